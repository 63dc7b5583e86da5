# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cells of several arms: files, readings, one fit of all, and the sentences that refuse what cannot be."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import _core
from fastcal.cells.asked import asked_parameters
from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.errors import ParseError
from fastcal.io.robot_file import read_spec
from fastcal.io.tree_file import cell_text, is_cell, load_cell
from fastcal.io.tree_readings import load_readings
from fastcal.io.yaml_text import yaml_text

NOISE = 2e-5  # [m] of a coordinate


def content(**changes: Any) -> dict[str, Any]:
    """A column that turns, two arms on it, a target on each and a camera on the column."""
    column = read_spec("ur5")
    column = {"name": "column", "kinematics": "dh", "joints": [{**column["joints"][0], "a_mm": 0.0, "d_mm": 500.0}]}
    column["joints"][0] = {key: value for key, value in column["joints"][0].items() if not key.endswith("_rad")}
    out: dict[str, Any] = {
        "cell": "test",
        "arms": {
            "column": {"robot": column, "xyz_mm": [10.0, 20.0, 0.0]},
            "left": {"robot": "ur5", "on": "column", "xyz_mm": [0.0, 200.0, 100.0], "rpy_deg": [-50.0, 0.0, 0.0]},
            "right": {"robot": "ur10", "on": "column", "xyz_mm": [0.0, -200.0, 100.0], "rpy_deg": [50.0, 0.0, 0.0]},
        },
        "targets": {"smr": {"on": "left", "xyz_mm": [40.0, 10.0, 120.0]}, "tag": {"on": "right"}},
        "sensors": {"camera": {"on": "column", "xyz_mm": [100.0, 0.0, 300.0], "rpy_deg": [0.0, 90.0, 0.0]}},
    }
    return {**out, **changes}


def written(folder: Path, cell: dict[str, Any]) -> Path:
    (folder / "cell.yaml").write_text(yaml_text(cell), encoding="utf-8")
    return folder / "cell.yaml"


def simulated(cell: Cell, rng: np.random.Generator, rows: int, views: dict[str, str]) -> Readings:
    """Readings of a cell as it is; the views are of points or of whole poses."""
    q = rng.uniform(-2.5, 2.5, (rows, len(cell.joint_columns)))
    tables = {}
    for view, what in views.items():
        T = np.asarray(cell.model.predict(_core.Samples(q), cell.model.start, of=view))
        tables[f"position@{view}"] = T[:, :3, 3] + rng.normal(0, NOISE, (rows, 3))
        if what == "pose":
            turned = [R @ _core.exp_so3(rng.normal(0, NOISE, 3)) for R in T[:, :3, :3]]
            tables[f"rotation@{view}"] = np.array([quaternion(R) for R in turned])
    return Readings(q, tables, "simulated")


def quaternion(R: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(R).as_quat()[[3, 0, 1, 2]])


def off(cell: Cell, readings: Readings, rng: np.random.Generator) -> Cell:
    """The cell with an error in all that its readings can show."""
    theta = np.array(cell.core.nominal)
    asked = asked_parameters(cell, readings)
    theta[asked] += rng.normal(0, 5e-4, len(asked))
    return cell.with_values(theta)


VIEWS = {"smr": "point", "tag:camera": "pose", "tag": "point"}


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[Cell, Readings, CellResult]:
    cell = load_cell(written(tmp_path_factory.mktemp("cell"), content()))
    rng = np.random.default_rng(3)
    nominal = Readings(np.zeros((1, 13)), {f"{k}@{v}": np.zeros((1, 3)) for v in VIEWS for k in ("position",)}, "")
    truth = off(cell, nominal, rng)
    readings, test = simulated(truth, rng, 80, VIEWS), simulated(truth, rng, 30, VIEWS)
    return truth, test, calibrate_cell(cell, readings, test=test)


def test_all_arms_are_identified_to_the_noise(found: tuple[Cell, Readings, CellResult]) -> None:
    result = found[2]
    assert result.status == "converged"
    before, after = result.train["position"].statistics
    assert before is not None
    assert after is not None
    assert before.rms > 5e-4
    assert after.rms < 1.05 * NOISE * np.sqrt(3)
    assert result.test is not None
    held_out = result.test["position"].statistics[1]
    assert held_out is not None
    assert held_out.rms < 2 * NOISE * np.sqrt(3)
    owners = {p.owner for p in result.parameters}
    assert {"column.joint1", "left.joint3", "right.joint6", "smr", "tag", "camera", "column.base"} <= owners
    assert not {owner for owner in owners if owner.endswith(".tool")}


