# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which postures of a cell to read, so that all its arms and places become known best in one fit.

The design problem is that of one arm: rows of derivatives over noise, here of all readings of a posture by all that
they can show, in plausible sizes; the search is the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.cells.asked import asked_parameters
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import known_views, simulate_cell
from fastcal.design.linear import KNOWN_TO
from fastcal.design.observability import observability_indices
from fastcal.design.planned import approached, unvaried
from fastcal.design.poses import SIGMA
from fastcal.design.search import Search
from fastcal.effects.entries import full_name, label
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import tables_of

_CANDIDATES = 4000
_SAMPLE = 1000  # candidates by which the gauge is chosen
_REACH = {"revolute": np.pi, "prismatic": 1.0}  # of a joint whose file gives no limits: either way [rad, m]


@dataclass(frozen=True, eq=False)
class CellDesign:
    """Postures of a cell, in the order of visiting.

    Attributes:
        q: (N, n) joint positions in the order of the tree [rad, m].
        approach: Of arms and numbers of joints, from 0, that backlash or friction asks for: (N,) from which side.
        views: What is to be read in each.
        sigma: Standard deviation of a predicted coordinate then, root of the mean square over the candidates [m].
        parameters: Names of what the postures identify.
        deviations: (P,) their predicted standard deviations, SI.
        observability: O1 to O5.
        efficiency: Share of the best possible O1 that is surely reached; None: not known.
    """

    q: FloatArray
    approach: dict[tuple[str, int], FloatArray]
    views: list[str]
    sigma: float
    parameters: list[str]
    deviations: FloatArray
    unidentifiable: list[str]
    observability: dict[str, float]
    efficiency: float | None
    candidate_count: int
    notes: list[str]


