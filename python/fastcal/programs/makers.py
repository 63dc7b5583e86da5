# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Languages of robots that are not read, by which their files are known; and whose language an arm speaks."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePath

from fastcal.said import said

READ = "RAPID (ABB), KRL (KUKA), FANUC LS and URScript (Universal Robots)"

# Ending: the language, and what to give instead where there is something.
_OTHERS: Mapping[str, str] = {
    ".jbi": "INFORM (Yaskawa)",
    **dict.fromkeys((".pgx", ".dtx", ".pjx"), "VAL3 (Staubli)"),
    **dict.fromkeys((".as", ".pg", ".kas"), "AS (Kawasaki)"),
    **dict.fromkeys((".pcs", ".pac"), "PAC (Denso)"),
    **dict.fromkeys((".drl", ".drs"), "DRL (Doosan)"),
    **dict.fromkeys((".mb4", ".mb5", ".mb6"), "MELFA BASIC (Mitsubishi)"),
    **dict.fromkeys((".pdl", ".cod"), "PDL2 (Comau)"),
    **dict.fromkeys((".kl", ".pc"), "KAREL (FANUC), whose positions stand elsewhere"),
    ".tp": "FANUC's binary form of a program: save it as .ls (ASCII)",
    ".urp": "PolyScope's own form of a program (Universal Robots): save it as .script",
    ".urpx": "PolyScope's own form of a program (Universal Robots): save it as .script",
}
# Languages that share an ending with one that is read, by how their lines look.
_MELFA = re.compile(
    rb"^\s*\d+\s+(?:MOV|MVS|MVR|DLY|OVRD|SPD|SERVO|HOPEN|HCLOSE|DEF)\b|^\s*(?:Mov|Mvs|Dly|Ovrd|Servo)\s", re.M | re.I
)
_LOOKED_AT = 20_000  # bytes

_SPEAKS: Mapping[str, str] = {
    r"abb|irb\d*|gofa|yumi": "RAPID",
    r"kuka|kr\d+|iiwa": "KRL",
    r"fanuc|lrmate\w*|crx\d*": "FANUC LS",
    r"ur\d+e?|universal": "URScript",
    r"motoman|yaskawa": "INFORM",
    r"staubli": "VAL3",
    r"kawasaki": "AS",
    r"denso": "PAC",
    r"doosan": "DRL",
    r"mitsubishi|melfa": "MELFA BASIC",
    r"comau": "PDL2",
}


def other_language(name: str, content: bytes = b"") -> str | None:
    """The language of a file that is a robot program, but in none that is read; None: it is not known as such."""
    suffix = PurePath(name).suffix.lower()
    if suffix == ".prg" and _MELFA.search(content[:_LOOKED_AT]) and b"ENDMODULE" not in content.upper():
        return "MELFA BASIC (Mitsubishi)"
    return _OTHERS.get(suffix)


def refusal(name: str, language: str) -> str:
    """The sentence on a program that is not read."""
    return f"{name}: is in {language}; programs are read in {READ}"


def foreign(arm: str, language: str) -> str:
    """The sentence on a program in another language than an arm's controller speaks, by its name; else empty."""
    spoken = language_of_arm(arm)
    if spoken is None or spoken == language:
        return ""
    return said("the arm {arm} speaks {spoken}, and this program is in {language}", arm=arm, spoken=spoken,
                language=language)  # fmt: skip


def language_of_arm(name: str) -> str | None:
    """The language that an arm's controller speaks, by its name; None where that is not known."""
    words = re.split(r"[^a-z0-9]+", name.lower())
    return next((said for form, said in _SPEAKS.items() if any(re.fullmatch(form, word) for word in words)), None)
