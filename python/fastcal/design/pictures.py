# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which pictures of a board to take, so that the cameras' places become known best.

With R_c^T R_c what picture c says of all unknowns (arm, cameras, boards, lenses), in their plausible sizes, and C the
covariance so far, a further picture lowers the variance tr(B C) of points seen through the cameras by

    gain_c = tr[(1 + R_c C R_c^T)^-1 R_c C B C R_c^T]

The picture with the largest gain is taken, one after another; one that brings corners to parts of a camera's picture
where none were counts for more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.camera_places import CameraPlace, camera_place, middles_of_boards
from fastcal.calibration.problem import asked_parameters, shown_ends
from fastcal.calibration.unknowns import CORNERS, of_corners
from fastcal.design.candidates import Candidates
from fastcal.design.result import in_order
from fastcal.design.surroundings import REASONS, Surroundings
from fastcal.design.views import FAR_MARGIN, MARGIN, drawn_postures, seen
from fastcal.effects.entries import full_name
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.hand_eye import hand_eyes
from fastcal.robot.rig import PLACEMENT, has_rig, known_within, pictures
from fastcal.robot.robot import Robot
from fastcal.robot.se3 import skew

SIGMA_PX = 0.2  # of a corner's coordinate where nothing better is known
GRID = (8, 6)  # parts across and down of a camera's picture
_VIEWS = 1500  # that are tried
_OPEN = 10.0  # plausible sizes within which all is known beforehand: the core's gauge calls more than that unknown
_TOLD = 1e-2  # information per plausible size that a parameter has beside others, or it is held as they move together
_SPREAD = 1.0  # times as much counts a picture that brings corners to all parts


@dataclass(frozen=True, eq=False)
class PictureDesign:
    """What `design_pictures` chose, in the order of visiting.

    Attributes:
        poses: The postures.
        corners: (N, K, 2) [px] where each is expected to be seen, as a data set has them.
        before: How surely each camera's place is known now; empty where nothing is known of it.
        after: And with these pictures.
        coverage: Of each camera, the share of the parts of its picture that hold a corner then.
        candidate_count: Postures that show a board and are clear.
        rejected: Why how many others could not be taken.
        notes: What a reader should know, a sentence each.
    """

    poses: Candidates
    corners: FloatArray
    before: list[CameraPlace]
    after: list[CameraPlace]
    coverage: dict[str, float]
    candidate_count: int
    rejected: dict[str, int]
    notes: list[str] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.poses)


