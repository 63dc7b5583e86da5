# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Stiffness of a beam element that comes as a matrix: from a finite-element program, constant or sampled over postures.

The matrix of an element in its local axes (x from start to end), B = 3 (ux, uy, rz) or 6 (ux, uy, uz, rx, ry, rz):

    [f_start; f_end] = [K_ss K_se; K_es K_ee] [u_start; u_end]

Equilibrium leaves K_ee alone to choose: f_start = -H f_end with H the wrench transport over the element's length. So
matrices are taken either whole, (2B, 2B), or as K_ee, (B, B), the stiffness of the end with the start clamped.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal import _core
from fastcal.errors import InvalidInput

Array = NDArray[np.float64]

EQUILIBRIUM = 1e-6
"""Largest sum of the forces of both ends, relative to K_ee: what a finite-element program rounds off, and no support."""


def as_numbers(name: str, value: ArrayLike) -> Array:
    """The value as a finite, C-order float64 array; anything that is no real number raises InvalidInput."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise InvalidInput(f"{name} must be real numbers, got an array of {array.dtype}")
    array = np.asarray(array, dtype=np.float64, order="C")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidInput(f"{name} must be finite, got {array[where]} at index {where}")
    return array


def end_stiffness(name: str, matrix: ArrayLike, size: int) -> Array:
    """K_ee of whole or clamped matrices.

    Args:
        name: What to call it in an error.
        matrix: (..., size, size) K_ee, or (..., 2 size, 2 size) the whole matrix.
        size: B, 3 in a plane frame and 6 in space.

    Returns:
        (..., size, size) K_ee.

    Raises:
        InvalidInput: Another shape, or a whole matrix that holds a force without an opposite one.
    """
    stiffness = as_numbers(name, matrix)
    if stiffness.ndim >= 2 and stiffness.shape[-2:] == (size, size):
        return stiffness
    if stiffness.ndim < 2 or stiffness.shape[-2:] != (2 * size, 2 * size):
        raise InvalidInput(
            f"{name} must end in shape ({size}, {size}), the end with the start clamped, or ({2 * size}, {2 * size}), "
            f"the whole element, got {stiffness.shape}"
        )
    translations = 2 if size == 3 else 3
    forces = stiffness[..., :translations, :] + stiffness[..., size : size + translations, :]
    if np.abs(forces).max() > EQUILIBRIUM * np.abs(stiffness[..., size:, size:]).max():
        raise InvalidInput(f"{name} is not the matrix of a free element: the forces at its two ends do not cancel")
    return np.ascontiguousarray(stiffness[..., size:, size:])


class StiffnessTable:
    """Stiffness over the posture, fitted to samples: K_ij(angle, extension) = f_ij(extension) g_ij(angle).

    f and g are polynomials; every entry is fitted by itself by least squares (the spray-painting paper's eq. 25, its
    unit 9 over theta5 and d6).

    Args:
        angle_rad: (S,) angle of each sample.
        extension_m: (S,) extension of each sample.
        matrices: (S, 3, 3), (S, 6, 6) or (S, 12, 12): K_ee or the whole matrix in local axes, SI.
        dimension: 2 for a plane frame, 3 for a space frame.
        angle_degree: Degree of g.
        extension_degree: Degree of f.

    Attributes:
        relative_error: Largest |K_fit - K|_ij / sqrt(K_ii K_jj) over the samples; look at it.

    Raises:
        InvalidInput: Too few samples for the degrees, or a sample that is not symmetric and positive definite.
    """

    def __init__(
        self,
        angle_rad: ArrayLike,
        extension_m: ArrayLike,
        matrices: ArrayLike,
        *,
        dimension: int,
        angle_degree: int = 4,
        extension_degree: int = 4,
    ) -> None:
        if dimension not in (2, 3):
            raise InvalidInput(f"dimension must be 2 or 3, got {dimension}")
        self.size = 3 if dimension == 2 else 6
        stiffness = end_stiffness("matrices", matrices, self.size)
        if stiffness.ndim != 3:
            raise InvalidInput(f"matrices must have shape (S, {self.size}, {self.size}), got {stiffness.shape}")
        angle, extension = as_numbers("angle_rad", angle_rad), as_numbers("extension_m", extension_m)
        for name, values in (("angle_rad", angle), ("extension_m", extension)):
            if values.shape != stiffness.shape[:1]:
                raise InvalidInput(f"{name} must have shape ({stiffness.shape[0]},), got {values.shape}")
        flat = stiffness.reshape(len(stiffness), -1)
        self._core = _core.StiffnessTable(angle, extension, flat, angle_degree, extension_degree)

    @property
    def relative_error(self) -> float:
        """Largest misfit over the samples."""
        return self._core.relative_error

    def __call__(self, angle_rad: ArrayLike, extension_m: ArrayLike) -> Array:
        """K_ee (N, B, B) at N pairs; outside the sampled range by more than 5 % of it raises InvalidInput."""
        angle = np.atleast_1d(as_numbers("angle_rad", angle_rad))
        extension = np.atleast_1d(as_numbers("extension_m", extension_m))
        return np.asarray(self._core.evaluate(angle, extension)).reshape(-1, self.size, self.size)

    def __repr__(self) -> str:
        return f"StiffnessTable({self.size} x {self.size}, relative error {self.relative_error:.1e})"
