"""Training runs end to end on a small budget, keep the best policy, and survive interruption and being cut off."""

import csv
import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from tqdm import tqdm

from agents.jobs.bar import Bar
from agents.jobs.job import Job, perform
from agents.jobs.machines import Machines
from agents.learning.callback import Keeper
from agents.learning.checkpoint import check_versions, running
from agents.learning.evaluation import COLUMNS
from agents.learning.run_folder import RunFolder
from agents.learning.train import train, train_all
from agents.learning.training_env import MeteredVectorEnv
from elbow_gym.baselines.policy import read_policy
from tests.support.trainings import SAC_KILLED, SAC_SMALL, SMALL, small_run
from tests.support.workers import do_jobs_here

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    run = small_run(tmp_path_factory.mktemp("whole") / "run", checkpoint_seconds=0.0)
    return run, train(run)


def weights(folder):
    return read_policy(folder / "best").weights


def evaluations(folder):
    with (folder / "evaluations.csv").open() as handle:
        return [[float(cell) for cell in row] for row in list(csv.reader(handle))[1:]]


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::PendingDeprecationWarning")
def test_run_leaves_policy_checkpoint_curve_and_tensorboard(done):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    run, result = done
    assert result["finished"]
    assert result["best"]["return"] == pytest.approx(max(row[3] for row in evaluations(run.folder)), rel=1e-9)
    assert sorted(path.name[-4:] for path in run.folder.glob("checkpoint_*")) == ["0768", "1024"]
    assert PPO.load(run.files.checkpoint().model, device="cpu").num_timesteps == 1024
    events = EventAccumulator(str(next((run.folder / "tensorboard").rglob("events*")).parent)).Reload()
    wanted = {"evaluation/return", *(f"rollout/{name}" for name in ("reward_tracking", "reward_energy"))}
    assert wanted <= set(events.Tags()["scalars"])
    # An episode's return is the sum of its two terms, however TensorBoard came by them; first episodes are shorter.
    last = {name: events.Scalars(f"rollout/{name}")[-1].value for name in ("reward_tracking", "reward_energy")}
    mean, length = (events.Scalars(f"rollout/ep_{name}_mean")[-1].value for name in ("rew", "len"))
    assert sum(last.values()) * length / 50 == pytest.approx(mean, rel=0.1)


def test_curve_counts_steps_and_two_kinds_of_seconds(done):
    rows = evaluations(done[0].folder)
    assert [row[0] for row in rows] == [0, 256, 512, 768, 1024]
    for row in rows:
        assert row[1] <= row[2]
    assert all(len(row) == len(COLUMNS) for row in rows)
    assert all(before[2] < after[2] for before, after in pairwise(rows))


def test_card_tells_how_it_was_made(done):
    card = json.loads((done[0].folder / "best.json").read_text())
    assert card["training"]["seed"] == 0
    assert card["training"]["num_envs"] == 4
    assert card["environment"]["duration"] == 1.0
    assert np.isfinite(card["evaluation"]["return"])


class Killed(BaseException):
    """Ends a training as SIGKILL does: nothing of it is caught, and nothing more is written."""


def ends_after_600_steps(keeper):
    if keeper.num_timesteps > 600:
        raise Killed
    return True


def cut_down(run, monkeypatch):
    """Starts a run whose process goes away midway, as far as its folder can tell."""
    with monkeypatch.context() as patch:
        patch.setattr(Keeper, "_on_step", ends_after_600_steps)
        with pytest.raises(Killed):
            train(run)


