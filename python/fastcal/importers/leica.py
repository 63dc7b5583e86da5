# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Leica trackers (AT401 to AT960, Tracker Pilot, emScon): points with RMS of each coordinate, weather and mode."""

from fastcal.importers.dialect import Dialect, signed

DIALECT = Dialect("Leica tracker", signed(r"emScon|Tracker Pilot|Measurement Mode|RMS Total"))
