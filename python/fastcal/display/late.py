# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Functions that lie above their callers, by name: `robot.save(path)` writes a file, and no robot imports files.

`fastcal/__init__.py` binds the names; a home is imported at its first call. Nothing that computes calls any of them.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

_HOMES: dict[str, str] = {}


def bind(homes: Mapping[str, str]) -> None:
    """Adds names and their homes, `MODULE:FUNCTION`."""
    _HOMES.update(homes)


def call(name: str, /, *arguments: Any, **options: Any) -> Any:
    """Calls the function that is bound to `name`."""
    module, _, function = _HOMES[name].partition(":")
    return getattr(importlib.import_module(module), function)(*arguments, **options)
