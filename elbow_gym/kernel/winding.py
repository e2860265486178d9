"""Temperature of a winding along the stages of a Runge-Kutta step."""

# pyright: basic

from elbow_gym.kernel.slots import (
    COOLING, CURRENT, HEATING, RESISTANCE, TEMPERATURE, TEMPERATURE0, TEMPERATURE_SUM, WARMING,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(inlined=True)
def warm(ws, here, weight, ahead, number):
    """Adds stage `number`, 1 to 4, of a winding's temperature, and sets the next stage's, `ahead` [s] of the start.

    Returns the resistance [ohm] at this stage.

    Reads: CURRENT, RESISTANCE, TEMPERATURE, HEATING, COOLING, WARMING, TEMPERATURE0, TEMPERATURE_SUM.
    Writes: TEMPERATURE, TEMPERATURE0, TEMPERATURE_SUM.
    """
    rise = ws[here + TEMPERATURE]
    i = ws[here + CURRENT]
    resistance = ws[here + RESISTANCE] * (1.0 + ws[here + WARMING] * rise)
    rate = ws[here + HEATING] * (resistance * i * i) - ws[here + COOLING] * rise
    start = rise if number == 1 else ws[here + TEMPERATURE0]
    gained = weight * rate if number == 1 else ws[here + TEMPERATURE_SUM] + weight * rate
    if number == 1:
        ws[here + TEMPERATURE0] = start
    ws[here + TEMPERATURE_SUM] = gained
    ws[here + TEMPERATURE] = start + (gained if number == 4 else ahead * rate)
    return resistance
