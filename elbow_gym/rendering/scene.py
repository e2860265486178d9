"""Pictures of one arm from plain arrays: the scene in perspective, its forces, and its meters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from operator import itemgetter

import numpy as np

from elbow_gym.parameters import Array
from elbow_gym.rendering.camera import Camera, framing
from elbow_gym.rendering.overlay import Instruments
from elbow_gym.rendering.painter import ELBOW, INK, JOINT, LINK, PULL, PUSH, TABLE, TRACE, Colour, Painter, mix
from elbow_gym.rendering.screen import Pixels, load_pygame, pixels_of

SMALLEST_SIZE = 64
SUPERSAMPLING = 2
"""Factor by which the scene is drawn larger each way before it is shrunk, which smooths every edge."""
SMALLEST_FORCE = 0.05
"""Smallest force that is drawn [N]."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """State of an arm as a picture shows it."""

    joints: Array
    """Positions of joints 1..n and, last, the hand [m], (n + 1, 3)."""
    path: Array
    """Closed path of the target [m], (m, 3)."""
    target: Array
    """Position of the target [m], (3,)."""
    trace: Array
    """Past positions of the hand [m], (k, 3), oldest first."""
    elbows: Sequence[int]
    """Joint numbers held on the table or, on a table that cannot pull, borne by it; n + 1 is the hand."""
    contacts: Sequence[int]
    """Joint numbers at which the forces act."""
    forces: Array
    """Forces of the table on the arm [N], (len(contacts), 3); those that point down hold the arm down."""
    power: Array
    """Electrical power of each joint [W], (n,)."""
    energy: float
    """Electrical energy since the start [J]."""
    error: float
    """Distance from hand to target [m]."""
    time: float
    """Time since the start [s]."""
    support: tuple[str, str]
    """Number of supports of the arm, and the word for them."""
    may_pull: bool = True
    """Whether some of the contacts can hold the arm down."""
    payload: float = 0.0
    """Mass at the hand [kg]."""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """Quantities that stay the same from picture to picture."""

    reach: float
    """Length of the stretched arm [m]."""
    weight: float
    """Weight of the whole arm [N], which sets the scale of the forces' arrows."""
    radius: float
    """Radius of a joint as it is drawn [m]."""
    seen: Array
    """Points that the picture has to show [m], (m, 3)."""
    azimuth: float
    """Direction from the scene to the camera [rad], about z from x."""


