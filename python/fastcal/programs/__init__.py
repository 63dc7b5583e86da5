# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robot programs as text whose targets can be read and replaced; all else stays byte for byte.

One file a language: ABB RAPID, KUKA KRL, FANUC LS and URScript.
"""

from fastcal.programs.frames import Cell, Frames
from fastcal.programs.languages import SUFFIXES, language_of, read_program
from fastcal.programs.program import Document, Language, Move, Number, Program, Target, Word

__all__ = [
    "SUFFIXES",
    "Cell",
    "Document",
    "Frames",
    "Language",
    "Move",
    "Number",
    "Program",
    "Target",
    "Word",
    "language_of",
    "read_program",
]