def assert_goes_on_to_the_same_policy(whole, cut, checkpoint, monkeypatch):
    """A run that was cut off leaves a checkpoint, goes on from there, and becomes the run that was not cut off."""
    assert max(path.name for path in cut.folder.glob("checkpoint_*")) == f"checkpoint_{checkpoint:012}"
    seen, on_step = [], Keeper._on_step
    with monkeypatch.context() as patch:
        patch.setattr(Keeper, "_on_step", lambda keeper: seen.append(keeper.num_timesteps) or on_step(keeper))
        assert train(cut, resume=True)["finished"]
    assert seen[0] == checkpoint + cut.settings.num_envs
    # Steps and figures; seconds differ.
    columns = [[row[:1] + row[3:] for row in evaluations(run.folder)] for run in (whole, cut)]
    np.testing.assert_allclose(*columns, rtol=1e-12)
    assert columns[0][-1][1:] != columns[0][-2][1:], "the policy must still change after the cut"
    for name, uncut in weights(whole.folder).items():
        np.testing.assert_array_equal(weights(cut.folder)[name], uncut)


def test_run_that_was_cut_off_goes_on_to_the_same_policy(done, tmp_path, monkeypatch):
    cut = small_run(tmp_path / "run", checkpoint_seconds=0.0)
    cut_down(cut, monkeypatch)
    assert_goes_on_to_the_same_policy(done[0], cut, 512, monkeypatch)


@pytest.mark.slow
def test_sac_that_was_cut_off_goes_on_to_the_same_policy(tmp_path, monkeypatch):
    whole, cut = (small_run(tmp_path / name, **SAC_KILLED) for name in ("whole", "cut"))
    train(whole)
    checkpoint = Keeper.checkpoint
    with monkeypatch.context() as patch:
        # One every 200 steps: a checkpoint takes longer than many steps.
        patch.setattr(
            Keeper, "checkpoint", lambda keeper, model: model.num_timesteps % 200 or checkpoint(keeper, model)
        )
        cut_down(replace(cut, checkpoint_seconds=0.0), monkeypatch)
    assert_goes_on_to_the_same_policy(whole, cut, 600, monkeypatch)


@pytest.mark.soak
def test_runs_that_were_killed_go_on_to_the_same_policies(done, tmp_path, monkeypatch):
    whole = small_run(tmp_path / "whole", checkpoint_seconds=0.0, **SAC_KILLED)
    train(whole)
    command = [sys.executable, "-m", "tests.support.trainings", str(tmp_path / "ppo"), str(tmp_path / "sac")]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert ended.stdout.splitlines().count(str(-signal.SIGKILL)) == 2, ended.stderr
    assert_goes_on_to_the_same_policy(done[0], small_run(tmp_path / "ppo"), 512, monkeypatch)
    assert_goes_on_to_the_same_policy(whole, small_run(tmp_path / "sac", **SAC_KILLED), 600, monkeypatch)


def test_interrupted_run_keeps_its_best_policy_and_goes_on(tmp_path, monkeypatch, capsys):
    def interrupt(self):
        if self.num_timesteps > 300:
            raise KeyboardInterrupt
        return True

    with monkeypatch.context() as patched:
        patched.setattr(Keeper, "_on_step", interrupt)
        result = train(small_run(tmp_path / "run"))
    assert "interrupted; keeping the best policy so far" in capsys.readouterr().err
    assert not result["finished"]
    assert read_policy(tmp_path / "run/best").card.training["timesteps"] < 512
    assert train(small_run(tmp_path / "run"), resume=True)["finished"]


def test_run_that_pauses_goes_on_to_the_same_policy(done, tmp_path):
    run = small_run(tmp_path / "run")
    for until, reached in ((300, 512), (300, 512), (600, 768)):
        assert (train(run, resume=True, until=until)["steps"], run.files.result()) == (reached, None)
    assert train(run, resume=True)["finished"]
    assert [row[:1] + row[3:] for row in evaluations(run.folder)] == [
        row[:1] + row[3:] for row in evaluations(done[0].folder)
    ]
    for name, whole in weights(done[0].folder).items():
        np.testing.assert_array_equal(weights(run.folder)[name], whole)


def test_finished_run_is_left_alone(done, monkeypatch):
    monkeypatch.setattr("agents.learning.callback.Keeper", None)
    assert train(done[0], resume=True) == done[1]


