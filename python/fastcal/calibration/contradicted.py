# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Distances and places that a file knows beforehand, held against what the readings say.

A fit without any of it finds z = f(theta) +- A V A^T of each number z that the file tells +- S, V the covariance of the
parameters with what no reading shows as open as plausible. With d = told - found,

    chi^2 = d^T (A V A^T + S)^-1 d

is that of what all of it contradicts. As long as chance does not explain it, the distance or place that contradicts
most is left out. A place that the file calls fixed counts as known within SURE_MM and SURE_DEG: nobody places anything
better, and less of an error does no harm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import Spec
from fastcal.said import Said, joined, said
from fastcal.units import from_si

SURE_MM, SURE_DEG = 0.1, 0.005
_CHANCE = 1e-6  # of what the readings leave open that the file contradicts them as much as it does
_ALIKE = 9.0  # of chi square: what would explain nearly as much may be what is wrong


@dataclass(frozen=True, eq=False)
class Told:
    """A distance or place that the file knows.

    Attributes:
        of: What it is, for who asks.
        label: What it is called.
        A: (k, T) derivatives of its numbers by the parameters and unknowns.
        off: (k,) told less found [m, rad].
        sigma: (k,) of what is told.
    """

    of: Any
    label: str
    A: FloatArray
    off: FloatArray
    sigma: FloatArray


def contradicted(told: Sequence[Told], V: FloatArray) -> list[tuple[Told, list[Told]]]:
    """What the readings and the rest of it contradict, each with what may be wrong in its place; V (T, T)."""
    from scipy.special import chdtrc  # SciPy takes longer to import than a fit

    def misfit(left: Sequence[Told]) -> tuple[float, int]:
        if not left:
            return 0.0, 0
        A, d = np.vstack([of.A for of in left]), np.concatenate([of.off for of in left])
        S = A @ V @ A.T + np.diag(np.concatenate([of.sigma for of in left]) ** 2)
        return float(d @ np.linalg.solve(S, d)), len(d)

    left, out = list(told), list[tuple[Told, list[Told]]]()
    while left:
        whole, count = misfit(left)
        if chdtrc(count, whole) > _CHANCE:
            break
        gain = [whole - misfit([of for of in left if of is not one])[0] - len(one.off) for one in left]
        worst = int(np.argmax(gain))
        alike = [of for of, own in zip(left, gain, strict=True) if of is not left[worst] and own > gain[worst] - _ALIKE]
        out.append((left[worst], alike))
        left.pop(worst)
    return out


def place_sentence(name: str, told: Spec, found: Spec) -> Said:
    """Where the file has a member and where the readings have it, {xyz_mm, rpy_deg} each."""
    X = np.linalg.inv(pose(told)) @ pose(found)
    angle = from_si(float(np.linalg.norm(np.asarray(_core.log_so3(X[:3, :3])))), "deg")
    return said(
        "{name}: the file knows the place {told} mm, the readings say {found} mm, {off} mm and {turn} deg from it: "
        "what the file knows of it is not used",
        name=name,
        told=_xyz(told),
        found=_xyz(found),
        off=f"{from_si(float(np.linalg.norm(X[:3, 3])), 'mm'):.3f}",
        turn=f"{angle:.3f}",
    )


def or_others(text: Said, others: Sequence[Told]) -> Said:
    """The sentence, with what may be wrong in its place."""
    if not others:
        return text
    return said("{text} (or it is {others} that is wrong)", text=text, others=joined(", ", [o.label for o in others]))


def _xyz(place: Spec) -> str:
    return " ".join(f"{value:.3f}" for value in place["xyz_mm"])
