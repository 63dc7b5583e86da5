# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a calibration found."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.bounds import Bound
from fastcal.calibration.camera_places import CameraPlace
from fastcal.calibration.evaluation import Evaluation
from fastcal.calibration.known_lengths import KnownLength
from fastcal.calibration.shape import Shape
from fastcal.display import late
from fastcal.display.shown import Plotted
from fastcal.measurements.kinds import POINTS, KindMisfit, KindNoise, noise_in_mm
from fastcal.robot.robot import Robot

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class IdentifiedParameter:
    """One number of the result, in the unit of its name: `theta_deg` of `joint2`.

    `std` is None where it ended on a `bound` of what it can be, which has no symmetric uncertainty.
    """

    name: str
    owner: str
    value: float
    std: float | None
    unit: str
    nominal: float
    bound: Bound | None = None

    def to_json_dict(self) -> dict[str, Any]:
        """The fields, `bound` only where there is one."""
        out = {key: value for key, value in vars(self).items() if key != "bound"}
        return out if self.bound is None else {**out, "bound": vars(self.bound)}


@dataclass(frozen=True)
class Unidentifiable:
    """A direction that the data cannot determine, in words, and the parameters in it; the first is held at nominal."""

    direction: str
    parameters: list[str]


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationResult(Plotted):
    """What `calibrate` found.

    Attributes:
        model: The identified robot; also the start of a next calibration.
        nominal: The robot before, with the best rigid fit of base and tool.
        status: converged, not_converged or too_few_equations.
        parameters: Identified numbers in edge units; `covariance` (P, P) is theirs in SI, in the same order.
        iterations: Of the solver, summed over the rounds in which weights, noise and loads settle.
        rank: Directions of the asked parameters that change anything that was measured.
        noise: Of one number of each kind of reading, by the kind's name.
        outliers: Rows whose error the noise does not explain.
        weights: (N,) robust weight of each row of `train.data`, 1 is full.
        misfits: Kinds of reading that do not belong to the arm or to the other kinds; `notes` begin with them.
        caveats: Those of the notes by which the stated deviations and intervals do not hold.
        bent: That of the caveats which says that the fit is not straight within its intervals; empty where it is.
        doubts: Those of the notes that come first: doubtful columns and rows, and which rows and which fit stand.
        shape: How surely distances between points are known, where no points were measured.
        held: How the geometry of few poses was held near nominal, a sentence; empty where it was free.
        unknowns: Of the observations, by what they are of: the place (3,) [m] of "anchor 2" of measured lengths.
        known_lengths: Lengths between touched points that the robot file knows, beside those found.
        cameras: How surely the place of each camera is known.
        reaches: (P, 2) of a fit that bends within its intervals, how far these reach down and up, over t times `std`.
        own_freedom: (P,) degrees of freedom of the parameters' deviations, where several kinds have each its noise.
    """

    status: str
    message: str
    model: Robot
    nominal: Robot
    loss: str
    method: str
    parameters: list[IdentifiedParameter]
    covariance: FloatArray
    unidentifiable: list[Unidentifiable]
    correlated: list[tuple[str, str, float]]
    rank: int
    asked_count: int
    degrees_of_freedom: int
    iterations: int
    noise: Mapping[str, KindNoise]
    outliers: list[int]
    weights: FloatArray
    train: Evaluation
    test: Evaluation | None = None
    notes: list[str] = field(default_factory=list)
    misfits: list[KindMisfit] = field(default_factory=list)
    caveats: list[str] = field(default_factory=list)
    bent: str = ""
    doubts: list[str] = field(default_factory=list)
    shape: Shape | None = None
    held: str = ""
    unknowns: dict[str, FloatArray] = field(default_factory=dict)
    known_lengths: list[KnownLength] = field(default_factory=list)
    cameras: list[CameraPlace] = field(default_factory=list)
    own_freedom: FloatArray | None = None
    reaches: FloatArray | None = None

    @property
    def sigma(self) -> float | None:
        """Noise of one measured coordinate [m]; None where no point was measured."""
        return self.noise[POINTS].value if POINTS in self.noise else None

    @property
    def sigma_note(self) -> str:
        """Where the noise comes from, of points where they were measured."""
        return next((of.note for of in self.noise.values()), "")

    @property
    def sigma_mm(self) -> float | None:
        """`sigma` in mm, or the noise of the lengths that were measured in place of points; None where neither was."""
        return noise_in_mm(self.noise)

    @property
    def lacks_effect(self) -> bool:
        """Is an effect missing from the model, since the residuals depend on the posture?"""
        return any(caveat != self.bent for caveat in self.caveats)

    def interval(self, level: float = 0.95) -> FloatArray:
        """(P, 2) two-sided confidence intervals of the parameters in edge units, by Student's t.

        Where the fit bends within them they follow its profile, as found at 95 %: no longer symmetric, and infinite
        where the rows do not object. Of a parameter on its bound the part that the bound leaves, infinite where nothing
        can be claimed.
        """
        from scipy import special  # takes longer to import than a fit

        freedom = np.full(len(self.parameters), float(max(self.degrees_of_freedom, 1)))
        if self.own_freedom is not None:
            freedom = np.minimum(freedom, np.maximum(self.own_freedom, 1.0))
        t = special.stdtrit(freedom, 0.5 + level / 2)
        out = np.empty((len(self.parameters), 2))
        reaches = np.ones(out.shape) if self.reaches is None else self.reaches
        for k, p in enumerate(self.parameters):
            if p.bound is not None:
                out[k] = p.bound.interval(p.value, float(t[k]))
            else:
                half = float(t[k]) * (p.std or 0.0)
                out[k] = p.value - half * reaches[k, 0], p.value + half * reaches[k, 1]
        return out

    def plot_gap(self) -> Figure:
        """RMS error with base and tool alone, what was identified takes of it, and what noise alone would make."""
        return late.call("chart", self, "gap")

    def plot_parameters(self) -> Figure:
        """Every parameter's change and its 95 % interval, in mm at the tool."""
        return late.call("chart", self, "parameters")

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes model.yaml (where anything was identified), result.json and report.html into a folder, all or none."""
        late.call("write_calibration", self, folder)

    def to_json_dict(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "status": self.status,
            "message": self.message,
            "method": self.method,
            "loss": self.loss,
            "train": self.train.to_json_dict(),
            "test": None if self.test is None else self.test.to_json_dict(),
            "parameters": [p.to_json_dict() for p in self.parameters],
            "rank": self.rank,
            "unidentifiable": [vars(u) for u in self.unidentifiable],
            "correlated": [{"first": a, "second": b, "correlation": r} for a, b, r in self.correlated],
            "sigma_mm": self.sigma_mm,
            "sigma_note": self.sigma_note,
            "noise": {name: of.to_json_dict() for name, of in self.noise.items()},
            "degrees_of_freedom": self.degrees_of_freedom,
            "outliers": self.outliers,
            "shape": None if self.shape is None else self.shape.to_json_dict(),
            "known_distances": [length.to_json_dict() for length in self.known_lengths],
            "cameras": [camera.to_json_dict() for camera in self.cameras],
            "misfits": [{"kind": of.kind.name, "text": of.text} for of in self.misfits],
            "caveats": self.caveats,
            "notes": self.notes,
            "held": self.held,
            "made_by": self.model.made_by,
        }
