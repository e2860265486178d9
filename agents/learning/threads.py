"""Number of threads that torch and BLAS take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread for torch and BLAS inside: small networks lose more by handing work to threads than they gain.

    On more threads BLAS would also add up in another order.
    """
    # Loaded here, since the limit reaches nothing that is loaded later; compiled products of matrices are this BLAS's.
    import scipy.linalg  # noqa: F401  # pyright: ignore[reportUnusedImport]
    import torch
    from threadpoolctl import threadpool_limits

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with threadpool_limits(1, user_api="blas"):
            yield
    finally:
        torch.set_num_threads(threads)
