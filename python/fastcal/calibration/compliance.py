# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Compliance of the joints by the position-distance method, each with a corner only where a test finds one.

RX160L paper, (11) and (12): a joint may be softer below a critical torque than above it. A fit in two pieces always
ends somewhere; whether there is a corner is decided by `corner_test`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.corner_test import Corner, corner_test
from fastcal.calibration.payload_pairs import PairsResult, differences, from_payload_pairs, rows_in_pairs
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import from_si

LEVEL = 0.01
TORQUES = ("all", "payload")
_PLACES = np.linspace(0.05, 0.95, 19)  # quantiles of |torque|: where a corner is looked for
_LEAST = 1e-3  # of the greatest torque: a joint that feels less is not asked about
_STRAIGHT, _BENT = "joint_compliance", "joint_compliance_nonlinear"


@dataclass(frozen=True, eq=False)
class JointCurve:
    """What is known of one joint.

    Attributes:
        owner: Such as joint2.
        p: Chance of what points to a corner if there were none.
        bent: Is it given two pieces?
        torque: (N,) torque about it in each row [N m].
        angle: (N,) angle that each row says: the model's, and what is left turned into this joint's angle [rad].
    """

    owner: str
    p: float
    bent: bool
    torque: FloatArray
    angle: FloatArray


@dataclass(frozen=True, eq=False)
class Compliance:
    """Compliances of the joints and which of them bend; `pairs` is the fit, `curves` one joint each."""

    pairs: PairsResult
    curves: list[JointCurve]
    level: float

    def to_json_dict(self) -> dict[str, Any]:
        """The content of compliance.json."""
        return {
            "sigma_mm": self.pairs.sigma_mm,
            "postures": self.pairs.posture_count,
            "rows": self.pairs.row_count,
            "level": self.level,
            "joints": [
                {
                    "owner": curve.owner,
                    "corner": curve.bent,
                    "p": curve.p,
                    "parameters": {
                        p.name: {"value": p.value, "std": p.std}
                        for p in self.pairs.parameters
                        if p.owner == curve.owner
                    },
                }
                for curve in self.curves
            ],
        }


def identify_compliance(
    robot: Robot,
    data: Dataset,
    *,
    joints: Sequence[int] | None = None,
    torque: str = "all",
    level: float = LEVEL,
    threads: int = 1,
) -> Compliance:
    """Compliances from postures that were measured with several payloads.

    The joint whose corner explains most is given two pieces first, the others are tested again behind it, until none is
    left that bends. Then each that was given two is tested behind all others, and loses them where it needs none: a
    corner of one joint looks like one of another, as long as it is not in the model.

    Args:
        robot: Nominal or calibrated.
        data: Rows with equal joints and different payloads belong together.
        joints: From 1; None: all that turn and feel the payloads.
        torque: What bends a joint: `all` weights, or the `payload` alone as in the paper.
        level: A corner is taken where its chance without one is below.
        threads: Cores to use.

    Raises:
        InvalidInput: As `from_payload_pairs`, or a joint that is not there or does not turn.
    """
    if torque not in TORQUES:
        raise InvalidInput(f"expected torque {' or '.join(TORQUES)}, got {torque!r}")
    if not 0 < level < 1:
        raise InvalidInput(f"expected a level between 0 and 1, got {level}")
    asked = _asked(robot, data, joints, torque)

    search = _Search(robot, data, asked, torque, level, threads)
    search.take()
    search.give_back()
    return Compliance(search.found, _curves(search.found, data, asked, search.bent, search.p, torque), level)


class _Search:
    """Which joints bend: `bent` those that do, `p` the chance of each joint's corner, `found` the fit."""

    def __init__(self, robot: Robot, data: Dataset, asked: list[int], torque: str, level: float, threads: int) -> None:
        self._robot, self._data, self._asked, self._torque = robot, data, asked, torque
        self._level, self._threads = level, threads
        self.bent: set[int] = set()
        self.p: dict[int, float] = {}
        self.found = self._fit(set())

    def _fit(self, bent: set[int]) -> PairsResult:
        effects = _effects(self._asked, bent, self._torque)
        return from_payload_pairs(self._robot, self._data, effects=effects, threads=self._threads)

    def _tested(self, joint: int, bent: set[int], found: PairsResult) -> Corner:
        return _corner(self._robot, self._data, self._asked, bent, joint, self._torque, found, self._threads)

    def take(self) -> None:
        """The joint whose corner explains most, one after the other, until none is left that bends."""
        while True:
            now = {j: self._tested(j, self.bent, self.found) for j in self._asked if j not in self.bent}
            self.p |= {j: corner.p for j, corner in now.items()}
            for joint in sorted((j for j in now if self.p[j] < self._level), key=lambda j: -now[j].share):
                try:
                    self.found = self._fit(self.bent | {joint})
                except InvalidInput:  # a corner, perhaps, but so far out that nothing tells the piece behind it
                    continue
                self.bent.add(joint)
                break
            else:
                return

    def give_back(self) -> None:
        """The joint that needs its corner least behind all others loses it, until all that are left need theirs."""
        while self.bent:
            self.p |= {j: self._behind(j) for j in self.bent}
            last = max(self.bent, key=self.p.__getitem__)
            if self.p[last] < self._level:
                return
            self.bent.remove(last)
            self.found = self._fit(self.bent)

    def _behind(self, joint: int) -> float:
        """Its chance behind all others; as it was taken where these, without it, do not come to a fit."""
        others = self.bent - {joint}
        try:
            return self._tested(joint, others, self._fit(others)).p
        except InvalidInput:
            return self.p[joint]