def test_result_that_a_kill_prevented_is_made_on_resuming(done, tmp_path):
    shutil.copytree(done[0].folder, tmp_path / "run")
    run = replace(done[0], folder=tmp_path / "run")
    for left in (None, {"finished": False}):
        (run.folder / "result.json").unlink()
        if left is not None:
            run.files.write_result(left)
        result = train(run, resume=True)
        assert (result["finished"], result["steps"]) == (True, 1024)
        assert result["best"] == done[1]["best"]
        assert run.files.result() == result
        assert [row[0] for row in evaluations(run.folder)] == [0, 256, 512, 768, 1024]


def test_run_is_neither_overwritten_nor_resumed_with_other_settings(done):
    run = done[0]
    with pytest.raises(ValueError, match="output must be free of earlier runs, or --resume be given, got"):
        train(run)
    other = replace(run, settings=replace(SMALL, gamma=0.5))
    with pytest.raises(ValueError, match=r"settings.gamma of a resumed run must be 0.98 as in .* got 0.5"):
        train(other, resume=True)


def test_minutes_end_a_run(tmp_path):
    result = train(small_run(tmp_path / "run", minutes=1e-9))
    assert result["finished"]
    assert result["steps"] < 1024


def assert_seeds_train_what_they_train_alone(done, folder):
    runs = [small_run(folder / f"seed{seed}", seed=seed) for seed in (0, 1)]
    results = train_all(runs, Machines(workers=2))
    assert [result["name"] for result in results] == ["seed0", "seed1"]
    for name, alone in weights(done[0].folder).items():
        np.testing.assert_array_equal(weights(folder / "seed0")[name], alone)
    assert any((weights(folder / "seed1")[name] != alone).any() for name, alone in weights(done[0].folder).items())


@pytest.mark.slow
def test_seeds_sent_to_processes_train_what_they_train_alone(done, tmp_path, monkeypatch):
    do_jobs_here(monkeypatch)
    assert_seeds_train_what_they_train_alone(done, tmp_path)


@pytest.mark.soak
def test_seeds_in_processes_train_what_they_train_alone(done, tmp_path):
    assert_seeds_train_what_they_train_alone(done, tmp_path)


def test_no_workers_and_no_runs_are_refused(tmp_path):
    with pytest.raises(ValueError, match="workers must be positive, got 0"):
        train_all([small_run(tmp_path / "run")], Machines(workers=0))
    with pytest.raises(ValueError, match="runs must be at least one, got none"):
        train_all([])


def test_no_seed_starts_where_a_folder_holds_another_run(done, tmp_path):
    new = small_run(tmp_path / "new", seed=1)
    with pytest.raises(ValueError, match="output must be free of earlier runs"):
        train_all([new, done[0]], Machines(workers=1))
    assert not new.folder.exists()


def test_run_that_nobody_waits_for_any_more_stops(monkeypatch, tmp_path):
    monkeypatch.setattr("agents.learning.callback.unwanted", lambda: True)
    run = small_run(tmp_path / "run")
    result = train(run)
    assert (result["finished"], result["steps"]) == (False, 4)
    assert run.files.best() is not None


def test_run_in_a_worker_that_nobody_waits_for_any_more_stores_what_it_has(monkeypatch, tmp_path):
    run = small_run(tmp_path / "run")
    monkeypatch.setattr("agents.jobs.job.unwanted", lambda: run.files.best() is not None)
    result = perform(Job(partial(train, run, True), 1024), lambda *_: None)
    assert (result["finished"], result["best"] is None) == (False, False)
    assert run.files.checkpoint().progress()["steps"] == result["steps"] > 0


