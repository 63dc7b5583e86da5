# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Ways whose arms carry other arms: the same poses, and the loads of the whole tree."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.cells.asked import with_effects
from fastcal.cells.branches import LoadedWay, loaded, possible_ways
from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.diagnose import diagnose_cell
from fastcal.cells.paths import Way, serial_ways
from fastcal.cells.readings import Readings
from fastcal.cells.written import written_cell
from fastcal.diagnosis.rivals import Rivals
from fastcal.errors import InvalidInput, Undetermined
from fastcal.io.tree_file import cell_text, load_cell
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.check import check


def arm(name: str, joints: int, mass: float = 3.0) -> dict[str, Any]:
    """A chain of modified DH rows with masses; a torso of so many joints, an arm, a head."""
    rows = [
        {
            "type": "revolute",
            "theta_deg": 20.0 * i,
            "d_mm": 60.0 + 10.0 * i,
            "a_mm": 30.0 * i,
            "alpha_deg": 90.0 * (-1) ** i,
            "min_deg": -170,
            "max_deg": 170,
            "link": {"mass_kg": mass, "com_mm": [40.0, -10.0 * i, 25.0]},
        }
        for i in range(joints)
    ]
    return {"name": name, "kinematics": "mdh", "joints": rows}


def torso(folder: Path, *, masses: bool = True) -> Cell:
    """A torso with two arms and a head, one of them with a hand; a reflector on the left arm's end."""
    sizes = {"torso": 2, "head": 2, "right": 3, "hand": 1, "left": 3}
    for name, joints in sizes.items():
        spec = arm(name, joints)
        if not masses:
            spec["joints"] = [{key: v for key, v in joint.items() if key != "link"} for joint in spec["joints"]]
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(spec))
    on = {"head": "torso", "right": "torso", "hand": "right", "left": "torso"}
    arms: dict[str, Any] = {
        name: {"robot": f"{name}.yaml", "on": on.get(name, "world"), "xyz_mm": [10.0, 200.0 - 100 * k, 300.0]}
        | {"rpy_deg": [20.0 * k, -15.0, 40.0]}
        for k, name in enumerate(sizes)
    }
    cell = {"cell": "humanoid", "arms": arms, "targets": {"smr": {"on": "left", "xyz_mm": [40.0, 10.0, 120.0]}}}
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell, sort_keys=False))
    return load_cell(folder / "cell.yaml")


def way_of(cell: Cell) -> Way:
    return serial_ways(cell, ["smr"])[0]


def postures(cell: Cell, way: Way, rows: int = 7) -> tuple[FloatArray, FloatArray]:
    """Random postures of the tree, and the same of a way."""
    q = np.random.default_rng(3).uniform(-1.2, 1.2, (rows, len(cell.joint_columns)))
    return q, q[:, columns_of(cell, way)]


def test_branches_move_nothing_and_load_the_joints_below_them(tmp_path: Path) -> None:
    cell = torso(tmp_path)
    bare, way = way_of(cell), loaded(cell, way_of(cell))
    assert {arm.name for arm, _ in way.joints} == {"torso", "head", "right", "hand", "left"}
    beside = {way.joints[i][0].name for i in way.robot.beside}
    assert beside == {"head", "right", "hand"}
    q, own = postures(cell, way)
    _, short = postures(cell, bare)
    np.testing.assert_allclose(way.robot.forward(own), bare.robot.forward(short), atol=1e-12)

    def torques(model: _core.ErrorModel, q: FloatArray, frames: list[int]) -> FloatArray:
        return np.asarray(model.loads(_core.Samples(np.ascontiguousarray(q)), model.start))[:, frames, 5]

    tree = _core.ErrorModel(cell.core)
    frames = [cell.core.frame(f"{arm.name}.joint{i + 1}") for arm, i in way.joints]
    in_way = [way.robot.core.frame(f"joint{k + 1}") for k in range(len(way.joints))]
    loads = torques(tree, q, frames)
    np.testing.assert_allclose(torques(_core.ErrorModel(way.robot.core), own, in_way), loads, atol=1e-9)
    # ... which the way alone does not have at the torso.
    alone = [bare.robot.core.frame(f"joint{k + 1}") for k in range(2)]
    assert np.abs(torques(_core.ErrorModel(bare.robot.core), short, alone) - loads[:, :2]).max() > 1.0


