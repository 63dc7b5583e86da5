# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""URScript: p[x, y, z, rx, ry, rz] in m and rad (a rotation vector), and joint lists [q1 ... q6] in rad, or d2r(deg).

In a move, or given to a name that a move takes. set_tcp(p[...]) sets the tool, pose_trans(p[...], p[...]) a frame.
"""

from fastcal.programs.urscript.language import UrScript
from fastcal.programs.urscript.reading import read

__all__ = ["UrScript", "read"]
