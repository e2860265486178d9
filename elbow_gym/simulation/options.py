"""Physics beyond the paper's model: load, table, friction, heat and supply, all off by default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from elbow_gym.checks import friction_coefficient, non_negative, positive
from elbow_gym.parameters import ArmParameters
from elbow_gym.table import TableParameters, as_table


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Load, table, friction, heat and supply. Raises ValueError naming the argument, the rule and the value."""

    payload: float = 0.0
    """Point mass at the hand [kg]."""
    table: bool | TableParameters | Mapping[str, float] | None = None
    """Compliant table under joints 3..n and the hand: True for the default one, or its fields."""
    elbow_friction: float = 0.0
    """Coulomb's coefficient of rigid elbows on the table, where they push [-], at most 1."""
    heat: bool = False
    """Whether windings warm up, and their resistance with them."""
    supply_voltage: float = 24.0
    """Voltage V0 of the common supply without load [V]; `supply_resistance` lowers it."""
    supply_resistance: float = 0.0
    """Resistance R_s inside the supply [ohm]."""
    regeneration: bool = True
    """Whether the supply takes current back."""

    def __post_init__(self) -> None:
        for name in ("payload", "supply_resistance"):
            object.__setattr__(self, name, non_negative(name, getattr(self, name)))
        object.__setattr__(self, "elbow_friction", friction_coefficient("elbow_friction", self.elbow_friction))
        object.__setattr__(self, "supply_voltage", positive("supply_voltage", self.supply_voltage))
        object.__setattr__(self, "table", None if self.table is None else as_table(self.table))
        for name in ("heat", "regeneration"):
            if not isinstance(getattr(self, name), bool):
                raise ValueError(f"{name} must be True or False, got {getattr(self, name)!r}")

    @property
    def surface(self) -> TableParameters | None:
        """The compliant table, if there is one."""
        return self.table if isinstance(self.table, TableParameters) else None

    def drive(self, arm: ArmParameters) -> bool:
        """Whether windings warm up, the supply has a resistance or a gear of the arm has Coulomb friction."""
        rough = bool((arm.of_motors("gear_coulomb_friction") > 0.0).any())
        return self.heat or self.supply_resistance > 0.0 or rough


def as_conditions(conditions: object) -> Conditions:
    """The conditions themselves; the paper's from None. Raises ValueError on anything else."""
    if conditions is None:
        return Conditions()
    if not isinstance(conditions, Conditions):
        raise ValueError(f"conditions must be a Conditions or None, got {conditions!r}")
    return conditions
