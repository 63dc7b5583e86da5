# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Hand-eye samples of other programs: poses of a flange, and of a board or tag as a camera saw it, in pairs.

A X S = Y holds with the flange's poses A where the camera is on the arm, and with their inverse where it is in the
room: the poses themselves say which, or that a file says it wrongly.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.hand_eye import FEWEST, gross, hand_eye
from fastcal.calibration.picture_arm import FAR_POSES, meant_by_poses
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers.pose_arrays import read_pose_arrays
from fastcal.importers.pose_lists import read_labelled_poses, read_pose_list
from fastcal.io.poses import checked, posed
from fastcal.io.yaml_file import read_yaml
from fastcal.robot.se3 import pose_of_six

FloatArray = NDArray[np.float64]

_CLEAR = 5.0  # times better: the other way round is what the file means
_ALIKE = 1.01  # no better than the other way round
_MOST = 0.75  # of few pairs half may agree in a wrong way round
_MOST_REACH = 30.0  # [m] of an arm, on its track
_NEAR = 0.5  # of the least time between two poses of the arm


@dataclass(frozen=True, eq=False)
class PosePairs:
    """Pairs of poses.

    Attributes:
        flange: (N, 4, 4) T_base_flange [m].
        seen: (N, 4, 4) T_camera_board [m].
        in_hand: Is the camera on the arm, and not the board? None: the file does not say.
        read_as: What wrote them.
        notes: What a reader should know, a sentence each.
        joints: (N, n) of the arm [rad, m], where they are known.
    """

    flange: FloatArray
    seen: FloatArray
    in_hand: bool | None
    read_as: str
    notes: tuple[str, ...] = ()
    joints: FloatArray | None = None


def read_pose_pairs(files: Sequence[Path], *, asked: bool = False, orientation: str | None = None) -> PosePairs | None:
    """The pairs in a file or folder that says what it is, or in two lists where they are asked for; None: no such file.

    Args:
        files: Samples of easy_handeye2 or MoveIt, a folder of ViSP, a .npz with the poses of both, or two lists: of
            the flange, of the board.
        asked: They are to be hand-eye samples, whatever they look like.
        orientation: What the angles of lists are that have six numbers a pose.

    Raises:
        ParseError: They are, and cannot be read.
        InvalidInput: Asked for and not recognized, or fewer than three.
    """
    found = None
    if len(files) == 1:
        found = _visp(files[0]) if files[0].is_dir() else _yaml_samples(files[0]) or _arrays(files[0])
        found = found or _labelled(files[0], orientation)
    elif len(files) == 2 and asked:
        found = _two_lists(files[0], files[1], orientation)
    if found is None:
        if asked:
            raise InvalidInput(
                "expected samples of easy_handeye2 or MoveIt, a folder of ViSP, a .npz with both poses (T_base_ee and "
                "T_cam_board, or R_gripper2base, t_gripper2base, R_target2cam and t_target2cam), or two lists of "
                "poses: of the flange in the base, and of the board in the camera"
            )
        return None
    return agreeing(found, files)


def agreeing(found: PosePairs, files: Sequence[Path]) -> PosePairs:
    """The pairs, with what their poses say of where the camera is and which of them agree.

    Raises:
        InvalidInput: Fewer than three, or they do not agree.
    """
    if len(found.flange) < FEWEST:
        raise InvalidInput(f"{files[0]}: holds {len(found.flange)} pairs of poses; expected {FEWEST} at least")
    right = _the_right_way(found)
    return replace(right, notes=(*right.notes, *_check_agreement(right, files)))


def _yaml_samples(path: Path) -> PosePairs | None:
    """easy_handeye2's .samples and MoveIt's pose samples, as YAML or JSON."""
    if path.suffix.lower() not in (".samples", ".yaml", ".yml", ".json"):
        return None
    content = read_yaml(path)
    if isinstance(content, Mapping) and isinstance(content.get("samples"), list):
        return _easy_handeye2(content, path)
    if isinstance(content, list) and content and isinstance(content[0], Mapping) and "effector_wrt_world" in content[0]:
        flange, seen = (
            np.array([_matrix(each.get(key), path, k) for k, each in enumerate(content)])
            for key in ("effector_wrt_world", "object_wrt_sensor")
        )
        return PosePairs(flange, seen, None, "MoveIt's pose samples")
    return None


