"""A batch in time: exact continuation, arms that do not feel each other, refused input, meters a hand can check."""

from dataclasses import replace

import numpy as np
import pytest

from elbow_gym import (
    ArmParameters,
    Conditions,
    LinkParameters,
    MotorParameters,
    Simulator,
    dynamics,
    kinematics,
    paper_arm,
)
from tests.support.kernel_calls import shared


def volts(size, seed=0):
    return np.random.default_rng(seed).uniform(-24.0, 24.0, (size, 10))


def poses(sim):
    """One on its elbows near the start pose for each arm."""
    noise = np.random.default_rng(1).normal(size=(sim.num_envs, 10))
    return sim.on_table(sim.arm.nominal_pose + 0.05 * noise)


def started(size, elbows=2, **options):
    """Arms at different poses, some steps under way."""
    sim = Simulator("paper", elbows, size, **options)
    sim.reset(poses(sim))
    sim.step(volts(size), 10)
    return sim


def assert_same(one, other, rows=slice(None)):
    for name, array in one.get_state().items():
        np.testing.assert_array_equal(array[rows], other.get_state()[name][rows], err_msg=name)


def test_a_saved_state_continues_bit_for_bit():
    sim, other = started(5), Simulator("paper", 2, 5)
    saved = sim.get_state()
    sim.step(volts(5, 2), 30)
    other.set_state(saved)
    other.step(volts(5, 2), 30)
    assert_same(sim, other)
    assert (saved["state"] != sim.get_state()["state"]).any()
    np.testing.assert_array_equal(other.time, sim.time)


@pytest.mark.parametrize("threads", [2, 3, 16])
def test_threads_change_no_bit(threads):
    sim, threaded = started(70), started(70, num_threads=threads)
    sim.step(volts(70, 3), 20)
    threaded.step(volts(70, 3), 20)
    assert_same(sim, threaded)


def test_an_arm_alone_is_the_arm_in_a_batch_bit_for_bit():
    batch = started(20)
    start = poses(batch)
    for arm in (0, 7, 19):
        alone = Simulator("paper", 2)
        alone.reset(start[arm])
        alone.step(volts(20)[arm], 10)
        np.testing.assert_array_equal(alone.get_state()["state"][0], batch.get_state()["state"][arm])
        np.testing.assert_array_equal(alone.elbow_force[0], batch.elbow_force[arm])


def test_resetting_some_arms_leaves_the_others_running():
    sim = started(4)
    before, mask = sim.get_state(), np.array([True, False, False, True])
    sim.reset(q_dot=np.zeros(10), current=np.ones(10), mask=mask)
    np.testing.assert_array_equal(sim.get_state()["state"][~mask], before["state"][~mask])
    np.testing.assert_array_equal(sim.time, [0.0, 0.02, 0.02, 0.0])
    np.testing.assert_array_equal(sim.q[mask], [sim.arm.nominal_pose] * 2)
    np.testing.assert_array_equal(sim.current[mask], np.ones((2, 10)))
    for meter in ("electrical_energy", "drawn_energy", "copper_loss", "friction_loss", "link_work"):
        assert not getattr(sim, meter)[mask].any()
        assert getattr(sim, meter)[~mask].all()


def test_reset_zeroes_clock_and_meters():
    sim = started(1, elbows=0)
    sim.step(np.zeros(10), 200)
    assert sim.below_table[0] > 0.0
    sim.reset()
    assert not sim.get_state()["state"][:, 1:].any()
    assert (sim.time[0], sim.below_table[0]) == (0.0, 0.0)


def test_hand_heights_and_forces_are_those_of_the_state():
    # A coarse step leaves most for the projection to put right.
    sim = started(20, elbows=(3, 5, 8), timestep=0.004)
    for arm in range(0, 20, 5):
        q = sim.q[arm]
        np.testing.assert_allclose(sim.hand_position[arm], kinematics.hand_position(sim.arm, q), atol=1e-14)
        lowest = kinematics.joint_positions(sim.arm, q)[2:, 2].min()
        assert sim.lowest_height[arm] == pytest.approx(lowest, abs=1e-14)
        expected = dynamics.forward_dynamics(sim.arm, q, sim.q_dot[arm], sim.current[arm], np.zeros(10), (3, 5, 8))
        np.testing.assert_allclose(sim.elbow_force[arm], expected.elbow_force, rtol=1e-11)


