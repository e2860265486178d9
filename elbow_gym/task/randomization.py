"""Ranges of an arm's parameters, from which each reset draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np

from elbow_gym.checks import check_entries, non_negative, positive, real, shown
from elbow_gym.parameters import Array
from elbow_gym.task.ranges import Range, as_range, ends

# One factor on the nominal value per link or motor.
FACTORS = (
    "mass",
    "length",
    "joint_viscous_friction",
    "gear_viscous_friction",
    "gear_coulomb_friction",
    "torque_constant",
    "armature_resistance",
)
MAY_BE_ZERO = ("joint_viscous_friction", "gear_viscous_friction", "gear_coulomb_friction")
# One number per arm: a factor on the nominal supply voltage, then values.
NUMBERS = ("supply_voltage", "payload", "sensor_noise", "action_delay")
POSITIVE = tuple(
    name for name in (*FACTORS, *NUMBERS) if name not in (*MAY_BE_ZERO, "payload", "sensor_noise", "action_delay")
)
"""Quantities that are above zero, but for the length of link 1, which only yaws."""


LARGEST_PAYLOADS = (0.05, 0.3, 0.3)
"""Largest payload of "tasks" with no elbow on the table, with one, and with two or more [kg]."""


def as_ranges(given: object, elbows: int) -> Any:
    """Ranges by name: those given, or of "tasks", whose payloads 24 V can hold with so many elbows on the table.

    Raises ValueError on another text.
    """
    if not isinstance(given, str):
        return given
    if given != "tasks":
        raise ValueError(f'randomize must be a dict of ranges, "tasks" or None, got {given!r}')
    return {"payload": (0.0, LARGEST_PAYLOADS[min(elbows, 2)])}


def _count(name: str, value: object) -> float:
    number = non_negative(name, value)
    if number != int(number):
        raise ValueError(f"{name} must be a whole number of control periods, got {value!r}")
    return number


class Randomization:
    """Ranges of an arm's parameters.

    Args:
        ranges: [low, high] or a fixed number by name. Factors on the nominal value, one draw per link or motor: `mass`,
            `length`, `joint_viscous_friction`, `gear_viscous_friction`, `gear_coulomb_friction`, `torque_constant`,
            `armature_resistance`; one factor per arm: `supply_voltage`. Values, one per arm: `payload` [kg],
            `sensor_noise` [standard deviation in the observation's units] and `action_delay` [control periods].

    Raises ValueError naming the entry, the rule and the value.
    """

    def __init__(self, ranges: Mapping[str, Any] | None = None) -> None:
        if ranges is not None and not isinstance(ranges, Mapping):
            raise ValueError(f"randomize must be a dict of ranges or None, got {ranges!r}")
        given: dict[str, Any] = dict(ranges or {})
        check_entries(given, {*FACTORS, *NUMBERS}, "randomize")
        checks: dict[str, Callable[[str, object], float]] = {
            **dict.fromkeys((*MAY_BE_ZERO, "payload", "sensor_noise"), non_negative),
            "action_delay": _count,
        }
        self.ranges: dict[str, Range] = {
            name: as_range(f"randomize {name}", given[name], checks.get(name, positive))
            for name in (*FACTORS, *NUMBERS)
            if name in given
        }

    def highest(self, name: str) -> float:
        """Upper end of a range, in the unit of its entry; zero when it is not given."""
        return ends(self.ranges[name])[-1] if name in self.ranges else 0.0

    def lowest(self, name: str) -> float:
        """Lower end of a factor's range [-]; one when it is not given."""
        return ends(self.ranges[name])[0] if name in self.ranges else 1.0

    def draw(self, nominal: Mapping[str, Array], generator: np.random.Generator) -> dict[str, Array]:
        """One arm's values by name: (n,) of links or motors, or () of the arm, in SI units.

        Draws in the order of FACTORS (n draws each) and NUMBERS (one each), and only what is a range.
        """
        values: dict[str, Array] = {}
        for name, span in self.ranges.items():
            base = nominal[name]
            low, high = span if isinstance(span, tuple) else (span, span)
            if name == "action_delay":
                values[name] = np.asarray(float(generator.integers(int(low), int(high) + 1) if low < high else low))
                continue
            size = base.shape if name in FACTORS else None
            drawn = np.asarray(generator.uniform(low, high, size) if isinstance(span, tuple) else span)
            values[name] = base * drawn if name in (*FACTORS, "supply_voltage") else drawn.astype(np.float64)
        return values

    @staticmethod
    def given(values: Any, nominal: Mapping[str, Array]) -> dict[str, Array]:
        """Values from a reset option, in SI units, (n,) or a number for all. Raises ValueError naming a wrong one."""
        if not isinstance(values, Mapping):
            raise ValueError(f"options['parameters'] must be a dict of values, got {values!r}")
        plain = cast("Mapping[str, Any]", values)
        check_entries(plain, {*FACTORS, *NUMBERS}, "options['parameters']")
        checked: dict[str, Array] = {}
        for name, value in plain.items():
            try:
                array = np.broadcast_to(np.asarray(real(value), dtype=np.float64), nominal[name].shape).copy()
            except (OverflowError, TypeError, ValueError) as error:
                shape = nominal[name].shape
                raise ValueError(
                    f"options['parameters'][{name!r}] must be numbers of shape {shape}, got {shown(value)}"
                ) from error
            check = _count if name == "action_delay" else non_negative
            for entry in array.ravel():
                check(f"options['parameters'][{name!r}]", float(entry))
            links = array[1:] if name == "length" else array
            if name in POSITIVE and not (links > 0.0).all():
                raise ValueError(f"options['parameters'][{name!r}] must be positive, got {value!r}")
            if name == "length":
                array[0] = 0.0
            checked[name] = array
        return checked
