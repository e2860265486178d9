"""An arm as a model for other simulators: MJCF with MuJoCo's DC motors, and URDF."""

from __future__ import annotations

from typing import cast
from xml.etree import ElementTree

from elbow_gym.checks import positive
from elbow_gym.parameters import ArmParameters

Element = ElementTree.Element


def mjcf(arm: ArmParameters, *, voltage_limit: float = 24.0, timestep: float = 1e-4) -> str:
    """The arm as a MuJoCo model, from the first release that knows `<dcmotor>`.

    Joints `joint1`... are this project's relative angles [rad], controls their motors' terminal voltages [V],
    activations the armature currents [A]. Sites lie at joints 3..n and at the hand. There are no elbows and no
    contacts: MuJoCo's are soft, and yours to choose.

    MuJoCo lets a DC motor push with the current that it will have after the step, and no file can say otherwise. For
    accelerations of the present state set `model.actuator_actearly[:] = 0` after loading.

    Gear Coulomb friction becomes `frictionloss`, which has no smooth rise through 0.05 rad/s as this project's has.

    Args:
        arm: the arm.
        voltage_limit: bound of the controls [V].
        timestep: MuJoCo's step [s]; its errors are of first order here, whatever the integrator.

    Raises:
        ValueError: an argument is not a positive number.
    """
    limit, step = positive("voltage_limit", voltage_limit), positive("timestep", timestep)
    root = Element("mujoco", model="elbow_arm")
    # Bounds on mass and inertia would alter light links; what an <inertial> says must not be taken from shapes.
    _add(root, "compiler", angle="radian", boundmass=0, boundinertia=0, inertiafromgeom="false", autolimits="true")
    _add(root, "option", timestep=step, gravity=(0, 0, -arm.gravity))
    _add(_add(root, "default"), "geom", contype=0, conaffinity=0, mass=0, rgba=(0.35, 0.5, 0.7, 1))
    parent, actuators = _add(root, "worldbody"), _add(root, "actuator")
    for k, (link, motor) in enumerate(zip(arm.links, arm.motors, strict=True)):
        name = f"joint{k + 1}"
        parent = _add(parent, "body", name=f"link{k + 1}", pos=(0, 0, arm.links[k - 1].length if k else 0))
        _add(
            parent, "joint", name=name, axis=_axis(k), armature=motor.reflected_inertia,
            damping=_viscous_friction(arm, k), frictionloss=motor.reflected_coulomb_friction,
        )  # fmt: skip
        across, _, along = _inertia(arm, k)
        _add(parent, "inertial", pos=(0, 0, link.length / 2), mass=link.mass, diaginertia=(across, across, along))
        if k:
            _add(parent, "geom", type="capsule", size=link.radius, fromto=(0, 0, 0, 0, 0, link.length))
            site = f"joint{k + 2}" if k + 1 < arm.n_joints else "hand"
            _add(parent, "site", name=site, pos=(0, 0, link.length))
        _add(
            actuators, "dcmotor", name=f"motor{k + 1}", joint=name, gear=motor.gear_ratio,
            motorconst=motor.torque_constant, resistance=motor.armature_resistance,
            inductance=motor.armature_inductance, ctrlrange=(-limit, limit),
        )  # fmt: skip
    return _text(root)


def urdf(arm: ArmParameters, *, voltage_limit: float = 24.0) -> str:
    """The arm as URDF: links, joints and their friction; the format has no motors and no rotor inertia.

    Joints `joint1`... are this project's relative angles [rad]; their limits are the motors' stall torque and no-load
    speed at the voltage limit. To have this project's accelerations, drive the joints with the torques K k i
    (`joint_torque_constant` times current) and give your simulator the rotors' `reflected_inertia` as armature.
    Pinocchio takes the rotors from `model.armature`, reads the damping and applies none: subtract it from the torques.

    Args:
        arm: the arm.
        voltage_limit: supply voltage behind the joints' limits [V].

    Raises:
        ValueError: `voltage_limit` is not a positive number.
    """
    limit = positive("voltage_limit", voltage_limit)
    root = Element("robot", name="elbow_arm")
    _add(root, "link", name="base")
    for k, (link, motor) in enumerate(zip(arm.links, arm.motors, strict=True)):
        body, middle = _add(root, "link", name=f"link{k + 1}"), (0, 0, link.length / 2)
        inertial = _add(body, "inertial")
        _add(inertial, "origin", xyz=middle, rpy=(0, 0, 0))
        _add(inertial, "mass", value=link.mass)
        across, _, along = _inertia(arm, k)
        _add(inertial, "inertia", ixx=across, iyy=across, izz=along, ixy=0, ixz=0, iyz=0)
        if k:
            visual = _add(body, "visual")
            _add(visual, "origin", xyz=middle, rpy=(0, 0, 0))
            _add(_add(visual, "geometry"), "cylinder", radius=link.radius, length=link.length)
        torque = motor.joint_torque_constant * limit / motor.armature_resistance
        joint = _joint(
            root,
            f"joint{k + 1}",
            "continuous",
            f"link{k}" if k else "base",
            f"link{k + 1}",
            arm.links[k - 1].length if k else 0.0,
        )
        _add(joint, "axis", xyz=_axis(k))
        _add(joint, "limit", effort=torque, velocity=limit / motor.joint_torque_constant)
        _add(joint, "dynamics", damping=_viscous_friction(arm, k), friction=motor.reflected_coulomb_friction)
    _add(root, "link", name="hand")
    _joint(root, "wrist", "fixed", f"link{arm.n_joints}", "hand", arm.links[-1].length)
    return _text(root)


def _joint(root: Element, name: str, kind: str, parent: str, child: str, height: float) -> Element:
    joint = _add(root, "joint", name=name, type=kind)
    _add(joint, "parent", link=parent)
    _add(joint, "child", link=child)
    _add(joint, "origin", xyz=(0, 0, height), rpy=(0, 0, 0))
    return joint


def _axis(k: int) -> tuple[int, int, int]:
    return (0, 1, 0) if k else (0, 0, 1)


def _viscous_friction(arm: ArmParameters, k: int) -> float:
    """All viscous friction of a joint, its own and the gear's [N m s/rad]."""
    return arm.joint_viscous_friction[k] + arm.motors[k].reflected_viscous_friction


def _inertia(arm: ArmParameters, k: int) -> tuple[float, float, float]:
    """Principal inertias of a link about its centre of mass [kg m^2], the last one along it."""
    link = arm.links[k]
    # Link 1 only yaws, so its inertia across is free. As a disc of no height it would lie on the edge of what a body
    # can be, where rounding decides whether a simulator takes it.
    across = link.transverse_inertia * (1.0 if k else 2.0)
    return across, across, link.axial_inertia


def _add(parent: Element, tag: str, **attributes: object) -> Element:
    """A child element; numbers keep all their digits."""
    return ElementTree.SubElement(parent, tag, {name: _value(value) for name, value in attributes.items()})


def _value(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(_value(part) for part in cast("tuple[object, ...]", value))
    return repr(float(value)) if isinstance(value, float) else str(value)


def _text(root: Element) -> str:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"