def test_time_below_the_table_is_counted_step_by_step():
    sim = Simulator("paper", 0, timestep=0.001)
    sim.reset()
    counted = 0.0
    for _ in range(400):
        counted += 0.001 * (kinematics.joint_positions(sim.arm, sim.q[0])[2:, 2].min() < -1e-6)
        sim.step(np.zeros(10))
    assert 0.1 < sim.below_table[0] < 0.4
    assert sim.below_table[0] == pytest.approx(counted)


def test_the_start_pose_rests_on_its_elbows_with_the_settled_forces_and_not_below_them():
    sim = Simulator("paper", 2)
    sim.reset()
    np.testing.assert_allclose(sim.elbow_force, [[2.39830698, 2.72709652]], rtol=0.0, atol=1e-8)
    sim.step(np.zeros(10), 10)
    assert abs(sim.lowest_height[0]) < 1e-15
    assert sim.below_table[0] == 0.0


def test_a_hanging_arm_is_below_the_table_all_the_time_and_an_upright_one_never():
    sim = Simulator("paper", 0, 3)
    sim.reset(np.eye(10)[1] * np.array([[np.pi], [0.0], [0.0]]))
    sim.step(np.zeros(10), 250)
    np.testing.assert_allclose(sim.below_table, [0.5, 0.0, 0.0])
    np.testing.assert_allclose(sim.lowest_height, [-2.7, 0.3, 0.3], atol=1e-9)


def stalled(current=None):
    """An arm whose rotors are too heavy to move and hardly driven: L di/dt = v - R i alone."""
    heavy = (MotorParameters(rotor_inertia=1e12, torque_constant=1e-200),) * 10
    sim = Simulator(replace(paper_arm(), motors=heavy), 0, timestep=1e-4)
    sim.reset(current=current)
    return sim


def test_a_stalled_motors_meters_are_the_circuits():
    # i = (v / R) (1 - exp(-t R / L))
    sim = stalled()
    voltage = np.linspace(-24.0, 24.0, 10)
    sim.step(voltage, 200)
    time, decay = 0.02, 0.0017 / 1.1
    fraction, twice = (1.0 - np.exp(-rate * time / decay) for rate in (1, 2))
    np.testing.assert_allclose(sim.current[0], voltage / 1.1 * fraction, rtol=1e-7)
    np.testing.assert_allclose(sim.electrical_energy[0], voltage**2 / 1.1 * (time - decay * fraction), rtol=1e-6)
    loss = voltage**2 / 1.1 * (time - 2.0 * decay * fraction + decay / 2.0 * twice)
    np.testing.assert_allclose(sim.copper_loss[0], loss, rtol=1e-6)
    np.testing.assert_array_equal(sim.drawn_energy, sim.electrical_energy)
    np.testing.assert_allclose(sim.friction_loss, 0.0, atol=1e-15)


def test_a_free_yaw_runs_up_to_its_no_load_speed():
    # Upright, nothing but friction (0.5 + 0.09 N m s/rad) holds the yaw: K_m i = D w and v = R i + K_m w.
    sim = Simulator("paper", 0)
    sim.reset(np.zeros(10))
    sim.step(12.0 * np.eye(10)[0], 2000)
    speed = 12.0 * 0.609 / (0.609**2 + 1.1 * 0.59)
    assert sim.q_dot[0, 0] == pytest.approx(speed, rel=1e-9)
    assert sim.current[0, 0] == pytest.approx(0.59 * speed / 0.609, rel=1e-9)
    assert not sim.q[0, 1:].any()


