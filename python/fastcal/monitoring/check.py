# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a calibrated model still hold? A few poses, the instrument set up anew."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.inspection import BAD_SHARE, check_columns
from fastcal.display import late
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring import next_poses, words
from fastcal.monitoring.evidence import Evidence
from fastcal.monitoring.hypotheses import ODDS, Changing, Hypothesis, extended, hypotheses, row_hypotheses
from fastcal.monitoring.linear import LinearRows, as_known, linear_rows, record_of
from fastcal.monitoring.result import Cause, Change, CheckResult, NextPose, Test
from fastcal.monitoring.setups import SetUp, bare_arm, distances, set_ups
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.made_by import made_by
from fastcal.robot.robot import Robot
from fastcal.units import factor, from_si

FloatArray = NDArray[np.float64]

LEVEL = 0.003  # chance that an unchanged arm is called changed
FEWEST_DEGREES = 6  # of freedom: with fewer a change hides in the base, four points have six
MOST_CAUSES = 3
RIVAL = 0.02  # odds against the likeliest cause above which another may be it
ANOTHER = 0.02  # odds of a second event beside the first
GUARD = 2.0  # standard deviations of a coordinate beside the tolerance within which nothing is decided


@dataclass(frozen=True, eq=False)
class Setting:
    """The linear problem of a check and all that may have happened."""

    arm: Robot
    extended_arm: Robot
    rows: LinearRows
    possible: list[Hypothesis]
    evidence: Evidence


def check(
    model: RobotLike,
    *data: DataLike,
    tolerance: float | None = None,
    as_read: bool = False,
    who: Mapping[str, str | None] | None = None,
    threads: int = 1,
) -> CheckResult:
    """Holds a calibrated model against a few new poses; the base of each set-up of the instrument is fitted anew.

    Args:
        model: A calibrated robot, which keeps its covariance: model.yaml.
        data: Measured poses, five to ten; several files are several set-ups.
        tolerance: Largest distance [m] of a point from the model that is accepted.
        as_read: Take the columns as they are, though another reading fits far better.
        who: What check.json shall keep: serial, instrument, operator, date (YYYY-MM-DD).
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: The model keeps no covariance, or the data are of another robot.
        Undetermined: Too few points to fix a base.
    """
    if not data:
        raise InvalidInput("expected the model and then at least one set of measured poses")
    robot = as_robot(model)
    if tolerance is not None and not (np.isfinite(tolerance) and tolerance > 0):
        raise InvalidInput(f"tolerance must be above 0, got {tolerance}")
    measured = joined(data, robot)
    setting, places, notes = prepared(robot, measured, as_read=as_read, threads=threads)
    error = distances(places)
    rms, largest = float(np.sqrt(np.nanmean(error**2))), float(np.nanmax(error))
    rows, evidence = setting.rows, setting.evidence
    p_value = min(1.0, 2 * min(evidence.p_value, evidence.smallest_p))
    sigma = float(np.sqrt(np.mean(rows.sigma[rows.is_point] ** 2)))
    causes, rivals = ([], []) if p_value >= LEVEL else explained(setting)
    enough = evidence.degrees >= FEWEST_DEGREES
    verdict = _verdict(p_value, causes, enough)
    within = None
    if tolerance is not None:
        within = _within(largest, tolerance, sigma)
        if verdict == "holds" and within is None:
            verdict = "cannot_tell"
    return CheckResult(
        verdict=verdict,
        sentence=words.sentence(verdict, causes, within, tolerance, largest, enough),
        reasons=words.reasons(rms, rows.expected_rms, p_value, evidence.degrees, places, causes),
        model=robot,
        data=measured,
        places=places,
        rms=rms,
        expected_rms=rows.expected_rms,
        largest=largest,
        p_value=p_value,
        misfit_p_value=evidence.p_value,
        tolerance=tolerance,
        within_tolerance=within,
        degrees_of_freedom=evidence.degrees,
        sigma=sigma,
        causes=causes,
        tests=_tests(setting),
        blind=[h.label for h, t in zip(setting.possible, evidence.tests, strict=True) if t.rank == 0 and h.odds >= 1],
        next_poses=_next(setting, measured, verdict, causes, rivals, sigma, enough),
        notes=notes,
        made_by=made_by(robot, measured, who),
    )


def joined(data: Sequence[DataLike], robot: Robot) -> Dataset:
    """One data set; several are stations of their own."""
    if len(data) == 1:
        return as_data(data[0], robot)
    if all(not isinstance(each, Dataset) for each in data):
        read: Dataset = late.call("load_measurements", list(data), robot)
        return read
    sets = [as_data(each, robot) for each in data]
    return Dataset.concatenate(sets, labels=[f"{i + 1}" for i in range(len(sets))])


