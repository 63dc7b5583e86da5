# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Signs and zeros of joints that nobody set: q = s J + z of what motors count, J, by pictures of a board or touches.

Cheap arms count from wherever their horns were screwed on. With the lengths of the URDF, the frame F that carries the
camera (or the board) and the board's pose S in the camera, turned round where the camera stands in the room,

    F_i(s J_i + z) X S_i = Y

holds with one X and Y for the right signs s and zeros z, and for no others but those told below. X and Y are in closed
form for any s and z (`hand_eye`), so that for each of the 2^n signs a search over zeros alone remains: Levenberg and
Marquardt's from STARTS places all around, first on the turns alone, which rule out most signs; then with the places.

`touch_zeros` has the same of touches of points. The zero of the first joint turns the base and that of the last one the
camera's mount, or the tip: nothing shows them, and they stay as they are. An arm whose links lie in one plane is its
own mirror image: with all signs of that plane's joints turned round it is the same arm, its base half turned. Of
solutions that fit alike, that within the joints' limits counts, then that with the fewest turned signs, and the others
are told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fastcal.calibration.board_poses import board_poses
from fastcal.calibration.hand_eye import solved_sets
from fastcal.calibration.lens_start import with_started_lenses
from fastcal.calibration.moving_rig import frames_of
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.touch_zeros import SOCKET, touches_of
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_name
from fastcal.robot.rig import WORLD, frame_of, pictures
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

FloatArray = NDArray[np.float64]

STARTS = 16  # of the zeros, for each of the signs
FEWEST = 6  # pictures
ALIKE = 1.5  # times the misfit of the best: such a solution fits as well
_ARM = 0.3  # [m] at which a turn counts as a shift
_MOST_TURNS = 4.0  # times the least misfit of turns: signs beyond are ruled out by the turns alone
_SAME = float(to_si(3.0, "deg"))  # between zeros of one solution
_BEYOND = float(to_si(10.0, "deg"))  # of a limit: a motor's own zero is no better known
_WRONG = float(to_si(5.0, "deg"))  # of misfit: no signs and zeros fit
_STEP = 1e-7  # [rad] of differences


@dataclass(frozen=True, eq=False)
class JointZeros:
    """Signs and zeros of all joints.

    Attributes:
        sign: (n,) +1 or -1.
        zero: (n,) [rad]; 0 of the first and the last joint, which no picture shows.
        std: (n,) [rad]; NaN of these.
        misfit: [m] RMS of a picture's pose, turns at 0.3 m.
        others: Signs (n,) and zeros (n,) that fit as well.
    """

    names: tuple[str, ...]
    sign: FloatArray
    zero: FloatArray
    std: FloatArray
    misfit: float
    others: tuple[tuple[FloatArray, FloatArray], ...] = ()

    def pendant(self) -> list[dict[str, Any]]:
        """The key of a robot file that says so: its jN_deg are then what the motors count."""
        zero = from_si(self.zero, "deg").tolist()
        parts = zip(self.sign.tolist(), zero, strict=True)
        return [
            {"joint": i + 1, "sign": int(sign), "zero_deg": round(at, 9)}
            for i, (sign, at) in enumerate(parts)
            if sign < 0 or at
        ]

    def to_json_dict(self) -> dict[str, Any]:
        """Joints with their sign, zero and its standard deviation, and the solutions that fit as well."""
        zero, std = from_si(self.zero, "deg").tolist(), from_si(self.std, "deg").tolist()
        return {
            "joints": [
                {"joint": name, "sign": int(s), "zero_deg": z, "std_deg": d if np.isfinite(d) else None}
                for name, s, z, d in zip(self.names, self.sign.tolist(), zero, std, strict=True)
            ],
            "misfit_mm": from_si(self.misfit, "mm"),
            "others": [
                {"sign": [int(of) for of in sign.tolist()], "zero_deg": from_si(other, "deg").tolist()}
                for sign, other in self.others
            ],
        }


