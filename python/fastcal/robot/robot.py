# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A robot: what its file says (`description`, edge units) and the C++ model that is built from it.

The file's numbers are the truth and the C++ model is always built from them, so a robot that was saved and loaded
predicts the same, bit for bit.
"""

from __future__ import annotations

import hashlib
import json
import pickle
from collections.abc import Callable
from functools import cached_property
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal import _core
from fastcal.correction import Corrected, Correction, Inputs
from fastcal.display import late
from fastcal.display.shown import Shown
from fastcal.effects.entries import build_effects, full_name
from fastcal.effects.values import parameter_values
from fastcal.errors import InvalidInput
from fastcal.measurements.conditions import build_samples, condition_columns
from fastcal.measurements.dataset import Dataset
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.core_model import build_core, pose
from fastcal.robot.loops import Assembly, assemble, passive_joints
from fastcal.robot.pendant import Pendant, pendant_of
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot_spec import Entry, Joint, RobotSpec, Spec, content, structured
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
_MOST_NUMBERS = 2**23  # of Jacobians that are in memory at once
_NOT_OF_THE_CHAIN = {"base", "tool", "effects", "equilibrium", "calibration", "correction", "made_by", "notes"}
CHOICES = {
    "kinematics": ("dh", "mdh", "poe", "urdf"),
    "gravity_frame": ("base", "measuring"),
    "wrench_frame": ("base", "flange", "tool"),
}


class Mimic(NamedTuple):
    """Joint `joint`, counted from 0, is at multiplier * position of `driver` + offset [rad or m]."""

    joint: int
    driver: int
    multiplier: float
    offset: float


class Robot(Shown):
    """A robot with its effects, nominal or identified.

    Args:
        spec: Canonical content of a robot file, as `fastcal.load_robot` reads it; it is copied.

    Raises:
        InvalidInput: A number is not finite, a screw has no unit length, an effect is unknown.
    """

    def __init__(self, spec: Spec) -> None:
        self._keep(plain_copy(spec))

    @classmethod
    def keeping(cls, spec: Spec, core: _core.RobotModel | None = None) -> Robot:
        """The robot of a spec that nobody else holds, which is kept and not copied.

        Args:
            spec: As for `Robot`.
            core: The C++ model of this spec, where there is one already.
        """
        robot = cls.__new__(cls)
        robot._keep(spec, core)
        return robot

    _packed: bytes = b""

    def _keep(self, spec: Spec, core: _core.RobotModel | None = None) -> None:
        self.spec = spec
        for key, choices in CHOICES.items():
            if self.spec.get(key) not in (None, *choices):
                raise InvalidInput(f"{key} must be one of {', '.join(choices)}, got {self.spec[key]!r}")
        if core is not None:
            self.core = core
        if self.correction is not None and self.correction.joint_count != self.joint_count:
            raise InvalidInput(
                f"the correction was trained for {self.correction.joint_count} joints, and {self.name} has "
                f"{self.joint_count}"
            )
        _ = self.error_model  # says what is wrong with the spec

    @cached_property
    def spec(self) -> Spec:
        """The content of its file, in edge units, for reading and writing; all else reads its `description`."""
        spec: Spec = pickle.loads(self._packed)  # noqa: S301 - a part of a pickle itself
        return spec

    @cached_property
    def description(self) -> RobotSpec:
        """What its file says, typed."""
        return structured(RobotSpec, self.spec)

    def with_(self, **changes: Any) -> Robot:
        """The robot with other values of some keys of its file, and without those that are None."""
        merged = self.spec | {key: content(value) for key, value in changes.items()}
        spec = plain_copy({key: value for key, value in merged.items() if value is not None})
        if not changes.keys() <= _NOT_OF_THE_CHAIN:
            return Robot.keeping(spec)
        if not {"base", "tool"} & changes.keys():
            return Robot.keeping(spec, self.core)
        return Robot.keeping(spec, self.core.with_base_and_tool(pose(spec["base"]), pose(spec["tool"])))

    @property
    def entries(self) -> list[Entry]:
        """Its effects as its file has them."""
        return self.description.effects

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Its joints as its file has them."""
        return self.description.joints

    @property
    def made_by(self) -> Spec:
        """What wrote its file, and of which arm; empty where nothing says it."""
        return self.description.made_by

    @property
    def T_world_base(self) -> FloatArray:
        """(4, 4) the base in the measuring frame."""
        return self.description.base.T

    @property
    def T_flange_tool(self) -> FloatArray:
        """(4, 4) the tool in the flange."""
        return self.description.tool.T

    @cached_property
    def core(self) -> _core.RobotModel:
        """The C++ model of the spec without its effects."""
        return build_core(self.description)

    @cached_property
    def effects(self) -> list[_core.Effect]:
        """The C++ models of the effects, in the order of the spec."""
        return build_effects(self.entries, self.core)

    @cached_property
    def error_model(self) -> _core.ErrorModel:
        """The C++ model with effects and the values of their parameters."""
        pairs = zip(self.entries, self.effects, strict=True)
        values = [value for entry, effect in pairs for value in parameter_values(entry, effect)]
        model = _core.ErrorModel(self.core, self.effects, np.asarray(values, dtype=float))
        return model.with_equilibrium(self.at_equilibrium)

    def __reduce__(self) -> tuple[Callable[[bytes], Robot], tuple[bytes]]:
        """A robot is what its file says: so it goes to other processes, where the spec is its own."""
        return Robot._of_packed, (pickle.dumps(self.spec, pickle.HIGHEST_PROTOCOL),)

    @classmethod
    def _of_packed(cls, packed: bytes) -> Robot:
        """The robot that was pickled; it is unpacked and built when it is asked for: most of a fleet never are."""
        robot = cls.__new__(cls)
        robot._packed = packed
        return robot

    def __copy__(self) -> Robot:
        return Robot(self.spec)

    @cached_property
    def sha256(self) -> str:
        """Hash of what its file says, but for where it came from."""
        spec = {key: value for key, value in self.spec.items() if key not in ("made_by", "correction")}
        return hashlib.sha256(json.dumps(spec, sort_keys=True, default=str).encode()).hexdigest()

    @property
    def correction(self) -> Correction | None:
        """What `fastcal train` has added; None for a model without."""
        return self.description.correction

    @property
    def name(self) -> str:
        """As the file names it."""
        return str(self.description.name)

    @property
    def arm(self) -> str:
        """What its cell calls it: columns of measurements may begin with that and a point."""
        return str(self.description.cell.get("arm", "arm"))

    @property
    def of_poses(self) -> bool:
        """Is only the pose of its flange known? Then its joints stand for that, and it has no geometry to identify."""
        return self.description.of_poses

    @property
    def kinematics(self) -> str:
        """dh, mdh, poe or urdf."""
        return self.description.kinematics

    @property
    def at_equilibrium(self) -> bool:
        """Are loads taken in the deflected posture (the default), or in the undeflected one, to first order?"""
        return self.description.equilibrium

    @property
    def joint_types(self) -> list[str]:
        """Revolute or prismatic, one a joint."""
        return [joint.type for joint in self.joints]

    @property
    def joint_count(self) -> int:
        """n, moving joints."""
        return len(self.joints)

    @cached_property
    def limits(self) -> FloatArray:
        """(n, 2) least and greatest joint position [rad or m]; infinite where the file has none."""
        out = np.full((self.joint_count, 2), [-np.inf, np.inf])
        for i, joint in enumerate(self.joints):
            for side, limit in enumerate(joint.limits):
                if limit is not None:
                    out[i, side] = to_si(float(limit), joint.unit)
        return out

    @cached_property
    def pendant(self) -> Pendant:
        """How the controller's joints J follow from the chain's q."""
        return pendant_of(self.description)

    @cached_property
    def reach(self) -> float:
        """[m] A bound on the distance from base to tool: all lengths of the chain, stretched sliders included."""
        zero = np.zeros((1, self.joint_count))
        origins = self._frames(zero)
        slides = sum(
            float(np.max(np.abs(limits[np.isfinite(limits)]), initial=0.0))
            for kind, limits in zip(self.joint_types, self.limits, strict=True)
            if kind == "prismatic"
        )
        return float(np.linalg.norm(np.diff(origins, axis=0), axis=1).sum() + slides)

    def _frames(self, q: FloatArray) -> FloatArray:
        """(frames, 3) origins of the chain's frames in the base at one posture q (1, n)."""
        return np.asarray(self.core.frame_origins(q)[0])

    @property
    def parameter_names(self) -> list[str]:
        """Names of the columns of `parameter_jacobian`, such as "joint2 theta"."""
        return [full_name(parameter) for parameter in self.error_model.parameters]

    @cached_property
    def record(self) -> CalibrationRecord | None:
        """How sure the identified numbers are; None for a nominal robot."""
        return CalibrationRecord.from_spec(self.description.calibration or None)

    def samples(self, data: Dataset) -> _core.Samples:
        """The conditions of a data set for the core; InvalidInput where a column that an effect needs is missing."""
        return self.conditions(data.q, **condition_columns(data))

    @cached_property
    def mimics(self) -> list[Mimic]:
        """The joints that another one drives."""
        found = []
        for i, joint in enumerate(self.joints):
            if (driven := joint.mimic) is not None:
                offset = to_si(driven.offset_deg or driven.offset_mm or 0.0, joint.unit)
                found.append(Mimic(i, driven.joint - 1, float(driven.multiplier), offset))
        return found

    @cached_property
    def passive(self) -> list[int]:
        """Joints, from 0, that closed loops move."""
        return passive_joints(self.description)

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
        joints = np.ascontiguousarray(np.atleast_2d(np.asarray(q, dtype=float)))
        if joints.ndim != 2 or joints.shape[1] != self.joint_count:
            raise InvalidInput(f"q must have shape (N, {self.joint_count}), got {np.shape(q)}")
        return assemble(self.core, joints, threads)

    def conditions(self, q: ArrayLike, **columns: Any) -> _core.Samples:
        """Checked conditions of N postures q (N, n) or (n,), SI; see `forward`. Mimic joints follow their drivers."""
        joints = np.ascontiguousarray(np.atleast_2d(np.asarray(q, dtype=float)))
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

        Displacement and sigma are along the axes of the measuring frame [m]; `forward` has the displacement in it.
        """
        joints = np.atleast_2d(np.asarray(q, dtype=float))
        correction = self.correction
        if correction is None:
            return Corrected(np.zeros((len(joints), 3)), np.zeros(len(joints)), np.zeros((len(joints), 3)))
        found = correction(self.inputs(joints, payload))
        R = self.T_world_base[:3, :3]
        sigma = np.sqrt(found.sigma**2 @ (R**2).T)
        return Corrected(found.displacement @ R.T, found.weight, sigma)

    def inputs(self, q: FloatArray, payload: ArrayLike | None = None) -> Inputs:
        """What a correction looks at; the joints' Jacobian is that of the rigid chain."""
        rigid = _core.ErrorModel(self.core, [], np.zeros(0))
        R = self.T_world_base[:3, :3]
        J = R.T @ np.asarray(_core.joint_jacobian(rigid, _core.Samples(q), 1))[:, :3]
        load = np.broadcast_to(np.asarray(0.0 if payload is None else payload, dtype=float), (len(q),))
        return Inputs(q, np.ascontiguousarray(load), J)

    def _with_correction(self, T: FloatArray, q: ArrayLike, payload: ArrayLike | None) -> FloatArray:
        if self.correction is not None:
            T[:, :3, 3] += self.correct(q, payload).displacement
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
