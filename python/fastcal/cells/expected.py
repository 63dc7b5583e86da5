# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Errors that a calibrated cell that has not changed shows in new readings.

Whitened residuals are r = A u + E e + n with u ~ N(0, 1) what is known of the cell, e ~ N(0, t^2) of each posture's own
joints and n ~ N(0, 1). The motions B of the world are fitted: with Q an orthonormal basis of their columns,

    var r_k = |(A - Q Q^T A)_k|^2 + t^2 |E_k|^2 + 1 - |Q_k|^2.
"""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.cells.evidence import joint_zeros
from fastcal.cells.known_fit import KnownFit
from fastcal.measurements.kinds import of_observation


def expected_rms(fit: KnownFit) -> dict[str, float]:
    """RMS error of each kind of reading [m, rad, px], by its name."""
    measured, noise = fit.measured, fit.noise(fit.measured)
    near = _core.linearize(fit.cell.model, fit.readings.samples(fit.cell), measured, fit.start, noise, fit.threads)
    J, row, number = np.asarray(near.J), np.asarray(near.row), np.asarray(near.number)
    world = fit.world.shape[1]
    A, B = J @ fit.G[:, : fit.G.shape[1] - world], J @ fit.world
    zeros = [column for _, _, kind, column in joint_zeros(fit.cell, J.shape[1]) if kind == "revolute"]
    E = fit.repeats * (J @ np.reshape(zeros, (-1, J.shape[1])).T)
    size = np.linalg.norm(B, axis=0)
    Q = np.linalg.qr(B[:, size > 0] / size[size > 0])[0] if (size > 0).any() else np.zeros((len(J), 0))
    variance = np.sum((A - Q @ (Q.T @ A)) ** 2, axis=1) + np.sum(E**2, axis=1) + 1 - np.sum(Q**2, axis=1)
    squares, counts = dict[str, float](), dict[str, float]()
    for of, common in zip(measured.observations, noise, strict=True):
        own = (number >= of.first_number) & (number < of.first_number + len(of.components))
        if of.is_known or not own.any():
            continue
        claimed = np.array([measured.sigma(int(i), int(c)) for i, c in zip(row[own], number[own], strict=True)])
        name, width = of_observation(of).name, len(of.components) // of.reading_count
        squares[name] = squares.get(name, 0.0) + float(variance[own] @ (claimed**2 + common**2))
        counts[name] = counts.get(name, 0.0) + int(own.sum()) / width
    return {name: float(np.sqrt(of / counts[name])) for name, of in squares.items()}
