# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The documentation builds as a site without a warning, a dead link being one, and lists every public name."""

import html
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

import fastcal

ROOT = Path(__file__).parents[2]


# Markup that became text: a fence, an item of a list, bold letters, a row of a table, a link.
MARKUP = re.compile(r"```|^\d+\. \*?\w.*$|^- .*$|\*\*[^*\n]+\*\*|^\|.*\|$|\]\(", re.MULTILINE)


def visible(page: str) -> str:
    """The text of a page's article without its code and headings."""
    article = page.split("<article", 1)[-1].split("</article>")[0]
    prose = re.sub(r"<(pre|code|h\d)\b.*?</\1>", "", article, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]+>", "", prose))


@pytest.fixture(scope="module")
def home() -> Path:
    """The first page of the site, which is built."""
    built = subprocess.run([ROOT / "tools" / "site"], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    assert "WARNING" not in built.stderr
    return Path(built.stdout.strip().splitlines()[-1])


def test_the_site_builds_without_a_warning(home: Path) -> None:
    assert "fastcal" in home.read_text(encoding="utf-8")
    pages = [page for page in home.parent.rglob("*.html") if page.name != "404.html"]
    assert len(pages) > 70
    unread = {page.name: MARKUP.findall(visible(page.read_text(encoding="utf-8"))) for page in pages}
    assert {name: found for name, found in unread.items() if found} == {}


@pytest.mark.parametrize("page", ["index.html", "effects/backlash.html"])
def test_a_site_opened_from_disk_finds_what_is_searched_for(home: Path, browser: Any, page: str) -> None:
    address = f"{(home.parent / page).as_uri()}?q=ball-bar"
    with browser.visited(address, "a.md-search-result__link") as (shown, console):
        document = shown.content()
    assert console == []
    assert re.search(r"\d+ matching documents", document)
    found = re.findall(r'<a href="(file:[^"]*)" class="md-search-result__link"', document)
    assert any("observations/length.html" in link for link in found)


def test_nothing_of_the_site_is_fetched_from_elsewhere(home: Path) -> None:
    for page in home.parent.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert re.findall(r'<(?:script|img|iframe)[^>]* src="https?:[^"]*"', text) == [], page.name
        assert re.findall(r'<link[^>]* rel="stylesheet"[^>]* href="https?:', text) == [], page.name


def test_the_home_page_has_a_path_for_each_kind_of_user() -> None:
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    paths = text.partition("## Your path")[2].partition("\n## ")[0].strip().split("\n\n")
    for who in ("tracker", "camera", "ball-bar", "research", "integrate", "fleet"):
        (path,) = [path for path in paths if who in path.split("**")[1]]
        assert path.count("](") >= 2, who
    assert text.count("](pictures/") == 3


def test_the_reference_lists_every_public_name() -> None:
    listed = set(
        re.findall(r"^::: fastcal\.(\w+)$", (ROOT / "docs" / "reference.md").read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert listed == {name for name in fastcal.__all__ if not name.startswith("_")}


def test_the_costs_of_commands_are_those_of_their_record() -> None:
    """bench/python/bench_commands.py writes the file, and the page quotes it."""
    record = json.loads((ROOT / "bench" / "python" / "bench_commands.json").read_text(encoding="utf-8"))["commands"]
    section = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8").partition("## Commands, from start")[2]
    lines = [line for line in section.partition("\n## ")[0].splitlines() if line.startswith("| ")][1:]
    quoted = [[cell.split()[0] for cell in line.strip("| ").split(" | ")[1:]] for line in lines]
    assert quoted == [
        [f"{cost['cpu_s']:.2f}", f"{cost['least_s']:.2f}", f"{cost['memory_mb']:.0f}"] for cost in record.values()
    ]
