# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every kind of page with every verdict, from simulated arms, and pictures of it on every kind of screen and on paper.

python -m tests.python.report.every_page OUT [NAME ...] writes the pages and OUT/NAME.SCREEN.png, and says what is
wrong with each: needs Debian's Chromium and Playwright, and axe-core for what is hard to see or to hear. On paper:
NAME.pdf. With FASTCAL_LANGUAGE=de the pages are German.
"""

from __future__ import annotations

import io
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from ..conftest import axe_core, inaccessible
from . import pages_of_arms, pages_of_cells, pages_of_kinds  # noqa: F401 - their pages are cases too
from .pages_of_fits import CASES

SIZE, WORDS, CHARTS = 1_500_000, 900, 12  # bytes of a file; of a diagnosis before anything is unfolded
SCREENS = [(width, scheme) for width in (1400, 400) for scheme in ("light", "dark")]

LOOK = """() => {
  const NEXT = /Next:|Als Nächstes:/;
  const seen = (each) => each.checkVisibility({ visibilityProperty: true });
  const words = [];
  const walker = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const around = walker.currentNode.parentElement;
    if (around.closest("script, style, svg, .plot") || !seen(around)) continue;
    words.push(...walker.currentNode.textContent.split(/\\s+/).filter((word) => /\\p{L}/u.test(word)));
  }
  const plots = [...document.querySelectorAll(".plot")].filter(seen);
  const named = (each) => each.closest("[id]")?.id ?? "";
  // Texts of a drawing that lie on one another, or leave it.
  const [overlap, cut] = [[], []];
  for (const plot of plots) {
    const frame = plot.getBoundingClientRect();
    const texts = [...plot.querySelectorAll("svg text")].filter((each) => each.textContent.trim() && seen(each) &&
      getComputedStyle(each).opacity !== "0" && !each.closest(".modebar, .hoverlayer"));
    const boxes = texts.map((each) => each.getBoundingClientRect());
    boxes.forEach((a, i) => {
      if (a.left < frame.left - 2 || a.right > frame.right + 2 || a.top < frame.top - 2 || a.bottom > frame.bottom + 2)
        cut.push(`${named(plot)}: ${texts[i].textContent}`);
      boxes.slice(i + 1).forEach((b, k) => {
        const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const tall = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        const both = [texts[i], texts[i + 1 + k]].map((each) => each.textContent).join(" / ");
        if (wide > 2 && tall > 3) overlap.push(`${named(plot)}: ${both}`);
      });
    });
  }
  const verdict = document.querySelector(".verdict")?.textContent ?? "";
  const boxes = [...document.querySelectorAll(".table-box")].filter(seen);
  const charts = plots.filter((plot) => !plot.closest(".flat-views")).length;
  return {
    words: words.length, charts, wide: document.documentElement.scrollWidth, overlap, cut,
    acts: Boolean(document.querySelector(".verdict.good, .verdict .acts")) || NEXT.test(verdict),
    over: boxes.filter((box) => box.scrollWidth > box.clientWidth + 1).map(named),
    empty: plots.filter((plot) => !["drawn", "message"].includes(plot.dataset.state)).map(named),
  };
}"""
DIAGNOSIS = {"diagnose", "diagnosed"}  # parts of the names of such cases
KINDS = ("overlap", "cut", "over", "empty")  # of what LOOK finds
QUIET = ("Canvas2D", "GPU", "GL Driver")  # what a browser that draws in software says of itself
PIECE = 4000  # a browser that draws in software paints no higher picture at once [CSS pixels]


PAPER = 687  # of text between the margins of A4, as in page.js [CSS pixels]


def on_paper(shown: Any) -> dict[str, Any]:
    """What LOOK sees of a page as it is printed."""
    shown.set_viewport_size({"width": PAPER, "height": PIECE})
    shown.wait_for_timeout(500)
    shown.evaluate("dispatchEvent(new Event('beforeprint'))")
    shown.emulate_media(media="print")
    shown.wait_for_timeout(500)
    return dict(shown.evaluate(LOOK))


def faults(
    page: Path, browser: Any, picture: Path | None = None, screens: Sequence[tuple[int, str]] = SCREENS
) -> list[str]:
    """What is wrong with a page on some screen, in words; with `picture` also PICTURE.SCREEN.png and PICTURE.pdf."""
    size = page.stat().st_size
    found = [f"{size} bytes"] if size > SIZE else []
    axe = axe_core()
    for width, scheme in screens:
        context = browser.new_context(viewport={"width": width, "height": PIECE}, color_scheme=scheme)
        shown = context.new_page()
        said: list[str] = []
        shown.on("console", lambda message, said=said: said.append(message.text))
        shown.on("pageerror", lambda error, said=said: said.append(str(error)))
        shown.goto(page.as_uri())
        shown.locator('body[data-state="ready"]').wait_for(timeout=120_000)
        seen = shown.evaluate(LOOK)
        on = f"{width} {scheme}"
        found += [f"{on}: {kind}: {each}" for kind in KINDS for each in seen[kind]]
        found += [f"{on}: console: {text}" for text in said if not any(known in text for known in QUIET)]
        if seen["wide"] != width:
            found.append(f"{on}: {seen['wide']} pixels wide")
        if axe is not None:
            found += [f"{on}: axe-core: {rule}: {element[:200]}" for rule, element, _act in inaccessible(shown, axe)]
        if not seen["acts"]:
            found.append(f"{on}: the verdict is not good, and says no next act")
        is_diagnosis = not DIAGNOSIS.isdisjoint(page.parent.parent.name.split("_"))
        if is_diagnosis and (seen["words"] > WORDS or seen["charts"] > CHARTS):
            found.append(f"{on}: {seen['words']} words, {seen['charts']} charts")
        if picture is not None:
            _photograph(shown, f"{picture}.{width}.{scheme}.png")
            if (width, scheme) == SCREENS[0]:
                shown.pdf(path=f"{picture}.pdf", prefer_css_page_size=True)
        if (width, scheme) == SCREENS[0]:
            printed = on_paper(shown)
            found += [f"paper: {kind}: {each}" for kind in KINDS for each in printed[kind]]
            if printed["wide"] != PAPER:
                found.append(f"paper: {printed['wide']} pixels wide")
        context.close()
    return found


def _photograph(shown: Any, target: str) -> None:
    """The whole page, piece by piece."""
    height = shown.evaluate("Math.ceil(document.querySelector('footer').getBoundingClientRect().bottom) + 48")
    width = shown.viewport_size["width"]
    whole = Image.new("RGB", (width, height))
    for top in range(0, height, PIECE):
        shown.evaluate("(top) => scrollTo(0, top)", top)
        piece = Image.open(io.BytesIO(shown.screenshot(timeout=60_000)))
        whole.paste(piece, (0, shown.evaluate("scrollY")))
    whole.save(target)


def main(arguments: list[str]) -> None:
    """Makes the pages that are named, or all, and looks at them."""
    from playwright.sync_api import sync_playwright

    out, names = Path(arguments[0]).resolve(), arguments[1:] or list(CASES)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        for name in names:
            folder = out / name
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            page = CASES[name](folder)
            told = faults(page, browser, out / name) if page.exists() else ["no page"]
            sys.stdout.write("".join(f"{name}: {each}\n" for each in told or ["good"]))
            sys.stdout.flush()
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
