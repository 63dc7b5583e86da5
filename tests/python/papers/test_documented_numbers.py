# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The numbers that the docs give of the papers' studies are those of the committed results."""

from pathlib import Path
from typing import Any

import pytest

from fastcal.io.results import read_json
from fastcal.papers import NAMES
from fastcal.papers.exhibits import COMPARED
from fastcal.papers.page import paper_page
from fastcal.report.formatting import significant

ROOT = Path(__file__).parents[3]


def kept(name: str) -> dict[str, Any]:
    return read_json(ROOT / "bench" / "papers" / f"{name}.json")


def median(content: dict[str, Any], title: str, row: str, column: str) -> str:
    """The median in a cell of a kept table, with the page's three digits."""
    tables = [e for s in content["sections"] for e in s["exhibits"] if e["kind"] == "table" and e["title"] == title]
    (table,) = tables
    (cells,) = [cells for cells in table["rows"] if cells[0] == row]
    cell = cells[table["columns"].index(column)]
    value = cell["median"] if isinstance(cell, dict) else cell
    return f"{value:.0f}" if float(value).is_integer() else significant(value)


# Lines of the docs by file, with a place for every number that comes from a kept file:
# (study, title of the table, row, column).
FEW, MANY = "fitted to 15 poses", "the same fitted to 100 random poses (not in the paper)"
KR500 = ("27 here", "33 here", "fastcal's best")
RIVALS = "mean error (mm) with equal budgets"
SPRAY = ("geometry", "geometry and beams as in the file, the paper's", "geometry and beams of identified stiffness")
LINES: list[tuple[str, str, list[tuple[str, str, str, str]]]] = [
    (
        "docs/papers.md",
        "| 15 poses fitted, largest error of five others | 0.5 | {} | {} | {} |",
        [("kuka_kr500", FEW, "five held out, max", column) for column in KR500],
    ),
    (
        "docs/papers.md",
        "| the same poses, 200 unseen, mean | | {} | {} | {} |",
        [("kuka_kr500", FEW, "200 unseen, mean", column) for column in KR500],
    ),
    (
        "docs/papers.md",
        "| 100 poses fitted, 200 unseen, mean | | {} | {} | {} |",
        [("kuka_kr500", MANY, "200 unseen, mean", column) for column in KR500],
    ),
    (
        "docs/papers.md",
        "| network, 200 poses not learnt | 0.6522 | {} | {} |",
        [("siasun_sr210d", "200 others", "after, mean", column) for column in COMPARED[2:]],
    ),
    (
        "docs/papers.md",
        "from a random start the same network leaves {} mm",
        [("siasun_sr210d", RIVALS, "a random start", "200 others")],
    ),
    (
        "docs/papers.md",
        "errors to points: `mlp` behind the paper's own model leaves {} mm",
        [("siasun_sr210d", RIVALS, "fastcal's mlp behind the paper's model", "200 others")],
    ),
    (
        "docs/papers.md",
        "The genetic algorithm needs the fewest, {}.",
        [("siasun_sr210d", "searches on the Michalewicz function", "GA", "evaluations where reached")],
    ),
    (
        "docs/papers.md",
        "within 3,000 evaluations in {} % of the starts",
        [("siasun_sr210d", "searches on the Michalewicz function", "BAS", "reached, % of the starts")],
    ),
    *(
        (
            "docs/papers.md",
            f"| {axis} ({word}) | {{}} ({{}}) | {{}} ({{}}) | {{}} ({{}}) |",
            [
                ("spray_7dof", "errors of the hidden arm (mm)", f"{model}, {axis}", statistic)
                for model in SPRAY
                for statistic in ("mean", "max")
            ],
        )
        for axis, word in (("X", "reach"), ("Y", "vertical"), ("Z", "rail"))
    ),
]


@pytest.mark.parametrize(("file", "line", "places"), LINES, ids=[line[1][:40] for line in LINES])
def test_a_documented_number_is_the_kept_one(file: str, line: str, places: list[tuple[str, str, str, str]]) -> None:
    expected = line.format(*(median(kept(study), *place) for study, *place in places))
    assert expected in (ROOT / file).read_text(encoding="utf-8")


HEADLINES = [
    ("docs/papers.md", "| geometry, ratios and coupling, 50 poses held out | 0.3008 | {} | {} |", "siasun_sr210d", 0),
    ("docs/papers.md", "| stiffness under 210 kg, 200 poses not fitted | 0.9370 | {} | {} |", "siasun_sr210d", 1),
]


@pytest.mark.parametrize(("file", "line", "study", "place"), HEADLINES, ids=[line[1][:40] for line in HEADLINES])
def test_a_documented_headline_is_the_kept_one(file: str, line: str, study: str, place: int) -> None:
    headline = kept(study)["headlines"][place]
    expected = line.format(*(significant(headline[key]["median"]) for key in ("method", "best")))
    assert expected in (ROOT / file).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", NAMES)
def test_a_kept_study_can_be_drawn_and_betters_its_paper_s_method(name: str) -> None:
    content = kept(name)
    assert content["paper"]["name"] == name
    assert all(headline["bettered"] for headline in content["headlines"])
    assert all(headline["reached"] or headline["why"] for headline in content["headlines"])
    assert paper_page(content).count("<figure") == sum(
        exhibit["kind"] == "chart" for section in content["sections"] for exhibit in section["exhibits"]
    )
