"""Parameters of the compliant table under the arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, cast

from elbow_gym.checks import check_entries, friction_coefficient, non_negative, positive

FRICTION_VELOCITY = 0.01
"""Default sliding speed over which friction on the table builds up [m/s]."""


@dataclass(frozen=True, kw_only=True)
class TableParameters:
    """A table at z = 0 that pushes and never pulls: Hunt-Crossley normal force, smooth Coulomb friction.

    Raises ValueError naming the field unless stiffness and friction_velocity are positive, friction is from zero to one
    and dissipation is not negative.
    """

    stiffness: float = 2e4
    """Stiffness k at each touching point [N/m]; the default is a padded elbow, which gives 0.4 mm under 8 N."""
    dissipation: float = 0.5
    """Dissipation c [s/m]: share by which the normal force grows per m/s of approach."""
    friction: float = 0.0
    """Coulomb's coefficient mu [-], at most 1."""
    friction_velocity: float = FRICTION_VELOCITY
    """Sliding speed v_s at which friction has 0.71 of its full size [m/s]."""

    def __post_init__(self) -> None:
        for field in fields(self):
            checks = {"stiffness": positive, "friction_velocity": positive, "friction": friction_coefficient}
            check = checks.get(field.name, non_negative)
            object.__setattr__(self, field.name, check(f"table {field.name}", getattr(self, field.name)))

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON types, which `as_table` takes back."""
        return asdict(self)


def as_table(table: object) -> TableParameters | None:
    """A table from True (the default one), a dict of its fields or a TableParameters; None from False.

    Raises ValueError on anything else.
    """
    if isinstance(table, bool):
        return TableParameters() if table else None
    if isinstance(table, TableParameters):
        return table
    if isinstance(table, Mapping):
        plain = cast("Mapping[str, Any]", table)
        check_entries(plain, {field.name for field in fields(TableParameters)}, "table")
        return TableParameters(**plain)
    raise ValueError(f"table must be True, False, a dict of its fields or TableParameters, got {table!r}")
