# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Finished English sentences are found among the catalogue's messages by their fixed words and said in German."""

from __future__ import annotations

import pytest

from fastcal.report.language import in_language, retold
from fastcal.report.retelling import Retelling
from fastcal.said import said

KNOWN = {
    "holds {count} rows": "enthält {count} Zeilen",
    "expected {what}, got {count} and nothing more": "erwartet {what}, gefunden {count} und nicht mehr",
    "expected {what}, got {other}": "erwartet {what}, gefunden {other}",
    "{name} {which} not installed": "{name} ist nicht installiert",
    "a whole number": "eine ganze Zahl",
    "<holds> {count} rows": "<enthält> {count} Zeilen",
    "row": "Zeile",
    "rows": "Zeilen",
    "at {place}": "bei {place}",
    "{first} or {second}": "{first} oder {second}",
    "{{brace}} comes of {name}": "{{Klammer}} kommt von {name}",
}


@pytest.mark.parametrize(
    ("english", "german"),
    [
        ("holds 3 rows", "enthält 3 Zeilen"),
        ("a.csv:3: holds 3 rows", "a.csv:3: enthält 3 Zeilen"),  # what stands before is not said
        ("holds 3 rows; a whole number", "enthält 3 Zeilen; eine ganze Zahl"),
        ("expected a whole number, got 1.5", "erwartet eine ganze Zahl, gefunden 1,5"),
        ("expected a whole number, got 1.5 and nothing more", "erwartet eine ganze Zahl, gefunden 1,5 und nicht mehr"),
        ("expected 2 rows, got 1 row", "erwartet 2 Zeilen, gefunden 1 Zeile"),
        ("expected a, b or c, got 'a whole number'", "erwartet a, b oder c, gefunden 'a whole number'"),
        ("expected what is said of it or not, got 1", "erwartet what is said of it or not, gefunden 1"),
        ("torch is not installed", "torch ist nicht installiert"),  # "is" or "are" is of English alone
        ("{brace} comes of rows", "{Klammer} kommt von rows"),  # a name stays what it is
        ("holds 3 rows. a whole number", "enthält 3 Zeilen. eine ganze Zahl"),
        ("expected 0.5, 1.25 mm, got 2 rows", "erwartet 0,5; 1,25 mm, gefunden 2 Zeilen"),
        ("<holds> 1 rows; is of a part", "<enthält> 1 Zeilen; is of a part"),
        ("holds nothing at all", "holds nothing at all"),
        ("", ""),
    ],
)
def test_a_sentence_is_retold_by_the_message_it_fits_best(english: str, german: str) -> None:
    assert Retelling(KNOWN, ",").again(english) == german


def test_the_catalogue_retells_what_rooms_say() -> None:
    told = "fit.csv:5: column 'z_mm': expected a number, got 'abc'"
    assert retold(told) == told
    with in_language("de"):
        assert retold(told) == "fit.csv:5: Spalte 'z_mm': erwartet eine Zahl, gefunden 'abc'"
        assert retold("a limit must be above 0, got -0.5 mm") == "eine Grenze muss über 0 liegen, nicht bei -0,5 mm"
        moved = "converged: 25 postures; nothing moved"
        assert retold(moved) == "konvergiert: 25 Stellungen; nichts hat sich bewegt"
        sizes = "positions: RMS 0.0325 mm (before 0.0372), at most 0.061 mm, 50 readings"
        assert retold(sizes) == "Positionen: RMS 0,0325 mm (vorher 0,0372), höchstens 0,061 mm, 50 Ablesungen"
        assert retold(said("{joint} {number}", joint="a", number=1.5)) == "a 1,5"
        assert retold("[Errno 13] Permission denied: 'x'") == "[Errno 13] Permission denied: 'x'"
