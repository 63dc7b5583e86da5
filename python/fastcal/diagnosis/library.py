# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The names that a diagnosis may give: every effect, owner and option that the robot has and the data can show."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.options_from_data import with_origins
from fastcal.effects import registered
from fastcal.effects.entries import build_effects, effect_names, effect_owners, identity, label
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, Spec

FloatArray = NDArray[np.float64]
Key = tuple[str, str]

NUISANCES = ("link_mass", "link_com")  # carried with priors where a load matters, never named
SHAPES = ("payload_mass", "payload_com")  # the form of a load effect rather than a cause of its own
LOADED = (
    "joint_compliance",
    "joint_compliance_nonlinear",
    "link_bending",
    "link_torsion",
    "bearing_tilt",
    "beam_gravity",
)
RICHER = {  # what holds another name of the same owner as a special case
    "joint_compliance_nonlinear": ("joint_compliance",),
    "joint_profile": ("reduction_ratio", "gear_harmonic"),
}
ORDERS = (1, 2, 3, 4, 5, 6)
CORNERS = (0.2, 0.35, 0.5, 0.65, 0.8)  # quantiles of a joint's load at which a compliance may bend
STEPS = 24  # moments of a step that are tried before the best is searched for
_NOT_SCREENED = ("joint_profile", "surrogate", "regressor", *NUISANCES)  # generic blocks stand for the first two
# What many other causes look like from afar: a surrogate shows the curve, a formula beside it the name to try.
_TO_TRY = ("friction", "settling", "tracker_angle", "tracker_range")
_FEWEST = 5  # rows on either side of a step

NEEDS = {
    "backlash": "approach{n} that takes both signs",
    "friction": "approach{n} that takes both signs",
    "settling": "rows in the order in which they were measured",
    "tracker_range": "poses that fill a wide angle as the instrument sees them",
    "tracker_angle": "poses that fill a wide angle as the instrument sees them",
    "gravity_sag": "no masses in the robot file; with them joint_compliance says more",
    "thermal_expansion": "temperature_c that varies",
    "thermal_offset": "temperature_c that varies",
    "base_drift": "time_s over which the set-up may move",
    "base_step": "time_s over which the set-up may move",
    "station_offset": "two stations or more in the column station",
    "tool_shift": "two mounts or more in the column mount",
    "current_compliance": "current{n}_a",
    "measurement_scale": "a known length, such as a scale bar: the lengths of the geometry take it up",
    "payload_mass": "a compliance in the model and payload_kg that varies",
    "payload_com": "a compliance in the model and payload_kg that varies",
    "compensator_spring": "a compensator in the robot file and poses that change its angle",
}
_LOAD_NEEDS = "a load about it that varies in another way than the geometry: other poses, payloads or pulling sideways"


@dataclass(frozen=True, eq=False)
class Name:
    """One cause that could be missing, as an entry of a robot file with its parameters at 0.

    Attributes:
        entry: {effect, owner, options}.
        variant: Tells apart entries of one effect and owner (orders, corners, moments); "" where there is but one.
    """

    entry: Spec
    variant: str = ""

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return str(self.entry["effect"])

    @property
    def owner(self) -> str:
        """Its owner."""
        return str(self.entry["owner"])

    @property
    def key(self) -> Key:
        """Effect and owner."""
        return self.effect, self.owner

    @property
    def searched(self) -> int:
        """Numbers that are searched for outside the fit and count as its parameters: a moment, an order."""
        order = self.entry.get("order", ORDERS[0])
        return int("at_s" in self.entry) + int(order not in ORDERS)

    def __repr__(self) -> str:
        return label(self.entry) + (f":{self.variant}" if self.variant else "")


@dataclass(frozen=True)
class Untestable:
    """A name on which the data hold no information, and what would show it."""

    effect: str
    owner: str
    needs: str


@dataclass(frozen=True)
class Library:
    """What can be named, and what the data lack the columns for."""

    names: list[Name]
    untestable: list[Untestable]


