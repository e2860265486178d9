"""Exported models: MuJoCo and Pinocchio, built from the files, have this project's accelerations."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings

from elbow_gym import dynamics, kinematics
from elbow_gym.export import mjcf, urdf
from tests.support.kernel_calls import accelerations_of
from tests.support.mujoco_models import loaded_in_mujoco
from tests.support.strategies import cases


def difference(value, expected):
    return np.abs(value - expected).max() / max(1.0, np.abs(expected).max())


def loaded_in_pinocchio(arm):
    """Pinocchio and its model of the URDF, with the rotors that the format cannot say."""
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromXML(urdf(arm))
    for k in range(arm.n_joints):
        model.armature[model.joints[model.getJointId(f"joint{k + 1}")].idx_v] = arm.motors[k].reflected_inertia
    return pin, model


@pytest.mark.slow
@given(cases())
@settings(max_examples=50)
def test_mujoco_has_the_accelerations_and_current_rates_of_the_file(case):
    arm, q, q_dot, current, voltage, _ = case
    mujoco, model, data = loaded_in_mujoco(mjcf(arm))
    data.qpos[:], data.qvel[:], data.act[:], data.ctrl[:] = q, q_dot, current, voltage
    mujoco.mj_forward(model, data)
    for q_ddot, _, current_dot in (
        dynamics.forward_dynamics(arm, q, q_dot, current, voltage),
        accelerations_of(case._replace(elbows=())),
    ):
        assert difference(data.qacc, q_ddot) < 1e-10
        assert difference(data.act_dot, current_dot) < 1e-12


@pytest.mark.slow
@given(cases())
@settings(max_examples=50)
def test_pinocchio_has_the_accelerations_of_the_file(case):
    arm, q, q_dot, current, voltage, _ = case
    pin, model = loaded_in_pinocchio(arm)
    friction = np.array(arm.joint_viscous_friction) + arm.of_motors("reflected_viscous_friction")
    np.testing.assert_allclose(model.damping, friction, rtol=1e-14)
    torque = arm.of_motors("joint_torque_constant") * current - friction * q_dot
    configuration = pin.integrate(model, pin.neutral(model), q)
    model.gravity.linear = np.array([0.0, 0.0, -arm.gravity])
    found = pin.aba(model, model.createData(), configuration, q_dot, torque)
    assert difference(found, dynamics.forward_dynamics(arm, q, q_dot, current, voltage).q_ddot) < 1e-10


def test_sites_and_frames_lie_where_the_joints_and_the_hand_do(arm):
    q = np.array(arm.nominal_pose)
    mujoco, model, data = loaded_in_mujoco(mjcf(arm))
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    names = [*(f"joint{k}" for k in range(3, 11)), "hand"]
    expected = kinematics.joint_positions(arm, q)[2:]
    assert [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_SITE, k) for k in range(model.nsite)] == names
    np.testing.assert_allclose(data.site_xpos[:-1], expected[: len(names) - 1], atol=1e-12)
    np.testing.assert_allclose(data.site_xpos[-1], kinematics.hand_position(arm, q), atol=1e-12)


def test_the_file_says_limits_frictions_and_supply(arm):
    rough = replace(arm, motors=tuple(replace(motor, gear_coulomb_friction=0.01) for motor in arm.motors))
    model = ElementTree.fromstring(mjcf(rough, voltage_limit=12.0, timestep=0.001))
    assert model.find("option").get("timestep") == "0.001"
    assert {motor.get("ctrlrange") for motor in model.iter("dcmotor")} == {"-12.0 12.0"}
    assert {joint.get("frictionloss") for joint in model.iter("joint")} == {repr(0.01 * 3.0)}
    robot = ElementTree.fromstring(urdf(rough, voltage_limit=12.0))
    motor = arm.motors[0]
    limit = robot.find("joint/limit")
    assert float(limit.get("effort")) == pytest.approx(motor.joint_torque_constant * 12.0 / 1.1)
    assert float(limit.get("velocity")) == pytest.approx(12.0 / (0.203 * 3.0))
    assert [joint.get("type") for joint in robot.iter("joint")] == ["continuous"] * 10 + ["fixed"]


@pytest.mark.parametrize("export", [mjcf, urdf])
def test_a_supply_that_is_no_number_is_refused(arm, export):
    with pytest.raises(ValueError, match="voltage_limit must be"):
        export(arm, voltage_limit=0.0)
