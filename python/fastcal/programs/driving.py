# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""New programs that drive a path of straight lines again and again, in the four languages.

Corners are joint positions, so the controller's own zeros and kinematics say where they lie: RAPID turns them into
poses by CalcRobT, URScript and FANUC drive lines to joint positions as they are, and KRL first visits each and keeps
$POS_ACT. The tool keeps its orientation along a path, so that the line of the flange is that of any tool.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.programs.measuring import LANGUAGES, check_axes, degrees, document, fanuc_program, looped, named
from fastcal.programs.program import Document
from fastcal.units import from_si, to_si

_ACCELERATION = 1.2  # m/s^2 of URScript's lines, its default
_DIGITS = {"rapid": 5, "krl": 5, "fanuc": 3}  # of degrees
_URSCRIPT_DIGITS = 7  # of radians


@dataclass(frozen=True, eq=False)
class Drive:
    """A path of straight lines, driven in cycles; the arm stands at its first and at its last corner.

    Attributes:
        q: (K, 6) joint positions of the corners [rad], as the controller counts them.
        cycles: How often.
        dwell_s: How long it stands [s].
        speed: Along the lines [m/s].
        blend: Distance from a corner at which it may leave the line [m]; 0: it stops in the corner.
        comment: Lines for a reader of the program.
    """

    q: FloatArray
    cycles: int
    dwell_s: float
    speed: float
    blend: float = 0.0
    comment: Sequence[str] = ()


def write_drive(language: str, name: str, drive: Drive) -> tuple[tuple[Document, ...], FloatArray]:
    """The program's files, named after `name` with the language's ending, and the joints (K, 6) that they give [rad].

    Raises:
        InvalidInput: Another number of joints than six, an unknown language, a name that is no program's, or a blend
            that the language has no word for.
    """
    check_axes(["revolute"] * drive.q.shape[1])
    path = named(language, name)
    if language == "fanuc" and drive.blend:
        raise InvalidInput("a FANUC program rounds corners by CNT and not by a distance; expected a blend of 0 mm")
    letter = "Q" if path.stem[:1].upper() == "P" else "P"  # no corner is named as the program is
    names = [f"{letter}{k + 1}" for k in range(len(drive.q))]
    if language == "urscript":
        rounded = np.round(drive.q, _URSCRIPT_DIGITS)
    else:
        rounded = to_si(np.round(from_si(drive.q, "deg"), _DIGITS[language]), "deg")
    return _WRITERS[language](path, names, replace(drive, q=rounded)), rounded


def _rapid(path: PurePath, names: Sequence[str], drive: Drive) -> tuple[Document, ...]:
    lines = [f"MODULE {path.stem}", *(f"  ! {line}" for line in drive.comment)]
    away = ",".join(["9E9"] * 6)
    for name, q in zip(names, drive.q, strict=True):
        lines.append(f"  CONST jointtarget {name}:=[[{','.join(degrees(q, _DIGITS['rapid']))}],[{away}]];")
    lines.append(f"  CONST speeddata vpath:=[{_mm(drive.speed)},500,5000,1000];")
    passing = "fine"
    if drive.blend:
        near, turn = _mm(drive.blend), f"{1.5 * from_si(drive.blend, 'mm'):g}"
        lines.append(f"  CONST zonedata zpath:=[FALSE,{near},{turn},{turn},1,{turn},1];")
        passing = "zpath"
    ends = [passing] * (len(names) - 2) + ["fine"]
    wait = f"    WaitTime \\InPos,{drive.dwell_s:g};"
    body = [f"    MoveAbsJ {names[0]}\\NoEOffs,vpath,fine,tool0;", wait]
    body += [f"    MoveL CalcRobT({name},tool0),vpath,{end},tool0;" for name, end in zip(names[1:], ends, strict=True)]
    lines += ["  PROC main()", "    SingArea \\Off;"]
    lines += looped([*body, wait], drive.cycles, f"    FOR cycle FROM 1 TO {drive.cycles} DO", "    ENDFOR")
    return (document(path, [*lines, "  ENDPROC", "ENDMODULE"]),)


