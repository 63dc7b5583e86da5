# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes in cells of several arms: named with their arm, joints that ways share once, and what is refused."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from fastcal import _core, load_robot, perturbed, random_poses, simulate
from fastcal.cells.asked import with_effects
from fastcal.cells.branches import ways_of
from fastcal.cells.cell import Cell
from fastcal.cells.diagnosis import CellDiagnosis, CellFinding
from fastcal.cells.paths import Way
from fastcal.cells.readings import Readings
from fastcal.cells.sensor_ways import seen_ways
from fastcal.cli.app import main
from fastcal.cli.cells import gap_lines
from fastcal.diagnosis.result import Finding
from fastcal.errors import InvalidInput
from fastcal.io.tree_file import load_cell
from fastcal.io.way_readings import way_datasets
from fastcal.robot.plain_copy import plain_copy

from .test_calibrate import content, off, simulated, written

NOISE = 2e-5  # [m]
AMPLITUDE, ORDER = 4e-4, 2.0  # of the wave that is hidden [rad]


def cell_of(folder: Path) -> Cell:
    targets = {"smr_left": {"on": "left", "xyz_mm": [40.0, 10.0, 120.0]}, "smr_right": {"on": "right"}}
    targets["smr_right"]["xyz_mm"] = [-30.0, 20.0, 100.0]
    return load_cell(written(folder, content(targets=targets, sensors={})))


def waved(cell: Cell, rows: int, joint: str | None, seed: int = 5) -> Readings:
    """Readings of both targets, made of postures in which one joint is beside its position by a wave."""
    rng = np.random.default_rng(seed)
    views = {"smr_left": "point", "smr_right": "point"}
    truth = off(cell, Readings(np.zeros((1, 13)), {f"position@{view}": np.zeros((1, 3)) for view in views}, ""), rng)
    readings = simulated(truth, rng, rows, views)
    if joint is None:
        return readings
    q = readings.q.copy()
    at = [names[0] for names in cell.joint_columns].index(joint)
    q[:, at] += AMPLITUDE * np.sin(ORDER * q[:, at] + 0.7)
    tables = {}
    for view in views:
        T = np.asarray(truth.model.predict(_core.Samples(q), truth.model.start, of=view))
        tables[f"position@{view}"] = T[:, :3, 3] + rng.normal(0, NOISE, (rows, 3))
    return replace(readings, tables=tables)


def write_poses(folder: Path, cell: Cell, readings: Readings, name: str = "poses.csv") -> Path:
    views = readings.views
    units = ["deg" if kind == "revolute" else "mm" for kind in cell.joint_types]
    titles = [f"{names[0]}_{unit}" for names, unit in zip(cell.joint_columns, units, strict=True)]
    titles += [f"{axis}_mm@{view}" for view in views for axis in "xyz"]
    points = np.hstack([1e3 * readings.tables[f"position@{view}"] for view in views])
    rows = np.hstack([np.where(np.array(units) == "deg", np.degrees(readings.q), 1e3 * readings.q), points])
    with (folder / name).open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([titles, *([f"{value:.9f}" for value in row] for row in rows)])
    return folder / name


