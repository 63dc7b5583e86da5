# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Uncertainty of each camera's pose on its arm or in the room, and the directions that the motions do not determine.

With C the covariance of the camera's shift d and turn w in its own axes, |d| is below a bound with 95 % probability:

    |d|^2 ~ g h F(h, freedom),   h = (tr C)^2 / tr C^2,   g = tr C / h          (F. E. Satterthwaite, 1946)

and so for |w|, and for a point p before the camera, which moves by d + w x p. Undetermined directions are found with
the identified arm held fixed: camera, board and lens only. Motions without rotation leave the camera's pose
undetermined, rotations about one axis its position along that axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.moving_rig import frames_of
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.unknowns import CORNERS, of_corners, unknowns_with_covariance
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.hand_eye import hand_eyes
from fastcal.robot.rig import PLACEMENT, board_corners, known_within, pictures
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import RobotSpec
from fastcal.robot.se3 import skew
from fastcal.units import from_si

LEVEL = 0.95
EXCHANGED = 3.0  # times nearer to the other's place in the file than to its own
ONE_AXIS = "rotate whatever carries the camera or the board about a second axis too, by 30 degrees or more"
TWO_AXES = "rotate whatever carries the camera or the board about two non-parallel axes, by 30 degrees or more"
_NEARLY = 0.35  # [rad] from half a turn: files have cameras within less
_KNOWN_TO = 10.0  # plausible sizes, GaugeOptions::practical_limit of the core: beyond it nothing is known
_ROUNDING = 1e-12  # of the best known direction's information
_LEVER = 0.3  # [m] at which a turn counts as a shift
_SHARE = 0.3  # of an open direction that lies along an axis: so much makes that axis open


@dataclass(frozen=True)
class CameraPlace:
    """What is known of one camera's place.

    Attributes:
        camera: Its name.
        frame: What it stands on: the flange, a link, or the arm's base where it stands in the room.
        within: With 95 % probability the camera is so near [m] to where the model has it; NaN where that is open.
        within_turn: Its turn, as `within` [rad].
        distance: Of the boards' middles from the camera [m], their median.
        point_within: A point where the boards were is placed so well [m] by the camera alone; NaN where open.
        with_arm: It counts together with the identified arm, not with the nominal one: what the last joint is off
            is in the camera's place.
        undetermined: Those of x, y, z, rx, ry, rz, in the camera's axes, that the motions do not show.
        axes_missing: About so many axes more the pictures' motions would have to turn.
    """

    camera: str
    frame: str
    within: float
    within_turn: float
    distance: float
    point_within: float
    with_arm: bool
    undetermined: tuple[str, ...] = ()
    axes_missing: int = 0

    @property
    def motion(self) -> str:
        """What motion would show what is undetermined; empty where nothing is."""
        return ("", ONE_AXIS, TWO_AXES)[self.axes_missing]

    @property
    def sentence(self) -> str:
        """In words."""
        where = f"camera {self.camera} on {self.frame}"
        if self.undetermined:
            return f"{where}: {', '.join(self.undetermined)} undetermined by these pictures; {self.motion}"
        arm = ", with the arm of model.yaml" if self.with_arm else ""
        shift, turn, point = (
            from_si(self.within, "mm"),
            from_si(self.within_turn, "deg"),
            from_si(self.point_within, "mm"),
        )
        distance = from_si(self.distance, "mm")
        return (
            f"{where}: known to {shift:.2g} mm and {turn:.2g} deg, and a point at {distance:.0f} mm to {point:.2g} mm "
            f"(95 %{arm})"
        )

    def to_json_dict(self) -> dict[str, Any]:
        """As result.json has it."""
        return {
            "camera": self.camera,
            "frame": self.frame,
            "level": LEVEL,
            "within_mm": from_si(self.within, "mm"),
            "within_deg": from_si(self.within_turn, "deg"),
            "distance_mm": from_si(self.distance, "mm"),
            "point_within_mm": from_si(self.point_within, "mm"),
            "with_identified_arm": self.with_arm,
            "undetermined": list(self.undetermined),
            "motion": self.motion,
        }


def camera_places(
    problem: CalibrationProblem, found: _core.Identification, covariance: FloatArray, freedom: int, model: Robot
) -> list[CameraPlace]:
    """Of each camera that was placed, in the order of the spec.

    Args:
        problem: What was fitted.
        found: The fit.
        covariance: Of its free parameters, SI.
        freedom: Degrees of freedom of the noise.
        model: The identified robot, with its cameras.
    """
    if CORNERS not in problem.data.kinds:
        return []
    own = len(problem.model.start)
    names, _, C = unknowns_with_covariance(found, problem.measured, own, covariance)
    at = {name: k for k, name in enumerate(names)}
    is_open = _open_directions(problem, found, own)
    with_arm = any(i < own for i in found.free)
    out = []
    for of in hand_eyes(model.description):
        places = [at.get((f"camera {of.camera}", axis)) for axis in PLACEMENT]
        six = [k for k in places if k is not None]
        if len(six) < len(PLACEMENT):
            continue  # it was given, or saw nothing
        middles = middles_of_boards(model, problem.data, of.camera)
        place = camera_place(
            of.camera, of.parent, C[np.ix_(six, six)], freedom, middles, is_open[six], with_arm=with_arm
        )
        out.append(place)
    return out


