"""Text and bars in a picture: time, error, energy, power of each joint, and a legend of the colours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from elbow_gym.parameters import Array
from elbow_gym.rendering.painter import GRID, INK, Colour, mix
from elbow_gym.rendering.screen import load_pygame

MUTED: Colour = (98, 108, 120)
# The power axis: linear around zero up to this [W], then logarithmic.
SMALLEST_POWER = 0.1
LARGEST_POWER = 1000.0
LEAST_POWER = -10.0
TICKS = (-10.0, 0.0, 10.0, 100.0, 1000.0)

# Letters are drawn this many times larger and shrunk: small fonts put them on whole pixels, unevenly.
FINER = 4


def bar_height(power: float) -> float:
    """Height of a bar over the axis' zero as a share of the largest, for a power [W]; sign(P) log(1 + |P| / 0.1 W)."""
    whole = math.log1p(LARGEST_POWER / SMALLEST_POWER)
    clipped = min(max(power, LEAST_POWER), LARGEST_POWER)
    return math.copysign(math.log1p(abs(clipped) / SMALLEST_POWER) / whole, clipped)


class Instruments:
    """Text and bars on a surface of one size.

    Args:
        width: width of the surface [pixels].
        height: height of the surface [pixels].
    """

    def __init__(self, width: int, height: int) -> None:
        self._pygame = load_pygame()
        self._width, self._height = width, height
        self.unit = min(width / 640.0, height / 480.0)
        """Size of what takes one pixel in a picture of 640 by 480 [pixels]."""
        self._fonts: dict[int, Any] = {}
        self._texts: dict[tuple[str, float, Colour], Any] = {}

    def frame(self) -> tuple[float, float, float, float]:
        """Left, top, width and height of what is left for the scene [pixels]."""
        unit = self.unit
        return 26.0 * unit, 92.0 * unit, self._width - 52.0 * unit, self._height - (92.0 + 124.0) * unit

    def _written(self, words: str, size: float, colour: Colour) -> Any:
        pygame, pixels = self._pygame, max(8, round(size * self.unit))
        try:
            self._fonts[pixels].size(words)
        except (KeyError, pygame.error):
            # Somebody's pygame.quit() takes all fonts with it.
            pygame.font.init()
            self._fonts[pixels] = pygame.font.Font(None, FINER * pixels)
        fine = self._fonts[pixels].render(words, True, colour)
        width, height = fine.get_size()
        return pygame.transform.smoothscale(fine, (max(1, width // FINER), max(1, height // FINER)))

    def _panel(self, surface: Any, top: float, height: float) -> None:
        # What lies under words shines through only faintly.
        panel = self._pygame.Surface((self._width, round(height)))
        panel.fill((255, 255, 255))
        panel.set_alpha(170)
        surface.blit(panel, (0, round(top)))

    def text(
        self, surface: Any, words: str, at: tuple[float, float], size: float, colour: Colour = INK, align: float = 0.0
    ) -> float:
        """Writes words with their upper left corner at a pixel (align 0), centred (0.5) or right-aligned (1).

        Returns their width [pixels].
        """
        key = (words, size, colour)
        if key not in self._texts:
            if len(self._texts) > 400:
                self._texts.clear()
            self._texts[key] = self._written(words, size, colour)
        written = self._texts[key]
        surface.blit(written, (round(at[0] - align * written.get_width()), round(at[1])))
        return float(written.get_width())

    def figures(self, surface: Any, entries: Sequence[tuple[str, str, str]]) -> None:
        """A row of (name, value, unit) across the top."""
        unit, width = self.unit, self._width / self.unit
        self._panel(surface, 0.0, 60.0 * unit)
        step = min((width - 28.0) / len(entries), 170.0)
        for k, (name, value, symbol) in enumerate(entries):
            left = (16.0 + k * step) * unit
            self.text(surface, name, (left, 12.0 * unit), 17, MUTED)
            end = left + self.text(surface, value, (left, 29.0 * unit), 30)
            self.text(surface, symbol, (end + 4.0 * unit, 37.0 * unit), 19, MUTED)

    def legend(self, surface: Any, entries: Sequence[tuple[str, Colour]]) -> None:
        """Coloured marks and their meaning, in a row under the figures."""
        unit, left, top = self.unit, 16.0 * self.unit, 64.0 * self.unit
        size = max(3, round(9.0 * unit))
        for meaning, colour in entries:
            square = (round(left), round(top + unit), size, size)
            self._pygame.draw.rect(surface, colour, square, border_radius=round(2.0 * unit))
            left += size + 5.0 * unit
            left += self.text(surface, meaning, (left, top), 17, MUTED) + 18.0 * unit

    def bars(self, surface: Any, power: Array, colour: Colour) -> None:
        """The power of each joint [W], (n,), at the bottom; paler where it is fed back."""
        draw, unit = self._pygame.draw, self.unit
        left, right = 52.0 * unit, self._width - 16.0 * unit
        top, bottom = self._height - 98.0 * unit, self._height - 20.0 * unit
        self._panel(surface, top - 28.0 * unit, self._height - (top - 28.0 * unit))
        lowest = bar_height(LEAST_POWER)
        rise = (bottom - top) / (1.0 - lowest)
        zero = round(bottom + rise * lowest)
        self.text(surface, "power of each joint (W, logarithmic)", (16.0 * unit, top - 20.0 * unit), 17, MUTED)
        for tick in TICKS:
            y = round(zero - rise * bar_height(tick))
            draw.line(surface, MUTED if tick == 0.0 else GRID, (left, y), (right, y), max(1, round(unit)))
            self.text(surface, f"{tick:g}".replace("-", "\u2212"), (left - 7.0 * unit, y - 6.0 * unit), 16, MUTED, 1.0)
        step = (right - left) / len(power)
        every = max(1, math.ceil(20.0 * unit / step))
        for k, watts in enumerate(power):
            x, height = left + k * step, rise * bar_height(float(watts))
            bar = (round(x + 0.2 * step), round(zero - max(height, 0.0)), max(1, round(0.6 * step)), round(abs(height)))
            draw.rect(surface, colour if watts >= 0.0 else mix(colour, (255, 255, 255), 0.5), bar)
            if (k + 1) % every == 0 or k == 0:
                self.text(surface, f"{k + 1}", (x + step / 2.0, bottom + 4.0 * unit), 16, mix(MUTED, INK, 0.4), 0.5)
