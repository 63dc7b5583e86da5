# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which errors of an arm's geometry are identifiable at all: independent, correlated with others, or without effect.

From the null space of the Jacobian over the workspace, J N = 0 (the spray-painting paper 2022, section 4.2, finds its
five rules by hand from special cases of one pair of rows). Held parameters are chosen as an identification chooses its
gauge (`identifiability.hpp`); the column of each is then a combination of kept ones, J_h = sum_k c_hk J_k.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.simulation import random_poses
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot

MEASURED = {"position": 3, "pose": 6}
_TIE = 1e-3  # of a priority: it decides between equals alone
NOTHING = 1e-9  # of the largest singular value: what rounding leaves of nothing
IN_COMBINATION = 1e-7  # of the largest coefficient


@dataclass(frozen=True)
class ErrorParameter:
    """One parameter of the geometry.

    Attributes:
        name: Such as "joint2 a".
        kind: independent, correlated or without_effect.
        held: Is it one of those that are best left at nominal?
        combination: Of a held, correlated one: its column of the Jacobian as a sum of kept ones, by name.
        partners: Parameters that it is correlated with, directly or through others.
    """

    name: str
    kind: str
    held: bool
    combination: dict[str, float]
    partners: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Redundancy:
    """What `redundancy` found.

    Attributes:
        parameters: All that were asked for, in the order of the robot.
        rank: How many directions measurements can determine; as many parameters are kept.
        singular_values: (P,) of the Jacobian, descending; scaled by plausible sizes, per root of the rows.
    """

    parameters: list[ErrorParameter]
    rank: int
    singular_values: FloatArray

    @property
    def kept(self) -> list[str]:
        """Names to identify: independent ones, and of each correlated family all but the held."""
        return [p.name for p in self.parameters if not p.held]

    @property
    def held(self) -> list[str]:
        """Names to leave at nominal."""
        return [p.name for p in self.parameters if p.held]

    @property
    def condition(self) -> float:
        """Largest over smallest singular value that is not nothing; from 1e3 or so on, some are nearly redundant."""
        return float(self.singular_values[0] / self.singular_values[self.rank - 1]) if self.rank else 1.0

    def __getitem__(self, name: str) -> ErrorParameter:
        return next(p for p in self.parameters if p.name == name)

    def __str__(self) -> str:
        lines = [f"{self.rank} of {len(self.parameters)} are identifiable, condition {self.condition:.3g}"]
        for p in self.parameters:
            if p.kind == "without_effect":
                lines.append(f"{p.name}: without effect")
            elif p.combination:
                terms = " ".join(f"{c:+.4g} {name}" for name, c in p.combination.items())
                lines.append(f"{p.name}: held, does what {terms} does")
            else:
                lines.append(f"{p.name}: {p.kind}")
        return "\n".join(lines)


def redundancy(
    robot: Robot,
    q: ArrayLike | None = None,
    *,
    measured: str = "position",
    parameters: Sequence[str] | None = None,
    keep: Sequence[str] = ("base", "tool"),
    count: int = 200,
    seed: int = 0,
) -> Redundancy:
    """Classes every parameter of an arm's geometry by what measurements over its workspace can determine of it.

    The arm is taken rigid, at its present numbers: what the deflections of a flexible arm add to J is of second order
    and makes redundant errors look identifiable.

    Args:
        robot: The arm; its effects are left out.
        q: (N, n) postures [rad or m]; None: `count` random ones within the limits.
        measured: position (the tool's point) or pose (point and orientation).
        parameters: Names such as "joint2 a" to look at, the others known; None: all of rows, base and tool.
        keep: Beginnings of names that are held only where nothing else will do, such as "base" or "joint3 d".
        count: Random postures.
        seed: The same seed gives the same ones.

    Raises:
        InvalidInput: A name is unknown, or a shape or word is invalid.
    """
    if measured not in MEASURED:
        raise InvalidInput(f"measured must be one of {', '.join(MEASURED)}, got '{measured}'")
    rigid = robot.with_(effects=[])
    names = rigid.parameter_names
    unknown = [name for name in parameters or () if name not in names]
    if unknown:
        raise InvalidInput(f"there is no parameter '{unknown[0]}'; there are {', '.join(names)}")
    asked = [i for i, name in enumerate(names) if parameters is None or name in parameters]
    postures = random_poses(rigid, count, seed=seed) if q is None else np.atleast_2d(np.asarray(q, dtype=float))
    sizes = np.array([parameter.sigma for parameter in rigid.error_model.parameters])[asked]
    J = rigid.parameter_jacobian(postures, rows=MEASURED[measured])[:, :, asked]
    return _classed([names[i] for i in asked], np.reshape(J, (-1, len(asked))), sizes, keep)


def _classed(names: list[str], J: FloatArray, sizes: FloatArray, keep: Sequence[str]) -> Redundancy:
    rows = np.zeros((max(len(J), len(names)), len(names)))
    rows[: len(J)] = J * (sizes / np.sqrt(max(len(J), 1)))
    R = np.linalg.qr(rows, mode="r")
    # Large: held first. Ties fall to the first in the chain.
    priority = np.array([1e-3 if any(name.startswith(k) for k in keep) else _fixing_priority(name) for name in names])
    priority *= 1 - _TIE * np.arange(len(names)) / len(names)
    held, directions, values = _core.choose_gauge(R, priority, NOTHING)
    rank = len(names) - len(held)
    moved = np.linalg.norm(np.linalg.qr(directions)[0], axis=1)  # rows of an orthonormal null basis
    silent = np.linalg.norm(R, axis=0) <= NOTHING * values[0]
    free = np.setdiff1d(np.arange(len(names)), held)
    coefficients = -directions * sizes[:, None] / sizes[held]
    parameters = []
    for i, name in enumerate(names):
        kind = "without_effect" if silent[i] else "correlated" if moved[i] > NOTHING**0.5 else "independent"
        combination = {}
        if i in held and not silent[i]:
            column = coefficients[:, held.index(i)]
            visible = np.abs(column) > IN_COMBINATION * np.abs(column[free]).max(initial=0)
            combination = {names[k]: float(column[k]) for k in free if visible[k]}
        parameters.append((name, kind, bool(i in held), combination))
    families = _families([(name, combination) for name, _, _, combination in parameters if combination])
    return Redundancy(
        [ErrorParameter(*p, tuple(other for other in families.get(p[0], ()) if other != p[0])) for p in parameters],
        rank,
        values,
    )


def _fixing_priority(name: str) -> float:
    """Beta serves only where two axes are nearly parallel, and is held elsewhere."""
    return 10.0 if name.endswith(" beta") else 1.0


def _families(combinations: list[tuple[str, dict[str, float]]]) -> dict[str, list[str]]:
    """By name, all names that combinations tie it to."""
    families: dict[str, list[str]] = {}
    for name, combination in combinations:
        together = list(dict.fromkeys(m for n in (name, *combination) for m in families.get(n, [n])))
        families |= dict.fromkeys(together, together)
    return families
