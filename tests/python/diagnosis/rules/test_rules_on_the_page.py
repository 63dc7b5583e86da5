# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of the diagnosis lists every rule with the number that it has, and says why."""

import re
from pathlib import Path

from fastcal.diagnosis import rules

PAGE = Path(__file__).parents[4] / "docs" / "diagnosis.md"


def number(value: float | tuple[float, ...]) -> str:
    """As the page writes it."""
    return ", ".join(map(number, value)) if isinstance(value, tuple) else f"{value:g}"


def test_the_page_has_every_rule_with_its_number_and_reason() -> None:
    rows = re.findall(r"^\| `([A-Z_]+)` \| (.+?) \| (.+?) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert [(name, value) for name, value, _ in sorted(rows)] == [
        (name, number(value)) for name, value in sorted(vars(rules).items()) if name.isupper()
    ]
    assert all(len(reason) > 10 for _, _, reason in rows)
