# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which constant of a closed loop differs from the robot file: the length of a rod, the place of a pin.

Every calibration identifies these constants, with all others of the geometry, so none of them is missing from a model.
What is asked is which one of them is off by more than machining leaves. Whitened rows at the file's geometry are

    y = F b + Z d + e,   e ~ N(0, 1),   d_k ~ N(0, s^2 size_k^2)

F the columns of base, tool, effects and observations, of which nothing is known, Z those of the joints and loops, size
their plausible errors (1 mm, 1 mrad) and s, how well this robot was built, found from the rows; 1 or less is as likely
as any, beyond it the density of ln s falls as s^-2. A cause adds w^2 size^2 to the variance of its own one to three
columns; by it the likelihood, without what F takes (REML, H. Patterson and R. Thompson 1971), rises at the best s and
w of each by

    gain = 2 (max l(s, w) - max l(s, 0)),

by chance about that of one variance more. Rods off by centimetres bend the rows: each hypothesis is looked at where
the geometry is likeliest with its s and w.

A place or direction of a joint is tried in the same way and named only as what else it may be: where it leads clearly,
nothing is. A rod and pins that are moved along it are told apart as far as the directions that the rod takes differ;
what is not is equivalent.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from fastcal import _core
from fastcal.arrays import thin_svd
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.reasons import Because, Reason
from fastcal.diagnosis.result import Finding, NamedValue
from fastcal.effects.entries import edge_name, edge_unit
from fastcal.effects.rig_traits import JOINT_PLACE, LOOP_GEAR, LOOP_LENGTH, LOOP_PIN, LOOP_TURN
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

_SPREADS = np.geomspace(1e-3, 30.0, 61)  # s over which the likelihood is looked at [plausible sizes]
_KNOWN = -4 * np.log(np.maximum(_SPREADS, 1.0))  # 2 log of what is believed of s: 1 or less, beyond it falls as s^-2
_WIDTHS = np.geomspace(0.05, 100.0, 41)  # w
_ROUNDING = 1e-9  # of the largest singular value
_ROUNDS, _SHORTER = 8, 6  # of linearizing; thirds of a step that makes nothing better
_NARROWEST = 0.05  # s of a step: without play no step moves
_LONGEST = 3.0  # of a step [plausible sizes]
_SETTLED = 0.5  # of the cost
_LOOKED_AT = 6  # causes whose own geometry is looked for, the best at that of all
_FITS = 1.5  # standard deviations that may be left of a number: beyond, rows and geometry do not belong together


class _Cause(NamedTuple):
    """One to three columns of the geometry that may be off together."""

    effect: str
    owner: str
    columns: list[int]  # of the free parameters


