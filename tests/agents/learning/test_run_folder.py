"""Run folders: every file is read back as it was written, and appears whole or not at all."""

import json
from pathlib import Path

import numpy as np
import pytest

from agents.learning.evaluation import COLUMNS
from agents.learning.run_folder import RunFolder
from agents.shipped.seeds import load_policy
from elbow_gym.baselines.policy import read_policy

RECORD = {"algorithm": "ppo", "settings": {"gamma": 0.98, "hidden": [64, 64]}, "seed": 0}
ROW = [float(k) for k in range(len(COLUMNS))]


@pytest.fixture
def folder(tmp_path):
    return RunFolder(tmp_path / "runs" / "ppo_elbows2_seed0")


@pytest.fixture
def policy():
    return load_policy("ppo", elbows=2, seed=0)


def write_checkpoint(folder, steps, buffer=None):
    def save_model(path):
        path.write_bytes(b"model of %d" % steps)

    folder.write_checkpoint(steps, save_model, buffer, {"generator": (1, "state")}, {"steps": steps})


def files(folder):
    return sorted(path.relative_to(folder.path).as_posix() for path in folder.path.rglob("*") if path.is_file())


def test_new_folder_holds_nothing(folder):
    assert (folder.result(), folder.best(), folder.checkpoint(), folder.evaluations()) == (None, None, None, [])
    assert not folder.path.exists()


def test_files_are_read_as_they_were_written(folder, policy):
    folder.open(RECORD, resume=False)
    folder.write_result({"finished": True, "steps": 7})
    folder.write_evaluations([ROW, [value + 0.5 for value in ROW]])
    folder.write_best(policy)
    assert folder.result() == {"finished": True, "steps": 7}
    assert folder.evaluations() == [ROW, [value + 0.5 for value in ROW]]
    assert folder.evaluations(last=0) == [ROW]
    assert folder.best().card == policy.card
    assert folder.best_size() == sum((folder.path / f"best.{end}").stat().st_size for end in ("json", "safetensors"))
    assert files(folder) == ["best.json", "best.safetensors", "evaluations.csv", "result.json", "run.json"]
    assert (folder.path / "evaluations.csv").read_text().startswith("steps [-],training_seconds [s],wall_seconds [s],")


def test_folder_is_named_as_its_run_also_from_inside(folder, monkeypatch):
    folder.open(RECORD, resume=False)
    monkeypatch.chdir(folder.path)
    assert RunFolder(Path()).name == "ppo_elbows2_seed0"


def test_run_is_resumed_with_the_same_record_alone(folder):
    folder.open(RECORD, resume=False)
    folder.open(RECORD, resume=True)
    with pytest.raises(ValueError, match="output must be free of earlier runs, or --resume be given, got"):
        folder.open(RECORD, resume=False)
    with pytest.raises(ValueError, match=r"settings\.gamma of a resumed run must be 0\.98 as in .*run\.json, got 0\.9"):
        folder.check({**RECORD, "settings": {"gamma": 0.9, "hidden": [64, 64]}}, resume=True)
    assert json.loads((folder.path / "run.json").read_text()) == RECORD
    folder.write_result({})
    (folder.path / "run.json").unlink()
    with pytest.raises(ValueError, match=r"output must be free of runs without run\.json, got"):
        folder.open(RECORD, resume=True)


def test_checkpoint_is_read_as_it_was_written(folder):
    arrays = {"pos": np.array(2), "full": np.array(False), "rewards": np.arange(6.0).reshape(3, 2)}
    write_checkpoint(folder, 512, arrays)
    checkpoint = folder.checkpoint()
    assert checkpoint.progress() == {"steps": 512}
    assert checkpoint.state() == {"generator": (1, "state")}
    assert checkpoint.model.read_bytes() == b"model of 512"
    stored = dict(checkpoint.buffer())
    assert list(stored) == list(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(stored[name], array)
    assert files(folder) == [
        f"checkpoint_000000000512/{name}" for name in ("model.zip", "progress.json", "replay_buffer.npz", "state.pkl")
    ]


def test_latest_checkpoint_is_kept_and_one_of_the_same_steps_stays(folder):
    write_checkpoint(folder, 999)
    write_checkpoint(folder, 1_000)
    (folder.path / "checkpoint_000000001000" / "model.zip").write_bytes(b"first")
    write_checkpoint(folder, 1_000)
    assert [path.name for path in folder.path.iterdir()] == ["checkpoint_000000001000"]
    assert folder.checkpoint().model.read_bytes() == b"first"
    assert dict(folder.checkpoint().buffer()) == {}


def test_checkpoint_that_fails_leaves_the_former_and_no_rest(folder):
    write_checkpoint(folder, 512)

    def full(path):
        path.write_bytes(b"half")
        raise OSError("disk is full")

    with pytest.raises(OSError, match="disk is full"):
        folder.write_checkpoint(1024, full, None, {}, {"steps": 1024})
    assert [path.name for path in folder.path.iterdir()] == ["checkpoint_000000000512"]
    assert folder.checkpoint().progress() == {"steps": 512}


def test_rest_of_a_killed_checkpoint_is_not_read_and_goes_with_the_next(folder):
    write_checkpoint(folder, 512)
    (folder.path / ".checkpoint_000000001024-killed").mkdir()
    assert folder.checkpoint().progress() == {"steps": 512}
    write_checkpoint(folder, 1024)
    assert [path.name for path in folder.path.iterdir()] == ["checkpoint_000000001024"]


def test_policy_whose_files_do_not_fit_each_other_is_none(folder, policy):
    folder.write_best(policy)
    card = (folder.path / "best.json").read_text()
    (folder.path / "best.json").write_text(card.replace(policy.card.digest, "0" * 64))
    assert folder.best() is None
    (folder.path / "best.json").unlink()
    assert folder.best() is None


def test_copies_are_whole_and_equal(folder, policy, tmp_path):
    folder.write_evaluations([ROW])
    folder.write_best(policy)
    folder.copy_best(tmp_path / "policies" / "copied")
    folder.copy_evaluations(tmp_path / "curves" / "copied.csv")
    assert read_policy(tmp_path / "policies" / "copied").card == folder.best().card
    assert (tmp_path / "curves" / "copied.csv").read_bytes() == (folder.path / "evaluations.csv").read_bytes()
    assert sorted(path.name for path in (tmp_path / "policies").iterdir()) == ["copied.json", "copied.safetensors"]