def parse_exclusions(texts: Collection[str], robot: Robot) -> set[tuple[str, str | None]]:
    """`EFFECT` or `EFFECT@OWNER` to pairs; the owner None: all of them.

    Raises:
        InvalidInput: An effect or owner that this robot does not have.
    """
    out: set[tuple[str, str | None]] = set()
    for text in texts:
        effect, at, owner = text.strip().partition("@")
        owners = effect_owners(effect, robot.core)
        if at and owner not in owners:
            there = ", ".join(owners) or "none"
            raise InvalidInput(f"--exclude {text}: {effect} has no owner '{owner}' on this robot; there are {there}")
        out.add((effect, owner if at else None))
    return out


def build_library(robot: Robot, data: Dataset, excluded: Collection[tuple[str, str | None]] = ()) -> Library:
    """All names for a robot and data, without those in its file already and those excluded."""
    there = {identity(entry) for entry in robot.spec.get("effects") or []}
    names: list[Name] = []
    untestable: list[Untestable] = []
    for effect in effect_names():
        if effect in (*_NOT_SCREENED, *_TO_TRY):
            continue
        for owner in effect_owners(effect, robot.core):
            if (effect, None) in excluded or (effect, owner) in excluded:
                continue
            try:
                entries = list(_entries(effect, owner, robot, data))
            except InvalidInput:
                untestable.append(Untestable(effect, owner, needs(effect, owner)))
                continue
            names += [name for name in entries if identity(name.entry) not in there]
    return Library(names, untestable)


def needs(effect: str, owner: str) -> str:
    """What the data would have to hold to show an effect."""
    number = "".join(c for c in owner.partition("<-")[0] if c.isdigit())
    return NEEDS.get(effect, _LOAD_NEEDS if effect in LOADED else f"poses in which {owner} moves further").format(
        n=number
    )


def _entries(effect: str, owner: str, robot: Robot, data: Dataset) -> Iterator[Name]:
    """The variants of one effect and owner; InvalidInput where the data lack a column."""
    bare: Spec = {"effect": effect, "owner": owner}
    if effect == "gear_harmonic":
        yield from harmonics(owner, robot, data, ORDERS)
    elif effect == "joint_compliance_nonlinear":
        for corner in CORNERS:  # the critical load itself follows from the loads of a fit
            yield Name({**bare, "corner": corner}, f"corner={corner}")
    elif effect == "base_step":
        yield from _steps(bare, data)
    elif effect == "gravity_sag":
        if not without_masses(robot) or np.ptp(data.payload) > 0:
            raise InvalidInput(
                "gravity_sag is for robots without masses, beside joint_compliance where payloads show it"
            )
        yield Name({**bare, "moments": "even"})
    else:
        entry = with_origins(bare, robot, data)
        for column in _columns(entry, robot):
            if getattr(data, column.rstrip("0123456789"), None) is None:
                raise InvalidInput(f"{effect} needs the column {column}")
        yield Name(entry)


def _columns(entry: Spec, robot: Robot) -> Sequence[str]:
    """Columns of the data that an effect cannot do without."""
    known = registered.find(entry["effect"])
    return known.columns if known else build_effects([entry], robot.core)[0].data_columns


def _steps(bare: Spec, data: Dataset) -> Iterator[Name]:
    """Moments over the time of the data; the search goes on from the best of them to the best between two rows."""
    if data.time is None:
        raise InvalidInput("base_step needs the column time_s")
    inner = np.unique(data.time)[_FEWEST:-_FEWEST]
    if len(inner) == 0:
        raise InvalidInput("base_step needs more moments")
    places = np.unique(np.linspace(0, len(inner) - 1, STEPS).round().astype(int))
    for at in inner[places]:
        yield Name({**bare, "at_s": float(at)}, f"at_s={at:.6g}")


def harmonics(owner: str, robot: Robot, data: Dataset, orders: Collection[float]) -> Iterator[Name]:
    """A wave of each order of which at least half a period fits into both the joint's limits and the data's range."""
    joint = int(owner.removeprefix("joint")) - 1
    span = float(np.ptp(data.q[:, joint]))
    for order in orders:
        if order >= 1 and order * span > math.pi:
            entry = {"effect": "gear_harmonic", "owner": owner, "order": float(order)}
            try:
                yield Name(with_origins(entry, robot, data), f"order={order:g}")
            except InvalidInput:
                continue


def without_masses(robot: Robot) -> bool:
    """Does the robot file say nothing of what the arm weighs?"""
    return not any(float((joint.get("link") or {}).get("mass_kg", 0.0)) > 0 for joint in robot.spec["joints"])
