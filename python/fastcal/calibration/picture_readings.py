# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Misinterpretation that explains why pictures and arm disagree: another board, lens, unit, order, sign or frame.

A picture by itself says whether its corners can be those of this board: the homography of a grid holds for one number
of corners to a row. With the arm, poses A_i of what
carries the camera and S_i of the board agree in A_i X S_i = Y (`hand_eye`) for the reading that was meant. It is named
where as given they are far off, and where it fits BETTER times as well; else nothing is named.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.board_poses import board_poses, drawn_board, planar_misfit
from fastcal.calibration.hand_eye import FEWEST, disagreement, hand_eye, length_ratio, solved_alike, with_lengths
from fastcal.robot.rig import SQUARES, board_corners
from fastcal.said import joined, said
from fastcal.units import factor

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
Spec = Mapping[str, Any]

BETTER = 5.0  # times: such a reading was meant
FAR = 0.005  # of the picture's width: no arm with its file's lengths misses half of its pictures by more
FLAT = 0.002  # of the picture's width: no flat board seen by its lens leaves more
SLIPS = (0, 1, -1, 2, -2, 3, -3)  # rows by which all pictures, or many, may have slipped
_TRIED = 40  # pictures, spread over all
_GLANCED = 12  # of them, for a lens
_LOOKED = 3  # readings of a kind that are looked at closely, those that fit best at a glance
_ALIKE = 1.5  # times: pictures that miss two drawings by so little more do not tell them apart
MEASURE_BOARD = said(
    "these pictures fit each: measure the squares of the board, and take pictures slanted by 30 degrees about several "
    "axes, at two distances"
)
_NOT_THE_LENS = said("its pictures do not fit the lens of the file:")
_WHOLE = 0.03  # by which a ratio may miss that of two units, or of two sizes of picture
_UNITS = {factor(unit) / factor("mm"): text for unit, text in (("m", said("in m")), ("in", said("in inches")))}
_UNITS |= {10.0: said("in cm"), 100.0: said("100 times too small")}
_SIZES = (2.0, 0.5, 1.5, 2 / 3, 3.0, 1 / 3, 4.0, 0.25)  # of pictures, in those that the lens was found with
_FOCAL = np.geomspace(0.2, 5.0, 41)  # times the file's, that are tried


@dataclass(frozen=True, eq=False)
class Arm:
    """What carries cameras and boards.

    Attributes:
        frames: Names that a camera's or board's `on` may have.
        poses: (N, 4, 4) of a frame in the measuring frame, one a row.
        otherwise: Other readings of the rows: what was meant, and the poses then.
    """

    frames: Sequence[str]
    poses: Callable[[str], FloatArray]
    otherwise: Callable[[], Iterator[tuple[str, Callable[[str], FloatArray]]]] = lambda: iter(())

    def between(self, camera: Spec, board: Spec) -> FloatArray:
        """(N, 4, 4) what carries the camera, in the frame of what carries the board."""
        return _between(self.poses, camera["on"], board["on"])


