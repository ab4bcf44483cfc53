"""Linear algebra of Newton's method on a path, whose Hessian is a narrow band as neighbours alone are coupled."""

from __future__ import annotations

import math

import numpy as np

from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import inlined

_DAMPING = 1e-9  # on the Hessian's diagonal, relative


@inlined
def make_positive(matrix: Array) -> None:
    """Set the negative eigenvalues of a symmetric matrix (3, 3) to zero."""
    eigenvalues, eigenvectors = np.linalg.eigh(matrix)
    matrix[:, :] = 0.0
    for k in range(3):
        for a in range(3):
            for b in range(3):
                matrix[a, b] += max(eigenvalues[k], 0.0) * eigenvectors[a, k] * eigenvectors[b, k]


@inlined
def solve_banded(band: Array, gradient: Array, step: Array) -> float:
    """Solve Hessian times step = gradient by a Cholesky factorisation in place; return gradient times step."""
    size, width = band.shape[0], band.shape[1] - 1
    for i in range(size):
        band[i, 0] += _DAMPING * band[i, 0] + 1e-12
        for j in range(max(0, i - width), i + 1):
            total = band[i, i - j]
            for k in range(max(0, i - width, j - width), j):
                total -= band[i, i - k] * band[j, j - k]
            band[i, i - j] = total / band[j, 0] if i != j else math.sqrt(max(total, 1e-300))
    for i in range(size):
        total = gradient[i]
        for k in range(max(0, i - width), i):
            total -= band[i, i - k] * step[k]
        step[i] = total / band[i, 0]
    for i in range(size - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, min(size, i + width + 1)):
            total -= band[k, k - i] * step[k]
        step[i] = total / band[i, 0]
    decrement = 0.0
    for i in range(size):
        decrement += gradient[i] * step[i]
    return decrement
