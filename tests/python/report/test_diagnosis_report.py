# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a diagnosis: numbers from what was hidden, names that drop takes, a quiet browser."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fastcal import _core, load_robot
from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.diagnosis import partial_residuals as partial
from fastcal.diagnosis.gap import KindGap
from fastcal.diagnosis.plan import SeparatingPlan
from fastcal.diagnosis.reasons import Because, BlockLabel, CauseLabel, Reason
from fastcal.diagnosis.result import NamedValue, Unexplained
from fastcal.diagnosis.words import reason_text, sentence_of
from fastcal.report import diagnosis_steps, diagnosis_words, shop
from fastcal.report.diagnosis_figures import alternatives, confusion_map, limits
from fastcal.report.diagnosis_report import diagnosis_page
from fastcal.report.diagnosis_tables import owners_text, smallest_by_kind
from fastcal.report.diagnosis_words import name_in_model
from fastcal.report.gap import waterfall
from fastcal.robot.dropped_effects import drop_effects
from fastcal.units import shop_unit


@pytest.fixture(scope="module")
def found(hidden_backlash) -> Diagnosis:
    return diagnose(hidden_backlash.robot, hidden_backlash.data, test=hidden_backlash.test)


@pytest.fixture(scope="module")
def unnamed(hidden_backlash) -> Diagnosis:
    """The same without the name: nothing else explains it."""
    return diagnose(hidden_backlash.robot, hidden_backlash.data, exclude=["backlash@joint3"])


def test_the_partial_residual_shows_the_backlash_that_was_hidden(found: Diagnosis, hidden_backlash) -> None:
    (finding,) = found.effects
    seen = partial.of_finding(found.final, finding)
    assert (seen.depends_on, seen.quantity, seen.unit) == (("approach3",), "joint", "rad")
    side, reading = seen.x[:, 0], seen.reading
    assert set(side) == {-1.0, 1.0}
    # Half the gap to either side, less what the zero of the joint took: the distance is the gap.
    for values, limit in ((reading.fitted, 4), (reading.before, 5)):
        distance = float(values[side > 0].mean() - values[side < 0].mean())
        std = 2 * float(reading.deviation.mean())
        assert abs(abs(distance) - hidden_backlash.gap) < limit * std
    assert abs(reading.after[side > 0].mean() - reading.after[side < 0].mean()) < 0.05 * hidden_backlash.gap
    np.testing.assert_array_equal(reading.before, reading.after + reading.fitted)


def test_the_band_is_that_of_the_calibration(found: Diagnosis) -> None:
    (finding,) = found.effects
    reading = partial.of_finding(found.final, finding).reading
    std = finding.parameters["gap_rad"].std
    assert std is not None
    # The joint's error is half the gap to either side: so is its deviation.
    assert float(reading.deviation.mean()) == pytest.approx(std / 2, rel=0.1)


def test_the_place_of_what_is_unexplained_is_drawn(unnamed: Diagnosis) -> None:
    remaining = Unexplained("joint3", 0.5, ("q3",))
    seen = partial.of_unexplained(unnamed.final, remaining.owner, remaining.depends_on)
    assert seen is not None
    assert seen.reading.before.shape == (len(seen.x), 1)
    assert np.all(np.isfinite(seen.reading.deviation))
    # The block takes what it explains: less is left with it than without.
    assert np.sum(seen.reading.after**2) < np.sum(seen.reading.before**2)
    assert partial.of_unexplained(unnamed.state, "joint3", ("no such variable",)) is None


def test_an_unexplained_part_that_no_column_shows_is_placed_without_a_figure(unnamed: Diagnosis) -> None:
    for owner, on in (("tool", ("gravity",)), ("tool", ("sight",))):
        assert any((g.owner, g.curves.depends_on) == (owner, on) for g in unnamed.final.blocks.generics)
        page = diagnosis_page(replace(unnamed, verdict="unexplained", unexplained=Unexplained(owner, 0.5, on)))
        assert 'id="unexplained"' in page
        assert 'id="figure-unexplained"' not in page


@pytest.mark.parametrize("on", [("q2", "q3"), ("x", "y", "z")])
def test_an_unexplained_part_of_several_variables_is_a_map(unnamed: Diagnosis, on: tuple[str, ...]) -> None:
    owner = "workspace" if "x" in on else "joint3"
    page = diagnosis_page(replace(unnamed, verdict="unexplained", unexplained=Unexplained(owner, 0.5, on)))
    assert 'id="figure-unexplained"' in page
    assert "Unexplained error" in page


