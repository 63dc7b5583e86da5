# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Screens driven in a browser, in the order in which a user meets them, on a tracker's and a controller's files."""

from __future__ import annotations

import json
import shlex
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.cli import main as command

from .conftest import patiently


@pytest.fixture(scope="module")
def studio(studio_in: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    running = studio_in(tmp_path_factory.mktemp("studio") / "cell_7")
    yield running
    running.end()


@pytest.fixture(scope="module")
def exports(shared_data: Any) -> Path:
    return shared_data / "exports" / "01_sa_points"


def number(text: str) -> float:
    return float(text.split()[0])


@patiently
def test_data_from_two_files_to_a_measurement_file(look: Any, studio: Any, exports: Path) -> None:
    page = look.go("/")
    look.choose("Shipped arm", "ur5")
    look.drop("instrument", exports / "ur5_sa.txt")
    look.get("problem").filter(has_text="no joints: drop the controller's log or program").wait_for()
    look.drop("controller", exports / "joints.csv")
    look.get("joined").wait_for()
    assert "joined with their poses by name" in " ".join(look.get("note").all_inner_texts())
    assert look.get("misfit").get_attribute("data-grade") == "good"
    good = number(look.get("misfit").inner_text())
    look.picture("studio-data")
    look.everybody()
    # A wrong unit is seen at once, and taken back.
    look.get("unit-q").get_by_text("rad", exact=True).click()
    page.locator('[data-test="misfit"][data-grade="bad"]').wait_for()
    assert number(look.get("misfit").inner_text()) > 100 * good
    look.get("unit-q").get_by_text("deg", exact=True).click()
    page.locator('[data-test="misfit"][data-grade="good"]').wait_for()
    # So is a joint that turns the other way; the robot file then says how the controller counts.
    look.get("sign-3").click()
    page.locator('[data-test="misfit"][data-grade="bad"]').wait_for()
    assert "sign" in look.get("suspicion").inner_text()
    assert fastcal.load_robot(studio.folder / "robot.yaml").spec["pendant"][0]["joint"] == 3
    look.get("sign-3").click()
    page.locator('[data-test="misfit"][data-grade="good"]').wait_for()
    assert number(look.get("misfit").inner_text()) == good
    look.get("save").click()
    line = look.get("command").inner_text()
    saved = (studio.folder / "measurements.csv").read_bytes()
    assert_same_by_command(line, studio.folder, "measurements.csv", saved)
    assert len(fastcal.load_measurements(studio.folder / "measurements.csv", fastcal.load_robot("ur5"))) > 190


def assert_same_by_command(line: str, folder: Path, name: str, content: bytes) -> None:
    """The command that the screen shows, run in the project's folder, writes the same file."""
    words = shlex.split(line)
    assert words[0] == "fastcal"
    assert line in (folder / "commands.txt").read_text().splitlines()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert command([*words[1:], "--quiet"]) == 0
    assert (folder / name).read_bytes() == content


@patiently
def test_result_calibrates_and_shows_the_page(look: Any, studio: Any) -> None:
    page = look.go("/result")
    page.get_by_label("Effects").fill("geometry,joint_compliance@joint2")
    look.get("calibrate").click()
    frame = page.frame_locator('[data-test="page-calibration"]')
    frame.locator("h1").first.wait_for()
    assert look.get("onward").get_attribute("href") == "/program"
    result = json.loads((studio.folder / "calibration" / "result.json").read_text())
    assert result["status"] == "converged"
    # Without the effect the others are fitted again: the error can only rise.
    switch = look.get("switch-joint_compliance@joint2")
    assert not switch.is_visible()
    look.get("without").get_by_text("What does each effect do?").click()
    assert look.page.locator('[data-test^="switch-"]').count() == 1  # masses that may be wrong are no switches
    switch.click()
    page.locator('[data-test="switch-joint_compliance@joint2"][aria-checked="false"]').wait_for()
    page.get_by_text("without Joint 2 compliance:").wait_for()
    without = float(look.get("gap-said").inner_text().split(": ")[1].split()[0])
    assert without >= result["train"]["after_mm"]["rms"] * 0.999
    look.picture("studio-result")
    look.everybody()


@patiently
def test_long_work_can_be_stopped(look: Any, studio: Any) -> None:
    robot = fastcal.load_robot(studio.folder / "robot.yaml")
    many = fastcal.simulate(fastcal.perturbed(robot, seed=3), fastcal.random_poses(robot, 12_000, seed=5), noise=3e-5)
    fastcal.write_measurements(studio.folder / "measurements.csv", many, robot.joint_types)
    page = look.go("/result")
    look.get("diagnose").click()
    page.get_by_role("button", name="Stop").dispatch_event("click")  # without waiting for the page to come to rest
    look.get("failed").filter(has_text="stopped").wait_for()
    assert not (studio.folder / "diagnosis").exists()


@patiently
def test_live_forty_rows_by_tcp(look: Any, studio: Any) -> None:
    nominal = fastcal.load_robot("ur5")
    true = fastcal.perturbed(nominal, seed=3)
    data = fastcal.simulate(true, fastcal.random_poses(nominal, 40, seed=5), noise=3e-5, seed=6)
    point = 1000 * data.position
    point[15] = np.nan
    point[25] += [0.9, -0.6, 0.4]
    page = look.go("/live")
    page.get_by_label("TCP port for rows").fill("0")
    look.get("begin").click()
    host, port = look.get("address").inner_text().removeprefix("TCP ").split(":")
    said = []
    with socket.create_connection((host, int(port)), timeout=60) as connection:
        file = connection.makefile("rw", encoding="utf-8", newline="\n")

        def send(line: str) -> str:
            file.write(line + "\n")
            file.flush()
            return file.readline().strip()

        assert send("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm") == "ok"
        for k in range(40):
            cells = [*np.degrees(data.q[k]), *point[k]]
            said.append(send(",".join("" if np.isnan(cell) else f"{cell:.5f}" for cell in cells)))
            if k == 15:
                look.get("last").filter(has_text="dropped beam").wait_for()
            if k == 25:
                look.get("last").filter(has_text="slip: 1.1").wait_for()
                look.picture("studio-live")
    assert [k for k, text in enumerate(said) if text != "ok"] == [15, 25]
    look.get("count").filter(has_text="40 rows, 38 kept").wait_for()
    assert "enough" in look.get("count").inner_text()
    assert look.get("onward").get_attribute("href") == "/result"
    assert number(look.get("sigma").inner_text().removeprefix("σ ")) < 0.1
    assert "J1" in look.get("next").inner_text()
    look.everybody()


@patiently
def test_a_kill_loses_no_row(look: Any, studio: Any) -> None:
    """The last of what the studio of this module does; the others begin with one of their own."""
    look.page.goto("about:blank")
    studio.kill()
    arrived = (studio.folder / "live" / "arrived.csv").read_text().splitlines()
    assert len(arrived) == 41
    kept = fastcal.load_measurements(studio.folder / "live" / "measurements.csv", fastcal.load_robot("ur5"))
    assert len(kept) == 38
    again = fastcal.calibrate("ur5", kept)
    assert again.status == "converged"
    assert 1000 * again.train.after.rms < 0.1
