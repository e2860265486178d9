"""An outside judge: the arm without elbows as MJCF, its inertia, bias and accelerations by MuJoCo."""

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import cases

from elbow_gym import dynamics

mujoco = pytest.importorskip("mujoco")


def mjcf(arm):
    """Nested bodies with z along the link; armature is the reflected rotor inertia, damping all viscous friction."""
    bodies = ""
    for k, (link, motor) in enumerate(zip(arm.links, arm.motors, strict=True)):
        base = arm.links[k - 1].length if k else 0.0
        # Link 1 only yaws, so its inertia across is free; MuJoCo wants it safely above half of the one along.
        across = link.transverse_inertia * (1.0 if k else 2.0)
        damping = arm.joint_viscous_friction[k] + motor.reflected_viscous_friction
        bodies += f"""
            <body pos="0 0 {base!r}">
              <joint axis="{"0 1 0" if k else "0 0 1"}" armature="{motor.reflected_inertia!r}" damping="{damping!r}"/>
              <inertial pos="0 0 {link.length / 2.0!r}" mass="{link.mass!r}" diaginertia="
                {across!r} {across!r} {link.axial_inertia!r}"/>"""
    return f"""
        <mujoco>
          <compiler angle="radian" boundmass="0" boundinertia="0"/>
          <option gravity="0 0 {-arm.gravity!r}"/>
          <worldbody>{bodies}{"</body>" * arm.n_joints}</worldbody>
        </mujoco>"""


@given(cases(largest=10))
@settings(max_examples=25)
def test_matrix_bias_and_accelerations_are_mujocos(case):
    arm, q, q_dot, current, voltage, _ = case
    model = mujoco.MjModel.from_xml_string(mjcf(arm))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, q_dot
    data.qfrc_applied[:] = arm.of_motors("joint_torque_constant") * current
    mujoco.mj_forward(model, data)
    matrix = np.zeros((arm.n_joints, arm.n_joints))
    for row, unit in zip(matrix, np.eye(arm.n_joints), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    bias = data.qfrc_bias - data.qfrc_passive
    q_ddot = dynamics.forward_dynamics(arm, q, q_dot, current, voltage).q_ddot
    for value, expected in (
        (dynamics.mass_matrix(arm, q), matrix),
        (dynamics.bias_forces(arm, q, q_dot), bias),
        (q_ddot, data.qacc),
    ):
        np.testing.assert_allclose(value, expected, rtol=0.0, atol=1e-8 * max(1.0, np.abs(expected).max()))
