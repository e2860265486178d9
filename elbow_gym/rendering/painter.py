"""Shaded shapes of the arm and its table on a pygame surface, in the view of a camera."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from elbow_gym.parameters import Array
from elbow_gym.rendering.camera import Camera
from elbow_gym.rendering.screen import load_pygame

Colour = tuple[int, int, int]

# Okabe and Ito's palette where colours carry meaning, greys elsewhere.
SKY: tuple[Colour, Colour] = ((255, 255, 255), (222, 229, 236))
TABLE: Colour = (240, 239, 235)
TABLE_EDGE: Colour = (196, 194, 187)
GRID: Colour = (214, 213, 207)
INK: Colour = (38, 46, 56)
# Taken off what it falls on.
SHADOW: Colour = (66, 64, 60)
LINK: Colour = (104, 122, 142)
JOINT: Colour = (58, 70, 84)
ELBOW: Colour = (230, 159, 0)
PUSH: Colour = (0, 158, 115)
PULL: Colour = (213, 94, 0)
TRACE: Colour = (0, 114, 178)

# Direction to the light, over its height: shadows fall away from it.
LIGHT = np.array([-0.25, 0.3])
# Round things are painted from their dark rim to the light, in this many steps.
SHARES = np.linspace(0.0, 1.0, 6)
BALL_LIGHT = np.array([-0.3, -0.38])
LOW_SIDE, HIGH_SIDE = -1.0 + 1.3 * SHARES, 1.0 - 0.62 * SHARES
WHOLE = np.ones(1)


@lru_cache(4096)
def mix(first: Colour, second: Colour, share: float) -> Colour:
    """Colour at a share of the way from the first to the second."""
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(first, second, strict=True))
    return red, green, blue


@lru_cache(64)
def tones_of(colour: Colour) -> tuple[Colour, ...]:
    """The colour from its dark rim to its highlight, one for each of `SHARES`."""
    dark, light = mix(colour, INK, 0.4), mix(colour, (255, 255, 255), 0.55)
    return tuple(mix(dark, colour, 2.0 * s) if s < 0.5 else mix(colour, light, 2.0 * s - 1.0) for s in SHARES.tolist())


class Painter:
    """Draws things of the world on one surface.

    Args:
        camera: projection of the world onto the surface.
        size: width and height of the surface [pixels].
        radius: radius of a joint as it is drawn [m]; the table's top is drawn so that a joint at z = 0 rests on it.
        reach: length of the stretched arm [m].
    """

    def __init__(self, camera: Camera, size: tuple[int, int], radius: float, reach: float) -> None:
        self._pygame = load_pygame()
        self._camera, self._radius, self._reach = camera, radius, reach
        self.surface = self._pygame.Surface(size)
        self._stage = self._paint_stage(size)

    def _points(self, world: Array) -> list[list[float]]:
        return self._camera.project(world).tolist()

    def _disc(self, radius: float, height: float, count: int = 96) -> Array:
        angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height)], axis=-1)

    def _paint_stage(self, size: tuple[int, int]) -> Any:
        """Paints what never moves: the sky, the table as far as the arm reaches, its grid, the arm's foot."""
        draw, stage = self._pygame.draw, self._pygame.Surface(size)
        width, height = size
        for y in range(height):
            draw.line(stage, mix(*SKY, y / height), (0, y), (width, y))
        top, edge = -self._radius, 1.02 * self._reach
        slab = 0.03 * self._reach
        draw.polygon(stage, TABLE_EDGE, self._points(self._disc(edge, top - slab, 240)))
        draw.polygon(stage, TABLE, self._points(self._disc(edge, top, 240)))
        spacing = 10.0 ** math.floor(math.log10(self._reach / 2.0))
        spacing *= max(step for step in (1.0, 2.0, 5.0) if step * spacing <= self._reach / 4.0 or step == 1.0)
        thickness = max(1, round(size[1] / 640))
        for offset in spacing * np.arange(-math.floor(edge / spacing), math.floor(edge / spacing) + 1):
            half = math.sqrt(edge**2 - offset**2)
            ends = np.array([[offset, -half, top], [offset, half, top]])
            for line in (ends, ends[:, [1, 0, 2]]):
                draw.line(stage, GRID, *self._points(line), thickness)
        draw.lines(stage, mix(TABLE_EDGE, TABLE, 0.4), True, self._points(self._disc(edge, top, 240)), thickness)
        draw.polygon(stage, mix(JOINT, TABLE, 0.35), self._points(self._disc(2.4 * self._radius, top)))
        draw.polygon(stage, mix(JOINT, TABLE, 0.15), self._points(self._disc(1.9 * self._radius, top)))
        return stage

    def depth(self, world: Array) -> Array:
        """Distance from the camera into the picture [m] of points [m]."""
        return self._camera.depth(world)

    def clear(self) -> None:
        """Clears the surface to the empty table."""
        self.surface.blit(self._stage, (0, 0))

    def on_top(self, world: Array) -> Array:
        """Shadows of points [m], (m, 3), on the drawn table; a point under it is moved straight up or down."""
        cast = world.copy()
        cast[:, :2] -= np.maximum(world[:, 2:] + self._radius, 0.0) * LIGHT
        cast[:, 2] = -self._radius
        return cast

    def shadow(self, joints: Array, radii: Array) -> None:
        """A soft shadow of the links between `joints` (n + 1, 3)."""
        pygame, cast = self._pygame, self.on_top(joints)
        less, coarser = 2, 4
        centres, scale = self._camera.project(cast) / less, self._camera.scale(cast) / less
        across = np.maximum(radii * scale, 1.0)
        margin = float(across.max()) + 2.0 * coarser
        low = np.floor(np.maximum(centres.min(axis=0) - margin, 0.0)).astype(int)
        high = np.ceil(np.minimum(centres.max(axis=0) + margin, np.array(self.surface.get_size()) / less)).astype(int)
        if (high - low <= 0).any():
            return
        width, height = (int(side) for side in high - low)
        dark = pygame.Surface((width, height))
        for k in range(len(joints) - 1):
            a, b = centres[k] - low, centres[k + 1] - low
            pygame.draw.polygon(dark, SHADOW, band(a, b, across[k], across[k + 1])[0])
            pygame.draw.circle(dark, SHADOW, b, across[k + 1])
        # Shrunk and enlarged again its edge is soft.
        soft = pygame.transform.smoothscale(dark, (max(1, width // coarser), max(1, height // coarser)))
        soft = pygame.transform.smoothscale(soft, (less * width, less * height))
        self.surface.blit(soft, (less * int(low[0]), less * int(low[1])), special_flags=pygame.BLEND_RGB_SUB)

    def line(self, world: Array, colour: Colour, thickness: float, closed: bool = False) -> None:
        """A line through points [m], (m, 3), some pixels thick."""
        if len(world) > 1:
            self._pygame.draw.lines(self.surface, colour, closed, self._points(world), max(2, round(thickness)))

    def ring(self, centre: Array, radius: float, colour: Colour, thickness: float) -> None:
        """A circle on the table around a point."""
        around = self._disc(radius, -self._radius, 40)
        around[:, :2] += centre[:2]
        self.line(around, colour, thickness, closed=True)

    def mark(self, centre: Array, radius: float, colour: Colour, thickness: float) -> None:
        """A ring that faces the camera, radius in metres."""
        at, size = self._camera.project(centre), radius * float(self._camera.scale(centre))
        self._pygame.draw.circle(self.surface, colour, at, size, max(1, round(thickness)))

    def ball(self, centre: Array, radius: float, colour: Colour) -> None:
        """A shaded ball, radius in metres."""
        at, size = self._camera.project(centre), radius * float(self._camera.scale(centre))
        for share, tone in zip(SHARES, tones_of(colour), strict=True):
            middle = at + share * size * BALL_LIGHT
            self._pygame.draw.circle(self.surface, tone, middle, max(size * (1.0 - 0.88 * share), 1.0))

    def link(self, ends: Array, radii: Array, colour: Colour) -> None:
        """A shaded tapered rod between two points (2, 3), radii in metres."""
        (a, b), (thick, thin) = self._camera.project(ends), radii * self._camera.scale(ends)
        tones = tones_of(colour)
        for tone, corners in zip(tones, band(a, b, thick, thin, LOW_SIDE, HIGH_SIDE), strict=True):
            self._pygame.draw.polygon(self.surface, tone, corners)

    def arrow(self, tail: Array, tip: Array, colour: Colour, thickness: float) -> None:
        """An arrow between two points [m], (3,), with a shaft some pixels thick."""
        (start, end), draw = self._camera.project(np.stack([tail, tip])), self._pygame.draw
        length = float(np.linalg.norm(end - start))
        if length < 1.0:
            return
        along = (end - start) / length
        head = min(3.2 * thickness, length)
        neck = end - head * along
        side = np.array([-along[1], along[0]])
        for grown, tone in ((0.28 * thickness, (255, 255, 255)), (0.0, colour)):
            half = thickness / 2.0 + grown
            foot, point = start - grown * along, end + 1.6 * grown * along
            corners = [neck - (0.55 * head + 1.4 * grown) * side, neck + (0.55 * head + 1.4 * grown) * side]
            draw.polygon(self.surface, tone, band(foot, neck, half, half)[0])
            draw.polygon(self.surface, tone, [corners[0] - grown * along, point, corners[1] - grown * along])


def band(
    a: Array, b: Array, thick: float, thin: float, low: Array = -WHOLE, high: Array = WHOLE
) -> list[list[list[float]]]:
    """Corners of tapered bands between two pixels, half `thick` wide at a and half `thin` at b.

    Each entry of low and high chooses a part of the width between -1 and 1, the upper side in the picture.
    """
    along = b - a
    side = np.array([along[1], -along[0]]) / max(float(np.hypot(along[0], along[1])), 1e-9)
    if side[1] > 0.0:
        side = -side
    across = np.stack([low * thick, high * thick, high * thin, low * thin], axis=-1)
    return (np.stack([a, a, b, b]) + across[..., None] * side).tolist()
