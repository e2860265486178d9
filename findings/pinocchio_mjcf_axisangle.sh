#!/usr/bin/env bash
# Package: pin 4.1.0 (Pinocchio), beside mujoco 4.0.0.
# Expected: an `axisangle` in MJCF gives a direction and an angle; the direction need not have length 1 (MuJoCo
#   normalises it, and so does Pinocchio's own reader with a joint's `axis`).
# Seen: `buildModelFromMJCF` uses the vector as it stands. For axisangle="0 2 0 30" the "rotation" of the body is a
#   matrix with a determinant of 3.4: bodies beyond it are larger than life, and positions, mass matrix and gravity
#   torques are wrong. The same in <inertial>. With length 1, or with `quat`, `euler`, `zaxis` and `xyaxes`, all agrees.
# Why it matters: axes such as "1 1 0" are what people write. The model loads, moves and is consistent with itself:
#   its forward and inverse dynamics agree with each other, for an arm that cannot exist.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0 mujoco==4.0.0
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

FILE = """
<mujoco><worldbody><body name="upper">
  <joint axis="0 2 0"/><inertial pos="0 0 0.5" mass="1" diaginertia="0.1 0.1 0.01"/>
  <body name="lower" pos="0 0 1" axisangle="0 {} 0 30">
    <joint axis="0 1 0"/><inertial pos="0 0 0.5" mass="1" diaginertia="0.1 0.1 0.01"/>
  </body>
</body></worldbody></mujoco>"""
difference, determinant = [], []
for length in (1, 2):
    text = FILE.format(length)
    reference = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(reference)
    mujoco.mj_forward(reference, data)
    Path("arm.xml").write_text(text)
    model = pin.buildModelFromMJCF("arm.xml")
    model = model[0] if isinstance(model, tuple) else model
    read = pin.aba(model, model.createData(), np.zeros(2), np.zeros(2), np.zeros(2))
    difference.append(np.abs(read - data.qacc).max())
    determinant.append(np.linalg.det(model.jointPlacements[2].rotation))
    print(f"length {length}: determinant {determinant[-1]:.3f}, accelerations {data.qacc} and {read} rad/s^2")
assert difference[0] < 1e-9 and abs(determinant[0] - 1.0) < 1e-9
assert difference[1] > 0.1 and abs(determinant[1] - 1.0) > 0.1
PYTHON
