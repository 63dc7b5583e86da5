# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Noise level and outliers relative to a rich model, so that no missing effect is mistaken for either."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import special

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.repeatability import visit_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.decorrelation import joint_share, points_without_joint_noise
from fastcal.diagnosis.fit_algebra import columns_of
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.joint_repeats import with_joint_noise
from fastcal.diagnosis.memory import memory, shared
from fastcal.diagnosis.noise_scales import others_note, rms_sigma, with_others_kept
from fastcal.diagnosis.postures import likeliest_repeatability
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.rich_model import RichModel
from fastcal.diagnosis.robust_rows import RichFit, studentized_residuals
from fastcal.diagnosis.slow_motion import SlowMotion, SlowMotions, slow_motions
from fastcal.measurements.dataset import Dataset
from fastcal.said import said
from fastcal.units import from_si

# Rows, one measured after the other, that are no outliers if all of them are off: of 5 % outliers so many come in a row
# in one of a thousand sets.
OUTLIER_RUN = 4
# Rows of one command are repeats of each other if their temperatures agree within [K].
REPEAT_TEMPERATURE = 0.5
# Share of the square of what rows are off by that their mean makes, from which on they lie off together: where they
# scatter it is one over their number.
TOGETHER = 0.5
# Degrees of freedom from which on repeats determine the noise (sigma within 13 %).
MIN_REPEAT_FREEDOM = 30


@dataclass(frozen=True, eq=False)
class NoiseLevel:
    """What is known of the noise.

    Attributes:
        noise: As the fits use it.
        sigma: Of a measured coordinate or length, RMS over the rows [m].
        source: repeats, column, option or residual.
        note: A sentence for a person.
        moved: Rows that lie off together, between others that do not, as if base or target had been knocked.
        slow: What moves in time, and is none of it.
        joints: The part of sigma that is of joints which repeat badly [m].
    """

    noise: Noise
    sigma: float
    source: str
    note: str
    moved: tuple[int, ...] = ()
    slow: SlowMotions = field(default_factory=lambda: SlowMotions([], 0.0))
    joints: float = 0.0

    @property
    def instrument(self) -> float:
        """Sigma without the joints' part."""
        return float(np.sqrt(max(self.sigma**2 - self.joints**2, 0.0)))

    def calmer(self, noise: Noise) -> NoiseLevel:
        """With the noise that curves of the joints leave, where that is less than the richest model left."""
        if noise.factor >= self.noise.factor:
            return self
        by = noise.factor / self.noise.factor
        note = said("estimated after fitting joint curves; without them: {note}", note=self.note)
        return replace(self, noise=noise, sigma=self.sigma * by, source="residual", note=note, joints=self.joints * by)


def with_estimated_noise(problem: Problem, at: Fit, option: float | None) -> tuple[Problem, NoiseLevel]:
    """The problem with the noise that a rich model leaves at a fit, and without the rows that it can't reach.

    Where the rows claim too little, a variance common to all is added, and the sum scaled to what the rich fit leaves.
    """
    every = problem.with_rows(problem.data.measured)
    near = at if at.problem is problem else fit(problem.with_rows(at.problem.used), at.added, at)
    beside = RichModel.of(near.on_every_row).without_gross.by_kind
    at_rest = beside.at_rest
    slow = slow_motions(beside.fit, at_rest, beside.left.wrong, beside.offered.frames)
    rho = slow.rho
    if slow.found:
        beside = beside.with_motions(slow.found)
    visits = repeats(problem.data)
    beside = with_joint_noise(beside, of_stays=visits is None or visits[1] < MIN_REPEAT_FREEDOM)
    _A, r, row = beside.fit.whitened
    if rho > 0 and beside.columns is not at_rest:
        rho = memory(every, beside.columns, r, row, beside.left.wrong)
    alike = shared(every, beside.columns, r, row, beside.left.wrong)
    if rho > 0 or alike > 0:
        beside = beside.again(replace(beside.noise, memory=rho, shared=alike))
    known = _from_repeats(beside.problem, beside.left, problem.data, option)
    if known is None and problem.data.sigma_position is not None and _agreement(beside.left) > 0:
        more = rms_sigma(beside.problem) * np.sqrt(max(beside.left.mean_square - 1.0, 0.0))
        position, turn, length = beside.noise.common
        common = (float(np.hypot(position, more)), turn, float(np.hypot(length, more)))
        beside = beside.again(replace(beside.noise, common=common)).by_kind
    level = known or noise_level(beside.problem, beside.left, problem.data, option)
    level = replace(level, slow=slow, moved=tuple(map(int, moved_together(slow.found, problem.data))))
    found = replace(beside.problem, noise=with_others_kept(level.noise, beside.problem, beside.left.mean_square))
    used = every.used.copy()
    used[every.rows[left_out(beside.left.wrong, beside.left.gross, every.kept)]] = False
    others = others_note(found)
    note = f"{level.note}; {others}" if others else level.note
    joints = joint_share(found)
    sigma = float(np.hypot(level.sigma, joints))
    return replace(found, used=used), replace(level, noise=found.noise, note=note, sigma=sigma, joints=joints)