def _arrays(path: Path) -> PosePairs | None:
    """Both of a .npz."""
    found = read_pose_arrays(path)
    return None if found is None else PosePairs(*found, None, "numpy's arrays of poses")


def _easy_handeye2(content: Mapping[str, Any], path: Path) -> PosePairs:
    kind = str((content.get("parameters") or {}).get("calibration_type") or "")
    flange, seen = (
        np.array([_transform(each.get(key), path, k) for k, each in enumerate(content["samples"])]).reshape(-1, 4, 4)
        for key in ("robot", "tracking")
    )
    in_hand = {"eye_in_hand": True, "eye_on_base": False}.get(kind)
    if in_hand is False:
        flange = np.linalg.inv(flange)  # with the camera in the room it keeps the base in the effector
    return PosePairs(flange, seen, in_hand, "easy_handeye2's samples")


def _transform(value: Any, path: Path, row: int) -> FloatArray:
    """(4, 4) of a translation and a rotation as ROS writes them."""
    try:
        p = [float(value["translation"][key]) for key in "xyz"]
        q = np.array([float(value["rotation"][key]) for key in "wxyz"])
    except (TypeError, KeyError, ValueError):
        raise ParseError(f"sample {row}: expected translation x y z and rotation x y z w", path) from None
    return posed(np.array(p), q, path, row)


def _matrix(value: Any, path: Path, row: int) -> FloatArray:
    """(4, 4) of sixteen numbers, row by row."""
    try:
        T = np.asarray(value, dtype=np.float64).reshape(4, 4)
    except (TypeError, ValueError):
        raise ParseError(f"sample {row}: expected sixteen numbers of a 4 x 4 matrix", path) from None
    return checked(T, path, row)


def _visp(folder: Path) -> PosePairs | None:
    """ViSP's pose_rPe_N.yaml (or fPe) of the effector and pose_cPo_N.yaml of the object, by their numbers."""
    numbered: dict[str, dict[int, Path]] = {"e": {}, "o": {}}
    for file in sorted(folder.glob("*.yaml")):
        if match := re.fullmatch(r".*pose_(?:[rf]P(e)|cP(o))_(\d+)", file.stem):
            numbered[match[1] or match[2]][int(match[3])] = file
    common = sorted(numbered["e"].keys() & numbered["o"].keys())
    if not common:
        return None
    flange, seen = (np.array([_theta_u(numbered[of][k], k) for k in common]) for of in "eo")
    left = len(numbered["e"]) + len(numbered["o"]) - 2 * len(common)
    notes = (f"{left} poses have no other half and were left out",) if left else ()
    return PosePairs(flange, seen, None, "ViSP's poses", notes)


def _theta_u(path: Path, row: int) -> FloatArray:
    """(4, 4) of a place [m] and a rotation vector [rad]."""
    content = read_yaml(path)
    try:
        v = np.asarray(content["data"], dtype=np.float64).reshape(6)
    except (KeyError, TypeError, ValueError):
        raise ParseError("expected data of six numbers: a place in m and a rotation vector", path) from None
    return checked(pose_of_six(v), path, row)


def _labelled(path: Path, orientation: str | None) -> PosePairs | None:
    """Lines that begin with hand or eye."""
    found = read_labelled_poses(path, orientation)
    return None if found is None else PosePairs(found[0].T, found[1].T, None, "lines of poses with labels")


def _two_lists(arm: Path, board: Path, orientation: str | None) -> PosePairs:
    """The flange's and the board's poses: by time where both have one, else one after the other."""
    a, b = (read_pose_list(path, orientation) for path in (arm, board))
    if a.times is not None and b.times is not None:
        apart = np.diff(np.sort(a.times))
        reach = _NEAR * float(np.min(apart[apart > 0], initial=np.inf))
        nearest = np.array([int(np.argmin(np.abs(b.times - t))) for t in a.times])
        near = np.abs(b.times[nearest] - a.times) <= reach
        if not near.any():
            raise InvalidInput(f"{arm} and {board}: are of other times; expected two lists of the same minutes")
        left = int((~near).sum())
        notes = (f"{left} poses of the arm have no pose of the board at their time and were left out",) if left else ()
        return PosePairs(a.T[near], b.T[nearest[near]], None, "two lists of poses, joined by time", notes)
    if len(a.T) != len(b.T):
        raise InvalidInput(f"{arm} holds {len(a.T)} poses and {board} {len(b.T)}; expected as many, or times in both")
    return PosePairs(a.T, b.T, None, "two lists of poses, joined by order")


