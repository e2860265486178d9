#!/usr/bin/env bash
# Package: pin 4.1.0 (Pinocchio).
# Expected: a joint's <dynamics damping="..."> in URDF, which lands in `model.damping`, acts in forward dynamics as the
#   rotor inertia in `model.armature` beside it does.
# Seen: `model.damping` holds the file's value, and `aba` gives the same acceleration for any value of it, while it
#   answers to `model.armature`. Friction has to be subtracted from the torques by the caller.
# Why it matters: a model from a file swings for ever though its file says that it is damped; energy and tracking
#   figures from it are those of an arm without friction.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0
"$folder/venv/bin/python" - <<'PYTHON'
import numpy as np
import pinocchio as pin

URDF = """
<robot name="pendulum">
  <link name="base"/>
  <link name="rod"><inertial><origin xyz="0 0 0.5"/><mass value="1"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="10" velocity="10"/><dynamics damping="2.0"/></joint>
</robot>"""
model = pin.buildModelFromXML(URDF)
print("damping read from the file:", model.damping)
assert model.damping[0] == 2.0


def acceleration():
    return float(pin.aba(model, model.createData(), np.zeros(1), np.array([3.0]), np.zeros(1))[0])


damped = acceleration()
model.damping[:] = 0.0
free = acceleration()
print(f"acceleration at 3 rad/s: {damped} with damping, {free} without")
assert damped == free
model.armature[:] = 1.0
pushed = float(pin.aba(model, model.createData(), np.zeros(1), np.zeros(1), np.ones(1))[0])
print(f"acceleration by 1 N m with an armature of 1 kg m^2: {pushed:.4f} rad/s^2")
assert abs(pushed - 1.0 / (0.35 + 1.0)) < 1e-12
PYTHON
