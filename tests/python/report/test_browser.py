# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page in a browser: no error in its console, every figure drawn, buttons that work, paper that cuts nothing."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fastcal.calibration.calibrate import CalibrationResult
from fastcal.report import calibration_page
from fastcal.report.figures import DARK, INK

MakeResult = Callable[..., CalibrationResult]

PAPER_WIDTH, PAPER_SCENE = 687, 440  # of the paper and of the arm on it [CSS pixels]


@pytest.fixture(scope="module")
def page(make_result: MakeResult) -> str:
    return calibration_page(make_result())


def drawn_figures(document: str) -> dict[str, str]:
    """Each figure's part of the document, by its id."""
    parts = re.split(r'<figure [^>]*id="figure-', document)[1:]
    return {part.split('"', 1)[0]: part.split("</figure>", 1)[0] for part in parts}


@pytest.mark.parametrize(
    "kind",
    [
        {},
        {"rows": 20, "test_rows": 0, "conditions": False, "outlier_count": 0},
        {"missing": 0.3},
        {"lengths": True},
        {"rows": 100_000, "test_rows": 20_000, "outlier_count": 700},
    ],
    ids=["full", "twenty rows", "missing coordinates", "lengths", "100,000 rows"],
)
def test_every_figure_is_drawn_and_the_console_is_quiet(
    browser: Any, make_result: MakeResult, kind: dict[str, Any]
) -> None:
    document, console = browser.run(calibration_page(make_result(**kind), simulated=True))
    assert console == []
    assert re.search(r"<dd>[\d.]+&nbsp;mm</dd>", document)  # a number and its unit stay on one line
    figures = drawn_figures(document)
    assert len(figures) >= 10
    for name, part in figures.items():
        assert 'data-state="drawn"' in part, name
        assert ('<svg class="main-svg"' in part) != (name == "workspace"), name
        assert ("<canvas" in part) == (name == "workspace"), name
        if name.startswith(("trend", "flat", "cumulative")):
            assert re.search(r'<path class="(js-line|point)"', part), name


def test_an_error_in_the_console_would_be_seen(browser: Any) -> None:
    _, console = browser.run("<!DOCTYPE html><script>throw new Error('planted')</script>")
    assert len(console) == 1
    assert "planted" in console[0]


INKED = """
      const canvas = document.querySelector("#figure-workspace canvas");
      const inked = () => {
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        let sum = 0, count = 0;
        for (let k = 0; k < data.length; k += 4) {
          if (data[k] === data[0] && data[k + 1] === data[1] && data[k + 2] === data[2]) continue;
          count += 1;
          sum += ((k / 4) * 7) % 9973;
        }
        return { share: count / (data.length / 4), sum };
      };
    """
PAINTED = """
      const painted = (scene) => new Promise((done) => {
        const look = () => { scene.asked ? setTimeout(look, 20) : done(); }; // a frame that was asked for
        look();
      });"""


def test_the_arm_turns_by_mouse_and_keys_without_a_graphics_card(browser: Any, page: str) -> None:
    script = f"""{INKED}{PAINTED}
      const plot = canvas.parentElement;
      const {{ scene }} = plot;
      await painted(scene);
      const seen = [[scene.azimuth, scene.height, inked()]];
      const mouse = (type, clientX, clientY) => canvas.dispatchEvent(new PointerEvent(type, {{ clientX, clientY }}));
      scene.canvas.setPointerCapture = () => {{}}; // there is no pointer to capture
      mouse("pointerdown", 300, 300); mouse("pointermove", 360, 320); mouse("pointerup", 360, 320);
      await painted(scene); seen.push([scene.azimuth, scene.height, inked()]);
      const press = (key) => plot.dispatchEvent(new KeyboardEvent("keydown", {{ key }}));
      ["ArrowRight", "ArrowRight", "ArrowUp", "+"].forEach(press);
      await painted(scene); seen.push([scene.azimuth, scene.height, inked()]);
      press("Home");
      await painted(scene); seen.push([scene.azimuth, scene.height, inked()]);
      return [plot.tabIndex, seen];"""
    focusable, (first, dragged, keyed, back) = browser.probe(page, script)
    assert focusable == 0
    assert dragged[0] < first[0]  # what is dragged to the right turns to the right
    assert dragged[0] < keyed[0]
    assert dragged[1] > first[1]
    assert keyed[1] > dragged[1]
    for seen in (first, dragged, keyed):
        assert 0.03 < seen[2]["share"] < 0.6
    assert len({seen[2]["sum"] for seen in (first, dragged, keyed)}) == 3
    assert back == first


