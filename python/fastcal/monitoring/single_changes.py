# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every number that a check looks for, alone: estimate, standard deviation, and the smallest change that would show."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.monitoring.causes import LEVEL
from fastcal.monitoring.result import Test
from fastcal.monitoring.setting import Setting
from fastcal.units import factor


def single_changes(setting: Setting) -> list[Test]:
    """Every single number that was looked for and shows; rows are left out."""
    out = []
    limit = 0.5 * LEVEL / setting.evidence.effective_tests
    noise_only = _noise_only(setting)
    for h, t, std_by_noise in zip(setting.possible, setting.evidence.tests, noise_only, strict=True):
        if h.kind == "row" or t.rank == 0:
            continue
        for k, number in enumerate(h.numbers):
            if not np.isfinite(t.std[k]):
                continue
            f = factor(number.unit)
            value, std = float(t.value[k]) / f, float(t.std[k]) / f
            out.append(
                Test(
                    h.kind, number.name, number.owner, value, std, float(std_by_noise[k]) / f, number.unit, t.p_value,
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
