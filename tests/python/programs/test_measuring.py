# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""New programs, read back by the readers that real programs are read with."""

import numpy as np
import pytest

from fastcal.errors import InvalidInput
from fastcal.programs import read_program
from fastcal.programs.measuring import LANGUAGES, Cycles, Stop, check_axes, write_cycles
from fastcal.units import from_si

Q = np.radians([[10.0, -20, 30, -40.5, 50, -60], [0, 0, 0, 0, 0, 0], [179.99999, 1e-7, -5.123456, 7, 8, 9]])
CYCLES = Cycles(
    ("P1", "P2", "P3"),
    Q,
    [(1, [Stop(0, False)]), (30, [Stop(2, True), Stop(1, False), Stop(0, True)])],
    2.5,
    0.5,
    ["a comment"],
)
DIGITS = {"rapid": 5e-6, "krl": 5e-6, "fanuc": 5e-4, "urscript": 3e-6}  # deg


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_program_is_read_back_with_its_targets_in_the_order_of_its_moves(language: str) -> None:
    suffix = LANGUAGES[language][0]
    documents = write_cycles(language, f"iso{suffix}", CYCLES)
    program = read_program({d.name: d.text.encode("latin-1") for d in documents})
    assert program.notes == ()
    assert {target.kind for target in program.targets} == {"joints"}
    driven = np.array([program.targets[move.target].values for move in program.moves])
    np.testing.assert_allclose(from_si(driven, "deg"), from_si(Q[[0, 2, 1, 0]], "deg"), atol=1.01 * DIGITS[language])


@pytest.mark.parametrize(
    ("language", "waits", "loop"),
    [
        ("rapid", "WaitTime \\InPos,2.5;", "FOR cycle FROM 1 TO 30 DO"),
        ("krl", "WAIT SEC 2.5", "FOR cycle=1 TO 30"),
        ("fanuc", "WAIT    2.50(sec)", "IF R[1:cycle]<30,JMP LBL[2]"),
        ("urscript", "sleep(2.5)", "while cycle < 30:"),
    ],
)
def test_it_waits_at_measured_stops_alone_and_loops(language: str, waits: str, loop: str) -> None:
    text = write_cycles(language, f"iso{LANGUAGES[language][0]}", CYCLES)[0].text
    assert text.count(waits) == 2
    assert text.count(loop) == 1


def test_urscript_counts_its_rounds() -> None:
    """The script, run as Python in which moves are noted, drives thirty rounds."""
    text = write_cycles("urscript", "iso.script", CYCLES)[0].text
    moves: list[list[float]] = []
    code = text.replace("  end\n", "\n").replace("\nend\n", "\niso()\n")
    exec(code, {"movej": lambda q, a, v: moves.append(q), "sleep": lambda s: None})  # noqa: S102
    assert len(moves) == 1 + 30 * 3


def test_only_axes_that_turn_are_written() -> None:
    with pytest.raises(InvalidInput, match="this robot's joint 3 slides"):
        check_axes(["revolute", "revolute", "prismatic", "revolute", "revolute", "revolute"])


@pytest.mark.parametrize(
    ("language", "name", "q", "said"),
    [
        ("pascal", "iso.mod", Q, "language must be one of rapid, krl, fanuc, urscript, got 'pascal'"),
        ("rapid", "iso.src", Q, "ends in .mod"),
        ("rapid", "iso 9283.mod", Q, "a letter, then up to 23"),
        ("krl", "9283.src", Q, "a letter, then up to 23"),
        ("fanuc", "iso.ls", Q[:, :5], "this robot has 5 joints"),
    ],
)
def test_what_no_controller_takes_is_refused(language: str, name: str, q: np.ndarray, said: str) -> None:
    from dataclasses import replace

    with pytest.raises(InvalidInput, match=said):
        write_cycles(language, name, replace(CYCLES, q=q))
