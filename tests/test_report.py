"""The report's data are the recordings, and its page shows them: driven in a real browser where there is one."""

import base64
import csv
import json
import re
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest
from browser import chromium, emulate, keep_picture

from agents.evaluation import players
from agents.evaluation.metrics import metrics
from agents.evaluation.players import CLASSICAL, Entry, entries
from agents.evaluation.recording import Recording
from agents.paper.cases import measure, settings_of
from agents.paper.figures import write_series
from agents.report import colours, command, payload
from agents.report.command import RESULTS
from agents.report.page import page
from agents.report.runs import Run, play
from agents.style import CONTROLLER_COLOURS, CONTROLLER_MARKERS, ELBOW_COLOURS
from benchmarks.energy import pareto
from elbow_gym.kinematics import joint_positions
from elbow_gym.task.circle import Circle


def synthetic(elbows, start):
    """A made-up run whose numbers differ between joints, cases, starts and instants; the arm stands still."""
    settings = settings_of(elbows, "paper", control_frequency=100.0, timestep=0.002, start=start)
    time = np.linspace(0.0, 5.0, 501)
    target = Circle().position(Circle().angle(time, 0.0))[:, None]
    factor = (3.0 - elbows) * (2.0 if start == "paper" else 1.0)
    ramp = np.repeat((time**2)[:, None, None], 10, axis=2) * np.arange(1.0, 11.0) * factor
    pose = np.broadcast_to(settings.parsed_arm.nominal_pose, (501, 1, 10))
    zeros = np.zeros_like(ramp)
    return Recording(
        settings,
        (0,),
        time,
        q=pose,
        q_dot=zeros,
        hand=target - np.array([0.0, 0.001, 0.01 * (1 + factor)]) * (1.0 + 0.2 * np.sin(time))[:, None, None],
        target=target,
        electrical_energy=ramp,
        drawn_energy=ramp,
        copper_loss=zeros,
        link_work=0.01 * ramp,
        elbow_force=(time - 1.0)[:, None, None] * np.arange(1.0, 1.0 + elbows),
        below_table=np.zeros((501, 1)),
        voltage=zeros,
        current=zeros,
    )


def made_up(controller, elbows, start):
    recording = synthetic(elbows, start)
    regimes = {"paper": {"A": 0.0, "B": 2.0}, "on_target": {"C": 0.0}}[start]
    figures = {
        name: {key: float(value[0]) for key, value in metrics(recording, since).items()}
        for name, since in regimes.items()
    }
    return Run(controller, str(elbows), start, recording, figures, measure(recording))


@pytest.fixture(scope="module")
def runs():
    """The paper's cases, made up, and PPO's two runs as they are."""
    paper = [made_up("pd_paper", elbows, start) for elbows in (2, 1, 0) for start in ("paper", "on_target")]
    clipped = [made_up("pd", elbows, "paper") for elbows in (2, 1, 0)]
    told = []
    entry = Entry("ppo", 2)
    learned = play(entry, told.append)
    assert sum(told) == 2 * entry.player().work
    return [*paper, *clipped, *learned]


@pytest.fixture(scope="module")
def document(runs):
    return page(runs, RESULTS)


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


@pytest.fixture(scope="module")
def browser():
    with chromium() as driver:
        yield driver


@pytest.fixture
def opened(browser, document, tmp_path_factory):
    """The page in the browser, all of its parts ready."""
    path = tmp_path_factory.getbasetemp() / "report.html"
    if not path.exists():
        path.write_text(document, encoding="utf-8")
    emulate(browser)
    browser.get(path.as_uri())
    wait(browser, "return document.documentElement.dataset.ready === 'true'")
    return browser


def wait(browser, condition):
    from selenium.webdriver.support.wait import WebDriverWait

    WebDriverWait(browser, 20, poll_frequency=0.05).until(lambda driver: driver.execute_script(condition))


def text(browser, selector):
    return browser.execute_script("return document.querySelector(arguments[0]).textContent", selector)


def number(browser, quantity, slot="a"):
    written = text(browser, f'#numbers [data-quantity="{quantity}"][data-slot={slot}]')
    return float(written.replace("\N{MINUS SIGN}", "-"))


