"""Voltages in infos: at the motors' terminals, and as they were asked for."""

import numpy as np
import pytest

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv

# The kernel with everything on is one that other tests compile.
SAGGING = {"table": True, "elbow_friction": 0.1, "heat": True, "supply_resistance": 0.2, "control_frequency": 5000.0}


@pytest.mark.parametrize("regeneration", [True, False])
def test_power_is_the_terminal_voltage_times_the_current_and_not_the_command(regeneration):
    env = ElbowArmEnv(regeneration=regeneration, **SAGGING)
    env.reset(seed=0)
    action = np.linspace(-0.8, 0.8, 10).astype(np.float32)
    # A period of 0.2 ms is short against the currents' change once they have risen.
    for _ in range(100):
        observation, *_, info = env.step(action)
    current = env.decode(observation)["current"]
    np.testing.assert_allclose(info["voltage_command"], 24.0 * action, rtol=1e-6)
    assert info["electrical_power"] == pytest.approx(info["voltage"] @ current, rel=1e-2)
    assert info["voltage_command"] @ current > 1.05 * info["electrical_power"]
    # The supply's own loss in the period is what is missing between both.
    before = info["supply_loss"]
    *_, after = env.step(action)
    lost = 5000.0 * (after["supply_loss"] - before)
    assert info["voltage_command"] @ current - info["electrical_power"] == pytest.approx(lost, rel=0.05)


def test_each_arm_of_a_batch_has_its_own_supply():
    env = ElbowArmVectorEnv(3, randomize={"supply_voltage": [0.5, 1.5]}, **SAGGING)
    _, first = env.reset(seed=4)
    for name in ("voltage", "voltage_command"):
        np.testing.assert_array_equal(first[name], 0.0)
    singles = [ElbowArmEnv(randomize={"supply_voltage": [0.5, 1.5]}, **SAGGING) for _ in range(3)]
    for i, single in enumerate(singles):
        single.reset(seed=4 + i)
    action = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 10)).astype(np.float32)
    for _ in range(20):
        *_, info = env.step(action)
        alone = [single.step(one)[4] for single, one in zip(singles, action, strict=True)]
    for name in ("voltage", "voltage_command"):
        np.testing.assert_array_equal(info[name], [one[name] for one in alone])
    assert (np.abs(info["voltage"]) < np.abs(info["voltage_command"])).all()


def test_a_stiff_supply_gives_what_is_asked_for_in_arrays_of_their_own():
    env = ElbowArmEnv()
    env.reset(seed=0)
    *_, info = env.step(np.linspace(-2.0, 2.0, 10).astype(np.float32))
    np.testing.assert_array_equal(info["voltage"], info["voltage_command"])
    assert not np.shares_memory(info["voltage"], info["voltage_command"])
    assert np.abs(info["voltage"]).max() == 24.0
