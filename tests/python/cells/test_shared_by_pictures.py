# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Corners of a picture share what joints do not repeat, and nothing else is to be taken for that."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from fastcal.cells.asked import pictured_ground, priors
from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.errors import view_errors
from fastcal.cells.fit import Fit
from fastcal.cells.readings import Readings
from fastcal.cells.rig_start import RigStart
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import load_cell
from fastcal.robot.rig import pictures

from .camera_scene import FloatArray, write

COUNT = 28


def scene(folder: Path, change: Callable[[dict[str, Any]], Any]) -> tuple[Cell, Readings]:
    """A cell with a target, which makes it one of several arms; the second link is 1 mm too long."""
    write(folder, COUNT, seed=4, error_mm=1.0)
    content = yaml.safe_load((folder / "cell.yaml").read_text())
    content["targets"] = {"tip": {"on": "arm"}}
    change(content)
    (folder / "cell.yaml").write_text(yaml.safe_dump(content))
    cell = load_cell(folder / "cell.yaml")
    return cell, load_seen_readings(folder / "poses.csv", cell, folder / "corners.csv")


def rms_px(found: CellResult, readings: Readings) -> float:
    errors: FloatArray = view_errors(found.cell, readings)["corner@plate:wrist"].after
    return float(np.sqrt(np.nanmean(errors**2)))


def test_a_wrong_lens_is_not_taken_for_joints_that_do_not_come_back(tmp_path: Path) -> None:
    """All was laid on the joints, the arm stayed as its file says, and 20.8 px were left."""
    cell, readings = scene(tmp_path, lambda of: of["cameras"]["wrist"]["distortion"].__setitem__(0, -0.02))
    found = calibrate_cell(cell, readings, as_read=True)
    assert rms_px(found, readings) < 3.0
    assert any("such as an error of the lens" in note for note in found.notes)


def test_with_the_right_lens_the_arm_is_found_and_nothing_is_said(tmp_path: Path) -> None:
    cell, readings = scene(tmp_path, lambda of: None)
    found = calibrate_cell(cell, readings)
    assert rms_px(found, readings) < 0.2
    assert not [note for note in found.notes if "such as an error of the lens" in note]


@pytest.mark.parametrize(("known", "ground"), [({}, "arm"), ({"sigma_mm": 1.0}, None), ({"fixed": True}, None)])
def test_pictures_alone_leave_the_world_where_the_first_arm_stands(
    tmp_path: Path, known: dict[str, Any], ground: str | None
) -> None:
    """Held weakly with the geometry, the base and all that stands in the world wandered off together."""
    cell, readings = scene(tmp_path, lambda of: of["boards"]["plate"].update(known))
    assert pictured_ground(cell, readings) == ground
    assert (
        pictured_ground(cell, Readings(readings.q, {**readings.tables, "position@tip": np.zeros((28, 3))}, "")) is None
    )
    sigma = [priors(cell, [0], [], 1.0, of).sigma[0] for of in (ground, None)]
    assert bool(sigma[0] < 0.05 * sigma[1]) is (ground is not None)


def test_a_camera_with_nothing_but_gross_pictures_ends_no_fit(tmp_path: Path) -> None:
    """Its place was no longer among what the other rows show: theta must hold 48 numbers, got 66."""

    def another(of: dict[str, Any]) -> None:
        of["cameras"]["other"] = {**of["cameras"]["wrist"], "xyz_mm": [0, 70, 50]}

    cell, readings = scene(tmp_path, another)
    uv = readings.tables["corner"].reshape(COUNT, -1, 2)
    part = pictures(cell)["other", "plate"]
    uv[-4:] = np.nan
    uv[-4:, part] = np.random.default_rng(1).uniform(0, 900, uv[-4:, part].shape)
    options: dict[str, Any] = {"effects": False, "arms": None, "loss": "tukey", "threads": 1}
    found = Fit.of(cell, readings, RigStart({}), report=lambda text: None, **options)
    assert set(found.found.outliers) >= {COUNT - 4, COUNT - 3, COUNT - 2, COUNT - 1}
    assert np.nanmedian(np.abs(found.errors(found.model)["corner@plate:wrist"])) < 0.2
