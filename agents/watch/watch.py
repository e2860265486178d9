"""Controllers at work, in a window in real time or in a file, alone or side by side and in step."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from agents.evaluation.players import find_player
from agents.tasks import Elbows
from agents.watch.video import FRAME_RATES, Pixels, check_video, write_video
from elbow_gym.checks import positive
from elbow_gym.rendering.overlay import Instruments
from elbow_gym.rendering.painter import Colour
from elbow_gym.rendering.screen import Window, display_driver, load_pygame, pixels_of
from elbow_gym.rendering.viewer import Viewer
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

WINDOW_RATE = 50.0
"""Pictures per second in a window [Hz]."""
HOLD = 2.0
"""Time for which a file shows its last picture [s]."""
LABEL_HEIGHT = 30.0
"""Height of the label under a picture of 640 by 480 [pixels]."""


def rgb(colour: str) -> Colour:
    """Red, green and blue (0-255) of a colour #rrggbb."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue


class Performance:
    """Controller in its environment, at its control rate.

    Args:
        name: name of the player, as `find_player` takes it.
        env: id of the environment.
        elbows: elbows on the table; the environment's own number when None.
        start: the environment's `start`.
        size: width and height of its pictures without the label [pixels].
        arguments: further arguments of the environment.
        trust: whether a file that may run code when it is read may be read.
    """

    def __init__(
        self,
        name: str,
        env: str,
        elbows: Elbows | None,
        start: str,
        size: tuple[int, int],
        arguments: Mapping[str, Any] = MappingProxyType({}),
        trust: bool = False,
    ) -> None:
        player = find_player(name, elbows, env, arguments, trust)
        self.settings = player.settings
        """Arguments of the environment."""
        self._env = ElbowArmVectorEnv(1, **replace(player.settings, start=start).arguments, autoreset_mode="Disabled")
        self._controller = player.make(self._env)
        self._viewer = Viewer(self._env.episodes, "rgb_array", *size, accent=rgb(player.colour))
        self._label = label(player.label, rgb(player.colour), size)
        self.duration = player.settings.duration
        """Duration of an episode [s]."""

    def restart(self, seed: int) -> None:
        """Starts an episode."""
        self._observation, _ = self._env.reset(seed=[seed])
        self._viewer.restart()
        self._over = False

    def advance(self, time: float) -> None:
        """Runs on to the last control period that ends by a time since the start [s]."""
        period = self._env.settings.control_period
        while not self._over and self._env.episodes.simulator.time[0] + period <= time + 1e-9:
            action, _ = self._controller.predict(self._observation, deterministic=True)
            self._observation, _, terminated, truncated, _ = self._env.step(action)
            self._viewer.follow()
            self._over = bool(terminated[0] or truncated[0])

    def picture(self) -> Pixels:
        """Picture of the arm now, with the label under it."""
        return np.concatenate([self._viewer.picture(), self._label])


def label(title: str, colour: Colour, size: tuple[int, int]) -> Pixels:
    """A strip in the controller's colour with its name, to go under a picture of a size (width, height)."""
    write = Instruments(*size)
    strip = load_pygame().Surface((size[0], round(LABEL_HEIGHT * write.unit)))
    strip.fill(colour)
    # Black or white, whichever has more contrast by the eye's weights of red, green and blue.
    ink: Colour = (0, 0, 0) if np.dot(colour, [0.299, 0.587, 0.114]) > 120.0 else (255, 255, 255)
    write.text(strip, title, (size[0] / 2.0, 6.0 * write.unit), 26, ink, 0.5)
    return pixels_of(strip)


def frames(performances: Sequence[Performance], seed: int, frames_per_second: float, speed: float) -> Iterator[Pixels]:
    """Pictures of one episode side by side, all at the same time since their start."""
    for performance in performances:
        performance.restart(seed)
    for k in range(1 + count_frames(performances, frames_per_second, speed)):
        for performance in performances:
            performance.advance(k * speed / frames_per_second)
        yield np.concatenate([performance.picture() for performance in performances], axis=1)


def count_frames(performances: Sequence[Performance], frames_per_second: float, speed: float) -> int:
    """Pictures of the longest episode after the first; the last shows its end."""
    duration = max(performance.duration for performance in performances)
    return math.ceil(duration * frames_per_second / speed - 1e-9)


def watch(
    names: Sequence[str],
    *,
    env: str = "ElbowArm-v0",
    elbows: Elbows | None = None,
    arguments: Mapping[str, Any] = MappingProxyType({}),
    trust: bool = False,
    start: str = "paper",
    seed: int = 0,
    speed: float = 1.0,
    size: tuple[int, int] = (640, 480),
    output: Path | None = None,
    tell: Callable[[Settings], None] | None = None,
) -> Path | None:
    """Plays controllers side by side with the same start, in a window until it is closed, or once into a file.

    Without a display and without an `output` the file is named after the controllers.

    Args:
        names: names of the controllers.
        env: id of the environment.
        elbows: elbows on the table; the environment's own number when None.
        arguments: further arguments of the environment.
        trust: whether files that may run code when they are read may be read.
        start: the environment's `start`.
        seed: seed of the start pose; the window goes on with the next ones.
        speed: simulated time per second of real time [s/s].
        size: width and height of each controller's picture [pixels].
        output: a .gif or .mp4 to write instead of opening a window.
        tell: called with the first controller's settings before it plays.

    Returns:
        The file, if one was written.

    Raises:
        ValueError: on a wrong argument, by name.
    """
    positive("speed", speed)
    if output is not None:
        check_video(output)
    performances = [Performance(name, env, elbows, start, size, arguments, trust) for name in names]
    if tell is not None:
        tell(performances[0].settings)
    if output is None and display_driver() is not None:
        _into_window(performances, " and ".join(names), seed, speed)
        return None
    if output is None:
        output = Path("_versus_".join(_file_name(name) for name in names) + ".mp4")
        print(f"no display: writing {output}", file=sys.stderr)
    return _into_file(performances, seed, speed, output)


def _file_name(name: str) -> str:
    """A controller's name as a part of a file's: its label, or a path's or an import path's last part."""
    return Path(name.partition("=")[0]).stem.replace(":", "_")


def _into_window(performances: Sequence[Performance], title: str, seed: int, speed: float) -> None:
    window = Window(title)
    try:
        while not window.closed:
            for picture in frames(performances, seed, WINDOW_RATE, speed):
                window.show(picture, WINDOW_RATE)
                if window.closed:
                    break
            seed += 1
    except KeyboardInterrupt:
        pass
    finally:
        window.close()


def _into_file(performances: Sequence[Performance], seed: int, speed: float, output: Path) -> Path:
    from tqdm import tqdm

    rate = FRAME_RATES[output.suffix.lower()]
    count = 1 + count_frames(performances, rate, speed)
    pictures = tqdm(frames(performances, seed, rate, speed), total=count, desc=output.name, unit="frame")
    return write_video(output, pictures, rate, HOLD)
