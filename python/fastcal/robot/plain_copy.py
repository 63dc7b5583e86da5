# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Copies of robot specs: mappings and lists of numbers and texts, which `copy.deepcopy` takes long to copy."""

from __future__ import annotations

import copy
from typing import TypeVar

Plain = TypeVar("Plain")

_SHARED = frozenset([str, float, int, bool, type(None)])


def plain_copy(value: Plain) -> Plain:
    """The value with mappings and lists made again, at any depth; what is neither they nor immutable, by `deepcopy`."""
    kind = type(value)
    if kind is dict:
        return {key: plain_copy(entry) for key, entry in value.items()}  # type: ignore[attr-defined,return-value]
    if kind is list:
        # Most entries are numbers: a call for each would take longer than everything else.
        return [e if type(e) in _SHARED else plain_copy(e) for e in value]  # type: ignore[attr-defined,return-value]
    return value if kind in _SHARED else copy.deepcopy(value)
