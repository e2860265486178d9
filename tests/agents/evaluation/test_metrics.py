"""Metrics by hand on a run that can be worked out on paper."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.metrics import REGIMES, UNITS, joint_energies, metrics
from agents.evaluation.players import player_of
from agents.evaluation.recording import record
from agents.evaluation.regimes import in_all_regimes
from elbow_gym.baselines.pd import PDController
from elbow_gym.task.settings import Settings
from tests.support.recordings import made_up


def hand_made(energy_weight=0.001):
    """One arm of two joints' worth of meters, 50 Hz, 0.1 s, hand 3 mm beside and 4 mm under the target."""
    time = np.arange(6) * 0.02
    target = np.zeros((6, 1, 3))
    hand = target + np.array([0.003, 0.0, -0.004])
    power = np.array([2.0, -1.0])  # W, constant
    energy = time[:, None, None] * power
    voltage = np.zeros((6, 1, 2))
    voltage[4, 0, 1] = -12.0
    return made_up(
        Settings(elbows=1, duration=0.1, energy_weight=energy_weight),
        time,
        joints=2,
        hand=hand,
        target=target,
        electrical_energy=energy,
        drawn_energy=np.maximum(energy, 0.0),
        elbow_force=np.array([3.0, 2.0, -1.0, 4.0, 5.0, 6.0]).reshape(6, 1, 1),
        below_table=time[:, None],
        voltage=voltage,
    )


def test_metrics_of_a_hand_made_run():
    found = metrics(hand_made())
    expected = {
        "electrical_energy": 0.1,
        "drawn_energy": 0.2,
        "error_rms": 5.0,
        "error_max": 5.0,
        "z_rms": 4.0,
        "peak_voltage": 12.0,
        "smallest_elbow_force": -1.0,
        "below_table": 0.1,
        # Two changes of 12 V among four of each of two joints.
        "voltage_change": 6.0,
        "return": -(5 * 0.005 + 5 * 0.001 * 1.0),
    }
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], [value], rtol=1e-12, err_msg=name)


def test_counting_later_counts_less():
    found = metrics(hand_made(), since=0.06)
    np.testing.assert_allclose(found["electrical_energy"], 0.04)
    np.testing.assert_allclose(found["below_table"], 0.04)
    np.testing.assert_allclose(found["smallest_elbow_force"], 4.0)
    np.testing.assert_allclose(joint_energies(hand_made(), 0.06), [[0.08, -0.04]])


@pytest.mark.parametrize("since", [-0.1, 0.1, 2.0])
def test_counting_from_outside_the_run_is_refused(since):
    with pytest.raises(ValueError, match=f"since must lie in .*got {since}"):
        metrics(hand_made(), since)


def test_every_metric_has_a_unit():
    assert set(metrics(hand_made())) == set(UNITS)


class Constant:
    """The same small voltage on all joints."""

    def __init__(self, env):
        self.action = np.full(env.action_space.shape, 0.05, np.float32)

    def predict(self, _, **__):
        return self.action, None


def test_regimes_are_the_whole_run_its_end_and_a_run_from_the_target():
    settings = Settings(duration=2.2, start_noise=0.0)
    found = in_all_regimes(player_of("constant", settings, Constant), seeds=[3])
    from_pose, on_target = (record(replace(settings, start=start), Constant, [3]) for start in ("paper", "on_target"))
    assert np.linalg.norm(from_pose.hand[0] - from_pose.target[0]) > 1.5
    assert np.linalg.norm(on_target.hand[0] - on_target.target[0]) < 1e-6
    energy, from_target = (run.electrical_energy.sum(axis=-1) for run in (from_pose, on_target))
    [two_seconds] = np.flatnonzero(np.isclose(from_pose.time, 2.0))
    expected = {"A": energy[-1], "B": energy[-1] - energy[two_seconds], "C": from_target[-1]}
    for name, spent in expected.items():
        np.testing.assert_allclose(found[name]["electrical_energy"], spent, rtol=1e-12, err_msg=name)
    late = np.linalg.norm(from_pose.hand - from_pose.target, axis=-1)[two_seconds + 1 :]
    np.testing.assert_allclose(found["B"]["error_max"], 1e3 * late.max(axis=0), rtol=1e-12)


@pytest.mark.parametrize("regime", REGIMES, ids=lambda regime: regime.name)
def test_a_regimes_meaning_says_where_it_starts_and_what_counts(regime):
    assert (regime.start == "paper") == ("paper's pose" in regime.meaning)
    assert (regime.start == "on_target") == ("on target from the start" in regime.meaning)
    assert f"{regime.since:g}-{Settings().duration:g} s" in regime.meaning


def test_recorded_return_is_the_sum_of_rewards():
    settings = Settings(duration=0.4)
    recording = record(settings, PDController, [3, 4])
    from elbow_gym.vector_env import ElbowArmVectorEnv

    env = ElbowArmVectorEnv(2, duration=0.4, autoreset_mode="Disabled")
    observation, _ = env.reset(seed=[3, 4])
    controller, total = PDController(env), np.zeros(2)
    for _ in range(settings.horizon):
        observation, reward, _, _, info = env.step(controller.predict(observation)[0])
        total += reward
    np.testing.assert_allclose(metrics(recording)["return"], total, rtol=1e-12)
    np.testing.assert_allclose(metrics(recording)["electrical_energy"], info["electrical_energy"], rtol=1e-12)


def test_thinned_recording_keeps_energies_and_the_largest_voltage():
    settings = Settings(duration=0.4, control_frequency=500.0)
    full, thin = (record(settings, PDController, [0], every=every) for every in (1, 10))
    np.testing.assert_array_equal(full.electrical_energy[::10], thin.electrical_energy)
    np.testing.assert_array_equal(full.time[::10], thin.time)
    np.testing.assert_array_equal(metrics(full)["peak_voltage"], metrics(thin)["peak_voltage"])
    with pytest.raises(ValueError, match=r"every must divide the number of control periods \(200\), got 7"):
        record(settings, PDController, [0], every=7)
