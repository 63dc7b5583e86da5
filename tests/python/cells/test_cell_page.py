# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a calibrated cell: errors of each target and sensor, places with their deviations, numbers by arm."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal.cells.asked import WEAK, asked_parameters, priors
from fastcal.cli.app import main

from . import track_scene as track
from .test_diagnose import cell_of, waved, write_poses


def calibrated(folder: Path, *options: str) -> tuple[dict[str, Any], str]:
    command = ["calibrate", str(folder / "cell.yaml"), str(folder / "poses.csv"), *options, "-o", str(folder / "out")]
    assert main(command) == 0
    page = (folder / "out/report.html").read_text(encoding="utf-8")
    return json.loads((folder / "out/result.json").read_text(encoding="utf-8")), page


def test_errors_and_places_of_two_arms(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    write_poses(tmp_path, cell, waved(cell, 60, None))
    test = write_poses(tmp_path, cell, waved(cell, 20, None, seed=5), "test.csv")
    result, page = calibrated(tmp_path, "--test", str(test))
    assert set(result["train"]["views"]) == set(result["test"]["views"]) == {"position@smr_left", "position@smr_right"}
    each = [result["train"]["views"][f"position@smr_{side}"]["after"]["rms"] for side in ("left", "right")]
    of_all = result["train"]["kinds"]["position"]["after"]["rms"]
    assert of_all == pytest.approx((sum(rms**2 for rms in each) / 2) ** 0.5)
    places = {of["name"]: of for of in result["placements"]}
    assert set(places) == {"column", "left", "right", "smr_left", "smr_right"}
    assert places["smr_left"]["on"] == "left.link6"
    assert any(std for std in places["smr_left"]["std_mm"])
    assert '<details class="folded"><summary><h2>What no reading determines</h2>' in page
    for text in (
        "Where everything is located",
        "smr_left",
        "smr_right",
        "Arm left",
        "Arm right",
        "left.joint",
        "Noise",
        "RMS on test poses",
    ):
        assert text in page


def test_places_are_held_weakly_where_the_geometry_is(tmp_path: Path) -> None:
    """All that stands on the column can turn about its joint against it, and no reading shows that."""
    cell = cell_of(tmp_path)
    asked = asked_parameters(cell, waved(cell, 3, None))
    assert priors(cell, asked, [], None).options == {}
    held = priors(cell, asked, [], 3.0)
    places = [i for i in asked if cell.core.parameters[i].owner in ("left.base", "column.base", "smr_left")]
    assert len(places) == 15  # three of a target of which points are read
    sizes = np.array([cell.core.parameters[i].sigma for i in places])
    assert np.allclose(held.sigma[places], WEAK * sizes)
    assert np.array_equal(held.mean, cell.model.start)


def test_errors_of_a_camera_and_places_of_its_board(tmp_path: Path) -> None:
    track.Scene(8).write(tmp_path, 25)
    result, page = calibrated(tmp_path, "--corners", str(tmp_path / "corners.csv"))
    assert list(result["train"]["views"]) == ["corner@plate:wrist"]
    places = {of["name"]: of for of in result["placements"]}
    assert (places["wrist"]["kind"], places["wrist"]["on"]) == ("camera", "arm.link6")
    assert all(std is not None and 0 < std < 1 for std in places["wrist"]["std_mm"])
    assert "RMS on test poses" not in page  # a column that would be empty
    assert "wrist" in page
    assert "plate" in page
    assert "px" in page


def test_pages_of_cells_are_german_where_that_is_asked(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    write_poses(tmp_path, cell, waved(cell, 60, None))
    _, page = calibrated(tmp_path, "--page-language", "de")
    for text in ("Wo alles steht", "Was keine Messung zeigt", "Die RMS-Fehler sanken", 'lang="de"', "Rauschen"):
        assert text in page
    for text in ("Where everything is located", "Stands on", "RMS error", "Noise", "held where", "Largest"):
        assert text not in page
    checked = tmp_path / "check.html"
    model, same = str(tmp_path / "out/model.yaml"), str(tmp_path / "poses.csv")
    assert main(["check", model, same, "-o", str(checked), "--page-language", "de"]) == 0
    page = checked.read_text(encoding="utf-8")
    assert "Die Zelle hält" in page
    assert "Each way" not in page
