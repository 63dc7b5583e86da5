# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""RoboDK: the table of a calibration project, joints beside measured points, and whether a row is valid.

Millimetres and degrees throughout, by its documentation.
"""

from fastcal.importers.dialect import Dialect, signed

DIALECT = Dialect(
    "RoboDK", signed(r"RoboDK|\bId\b.*\bValid\b.*\bJoint"), units={"length": ("mm", 1.0), "angle": ("deg", 1.0)}
)
