# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""LS files: which uses of a position are understood, and what is left and named."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fastcal.errors import ParseError
from fastcal.programs import Cell, Frames, Program, read_program
from fastcal.programs.languages import is_program

POSE = """\
P[{n}:"a, b"]{{
   GP1:
\tUF : {uf}, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =   {x}.000  mm,\tY =    40.000  mm,\tZ =    80.000  mm,
\tW =   179.000 deg,\tP =      .500 deg,\tR =   178.500 deg{more}
}};
"""


def ls(*lines: str, count: int = 3, uf: object = 1, more: dict[int, str] | None = None, head: str = "") -> Program:
    """A program of these instructions and of positions 1 to `count`."""
    body = "".join(f"{k:4}:{line} ;\n" if line[:1] != " " else f"{line} ;\n" for k, line in enumerate(lines, start=1))
    poses = "".join(POSE.format(n=n, x=100 + n, uf=uf, more=(more or {}).get(n, "")) for n in range(1, count + 1))
    return read_program({"A.LS": f"/PROG  A\n/ATTR\n{head}/MN\n{body}/POS\n{poses}/END\n".encode()})


def names(program: Program) -> list[str]:
    return [program.targets[move.target].name for move in program.moves]


def left(program: Program) -> list[str]:
    return [program.said(each) for each in program.left]


@pytest.mark.parametrize(
    "move",
    [
        "J P[2] 100% FINE   ",
        "L P[2:weld, start] 1200mm/sec CNT100 ACC80  ",
        "L P[2] R[5:speed]mm/sec CNT R[6] PTH  ",
        "L P[2] WELD_SPEED FINE  Arc Start[1]",
        "L P[2] 20cm/min CNT50 TB  .10sec,CALL GRIP(1,R[2])",
        "L P[2] 2.5sec FINE Skip,LBL[5],PR[7]=LPOS",
        "J P[2] 50% CNT10 DB   5.0mm,P-SPS",
        "S P[2] 240cm/min CNT100 ACC50 Wjnt",
        "L P[2] 2000mm/sec FINE SPOT[P=1,S=2]",
        "A P[2] 300mm/sec CNT100 TA   .20sec,DO[3]=ON",
    ],
)
def test_what_leaves_a_position_where_it_is(move) -> None:
    program = ls("J P[1] 100% FINE", move)
    assert names(program) == ["P[1]", "P[2]"]
    assert left(program) == []
    assert program.moves[1].offset is None
    assert program.moves[1].wordless == ("Wjnt" in move)


@pytest.mark.parametrize("added", ["Offset", "Offset,PR[3:x]", "Tool_Offset,PR[R[2]]", "VOFFSET,VR[1]"])
def test_what_is_added_at_run_time_goes_along_with_the_target(added) -> None:
    (move,) = ls(f"L P[2] 100mm/sec FINE {added}").moves
    assert move.offset is not None
    assert math.isnan(move.offset[0])


@pytest.mark.parametrize(
    ("lines", "sentences"),
    [
        (["L P[2] 100mm/sec FINE INC"], ["the move goes on by it as an increment"]),
        (["L P[2] 100mm/sec FINE COORD"], ["the move is coordinated with another group"]),
        (["L P[2] 100mm/sec FINE RTCP"], ["the tool is outside"]),
        (["L P[2] 100mm/sec FINE Wiggle[3]"], ["'Wiggle' is not understood"]),
        (["L P[1] 100mm/sec FINE", "PR[4]=P[2]"], ["'PR[4]=P[2]' uses it otherwise than to go there"]),
        (["J P[2] 9% FINE", "L P[2] 9mm/sec FINE INC"], ["the move goes on by it as an increment"]),
        (["CALL GO(P[2],1)"], ["'CALL GO(P[2],1)' uses it otherwise than to go there"]),
        (
            ["Independent GP", "  :  GP1,JP 100% FINE P[2]"],
            ["'Independent GP ; GP1,JP 100% FINE P[2]' uses it otherwise"],
        ),
    ],
)
def test_a_use_that_is_not_understood_leaves_the_target(lines, sentences) -> None:
    program = ls(*lines)
    assert "P[2]" not in [target.name for target in program.targets]
    (said,) = left(program)
    assert said.startswith("A.LS:")
    assert f"P[2] is left as it is: {sentences[0]}" in said


