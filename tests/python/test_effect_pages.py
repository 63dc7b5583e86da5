# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of effects: complete, their figures drawn by the script beside them, their C++ listings those built."""

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from fastcal import _core

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "effects"
HEADINGS = ["Equation", "Typical size", "What it is confused with", "What data it needs"]


@pytest.fixture(scope="module")
def figures() -> dict[str, Any]:
    """What docs/effects/figures.py defines."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PAGES)
        return runpy.run_path(str(PAGES / "figures.py"))


@pytest.mark.parametrize("effect", _core.effect_names())
def test_every_effect_has_a_complete_page(effect: str) -> None:
    text = (PAGES / f"{effect}.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (.*)$", text, re.MULTILINE) == HEADINGS
    assert f"`{effect}` · owner: " in text
    assert f"]({effect}.svg)" in text
    assert (PAGES / f"{effect}.svg").exists()


def test_no_page_is_of_an_effect_that_is_not() -> None:
    assert {page.stem for page in PAGES.glob("*.md")} == set(_core.effect_names())


def test_no_figure_is_of_an_effect_that_is_not(figures: dict[str, Any]) -> None:
    assert {figure.__name__ for figure in figures["FIGURES"]} == {file.stem for file in PAGES.glob("*.svg")}


def test_figures_are_what_fastcal_simulates(figures: dict[str, Any]) -> None:
    """To a tenth of a pixel, whatever the machine's last bit."""
    numbers = re.compile(r"-?\d+\.?\d*")
    for figure in figures["FIGURES"]:
        drawn, kept = figures["svg"](figure()), (PAGES / f"{figure.__name__}.svg").read_text(encoding="utf-8")
        assert numbers.sub("#", drawn) == numbers.sub("#", kept)
        now, then = ([float(n) for n in numbers.findall(text)] for text in (drawn, kept))
        assert now == pytest.approx(then, abs=0.11), figure.__name__


def test_no_number_at_the_axis_covers_its_title() -> None:
    """The title is a line of 11 px type around x = 9; a digit of that size is 6.7 px wide."""
    for file in PAGES.glob("*.svg"):
        numbers = re.findall(r'<text x="([\d.]+)"[^>]* text-anchor="end">([^<]*)<', file.read_text(encoding="utf-8"))
        assert numbers, file.name
        assert min(float(x) - 6.7 * len(text) for x, text in numbers) > 15, file.name


def test_the_listings_of_the_guide_are_those_that_are_built() -> None:
    text = (ROOT / "docs" / "adding-an-effect.md").read_text(encoding="utf-8")
    listings = re.findall(r"```cpp\n(.*?)```", text, re.DOTALL)
    built = ROOT / "tests" / "cpp" / "examples"
    assert listings == [
        (built / name).read_text(encoding="utf-8") for name in ("cable_pull.cpp", "cable_pull_test.cpp")
    ]
