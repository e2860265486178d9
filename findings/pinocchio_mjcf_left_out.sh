#!/usr/bin/env bash
# Package: pin 4.1.0 (Pinocchio), beside mujoco 4.0.0.
# Expected: `buildModelFromMJCF` gives the mechanism that MuJoCo makes of the same file, or an error that names the
#   element it does not know.
# Seen: what lies in a <frame> is left out without a word: a body with its joint is gone, a geom's mass is missing. So
#   is the content of <replicate>, a first body that has no name (names are optional in MJCF), a joint's `pos` where it
#   stands in a default class, and <option gravity>: the model falls with 9.81 m/s^2 whatever the file says. (The `pos`
#   of a joint itself, and `armature` in a class, are read.)
# Why it matters: <frame> and <replicate> are how files for current MuJoCo are written. A controller that takes its
#   mass matrix and gravity torques from such a model computes for another arm, and nothing fails unless a whole joint
#   is missing.
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
<mujoco>
  {option}
  <default><default class="offset"><joint pos="0.1 0 0"/></default></default>
  <worldbody><body {name}>
    <joint axis="0 1 0" {joint}/><inertial pos="0 0 0.5" mass="1" diaginertia="0.1 0.1 0.01"/>{child}
  </body></worldbody>
</mujoco>"""
CHILD = '<body name="lower" pos="0 0 1"><joint axis="0 1 0"/>{}</body>'
BALL = '<geom size="0.1" mass="2" pos="0 0 0.5"/>'
CASES = {
    "nothing unusual": dict(child=CHILD.format(BALL)),
    "first body nameless": dict(name="", child=CHILD.format(BALL)),
    "body in a frame": dict(child=f"<frame>{CHILD.format(BALL)}</frame>"),
    "geom in a frame": dict(child=CHILD.format(BALL + f"<frame>{BALL}</frame>")),
    "geom in replicate": dict(child=CHILD.format(BALL + f'<replicate count="2" offset="0 0 0.1">{BALL}</replicate>')),
    "pos in a class": dict(joint='class="offset"', child=CHILD.format(BALL)),
    "gravity of the moon": dict(option='<option gravity="0 0 -1.62"/>', child=CHILD.format(BALL)),
}
seen = {}
for name, parts in CASES.items():
    text = FILE.format(**{"option": "", "name": 'name="upper"', "joint": "", "child": "", **parts})
    reference = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(reference)
    data.qpos[:] = 0.5
    mujoco.mj_forward(reference, data)
    Path("arm.xml").write_text(text)
    model = pin.buildModelFromMJCF("arm.xml")
    model = model[0] if isinstance(model, tuple) else model
    torque = pin.computeGeneralizedGravity(model, model.createData(), np.full(model.nq, 0.5))
    seen[name] = (reference.nq, model.nq, data.qfrc_bias[0], torque[0])
    print("{:19s} joints {} and {}, gravity's torque on the first joint {:8.3f} and {:8.3f} N m".format(name, *seen[name]))

joints, joints_read, expected, read = seen.pop("nothing unusual")
assert joints == joints_read == 2 and abs(expected - read) < 1e-9
assert seen["first body nameless"][:2] == seen["body in a frame"][:2] == (2, 1)
assert all(abs(expected - read) > 0.05 * abs(expected) for _, _, expected, read in seen.values())
PYTHON
