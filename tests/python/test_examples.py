# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every example of the README and the docs runs: Python blocks, and console lines that begin with `$ fastcal`.

The blocks of a page run in one folder and share their names, in the order in which a reader meets them. The folder
holds what a reader would bring: robot.yaml, measurements.csv, test.csv, the same measurements as a tracker's list and a
controller's log; and a public set once a block uses it.
"""

import csv
import itertools
import re
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from fastcal.cli import main
from fastcal.effects import registered

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
    write_exports(folder)
    return folder


EXPORTS = ("tracker.txt", "joints.csv", "poses.dat", "poses_map.yaml", "monday.csv", "tuesday.csv")


def write_exports(folder: Path) -> None:
    """The first 60 poses of measurements.csv as an instrument and a controller write them, and as two files."""
    text = (folder / "measurements.csv").read_text().splitlines()
    rows = list(csv.DictReader(text[:61]))
    joints = [f"q{joint}_deg" for joint in range(1, 7)]
    points = [f"A, SMR, P{k:03d}, {r['x_mm']}, {r['y_mm']}, {r['z_mm']}" for k, r in enumerate(rows, 1)]
    head = ["// SpatialAnalyzer", "// Units: Millimeters", "// Collection, Group, Target, X, Y, Z"]
    (folder / "tracker.txt").write_text("\n".join([*head, *points]))
    log = [",".join([f"P{k:03d}", *(r[joint] for joint in joints)]) for k, r in enumerate(rows, 1)]
    (folder / "joints.csv").write_text("\n".join(["Name,J1,J2,J3,J4,J5,J6", *log]))
    metres = [[str(float(row[axis]) / 1000) for axis in ("x_mm", "y_mm", "z_mm")] for row in rows]
    bare = [" ".join([str(k), *m, *(r[j] for j in joints)]) for k, (m, r) in enumerate(zip(metres, rows, strict=True))]
    (folder / "poses.dat").write_text("\n".join(bare))
    places = {joint: 5 + k for k, joint in enumerate(joints)} | {"x_m": 2, "y_m": 3, "z_m": 4}
    (folder / "poses_map.yaml").write_text(f"columns: {places}".replace("'", ""))
    (folder / "monday.csv").write_text("\n".join(text[:31]))
    (folder / "tuesday.csv").write_text("\n".join([text[0], *text[31:61]]))


@pytest.mark.parametrize("page", PAGES_WITH_EXAMPLES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_examples_of_a_page_run(
    page: Path, readers_files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    for name in ("robot.yaml", "measurements.csv", "test.csv", *EXPORTS):
        shutil.copy(readers_files / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registered, "_effects", {})  # what a page registers is that page's

    names: dict[str, object] = {"__name__": "__main__"}
    if any("paper kuka_kr500" in command for block in blocks(page) for command in block.commands()):
        request.getfixturevalue("known_kr500")
    for block in blocks(page):
        for name in PUBLIC_SETS:
            if f"{name}/" in block.text and not Path(name).exists():
                shutil.copytree(request.getfixturevalue("shared_data") / name, name)
        if block.language == "python":
            # Blank lines in front, so that a traceback tells the line of the page.
            exec(compile("\n" * block.line + block.text, str(page), "exec"), names)  # noqa: S102 - our own pages
        for command in block.commands():
            assert main(shlex.split(command)[1:]) == 0, f"{page.relative_to(ROOT)}:{block.line}: {command}"


def test_the_readme_quotes_what_the_commands_print(
    readers_files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A text block after a command holds words of its output in their order; lines may be left out, none changed."""
    monkeypatch.chdir(readers_files)
    found = blocks(ROOT / "README.md")
    quotes = [(a, b) for a, b in itertools.pairwise(found) if a.commands() and b.language == "text"]
    assert len(quotes) == 2
    for console, text in quotes:
        capsys.readouterr()
        for command in console.commands():
            assert main(shlex.split(command)[1:]) == 0
        printed = iter(capsys.readouterr().out.split())
        missing = [word for word in text.text.split() if word not in printed]  # advances through what was printed
        assert missing == []


def test_the_readme_shows_the_main_job_in_both_languages() -> None:
    found = blocks(ROOT / "README.md")
    commands = [command for block in found for command in block.commands()]
    assert any(command.startswith("fastcal demo") for command in commands)
    assert any(command.startswith("fastcal calibrate robot.yaml") for command in commands)
    assert any("fastcal.calibrate(" in block.text for block in found if block.language == "python")
