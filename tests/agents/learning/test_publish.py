"""Publishing: only finished runs with the right name, whole files, and the old seeds go when they should."""

import json
import shutil
from dataclasses import replace

import pytest

from agents.learning.actor import save_policy
from agents.learning.publish import publish
from agents.shipped.seeds import shipped_path
from elbow_gym.baselines.policy import Policy, pair, read_policy


@pytest.fixture
def run(tmp_path):
    folder = tmp_path / "runs" / "ppo_elbows2_seed0"
    folder.mkdir(parents=True)
    for source, target in zip(pair(shipped_path("ppo_elbows2", 0)), pair(folder / "best"), strict=True):
        shutil.copyfile(source, target)
    (folder / "result.json").write_text(json.dumps({"finished": True}))
    (folder / "evaluations.csv").write_text("steps [-]\n0\n")
    return folder


def places(tmp_path):
    return {name: tmp_path / name for name in ("baselines", "policies", "curves")}


def test_finished_run_is_copied_whole(run, tmp_path):
    assert publish([run], **places(tmp_path)) == ["ppo_elbows2_seed0"]
    copied = read_policy(tmp_path / "baselines/ppo_elbows2_seed0")
    assert copied.card == read_policy(run / "best").card
    assert (tmp_path / "curves/ppo_elbows2_seed0.csv").read_text() == (run / "evaluations.csv").read_text()


def test_label_goes_into_the_name(run, tmp_path):
    cloned = run.rename(run.with_name("ppo_cloned_elbows2_seed0"))
    assert publish([cloned], **places(tmp_path)) == ["ppo_cloned_elbows2_seed0"]


def altered_card(run, **entries):
    card = json.loads((run / "best.json").read_text())
    (run / "best.json").write_text(json.dumps(card | entries))
    return card


def test_policy_of_elbows_by_their_joints_is_published_under_them(run, tmp_path):
    policy = read_policy(run / "best")
    joints = replace(policy.card, environment=policy.card.environment | {"elbows": [4, 7]}, digest="")
    save_policy(Policy(joints, policy.weights), run / "best")
    named = run.rename(run.with_name("ppo_joints4_7_seed0"))
    assert publish([named], **places(tmp_path)) == ["ppo_joints4_7_seed0"]


@pytest.mark.parametrize("evaluation", [{}, {"return": float("nan")}, {"return": "high"}])
def test_policy_without_a_return_takes_no_place(run, tmp_path, evaluation):
    publish([run], **places(tmp_path))
    altered_card(run, evaluation=evaluation)
    with pytest.raises(ValueError, match=r"^return in .*best.json must be "):
        publish([run], **places(tmp_path))


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


def test_worse_policy_takes_no_better_ones_place_unless_allowed(run, tmp_path):
    shipped = places(tmp_path)
    publish([run], **shipped)
    card = altered_card(run)
    better = card["evaluation"]["return"]
    card["evaluation"]["return"] = better - 1.0
    altered_card(run, evaluation=card["evaluation"])
    for more in ({}, {"replace_seeds": True}):
        message = (
            rf"return must be at least the shipped ppo_elbows2_seed0's {better:.2f}, or --allow-worse be given, got"
        )
        with pytest.raises(ValueError, match=message):
            publish([run], **shipped, **more)
    card["training"]["seed"] = 1
    other = run.rename(run.with_name("ppo_elbows2_seed1"))
    (other / "best.json").write_text(json.dumps(card))
    with pytest.raises(ValueError, match="return must be at least the shipped ppo_elbows2_seed0's"):
        publish([other], **shipped, replace_seeds=True)
    assert read_policy(shipped["baselines"] / "ppo_elbows2_seed0").card.evaluation["return"] == better
    # Beside the better one a worse seed may stand.
    assert publish([other], **shipped) == ["ppo_elbows2_seed1"]
    publish([other], **shipped, replace_seeds=True, allow_worse=True)
    assert read_policy(shipped["baselines"] / "ppo_elbows2_seed1").card.evaluation["return"] == better - 1.0
    assert not list(shipped["baselines"].glob("*seed0*"))


def test_damaged_files_of_a_run_are_refused_by_name(run, tmp_path):
    (run / "evaluations.csv").write_text("steps [-]\n")
    with pytest.raises(ValueError, match="runs must hold evaluations, got none in"):
        publish([run], **places(tmp_path))
    (run / "best.safetensors").write_bytes(b"cut")
    with pytest.raises(ValueError, match=r"policy weights must be whole safetensors, got .*best\.safetensors"):
        publish([run], **places(tmp_path))
    (run / "best.safetensors").unlink()
    with pytest.raises(ValueError, match=r"got no .*best\.safetensors"):
        publish([run], **places(tmp_path))


def test_old_seeds_go_when_asked(run, tmp_path):
    old = places(tmp_path)
    publish([run], **old)
    for name in ("ppo_elbows2_seed7", "ppo_elbows1_seed7"):
        for path in pair(old["policies"] / name):
            path.write_text('{"evaluation": {"return": -99.0}}')
    publish([run], **old)
    assert (old["policies"] / "ppo_elbows2_seed7.json").exists()
    publish([run], **old, replace_seeds=True)
    assert not list(old["policies"].glob("ppo_elbows2_seed7*"))
    assert (old["policies"] / "ppo_elbows1_seed7.json").exists()


def test_best_seed_becomes_the_baseline_and_the_others_stand_beside_the_curves(run, tmp_path):
    card = json.loads((run / "best.json").read_text())
    runs = []
    for seed, merit in ((3, -30.0), (11, -20.0), (5, -40.0)):
        card["training"]["seed"], card["evaluation"]["return"] = seed, merit
        (run / "best.json").write_text(json.dumps(card))
        runs.append(shutil.copytree(run, run.with_name(f"ppo_elbows2_seed{seed}")))

    def published():
        folders = places(tmp_path).values()
        return [sorted(int(path.stem.partition("_seed")[2]) for path in f.glob("*.[jc]s*")) for f in folders]

    publish([runs[0], runs[2]], **places(tmp_path))
    assert published() == [[3], [5], [3, 5]]
    publish([runs[1]], **places(tmp_path))
    assert published() == [[11], [3, 5], [3, 5, 11]]
    publish([runs[1]], **places(tmp_path))
    assert published() == [[11], [3, 5], [3, 5, 11]]
    publish([runs[2]], **places(tmp_path), replace_seeds=True, allow_worse=True)
    assert published() == [[5], [], [5]]
    assert len(list((tmp_path / "baselines").iterdir())) == 2
