# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Parameters that ended at a bound: their unconstrained estimate, and the interval that may be stated.

A compliance cannot be negative. Where noise pulls its estimate below 0 it stays on 0, and a symmetric interval around 0
describes no estimate at all. Stated instead is the estimate without the bound, to first order x - (J^T W J)^-1 J^T W r,
whose interval, cut at the bound, holds the true value as often as any. Where the whole of it lies beyond the bound,
nothing is claimed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fastcal import _core
from fastcal.calibration.problem import CalibrationProblem
from fastcal.said import Said, said

Side = Literal["lower", "upper"]

NOISE_EXPLAINS = 3.0  # standard deviations beyond the bound


@dataclass(frozen=True)
class Bound:
    """Which bound a parameter is on, and the estimate that the data would give without it, in the parameter's unit."""

    side: Side
    unbounded: float
    std: float

    def interval(self, value: float, t: float) -> tuple[float, float]:
        """The part of unbounded +- t std that the bound `value` leaves; all of its side where it leaves none."""
        if self.side == "lower":
            high = self.unbounded + t * self.std
            return value, high if high > value else np.inf
        low = self.unbounded - t * self.std
        return low if low < value else -np.inf, value

    def note(self, name: str, value: float, unit: str) -> Said:
        """A sentence for the reader."""
        out = value - self.unbounded if self.side == "lower" else self.unbounded - value
        beyond = out / self.std if self.std > 0 else np.inf
        side = said("lower") if self.side == "lower" else said("upper")
        own = "" if name.endswith(f"_{unit}") else f" {unit}"  # said once, as part of the name
        given = {"name": name, "side": side, "value": float(value), "unit": own, "free": float(self.unbounded)}
        if out <= 0:  # to first order, and the fit is not linear
            return said(
                "{name} is held at its {side} bound {value:.4g}{unit}; unconstrained, the data give {free:.3g}, "
                "within its bound: the sign is decided by noise, and the interval is one-sided",
                **given,
            )
        if beyond <= NOISE_EXPLAINS:
            return said(
                "{name} is held at its {side} bound {value:.4g}{unit}; unconstrained, the data give {free:.3g}, "
                "{beyond:.1f} standard deviations beyond it, so its interval is one-sided",
                beyond=float(beyond),
                **given,
            )
        return said(
            "{name} is held at its {side} bound {value:.4g}{unit}; unconstrained, the data give {free:.3g}, which "
            "noise cannot explain: another effect may be missing, and no interval is stated for it",
            **given,
        )


def bounds_reached(
    problem: CalibrationProblem, found: _core.Identification, limits: dict[str, Any]
) -> dict[int, tuple[Side, float]]:
    """The side and the estimate without bounds [SI] of each parameter that is on a bound, by its index in theta.

    `limits` are all that the fit had as options of `problem.identify`: bounds, priors and pulls.
    """
    if "lower" not in limits:
        return {}
    theta = np.asarray(found.theta)
    sides: dict[int, Side] = {i: "lower" for i in found.free if theta[i] == limits["lower"][i]}
    sides |= {i: "upper" for i in found.free if theta[i] == limits["upper"][i]}
    if not sides:
        return {}
    near = problem.linearize(theta, found.common_noise)
    root = np.sqrt(np.asarray(found.weights))[np.asarray(near.row)]
    scale = np.sqrt(np.diag(np.asarray(found.covariance)))
    J, r = np.asarray(near.J)[:, found.free] * root[:, np.newaxis] * scale, np.asarray(near.r) * root
    for kind in ("prior", "pull"):
        if f"{kind}_sigma" not in limits:
            continue
        sigma, mean = limits[f"{kind}_sigma"][found.free], limits[f"{kind}_mean"][found.free]
        J = np.vstack([J, np.diag(scale / sigma)])
        r = np.append(r, (theta[found.free] - mean) / sigma)
    step = scale * np.linalg.lstsq(J, -r, rcond=None)[0]
    place = {i: k for k, i in enumerate(found.free)}
    return {i: (side, float(theta[i] + step[place[i]])) for i, side in sides.items()}