def design_cell(
    cell: Cell,
    count: int,
    views: Sequence[str] = (),
    *,
    sigma: float = SIGMA,
    sigma_rotation: float | None = None,
    candidate_count: int = _CANDIDATES,
    restarts: int = 0,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> CellDesign:
    """Chooses `count` postures out of random ones within the joints' limits.

    Args:
        cell: With its members about where they are. Its arms' effects stay as they are; those that look at what no
            posture varies, as of heat, are left out.
        count: How many.
        views: What is read; none: all targets from the world. Beside points, KIND@TARGET or KIND@TARGET:SENSOR of
            another kind of the registry.
        sigma: Standard deviation of a read coordinate [m].
        sigma_rotation: Of an orientation about each axis [rad]; None: none is read.
        candidate_count: Postures to choose from.
        restarts: Further searches from random designs.
        seed: The same seed gives the same postures.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: A view that there is not, an arm that is known by its poses alone, or nothing to identify.
    """
    report = progress or (lambda text: None)
    if any(arm.of_poses for arm in cell.arms):
        raise InvalidInput(
            f"{cell.name} has an arm that is known by its poses alone, so postures cannot be planned for it"
        )
    if not 1 <= count <= candidate_count:
        raise InvalidInput(f"count must be between 1 and the {candidate_count} candidates, got {count}")
    random = np.random.default_rng(seed)
    limits = joint_limits(cell)
    q = random.uniform(limits[:, 0], limits[:, 1], (candidate_count, len(limits)))
    report("linearizing")
    kinds = [view for view in views if "@" in view]
    is_of_points = len(kinds) < len(views) or not views
    points = known_views(cell, [view for view in views if "@" not in view]) if is_of_points else []
    cell, kept = _planned(cell)
    approach = {
        (arm.name, joint): random.choice([-1.0, 1.0], candidate_count)
        for arm in cell.arms
        for joint in approached(arm.robot)
    }
    pool = Readings(q, {}, "design", arms=_conditions(cell, q, approach))
    if points:
        pool = simulate_cell(cell, pool, points, noise_rotation=None if sigma_rotation is None else 0.0)
    pool = replace(pool, tables={**pool.tables, **_read_of(cell, kinds, len(q))})
    unknowns = pool.measured(cell).parameters
    parameters = [*cell.model.parameters, *unknowns]
    asked = [*asked_parameters(cell, pool), *range(len(parameters) - len(unknowns), len(parameters))]
    J, of_points = _rows(cell, pool, asked, sigma, sigma_rotation, threads)
    k = len(J) // len(q)
    some = _core.draw_design(len(q), min(_SAMPLE, len(q)), seed)
    R = np.asarray(
        np.linalg.qr(J.reshape(len(q), k, -1)[some].reshape(-1, J.shape[1]) * np.sqrt(count / len(some)), "r")
    )
    R = np.vstack([R, np.zeros((max(len(asked) - len(R), 0), len(asked)))])
    free, unseen = _core.free_parameters(R, [parameters[i] for i in asked])
    if not len(free):
        raise InvalidInput("nothing of the cell is identifiable from these readings")
    rows, free = np.ascontiguousarray(J[:, free]), list(free)
    known = np.eye(len(free)) / KNOWN_TO**2
    B = rows[of_points].T @ rows[of_points] * sigma**2 / max(of_points.sum(), 1)
    report(f"choosing {count} of {len(q)} postures")
    search = Search(_core.Candidates(rows, k), "O1", known, B, restarts=restarts, seed=seed, threads=threads)
    found = search.run(count)
    members = np.array(found.members)
    scaled = (q[members] - limits[:, 0]) / np.maximum(limits[:, 1] - limits[:, 0], 1e-9)
    order = _core.visiting_order(np.ascontiguousarray(scaled), np.full(len(limits), 0.5))
    chosen = rows.reshape(len(q), k, -1)[members].reshape(-1, len(free))
    sizes = np.array([parameters[asked[i]].sigma for i in free])
    indices = observability_indices(chosen, count)
    notes = [
        *kept,
        "arms are not kept from meeting one another or what stands around: drive the postures slowly at first",
    ]
    if indices["O1"] == 0:
        notes.append(
            f"{count} postures do not identify all {len(free)} parameters: the others stay as the file has them"
        )
    return CellDesign(
        q[members][order],
        {joint: side[members][order] for joint, side in approach.items()},
        [*points, *kinds],
        float(np.sqrt(search.variance(found.members))),
        [full_name(parameters[asked[i]]) for i in free],
        sizes * np.sqrt(np.diag(np.linalg.inv(search.information(found.members)))),
        list(unseen),
        indices,
        None if indices["O1"] == 0 else found.efficiency,
        len(q),
        notes,
    )


def _planned(cell: Cell) -> tuple[Cell, list[str]]:
    """The cell with the effects of its arms that postures vary, and a note on effects."""
    arms, out = [], list[str]()
    for arm in cell.arms:
        robot = arm.robot
        pairs = list(zip(robot.entries, robot.effects, strict=True))
        kept = [entry for entry, effect in pairs if not unvaried(entry, effect)]
        out += [f"{label(entry)} of {arm.name}" for entry, effect in pairs if unvaried(entry, effect)]
        arms.append(arm if len(kept) == len(pairs) else replace(arm, robot=robot.with_(effects=kept)))
    notes = []
    if any(arm.robot.entries for arm in cell.arms):
        notes.append("the postures are chosen for geometry and places, without a payload; the arms' effects stay known")
    if out:
        notes.append(f"the postures are not chosen for {', '.join(out)}: no choice of postures makes it observable")
    return replace(cell, arms=tuple(arms)), notes


def _conditions(cell: Cell, q: FloatArray, approach: Mapping[tuple[str, int], FloatArray]) -> dict[str, Dataset]:
    """Of the arms with joints whose side of approach matters, from which the postures q (N, n) come."""
    out = {}
    for branch in cell.core.branches:
        joints = [joint for arm, joint in approach if arm == branch.name]
        if joints:
            own = np.ascontiguousarray(q[:, branch.first_joint : branch.first_joint + branch.joint_count])
            sides = np.zeros(own.shape)
            sides[:, joints] = np.column_stack([approach[branch.name, joint] for joint in joints])
            out[branch.name] = Dataset.from_arrays(own, approach=sides)
    return out


def _read_of(cell: Cell, kinds: Sequence[str], count: int) -> dict[str, FloatArray]:
    """Tables (N, c) of kinds of readings, KIND@VIEW, of any content: a plan asks what they tell, not what they say."""
    tables = {of.name: of for of in tables_of(0).values() if of.role == "measured" and of.columns}
    out = {}
    for kind in kinds:
        name, _, view = kind.partition("@")
        if name not in tables:
            raise InvalidInput(f"'{name:.60}' is no kind of reading; expected one of {', '.join(sorted(tables))}")
        out[f"{name}@{known_views(cell, [view])[0]}"] = np.zeros((count, len(tables[name].columns)))
    return out


def joint_limits(cell: Cell) -> FloatArray:
    """(n, 2) of all joints in the order of the tree."""
    arms = {arm.name: arm for arm in cell.arms}
    own = np.vstack([arms[of.name].robot.limits for of in cell.core.branches if of.joint_count])
    reach = np.array([_REACH[kind] for kind in cell.joint_types])[:, np.newaxis] * [-1.0, 1.0]
    return np.asarray(np.where(np.isfinite(own), own, reach))


def _rows(
    cell: Cell, pool: Readings, asked: list[int], sigma: float, sigma_rotation: float | None, threads: int
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """(N k, p) derivatives over noise by the asked parameters in plausible sizes, posture by posture.

    And (N k,) which of them are of points.
    """
    measured, model = pool.measured(cell), cell.model
    noise = [sigma_rotation or 1.0 if of.unit == "rad" else sigma for of in measured.observations]
    theta = np.append(np.asarray(model.start), np.zeros(len(measured.parameters)))
    near = _core.linearize(model, pool.samples(cell), measured, theta, noise, threads)
    turns = np.zeros(measured.number_count, dtype=bool)
    for of in measured.observations:
        turns[of.first_number : of.first_number + of.reading_count * len(of.components)] = of.unit == "rad"
    order = np.argsort(np.asarray(near.row), kind="stable")
    scale = np.array([[*model.parameters, *measured.parameters][i].sigma for i in asked])
    return np.asarray(near.J)[order][:, asked] * scale, ~turns[np.asarray(near.number)[order]]
