# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lengths that a robot file knows (`known_distances`) beside those that a fit has found.

Touches of unknown points leave the common scale of all lengths open: the fit takes it from the robot file. A length L
between two of the points that is known to be l shows it. With d the vector between the points as found [m], u = d / |d|
and C their covariance, L = |d| has the variance u^T (C_aa - C_ab - C_ba + C_bb) u, and arm, tool and places are l / L
times as large as in the model, with the deviation of both lengths over L. It is reported and not imposed: a block of
50 mm that is known to 0.1 mm knows the scale to 0.2 %, which of a link of 400 mm is 0.8 mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.robot.robot_spec import Spec
from fastcal.units import from_si, to_si

_CONTRADICTS = 3.0  # standard deviations of both lengths
_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class KnownLength:
    """A length between two touched points: as the robot file knows it, and as a fit has it [m].

    Attributes:
        between: The two points, by their names.
        known, known_std: Of the robot file.
        found, found_std: Of the fit, the common scale of all lengths being that of the robot file.
    """

    between: tuple[str, str]
    known: float
    known_std: float
    found: float
    found_std: float

    @property
    def scale(self) -> float:
        """By which all lengths of the model were to be multiplied for this one to be as known."""
        return self.known / self.found

    @property
    def scale_std(self) -> float:
        """Standard deviation of `scale`."""
        return float(np.hypot(self.known_std, self.scale * self.found_std)) / self.found

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `known_distances` of result.json."""
        first, second = self.between
        numbers = {
            "known_mm": self.known,
            "known_std_mm": self.known_std,
            "found_mm": self.found,
            "found_std_mm": self.found_std,
        }
        lengths = {name: from_si(value, "mm") for name, value in numbers.items()}
        return {"from": first, "to": second, **lengths, "scale": self.scale, "scale_std": self.scale_std}

    @property
    def note(self) -> str:
        """A sentence for a reader."""
        first, second = self.between
        text = (
            f"from {first} to {second} the fit has {from_si(self.found, 'mm'):.3f} mm (standard deviation "
            f"{from_si(self.found_std, 'mm'):.2g}), the file {from_si(self.known, 'mm'):.3f} mm "
            f"({from_si(self.known_std, 'mm'):.2g}): "
        )
        shown = f"{100 * self.scale_std:.2g} %"
        # Held against each other as lengths: the deviation of a scale grows beyond all bounds as `found` goes to 0.
        if abs(self.known - self.found) <= _CONTRADICTS * float(np.hypot(self.known_std, self.found_std)):
            return text + f"they agree, which shows the common scale of all lengths to {shown}"
        size = "larger" if self.scale > 1 else "smaller"
        return text + (
            f"either all lengths are {100 * abs(self.scale - 1):.2g} % {size} than in the model (to {shown}), or it "
            "lacks something; the fit keeps the scale of the file"
        )


def known_lengths(
    known: Sequence[Spec], names: Sequence[tuple[str, str]], places: FloatArray, covariance: FloatArray
) -> list[KnownLength]:
    """The known distances of a file whose two points a fit has found.

    Args:
        known: `known_distances` of the file: from, to, mm, sigma_mm.
        names: (U,) owner and name of each unknown of the observations, as ("socket a", "x").
        places: (U,) their values [m].
        covariance: (U, U) of these; what is held has none.
    """
    at = {name: k for k, name in enumerate(names)}
    out = []
    for entry in known:
        ends = (str(entry["from"]), str(entry["to"]))
        if ends[0] == ends[1] or not all((end, axis) in at for end in ends for axis in _AXES):
            continue
        first, second = ([at[end, axis] for axis in _AXES] for end in ends)
        between = places[second] - places[first]
        found = float(np.linalg.norm(between))
        if found == 0:
            continue
        along = np.zeros(len(places))
        along[second], along[first] = between / found, -between / found
        std = float(np.sqrt(max(float(along @ covariance @ along), 0.0)))
        length, length_std = (to_si(float(entry[key]), "mm") for key in ("mm", "sigma_mm"))
        out.append(KnownLength(ends, length, length_std, found, std))
    return out


def length_notes(known: Sequence[Spec], lengths: Sequence[KnownLength]) -> list[str]:
    """A sentence for each known distance of a file that was touched, or that none was."""
    if known and not lengths:
        return ["of no known distance of the file both ends were touched"]
    return [length.note for length in lengths]