def _krl(path: PurePath, names: Sequence[str], drive: Drive) -> tuple[Document, ...]:
    data = [f"DEFDAT {path.stem}"]
    for name, q in zip(names, drive.q, strict=True):
        axes = ",".join(f"A{axis} {value}" for axis, value in enumerate(degrees(q, _DIGITS["krl"]), start=1))
        data.append(f"DECL E6AXIS {name}={{{axes},E1 0,E2 0,E3 0,E4 0,E5 0,E6 0}}")
    poses = [f"X{name}" for name in names]
    lines = [f"DEF {path.stem}()", "INT cycle", *(f"DECL E6POS {pose}" for pose in poses[1:])]
    lines += [*(f"; {line}" for line in drive.comment), "BAS(#INITMOV,0)", "BAS(#VEL_PTP,10)"]
    lines += ["$TOOL=$NULLFRAME", "$BASE=$NULLFRAME", f"$VEL.CP={drive.speed:g}"]
    lines += [f"$APO.CDIS={_mm(drive.blend)}"] if drive.blend else []
    for name, pose in zip(names[1:], poses[1:], strict=True):
        lines += [f"PTP {name}", "WAIT SEC 0.5", f"{pose}=$POS_ACT"]
    ends = [" C_DIS" if drive.blend else ""] * (len(names) - 2) + [""]
    wait = f"WAIT SEC {drive.dwell_s:g}"
    body = [f"PTP {names[0]}", wait, *(f"LIN {pose}{end}" for pose, end in zip(poses[1:], ends, strict=True)), wait]
    lines += looped(body, drive.cycles, f"FOR cycle=1 TO {drive.cycles}", "ENDFOR")
    return document(path, [*lines, "END"]), document(path.with_suffix(".dat"), [*data, "ENDDAT"])


def _fanuc(path: PurePath, names: Sequence[str], drive: Drive) -> tuple[Document, ...]:
    steps = [f"!{line[:30]}" for line in drive.comment]
    steps += ["UFRAME_NUM=0", "UTOOL_NUM=1", "R[1:cycle]=0", "LBL[1]", "J P[1] 10% FINE"]
    wait = f"WAIT {drive.dwell_s:7.2f}(sec)"
    steps += [wait, *(f"L P[{at}] {_mm(drive.speed)}mm/sec FINE" for at in range(2, len(names) + 1)), wait]
    steps += ["R[1:cycle]=R[1:cycle]+1", f"IF R[1:cycle]<{drive.cycles},JMP LBL[1]"]
    return fanuc_program(path, steps, names, drive.q)


def _urscript(path: PurePath, names: Sequence[str], drive: Drive) -> tuple[Document, ...]:
    lines = [f"def {path.stem}():", *(f"  # {line}" for line in drive.comment)]
    for name, q in zip(names, drive.q, strict=True):
        lines.append(f"  {name} = [{', '.join(f'{value + 0.0:.{_URSCRIPT_DIGITS}f}' for value in q)}]")
    line = f"a={_ACCELERATION:g}, v={drive.speed:g}"
    ends = [f", r={drive.blend:g}" if drive.blend else ""] * (len(names) - 2) + [""]
    wait = f"  sleep({drive.dwell_s:g})"
    body = [f"  movej({names[0]}, a=0.5, v=0.2)", wait]
    body += [f"  movel({name}, {line}{end})" for name, end in zip(names[1:], ends, strict=True)]
    count = ["  cycle = cycle + 1"] if drive.cycles > 1 else []
    lines += ["  cycle = 0"] if count else []
    lines += looped([*body, wait, *count], drive.cycles, f"  while cycle < {drive.cycles}:", "  end")
    return (document(path, [*lines, "end"]),)


def _mm(length: float) -> str:
    """A length or speed as mm."""
    return f"{from_si(length, 'mm'):g}"


_WRITERS: dict[str, Callable[[PurePath, Sequence[str], Drive], tuple[Document, ...]]] = dict(
    zip(LANGUAGES, (_rapid, _krl, _fanuc, _urscript), strict=True)
)
