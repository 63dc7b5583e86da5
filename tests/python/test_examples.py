# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every example of the README and the docs runs: Python blocks, and console lines that begin with `$ fastcal`.

The blocks of a page run in one folder and share their names, in the order in which a reader meets them. The folder
holds what a reader would bring: robot.yaml, measurements.csv, test.csv; and a public set once a block uses it.
"""

import re
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from fastcal.cli import main

ROOT = Path(__file__).parents[2]
PUBLIC_SETS = ("ur5_tracker", "ur10_tmac")


@dataclass(frozen=True)
class Block:
    language: str
    text: str
    line: int

    def commands(self) -> list[str]:
        """The `fastcal` commands of a console block, continued lines joined."""
        joined = self.text.replace("\\\n", " ")
        return re.findall(r"^\$ (fastcal .*)$", joined, re.MULTILINE)


def blocks(path: Path) -> list[Block]:
    tokens = MarkdownIt().parse(path.read_text(encoding="utf-8"))
    return [
        Block(token.info.strip(), token.content, token.map[0] + 1)
        for token in tokens
        if token.type == "fence" and token.map is not None
    ]


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES_WITH_EXAMPLES = [
    page for page in PAGES if any(block.language == "python" or block.commands() for block in blocks(page))
]


@pytest.fixture(scope="module")
def readers_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reader")
    assert main(["demo", "-o", str(folder)]) == 0
    return folder


@pytest.mark.parametrize("page", PAGES_WITH_EXAMPLES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_examples_of_a_page_run(
    page: Path, readers_files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    for name in ("robot.yaml", "measurements.csv", "test.csv"):
        shutil.copy(readers_files / name, tmp_path)
    monkeypatch.chdir(tmp_path)

    names: dict[str, object] = {"__name__": "__main__"}
    for block in blocks(page):
        for name in PUBLIC_SETS:
            if f"{name}/" in block.text and not Path(name).exists():
                shutil.copytree(request.getfixturevalue("shared_data") / name, name)
        if block.language == "python":
            # Blank lines in front, so that a traceback tells the line of the page.
            exec(compile("\n" * block.line + block.text, str(page), "exec"), names)  # noqa: S102 - our own pages
        for command in block.commands():
            assert main(shlex.split(command)[1:]) == 0, f"{page.relative_to(ROOT)}:{block.line}: {command}"


def test_the_readme_shows_the_main_job_in_both_languages() -> None:
    found = blocks(ROOT / "README.md")
    commands = [command for block in found for command in block.commands()]
    assert any(command.startswith("fastcal demo") for command in commands)
    assert any(command.startswith("fastcal calibrate robot.yaml") for command in commands)
    assert any("fastcal.calibrate(" in block.text for block in found if block.language == "python")
