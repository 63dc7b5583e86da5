# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robot programs as text whose targets can be read and replaced; all else stays byte for byte.

One file a language: ABB RAPID, KUKA KRL, FANUC LS and URScript.
"""

from fastcal.programs.frames import Cell, Frames
from fastcal.programs.languages import SUFFIXES, doubts_on_joints, is_program, language_of, read_program
from fastcal.programs.loads import Carried, carried, stated_masses
from fastcal.programs.makers import foreign, language_of_arm, other_language, refusal
from fastcal.programs.program import Document, Language, Left, Move, Number, Program, Target, Word

__all__ = [
    "SUFFIXES",
    "Carried",
    "Cell",
    "Document",
    "Frames",
    "Language",
    "Left",
    "Move",
    "Number",
    "Program",
    "Target",
    "Word",
    "carried",
    "doubts_on_joints",
    "foreign",
    "is_program",
    "language_of",
    "language_of_arm",
    "other_language",
    "read_program",
    "refusal",
    "stated_masses",
]
