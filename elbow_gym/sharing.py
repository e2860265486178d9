"""Arms spread over threads in whole blocks, so that no result depends on how many threads there are."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np


class Sharing:
    """Runs a function over ranges of arms, one range per thread.

    Args:
        num_envs: the number of arms.
        lanes: arms in a block, which stays whole.
        num_threads: ranges at most.
    """

    def __init__(self, num_envs: int, lanes: int, num_threads: int) -> None:
        blocks = -(-num_envs // lanes)
        edges = np.linspace(0, blocks, min(num_threads, blocks) + 1).round().astype(int) * lanes
        self._shares = [(int(a), min(int(b), num_envs)) for a, b in itertools.pairwise(edges)]
        self._pool = ThreadPoolExecutor(len(self._shares) - 1) if len(self._shares) > 1 else None

    def total(self, work: Callable[[int, int], int]) -> int:
        """The sum of `work(first, end)` over all shares, when every one is done."""
        if self._pool is None:
            return work(*self._shares[0])
        # This thread takes the first share itself: one hand-over less.
        others = [self._pool.submit(work, *share) for share in self._shares[1:]]
        return work(*self._shares[0]) + sum(other.result() for other in others)