def test_a_way_without_masses_beside_it_stays_as_it_is(tmp_path: Path) -> None:
    cell = torso(tmp_path, masses=False)
    way = way_of(cell)
    assert loaded(cell, way) is way


@pytest.mark.parametrize("name", ["torso.joint2", "left.joint1", "right.joint3"])
def test_owners_of_a_loaded_way_are_the_cells(tmp_path: Path, name: str) -> None:
    cell = torso(tmp_path)
    way = loaded(cell, way_of(cell))
    assert name in {way.owner(f"joint{k + 1}") for k in range(len(way.joints))}


def test_a_curve_is_of_a_joint_that_moves_the_tool(tmp_path: Path) -> None:
    """Of others no row would show it."""
    cell = torso(tmp_path)
    way = loaded(cell, way_of(cell))
    robot = way.robot
    own = {f"joint{k + 1}" for k in range(robot.joint_count)} - {f"joint{k + 1}" for k in robot.beside}
    moving = Dataset.from_arrays(np.random.default_rng(1).uniform(-1, 1, (9, robot.joint_count)))
    problem = SimpleNamespace(start=SimpleNamespace(robot=robot), given=[], kept=moving)
    rivals = SimpleNamespace(search=SimpleNamespace(problem=problem))
    every = vars(Rivals)["every"].fget(rivals)
    assert {entry["owner"] for entry in every} == own


STIFFNESS = 4e-5  # compliance of the torso's second joint [rad/(N m)]


def yielding(cell: Cell) -> tuple[Cell, Readings]:
    """The cell whose torso may yield, and points that one that does was read at."""
    asked = with_effects(cell, "geometry,joint_compliance@torso.joint2")
    theta = np.array(asked.model.start)
    theta[-1] = STIFFNESS
    rng = np.random.default_rng(11)
    q = rng.uniform(-1.2, 1.2, (120, len(cell.joint_columns)))
    T = np.asarray(asked.model.predict(_core.Samples(q), theta, of="smr"))
    return asked, Readings(q, {"position@smr": T[:, :3, 3] + rng.normal(0, 2e-5, (len(q), 3))}, "made")


def test_effects_of_arms_are_identified_with_the_cell(tmp_path: Path) -> None:
    cell, readings = yielding(torso(tmp_path))
    left = calibrate_cell(cell, readings)  # as the files have them: none yields
    found = calibrate_cell(cell, readings, effects=True)
    assert found.status == "converged"
    assert rms(found) < 0.2 * rms(left)
    (value,) = [p for p in found.parameters if p.name == "compliance_rad_nm"]
    assert value.owner == "torso.joint2"
    assert abs(value.value - STIFFNESS) < 5 * value.std
    (entry,) = found.cell.arm("torso").robot.entries
    assert entry["parameters"]["compliance_rad_nm"]["value"] == pytest.approx(value.value)


def rms(found: CellResult) -> float:
    return float(np.sqrt((found.train["position"].after ** 2).mean()))


def test_a_diagnosis_counts_what_hangs_beside_the_way(tmp_path: Path) -> None:
    """With the other arm's weight the torso's joint is named; what the way alone carries explains a part of it."""
    bare = torso(tmp_path)
    _, readings = yielding(bare)
    way = loaded(bare, way_of(bare))
    data = Dataset.from_arrays(readings.q[:, columns_of(bare, way)], position=readings.tables["position@smr"])
    found = diagnose_cell(bare, readings, [(way, data, None)])
    clearest = found.effects[0].finding
    assert (clearest.label, clearest.grade) == ("joint_compliance@torso.joint2", "A")
    assert all(of.finding.grade == "C" for of in found.effects[1:])
    (entry, *_) = found.cell.arm("torso").robot.entries
    assert entry["parameters"]["compliance_rad_nm"]["value"] == pytest.approx(STIFFNESS, rel=0.15)