def test_a_point_says_its_error_and_a_click_chooses_its_row(browser: Any, page: str) -> None:
    script = (
        PAINTED
        + """
      const plot = document.querySelector("#figure-workspace .plot");
      const { scene } = plot;
      await painted(scene);
      const frame = scene.canvas.getBoundingClientRect();
      const { at } = scene.seen[1];
      const points = [...scene.data[1].x.keys()], place = (k) => [at[3 * k], at[3 * k + 1]];
      const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
      const lonely = (k) => points.filter((each) => apart(place(each), place(k)) < 26).length === 1;
      const k = points.find((each) => lonely(each) && scene.nearest(place(each))?.trace === 1);
      const [clientX, clientY] = [frame.left + at[3 * k], frame.top + at[3 * k + 1]];
      scene.canvas.setPointerCapture = () => {};
      for (const type of ["pointermove", "pointerdown", "pointerup"])
        scene.canvas.dispatchEvent(new PointerEvent(type, { clientX, clientY }));
      const told = plot.querySelector(".tip").textContent;
      await painted(scene);
      const [dots, measured] = [scene.data[1], scene.data.at(-1)];
      return [told, dots.customdata[k], ["x", "y", "z"].map((axis) => [measured[axis][0], dots[axis][k]])];"""
    )
    told, error, points = browser.probe(page, script)
    assert told == f"error {error:.3f} mm"
    for shown, clicked in points:
        assert shown == pytest.approx(clicked)


