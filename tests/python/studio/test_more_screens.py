# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The other screens, on the project that `fastcal studio --demo` makes; and who is not let in."""

from __future__ import annotations

import http.client
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

import fastcal
from fastcal.cli import main as command
from fastcal.studio.pictures import RED
from fastcal.studio.project import Project

from .conftest import patiently


@pytest.fixture(scope="module")
def studio(studio_in: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    running = studio_in(tmp_path_factory.mktemp("studio") / "demo", "--demo")
    yield running
    running.end()


def status(address: str, **headers: str) -> int:
    host = urlsplit(address)
    connection = http.client.HTTPConnection(host.hostname or "", host.port, timeout=120)
    connection.request("GET", address.partition(host.netloc)[2], headers=headers)
    answer = connection.getresponse().status
    connection.close()
    return answer


@pytest.mark.parametrize(
    "path", ["/", "/live", "/project/robot.yaml", "/_nicegui_ws/socket.io/?EIO=4&transport=polling", "/?token=guess"]
)
def test_nobody_without_the_token_is_let_in(studio: Any, path: str) -> None:
    assert status(studio.base + path) == 401
    assert status(studio.base + path, Cookie="fastcal_studio_1=x") == 401


def test_a_foreign_name_of_this_machine_is_refused(studio: Any) -> None:
    assert status(studio.base + "/", Host="evil.example:80") == 421


@patiently
def test_nothing_outside_the_project_is_served(look: Any, studio: Any) -> None:
    (studio.folder.parent / "secret.txt").write_text("secret")
    for path in ("/project/..%2Fsecret.txt", "/project/%2e%2e/secret.txt", "/project/inputs/../../secret.txt"):
        answer = look.page.request.get(studio.base + path)
        assert answer.status == 404
        assert "secret\n" not in answer.text()
    assert look.page.request.get(studio.base + "/project/robot.yaml").status == 200


@patiently
def test_arm_sliders_move_the_skeleton(look: Any, studio: Any) -> None:
    look.go("/arm")
    tool = look.get("tool")
    tool.wait_for()
    at = tool.inner_text()
    look.get("slider-2").locator("[tabindex]").press("ArrowRight")
    tool.filter(has_not_text=at).wait_for()
    pose = fastcal.load_robot("ur5e")
    moved = 1000 * pose.forward(np.radians([[0, 1, 0, 0, 0, 0]]))[0, :3, 3]
    assert f"x {moved[0]:.2f} y {moved[1]:.2f} z {moved[2]:.2f} mm," in " ".join(tool.inner_text().split())
    look.choose("Arm", "franka_panda")
    look.get("slider-7").wait_for()
    look.picture("studio-arm")
    look.everybody()


@patiently
def test_plan_draws_poses_and_what_cannot_be_driven(look: Any, studio: Any) -> None:
    page = look.go("/plan")
    page.get_by_label("Poses", exact=True).fill("16")
    look.get("plan").click()
    look.get("drivable").filter(has_text="all can be reached").wait_for()
    look.get("curve").wait_for()
    poses = fastcal.load_measurements(
        studio.folder / "plan" / "poses.csv", fastcal.load_robot("ur5e"), require_measured=False
    )
    assert len(poses) == 16
    assert (studio.folder / "plan" / "poses.script").is_file()
    for label, value in (("from x", 200), ("from y", -900), ("from z", 0), ("to x", 900), ("to y", 900), ("to z", 900)):
        page.get_by_label(label, exact=True).fill(str(value))
    look.get("add-box").click()
    look.get("drivable").filter(has_text="cannot be reached").wait_for()
    look.picture("studio-plan")
    look.everybody()
    page.get_by_label("z mm", exact=True).fill("1900")  # out of the way, and back by the slider
    look.get("drivable").filter(has_text="all can be reached").wait_for()
    for _ in range(3):
        page.get_by_role("slider", name="z of box 1").press("PageDown")
    page.get_by_label("z mm", exact=True).fill("450")
    look.get("drivable").filter(has_text="cannot be reached").wait_for()
    assert Project(studio.folder).answers["keep_out_mm"] == [[[200, -900, 0], [900, 900, 900]]]
    look.get("plan").click()
    look.get("drivable").filter(has_text="all can be reached").wait_for()
    planned = (studio.folder / "plan" / "poses.csv").read_bytes()
    repeat(look.get("command").first.inner_text(), studio.folder)
    assert (studio.folder / "plan" / "poses.csv").read_bytes() == planned


def repeat(line: str, folder: Path) -> None:
    """Runs the command that a screen shows, in the project's folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert command([*shlex.split(line)[1:], "--quiet"]) == 0


@patiently
def test_what_tells_causes_apart_leads_to_the_plan(look: Any, studio: Any) -> None:
    """Of a diagnosis that names poses: they are the plan then."""
    project = Project(studio.folder)
    there = project.path("diagnosis")
    there.mkdir(exist_ok=True)
    asked = fastcal.random_poses(project.robot(), 7, seed=3)
    data = fastcal.Dataset.from_arrays(asked)
    fastcal.write_measurements(there / "next_poses.csv", data, project.robot().joint_types)
    project.robot().save(there / "model.yaml")
    (there / "report.html").write_text("<!DOCTYPE html><html lang='en'><title>x</title><h1>x</h1></html>")
    (studio.folder / "measurements.csv").write_bytes((studio.folder / "fleet_data" / "cell_1.csv").read_bytes())
    look.go("/result")
    look.get("tell-apart").click()
    look.page.wait_for_url("**/plan")
    look.get("drivable").wait_for()
    planned = fastcal.load_measurements(project.path("plan/poses.csv"), project.robot(), require_measured=False)
    np.testing.assert_allclose(planned.q, asked, atol=1e-8)
    for name in ("report.html", "next_poses.csv", "model.yaml"):
        (there / name).unlink()


@patiently
def test_program_before_and_after(look: Any, studio: Any) -> None:
    look.go("/program")
    assert look.page.get_by_text("There is no calibrated model yet").is_visible()
    project = Project(studio.folder)
    data = fastcal.load_measurements(studio.folder / "fleet_data" / "cell_1.csv", project.robot())
    fastcal.calibrate(project.robot(), data).save(studio.folder / "calibration")
    page = look.go("/program")
    look.get("compensate").click()
    look.get("taken").filter(has_text="4 targets").wait_for()
    assert "movej" in look.get("difference").inner_text()
    look.picture("studio-program")
    look.everybody()
    written = (studio.folder / "programs" / "demo.script").read_text()
    assert written != (studio.folder / "inputs" / "demo.script").read_text()
    with page.expect_download() as loaded:
        look.get("download").first.click()
    assert Path(loaded.value.path()).read_text() == written
    repeat(look.get("command").inner_text(), studio.folder)
    # A program that was compensated already is refused with a sentence.
    look.drop("program", studio.folder / "programs" / "demo.script")
    look.arrived(studio.folder / "inputs" / "demo.script", written)
    look.get("compensate").click()
    look.get("refused").filter(has_text="was compensated already").wait_for()
    # What cannot be reached is said, and stands out in red among the others.
    far = studio.folder / "far.script"
    head = "def far():\n  set_tcp(p[0, 0, 0.1, 0, 0, 0])\n  movej([0, -1.2, 1.3, -1.6, -1.5, 0])\n"
    far.write_text(f"{head}  movel(p[5, 0, 0, 0, 0, 0])\nend\n")
    look.drop("program", far)
    look.arrived(studio.folder / "inputs" / "far.script", far.read_text())
    look.get("compensate").click()
    look.get("unreached").wait_for()
    assert look.get("refused").inner_text().startswith("inputs/far.script:4: ")
    colours = page.evaluate("document.querySelector('[data-test=unreached]').data[0].marker.color")
    assert [colour == RED for colour in colours] == [False, True]
    look.everybody()


@patiently
def test_fleet_matrix(look: Any, studio: Any) -> None:
    look.go("/fleet")
    look.get("run-fleet").click()
    look.get("matrix").wait_for()
    assert look.get("arm-link").count() == 20
    look.picture("studio-fleet")
    look.everybody()
    page = look.page.context.new_page()
    page.goto(studio.base + look.get("arm-link").first.get_attribute("href"))
    page.locator("h1").first.wait_for()
    page.close()


@patiently
def test_what_stands_where_is_drawn_and_kept(look: Any, studio: Any) -> None:
    """A tool that is longer by 100 mm: the tool's place follows, and so does the file once it is saved."""
    page = look.go("/arm")
    look.get("tool").wait_for()
    before = fastcal.load_robot(studio.folder / "robot.yaml").spec["tool"]["xyz_mm"][2]
    at = look.get("tool").inner_text()
    page.get_by_label("tool: z mm", exact=True).fill(str(before + 100))
    look.get("tool").filter(has_not_text=at).wait_for()
    assert fastcal.load_robot(studio.folder / "robot.yaml").spec["tool"]["xyz_mm"][2] == before
    look.get("save-places").click()
    look.get("kept-places").filter(has_text="robot.yaml").wait_for()
    kept = fastcal.load_robot(studio.folder / "robot.yaml")
    assert kept.spec["tool"]["xyz_mm"][2] == before + 100
    moved = 1000 * kept.forward(np.zeros((1, 6)))[0, :3, 3]
    assert f"x {moved[0]:.2f} y {moved[1]:.2f} z {moved[2]:.2f} mm," in " ".join(look.get("tool").inner_text().split())
    look.everybody()
    page.get_by_label("tool: z mm", exact=True).fill(str(before))
    look.get("save-places").click()


@patiently
def test_an_arm_of_the_fleet_is_checked(look: Any, studio: Any) -> None:
    """A joint's zero that moved by 0.05 degrees after the fleet was calibrated is named, and what to do about it."""
    project = Project(studio.folder)
    there = studio.folder / "fleet" / "cell_1"
    data = fastcal.load_measurements(studio.folder / "fleet_data" / "cell_1.csv", project.robot())
    result = fastcal.calibrate(project.robot(), data, effects="geometry,joint_compliance@joint2")
    there.mkdir(parents=True, exist_ok=True)
    result.model.save(there / "model.yaml")
    spec = fastcal.load_robot(there / "model.yaml").spec
    spec["joints"][2]["theta_deg"] += 0.05
    moved = fastcal.load_robot({key: value for key, value in spec.items() if key != "calibration"})
    for month, real in ((3, result.model), (4, moved)):
        measured = fastcal.simulate(real, fastcal.check_poses(result.model, 8).q, noise=3e-5, seed=month)
        fastcal.write_measurements(studio.folder / f"new_{month}.csv", measured, real.joint_types)
    page = look.go("/fleet")
    page.locator('[data-test="check-model"]').click()
    page.get_by_role("option", name="fleet/cell_1/model.yaml", exact=True).click()
    for month, verdict in ((3, "holds"), (4, "changed")):
        page.get_by_label("Date", exact=True).fill(f"2026-0{month}-02")
        look.drop("check", studio.folder / f"new_{month}.csv")
        page.locator(f'[data-test="checked"][data-verdict="{verdict}"]').wait_for()
    assert "joint 3 zero by +0.0" in look.get("checked").inner_text()
    assert "re-master joint 3" in look.get("act").inner_text()
    look.everybody()
    kept = studio.folder / "checks" / "cell_1" / "2026-04-02.json"
    first = kept.read_bytes()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(studio.folder)
        line = shlex.split(look.get("command").first.inner_text())
        assert command([*line[1:], "--quiet"]) == 4  # it has changed
    assert kept.read_bytes() == first
    shown = page.context.new_page()
    shown.goto(studio.base + look.get("history-link").get_attribute("href"))
    shown.locator("h1").filter(has_text="cell_1").wait_for()
    shown.close()
