"""Random settings of the environment: constants over decades, every switch, ranges, a reset's parameters and state."""

import dataclasses
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from elbow_gym import ArmParameters, LinkParameters, MotorParameters, Simulator, paper_arm
from elbow_gym.kernel.rows import PARAMETERS

LINK = {"mass": 0.1, "length": 0.3, "radius": 0.01}
MOTOR = {
    **{field.name: field.default for field in dataclasses.fields(MotorParameters)},
    "gear_coulomb_friction": 0.005,
}
MOTOR.pop("temperature_limit", None)
ARM = {"joint_viscous_friction": 0.5, "gravity": 9.81}
TABLE = {"stiffness": 2e4, "dissipation": 0.5, "friction": 0.1, "friction_velocity": 0.01}
OTHERS = {"payload": 0.3, "elbow_friction": 0.1, "supply_resistance": 0.1, "voltage_limit": 24.0}
RANGES = ("mass", "length", "joint_viscous_friction", "torque_constant", "armature_resistance", "supply_voltage")
SWITCHES = ("table", "rubbing", "heat", "supply", "rough", "payload", "one_way")


class Drawn(NamedTuple):
    """A random setting."""

    arguments: dict[str, Any]
    """Of the environment."""
    parameters: dict[str, Any] | None
    """The reset option of that name, if there is one."""


def draw(rng: np.random.Generator, decades: float = 2.0, on: tuple[str, ...] | None = None) -> Drawn:
    """A setting whose constants are the usual ones times up to 10^decades either way.

    Args:
        rng: source of all that is drawn.
        decades: half the width of a constant's range.
        on: switches that are on; drawn when None.
    """
    n, width, joints_differ = int(rng.choice([3, 4, 6, 10, 10])), decades * rng.choice([0.25, 0.5, 1.0]), rng.random()
    kept = rng.choice([0.0, 0.7])

    def spread(value: float) -> np.ndarray:
        if rng.random() < kept:
            return np.full(n, value)
        exponent = rng.uniform(-width, width) + (joints_differ < 0.5) * rng.uniform(-1.0, 1.0, n) * min(width, 1.0)
        return value * 10.0 ** np.clip(exponent, -width, width) * np.ones(n)

    link, motor, arm = ({name: spread(value) for name, value in of.items()} for of in (LINK, MOTOR, ARM))
    link["length"][0] = 0.0
    table, others = ({name: float(spread(value)[0]) for name, value in of.items()} for of in (TABLE, OTHERS))
    switched = {name for name in SWITCHES if rng.random() < 0.4} if on is None else set(on)
    if "rough" not in switched:
        motor["gear_coulomb_friction"][:] = 0.0
    elbows = tuple(sorted(rng.choice(np.arange(3, n + 1), min(n - 2, int(rng.integers(0, 3))), replace=False).tolist()))
    arguments: dict[str, Any] = {
        "elbows": elbows,
        "voltage_limit": others["voltage_limit"],
        "heat": "heat" in switched,
        "regeneration": "one_way" not in switched,
        "table": table if "table" in switched else False,
        "payload": others["payload"] * ("payload" in switched),
        "supply_resistance": others["supply_resistance"] * ("supply" in switched),
        "elbow_friction": others["elbow_friction"] * ("rubbing" in switched),
        "start_noise": float(rng.choice([0.0, 0.02])),
        "duration": 1.0,
    }
    made = ArmParameters(
        links=tuple(LinkParameters(**{name: float(x[k]) for name, x in link.items()}) for k in range(n)),
        motors=tuple(MotorParameters(**{name: float(x[k]) for name, x in motor.items()}) for k in range(n)),
        joint_viscous_friction=tuple(arm["joint_viscous_friction"].tolist()),
        gravity=float(arm["gravity"][0]),
        nominal_pose=_pose(rng, link["length"], elbows),
    )
    ranges = {name: [float(rng.uniform(0.7, 1.0)), float(rng.uniform(1.0, 1.4))] for name in RANGES}
    drawn = {name: span for name, span in ranges.items() if rng.random() < 0.3} if rng.random() < 0.3 else None
    # A small circle that the hand can reach, with the shortest links that may be drawn, too.
    bend, share = (elbows[-1] - 1 if elbows else 0), 0.65 if drawn and "length" in drawn else 0.97
    rest, free = link["length"][:bend].sum(), link["length"][bend:].sum()
    center = [share * rest, 0.0, share * free] if elbows else [share * free, 0.0, 0.0]
    circle = {"center": center, "radius": 1e-3 * float(link["length"][1:].min())}
    own = {"mass": link["mass"] * rng.uniform(0.7, 1.4, n), "torque_constant": 0.9 * motor["torque_constant"]}
    return Drawn({**arguments, "arm": made, "circle": circle, "randomize": drawn}, own if rng.random() < 0.2 else None)


def _pose(rng: np.random.Generator, length: np.ndarray, elbows: tuple[int, ...]) -> tuple[float, ...]:
    """The paper's, or one with links up to a right angle from upright; elbows near z = 0 where the links reach it."""
    n = len(length)
    if rng.random() < 0.3:
        return paper_arm().nominal_pose[:n]
    pitch, height = rng.uniform(-1.5, 1.5, n), 0.0
    for a in range(1, n):
        if a + 2 in elbows:
            # The link down from where it starts, as far as it reaches.
            pitch[a] = np.copysign(np.arccos(np.clip(-height / length[a], -1.0, 1.0)), pitch[a])
        height += length[a] * np.cos(pitch[a])
    pitch[0] = 0.0
    return (float(rng.uniform(-1.0, 1.0)), *np.diff(pitch).tolist())


def draw_state(rng: np.random.Generator, simulator: Simulator) -> dict[str, np.ndarray]:
    """A reset's state for the simulator's one arm: a pose near the present one, speeds, currents and warm windings.

    Speeds and currents are over two and a half decades, up to three times the free speed and the stalled current.
    """
    row = dict(zip(PARAMETERS, simulator.parameters(np.array([0]))[0], strict=True))
    q, n, volts = simulator.q[0].copy(), simulator.arm.n_joints, simulator.conditions.supply_voltage
    noise = rng.choice([0.0, 0.05, 0.3]) * rng.normal(size=n)
    with suppress(ValueError):
        q = simulator.on_table(q + noise)[0]
    # Heights of the elbows by the joints: each link turns with all joints before its end.
    slope = -row["length"] * np.sin(np.cumsum(np.concatenate([[0.0], q[1:]])))
    rise = np.array([np.cumsum((slope * (np.arange(n) < elbow - 1))[::-1])[::-1] for elbow in simulator.elbows])
    rise = rise.reshape(-1, n) * (np.arange(n) > 0)
    speed = rng.normal(size=n) * 10.0 ** rng.uniform(-2.0, 0.5) * volts / row["joint_torque_constant"]
    current = rng.normal(size=n) * 10.0 ** rng.uniform(-2.0, 0.5) * volts / row["armature_resistance"]
    warm = rng.uniform(size=n) * 10.0 ** rng.uniform(0.0, 2.5)
    state = {"q": q, "q_dot": speed - np.linalg.pinv(rise) @ (rise @ speed), "current": current}
    return {**state, "temperature_rise": warm} if simulator.conditions.heat else state
