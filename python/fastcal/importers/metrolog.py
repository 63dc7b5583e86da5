# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Metrolog: features with measured (mesuré) and nominal (théorique) coordinates, in the user's language."""

from fastcal.importers.dialect import Dialect, signed

DIALECT = Dialect("Metrolog", signed(r"Metrolog|X mesuré|X th[ée]orique"))
