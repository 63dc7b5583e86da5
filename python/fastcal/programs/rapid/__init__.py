# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""ABB RAPID: robtargets and jointtargets, declared, assigned or written into a move.

robtarget: [[x, y, z], [q1, q2, q3, q4], [cf1, cf4, cf6, cfx], [external axes]], mm and a quaternion w, x, y, z.
jointtarget: [[six joints], [external axes]], deg.
"""

from fastcal.programs.rapid.language import Rapid
from fastcal.programs.rapid.reading import read

__all__ = ["Rapid", "read"]
