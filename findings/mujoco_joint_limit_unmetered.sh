#!/usr/bin/env bash
# Package: mujoco 4.0.0.
# Expected: `actuator_force`, and the sensor of the same name, are the force that an actuator exerts after all limits;
#   times `actuator_velocity` they give its power, whichever of the limits holds.
# Seen: an actuator's own `forcerange` shows in them. A joint's `actuatorfrcrange`, which is what <limit effort="..."/>
#   of a URDF becomes, cuts the torque on the joint and leaves them as they were: below the motor gives the rod 5 J, and
#   force times velocity come to 50 J. Only `qfrc_actuator` and the sensor `jointactuatorfrc` have the limit in them.
# Why it matters: that product is how the energy of a motion is counted. Of a robot from a URDF, whose motors have
#   no other limit, it bills torques that never acted, by whatever factor the controller asks for too much.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mujoco==4.0.0
"$folder/venv/bin/python" - <<'PYTHON'
import mujoco

INERTIA = 0.1
URDF = f"""
<robot name="crank">
  <link name="base"/>
  <link name="rod"><inertial><origin xyz="0 0 0.5"/><mass value="1"/>
    <inertia ixx="{INERTIA}" iyy="{INERTIA}" izz="{INERTIA}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 0 1"/>
    <limit effort="{{effort}}" velocity="100"/></joint>
</robot>"""


def spin(effort, own):
    """A second of 10 N m asked for: energy by the actuator's figures, by the joint's, and in the rod's motion [J]."""
    spec = mujoco.MjSpec.from_string(URDF.format(effort=effort))
    motor = spec.add_actuator(name="motor", target="hinge", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.set_to_motor()
    motor.forcelimited, motor.forcerange = int(own is not None), [-(own or 0.0), own or 0.0]
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:] = 10.0
    by_actuator = by_joint = 0.0
    while data.time < 1.0 - 1e-9:
        mujoco.mj_step(model, data)
        by_actuator += float(data.actuator_force[0] * data.actuator_velocity[0]) * model.opt.timestep
        by_joint += float(data.qfrc_actuator[0] * data.qvel[0]) * model.opt.timestep
    return by_actuator, by_joint, 0.5 * INERTIA * float(data.qvel[0]) ** 2


for name, limits in {"forcerange of the actuator": (100.0, 1.0), "effort of the joint": (1.0, None)}.items():
    by_actuator, by_joint, moved = spin(*limits)
    print(f"1 N m by {name}: {by_actuator:.2f} J by actuator_force, {by_joint:.2f} J by qfrc_actuator, {moved:.2f} J moved")
    assert abs(moved - 5.0) < 0.01 and abs(by_joint / moved - 1.0) < 0.01
    assert abs(by_actuator / moved - (1.0 if limits[1] else 10.0)) < 0.1
PYTHON
