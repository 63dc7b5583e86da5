# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""PolyWorks|Inspector: tables of features with measured (Meas), nominal (Nom) and deviation (Dev) side by side."""

from fastcal.importers.dialect import Dialect, signed

DIALECT = Dialect("PolyWorks|Inspector", signed(r"PolyWorks|\bMeas\.? X\b.*\bNom\.? X\b"))
