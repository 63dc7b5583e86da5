# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal place`: what its files hold, what it says, what it refuses."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import fastcal as library
from fastcal.io.tree_file import load_cell, write_cell

from ..calibration.test_touches import DOWN, TOOL, arm, touches
from ..cells.test_place import pair, read


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "robot.yaml"
    arm().with_(tool={"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]}).save(path)
    return path


def table(path: Path, titles: list[str], columns: list[Any]) -> Path:
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([titles, *zip(*columns, strict=True)])
    return path


def joints(q: Any) -> tuple[list[str], list[Any]]:
    return [f"q{k}_deg" for k in range(1, 7)], list(np.degrees(q).T)


def test_a_tool_goes_into_the_robot_file_with_its_deviation(fastcal, robot: Path, tmp_path: Path) -> None:
    data = touches("socket", 8, 2)
    titles, columns = joints(data.q)
    path = table(tmp_path / "touches.csv", [*titles, "socket"], [*columns, ["a"] * 8])
    said = fastcal("place", robot, path, "--what", "tool", "-o", tmp_path / "out.yaml")
    assert (said.code, said.err.count("warning: the points of each label")) == (0, said.err.count("warning"))
    found = library.load_robot(tmp_path / "out.yaml")
    assert np.abs(np.array(found.spec["tool"]["xyz_mm"]) - TOOL["xyz_mm"]).max() < 0.3
    first = (tmp_path / "out.yaml").read_text().splitlines()[0]
    assert first.startswith("# tool at ")
    assert " +- " in first
    content = json.loads(fastcal("place", robot, path, "--what", "tool", "-o", tmp_path / "2.yaml", "--json").out)
    assert content["what"] == "tool"
    assert content["count"] == 8
    assert content["degrees_of_freedom"] == 18
    assert content["std_deg"] == [None, None, None]
    assert all(0 < std < 0.2 for std in content["std_mm"])


def test_a_spheres_radius_is_found_where_it_is_asked_for(fastcal, robot: Path, tmp_path: Path) -> None:
    data = touches("anchor", 14, 2)
    titles, columns = joints(data.q)
    path = table(tmp_path / "ball.csv", [*titles, "anchor", "distance_mm"], [*columns, ["ball"] * 14, [26.0] * 14])
    asked = ["place", robot, path, "--what", "tool", "--find-radius", "-o", tmp_path / "out.yaml"]
    radius, std = json.loads(fastcal(*asked, "--json").out)["radius_mm"]
    assert abs(radius - 25.0) < 4 * std < 1.0
    assert "radius of the sphere 2" in (tmp_path / "out.yaml").read_text().splitlines()[0]
    asked[4] = "base"
    assert "--find-radius is for a tool of one arm that touched a sphere" in fastcal(*asked).err


def test_a_part_goes_into_a_cell_whose_arm_is_fixed(fastcal, tmp_path: Path) -> None:
    arm().save(tmp_path / "robot.yaml")
    q = DOWN + np.random.default_rng(5).uniform(-0.5, 0.5, (6, 6))
    p = 1e3 * (arm().forward(q)[:, :3, 3] - [0.1, 0.2, 0.3])
    titles, columns = joints(q)
    path = table(tmp_path / "part.csv", [*titles, "x_mm", "y_mm", "z_mm"], [*columns, *p.T])
    out = tmp_path / "cell.yaml"
    said = fastcal("place", tmp_path / "robot.yaml", path, "--what", "part", "--name", "jig", "-o", out)
    assert (said.code, said.err) == (0, "")
    cell = load_cell(out)
    (jig,) = cell.points
    assert (jig.name, jig.on) == ("jig", "world")
    assert np.allclose(jig.place["xyz_mm"], [100, 200, 300], atol=1e-6)
    assert cell.known("arm").fixed


def test_an_axis_goes_into_the_cell(fastcal, tmp_path: Path) -> None:
    true, sent = pair(tmp_path, "revolute")
    write_cell(sent, tmp_path / "sent.yaml")
    readings = read(true, 8, 1)
    names = [f"{titles[0]}_deg" for titles in sent.joint_columns]
    p = 1e3 * readings.tables["position@mark"]
    path = table(
        tmp_path / "turns.csv",
        [*names, "x_mm@mark", "y_mm@mark", "z_mm@mark"],
        [*np.degrees(readings.q).T, *p.T],
    )
    out = tmp_path / "placed.yaml"
    said = fastcal("place", tmp_path / "sent.yaml", path, "--what", "axis", "-o", out)
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith("table on world at ")
    assert "it moves by 1 +" in said.out
    content = yaml.safe_load(out.read_text())
    assert content["arms"]["table"]["sigma_mm"] > 0
    assert content["arms"]["table"]["robot"]["effects"][0]["effect"] == "reduction_ratio"
    by_name = fastcal("place", tmp_path / "sent.yaml", path, "--what", "base", "-o", tmp_path / "other.yaml")
    assert by_name.code == 2
    assert "--name says which members of the cell are placed; there are arm, table, mark, tip" in by_name.error


def test_what_cannot_be_is_one_sentence_and_writes_nothing(fastcal, robot: Path, tmp_path: Path) -> None:
    data = touches("socket", 8, 2, turned=0.0)
    titles, columns = joints(data.q)
    path = table(tmp_path / "touches.csv", [*titles, "socket"], [*columns, ["a"] * 8])
    out = tmp_path / "out.yaml"
    said = fastcal("place", robot, path, "--what", "tool", "-o", out)
    assert said.code == 3
    assert "all postures have one orientation; turn the tool by 30 degrees" in said.error
    said = fastcal("place", robot, path, "--what", "axis", "-o", out)
    assert said.code == 2
    assert "--what axis expects a cell" in said.error
    said = fastcal("place", robot, path, "--what", "tool", "--name", "gun", "-o", out)
    assert said.code == 2
    assert not out.exists()
