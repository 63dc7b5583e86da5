# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes in cells whose sensor or camera stands on an arm: down one branch of the tree, up another."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import _core
from fastcal.cells.asked import asked_parameters
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell, Point
from fastcal.cells.errors import view_errors
from fastcal.cells.readings import Readings
from fastcal.cells.sensor_ways import SensorWay, joint_loads, seen_ways
from fastcal.cells.simulate import simulate_cell, view_poses
from fastcal.cells.written import written_cell
from fastcal.cli.app import main
from fastcal.errors import InvalidInput
from fastcal.io.hand_eye_read import read_hand_eye
from fastcal.io.tree_file import load_cell
from fastcal.io.yaml_text import yaml_text
from fastcal.robot.core_model import pose

from . import camera_scene as camera
from . import track_scene
from .test_calibrate import off, simulated

VIEWS = {"tag_left:camera": "pose", "tag_right:camera": "pose"}
NOISE, NOISE_TURN = 5e-5, 1e-4  # [m, rad]
WAVE = 5e-4  # [rad]


def content(**changes: Any) -> dict[str, Any]:
    """A head that turns and nods and sees a tag on each of two arms."""
    link = {"mass_kg": 3.0, "com_mm": [20.0, 10.0, 60.0]}
    row = {"type": "revolute", "theta_deg": 0.0, "link": link}
    neck = [{**row, "d_mm": 120.0, "a_mm": 40.0, "alpha_deg": -90.0}]
    neck += [{**row, "d_mm": 30.0, "a_mm": 90.0, "alpha_deg": 0.0}]
    arms = {
        "head": {"robot": {"name": "head", "kinematics": "dh", "joints": neck}, "xyz_mm": [0.0, 0.0, 900.0]},
        "left": {"robot": "ur5", "xyz_mm": [0.0, 250.0, 500.0], "rpy_deg": [-50.0, 0.0, 0.0]},
        "right": {"robot": "ur10", "xyz_mm": [0.0, -250.0, 500.0], "rpy_deg": [50.0, 0.0, 0.0]},
    }
    targets = {name: {"on": name[4:], "xyz_mm": [40.0, 10.0, 120.0]} for name in ("tag_left", "tag_right")}
    sensor = {"on": "head", "xyz_mm": [100.0, 0.0, 60.0], "rpy_deg": [0.0, 90.0, 0.0]}
    return {"cell": "head", "arms": arms, "targets": targets, "sensors": {"camera": sensor}, **changes}


def cell_of(folder: Path, **changes: Any) -> Cell:
    (folder / "cell.yaml").write_text(yaml_text(content(**changes)), encoding="utf-8")
    return load_cell(folder / "cell.yaml")


def compliant(cell: Cell, arm: str, size: float) -> Cell:
    entry = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": {"value": size}}}
    arms = (replace(of, robot=of.robot.with_(effects=[entry])) if of.name == arm else of for of in cell.arms)
    return replace(cell, arms=tuple(arms))


