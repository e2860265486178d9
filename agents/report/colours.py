"""Colours of the project, made legible on a light and on a dark page."""

from __future__ import annotations

from collections.abc import Iterable

from agents.evaluation.players import TABLE
from agents.style import CONTROLLER_COLOURS, ELBOW_COLOURS, TARGET_COLOUR, look

BACKGROUNDS = {"light": "#ffffff", "dark": "#14181d"}
"""Colours of the panels, as in page.css."""
TABLE_COLOUR = "#009E73"
"""Colour of the table that cannot pull, beside those of the elbow counts."""
CONTRAST = 3.0
"""Least contrast of graphics against their background (WCAG 2.2, 1.4.11)."""


def luminance(colour: str) -> float:
    """Relative luminance of a colour #rrggbb, 0 to 1 (WCAG 2.2)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in _channels(colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(colour: str, background: str) -> float:
    """Contrast ratio of two colours #rrggbb, 1 to 21 (WCAG 2.2)."""
    darker, lighter = sorted((luminance(colour), luminance(background)))
    return (lighter + 0.05) / (darker + 0.05)


def legible(colour: str, background: str) -> str:
    """The colour, mixed with as little black or white as gives `CONTRAST` on the background; black turns white."""
    if colour == TARGET_COLOUR and luminance(background) < 0.5:
        return "#ffffff"
    toward = 0.0 if luminance(background) > 0.5 else 1.0
    for step in range(51):
        mixed = "#" + "".join(f"{round(255 * (c + (toward - c) * step / 50)):02x}" for c in _channels(colour))
        if contrast(mixed, background) >= CONTRAST:
            return mixed
    raise ValueError(f"background must leave room for a contrast of {CONTRAST}, got {background}")


def _channels(colour: str) -> list[float]:
    return [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]


def stylesheet(controllers: Iterable[str] = ()) -> str:
    """CSS custom properties --controller-NAME, --bearing-NAME and --target for both schemes.

    Args:
        controllers: names of further controllers than those with colours of their own.
    """
    names = dict.fromkeys([*CONTROLLER_COLOURS, *controllers])
    colours = {f"controller-{name}": look(name)[1] for name in names}
    colours |= {f"bearing-{elbows}": colour for elbows, colour in ELBOW_COLOURS.items()}
    colours[f"bearing-{TABLE}"] = TABLE_COLOUR
    colours["target"] = TARGET_COLOUR
    blocks = {
        scheme: "".join(f"  --{name}: {legible(colour, background)};\n" for name, colour in colours.items())
        for scheme, background in BACKGROUNDS.items()
    }
    return f":root {{\n{blocks['light']}}}\n@media (prefers-color-scheme: dark) {{\n:root {{\n{blocks['dark']}}}\n}}\n"
