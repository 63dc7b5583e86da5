# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of a check, an update, a comparison and a history: in a browser, on a phone, in both languages."""

import html
import re
from dataclasses import replace

import numpy as np
import pytest

import fastcal
from fastcal.monitoring.history import ArmHistory, History
from fastcal.monitoring.result import NextPose
from fastcal.monitoring.words import kept_sentence
from fastcal.report.arms_report import arms_page
from fastcal.report.check_report import check_page
from fastcal.report.comparison_report import comparison_page
from fastcal.report.history_report import history_page
from fastcal.report.language import in_language
from fastcal.report.sections import printed
from fastcal.report.summaries import headline
from fastcal.report.update_report import update_page
from fastcal.robot.robot import Robot

from .pages_of_arms import write_hundred

NAMES = ("check", "update", "comparison", "history", "arms")


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], str]:
    """All pages in both languages, of an arm whose joint 3 has moved."""
    nominal = fastcal.load_robot("staubli_rx160l")
    true = fastcal.perturbed(nominal, seed=3)
    data = fastcal.simulate(true, fastcal.random_poses(nominal, 60, seed=1), noise=3e-5, seed=2)
    model = fastcal.calibrate(nominal, data, who={"serial": "<b>7</b>", "date": "2026-01-05"}).model
    q = fastcal.check_poses(model, 10).q
    folder = tmp_path_factory.mktemp("arm")
    found = []
    for month, turn in enumerate((0.0, 0.0, 0.03)):
        spec = Robot(true.spec).spec
        spec["joints"][2]["theta_deg"] += turn
        measured = fastcal.simulate(Robot(spec), q, noise=3e-5, seed=month)
        found.append(fastcal.check(model, measured, tolerance=3e-4, who={"date": f"2026-0{month + 2}-05"}))
        found[-1].save(folder / f"{month}.json")
    asked = NextPose((-123.45, -101.23, 145.67, -170.12, -112.34, -265.43), 12.5)
    found[-1] = replace(found[-1], next_poses=[asked] * 3)
    updated = fastcal.update(model, measured)
    arms = tmp_path_factory.mktemp("arms")
    for arm, data in (("A", measured), ("B", fastcal.simulate(true, q, noise=3e-5, seed=9)), ("C", None)):
        (arms / arm).mkdir()
        model.save(arms / arm / "model.yaml")
        if data is not None:
            fastcal.write_measurements(arms / arm / "2026-11.csv", data)
    drawn = {
        "check": (check_page, found[-1]),
        "update": (update_page, updated),
        "comparison": (comparison_page, fastcal.compare(model, updated.model)),
        "history": (history_page, fastcal.history(folder)),
        "arms": (arms_page, fastcal.check_arms(arms)),
    }
    return {(name, tongue): page(what, tongue) for name, (page, what) in drawn.items() for tongue in ("en", "de")}


def text(document: str) -> str:
    """What is read, without scripts and styles."""
    body = re.sub(r"<(script|style).*?</\1>", "", document, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]+>", " ", body))


def test_pages_say_what_was_found_in_both_languages(pages) -> None:
    assert "The arm has changed: joint 3 zero by +0.0" in text(pages["check", "en"])
    assert "Der Roboter hat sich verändert: Nullpunkt Gelenk 3 um +0,0" in text(pages["check", "de"])
    assert "beyond the tolerance of 0.3 mm" in text(pages["check", "en"])
    assert "1 of 18 parameters differs beyond noise" in text(pages["comparison", "en"])
    assert "This arm needs attention." in text(pages["history", "en"])
    assert "1 of 3 arms has changed: A." in text(pages["arms", "en"])
    assert "1 von 3 Robotern hat sich verändert: A." in text(pages["arms", "de"])
    assert "1 Alarm " in text(pages["history", "de"])
    assert "seit das Modell entstand, wurde nichts gemessen" in text(pages["arms", "de"])
    for (name, tongue), document in pages.items():
        assert f'<html lang="{tongue}">' in document, name
        assert "<b>7</b>" not in document, name


@pytest.mark.parametrize("name", NAMES)
def test_everybody_can_use_them_in_light_and_dark(pages, fit_for_all, name: str) -> None:
    fit_for_all(pages[name, "de"])


def test_a_comparison_shows_the_arm_and_what_moves_the_tool(pages) -> None:
    document = pages["comparison", "en"]
    assert 'id="figure-workspace"' in document
    assert "from the point of A towards that of B" in document
    assert 'id="figure-sizes"' in document
    assert "coloured by how far their change moves the tool (RMS): joint 3 " in document


def test_a_comparison_names_what_differs(pages) -> None:
    verdict = pages["comparison", "en"].split('<section class="verdict', 1)[1].split("</section>")[0]
    assert re.search(r"Joint\xa03 theta differs by 0\.0\d+ ± 0\.0\d+°, from 89\.\d+ to 90\.\d+°\.", verdict)


def test_a_german_page_has_no_english_names_and_signs(pages) -> None:
    """Sentences kept in files among them; "joint" stands in no word but in file names, of which there are none here."""
    for name in NAMES:
        read = text(pages[name, "de"])
        assert not re.findall(r"\b(joint|link|zero|compliance|holds|changed)\b", read), name
        assert not re.findall(r"\d \+- |\d deg\b", read), name
        assert not re.findall(r"\d\.\d+ mm", read), name
        assert not re.findall(r">[^<]*\d\.\d[^<]*</td>", pages[name, "de"]), name


