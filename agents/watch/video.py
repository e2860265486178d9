"""Video files: GIF through Pillow, MP4 through ffmpeg."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import write_whole

FRAME_RATES = {".gif": 100.0 / 6.0, ".mp4": 25.0}
"""Pictures per second of each kind of file; both are whole numbers of 50 Hz control periods apart, and GIF counts in
hundredths of a second."""
COLOURS = 128
"""Number of colours in a GIF's palette."""
VIVID = 60
"""Distance between the channels of a colour beyond which it is no grey (0-255)."""

Pixels = NDArray[np.uint8]


def check_video(path: Path) -> None:
    """Raises ValueError unless the file's suffix is one that can be written."""
    if path.suffix.lower() not in FRAME_RATES:
        raise ValueError(f"output must end in one of {list(FRAME_RATES)}, got {path.name!r}")


def write_video(path: Path, frames: Iterable[Pixels], frames_per_second: float, hold: float = 0.0) -> Path:
    """Writes pictures (height, width, 3) to a .gif, which repeats, or an .mp4, whole or not at all.

    Args:
        path: path of the file.
        frames: at least one picture, all of one size.
        frames_per_second: pictures per second [Hz].
        hold: time for which the last one stays [s].

    Raises ValueError on another suffix.
    """
    check_video(path)
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    return write_whole(path, lambda temporary: write(temporary, frames, frames_per_second, hold))


def _write_gif(path: Path, frames: Iterable[Pixels], frames_per_second: float, hold: float) -> None:
    from PIL import Image

    plain = [Image.fromarray(frame) for frame in frames]
    # One palette for all and no dithering: what does not change then costs nothing.
    some = np.stack([np.asarray(plain[k]) for k in np.linspace(0, len(plain) - 1, 8).astype(int)])
    vivid = some[some.max(axis=-1).astype(int) - some.min(axis=-1) > VIVID]
    # Few pixels have the colours that carry meaning; as many more of them keep those in the palette.
    shown = np.concatenate([*some, *np.resize(vivid, (8 if len(vivid) else 0, *some.shape[1:]))])
    palette = Image.fromarray(shown).quantize(COLOURS, dither=Image.Dither.NONE)
    first, *rest = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in plain)
    duration = [round(1000.0 / frames_per_second)] * len(plain)
    duration[-1] += round(1000.0 * hold)
    first.save(path, save_all=True, append_images=rest, duration=duration, loop=0, optimize=False)


def _write_mp4(path: Path, frames: Iterable[Pixels], frames_per_second: float, hold: float) -> None:
    from imageio_ffmpeg import write_frames

    writer: Any = None
    try:
        for frame in _held(frames, round(hold * frames_per_second)):
            # The usual kind of MP4 has sides of whole pairs of pixels.
            even = np.ascontiguousarray(frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2])
            if writer is None:
                size = (even.shape[1], even.shape[0])
                writer = write_frames(str(path), size, fps=frames_per_second, quality=8, macro_block_size=2)
                writer.send(None)
            writer.send(even)
    finally:
        # Otherwise ffmpeg goes on writing the file of an interrupted video.
        if writer is not None:
            writer.close()


def _held(frames: Iterable[Pixels], count: int) -> Iterator[Pixels]:
    last: list[Pixels] = []
    for frame in frames:
        last = [frame]
        yield frame
    yield from chain.from_iterable([last] * count)