@dataclass(frozen=True)
class _Rows:
    """Rows without what the columns of unknown size take of them.

    Attributes:
        y: (k,) in the axes of the columns' singular vectors.
        Z: (k, K) columns over their plausible sizes.
    """

    y: FloatArray
    Z: FloatArray
    variance: FloatArray  # (k,) squares of the singular values

    @staticmethod
    def of(F: FloatArray, Z: FloatArray, y: FloatArray) -> _Rows:
        """Rows (m,) with columns F (m, f) of which nothing is known and Z (m, K)."""
        U, size, _ = thin_svd(F)
        U = U[:, size > _ROUNDING * max(size.max(initial=0.0), np.finfo(float).tiny)]
        Z, y = Z - U @ (U.T @ Z), y - U @ (U.T @ y)
        U, size, Vt = thin_svd(Z)
        kept = size > _ROUNDING * max(size.max(initial=0.0), np.finfo(float).tiny)
        return _Rows(U.T[kept] @ y, size[kept, np.newaxis] * Vt[kept], size[kept] ** 2)

    def likelihoods(self, columns: Sequence[int] = ()) -> FloatArray:
        """(S, W) 2 l over _SPREADS and _WIDTHS of these columns; (S, 1) without columns."""
        V = 1 + _SPREADS[:, np.newaxis] ** 2 * self.variance
        plain = np.asarray(_KNOWN - (np.log(V) + self.y**2 / V).sum(axis=1))[:, np.newaxis]
        if not columns:
            return plain
        G = self.Z[:, columns]
        inner = np.einsum("ki,sk,kj->sij", G, 1 / V, G)
        along = np.einsum("ki,sk->si", G, self.y / V)
        size, axes = np.linalg.eigh(inner)
        size, turned = size[:, np.newaxis, :], np.einsum("sij,si->sj", axes, along)[:, np.newaxis, :]
        w = _WIDTHS[np.newaxis, :, np.newaxis] ** 2
        return np.asarray(plain + (turned**2 * w / (1 + w * size) - np.log1p(w * size)).sum(axis=2))

    def spread(self) -> float:
        """How well this robot was built, s, without a cause [plausible sizes]."""
        return float(_SPREADS[np.argmax(self.likelihoods()[:, 0])])

    def gain(self, cause: _Cause) -> float:
        """Of one cause."""
        return float(self.likelihoods(cause.columns).max() - self.likelihoods().max())

    def best(self, columns: Sequence[int]) -> tuple[float, float]:
        """S and w at which these columns are likeliest to be off together."""
        at = self.likelihoods(columns)
        narrow, wide = np.unravel_index(int(at.argmax()), at.shape)
        return float(_SPREADS[narrow]), float(_WIDTHS[wide])

    def estimate(self, columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """The error of these columns and its standard deviation (p,) [plausible sizes], at the best s and w."""
        s, w = self.best(columns)
        G = self.Z[:, columns]
        over = G.T / (1 + s**2 * self.variance)
        C = np.linalg.inv(over @ G + np.eye(len(columns)) / w**2)  # of what w adds
        known = s**2 + w**2
        value = known * (over @ (self.y - G @ (C @ (over @ self.y))))
        seen = over @ G
        spread = known * np.eye(len(columns)) - known**2 * (seen - seen @ C @ seen)
        return np.asarray(value), np.sqrt(np.maximum(np.diag(spread), 0.0))


class _Place(NamedTuple):
    """A fit, and its rows at the geometry of the file."""

    at: Fit
    rows: _Rows


def found_loop_cause(robot: Robot, at: Fit, excluded: Collection[str], *, all_found: bool) -> Finding | None:
    """The constant of a loop that is surely not as the robot file says; None where there is none, or no loop.

    Args:
        robot: As its file has it.
        at: The fit of all that was found.
        excluded: Names that are not to be given, EFFECT or EFFECT@OWNER.
        all_found: Does the fit leave nothing without a name? Else it may be in the geometry, and nothing is named.
    """
    if not robot.description.loops or not all_found:
        return None
    known, size = _sizes(at)
    causes = _causes(known)
    plain = _likeliest(at, size, [])
    likelihood = float(plain.rows.likelihoods().max())
    gains = np.array([plain.rows.gain(cause) for cause in causes])
    places = {}
    for i in np.argsort(-gains)[:_LOOKED_AT].tolist():
        places[i] = _likeliest(plain.at, size, causes[i].columns)
        gains[i] = float(places[i].rows.likelihoods(causes[i].columns).max()) - likelihood
    named = [i for i in places if causes[i].effect != JOINT_PLACE]
    if not named:
        return None
    first = max(named, key=lambda i: float(gains[i]))
    cause, gain, there = causes[first], float(gains[first]), places[first]
    p = min(1.0, float(stats.chi2.sf(max(gain, 0.0), 1)) * len(causes))
    sure = float(stats.chi2.isf(rules.ALPHA_RIG / len(causes), 1))
    name = f"{cause.effect}@{cause.owner}"
    if (
        p > rules.ALPHA_SCAN
        or gains.max() > gain + rules.RIG_LEAD
        or {cause.effect, name} & set(excluded)
        or not _fits(there.at)
    ):
        return None
    near = [causes[i] for i in np.flatnonzero(gains > gain - rules.RIG_LEAD) if causes[i][:2] != cause[:2]]
    share, error, stability = _held_out(*_at_the_file(there.at, size), causes, first)
    doubts = {
        Because(Reason.WEAK_SIGNAL, gain**0.5, sure**0.5): gain < sure,
        Because(Reason.EQUIVALENTS): bool(near),
        Because(Reason.UNSTABLE, stability): stability < 1,
        Because(Reason.NAMES_EXCLUDED): bool(excluded),
    }
    limits = tuple(reason for reason, is_so in doubts.items() if is_so)
    value, std = (part * size[np.isfinite(size)][cause.columns] for part in there.rows.estimate(cause.columns))
    return Finding(
        cause.effect,
        cause.owner,
        "B" if limits else "A",
        _shown([known[k] for k in cause.columns], value, std),
        float(np.sqrt(gain)),
        p,
        tuple(dict.fromkeys((other.effect, other.owner) for other in near)),
        (share, error),
        stability,
        limits,
    )


def _fits(at: Fit) -> bool:
    """Is what is left of the measured numbers about their noise?"""
    _, left, row = at.standardized
    return bool(np.mean(left[row >= 0] ** 2) < _FITS**2)


def _likeliest(at: Fit, size: FloatArray, columns: list[int]) -> _Place:
    """Where the geometry is likeliest if `columns` may be off together: steps of Newton, each beside its s and w."""
    free, is_inner = np.array(at.free), np.isfinite(size)
    for _ in range(_ROUNDS):
        F, Z, y, _ = _at_the_file(at, size)
        rows = _Rows.of(F, Z, y)
        s, w = rows.best(columns) if columns else (rows.spread(), 0.0)
        wide = np.full(Z.shape[1], max(s, _NARROWEST))
        wide[columns] = np.hypot(wide[columns], w)
        found = _by_rows(F, Z * wide, y)
        step = np.zeros(len(at.theta))
        step[free[~is_inner]] = found[: F.shape[1]]
        step[free[is_inner]] = (at.centre - at.theta)[free[is_inner]] + found[F.shape[1] :] * wide * size[is_inner]
        longest = np.abs(step[free[is_inner]] / size[is_inner]).max()
        share = min(1.0, _LONGEST / max(float(longest), np.finfo(float).tiny))
        before = _cost(at, size, wide)
        for shorter in share / 3.0 ** np.arange(_SHORTER):
            there = _moved(at, at.theta + shorter * step)
            cost = _cost(there, size, wide)
            if cost < before:
                break
        else:
            break
        at = there
        if shorter == 1 and before - cost < _SETTLED:
            break
    F, Z, y, _ = _at_the_file(at, size)
    return _Place(at, _Rows.of(F, Z, y))


def _moved(at: Fit, theta: FloatArray) -> Fit:
    return replace(at, theta=theta, near=at.problem.linearized(at.model, at.samples, theta), squares=None)


def _cost(at: Fit, size: FloatArray, wide: FloatArray) -> float:
    """Squares of the rows and of the geometry's errors over `wide` plausible sizes; infinite where rows fold."""
    A, r, row = at.whitened
    is_inner = np.isfinite(size)
    errors = (at.theta - at.centre)[at.free][is_inner] / size[is_inner] / wide
    cost = float(r[row >= 0] @ r[row >= 0] + errors @ errors)
    return cost if np.isfinite(cost) and np.isfinite(A).all() else np.inf


def _sizes(at: Fit) -> tuple[list[_core.Parameter], FloatArray]:
    """Parameters of joints and loops among the free ones, and the plausible errors (F,) of all, inf of the others."""
    size = np.full(len(at.free), np.inf)
    known = []
    for k, i in enumerate(at.free):
        if i < at.problem.own and (p := at.model.parameters[i]).owner not in ("base", "tool"):
            size[k] = p.sigma
            known.append(p)
    return known, size


def _at_the_file(at: Fit, size: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.intp]]:
    """F, Z over plausible sizes, y (m,) at the geometry of the file, and the row of each number."""
    A, r, row = at.whitened
    A, r, row = A[row >= 0], r[row >= 0], row[row >= 0]
    is_inner = np.isfinite(size)
    away = np.where(is_inner, (at.theta - at.centre)[at.free], 0.0)
    return A[:, ~is_inner], A[:, is_inner] * size[is_inner], r + A @ away, row


