"""Run folders: every file is read back as it was written, and appears whole or not at all."""

import errno
import json
import re
import shutil
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
def opened(folder):
    folder.open(RECORD, resume=False)
    return folder


@pytest.fixture
def policy():
    return load_policy("ppo", elbows=2, seed=0)


def write_checkpoint(folder, steps, buffer=None, best=None):
    state, progress = {"generator": (1, "state")}, {"steps": steps}
    folder.write_checkpoint(steps, b"model of %d" % steps, buffer, state, progress, best)


def checkpoints(folder):
    return sorted(int(path.name.removeprefix("checkpoint_")) for path in folder.path.glob("checkpoint_*"))


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


def test_checkpoint_is_read_as_it_was_written(opened, policy):
    arrays = {"pos": np.array(2), "full": np.array(False), "rewards": np.arange(6.0).reshape(3, 2)}
    write_checkpoint(opened, 512, arrays, policy)
    checkpoint = opened.checkpoint()
    assert checkpoint.progress() == {"steps": 512}
    assert checkpoint.state() == {"generator": (1, "state")}
    assert checkpoint.model.read_bytes() == b"model of 512"
    assert checkpoint.best().card == policy.card
    stored = dict(checkpoint.buffer())
    assert list(stored) == list(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(stored[name], array)
    names = ("best.json", "best.safetensors", "checksums.json", "model.zip", "progress.json", "replay_buffer.npz")
    assert files(opened) == [*(f"checkpoint_000000000512/{name}" for name in (*names, "state.pkl")), "run.json"]


def test_two_checkpoints_are_kept_and_a_whole_one_of_the_same_steps_stays(opened):
    for steps in (512, 999, 1_000):
        write_checkpoint(opened, steps)
    made = opened.checkpoint().model.stat().st_mtime_ns
    write_checkpoint(opened, 1_000)
    assert checkpoints(opened) == [999, 1_000]
    assert opened.checkpoint().model.stat().st_mtime_ns == made
    assert dict(opened.checkpoint().buffer()) == {}


NAMES = ("checksums.json", "model.zip", "progress.json", "replay_buffer.npz", "state.pkl", "best.json")


def cut(path):
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


def flip(path):
    whole = bytearray(path.read_bytes())
    whole[len(whole) // 2] ^= 1
    path.write_bytes(whole)


@pytest.mark.parametrize("damage", [Path.unlink, cut, flip], ids=["missing", "cut", "flipped"])
@pytest.mark.parametrize("name", NAMES)
def test_damaged_checkpoint_is_named_and_the_one_before_taken(opened, policy, capsys, name, damage):
    for steps in (512, 1024):
        write_checkpoint(opened, steps, {"pos": np.arange(9)}, policy)
    assert capsys.readouterr().err == ""
    bad = opened.path / "checkpoint_000000001024" / name
    damage(bad)
    assert opened.checkpoint().progress() == {"steps": 512}
    # A checksum that is damaged puts the file in doubt that it is of.
    said = capsys.readouterr().err
    assert said.endswith(" is damaged or missing; going on from checkpoint_000000000512\n")
    assert str(bad) in said or (name == "checksums.json" and str(bad.parent) in said)


def test_checkpoint_whose_checksums_lack_a_file_is_damaged(opened):
    write_checkpoint(opened, 512)
    sums = json.loads((opened.checkpoint().path / "checksums.json").read_text())
    for name in ("model.zip", "progress.json", "state.pkl"):
        fewer = {entry: value for entry, value in sums.items() if entry != name}
        (opened.path / "checkpoint_000000000512" / "checksums.json").write_text(json.dumps(fewer))
        with pytest.raises(ValueError, match=f"got damaged or missing .*{name}"):
            opened.checkpoint()


def test_run_whose_checkpoints_are_all_damaged_is_refused_and_not_started_anew(opened):
    for steps in (512, 1024):
        write_checkpoint(opened, steps)
        flip(opened.path / f"checkpoint_{steps:012}" / "state.pkl")
    with pytest.raises(ValueError, match=r"a checkpoint of the run must be whole, got .*1024/state.pkl, .*512/state.p"):
        opened.checkpoint()


def test_damaged_checkpoints_go_when_the_training_comes_past_them(opened):
    for steps in (512, 1024):
        write_checkpoint(opened, steps)
    cut(opened.path / "checkpoint_000000001024" / "state.pkl")
    write_checkpoint(opened, 768)
    assert checkpoints(opened) == [512, 768]
    cut(opened.path / "checkpoint_000000000768" / "state.pkl")
    write_checkpoint(opened, 768)
    assert opened.checkpoint().progress() == {"steps": 768}


def test_checkpoint_that_fails_leaves_the_former_and_no_rest(opened, monkeypatch):
    write_checkpoint(opened, 512)

    def full(path, **_):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("numpy.savez", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*checkpoint_000000001024'"):
        write_checkpoint(opened, 1024, {})
    assert sorted(path.name for path in opened.path.iterdir()) == ["checkpoint_000000000512", "run.json"]
    assert opened.checkpoint().progress() == {"steps": 512}


def test_rest_of_a_killed_checkpoint_is_not_read_and_goes_with_the_next(opened):
    write_checkpoint(opened, 512)
    (opened.path / ".checkpoint_000000001024-killed").mkdir()
    (opened.path / ".best-killed.json").write_text("half")
    assert opened.checkpoint().progress() == {"steps": 512}
    write_checkpoint(opened, 1024)
    assert sorted(path.name for path in opened.path.iterdir()) == [
        "checkpoint_000000000512",
        "checkpoint_000000001024",
        "run.json",
    ]


def test_nothing_is_written_where_the_folder_has_gone(opened, policy):
    shutil.rmtree(opened.path)
    for write in (
        lambda: write_checkpoint(opened, 512),
        lambda: opened.write_best(policy),
        lambda: opened.write_evaluations([ROW]),
        lambda: opened.write_result({}),
    ):
        with pytest.raises(FileNotFoundError, match=r"the run's folder is gone, or its run.json: '.*elbows2_seed0'"):
            write()
    assert not opened.path.exists()


@pytest.mark.parametrize("damage", [cut, lambda path: path.write_text("[]")], ids=["cut", "list"])
def test_damaged_record_and_result_are_named(opened, capsys, damage):
    opened.write_result({"finished": True})
    for name in ("result.json", "run.json"):
        (opened.path / name).write_text(json.dumps({"nested": {"a": 1}}))
        cut(opened.path / name)
    assert opened.result() is None
    assert re.search(r"result\.json must hold JSON .* it counts as missing", capsys.readouterr().err)
    with pytest.raises(ValueError, match=r"run\.json must hold JSON as it was written, got a damaged file"):
        opened.check(RECORD, resume=True)


def test_damaged_evaluations_are_named(opened):
    opened.write_evaluations([ROW])
    path = opened.path / "evaluations.csv"
    for text, message in (("a,b\n1,\n", "numbers under a header"), ("a,b\n1\n", "2 numbers in each"), ("", "header")):
        path.write_text(text)
        with pytest.raises(ValueError, match=f"evaluations.csv must (hold|have) .*{message}"):
            opened.evaluations()


@pytest.mark.parametrize("damage", [Path.unlink, cut], ids=["missing", "cut"])
@pytest.mark.parametrize("name", ["best.json", "best.safetensors"])
def test_best_policy_that_was_lost_comes_back_from_the_checkpoint(opened, policy, capsys, name, damage):
    opened.write_best(policy)
    write_checkpoint(opened, 512, best=policy)
    assert opened.restore_best(opened.checkpoint()).card == policy.card
    assert capsys.readouterr().err == ""
    damage(opened.path / name)
    assert opened.restore_best(opened.checkpoint()).card == policy.card
    assert opened.best().card == policy.card
    assert "; written again from checkpoint_000000000512" in capsys.readouterr().err


def test_best_policy_whose_files_do_not_fit_each_other_is_refused(opened, policy):
    opened.write_best(policy)
    card = (opened.path / "best.json").read_text()
    (opened.path / "best.json").write_text(card.replace(policy.card.digest, "0" * 64))
    with pytest.raises(ValueError, match="weights and card must be those of the digest"):
        opened.best()


def test_copies_are_whole_and_equal(opened, policy, tmp_path):
    folder = opened
    folder.write_evaluations([ROW])
    folder.write_best(policy)
    folder.copy_best(tmp_path / "policies" / "copied")
    folder.copy_evaluations(tmp_path / "curves" / "copied.csv")
    assert read_policy(tmp_path / "policies" / "copied").card == folder.best().card
    assert (tmp_path / "curves" / "copied.csv").read_bytes() == (folder.path / "evaluations.csv").read_bytes()
    assert sorted(path.name for path in (tmp_path / "policies").iterdir()) == ["copied.json", "copied.safetensors"]
