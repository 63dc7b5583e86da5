# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What each arm of a cell carries and knows: columns of the file, the same arm alone, fits and commands with them."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import _core
from fastcal.cells.branches import ways_of
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.compare import compare_cells
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell, view_poses
from fastcal.cli.app import main
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.robot_file import read_spec
from fastcal.io.tree_file import load_cell
from fastcal.io.tree_readings import load_readings
from fastcal.io.tree_readings_out import write_readings
from fastcal.io.way_readings import way_datasets
from fastcal.measurements.dataset import Dataset

from .test_calibrate import JOINTS, content, csv_of, written

NOISE = 2e-5  # [m]
TARGETS = {
    "smr_left": {"on": "left", "xyz_mm": [40.0, 10.0, 120.0]},
    "smr_right": {"on": "right", "xyz_mm": [-30.0, 20.0, 100.0]},
}


def effect(name: str, owner: str, parameter: str, value: float, **options: float) -> dict[str, Any]:
    """An entry of a robot file."""
    return {"effect": name, "owner": owner, **options, "parameters": {parameter: {"value": value, "std": None}}}


SLACK_OF = "backlash", "joint4", "gap_rad"
SLACK = effect(*SLACK_OF, 4e-4)
WARM = effect("thermal_expansion", "link2", "coefficient_1_k", 2e-5, t0_c=20.0)
SOFT_OF = "joint_compliance", "joint2", "compliance_rad_nm"
SOFT = effect(*SOFT_OF, 1e-5)


def cell_of(folder: Path, **effects: list[dict[str, Any]]) -> Cell:
    """Two arms on a column, some with effects, and a reflector on each."""
    arms = content()["arms"]
    for name, own in effects.items():
        spec = arms[name]["robot"]
        arms[name] = {**arms[name], "robot": (read_spec(spec) if isinstance(spec, str) else spec) | {"effects": own}}
    return load_cell(written(folder, content(arms=arms, targets=TARGETS, sensors={})))


def postures(cell: Cell, rows: int, seed: int, **known: dict[str, Any]) -> Readings:
    """Random ones; what is known of an arm, by its name: payload, temperature, approach ..."""
    q = np.random.default_rng(seed).uniform(-2.5, 2.5, (rows, len(cell.joint_columns)))
    arms = {
        of.name: Dataset.from_arrays(q[:, of.first_joint : of.first_joint + of.joint_count], **known.get(of.name, {}))
        for of in cell.core.branches
        if of.joint_count
    }
    return Readings(q, {}, "made", arms=arms)


def signs(rows: int, joints: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).choice([-1.0, 1.0], (rows, joints))


def test_each_arm_is_the_arm_alone_in_its_own_conditions(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, left=[SLACK, WARM, SOFT], right=[WARM, SLACK, SOFT])
    known: dict[str, dict[str, Any]] = {
        "left": {"payload": np.linspace(0, 5, 9), "temperature": np.full(9, 303.0), "approach": signs(9, 6, 1)},
        "right": {"payload": 10.0, "temperature": np.linspace(280, 310, 9), "approach": signs(9, 6, 2)},
    }
    made = postures(cell, 9, 3, **known)
    found = {name: view_poses(cell, made, f"{name}.link6") for name in known}
    at = {of.name: slice(of.first_joint, of.first_joint + of.joint_count) for of in cell.core.branches}
    for name, own in known.items():
        arm, q = cell.arm(name).robot, made.q[:, at[name]]
        # It stands on the column, and gravity does not lean with it.
        base = np.asarray(cell.frames_at(made.q, f"{name}.base"))
        for row in range(9):
            there = arm.with_(base=_place(base[row]), gravity_frame="measuring")
            given = {key: np.atleast_1d(value)[[row % np.size(value)]] if key != "approach" else value[[row]]
                     for key, value in own.items()}  # fmt: skip
            flange = there.error_model.predict(there.conditions(q[[row]], **given), there.error_model.start, of="link6")
            assert np.allclose(flange[0], found[name][row], atol=1e-11)


def _place(T: np.ndarray) -> dict[str, Any]:
    from fastcal.robot.robot_spec import frame_spec

    return frame_spec(T)


