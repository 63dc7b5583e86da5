# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What somebody new does wrong, and what the screens say: files in the wrong field, a box of no size, no test poses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import fastcal
from fastcal.fleet import calibrate_many, read_list
from fastcal.fleet.page import write_fleet
from fastcal.studio.project import Project

from .conftest import patiently

SCRIPT = "def p():\n  set_payload(2.35)\n  movej([0, -1.2, 1.3, -1.6, -1.5, 0])\nend\n"
# Braces in a text that is shown are its own, and no places of a message.
KRL = "DEF b()\n$BASE=$NULLFRAME\n$TOOL=$NULLFRAME\nPTP {A1 0,A2 -60,A3 80,A4 0,A5 30,A6 0}\nLIN {Z 25}\nEND\n"


@pytest.fixture(scope="module")
def studio(studio_in: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A project with an arm, measurements of the fit and others, and a model whose joint 2 yields."""
    folder = tmp_path_factory.mktemp("studio") / "cell_7"
    running = studio_in(folder)
    nominal = Project(folder).choose_robot("ur5")
    yields = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 4e-6}}
    real = fastcal.perturbed(nominal.with_(effects=[yields]), seed=1)
    for name, rows in (("measurements.csv", 40), ("test.csv", 12)):
        data = fastcal.simulate(real, fastcal.random_poses(nominal, rows, seed=rows), noise=3e-5, seed=rows)
        fastcal.write_measurements(folder / name, data, nominal.joint_types)
    data = fastcal.load_measurements(folder / "measurements.csv", nominal)
    fastcal.calibrate(nominal, data, effects="geometry,joint_compliance@joint2").save(folder / "calibration")
    yield running
    running.end()


@patiently
def test_a_box_of_no_size_is_not_added(look: Any, studio: Any) -> None:
    look.go("/plan")
    look.get("add-box").click()
    look.page.get_by_text("a box needs two corners that differ in x, y and z").wait_for()
    assert Project(studio.folder).answers.get("keep_out_mm", []) == []
    assert look.page.get_by_role("slider", name="z of box 1").count() == 0
    look.everybody()  # the red note can be read and closed, too


@patiently
def test_test_poses_are_others_than_those_of_the_fit(look: Any, studio: Any) -> None:
    look.go("/result")
    look.page.get_by_label("Measurements").click()
    look.page.get_by_role("option", name="test.csv").click()
    look.get("calibrate").click()
    look.page.get_by_text("the test poses are those of the fit").wait_for()
    look.page.get_by_label("Measurements").click()
    look.page.get_by_role("option", name="measurements.csv").first.click()
    look.page.get_by_label("Effects", exact=True).fill("geometry,joint_compliance@joint2")
    look.get("calibrate").click()
    page = look.page.frame_locator('[data-test="page-calibration"]')
    page.get_by_text("Test: test.csv, 12 poses").wait_for()
    line = look.get("command").inner_text()
    assert line.endswith("-o calibration --effects geometry,joint_compliance@joint2 --test test.csv")


@patiently
def test_a_programs_payload_is_shown_and_used(look: Any, studio: Any, tmp_path: Path) -> None:
    names = {
        "good.script": SCRIPT.format(""),
        "far.script": SCRIPT.format("  movej([9, 9, 9, 9, 9, 9])\n"),
        "b.src": KRL,
    }
    for name, text in names.items():
        (tmp_path / name).write_text(text)
    look.go("/program")
    look.drop("program", tmp_path / "good.script")
    look.get("stated").filter(has_text="Payload as the program states it: 2.35 kg.").wait_for()
    look.get("compensate").click()
    look.get("note").filter(has_text="payload as the program states it: 2.35 kg").wait_for()
    assert look.get("command").inner_text() == (
        "fastcal compensate calibration/model.yaml inputs/good.script -o programs/good.script"
    )
    used = (studio.folder / "programs" / "good.script").read_text()
    look.page.get_by_label("Payload, kg").fill("0")
    look.get("compensate").click()
    look.get("note").filter(
        has_text="0 kg are taken as the payload, as asked for; the program states 2.35 kg"
    ).wait_for()
    assert "--payload-kg 0" in look.get("command").inner_text()
    assert (studio.folder / "programs" / "good.script").read_text() != used
    look.page.get_by_label("Payload, kg").fill("")
    look.drop("program", tmp_path / "b.src")
    look.get("stated").filter(has_not_text="2.35").wait_for(state="attached")
    look.get("compensate").click()
    look.page.get_by_text("it names only Z").wait_for()
    look.page.get_by_text("the arm ur5 speaks URScript, and this program is in KRL").wait_for()
    (tmp_path / "notes.txt").write_text("{x}")
    look.drop("program", tmp_path / "notes.txt")
    look.page.get_by_text("notes.txt: no robot program, by its ending").wait_for()


@patiently
def test_why_an_arm_of_a_fleet_has_no_model_is_said(look: Any, studio: Any) -> None:
    """In the last column, cut where it is long and whole when pointed at; that arm stands first, without numbers."""
    lines = (studio.folder / "measurements.csv").read_text().splitlines()
    cells = [line.split(",") for line in lines]
    rolled = [[*one[:6], *two[6:]] for one, two in zip(cells[1:], [*cells[20:], *cells[1:20]], strict=True)]
    (studio.folder / "rolled.csv").write_text("\n".join(",".join(line) for line in [cells[0], *rolled, []]))
    (studio.folder / "arms.csv").write_text("robot,data,name\nur5,measurements.csv,good\nur5,rolled.csv,lost\n")
    found = calibrate_many(read_list(studio.folder / "arms.csv"), out=studio.folder / "fleet")
    assert [each.status for each in found] == ["converged", "refused"]
    write_fleet(found, studio.folder / "fleet")
    look.go("/fleet")
    look.page.get_by_text("2 arms, 1 without a model").wait_for()
    cell = look.get("matrix").locator("> *")
    assert cell.nth(7).inner_text() == "note"
    first = [cell.nth(8 + k).inner_text() for k in range(8)]
    assert first[:2] == ["lost", "refused"]
    assert first[2:5] == ["–"] * 3
    assert first[7].startswith("rolled.csv: the points do not fit this robot")
    assert cell.nth(16).inner_text() == "good"
    assert cell.nth(23).inner_text().startswith("the joints repeat to about")  # what its calibration notes
    cell.nth(15).hover()
    look.page.get_by_role("tooltip").filter(has_text="rolled.csv: the points do not fit this robot").wait_for()


@patiently
def test_files_in_the_wrong_fields_find_their_place(look: Any, studio: Any, shared_data: Any) -> None:
    """The last one: it writes other test poses."""
    folder = shared_data / "exports" / "01_sa_points"
    look.go("/")
    look.drop("instrument", folder / "joints.csv")
    look.page.get_by_text("joints.csv holds joints and no points").wait_for()
    look.drop("controller", folder / "ur5_sa.txt")
    look.page.locator('[data-test="misfit"][data-grade="good"]').wait_for()
    assert Project(studio.folder).answers["controller"] == "inputs/joints.csv"
    assert Project(studio.folder).answers["instrument"] == ["inputs/ur5_sa.txt"]
    look.get("save-test").click()
    assert look.get("command").inner_text().endswith("-o test.csv")
