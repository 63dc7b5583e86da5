# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An acceptance test by ISO 9283: from measured rows to figures, their uncertainty and a verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fastcal.acceptance.figures import figures_of
from fastcal.acceptance.judgement import CONFIDENCE, LIMITS, UNITS, Judged, Verdict, judged, overall, parsed_limits
from fastcal.acceptance.propagation import simulated_expanded, spreads_of, uncertainty_of
from fastcal.acceptance.visits import Campaign, campaign, cycle_of
from fastcal.acceptance.volume import Predicted, predicted_uncertainty
from fastcal.budget import Budget
from fastcal.calibration.repeatability import ISO_POSES, ISO_VISITS
from fastcal.display.shown import PlottedArm
from fastcal.measurements.dataset import Dataset
from fastcal.robot.made_by import made_by
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import frame_spec
from fastcal.robot.se3 import inverse
from fastcal.units import from_si

DRAWS = 20_000


@dataclass(frozen=True, eq=False)
class Acceptance(PlottedArm):
    """What a test has shown.

    Attributes:
        model: The robot whose test it was.
        campaign: The rows as visits.
        figures: Each with its uncertainty and verdict.
        verdict: pass, fail or cannot_tell; None where no limit was given.
        budget: What was known beforehand; None: nothing.
        simulated: By figure: the expanded uncertainty by draws (JCGM 101), None for figures of spread.
        predicted: How surely the model knows its own points in the test's volume; None if it was not calibrated.
        missing: Limits that no figure of the test shows.
        made_by: Version, hashes and what is known of who measured what.
        notes: What a reader should know, a sentence each.
    """

    model: Robot
    campaign: Campaign
    figures: tuple[Judged, ...]
    verdict: Verdict | None
    budget: Budget | None
    simulated: tuple[float | None, ...]
    predicted: Predicted | None = None
    missing: tuple[str, ...] = ()
    made_by: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def is_iso_9283(self) -> bool:
        """Is the standard's plan met: five poses, thirty visits each from one side?"""
        stations = self.campaign.stations
        return sum(len(stations[k].rows) >= ISO_VISITS for k in cycle_of(stations)) >= ISO_POSES

    @property
    def probability(self) -> float | None:
        """The least probability with which one of the limits is kept; None without a limit."""
        known = [each.probability for each in self.figures if each.probability is not None]
        return min(known) if known else None

    def to_json_dict(self) -> dict[str, Any]:
        """The content of accept.json."""
        T = inverse(self.campaign.T_base_world)
        return {
            "verdict": self.verdict,
            "probability": self.probability,
            "sure": CONFIDENCE,
            "robot": self.model.name,
            "iso_9283": self.is_iso_9283,
            "aligned": {"fitted": self.campaign.fitted, **frame_spec(T)},
            "poses": [
                {
                    "pose": s.pose,
                    "direction": s.direction,
                    "visits": len(s.rows),
                    "commanded_mm": [from_si(float(v), "mm") for v in s.commanded[:3, 3]],
                }
                for s in self.campaign.stations
            ],
            "figures": [_entry(each, drawn) for each, drawn in zip(self.figures, self.simulated, strict=True)],
            "volume": None if self.predicted is None else _volume(self.predicted),
            "level": None if self.budget is None else self.budget.level,
            "notes": list(self.notes),
            "made_by": dict(self.made_by),
        }


def _entry(each: Judged, drawn: float | None) -> dict[str, Any]:
    """One entry of `figures`, its expanded uncertainty also by draws."""
    by_draws = None if drawn is None else float(from_si(drawn, UNITS[each.figure.unit]))
    return each.to_json_dict() | {"expanded_by_draws": by_draws}


def _volume(found: Predicted) -> dict[str, Any]:
    """The block `volume`, in mm."""
    largest = max(found.worst, key=lambda u: u.expanded)
    return {
        "largest_expanded_mm": float(from_si(largest.expanded, "mm")),
        "points": [
            {
                "name": name,
                "xyz_mm": from_si(point, "mm"),
                "expanded_mm": [from_si(u.expanded, "mm") for u in coordinates],
                "worst_expanded_mm": from_si(worst.expanded, "mm"),
                "contributions_mm": {"calibration": from_si(worst.observed, "mm")}
                | {name: from_si(part, "mm") for name, part in worst.parts},
            }
            for name, point, coordinates, worst in zip(
                found.names, found.points, found.coordinates, found.worst, strict=True
            )
        ],
    }


def accept(
    model: Robot,
    data: Dataset,
    *,
    plan: Dataset | None = None,
    limits: Mapping[str, float] | None = None,
    budget: Budget | None = None,
    align: bool = True,
    draws: int = DRAWS,
    seed: int = 0,
    who: Mapping[str, str | None] | None = None,
) -> Acceptance:
    """Judges measured visits.

    Args:
        model: The robot; without a plan its poses are the commands.
        data: Measured points at commanded joint positions.
        plan: As `fastcal accept --plan` has written it, read as a data set.
        limits: By name, in its unit: ap_mm, rp_mm, vap_mm, ad_mm, rd_mm, dap_mm, drp_mm, ap_deg, rp_deg.
        budget: What is known of instrument and conditions.
        align: Fit the measuring frame to the poses; False: take the model's base.
        draws: Of the check by JCGM 101.
        seed: Of the draws.
        who: What only a person knows: serial, instrument, operator, customer, date (YYYY-MM-DD).

    Raises:
        InvalidInput: The rows can't be matched or aligned, a limit is unknown, or no pose was visited twice.
    """
    asked = parsed_limits(limits or {})
    origin = made_by(model, data, who)
    found = campaign(model, data, plan, align=align)
    spreads = spreads_of(found, budget or Budget(), model)
    every = range(len(found.stations))
    means = np.array([found.errors(k).mean(axis=0) for k in every])
    turned = np.zeros_like(means)
    if found.turns is not None:
        turned = np.array([found.turn_errors(k).mean(axis=0) for k in every])
    figures = figures_of(found)
    out = [
        judged(figure, uncertainty_of(figure, turned if figure.unit == "rad" else means, spreads), asked)
        for figure in figures
    ]
    missing = [
        name
        for name, symbols in LIMITS.items()
        if symbols[0] in asked and not any(figure.symbol in symbols for figure in figures)
    ]
    drawn = simulated_expanded(figures, means, turned, spreads, draws, seed) if draws else [None] * len(figures)
    volume = predicted_uncertainty(model, found, budget or Budget())
    result = Acceptance(
        model, found, tuple(out), overall(out, missing), budget, tuple(drawn), volume, tuple(missing), origin
    )
    return replace(result, notes=tuple(_notes(result)))


def _notes(found: Acceptance) -> list[str]:
    """What a reader of the figures should know."""
    out = [f"a limit is given for {name}, but no measurement determines it" for name in found.missing]
    if found.budget is None:
        out.append(
            "no budget was given: the uncertainties contain the scatter of the visits only; --budget adds what is "
            "known of the instrument"
        )
    if not found.is_iso_9283:
        stations = found.campaign.stations
        cycle = cycle_of(stations)
        least = min(len(stations[k].rows) for k in cycle)
        out.append(
            f"not the plan of ISO 9283, {ISO_POSES} poses with {ISO_VISITS} visits each: {len(cycle)} poses were "
            f"measured, with at least {least} visits each"
        )
    if found.campaign.fitted:
        out.append(
            "the instrument was aligned to the commanded poses by a best fit: AP leaves out whatever a rigid motion "
            "of all poses explains"
        )
    return out