def press(browser, selector, *keys):
    browser.find_element("css selector", selector).send_keys(*keys)


def test_it_opens_without_errors_and_without_requests(opened):
    assert [entry for entry in opened.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")] == []
    assert opened.execute_script("return performance.getEntriesByType('resource').map(e => e.name)") == []


@pytest.fixture(scope="module")
def rows(runs, tmp_path_factory):
    """The series of the paper's cases as `python -m agents reproduce` writes them, by elbows and time."""
    cases = {int(run.bearing): run.series for run in runs if run.controller == "pd_paper" and run.start == "paper"}
    path = write_series(tmp_path_factory.mktemp("series") / "series.csv", cases)
    with path.open(newline="", encoding="utf-8") as handle:
        return {(int(row["elbows"]), round(float(row["time [s]"]), 2)): row for row in csv.DictReader(handle)}


def test_the_slider_shows_the_series_values(opened, rows):
    from selenium.webdriver.common.keys import Keys

    press(opened, "#time", Keys.HOME, *[Keys.ARROW_RIGHT] * 7)
    assert text(opened, "#clock") == "0.07 s"
    seen = []
    for keys, time in (((), 0.07), ((Keys.END,), 5.0), ((Keys.ARROW_LEFT,), 4.99)):
        press(opened, "#time", *keys)
        for slot, elbows in (("a", 2), ("b", 0)):
            row = {name: float(value or "nan") for name, value in rows[elbows, time].items()}
            energy = sum(row[f"electrical_energy_{joint} [J]"] for joint in range(1, 11))
            away = [row[f"hand_{axis} [m]"] - row[f"target_{axis} [m]"] for axis in "xyz"]
            assert number(opened, "energy", slot) == pytest.approx(energy, rel=1e-4, abs=6e-4)
            assert number(opened, "error", slot) == pytest.approx(1e3 * np.linalg.norm(away), rel=1e-3)
            assert number(opened, "height", slot) == pytest.approx(1e3 * away[2], rel=1e-3)
        row = rows[2, time]
        assert number(opened, "force-4") == pytest.approx(float(row["elbow_force_4 [N]"]), abs=6e-4)
        assert number(opened, "force-7") == pytest.approx(float(row["elbow_force_7 [N]"]), abs=6e-4)
        seen.append(number(opened, "energy"))
    assert len(set(seen)) == 3
    wait(opened, "return document.getElementById('announcement').textContent.startsWith('At 4.99 s')")


def test_counting_from_two_seconds_takes_off_what_was_spent_before(opened, rows):
    opened.execute_script("document.querySelector('input[name=since][value=\"2\"]').click()")
    press(opened, "#time", "\ue010")  # End
    spent = [sum(float(rows[2, t][f"electrical_energy_{joint} [J]"]) for joint in range(1, 11)) for t in (2.0, 5.0)]
    assert number(opened, "energy") == pytest.approx(spent[1] - spent[0], rel=1e-4)
    press(opened, "#time", "\ue011")  # Home
    assert text(opened, "#clock") == "2.00 s"


def test_a_point_of_the_front_puts_its_run_into_the_replay(opened):
    before = opened.execute_script("return document.getElementById('scene').toDataURL()")
    opened.execute_script("document.getElementById('runs').scrollIntoView()")
    wait(opened, "return document.querySelector('.point[data-run=\"ppo-2-paper\"]') !== null")
    press(opened, '.point[data-run="ppo-2-paper"]', "\ue007")  # Enter
    wait(opened, "return document.getElementById('name-a').textContent === 'A: PPO, 24 V, two elbows'")
    pressed = "return [...document.querySelectorAll('.point[aria-pressed=true]')].map(p => p.dataset.run)"
    assert opened.execute_script(pressed) == ["ppo-2-paper"]
    assert opened.execute_script("return document.getElementById('scene').toDataURL()") != before
    # The arrow keys go on to the next point, which takes over the place in the order of Tab.
    press(opened, '.point[data-run="ppo-2-paper"]', "\ue014", "\ue00d")  # right, Space
    wait(opened, "return document.getElementById('name-a').textContent.startsWith('A: PD')")


def test_the_arrow_keys_turn_the_view(opened):
    picture = "return document.getElementById('scene').toDataURL()"
    before = opened.execute_script(picture)
    press(opened, "#scene", "\ue012", "\ue012")  # left
    assert opened.execute_script(picture) != before
    press(opened, "#scene", "\ue014", "\ue014")  # right, back again
    assert opened.execute_script(picture) == before


def test_playing_moves_the_time_until_it_is_stopped(opened):
    press(opened, "#play", "\ue00d")  # Space
    assert text(opened, "#play") == "Pause"
    wait(opened, "return Number(document.getElementById('time').value) > 2.1")
    press(opened, "#play", "\ue00d")
    assert text(opened, "#play") == "Play"
    stopped = "return document.getElementById('time').value"
    before = opened.execute_script(stopped)
    opened.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert opened.execute_script(stopped) == before


def test_with_reduced_motion_playing_goes_in_steps(opened):
    emulate(opened, prefers_reduced_motion="reduce")
    opened.execute_script(
        "window.seen = [2];"
        "const keep = () => window.seen.push(Number(document.getElementById('time').value));"
        "new MutationObserver(keep).observe(document.getElementById('clock'), {childList: true});"
    )
    press(opened, "#play", "\ue00d")
    wait(opened, "return window.seen.length > 3")
    press(opened, "#play", "\ue00d")
    steps = np.diff(list(dict.fromkeys(opened.execute_script("return window.seen"))))
    # Of half a second; the first frame only starts the clock.
    assert steps.size > 1
    assert (steps[1:] > 0.4).all()


def test_every_control_has_a_name_for_a_screen_reader(opened):
    opened.execute_cdp_cmd("Accessibility.enable", {})
    nodes = opened.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    roles = ("button", "slider", "combobox", "radio", "checkbox", "image", "img", "region", "link")
    controls = [node for node in nodes if node.get("role", {}).get("value") in roles and not node.get("ignored")]
    assert len(controls) > 60
    assert [node for node in controls if not node.get("name", {}).get("value")] == []


def test_all_figures_of_the_paper_are_drawn_and_follow_the_slider(opened):
    assert opened.execute_script("return document.querySelectorAll('#panels > figure').length") == 25
    opened.execute_script("document.getElementById('figure-25').scrollIntoView()")
    wait(opened, "return document.querySelectorAll('#figure-25 .curve').length === 3")
    place = "return document.querySelector('#figure-25 .cursor').getAttribute('x1')"
    before = opened.execute_script(place)
    press(opened, "#time", "\ue010")
    assert opened.execute_script(place) != before
    opened.execute_script("document.querySelector('input[name=case][value=\"0\"]').click()")
    wait(opened, "return document.querySelectorAll('#figure-25 .curve').length === 2")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 375])