def design_pictures(
    robot: Robot,
    count: int,
    *,
    measured: Dataset | None = None,
    surroundings: Surroundings | None = None,
    sigma_px: float | None = None,
    focus: tuple[float, float] | None = None,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> PictureDesign:
    """Chooses the postures in which to take pictures.

    Args:
        robot: With its cameras and boards about where they are; a calibrated cell counts with what it knows.
        count: How many.
        measured: Pictures that were taken already, with their corners; they count in place of what the cell knows.
        surroundings: Keep-out boxes and region. None: above the mounting face and out of the arm's own column.
        sigma_px: Standard deviation of a corner's coordinate; None: that of the cell's calibration, or 0.2 px.
        focus: Least and greatest distance of a board's middle from the camera [m].
        seed: The same seed gives the same postures.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: There is no camera or board, the arm has no joints to plan, or too few postures show a board.
    """
    if not has_rig(robot.description):
        raise InvalidInput(f"{robot.name} has no cameras or no boards to plan pictures of")
    if robot.of_poses:
        raise InvalidInput(f"{robot.name} is known by its poses alone, so pictures cannot be planned for it")
    if count < 1:
        raise InvalidInput(f"count must be at least 1, got {count}")
    noise = sigma_px or (robot.record.sigma(CORNERS) if robot.record else None) or SIGMA_PX
    report = progress or (lambda text: None)
    random = np.random.default_rng(seed)
    report("looking for views")
    q = drawn_postures(robot, _VIEWS, random, focus, threads)
    told = measured is not None or bool(robot.record and robot.record.unknowns)
    uv = seen(robot, q, focus, MARGIN if told else FAR_MARGIN)
    shows = np.isfinite(uv[..., 0]).any(axis=1)
    around = Surroundings(mounting=True) if surroundings is None else surroundings
    obstacle = around.obstacles(robot, np.ascontiguousarray(q), threads=threads)
    rejected = {why: int(np.sum(shows & (obstacle == key))) for key, why in REASONS.items()}
    rejected = {why: number for why, number in rejected.items() if number} | {"show no board well": int((~shows).sum())}
    good = np.flatnonzero(shows & (obstacle == 0))
    if len(good) < count:
        why = ", ".join(f"{number} {reason}" for reason, number in rejected.items())
        raise InvalidInput(
            f"{count} pictures were asked for, and {len(good)} postures show a board and are clear: {why}; is the "
            "board within reach, and do the file's places say about where it is?"
        )
    q, uv = np.ascontiguousarray(q[good]), uv[good]

    report("linearizing")
    pool = _dataset(robot, q, uv)
    plan = _Plan.of(robot, pool, measured, count, noise, threads)
    known = plan.known(robot, measured, threads)
    R = plan.roots(robot, pool, threads)
    B, middles = plan.wanted(robot, pool)
    report(f"choosing {count} of {len(q)} postures")
    at = _covered(robot, uv)
    chosen = _chosen(
        R, np.asarray(np.linalg.inv(known), dtype=np.float64), B, at, _covered_before(robot, measured), count
    )
    poses = in_order(robot, Candidates(q[chosen], np.zeros(len(chosen))))
    after = known + np.einsum("nki,nkj->ij", R[chosen], R[chosen])
    freedom = 10**6  # of a noise that is taken as known
    order = [int(np.flatnonzero((q == row).all(axis=1))[0]) for row in poses.q]
    covered = at[chosen].any(axis=0) | _covered_before(robot, measured)
    return PictureDesign(
        poses,
        uv[order],
        plan.places(known, middles, freedom) if told else [],
        plan.places(after, middles, freedom),
        dict(zip(robot.description.cameras, covered.mean(axis=1).tolist(), strict=True)),
        len(q),
        rejected,
        plan.notes,
    )


@dataclass(frozen=True, eq=False)
class _Plan:
    """What is to be known: indices among the model's parameters and the unknowns, and their plausible sizes.

    What moves with others unseen is held, the arm's before the cameras'.
    """

    names: list[str]
    free: list[int]
    sizes: FloatArray
    prior: FloatArray
    noise: float
    with_arm: bool
    eyes: list[tuple[str, str, list[int]]]
    notes: list[str]

    @staticmethod
    def of(robot: Robot, pool: Dataset, measured: Dataset | None, count: int, noise: float, threads: int) -> _Plan:
        model, rows = robot.error_model, measurements(pool, robot)
        own, parameters = len(model.start), [*model.parameters, *rows.parameters]
        asked = [i for i in asked_parameters(model, True, **shown_ends(rows)) if i < own]
        asked += list(range(own, len(parameters)))
        sizes = np.array([p.sigma for p in parameters])
        within = np.concatenate([np.full(own, np.inf), known_within(robot.description, rows.parameters)])
        J, _ = _rows(robot, pool, noise, threads)
        few = min(1.0, count / len(pool))
        A = few * (J * sizes).T @ (J * sizes) + np.diag((sizes / within) ** 2)
        if measured is not None:
            K, _ = _rows(robot, measured, noise, threads)
            A += (K * sizes).T @ (K * sizes)
        free = _told_apart(A, asked[::-1])
        names = [full_name(p) for p in parameters]
        prior = np.diag((sizes / within)[free] ** 2 + 1 / _OPEN**2)
        at = {name: k for k, name in enumerate(names[i] for i in free)}
        eyes = []
        for of in hand_eyes(robot.description):
            six = [at[name] for axis in PLACEMENT if (name := f"camera {of.camera} {axis}") in at]
            if len(six) == len(PLACEMENT):
                eyes.append((of.camera, of.parent, six))
        missing = [of for of in robot.description.cameras if of not in {name for name, _, _ in eyes}]
        notes = [f"camera {name}: pictures from these postures do not show all of its place" for name in missing]
        return _Plan(names, free, sizes[free], prior, noise, any(i < own for i in free), eyes, notes)

    def known(self, robot: Robot, measured: Dataset | None, threads: int) -> FloatArray:
        """(F, F) information before the pictures: of those that were taken, else of the cell's calibration."""
        if measured is not None:
            J, _ = _rows(robot, measured, self.noise, threads)
            own = J[:, self.free] * self.sizes
            return self.prior + own.T @ own
        record = robot.record
        if record is None or not record.unknowns:
            return self.prior
        rows = record.roots
        at = [k for k, i in enumerate(self.free) if self.names[i] in rows]
        known = np.array([rows[self.names[self.free[k]]] / self.sizes[k] for k in at])
        C = known @ known.T
        out = self.prior.copy()
        out[np.ix_(at, at)] += np.linalg.pinv(C, rcond=1e-13, hermitian=True)
        return out

    def roots(self, robot: Robot, pool: Dataset, threads: int) -> FloatArray:
        """(N, k, F) upper triangles R_c with R_c^T R_c the information of each picture."""
        J, row = _rows(robot, pool, self.noise, threads)
        J = J[:, self.free] * self.sizes
        out = np.zeros((len(pool), J.shape[1], J.shape[1]))
        for i in range(len(pool)):
            R = np.linalg.qr(J[row == i], mode="r")
            out[i, : len(R)] = R
        rank = int(max(np.linalg.matrix_rank(R) for R in out[:: max(len(out) // 20, 1)]))
        _, s, Vt = np.linalg.svd(out, full_matrices=False)
        return np.asarray(s[:, : rank + 1, None] * Vt[:, : rank + 1])

    def wanted(self, robot: Robot, pool: Dataset) -> tuple[FloatArray, list[FloatArray]]:
        """(F, F) B, so that tr(B C) is the mean variance of points where boards are, and these points by camera."""
        B, points = np.zeros((len(self.free), len(self.free))), []
        for camera, _, six in self.eyes:
            middles = middles_of_boards(robot, pool, camera)
            points.append(middles)
            for p in middles[:: max(len(middles) // 50, 1)]:
                J = np.hstack([np.eye(3), -skew(p)]) * self.sizes[six]
                B[np.ix_(six, six)] += J.T @ J / len(middles)
        if not self.eyes:
            raise InvalidInput(f"{robot.name}: {'; '.join(self.notes) or 'all cameras are fixed'}: nothing to plan for")
        return B, points

    def places(self, information: FloatArray, middles: Sequence[FloatArray], freedom: int) -> list[CameraPlace]:
        C = np.linalg.inv(information) * np.outer(self.sizes, self.sizes)
        return [
            camera_place(camera, frame, C[np.ix_(six, six)], freedom, points, with_arm=self.with_arm)
            for (camera, frame, six), points in zip(self.eyes, middles, strict=True)
        ]


def _rows(robot: Robot, data: Dataset, noise: float, threads: int) -> tuple[FloatArray, NDArray[np.int32]]:
    """(m, T) derivative of the corners' coordinates over their noise, and the row of each."""
    measured = measurements(data, robot)
    model = robot.error_model
    theta = np.concatenate([model.start, np.zeros(len(measured.parameters))])
    common = [noise] * len(measured.observations)
    near = _core.linearize(model, robot.samples(data), measured, theta, common, threads)
    own = of_corners(near, measured)
    return np.asarray(near.J)[own], np.asarray(near.row)[own]


def _told_apart(A: FloatArray, order: Sequence[int]) -> list[int]:
    """Indices, ascending, whose information beside those kept before is more than _TOLD: a pivoted Cholesky of A."""
    kept: list[int] = []
    L = np.zeros((0, 0))
    for i in order:
        below = np.linalg.solve(L, A[kept, i]) if kept else np.zeros(0)
        rest = float(A[i, i] - below @ below)
        if rest > max(_TOLD, 1e-10 * float(A[i, i])):
            L = np.block([[L, np.zeros((len(L), 1))], [below[None, :], np.sqrt(rest) * np.ones((1, 1))]])
            kept.append(i)
    return sorted(kept)


def _chosen(
    R: FloatArray, C: FloatArray, B: FloatArray, at: NDArray[np.bool_], covered: NDArray[np.bool_], count: int
) -> list[int]:
    """The pictures R (N, k, F) that lower tr(B C) most, each once; `at` (N, cameras, parts) where they have corners."""
    left = np.ones(len(R), dtype=bool)
    out: list[int] = []
    for _ in range(count):
        RC = R @ C
        S = np.eye(R.shape[1]) + RC @ R.transpose(0, 2, 1)
        gain = np.trace(np.linalg.solve(S, RC @ B @ RC.transpose(0, 2, 1)), axis1=1, axis2=2)
        fresh = (at & ~covered).mean(axis=(1, 2))
        best = int(np.argmax(np.where(left, gain * (1 + _SPREAD * fresh), -1.0)))
        C = C - RC[best].T @ np.linalg.solve(S[best], RC[best])
        left[best] = False
        covered = covered | at[best]
        out.append(best)
    return out


def _covered(robot: Robot, uv: FloatArray) -> NDArray[np.bool_]:
    """(N, cameras, parts) which parts of each camera's picture hold a corner of uv (N, K, 2)."""
    cameras = robot.description.cameras
    out = np.zeros((len(uv), len(cameras), GRID[0] * GRID[1]), dtype=bool)
    for (camera, _), own in pictures(robot.description).items():
        size = np.array(cameras[camera]["size_px"], dtype=float)
        part = uv[:, own]
        row, corner = np.nonzero(np.isfinite(part[..., 0]))
        cell = np.clip((part[row, corner] / size * GRID).astype(int), 0, np.array(GRID) - 1)
        out[row, list(cameras).index(camera), cell[:, 0] * GRID[1] + cell[:, 1]] = True
    return out


def _covered_before(robot: Robot, measured: Dataset | None) -> NDArray[np.bool_]:
    """(cameras, parts) of what was taken already."""
    if measured is None:
        return np.zeros((len(robot.description.cameras), GRID[0] * GRID[1]), dtype=bool)
    uv = measured.observed[CORNERS].reshape(len(measured), -1, 2)
    return np.asarray(_covered(robot, uv).any(axis=0))


def _dataset(robot: Robot, q: FloatArray, uv: FloatArray) -> Dataset:
    poses = Dataset.from_arrays(q, robot=robot, source="design")
    observed: dict[str, Any] = {CORNERS: np.ascontiguousarray(uv.reshape(len(q), -1))}
    return replace(poses, observed=observed)