def joint_zeros(robot: Robot, data: Dataset, *, progress: Callable[[str], None] | None = None) -> JointZeros:
    """Finds signs and zeros from pictures of a board, or from touches of points.

    Args:
        robot: For pictures with its camera and board, of which one stands on the arm; their places are not used.
        data: Its q are what the motors count, in the units of the joints; corners, or `socket` labels of touches.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: Too few pictures or touches, neither camera nor board is on the arm, or a joint slides.
        Undetermined: No signs and zeros fit.
    """
    report = progress or (lambda text: None)
    # The search goes round a turn: of a length it would give one of many, in degrees, as if it were known.
    if sliding := [joint_name(i) for i, kind in enumerate(robot.joint_types) if kind == "prismatic"]:
        raise InvalidInput(
            f"{robot.name}: signs and zeros are found of joints that turn, and these slide: {', '.join(sliding)}"
        )
    robot, _ = with_started_lenses(robot, data)
    free = np.arange(1, robot.core.joint_count - 1)
    is_touched = CORNERS not in data.kinds and SOCKET in data.kinds
    views: Sequence[_Shown] = [touches_of(data, len(free))] if is_touched else _views(robot, data)
    random = np.random.default_rng(0)
    starts = random.uniform(-np.pi, np.pi, (STARTS, len(free)))
    starts[0] = 0.0
    signs = [np.array(each) for each in product((1.0, -1.0), repeat=robot.core.joint_count)]
    found: list[tuple[float, FloatArray, FloatArray]] = []
    least = 0.0
    if not is_touched:  # which show no turn alone
        report("trying signs by the turns alone")
        by_turns = [_searched(_Misfit(robot, views, sign, free, turns_alone=True), starts)[0] for sign in signs]
        least = min(by_turns)  # and with the places no less
        limit = _MOST_TURNS * max(least, 1e-3)
        signs = [sign for sign, cost in zip(signs, by_turns, strict=True) if cost <= limit]
    if least <= _ARM * _WRONG:
        report("finding the zeros")
        for sign in signs:
            found += _solutions(robot, views, sign, free, starts)
        found.sort(key=lambda of: of[0])
        least = found[0][0]
    if least > _ARM * _WRONG:
        raise Undetermined(
            f"{data.source}: no signs and zeros of the joints fit the {'touches' if is_touched else 'pictures'}: they "
            f"leave {from_si(least, 'mm'):.0f} mm or more; are the joints in the order of the robot file, and the "
            f"{'labels' if is_touched else 'pictures'} of these rows?"
        )
    alike = [of for of in found if of[0] <= ALIKE * least]
    chosen = min(alike, key=lambda of: (_outside(robot, data, *of[1:]), int(np.sum(of[1] < 0)), of[0]))
    misfit, sign, zero = chosen
    std = np.full(robot.core.joint_count, np.nan)
    std[free] = _deviations(_Misfit(robot, views, sign, free), zero[free])
    others = tuple((s, z) for _, s, z in alike if s is not sign or z is not zero)
    names = tuple(joint_name(i) for i in range(robot.core.joint_count))
    return JointZeros(names, sign, zero, std, misfit, others)


@dataclass(frozen=True, eq=False)
class _View:
    """What one camera saw of one board: counts (N, n), poses S (N, 4, 4), and the frame of the arm that carries one."""

    counts: FloatArray
    S: FloatArray
    on: str

    def misfits(self, robot: Robot, sign: FloatArray, zeros: FloatArray, *, turns_alone: bool) -> FloatArray:
        """(B, N, 6) by which F X S is away from Y: shifts [m], and turns times 0.3 m; or turns alone (B, N, 3)."""
        q = self.counts * sign + zeros[:, np.newaxis]
        F = frames_of(robot, np.ascontiguousarray(q.reshape(-1, q.shape[2])), self.on).reshape(*q.shape[:2], 4, 4)
        X, Y = solved_sets(F, np.broadcast_to(self.S, F.shape))
        E = np.linalg.inv(Y)[:, np.newaxis] @ F @ X[:, np.newaxis] @ self.S
        R = E[..., :3, :3]
        turn = np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1) / 2
        # Beyond a quarter turn the sine falls again: 1 - cos keeps large turns large.
        away = np.sqrt(np.maximum(3 - np.trace(R, axis1=-2, axis2=-1), 0.0) + 1e-30)
        size = np.linalg.norm(turn, axis=-1)
        turn *= (away / np.maximum(size, 1e-9) * (size > 0))[..., np.newaxis]
        return _ARM * turn if turns_alone else np.concatenate([E[..., :3, 3], _ARM * turn], axis=-1)


class _Shown(Protocol):
    """What shows signs and zeros."""

    def misfits(self, robot: Robot, sign: FloatArray, zeros: FloatArray, *, turns_alone: bool) -> FloatArray:
        """(B, N, m) of its rows [m] with each of the zeros (B, n)."""
        ...