def test_files_are_replaced_together(found: Diagnosis, tmp_path: Path) -> None:
    (tmp_path / "without_base_drift@base.patch").write_text("of an older version")
    (tmp_path / "mine.txt").write_text("kept")
    found.save(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"model.yaml", "diagnosis.json", "report.html", "mine.txt"}
    assert json.loads((tmp_path / "diagnosis.json").read_text())["verdict"] == "named"
    written = load_robot(tmp_path / "model.yaml")
    assert [e["effect"] for e in written.spec["effects"]] == ["backlash"]
    (finding,) = found.effects
    bare = drop_effects(written, name_in_model(finding))
    assert not bare.spec["effects"]
    assert bare.spec["joints"] == written.spec["joints"]


def test_the_page_says_what_was_found(found: Diagnosis) -> None:
    page = diagnosis_page(found)
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page.split("<main")[1].split("</main>")[0]))
    assert text.index("Named") < text.index("What to do now") < text.index("What is missing from the model")
    assert "arcmin" in text
    assert "fastcal drop model.yaml backlash@joint3 -o without.yaml" in text
    assert "error of joint 3" in page
    for id_ in ("gap", "confusion", "normal", "effect-backlash@joint3", "workspace"):
        assert f'id="figure-{id_}"' in page


def test_drawing_the_page_fits_nothing(found: Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    def fitted(*given: object, **named: object) -> None:
        raise AssertionError("a page fits")

    for name in ("identify", "linearize", "align", "ScoreTests", "SubsetSearch", "Alignment"):
        monkeypatch.setattr(_core, name, fitted)
    assert "What is missing from the model" in diagnosis_page(found)


@pytest.mark.parametrize("reason", list(Reason))
def test_every_reason_has_a_sentence(reason: Reason) -> None:
    because = Because(reason, 0.01, 15.0, (BlockLabel("joint4", ("q4",)),), ((2, 1e-3),))
    sentence = diagnosis_words.reason_sentence(because)
    assert sentence.endswith(".")
    assert "@" not in sentence
    assert "@" not in reason_text(because)


def test_in_a_browser_every_figure_is_drawn_and_the_console_is_quiet(browser, found: Diagnosis) -> None:
    document, console = browser.run(diagnosis_page(found))
    assert console == []
    plots = re.findall(r'<div class="plot[^>]*data-state="(\w+)"', document)
    assert len(plots) == len(re.findall(r"<figure ", document)) > 10
    assert set(plots) == {"drawn"}


def test_everybody_can_use_it_in_light_and_dark(found: Diagnosis, fit_for_all) -> None:
    fit_for_all(diagnosis_page(found))


SEEN = """() => {
  const seen = (e) => e.checkVisibility() && !e.closest(".unseen, .skip, .plot, select, script, style");
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  let words = 0;
  while (texts.nextNode())
    if (seen(texts.currentNode.parentElement)) words += (texts.currentNode.textContent.match(/\\S+/g) ?? []).length;
  const charts = [...document.querySelectorAll(".plot")].filter((plot) => plot.checkVisibility());
  return [words, charts.length]; }"""


@pytest.mark.parametrize("case", ["named", "several", "unexplained", "none"])
def test_a_page_is_read_in_minutes(chromium, found: Diagnosis, case: str, tmp_path: Path) -> None:
    """At most 900 words and 12 charts are in sight before anything is unfolded."""
    (finding,) = found.effects
    reasons = [Because(reason, 0.01, 15.0, (BlockLabel("joint4", ("q4",)),)) for reason in list(Reason)[:8]]
    many = [replace(finding, grade="C", limits=reasons)] * 10
    changed = {
        "named": {},
        "several": {"effects": many},
        "unexplained": {"effects": many, "unexplained": Unexplained("workspace", 0.5, ("x", "y", "z"))},
        "none": {"effects": [], "steps": found.steps[:1], "gap": found.gap[:1], "ranking": []},
    }[case]
    (tmp_path / "page.html").write_text(diagnosis_page(replace(found, verdict=case, **changed)), encoding="utf-8")
    page = chromium.new_page(viewport={"width": 1400, "height": 900})
    page.goto((tmp_path / "page.html").as_uri())
    page.locator('body[data-state="ready"]').wait_for(timeout=120_000)
    words, charts = page.evaluate(SEEN)
    assert 300 < words <= 900
    assert 3 <= charts <= 12
    if case == "several":  # a chip opens the card that it leads to
        page.locator('a[href="#cause-2"]').click()
        page.locator("#cause-2 .why").wait_for()
        assert page.evaluate(SEEN)[0] > words + 50
    page.close()


def test_many_causes_print_on_five_sheets(browser, found: Diagnosis) -> None:
    """The first eight with their names and sizes, the first one's figure, the arm; the screen has all."""
    (finding,) = found.effects
    several = replace(found, verdict="several", effects=[replace(finding, grade="B")] * 10)
    pdf, _ = browser.printed(diagnosis_page(several))
    assert len(re.findall(rb"/Type /Page\b", pdf)) <= 5


def test_nothing_missing_prints_on_three_sheets(browser, found: Diagnosis) -> None:
    """The fourth held the last line of the page. Where no grade is given, none is explained."""
    nothing = replace(found, verdict="none", effects=[], steps=found.steps[:1], gap=found.gap[:1], ranking=[])
    made_by = {"fastcal": "0", "data": ["measurements.csv"], "data_sha256": "0" * 64, "robot_sha256": "0" * 64}
    document = diagnosis_page(nothing, made_by=made_by)
    assert "Grade A" not in document
    assert "<dt>Grade A</dt>" in diagnosis_page(found)
    pdf, _ = browser.printed(document)
    assert len(re.findall(rb"/Type /Page\b", pdf)) <= 3


def test_causes_that_are_not_proved_share_a_sentence(found: Diagnosis) -> None:
    (finding,) = found.effects
    unproven = [replace(finding, grade="B", owner=f"joint{k}") for k in (2, 5)]
    tilt = replace(finding, grade="B", effect="bearing_tilt", owner="joint1")
    said = sentence_of(replace(found, effects=[finding, *unproven, tilt]))
    assert said.count("The data are consistent with") == 1
    assert "backlash (lost motion) at joint 2, joint 5; " in said
    assert said.startswith("Joint 3: backlash (lost motion), ")
    assert "consistent with joint 2: backlash (lost motion), but do not prove it." in sentence_of(
        replace(found, effects=unproven[:1])
    )


def test_limits_are_drawn_over_usual_sizes(found: Diagnosis) -> None:
    """A bar an effect, from the place where it shows best to the one where it shows worst."""
    kinds = smallest_by_kind(found)
    figure = limits(kinds)
    assert figure is not None
    drawn = {}
    for trace in figure.traces[:-1]:
        for k in range(0, len(trace["x"]), 3):
            drawn[trace["y"][k]] = trace["x"][k : k + 2]
    shown = [kind for kind in kinds if kind.name in drawn]
    assert len(shown) == len(drawn) > 3
    for kind in shown:
        low, high = drawn[kind.name]
        assert low == pytest.approx(min(s.value / u for s, u in zip(kind.members, kind.usual, strict=True) if u))
        assert bool(kind.hidden) == (high > 1)
        assert low <= high


def test_long_reasons_stand_below_their_causes(found: Diagnosis) -> None:
    """In the names of a cell, on paper: one line would run over the edge."""
    short, far = alternatives(found), alternatives(found, lambda text: f"{text} {'x' * 60}")
    assert not any("<br>" in each["text"] for each in short.layout["annotations"])
    assert all("</b><br>" in each["text"] and each["align"] == "left" for each in far.layout["annotations"])
    assert far.height > short.height


def test_the_waterfall_adds_up() -> None:
    figure = waterfall([("geometry alone", 0.5), ("a", 0.3), ("b", 0.35)], 0.1, "test poses")
    bars = figure.traces[0]
    assert bars["x"] == pytest.approx([0.5, 0.2, 0.05, 0.35])
    assert bars["base"] == pytest.approx([0.0, 0.3, 0.3, 0.0])
    assert set(figure.traces[1]["x"]) == {0.1}
    assert [y for y in figure.traces[1]["y"] if y is not None] == pytest.approx(
        [-0.3, 0.3, 0.7, 1.3, 1.7, 2.3, 2.7, 3.3]
    )


def test_no_line_runs_through_a_word_of_the_waterfall() -> None:
    """The line of the noise stands beside bars alone; a size that it would cross is written behind it."""
    figure = waterfall([("base and tool alone", 1.8), ("the geometry", 0.05)], 0.06, "test poses")
    *names, first, step, rest = figure.layout["annotations"]
    assert [name["y"] for name in names] == pytest.approx([-0.3, 0.7, 1.7])  # each ends above its bar and the line
    assert [size["x"] for size in (first, step, rest)] == pytest.approx([1.8, 1.8, 0.06])
    far = waterfall([("base and tool alone", 1.8), ("the geometry", 0.05)], 1.2, "test poses")
    assert far.layout["annotations"][-1]["x"] == pytest.approx(0.05)  # it ends before the line


def test_a_step_that_takes_next_to_nothing_does_not_take_minus_nothing() -> None:
    texts = waterfall([("places alone", 0.173), ("a", 0.1723), ("b", 0.17228)], 0.059, "test poses").traces[0]
    assert texts["customdata"][1:3] == ["\N{MINUS SIGN}0.001 mm", "\N{MINUS SIGN}0.00002 mm"]


def test_long_names_beside_an_axis_stand_on_two_lines_of_a_narrow_screen(found: Diagnosis) -> None:
    kinds = smallest_by_kind(found)
    named = {"short": "turn", "long": "turn for each moment of the bearings that it is seated in"}
    drawn = {
        size: limits([replace(kind, effect="backlash", kind=name)]) for size, name in named.items() for kind in kinds
    }
    assert drawn["short"] is not None
    assert drawn["short"].narrow == {"xaxis.dtick": 2}
    assert drawn["long"] is not None
    narrow = drawn["long"].narrow
    assert narrow["yaxis.tickvals"] == drawn["long"].layout["yaxis"]["categoryarray"]
    assert narrow["yaxis.ticktext"] == ["Backlash, turn for each moment<br>of the bearings that it is<br>seated in"]
    assert narrow["height"] > drawn["long"].height


def test_the_map_frames_what_is_given() -> None:
    figure = confusion_map(["a", "b"], np.array([[1.0, -0.9], [-0.9, 1.0]]), [1])
    assert figure.traces[0]["z"].tolist() == [[1.0, 0.9], [0.9, 1.0]]
    assert [(s["x0"], s["x1"]) for s in figure.layout["shapes"]] == [(0.5, 1.5)]


def test_numbers_are_in_the_units_of_the_shop_floor() -> None:
    minute = np.pi / 180 / 60
    assert shop.value_text("gap_rad", 1.5 * minute, 0.06 * minute) == "1.500 ± 0.060 arcmin"
    assert shop.size_text("1_k", 11.5e-6) == "12 µm/(m\N{NO-BREAK SPACE}K)".replace("µ", "\N{MICRO SIGN}")
    assert shop.size_text("mm_s", 0.05 / 3600) == "50 \N{MICRO SIGN}m/h"
    lines = shop.estimate_lines("joint_compliance", {"compliance_rad_nm": NamedValue(minute / 200, None)})
    assert lines[1] == ("as a stiffness", "200 N\N{NO-BREAK SPACE}m/arcmin")
    assert shop.estimate_text({"sine_2x_rad": 3 * minute, "cosine_2x_rad": 4 * minute}) == "5.0 arcmin"
    assert shop_unit("rad", minute / 60).of(minute) == pytest.approx(60)


def test_names_are_spoken() -> None:
    assert shop.number_in_words("rate_rx") == "turn rate about x"
    assert shop.number_in_words("step_z") == "shift along z"
    assert shop.number_in_words("inverse_ei") == "1/EI"
    assert shop.kind_in_words("base_drift", "rate_rx") == "turn rate"
    assert shop.kind_in_words("thermal_offset", "") == "turn per kelvin"
    spoken = diagnosis_words.spoken
    assert spoken(CauseLabel("joint_compliance", "joint3")) == "joint 3 compliance"
    assert spoken(CauseLabel("base_drift", "base")) == "base drift"
    assert spoken(CauseLabel("gear_harmonic", "joint2", "order=2")) == "joint 2 gear harmonic, order 2"
    assert spoken(CauseLabel("coupling_ratio", "joint6<-joint5")) == "joint 6 from joint 5 coupling ratio"
    left = BlockLabel("joint4", ("q4", "q6"))
    assert diagnosis_words.reason_sentence(Because(Reason.LEAVES_MORE, 1e-5, subjects=(left,))) == (
        "With it in the model, something at joint 4 that depends on the positions of joint 4 and joint 6 is still "
        "significant; noise alone would look like this in less than 1 of 100\N{NARROW NO-BREAK SPACE}000 data sets."
    )
    assert owners_text(["joint1", "joint2", "joint3", "link2"]) == "joints 1 to 3, link 2"


def test_what_something_without_a_name_depends_on_is_spoken() -> None:
    depends = diagnosis_words.depends
    assert depends(["q2"]) == "the position of joint 2"
    assert depends(["q4", "q6"]) == "the positions of joint 4 and joint 6"
    assert depends(["approach3", "q2"]) == "the position of joint 2 and the approach direction of joint 3"
    assert depends(["down2_x", "down2_y", "down2_z"]) == "the orientation of link 2 to gravity"
    assert depends(["sight_x", "sight_y", "sight_z"]) == "the side from which the instrument sees it"
    assert depends(["gravity"]) == "its orientation to gravity"
    assert depends(["weight_x", "weight_y"]) == "the payload and its orientation to gravity"
    assert depends(["x", "y", "z"]) == "the position in space"
    assert depends(["load4", "time_s"]) == "the load on joint 4 and time"
    assert depends(["flow"]) == "the column flow"


@pytest.mark.parametrize("verdict", ["none", "one_of", "several", "unexplained"])
def test_each_verdict_has_a_page_that_says_what_to_do(found: Diagnosis, verdict: str) -> None:
    (finding,) = found.effects
    changed = {
        "none": {"effects": [], "steps": found.steps[:1], "gap": found.gap[:1]},
        "one_of": {"effects": [replace(finding, equivalents=(("gear_harmonic", "joint3"),), grade="B")]},
        "several": {"effects": [finding, finding]},
        "unexplained": {"unexplained": Unexplained("joint5", 0.4, ("q4", "q6"))},
    }[verdict]
    steps = diagnosis_steps.next_steps(replace(found, verdict=verdict, **changed))
    assert len(steps) >= 2
    assert ("Do not repair anything yet" in steps[0]) == (verdict == "one_of")
    assert ("Check joint 5" in steps[0]) == (verdict == "unexplained")
    if verdict in ("none", "one_of"):
        assert diagnosis_words.VERDICTS[verdict][0] in diagnosis_page(replace(found, verdict=verdict, **changed))


def test_the_contents_of_a_diagnosis_lead_to_its_sections(found: Diagnosis, unnamed: Diagnosis) -> None:
    for shown in (found, unnamed):
        page = diagnosis_page(shown)
        links = re.findall(r'<a href="#([^"]+)">', page.split('<nav class="contents"')[1].split("</nav>")[0])
        assert links == re.findall(r'<section id="([^"]+)"', page)


def test_an_error_of_the_measurement_is_not_to_be_compensated(found: Diagnosis) -> None:
    (finding,) = found.effects
    drift = replace(finding, effect="base_drift", owner="base")
    steps = diagnosis_steps.next_steps(replace(found, verdict="named", effects=[drift]))
    assert steps[0].startswith("Not the robot but the measurement: base: a drift")
    assert not any(step.startswith("Compensate") for step in steps)
    both = diagnosis_steps.next_steps(replace(found, verdict="several", effects=[finding, drift]))
    assert both[0].startswith("Not the robot but the measurement")
    assert both[1].startswith("Compensate with model.yaml: it holds the geometry and the effect, identified together.")


def test_a_plan_that_would_settle_nothing_is_no_advice(found: Diagnosis) -> None:
    """Poses that raise the power from 9 to 16 % are not worth measuring, and the page does not ask for them."""
    (finding,) = found.effects
    effects = [replace(finding, equivalents=(("gear_harmonic", "joint3"),), grade="B")]
    poses = found.search.problem.data[:12]
    for after, asked in ((0.16, False), (0.84, True)):
        plan = SeparatingPlan(poses, 0.09, after, (CauseLabel("backlash", "joint3"), CauseLabel("backlash", "joint4")))  # type: ignore[arg-type]
        shown = replace(found, verdict="one_of", effects=effects, plan=plan)
        steps = diagnosis_steps.next_steps(shown)
        assert ("see below" in steps[1]) == asked
        assert ("would hardly tell them apart" in steps[1]) == (not asked)
        assert ('<section id="plan"' in diagnosis_page(shown)) == asked


def test_several_causes_are_spoken_of_as_several(found: Diagnosis) -> None:
    assert "With it in the model the error" in found.sentence
    assert "With them in the model the error" in sentence_of(replace(found, gap=[*found.gap, found.gap[-1]]))
    worse = replace(found.gap[-1], kinds={"position": KindGap("mm", 9.0, 9.0, 9.0)})
    assert " rises from " in sentence_of(replace(found, gap=[found.gap[0], worse]))


def test_the_status_says_whether_the_model_may_be_used(found: Diagnosis) -> None:
    worse = replace(found.gap[-1], kinds={"position": KindGap("mm", 9.0, 9.0, 9.0)})
    states = [found, replace(found, gap=[found.gap[0], worse]), replace(found, converged=False)]
    assert [each.to_json_dict()["status"] for each in states] == ["converged", "predicts_worse", "not_converged"]
