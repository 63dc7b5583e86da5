# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A diagnosis does not know how its points are called; what a sensor read is tried."""

import json
from pathlib import Path

import numpy as np
import pytest

import fastcal
from fastcal.diagnosis.columns import columns_of
from fastcal.io.measurements import load_measurements
from fastcal.report.diagnosis_report import diagnosis_page

ROWS = 60
RNG = np.random.default_rng(4)
NAMES = {
    "none": None,
    "P001": [f"P{k:03d}" for k in range(ROWS)],
    "1": range(1, ROWS + 1),
    "in any order": RNG.permutation(ROWS),
    "serial numbers": RNG.integers(1000, 99_999, ROWS),
}


@pytest.fixture(scope="module")
def drifting(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """An arm whose base sinks by 0.6 mm, row by row, without a column that says when a row was measured."""
    robot = fastcal.load_robot("ur5")
    q = fastcal.random_poses(robot, ROWS, seed=3)
    data = fastcal.simulate(fastcal.perturbed(robot, seed=1), q, noise=3e-5, seed=2)
    assert data.position is not None
    data.position[:, 2] += 6e-4 * np.linspace(0, 1, ROWS)
    folder = tmp_path_factory.mktemp("drifting")
    fastcal.write_measurements(folder / "data.csv", data, robot.joint_types)
    data.position[:, 2] += 6e-4 * (np.sin(40 * np.linspace(0, 1, ROWS)) - np.linspace(0, 1, ROWS))
    fastcal.write_measurements(folder / "wavy.csv", data, robot.joint_types)
    return folder / "data.csv", folder / "wavy.csv"


def with_column(path: Path, title: str, values: object) -> Path:
    lines = path.read_text().splitlines()
    out = path.with_name("with_column.csv")
    out.write_text("\n".join([f"{lines[0]},{title}", *(f"{a},{b}" for a, b in zip(lines[1:], values, strict=True))]))  # type: ignore[call-overload]
    return out


def test_a_diagnosis_is_the_same_whatever_its_points_are_called(drifting: tuple[Path, Path]) -> None:
    robot, found = fastcal.load_robot("ur5"), {}
    for name, values in NAMES.items():
        for title in ("name", "Messung") if values is not None else ("",):
            path = drifting[0] if values is None else with_column(drifting[0], title, values)
            result = fastcal.diagnose(robot, load_measurements(path, robot)).to_json_dict()
            assert result.pop("columns")["tried"] == []
            assert not any(word in json.dumps(result["unexplained"]) for word in ("name", "Messung"))
            result.pop("notes")
            found[name, title] = json.dumps(result)
    assert len(set(found.values())) == 1


def test_what_a_sensor_read_is_tried_and_the_page_says_so(drifting: tuple[Path, Path]) -> None:
    robot = fastcal.load_robot("ur5")
    reading = np.sin(40 * np.linspace(0, 1, ROWS)).round(4)
    data = load_measurements(with_column(drifting[1], "oil,Nr.", [f"{x},{k}" for k, x in enumerate(reading)]), robot)
    result = fastcal.diagnose(robot, data)
    assert result.to_json_dict()["columns"] == {"tried": ["oil"], "labels": ["Nr."], "unvaried": []}
    assert result.unexplained is not None
    assert "oil" in result.unexplained.depends_on
    page = " ".join(diagnosis_page(result).split())
    assert "tested as causes, in addition to the joint positions: oil." in page
    assert "Labels, which are never a cause: Nr.." in page


def test_columns_that_do_not_vary_are_told_apart(drifting: tuple[Path, Path]) -> None:
    robot = fastcal.load_robot("ur5")
    data = load_measurements(with_column(drifting[0], "level,serial,payload_kg", ["1.5,7,2"] * ROWS), robot)
    found = columns_of(data)
    assert (found.tried, found.labels, found.unvaried) == ((), ("serial",), ("level",))
