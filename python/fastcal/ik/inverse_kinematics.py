# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From target poses to joint commands, on the model with all its effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.display.shown import Shown
from fastcal.effects.registered import find
from fastcal.errors import InvalidInput
from fastcal.ik.driven_joints import solve_driven
from fastcal.ik.posture import configurations
from fastcal.ik.same_configuration import in_its_configuration
from fastcal.measurements.conditions import real_array
from fastcal.robot.robot import Robot
from fastcal.robot.se3 import rotations_by
from fastcal.units import from_si

STATUSES = ("reached", "limit", "unreachable", "singular", "bad_target", "configuration")  # the core's order
_STANDING = (STATUSES.index("reached"), STATUSES.index("singular"))
_SAME_COMMAND = 1e-12  # [rad or m]
_MAX_ROUNDS = 30
_DECIMALS = 6  # of a distance in mm and an angle in degrees that are told
_FREEDOMS = 6  # of a pose


@dataclass(frozen=True, eq=False, repr=False)
class InverseKinematics(Shown):
    """Commands for N targets.

    Attributes:
        q: (N, n) joint positions to command [rad or m], within the limits; where the target is not reached, those of
            the nearest pose that was found; of a bad target the seed.
        status: (N,) "reached"; "limit": only beyond the limits; "unreachable": not even beyond them; "singular":
            reached, in a posture in which the tool can't move in some direction; "bad_target": not a pose, or not
            finite; "configuration": only in another configuration than was to be kept, and q is there.
        iterations: (N,) times that the chain or the model was evaluated.
        position_error: (N,) distance that is left [m], NaN for a bad target.
        rotation_error: (N,) angle that is left [rad], NaN for a bad target.
        robot: What was solved.
    """

    q: FloatArray
    status: NDArray[np.str_]
    iterations: NDArray[np.int32]
    position_error: FloatArray
    rotation_error: FloatArray
    robot: Robot = field(repr=False)

    def __len__(self) -> int:
        return len(self.q)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(N,) is the tool at the target, in a singular posture or not?"""
        return np.asarray((self.status == "reached") | (self.status == "singular"))

    @cached_property
    def configuration(self) -> NDArray[np.str_]:
        """(N,) shoulder, elbow and wrist of a 6R arm, such as "front up positive", as `configurations` has them."""
        return configurations(self.robot, self.q)

    def message(self, row: int) -> str:
        """What became of one row, a sentence."""
        far = round(float(from_si(self.position_error[row], "mm")), _DECIMALS)
        turned = round(float(from_si(self.rotation_error[row], "deg")), _DECIMALS)
        left = f"the nearest pose is {far:.4g} mm and {turned:.4g} deg away"
        motors = self.robot.joint_count - len(self.robot.passive)
        if self.robot.passive and motors < _FREEDOMS and self.status[row] == "unreachable" and far == 0:
            return f"the point can be reached, but with {motors} motors the loops turn the tool otherwise there; {left}"
        return {
            "reached": "the target is reached",
            "limit": f"the target can be reached only beyond the joint limits; within them {left}",
            "unreachable": f"the target is out of reach; {left}",
            "singular": "the target is reached in a singular posture: in some direction the tool can't move from there",
            "bad_target": "the target is not a pose: it must be finite, a rotation and a position",
            "configuration": f"the target can be reached only in another configuration: {self.configuration[row]}",
        }[str(self.status[row])]


def inverse_kinematics(
    model: Robot,
    targets: ArrayLike,
    seed: ArrayLike | None = None,
    *,
    limits: ArrayLike | None = None,
    tolerance_m: float = 1e-9,
    tolerance_rad: float = 1e-9,
    restarts: int = 100,
    hold: Sequence[int] = (),
    along_path: bool = False,
    keep_configuration: bool = False,
    random_seed: int = 0,
    threads: int = 1,
    **conditions: Any,
) -> InverseKinematics:
    """Joint positions q with model.forward(q, **conditions) = targets, all effects included, within the limits.

    Args:
        model: A robot with its effects, nominal or identified.
        targets: (N, 4, 4) poses of the tool in the measuring frame; (4, 4) is one.
        seed: Where the search begins: (n,) for all or (N, n); None: the middle of the limits. From a seed near a
            solution the arm keeps its configuration.
        limits: (n, 2) least and greatest joint positions [rad or m]; None: those of the robot file.
        tolerance_m: Distance from the target that counts as reached [m].
        tolerance_rad: Angle from the target that counts as reached [rad].
        restarts: Further attempts from a quasi-random sequence of postures where the seed does not lead there; 0: the
            seed alone, no jump to another configuration.
        hold: Joints, counted from 1, that stay where the seed has them: a redundant arm moves the others.
        along_path: Every row but the first begins where the one before it ended and has no restarts, so that neither
            the configuration nor a redundant joint jumps.
        keep_configuration: A 6R arm stays on the seed's side of shoulder, elbow and wrist: each target in the branch of
            its solutions that has the seed's configuration on the arm without effects, followed to the whole model. A
            command that crosses a singularity by less than 0.2 rad from there keeps it too.
        random_seed: The same gives the same postures to restart from.
        threads: Cores to use; the result does not depend on it. A path takes one.
        **conditions: payload [kg], approach ... as `Robot.forward` takes them.

    Raises:
        InvalidInput: A shape does not fit, a number is invalid, or an arm without configurations is to keep one.
    """
    T = np.ascontiguousarray(real_array("targets", targets))
    T = T[np.newaxis] if T.shape == (4, 4) else T
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise InvalidInput(f"targets must have shape (N, 4, 4), got {np.shape(targets)}")
    box = checked_limits(model, limits)
    options = solver_options(model, box, tolerance_m, tolerance_rad, restarts, hold, random_seed)
    options |= {"along_path": bool(along_path), "threads": int(threads)}
    restarts = options.pop("restarts")
    if keep_configuration and along_path:
        raise InvalidInput("along_path=True follows the row before: give it or keep_configuration=True, not both")
    q = _seeds(model, seed, box, len(T))
    solve = partial(_solve, options=options)
    if keep_configuration:
        refuse_mimic_joints(model, "keeping a configuration")
        return in_its_configuration(model, T, q, box, restarts=restarts, solve=solve, **conditions)
    return solve(model, T, q, restarts=restarts, **conditions)


def checked_limits(model: Robot, limits: ArrayLike | None) -> FloatArray:
    """(n, 2) the limits that were given, or those of the robot file.

    Raises:
        InvalidInput: A shape that does not fit the arm, or a number that is none.
    """
    box = model.limits if limits is None else real_array("limits", limits)
    if box.shape != (model.joint_count, 2) or np.isnan(box).any():
        raise InvalidInput(f"limits must be numbers of shape ({model.joint_count}, 2), got {box.shape}")
    return box


def solver_options(
    model: Robot,
    box: FloatArray,
    tolerance_m: float,
    tolerance_rad: float,
    restarts: int,
    hold: Sequence[int],
    random_seed: int,
) -> dict[str, Any]:
    """The options of `inverse_kinematics` as the core has them.

    Raises:
        InvalidInput: A number is invalid.
    """
    for name, size in (("tolerance_m", tolerance_m), ("tolerance_rad", tolerance_rad)):
        if not size > 0:
            raise InvalidInput(f"{name} must be above 0, got {size}")
    if restarts < 0:
        raise InvalidInput(f"restarts must be at least 0, got {restarts}")
    if not set(hold) <= set(range(1, model.joint_count + 1)):
        raise InvalidInput(f"hold takes numbers of joints from 1 to {model.joint_count}, got {list(hold)}")
    return {
        "limits": box,
        "tolerance_position": float(tolerance_m),
        "tolerance_rotation": float(tolerance_rad),
        "restarts": int(restarts),
        "held": [joint + 1 in hold for joint in range(model.joint_count)],
        "random_seed": int(random_seed),
    }


def _solve(
    model: Robot, T: FloatArray, q: FloatArray, *, restarts: int, options: dict[str, Any], **conditions: Any
) -> InverseKinematics:
    """Joint positions for poses (N, 4, 4) from postures (N, n).

    What belongs to the q that it was made for, the basis of an effect written in Python and a trained correction, is
    taken once more at the new one until nothing moves.
    """
    if model.mimics:
        return InverseKinematics(*solve_driven(model, T, q, restarts=restarts, options=options, **conditions), model)
    moving = model.correction is not None or any(find(entry["effect"]) for entry in model.entries)
    aimed = T.copy()
    for _ in range(_MAX_ROUNDS):
        if model.correction is not None:
            said = model.correct(q, conditions.get("payload"))
            aimed[:, :3, 3] = T[:, :3, 3] - said.displacement
            aimed[:, :3, :3] = rotations_by(-said.turn) @ T[:, :3, :3]
        found = _core.inverse_kinematics(
            model.error_model,
            model.conditions(q, **conditions),
            aimed.reshape(-1, 16),
            reach=model.reach,
            restarts=restarts,
            **options,
        )
        standing = np.isin(found[1], _STANDING)
        moved = standing & (np.abs(found[0] - q).max(axis=1) > _SAME_COMMAND)
        if not moving or not moved.any():
            break
        q = np.asarray(found[0])
    q, status, iterations, position, rotation = found
    if moving and moved.any():
        # A correction that jumps between cells of its joint space may leave no posture that agrees with itself.
        T_there = model.forward(q, **conditions)
        left = np.linalg.norm((T_there - T)[:, :3, 3], axis=1)
        turned = 2 * np.arcsin(np.minimum(np.linalg.norm((T_there - T)[:, :3, :3], axis=(1, 2)) / np.sqrt(8), 1))
        position, rotation = np.where(moved, left, position), np.where(moved, turned, rotation)
        beyond = (left > options["tolerance_position"]) | (turned > options["tolerance_rotation"])
        status = np.where(moved & beyond, STATUSES.index("unreachable"), status)
    return InverseKinematics(q, np.array(STATUSES)[status], iterations, position, rotation, model)


def refuse_mimic_joints(model: Robot, what: str) -> None:
    """InvalidInput where a joint of the model follows another; `what` needs a motor in every joint."""
    if model.mimics:
        joint, driver = model.mimics[0][:2]
        raise InvalidInput(
            f"{what} needs a motor in every joint, and joint {joint + 1} of {model.name} follows joint {driver + 1}"
        )


def _seeds(model: Robot, seed: ArrayLike | None, box: FloatArray, count: int) -> FloatArray:
    """(count, n) postures to begin from."""
    if seed is None:
        low, high = np.where(np.isfinite(box), box, 0.0).T
        seed = np.clip((low + high) / 2, box[:, 0], box[:, 1])
    q = real_array("seed", seed)
    if q.shape not in ((model.joint_count,), (count, model.joint_count)):
        n = model.joint_count
        raise InvalidInput(f"seed must have shape ({n},) or ({count}, {n}), got {q.shape}")
    if not np.isfinite(q).all():
        raise InvalidInput("seed must be finite")
    return np.array(np.broadcast_to(q, (count, model.joint_count)))
