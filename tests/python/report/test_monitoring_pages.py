# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of a check, an update, a comparison and a history: in a browser, on a phone, in both languages."""

import html
import re

import numpy as np
import pytest

import fastcal
from fastcal.report.check_report import check_page
from fastcal.report.comparison_report import comparison_page
from fastcal.report.history_report import history_page
from fastcal.report.update_report import update_page
from fastcal.robot.robot import Robot

NAMES = ("check", "update", "comparison", "history")


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
    updated = fastcal.update(model, measured)
    drawn = {
        "check": (check_page, found[-1]),
        "update": (update_page, updated),
        "comparison": (comparison_page, fastcal.compare(model, updated.model)),
        "history": (history_page, fastcal.history(folder)),
    }
    return {(name, tongue): page(what, tongue) for name, (page, what) in drawn.items() for tongue in ("en", "de")}


def text(document: str) -> str:
    """What is read, without scripts and styles."""
    body = re.sub(r"<(script|style).*?</\1>", "", document, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]+>", " ", body))


def test_pages_say_what_was_found_in_both_languages(pages) -> None:
    assert "The arm has changed: joint 3 zero by +0.0" in text(pages["check", "en"])
    assert "Der Roboter hat sich verändert: Nullpunkt joint 3 um +0,0" in text(pages["check", "de"])
    assert "beyond the tolerance of 0.3 mm" in text(pages["check", "en"])
    assert "1 of" in text(pages["comparison", "en"])
    assert "parameters differ beyond noise" in text(pages["comparison", "en"])
    assert "1 of 1 arms ask for attention" in text(pages["history", "en"])
    for (name, tongue), document in pages.items():
        assert f'<html lang="{tongue}">' in document, name
        assert "<b>7</b>" not in document, name


def test_every_drawing_has_a_text_in_its_place(pages) -> None:
    for name in NAMES:
        drawings = re.findall(r'class="plot" role="img" aria-label="([^"]*)"', pages[name, "en"])
        assert drawings, name
        assert all(len(alt) > 30 for alt in drawings), name


@pytest.mark.parametrize("name", NAMES)
def test_pages_are_drawn_and_the_console_is_quiet(browser, pages, name) -> None:
    document, console = browser.run(pages[name, "en"], "--dump-dom", *browser.no_gl)
    assert console == []
    assert document.count('data-state="drawn"') == pages[name, "en"].count('<div class="plot"') > 0


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
