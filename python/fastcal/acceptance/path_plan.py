# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The path test of ISO 9283 as a robot program: straight lines between corners, one orientation, ten cycles."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fastcal.acceptance.path_figures import PathRun
from fastcal.acceptance.plan import assumed
from fastcal.arrays import FloatArray
from fastcal.compensation.curves import between
from fastcal.compensation.following import follow
from fastcal.compensation.paths import path_accuracy
from fastcal.compensation.programs import robot_without_measurement
from fastcal.errors import InvalidInput
from fastcal.ik.all_configurations import branches
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.measurements.targets import targets_of
from fastcal.programs import Document, doubts_on_joints
from fastcal.programs.driving import Drive, write_drive
from fastcal.robot import se3
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot
from fastcal.robot.steady import steady
from fastcal.units import from_si

RUNS = 10  # ISO 9283: cycles of a path
_LOOKED_AT = 20  # poses on each line, where the way is tried
_CLEARANCE = 0.02  # of a joint's range, from its limits


@dataclass(frozen=True, eq=False)
class PathPlan:
    """A path as it is to be driven.

    Attributes:
        documents: The program's files.
        corners: (K, 4, 4) T_world_tool that are commanded.
        q: (K, n) joints at the corners, as the program's own digits say [rad].
        compensated: Do they bring the calibrated arm there, or the controller's nominal one?
        notes: What a reader should know.
    """

    documents: tuple[Document, ...]
    corners: FloatArray
    q: FloatArray
    compensated: bool
    notes: tuple[str, ...]


def plan_path(
    model: Robot,
    corners: PathRun,
    *,
    language: str,
    program: str,
    compensate: bool = False,
    cycles: int = RUNS,
    rotation: FloatArray | None = None,
    payload: float = 0.0,
    temperature: float | None = None,
    dwell_s: float = 3.0,
    speed: float = 0.1,
    blend: float = 0.0,
) -> PathPlan:
    """Finds a configuration in which the arm drives the whole path, and writes the program.

    Args:
        model: A calibrated model, or a nominal robot.
        corners: Their points in the model's measuring frame, with one orientation for all, or without.
        language: `rapid`, `krl`, `fanuc` or `urscript`.
        program: The file that it will be; gives the program its name.
        compensate: Command what brings the calibrated arm to the corners; False: what the controller itself would.
        cycles: Runs; the standard has ten.
        rotation: (3, 3) of the tool in the base where the corners have none; None: it points down.
        payload: Mass at the tool [kg].
        temperature: Of the arm [K], as in `plan_acceptance`.
        dwell_s: How long the arm stands before and after each run [s].
        speed: Along the path [m/s].
        blend: Distance from a corner at which the line may be left [m]; 0: the arm stops in the corner.

    Raises:
        InvalidInput: Fewer than two corners, corners that turn the tool, a path that no configuration drives, or an arm
            or a blend that the language cannot hold.
    """
    count = len(corners.points)
    if count < 2 or cycles < 1 or not speed > 0 or blend < 0:
        raise InvalidInput(
            f"expected at least 2 corners, at least 1 cycle, a speed above 0 and a blend of 0 or more, got {count}, "
            f"{cycles}, {from_si(speed, 'mm'):g} mm/s and {from_si(blend, 'mm'):g} mm"
        )
    controller = nominal_robot(model)
    T_world_base, _ = controller.core.base_and_tool(controller.core.nominal)
    if corners.rotations is None:
        kept = T_world_base[:3, :3] @ (se3.rotation_y(np.pi) if rotation is None else rotation)
    else:
        kept = corners.rotations[0]
        if np.abs(corners.rotations - kept).max() > 1e-9:
            raise InvalidInput("the corners turn the tool; expected one orientation for all, as in a path of ISO 9283")
    poses = np.array([se3.pose(kept, point) for point in corners.points])
    q_nominal = _drivable(controller, poses)
    notes: list[str] = []
    q = q_nominal
    if compensate:
        arm = robot_without_measurement(model)
        temperature, notes = assumed(arm, temperature)
        known: dict[str, Any] = {"payload": payload, "temperature": temperature, **steady(arm)}
        known = {k: v for k, v in known.items() if v is not None}
        arrives = np.sign(np.diff(q_nominal, axis=0, prepend=q_nominal[-1:]))
        found = inverse_kinematics(arm, poses, seed=q_nominal, restarts=0, approach=arrives, **known)
        if not found.reached.all():
            row = int(np.argmin(found.reached))
            raise InvalidInput(f"{model.name}, corner {row + 1} of the path: {found.message(row)}")
        q = found.q
        left = path_accuracy(arm, poses, q_nominal[0], **known)
        notes.append(
            "the corners are compensated, the lines between them are the controller's: "
            f"{from_si(float(left.off_after.max()), 'mm'):.3f} mm are left there at most, by the model"
        )
    comment = ["ISO 9283 path by fastcal", f"arm: {model.name[:40]}", f"corners: {count}"]
    comment += ["corners are compensated" if compensate else "corners are not compensated", "drive it slowly first"]
    shown = model.pendant.shown(q)
    documents, written = write_drive(language, program, Drive(shown, cycles, dwell_s, speed, blend, comment))
    if not model.description.pendant:
        notes += doubts_on_joints(documents[0].name, model.name)
    if cycles < RUNS:
        notes.append(f"{cycles} cycles are fewer than the {RUNS} of ISO 9283")
    return PathPlan(documents, poses, model.follow(model.pendant.chain(written)), compensate, tuple(notes))


def _drivable(controller: Robot, corners: FloatArray) -> FloatArray:
    """(K, n) joints at the corners in a configuration that follows all lines clear of the limits.

    Of several, the one that stays farthest from singular postures.
    """
    lines = [between(a, b, _LOOKED_AT) for a, b in pairwise(corners)]
    way = np.concatenate([corners[:1], *lines])
    low, high = controller.limits.T
    span = np.where(np.isfinite(high - low), high - low, 1.0)
    best: tuple[float, FloatArray] | None = None
    starts = branches(controller, corners[0])
    for start in starts.q[starts.reached]:
        q, reached, jumps = follow(controller, targets_of(way, start, controller.joint_count, {}))
        if not reached.all() or jumps or (np.minimum(q - low, high - q) / span).min() < _CLEARANCE:
            continue
        J = controller.joint_jacobian(q)
        J[:, :3] /= controller.reach / 4
        clear = float(np.linalg.svd(J, compute_uv=False).min())
        if best is None or clear > best[0]:
            best = clear, q[::_LOOKED_AT]
    if best is None:
        raise InvalidInput(
            f"{controller.name} drives this path in no configuration that stays clear of its joint limits; the path "
            "elsewhere or another orientation of the tool may do"
        )
    return best[1]
