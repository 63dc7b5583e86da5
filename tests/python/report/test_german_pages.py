# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""No English is left on a German page, doubts and the end of a fit included."""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest

from . import pages_of_arms, pages_of_kinds  # noqa: F401 - their pages are cases too
from .pages_of_fits import CASES

# Words that hardly an English sentence lacks, and no German one has.
ENGLISH = {"the", "of", "and", "with", "from", "that", "are", "is", "were", "not", "this", "which", "has", "have", "by"}
ENGLISH |= {"on", "its", "for", "be"}
# Sentences of rooms that speak English alone (docs/architecture.md).
ALONE = re.compile(r"^(fastcal|nonlinear least squares)")


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
    ],
)
def test_a_page_of_german_has_no_english(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FASTCAL_LANGUAGE", "de_DE.UTF-8")
    page = CASES[name](tmp_path).read_text(encoding="utf-8")
    assert '<html lang="de">' in page
    assert english(page) == []


def test_english_would_be_seen() -> None:
    assert english('<p>Der Tracker, the base</p><p aria-label="by joint">x</p><code>the</code>') == [
        "Der Tracker, the base",
        "by joint",
    ]
