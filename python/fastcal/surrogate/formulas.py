# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Short formulas that would describe a surrogate's curve: a hint to a person, and no finding."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fastcal.arrays import FloatArray

MOST = 3
_LEAST = 0.5  # share of the curve that a formula must describe to be worth reading
_ORDERS = np.arange(0.5, 12.01, 0.1)  # cycles a turn
_WIDTHS = (0.1, 0.25, 0.5)  # of the largest load, where a tanh bends


@dataclass(frozen=True)
class Formula:
    """A formula and the share of the curve's variation that it describes, beside a plane over the inputs."""

    text: str
    share: float


def formulas(names: tuple[str, ...], inputs: FloatArray, curve: FloatArray) -> list[Formula]:
    """Up to three formulas, the best first.

    Args:
        names: Of the inputs, such as ("approach3", "load3").
        inputs: (N, d) SI.
        curve: (N, k) the function's values; of several directions the one that varies most is described.
    """
    if len(inputs) == 0 or curve.shape[1] == 0:
        return []
    y = curve[:, int(np.argmax(curve.std(axis=0)))]
    plane = np.column_stack([np.ones(len(y)), inputs])
    Q = np.linalg.qr(plane)[0]
    y = y - Q @ (Q.T @ y)
    total = float(y @ y)
    best: dict[str, Formula] = {}
    for kind, text, columns in _tried(names, inputs):
        X = columns - Q @ (Q.T @ columns)
        left = y - X @ np.linalg.lstsq(X, y, rcond=1e-9)[0]
        share = 1 - float(left @ left) / total if total > 0 else 0.0
        if share > best.get(kind, Formula("", _LEAST)).share:
            best[kind] = Formula(text, share)
    return sorted(best.values(), key=lambda f: -f.share)[:MOST]


def _tried(names: tuple[str, ...], x: FloatArray) -> Iterator[tuple[str, str, FloatArray]]:
    """(kind, text, columns): of one kind the best alone is kept."""
    for k, name in enumerate(names):
        of = {"q": _waves, "load": _bends, "time": _lags}.get(name.rstrip("0123456789"))
        if of is not None:
            yield from of(name, x[:, k])
        if name.startswith("approach"):
            for j, other in enumerate(names):
                if j != k:
                    yield "times", f"{name} times {other}", (x[:, k] * x[:, j])[:, np.newaxis]
                    yield "times size", f"{name} times |{other}|", (x[:, k] * np.abs(x[:, j]))[:, np.newaxis]


def _waves(name: str, v: FloatArray) -> Iterator[tuple[str, str, FloatArray]]:
    for order in _ORDERS[_ORDERS * np.ptp(v) > np.pi]:
        text = f"sine of {order:.1f} cycles a turn of {name}"
        yield f"sine {name}", text, np.column_stack([np.sin(order * v), np.cos(order * v)])


def _bends(name: str, v: FloatArray) -> Iterator[tuple[str, str, FloatArray]]:
    largest = float(np.max(np.abs(v))) or 1.0
    yield f"size {name}", f"|{name}|", np.abs(v)[:, np.newaxis]
    yield f"cube {name}", f"{name} cubed", (v / largest)[:, np.newaxis] ** 3
    for share in _WIDTHS:
        text = f"tanh({name} / {share * largest:.3g})"
        yield f"tanh {name}", text, np.tanh(v / (share * largest))[:, np.newaxis]


def _lags(name: str, v: FloatArray) -> Iterator[tuple[str, str, FloatArray]]:
    for share in (0.05, 0.1, 0.2, 0.4):
        lag = share * float(np.ptp(v))
        yield "lag", f"settles with a lag of {lag:.3g} s", np.exp(-(v - v.min()) / lag)[:, np.newaxis]
