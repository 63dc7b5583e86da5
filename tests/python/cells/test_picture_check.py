# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One picture says whether a cell still holds; a few say what moved."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal.cli.app import main

from . import rig_faults


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cell")
    rig_faults.write(folder, 30, 1)
    main(["calibrate", *files(folder, folder / "cell.yaml"), "-o", str(folder / "out")])
    return folder / "out/model.yaml"


def files(folder: Path, robot: Path) -> list[str]:
    return [str(robot), str(folder / "poses.csv"), "--corners", str(folder / "corners.csv")]


def checked(model: Path, folder: Path) -> tuple[int, dict]:  # type: ignore[type-arg]
    code = main(["check", *files(folder, model), "-o", str(folder / "check.json")])
    return code, json.loads((folder / "check.json").read_text())


@pytest.mark.parametrize(("pictures", "seed"), [(1, 5), (1, 6), (3, 7)])
def test_a_cell_that_nobody_touched_holds(model: Path, tmp_path: Path, pictures: int, seed: int) -> None:
    rig_faults.write(tmp_path, pictures, seed)
    code, found = checked(model, tmp_path)
    assert (code, found["verdict"], found["moved"]) == (0, "holds", [])


def test_one_picture_shows_that_something_moved(model: Path, tmp_path: Path) -> None:
    rig_faults.write(tmp_path, 1, 5, camera_mm=np.array([1.0, -1.0, 0.5]))
    code, found = checked(model, tmp_path)
    assert (code, found["verdict"]) == (4, "changed")
    assert {"camera wrist", "board plate"} <= {of["owner"] for of in found["moved"]}
    assert "tell them apart" in found["sentence"]


@pytest.mark.parametrize(("what", "moved"), [("camera_mm", "camera wrist"), ("board_mm", "board plate")])
def test_a_few_say_what(model: Path, tmp_path: Path, what: str, moved: str) -> None:
    rig_faults.write(tmp_path, 4, 8, **{what: np.array([1.5, -1.0, 0.5])})
    code, found = checked(model, tmp_path)
    assert code == 4
    assert [of["owner"] for of in found["moved"]] == [moved]
    size = float(np.linalg.norm([1.5, -1.0, 0.5]))
    assert found["moved"][0]["shift_mm"] == pytest.approx(size, rel=0.1)
    assert found["moved"][0]["turn_deg"] == pytest.approx(0.05 * size, abs=0.04)


@pytest.mark.parametrize(
    ("language", "word", "act"),
    [
        ("en", "Board plate moved.", "Next: check board plate, then adopt"),
        ("de", "Tafel plate hat sich bewegt.", "Als Nächstes: Tafel plate prüfen"),
    ],
)
def test_the_check_is_a_page_where_that_is_asked(
    model: Path, tmp_path: Path, language: str, word: str, act: str
) -> None:
    rig_faults.write(tmp_path, 4, 8, board_mm=np.array([1.5, -1.0, 0.5]))
    page = tmp_path / "check.html"
    assert main(["check", *files(tmp_path, model), "-o", str(page), "--page-language", language]) == 4
    text = page.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    assert word in text
    assert act in text
    assert text.count('<div class="plot"') == 2  # the cell, and the error of each picture
    assert 'id="figure-workspace"' in text


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_postures_that_repeat_worse_are_no_move(model: Path, tmp_path: Path, seed: int) -> None:
    """Each picture has an error of its own, of joints that repeat to 0.05 degrees: nothing moved."""
    rig_faults.write(tmp_path, 10, seed, joint_noise_deg=0.05)
    code, found = checked(model, tmp_path)
    assert (code, found["verdict"], found["moved"], found["lens"]) == (3, "cannot_tell", [], None)
    page = tmp_path / "check.html"
    assert main(["check", *files(tmp_path, model), "-o", str(page)]) == 3
    assert "nothing that may have moved explains why" in page.read_text(encoding="utf-8")


def test_another_focal_length_is_the_lens_and_no_move(model: Path, tmp_path: Path) -> None:
    rig_faults.write(tmp_path, 4, 8)
    content = yaml.safe_load(model.read_text())
    camera = content["cameras"]["wrist"]
    camera["focal_px"] = [1.02 * f for f in camera["focal_px"]]  # as if the pictures had been zoomed out by 2 %
    (tmp_path / "model.yaml").write_text(yaml.safe_dump(content))
    code, found = checked(tmp_path / "model.yaml", tmp_path)
    assert (code, found["verdict"], found["moved"]) == (4, "changed", [])
    assert "the lens of camera wrist: its focal length by -2 %" in found["sentence"]
