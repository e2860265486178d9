"""Pictures and windows of the environments: scenes of their arms with the hands' traces."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from elbow_gym.kinematics import joint_positions
from elbow_gym.parameters import Array
from elbow_gym.rendering.painter import TRACE, Colour
from elbow_gym.rendering.scene import SMALLEST_SIZE, Renderer, Scene, Stage
from elbow_gym.rendering.screen import Pixels, Window
from elbow_gym.task.episodes import Episodes

RENDER_MODES = ("human", "rgb_array")
HIGHEST_RATE = 60.0
"""Highest rate of pictures in a window, and of points of a trace, per second of simulated time [Hz]."""
TRACE_TIME = 5.0
"""Length of a trace [s]."""
POWER_TIME = 0.1
"""Time over which the power that is shown is averaged [s]."""
# A window shows at most two by two arms.
SHOWN_ARMS = 4


class Viewer:
    """Pictures of B arms as they move. It reads their state and changes nothing.

    Args:
        episodes: the arms.
        render_mode: "rgb_array", "human", or None for a viewer that never draws and costs nothing.
        render_width: width of each picture [pixels].
        render_height: height of each picture [pixels].
        accent: colour of the hands' traces and of the bars.

    Raises ValueError naming the argument; the sides are whole numbers of at least 64 pixels.
    """

    def __init__(
        self,
        episodes: Episodes,
        render_mode: str | None,
        render_width: int = 640,
        render_height: int = 480,
        accent: Colour = TRACE,
    ) -> None:
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise ValueError(f"render_mode must be one of {list(RENDER_MODES)} or None, got {render_mode!r}")
        for name, size in (("render_width", render_width), ("render_height", render_height)):
            if isinstance(size, bool) or not isinstance(size, int) or size < SMALLEST_SIZE:
                raise ValueError(f"{name} must be a whole number of pixels, at least {SMALLEST_SIZE}, got {size!r}")
        self._episodes, self._mode = episodes, render_mode
        self._size, self._accent = (render_width, render_height), accent
        frequency = episodes.settings.control_frequency
        self._every = max(1, math.ceil(frequency / HIGHEST_RATE))
        self._rate = frequency / self._every
        kept = max(2, round(TRACE_TIME * self._rate))
        self._hands: deque[Array] = deque(maxlen=kept)
        self._meters: deque[tuple[Array, Array]] = deque(maxlen=max(2, 1 + round(POWER_TIME * self._rate)))
        self._age = np.zeros(episodes.num_envs, dtype=np.int64)
        self._steps = 0
        self._renderer: Renderer | None = None
        self._window = Window("elbow_gym")

    def __getstate__(self) -> dict[str, Any]:
        """Everything but pictures and windows, for pickling and copying."""
        return {**self.__dict__, "_renderer": None, "_window": Window("elbow_gym")}

    def restart(self, mask: NDArray[np.bool_] | None = None) -> None:
        """Clears the traces of the arms in `mask`, all when None, which start anew."""
        if self._mode is None:
            return
        self._age[slice(None) if mask is None else mask] = 0
        self._note()
        if self._mode == "human":
            self._show()

    def follow(self) -> None:
        """Records the positions of the hands after a control period."""
        self._steps += 1
        if self._mode is None or self._steps % self._every:
            return
        self._note()
        if self._mode == "human":
            self._show()

    def render(self, ready: bool = True) -> tuple[Pixels, ...] | None:
        """Fresh pictures (height, width, 3) of all arms; None in the mode "human", whose window shows the arms anyway.

        Raises gymnasium's ResetNeeded unless the arms are `ready`, and DependencyNotInstalled without pygame-ce.
        """
        if self._mode is None:
            gym.logger.warn(f"render needs a render_mode, one of {list(RENDER_MODES)}, when the environment is made")
            return None
        if not ready:
            raise gym.error.ResetNeeded("reset must be called before render")
        if self._mode == "human":
            self._show()
            return None
        return tuple(self.picture(i) for i in range(self._episodes.num_envs))

    def _note(self) -> None:
        simulator = self._episodes.simulator
        self._hands.append(simulator.hand_position.copy())
        self._meters.append((simulator.time.copy(), simulator.electrical_energy.copy()))
        self._age += 1

    def _power(self, i: int) -> Array:
        past = list(self._meters)[-min(int(self._age[i]), len(self._meters)) :]
        passed = past[-1][0][i] - past[0][0][i]
        if passed <= 0.0:
            return np.zeros(self._episodes.arm.n_joints)
        return (past[-1][1][i] - past[0][1][i]) / passed

    def scene(self, i: int = 0) -> Scene:
        """Scene of arm i now."""
        episodes, simulator = self._episodes, self._episodes.simulator
        population = episodes.population
        moved = "length" in population.randomization.ranges or population.changed
        arm = population.arms(np.array([i]))[0] if moved else episodes.arm
        joints = joint_positions(arm, simulator.q[i])
        circle, target = episodes.targets.circles[i], episodes.target()[i]
        trace = [hands[i] for hands in list(self._hands)[-int(self._age[i]) :]]
        elbows: tuple[int, ...] = simulator.elbows
        contacts: tuple[int, ...] = elbows
        forces = np.zeros((len(elbows), 3))
        forces[:, 2] = simulator.elbow_force[i]
        support = (str(len(elbows)), "elbow" if len(elbows) == 1 else "elbows")
        if simulator.conditions.surface is not None:
            along = simulator.contact_force[i]
            touching = range(3, arm.n_joints + 2)
            cosine, sine = math.cos(simulator.q[i, 0]), math.sin(simulator.q[i, 0])
            turned = np.stack(
                [cosine * along[:, 0] - sine * along[:, 1], sine * along[:, 0] + cosine * along[:, 1], along[:, 2]],
                axis=-1,
            )
            bearing = tuple(joint for joint, force in zip(touching, along[:, 2], strict=True) if force > 0.0)
            elbows, contacts = (*elbows, *bearing), (*contacts, *touching)
            forces = np.concatenate([forces, turned])
            support = (str(len(bearing) + len(simulator.elbows)), "on the table")
        return Scene(
            joints=joints,
            path=circle.position(np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)),
            target=target,
            trace=np.array([*trace, joints[-1]]),
            elbows=elbows,
            contacts=contacts,
            forces=forces,
            power=self._power(i),
            energy=float(simulator.electrical_energy[i].sum()),
            error=float(np.linalg.norm(joints[-1] - target)),
            time=float(simulator.time[i]),
            support=support,
            may_pull=len(simulator.elbows) > 0,
            payload=float(population.values["payload"][i]),
        )

    @property
    def renderer(self) -> Renderer:
        """Renderer of the pictures, made when it is first needed."""
        if self._renderer is None:
            self._renderer = Renderer(stage_of(self._episodes), *self._size, self._accent)
        return self._renderer

    def picture(self, i: int = 0) -> Pixels:
        """New picture (height, width, 3) of arm i."""
        return self.renderer.draw(self.scene(i))

    def _show(self) -> None:
        if self._window.closed:
            return
        shown = [self.picture(i) for i in range(min(SHOWN_ARMS, self._episodes.num_envs))]
        columns = 1 if len(shown) == 1 else 2
        shown += [np.zeros_like(shown[0])] * (-len(shown) % columns)
        rows = [np.concatenate(shown[k : k + columns], axis=1) for k in range(0, len(shown), columns)]
        self._window.show(np.concatenate(rows), self._rate)

    def close(self) -> None:
        """Closes the window. May be called twice."""
        self._window.close()


def stage_of(episodes: Episodes) -> Stage:
    """Stage for these arms: the camera views an arm on its path from the side, with the way there in the picture."""
    arm, length = episodes.arm, episodes.arm.of_links("length")
    reach = float(length.sum())
    path = episodes.circle.widest.position(np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False))
    start = joint_positions(arm, episodes.pose)
    goal = math.atan2(*path[:, 1::-1].mean(axis=0))
    turn = 0.0
    if episodes.settings.start == "paper":
        turn = math.remainder(goal - float(episodes.pose[0]), 2.0 * math.pi)
    points = [path, np.zeros((1, 3))]
    for azimuth in np.linspace(goal - 1.25 * turn, goal, 9):
        for height in (0.0, 0.1 * reach):
            radius = np.hypot(start[:, 0], start[:, 1])
            around = np.stack([radius * math.cos(azimuth), radius * math.sin(azimuth), start[:, 2] + height], axis=-1)
            points.append(around)
    return Stage(
        reach=reach,
        weight=max(1.0, arm.gravity * float(arm.of_links("mass").sum())),
        radius=min(0.015 * reach, 0.45 * float(np.median(length[length > 0.0]))),
        seen=np.concatenate(points),
        azimuth=goal + math.copysign(math.radians(100.0), -turn if turn else -1.0),
    )
