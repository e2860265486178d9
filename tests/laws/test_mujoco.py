"""An outside judge: the exported arm's inertia and bias by MuJoCo, and what bears it on a table."""

from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings

from elbow_gym import Conditions, Simulator, dynamics, kinematics
from elbow_gym.export import mjcf
from tests.support.mujoco_models import loaded_in_mujoco
from tests.support.strategies import cases


@given(cases(largest=10))
@settings(max_examples=25)
def test_matrix_bias_and_accelerations_are_mujocos(case):
    arm, q, q_dot, current, voltage, _ = case
    mujoco, model, data = loaded_in_mujoco(mjcf(arm))
    data.qpos[:], data.qvel[:], data.act[:] = q, q_dot, current
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


def on_a_table(model):
    """The model with a plane without friction, which points (spheres of next to no radius) at all sites touch."""
    root = ElementTree.fromstring(model)
    plane = {"type": "plane", "size": "9 9 1", "conaffinity": "1", "condim": "1"}
    ElementTree.SubElement(root.find("worldbody"), "geom", plane)
    point = {"size": "1e-9", "contype": "1", "condim": "1", "solref": "-1e5 -200"}
    for body in root.iter("body"):
        for site in body.findall("site"):
            ElementTree.SubElement(body, "geom", {**point, "pos": site.get("pos")})
    return ElementTree.tostring(root, encoding="unicode")


def test_an_arm_at_rest_on_the_table_is_borne_as_mujocos(arm):
    # As many supports as pitch joints: statics alone fixes the forces, whatever law either contact follows. The
    # motors' torques, of stalled currents v / R, load some points and relieve others.
    voltage = 0.05 * np.random.default_rng(2).uniform(-1.0, 1.0, 10) * (np.arange(10) > 0)
    flat = np.pi / 2.0 * np.eye(10)[1]
    sim = Simulator(arm, 0, conditions=Conditions(table=True), timestep=5e-4)
    sim.reset(flat)
    sim.step(voltage, 10_000)
    mujoco, model, data = loaded_in_mujoco(on_a_table(mjcf(arm, timestep=0.002)))
    data.qpos[:], data.ctrl[:] = flat, voltage
    for _ in range(3000):
        mujoco.mj_step(model, data)
    force, found = np.zeros(6), np.zeros(9)
    for k in range(data.ncon):
        mujoco.mj_contactForce(model, data, k, force)
        # Body 0 is the world, and link 1 touches nothing.
        found[model.geom_bodyid[data.contact[k].geom].max() - 2] += force[0]
    # Both lie some tenths of a millimetre deep, over links of 0.3 m: cosines off by 1e-6.
    np.testing.assert_allclose(sim.contact_force[0, :, 2], found, rtol=1e-5)
    assert np.ptp(found[:-1]) > 0.1
    assert found.sum() == pytest.approx(9.81 * 0.85, abs=0.3)
    assert np.abs(kinematics.pitches(sim.q[0])[1:] - np.pi / 2.0).max() < 1e-3
