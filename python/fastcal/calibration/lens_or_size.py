# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Is a board of another size than its file says, or a lens of another focal length, what pictures show?

An arm that is identified takes a wrong length of a board for its own: pictures alone show no length, and an arm all of
whose links are too short by some factor draws what a board draws that is too small by it. So it is asked before the
fit, of the arm as its file has it. With cameras and boards placed by all pictures, and s a board's size or a camera's
focal length in times the file's, Gauss' and Newton's steps over the places x and ln s,

    r(x + dx, s exp(ds)) = r + J dx + D ds,    J, D whitened derivatives,

find the s that pictures fit best. It is told where half of the pictures are then missed by HALVED times less or better,
and s is farther from 1 than arms are wrong by; beyond MISTAKEN the file is wrong, and not the arm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.picture_readings import BETTER, FAR, MEASURE_BOARD, focal_of, size_of
from fastcal.calibration.shifted_rows import huber_fit
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import without_kinds
from fastcal.robot.rig import has_rig, sized
from fastcal.robot.robot import Robot
from fastcal.said import chained, joined, said

HALVED = 2.0  # times less that pictures are missed by: three quarters of the squares
NEAR = 0.01  # of a size: lengths of arms are known to that
MISTAKEN = 0.05  # of a size: no arm is wrong by that
_ALIKE = 2.0  # times what the best explanation leaves: these pictures do not tell another one from it
_FEWEST = 6  # pictures: places have twelve numbers, as two pictures have
_STEPS, _WIDEST, _DONE = 12, 0.4, 1e-4  # of ln s
_SHARE = 1e-5  # of a length, in a difference
_PIXEL = 0.05  # [px] no corner is found better


@dataclass(frozen=True)
class OtherSizes:
    """What is said of boards and lenses.

    Attributes:
        text: A sentence.
        mistaken: Is it so far off that the file must be wrong?
        several: Do size and lens explain the pictures alike?
    """

    text: str
    mistaken: bool
    several: bool


@dataclass(frozen=True, eq=False)
class _Sized:
    """Boards, or lenses, in times the file's."""

    robot: Robot
    data: Dataset
    boards: Sequence[str] = ()
    cameras: Sequence[str] = ()
    threads: int = 1
    log: FloatArray = field(default_factory=lambda: np.zeros(0))

    def at(self, log: FloatArray) -> _Sized:
        return replace(self, log=log)

    @property
    def sizes(self) -> dict[str, float]:
        return dict(zip((*self.boards, *self.cameras), np.exp(self.log).tolist(), strict=True))

    def measured(self, log: FloatArray) -> _core.Measurements:
        """The corners, seen with boards and lenses so many times as large."""
        spec, times = self.robot.description, np.exp(log)
        boards, cameras = dict(spec.boards), dict(spec.cameras)
        for name, of in zip(self.boards, times, strict=False):
            boards[name] = sized(boards[name], float(of))
        for name, of in zip(self.cameras, times[len(self.boards) :], strict=True):
            cameras[name] = {**cameras[name], "focal_px": [float(of) * f for f in cameras[name]["focal_px"]]}
        return measurements(self.data, self.robot.with_(boards=boards, cameras=cameras))


@dataclass(frozen=True, eq=False)
class _Placed:
    """Cameras and boards where pictures put them: theta, the noise, and by how much half of the pictures miss [px]."""

    theta: FloatArray
    noise: list[float]
    miss: float