def prepared(robot: Robot, measured: Dataset, *, as_read: bool, threads: int) -> tuple[Setting, list[SetUp], list[str]]:
    """The linear problem, the set-ups and notes."""
    record = record_of(robot)
    notes = [*measured.notes, *check_columns(robot, measured, as_read=as_read)]
    arm, said = bare_arm(robot, measured)
    known, left_out = as_known(measured, record)
    more, added = extended(arm, {"approach"} if measured.approach is not None else set())
    places = set_ups(more, known, threads=threads)
    refuse_other_robot(robot, measured, places, as_read)
    rows = linear_rows(places, record, threads=threads)
    turned = known.rotation is not None
    possible = [*hypotheses(arm, more, added, turned), *row_hypotheses(rows.row, rows.is_point)]
    columns = [h.columns(rows.J, rows.row, rows.sigma) for h in possible]
    evidence = Evidence(
        rows.whitened(rows.r),
        rows.whitened(rows.B),
        [rows.whitened(c) for c in columns],
        [h.sizes for h in possible],
        rows.freedom,
    )
    return Setting(arm, more, rows, possible, evidence), places, [*notes, *said, *left_out]


def refuse_other_robot(robot: Robot, data: Dataset, places: list[SetUp], as_read: bool) -> None:
    """Refuses points that no arm of this kind reaches: half of them are farther off than a part of the reach."""
    median = float(np.nanmedian(distances(places)))
    if median > BAD_SHARE * robot.reach and not as_read:
        miss, reach = (f"{from_si(length, 'mm'):.4g} mm" for length in (median, robot.reach))
        raise InvalidInput(
            f"{data.source}: the points do not fit {robot.name}: with the best base the model misses half of them by "
            f"more than {miss}, with a reach of {reach}; is it the model of this robot?"
        )


def explained(setting: Setting) -> tuple[list[Cause], list[list[int]]]:
    """The likeliest causes, one after the other while something remains, and each one's rivals (itself first).

    Grown noise explains any misfit, so it is held against the whole set and not against its first member.
    """
    noise, evidence = len(setting.possible), setting.evidence
    chosen: list[int] = []
    rivals: list[list[int]] = []
    probability: list[float] = []
    while len(chosen) < MOST_CAUSES:
        shares = _shares(setting, evidence, chosen)
        best = int(np.argmax(shares))
        rivals.append([i for i in np.argsort(-shares, kind="stable").tolist() if shares[i] >= RIVAL * shares[best]])
        probability.append(float(shares[best]))
        chosen.append(best)
        evidence = setting.evidence.given(chosen)
        if evidence.degrees < 1 or min(evidence.p_value, evidence.smallest_p) * 2 >= LEVEL:
            break
    prior = sum(np.log(setting.possible[i].odds) for i in chosen) + (len(chosen) - 1) * np.log(ANOTHER)
    quiet = setting.evidence.noise_odds[0] + np.log(ODDS["noise"]) - setting.evidence.odds_of(chosen) - prior
    if quiet > 0:
        return [_cause(setting, [noise], 0, float(1 / (1 + np.exp(-quiet))), [])], [[noise]]
    if quiet > np.log(RIVAL):
        rivals[0].append(noise)
    causes = [
        _cause(setting, chosen, k, probability[k], [i for i in rivals[k] if i != each]) for k, each in enumerate(chosen)
    ]
    return causes, rivals


def _shares(setting: Setting, evidence: Evidence, chosen: list[int]) -> FloatArray:
    """(h,) probabilities of the hypotheses beside those that are chosen, given that one of them happened."""
    logs = np.array(
        [
            t.odds + np.log(h.odds) if t.rank > 0 and h.allows(t.value, t.std) else -np.inf
            for h, t in zip(setting.possible, evidence.tests, strict=True)
        ]
    )
    logs[chosen] = -np.inf
    return np.asarray(np.exp(logs - np.max(logs)) / np.sum(np.exp(logs - np.max(logs))))


