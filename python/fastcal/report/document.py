# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What makes a page a document: whose arm, who measured it with what, which data and software, and room to sign."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastcal.report.language import _


def document_facts(made_by: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and text of what `made_by` holds, what only a person knows first; nothing where nothing is known."""
    texts = {
        _("Serial number"): made_by.get("serial"),
        _("Customer"): made_by.get("customer"),
        _("Operator"): made_by.get("operator"),
        _("Instrument"): made_by.get("instrument"),
        _("Date of measurement"): made_by.get("date"),
        _("Data"): ", ".join(made_by.get("data", [])),
        _("SHA-256 of the data"): made_by.get("data_sha256"),
        _("SHA-256 of the robot"): made_by.get("robot_sha256"),
        _("Software"): f"fastcal {made_by['fastcal']}" if "fastcal" in made_by else None,
    }
    return [(label, str(text)) for label, text in texts.items() if text]