def test_a_number_that_rounds_to_zero_has_no_sign(pages) -> None:
    for (name, tongue), document in pages.items():
        assert not re.findall(r"[-\N{MINUS SIGN}]0[.,]0+(?![\d.,])", text(document)), (name, tongue)


def test_a_kept_sentence_is_that_of_the_check_and_damage_leaves_it_as_it_was() -> None:
    kept = {
        "verdict": "changed", "within_tolerance": False, "tolerance_mm": 0.3, "max_mm": 0.5, "degrees_of_freedom": 18,
        "sentence": "as it was",
        "causes": [{
            "kind": "zero", "label": "joint3 zero", "probability": 1.0, "equivalents": ["tool"],
            "changes": [{"name": "theta_deg", "owner": "joint3", "value": 90.02, "std": 0.002, "unit": "deg",
                         "was": 90.0, "p_value": 1e-9, "change": 0.02}],
        }],
    }  # fmt: skip
    assert kept_sentence(kept) == (
        "The arm has changed: joint 3 zero by +0.0200 +- 0.0020 deg, or tool. "
        "The largest error, 0.500 mm, is beyond the tolerance of 0.3 mm."
    )
    for damage in (
        {"causes": [{"kind": "zero"}]},
        {"causes": 3},
        {"max_mm": "x"},
        {"causes": [{**kept["causes"][0], "label": None}]},
    ):
        assert kept_sentence(kept | damage) == "as it was"


def test_every_drawing_has_a_text_in_its_place(pages) -> None:
    for name in NAMES:
        drawings = re.findall(r'class="plot" role="img" aria-label="([^"]*)"', pages[name, "en"])
        assert drawings, name
        assert all(len(alt) > 30 for alt in drawings), name


@pytest.mark.parametrize("name", NAMES)
def test_pages_are_drawn_and_the_console_is_quiet(browser, pages, name) -> None:
    document, console = browser.run(pages[name, "en"])
    assert console == []
    assert document.count('data-state="drawn"') == pages[name, "en"].count('<div class="plot"') > 0


@pytest.mark.parametrize("tongue", ["en", "de"])
def test_no_table_of_a_check_scrolls_sideways_on_a_phone(browser, pages, tongue) -> None:
    """The six joints and the payload of the poses to measure next did, and German column heads."""
    script = """return [document.documentElement.scrollWidth,
      [...document.querySelectorAll(".table-box")].map((box) => box.scrollWidth - box.clientWidth)];"""
    width, over = browser.phone(pages["check", tongue], script)
    assert width == 400
    assert over
    assert max(over) <= 0


def test_drawing_fits_nothing(pages, monkeypatch: pytest.MonkeyPatch) -> None:
    """A page is made of its result alone: no alignment, no linearization."""
    from fastcal import _core

    result = fastcal.load_robot("staubli_rx160l")
    model = fastcal.calibrate(
        result,
        fastcal.simulate(fastcal.perturbed(result, seed=1), fastcal.random_poses(result, 40, seed=2), noise=3e-5),
    ).model
    found = fastcal.check(model, fastcal.simulate(model, fastcal.check_poses(model, 6).q, noise=3e-5))
    same = fastcal.compare(model, model)
    for name in ("align", "linearize", "identify"):
        monkeypatch.setattr(_core, name, None)
    monkeypatch.setattr(np.linalg, "lstsq", None)
    assert check_page(found)
    assert comparison_page(same)


def test_a_fleet_of_a_hundred_arms_is_a_matrix_whose_lines_lead_to_the_arms(browser, tmp_path) -> None:
    """Those that ask for attention are open, the others a click away; the page is three screens high."""
    write_hundred(tmp_path / "history")
    found = fastcal.history(tmp_path / "history")
    assert len(found.arms) == 100
    script = """
      const height = document.documentElement.scrollHeight;
      const plot = document.querySelector("#figure-months .plot");
      const last = document.getElementById("arm-20").querySelector("details");
      const before = last.open;
      plot.emit("plotly_click", { points: [{ y: 20 }] });
      const named = [...plot.querySelectorAll(".ytick")].map((each) => each.textContent);
      const folded = document.querySelectorAll("section[id^=arm-] > details").length;
      return [height, named, before, last.open, folded];"""
    height, named, before, after, folded = browser.probe(history_page(found), script)
    assert height < 3 * 1230
    assert named == ["A017, A060"]  # of lines too low for a name each, those that ask for attention
    assert (before, after) == (False, True)
    assert folded == 22  # of 24 with charts two ask for attention


def test_a_fleet_of_one_is_one_arm_and_german_lists_of_decimals_are_parted() -> None:
    one = History("fleet", [ArmHistory("a", "ur5", [], [], [], [])])
    assert headline(one) == "1 arm, 0 files, 0 alarms"
    with in_language("de"):
        assert headline(one) == "1 Roboter, 0 Dateien, 0 Alarme"
        assert printed("xyz 0.03, -0.02, 0.34 mm, rpy 1.5") == "xyz 0,03; −0,02; 0,34 mm, rpy 1,5"
    assert printed("xyz 0.03, -0.02 mm") == "xyz 0.03, −0.02 mm"
