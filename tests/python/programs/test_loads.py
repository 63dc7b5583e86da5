# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What programs say that the arm carries, in each language."""

from __future__ import annotations

import pytest

from fastcal.programs import Carried, carried, read_program

J = "[9E9,9E9,9E9,9E9,9E9,9E9]"
RAPID = f"""MODULE M
  PERS tooldata gun:=[TRUE,[[0,0,200],[1,0,0,0]],[1.5,[0,0,1],[1,0,0,0],0,0,0]];
  PERS tooldata unset:=[TRUE,[[0,0,200],[1,0,0,0]],[-1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS loaddata box:=[5,[0,0,50],[1,0,0,0],0,0,0];
  CONST jointtarget p1:=[[1,0,0,0,30,0],{J}];
  CONST jointtarget p2:=[[2,0,0,0,30,0],{J}];
  CONST jointtarget p3:=[[3,0,0,0,30,0],{J}];
  PROC main()
    BODY
  ENDPROC
ENDMODULE
"""
KRL = "DEF w()\nBODY\nEND\n"
A = "{{A1 {},A2 -90,A3 90,A4 0,A5 0,A6 0}}"
FANUC = """/PROG  P
/MN
BODY
/POS
P[1]{ GP1:
 UF : 0, UT : 1,
 J1= 1.0 deg, J2= 0.0 deg, J3= 0.0 deg,
 J4= 0.0 deg, J5= 30.0 deg, J6= 0.0 deg
};
P[2]{ GP1:
 UF : 0, UT : 1,
 J1= 2.0 deg, J2= 0.0 deg, J3= 0.0 deg,
 J4= 0.0 deg, J5= 30.0 deg, J6= 0.0 deg
};
/END
"""


def found(name: str, body: str, **given: float) -> list[Carried]:
    """What the targets of a program with these lines are passed with."""
    frame = {"m.mod": RAPID, "w.src": KRL, "p.ls": FANUC, "s.script": "def s():\nBODY\nend\n"}[name]
    return carried(read_program({name: frame.replace("BODY", body).encode()}), given)


def go(language: str, *places: int) -> str:
    """Moves to joints, a line each."""
    line = {
        "RAPID": "MoveAbsJ p{},v100,fine,gun;",
        "KRL": f"PTP {A}",
        "FANUC": "1:J P[{}] 50% FINE ;",
        "URScript": "movej([0.{},-1,1,0,1,0])",
    }[language]
    return "\n".join(line.format(place) for place in places) + "\n"


def test_a_tool_of_rapid_and_what_gripload_puts_into_it_add_up() -> None:
    body = go("RAPID", 1) + "GripLoad box;\n" + go("RAPID", 2, 1) + "GripLoad load0;\n" + go("RAPID", 3)
    assert found("m.mod", body) == [Carried((1.5, 6.5)), Carried((6.5,)), Carried((1.5,))]


def test_tload_stands_for_tool_and_load_together() -> None:
    body = "GripLoad box;\nMoveAbsJ p1,v100,fine,gun\\TLoad:=box;\nMoveAbsJ p2,v100,fine,gun\\TLoad:=load0;\n"
    assert found("m.mod", body) == [Carried((5.0,)), Carried((6.5,)), Carried()]


def test_tool0_says_nothing_of_what_it_carries_and_a_mass_below_nothing_is_none() -> None:
    body = "MoveAbsJ p1,v100,fine,tool0;\nMoveAbsJ p2,v100,fine,unset;\nbox.mass:=n;\nGripLoad box;\n" + go("RAPID", 3)
    first, second, third = found("m.mod", body)
    assert first == Carried()
    assert second.unknown == ("the mass of load unset is -1 in line 3, which stands for none given",)
    assert third.unknown == ("load box is changed at run time, in line 11",)


def test_loads_of_krl() -> None:
    body = "LOAD_DATA[1]={M 5.5,CM {X 0,Y 0,Z 10,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\nBAS(#TOOL,1)\n" + go("KRL", 1)
    body += "$LOAD.M=7\n" + go("KRL", 2) + "$LOAD=LOAD_DATA[3]\n" + go("KRL", 3)
    body += "$LOAD={M 2.0,CM {X 0,Y 0,Z 10,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\n" + go("KRL", 4) + "BAS(#TOOL,0)\n"
    body += go("KRL", 5) + "$LOAD.CM.X=3\n" + go("KRL", 6) + "LOAD_DATA[2].M=-1\n$LOAD=LOAD_DATA[2]\n" + go("KRL", 7)
    masses = [Carried((5.5,)), Carried((7.0,)), Carried((), ("the mass of load 3 is not in the program",))]
    none = "the mass of load 2 is -1 in line 15, which stands for none given"
    assert found("w.src", body) == [*masses, Carried((2.0,)), Carried(), Carried(), Carried((), (none,))]
    assert found("w.src", body, **{"3": 4.0})[2] == Carried((4.0,))


def test_a_payload_of_fanuc_is_a_number_whose_mass_the_user_says() -> None:
    body = "1: PAYLOAD[2] ;\n" + go("FANUC", 1, 2)
    assert found("p.ls", body) == [Carried((), ("the mass of load 2 is not in the program",))] * 2
    assert found("p.ls", body, **{"2": 8.5}) == [Carried((8.5,))] * 2
    # With two of them jumps decide which holds; another group's says nothing of the arm.
    both = "1: PAYLOAD[GP1:2] ;\n" + go("FANUC", 1) + "2: PAYLOAD[3] ;\n3: PAYLOAD[GP2:1] ;\n"
    assert found("p.ls", both, **{"2": 8.5, "3": 1.0})[0] == Carried((1.0, 8.5))
    assert found("p.ls", "1: PAYLOAD[R[5]] ;\n" + go("FANUC", 1))[0].unknown == (
        "the mass of load R[5] is not in the program",
    )


def test_payloads_of_urscript() -> None:
    body = go("URScript", 1) + "set_payload(m=2.0)\n" + go("URScript", 2)
    body += "if (x):\nset_target_payload(1+0.5, [0,0,0.1])\nend\n" + go("URScript", 3)
    body += "set_payload_cog([0,0,0.1])\nset_payload_mass(4)\n" + go("URScript", 4) + "set_payload(w)\n"
    *known, last = found("s.script", body + go("URScript", 5))
    assert known == [Carried(), Carried((2.0,)), Carried((1.5, 2.0)), Carried((4.0,))]
    assert last == Carried((), ("the mass of load set_payload of line 12 is computed at run time, in line 12",))


@pytest.mark.parametrize("load", ["set_payload", "set_payload_mass"])
def test_a_routine_of_the_programs_own_is_no_payload(load: str) -> None:
    text = f"def s():\n  {load}(3)\n  movej([0,-1,1,0,1,0])\nend\ndef {load}(m):\n  x = m\nend\n"
    assert carried(read_program({"s.script": text.encode()}), {}) == [Carried()]