def test_run_goes_on_where_its_terminal_is_gone(tmp_path, monkeypatch):
    def lost(*_, **__):
        raise OSError(errno.EIO, "Input/output error")

    forgotten = []
    monkeypatch.setattr(tqdm, "update", lost)
    monkeypatch.setattr(tqdm, "write", lost)
    monkeypatch.setattr("agents.jobs.bar.forget_lost_terminal", lambda: forgotten.append(True))
    with Bar(1024, "step") as bar:
        assert train(small_run(tmp_path / "run"), tell=bar)["finished"]
    assert forgotten


def interrupted_after(steps, monkeypatch):
    on_step = Keeper._on_step

    def interrupt(keeper):
        if keeper.num_timesteps > steps:
            raise KeyboardInterrupt
        return on_step(keeper)

    monkeypatch.setattr(Keeper, "_on_step", interrupt)


@pytest.mark.parametrize("apart", [False, True], ids=["one-by-one", "side-by-side"])
def test_interruption_ends_every_seed_with_a_line_each(tmp_path, monkeypatch, capsys, apart):
    do_jobs_here(monkeypatch)
    interrupted_after(300, monkeypatch)
    runs = [small_run(tmp_path / f"seed{seed}", seed=seed) for seed in (0, 1)]
    with pytest.raises(KeyboardInterrupt):
        train_all(runs, Machines(workers=2 if apart else 1))
    first, second = capsys.readouterr().out.splitlines()[-2:]
    assert re.match(r"seed0: not finished after 304 steps, best: return -", first)
    if apart:
        assert re.match(r"seed1: not finished after 304 steps, best: return -", second)
    else:
        assert second == "seed1: stopped; --resume goes on from its last checkpoint, or starts it"
        assert not (tmp_path / "seed1" / "run.json").exists()


def test_run_that_was_interrupted_in_its_first_evaluation_makes_it_again(tmp_path, monkeypatch):
    write, interrupted = RunFolder.write_best, []

    def interrupt(folder, policy):
        write(folder, policy)
        if not interrupted:
            interrupted.append(folder)
            raise KeyboardInterrupt

    monkeypatch.setattr(RunFolder, "write_best", interrupt)
    run = small_run(tmp_path / "run")
    result = train(run)
    assert (result["finished"], result["best"] is None) == (False, False)
    assert [row[0] for row in evaluations(run.folder)] == [0]


def test_run_that_was_interrupted_while_it_prepared_starts_anew(tmp_path, monkeypatch):
    run = small_run(tmp_path / "run", **SAC_KILLED)

    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("agents.learning.warm_start.imitate", interrupt)
        result = train(run)
    assert (result["finished"], result["steps"], result["best"]) == (False, 0, None)
    assert run.files.checkpoint() is None
    assert train(run, resume=True)["finished"]
    assert evaluations(run.folder)[0][0] == 400


def test_seed_that_fails_leaves_the_others_going_on(tmp_path, monkeypatch, capsys):
    do_jobs_here(monkeypatch)
    runs = [small_run(tmp_path / f"seed{seed}", seed=seed) for seed in (0, 1)]
    write = RunFolder.write_evaluations

    def full(folder, rows):
        if folder.name == "seed0":
            raise OSError(errno.ENOSPC, "No space left on device", str(folder.path))
        write(folder, rows)

    monkeypatch.setattr(RunFolder, "write_evaluations", full)
    with pytest.raises(OSError, match="No space left on device"):
        train_all(runs)
    first, second = capsys.readouterr().out.splitlines()[-2:]
    assert first == f"seed0: failed: No space left on device: {tmp_path / 'seed0'}"
    assert second.startswith("seed1: finished after 1,024 steps, best: ")


def test_error_without_a_name_gets_the_folders_and_a_threads_is_not_printed(tmp_path, monkeypatch, capsys):
    def fail():
        raise OSError(errno.ENOSPC, "No space left on device")

    def step(keeper):
        thread = threading.Thread(target=fail)
        thread.start()
        thread.join()
        fail()

    monkeypatch.setattr(Keeper, "_on_step", step)
    hook = threading.excepthook
    with pytest.raises(OSError, match=f"No space left on device: '{tmp_path / 'run'}'"):
        train(small_run(tmp_path / "run"))
    assert "Traceback" not in capsys.readouterr().err
    assert threading.excepthook is hook


