# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Stiffness of a beam element that comes as a matrix: from a finite-element program, constant or sampled over postures.

The matrix of an element in its local axes (x from start to end), B = 3 (ux, uy, rz) or 6 (ux, uy, uz, rx, ry, rz):

    [f_start; f_end] = [K_ss K_se; K_es K_ee] [u_start; u_end]

Equilibrium leaves K_ee alone to choose: f_start = -H f_end with H the wrench transport over the element's length. So
matrices are taken either whole, (2B, 2B), or as K_ee, (B, B), the stiffness of the end with the start clamped.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput

EQUILIBRIUM = 1e-6
"""Largest sum of the forces of both ends, relative to K_ee: what a finite-element program rounds off, no support."""


def as_numbers(name: str, value: ArrayLike) -> FloatArray:
    """The value as a finite, C-order float64 array; anything that is no real number raises InvalidInput."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise InvalidInput(f"{name} must be real numbers, got an array of {array.dtype}")
    array = np.asarray(array, dtype=np.float64, order="C")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidInput(f"{name} must be finite, got {array[where]} at index {where}")
    return array


def rows(name: str, value: ArrayLike, shape: tuple[int, ...], count: int) -> FloatArray:
    """The value with `shape`, one for all postures, or (count, *shape); another shape raises InvalidInput."""
    numbers = as_numbers(name, value)
    if numbers.shape not in (shape, (count, *shape)):
        raise InvalidInput(f"{name} must have shape {shape} or {(count, *shape)}, got {numbers.shape}")
    return numbers


def end_stiffness(name: str, matrix: ArrayLike, size: int) -> FloatArray:
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

    def __call__(self, angle_rad: ArrayLike, extension_m: ArrayLike) -> FloatArray:
        """K_ee (N, B, B) at N pairs; outside the sampled range by more than 5 % of it raises InvalidInput."""
        angle = np.atleast_1d(as_numbers("angle_rad", angle_rad))
        extension = np.atleast_1d(as_numbers("extension_m", extension_m))
        return np.asarray(self._core.evaluate(angle, extension)).reshape(-1, self.size, self.size)

    def __repr__(self) -> str:
        return f"StiffnessTable({self.size} x {self.size}, relative error {self.relative_error:.1e})"


ElementStiffness = StiffnessTable | ArrayLike | None


class ElementMatrices:
    """The elements of a frame whose stiffness is no section's.

    Args:
        stiffness: {element: a matrix, a StiffnessTable, or None where every call brings its own}.
        element_count: How many elements the frame has.
        size: B, 3 or 6.

    Attributes:
        own: {element: what it was given}, ascending.
    """

    def __init__(self, stiffness: Mapping[int, ElementStiffness], element_count: int, size: int) -> None:
        self.size = size
        self.own: dict[int, StiffnessTable | FloatArray | None] = {}
        for index in sorted(stiffness):
            given, name = stiffness[index], f"stiffness of element {index}"
            if not 0 <= index < element_count:
                raise InvalidInput(f"there is no element {index} to have a stiffness; there are {element_count}")
            if given is None:
                self.own[index] = None
            elif isinstance(given, StiffnessTable):
                if given.size != size:
                    raise InvalidInput(f"the {name} has {given.size} displacements a node, the frame {size}")
                self.own[index] = given
            else:
                matrix = end_stiffness(name, given, size)
                if matrix.ndim != 2:
                    raise InvalidInput(
                        f"{name} must be one matrix, got shape {matrix.shape}; give None, and it to solve"
                    )
                self.own[index] = matrix

    def at(
        self, count: int, angle_rad: ArrayLike | None, extension_m: ArrayLike | None, given: Mapping[int, ArrayLike]
    ) -> FloatArray | None:
        """K_ee (T, B, B), or (N, T, B, B) where one changes, of these T elements at N = count postures."""
        unknown = sorted(set(given) - set(self.own))
        if unknown:
            raise InvalidInput(f"element {unknown[0]} was made with a section: give BeamFrame a stiffness for it first")
        if not self.own:
            return None
        shape = (self.size, self.size)
        matrices = []
        for index, own in self.own.items():
            name = f"stiffness of element {index}"
            if index in given:
                matrices.append(rows(name, end_stiffness(name, given[index], self.size), shape, count))
            elif isinstance(own, StiffnessTable):
                if angle_rad is None or extension_m is None:
                    raise InvalidInput(f"the {name} is a table: angle_rad and extension_m are needed")
                matrices.append(
                    own(_postures("angle_rad", angle_rad, count), _postures("extension_m", extension_m, count))
                )
            elif own is None:
                raise InvalidInput(f"the {name} must be given with the postures")
            else:
                matrices.append(own)
        if all(matrix.ndim == 2 for matrix in matrices):
            return np.stack(matrices)
        return np.stack([np.broadcast_to(matrix, (count, *shape)) for matrix in matrices], axis=1).copy(order="C")


def _postures(name: str, values: ArrayLike, count: int) -> FloatArray:
    numbers = as_numbers(name, values)
    if numbers.shape != (count,):
        raise InvalidInput(f"{name} must have shape ({count},), got {numbers.shape}")
    return numbers