def test_positions_of_registers_and_of_other_files_are_named() -> None:
    program = ls("J PR[1:park] 20% FINE", "L P[R[3]] 50mm/sec FINE", "J P[9] 100% FINE", "J P[1] 100% FINE")
    assert names(program) == ["P[1]"]
    assert program.moves[0].afresh
    assert left(program) == [
        "A.LS:4: J PR[1] is left as it is: a register has it at run time",
        "A.LS:5: L P[R[3]] is left as it is: a register has it at run time",
        "A.LS:6: J P[9] is left as it is: it is not in this file",
    ]


def test_what_moves_nothing_is_passed_over() -> None:
    program = ls(
        "!J P[9] 100% FINE",
        "//L P[9] 100mm/sec FINE",
        "IF R[5:count]>3,JMP LBL[2]",
        "IF (DI[1] AND !DI[2]) THEN",
        "C P[1]    \n    :  P[2] 200mm/sec CNT100   ",
        "ENDIF",
        "FOR R[1]=1 TO 5",
        "ENDFOR",
        "SELECT R[2]=1,CALL PICK",
        "             =2,JMP LBL[4]",
        "WAIT   1.00(sec)",
        "CALL DROP(1,'P[3]')",
        "R[1]=PR[2,3]*P",
        "LBL[2]",
    )
    assert names(program) == ["P[1]", "P[2]"]
    assert left(program) == []


def test_external_axes_that_differ_leave_the_poses() -> None:
    rails = {n: f",\n\tE1=  {500 * n}.000  mm" for n in (1, 2, 3)}
    program = ls("L P[1] 9mm/sec FINE", "L P[2] 9mm/sec FINE", more=rails)
    assert program.targets == ()
    assert "E1 = 500.000 mm" in left(program)[0]
    same = ls("L P[1] 9mm/sec FINE", more=dict.fromkeys((1, 2, 3), ",\n\tE1=   500.000  mm"))
    assert len(same.targets) == 3
    assert "E1 = 500.000 mm in all poses" in same.notes[0]


def test_the_frame_that_is_chosen_and_the_one_that_moves() -> None:
    """UF : F is the frame that holds; several may, where the program chooses more than one."""
    one = ls("UFRAME_NUM=2", "L P[1] 9mm/sec FINE", uf="F")
    assert (one.targets[0].frame, one.moves[0].frame, one.moves[0].tool) == (None, "2", None)
    two = ls("UFRAME_NUM=2", "UFRAME_NUM[GP1]=R[4]", "L P[1] 9mm/sec FINE", uf="F")
    assert two.moves[0].frame is None
    moved = ls("UFRAME[1]=PR[5]", "L P[1] 9mm/sec FINE")
    assert moved.doubts[("frame", "1")] == "line 4 gives frame 1 a value at run time"
    assert "frame 1 a value at run time" in Frames(moved, Cell(tools={"1": np.eye(4)}), np.eye(4)).left[0]


def test_poses_of_a_part_for_a_tool_outside_are_left() -> None:
    text = ls("L P[1] 9mm/sec FINE").documents[0].text.replace("\tX =", "\tRX =", 1)
    program = read_program({"A.LS": text.encode()})
    assert [target.name for target in program.targets] == ["P[2]", "P[3]"]
    assert "P[1] is left as it is: it is the pose of a part for a tool that stands outside" in left(program)[0]


def test_a_program_that_follows_a_conveyor_is_left() -> None:
    program = ls("L P[1] 9mm/sec FINE", head="/APPL\n  LINE_TRACK ;\nLINE_TRACK_SCHEDULE_NUMBER : 1;\n")
    assert program.targets == ()
    assert "the program follows a conveyor" in left(program)[0]


def test_reports_of_a_controller_are_no_programs() -> None:
    report = b"  1 FANUC   12-MAY-26 08:01:55\nLogbook of events\n SRVO-003 Deadman switch released\n"
    assert not is_program("LOGBOOK.LS", report)
    assert is_program("A.LS", b"/PROG  A\n/POS\n/END\n")
    assert is_program("a.src", b"DEF A()\nEND\n")
    with pytest.raises(ParseError, match=r"LOGBOOK.LS:1: expected a section /POS.* is a controller's report"):
        read_program({"LOGBOOK.LS": report})