def with_joints_of_pictures(level: NoiseLevel, at: Fit) -> NoiseLevel:
    """The noise of corners with what joints that repeat badly add to it, as a fit that is written leaves it.

    While causes are looked for, they may hide in what the joints' noise is taken to be (`found.of_corners`).
    """
    as_seen = at.problem if at.problem.repeatability is None else replace(at.problem, repeatability=0.0)
    pictures = as_seen.pictures
    if pictures is None:
        return level
    near = as_seen.linearized(at.model, at.samples, at.theta)
    r, J = near.r / level.noise.factor, columns_of(near, at.free) / level.noise.factor
    freedom = max(len(r) - len(at.free), 1)
    if float(r @ r) <= float(special.chdtri(freedom, rules.ALPHA_NOISE)):  # noise of pixels leaves as much
        return level
    k = likeliest_repeatability(pictures, r, J, freedom)
    joints = level.sigma * pictures.joint_share(k)
    noise = replace(level.noise, repeatability=k * level.sigma / level.noise.factor)
    return replace(level, noise=noise, sigma=float(np.hypot(level.sigma, joints)), joints=joints)


def left_out(wrong: IndexArray, gross: IndexArray, data: Dataset) -> IndexArray:
    """Rows that no fit should hold: those of `wrong` that stand alone, and `gross` ones but for those of a posture."""
    return np.union1d(isolated_rows(wrong, data), sharing_no_posture(gross, data))


def sharing_no_posture(gross: IndexArray, data: Dataset) -> IndexArray:
    """Those of the rows `gross` that no effect explains, wherever they stand: they would bend everything else.

    Rows that share a posture though they were measured at different times may lie on a bump that the rich model has no
    curve for.
    """
    shared = shared_posture(gross, data)
    return gross if shared is None else np.setdiff1d(gross, shared[1])


def shared_posture(wrong: IndexArray, data: Dataset) -> tuple[int, IndexArray] | None:
    """The joint of whose way rows among `wrong` share a small part, by more than chance, and these rows; or None.

    Rows of a run share one wherever successive poses are near: they do not count.
    """
    runs = _runs(wrong, data)
    alone = wrong[~np.isin(wrong, np.concatenate(runs))] if runs else wrong
    joint = _joint_of_shared_range(alone, data.q)
    return None if joint is None else (joint, alone)


def isolated_rows(wrong: IndexArray, data: Dataset) -> IndexArray:
    """Those of the rows `wrong` that do not stand in a run of OUTLIER_RUN or more, one measured after the other.

    Where every row of a stretch of time is off, something moved: that is an effect and no outliers. Nor are there any
    where all of them share a posture.
    """
    if _joint_of_shared_range(wrong, data.q) is not None:
        return wrong[:0]
    moved = _runs(wrong, data)
    return wrong[~np.isin(wrong, np.concatenate(moved))] if moved else wrong


def row_run_notes(data: Dataset, outliers: Sequence[int], error: FloatArray) -> list[str]:
    """A sentence for outliers that share a posture and for each run of them in time: chance makes neither.

    `error` (N, 3) is what the model leaves of their points [m], NaN where none was measured.
    """
    at = np.flatnonzero(data.measured)
    wrong = np.flatnonzero(np.isin(at, outliers))
    found = _runs(wrong, data.select(at))
    rows = [np.intersect1d(at[run], outliers) for run in found]
    shared = shared_posture(wrong, data.select(at))
    told = [] if shared is None else [_shared_note(shared[0], at[shared[1]])]
    return told + [
        f"rows {own[0]} to {own[-1]} were measured one after the other and {_how_far(error[own])} ({len(own)} of "
        "them): no cause that was tested explains them, and they are left out of the fits; check what happened there"
        for own in rows
    ]


def _shared_note(joint: int, rows: IndexArray) -> str:
    return (
        f"rows {', '.join(map(str, rows))} are far off and lie within a small part of the range of joint {joint + 1}, "
        "which is unlikely for outliers: there is an error there, but too few poses to say more"
    )


