# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a detection: every picture with its corners drawn, what was not found and why, and the coverage."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.camera.detection import Detection, PictureSeen
from fastcal.report import page
from fastcal.report.cards import Card, data_url
from fastcal.report.figures import AFTER, ALERT
from fastcal.report.formatting import count, percent, plural
from fastcal.report.image_plane import coverage_figure, covered
from fastcal.report.language import _, in_language, retold
from fastcal.report.words import Remark, Verdict
from fastcal.robot.rig import Seeing

Array = NDArray[np.float64]

_ENOUGH = 0.6  # of the parts of a picture that hold a corner


def detection_page(found: Detection, cell: Seeing, *, language: str = "en") -> str:
    """The HTML text of the page."""
    with in_language(language):
        return _page(found, cell)


def _page(found: Detection, cell: Seeing) -> str:
    cameras: Mapping[str, Any] = cell.cameras
    seen = {name: _corners_of(found, name) for name in cameras if any(p.camera == name for p in found.pictures)}
    with_board = len(found.pictures) - len(found.empty)
    tiles = [
        (_("Pictures with a board"), _("{some} of {all}", some=with_board, all=len(found.pictures)), ""),
        (_("Corners"), count(sum(picture.count for picture in found.pictures)), ""),
    ]
    shares = {name: covered(uv, cameras[name]["size_px"]) for name, uv in seen.items()}
    for name, share in shares.items():
        note = _("of the picture holds corners") if share >= _ENOUGH else _("of the picture holds corners; show more")
        tiles.append((_("Coverage, camera {camera}", camera=name), percent(share), note))
    return page.render(
        "detection.html",
        title=_("Corners in pictures of {robot}", robot=cell.name),
        robot_name=cell.name,
        simulated=False,
        pictures=plural(len(found.pictures), "picture"),
        verdict=_verdict(found, shares),
        steps=[_("Calibrate with these corners: fastcal calibrate CELL POSES --corners FILE -o OUT")],
        tiles=tiles,
        drawings=[coverage_figure(name, uv, cameras[name]["size_px"]) for name, uv in seen.items()],
        cards=[_card(picture) for picture in sorted(found.pictures, key=lambda each: each.count > 0)],
    )


def _verdict(found: Detection, shares: Mapping[str, float]) -> Verdict:
    """How many pictures show a board, and where the boards were missing."""
    pictures = plural(len(found.pictures), "picture")
    remarks = [
        Remark(
            _(
                "Camera {camera} detected corners in {share} of its picture: show the board in more of it.",
                camera=name,
                share=percent(share),
            ),
            True,
            "coverage",
        )
        for name, share in shares.items()
        if share < _ENOUGH
    ]  # fmt: skip
    if not found.empty:
        return Verdict(
            "caution" if remarks else "good",
            _("With remarks") if remarks else _("Good"),
            _("Each of {pictures} shows a board.", pictures=pictures),
            remarks,
        )
    text = _("{count} of {pictures} show no board.", count=len(found.empty), pictures=pictures)
    return Verdict("bad" if len(found.empty) == len(found.pictures) else "caution", _("Attention"), text, remarks)


def _corners_of(found: Detection, camera: str) -> Array:
    """(K, 2) all corners that a camera saw."""
    every = [seen.uv for picture in found.pictures if picture.camera == camera for seen in picture.boards.values()]
    uv = np.concatenate(every) if every else np.empty((0, 2))
    return np.asarray(uv[np.isfinite(uv[:, 0])])


def _card(picture: PictureSeen) -> Card:
    marks: list[tuple[float, float, str]] = []
    for seen in picture.boards.values():
        known = seen.uv[np.isfinite(seen.uv[:, 0])].round(1).tolist()
        # The first corner in another colour says which way up the board was read.
        first = np.isfinite(seen.uv[0]).all()
        marks += [(u, v, ALERT if first and k == 0 else AFTER) for k, (u, v) in enumerate(known)]
    return Card(
        picture.path.name, retold(picture.told), data_url(picture.thumb), *picture.size, tuple(marks), not picture.count
    )
