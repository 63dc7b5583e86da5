# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""--open shows the page that this run wrote, and says so where there is none."""

import webbrowser
from pathlib import Path

import pytest

from fastcal.cli.app import COMMANDS, installed
from fastcal.cli.pages import WITH_PAGE


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The addresses that a browser was asked for."""
    asked: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: asked.append(address) or True)
    return asked


def calibrate(demo: Path, out: Path) -> tuple[object, ...]:
    return ("calibrate", demo / "robot.yaml", demo / "measurements.csv", "-o", out)


def test_the_report_is_opened_once_it_is_there(fastcal, demo: Path, tmp_path: Path, opened: list[str]) -> None:
    out = tmp_path / "a folder"
    assert fastcal(*calibrate(demo, out)).code == 0
    assert opened == []
    assert fastcal(*calibrate(demo, out), "--open").code == 0
    assert opened == [(out / "report.html").as_uri()]


def test_a_page_by_its_name_and_a_verdict_that_is_no_failure(
    fastcal, demo: Path, tmp_path: Path, opened: list[str]
) -> None:
    check = ("check", demo / "model.yaml", demo / "test.csv", "--tolerance-mm", "0.0001", "-o")
    assert fastcal(*check, tmp_path / "c.html", "--open").code == 4
    assert opened == [(tmp_path / "c.html").as_uri()]


def test_where_no_page_was_written_one_line_says_so(fastcal, demo: Path, tmp_path: Path, opened: list[str]) -> None:
    check = ("check", demo / "model.yaml", demo / "test.csv", "--open")
    for more in ((), ("-o", tmp_path / "c.json")):
        assert "--open: this run wrote no page" in fastcal(*check, *more).err
    assert opened == []


def test_a_refused_run_opens_no_older_page(fastcal, demo: Path, tmp_path: Path, opened: list[str]) -> None:
    assert fastcal(*calibrate(demo, tmp_path / "out")).code == 0
    assert fastcal("calibrate", "no_such_arm", demo / "test.csv", "-o", tmp_path / "out", "--open").code == 2
    assert opened == []


def test_without_a_browser_the_path_is_told(fastcal, demo: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    said = fastcal(*calibrate(demo, tmp_path / "out"), "--open")
    assert f"no browser could be started; the page is {tmp_path / 'out' / 'report.html'}" in said.err
    assert said.code == 0


@pytest.mark.parametrize("name", [*COMMANDS, *installed()])
def test_help_offers_it_where_a_page_is_written(fastcal, name: str) -> None:
    assert ("--open " in fastcal(name, "--help").out) == (name in WITH_PAGE)
