# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A compensated program says so in a comment of its language, and is known again by it."""

import pytest

from fastcal.errors import InvalidInput
from fastcal.programs import read_program, stamp

HASH = "5f3a1b2c4d5e" + 52 * "0"
LINES = {
    "RAPID": "  ! fastcal compensated 5f3a1b2c4d5e; serial K-17; 2026-11-25; version 0.9.0",
    "KRL": "  ; fastcal compensated 5f3a1b2c4d5e; serial K-17; 2026-11-25; version 0.9.0",
    "FANUC LS": "   1:  !fastcal compensated 5f3a1b2c4d5e ;",
    "URScript": "  # fastcal compensated 5f3a1b2c4d5e; serial K-17; 2026-11-25; version 0.9.0",
}


@pytest.fixture
def words(monkeypatch) -> str:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1795564800")  # 2026-11-25
    return stamp.text(HASH, "K-17", "0.9.0")


@pytest.mark.parametrize("language", LINES)
def test_the_comment_is_met_again_and_taken_away(programs, words, language) -> None:
    program = read_program(programs[language])
    assert stamp.stamped_line(program) is None
    done = stamp.stamped(program.documents, language, words)
    again = read_program({d.name: d.text.encode("latin-1") for d in done})
    assert len(again.targets) == len(program.targets)
    assert len(again.moves) == len(program.moves)
    assert [(left.what, left.why) for left in again.left] == [(left.what, left.why) for left in program.left]
    where = stamp.stamped_line(again)
    assert where is not None
    lines = next(d.text for d in done if d.name == where[0]).splitlines()
    assert lines[where[1] - 1] == LINES[language]
    assert stamp.stamped(done, language, words) == done  # in place of the older one
    assert stamp.stamped(done, language, None) == program.documents


def test_lines_of_ls_are_numbered_anew(programs, words) -> None:
    (document,) = stamp.stamped(read_program(programs["FANUC LS"]).documents, "FANUC LS", words)
    body = document.text.split("/MN")[1].split("/POS")[0].splitlines()
    assert [line[:45].rstrip() for line in body[1:6]] == [
        "   1:  !fastcal compensated 5f3a1b2c4d5e ;",
        "   2:  !fastcal: serial K-17 ;",
        "   3:  !fastcal: 2026-11-25 ;",
        "   4:  !fastcal: version 0.9.0 ;",
        "   5:  !Tray 3, gripper 1 ;",
    ]
    assert document.text.count("\r\n") == document.text.count("\n")
    assert "LINE_COUNT\t= 18;" in document.text
    assert "  17:  PR[9]=P[7]    ;" in document.text


def test_numbers_within_a_local_condition_stay(words) -> None:
    """They begin again at 1 and end at a line of dashes, whatever the indentation."""
    lines = [
        "   1:  UFRAME_NUM=0 ;",
        "   2:J P[1] 100% CNT0 TB    .10sec,P-SPS    ;",
        "      1:  TC_ONLINE (ON) ;",
        "      2:  DO[23]=(OFF) ;",
        "       ------ ;",
        "   3:J P[2] 100% FINE    ;",
        "   1:  TC_ONLINE (ON) ;",
        "       ------ ;",
    ]
    joints = "".join(f"P[{n}]{{\n   GP1:\n\tJ1= 1.000 deg\n}};\n" for n in (1, 2))
    program = read_program({"A.LS": ("/PROG  A\n/MN\n" + "\n".join(lines) + f"\n/POS\n{joints}/END\n").encode()})
    (document,) = stamp.stamped(program.documents, "FANUC LS", words)
    numbers = [line.split(":")[0].strip() for line in document.text.split("/MN\n")[1].split("/POS")[0].splitlines()]
    assert numbers == ["1", "2", "3", "4", "5", "6", "1", "2", "------ ;", "7", "1", "------ ;"]
    assert stamp.stamped((document,), "FANUC LS", None) == program.documents


def test_the_date_is_today_or_that_of_the_environment(monkeypatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    assert stamp.text(HASH, None, "1.0") == "fastcal compensated 5f3a1b2c4d5e; 1970-01-01; version 1.0"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "soon")
    with pytest.raises(InvalidInput, match="SOURCE_DATE_EPOCH: expected seconds since 1970, got 'soon'"):
        stamp.text(HASH, None, "1.0")
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    assert stamp.text(HASH, None, "1.0").split("; ")[1] > "2026"


def test_a_text_without_a_head_is_marked_in_its_first_line() -> None:
    program = read_program({"a.script": b"movej([0,0,0,0,0,0])\r\n"})
    (document,) = stamp.stamped(program.documents, "URScript", "fastcal compensated 5f3a1b2c4d5e")
    assert document.text == "# fastcal compensated 5f3a1b2c4d5e\r\nmovej([0,0,0,0,0,0])\r\n"
