# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""KUKA KRL: {X 1, Y 2, Z 3, A 4, B 5, C 6, S 2, T 35} and {A1 1, ... A6 6} in moves (.src) and lists (.dat).

Units mm and deg, R = Rz(A) Ry(B) Rx(C). S, the status: bit 0, the wrist centre is behind axis 1; bit 1, the elbow is up
(A3 beyond the angle at which the arm is stretched); bit 2, A5 < 0. T, the turn: bit i - 1, Ai < 0.
"""

from fastcal.programs.krl.language import Krl
from fastcal.programs.krl.reading import read

__all__ = ["Krl", "read"]
