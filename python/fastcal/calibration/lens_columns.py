# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do the corners contradict intrinsics that the file calls known? A score test with the derivatives of the lens.

With r the whitened residuals of the fit, J its columns and H those of focal length, centre and distortion,

    share = 1 - |r - (J, H) x|^2 / |r - J y|^2

is what another lens would explain. It is told where that is more than half of what the fit leaves: corners of a picture
share the errors of the arm, so that chance alone is no measure.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals
from fastcal.calibration.shifted_rows import EXPLAINED, huber_fit
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.kinds import kind_named
from fastcal.robot.rig import PLACEMENT

_COEFFICIENTS = {"pinhole": 5, "fisheye": 4}  # k1, k2, p1, p2, k3 of a lens whose file has fewer
_FEWEST = 5.0  # numbers a parameter: with fewer another lens would explain much of any noise


@dataclass(frozen=True, eq=False)
class LensColumns:
    """Derivatives of what was measured by the numbers of lenses that are not identified.

    Attributes:
        cameras: Their names.
        columns: (m, k) whitened.
    """

    cameras: tuple[str, ...]
    columns: FloatArray


def known_lenses(problem: CalibrationProblem) -> tuple[str, ...]:
    """Cameras whose lens is said to be known; empty where no corners were read."""
    cameras = problem.robot.description.cameras
    is_read = CORNERS in problem.data.kinds
    return tuple(name for name, camera in cameras.items() if is_read and camera["intrinsics"] != "identify")


def with_lenses(problem: CalibrationProblem, names: Collection[str]) -> CalibrationProblem:
    """The problem with the lenses of some cameras identified too, from where the file has them."""
    cameras = dict(problem.robot.description.cameras)
    for name in names:
        own = list(cameras[name].get("distortion", []))
        own += [0.0] * (_COEFFICIENTS[cameras[name]["model"]] - len(own))
        cameras[name] = {**cameras[name], "intrinsics": "identify", "distortion": own}
    robot = problem.robot.with_(cameras=cameras)
    measured = measurements(problem.data, robot)
    there = _unknowns(problem, problem.alignment.unknowns, measured.parameters)
    return problem.with_(robot=robot, measured=measured, alignment=replace(problem.alignment, unknowns=there))


def _unknowns(problem: CalibrationProblem, values: FloatArray, of: Sequence[_core.Parameter]) -> FloatArray:
    """(U,) values of other unknowns, from those (V,) of the problem; 0 of what is not among these."""
    own = {(p.owner, p.name): value for p, value in zip(problem.measured.parameters, values.tolist(), strict=True)}
    return np.array([own.get((p.owner, p.name), 0.0) for p in of])


def lens_columns(
    problem: CalibrationProblem, near: Residuals, names: Collection[str] | None = None
) -> LensColumns | None:
    """Those of some cameras, or of all whose lens is said to be known; None where there are none, or no corners."""
    known = tuple(known_lenses(problem) if names is None else names)
    if not known:
        return None
    freed = with_lenses(problem, known)
    own_count = len(problem.model.start)
    theta = np.append(near.theta[:own_count], _unknowns(problem, near.theta[own_count:], freed.measured.parameters))
    J = np.asarray(freed.linearize(theta, near.noise).J)
    of_lens = [
        own_count + k
        for k, p in enumerate(freed.measured.parameters)
        if p.owner in {f"camera {name}" for name in known} and p.name not in PLACEMENT
    ]
    return LensColumns(known, J[near.place][:, of_lens])


def explained_by_lens(problem: CalibrationProblem, near: Residuals, names: Collection[str] | None = None) -> float:
    """The share of the squares left that other lenses would explain, of some cameras or of all said to be known.

    0 where the corners are too few to say.
    """
    found = lens_columns(problem, near, names)
    if found is None:
        return 0.0
    corners = near.of(kind_named(CORNERS)) & near.kept
    J, H = near.J[corners][:, near.free], found.columns[corners]
    if corners.sum() < _FEWEST * (J.shape[1] + H.shape[1]):
        return 0.0
    r, row = near.residual[corners], near.row[corners]
    alone, with_lens = huber_fit(J, r, row)[0], huber_fit(np.hstack([J, H]), r, row)[0]
    return 1 - with_lens / alone if alone > 0 else 0.0


def lens_note(problem: CalibrationProblem, near: Residuals) -> str | None:
    """The sentence where another lens would explain most of what the fit leaves; None where it would not."""
    share = explained_by_lens(problem, near)
    if not share >= EXPLAINED:
        return None
    known = known_lenses(problem)
    names, several = ", ".join(known), len(known) > 1
    return (
        f"camera{'s' if several else ''} {names}: another lens than the file's would explain "
        f"{100 * share:.0f} % of the squares that are left: calibrate the lens, or have it identified with "
        "`intrinsics: identify`"
    )
