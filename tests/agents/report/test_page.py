"""The report's data are the recordings, its page needs nothing but itself, and its lineup is the benchmark's."""

import base64
import csv
import json
import re
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest

from agents.evaluation import players
from agents.evaluation.guest import Guest
from agents.evaluation.players import CLASSICAL, entries
from agents.report import colours, command, payload
from agents.report.command import RESULTS
from agents.report.page import page
from agents.report.runs import Visitor, play
from agents.style import CONTROLLER_COLOURS, CONTROLLER_MARKERS, ELBOW_COLOURS
from benchmarks.energy import pareto
from elbow_gym.kinematics import joint_positions


def unpacked(document, key):
    """Fields of a run as the page's script reads them."""
    plain = json.loads(re.search(r'<script type="application/json"[^>]*>(.*?)</script>', document, re.DOTALL)[1])
    packed = plain["runs"][key]
    raw, offset, fields = zlib.decompress(base64.b64decode(packed["data"])), 0, {}
    for name, kind, shape in packed["fields"]:
        fields[name] = np.frombuffer(raw, f"<{kind}", int(np.prod(shape)), offset).reshape(shape)
        offset += fields[name].nbytes
    assert offset == len(raw)
    return packed, fields


@pytest.mark.parametrize("key", ["pd_paper-1-paper", "ppo-2-on_target"])
def test_series_in_the_page_are_the_recordings(runs, document, key):
    recording = next(run for run in runs if run.key == key).series
    packed, fields = unpacked(document, key)
    period = packed["period"]
    assert period == pytest.approx(recording.time[1])
    np.testing.assert_allclose(fields["hand"], recording.hand[:, 0], rtol=1e-6)
    np.testing.assert_allclose(fields["target"], recording.target[:, 0], rtol=1e-6, atol=1e-7)
    energy = np.cumsum(fields["power"].astype(np.float64), axis=0) * period
    np.testing.assert_allclose(energy, recording.electrical_energy[:, 0], rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(fields["force"], recording.elbow_force[:, 0], rtol=1e-6)
    joints = joint_positions(recording.settings.parsed_arm, recording.q[:, 0])[:, :-1]
    np.testing.assert_allclose(payload.LENGTH_UNIT * fields["joints"], joints, atol=0.51 * payload.LENGTH_UNIT)
    assert packed["elbowJoints"] == list(recording.settings.elbow_joints)


def test_link_work_is_there_for_the_papers_figures_alone(runs, document):
    _, fields = unpacked(document, "pd_paper-0-paper")
    np.testing.assert_allclose(fields["work"], runs[4].series.link_work[:, 0], rtol=1e-6)
    assert "force" not in fields  # without an elbow there is none
    assert "work" not in unpacked(document, "ppo-2-paper")[1]


def test_a_hundred_runs_stay_under_eight_megabytes(document):
    sizes = [len(unpacked(document, key)[0]["data"]) for key in ("ppo-2-paper", "pd_paper-2-paper")]
    rest = len(document) - sum(len(found) for found in re.findall(r'"data":"([^"]*)"', document))
    assert rest + 100 * max(sizes) < 8e6


def test_same_runs_give_the_same_page(runs, document):
    assert page(runs, RESULTS) == document


class Loads(HTMLParser):
    """Collects what a page would have to fetch."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        self.found += [(tag, name, value) for name, value in attrs if name in ("src", "srcset", "data", "poster")]
        self.found += [(tag, name, value) for name, value in attrs if name == "href" and not value.startswith("#")]


def test_the_page_needs_nothing_but_itself(document):
    parser = Loads()
    parser.feed(document)
    assert parser.found == [("link", "href", "data:,")]
    assert re.findall(r"https?://(?!www\.w3\.org/2000/svg)", document) == []
    assert re.findall(r"\b(?:fetch|XMLHttpRequest|WebSocket|importScripts)\b|@import|url\(", document) == []
    assert "default-src 'none'" in document


def test_the_benchmarks_table_is_the_csv(document):
    with (RESULTS / "energy.csv").open(newline="", encoding="utf-8") as handle:
        rows = list(csv.DictReader(handle))
    shown = re.findall(r'<tr data-set="nominal".*?</tr>', document)
    assert len(shown) == len(rows)
    for row, line in zip(rows, shown, strict=True):
        assert f'data-value="{row["electrical_energy [J]"]}"' in line
        assert f'data-value="{row["return [-]"]}"' in line
        assert (f'data-run="ppo-{row["elbows"]}' in line) == (row["controller"] == "ppo" and row["elbows"] == "2")


def test_the_front_is_the_benchmarks_and_nothing_from_under_the_table():
    shown = payload.front(RESULTS / "optimal.csv")
    for elbows in (2, 1, 0):
        mine = [point for point in shown if point["bearing"] == str(elbows) and point["start"] == "paper"]
        places = sorted((point["error"], point["energy"]) for point in mine)
        np.testing.assert_allclose(places, pareto.front(elbows), rtol=1e-5)


def test_without_results_the_page_says_how_to_make_them(runs, tmp_path):
    text = page(runs, tmp_path)
    assert "python -m benchmarks energy" in text
    assert '"front":[]' in text


def test_contrast_is_wcags():
    assert colours.contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert colours.contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.01)  # the grey that just passes AA


@pytest.mark.parametrize("background", colours.BACKGROUNDS.values())
def test_colours_can_be_told_from_the_page(background):
    for colour in (*CONTROLLER_COLOURS.values(), *ELBOW_COLOURS.values()):
        shown = colours.legible(colour, background)
        assert colours.contrast(shown, background) >= 3.0
        if colours.contrast(colour, background) >= 3.0:
            assert shown == colour.lower()


def test_every_controller_of_the_benchmark_is_played(tmp_path, monkeypatch):
    expected = {(name, elbows) for name in (*CLASSICAL, "lqr") for elbows in (2, 1, 0)}
    assert {(entry.name, entry.elbows) for entry in entries()} >= expected
    monkeypatch.setattr(players, "OPTIMA", tmp_path)
    assert not [entry for entry in entries() if entry.name == "lqr"]


def test_policies_are_played_where_they_were_trained(monkeypatch):
    shipped = [
        "ppo_elbows1_seed0",
        "ppo_elbows1_seed3",
        "sac_cloned_elbows0_seed1",
        "ppo_random_seed0",
        "sac_table_seed2",
    ]
    monkeypatch.setattr(players, "shipped_policies", lambda: shipped)
    learned = [entry for entry in entries() if entry.name not in (*CLASSICAL, "lqr")]
    assert [(entry.name, entry.bearing, entry.env) for entry in learned] == [
        ("ppo", "1", "ElbowArm-v0"),
        ("ppo_random", "2", "ElbowArm-v0"),
        ("sac_cloned", "0", "ElbowArm-v0"),
        ("sac", "table", "ElbowArmTable-v0"),
    ]
    beside = [entry for entry in entries() if entry.bearing == "table" and entry.name in CLASSICAL]
    assert {entry.name for entry in beside} == set(CLASSICAL) - {"pd_paper"}
    assert all(entry.player().settings.table for entry in beside)


def test_every_marker_has_its_drawing(document):
    drawn = re.search(r"const MARKERS = \{(.*?)\};", document, re.DOTALL)[1]
    named = set(re.findall(r'^\s+"?([^":\s]+)"?: "M', drawn, re.MULTILINE))
    assert set(CONTROLLER_MARKERS.values()) <= named


def test_the_command_writes_the_file_whole_or_not_at_all(runs, document, tmp_path, monkeypatch):
    monkeypatch.setattr(command, "collect", lambda entries: runs)
    assert command.report(tmp_path / "all" / "report.html").read_text(encoding="utf-8") == document

    def broken(*_):
        raise ValueError("no")

    monkeypatch.setattr(command, "page", broken)
    with pytest.raises(ValueError, match="no"):
        command.report(tmp_path / "none" / "report.html")
    assert not list(tmp_path.glob("none/*"))


class Still:
    def predict(self, observation):
        return np.zeros((len(observation), 10))


def test_player_of_a_users_own_is_in_the_page_under_its_label(runs):
    visitor = Visitor(Guest("my <still> arm", Still()), 0)
    own = play(visitor, lambda _: None)
    document = page([*runs, *own], RESULTS)
    name = "own-my-still-arm"
    assert [run.key for run in own] == [f"{name}-0-paper", f"{name}-0-on_target"]
    _, fields = unpacked(document, f"{name}-0-paper")
    np.testing.assert_allclose(fields["hand"], own[0].series.hand[:, 0], rtol=1e-6)
    rows = re.findall(
        rf'<tr data-set="nominal" data-regime="(.)" data-bearing="0" data-controller="{name}".*', document
    )
    assert rows == ["A", "B", "C"]
    assert "my &lt;still&gt; arm</button>" in document
    assert f"--controller-{name}: #" in document
    plain = json.loads(re.search(r'<script type="application/json"[^>]*>(.*?)</script>', document, re.DOTALL)[1])
    assert plain["controllers"][name]["name"] == "my <still> arm"
