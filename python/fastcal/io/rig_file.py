# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cell files of one arm, its cameras and boards, closed loops: see docs/cells.md."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fastcal.cells.pose_arm import POSE, pose_arm
from fastcal.io.fields import Fields
from fastcal.io.regular_file import is_there
from fastcal.io.rig_schema import check_arm_rig
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import frame_spec

Spec = dict[str, Any]


OF_CELLS = ("targets", "sensors")  # keys of cells that no robot alone has; known_distances of sockets it may have
TAKE_CELLS = "calibrate, evaluate, diagnose, check, update, compare, predict, simulate, design and place"


def is_cell(value: Any) -> bool:
    """Does a file name arms instead of being one?"""
    return isinstance(value, dict) and "arms" in value


def cell_spec(value: Spec, path: Path, read_arm: Callable[..., Spec]) -> Spec:
    """The robot file that a cell of one arm stands for: the arm's, on its base, with the cell's cameras, boards, loops.

    Args:
        value: What the cell file holds.
        path: Of it; the arm's file is named relative to it.
        read_arm: Reads an arm's file: path, base_link, tip_link, loops.

    Raises:
        ParseError: One sentence that names the file, the key, what was expected and what came.
    """
    top = Fields(value, "", path)
    name = top.text("cell", path.stem)
    arms = top.inner("arms").rest()
    if len(arms) != 1:
        top.refuse(
            "arms",
            f"expected one arm, got {len(arms)}; {TAKE_CELLS} take several, and convert, compensate and accept one of "
            "them with --name",
        )
    (arm, given), *_ = arms.items()
    fields = Fields({"robot": given} if isinstance(given, str) else given, f"arms.{arm}", path)
    source = fields.text("robot")
    links = {key: fields.text(key) for key in ("base_link", "tip_link") if fields.has(key)}
    on = fields.text("on", "world")
    if on != "world":
        fields.fail("on", "world, where the only arm stands", on)
    T = pose(fields.frame())
    fields.done()
    beside = path.parent / source
    if source == POSE:
        spec = read_arm({**pose_arm(str(arm)), "of_poses": True})
    else:
        loops = _loops(top, str(arm))
        spec = read_arm(os.fspath(beside) if is_there(beside) else source, **links, loops=loops)
    spec["base"] = frame_spec(T @ pose(spec["base"]))
    spec |= check_arm_rig(top, len(spec["joints"]), str(arm))
    spec["cell"] = {"name": name, "arm": str(arm)}
    top.done()
    return spec


def _loops(top: Fields, arm: str) -> list[Spec]:
    """`loops` of a cell as the arm's robot file would have them: its links without its name."""
    out = []
    for fields in top.entries("loops", 0, 1000):
        loop = fields.rest()
        ends = {key: str(loop[key]).removeprefix(f"{arm}.") for key in ("from", "to") if key in loop}
        out.append(loop | ends)
    return out