def _causes(parameters: Sequence[_core.Parameter]) -> list[_Cause]:
    """What may be off by itself: of loops a length, a pin, a turn, a gear; of joints a place and a direction."""
    out: dict[tuple[str, str, str], list[int]] = {}
    for k, p in enumerate(parameters):
        if p.owner.startswith("joint"):
            effect, part = JOINT_PLACE, p.unit
        elif p.name == "length":
            effect, part = LOOP_LENGTH, ""
        elif p.name.startswith(("from_", "to_")):
            effect, part = LOOP_PIN, p.name.partition("_")[0]
        else:
            effect, part = (LOOP_TURN if p.name in ("rx", "ry", "rz") else LOOP_GEAR), ""
        out.setdefault((effect, p.owner, part), []).append(k)
    return [_Cause(effect, owner, columns) for (effect, owner, _), columns in out.items()]


def _shown(parameters: Sequence[_core.Parameter], value: FloatArray, std: FloatArray) -> dict[str, NamedValue]:
    """How far the numbers are off what the file says."""
    out = {}
    for p, v, s in zip(parameters, value.tolist(), std.tolist(), strict=True):
        unit = edge_unit(p, geometry=True)
        out[edge_name(p, geometry=True)] = NamedValue(from_si(v, unit), from_si(s, unit))
    return out