def columns_of(cell: Cell, way: Way) -> list[int]:
    names = [titles[0] for titles in cell.joint_columns]
    return [names.index(arm.joint_columns[i][0]) for arm, i in way.joints]


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ("joint_compliance", "write --effects geometry,joint_compliance"),
        ("geometry,joint_compliance@foot.joint1", "expected an owner such as left.joint1"),
        ("geometry,joint_compliance@left.joint9", "no owner 'joint9'"),
        ("geometry,link_mass", "changes weights"),
    ],
)
def test_effects_that_a_cell_cannot_have_are_refused(tmp_path: Path, asked: str, expected: str) -> None:
    with pytest.raises(InvalidInput, match=expected):
        with_effects(torso(tmp_path), asked)


def test_what_anyone_would_try_is_written_where_it_predicts_better(tmp_path: Path) -> None:
    """A wrong name of mere place, beside all joints that yield; what is sure stays."""
    plain = torso(tmp_path)
    _, readings = yielding(plain)
    wrong = with_effects(plain, "geometry,gear_harmonic@left.joint2:order=3")
    written, notes = written_cell(plain, wrong, readings, is_sure=False)
    assert "joint_compliance" in notes[0]
    assert ("joint_compliance", "joint2") in {(e["effect"], e["owner"]) for e in written.arm("torso").robot.entries}
    right = with_effects(plain, "geometry,joint_compliance@torso.joint2")
    written, notes = written_cell(plain, right, readings, is_sure=True)
    assert not notes
    assert [e["effect"] for e in written.arm("torso").robot.entries] == ["joint_compliance"]


def test_ways_of_arms_that_yield_have_the_loads_of_the_tree_in_checks_too(tmp_path: Path) -> None:
    """A cell that was calibrated so holds on new postures, which with one arm alone its torso would not seem to."""
    cell, readings = yielding(torso(tmp_path))
    assert type(possible_ways(torso(tmp_path), ["smr"])[0]) is Way
    assert isinstance(possible_ways(cell, ["smr"])[0], LoadedWay)
    found = calibrate_cell(cell, readings, effects=True)
    (way,) = possible_ways(found.cell, ["smr"])
    assert way.record is not None
    theta = np.array(cell.model.start)
    theta[-1] = STIFFNESS
    rng = np.random.default_rng(12)
    q = rng.uniform(-1.2, 1.2, (25, len(cell.joint_columns)))
    T = np.asarray(cell.model.predict(_core.Samples(q), theta, of="smr"))
    new = Readings(q, {"position@smr": T[:, :3, 3] + rng.normal(0, 2e-5, (len(q), 3))}, "new")
    checked = check(way.robot, way.rows(found.cell, new))
    assert checked.verdict == "holds"
    (tmp_path / "model.yaml").write_text(cell_text(found.cell, "made"))
    (again,) = possible_ways(load_cell(tmp_path / "model.yaml"), ["smr"])
    assert again.record is not None


def test_a_cell_of_which_a_part_of_the_postures_fixes_nothing_is_written_as_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = torso(tmp_path)
    _, readings = yielding(plain)
    found = with_effects(plain, "geometry,gear_harmonic@left.joint2:order=3")

    def whole(cell: Cell, given: Readings, **options: Any) -> CellResult:
        if len(given) < len(readings):
            raise Undetermined("these postures fix no base")
        return calibrate_cell(cell, given, **options)

    monkeypatch.setattr("fastcal.cells.written.calibrate_cell", whole)
    written, notes = written_cell(plain, found, readings, is_sure=False)
    assert notes == []
    assert [entry["effect"] for entry in written.arm("left").robot.entries] == ["gear_harmonic"]
