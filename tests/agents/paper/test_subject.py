"""The paper's cases on another arm: one pose, one circle in reach, and nothing compared with the paper's numbers."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from agents.paper import cases as reproduce
from agents.paper.claims import OTHER_ARM
from agents.paper.figures import figures
from agents.paper.subject import Subject, cases_in_words
from agents.paper.table_cases import lifts, start_pose
from agents.style import joints_in_words, leaning_in_words, pyplot
from elbow_gym import paper_arm
from elbow_gym.kinematics import hand_position, joint_positions
from tests.support.arms import six_joint_arm
from tests.support.recordings import made_up


@pytest.fixture
def path(tmp_path):
    """File of a six-joint arm whose nominal pose is off the table."""
    arm = six_joint_arm()
    pose = np.array(arm.nominal_pose)
    pose[1] -= 0.2
    file = tmp_path / "mine.json"
    file.write_text(json.dumps(replace(arm, nominal_pose=tuple(pose)).to_dict()), encoding="utf-8")
    return file


def test_the_papers_arm_has_the_papers_cases():
    subject = Subject()
    assert subject.cases == (2, 1, 0)
    assert [subject.arguments(elbows) for elbows in subject.cases] == [{"elbows": 2}, {"elbows": 1}, {"elbows": 0}]
    assert (subject.arm, subject.published) == (paper_arm(), True)


def test_all_cases_of_another_arm_start_on_the_table_and_follow_one_circle(path):
    subject = Subject((4,), path)
    assert (subject.cases, subject.published) == ((1, 0), False)
    settings = [reproduce.settings_of(elbows, "paper", subject=subject) for elbows in subject.cases]
    assert [one.elbow_joints for one in settings] == [(4,), ()]
    assert settings[0].parsed_circle == settings[1].parsed_circle == subject.circle
    assert settings[0].parsed_arm == settings[1].parsed_arm == subject.arm
    assert joint_positions(subject.arm, np.array(subject.arm.nominal_pose))[3, 2] == pytest.approx(0.0, abs=1e-9)
    assert "mine.json with 6 joints, elbows on joint 4, circle of" in subject.described()


def test_the_papers_arm_on_other_elbows_is_not_the_papers():
    subject = Subject((3, 5, 8))
    assert (subject.cases, subject.published) == ((3, 2, 1, 0), False)
    assert [subject.arguments(elbows)["elbows"] for elbows in subject.cases] == [(3, 5, 8), (3, 5), (3,), ()]


def test_no_elbow_and_an_elbow_that_the_arm_has_not_are_refused(path):
    with pytest.raises(
        ValueError, match="elbows must be at least one, since arms with and without are compared, got 0"
    ):
        Subject(0)
    with pytest.raises(ValueError, match="elbows must be joints 3 to 6"):
        Subject(2, path)


def test_words():
    assert [joints_in_words(joints) for joints in ((4,), (3, 5, 8))] == ["joint 4", "joints 3, 5 and 8"]
    assert [leaning_in_words(joints) for joints in ((), (4, 7))] == ["no elbow", "elbows on joints 4 and 7"]
    assert cases_in_words((3, 2, 1, 0)) == "3 / two / one / no elbow"


def standing(settings, level):
    """A made-up run of another arm: the hand level mm under the target, every joint at the power `level`."""
    time = np.linspace(0.0, 5.0, 101)
    target = settings.parsed_circle.position(settings.parsed_circle.angle(time, 0.0))[:, None]
    ramp = level * np.repeat(time[:, None, None], 6, axis=2)
    return made_up(
        settings,
        time,
        joints=6,
        hand=target - [0.0, 0.0, 1e-3 * level],
        target=target,
        electrical_energy=ramp,
        link_work=ramp / level,
    )


def test_a_reproduction_on_another_arm_names_it_and_compares_with_nothing(path, tmp_path, monkeypatch, capsys):
    subject = Subject((4,), path)

    def play_all(jobs, progress):
        runs = {key: standing(settings, 2.0 - key[0]) for key, settings in jobs.items()}
        return {key: reproduce.Played(reproduce.measure(run), run) for key, run in runs.items()}

    monkeypatch.setattr(reproduce, "play_all", play_all)
    monkeypatch.setattr(reproduce, "draw", lambda *_: None)
    found = reproduce.reproduce(tmp_path / "out", subject=subject)
    assert set(found.numbers) == {1, 0}
    with (tmp_path / "out" / "numbers.csv").open(newline="", encoding="utf-8") as handle:
        rows = list(csv.DictReader(handle))
    assert [row["elbows"] for row in rows] == ["1", "0"]
    assert not [name for name in rows[0] if "published" in name or "difference" in name]
    assert "force_mean_4 [N]" in rows[0]
    text = (tmp_path / "out" / "verdict.md").read_text(encoding="utf-8")
    assert subject.described() in text
    assert OTHER_ARM in text
    assert "Two values stand for one / no elbow." in text
    assert "FAILS" not in text
    # All joints save the same by the elbow, so that joint 2 saves no more than joint 3.
    assert "**Does not hold here** (toward the base)" in text
    assert "(+" not in capsys.readouterr().out
    with pytest.raises(
        ValueError, match=r"--publish must be given for the paper's arm on two elbows alone, got mine\.json"
    ):
        reproduce.reproduce(tmp_path / "other", publish=True, subject=subject)
    assert not (tmp_path / "other").exists()


@pytest.mark.slow
def test_figures_of_another_arm_have_its_joints_and_cases(path):
    subject = Subject((4,), path)
    runs = {
        elbows: standing(reproduce.settings_of(elbows, "24 V", subject=subject), 2.0 - elbows)
        for elbows in subject.cases
    }
    names = []
    for name, figure in figures(runs):
        names.append(name)
        if name == "paper_cases":
            assert [axes.get_title() for axes in figure.axes[:2]] == ["one elbow", "no elbow"]
            # The hand keeps its height, and the views from the side are not a line.
            low, high = figure.axes[2].get_ylim()
            assert high - low > 0.05
        pyplot().close(figure)
    assert names == [*(f"fig{k:02d}" for k in range(1, 18)), "paper_cases"]


def test_another_arm_is_lifted_off_the_table_by_a_third_of_a_link(path):
    subject = Subject((4,), path)
    length = float(subject.arm.of_links("length")[1:].mean())
    assert lifts(subject) == {"joint 4": (0.0,), "clear": (pytest.approx(length / 3.0),)}
    pose = start_pose(subject.arm, (4,), lifts(subject)["clear"])
    assert joint_positions(subject.arm, pose)[3, 2] == pytest.approx(length / 3.0)
    assert hand_position(subject.arm, pose)[2] >= 0.0