def _cause(setting: Setting, chosen: list[int], k: int, probability: float, others: list[int]) -> Cause:
    """The k-th cause, its numbers estimated beside the other causes."""
    labels = tuple(_label(setting, i) for i in others)
    index = chosen[k]
    rest = setting.evidence.given([i for i in chosen if i not in (index, len(setting.possible))])
    if index == len(setting.possible):
        sigma = from_si(float(np.sqrt(np.mean(setting.rows.sigma[setting.rows.is_point] ** 2))), "mm")
        grown = rest.noise_odds[1]
        std = grown * sigma / np.sqrt(2 * max(rest.degrees, 1))
        change = Change("sigma_mm", "instrument", grown * sigma, std, "mm", sigma, rest.p_value)
        return Cause("noise", "noise", probability, labels, (change,))
    h, t = setting.possible[index], rest.tests[index]
    p = setting.evidence.adjusted(t.p_value)
    changes = tuple(
        _change(number, value, std, p) for number, value, std in zip(h.numbers, t.value, t.std, strict=True)
    )
    return Cause(h.kind, h.label, probability, labels, changes)


def _change(number: Changing, value: float, std: float, p: float) -> Change:
    f = factor(number.unit)
    return Change(number.name, number.owner, number.was + value / f, std / f, number.unit, number.was, p)


def _label(setting: Setting, index: int) -> str:
    return "noise" if index == len(setting.possible) else setting.possible[index].label


def _verdict(p_value: float, causes: list[Cause], enough: bool) -> str:
    if not enough:
        return "cannot_tell"
    if p_value >= LEVEL:
        return "holds"
    if all(cause.kind == "row" for cause in causes):
        return "cannot_tell"
    return "changed"


def _within(largest: float, tolerance: float, sigma: float) -> bool | None:
    """Is the largest distance below the tolerance, beyond doubt of its own noise (guard bands as in ISO 14253-1)?"""
    if largest <= tolerance - GUARD * sigma:
        return True
    return False if largest > tolerance + GUARD * sigma else None


def _tests(setting: Setting) -> list[Test]:
    """Every single number that was looked for and shows; rows are left out."""
    out = []
    limit = 0.5 * LEVEL / setting.evidence.effective_tests
    noise_only = _noise_only(setting)
    for h, t, quiet in zip(setting.possible, setting.evidence.tests, noise_only, strict=True):
        if h.kind == "row" or t.rank == 0:
            continue
        for k, number in enumerate(h.numbers):
            if not np.isfinite(t.std[k]):
                continue
            f = factor(number.unit)
            value, std = float(t.value[k]) / f, float(t.std[k]) / f
            out.append(
                Test(
                    h.kind, number.name, number.owner, value, std, float(quiet[k]) / f, number.unit, t.p_value,
                    _needed(limit) * std,
                )
            )  # fmt: skip
    return out


def _noise_only(setting: Setting) -> list[FloatArray]:
    """Standard deviations (d,) of each estimate that come from the new rows alone, SI.

    An estimate is a linear function of the whitened rows, value = W r; the noise's part of V = 1 + M M^T is L^-1.
    """
    L = setting.rows.root
    own = setting.rows.whitened(np.eye(len(L)))  # L^-1: what noise of 1 makes of the whitened rows
    out = []
    for h, t, K in zip(setting.possible, setting.evidence.tests, setting.evidence.K, strict=True):
        if h.kind == "row" or t.rank == 0:
            out.append(np.full(len(h.sizes), np.inf))
            continue
        W = h.sizes[:, None] * np.linalg.pinv(t.basis.T @ (K * h.sizes), rcond=1e-10) @ t.basis.T
        out.append(np.linalg.norm(W @ own, axis=1))
    return out


def _needed(level: float) -> float:
    """Standard deviations that a change must have to be shown four times in five by a test at a two-sided level."""
    from scipy import special

    return float(special.ndtri(1 - level / 2) + special.ndtri(0.8))


def _next(
    setting: Setting,
    data: Dataset,
    verdict: str,
    causes: list[Cause],
    rivals: list[list[int]],
    sigma: float,
    enough: bool,
) -> list[NextPose]:
    record = record_of(setting.arm)
    if verdict == "changed":
        for group in rivals:
            pairs = [
                (setting.possible[i], setting.evidence.tests[i].value)
                for i in group
                if i < len(setting.possible) and setting.possible[i].directions is not None
            ][:4]
            if len(pairs) > 1:
                return next_poses.separating(setting.extended_arm, record, setting.rows, data, pairs, sigma)
        return []
    if verdict == "cannot_tell" and causes:
        wrong = [setting.possible[group[0]].row for group in rivals if group[0] < len(setting.possible)]
        return next_poses.repeated(setting.arm, data, [row for row in wrong if row is not None])
    if verdict == "cannot_tell" and not enough:
        watched = [h for h in setting.possible if h.kind in ("zero", "tool", "effect")]
        poses = next_poses.informative(
            setting.extended_arm, record, data, watched, setting.rows.R, sigma, next_poses.MOST
        )
        return next_poses.as_poses(setting.arm, poses)
    return []
