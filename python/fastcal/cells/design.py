# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which postures of a cell to read, so that all its arms and places become known best in one fit.

The design problem is that of one arm: rows of derivatives over noise, here of all readings of a posture by all that
they can show, in plausible sizes; the search is the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.camera_places import CameraPlace, camera_place
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.asked import asked_parameters
from fastcal.cells.cell import Cell
from fastcal.cells.picture_postures import showing_postures
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import known_views, simulate_cell, view_poses
from fastcal.cells.view_points import with_rig_as_points
from fastcal.design.linear import KNOWN_TO
from fastcal.design.observability import observability_indices
from fastcal.design.pictures import SIGMA_PX
from fastcal.design.planned import approached, unvaried
from fastcal.design.poses import SIGMA
from fastcal.design.search import Search
from fastcal.effects.entries import full_name, label
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import tables_of
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.rig import PLACEMENT, board_corners, has_rig, pictures
from fastcal.said import said

_CANDIDATES = 4000
_SAMPLE = 1000  # candidates by which the gauge is chosen
_SURE = 10**6  # degrees of freedom of a noise that is taken as known
_RANK = 1e-9  # of the largest singular value: less of a direction is rounding
_REACH = {"revolute": np.pi, "prismatic": 1.0}  # of a joint whose file gives no limits: either way [rad, m]


@dataclass(frozen=True, eq=False)
class CellDesign:
    """Postures of a cell, in the order of visiting.

    Attributes:
        q: (N, n) joint positions in the order of the tree [rad, m].
        approach: Of arms and numbers of joints, from 0, that backlash or friction asks for: (N,) from which side.
        views: What is to be read in each.
        sigma: Standard deviation of a predicted coordinate then, root of the mean square over the candidates [m]; None
            where pictures alone are taken.
        parameters: Names of what the postures identify.
        deviations: (P,) their predicted standard deviations, SI.
        observability: O1 to O5.
        efficiency: Share of the best possible O1 that is surely reached; None: not known.
        cameras: How surely the place of each camera is known then; of those whose place the postures show.
    """

    q: FloatArray
    approach: dict[tuple[str, int], FloatArray]
    views: list[str]
    sigma: float | None
    parameters: list[str]
    deviations: FloatArray
    unidentifiable: list[str]
    observability: dict[str, float]
    efficiency: float | None
    candidate_count: int
    notes: list[str]
    cameras: list[CameraPlace] = field(default_factory=list)


