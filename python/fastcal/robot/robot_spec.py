# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a robot file says, typed: its keys by name, in the file's own units; None or empty is what it leaves out.

Numbers stay as the file has them (mm, deg), since a length that goes to metres and back need not keep its last bit.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args, get_type_hints

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.robot import se3
from fastcal.units import from_si, to_si

if TYPE_CHECKING:
    from fastcal.correction import Correction

Spec = dict[str, Any]
Entry = dict[str, Any]  # of an effect: effect, owner, parameters, and options that the effect alone knows
Vector = tuple[float, float, float]
T = TypeVar("T")

ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Frame:
    """A pose; rpy about fixed axes X, Y, Z: R = Rz Ry Rx."""

    xyz_mm: Vector = ZERO
    rpy_deg: Vector = ZERO

    @property
    def T(self) -> FloatArray:
        """(4, 4) the pose [m]."""
        rpy = [to_si(float(angle), "deg") for angle in self.rpy_deg]
        return se3.pose(_core.rpy_to_rotation(rpy), [to_si(float(length), "mm") for length in self.xyz_mm])


def frame_spec(T: FloatArray) -> Spec:
    """{xyz_mm, rpy_deg} of a pose (4, 4)."""
    return {
        "xyz_mm": [from_si(v, "mm") for v in T[:3, 3].tolist()],
        "rpy_deg": [from_si(v, "deg") for v in _core.rotation_to_rpy(T[:3, :3]).tolist()],
    }


@dataclass(frozen=True)
class Link:
    """The body that a joint moves; com, and inertia about it (xx, yy, zz, xy, xz, yz), in the frame that follows it."""

    mass_kg: float = 0.0
    com_mm: Vector = ZERO
    inertia_kg_m2: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Mimic:
    """The joint that drives another, counted from 1: position = multiplier x its position + offset."""

    joint: int
    multiplier: float = 1.0
    offset_deg: float | None = None
    offset_mm: float | None = None


@dataclass(frozen=True)
class Joint:
    """A joint: type, what its kind of kinematics gives of it, limits, gear, driver, where it stands, its link."""

    type: Literal["revolute", "prismatic"]
    name: str | None = None
    omega: Vector | None = None
    v: Vector | None = None
    v_mm: Vector | None = None
    point_mm: Vector | None = None
    theta_deg: float | None = None
    d_mm: float | None = None
    a_mm: float | None = None
    alpha_deg: float | None = None
    beta_deg: float | None = None
    origin: Frame | None = None
    axis: Vector | None = None
    min_deg: float | None = None
    max_deg: float | None = None
    min_mm: float | None = None
    max_mm: float | None = None
    motor_ratio: float | None = None
    mimic: Mimic | None = None
    on: str | None = None
    passive: bool | None = None
    start_deg: float | None = None
    start_mm: float | None = None
    link: Link | None = None

    @property
    def turns(self) -> bool:
        """Is it revolute?"""
        return self.type == "revolute"

    @property
    def unit(self) -> Literal["deg", "mm"]:
        """In which its position and its limits are given."""
        return "deg" if self.turns else "mm"

    @property
    def limits(self) -> tuple[float | None, float | None]:
        """Its least and greatest position, in its unit; None where the file has none."""
        return (self.min_deg, self.max_deg) if self.turns else (self.min_mm, self.max_mm)

    @property
    def start(self) -> float:
        """Where it is when the loops are first closed, in its unit."""
        return self.start_deg or self.start_mm or 0.0

    @property
    def mass_kg(self) -> float:
        """Of its link; 0 where the file gives none."""
        return 0.0 if self.link is None else self.link.mass_kg


@dataclass(frozen=True)
class Coupling:
    """Joint `joint` turns by ratio when `source` turns, counted from 1."""

    joint: int
    source: int
    ratio: float