def _held_out(
    F: FloatArray, Z: FloatArray, y: FloatArray, row: NDArray[np.intp], causes: Sequence[_Cause], first: int
) -> tuple[float, float, float]:
    """By how much squares of held-out rows are lower with a cause, its standard error; how often it comes first."""
    rows = np.unique(row)
    shares, firsts = [], 0
    for fold in range(rules.FOLDS):
        held = np.isin(row, rows[fold :: rules.FOLDS])
        train = _Rows.of(F[~held], Z[~held], y[~held])
        s = train.spread()
        narrow, wide = train.best(causes[first].columns)
        with_it = np.full(Z.shape[1], narrow)
        with_it[causes[first].columns] = np.hypot(narrow, wide)
        left = [_left(F, Z * sizes, y, held) for sizes in (with_it, np.full(Z.shape[1], s))]
        shares.append(1 - left[0] / left[1])
        firsts += int(np.argmax([train.gain(cause) for cause in causes])) == first
    return float(np.mean(shares)), float(np.std(shares, ddof=1) / np.sqrt(rules.FOLDS)), firsts / rules.FOLDS


def _left(F: FloatArray, Z: FloatArray, y: FloatArray, held: NDArray[np.bool_]) -> float:
    """Mean square of held-out numbers (their noise is 1) by the other ones, d ~ N(0, 1)."""
    found = _by_rows(F[~held], Z[~held], y[~held])
    return float(np.mean((y[held] - np.hstack([F, Z])[held] @ found) ** 2))


def _by_rows(F: FloatArray, Z: FloatArray, y: FloatArray) -> FloatArray:
    """B and d of the rows, d ~ N(0, 1)."""
    known = np.hstack([np.zeros((Z.shape[1], F.shape[1])), np.eye(Z.shape[1])])
    A = np.vstack([np.hstack([F, Z]), known])
    return np.asarray(np.linalg.lstsq(A, np.concatenate([y, np.zeros(len(known))]), rcond=None)[0])