def design_cell(
    cell: Cell,
    count: int,
    views: Sequence[str] = (),
    *,
    sigma: float = SIGMA,
    sigma_rotation: float | None = None,
    sigma_px: float | None = None,
    focus: tuple[float, float] | None = None,
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
        views: What is read; none: all targets from the world, and pictures of all boards. Beside points, BOARD:CAMERA
            of pictures, KIND@TARGET or KIND@TARGET:SENSOR of another kind of the registry.
        sigma: Standard deviation of a read coordinate [m].
        sigma_rotation: Of an orientation about each axis [rad]; None: none is read.
        sigma_px: Of a corner's coordinate in a picture; None: that of the cell's calibration, or 0.2 px.
        focus: Least and greatest distance of a board's middle from a camera [m]; None: as the picture's size wants it.
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
    asked_views = _Views.of(cell, views)
    q = random.uniform(limits[:, 0], limits[:, 1], (candidate_count, len(limits)))
    uv = None
    if asked_views.pictures:
        report("looking for views")
        shown, uv = showing_postures(cell, limits, asked_views.pictures, count, random, focus, threads)
        q, uv = (np.vstack([shown, q]), _padded(uv, len(q))) if asked_views.has_points else (shown, uv)
    report("linearizing")
    cell, kept = planned_cell(cell)
    approach = drawn_approaches(cell, len(q), random)
    pool = Readings(q, {}, "design", arms=approach_conditions(cell, q, approach))
    points, kinds = asked_views.points, asked_views.kinds
    if points:
        pool = simulate_cell(cell, pool, points, noise_rotation=None if sigma_rotation is None else 0.0)
    pool = replace(pool, tables={**pool.tables, **_read_of(cell, kinds, len(q))})
    if uv is not None:
        pool = replace(pool, tables={**pool.tables, CORNERS: np.ascontiguousarray(uv.reshape(len(q), -1))})
    unknowns = pool.measured(cell).parameters
    parameters = [*cell.model.parameters, *unknowns]
    asked = [*asked_parameters(cell, pool), *range(len(parameters) - len(unknowns), len(parameters))]
    noise_px = sigma_px or _corner_noise(cell) or SIGMA_PX
    J, of_points = _rows(cell, pool, asked, (sigma, sigma_rotation, noise_px), threads)
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
    B = of_points[:, free].T @ of_points[:, free] * sigma**2 / max(len(of_points), 1)
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
    names = [full_name(parameters[asked[i]]) for i in free]
    covariance = np.asarray(np.linalg.inv(search.information(found.members)) * np.outer(sizes, sizes), np.float64)
    cameras, hidden = _cameras(cell, pool.pick(members), names, covariance)
    return CellDesign(
        q[members][order],
        {joint: side[members][order] for joint, side in approach.items()},
        asked_views.names,
        float(np.sqrt(search.variance(found.members))) if len(of_points) else None,
        names,
        np.sqrt(np.diag(covariance)),
        list(unseen),
        indices,
        None if indices["O1"] == 0 else found.efficiency,
        len(q),
        [*notes, *hidden],
        cameras,
    )


@dataclass(frozen=True)
class _Views:
    """What is to be read: points and poses, other kinds of readings, and (board, camera) of pictures."""

    points: list[str]
    kinds: list[str]
    pictures: list[tuple[str, str]]

    @staticmethod
    def of(cell: Cell, views: Sequence[str]) -> _Views:
        """InvalidInput: one is of what the cell does not have, or it has nothing to read."""
        pairs = {f"{board}:{camera}": (board, camera) for camera, board in pictures(cell)} if has_rig(cell) else {}
        if not views and pairs:
            targets = [of.name for of in cell.points if of.role == "target"]
            return _Views(targets, [], list(pairs.values()))
        for view in views:
            ends = set(view.split(":", 1))
            if view not in pairs and pairs and ends & {*cell.boards, *cell.cameras}:
                raise InvalidInput(f"'{view:.60}' is no picture of the cell; there are {', '.join(pairs)}")
        kinds = [view for view in views if "@" in view]
        points = [view for view in views if "@" not in view and view not in pairs]
        is_of_points = len(points) > 0 or not views
        return _Views(
            known_views(cell, points) if is_of_points else [], kinds, [pairs[view] for view in views if view in pairs]
        )

    @property
    def has_points(self) -> bool:
        """Is anything read but pictures?"""
        return bool(self.points or self.kinds)

    @property
    def names(self) -> list[str]:
        """As they were asked for."""
        return [*self.points, *self.kinds, *(f"{board}:{camera}" for board, camera in self.pictures)]


def _padded(uv: FloatArray, count: int) -> FloatArray:
    """Pictures (N, K, 2), and nothing seen in `count` further postures."""
    return np.concatenate([uv, np.full((count, *uv.shape[1:]), np.nan)])


def _corner_noise(cell: Cell) -> float | None:
    """[px] of the calibration."""
    record = CalibrationRecord.from_spec(cell.record)
    return None if record is None else record.sigma(CORNERS)


def _cameras(
    cell: Cell, pool: Readings, names: list[str], covariance: FloatArray
) -> tuple[list[CameraPlace], list[str]]:
    """Of each camera that sees a board in the pool how surely it is placed; and a note on those that it does not place.

    Args:
        cell: The tree.
        pool: The postures that were chosen.
        names: What they identify.
        covariance: (P, P) of it, SI.
    """
    uv = pool.tables.get(CORNERS)
    out, notes, at = list[CameraPlace](), list[str](), {name: i for i, name in enumerate(names)}
    for camera, entry in cell.cameras.items() if uv is not None else ():
        middles = _middles(cell, pool, camera)
        six = [at[name] for axis in PLACEMENT if (name := f"camera {camera} {axis}") in at]
        if entry.get("fixed") or not len(middles):
            continue
        if len(six) < len(PLACEMENT):
            notes.append(said("camera {name}: pictures from these postures do not show all of its place", name=camera))
            continue
        with_arm = any(not name.startswith(("camera ", "board ")) for name in names)
        C = covariance[np.ix_(six, six)]
        out.append(camera_place(camera, str(entry["on"]), C, _SURE, middles, with_arm=with_arm))
    return out, notes


def _middles(cell: Cell, pool: Readings, camera: str) -> FloatArray:
    """(M, 3) middles of the boards [m] in the frame of a camera, one a picture."""
    seen, out = with_rig_as_points(cell), [np.zeros((0, 3))]
    for (name, board), part in pictures(cell).items():
        rows = np.flatnonzero(np.isfinite(pool.tables[CORNERS][:, 2 * part.start : 2 * part.stop]).any(axis=1))
        if name == camera and len(rows):
            T = view_poses(seen, pool.pick(rows), f"{board}:{camera}")
            out.append(T[:, :3, :3] @ board_corners(cell.boards[board]).mean(axis=0) + T[:, :3, 3])
    return np.concatenate(out)


def planned_cell(cell: Cell) -> tuple[Cell, list[str]]:
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


def drawn_approaches(cell: Cell, count: int, random: np.random.Generator) -> dict[tuple[str, int], FloatArray]:
    """Of arms and numbers of joints whose side of approach matters, from which side each of the postures comes."""
    return {
        (arm.name, joint): random.choice([-1.0, 1.0], count) for arm in cell.arms for joint in approached(arm.robot)
    }


def approach_conditions(
    cell: Cell, q: FloatArray, approach: Mapping[tuple[str, int], FloatArray]
) -> dict[str, Dataset]:
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
    cell: Cell, pool: Readings, asked: list[int], sigma: tuple[float, float | None, float], threads: int
) -> tuple[FloatArray, FloatArray]:
    """(N k, p) derivatives over noise by the asked parameters in plausible sizes, posture by posture; (m, p) of points.

    What a posture tells is its rows' J^T J: where corners are many, its k largest directions stand for them.
    `sigma`: of a coordinate [m], an orientation [rad], a corner [px].
    """
    measured, model = pool.measured(cell), cell.model
    length, angle, corner = sigma
    noise = [
        corner if of.field == CORNERS else (angle or 1.0) if of.unit == "rad" else length
        for of in measured.observations
    ]
    parameters = [*model.parameters, *measured.parameters]
    theta = np.append(np.asarray(model.start), np.zeros(len(measured.parameters)))
    near = _core.linearize(model, pool.samples(cell), measured, theta, noise, threads)
    of_points = np.zeros(measured.number_count, dtype=bool)
    for of in measured.observations:
        own = slice(of.first_number, of.first_number + of.reading_count * len(of.components))
        of_points[own] = of.field != CORNERS and of.unit != "rad"
    order = np.argsort(np.asarray(near.row), kind="stable")
    J = np.asarray(near.J)[order][:, asked] * np.array([parameters[i].sigma for i in asked])
    points = J[of_points[np.asarray(near.number)[order]]]
    if CORNERS not in pool.tables:
        return J, points
    row = np.asarray(near.row)[order]
    blocks = np.split(J, np.searchsorted(row, np.arange(1, len(pool))))
    R = np.zeros((len(pool), J.shape[1], J.shape[1]))
    for i, block in enumerate(blocks):
        part = np.linalg.qr(block, mode="r") if len(block) > J.shape[1] else block
        R[i, : len(part)] = part
    _, s, Vt = np.linalg.svd(R, full_matrices=False)
    rank = max(int((s > _RANK * s.max()).sum(axis=1).max()), 1)
    return np.ascontiguousarray((s[:, :rank, np.newaxis] * Vt[:, :rank]).reshape(-1, J.shape[1])), points
