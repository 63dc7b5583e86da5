# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What corners say of a lens that the file calls known: its derivatives beside those of the fit, and a test.

With r the whitened residuals of the fit, J its columns and H those of focal length, centre and distortion,

    share = 1 - |r - (J, H) x|^2 / |r - J y|^2

is what another lens would explain, or boards of another size by theirs. It is told where that is more than half of what
the fit leaves: corners of a picture share the errors of the arm, so that chance alone is no measure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals
from fastcal.calibration.shifted_rows import EXPLAINED, huber_fit
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.kinds import kind_named
from fastcal.robot.rig import PLACEMENT, sized

_COEFFICIENTS = {"pinhole": 5, "fisheye": 4}  # k1, k2, p1, p2, k3 of a lens whose file has fewer
_ALIKE = 2.0  # times the squares that the better of two explanations leaves: the other one is as good
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


def size_columns(problem: CalibrationProblem, near: Residuals) -> FloatArray:
    """(m, b) whitened change of what was measured by the size of each board, all its lengths a unit share larger."""
    boards, share = problem.robot.description.boards, 1e-5
    theta, noise = near.theta, near.noise

    def left(scaled: Mapping[str, Any]) -> FloatArray:
        measured = measurements(problem.data, problem.robot.with_(boards=scaled))
        return np.asarray(_core.linearize(problem.model, problem.samples, measured, theta, noise, problem.threads).r)

    as_is = left(boards)
    columns = [(left({**boards, name: sized(board, 1 + share)}) - as_is) / share for name, board in boards.items()]
    return np.column_stack(columns)[near.place]


def lens_note(problem: CalibrationProblem, near: Residuals) -> str | None:
    """The sentence where another lens, or boards of another size, would explain most of what the fit leaves, or None.

    Where both explain about as much, as in pictures of boards that all face the camera, both are said.
    """
    found = lens_columns(problem, near)
    if found is None:
        return None
    corners = near.of(kind_named(CORNERS)) & near.kept
    J, H = near.J[corners][:, near.free], found.columns[corners]
    if corners.sum() < _FEWEST * (J.shape[1] + H.shape[1]):
        return None
    r, row, D = near.residual[corners], near.row[corners], size_columns(problem, near)[corners]
    alone, with_lens, with_size = (huber_fit(of, r, row)[0] for of in (J, np.hstack([J, H]), np.hstack([J, D])))
    least = min(with_lens, with_size)
    if least > (1 - EXPLAINED) * alone:
        return None
    said, acts = [], []
    if with_lens <= _ALIKE * least:
        names, several = ", ".join(found.cameras), len(found.cameras) > 1
        said.append(f"camera{'s' if several else ''} {names}: another lens than the file's")
        acts.append(
            "calibrate the lens, or have it identified with `intrinsics: identify` and `distortion: [0, 0, 0, 0, 0]`"
        )
    if with_size <= _ALIKE * least:
        boards = list(problem.robot.description.boards)
        said.append(f"board{'s' if len(boards) > 1 else ''} {', '.join(boards)}: another size than the file's")
        acts.append("measure the squares over the whole board")
    both = "; these pictures do not tell the two apart, others with the board slanted do" if len(said) > 1 else ""
    return (
        f"{', or '.join(said)} would explain {100 * (1 - least / alone):.0f} % of the squares that are left{both}: "
        f"{', and '.join(acts)}"
    )