def found(folder: Path, hidden: str, seed: int, *options: str, code: int = 0) -> dict[str, Any]:
    """diagnosis.json of 90 postures; hidden: ARM.qK of a wave of three cycles, or ARM whose joint 2 yields."""
    cell = cell_of(folder)
    rng = np.random.default_rng(seed)
    nominal = Readings(
        np.zeros((1, 14)),
        {f"{kind}@{v}": np.zeros((1, n)) for v in VIEWS for kind, n in (("position", 3), ("rotation", 4))},
        "",
    )
    truth = off(cell, nominal, rng)
    q = rng.uniform(-2.4, 2.4, (90, 14))
    names = [titles[0] for titles in cell.joint_columns]
    there = q.copy()
    if hidden in names:
        at = names.index(hidden)
        there[:, at] += WAVE * np.sin(3 * q[:, at] + 0.7)
    elif hidden:
        truth = compliant(truth, hidden, 3e-4 if hidden == "head" else 3e-5)
    seen = simulate_cell(truth, Readings(there, {}, ""), [*VIEWS], noise=NOISE, noise_rotation=NOISE_TURN, seed=seed)
    titles, parts = [f"{name}_deg" for name in names], [np.degrees(q)]
    for view in VIEWS:
        titles += [*(f"{axis}_mm@{view}" for axis in "xyz"), *(f"q{of}@{view}" for of in "wxyz")]
        parts += [1e3 * seen.tables[f"position@{view}"], seen.tables[f"rotation@{view}"]]
    with (folder / "poses.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([titles, *([f"{value:.9f}" for value in row] for row in np.hstack(parts))])
    command = ["diagnose", str(folder / "cell.yaml"), str(folder / "poses.csv"), "-o", str(folder / "out")]
    assert main([*command, *options]) == code
    return dict(json.loads((folder / "out/diagnosis.json").read_text(encoding="utf-8")))


def test_a_way_from_a_sensor_is_the_trees_own_chain(tmp_path: Path) -> None:
    """Between any two frames of the tree, links in the middle of arms too: the same poses."""
    cell = cell_of(tmp_path)
    place = {"xyz_mm": [30.0, -20.0, 50.0], "rpy_deg": [10.0, 20.0, 30.0]}
    frames = ("world", "head.link1", "left.base", "left.link3", "left.link6", "right.link2", "head.link2")
    points = tuple(Point(f"p{k}", role, on, place) for k, on in enumerate(frames) for role in ("target",))
    cell = replace(cell, points=(*cell.points, *points))
    rng = np.random.default_rng(4)
    views = {f"p{i}:p{k}": "pose" for i in range(len(frames)) for k in range(len(frames)) if i != k}
    readings = simulated(cell, rng, 3, views)
    ways = [way for way in seen_ways(cell, readings) if isinstance(way, SensorWay)]
    assert len(ways) == len(views) - 2  # no joint lies between the world and the left arm's base
    names = [titles[0] for titles in cell.joint_columns]
    assert [ways[0].owner(end) for end in ("base", "tool")] == [ways[0].sensor.name, ways[0].target.name]
    for way in ways:
        own = [names.index(f"{arm.name}.q{index + 1}") for arm, index in way.joints]
        model = way.robot.error_model
        T = np.asarray(model.predict(_core.Samples(np.ascontiguousarray(readings.q[:, own])), model.start))
        assert np.allclose(T, view_poses(cell, readings, way.name), atol=1e-12)


def test_loads_of_a_way_are_those_of_the_tree(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    q = np.random.default_rng(5).uniform(-2, 2, (4, 14))
    arm = cell.arm("left")
    names = [titles[0] for titles in cell.joint_columns]
    own = _core.Samples(np.ascontiguousarray(q[:, [names.index(f"left.q{k}") for k in range(1, 7)]]))
    alone = _core.ErrorModel(arm.robot.with_(gravity_frame="measuring").core)  # it leans, and gravity does not
    loads = np.asarray(alone.loads(own, alone.start))
    postures = Readings(q, {}, "")
    torques = joint_loads(cell, [(arm, 1), (arm, 2)], postures)
    assert torques is not None
    assert np.allclose(torques, loads[:, [3, 5], 5], atol=1e-9)
    weightless = replace(cell, arms=tuple(of for of in cell_of(tmp_path, arms=_weightless()).arms))
    assert joint_loads(weightless, [(weightless.arm("left"), 1)], postures) is None


def _weightless() -> dict[str, Any]:
    arms: dict[str, Any] = content()["arms"]
    rows = [{"type": "revolute", "theta_deg": 0.0, "d_mm": 100.0, "a_mm": 200.0, "alpha_deg": 90.0}] * 6
    for name in ("left", "right"):
        arms[name] = {**arms[name], "robot": {"name": name, "kinematics": "dh", "joints": rows}}
    arms["head"]["robot"]["joints"] = rows[:2]
    return arms


@pytest.mark.parametrize(("hidden", "owner", "ways"), [("left.q4", "left.joint4", 1), ("head.q1", "head.joint1", 2)])
def test_a_wave_is_named_with_its_arm(tmp_path: Path, hidden: str, owner: str, ways: int) -> None:
    told = found(tmp_path, hidden, 21)
    assert [(of["effect"], of["owner"], of["grade"]) for of in told["effects"]] == [("gear_harmonic", owner, "A")]
    assert len(told["effects"][0]["seen_by"]) == ways
    assert told["effects"][0]["parameters"]["amplitude_rad"]["value"] == pytest.approx(WAVE, rel=0.15)
    model = load_cell(tmp_path / "out/model.yaml")
    assert [of["effect"] for of in model.arm(owner.partition(".")[0]).robot.entries] == ["gear_harmonic"]
    assert (tmp_path / "out/tag_left-camera/report.html").exists()
    assert "tag_left-camera/report.html" in (tmp_path / "out/report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("arm", ["head", pytest.param("left", marks=pytest.mark.full)])
def test_a_joint_that_yields_is_told_by_the_trees_torques_and_is_not_sure(tmp_path: Path, arm: str) -> None:
    told = found(tmp_path, arm, 22)
    (cause,) = told["effects"]
    assert (cause["effect"], cause["owner"], cause["grade"]) == ("joint_compliance", f"{arm}.joint2", "B")
    assert "the sensor stands on an arm that moves" in cause["reasons"][-1]
    size = cause["parameters"]["compliance_rad_nm"]["value"]
    assert size == pytest.approx(3e-4 if arm == "head" else 3e-5, rel=0.15)
    assert [of["effect"] for of in load_cell(tmp_path / "out/model.yaml").arm(arm).robot.entries] == [
        "joint_compliance"
    ]


def test_nothing_is_named_where_nothing_is_hidden(tmp_path: Path) -> None:
    assert found(tmp_path, "", 23)["verdict"] == "none"


@pytest.mark.full
def test_what_is_excluded_is_not_given(tmp_path: Path) -> None:
    told = found(tmp_path, "left", 22, "--exclude", "joint_compliance@left.joint2")
    assert ("joint_compliance", "left.joint2") not in {(of["effect"], of["owner"]) for of in told["effects"]}
    assert "A" not in {of["grade"] for of in told["effects"]}


def test_a_wave_is_seen_by_a_camera_on_another_arm(tmp_path: Path) -> None:
    """An arm on a track looks at a board on a turntable: the turntable's wave is named from the pictures."""
    scene = track_scene.Scene(13)
    q = scene.postures(60)
    scene.write(tmp_path, 1)
    there = q.copy()
    there[:, 7] += 0.05 * np.sin(3 * np.radians(q[:, 7]) + 0.7)
    lines = [",".join(f"{value:.9f}" for value in row) for row in q]
    (tmp_path / "poses.csv").write_text("\n".join([",".join(track_scene.COLUMNS), *lines]) + "\n", encoding="utf-8")
    uv = np.array([scene.picture(row) for row in there])
    camera.write_corners(tmp_path, uv + 0.1 * scene.random.standard_normal(uv.shape), "corners.csv")
    files = [str(tmp_path / name) for name in ("cell.yaml", "poses.csv")]
    more = ["--corners", str(tmp_path / "corners.csv"), "--hand-eye", str(tmp_path / "eye.calib")]
    assert main(["diagnose", *files, *more, "-o", str(tmp_path / "out")]) == 0
    told = json.loads((tmp_path / "out/diagnosis.json").read_text(encoding="utf-8"))
    assert [(of["effect"], of["owner"]) for of in told["effects"]] == [("gear_harmonic", "table.joint1")]
    model = load_cell(tmp_path / "out/model.yaml")
    assert [of["effect"] for of in model.arm("table").robot.entries] == ["gear_harmonic"]
    ((name, entry),) = model.cameras.items()
    assert name
    np.testing.assert_allclose(read_hand_eye(tmp_path / "eye.calib"), pose(entry), atol=1e-9)


def test_readings_that_no_joint_moves_are_refused(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    other = Point("other", "target", "head.link2", {"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]})
    cell = replace(cell, points=(*cell.points, other))
    readings = Readings(np.zeros((2, 14)), {"position@other:camera": np.zeros((2, 3))}, "")
    with pytest.raises(InvalidInput, match="that joints move where they are read from"):
        seen_ways(cell, readings)


def test_no_way_is_written_worse_than_its_frames_alone(tmp_path: Path) -> None:
    """The right arm is as its file says and poorly read; the left one is off, and read as poorly."""
    cell = cell_of(tmp_path)
    names = {name: [f"{kind}@{name}" for kind in ("position", "rotation")] for name in VIEWS}
    nominal = Readings(np.zeros((1, 14)), {field: np.zeros((1, 3)) for of in names.values() for field in of}, "")
    exact, theta = cell.arm("right"), np.array(cell.core.nominal)
    asked = asked_parameters(cell, nominal)
    owners = [cell.core.parameters[i].owner.partition(".")[0] for i in asked]
    theta[[i for i, owner in zip(asked, owners, strict=True) if owner == "left"]] += 5e-3
    truth, q = cell.with_values(theta), np.random.default_rng(7).uniform(-2.4, 2.4, (40, 14))
    read = simulate_cell(truth, Readings(q, {}, ""), [*VIEWS], noise=2e-3, noise_rotation=4e-3, seed=7)
    there, notes = written_cell(cell, cell, read, is_sure=True)
    assert there.arm("right").robot.spec["joints"] == exact.robot.spec["joints"]
    assert there.arm("left").robot.spec["joints"] != cell.arm("left").robot.spec["joints"]
    assert [note for note in notes if "right" in note.partition(":")[0] and "tag_right:camera" in note]
    held = simulate_cell(truth, Readings(np.random.default_rng(8).uniform(-2.4, 2.4, (200, 14)), {}, ""), [*VIEWS])
    free = calibrate_cell(cell, read).cell
    errors = [view_errors(model, held)["position@tag_right:camera"].rms for model in (there, free)]
    assert errors[0] is not None
    assert errors[1] is not None
    assert errors[0] < errors[1]
