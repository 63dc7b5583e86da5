# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Mistakes of a new user with a cell of two arms: each is refused in a sentence that says what was meant."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.errors import view_errors
from fastcal.cells.misfit import check_cell_fit
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.tree_file import load_cell
from fastcal.io.tree_readings import load_readings

from .test_calibrate import content, csv_of, written
from .test_uses import disturbed, postures, two_arms

LEFT, RIGHT = slice(0, 6), slice(6, 12)
FRAMES = "expected world, left, left.base or left.link1 to left.link6, right, right.base or right.link1 to right.link6"


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory) -> tuple[Cell, Readings]:
    cell = two_arms(tmp_path_factory.mktemp("cell"))
    return cell, simulate_cell(disturbed(cell, 1), postures(cell, 25, 3), ["smr", "tag"], noise=2e-5, seed=1)


def joints_exchanged(cell: Cell, readings: Readings) -> tuple[Cell, Readings]:
    return cell, replace(readings, q=np.hstack([readings.q[:, RIGHT], readings.q[:, LEFT]]))


def targets_exchanged(cell: Cell, readings: Readings) -> tuple[Cell, Readings]:
    one, other = (readings.tables[f"position@{name}"] for name in ("smr", "tag"))
    return cell, replace(readings, tables={"position@smr": other, "position@tag": one})


def another_arm(cell: Cell, readings: Readings) -> tuple[Cell, Readings]:
    left, right = cell.arms
    robot = right.robot.with_(base=left.robot.spec["base"])
    return replace(cell, arms=(replace(left, robot=robot), right)), readings


def on_nothing(cell: Cell, readings: Readings) -> tuple[Cell, Readings]:
    points = tuple(replace(of, on="world") if of.name == "smr" else of for of in cell.points)
    return replace(cell, points=points), readings


@pytest.mark.parametrize(
    ("mistake", "sentence"),
    [
        (joints_exchanged, r"do not fit .* with the joints of left and right exchanged it would be 0\."),
        (targets_exchanged, r"do not fit .* with the readings of smr and tag exchanged it would be 0\."),
        (another_arm, r"points of smr do not fit this cell: .* reach of .* mm; is each arm's file the right one"),
        (on_nothing, r"points of smr do not fit .* no arm of the file moves it: what is it `on`\?; --as-read"),
    ],
)
def test_what_does_not_fit_is_refused_and_what_was_meant_is_said(
    read: tuple[Cell, Readings], mistake: Callable[[Cell, Readings], tuple[Cell, Readings]], sentence: str
) -> None:
    """All of these converged, with 0.2 to 1 m left and no word. Here the arms stand where the file has them."""
    cell, readings = mistake(*read)
    views = view_errors(cell, readings)
    with pytest.raises(InvalidInput, match=sentence):
        check_cell_fit(cell, readings, views, as_read=False)
    assert check_cell_fit(cell, readings, views, as_read=True)
    assert not check_cell_fit(read[0], read[1], view_errors(*read), as_read=False)


def test_a_calibration_refuses_what_does_not_fit(read: tuple[Cell, Readings]) -> None:
    with pytest.raises(InvalidInput, match="points of smr do not fit this cell: even when calibrated it misses half"):
        calibrate_cell(*on_nothing(*read))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"targets": {"smr": {"on": "lefty"}}}, f"'smr' stands on 'lefty', and there is no such frame; {FRAMES}"),
        ({"targets": {"smr": {"on": "left.link9"}}}, f"stands on 'left.link9', and there is no such frame; {FRAMES}"),
        (
            {"known_distances": [{"from": "tag", "to": "smrr", "mm": 100.0}]},
            f"known_distances[0].to: there is no 'smrr'; expected a target or sensor, which are smr, tag, {FRAMES[9:]}",
        ),
    ],
)
def test_a_name_that_is_not_there_comes_with_those_that_are(
    tmp_path: Path, changes: dict[str, Any], sentence: str
) -> None:
    arms = {name: {**of, "on": "world"} for name, of in content()["arms"].items() if name != "column"}
    with pytest.raises(ParseError) as error:
        load_cell(written(tmp_path, content(arms=arms, sensors={}, **changes)))
    assert sentence in str(error.value)


@pytest.mark.parametrize(
    ("titles", "sentence"),
    [
        (
            [f"q{i}_deg" for i in range(1, 7)],
            "no column of the joint left.q1; expected left.q1_deg, got columns that are of no joint: q1_deg, q2_deg",
        ),
        (
            [f"left.joint{i}_deg" for i in range(1, 7)],
            "no column of the joint left.q1; expected left.q1_deg, got columns that are of no joint: left.joint1_deg",
        ),
        (
            [*(f"left.q{i}_deg" for i in range(1, 7)), "y_cm@smr"],
            "column 'y_cm@smr': 'cm' is no unit of length known here; expected one of",
        ),
    ],
)
def test_a_column_by_another_name_is_shown(tmp_path: Path, titles: list[str], sentence: str) -> None:
    cell = two_arms(tmp_path)
    every = [*titles, *(f"right.q{i}_deg" for i in range(1, 7)), "x_mm@smr"]
    with pytest.raises(ParseError) as error:
        load_readings(csv_of(tmp_path, every, [[1.0] * len(every)]), cell)
    assert sentence in str(error.value)