def other_sizes(robot: Robot, data: Dataset, threads: int = 1) -> OtherSizes | None:
    """Boards of another size, or lenses of another focal length, that explain what the arm's file does not; or None.

    Args:
        robot: The arm as its file has it, with cameras and boards.
        data: Pictures whose rows and order of corners are right.
        threads: Cores.
    """
    spec = robot.description
    if CORNERS not in data.kinds or not has_rig(spec):
        return None
    corners = without_kinds(data, [kind for kind in data.kinds if kind != CORNERS])
    seen = np.isfinite(corners.observed[CORNERS]).any(axis=1)
    if seen.sum() < _FEWEST:
        return None
    known = [name for name, camera in spec.cameras.items() if camera["intrinsics"] != "identify"]
    given = _Sized(robot, corners, threads=threads)
    start = _core.align(robot.error_model, robot.samples(corners), given.measured(given.log), threads)
    if not start.found:
        return None
    as_given = _placed(given, np.asarray(start.unknowns))
    if not as_given.miss > HALVED * _PIXEL:
        return None
    tried = [replace(given, boards=tuple(spec.boards)), *([replace(given, cameras=tuple(known))] if known else [])]
    found = [_fitted(of.at(np.zeros(len(of.boards) + len(of.cameras))), as_given) for of in tried]
    width = min(float(camera["size_px"][0]) for camera in spec.cameras.values())
    enough = min(FAR * width, as_given.miss / HALVED, _ALIKE * min(placed.miss for _, placed in found))
    good = [(of, placed) for of, placed in found if placed.miss < enough and np.abs(of.log).max() > NEAR]
    return _told(good, as_given.miss) if good else None


def _told(good: Sequence[tuple[_Sized, _Placed]], as_given: float) -> OtherSizes:
    """The sentence of explanations that fit alike; `as_given`: by how much half of the pictures miss without [px]."""
    told: list[str] = []
    for of, _ in good:
        words = size_of if of.boards else focal_of
        named = {name: s for name, s in of.sizes.items() if abs(np.log(s)) > NEAR}
        told += [
            said("board {name}: {text}" if of.boards else "camera {name}: {text}", name=name, text=words(s))
            for name, s in named.items()
        ]
    best = min(placed.miss for _, placed in good)
    far = max(float(np.abs(of.log).max()) for of, _ in good)
    text = chained("{first}; or {second}", told)
    return OtherSizes(
        said(
            "{text} (half of the pictures miss by {best:.2g} px then, and by {as_given:.2g} px as given)",
            text=joined("; ", [text, MEASURE_BOARD]) if len(good) > 1 else text,
            best=float(best),
            as_given=float(as_given),
        ),
        far > MISTAKEN and best * BETTER < as_given,
        len(good) > 1,
    )


def _placed(of: _Sized, unknowns: FloatArray) -> _Placed:
    """Where the pictures put cameras and boards, beginning at their unknowns (U,)."""
    model, samples, measured = of.robot.error_model, of.robot.samples(of.data), of.measured(of.log)
    found = _core.identify(model, samples, measured, asked=[], unknowns=unknowns, loss="huber", threads=of.threads)
    theta = np.asarray(found.theta)
    r = np.asarray(_core.residuals(model, samples, measured, theta, of.threads))
    r = r[np.isfinite(r).any(axis=1)]
    rms = np.sqrt(2 * np.nanmean(r**2, axis=1))
    return _Placed(theta, list(found.common_noise), float(np.median(rms)))


def _fitted(of: _Sized, placed: _Placed) -> tuple[_Sized, _Placed]:
    """The sizes that the pictures fit best, and the places with them, from where these are as given."""
    own = len(of.robot.error_model.start)
    for k in range(_STEPS):
        step = _step(of, placed)
        if k == 0 and np.abs(step).max() < NEAR / 2:
            break
        step *= min(1.0, _WIDEST / max(float(np.abs(step).max()), _DONE))
        for _ in range(3):
            there = of.at(of.log + step)
            tried = _placed(there, placed.theta[own:])
            if tried.miss < placed.miss:
                break
            step = step / 3
        else:
            break
        of, placed = there, tried
        if np.abs(step).max() < _DONE:
            break
    return of, placed


def _step(of: _Sized, placed: _Placed) -> FloatArray:
    """Of ln s, with the places free."""
    model, samples, own = of.robot.error_model, of.robot.samples(of.data), len(of.robot.error_model.start)

    def near(log: FloatArray, *, columns: bool) -> _core.Linearization:
        return _core.linearize(
            model, samples, of.measured(log), placed.theta, placed.noise, of.threads, columns=columns
        )

    at = near(of.log, columns=True)
    r = np.asarray(at.r)
    D = [(np.asarray(near(of.log + _SHARE * e, columns=False).r) - r) / _SHARE for e in np.eye(len(of.log))]
    J = np.column_stack([np.asarray(at.J)[:, own:], *D])
    found = huber_fit(J, r, np.asarray(at.row, dtype=np.int64))[1]
    return np.asarray(-found[-len(of.log) :])
