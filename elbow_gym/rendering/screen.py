"""Fonts, pixels and the window of pygame-ce, which is imported only where something is drawn."""

from __future__ import annotations

import os
from importlib.util import find_spec
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]


def can_draw() -> bool:
    """Whether pygame is installed."""
    return find_spec("pygame") is not None


def load_pygame() -> Any:
    """The module pygame with its fonts ready; nothing else of it is initialised, and no display is needed.

    Raises gymnasium's DependencyNotInstalled where it is missing.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        raise gym.error.DependencyNotInstalled(
            'pygame-ce is not installed, run `pip install "elbow-gym[render]"`'
        ) from error
    pygame.font.init()
    return pygame


def pixels_of(surface: Any) -> Pixels:
    """A fresh array (height, width, 3) of a surface's colours."""
    pygame = load_pygame()
    width, height = surface.get_size()
    return np.frombuffer(pygame.image.tobytes(surface, "RGB"), dtype=np.uint8).reshape(height, width, 3).copy()


def display_driver() -> str | None:
    """Name of SDL's driver for windows; None where there is no display."""
    pygame = load_pygame()
    ready = pygame.display.get_init()
    try:
        pygame.display.init()
        driver = pygame.display.get_driver()
    except pygame.error:
        return None
    finally:
        if not ready:
            pygame.display.quit()
    return None if driver in ("dummy", "offscreen") else str(driver)


class Window:
    """A window that opens with its first picture. Once the user has closed it, it stays closed.

    pygame has one display: another window's next picture takes it over.

    Args:
        title: text in the bar of the window.
    """

    _shown: ClassVar[Window | None] = None

    def __init__(self, title: str) -> None:
        self._title = title
        self.closed = False
        """Whether the user has closed it."""

    def show(self, pixels: Pixels, frames_per_second: float) -> None:
        """Shows a picture (height, width, 3), not earlier than a frame's time after the one before."""
        if self.closed:
            return
        pygame = load_pygame()
        if Window._shown is not self or not pygame.display.get_init():
            pygame.display.init()
            pygame.display.set_caption(self._title)
            pygame.display.set_mode(pixels.shape[1::-1])
            Window._shown, self._clock = self, pygame.time.Clock()
        pygame.surfarray.blit_array(pygame.display.get_surface(), pixels.swapaxes(0, 1))
        pygame.display.flip()
        self._clock.tick(frames_per_second)
        if pygame.event.get(pygame.QUIT):
            self.close()
            self.closed = True
            return
        pygame.event.clear()

    def close(self) -> None:
        """Closes the window. May be called twice."""
        if Window._shown is self:
            load_pygame().display.quit()
            Window._shown = None
