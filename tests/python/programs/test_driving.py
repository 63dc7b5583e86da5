# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""New programs that drive a path: what they say, and joints that are those of the text."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from fastcal.errors import InvalidInput
from fastcal.programs.driving import Drive, write_drive
from fastcal.programs.measuring import LANGUAGES
from fastcal.units import from_si

Q = np.radians([[10.0, -20, 30, -40.5, 50, -60], [0, 1.123456789, 0, 0, 90, 0], [179.99999, 1e-7, -5.123456, 7, 8, 9]])
DRIVE = Drive(Q, 10, 2.5, 0.25, comment=["a comment"])
NUMBER = r"-?\d+\.\d+"


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_joints_that_come_back_are_those_of_the_text(language: str) -> None:
    documents, q = write_drive(language, f"way{LANGUAGES[language][0]}", DRIVE)
    text = documents[-1].text
    lines = {
        "rapid": re.findall(r"jointtarget P\d:=\[\[(.*?)\]", text),
        "krl": [line.partition("E1")[0] for line in re.findall(r"E6AXIS P\d=\{(.*?)\}", text)],
        "fanuc": re.findall(r"UT : 1,\n(.*?)\};", text, re.DOTALL),
        "urscript": re.findall(r"P\d = \[(.*?)\]", text),
    }[language]
    written = np.array([[float(number) for number in re.findall(NUMBER, line)] for line in lines])
    assert written.shape == (3, 6)
    np.testing.assert_allclose(q if language == "urscript" else from_si(q, "deg"), written, rtol=0, atol=1e-12)
    assert np.abs(q - Q).max() < np.radians(6e-4)


@pytest.mark.parametrize(
    ("language", "moves", "waits"),
    [
        (
            "rapid",
            ["MoveAbsJ P1", "MoveL CalcRobT(P2,tool0),vpath,zpath", "MoveL CalcRobT(P3,tool0),vpath,fine"],
            "WaitTime \\InPos,2.5;",
        ),
        ("krl", ["XP3=$POS_ACT", "PTP P1", "LIN XP2 C_DIS", "LIN XP3\n"], "WAIT SEC 2.5"),
        ("urscript", ["movej(P1,", "movel(P2, a=1.2, v=0.25, r=0.004)", "movel(P3, a=1.2, v=0.25)"], "sleep(2.5)"),
    ],
)
def test_it_stands_at_both_ends_and_rounds_the_corners_between(language: str, moves: list[str], waits: str) -> None:
    (document, *_), _ = write_drive(language, f"way{LANGUAGES[language][0]}", replace(DRIVE, blend=0.004))
    places = [document.text.find(move) for move in moves]
    assert min(places) > 0
    assert places == sorted(places)
    assert document.text.count(waits) == 2
    assert {"rapid": "vpath:=[250,500", "krl": "$VEL.CP=0.25", "urscript": "v=0.25"}[language] in document.text


def test_a_fanuc_stops_in_its_corners() -> None:
    (document,), _ = write_drive("fanuc", "way.ls", DRIVE)
    assert [line[5:].strip(" ;") for line in document.text.splitlines() if re.match(r" +\d+:[JL] ", line)] == [
        "J P[1] 10% FINE",
        "L P[2] 250mm/sec FINE",
        "L P[3] 250mm/sec FINE",
    ]
    assert "IF R[1:cycle]<10,JMP LBL[1]" in document.text
    with pytest.raises(InvalidInput, match="expected a blend of 0 mm"):
        write_drive("fanuc", "way.ls", replace(DRIVE, blend=0.004))


def test_urscript_counts_its_runs() -> None:
    """The script, run as Python in which moves are noted, drives ten runs."""
    (document,), _ = write_drive("urscript", "way.script", DRIVE)
    moves: list[str] = []
    code = document.text.replace("  end\n", "\n").replace("\nend\n", "\nway()\n")
    known = {
        "movej": lambda q, a, v: moves.append("j"),
        "movel": lambda q, a, v: moves.append("l"),
        "sleep": lambda s: moves.append("s"),
    }
    exec(code, known)  # noqa: S102
    assert moves == ["j", "s", "l", "l", "s"] * 10


def test_no_corner_is_named_as_the_program() -> None:
    (document,), _ = write_drive("rapid", "P1.mod", DRIVE)
    assert "jointtarget Q1:=" in document.text
    assert "jointtarget P" not in document.text
