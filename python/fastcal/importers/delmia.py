# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""DELMIA calibration (Auto ID): tags with x, y, z, roll, pitch, yaw and joints; mm and deg by its documentation."""

from fastcal.importers.dialect import Dialect, signed

DIALECT = Dialect(
    "DELMIA",
    signed(r"DELMIA|\bTag name\b.*\bRoll\b.*\bJoint"),
    units={"length": ("mm", 1.0), "angle": ("deg", 1.0)},
    orientation="rpy",
)
