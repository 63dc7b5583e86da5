# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Was a camera or a board knocked between two pictures? From the poses of the board in them, with the arm as it is.

With X and Y of A_i X S_i = Y, the error of a picture is the twist e_i = log(Y^-1 A_i X S_i). A change of the camera's
place moves it by Ad(S_i^-1) dx, one of the board's by -dy; the rows from which either did are looked for as those of a
tracker that moved (`shifted_rows`). The arm's own error is unknown here, so a knock must explain nearly everything.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.hand_eye import hand_eye
from fastcal.calibration.picture_readings import Arm, View
from fastcal.calibration.shifted_rows import find_shift, huber_fit
from fastcal.robot.se3 import skew
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

CLEAR = 8.0  # times the squares that it leaves: such a knock is no error of the arm
MOST = 0.05  # [m] of a knock
_LEVER = 0.3  # [m] at which a turn counts as a shift


def knock_note(view: View, arm: Arm) -> str | None:
    """The sentence where the camera or the board stands elsewhere from a row on; None where neither does."""
    rows, S = view.all_poses()
    A = arm.between(view.camera, view.board)[rows]
    solved = hand_eye(A, S)
    if solved is None:
        return None
    X, Y = solved
    E = np.linalg.inv(Y) @ A @ X @ S
    turn = np.array([_core.log_so3(np.ascontiguousarray(R)) for R in E[:, :3, :3]])
    e = np.hstack([E[:, :3, 3], _LEVER * turn])
    of_camera = np.array([_adjoint(T) for T in np.linalg.inv(S)])
    of_board = np.broadcast_to(-np.eye(6), of_camera.shape)
    weight = np.repeat([1.0, _LEVER], 3)[:, np.newaxis]
    columns = [(J * weight).reshape(-1, 6) for J in (of_camera, of_board)]
    row = np.repeat(rows, 6)
    shift = find_shift(np.hstack(columns), columns, e.ravel(), row, 1.0)
    if shift is None or not shift.stands_out or shift.size > MOST:
        return None
    if shift.left * CLEAR > huber_fit(np.hstack(columns), e.ravel(), row)[0]:
        return None
    first = " and ".join(str(row) for row in shift.firsts)
    return (
        f"from row {first} on camera {view.names[0]} or board {view.names[1]} stands elsewhere, by about "
        f"{from_si(shift.size, 'mm'):.2g} mm: it was knocked; `fastcal diagnose` tells which and corrects it"
    )


def _adjoint(T: FloatArray) -> FloatArray:
    """(6, 6) by which a twist (shift, turn) is that of another frame."""
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = T[:3, :3]
    out[:3, 3:] = skew(T[:3, 3]) @ T[:3, :3]
    return out