def test_torch_has_its_threads_back_after_a_training(tmp_path):
    before, threads = dict(os.environ), torch.get_num_threads()
    try:
        torch.set_num_threads(3)
        train(small_run(tmp_path / "run", minutes=1e-9))
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(threads)
    assert dict(os.environ) == before


def test_folder_that_cannot_be_written_is_named_before_a_seed_trains(tmp_path, monkeypatch):
    monkeypatch.setattr("agents.learning.train.train", lambda *_: pytest.fail("trained"))
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match=r"Not a directory: '.*file/run'"):
        train_all([small_run(tmp_path / "file" / "run")])


def test_disk_without_room_for_the_checkpoints_is_named_before_the_training(tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=10_000_000))
    sac = replace(SAC_SMALL, buffer_size=100_000)
    with pytest.raises(OSError, match=r"No space left on device: \d+ MB are needed, 10 MB are free: '"):
        train(small_run(tmp_path / "run", algorithm="sac", settings=sac))
    assert not (tmp_path / "run").exists()


def test_checkpoint_of_other_versions_is_refused_naming_both(done, tmp_path, monkeypatch):
    shutil.copytree(done[0].folder, tmp_path / "run")
    run = replace(done[0], folder=tmp_path / "run")
    (run.folder / "result.json").unlink()
    installed = {**running(), "python": "3.10", "numpy": "9.9"}
    for name, version in (("python", "3.10"), ("numpy", "9.9")):
        monkeypatch.setattr("agents.learning.checkpoint.running", lambda name=name: {name: installed[name]})
        message = (
            f"{name} of a resumed run must be {re.escape(running()[name])} as when .*1024 was saved, got {version}"
        )
        with pytest.raises(ValueError, match=message):
            train(run, resume=True)


def test_checkpoint_that_does_not_say_a_version_goes_on(done, monkeypatch):
    monkeypatch.setattr("agents.learning.checkpoint.running", lambda: {"a package of tomorrow": "1.0"})
    check_versions(done[0].files.checkpoint())


