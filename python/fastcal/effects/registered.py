# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects written in Python: a function gives the twists of a basis for all rows at once, the core fits coefficients.

xi_frame(row) = sum_k theta_k basis[row, frame, :, k], body twists [m; rad] = [v; w] of frames of the chain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from traceback import extract_tb
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.effects.traits import Place, Reference, Role, Traits
from fastcal.errors import InvalidInput
from fastcal.units import UNITS

ParameterText = tuple[str, str, float, str]

ENTRY_POINTS = "fastcal.effects"  # the group of an installed package's effects


@dataclass(frozen=True, eq=False)
class States:
    """What a basis function may look at: N rows, SI, None where the data have no such column.

    Attributes:
        owner: Whose effect is asked for, such as "joint4".
        robot: The robot without effects.
        q: (N, n) joint positions as commanded [rad or m].
        payload: (N,) [kg].
        wrench: (N, 6) [N, N m].
        temperature: (N,) [K].
        time: (N,) [s].
        station, mount: (N,) numbers of labels.
        approach: (N, n) +1, -1, or 0 where unknown.
        current: (N, n) [A].
        extra: The user's own columns that the effect asked for, by name, each (N,).
        load: (N, frames, 6) force and moment [N, N m] that all beyond a frame puts on it, in the frame's axes, of the
            robot without effects in the commanded posture; only for an effect with `follows_loads`.
    """

    owner: str
    robot: _core.RobotModel
    q: FloatArray
    payload: FloatArray | None = None
    wrench: FloatArray | None = None
    temperature: FloatArray | None = None
    time: FloatArray | None = None
    station: IntArray | None = None
    mount: IntArray | None = None
    approach: FloatArray | None = None
    current: FloatArray | None = None
    extra: Mapping[str, FloatArray] = field(default_factory=dict)
    load: FloatArray | None = None

    def load_on(self, frame: str) -> FloatArray:
        """(N, 6) `load` of a frame by its name, "base", "joint3", "link3" or "tool"."""
        if self.load is None:
            raise InvalidInput(f"an effect asks for the load on {frame} and was not registered with follows_loads=True")
        names = [self.robot.frame_name(k) for k in range(self.robot.frame_count)]
        if frame not in names:
            raise InvalidInput(f"no frame is called '{frame}'; there are {', '.join(names)}")
        return self.load[:, names.index(frame)]


_COLUMNS = ("payload", "wrench", "temperature", "time", "station", "mount", "approach", "current")


@dataclass(frozen=True)
class RegisteredEffect:
    """An effect as `register_effect` took it."""

    name: str
    owners: Sequence[str] | Callable[[_core.RobotModel], Sequence[str]]
    parameters: tuple[ParameterText, ...]
    basis: Callable[[States], ArrayLike]
    frames: tuple[str, ...] | None
    columns: tuple[str, ...]
    extra: tuple[str, ...]
    follows_loads: bool
    traits: Traits

    def owners_of(self, core: _core.RobotModel) -> list[str]:
        """All owners that a robot has for it."""
        return list(self.owners(core) if callable(self.owners) else self.owners)

    def frames_of(self, owner: str) -> tuple[str, ...]:
        """The frames that one owner's effect moves."""
        return self.frames or (owner,)

    def width(self, owner: str) -> int:
        """Columns of the table that one owner's effect takes."""
        return 6 * len(self.frames_of(owner)) * len(self.parameters)

    def build(self, owner: str, core: _core.RobotModel, first: int) -> _core.Effect:
        """The core's effect, whose basis stands in the table from column `first` on."""
        owners = self.owners_of(core)
        if owner not in owners:
            there = ", ".join(owners) or "none"
            raise InvalidInput(f"{self.name} has no owner '{owner}' on this robot; there are {there}")
        return _core.tabulated_effect(
            core, owner, list(self.parameters), list(self.frames_of(owner)), first, self.follows_loads
        )

    def table(self, states: States) -> FloatArray:
        """(N, width) in the core's order: frame, parameter, six numbers."""
        frames, count = len(self.frames_of(states.owner)), len(self.parameters)
        basis = self._computed(states)
        if frames == 1 and basis.ndim == 3:
            basis = basis[:, np.newaxis]
        expected = (len(states.q), frames, 6, count)
        if basis.shape != expected:
            shape = expected if frames > 1 else (expected[0], *expected[2:])
            raise InvalidInput(f"the basis of {self.name}@{states.owner} must have shape {shape}, got {basis.shape}")
        if not np.isfinite(basis).all():
            row = int(np.argwhere(~np.isfinite(basis))[0][0])
            raise InvalidInput(f"the basis of {self.name}@{states.owner} is not finite in row {row}")
        return np.ascontiguousarray(basis.transpose(0, 1, 3, 2)).reshape(len(states.q), -1)

    def _computed(self, states: States) -> FloatArray:
        try:
            return np.asarray(self.basis(states), dtype=float)
        except InvalidInput:
            raise
        except Exception as error:
            at = extract_tb(error.__traceback__)[:2][-1]  # below this method: the function itself
            file, kind = Path(at.filename).name, type(error).__name__
            raise InvalidInput(
                f"the basis of {self.name}@{states.owner} cannot be computed ({file}, line {at.lineno}): "
                f"{kind}, {error}; what the data lack is None, unless columns= asks for it"
            ) from error


_effects: dict[str, RegisteredEffect] = {}


