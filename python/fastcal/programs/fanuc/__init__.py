# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""FANUC LS: positions P[n] of group 1 in the section /POS, used by the moves of /MN.

X, Y, Z in mm; W, P, R in deg, R = Rz(R) Ry(P) Rx(W); or J1 ... in deg (mm for a sliding one). CONFIG is three letters
and the turns of axes 1, 4 and 6: N or F, J5 negative or at least 0; U or D, elbow up or down; T or B, the wrist centre
before or behind axis 1; a turn k means 360 k - 180 <= J < 360 k + 180. Held against pairs that controllers wrote:
tests/python/programs/maker_facts/fanuc.yaml.
"""

from fastcal.programs.fanuc.language import Fanuc
from fastcal.programs.fanuc.reading import is_program, read

__all__ = ["Fanuc", "is_program", "read"]