def test_it_fits_the_screen_in_both_schemes(opened, width, scheme):
    emulate(opened, width, 800, prefers_color_scheme=scheme)
    wait(opened, f"return innerWidth === {width} && document.documentElement.scrollWidth <= {width}")
    ground = opened.execute_script("return getComputedStyle(document.documentElement).backgroundColor")
    brightness = np.mean([int(channel) for channel in re.findall(r"\d+", ground)[:3]])
    assert (brightness > 128) == (scheme == "light")
    keep_picture(opened, f"report_{width}_{scheme}.png")


def test_the_benchmarks_table_fits_1280_pixels_with_every_row_and_its_lines_run_through(opened):
    opened.execute_script(
        "for (const filter of document.querySelectorAll('#filters select')) {"
        "  if (filter.name !== 'set') filter.value = '';"
        "  filter.dispatchEvent(new Event('change'));"
        "}"
    )
    frame, table, rows = opened.execute_script(
        "const frame = document.querySelector('#benchmark .scroll');"
        "const rows = [...frame.querySelectorAll('tbody tr:not([hidden])')];"
        "const edge = cell => [getComputedStyle(cell).borderTopWidth, cell.getBoundingClientRect().top];"
        "return [frame.clientWidth, frame.scrollWidth, rows.map(row => [edge(row.cells[0]), edge(row.cells[1])])];"
    )
    assert table <= frame
    assert len(rows) > 50
    for first, second in rows:
        assert first == second
        assert first[0] == "1px"