class Renderer:
    """Pictures of one size; everything is drawn in memory, without a display.

    Args:
        stage: quantities that stay the same from picture to picture.
        width: width of a picture [pixels].
        height: height of a picture [pixels].
        accent: colour of the hand's trace and of the bars.
    """

    def __init__(self, stage: Stage, width: int, height: int, accent: Colour = TRACE) -> None:
        self._stage, self._accent = stage, accent
        self._instruments = Instruments(width, height)
        self.camera: Camera = framing(stage.seen, stage.azimuth, self._instruments.frame())
        """World to the pixels of a picture."""
        enlarged, size = self.camera.enlarged(SUPERSAMPLING), (SUPERSAMPLING * width, SUPERSAMPLING * height)
        self._painter = Painter(enlarged, size, stage.radius, stage.reach)
        self._surface = load_pygame().Surface((width, height))

    def draw(self, scene: Scene) -> Pixels:
        """A fresh picture (height, width, 3)."""
        arrows = self._arrows(scene)
        self._paint(scene, arrows)
        load_pygame().transform.smoothscale(self._painter.surface, self._surface.get_size(), self._surface)
        self._write(scene, arrows)
        return pixels_of(self._surface)

    def _radii(self, n_points: int) -> Array:
        return self._stage.radius * np.linspace(1.0, 0.55, n_points)

    def _paint(self, scene: Scene, arrows: list[tuple[Array, Array, float]]) -> None:
        painter, thin = self._painter, SUPERSAMPLING * self._instruments.unit
        radii, radius = self._radii(len(scene.joints)), self._stage.radius
        painter.clear()
        painter.line(painter.on_top(scene.path), mix(TABLE, INK, 0.22), 1.2 * thin, closed=True)
        painter.line(np.stack([scene.target, painter.on_top(scene.target[None])[0]]), mix(TABLE, INK, 0.22), thin)
        for joint in scene.elbows:
            for size, share in ((2.0, 1.0), (2.6, 0.5)):
                painter.ring(scene.joints[joint - 1], size * radius, mix(TABLE, ELBOW, share), 1.6 * thin)
        pieces = cut_at_table(scene.joints, radii, -radius)
        under = [piece for piece in pieces if piece[2]]
        for ends, thickness, _ in under:
            painter.link(ends, thickness, mix(TABLE, LINK, 0.3))
        painter.shadow(scene.joints, radii)
        painter.line(scene.path, mix(TABLE, INK, 0.75), 1.4 * thin, closed=True)
        self._paint_trace(scene.trace, 2.2 * thin)
        self._paint_arm(scene, radii, [piece for piece in pieces if not piece[2]])
        painter.line(np.stack([scene.joints[-1], scene.target]), mix(TABLE, PULL, 0.8), thin)
        painter.mark(scene.target, 1.5 * radius, INK, 1.6 * thin)
        for tail, tip, newtons in arrows:
            painter.arrow(tail, tip, PUSH if newtons > 0.0 else PULL, 4.0 * thin)

    def _paint_trace(self, trace: Array, thickness: float) -> None:
        pieces = 16
        edges = np.linspace(0, max(len(trace) - 1, 0), pieces + 1).astype(int)
        for k in range(pieces):
            colour = mix(TABLE, self._accent, 0.12 + 0.88 * (k + 1) / pieces)
            self._painter.line(trace[edges[k] : edges[k + 1] + 1], colour, thickness)

    def _paint_arm(self, scene: Scene, radii: Array, pieces: list[tuple[Array, Array, bool]]) -> None:
        painter, depth, last = self._painter, self._painter.depth, len(scene.joints) - 1
        things: list[tuple[float, Callable[[], None]]] = []
        for ends, thickness, _ in pieces:
            things.append((float(depth(ends).mean()), partial(painter.link, ends, thickness, LINK)))
        # The first link has no length: joints 1 and 2 are one ball.
        for k in range(1, last + 1):
            if scene.joints[k, 2] < -2.0 * self._stage.radius:
                continue
            size, colour = 1.18 * radii[k], JOINT
            if k + 1 in scene.elbows:
                size, colour = 1.5 * radii[k], ELBOW
            elif k == last:
                # Its volume grows with the mass.
                size += 0.0093 * self._stage.reach * (scene.payload / 0.1) ** (1.0 / 3.0)
                colour = self._accent
            # Before both of its links, whichever way they lean.
            middles = (scene.joints[k - 1 : k + 2] + scene.joints[k]) / 2.0
            nearer = float(depth(middles).min()) - 0.01 * self._stage.radius
            things.append((nearer, partial(painter.ball, scene.joints[k], size, colour)))
        for _, draw in sorted(things, key=itemgetter(0), reverse=True):
            draw()

    def _arrows(self, scene: Scene) -> list[tuple[Array, Array, float]]:
        """Tail and tip [m] of each force's arrow, and the force [N], negative where it holds the arm down."""
        arrows: list[tuple[Array, Array, float]] = []
        for joint, force in zip(scene.contacts, scene.forces, strict=True):
            size = float(np.linalg.norm(force))
            if size < SMALLEST_FORCE:
                continue
            length = 0.24 * self._stage.reach * size / (size + self._stage.weight)
            foot = scene.joints[joint - 1] + np.array([0.0, 0.0, 1.7 * self._stage.radius])
            far = foot + length * force / size * (1.0 if force[2] >= 0.0 else -1.0)
            pull = force[2] < 0.0
            arrows.append((far, foot, -size) if pull else (foot, far, size))
        return arrows

    def _write(self, scene: Scene, arrows: list[tuple[Array, Array, float]]) -> None:
        write, surface, unit = self._instruments, self._surface, self._instruments.unit
        write.figures(
            surface,
            [
                ("time", f"{scene.time:.2f}", "s"),
                ("error", f"{1e3 * scene.error:.1f}", "mm"),
                ("energy", f"{scene.energy:.1f}", "J"),
                ("power", f"{scene.power.sum():.1f}", "W"),
                ("support", *scene.support),
            ],
        )
        for tail, tip, newtons in arrows:
            end = tip if newtons > 0.0 else tail
            x, y = self.camera.project(end)
            words = f"{abs(newtons):.1f} N"
            colour = mix(PUSH if newtons > 0.0 else PULL, INK, 0.25)
            write.text(surface, words, (float(x), float(y) - 17.0 * unit), 18, colour, 0.5)
        meaning = [("target", INK), ("hand", self._accent)]
        if len(scene.contacts):
            meaning.append(("table pushes", PUSH))
        if scene.may_pull:
            meaning.append(("table pulls", PULL))
        write.legend(surface, meaning)
        write.bars(surface, scene.power, self._accent)


def cut_at_table(joints: Array, radii: Array, height: float) -> list[tuple[Array, Array, bool]]:
    """Links as pieces that lie wholly above or under a height: ends [m] (2, 3), radii [m] (2,), whether under."""
    pieces: list[tuple[Array, Array, bool]] = []
    for k in range(len(joints) - 1):
        ends, thickness = joints[k : k + 2], radii[k : k + 2]
        low, high = ends[:, 2] - height
        if low * high >= 0.0:
            pieces.append((ends, thickness, bool(low + high < 0.0)))
            continue
        share = low / (low - high)
        middle, width = ends[0] + share * (ends[1] - ends[0]), thickness[0] + share * (thickness[1] - thickness[0])
        pieces.append((np.stack([ends[0], middle]), np.array([thickness[0], width]), bool(low < 0.0)))
        pieces.append((np.stack([middle, ends[1]]), np.array([width, thickness[1]]), bool(high < 0.0)))
    return pieces
