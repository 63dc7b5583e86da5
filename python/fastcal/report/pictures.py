# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a calibration's page shows of pictures: residuals over each camera's picture, and those that fit worst."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.camera.thumbnails import thumbnail
from fastcal.report import figures
from fastcal.report.cards import Card, data_url
from fastcal.report.figures import Figure
from fastcal.report.formatting import significant
from fastcal.report.image_plane import coverage_figure, residual_figure
from fastcal.report.language import _
from fastcal.robot.rig import pictures

if TYPE_CHECKING:
    from fastcal.calibration.evaluation import Evaluation
    from fastcal.robot.robot import Robot


CORNERS = "corner"
_WORST = 6  # pictures that are shown
_BARS = 60  # and that have a bar


@dataclass(frozen=True)
class PicturePart:
    """The part of a page that speaks of pictures: drawings, and cards of those that fit worst."""

    drawings: list[Figure] = field(default_factory=list)
    cards: list[Card] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class _Picture:
    """One camera's picture of one board: its row, what was seen and what is left (K, 2) [px]."""

    camera: str
    board: str
    row: int
    uv: FloatArray
    left: FloatArray

    @property
    def rms(self) -> float:
        """Root mean square distance of its corners [px]."""
        return float(np.sqrt(np.nanmean(np.sum(self.left**2, axis=1))))


def picture_part(model: Robot, part: Evaluation, files: Mapping[tuple[int, str], Path] | None = None) -> PicturePart:
    """Of the rows of an evaluation that cameras saw; empty where none did.

    Args:
        model: With the cameras and boards.
        part: Whose corners and their residuals are drawn.
        files: Of pictures, by row and camera, as far as they are known.
    """
    if CORNERS not in part.others_after:
        return PicturePart()
    left = part.others_after[CORNERS].reshape(len(part.data), -1, 2)
    uv = part.data.observed[CORNERS].reshape(left.shape)
    found = []
    drawings: list[Figure | None] = []
    places: dict[str, list[slice]] = {}
    for (camera, board), own in pictures(model.description).items():
        places.setdefault(camera, []).append(own)
        for i in np.flatnonzero(np.isfinite(left[:, own]).any(axis=(1, 2))).tolist():
            row = i if part.rows is None else int(part.rows[i])
            found.append(_Picture(camera, board, row, uv[i, own], left[i, own]))
    for camera, slices in places.items():
        size = model.description.cameras[camera]["size_px"]
        seen, rest = (np.concatenate([of[:, each].reshape(-1, 2) for each in slices]) for of in (uv, left))
        if np.isfinite(seen).any():
            drawings += [residual_figure(camera, seen, rest, size), coverage_figure(camera, seen, size)]
    if not found:
        return PicturePart()
    worst = sorted(found, key=lambda each: each.rms, reverse=True)
    drawings.append(_bars(worst))
    cards = [_card(each, model, files or {}) for each in worst[:_WORST]]
    return PicturePart(figures_of(drawings), cards)


def figures_of(drawings: Sequence[Figure | None]) -> list[Figure]:
    """Those that there are."""
    return [each for each in drawings if each is not None]


def _bars(worst: Sequence[_Picture]) -> Figure:
    """The pictures by what is left of their corners, worst first."""
    shown = worst[:_BARS]
    usual = float(np.median([each.rms for each in worst]))
    names = [_("row {row}, {camera}, {board}", row=each.row, camera=each.camera, board=each.board) for each in shown]
    bars = {
        "type": "bar",
        "x": list(range(1, len(shown) + 1)),
        "y": [each.rms for each in shown],
        "text": names,
        "textposition": "none",
        "marker": {"color": figures.AFTER},
        "hovertemplate": "%{text}: %{y:.3g} px<extra></extra>",
    }
    line = figures.line([0.5, len(shown) + 0.5], [usual, usual], figures.INK, "dot")
    return Figure(
        "worst-pictures",
        _("Pictures, worst first"),
        _("RMS residual of the corners of each picture, largest first."),
        [bars, line],
        figures.layout(_("picture, worst first"), _("RMS of its corners (px)"), yaxis={"rangemode": "tozero"}),
        note=_(
            "Dotted: the median over the pictures. A single bar that stands out is a picture that was blurred, "
            "taken in motion or matched to the wrong row; a gradual rise over many pictures points to something "
            "missing from the model."
        ),
        height=300,
    )


def _card(of: _Picture, model: Robot, files: Mapping[tuple[int, str], Path]) -> Card:
    file = files.get((of.row, of.camera))
    size = model.description.cameras[of.camera]["size_px"]
    known = np.isfinite(of.left).all(axis=1)
    marks = [(u, v, figures.AFTER) for u, v in of.uv[known].round(1).tolist()]
    drawn = [(u, v, figures.ALERT) for u, v in (of.uv + of.left)[known].round(1).tolist()]
    return Card(
        _("row {row}, {camera}, {board}", row=of.row, camera=of.camera, board=of.board),
        _("RMS {value} px, {count} corners", value=significant(of.rms), count=int(known.sum())),
        data_url(b"" if file is None else thumbnail(file)),
        int(size[0]),
        int(size[1]),
        (*marks, *drawn),
        row=f"0:{of.row}",  # of the training data
    )