@dataclass(frozen=True, eq=False)
class View:
    """What one camera saw of one board: its corners (N, K, 2) [px], and what they are called in sentences."""

    camera: Spec
    board: Spec
    uv: FloatArray
    shown: str
    names: tuple[str, str]

    def poses(self, camera: Spec | None = None, uv: FloatArray | None = None) -> tuple[IntArray, FloatArray]:
        """Rows (M,) and T_camera_board (M, 4, 4) [m] there; of _TRIED pictures at most."""
        uv = self.uv if uv is None else uv
        seen = np.flatnonzero(np.isfinite(uv[..., 0]).any(axis=1))
        tried = seen[:: max(1, -(-len(seen) // _TRIED))]
        return _flat_poses(camera or self.camera, self.board, uv, tried)

    def all_poses(self) -> tuple[IntArray, FloatArray]:
        """Rows (M,) and T_camera_board (M, 4, 4) [m] of all pictures."""
        return _flat_poses(self.camera, self.board, self.uv, np.flatnonzero(np.isfinite(self.uv[..., 0]).any(axis=1)))

    def left(self) -> dict[int, float]:
        """RMS that the board's own pose leaves in a picture [px], by row."""
        rows, T = self.all_poses()
        r = drawn_board(self.camera, self.board, T) - self.uv[rows]
        rms = np.sqrt(np.nanmean(np.sum(r**2, axis=2), axis=1)) if len(rows) else np.zeros(0)
        return dict(zip(rows.tolist(), rms.tolist(), strict=True))


def _flat_poses(camera: Spec, board: Spec, uv: FloatArray, seen: IntArray) -> tuple[IntArray, FloatArray]:
    """Rows among `seen` (M,) and T_camera_board (M, 4, 4) of a board taken as flat; none of points in space."""
    flat = {**board, "bend_mm": None}
    if not len(seen) or np.ptp(board_corners(flat)[:, 2]) > 0:
        return np.zeros(0, dtype=np.intp), np.zeros((0, 4, 4))
    rows, T = board_poses(camera, flat, uv[seen].reshape(len(seen), -1), slice(0, uv.shape[1]))
    return seen[rows], T


def drawn_by_poses(view: View, arm: Arm, fits: Callable[[FloatArray], float], enough: float) -> FloatArray | None:
    """(N, K, 2) where each posture draws the board [px], camera and board placed by hand-eye of the pictures' poses.

    Also where all pictures slipped by a few rows, or are in the reverse order: the first that is good enough, else the
    best; None from fewer than three pictures.

    Args:
        view: The pictures.
        arm: What carries camera and board.
        fits: Of a drawing: by how much pictures miss it, each at the posture that it fits [px].
        enough: [px].
    """
    rows, S = view.poses()
    if len(rows) < FEWEST:
        return None
    A = arm.between(view.camera, view.board)
    best, least = None, np.inf
    for slip in (*SLIPS, None):
        of = len(A) - 1 - rows if slip is None else rows - slip
        there = (of >= 0) & (of < len(A))
        solved = hand_eye(A[of[there]], S[there])
        if solved is None:
            continue
        drawn = drawn_board(view.camera, view.board, np.linalg.inv(A @ solved[0]) @ solved[1])
        misfit = fits(drawn)
        if misfit < least:
            best, least = drawn, misfit
        if least < enough:
            break
    return best


@dataclass(frozen=True, eq=False)
class _Reading:
    """Another reading of pictures and arm.

    Attributes:
        of: What it changes: board, lens, frames, arm, axes.
        words: What it says.
        A: (M, 4, 4) of what carries the camera, in the frame of what carries the board.
        S: (M, 4, 4) T_camera_board [m].
        camera: With the lens then.
        uv: (M, K, 2) the corners [px].
        scale: The board's size over that of the file.
    """

    of: str
    words: str
    A: FloatArray
    S: FloatArray
    camera: Spec
    uv: FloatArray
    scale: float = 1.0

    def misses(self, board: Spec) -> float:
        """By how much the pictures miss where the arm draws them then [px], half of them by less."""
        solved = hand_eye(self.A, self.S)
        if solved is None:
            return np.inf
        T = np.linalg.inv(self.A @ solved[0]) @ solved[1]
        T[:, :3, 3] /= self.scale
        r = np.linalg.norm(drawn_board(self.camera, board, T) - self.uv, axis=2)
        return float(np.median(np.sqrt(np.nanmean(r**2, axis=1))))


def meant_with_arm(view: View, arm: Arm, others: Mapping[str, Spec]) -> str | None:
    """What explains pictures that are far off: other frames, joints, units, lenses, axes of the picture; None: nothing.

    Of several that fit, that is named whose drawing the pictures miss least; readings of another kind that they miss
    about as little are named beside it: flat motion shows a board of another size and a lens of another focal length
    alike.

    Args:
        view: The pictures.
        arm: What carries camera and board.
        others: The other cameras, by name.
    """
    rows, S = view.poses()
    if len(rows) < FEWEST:
        return None
    A = arm.between(view.camera, view.board)[rows]
    as_given = disagreement(A, S)
    found = [reading for reading in _looked_at(view, arm, others, rows, S) if _fits(reading) * BETTER < as_given]
    if not found:
        return None
    misses = [reading.misses(view.board) for reading in found]
    order = np.argsort(misses, kind="stable").tolist()
    named: dict[str, str] = {}
    for k in order:
        if misses[k] <= _ALIKE * misses[order[0]]:
            named.setdefault(found[k].of, found[k].words)
    if len(named) == 1:
        return f"{view.shown}: {found[order[0]].words}"
    both = "; or ".join(named.values())
    return f"{view.shown}: {both}; {MEASURE_BOARD}"


def _fits(reading: _Reading) -> float:
    return disagreement(reading.A, reading.S)


def _looked_at(view: View, arm: Arm, others: Mapping[str, Spec], rows: IntArray, S: FloatArray) -> list[_Reading]:
    """Of each kind those readings that fit best at a glance."""
    glances: dict[str, list[tuple[float, _Reading]]] = {}
    for reading in _readings(view, arm, others, rows, S):
        glances.setdefault(reading.of, []).append((_glance(reading.A, reading.S), reading))
    return [reading for own in glances.values() for _, reading in sorted(own, key=lambda of: of[0])[:_LOOKED]]


def mirrored(view: View) -> bool:
    """Do all pictures show the board from its back, x along its rows and y down its columns?"""
    xy = np.column_stack([board_corners(view.board)[:, :2], np.ones(view.uv.shape[1])])
    signs = []
    for seen in view.uv:
        known = np.isfinite(seen).all(axis=1)
        if known.sum() >= xy.shape[1]:
            slope, _, rank, _ = np.linalg.lstsq(xy[known], seen[known], rcond=1e-9)
            if rank == xy.shape[1]:
                signs.append(np.sign(np.linalg.det(slope[:2])))
    return bool(signs) and max(signs) < 0


def other_numbering(view: View) -> str | None:
    """Where pictures by themselves say that another number of corners is to a row than the file's board has."""
    if view.board["kind"] not in (*SQUARES, "circles") or view.board.get("asymmetric"):
        return None
    squares = int(view.board["kind"] in SQUARES)
    own = int(view.board["columns"]) - squares
    most = int(np.flatnonzero(np.isfinite(view.uv).all(axis=2).any(axis=0)).max(initial=0))
    as_given, camera = _of_width(view, own), view.camera
    if not FLAT * camera["size_px"][0] < as_given < np.inf:
        return None
    found = {width: _of_width(view, width) for width in range(2, most + 1) if width != own}
    if not found or min(found.values()) * BETTER > as_given:
        return None
    width = min(found, key=lambda of: found[of])
    down = int(view.board["rows"]) - squares
    why = "are columns and rows exchanged, or corners counted down the columns" if width == down else "is it this board"
    what = "squares" if squares else "circles"
    return (
        f"{view.shown}: its pictures are those of a board with {width + squares} {what} in a row, and the file has "
        f"columns: {own + squares}; {why}?"
    )


def _of_width(view: View, width: int) -> float:
    """Median of what a homography leaves [px] where so many corners are to a row."""
    k = np.arange(view.uv.shape[1])
    points = np.column_stack([k % width, k // width]).astype(np.float64)
    left = [planar_misfit(view.camera, points, seen) for seen in _some(view.uv)]
    known = [of for of in left if of is not None]
    return float(np.median(known)) if known else np.inf


def _some(uv: FloatArray, most: int = 8) -> FloatArray:
    """Pictures with the most corners."""
    count = np.isfinite(uv).all(axis=2).sum(axis=1)
    return uv[np.argsort(-count, kind="stable")[:most]]


def _lenses(view: View, others: Mapping[str, Spec]) -> Iterator[tuple[str, Spec]]:
    """Lenses of pictures of another size, of another camera, or with another focal length or centre."""
    camera = view.camera
    focal, centre = np.array(camera["focal_px"]), np.array(camera["centre_px"])
    for other, entry in others.items():
        if _lens_of(entry) != _lens_of(camera):
            yield f"are they of camera {other}, the cameras' names exchanged?", {**camera, **_lens_of(entry)}
    for size in _SIZES:
        was = f"found with pictures {1 / size:.3g} times as large?"
        yield f"was its lens (focal_px, centre_px) {was}", _with_lens(camera, focal * size, centre * size)
        yield f"was its focal_px {was}", _with_lens(camera, focal * size, centre)
        yield f"was its centre_px {was}", _with_lens(camera, focal, centre * size)
    yield "is its centre_px y before x?", _with_lens(camera, focal, centre[::-1])
    yield "has its distortion the other sign?", {**camera, "distortion": [-k for k in camera["distortion"]]}
    for ratio in _FOCAL:
        yield _focal(ratio), _with_lens(camera, focal * ratio, centre)


def _lens_of(camera: Spec) -> dict[str, Any]:
    return {key: list(camera[key]) for key in ("focal_px", "centre_px", "distortion")}


def _with_lens(camera: Spec, focal: FloatArray, centre: FloatArray) -> Spec:
    return {**camera, "focal_px": focal.tolist(), "centre_px": centre.tolist()}


def _readings(view: View, arm: Arm, others: Mapping[str, Spec], rows: IntArray, S: FloatArray) -> Iterator[_Reading]:
    """All that are tried; S are the poses (M, 4, 4) in the rows as the file has board and lens."""
    camera, board, uv = view.camera, view.board, view.uv
    A = arm.between(camera, board)
    if (scale := length_ratio(A[rows], S)) is not None:
        yield _Reading("board", size_of(scale), A[rows], with_lengths(S, scale), camera, uv[rows], scale)
    whose = (
        f"is camera {view.names[0]} on {{}} and board {view.names[1]} on {{}}, not on {camera['on']} and {board['on']}?"
    )
    for on in arm.frames:
        for ends in ((on, "world"), ("world", on)):
            if ends != (camera["on"], board["on"]):
                there = _between(arm.poses, *ends)[rows]
                yield _Reading("frames", whose.format(*ends), there, S, camera, uv[rows])
    for words, poses in arm.otherwise():
        yield _Reading("arm", words, _between(poses, camera["on"], board["on"])[rows], S, camera, uv[rows])
    if camera["intrinsics"] != "identify":
        some = np.full_like(uv, np.nan)
        some[rows[:: max(1, len(rows) // _GLANCED)]] = uv[rows[:: max(1, len(rows) // _GLANCED)]]
        for words, lens in _lenses(view, others):
            of, T = view.poses(lens, some)
            yield _Reading("lens", f"{_NOT_THE_LENS} {words}", A[of], T, {**camera, **lens}, uv[of])
    width = float(camera["size_px"][0])
    across = np.stack([width - 1 - uv[..., 0], uv[..., 1]], axis=-1)
    for words, turned in (
        ("u_px and v_px are exchanged", uv[..., ::-1]),
        ("its pictures are mirrored, left for right, as some programs show them", across),
    ):
        of, T = view.poses(uv=turned)
        yield _Reading("axes", words, A[of], T, camera, turned[of])


def _between(poses: Callable[[str], FloatArray], camera_on: str, board_on: str) -> FloatArray:
    return np.asarray(np.linalg.inv(poses(board_on)) @ poses(camera_on), dtype=np.float64)


def _glance(A: FloatArray, S: FloatArray) -> float:
    """Median misfit of all poses alike."""
    X, Y = solved_alike(A, S)
    return float(np.median(np.linalg.norm(A @ X @ S - Y, axis=(1, 2))))


def size_of(scale: float) -> str:
    """What a board is that the arm sees so many times as large as the file has it."""
    seen = said("seen with this arm the board is {scale:.4g} times as large as its file says:", scale=float(scale))
    for unit, text in _UNITS.items():
        if abs(scale / unit - 1) < _WHOLE:
            return said("{seen} are its lengths {unit}?", seen=seen, unit=text)
        if abs(scale * unit - 1) < _WHOLE:
            return said("{seen} are its lengths, or those of the arm, in another unit?", seen=seen)
    return said("{seen} measure its squares", seen=seen)


def focal_of(ratio: float) -> str:
    """What is said of a camera whose pictures fit so many times its focal length."""
    return joined(" ", [_NOT_THE_LENS, _focal(ratio)])


def _focal(ratio: float) -> str:
    return said("they fit a focal length about {ratio:.2g} times that of the file", ratio=float(ratio))
