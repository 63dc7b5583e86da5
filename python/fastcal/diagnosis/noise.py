# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How large the noise is, and which rows are wrong: against a rich model, so that no missing effect passes for either.

The rich model is the fit with as many named and unnamed blocks as RICH_MODEL_SHARE allows. What it
leaves is noise, whatever is missing (Baarda 1968, with the alternatives themselves as the model).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from fastcal.calibration.columns import unit_columns
from fastcal.calibration.repeatability import visit_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.blocks import Blocks, blocks, columns_at
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.memory import memory
from fastcal.diagnosis.noise_scales import others_note, with_others_kept, with_own_scales
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.robust_rows import RichFit, without_outliers
from fastcal.measurements.dataset import Dataset
from fastcal.units import from_si

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class NoiseLevel:
    """What is known of the noise.

    Attributes:
        noise: As the fits use it.
        sigma: Of a measured coordinate or length, RMS over the rows [m].
        source: repeats, column, option or residual.
        note: A sentence for a person.
    """

    noise: Noise
    sigma: float
    source: str
    note: str

    def calmer(self, noise: Noise) -> NoiseLevel:
        """With the noise that curves of the joints leave, where that is less than the richest model left."""
        if noise.factor >= self.noise.factor:
            return self
        sigma = self.sigma * noise.factor / self.noise.factor
        return NoiseLevel(noise, sigma, "residual", f"what curves of the joints leave; without them: {self.note}")


def with_estimated_noise(problem: Problem, at: Fit, option: float | None) -> tuple[Problem, NoiseLevel]:
    """The problem with the noise that a rich model leaves at a fit, and without the rows that it can't reach.

    Where the rows claim too little, a variance common to all is added, and the sum scaled to what the rich fit leaves.
    """
    every = problem.with_rows(problem.data.measured)
    beside = RichModel.of(at if at.problem is every else fit(every, at.added, at)).by_kind
    _A, r, row = beside.fit.whitened
    rho = memory(every, beside.columns, r, row, beside.left.wrong)
    if rho > 0:
        beside = beside.again(replace(beside.noise, memory=rho))
    known = _from_repeats(beside.problem, beside.left, problem.data, option)
    if known is None and problem.data.sigma_position is not None and _agreement(beside.left) > 0:
        more = _rms_sigma(beside.problem, problem.data) * np.sqrt(max(beside.left.mean_square - 1.0, 0.0))
        position, turn, length = beside.noise.common
        common = (float(np.hypot(position, more)), turn, float(np.hypot(length, more)))
        beside = beside.again(replace(beside.noise, common=common)).by_kind
    level = known or noise_level(beside.problem, beside.left, problem.data, option)
    found = replace(beside.problem, noise=with_others_kept(level.noise, beside.problem, beside.left.mean_square))
    used = every.used.copy()
    used[every.rows[left_out(beside.left.wrong, beside.left.gross, every.kept)]] = False
    others = others_note(found)
    note = f"{level.note}; {others}" if others else level.note
    return replace(found, used=used), replace(level, noise=found.noise, note=note)


def left_out(wrong: IntArray, gross: IntArray, data: Dataset) -> IntArray:
    """Rows that no fit should hold: those of `wrong` that stand alone, and `gross` ones but for those of a posture."""
    return np.union1d(isolated_rows(wrong, data), of_no_posture(gross, data))


def of_no_posture(gross: IntArray, data: Dataset) -> IntArray:
    """Those of the rows `gross` that no effect explains, wherever they stand: they would bend everything else.

    Rows that share a posture though they were measured at different times may lie on a bump that the rich model has no
    curve for.
    """
    shared = shared_posture(gross, data)
    return gross if shared is None else np.setdiff1d(gross, shared[1])


def shared_posture(wrong: IntArray, data: Dataset) -> tuple[int, IntArray] | None:
    """The joint of whose way rows among `wrong` share a small part, by more than chance, and these rows; or None.

    Rows of a run share one wherever successive poses are near: they do not count.
    """
    runs = _runs(wrong, data)
    alone = wrong[~np.isin(wrong, np.concatenate(runs))] if runs else wrong
    joint = _posture(alone, data.q)
    return None if joint is None else (joint, alone)


def isolated_rows(wrong: IntArray, data: Dataset) -> IntArray:
    """Those of the rows `wrong` that do not stand in a run of OUTLIER_RUN or more, one measured after the other.

    Where every row of a stretch of time is off, something moved: that is an effect and no outliers. Nor are there any
    where all of them share a posture.
    """
    if _posture(wrong, data.q) is not None:
        return wrong[:0]
    moved = _runs(wrong, data)
    return wrong[~np.isin(wrong, np.concatenate(moved))] if moved else wrong