def _the_right_way(found: PosePairs) -> PosePairs:
    """The pairs, with what their poses say of where the camera is.

    Raises:
        InvalidInput: They agree only where the file says something else.
    """
    inverse = np.asarray(np.linalg.inv(found.flange), dtype=np.float64)
    in_hand, in_room = _misfit(found.flange, found.seen), _misfit(inverse, found.seen)
    if found.in_hand is None:
        # A board whose poses are inverse looks the same as a camera at the other end: poses cannot tell these apart.
        is_in_hand = in_hand <= _ALIKE * in_room
        where = "on the arm and the board in the room" if is_in_hand else "in the room and the board on the arm"
        said = f"the camera is {where}, as the poses agree so (or the other way, were the board's poses inverse)"
        if max(in_hand, in_room) <= _CLEAR * min(in_hand, in_room):
            # Of three poses the motions between them, and between their inverses, have the same angles and pitches.
            count = len(found.flange)
            said = (
                f"{count} pairs agree about as well with a camera on the arm as with one in the room: it is "
                f"taken to be {where}; if it is not, exchange on: of camera and board in the cell file, or measure "
                "more pairs with other turns"
            )
        return replace(found, in_hand=is_in_hand, notes=(*found.notes, said))
    own, other = (in_hand, in_room) if found.in_hand else (in_room, in_hand)
    if own > _CLEAR * other:
        kind = "eye_in_hand" if found.in_hand else "eye_on_base"
        raise InvalidInput(
            f"{found.read_as}: as {kind} the poses do not agree, and {own / other:.3g} times better the other way: the "
            "poses of the arm or those of the board are inverse, or calibration_type is the other"
        )
    return found


def _check_agreement(found: PosePairs, files: Sequence[Path]) -> list[str]:
    """A sentence for pairs of something else; refuses pairs that agree on no place of camera and board.

    Raises:
        InvalidInput: They do not, with what was probably meant.
    """
    source = " and ".join(map(str, files))
    far = float(np.median(np.linalg.norm(found.flange[:, :3, 3], axis=1)))
    if far > _MOST_REACH:
        raise InvalidInput(f"{source}: the arm reaches {far:.4g} m; are the lengths in mm? They are taken as metres")
    inverse = np.asarray(np.linalg.inv(found.flange), dtype=np.float64)
    A = found.flange if found.in_hand else inverse
    solved = hand_eye(A, found.seen)
    if solved is None:
        return []
    off = np.linalg.norm(A @ solved[0] @ found.seen - solved[1], axis=(1, 2))
    if float(np.median(off)) > FAR_POSES:
        meant = meant_by_poses(found.flange, found.seen) or meant_by_poses(found.flange, found.seen, in_room=True)
        asked = "is every pose of the board that of its row, and are both in the order and unit that were taken?"
        raise InvalidInput(f"{source}: the poses of the arm and of the board do not agree: {meant or asked}")
    others = np.flatnonzero(gross(A, found.seen, *solved) & (off > FAR_POSES))
    if not len(others):
        return []
    # Where each pose of the board among them fits best, of these rows.
    fits = np.array([[np.linalg.norm(A[j] @ solved[0] @ found.seen[i] - solved[1]) for j in others] for i in others])
    other = others[np.argmin(fits, axis=1)]
    named = ", ".join(f"{i} that of {j}" for i, j in zip(others, other, strict=True) if i != j)
    where = (
        f": the board's poses fit other rows, {named}" if named and float(fits.min(axis=1).max()) < FAR_POSES else ""
    )
    listed = ", ".join(map(str, others.tolist()))
    return [f"pairs {listed} (counted from 0) do not agree with the others{where}; they get no weight"]


def _misfit(A: FloatArray, S: FloatArray) -> float:
    """Misfit of the closed form that most pairs are within [m, a turn of 1 rad counting as 1 m]."""
    solved = hand_eye(A, S)
    if solved is None:
        return float("inf")
    return float(np.quantile(np.linalg.norm(A @ solved[0] @ S - solved[1], axis=(1, 2)), _MOST)) + 1e-9