def camera_place(
    camera: str,
    frame: str,
    C: FloatArray,
    freedom: int,
    middles: FloatArray,
    is_open: FloatArray | None = None,
    *,
    with_arm: bool,
) -> CameraPlace:
    """Of one camera: covariance (6, 6), middles of boards (M, 3) before it, and open directions (6, k)."""
    is_open = np.zeros((len(PLACEMENT), 0)) if is_open is None else is_open
    undetermined = tuple(axis for axis, part in zip(PLACEMENT, is_open, strict=True) if np.linalg.norm(part) > _SHARE)
    distance = float(np.median(np.linalg.norm(middles, axis=1)))
    if undetermined:
        missing = min(max(int(np.linalg.matrix_rank(is_open[:3], tol=_SHARE)), 1), 2)
        return CameraPlace(camera, frame, np.nan, np.nan, distance, np.nan, with_arm, undetermined, missing)
    points = []
    for p in middles:
        J = np.hstack([np.eye(3), -skew(p)])
        points.append(within(J @ C @ J.T, freedom))
    shift, turn = within(C[:3, :3], freedom), within(C[3:, 3:], freedom)
    return CameraPlace(camera, frame, shift, turn, distance, float(np.median(points)), with_arm)


def within(C: FloatArray, freedom: int) -> float:
    """Bound of the length of a vector of covariance C (k, k), with 95 % probability; C has `freedom` itself."""
    from scipy import special  # takes longer to import than a fit

    total, squares = float(np.trace(C)), float(np.sum(C * C))
    if not squares > 0:
        return 0.0
    h = total**2 / squares
    return float(np.sqrt(total * special.fdtri(h, float(max(freedom, 1)), LEVEL)))


def _open_directions(problem: CalibrationProblem, found: _core.Identification, own: int) -> FloatArray:
    """(U, k) directions of the unknowns that no corner shows beside the arm as it is, of length 1 in plausible sizes.

    Of corners alone: what exact touches show would make all that corners show look like rounding.
    """
    near = problem.linearize(np.asarray(found.theta), list(found.common_noise))
    unknowns = problem.measured.parameters
    sizes = np.array([parameter.sigma for parameter in unknowns])
    J = np.asarray(near.J)[of_corners(near, problem.measured)][:, own:] * sizes
    known = sizes / known_within(problem.robot.description, unknowns)
    values, directions = np.linalg.eigh(J.T @ J + np.diag(known**2))
    return np.asarray(directions[:, values < max(1 / _KNOWN_TO**2, _ROUNDING * values[-1])])


def exchanged_names(given: RobotSpec, found: RobotSpec) -> list[str]:
    """A sentence for two cameras of which each was found where the file has the other."""

    def apart(a: str, b: str) -> float:
        T = np.linalg.inv(pose(given.cameras[a])) @ pose(found.cameras[b])
        return float(np.hypot(np.linalg.norm(T[:3, 3]), _LEVER * np.linalg.norm(T[:3, :3] - np.eye(3))))

    return [
        f"cameras {a} and {b}: each was found where the file has the other; are their pictures exchanged?"
        for a, b in combinations(given.cameras, 2)
        if given.cameras[a]["on"] == given.cameras[b]["on"]
        and (apart(a, b) + apart(b, a)) * EXCHANGED < apart(a, a) + apart(b, b)
    ]


def turned_pictures(given: RobotSpec, found: RobotSpec) -> list[str]:
    """A sentence for each camera that was found half turned about its optical axis from where the file has it."""
    half = np.diag([-1.0, -1.0, 1.0])
    out = []
    for name, camera in given.cameras.items():
        T, there = pose(camera), pose(found.cameras[name])
        if np.allclose(T, np.eye(4)):  # nothing was said of it
            continue
        angle = float(np.linalg.norm(_core.log_so3(half @ T[:3, :3].T @ there[:3, :3])))
        if angle < _NEARLY:
            out.append(
                f"camera {name} was found half turned about its optical axis from where the file has it: are its "
                "pictures turned by 180 degrees, or is it mounted so? Its place is that of pictures as they are read, "
                "of which centre_px and distortion must be too"
            )
    return out


def middles_of_boards(model: Robot, data: Dataset, camera: str) -> FloatArray:
    """(M, 3) middles of the boards [m] in the frame of a camera, one a picture."""
    spec = model.description
    entry = spec.cameras[camera]
    uv = data.observed[CORNERS].reshape(len(data), -1, 2)
    T_world_camera = frames_of(model, data.q, entry["on"]) @ pose(entry)
    out = []
    for (name, board), places in pictures(spec).items():
        rows = np.isfinite(uv[:, places, 0]).any(axis=1)
        if name != camera or not rows.any():
            continue
        plate = spec.boards[board]
        T = np.linalg.inv(T_world_camera[rows]) @ frames_of(model, data.q[rows], plate["on"]) @ pose(plate)
        out.append(T[:, :3, :3] @ board_corners(plate).mean(axis=0) + T[:, :3, 3])
    return np.concatenate(out) if out else np.zeros((0, 3))
