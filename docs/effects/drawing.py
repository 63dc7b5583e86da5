# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One figure as a small SVG file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
WIDTH, HEIGHT = 460, 240
LEFT, RIGHT, TOP, BOTTOM = 68, 14, 26, 40
COLORS = ("#1f6fb2", "#d1495b", "#3a7d44")


@dataclass(frozen=True)
class Figure:
    """Curves over one quantity; each is (name, values) as long as x."""

    x_label: str
    y_label: str
    x: FloatArray
    curves: list[tuple[str, FloatArray]]


def ticks(low: float, high: float) -> FloatArray:
    """Round numbers between two, four to eight of them."""
    step = 10.0 ** np.floor(np.log10((high - low) / 2))
    for factor in (5.0, 2.0, 1.0, 0.5):
        marks = (
            np.arange(np.ceil(low / (step * factor) - 1e-9), np.floor(high / (step * factor) + 1e-9) + 1)
            * step
            * factor
        )
        if len(marks) >= 4:
            break
    return np.asarray(marks) + 0.0  # no minus zero


def svg(figure: Figure) -> str:
    """The figure as a small file that needs nothing else."""
    values = np.concatenate([curve for _, curve in figure.curves])
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    margin = 0.06 * (high - low)
    low, high = low - margin, high + margin
    left, right = float(figure.x[0]), float(figure.x[-1])

    def across(x: float) -> float:
        return LEFT + (x - left) / (right - left) * (WIDTH - LEFT - RIGHT)

    def down(y: float) -> float:
        return TOP + (high - y) / (high - low) * (HEIGHT - TOP - BOTTOM)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}"',
        '     font-family="sans-serif" font-size="11" fill="#222">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>',
    ]
    foot = HEIGHT - BOTTOM + 14
    parts += [f'<text x="{across(x):.1f}" y="{foot}" text-anchor="middle">{x:g}</text>' for x in ticks(left, right)]
    for y in ticks(low, high):
        color = "#999" if abs(y) < 1e-12 * (high - low) else "#e4e4e4"
        parts.append(f'<path d="M{LEFT} {down(y):.1f}H{WIDTH - RIGHT}" stroke="{color}"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{down(y) + 4:.1f}" text-anchor="end">{y:.6g}</text>')
    for k, (name, curve) in enumerate(figure.curves):
        line = " ".join(f"{across(x):.1f},{down(y):.1f}" for x, y in zip(figure.x, curve, strict=True))
        parts.append(f'<polyline points="{line}" fill="none" stroke="{COLORS[k]}" stroke-width="1.6"/>')
        x, y = LEFT + 10 + k * 120, TOP - 12
        parts.append(f'<path d="M{x} {y}h14" stroke="{COLORS[k]}" stroke-width="3"/>')
        parts.append(f'<text x="{x + 18}" y="{y + 4}">{name}</text>')
    middle, side = (LEFT + WIDTH - RIGHT) / 2, f"translate(13 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)"
    parts.append(f'<text x="{middle}" y="{HEIGHT - 8}" text-anchor="middle">{figure.x_label}</text>')
    parts.append(f'<text transform="{side}" text-anchor="middle">{figure.y_label}</text>')
    return "\n".join([*parts, "</svg>", ""])
