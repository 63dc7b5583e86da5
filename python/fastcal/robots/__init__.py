# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arms that come with fastcal, by name: `load_robot("ur5")`."""

from __future__ import annotations

import difflib
import re
from pathlib import Path

FOLDER = Path(__file__).parent
_SHORTEST = 3  # characters of a part of a name that is taken for it


def available() -> tuple[str, ...]:
    """Names of the shipped arms, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def serial() -> tuple[str, ...]:
    """Names of the shipped arms that are chains of joints, sorted; the others have closed loops."""
    return tuple(name for name in available() if "\nloops:" not in _text(name))


def path_of(name: str) -> Path | None:
    """The file of a shipped arm; case, spaces, dots, - and _ do not matter. None where there is none of that name.

    A text with a folder in it, such as ./ur5, is no name.
    """
    if "/" in name or "\\" in name:
        return None
    return next((FOLDER / f"{arm}.yaml" for arm in available() if _plain(arm) == _plain(name)), None)


def likely(name: str) -> list[str]:
    """Shipped arms of which `name` is the beginning of a part: "kr500" of kuka_kr500_3, "irb 6700" of abb_irb6700."""
    wanted = _plain(name)
    if len(wanted) < _SHORTEST or "/" in name:
        return []
    return [arm for arm in available() if any(part.startswith(wanted) for part in _endings(arm))]


def similar(name: str) -> list[str]:
    """Shipped arms, at most two, whose names are nearly `name`: kr6_r901 is nearly kuka_kr6_r900."""
    wanted = _plain(name)
    endings = {ending: arm for arm in available() for ending in _endings(arm) if len(ending) >= _SHORTEST}
    near = difflib.get_close_matches(wanted, endings, n=4, cutoff=0.75)
    return list(dict.fromkeys(endings[ending] for ending in near))[:2]


def about(name: str) -> str:
    """The first sentence at the head of an arm's file: what it is."""
    lines = _text(name).splitlines()
    head = " ".join(line.lstrip("# ") for line in lines if line.startswith("#") and "SPDX" not in line).strip()
    return re.split(r"(?<=[^A-Z])[:.] ", head, maxsplit=1)[0].rstrip(".")


def _text(name: str) -> str:
    return (FOLDER / f"{name}.yaml").read_text(encoding="utf-8")


def _plain(name: str) -> str:
    return re.sub(r"[\s._-]", "", name).lower()


def _endings(arm: str) -> list[str]:
    """kuka_kr500_3 to kukakr5003, kr5003, 3."""
    parts = arm.split("_")
    return ["".join(parts[first:]) for first in range(len(parts))]