def _views(robot: Robot, data: Dataset) -> list[_View]:
    if CORNERS not in data.kinds:
        raise InvalidInput(
            f"{data.source}: signs and zeros need pictures of a board (--corners) or touches of points (column socket)"
        )
    spec, out = robot.description, []
    for (camera, board), part in pictures(spec).items():
        ends = spec.cameras[camera]["on"], spec.boards[board]["on"]
        standing = [frame_of(on, robot.core.joint_count) == WORLD for on in ends]
        if standing[0] == standing[1]:
            continue
        rows, T = board_poses(spec.cameras[camera], spec.boards[board], data.observed[CORNERS], part)
        if len(rows) >= FEWEST:
            is_in_hand = standing[1]
            S: FloatArray = T if is_in_hand else np.asarray(np.linalg.inv(T), dtype=np.float64)
            out.append(_View(data.q[rows], S, ends[0] if is_in_hand else ends[1]))
    if not out:
        raise InvalidInput(
            f"{data.source}: expected {FEWEST} or more pictures in which a camera on the arm sees a board in the room, "
            "or one in the room a board on the arm"
        )
    return out


@dataclass(frozen=True, eq=False)
class _Misfit:
    """What was seen or touched is off, by the zeros of the joints `free`; of pictures the turns alone."""

    robot: Robot
    views: Sequence[_Shown]
    sign: FloatArray
    free: NDArray[np.intp]
    turns_alone: bool = False

    def __call__(self, z: FloatArray) -> FloatArray:
        """(N, m) with zeros (k,)."""
        return np.asarray(self._of(z[np.newaxis])[0])

    def slopes(self, z: FloatArray) -> FloatArray:
        """(N m, k) of z, by differences, in one go."""
        ways = np.vstack([np.zeros(len(z)), np.eye(len(z))])
        here, *there = self._of(z + _STEP * ways).reshape(len(ways), -1)
        return np.asarray((np.array(there) - here).T / _STEP)

    def _of(self, z: FloatArray) -> FloatArray:
        zeros = np.zeros((len(z), len(self.sign)))
        zeros[:, self.free] = z
        parts = [view.misfits(self.robot, self.sign, zeros, turns_alone=self.turns_alone) for view in self.views]
        out: FloatArray = np.concatenate(parts, axis=1)
        return out


def _searched(misfits: _Misfit, starts: FloatArray) -> tuple[float, FloatArray]:
    """The least RMS misfit of a row over starts, and where."""
    best, at = np.inf, starts[0]
    how: dict[str, Any] = {"method": "lm", "xtol": 1e-6, "ftol": 1e-6, "max_nfev": 60}
    rows = len(misfits(starts[0]))
    for start in starts:
        found = least_squares(lambda z: misfits(z).ravel(), start, jac=misfits.slopes, **how)
        cost = float(np.sqrt(2 * found.cost / rows))
        if cost < best:
            best, at = cost, found.x
    return best, at


def _solutions(
    robot: Robot, views: Sequence[_Shown], sign: FloatArray, free: NDArray[np.intp], starts: FloatArray
) -> list[tuple[float, FloatArray, FloatArray]]:
    """Misfit, signs and zeros of the distinct minima, the best first."""
    out: list[tuple[float, FloatArray, FloatArray]] = []
    for start in starts:
        cost, z = _searched(_Misfit(robot, views, sign, free), start[np.newaxis])
        zero = np.zeros(len(sign))
        zero[free] = np.angle(np.exp(1j * z))
        if all(np.abs(np.angle(np.exp(1j * (zero - other)))).max() > _SAME for _, _, other in out):
            out.append((cost, sign, zero))
    return sorted(out, key=lambda of: of[0])


def _outside(robot: Robot, data: Dataset, sign: FloatArray, zero: FloatArray) -> int:
    """Joints that would have been beyond their limits."""
    q = data.q * sign + zero
    low, high = robot.limits.T
    beyond = ((q < low - _BEYOND) | (q > high + _BEYOND)).any(axis=0)
    return int(np.sum(beyond[1:-1]))


def _deviations(misfits: _Misfit, z: FloatArray) -> FloatArray:
    """Standard deviations of zeros from what the best fit leaves."""
    r, J = misfits(z).ravel(), misfits.slopes(z)
    freedom = max(1, len(r) - len(z) - 12)
    return np.asarray(np.sqrt(np.diag(np.linalg.pinv(J.T @ J)) * (r @ r) / freedom))
