# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""No English is left on a German page, doubts and the end of a fit included."""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest

from fastcal.calibration.picture_readings import MEASURE_BOARD, focal_of, size_of
from fastcal.cli import demo_camera
from fastcal.report.language import _, in_language
from fastcal.said import said

from . import pages_of_arms, pages_of_cells, pages_of_kinds  # noqa: F401 - their pages are cases too
from .pages_of_fits import CASES

# Words that hardly an English sentence lacks, and no German one has.
ENGLISH = {"the", "of", "and", "with", "from", "that", "are", "is", "were", "not", "this", "which", "has", "have", "by"}
ENGLISH |= {"on", "its", "for", "be", "corners"}
# Sentences of rooms that speak English alone (docs/architecture.md).
ALONE = re.compile(r"^(fastcal|nonlinear least squares|[0-9a-f]{64}$)")


def english(page: str) -> list[str]:
    """The texts of a page that hold an English word; code aside."""
    page = re.sub(r"<(style|code|script)\b.*?</\1>", " ", page, flags=re.DOTALL)
    texts = [html.unescape(part).strip() for part in re.split(r"<[^>]+>", page)]
    texts += [html.unescape(part) for part in re.findall(r'(?:aria-label|data-title)="([^"]*)"', page)]
    return sorted({t for t in texts if set(re.findall(r"[a-z]+", t.lower())) & ENGLISH and not ALONE.match(t)})


@pytest.mark.parametrize(
    "name",
    [
        "calibrate_good",
        "calibrate_limit_missed",
        "camera_diagnosed",
        "cell_of_a_track",
        "calibrate_moved",
        "calibrate_few",
        "calibrate_wrong_rows",
        "calibrate_outliers",
        "calibrate_full_poses",
        "calibrate_two_stations",
        "diagnose_few",
        "check_collision",
        "compliance_of_loads",
        "accept_path",
        "path_compensated",
        "cell_updated",
        "cell_of_two_arms_checked",
        "camera",
        "calibrate_effects",
        "calibrate_not_converged",
    ],
)
def test_a_page_of_german_has_no_english(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FASTCAL_LANGUAGE", "de_DE.UTF-8")
    monkeypatch.setattr(demo_camera, "ROWS", 16)  # fewer pictures have the same words
    monkeypatch.setattr(demo_camera, "TEST_ROWS", 6)
    page = CASES[name](tmp_path).read_text(encoding="utf-8")
    assert '<html lang="de">' in page
    assert english(page) == []


def test_a_board_or_lens_of_another_size_is_said_in_german() -> None:
    told = said("board {name}: {text}", name="plate", text=size_of(1.024))
    assert str(told).startswith("board plate: seen with this arm the board is 1.024 times as large")
    with in_language("de"):
        for text in (told, size_of(25.4), size_of(1 / 1000), focal_of(1.4), MEASURE_BOARD):
            assert english(f"<p>{_(text)}</p>") == []
        assert _(told).startswith("Tafel plate: mit diesem Roboter gesehen ist die Tafel 1,024-mal so groß")


def test_a_percent_sign_stands_apart_in_german() -> None:
    told = said("{share:.0%} and {size:.1f}", share=0.56, size=1.5)
    assert told == "56% and 1.5"
    with in_language("de"):
        assert _(told) == "56\N{NARROW NO-BREAK SPACE}% and 1,5"


def test_english_would_be_seen() -> None:
    assert english('<p>Der Tracker, the base</p><p aria-label="by joint">x</p><code>the</code>') == [
        "Der Tracker, the base",
        "by joint",
    ]
