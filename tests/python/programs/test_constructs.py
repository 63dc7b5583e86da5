# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The constructs of docs/robot-programs.md, a row a test: followed, or left and named."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal.programs import Cell, Frames, read_program

DOCS = Path(__file__).parents[3] / "docs/robot-programs.md"
TABLE = yaml.safe_load((Path(__file__).parent / "constructs.yaml").read_text())
ROWS = [(language, row) for language, table in TABLE.items() for row in table["rows"]]


def files(language: str, row: dict[str, str]) -> dict[str, bytes]:
    """The program around a row."""
    return {name: text.replace("BODY", row["program"]).encode() for name, text in TABLE[language]["files"].items()}


@pytest.mark.parametrize(("language", "row"), ROWS, ids=lambda row: row if isinstance(row, str) else row["construct"])
def test_a_construct_is_followed_or_left_as_the_docs_say(language, row) -> None:
    program = read_program(files(language, row))
    poses = {name: np.eye(4) for name in ("1", "2", "3", "4")}
    frames = Frames(program, Cell(tools=poses, frames={k: T for k, T in poses.items() if k != "3"}), np.eye(4))
    followed = [
        " ".join(
            [
                *(program.targets[move.target].name, str(move.tool), str(move.frame)),
                *(["shifted"] if move.offset else []),
                *(["near"] if move.near else []),
                *(["afresh"] if move.afresh else []),
                *(["wordless"] if move.wordless else []),
            ]
        )
        for move in program.moves
        if move.target not in frames.left
    ]
    assert followed == row.get("followed", [])
    gone_to = {move.target for move in program.moves}
    left = [program.said(left).partition(":")[2] for left in program.left]
    left += [f"{program.targets[place].name}: {why}" for place, why in frames.left.items() if place in gone_to]
    assert left == row.get("left", [])


@pytest.mark.parametrize("language", TABLE)
def test_the_docs_have_a_row_for_each_test(language) -> None:
    section = DOCS.read_text().partition(f"### {TABLE[language]['heading']}")[2].partition("\n#")[0]
    documented = dict(re.findall(r"^\| (.*?) \| (followed|left)\b[^|]*\|$", section, re.M))
    rows = TABLE[language]["rows"]
    assert list(documented) == [row["construct"] for row in rows]
    for row in rows:
        assert documented[row["construct"]] == ("left" if row.get("left") or row.get("lost") else "followed"), row
