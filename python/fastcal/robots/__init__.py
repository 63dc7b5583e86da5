# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arms that come with fastcal, by name: `load_robot("ur5")`."""

from __future__ import annotations

from pathlib import Path

_FOLDER = Path(__file__).parent


def available() -> tuple[str, ...]:
    """Names of the shipped arms, sorted."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.yaml")))


def path_of(name: str) -> Path | None:
    """The file of a shipped arm; None where there is none of that name."""
    return _FOLDER / f"{name}.yaml" if name in available() else None
