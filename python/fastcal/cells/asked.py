# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which parameters of a cell its readings can show, and what is known of them beforehand."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.robot.rig import known_within
from fastcal.units import to_si

FloatArray = NDArray[np.float64]


def asked_parameters(cell: Cell, readings: Readings) -> list[int]:
    """Indices of the parameters to identify: of what lies between a target and the frame that it is read from.

    What carries both moves them together, and no reading shows it. A tool's own place is that of the targets on it. A
    base that stands on a fork of one URDF is the origin of its first joint.
    """
    core, parameters = cell.core, cell.core.parameters
    between = _frames_between(core, readings.sights(cell))
    kinds = [name.partition("@") for name in readings.tables]
    turned = {view.partition(":")[0] for kind, _, view in kinds if kind == "rotation"}
    sensors = {view.partition(":")[2] for kind, _, view in kinds if kind in ("position", "rotation")}
    poses = {arm.name for arm in cell.arms if arm.of_poses}
    out = []
    for branch in core.branches:
        if branch.name in poses:
            continue
        fixed = cell.known(branch.name).fixed
        for i in range(branch.first_parameter, branch.first_parameter + branch.parameter_count):
            parameter = parameters[i]
            place = parameter.owner.removeprefix(f"{branch.name}.")
            if place == branch.name:  # one frame
                shown = branch.name in turned | sensors or not parameter.name.startswith("r")
                wanted = not fixed and shown and branch.first_frame in between
            elif place == "base":
                wanted = not fixed and branch.first_frame in between
            else:
                wanted = place != "tool" and core.frame(parameter.owner) in between
            if wanted:
                out.append(i)
    return out


def priors(cell: Cell, asked: list[int], unknowns: list[_core.Parameter], sizes: float | None) -> dict[str, Any]:
    """Priors as keyword arguments of the core's `identify`.

    Args:
        cell: Says within what the places of its members are known.
        unknowns: Of what was read, behind the parameters.
        asked: The parameters that are identified.
        sizes: Hold the geometry of the arms within so many plausible sizes of where it is; None: not at all.
    """
    core = cell.core
    parameters, mean = core.parameters, np.asarray(cell.model.start)
    sigma = np.full(len(mean), np.inf)
    for branch in core.branches:
        known = cell.known(branch.name)
        first = branch.first_parameter
        if known.sigma_mm is not None:
            sigma[first : first + 3] = to_si(known.sigma_mm, "mm")
        if known.sigma_deg is not None:
            sigma[first + 3 : first + 6] = to_si(known.sigma_deg, "deg")
        if sizes is not None and branch.joint_count:
            for i in range(first + 6, first + branch.parameter_count - 6):
                sigma[i] = sizes * parameters[i].sigma
    chosen = np.zeros(len(mean), dtype=bool)
    chosen[asked] = True
    sigma[~chosen] = np.inf
    mean, sigma = np.append(mean, np.zeros(len(unknowns))), np.append(sigma, known_within(cell, unknowns))
    return {"prior_mean": mean, "prior_sigma": sigma} if np.isfinite(sigma).any() else {}


def _frames_between(core: _core.RobotModel, views: list[str]) -> set[int]:
    """Frames that carry the one end of a view and not the other."""
    parents = core.parents

    def carriers(frame: int) -> set[int]:
        out = set()
        while frame >= 0:
            out.add(frame)
            frame = parents[frame]
        return out

    out: set[int] = set()
    for view in views:
        target, _, sensor = view.partition(":")
        out |= carriers(core.frame(target)) ^ carriers(core.frame(sensor or "world"))
    return out