def diagnosed(folder: Path, joint: str | None, *options: str, code: int = 0) -> dict[str, Any]:
    cell = cell_of(folder)
    poses = write_poses(folder, cell, waved(cell, 100, joint))
    assert main(["diagnose", str(folder / "cell.yaml"), str(poses), *options, "-o", str(folder / "out")]) == code
    return dict(json.loads((folder / "out/diagnosis.json").read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("joint", "owner", "seen"),
    [
        pytest.param("left.q4", "left.joint4", ["smr_left"], marks=pytest.mark.full),
        pytest.param("right.q2", "right.joint2", ["smr_right"], marks=pytest.mark.full),
        ("column.q1", "column.joint1", ["smr_left", "smr_right"]),
    ],
)
def test_a_wave_is_named_with_its_arm_and_is_in_the_model(
    tmp_path: Path, joint: str, owner: str, seen: list[str]
) -> None:
    found = diagnosed(tmp_path, joint)
    assert (found["status"], found["verdict"]) == ("converged", "named")
    (cause,) = found["effects"]
    assert (cause["effect"], cause["owner"]) == ("gear_harmonic", owner)
    assert cause["seen_by"] == seen
    assert not cause["not_seen_by"]
    assert cause["parameters"]["amplitude_rad"]["value"] == pytest.approx(AMPLITUDE, rel=0.1)
    model = load_cell(tmp_path / "out/model.yaml")
    arm = model.arm(owner.partition(".")[0])
    assert [(entry["effect"], entry["owner"]) for entry in arm.robot.entries] == [
        ("gear_harmonic", owner.partition(".")[2])
    ]
    sizes = [step["train"]["position"]["after"]["rms"] for step in found["gap"]]
    assert [step["added"] for step in found["gap"]] == [None, "geometry", "the effects found"]
    assert sizes[0] > sizes[1] > 1.2 * sizes[2]
    # The cell with it predicts other postures to the noise.
    cell = cell_of(tmp_path)
    test = write_poses(tmp_path, cell, waved(cell, 40, joint, seed=5), "test.csv")
    assert main(["evaluate", str(tmp_path / "out/model.yaml"), str(test), "-o", str(tmp_path / "e.json")]) == 0
    kinds = json.loads((tmp_path / "e.json").read_text(encoding="utf-8"))["kinds"]
    assert kinds["position"]["after"]["rms"] < 1.4e3 * NOISE * 3**0.5
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert owner.replace("joint", "joint ") in page
    assert "With the effects found" in page
    for view in ("smr_left", "smr_right"):
        assert (tmp_path / "out" / view / "report.html").exists()
        assert f"{view}/report.html" in page


def test_nothing_is_named_where_nothing_is_hidden(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, None)
    assert found["verdict"] == "none"
    assert found["effects"] == []
    assert found["ways"]["smr_left"]["joints"][:2] == ["column.joint1", "right.joint1"]  # whose weight it carries too
    assert found["ways"]["smr_left"]["joints"][-1] == "left.joint6"


@pytest.mark.full
def test_what_is_excluded_is_not_given(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    poses = write_poses(tmp_path, cell, waved(cell, 100, "left.q4"))
    command = ["diagnose", str(tmp_path / "cell.yaml"), str(poses), "-o", str(tmp_path / "out")]
    assert main([*command, "--exclude", "gear_harmonic@left.joint4"]) in (0, 3)
    found = json.loads((tmp_path / "out/diagnosis.json").read_text(encoding="utf-8"))
    assert ("gear_harmonic", "left.joint4") not in {(of["effect"], of["owner"]) for of in found["effects"]}


def test_a_way_is_the_cells_own_chain(tmp_path: Path) -> None:
    """Its tool is where the tree has the target, for any posture; conditions of its arms come along."""
    cell = cell_of(tmp_path)
    readings = waved(cell, 6, None)
    poses = write_poses(tmp_path, cell, readings)
    head, *rows = poses.read_text(encoding="utf-8").splitlines()
    more = ",column.approach1,left.approach2,left.payload_kg,right.payload_kg,temperature_c"
    poses.write_text("\n".join([head + more, *(f"{row},1,-1,2.5,9,21" for row in rows)]) + "\n", encoding="utf-8")
    ways = ways_of(cell, readings.views)
    names = [names[0] for names in cell.joint_columns]
    for way, data in zip(ways, way_datasets(poses, cell, ways, readings), strict=True):
        own = [names.index(f"{arm.name}.q{index + 1}") for arm, index in way.joints]
        assert np.allclose(data.q, readings.q[:, own], atol=1e-9)
        T = np.asarray(cell.model.predict(_core.Samples(readings.q), cell.model.start, of=way.name))
        model = way.robot.error_model
        assert np.allclose(model.predict(_core.Samples(data.q), model.start), T, atol=1e-12)
        assert np.allclose(data.position, readings.tables[f"position@{way.name}"], atol=1e-9)
    left = way_datasets(poses, cell, ways, readings)[0]
    assert left.approach is not None
    assert left.approach[:, [0, 2]].tolist() == [[1, -1]] * 6
    assert left.payload is not None
    assert left.payload.tolist() == [2.5] * 6
    assert left.temperature is not None


def test_names_of_a_way_are_the_cells(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    way: Way = ways_of(cell, ["smr_right"])[0]
    assert [way.owner(of) for of in ("joint1", "joint2", "link7", "base", "tool", "payload", "workspace")] == [
        *("column.joint1", "right.joint1", "right.link6", "column.base", "smr_right", "right.payload", "workspace")
    ]
    assert way.owner("joint4<-joint3") == "right.joint3<-right.joint2"
    assert [way.column(of) for of in ("q1", "q4", "temperature_c")] == ["column.q1", "right.q3", "temperature_c"]


def test_what_cannot_be_diagnosed_gets_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell = cell_of(tmp_path)
    with pytest.raises(InvalidInput, match="expected readings from the world of targets on arms' flanges"):
        ways_of(cell, ["smr_left:smr_right"])
    poses = write_poses(tmp_path, cell, waved(cell, 5, None))
    command = ["diagnose", str(tmp_path / "cell.yaml"), str(poses), "-o", str(tmp_path / "out")]
    for more, sentence in (
        (
            ["--exclude", "backlash@mid.joint1"],
            "--exclude backlash@mid.joint1: expected an owner such as column.joint1",
        ),
        (["--corners", str(poses)], "holds corners, and the file has no cameras or no boards"),
    ):
        assert main([*command, *more]) == 2
        error = capsys.readouterr().err.strip().splitlines()
        assert sentence in error[-1]
    assert not (tmp_path / "out").exists()


def test_a_sentence_lists_what_is_sure_and_the_clearest_of_the_rest(tmp_path: Path) -> None:
    found = diagnose_cell_of(["A", "C", "C", "B", "C", "C", "C"])
    listed, more = found.told
    assert [of.finding.grade for of in listed] == ["A", "B", "C"]
    assert more == 4
    assert "4 more that are merely possible (grade C)" in found.sentence
    few = diagnose_cell_of(["C", "C", "C", "C"])
    assert len(few.told[0]) == 4
    assert "more" not in few.sentence
    assert gap_lines([]) == []


def diagnose_cell_of(grades: list[str]) -> CellDiagnosis:
    """A diagnosis that gives names of these grades."""
    effects = [
        CellFinding(Finding("backlash", f"left.joint{k + 1}", grade, {}, 20.0 - k, 1e-9), None, ("smr",))
        for k, grade in enumerate(grades)
    ]
    return CellDiagnosis(Cell("cell", ()), [], effects)


def test_a_target_on_a_link_has_a_way_from_the_world_with_its_readings(tmp_path: Path) -> None:
    """Its column is `x_mm@elbow`, without a sensor, as that of a target on a flange."""
    targets = {"elbow": {"on": "left.link3", "xyz_mm": [10.0, 20.0, 90.0]}, "smr": {"on": "left"}}
    cell = load_cell(written(tmp_path, content(targets=targets, sensors={})))
    readings = simulated(cell, np.random.default_rng(4), 12, {"elbow": "point", "smr": "point"})
    ways = seen_ways(cell, readings)
    # The other target's way has the right arm too, whose weight loads the column.
    assert {way.name: len(way.joints) for way in ways} == {"elbow": 4, "smr": 13}
    rows = way_datasets(write_poses(tmp_path, cell, readings), cell, ways, readings)
    for way, data in zip(ways, rows, strict=True):
        np.testing.assert_allclose(data.position, readings.tables[f"position@{way.name}"], atol=1e-11)
        np.testing.assert_allclose(way.robot.forward(data.q)[:, :3, 3], data.position, atol=6 * NOISE)


def test_a_coupling_of_two_joints_is_an_effect_of_their_arm(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    there = with_effects(cell, "geometry,coupling_ratio@left.joint6<-left.joint5")
    assert [of["owner"] for of in there.arm("left").robot.entries] == ["joint6<-joint5"]
    assert not there.arm("right").robot.entries
    with pytest.raises(InvalidInput, match="expected an owner such as"):
        with_effects(cell, "geometry,coupling_ratio@left.joint1<-right.joint5")


def test_a_coupling_that_is_hidden_is_in_the_model(tmp_path: Path) -> None:
    """A pair has two owners: of a public arm a diagnosis ended with "owned by joint1 to joint6, got 'arm.joint3'"."""
    nominal = load_robot("kuka_kr6_r900")
    hidden = {"effect": "coupling_ratio", "owner": "joint6<-joint5", "parameters": {"ratio": {"value": 4e-3}}}
    true = perturbed(nominal, seed=1).with_(effects=[hidden])
    data = simulate(true, random_poses(nominal, 60, seed=2), noise=NOISE, seed=3)
    (tmp_path / "arm.yaml").write_text(
        yaml.safe_dump({**plain_copy(nominal.spec), "targets": {"n1": {"on": "arm", "xyz_mm": [60, 20, 30]}}})
    )
    at = true.forward(data.q)
    points = at[:, :3, 3] + at[:, :3, :3] @ [0.06, 0.02, 0.03] + np.random.default_rng(4).normal(0, NOISE, (60, 3))
    titles = [*(f"q{k}_deg" for k in range(1, 7)), *(f"{axis}_mm@n1" for axis in "xyz")]
    with (tmp_path / "poses.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([titles, *np.hstack([np.degrees(data.q), 1e3 * points])])
    files = [str(tmp_path / name) for name in ("arm.yaml", "poses.csv", "out")]
    assert main(["diagnose", *files[:2], "-o", files[2]]) == 0
    (entry,) = load_cell(tmp_path / "out/model.yaml").arms[0].robot.entries
    assert (entry["effect"], entry["owner"]) == ("coupling_ratio", "joint6<-joint5")
    assert entry["parameters"]["ratio"]["value"] == pytest.approx(4e-3, rel=0.1)