@pytest.mark.parametrize("name", ["model.zip", "state.pkl", "progress.json"])
def test_run_goes_on_from_the_older_checkpoint_to_the_same_policy_where_the_last_is_damaged(
    done, tmp_path, capsys, name
):
    shutil.copytree(done[0].folder, tmp_path / "run")
    run = replace(done[0], folder=tmp_path / "run")
    for lost in ("result.json", "evaluations.csv", "best.safetensors"):
        (run.folder / lost).unlink()
    damaged = run.files.checkpoint().path / name
    whole = bytearray(damaged.read_bytes())
    whole[len(whole) // 2] ^= 1
    damaged.write_bytes(whole)
    assert train(run, resume=True)["finished"]
    said = capsys.readouterr().err
    assert f"{damaged} is damaged or missing; going on from checkpoint_000000000768" in said
    assert "best.safetensors; written again from checkpoint_000000000768" in said
    columns = [[row[:1] + row[3:] for row in evaluations(one.folder)] for one in (done[0], run)]
    np.testing.assert_allclose(*columns, rtol=1e-12)
    for entry, array in weights(done[0].folder).items():
        np.testing.assert_array_equal(weights(run.folder)[entry], array)
    assert sorted(path.name[-4:] for path in run.folder.glob("checkpoint_*")) == ["0768", "1024"]


def test_first_policy_is_where_the_training_starts(done, tmp_path):
    run = small_run(tmp_path / "run", initial_policy=done[0].folder / "best", minutes=1e-9)
    train(run)
    first = evaluations(run.folder)[0]
    assert first[3] == pytest.approx(done[1]["best"]["return"], rel=1e-6)
    wrong = small_run(tmp_path / "wrong", initial_policy=done[0].folder / "best", settings=replace(SMALL, hidden=(9,)))
    with pytest.raises(ValueError, match=r"layers of the first policy must be \(41, 9, 10\) .* got \(41, 8, 10\)"):
        train(wrong)


def test_sac_checkpoint_holds_the_replay_buffer(tmp_path):
    from stable_baselines3.common.vec_env import VecMonitor

    from agents.learning.checkpoint import load_checkpoint
    from agents.learning.training_env import MeteredVectorEnv
    from elbow_gym.sb3 import SB3VecEnv

    run = small_run(tmp_path / "run", algorithm="sac", settings=SAC_SMALL)
    assert train(run)["finished"]
    card = read_policy(run.folder / "best").card
    assert (card.algorithm, card.output, card.activation) == ("sac", "tanh", "relu")
    monitored = VecMonitor(SB3VecEnv(MeteredVectorEnv(4, **run.environment)))
    model = load_checkpoint(run.files.checkpoint(), SAC_SMALL.model_class, monitored)
    buffer = model.replay_buffer
    assert (model.num_timesteps, buffer.pos, buffer.full) == (1240, 310, False)
    # What follows an observation is the next one, but where an episode of 50 periods ends.
    inside = np.arange(309) % 50 != 49
    np.testing.assert_array_equal(buffer.next_observations[:309][inside], buffer.observations[1:310][inside])
    assert buffer.timeouts[49].all()


def test_warm_start_shows_how_the_task_is_done(tmp_path):
    from stable_baselines3.common.vec_env import VecMonitor

    from agents.learning.training_env import MeteredVectorEnv
    from agents.learning.warm_start import fill, imitate
    from elbow_gym.sb3 import SB3VecEnv

    sac = replace(SAC_SMALL, learning_starts=1000, warm_start_noise=0.05)
    env = MeteredVectorEnv(4)
    model = sac.model(VecMonitor(SB3VecEnv(env)), 0, tmp_path)
    shown = fill(model, sac, env, seed=0)
    seen = env.episodes.layout.decode(model.replay_buffer.next_observations[100:250])
    assert np.median(np.linalg.norm(seen["hand_error"], axis=-1)) < 0.05
    assert np.ptp(model.replay_buffer.actions[:250]) > 0.5
    narrow = model.predict(model.replay_buffer.observations[0], deterministic=False)[0]
    assert np.abs(narrow).max() < 0.6
    # The noise that the buffer holds is not shown.
    noise = model.replay_buffer.actions[:250] - shown.actions
    assert shown.actions.shape == (250, 4, 10)
    assert np.abs(noise.mean(axis=(0, 2))).max() < 0.01 < noise.std()
    imitate(model, shown, 300, seed=0)
    own = model.predict(shown.observations.reshape(1000, -1), deterministic=True)[0]
    np.testing.assert_allclose(own, shown.actions.reshape(1000, -1), atol=0.5)
    assert np.abs(own - shown.actions.reshape(1000, -1)).mean() < 0.3 * np.abs(shown.actions).mean()
    assert not len(fill(model, replace(sac, warm_start="actor", learning_starts=1100), env, seed=0).actions)


def test_staggered_arms_end_their_first_episodes_one_after_the_other():
    env = MeteredVectorEnv(5, duration=0.5)
    env.staggered = True
    first, _ = env.reset(seed=0)
    angle = np.arctan2(*env.decode(first)["target_angle"].T[::-1])
    assert angle == pytest.approx(2.0 * np.pi * np.arange(5) * 0.1 / 5.0, abs=1e-6)
    ends = []
    for k in range(1, 26):
        _, _, _, truncated, _ = env.step(np.zeros((5, 10), np.float32))
        ends += [(k, int(i)) for i in np.flatnonzero(truncated)]
    assert ends == [(5, 4), (10, 3), (15, 2), (20, 1), (25, 0)]
    many = MeteredVectorEnv(32, duration=0.5)
    many.staggered = True
    many.reset(seed=0)
    steps = many.get_state()["episodes"]["steps"]
    assert steps.tolist() == [25 * (i // 2) // 16 for i in range(32)]
    # Who resets some arms wants whole episodes, and the others left alone.
    env.step(np.zeros((5, 10), np.float32))
    before = env.get_state()["episodes"]["steps"]
    env.reset(options={"reset_mask": np.array([True, False, False, False, False])})
    assert env.get_state()["episodes"]["steps"].tolist() == [0, *before[1:]]


def test_price_of_power_goes_to_the_rewards_own_or_where_it_is_told():
    settings = replace(SMALL, first_energy_share=0.2)
    assert [settings.energy_share(done) for done in (0.0, 0.25, 0.5, 1.0)] == pytest.approx([0.2, 0.6, 1.0, 1.0])
    settings = replace(SMALL, first_energy_share=3.0, energy_share_until=0.8)
    assert [settings.energy_share(done) for done in (0.0, 0.4, 0.8, 1.0)] == pytest.approx([3.0, 2.0, 1.0, 1.0])
    settings = replace(settings, energy_share_final=1.5)
    assert [settings.energy_share(done) for done in (0.0, 0.4, 0.8, 1.0)] == pytest.approx([3.0, 2.25, 1.5, 1.5])
    assert SMALL.energy_share(0.0) == 1.0
    with pytest.raises(ValueError, match=r"energy_share_until must lie in \(0, 1\], got 0"):
        replace(SMALL, energy_share_until=0.0)
    for name in ("first_energy_share", "energy_share_final"):
        with pytest.raises(ValueError, match=rf"{name} must be at least 0.* got -0.5"):
            replace(SMALL, **{name: -0.5})


def test_exploration_follows_its_plan_whatever_the_gradients_say(tmp_path, monkeypatch):
    seen = []

    def look(self):
        seen.append((self.num_timesteps, self.model.policy.log_std.detach().numpy().copy()))
        return True

    monkeypatch.setattr(Keeper, "_on_step", look)
    train(small_run(tmp_path / "run", settings=replace(SMALL, log_std_init=-1.0, log_std_final=-3.0, n_epochs=2)))
    for steps, log_std in seen:
        # Set at the start of every rollout of 256 control periods.
        np.testing.assert_allclose(log_std, -1.0 - 2.0 * ((steps - 1) // 256 * 256) / 1024, rtol=1e-6)


def test_entropy_aimed_at_and_proximity_follow_their_plans(tmp_path, monkeypatch):
    seen = []

    def look(self):
        seen.append((self.num_timesteps, self.model.target_entropy, self.model.proximity))
        return True

    monkeypatch.setattr(Keeper, "_on_step", look)
    settings = replace(SAC_SMALL, target_entropy=-10.0, target_entropy_final=-20.0, proximity=2.0)
    settings = replace(settings, first_proximity=200.0, proximity_until=0.98)
    train(small_run(tmp_path / "run", algorithm="sac", settings=settings))
    for steps, entropy, proximity in seen:
        # Set at the start of every round of one control period of four arms.
        done = (steps - 4) / 1240
        assert entropy == pytest.approx(-10.0 - 10.0 * done)
        assert proximity == pytest.approx(max(2.0, 2.0 * 100.0 ** (1.0 - done / 0.98)))
    assert {2.0} < {proximity for _, _, proximity in seen}
    assert seen[-1][1] < -19.0
    with pytest.raises(ValueError, match="target_entropy must be a number where there is a target_entropy_final"):
        replace(SAC_SMALL, target_entropy=None, target_entropy_final=-20.0)
    with pytest.raises(ValueError, match=r"first_proximity and proximity must be positive .* got \(3.0, 0.0\)"):
        replace(SAC_SMALL, first_proximity=3.0)
    with pytest.raises(ValueError, match=r"proximity_until must lie in \(0, 1\], got 0.0"):
        replace(SAC_SMALL, proximity_until=0.0)