def row_run_notes(data: Dataset, outliers: Sequence[int]) -> list[str]:
    """A sentence for outliers that share a posture and for each run of them in time: chance makes neither."""
    at = np.flatnonzero(data.measured)
    found = _runs(np.flatnonzero(np.isin(at, outliers)), data.select(at))
    rows = [np.intersect1d(at[run], outliers) for run in found]
    shared = shared_posture(np.flatnonzero(np.isin(at, outliers)), data.select(at))
    told = [] if shared is None else [_shared_note(shared[0], at[shared[1]])]
    return told + [
        f"rows {own[0]} to {own[-1]} were measured one after the other and are far off ({len(own)} of them): nothing "
        "that was tried explains them, and no fit holds them; look at what happened there"
        for own in rows
    ]


def _shared_note(joint: int, rows: IntArray) -> str:
    return (
        f"rows {', '.join(map(str, rows))} are far off and share a small part of the way of joint {joint + 1}, which "
        "outliers do not: something is wrong there that too few poses show to say more"
    )


def _runs(wrong: IntArray, data: Dataset) -> list[IntArray]:
    """Runs with OUTLIER_RUN of the rows `wrong` and more without a gap; a run goes on over single rows that fit."""
    order = np.argsort(data.time, kind="stable") if data.time is not None else np.arange(len(data))
    is_wrong = np.isin(order, wrong)
    padded = np.r_[False, is_wrong, False]
    bridged = is_wrong | (padded[:-2] & padded[2:])
    ends = np.flatnonzero(np.diff(np.r_[False, bridged, False].astype(int)))
    runs = [slice(a, b) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    return [order[run] for run in runs if rules.OUTLIER_RUN in np.convolve(is_wrong[run], np.ones(rules.OUTLIER_RUN))]


def _posture(wrong: IntArray, q: FloatArray) -> int | None:
    """The joint where OUTLIER_RUN rows or more lie within so small a part of its way as in one of a thousand by chance.

    k rows drawn from N lie in a window that holds a share f of them with a chance of k f^(k - 1) at most.
    """
    k = len(wrong)
    if k < rules.OUTLIER_RUN:
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


@dataclass(frozen=True, eq=False)
class RichModel:
    """A fit, the unit columns (m, p) of the rich model beside it, and what this leaves."""

    fit: Fit
    columns: FloatArray
    left: RichFit

    @classmethod
    def of(cls, at: Fit, begun: IntArray | None = None) -> RichModel:
        """The rich model at a fit; `begun` as in `without_outliers`."""
        X = _rich_columns(at)
        _A, r, row = at.whitened
        return cls(at, X, without_outliers(X, r, row, begun))

    @property
    def problem(self) -> Problem:
        """Of the fit."""
        return self.fit.problem

    @property
    def noise(self) -> Noise:
        """That it is whitened with."""
        return self.problem.noise

    def again(self, noise: Noise) -> RichModel:
        """With other noise."""
        return RichModel.of(fit(self.problem.with_noise(noise), self.fit.added, self.fit), self.left.wrong)

    @property
    def by_kind(self) -> RichModel:
        """With a scale for each kind of observation that has noise of its own."""
        out = self
        for _ in range(rules.SCALE_ROUNDS):
            noise = with_own_scales(out.fit, out.left)
            if noise is out.noise:
                break
            out = out.again(noise)
        return out


def _rich_columns(at: Fit) -> FloatArray:
    """Unit columns of the parameters and as many blocks as RICH_MODEL_SHARE allows, those that are clear first."""
    known = columns_at(at)
    tested = blocks(at, known)
    A = at.whitened[0]
    ranks = np.asarray(tested.tests.scores.rank)
    budget = rules.RICH_MODEL_SHARE * at.freedom
    columns = [A]
    for index in dict.fromkeys([*_clear(tested), *_order(tested)]):
        if 0 < ranks[index] <= budget:
            columns.append(known.of(index))
            budget -= ranks[index]
    return unit_columns(np.hstack(columns))


def _clear(blocks: Blocks) -> list[int]:
    """Blocks in the order in which each explains most for its functions beyond those before it, while that is clear.

    They come first: a missing effect must not pass for noise because the model was full before its turn.
    """
    among = np.arange(len(blocks.sizes))
    added: list[int] = []
    while len(added) < rules.MAX_CLEAR_BLOCKS:
        left = blocks.tests.given(added)
        worth = blocks.worth(np.asarray(left.statistic), np.asarray(left.rank), among)
        best = int(np.argmax(worth))
        if worth[best] < rules.CLEAR_BLOCK_BIC:
            break
        added.append(best)
    return added


def _order(blocks: Blocks) -> list[int]:
    """Names without their variants, curves of one variable, then the rest."""
    seen: set[tuple[Any, ...]] = set()
    first: list[int] = []
    later: list[int] = []
    for i, name in enumerate(blocks.names):
        (later if name.cause in seen else first).append(i)
        seen.add(name.cause)
    single = [blocks.count + i for i, g in enumerate(blocks.generics) if len(g.curves.depends_on) != 2]
    pairs = [blocks.count + i for i, g in enumerate(blocks.generics) if len(g.curves.depends_on) == 2]
    return [*first, *single, *pairs, *later]


def noise_level(problem: Problem, rich: RichFit, data: Dataset, option: float | None) -> NoiseLevel:
    """The noise to test with where no repeats show it: a claim that the rich fit bears out, else what this leaves.

    Args:
        problem: Whose noise `rich` was whitened with.
        rich: What the rich model leaves.
        data: All rows.
        option: Claimed by the user [m].
    """
    own = _rms_sigma(problem, data)
    ratio = rich.mean_square
    added = data.sigma_position is not None and max(problem.noise.common[0], problem.noise.common[2]) > 0
    claimed = data.sigma_position is not None or option is not None
    source = "option" if option is not None else "column"
    if claimed and not added and _agreement(rich) == 0:
        return NoiseLevel(
            replace(problem.noise, freedom=np.inf), own, source, "as claimed, and what the richest model leaves agrees"
        )
    factor = problem.noise.factor * float(np.sqrt(ratio))
    noise = replace(problem.noise, factor=factor, freedom=rich.freedom)
    sigma = own * float(np.sqrt(ratio))
    if added:
        part = from_si(problem.noise.common[0], "mm")
        note = f"the rows' own claims and {part:.4f} mm common to all, which the richest model leaves beyond them"
        return NoiseLevel(noise, sigma, "residual", note)
    if claimed:
        word = "a column" if option is None else "an option"
        size = "too small" if ratio > 1 else "too large"
        note = f"what the richest model leaves; {word} claims {from_si(own, 'mm'):.4f} mm, which is {size}"
        return NoiseLevel(noise, sigma, "residual", note)
    return NoiseLevel(
        noise, sigma, "residual", "estimated from what the richest model leaves; no sigma column, no repeated poses"
    )


def _from_repeats(problem: Problem, rich: RichFit, data: Dataset, option: float | None) -> NoiseLevel | None:
    """The pure error of repeated poses, whatever a model leaves above it; None: too few repeats, or none.

    A claim that the repeats bear out (chi square, two-sided ALPHA_NOISE) is taken as it is; where the rich model leaves
    as much (F), both together; where it leaves less, something moved between the visits, and they are no repeats.
    """
    repeated = repeats(data)
    if repeated is None or repeated[1] < rules.MIN_REPEAT_FREEDOM:
        return None
    sigma, freedom = repeated
    own = _rms_sigma(problem, data)
    against = sigma**2 / (own**2 * rich.mean_square)
    low, high = special.fdtri(freedom, rich.freedom, [rules.ALPHA_NOISE / 2, 1 - rules.ALPHA_NOISE / 2])
    if against > high:
        return None
    note = f"from {freedom:.0f} differences of repeated poses"
    if data.sigma_position is not None or option is not None:
        least, most = (
            float(special.chdtri(freedom, p)) / freedom for p in (1 - rules.ALPHA_NOISE / 2, rules.ALPHA_NOISE / 2)
        )
        if least <= sigma**2 / own**2 <= most:
            noise = replace(problem.noise, freedom=np.inf)
            source = "option" if option is not None else "column"
            return NoiseLevel(noise, own, source, f"as claimed, and {freedom:.0f} differences of repeated poses agree")
    if against >= low:
        together = freedom + rich.freedom
        sigma = float(np.sqrt((freedom * sigma**2 + rich.freedom * own**2 * rich.mean_square) / together))
        freedom, note = together, f"{note} and what the richest model leaves, which agree"
    noise = replace(problem.noise, factor=problem.noise.factor * sigma / own, freedom=freedom)
    return NoiseLevel(noise, sigma, "repeats", note)


def over_claim(level: NoiseLevel, data: Dataset, option: float | None) -> float:
    """The noise over what is claimed, 0 where nothing is; repeated poses are more than a claim."""
    if level.source == "repeats":
        return 0.0
    if option is not None:
        return level.sigma / option
    return 0.0 if data.sigma_position is None else level.sigma / float(np.sqrt(np.nanmean(data.sigma_position**2)))


def _rms_sigma(problem: Problem, data: Dataset) -> float:
    """Of a coordinate (or a length), claims and common part together [m]."""
    common = problem.noise.common[0] if data.position is not None else problem.noise.common[2]
    square = common**2
    if data.sigma_position is not None:
        square += float(np.nanmean(data.sigma_position**2))
    return problem.noise.factor * float(np.sqrt(square))


def repeats(data: Dataset) -> tuple[float, float] | None:
    """Pure error of a coordinate [m] and its degrees of freedom, from rows with the same command; None: no repeats.

    Rows that differ in approach, temperature or station are no repeats of each other.
    """
    if data.position is None:
        return None
    group = visit_groups(data)
    if data.temperature is not None:
        degrees = np.round(data.temperature / rules.REPEAT_TEMPERATURE).astype(np.intp)
        group = np.unique(np.column_stack([group, degrees]), axis=0, return_inverse=True)[1].ravel()
    whole = ~np.isnan(data.position).any(axis=1)
    squares, freedom = 0.0, 0.0
    for g in np.flatnonzero(np.bincount(group[whole]) > 1):
        points = data.position[whole & (group == g)]
        squares += float(np.sum((points - points.mean(axis=0)) ** 2))
        freedom += 3 * (len(points) - 1)
    return None if freedom == 0 or squares == 0 else (float(np.sqrt(squares / freedom)), freedom)
