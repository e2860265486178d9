"""Compilation before processes start, and the cores that they may use."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, TextIO

from elbow_gym.task.settings import Settings

BATCH = 16
"""Arms of an environment whose number does not matter, as long as it is no single arm's kernel that steps them."""
PATIENCE = 2.0
"""Time after which a compilation is announced [s]."""
COMPILE_SECONDS = 15
"""Approximate time that one kernel takes to compile [s]."""
WITHOUT_KERNEL: dict[str, Any] = {
    "control_frequency": 50.0,
    "timestep": None,
    "voltage_limit": 24.0,
    "action_unit": "fraction",
    "start": "paper",
    "start_noise": 0.0,
}
"""Arguments of an environment that no kernel depends on, as `compile_before` sets them."""


class _WithoutNotice:
    """Stream without the kernel's notices that it compiles."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._dropped = stream, False

    def write(self, text: str) -> int:
        """Passes text on, unless it is a notice or the end of its line."""
        drop = text.startswith("elbow_gym: compiling") or (self._dropped and text == "\n")
        self._dropped = drop and text != "\n"
        return len(text) if drop else self._stream.write(text)

    def flush(self) -> None:
        """Flushes the stream behind."""
        self._stream.flush()


def compile_before(
    batches: Iterable[Settings | tuple[Settings, int]], others: Mapping[Callable[[], Any], int] | None = None
) -> None:
    """Compiles the kernels that environments will need, here and one after the other, before processes start.

    Otherwise each process would compile the same kernel at the same time. Nothing is compiled or said when Numba's
    cache has them; one line on stderr says about how long it takes when it has not.

    Args:
        batches: settings of the environments, each alone or with the number of arms side by side; alone they mean
            a batch. Up to two arms have another kernel than more.
        others: calls that compile something else, and about how long each takes [s].
    """
    import numpy as np

    from elbow_gym.vector_env import ElbowArmVectorEnv

    wanted: list[tuple[Settings, int]] = []
    for batch in batches:
        settings, arms = (batch, BATCH) if isinstance(batch, Settings) else batch
        alike = replace(settings, **WITHOUT_KERNEL), arms
        if alike not in wanted:
            wanted.append(alike)
    kernels = {(settings.table is False, arms <= 2) for settings, arms in wanted}
    others = others or {}
    seconds = COMPILE_SECONDS * len(kernels) + sum(others.values())
    notice = f"Compiling the kernel for this machine, once: about {seconds} s of CPU time."
    said = threading.Event()

    def say() -> None:
        if not said.is_set():
            said.set()
            print(notice, file=stream, flush=True)

    def step_once(settings: Settings, arms: int) -> None:
        env = ElbowArmVectorEnv(arms, **settings.arguments)
        env.reset(seed=0)
        env.step(np.zeros((arms, settings.parsed_arm.n_joints), dtype=np.float32))

    stream = sys.stderr
    with contextlib.redirect_stderr(_WithoutNotice(stream)):
        for work in (*(partial(step_once, *batch) for batch in wanted), *others):
            timer = threading.Timer(PATIENCE, say)
            timer.daemon = True
            timer.start()
            try:
                work()
            finally:
                timer.cancel()


def cores() -> int:
    """Number of cores that this process may use, which a job's affinity can make fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
