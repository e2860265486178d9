"""Publishing: only finished runs with the right name, whole files, and the old seeds go when they should."""

import json
import shutil

import pytest

from agents.learning.publish import publish
from agents.policy import SHIPPED, load_policy, pair


@pytest.fixture
def run(tmp_path):
    folder = tmp_path / "runs" / "ppo_elbows2_seed0"
    folder.mkdir(parents=True)
    for source, target in zip(pair(SHIPPED / "ppo_elbows2_seed0"), pair(folder / "best"), strict=True):
        shutil.copyfile(source, target)
    (folder / "result.json").write_text(json.dumps({"finished": True}))
    (folder / "evaluations.csv").write_text("steps [-]\n0\n")
    return folder


def places(tmp_path):
    return {"policies": tmp_path / "policies", "curves": tmp_path / "curves"}


def test_finished_run_is_copied_whole(run, tmp_path):
    assert publish([run], **places(tmp_path)) == ["ppo_elbows2_seed0"]
    copied = load_policy(tmp_path / "policies/ppo_elbows2_seed0")
    assert copied.card == load_policy(run / "best").card
    assert (tmp_path / "curves/ppo_elbows2_seed0.csv").read_text() == (run / "evaluations.csv").read_text()


def test_label_goes_into_the_name(run, tmp_path):
    cloned = run.rename(run.with_name("ppo_cloned_elbows2_seed0"))
    assert publish([cloned], **places(tmp_path)) == ["ppo_cloned_elbows2_seed0"]


def test_unfinished_misnamed_and_large_runs_are_refused(run, tmp_path, monkeypatch):
    (run / "result.json").write_text(json.dumps({"finished": False}))
    with pytest.raises(ValueError, match="runs must be finished trainings, got"):
        publish([run], **places(tmp_path))
    (run / "result.json").write_text(json.dumps({"finished": True}))
    monkeypatch.setattr("agents.learning.publish.LARGEST", 1000)
    with pytest.raises(ValueError, match="a policy must have at most 1000 bytes, got"):
        publish([run], **places(tmp_path))
    wrong = run.rename(run.with_name("ppo_elbows1_seed0"))
    with pytest.raises(
        ValueError, match=r"runs must be named ppo\[_LABEL\]_elbows2_seed0 as what they hold, got ppo_elb"
    ):
        publish([wrong], **places(tmp_path))
    assert not (tmp_path / "policies").exists()


def test_old_seeds_go_when_asked(run, tmp_path):
    old = places(tmp_path)
    publish([run], **old)
    for name in ("ppo_elbows2_seed7", "ppo_elbows1_seed7"):
        for path in pair(old["policies"] / name):
            path.write_text("old")
    publish([run], **old)
    assert (old["policies"] / "ppo_elbows2_seed7.json").exists()
    publish([run], **old, replace_seeds=True)
    assert not list(old["policies"].glob("ppo_elbows2_seed7*"))
    assert (old["policies"] / "ppo_elbows1_seed7.json").exists()
