# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Texts that remember what they were made of: plain strings to files, said again by a page in its language."""

from __future__ import annotations

import copy
import json
import pickle

import pytest

from fastcal.diagnosis.words import cause_in_words, owner_in_words
from fastcal.errors import InvalidInput, ParseError
from fastcal.report.language import _, in_language
from fastcal.said import Said, capital, chained, first_few, joined, said, sentence_of


def test_a_text_is_english_and_says_itself_again() -> None:
    text = said("{what} by {size:.2f} mm", what=cause_in_words("backlash", "joint3"), size=1.5)
    assert text == "joint 3: backlash (lost motion) by 1.50 mm"
    assert json.loads(json.dumps({"text": text})) == {"text": str(text)}
    with in_language("de"):
        assert _(cause_in_words("backlash", "joint3")) == "Gelenk 3: Umkehrspiel"
        assert _("{what} by {size}", what=owner_in_words("link2"), size=1.5) == "Glied 2 um 1,5"
        assert _(capital(owner_in_words("base"))) == "Basis"
    assert _(text) == text


def test_parts_are_joined_and_chained() -> None:
    joints = [owner_in_words(f"joint{k}") for k in (1, 2, 3)]
    assert joined(", ", joints) == "joint 1, joint 2, joint 3"
    assert chained("{first} or {second}", joints) == "joint 1 or joint 2 or joint 3"
    assert chained("{first} or {second}", []) == ""
    with in_language("de"):
        assert _(chained("{first} or {second}", joints)) == "Gelenk 1 oder Gelenk 2 oder Gelenk 3"


def test_of_many_parts_the_first_are_named_and_the_others_counted() -> None:
    assert first_few(range(3, 6)) == "3, 4, 5"
    assert first_few(list(range(5))) == "0, 1, 2, 3, 4"
    text = first_few([owner_in_words(f"joint{k}") for k in range(1, 7)], 2)
    assert text == "joint 1, joint 2 and 4 more"
    with in_language("de"):
        assert _(text) == "Gelenk 1, Gelenk 2 und 4 weitere"


@pytest.mark.parametrize("text", [said("a {b}", b="{x}"), capital(said("{{a}} {b:.1f}", b=2.0)), joined("", [])])
def test_copies_remember_as_well(text: Said) -> None:
    for other in (copy.deepcopy(text), pickle.loads(pickle.dumps(text))):  # noqa: S301  our own
        assert (other, other.message, other.values) == (text, text.message, text.values)
        assert type(other) is type(text)


def test_the_sentence_of_an_error_keeps_its_parts_and_its_place() -> None:
    german = {"holds {count} rows": "enthält {count} Zeilen"}
    for error, english, other in (
        (InvalidInput(said("holds {count} rows", count=2)), "holds 2 rows", "enthält 2 Zeilen"),
        (ParseError(said("holds {count} rows", count=2), "a", 3), "a:3: holds 2 rows", "a:3: enthält 2 Zeilen"),
        (ParseError("holds {x}", "a.csv"), "a.csv: holds {x}", None),
        (InvalidInput(), "", None),
    ):
        found = sentence_of(error)
        assert found == english
        assert (found.again(lambda text: german.get(text, text), ",") if isinstance(found, Said) else None) == other
