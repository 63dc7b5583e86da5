# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a model is used for, in lines: predictions, inverse kinematics, commands, designs, paths."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.prediction import Prediction
from fastcal.compensation import Compensation, PathAccuracy
from fastcal.design.result import PoseDesign
from fastcal.ik.inverse_kinematics import InverseKinematics
from fastcal.measurements.targets import Targets
from fastcal.report.formatting import plural
from fastcal.report.language import _ as translated
from fastcal.report.language import decimal_sign
from fastcal.report.summaries import headline, summary
from fastcal.units import from_si

FloatArray = NDArray[np.float64]


def _rms_mm(values: FloatArray) -> float | None:
    """Root of the mean square [mm] of what is known; None where nothing is."""
    known = values[np.isfinite(values)]
    return float(from_si(float(np.sqrt(np.mean(known**2))), "mm")) if known.size else None


def _counts(status: NDArray[np.str_]) -> str:
    found = status.tolist()
    return ", ".join(f"{found.count(kind)} {kind.replace('_', ' ')}" for kind in dict.fromkeys(found))


@headline.register
def _(found: Prediction) -> str:
    sigma = _rms_mm(found.sigma_position)
    return plural(len(found.position), "pose") + ("" if sigma is None else f", standard deviation {sigma:.3g} mm")


@summary.register
def _(found: Prediction) -> list[str]:
    return [headline(found), *found.notes]


@headline.register
def _(found: InverseKinematics) -> str:
    return f"{plural(len(found), 'target')}: {_counts(found.status)}"


@summary.register
def _(found: InverseKinematics) -> list[str]:
    missed = np.flatnonzero(~found.reached)
    lines = [f"row {row}: {found.message(int(row))}" for row in missed[:5]]
    return [headline(found), *lines, *([f"and {plural(len(missed) - 5, 'row')} more"] if len(missed) > 5 else [])]


@headline.register
def _(found: Compensation) -> str:
    return f"{plural(len(found), 'target')}: {_counts(found.status)}"


@summary.register
def _(found: Compensation) -> list[str]:
    lines = [headline(found)]
    if found.reached.any():
        left = from_si(float(np.max(found.position_error[found.reached])), "mm")
        sigma = found.sigma[found.reached]
        known = np.isfinite(sigma).all()
        spread = f"; its standard deviation {from_si(float(sigma.max()), 'mm'):.3g} mm per coordinate" if known else ""
        lines.append(f"predicted error of the reached ones: at most {left:.3g} mm{spread}")
    return [*lines, *found.notes]


@headline.register
def _(found: PoseDesign) -> str:
    sigma = from_si(found.sigma, "mm")
    return f"{plural(len(found), 'pose')} of {found.candidate_count} candidates, {found.criterion}, {sigma:.3g} mm"


@summary.register
def _(found: PoseDesign) -> list[str]:
    refused = "".join(f"; {number} {translated(reason)}" for reason, number in found.rejected.items())
    poses = plural(len(found), "pose")
    lines = [translated("{poses} of {count} candidates", poses=poses, count=found.candidate_count) + refused]
    touches = Counter(label for label in found.plane or [] if label)
    if touches:
        of = (translated("{count} of plane {label}", count=n, label=label) for label, n in sorted(touches.items()))
        lines.append(translated("touches: {planes}", planes=", ".join(of)))
    sigma = float(from_si(found.sigma, "mm"))
    lines.append(
        translated("predicted standard deviation of a coordinate: {sigma:.4g} mm, RMS over the targets", sigma=sigma)
    )
    sizes = (f"{name} {value:.4g}".replace(".", decimal_sign()) for name, value in found.observability.items())
    lines.append(("; " if decimal_sign() == "," else ", ").join(sizes))
    if found.efficiency is not None:
        lines.append(
            translated(
                "{criterion}: at least {share:.1f} % of the best that any choice of as many candidates can reach",
                criterion=found.criterion,
                share=100.0 * float(found.efficiency),
            )
        )
    return lines


@headline.register
def _(found: PathAccuracy) -> str:
    before, after = (from_si(float(size.max()), "mm") for size in (found.before, found.after))
    sizes = f"{before:.3g} mm without, {after:.3g} mm with compensation"
    return f"{plural(len(found.points), 'target')}, largest error {sizes}"


@summary.register
def _(found: PathAccuracy) -> list[str]:
    lines = [headline(found)]
    for name, size, off in (
        ("without compensation", found.before, found.off_before),
        ("with compensation", found.after, found.off_after),
    ):
        mean, most, aside = (from_si(float(value), "mm") for value in (size.mean(), size.max(), off.max()))
        sizes = f"mean {mean:.4f} mm, largest {most:.4f} mm, perpendicular to the path {aside:.4f} mm"
        lines.append(f"error on the path {name}: {sizes}")
    return lines


@headline.register
def _(targets: Targets) -> str:
    conditions = ", ".join(targets.conditions)
    return plural(len(targets), "pose") + (f" with {conditions}" if conditions else "")


@summary.register
def _(targets: Targets) -> list[str]:
    return [headline(targets), *targets.notes]