def test_drawn_energy_leaves_out_what_flows_back():
    sim = started(8)
    for seed in range(10):
        sim.step(volts(8, seed), 10)
    assert (sim.drawn_energy >= sim.electrical_energy).all()
    assert (sim.drawn_energy > sim.electrical_energy + 1e-3).any()
    # v = -1 V against a current of 20 A that stays positive for 5 ms: all of it flows back.
    sim = stalled(np.full(10, 20.0))
    sim.step(np.full(10, -1.0), 20)
    flowed = -0.002 / 1.1 + (20.0 + 1.0 / 1.1) * 0.0017 / 1.1 * (1.0 - np.exp(-0.002 * 1.1 / 0.0017))
    np.testing.assert_allclose(sim.electrical_energy, -flowed, rtol=1e-7)
    assert not sim.drawn_energy.any()


def test_an_arm_whose_state_or_meter_overflows_is_flagged_and_kept():
    sim = started(2)
    before = sim.get_state()
    sim.step(np.outer([0.0, 1e300], np.ones(10)), 5)
    np.testing.assert_array_equal(sim.valid, [True, False])
    np.testing.assert_array_equal(sim.get_state()["state"][1], before["state"][1])
    sim = stalled()
    sim.step(np.full(10, 1e200))
    assert not sim.valid[0]
    assert not sim.copper_loss.any()


ROUGH = replace(paper_arm(), motors=(*paper_arm().motors[1:], MotorParameters(gear_coulomb_friction=0.005)))


@pytest.mark.parametrize(
    ("options", "lanes", "switches"),
    [
        ({}, 1, {"exponential"}),
        ({"integrator": "rk4"}, 1, set()),
        ({"num_envs": 2}, 1, {"exponential"}),
        ({"num_envs": 3}, 16, {"exponential"}),
        ({"conditions": Conditions(table=True)}, 1, {"exponential", "table"}),
        ({"elbows": 2, "conditions": Conditions(elbow_friction=0.1)}, 1, {"exponential", "rubbing"}),
        ({"conditions": Conditions(elbow_friction=0.1)}, 1, {"exponential"}),
        ({"conditions": Conditions(heat=True)}, 1, {"exponential", "drive"}),
        ({"conditions": Conditions(supply_resistance=0.1)}, 1, {"exponential", "drive"}),
        ({"arm": ROUGH}, 1, {"exponential", "drive"}),
    ],
)
def test_a_simulator_steps_in_the_kernel_of_its_switches_alone(monkeypatch, options, lanes, switches):
    asked = []

    def kernel(lanes, **on):
        asked.append((lanes, {name for name, value in on.items() if value}))
        return shared(lanes, **on)

    monkeypatch.setattr("elbow_gym.simulator.kernel", kernel)
    Simulator(**{"arm": "paper", "elbows": 0, "timestep": 5e-4, **options})
    assert asked == [(lanes, switches)]


def test_on_table_refuses_a_pose_with_no_way_down():
    with pytest.raises(ValueError, match=r"^q must hold elbow joint 7 at z = 0 to 1e-08 m, got 1\.5 m off$"):
        Simulator("paper", (7,)).on_table(np.zeros(10))


