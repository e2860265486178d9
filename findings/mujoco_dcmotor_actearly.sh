#!/usr/bin/env bash
# Package: mujoco 4.0.0.
# Expected: `actearly` is an option of every stateful actuator; a file, or a default class in it, says whether the force
#   of a step uses the activation before or after that step's update, and off is the rule.
# Seen: a <dcmotor> with an inductance always comes with actearly on. A default class that says off is passed over
#   without a word, and a <general dyntype="dcmotor" actearly="false"> is refused. Only the compiled model's array can
#   be changed. With actearly on, the acceleration that mj_forward reports is not that of the current in `act`: it is
#   that of the current one time step later, and changes with `opt.timestep`.
# Why it matters: whoever compares accelerations at a given state and current with another simulator, or reads torque
#   and current of one instant for an energy balance, is off by a step of the electrical dynamics.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mujoco==4.0.0
"$folder/venv/bin/python" - <<'PYTHON'
import mujoco

MODEL = """
<mujoco>
  <default><general actearly="false"/></default>
  <worldbody><body>
    <joint name="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
  </body></worldbody>
  <actuator>{}</actuator>
</mujoco>"""
MOTOR = '<dcmotor joint="hinge" motorconst="0.5" resistance="1" inductance="0.01"/>'
GENERAL = '<general joint="hinge" dyntype="dcmotor" gaintype="dcmotor" biastype="dcmotor" actearly="false"/>'


def acceleration(model):
    """At 12 V and no current yet: torque and acceleration of that instant are zero."""
    data = mujoco.MjData(model)
    data.ctrl[0] = 12.0
    mujoco.mj_forward(model, data)
    return float(data.qacc[0])


model = mujoco.MjModel.from_xml_string(MODEL.format(MOTOR))
print("actearly of the compiled motor:", bool(model.actuator_actearly[0]))
assert model.actuator_actearly[0]
found = {}
for timestep in (0.002, 0.001):
    model.opt.timestep = timestep
    found[timestep] = acceleration(model)
    print(f"acceleration at zero current, steps of {timestep} s: {found[timestep]:.4f} rad/s^2")
assert found[0.002] > 1.8 * found[0.001] > 0.5
model.actuator_actearly[0] = 0
print("with the array set to 0:", acceleration(model))
assert acceleration(model) == 0.0
try:
    mujoco.MjModel.from_xml_string(MODEL.format(GENERAL))
except ValueError as error:
    print("refused:", str(error).splitlines()[0])
else:
    raise SystemExit("a <general> of this kind is taken now")
PYTHON