def _how_far(error: FloatArray) -> str:
    """What is wrong with rows whose points are off by `error` (n, 3) [m]."""
    known = error[~np.isnan(error).any(axis=1)]
    if len(known) == 0:
        return "are far off"
    mean = known.mean(axis=0)
    if float(mean @ mean) < TOGETHER * float(np.mean(np.sum(known**2, axis=1))):
        return "are far off"
    shift = from_si(float(np.linalg.norm(mean)), "mm")
    return f"are all off by about the same {shift:.2g} mm, as if something had been moved and put back"


def moved_together(slow: Sequence[SlowMotion], data: Dataset) -> IndexArray:
    """Rows of the blocks among the motions, where nothing but when they were measured sets them apart.

    What a posture, a payload or a direction of approach sets apart may be an effect.
    """
    conditions = [data.payload, data.approach, *data.sensors.values()]
    labels = [np.unique(own, return_inverse=True)[1] for own in (data.station, data.mount) if own is not None]
    apart = np.column_stack([data.q, *(c for c in conditions if c is not None), *labels])
    blocks = [motion.block for motion in slow if _joint_of_shared_range(motion.block, apart) is None]
    return np.concatenate([np.zeros(0, dtype=np.intp), *blocks])


def _runs(wrong: IndexArray, data: Dataset) -> list[IndexArray]:
    """Runs with OUTLIER_RUN of the rows `wrong` and more without a gap; a run goes on over single rows that fit."""
    order = np.argsort(data.time, kind="stable") if data.time is not None else np.arange(len(data))
    is_wrong = np.isin(order, wrong)
    padded = np.r_[False, is_wrong, False]
    bridged = is_wrong | (padded[:-2] & padded[2:])
    ends = np.flatnonzero(np.diff(np.r_[False, bridged, False].astype(int)))
    runs = [slice(a, b) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    return [order[run] for run in runs if OUTLIER_RUN in np.convolve(is_wrong[run], np.ones(OUTLIER_RUN))]


def _joint_of_shared_range(wrong: IndexArray, q: FloatArray) -> int | None:
    """The joint where OUTLIER_RUN rows or more lie within so small a part of its way as in one of a thousand by chance.

    k rows drawn from N lie in a window that holds a share f of them with a chance of k f^(k - 1) at most.
    """
    k = len(wrong)
    if k < OUTLIER_RUN:
        return None
    low, high = q[wrong].min(axis=0), q[wrong].max(axis=0)
    share = np.mean((q >= low) & (q <= high), axis=0)
    joint = int(np.argmin(share))
    return joint if q.shape[1] * k * share[joint] ** (k - 1) < rules.ALPHA_POSTURE else None


def _agreement(rich: RichFit) -> int:
    """0 where noise 1 is borne out, 1 where more remains, -1 where less."""
    low, high = (
        float(special.chdtri(rich.freedom, p)) / rich.freedom
        for p in (1 - rules.ALPHA_NOISE / 2, rules.ALPHA_NOISE / 2)
    )
    return int(rich.mean_square > high) - int(rich.mean_square < low)


def noise_level(problem: Problem, rich: RichFit, data: Dataset, option: float | None) -> NoiseLevel:
    """The noise to test with where no repeats show it: a claim that the rich fit bears out, else what this leaves.

    Args:
        problem: Whose noise `rich` was whitened with.
        rich: What the rich model leaves.
        data: All rows.
        option: Claimed by the user [m].
    """
    own = rms_sigma(problem)
    ratio = rich.mean_square
    added = data.sigma_position is not None and max(problem.noise.common[0], problem.noise.common[2]) > 0
    claimed = data.sigma_position is not None or option is not None
    source = "option" if option is not None else "column"
    if claimed and not added and _agreement(rich) == 0:
        return NoiseLevel(
            replace(problem.noise, freedom=np.inf),
            own,
            source,
            said("as stated, and the residuals of the richest model agree"),
        )
    factor = problem.noise.factor * float(np.sqrt(ratio))
    noise = replace(problem.noise, factor=factor, freedom=rich.freedom)
    sigma = own * float(np.sqrt(ratio))
    if added:
        part = from_si(problem.noise.common[0], "mm")
        note = said(
            "the stated sigma of each row and {size:.4f} mm common to all, from the residuals of the richest model",
            size=float(part),
        )
        return NoiseLevel(noise, sigma, "residual", note)
    if claimed:
        note = said(
            "the residuals of the richest model; {source} states {size:.4f} mm, which is {judged}",
            source=said("a column") if option is None else said("an option"),
            size=float(from_si(own, "mm")),
            judged=said("too small") if ratio > 1 else said("too large"),
        )
        return NoiseLevel(noise, sigma, "residual", note)
    note = said("estimated from the residuals of the richest model; no sigma column, no repeated poses")
    return NoiseLevel(noise, sigma, "residual", note)


def _from_repeats(problem: Problem, rich: RichFit, data: Dataset, option: float | None) -> NoiseLevel | None:
    """The pure error of repeated poses, whatever a model leaves above it; None: too few repeats, or none.

    A claim that the repeats bear out (chi square, two-sided ALPHA_NOISE) is taken as it is; where the rich model leaves
    as much (F), both together; where it leaves less, something moved between the visits, and they are no repeats.
    """
    repeated = repeats(data, problem)
    if repeated is None or repeated[1] < MIN_REPEAT_FREEDOM:
        return None
    sigma, freedom = repeated
    own = rms_sigma(problem)
    against = sigma**2 / (own**2 * rich.mean_square)
    low, high = special.fdtri(freedom, rich.freedom, [rules.ALPHA_NOISE / 2, 1 - rules.ALPHA_NOISE / 2])
    if against > high:
        return None
    note = said("from {count:.0f} differences of repeated poses", count=float(freedom))
    if data.sigma_position is not None or option is not None:
        least, most = (
            float(special.chdtri(freedom, p)) / freedom for p in (1 - rules.ALPHA_NOISE / 2, rules.ALPHA_NOISE / 2)
        )
        if least <= sigma**2 / own**2 <= most:
            noise = replace(problem.noise, freedom=np.inf)
            source = "option" if option is not None else "column"
            agreed = said("as stated, and {count:.0f} differences of repeated poses agree", count=float(freedom))
            return NoiseLevel(noise, own, source, agreed)
    if against >= low:
        together = freedom + rich.freedom
        sigma = float(np.sqrt((freedom * sigma**2 + rich.freedom * own**2 * rich.mean_square) / together))
        freedom, note = together, said("{note} and the residuals of the richest model, which agree", note=note)
    noise = replace(problem.noise, factor=problem.noise.factor * sigma / own, freedom=freedom)
    return NoiseLevel(noise, sigma, "repeats", note)


def over_claim(level: NoiseLevel, data: Dataset, option: float | None) -> float:
    """The noise over what is claimed, 0 where nothing is; repeated poses are more than a claim."""
    if level.source == "repeats":
        return 0.0
    if option is not None:
        return level.instrument / option
    claimed = data.sigma_position
    return 0.0 if claimed is None else level.instrument / float(np.sqrt(np.nanmean(claimed**2)))


def repeats(data: Dataset, problem: Problem | None = None) -> tuple[float, float] | None:
    """Pure error of a coordinate [m] and its degrees of freedom, from rows with the same command; None: no repeats.

    Rows that differ in approach, temperature or station are no repeats of each other. Where the noise of a `problem`
    is also of joints that repeat badly, this error is without it.
    """
    if data.position is None:
        return None
    group = visit_groups(data)
    if data.temperature is not None:
        degrees = np.round(data.temperature / REPEAT_TEMPERATURE).astype(np.intp)
        group = np.unique(np.column_stack([group, degrees]), axis=0, return_inverse=True)[1].ravel()
    whole = ~np.isnan(data.position).any(axis=1)
    of_joints = problem is not None and problem.noise.repeatability > 0
    if problem is not None and of_joints and problem.noise.by_stay:  # rows of a stay share the joints' errors
        whole &= np.isin(np.arange(len(data)), np.unique(problem.stays, return_index=True)[1])
    away, freedom = np.zeros((len(data), 3)), 0.0
    for g in np.flatnonzero(np.bincount(group[whole]) > 1):
        own = whole & (group == g)
        away[own] = data.position[own] - data.position[own].mean(axis=0)
        freedom += 3 * (int(own.sum()) - 1)
    if problem is not None and of_joints:
        away = points_without_joint_noise(problem, away)
    squares = float(np.sum(away**2))
    return None if freedom == 0 or squares == 0 else (float(np.sqrt(squares / freedom)), freedom)


def out_of_reach(at: Fit) -> list[int]:
    """Rows that a fit can't reach: where noise alone makes one row so large in one of a hundred such sets."""
    whole = at.on_every_row
    every, (A, r, row) = whole.problem, whole.whitened
    wrong = np.flatnonzero(~np.isin(every.rows, at.problem.rows))
    square, count = studentized_residuals(A, r, row, wrong)
    limit = special.chdtri(np.maximum(count, 1), rules.ALPHA_OUTLIER / len(every.rows))
    return [int(every.rows[i]) for i in np.flatnonzero((count > 0) & (square > limit))]
