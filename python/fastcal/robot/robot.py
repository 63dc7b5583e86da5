# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A robot and what it predicts: poses, their derivatives, and how sure they are."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.correction import Corrected, Inputs
from fastcal.display import late
from fastcal.effects.entries import build_effects
from fastcal.errors import InvalidInput
from fastcal.measurements.conditions import build_samples, condition_columns, real_array
from fastcal.measurements.dataset import Dataset
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.described_robot import DescribedRobot
from fastcal.robot.loops import Assembly, assemble
from fastcal.robot.robot_spec import Spec
from fastcal.robot.se3 import rotations_by

_MOST_NUMBERS = 2**23  # of Jacobians that are in memory at once


class Robot(DescribedRobot):
    """A robot with its effects, nominal or identified.

    Args:
        spec: Canonical content of a robot file, as `fastcal.load_robot` reads it; it is copied.

    Raises:
        InvalidInput: A number is not finite, a screw has no unit length, an effect is unknown.
    """

    def samples(self, data: Dataset) -> _core.Samples:
        """The conditions of a data set for the core; InvalidInput where a column that an effect needs is missing."""
        return self.conditions(data.q, **condition_columns(data))

    def follow(self, q: FloatArray) -> FloatArray:
        """Joint positions (N, n) with mimic and passive joints where others put them, whatever q says of them.

        Raises:
            InvalidInput: The loops of a row do not close, not even nearly.
        """
        if self.mimics:
            q = q.copy()
            for joint, driver, multiplier, offset in self.mimics:
                q[:, joint] = multiplier * q[:, driver] + offset
        if self.passive:
            assembly = assemble(self.core, q)
            assembly.check(near=True)
            q = assembly.q
        return q

    def assemble(self, q: ArrayLike, *, threads: int = 1) -> Assembly:
        """Closes the loops of postures q (N, n) or (n,) [rad or m]; what q says of passive joints is not looked at."""
        joints = np.ascontiguousarray(np.atleast_2d(real_array("q", q)))
        if joints.ndim != 2 or joints.shape[1] != self.joint_count:
            raise InvalidInput(f"q must have shape (N, {self.joint_count}), got {np.shape(q)}")
        return assemble(self.core, joints, threads)

    def conditions(self, q: ArrayLike, **columns: Any) -> _core.Samples:
        """Checked conditions of N postures q (N, n) or (n,), SI; see `forward`. Mimic joints follow their drivers."""
        joints = np.ascontiguousarray(np.atleast_2d(real_array("q", q)))
        if joints.ndim != 2 or joints.shape[1] != self.joint_count:
            raise InvalidInput(f"q must have shape (N, {self.joint_count}), got {np.shape(q)}")
        return build_samples(self.entries, self.effects, self.core, self.follow(joints), columns)

    def forward(
        self, q: ArrayLike, *, threads: int = 1, out: FloatArray | None = None, **conditions: Any
    ) -> FloatArray:
        """Poses (N, 4, 4) of the tool in the measuring frame for joint positions q (N, n) [rad or m].

        Args:
            q: Joint positions as commanded; (n,) is one posture.
            threads: Cores to use; the result does not depend on it.
            out: C-order float64 (N, 4, 4) to write into.
            **conditions: payload [kg], wrench (N, 6), temperature [K], time [s], station and mount (labels), approach
                (N, n), move (N, n) last moves of the joints [rad or m], current (N, n) [A], extra (name to (N,)); one
                number or label stands for all rows.

        Raises:
            InvalidInput: The closed loops of a row do not close; `assemble` says why, row by row.
        """
        if self.passive:
            self.assemble(q).check()
        samples = self.conditions(q, **conditions)
        T = np.asarray(self.error_model.predict(samples, self.error_model.start, threads, out))
        return self._with_correction(T, q, conditions.get("payload"))

    def poses(self, data: Dataset, *, threads: int = 1, samples: _core.Samples | None = None) -> FloatArray:
        """`forward` (N, 4, 4) at the joints and conditions of a data set, its `samples` where they are known."""
        read = self.samples(data) if samples is None else samples
        T = np.asarray(self.error_model.predict(read, self.error_model.start, threads))
        return self._with_correction(T, data.q, data.payload)

    def correct(self, q: ArrayLike, payload: ArrayLike | None = None) -> Corrected:
        """What the trained correction adds at q (N, n) and payload [kg], one number or (N,); zero without a correction.

        Displacement, turn and sigmas are along the axes of the measuring frame [m, rad]; `forward` has both in it.
        """
        joints = np.atleast_2d(np.asarray(q, dtype=float))
        correction = self.correction
        if correction is None:
            none = np.zeros((len(joints), 3))
            return Corrected(none, np.zeros(len(joints)), none, none, none)
        found = correction(self.inputs(joints, payload))
        R = self.T_world_base[:3, :3]
        sigma, sigma_turn = (np.sqrt(own**2 @ (R**2).T) for own in (found.sigma, found.sigma_turn))
        return Corrected(found.displacement @ R.T, found.weight, sigma, found.turn @ R.T, sigma_turn)

    def inputs(self, q: FloatArray, payload: ArrayLike | None = None) -> Inputs:
        """What a correction looks at; the joints' Jacobian is that of the rigid chain."""
        rigid = _core.ErrorModel(self.core, [], np.zeros(0))
        R = self.T_world_base[:3, :3]
        J = np.asarray(_core.joint_jacobian(rigid, _core.Samples(q), 1)).reshape(len(q), 2, 3, -1)
        J = (R.T @ J).reshape(len(q), 6, -1)
        load = np.broadcast_to(np.asarray(0.0 if payload is None else payload, dtype=float), (len(q),))
        return Inputs(q, np.ascontiguousarray(load), J)

    def _with_correction(self, T: FloatArray, q: ArrayLike, payload: ArrayLike | None) -> FloatArray:
        if self.correction is not None:
            said = self.correct(q, payload)
            T[:, :3, 3] += said.displacement
            T[:, :3, :3] = rotations_by(said.turn) @ T[:, :3, :3]
        return T

    def parameter_jacobian(
        self, q: ArrayLike, *, rows: int = 3, threads: int = 1, out: FloatArray | None = None, **conditions: Any
    ) -> FloatArray:
        """(N, rows, P): derivative of the tool by every parameter, SI, axes of the measuring frame.

        At the loads of the equilibrium, which are held: how deflection changes the loads, 0.3 to 2 % of the columns of
        a heavily loaded arm, is not in it. Differences of `forward` are with it.

        rows = 3: position; 6: [v; w], velocity of the tool's origin and turning of its frame. Columns:
        `parameter_names`.
        """
        return np.asarray(
            self.error_model.parameter_jacobian(
                self.conditions(q, **conditions), self.error_model.start, rows, threads, out
            )
        )

    def joint_jacobian(self, q: ArrayLike, *, threads: int = 1, **conditions: Any) -> FloatArray:
        """(N, 6, n): motion of the tool [v; w] by every joint, SI, axes of the measuring frame.

        The joints turn about the axes of the deflected arm, and the deflection is held. A joint takes those that follow
        it along; a mimic joint moves nothing by itself.
        """
        J = np.asarray(_core.joint_jacobian(self.error_model, self.conditions(q, **conditions), threads))
        for joint, driver, multiplier, _ in self.mimics:
            J[:, :, driver] += multiplier * J[:, :, joint]
            J[:, :, joint] = 0
        return J

    def position_deviation(self, q: ArrayLike, **conditions: Any) -> FloatArray:
        """(N, 3) standard deviation [m] of the predicted points that comes from the parameters.

        NaN for a nominal robot; else the root of diag(J C J^T + J H H^T J^T): C the covariance of the identified
        parameters, column k of H how all move, unseen by the measurements, when the k-th held one is off by its
        plausible size. A gauge direction moves no point and adds nothing. A new measurement adds its own noise.
        """
        return self.deviation_at(self.conditions(q, **conditions))

    def deviation_at(self, samples: _core.Samples, threads: int = 1) -> FloatArray:
        """`position_deviation` at conditions that are checked already."""
        record = self.record
        if record is None:
            return np.full((len(samples), 3), np.nan)
        out = np.empty((len(samples), 3))
        step = max(1, _MOST_NUMBERS // (3 * len(self.parameter_names)))
        for begin in range(0, len(samples), step):
            part = samples.slice(begin, min(begin + step, len(samples)))
            surrogates = self.surrogate_deviation(part, threads)
            variance = np.sum(self._roots(record, part, threads) ** 2, axis=2) + surrogates**2
            out[begin : begin + step] = np.sqrt(variance)
        return out

    def position_covariance(self, q: ArrayLike, **conditions: Any) -> FloatArray:
        """(N, 3, 3) covariance [m^2] of which `position_deviation` is the root of the diagonal; NaN if nominal."""
        samples = self.conditions(q, **conditions)
        record = self.record
        if record is None:
            return np.full((len(samples), 3, 3), np.nan)
        roots = self._roots(record, samples, 1)
        own = self.surrogate_deviation(samples) ** 2
        return np.asarray(roots @ np.swapaxes(roots, 1, 2) + own[:, :, np.newaxis] * np.eye(3))

    def point_roots(self, samples: _core.Samples, threads: int = 1) -> FloatArray:
        """(N, 3, k) independent shifts of the points [m], of which a covariance is the sum; none of a nominal robot."""
        return np.zeros((len(samples), 3, 0)) if self.record is None else self._roots(self.record, samples, threads)

    def _roots(self, record: CalibrationRecord, samples: _core.Samples, threads: int) -> FloatArray:
        """(N, 3, P + held) J L and J H: the columns are independent shifts of the points [m]."""
        J = np.asarray(self.error_model.parameter_jacobian(samples, self.error_model.start, 3, threads, None))
        known = _times(self._columns(J, record.parameters), record.root)
        return np.concatenate([known, _times(self._columns(J, record.moved), record.directions)], axis=2)

    def surrogate_deviation(self, samples: _core.Samples, threads: int = 1) -> FloatArray:
        """(N, 3) standard deviation [m] of the points that comes from the functions of surrogates; 0 without one.

        Each line of an entry's `spread` is a function (weights, then shift) of which the posterior holds one unit.
        """
        parts: list[Spec] = []
        for entry in self.entries:
            count = len(entry.get("weights") or [])
            for line in entry.get("spread") or []:
                part = {"weights": line[:count], "shift": line[count:], "parameters": {}}
                parts.append({key: value for key, value in entry.items() if key != "spread"} | part)
        if not parts:
            return np.zeros((len(samples), 3))
        model = _core.ErrorModel(self.core, build_effects(parts, self.core), np.zeros(len(parts)))
        J = np.asarray(model.parameter_jacobian(samples, model.start, 3, threads, None))[:, :, -len(parts) :]
        return np.asarray(np.linalg.norm(J, axis=2))

    def _columns(self, J: FloatArray, names: list[str]) -> FloatArray:
        """(N, 3, len(names)) the columns of the parameters `names`; zero where this robot has no such parameter."""
        at = {name: i for i, name in enumerate(self.parameter_names)}
        place = np.array([at.get(name, -1) for name in names], dtype=np.intp)
        out = np.take(J, place, axis=2)
        out[:, :, place < 0] = 0.0
        return np.asarray(out)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the robot file; it loads back to the same predictions, bit for bit."""
        late.call("write_spec", self.spec, path)


def _times(J: FloatArray, root: FloatArray) -> FloatArray:
    """(N, 3, k) J (N, 3, P) times root (P, k), in one product: numpy would make one a row."""
    return np.asarray(J.reshape(J.shape[0] * J.shape[1], len(root)) @ root).reshape(*J.shape[:2], root.shape[1])


__all__ = ["Robot", "Spec"]
