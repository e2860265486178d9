"""CasADi, sparse matrices gathered block by block, and interpolation between the points of two meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def casadi() -> Any:
    """The module casadi, told what NumPy's functions on its symbols mean, of which it warns from 3.8 on otherwise."""
    import casadi as ca

    if hasattr(ca.GlobalOptions, "setNumpyMode"):
        ca.GlobalOptions.setNumpyMode(-1)
    return ca


def lagrange(nodes: Array, at: Array) -> Array:
    """Matrix (len(at), len(nodes)) from a polynomial's values at nodes to those at other places."""
    return np.linalg.solve(np.vander(nodes).T, np.vander(at, nodes.size).T).T


class Triplets:
    """Entries of a sparse matrix, gathered block by block."""

    def __init__(self) -> None:
        self._rows: list[Array] = []
        self._columns: list[Array] = []
        self._values: list[Array] = []

    def add(self, rows: Any, columns: Any, values: Array) -> None:
        """Adds entries at rows and columns, all three (k,)."""
        self._rows.append(rows)
        self._columns.append(columns)
        self._values.append(values)

    @property
    def triplets(self) -> tuple[Array, tuple[Array, Array]]:
        """Values, and their rows and columns, as SciPy takes them."""
        return np.concatenate(self._values), (np.concatenate(self._rows), np.concatenate(self._columns))


def casadi_matrix(matrix: Any) -> Any:
    """CasADi's form of a sparse matrix of SciPy's."""
    ca = casadi()
    matrix = matrix.tocsc()
    matrix.sum_duplicates()
    matrix.sort_indices()
    places = ca.Sparsity(*matrix.shape, matrix.indptr.tolist(), matrix.indices.tolist())
    return ca.DM(places, matrix.data)
