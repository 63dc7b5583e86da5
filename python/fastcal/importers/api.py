# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""API trackers (Radian, OT2, iLT): numbered points with a standard deviation and the time of day."""

from fastcal.importers.dialect import Dialect, signed

DIALECT = Dialect("API tracker", signed(r"\bAPI (Radian|OT2|iLT|Tracker|T3)\b|\bRadian (Pro|Plus|Core)\b"))
