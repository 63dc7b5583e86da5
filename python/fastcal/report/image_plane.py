# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Figures in the plane of a camera's pictures: where corners were seen, and what is left of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.report import figures
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import percent, significant
from fastcal.report.language import _

GRID = (8, 6)  # parts across and down of which each should hold a corner
_MOST = 4000  # corners that are drawn
_LONGEST = 0.06  # of the picture's width: the length of the 95th percentile's arrow


def covered(uv: FloatArray, size_px: Sequence[int]) -> float:
    """Share of the parts of a picture that hold a corner of uv (K, 2) [px]."""
    known = uv[np.isfinite(uv).all(axis=1)]
    counts, _x, _y = np.histogram2d(known[:, 0], known[:, 1], bins=GRID, range=[[0, side - 1] for side in size_px])
    return float(np.mean(counts > 0))


def coverage_figure(camera: str, uv: FloatArray, size_px: Sequence[int]) -> Figure:
    """Corners uv (K, 2) of all pictures of a camera, in one."""
    known = uv[np.isfinite(uv).all(axis=1)]
    shown = known[figures.spread_rows(len(known), _MOST)]
    share = percent(covered(uv, size_px))
    traces = [figures.points(shown[:, 0], shown[:, 1], figures.AFTER, 3, 0.5, hover="(%{x:.1f}, %{y:.1f}) px")]
    return Figure(
        f"coverage-{camera}",
        _("Coverage, camera {camera}", camera=camera),
        _("All corners that camera {camera} detected, in the image plane.", camera=camera),
        traces,
        _plane(size_px),
        note=_(
            "{share} of the {parts} regions of the picture contain a corner. The lens is identified only where "
            "corners were detected.",
            share=share,
            parts=GRID[0] * GRID[1],
        ),
        columns=3,
        height=340,
    )


def residual_figure(camera: str, uv: FloatArray, residual: FloatArray, size_px: Sequence[int]) -> Figure | None:
    """What is left of corners uv (K, 2), as enlarged lines from where they were seen to where they are drawn."""
    known = np.isfinite(uv).all(axis=1) & np.isfinite(residual).all(axis=1)
    if not known.any():
        return None
    places = np.flatnonzero(known)[figures.spread_rows(int(known.sum()), _MOST)]
    at, left = uv[places], residual[places]
    size = np.linalg.norm(left, axis=1)
    scale = _LONGEST * size_px[0] / max(float(np.quantile(size, 0.95)), 1e-9)
    scale = float(f"{scale:.0e}")
    ends = at + scale * left
    gap = np.full(len(at), np.nan)
    x, y = (np.column_stack([at[:, k], ends[:, k], gap]).ravel() for k in (0, 1))
    line = figures.line(x, y, figures.AFTER)
    line["line"]["width"] = 1
    line["connectgaps"] = False
    dots = figures.points(at[:, 0], at[:, 1], figures.INK, 2.5, 0.6, hover="(%{x:.1f}, %{y:.1f}) px")
    return Figure(
        f"residual-{camera}",
        _("Residuals over the picture, camera {camera}", camera=camera),
        _("Lines from each detected corner towards its reprojection by the model, in the image plane."),
        [line, dots],
        _plane(size_px),
        note=_(
            "Lines are {scale} times as long as the residuals, whose median is {median} px. Neighbouring lines that "
            "point the same way mean that the lens or the board differs from its description in the file; noise "
            "points in random directions.",
            scale=f"{scale:g}",
            median=significant(float(np.median(size)), 2),
        ),
        columns=3,
        height=340,
        key=[Key(_("detected"), figures.INK, "point"), Key(_("towards its reprojection"), figures.AFTER, "solid")],
    )


def _plane(size_px: Sequence[int]) -> dict[str, object]:
    """Axes of a picture: v down, both alike long."""
    return figures.layout(
        "u (px)",
        "v (px)",
        xaxis={"range": [0, size_px[0]], "constrain": "domain"},
        yaxis={"range": [size_px[1], 0], "scaleanchor": "x", "constrain": "domain"},
    )
