# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The instructions of RAPID that move the arm, by their arguments, those with a backslash left out.

Source: ABB, Technical reference manual, RAPID Instructions, Functions and Data types (3HAC050917), and the manuals of
the options Arc (3HAC050988), Spot (3HAC050979) and Dispense.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

# What an argument is: via and point are robtargets, joints a jointtarget, found is a place that the instruction writes,
# external a jointtarget of external axes alone, tool the tool; - is anything else.
_SIGNATURES: Mapping[str, str] = {
    "MoveJ MoveL TriggJIOs TriggLIOs PaintL PaintLSig ArcMoveJ ArcMoveL": "point - - tool",
    "MoveC TriggCIOs PaintC ArcMoveC": "via point - - tool",
    "MoveAbsJ ArcMoveAbsJ": "joints - - tool",
    "MoveExtJ ArcMoveExtJ": "external - -",
    "MoveJSync MoveLSync": "point - - tool -",
    "MoveCSync": "via point - - tool -",
    "MoveJDO MoveLDO MoveJAO MoveLAO MoveJGO MoveLGO": "point - - tool - -",
    "MoveCDO MoveCAO MoveCGO": "via point - - tool - -",
    "SearchL": "- found point - tool",
    "SearchC": "- found via point - tool",
    "SearchExtJ": "- found external -",
    "TriggJ TriggL": "point - - - tool",
    "TriggC": "via point - - - tool",
    "TriggAbsJ": "joints - - - tool",
    "ArcL ArcLStart ArcLEnd": "point - - - - tool",
    "ArcC ArcCStart ArcCEnd": "via point - - - - tool",
    "SpotL SpotJ": "point - - - tool",
    "SpotML SpotMJ": "point - - tool",
    "DispL": "point - - - tool",
    "DispC": "via point - - - tool",
}
_BY_NAME = {name.upper(): roles.split() for names, roles in _SIGNATURES.items() for name in names.split()}
# These may have one argument less or more: MoveLGO its value as a switch, ArcL its weave data or not.
_LONGER = {"ARCL", "ARCLSTART", "ARCLEND", "ARCC", "ARCCSTART", "ARCCEND"}
_SHORTER = {"MOVEJGO", "MOVELGO", "MOVECGO"}


def roles(instruction: str, count: int) -> Sequence[str] | None:
    """What each of `count` arguments of an instruction is; None where it moves nothing, or has other arguments."""
    name = instruction.upper()
    known = _BY_NAME.get(name)
    if known is None or count == len(known):
        return known
    if name in _LONGER and count == len(known) + 1:
        return [*known[:-1], "-", known[-1]]
    return known[:-1] if name in _SHORTER and count == len(known) - 1 else None


def moves(instruction: str) -> bool:
    """Does an instruction move the arm, by its name?"""
    return instruction.upper() in _BY_NAME