@dataclass(frozen=True)
class PendantJoint:
    """How the controller counts one joint, counted from 1: q = sign J + zero + those of `plus` - those of `minus`.

    J is the controller's axis of the joint's own number, or that of the number `axis`.
    """

    joint: int
    axis: int | None = None
    sign: float = 1.0
    zero_deg: float | None = None
    zero_mm: float | None = None
    plus: tuple[int, ...] = ()
    minus: tuple[int, ...] = ()

    @property
    def zero(self) -> float:
        """In the unit of the joint."""
        return self.zero_deg or self.zero_mm or 0.0


@dataclass(frozen=True)
class Payload:
    """Where the payload's weight acts, in the last frame."""

    com_mm: Vector = ZERO


@dataclass(frozen=True)
class Compensator:
    """A spring from an anchor to an arm that joint `joint`, counted from 1, turns; both in its frame at position 0."""

    joint: int
    anchor_mm: Vector
    arm_mm: Vector
    stiffness_n_m: float
    free_length_mm: float


@dataclass(frozen=True)
class RobotSpec:
    """A robot file; `structured(RobotSpec, content)` makes one of the canonical content."""

    name: str
    kinematics: Literal["dh", "mdh", "poe", "urdf"]
    joints: tuple[Joint, ...]
    home: Frame | None = None
    flange: Frame | None = None
    coupling: tuple[Coupling, ...] = ()
    pendant: tuple[PendantJoint, ...] | None = None  # () says that the controller counts as the chain does
    base: Frame = Frame()
    tool: Frame = Frame()
    payload: Payload = Payload()
    gravity_m_s2: Vector = (0.0, 0.0, -9.80665)
    gravity_frame: Literal["base", "measuring"] = "base"
    wrench_frame: Literal["base", "flange", "tool"] = "base"
    compensator: Compensator | None = None
    equilibrium: bool = True
    loops: list[Spec] = field(default_factory=list)
    effects: list[Entry] = field(default_factory=list)
    structure: Spec = field(default_factory=dict)
    known_distances: list[Spec] = field(default_factory=list)
    cameras: dict[str, Spec] = field(default_factory=dict)
    boards: dict[str, Spec] = field(default_factory=dict)
    cell: Spec = field(default_factory=dict)
    of_poses: bool = False  # only the pose of its flange is known: its joints stand for that, and are exact
    calibration: Spec = field(default_factory=dict)
    correction: Correction | None = None
    made_by: Spec = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    source: Spec = field(default_factory=dict)


def structured(kind: type[T], content: Mapping[str, Any]) -> T:
    """A value of one of these types from the keys of a mapping; what is None there is as if it were left out."""
    given = ((name, convert, content.get(name)) for name, convert in _fields(kind))  # type: ignore[arg-type]
    return kind(**{name: convert(value) for name, convert, value in given if value is not None})


@cache
def _fields(kind: Hashable) -> tuple[tuple[str, Callable[[Any], Any]], ...]:
    hints = get_type_hints(kind, {**globals(), "Correction": object})
    return tuple((f.name, _converter(hints[f.name])) for f in dataclasses.fields(kind))  # type: ignore[arg-type]


def _converter(hint: Any) -> Callable[[Any], Any]:
    """How the plain value of a field becomes what its type says."""
    options = [option for option in get_args(hint) if option is not type(None)]
    if type(None) in get_args(hint) and len(options) == 1:
        return _converter(options[0])
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return lambda value: structured(hint, value)
    if getattr(hint, "__origin__", None) is tuple:
        inner = _converter(options[0])
        return lambda values: tuple(map(inner, values))
    return lambda value: value


def content(value: Any) -> Any:
    """What a file holds for a value of these types: mappings and lists, without what is None; all else as it is."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type) and type(value) in _TYPES:
        pairs = ((f.name, getattr(value, f.name)) for f in dataclasses.fields(value))
        return {name: content(each) for name, each in pairs if each is not None}
    return list(map(content, value)) if isinstance(value, list | tuple) else value


_TYPES = frozenset([Frame, Link, Mimic, Joint, Coupling, PendantJoint, Payload, Compensator, RobotSpec])
