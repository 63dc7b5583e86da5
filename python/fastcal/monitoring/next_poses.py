# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which poses a check needs: those that tell rival causes apart, and those that show most changes at all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.greedy_gain import most_telling
from fastcal.design.candidates import Candidates, joint_ranges, postures, with_conditions
from fastcal.design.planned import approached
from fastcal.design.separation import separating_poses
from fastcal.design.surroundings import Surroundings
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.hypotheses import Hypothesis
from fastcal.monitoring.linear import LinearRows
from fastcal.monitoring.result import NextPose
from fastcal.place import joint_column
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

MOST = 6
POWER = 0.95  # at which no more poses are asked for
_CANDIDATES = 400
_DRAWN = 1600  # of which half may be out of bounds
_FEWEST = 20
_SEED = 0


def candidates(
    robot: Robot,
    record: CalibrationRecord,
    payloads: Sequence[float],
    approached: Sequence[int] = (),
    surroundings: Surroundings | None = None,
) -> Candidates:
    """Postures within the joint ranges that the model was fitted on, clear of the surroundings, with payloads at hand.

    Joints `approached`, from 0, come from either side. An arm that was measured below its mounting face, and there
    alone, may go there again.
    """
    limits = joint_ranges(robot)
    low, high = limits.T.copy()
    for i, joint in enumerate(robot.joints):
        covered = record.covered.get(joint_column(i, joint.unit))
        if covered is not None:
            low[i], high[i] = max(low[i], to_si(covered[0], joint.unit)), min(high[i], to_si(covered[1], joint.unit))
    q = postures(robot, "random", _DRAWN, _SEED)
    q = low + (q - limits[:, 0]) / (limits[:, 1] - limits[:, 0]) * (high - low)
    clear = q[(surroundings or Surroundings()).obstacles(robot, q) == 0]
    if surroundings is None and len(clear) < _FEWEST:
        clear = q
    if len(clear) < _FEWEST:
        raise InvalidInput(f"the surroundings leave {len(clear)} of {len(q)} postures that the model was fitted on")
    return with_conditions(clear[:_CANDIDATES], payloads, approached, _CANDIDATES, _SEED)


def separating(
    arm: Robot,
    record: CalibrationRecord,
    rows: LinearRows,
    data: Dataset,
    rivals: Sequence[tuple[Hypothesis, FloatArray]],
    sigma: float,
) -> list[NextPose]:
    """Poses that tell rivals apart, each with its estimate (d,); empty where a rival is no matter of poses.

    `arm` is the extended model, before the first set-up; sigma [m] that of a coordinate.
    """
    if len(rivals) < 2 or any(h.directions is None for h, _ in rivals):
        return []
    pool = candidates(arm, record, _payloads(data, record))
    J = _jacobian(arm, record, pool, data) / sigma
    base, own = J[:, :, : _base_count(arm)], np.vstack([rows.R, np.zeros((J.shape[2] - len(rows.R), rows.R.shape[1]))])
    common = np.concatenate([base, J @ own], axis=2)
    causes = [J @ h.directions for h, _ in rivals if h.directions is not None]
    done = _measured_information(rows, common.shape[2], base.shape[2], [h for h, _ in rivals])
    found = separating_poses(
        common, causes, [value for _, value in rivals], MOST, prior=done, until_power=POWER, level=0.01
    )
    return as_poses(arm, pool.select(found.chosen))


def informative(
    arm: Robot,
    record: CalibrationRecord,
    data: Dataset | None,
    watched: Sequence[Hypothesis],
    R: FloatArray,
    sigma: float,
    count: int,
    surroundings: Surroundings | None = None,
) -> Candidates:
    """Poses that show most of what may have changed: greedily, the greatest gain of information each.

    A pose adds log det(1 + J C J^T), C the covariance of base, model and changes before it: the bases' and the
    changes' of their typical sizes, so that what one pose has shown the next need not.
    """
    pool = candidates(arm, record, _payloads(data, record), approached(arm) if data is None else (), surroundings)
    J = _jacobian(arm, record, pool, data) / sigma
    base = _base_count(arm)
    grown = np.vstack([R, np.zeros((J.shape[2] - len(R), R.shape[1]))])
    changes = [J @ (h.directions * h.sizes) for h in watched if h.directions is not None]
    A = np.concatenate([J[:, :, :base], J @ grown, *changes], axis=2)  # 1 m and 1 rad: as good as nothing is known
    return pool.select(most_telling(A, np.eye(A.shape[2]), count))


def repeated(robot: Robot, data: Dataset, rows: Sequence[int]) -> list[NextPose]:
    """The poses of some rows again."""
    return as_poses(robot, Candidates(data.q, data.payload).select(list(rows)))


def as_poses(robot: Robot, poses: Candidates) -> list[NextPose]:
    """As check.json lists them."""
    units = ["deg" if kind == "revolute" else "mm" for kind in robot.joint_types]
    return [
        NextPose(
            tuple(round(from_si(float(v), unit), 3) for v, unit in zip(q, units, strict=True)),
            float(payload),
        )
        for q, payload in zip(poses.q, poses.payload, strict=True)
    ]


def _payloads(data: Dataset | None, record: CalibrationRecord) -> list[float]:
    """Those of the data, or the least and the greatest that the model was fitted with."""
    if data is not None:
        return [float(v) for v in np.unique(data.payload)[:4]]
    return sorted(set(record.covered.get("payload_kg", (0.0, 0.0))))


def _jacobian(arm: Robot, record: CalibrationRecord, pool: Candidates, data: Dataset | None) -> FloatArray:
    """(N, 3, P) of the points, other conditions as in the first row of the data.

    What no data say: the middle of both directions and of the temperatures of the fit, nothing lags, nothing pushes.
    """
    count, joints = pool.q.shape
    given: dict[str, Any] = {
        "approach": np.zeros((count, joints)),
        "current": np.zeros((count, joints)),
        "wrench": np.zeros((count, 6)),
        "temperature": record.temperature,
        "time": 0.0,
    }
    if data is not None:
        for name in ("temperature", "time"):
            if getattr(data, name) is not None:
                given[name] = np.full(count, getattr(data, name)[0])
        if data.approach is not None:
            given["approach"] = np.repeat(data.approach[:1], count, axis=0)
    return arm.parameter_jacobian(pool.q, **(given | pool.conditions()))


def _base_count(arm: Robot) -> int:
    return sum(p.owner == "base" for p in arm.error_model.parameters[: len(arm.core.parameters)])


def _measured_information(rows: LinearRows, common: int, base: int, rivals: Sequence[Hypothesis]) -> FloatArray:
    """J^T J of the rows measured already on [base, z, causes ...], and of the model's own prior on z."""
    extra = [rows.J @ h.directions[: rows.J.shape[1]] for h in rivals if h.directions is not None]
    if rows.are_of_bases:
        B = rows.B.reshape(len(rows.B), -1, base).sum(axis=1)
        A = np.hstack([B, rows.J @ rows.R, *extra])
        information = A.T @ A
    else:  # bases and unknowns of the rows' own are taken out of all else; of the base to come nothing is known
        A = np.hstack([rows.J @ rows.R, *extra])
        Q = np.linalg.qr(rows.B)[0]
        A = A - Q @ (Q.T @ A)
        information = np.zeros((base + A.shape[1],) * 2)
        information[:base, :base] = np.eye(base)  # 1 m and 1 rad
        information[base:, base:] = A.T @ A
    information[base:common, base:common] += np.eye(common - base)
    return np.asarray(information)
