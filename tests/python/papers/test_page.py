# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page and the command of a study, from a made-up one and from the cheapest real one."""

import dataclasses
import html
import json
import re
from pathlib import Path
from typing import Any

import pytest

import fastcal
from fastcal.cli import main
from fastcal_studies import NAMES, load_study, run_study
from fastcal_studies.exhibits import Absent, Chart, Headline, Page, Section, Series, Spread, Table, spread, worlds_won
from fastcal_studies.page import paper_page


def made_up() -> dict[str, Any]:
    """The content of a study whose method falls behind its paper."""
    headline = Headline("error (mm)", 0.1, Spread(0.3, 0.2, 0.4), Spread(0.05, 0.04, 0.06), "plain", "It is softer.")
    page = Page(
        [headline],
        [
            Section(
                "One",
                "A lead.",
                [
                    Table(
                        "Table 1",
                        "of numbers",
                        ("mm", "paper", "here"),
                        [["mean", None, Spread(1.5, 0.5, 2.1)], ["compliance (nrad/N m)", None, "-0.1 (-2 to 3)"]],
                        "a note",
                    ),
                    Chart(
                        "Figure 1", "of lines", "pose", "error (mm)", [Series("before", [1, 2], [3.0, 4.0], "before")]
                    ),
                    Absent("Figure 2", "it is a <photograph>."),
                    Absent("Figures 3 and 4", "they are bars."),
                ],
            )
        ],
        ["A remark."],
    )
    content = dataclasses.asdict(page)
    content["headlines"][0] |= {"reached": headline.reached, "bettered": headline.bettered}
    paper = {"name": "made_up", "robot": "arm", "reference": "Somebody, 2020", "arm": ["Chosen."]}
    return {"paper": paper, "arms": 3, "full": False, **content, "runs": []}


def test_a_lead_is_counted_by_the_medians_of_each_world() -> None:
    arms = [(1.0, 2.0), (3.0, 2.5), (1.5, 2.0)]  # medians 1.5 and 2.0; in the third world the other way round
    runs = [
        {"worlds": {"joints": {"a": a, "b": b}, "point": {"a": a, "b": b}, "links": {"a": b, "b": a}}} for a, b in arms
    ]
    assert worlds_won(runs, "a", "b") == "2 of 3 worlds"
    assert worlds_won(runs, "a", "a") == "0 of 3 worlds"


def test_the_page_says_where_the_method_falls_behind_and_what_is_not_shown() -> None:
    text = paper_page(made_up())
    assert "Error (mm): 0.300 here, 0.100 in the paper. It is softer." in text
    assert 'class="verdict caution"' in text
    assert "1.50 (0.500\N{NO-BREAK SPACE}to\N{NO-BREAK SPACE}2.10)" in text
    assert "compliance (nrad/N\N{NO-BREAK SPACE}m)" in text
    assert "\N{MINUS SIGN}0.1 (\N{MINUS SIGN}2 to 3)" in text
    assert "<strong>Figure 2</strong> is not shown: it is a &lt;photograph&gt;." in text
    assert "<strong>Figures 3 and 4</strong> are not shown: they are bars." in text
    assert "Simulated data" in text


def test_a_lead_that_a_world_does_not_show_is_no_lead() -> None:
    content = made_up()
    (headline,) = content["headlines"]
    headline |= {"paper": 0.5, "reached": True}
    assert 'class="verdict good"' in paper_page(content)
    assert "of these the ranges over the arms do not overlap" in paper_page(content)
    headline["best"]["high"] = 0.25
    assert "on 1 the median of fastcal&#39;s best on the same data is lower, on 0 of these" in paper_page(content)
    rows = [[name, {"median": 0.3}, {"median": best}] for name, best in (("joints", 0.2), ("point", 0.3))]
    table = {"number": "Three worlds", "title": "mean", "columns": ["", "paper", "best"], "note": "", "kind": "table"}
    for row in rows:
        for cell in row[1:]:
            cell |= {"low": 0.1, "high": 0.4}  # type: ignore[operator]
    content["sections"] = [{"title": "Three worlds", "lead": "", "exhibits": [table | {"rows": rows}]}]
    text = paper_page(content)
    assert "It leaves less than every other line in 1 of 2 worlds of hidden errors, by the medians." in text
    assert 'class="verdict caution"' in text


def test_one_arm_has_no_median_and_no_range() -> None:
    text = html.unescape(paper_page(made_up() | {"arms": 1}))
    assert "on this one arm; on 1 fastcal's best on the same data leaves less." in text
    assert "median of fastcal" not in text
    assert "by the medians" not in text


def test_numbers_with_their_own_digits_stand_right_and_words_left() -> None:
    content = made_up()
    rows = [["L1", "313.101 (-2.5 to 3)", "0.4 kg"], ["L2", "-0.5", "0.4"], ["L3", None, None]]
    content["sections"][0]["exhibits"][0] |= {"columns": ("", "found", "loads"), "rows": rows}
    heads = re.findall(r"<th([^>]*)>(found|loads)", paper_page(content))
    assert ["numeric" in of or "number" in of for of, _ in heads] == [True, False]


def test_a_spread_is_median_least_and_greatest() -> None:
    assert spread([{"a": {"b": x}} for x in (3.0, 1.0, 9.0)], "a", "b") == Spread(3.0, 1.0, 9.0)


def test_a_study_is_found_by_its_name_or_refused() -> None:
    for name in NAMES:
        assert load_study(name).PAPER.robot in fastcal.robots.available()
    with pytest.raises(fastcal.InvalidInput, match="unknown paper 'kuka', expected one of"):
        load_study("kuka")
    with pytest.raises(fastcal.InvalidInput, match="at least one arm, got 0"):
        run_study(NAMES[0], arms=0)


@pytest.mark.usefixtures("known_kr500")
def test_the_command_writes_json_and_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["paper", "kuka_kr500", "--arms", "1", "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.splitlines()[-1] == str(tmp_path / "out" / "report.html")
    content = json.loads((tmp_path / "out" / "paper.json").read_text())
    assert content["arms"] == len(content["runs"]) == 1
    page = (tmp_path / "out" / "report.html").read_text()
    assert paper_page(content) == page
    for section in content["sections"]:
        for exhibit in section["exhibits"]:
            assert html.escape(exhibit["number"], quote=False).replace("'", "&#39;") in page


@pytest.mark.full
def test_two_processes_find_what_one_finds() -> None:
    one, two = (run_study("kuka_kr500", arms=2, threads=threads) for threads in (1, 2))
    assert one == two


def test_every_figure_is_drawn(browser: Any) -> None:
    document, console = browser.run(paper_page(made_up()))
    assert console == []
    assert re.findall(r'data-state="(\w+)"', document.split("<main")[1]) == ["drawn"]


def test_nothing_is_written_for_an_unknown_name(tmp_path: Path) -> None:
    assert main(["paper", "abb", "-o", str(tmp_path / "out")]) == 2
    assert not (tmp_path / "out").exists()
