# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the tests of all studies need."""

from collections.abc import Callable
from typing import Any

import pytest

from fastcal_studies.page import paper_page
from fastcal_studies.study import content


@pytest.fixture(scope="session")
def shown() -> Callable[[str, dict[str, Any]], dict[str, Any]]:
    """The content of one run, once it was drawn with the sentence where networks are missing."""

    def draw(name: str, run: dict[str, Any]) -> dict[str, Any]:
        out = content(name, [run])
        page = paper_page(out)
        assert page.count("<figure") == sum(e["kind"] == "chart" for s in out["sections"] for e in s["exhibits"])
        assert ("torch is not installed" in page) == ("networks" not in run and name != "spray_7dof")
        return out

    return draw
