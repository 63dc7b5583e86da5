# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the postures of a cell leave open by how they were chosen: joints that stand still, views read once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.place import Place
from fastcal.said import Said, said

_STILL = 1e-6  # [rad, m] of a joint that does not move


def data_notes(cell: Cell, readings: Readings, asked: Sequence[int]) -> list[Said]:
    """A sentence on joints, of those that are identified, at one position in all postures, and on each view read once.

    Args:
        cell: The tree.
        readings: What was read.
        asked: Indices of the parameters that are identified.
    """
    owners = {cell.core.parameters[i].owner for i in asked if i < len(cell.core.parameters)}
    moves = np.ptp(readings.q, axis=0) > _STILL
    still = []
    for branch in (of for of in cell.core.branches if of.joint_count):
        names = [str(Place(branch.name, "joint", k + 1)) for k in range(branch.joint_count)]
        still += [name for k, name in enumerate(names) if name in owners and not moves[branch.first_joint + k]]
    out = []
    if still:
        out.append(
            said(
                "{joints}: at one position in all postures, so that these do not show where the axis is; what was "
                "found holds at this position alone",
                joints=", ".join(still),
            )
        )
    fields = [name for name in readings.tables if "@" in name and not name.startswith("sigma")]
    for view in dict.fromkeys(name.partition("@")[2] for name in fields):
        own = [readings.tables[name] for name in fields if name.endswith(f"@{view}")]
        if len(readings) > 1 and np.any([np.isfinite(table).any(axis=1) for table in own], axis=0).sum() == 1:
            out.append(said("{view} was read in one posture alone, so that nothing checks it", view=view))
    return out
