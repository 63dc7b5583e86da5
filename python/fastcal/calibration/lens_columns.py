# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do the corners contradict intrinsics that the file calls known? A score test with the derivatives of the lens.

With r the whitened residuals of the fit, J its columns and H those of focal length, centre and distortion,

    share = 1 - |r - (J, H) x|^2 / |r - J y|^2

is what another lens would explain. It is told where that is more than half of what the fit leaves: corners of a picture
share the errors of the arm, so that chance alone is no measure.
"""

from __future__ import annotations

from dataclasses import dataclass

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


def lens_columns(problem: CalibrationProblem, near: Residuals) -> LensColumns | None:
    """Those of all cameras whose lens is said to be known; None where there are none, or no corners."""
    cameras = problem.robot.description.cameras
    known = tuple(name for name, camera in cameras.items() if camera["intrinsics"] != "identify")
    if not known or CORNERS not in problem.data.kinds:
        return None
    asked = dict(cameras)
    for name in known:
        own = list(cameras[name].get("distortion", []))
        own += [0.0] * (_COEFFICIENTS[cameras[name]["model"]] - len(own))
        asked[name] = {**cameras[name], "intrinsics": "identify", "distortion": own}
    measured = measurements(problem.data, problem.robot.with_(cameras=asked))
    own_count = len(problem.model.start)
    values = {(p.owner, p.name): near.theta[own_count + k] for k, p in enumerate(problem.measured.parameters)}
    theta = [*near.theta[:own_count], *(values.get((p.owner, p.name), 0.0) for p in measured.parameters)]
    J = np.asarray(
        _core.linearize(problem.model, problem.samples, measured, np.array(theta), near.noise, problem.threads).J
    )
    of_lens = [
        own_count + k
        for k, p in enumerate(measured.parameters)
        if p.owner in {f"camera {name}" for name in known} and p.name not in PLACEMENT
    ]
    return LensColumns(known, J[near.place][:, of_lens])


def lens_note(problem: CalibrationProblem, near: Residuals) -> str | None:
    """The sentence where another lens would explain most of what the fit leaves; None where it would not."""
    found = lens_columns(problem, near)
    if found is None:
        return None
    corners = near.of(kind_named(CORNERS)) & near.kept
    J, H = near.J[corners][:, near.free], found.columns[corners]
    if corners.sum() < _FEWEST * (J.shape[1] + H.shape[1]):
        return None
    r, row = near.residual[corners], near.row[corners]
    alone, with_lens = huber_fit(J, r, row)[0], huber_fit(np.hstack([J, H]), r, row)[0]
    if with_lens > (1 - EXPLAINED) * alone:
        return None
    names, several = ", ".join(found.cameras), len(found.cameras) > 1
    return (
        f"camera{'s' if several else ''} {names}: another lens than the file's would explain "
        f"{100 * (1 - with_lens / alone):.0f} % of the squares that are left: calibrate the lens, or have it "
        "identified with `intrinsics: identify` and `distortion: [0, 0, 0, 0, 0]`"
    )
