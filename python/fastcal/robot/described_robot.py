# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a robot's file says (edge units, `description`), and the C++ model that is built from it.

The file's numbers are the truth and the C++ model is always built from them, so a robot that was saved and loaded
predicts the same, bit for bit.
"""

from __future__ import annotations

import hashlib
import json
import pickle
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.correction import Correction
from fastcal.display.shown import Shown
from fastcal.effects.entries import build_effects, full_name
from fastcal.effects.values import parameter_values
from fastcal.errors import InvalidInput
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.core_model import build_core, pose
from fastcal.robot.loops import joints_beside, passive_joints
from fastcal.robot.pendant import Pendant, pendant_of
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot_spec import Entry, Joint, RobotSpec, Spec, content, structured
from fastcal.units import to_si

if TYPE_CHECKING:
    from typing_extensions import Self

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


class DescribedRobot(Shown):
    """A robot as its file says; `Robot` predicts with it.

    Args:
        spec: Canonical content of a robot file, as `fastcal.load_robot` reads it; it is copied.

    Raises:
        InvalidInput: A number is not finite, a screw has no unit length, an effect is unknown.
    """

    def __init__(self, spec: Spec) -> None:
        self._keep(plain_copy(spec))

    @classmethod
    def keeping(cls, spec: Spec, core: _core.RobotModel | None = None) -> Self:
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

    def with_(self, **changes: Any) -> Self:
        """The robot with other values of some keys of its file, and without those that are None."""
        merged = self.spec | {key: content(value) for key, value in changes.items()}
        spec = plain_copy({key: value for key, value in merged.items() if value is not None})
        if not changes.keys() <= _NOT_OF_THE_CHAIN:
            return self.keeping(spec)
        if not {"base", "tool"} & changes.keys():
            return self.keeping(spec, self.core)
        return self.keeping(spec, self.core.with_base_and_tool(pose(spec["base"]), pose(spec["tool"])))

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

    def __reduce__(self) -> tuple[Callable[[bytes], Self], tuple[bytes]]:
        """A robot is what its file says: so it goes to other processes, where the spec is its own."""
        return self._of_packed, (pickle.dumps(self.spec, pickle.HIGHEST_PROTOCOL),)

    @classmethod
    def _of_packed(cls, packed: bytes) -> Self:
        """The robot that was pickled; it is unpacked and built when it is asked for: most of a fleet never are."""
        robot = cls.__new__(cls)
        robot._packed = packed
        return robot

    def __copy__(self) -> Self:
        return type(self)(self.spec)

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

    @cached_property
    def beside(self) -> list[int]:
        """Joints, from 0, that do not move the tool and load it by their weight alone."""
        return joints_beside(self.description)