def register_effect(
    name: str,
    *,
    owners: Sequence[str] | Callable[[_core.RobotModel], Sequence[str]],
    parameters: Sequence[ParameterText],
    basis: Callable[[States], ArrayLike],
    frames: Sequence[str] | None = None,
    columns: Sequence[str] = (),
    extra: Sequence[str] = (),
    phrase: str = "",
    role: Role = "cause",
    place: Place | None = None,
    depends_on: Sequence[str] = (),
    needs_data: str = "",
    shown_by: str = "",
    generalizes: Sequence[str] = (),
    contrast: Sequence[str] = (),
    refers_to: Reference = "rows",
    of_the_measurement: bool = False,
    plotted_over: str = "itself",
    number: str = "",
    follows_loads: bool = False,
) -> None:
    """Makes an effect of one's own known by name, to be used as those that come with fastcal.

    It must be registered again in every program that loads a model with it, or by a package with an entry point in the
    group `fastcal.effects`, which every program and command finds. Registering a name again replaces it.

    Args:
        name: As it will be written in files and effect lists.
        owners: Where it can act, such as ["joint1", "joint2"], or a function that lists them for a robot.
        parameters: (name, unit, plausible size, one line on it) of each; units are SI: "rad", "m", "rad_nm", "1" ...
        basis: From `States` of N rows to the body twists [v; w] that one unit of each parameter causes,
            (N, 6, parameters).
        frames: The frames that it moves ("base", "joint3", "link3", "tool"); the owner's own where not given. With
            several, the basis is (N, frames, 6, parameters).
        columns: Fields of `States` that the data must have, such as "temperature".
        extra: The user's own columns that the data must have.
        phrase: What a person understands, "a cable that pulls"; the name in words where not given.
        role: "cause", "nuisance", "load modifier" or "curve", as `fastcal.effects.traits.Traits` says.
        place: Where it acts; where not given, what the owners are called, else "frame".
        depends_on: Variables, such as "q{n}", "load" or "temperature_c".
        needs_data: What the data must hold; where not given, the columns.
        shown_by: The poses that would show it; where not given, other loads or a longer way of the owner.
        generalizes: Effects of the same owners that it holds as special cases.
        contrast: Two of its parameters, equal where it is no more than such a special case.
        refers_to: What the numbers refer to; "rows", the frames of this kind of kinematics, is what any basis may do.
        of_the_measurement: Is it the instrument's or the set-up's? Compensation leaves it out.
        plotted_over: The variable of its partial residual in a report; "itself": its own size in each pose.
        number: What its parameter is where that has no name; where not given, its line of text.
        follows_loads: Does it yield to loads? Then `States.load` is given, errors of masses are carried beside it, and
            it is proved at the signal that effects of loads take.

    Raises:
        InvalidInput: The name is taken by the core, or a parameter is invalid.
    """
    if name in _core.effect_names() or name == "geometry" or not name.replace("_", "").isalnum():
        raise InvalidInput(f"an effect needs a name of letters, digits and _ that is not taken, got '{name}'")
    if isinstance(owners, str):
        raise InvalidInput(f"owners of {name} must be a list, such as ['{owners}'], got '{owners}'")
    if not parameters:
        raise InvalidInput(f"{name} needs at least one parameter")
    for parameter in parameters:
        if len(parameter) != 4 or parameter[1] not in UNITS or not parameter[2] > 0:
            raise InvalidInput(
                f"a parameter of {name} must be (name, unit, size above 0, text), got {parameter}; "
                f"the units are {', '.join(UNITS)}"
            )
    for column in columns:
        if column not in _COLUMNS:
            raise InvalidInput(
                f"columns of {name} are {', '.join(_COLUMNS)}, got '{column}'; a column of one's own belongs in extra="
            )
    traits = Traits(
        phrase=phrase or name.replace("_", " "),
        role=role,
        place=place or _place_of(owners),
        depends_on=tuple(depends_on),
        needs_data=needs_data or " and ".join((*columns, *extra)),
        shown_by=shown_by or (_core.SHOWN_BY_LOADS if follows_loads else _core.SHOWN_BY_MOTION),
        generalizes=tuple(generalizes),
        contrast=tuple(contrast),
        refers_to=refers_to,
        of_the_measurement=of_the_measurement,
        plotted_over=plotted_over,
        number=number or parameters[0][3],
    )
    _effects[name] = RegisteredEffect(
        name,
        owners,
        tuple(parameters),
        basis,
        tuple(frames) if frames else None,
        tuple(columns),
        tuple(extra),
        follows_loads,
        traits,
    )


def _place_of(owners: Sequence[str] | Callable[[_core.RobotModel], Sequence[str]]) -> Place:
    """What all owners are called without their numbers, where that is a place."""
    kinds = set() if callable(owners) else {owner.rstrip("0123456789") for owner in owners}
    return next((place for place in get_args(Place) if kinds == {place}), "frame")


def find(name: str) -> RegisteredEffect | None:
    """The registered effect of that name, if there is one; packages are asked for one that nobody else knows."""
    if name not in _effects and name not in _core_names():
        _load_installed()
    return _effects.get(name)


def names() -> list[str]:
    """Names of all registered effects, those of installed packages too."""
    _load_installed()
    return sorted(_effects)


@cache
def _core_names() -> frozenset[str]:
    return frozenset(_core.effect_names())


@cache
def _load_installed() -> None:
    """Loads what installed packages offer: a module that registers effects, or a function that does, each once.

    Raises:
        InvalidInput: One of them cannot be loaded.
    """
    from importlib.metadata import entry_points  # takes as long as a short command

    for point in entry_points(group=ENTRY_POINTS):
        try:
            offered = point.load()
            if callable(offered):
                offered()
        except Exception as error:
            raise InvalidInput(
                f"the effects of the installed package that offers '{point.value}' cannot be loaded: {error}"
            ) from error
