"""MuJoCo's models of exported arms; tests skip where it is missing or knows no DC motors."""

import pytest


def loaded_in_mujoco(mjcf):
    """MuJoCo, its model of a file, with forces of the currents as they are, and the model's data."""
    mujoco = pytest.importorskip("mujoco")
    try:
        model = mujoco.MjModel.from_xml_string(mjcf)
    except ValueError as error:
        if "dcmotor" in str(error):
            pytest.skip("this MuJoCo knows no <dcmotor>")
        raise
    model.actuator_actearly[:] = 0
    return mujoco, model, mujoco.MjData(model)
