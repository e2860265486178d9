"""Temperature of a winding along the stages of a Runge-Kutta step."""

# pyright: basic

from elbow_gym.kernel.slots import (
    COOLING, CURRENT, HEATING, RESISTANCE, TEMPERATURE, TEMPERATURE0, TEMPERATURE_SUM, WARMING,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(inlined=True)
def warm(ws, here, k, weight, ahead, number):
    """Adds stage `number`, 1 to 4, of a winding's temperature, and sets the next stage's, `ahead` [s] of the start.

    Returns the resistance [ohm] at this stage.

    Reads: CURRENT, RESISTANCE, TEMPERATURE, HEATING, COOLING, WARMING, TEMPERATURE0, TEMPERATURE_SUM.
    Writes: TEMPERATURE, TEMPERATURE0, TEMPERATURE_SUM.
    """
    rise = ws[here + TEMPERATURE + k]
    i = ws[here + CURRENT + k]
    resistance = ws[here + RESISTANCE + k] * (1.0 + ws[here + WARMING + k] * rise)
    rate = ws[here + HEATING + k] * (resistance * i * i) - ws[here + COOLING + k] * rise
    start = rise if number == 1 else ws[here + TEMPERATURE0 + k]
    gained = weight * rate if number == 1 else ws[here + TEMPERATURE_SUM + k] + weight * rate
    if number == 1:
        ws[here + TEMPERATURE0 + k] = start
    ws[here + TEMPERATURE_SUM + k] = gained
    ws[here + TEMPERATURE + k] = start + (gained if number == 4 else ahead * rate)
    return resistance