LONG_ARM = ArmParameters(
    links=(LinkParameters(length=0.0), *(LinkParameters(),) * 11),
    motors=(MotorParameters(),) * 12,
    joint_viscous_friction=(0.5,) * 12,
    nominal_pose=(0.0,) * 12,
)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"num_envs": 0}, "num_envs must be a positive integer, got 0"),
        ({"num_envs": 2.0}, r"num_envs must be a positive integer, got 2\.0"),
        ({"num_threads": 0}, "num_threads must be a positive integer, got 0"),
        ({"timestep": 0.0}, r"timestep must be positive, got 0\.0"),
        ({"timestep": 0.006}, r"timestep must be at most 0\.0055 s, for the rate 'friction' .*, got 0\.006"),
        ({"timestep": 0.003, "integrator": "rk4"}, r"timestep must be at most 0\.00216 s, for the rate 'armature' .*"),
        ({"integrator": "euler"}, r"integrator must be one of \('exponential', 'rk4'\), got 'euler'"),
        ({"conditions": {"heat": True}}, r"conditions must be a Conditions or None, got \{'heat': True\}"),
        ({"elbows": (2,)}, r"elbows must be joints 3 to 10 .*, got 2"),
        ({"arm": LONG_ARM, "elbows": tuple(range(3, 12))}, "elbows must be at most 8, got 9"),
        ({"arm": "puma"}, "arm must be one of .*, got 'puma'"),
    ],
)
def test_a_simulator_that_cannot_be_is_refused(options, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        Simulator(**options)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda sim: sim.step(np.full(10, np.nan)), "voltage must be finite, got nan"),
        (lambda sim: sim.step(np.full((2, 10), np.inf)), "voltage must be finite, got inf"),
        (lambda sim: sim.step(np.zeros(9)), r"voltage must have shape \(2, 10\) or \(10,\), got \(9,\)"),
        (lambda sim: sim.step(np.zeros((3, 10))), r"voltage must have shape .*, got \(3, 10\)"),
        (lambda sim: sim.step(np.zeros(10), 0), "n_substeps must be a positive integer, got 0"),
        (lambda sim: sim.step(np.zeros(10), 1.5), r"n_substeps must be a positive integer, got 1\.5"),
        (lambda sim: sim.reset(np.zeros(10)), r"q must hold elbow joint 7 at z = 0 to 1e-08 m, got 1\.5 m off"),
        (lambda sim: sim.reset(np.eye(10)[1] * np.pi / 2.0 + np.eye(10)[4]), "q must hold elbow joint 7 at z = 0"),
        (lambda sim: sim.reset(q_dot=np.eye(10)[1]), "q_dot must keep the elbows at z = 0, got .* m/s off the table"),
        (lambda sim: sim.reset(current=np.full(10, np.nan)), "current must be finite, got nan"),
        (lambda sim: sim.reset(mask=np.ones(3, bool)), r"mask must have shape \(2,\), got \(3,\)"),
        (lambda sim: sim.set_state({}), r"state must have the entry 'state', got \[\]"),
        (
            lambda sim: sim.set_state(sim.get_state() | {"clock": np.zeros(3)}),
            r"state\['clock'\] must have shape \(2, 2\)",
        ),
    ],
)
def test_bad_input_is_named_and_leaves_the_state_untouched(call, message):
    sim, untouched = started(2), started(2)
    with pytest.raises(ValueError, match=f"^{message}"):
        call(sim)
    assert_same(sim, untouched)


def test_running_state_cannot_be_written_to():
    sim = started(2)
    with pytest.raises(ValueError, match="read-only"):
        sim.q[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        sim.elbow_force[0, 0] = 1.0


def test_a_new_simulator_rests_in_the_nominal_pose_on_the_table():
    sim = Simulator("paper", (3, 5))
    assert np.abs(kinematics.elbow_heights(sim.arm, sim.q, sim.elbows)).max() <= 1e-12
    np.testing.assert_array_equal(Simulator("paper", 2).q[0], Simulator("paper", 2).arm.nominal_pose)


def test_resetting_one_arm_leaves_anothers_failure_standing():
    sim = Simulator("paper", 2, 3)
    voltage = np.zeros((3, 10))
    voltage[1] = 1e300
    sim.step(voltage, 5)
    sim.reset(mask=np.array([True, False, False]))
    assert sim.valid.tolist() == [True, False, True]


def test_a_running_state_can_be_given_back():
    sim = Simulator("paper", 2)
    rng = np.random.default_rng(0)
    for _ in range(50):
        sim.step(24.0 * rng.choice([-1.0, 1.0], 10), 10)
    running = [values.copy() for values in (sim.q, sim.q_dot, sim.current)]
    sim.reset(sim.q, sim.q_dot, sim.current)
    np.testing.assert_array_equal([sim.q, sim.q_dot, sim.current], running)