def test_a_payload_loads_the_joints_below_its_arm_and_no_other(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    rows = 5
    bare, held = postures(cell, rows, 4), postures(cell, rows, 4, left={"payload": 10.0})
    model = cell.model
    loads = [np.asarray(model.loads(of.samples(cell), model.start)) for of in (bare, held)]
    more = loads[1] - loads[0]
    assert np.allclose(more, model.loads(held.samples(cell), model.start, payload_alone=True), atol=1e-9)
    for f in range(cell.core.frame_count):
        name = cell.core.frame_name(f)
        carries = name.startswith(("column", "left")) and name not in ("column.tool", "left.tool")
        assert np.allclose(np.linalg.norm(more[:, f, :3], axis=1), 10 * 9.80665 if carries else 0), name
    # The moment about the column's joint is that of the weight at the flange.
    T = np.asarray(model.predict(bare.samples(cell), model.start, of="column.joint1"))
    p = np.asarray(model.predict(bare.samples(cell), model.start, of="left.link6"))[:, :3, 3]
    moment = np.einsum("ni,ni->n", T[:, :3, 2], np.cross(p - T[:, :3, 3], 10 * cell.gravity))
    assert np.allclose(more[:, cell.core.frame("column.joint1"), 5], moment, atol=1e-9)


def test_columns_of_a_file(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    more: dict[str, list[Any]] = {
        "left.payload_kg": [0, 2.5, ""],
        "right.payload_g": [1000, 2000, 3000],
        "left.approach2": [1, -1, ""],
        "temperature_c": [20, 21, 22],
        "right.temperature_c": [30, 31, 32],
        "time_s": [0, 60, 120],
        "left.oil_c": [40, 41, 42],
        "remark": ["a", "b", "c"],
    }
    with pytest.raises(ParseError, match=r"columns 'temperature_c' and 'right\.temperature_c' both give temperature_c"):
        load_readings(_file(tmp_path, more), cell)
    more["left.temperature_c"] = more.pop("temperature_c")
    found = load_readings(_file(tmp_path, more), cell)
    left, right, column = (found.arms[name] for name in ("left", "right", "column"))
    assert left.payload.tolist() == [0, 2.5, 0]
    assert right.payload.tolist() == [1, 2, 3]
    assert column.payload.tolist() == [0, 0, 0]
    assert left.approach is not None
    assert left.approach[:, 1].tolist() == [1, -1, 0]
    assert left.temperature is not None
    assert np.allclose(left.temperature, [293.15, 294.15, 295.15])
    assert all(of.time is not None and of.time.tolist() == [0, 60, 120] for of in (left, right, column))
    assert left.extra["oil_c"].tolist() == [40, 41, 42]
    assert not right.extra
    assert found.notes == (
        "column 'remark' is not known and was not read",
        "the payload of left is empty in 1 row and taken as 0 there",
        "column 'left.oil_c' is not known and is kept as it is",
    )
    assert found.pick(np.array([2, 0])).arms["right"].payload.tolist() == [3, 1]
    # What is written is read again.
    write_readings(tmp_path / "again.csv", cell, found)
    again = load_readings(tmp_path / "again.csv", cell)
    for name, of in found.arms.items():
        for field in ("payload", "temperature", "time", "approach"):
            one, two = getattr(of, field), getattr(again.arms[name], field)
            assert (one is None and two is None) or np.allclose(one, two), (name, field)
    assert again.arms["left"].extra["oil_c"].tolist() == [40, 41, 42]


def _file(folder: Path, more: dict[str, list[Any]]) -> Path:
    read = ["x_mm@smr_left", "y_mm@smr_left", "z_mm@smr_left"]
    rows = [[*([float(row)] * 13), 1, 2, 3, *(of[row] for of in more.values())] for row in range(3)]
    return csv_of(folder, [*JOINTS, *read, *more], rows)


@pytest.mark.parametrize(
    ("title", "value", "sentence"),
    [
        ("left.payload_lb", 1, "column 'left.payload_lb': 'lb' is no unit of mass known here; expected payload_kg"),
        ("left.payload", 1, "column 'left.payload' has no unit; expected"),
        ("payload_kg", 1, "column 'payload_kg' names no arm; expected column.payload_kg or left.payload_kg or right"),
        ("mid.payload_kg", 1, "column 'mid.payload_kg' names no arm of this cell; its arms are column, left, right"),
        ("left.payload_kg", "heavy", "column 'left.payload_kg': expected a number, got 'heavy'"),
        ("left.approach9", 1, "column 'left.approach9' names no joint of this robot; its joints are numbered 1 to 6"),
        ("left.approach2", 0, "column 'left.approach2': expected +1 or -1, or an empty cell where"),
        ("left.temperature_c", "", "column 'left.temperature_c': expected a finite number in every row"),
        ("left.fx_n", 1, "expected also fy_n and fz_n and mx_nm"),
    ],
)  # fmt: skip
def test_wrong_columns_get_one_sentence(title: str, value: object, sentence: str, tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    with pytest.raises(ParseError) as error:
        load_readings(_file(tmp_path, {title: [value] * 3}), cell)
    assert sentence in str(error.value)


def test_an_effect_without_its_column_is_refused_in_one_sentence(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, right=[WARM])
    with pytest.raises(InvalidInput, match=r"^arm right: thermal_expansion@link2 needs the column temperature_c"):
        simulate_cell(cell, postures(cell, 3, 1), ["smr_right"])


def test_a_way_has_its_arms_conditions(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    more = {"left.approach2": [1, -1, 1], "column.approach1": [-1, -1, 1], "left.payload_kg": [1, 2, 3]}
    path = _file(tmp_path, more)
    readings = load_readings(path, cell)
    (way,) = ways_of(cell, ["smr_left"])
    own, (read,) = way.rows(cell, readings), way_datasets(path, cell, [way], readings)
    assert own.payload.tolist() == read.payload.tolist() == [1, 2, 3]
    assert own.approach is not None
    assert read.approach is not None
    k = [joint for joint, (arm, index) in enumerate(way.joints) if (arm.name, index) == ("left", 1)]
    assert own.approach[:, k].T.tolist() == read.approach[:, k].T.tolist() == [[1, -1, 1]]


def loaded(cell: Cell, rows: int, seed: int) -> Readings:
    """Postures with and without 10 kg on each flange, drawn apart, reached from either side."""
    rng = np.random.default_rng(seed)
    known: dict[str, Any] = {
        name: {"payload": 10.0 * rng.integers(0, 2, rows), "approach": rng.choice([-1.0, 1.0], (rows, 6))}
        for name in ("left", "right")
    }
    return postures(cell, rows, seed + 1, **known)


def identified(cell: Cell, arm: str) -> dict[str, float]:
    entries = cell.arm(arm).robot.entries
    return {f"{of['effect']}@{of['owner']}": next(iter(of["parameters"].values()))["value"] for of in entries}


def test_compliance_and_backlash_of_an_arm_are_found_by_a_fit_of_all(tmp_path: Path) -> None:
    """10 kg on the other arm must not be taken for a load of this one."""
    true = cell_of(tmp_path, left=[SOFT, SLACK])
    sent = loaded(true, 120, 11)
    read = simulate_cell(true, sent, ["smr_left", "smr_right"], noise=NOISE, seed=12)
    plain = cell_of(tmp_path)
    zero = [effect(*of, 0.0) for of in (SOFT_OF, SLACK_OF)]
    asked = cell_of(tmp_path, left=zero)
    found = calibrate_cell(asked, read, effects=True)
    assert found.status == "converged"
    after = found.train["position"].statistics[1]
    assert after is not None
    assert after.rms < 1.1 * NOISE * np.sqrt(3)
    values = identified(found.cell, "left")
    assert values["joint_compliance@joint2"] == pytest.approx(1e-5, rel=0.05)
    assert values["backlash@joint4"] == pytest.approx(4e-4, rel=0.1)
    stiff = calibrate_cell(plain, read).train["position"].statistics[1]
    assert stiff is not None
    assert stiff.rms > 3 * after.rms
    # Without the payloads in the file the fit does not hold.
    blind = calibrate_cell(asked, replace(read, arms=postures(true, 120, 12).arms), effects=True)
    missed = blind.train["position"].statistics[1]
    assert missed is not None
    assert missed.rms > 2 * after.rms


@pytest.mark.parametrize("hidden", [pytest.param(SOFT, marks=pytest.mark.full), SLACK], ids=["compliance", "backlash"])
def test_what_follows_a_condition_is_named_and_written(hidden: dict[str, Any], tmp_path: Path) -> None:
    true = cell_of(tmp_path, left=[hidden])
    read = simulate_cell(true, loaded(true, 140, 21), ["smr_left", "smr_right"], noise=NOISE, seed=22)
    cell = cell_of(tmp_path)
    write_readings(tmp_path / "poses.csv", cell, read)
    files = [str(tmp_path / of) for of in ("cell.yaml", "poses.csv", "out")]
    assert main(["diagnose", *files[:2], "-o", files[2]]) == 0
    found = json.loads((tmp_path / "out/diagnosis.json").read_text(encoding="utf-8"))
    named = {(of["effect"], of["owner"]) for of in found["effects"]}
    assert (hidden["effect"], f"left.{hidden['owner']}") in named
    model = load_cell(tmp_path / "out/model.yaml")
    key = f"{hidden['effect']}@{hidden['owner']}"
    (wanted,) = (of["value"] for of in hidden["parameters"].values())
    assert identified(model, "left")[key] == pytest.approx(wanted, rel=0.15)
    # It predicts other postures to the noise, by their conditions.
    other = simulate_cell(true, loaded(true, 40, 31), ["smr_left", "smr_right"])
    left = view_poses(model, other, "smr_left")[:, :3, 3] - other.tables["position@smr_left"]
    assert np.sqrt(np.mean(left**2)) < 2 * NOISE


def test_commands_take_the_columns(tmp_path: Path) -> None:
    """Simulated, calibrated, predicted, checked, brought up to date: each reads what the arms carry."""
    true = cell_of(tmp_path, left=[SOFT, SLACK])
    (tmp_path / "true").mkdir()
    cell_of(tmp_path / "true", left=[SOFT, SLACK])
    sent = loaded(true, 90, 41)
    write_readings(tmp_path / "sent.csv", true, sent)
    names = ("sent.csv", "read.csv", "out", "predicted.csv", "new", "true/cell.yaml")
    at = {name: str(tmp_path / name) for name in names}
    options = ["--views", "smr_left,smr_right", "--noise-mm", "0.02"]
    assert main(["simulate", at["true/cell.yaml"], at["sent.csv"], *options, "-o", at["read.csv"]]) == 0
    with (tmp_path / "read.csv").open(encoding="utf-8") as file:
        titles = next(csv.reader(file))
    assert {"left.payload_kg", "right.payload_kg", "left.approach4"} <= set(titles)
    assert main(["calibrate", at["true/cell.yaml"], at["read.csv"], "-o", at["out"]]) == 0
    model = str(tmp_path / "out/model.yaml")
    assert main(["evaluate", model, at["read.csv"]]) == 0
    assert main(["predict", model, at["sent.csv"], "-o", at["predicted.csv"]]) == 0
    with (tmp_path / "predicted.csv").open(encoding="utf-8") as file:
        predicted = list(csv.DictReader(file))
    points = np.array([[float(row[f"{axis}_mm@smr_left"]) for axis in "xyz"] for row in predicted])
    exact = 1e3 * view_poses(true, sent, "smr_left")[:, :3, 3]
    assert np.sqrt(np.mean((points - exact) ** 2)) < 2e3 * NOISE
    assert main(["check", model, at["read.csv"]]) == 0
    assert main(["update", model, at["read.csv"], "-o", at["new"]]) == 0


def test_samples_side_by_side() -> None:
    one = _core.Samples(np.zeros((2, 1)), payload=[1.0, 2.0])
    two = _core.Samples(np.ones((2, 3)), temperature=[3.0, 4.0], extra=np.ones((2, 2)))
    assert len(_core.Samples.side_by_side([one, two])) == 2
    with pytest.raises(InvalidInput, match="expected 2 postures of each arm, got 1"):
        _core.Samples.side_by_side([one, _core.Samples(np.zeros((1, 2)))])
    with pytest.raises(InvalidInput, match="expected the postures of at least one arm"):
        _core.Samples.side_by_side([])


def test_postures_are_planned_for_arms_with_effects(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They come from either side where backlash asks for it, and what heat does is said not to be planned for."""
    cell_of(tmp_path, left=[SLACK, SOFT], right=[WARM])
    poses, read = tmp_path / "plan.csv", tmp_path / "read.csv"
    asked = ["--count", "20", "--views", "smr_left,smr_right", "-o", str(poses)]
    assert main(["design", str(tmp_path / "cell.yaml"), *asked]) == 0
    told = capsys.readouterr()
    assert "without a payload; the arms' effects stay known" in told.err
    assert "not chosen for thermal_expansion@link2 of right" in told.err
    with poses.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["left.approach4"] for row in rows} == {"1.0", "-1.0"}
    assert [title for title in rows[0] if "approach" in title] == ["left.approach4"]
    cell_of(tmp_path, left=[SLACK, SOFT])  # the plan has the columns that a simulation of this cell needs
    assert main(["simulate", str(tmp_path / "cell.yaml"), str(poses), "--views", "smr_left", "-o", str(read)]) == 0


def test_models_of_arms_with_effects_are_compared(tmp_path: Path) -> None:
    """The joints of a way were counted without the arms that only load it: no compliance differed, nor any backlash."""
    models = []
    for seed, compliance in ((21, 1e-5), (22, 1.3e-5)):
        true = cell_of(tmp_path, left=[effect(*SOFT_OF, compliance)])
        asked = cell_of(tmp_path, left=[effect(*SOFT_OF, 0.0)])
        read = simulate_cell(true, loaded(true, 50, seed), ["smr_left"], noise=NOISE, seed=seed)
        models.append(calibrate_cell(asked, read, effects=True).cell)
    left, right = compare_cells(*models).ways
    found = {(of.owner, of.name): of for of in left.significant}
    assert found["left.joint2", "compliance_rad_nm"].difference == pytest.approx(3e-6, rel=0.2)
    assert set(np.unique(left.found.payload)) == {0.0, 10.0}
    assert not [of for of in right.significant if "compliance" in of.name]