def test_the_written_cell_loads_back_bit_for_bit(found: tuple[Cell, Readings, CellResult], tmp_path: Path) -> None:
    result = found[2]
    path = tmp_path / "model.yaml"
    path.write_text(cell_text(result.cell, "a remark"), encoding="utf-8")
    assert is_cell(path)
    again = load_cell(path)
    assert np.array_equal(again.core.nominal, result.cell.core.nominal)
    assert cell_text(again, "a remark") == path.read_text(encoding="utf-8")


def csv_of(folder: Path, titles: list[str], rows: list[list[float | str]]) -> Path:
    with (folder / "poses.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([titles, *rows])
    return folder / "poses.csv"


JOINTS = ["column.q1_deg", *(f"{arm}.q{i}_deg" for arm in ("left", "right") for i in range(1, 7))]


def test_columns_are_read_in_the_order_of_the_tree(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, content()))
    titles = [*reversed(JOINTS), "x_mm@smr", "y_mm@smr", "z_mm@smr", "sigma_mm@smr", "colour"]
    read = load_readings(csv_of(tmp_path, titles, [[*range(12, -1, -1), 1000, 2000, 3000, 0.5, 7]]), cell)
    names = [of[0] for of in cell.joint_columns]
    assert np.allclose(np.degrees(read.q[0]), [JOINTS.index(f"{name}_deg") for name in names])
    assert np.array_equal(read.tables["position@smr"], [[1, 2, 3]])
    assert np.array_equal(read.tables["sigma_position@smr"], [[5e-4] * 3])
    assert read.notes == ("column 'colour' is not known and was not read",)


@pytest.mark.parametrize(
    ("titles", "row", "sentence"),
    [
        (["mid.q1_deg"], [0], "names no arm of this cell; its arms are column, left, right"),
        (["left.q7_deg"], [0], "names no joint of its arm; its joints are numbered 1 to 6"),
        (["x_mm@ball"], [0], "which is no target or sensor here; there are camera, smr, tag"),
        (["x@smr"], [0], "has no unit of length"),
        (["x_mm@smr", "sigma_mm@smr"], [1, 0], "expected a standard deviation above 0"),
        (["x_in@smr"], [1e308], "column 'x_in@smr': expected a number"),
        (["x_mm@smr"], [""], "holds a posture and no reading of any target"),
        ([], [], "holds no reading; expected columns such as x_mm@TARGET"),
    ],
)
def test_a_wrong_file_of_postures_gets_one_sentence(
    tmp_path: Path, titles: list[str], row: list[float | str], sentence: str
) -> None:
    cell = load_cell(written(tmp_path, content()))
    path = csv_of(tmp_path, [*JOINTS, *titles], [[*map(float, range(13)), *row]])
    with pytest.raises(ParseError, match=sentence.replace("(", r"\(")):
        load_readings(path, cell)


def test_a_joint_without_a_column_is_named(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, content()))
    path = csv_of(tmp_path, [*JOINTS[:-1], "x_mm@smr"], [[0.0] * 13])
    with pytest.raises(ParseError, match=r"there is no column of the joint right.q6; expected right.q6_deg"):
        load_readings(path, cell)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"targets": {"smr": {"on": "nobody"}}}, "'smr' stands on 'nobody', and there is no such frame"),
        ({"targets": {"left": {"on": "column"}}}, "two members of the cell are named 'left'"),
        ({"target": {}}, "the key 'target' is not known; did you mean 'targets'"),
        (
            {"targets": {"smr": {"on": "left", "sigma_mm": 0}}},
            "targets.smr: sigma_mm: expected a standard deviation above 0",
        ),
        (
            {
                "arms": {"a": {"robot": "ur5", "on": "b"}, "b": {"robot": "ur5", "on": "a"}},
                "targets": {},
                "sensors": {},
            },
            "which in the end stands on 'a' itself",
        ),
    ],
)
def test_a_wrong_cell_gets_one_sentence(tmp_path: Path, changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParseError) as error:
        load_cell(written(tmp_path, content(**changes)))
    assert sentence in str(error.value).replace("targets.smr.sigma_mm", "targets.smr: sigma_mm")
    assert "\n" not in str(error.value)