def test_the_buttons_switch_the_arrows(browser: Any, page: str) -> None:
    script = """
      const figure = document.getElementById("figure-workspace");
      const buttons = [...figure.querySelectorAll(".controls button")];
      const states = [];
      for (const button of [...buttons.slice(1), buttons[0]]) {
        button.click();
        await new Promise((done) => setTimeout(done, 300));
        states.push([figure.querySelector(".plot").scene.data.map((trace) => trace.visible !== false),
                     buttons.map((other) => other.getAttribute("aria-pressed"))]);
      }
      return states;"""
    states = browser.probe(page, script)
    for shown, (visible, pressed) in zip((1, 2, 0), states, strict=True):
        assert visible == [k // 2 == shown for k in range(6)] + [True] * 4  # base, and the arm's three
        assert pressed == ["true" if k == shown else "false" for k in range(3)]


def test_the_slider_and_an_outlying_row_move_the_arm(browser: Any, page: str) -> None:
    script = (
        PAINTED
        + """
      const figure = document.getElementById("figure-workspace");
      const plot = figure.querySelector(".plot").scene;
      const [slider, said] = [figure.querySelector(".posture input"), figure.querySelector(".posture output")];
      const look = () => {
        const [chain, joints, point] = plot.data.slice(-3);
        return { said: said.textContent, end: ["x", "y", "z"].map((axis) => chain[axis][chain[axis].length - 1]),
                 point: ["x", "y", "z"].map((axis) => point[axis][0]), joints: joints.x.length,
                 chosen: [...document.querySelectorAll("tr.chosen")].map((row) => row.cells[0].dataset.sort) };
      };
      const rows = [...document.querySelectorAll("#outlier-table tr[data-row]")];
      const outlying = new Set(rows.map((row) => row.dataset.row));
      const plain = [0, 1, 2, 3, 4, 5, 6, 7].find((k) => !outlying.has(`0:${k}`));
      const seen = [plain];
      slider.value = plain; slider.dispatchEvent(new Event("input"));
      await painted(plot); seen.push(look());
      const [row] = rows;
      row.click();
      await painted(plot); seen.push(look());
      return [row.cells[0].dataset.sort, ...seen];"""
    )
    row, plain, slid, clicked = browser.probe(page, script)
    assert slid["said"] == f"Training, row {plain}"
    assert slid["chosen"] == []
    assert slid["joints"] == 6
    assert clicked["said"] == f"Training, row {float(row):.0f}"
    assert clicked["chosen"] == [row]
    for seen in (slid, clicked):  # the arm ends in the measured point, but for errors of a millimetre
        assert seen["end"] == pytest.approx(seen["point"], abs=2.0)
    assert slid["end"] != pytest.approx(clicked["end"], abs=2.0)


def test_a_row_is_chosen_everywhere(browser: Any, page: str) -> None:
    """A click on an outlier marks its points in the panels; a click on a panel's point moves the arm."""
    script = """
      const wait = () => new Promise((done) => setTimeout(done, 300));
      const plot = document.querySelector("#figure-trend-q1 .plot");
      const mark = () => plot.data[plot.data.length - 1];
      const line = [...document.querySelectorAll("#outlier-table tr[data-row]")]
        .find((each) => [...plot._fullData[0].customdata].includes(Number(each.dataset.row.split(":")[1])));
      const row = line ? Number(line.dataset.row.split(":")[1]) : null;
      const place = [...plot._fullData[0].customdata].indexOf(row);
      if (line) line.click();
      await wait();
      const seen = [place, mark().x.length, [...mark().y], [0, 1, 2].map((t) => plot._fullData[t].y[place])];
      plot.emit("plotly_click", { points: [{ curveNumber: 1, customdata: plot._fullData[1].customdata[0] }] });
      await wait();
      return [...seen, document.querySelector(".posture output").textContent, mark().x[0], plot._fullData[0].x[0]];"""
    place, count, marked, there, said, x, first = browser.probe(page, script)
    assert place >= 0
    assert count == 3
    assert marked == pytest.approx(there)
    assert said == "Training, row 0"
    assert x == pytest.approx(first)


def test_the_filter_leaves_the_poses_of_a_range(browser: Any, page: str) -> None:
    script = """
      const figure = document.getElementById("figure-workspace");
      const plot = figure.querySelector(".plot");
      const [choice, said] = [figure.querySelector(".filter select"), figure.querySelector(".filter output")];
      const [from, to] = figure.querySelectorAll(".filter input");
      const left = (t) => [...plot.scene.data[t].x].filter(Number.isFinite).length;
      const all = [left(0), left(1)];
      choice.value = [...choice.options].find((each) => each.textContent.startsWith("joint 2")).value;
      choice.dispatchEvent(new Event("change"));
      const whole = said.textContent;
      to.value = (Number(from.min) + Number(from.max)) / 2;
      to.dispatchEvent(new Event("input"));
      await new Promise((done) => setTimeout(done, 300));
      const some = [left(0), left(1)];
      choice.value = ""; choice.dispatchEvent(new Event("change"));
      await new Promise((done) => setTimeout(done, 300));
      return [all, whole, said.textContent, some, [left(0), left(1)], from.parentElement.hidden];"""
    all_, whole, said, some, again, hidden = browser.probe(page, script)
    assert whole.endswith(f": {all_[1]} of {all_[1]} poses")
    assert said == ""
    assert 0.3 * all_[1] < some[1] < 0.7 * all_[1]  # joints were drawn evenly
    assert all_ == again == [5 * all_[1], all_[1]]
    assert some[0] == 5 * some[1]  # shaft and barbs
    assert hidden


def test_tables_sort_within_groups_and_fold(browser: Any, page: str) -> None:
    script = """
      const table = document.getElementById("parameter-table");
      const bodies = [...table.querySelectorAll("tbody.rows")];
      const read = () => bodies.map((body) => [...body.rows].map((row) => row.cells[4].dataset.sort).map(Number));
      const header = table.tHead.rows[0].cells[4];
      const seen = [];
      for (let k = 0; k < 2; k++) { header.querySelector("button").click(); seen.push([header.ariaSort, read()]); }
      const fold = table.querySelector(".fold");
      fold.click();
      return [seen, fold.getAttribute("aria-expanded"), bodies.map((body) => body.hidden)];"""
    seen, expanded, hidden = browser.probe(page, script)
    (first, rising), (second, falling) = seen
    assert [first, second] == ["ascending", "descending"]
    assert all(group == sorted(group) for group in rising)
    assert falling == [group[::-1] for group in rising]
    assert expanded == "false"
    assert hidden == [True] + [False] * (len(hidden) - 1)


def test_figures_are_drawn_to_the_width_of_the_paper_and_back(browser: Any, page: str) -> None:
    script = """
      const plots = [...document.querySelectorAll(".plot")].filter((plot) => plot.data);
      const widths = () => plots.map((plot) => plot.querySelector("svg").getBoundingClientRect().width);
      const settle = () => new Promise((done) => setTimeout(done, 500));
      const screen = widths();
      dispatchEvent(new Event("beforeprint")); await settle();
      const paper = widths();
      const columns = plots.map((plot) => Number(/columns-(\\d)/.exec(plot.closest("figure").className)[1]));
      const cards = plots.map((plot) => plot.closest(".verdict") !== null);
      dispatchEvent(new Event("afterprint")); await settle();
      return [columns, cards, screen, paper, widths()];"""
    columns, cards, screen, paper, back = browser.probe(page, script)
    assert back == pytest.approx(screen, abs=1)
    assert any(cards)
    for count, is_card, width in zip(columns, cards, paper, strict=True):
        across = PAPER_WIDTH - (41 if is_card else 0)  # 18 beside it on either side, 5 of border
        assert width == pytest.approx((across + 12) * count / 6 - 12, abs=1)


def test_prints_on_a4(browser: Any, page: str) -> None:
    pdf, console = browser.printed(page)
    assert console == []
    sizes = {tuple(round(float(x)) for x in box.split()) for box in re.findall(rb"/MediaBox \[([^]]*)\]", pdf)}
    assert sizes == {(0, 0, 595, 842)}
    assert len(re.findall(rb"/Type /Page\b", pdf)) == 4


def test_on_a_phone_no_word_breaks_and_nothing_is_wider_than_the_screen(browser: Any, page: str) -> None:
    """Words of table heads and first cells stay whole, neither the body nor a table scrolls sideways."""
    script = """
      const heads = [...document.querySelectorAll("table th, table td:first-child, .facts dt")];
      const letter = (cell) => cell.textContent.trim().split(/[\\s\u00a0]+/).map((word) => word.length)
        .reduce((a, b) => Math.max(a, b), 0);
      return {
        wide: document.documentElement.scrollWidth,
        broken: heads.filter((cell) => cell.clientWidth > 0 && cell.clientWidth < 4 * Math.min(letter(cell), 12))
          .map((cell) => cell.textContent.trim()),
        scrolled: [...document.querySelectorAll(".table-box")].filter((box) => box.scrollWidth > box.clientWidth)
          .map((box) => box.firstElementChild.id),
        count: heads.length,
      };"""
    seen = browser.phone(page, script)
    assert seen["wide"] == 400
    assert seen["broken"] == []
    assert seen["scrolled"] == []
    assert seen["count"] > 30


def test_every_chart_has_a_text_alternative(browser: Any, page: str) -> None:
    script = """return [...document.querySelectorAll(".plot")].map((plot) =>
        [plot.getAttribute("role"), (plot.getAttribute("aria-label") || "").length]);"""
    seen = browser.probe(page, script)
    assert len(seen) >= 10
    assert all(role == "img" and length > 30 for role, length in seen)


def test_everybody_can_use_it_in_light_and_dark(fit_for_all: Callable[[str], None], make_result: MakeResult) -> None:
    fit_for_all(calibration_page(make_result(), simulated=True))


def test_a_dark_screen_has_dark_drawings_and_paper_none(chromium: Any, page: str, tmp_path: Path) -> None:
    """Every drawing, the arm's pixels too, takes the colours of the screen, and those of paper while it is printed."""
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    shown = chromium.new_page(color_scheme="dark")
    shown.goto((tmp_path / "page.html").as_uri())
    shown.locator('body[data-state="ready"]').wait_for(timeout=120_000)
    look = """() => [...new Set([...document.querySelectorAll(".plot[data-state=drawn]")].map((plot) =>
        plot.scene ? [plot.scene.style.ground, plot.scene.style.ink].join()
          : [plot._fullLayout.paper_bgcolor, plot._fullLayout.font.color].join()))]"""
    corner = """() => { const canvas = document.querySelector("#figure-workspace canvas");
        return [...canvas.getContext("2d").getImageData(2, canvas.height - 2, 1, 1).data].slice(0, 3).join(); }"""
    assert shown.evaluate(look) == [f"{DARK['#fff']},{DARK[INK]}"]
    assert shown.evaluate(corner) == "18,24,30"  # DARK["#fff"]
    shown.evaluate("dispatchEvent(new Event('beforeprint'))")
    shown.wait_for_function(f"({look})().join() === '#fff,{INK}'")
    shown.wait_for_function(f"({corner})() === '255,255,255'")
    assert shown.evaluate("document.querySelector('#figure-workspace canvas').width") == 3 * PAPER_SCENE
    shown.evaluate("dispatchEvent(new Event('afterprint'))")
    shown.wait_for_function(f"({look})().join() === '{DARK['#fff']},{DARK[INK]}'")
    shown.wait_for_function(f"({corner})() === '18,24,30'")
    shown.close()


def test_the_contents_lead_to_every_section(page: str) -> None:
    links = re.findall(r'<a href="#([^"]+)">', page.split('<nav class="contents"')[1].split("</nav>")[0])
    assert links == re.findall(r'<section id="([^"]+)"', page)


def test_the_page_may_connect_to_nothing(browser: Any, page: str) -> None:
    script = """
      addEventListener("securitypolicyviolation", (event) => { window.blocked = event.effectiveDirective; });
      try { await fetch("http://127.0.0.1:9/"); } catch (error) { /* blocked, as it should be */ }
      await new Promise((done) => setTimeout(done, 50));
      return window.blocked ?? null;"""
    assert browser.probe(page, script) == "connect-src"


def test_no_title_of_an_axis_is_cut_on_a_phone(browser: Any, page: str) -> None:
    cut = browser.phone(
        page,
        "return [...document.querySelectorAll('.xtitle')].filter((title) => {"
        "const at = title.getBoundingClientRect(), plot = title.closest('.plot').getBoundingClientRect();"
        "return at.left < plot.left - 1 || at.right > plot.right + 1 || at.bottom > plot.bottom + 1;"
        "}).map((title) => title.textContent)",
    )
    assert cut == []


def test_heads_are_printed_without_buttons(chromium: Any, page: str) -> None:
    """Chromium leaves a button out where a table's head is repeated on the next sheet: the title stands beside it."""
    opened = chromium.new_page()
    opened.set_content(re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL))
    look = """() => [...document.querySelectorAll("thead th:has(button)")].map((head) => [head.textContent,
        getComputedStyle(head.firstElementChild).display, getComputedStyle(head, "::before").content])"""
    screen = opened.evaluate(look)
    opened.emulate_media(media="print")
    paper = opened.evaluate(look)
    opened.close()
    assert len(screen) > 10
    assert all(shown != "none" and title in ("none", "normal") for _text, shown, title in screen)
    assert paper == [[text, "none", f'"{text}"'] for text, _shown, _title in screen]