def _effects(joints: Sequence[int], bent: set[int], torque: str) -> list[str]:
    option = ":torque=payload" if torque == "payload" else ""
    return [f"{_BENT}@joint{j}{option}" if j in bent else f"{_STRAIGHT}@joint{j}" for j in joints]


def _asked(robot: Robot, data: Dataset, joints: Sequence[int] | None, torque: str) -> list[int]:
    turning = [k for k, kind in enumerate(robot.joint_types, start=1) if kind == "revolute"]
    if joints is not None:
        wrong = sorted(set(joints) - set(turning))
        if wrong or not joints:
            raise InvalidInput(f"expected joints that turn, of {turning}, got {list(joints)}")
        return sorted(set(joints))
    torques = torques_of(robot, data, torque)
    felt = np.ptp(torques, axis=0)
    return [k for k in turning if felt[k - 1] > _LEAST * felt.max()]


def torques_of(robot: Robot, data: Dataset, torque: str) -> FloatArray:
    """(N, n) torque of the weights, or of the payload alone, about each joint's axis [N m]."""
    model = robot.error_model
    loads = np.asarray(model.loads(robot.samples(data), model.start, torque == "payload", 1))
    return loads[:, 1 : 2 * robot.joint_count : 2, 5]


def _corner(
    robot: Robot,
    data: Dataset,
    joints: Sequence[int],
    bent: set[int],
    joint: int,
    torque: str,
    found: PairsResult,
    threads: int,
) -> Corner:
    """The test of one joint, the others as they were found."""
    ready, problem = differences(robot, data, _effects(joints, bent | {joint}, torque), threads)
    model = ready.model
    own = len(model.robot.parameters)
    effects = model.parameters[own:]
    known = {(p.owner, p.name): p.value for p in found.parameters}
    theta = np.array(model.start)
    for k, parameter in enumerate(effects):
        name = "compliance_rad_nm" if parameter.owner == f"joint{joint}" else None
        pieces = {"low": "low_rad_nm", "high": "high_rad_nm", "critical": "critical_nm"}
        value = known.get((parameter.owner, name or pieces.get(parameter.name, "compliance_rad_nm")))
        theta[own + k] = 0.0 if value is None else value
    places = {p.name: k for k, p in enumerate(effects) if p.owner == f"joint{joint}"}
    low, high, critical = (places[name] for name in ("low", "high", "critical"))
    size = np.abs(torques_of(ready.robot, rows_in_pairs(data)[0], torque)[:, joint - 1])
    tried = np.unique(np.quantile(size, _PLACES))
    columns = []
    for place in tried:
        there = theta.copy()
        there[own + critical] = place
        columns.append(problem.jacobian(there)[:, high])
    theta[own + critical] = tried[len(tried) // 2]
    J = problem.jacobian(theta)
    straight = [k for k in range(len(effects)) if k not in (low, high, critical)]
    A = np.column_stack([J[:, straight], J[:, low] + J[:, high]])
    return corner_test(problem.residuals(theta), A, np.column_stack(columns), problem.freedom() + 2)


def _curves(
    found: PairsResult, data: Dataset, joints: Sequence[int], bent: set[int], p: dict[int, float], torque: str
) -> list[JointCurve]:
    model, rows = found.model, rows_in_pairs(data)[0]
    torques = torques_of(model, rows, torque)
    J = model.joint_jacobian(rows.q, payload=rows.payload)[:, :3]
    own = {(entry["owner"]): entry["parameters"] for entry in model.entries}
    out = []
    for joint in joints:
        tau, column = torques[:, joint - 1], J[:, :, joint - 1]
        angle = _angle(tau, own[f"joint{joint}"])
        angle = angle - np.einsum("ni,ni->n", column, found.after) / np.einsum("ni,ni->n", column, column)
        out.append(JointCurve(f"joint{joint}", p[joint], joint in bent, tau, angle))
    return out


def _angle(tau: FloatArray, parameters: dict[str, Any]) -> FloatArray:
    """The law [rad] at torques (N,) [N m]."""
    value = {name: entry["value"] if isinstance(entry, dict) else entry for name, entry in parameters.items()}
    if "compliance_rad_nm" in value:
        return np.asarray(value["compliance_rad_nm"] * tau)
    size = np.abs(tau)
    beyond = np.maximum(size - value["critical_nm"], 0)
    bend = value["high_rad_nm"] - value["low_rad_nm"]
    return np.asarray(np.sign(tau) * (value["low_rad_nm"] * size + bend * beyond))


def curve(found: Compliance, owner: str, torque: FloatArray) -> FloatArray:
    """The angle [deg] of a joint at torques (N,) [N m], as it was found."""
    (entry,) = [entry for entry in found.pairs.model.entries if entry["owner"] == owner]
    return np.asarray(from_si(_angle(torque, entry["parameters"]), "deg"))
