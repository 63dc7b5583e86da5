# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Residual models as plain numbers: settings that JSON can hold and named arrays, checked when they are read back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput


class Packed(NamedTuple):
    """Settings and arrays of one part."""

    settings: dict[str, Any]
    tensors: dict[str, NDArray[Any]]

    def under(self, prefix: str) -> dict[str, NDArray[Any]]:
        """The arrays with a name in front."""
        return {f"{prefix}.{name}": value for name, value in self.tensors.items()}


class Tensors:
    """Arrays of a file, taken one by one; `done` refuses what was not taken.

    Args:
        values: Arrays by name.
        prefix: In front of the names that are taken, of a part.
    """

    def __init__(self, values: Mapping[str, NDArray[Any]], prefix: str = "", left: set[str] | None = None) -> None:
        self._values = values
        self._prefix = prefix
        self._left = set(values) if left is None else left

    def part(self, name: str) -> Tensors:
        """The arrays of one part."""
        return Tensors(self._values, f"{self._prefix}{name}.", self._left)

    def take(self, name: str, shape: tuple[int | None, ...]) -> FloatArray:
        """A finite array as float64; None in `shape` is any size of at least 1.

        Raises:
            InvalidInput: It is missing, of another shape, or holds what is no finite number.
        """
        full = f"{self._prefix}{name}"
        if full not in self._values:
            raise InvalidInput(f"expected the array {full}, which is not there")
        value = self._values[full]
        self._left.discard(full)
        fits = value.ndim == len(shape) and all(
            got > 0 and want in (None, got) for want, got in zip(shape, value.shape, strict=True)
        )
        if not fits:
            sizes = ", ".join("any" if size is None else str(size) for size in shape)
            raise InvalidInput(f"the array {full} must have shape ({sizes}), got {value.shape}")
        if value.dtype.kind not in "fi" or not np.isfinite(value).all():
            raise InvalidInput(f"the array {full} must hold finite numbers, and does not")
        return np.asarray(value, dtype=np.float64)

    def take_wide(self, name: str, rows: int) -> FloatArray:
        """(rows, 6), or (rows, 3) where points alone were measured."""
        value = self.take(name, (rows, None))
        if value.shape[1] not in (3, 6):
            raise InvalidInput(f"the array {self._prefix}{name} must have 3 or 6 columns, got {value.shape[1]}")
        return value

    def done(self) -> None:
        """Refuses arrays that no part of the model asked for."""
        if self._left:
            raise InvalidInput(f"the array {min(self._left)} belongs to no part of the model")


def setting(settings: Any, name: str, kind: type | tuple[type, ...]) -> Any:
    """A setting of the expected type.

    Raises:
        InvalidInput: It is missing or of another type.
    """
    if not isinstance(settings, dict) or not isinstance(settings.get(name), kind) or settings.get(name) is True:
        raise InvalidInput(f"expected the setting {name}, got {str(settings)[:60]!r}")
    return settings[name]
