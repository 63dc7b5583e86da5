# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The studies' pages in German: all that they say has its German, and what names a thing stays."""

from __future__ import annotations

import re
from pathlib import Path

from tests.python.report.sentences import shape, spoken

import fastcal_studies
from fastcal.report.language import catalogue, messages_of
from fastcal_studies.page import paper_page

from .test_page import made_up

HOME = Path(fastcal_studies.__file__).parent
# Titles of papers as they are cited, names of axes, and what a command's line is.
AS_IT_IS = re.compile(r"\(20\d\d\)|^Positioning Accuracy|^Y\. Wang|^module 'fastcal_studies'|^fastcal paper ")


def test_every_sentence_of_a_study_has_its_german() -> None:
    with messages_of("fastcal_studies"):
        known = {shape(message) for message in catalogue("de")}
    said = {shape(text) for path in sorted(HOME.glob("*.py")) for text in spoken(path) if not AS_IT_IS.search(text)}
    assert len(said) > 150
    assert sorted(said - known) == []


def test_a_page_in_german() -> None:
    content = made_up()
    content["sections"][0]["exhibits"][0]["rows"][0][2] |= {"median": 0.25}
    content["sections"][0]["exhibits"][0]["rows"][0][0] = "joint2 alpha (deg)"
    content["sections"][0] |= {"title": "Three worlds", "lead": "GA10 is trained."}
    page = paper_page(content, "de")
    assert "Studie zu arm" in page
    assert "Error (mm)" not in page
    assert "Fehler (mm): 0,300 hier, 0,100 in der Veröffentlichung." in page
    assert "Bei 0 von 1 Kennzahl erreicht das Verfahren der Veröffentlichung hier deren Wert" in page
    assert "Drei Welten" in page
    assert "Gelenk\N{NO-BREAK SPACE}2 alpha (deg)" in page
    assert "GA10 wird gelernt." in page
    assert "0,250 (0,500\N{NO-BREAK SPACE}bis\N{NO-BREAK SPACE}2,10)" in page
    assert "Tabelle 1: of numbers" in page  # what no catalogue has
    assert "<strong>Abbildung 2</strong> ist nicht gezeigt: it is a &lt;photograph&gt;." in page
    assert "Somebody, 2020" in page
    assert paper_page(content) == paper_page(content, "en")
