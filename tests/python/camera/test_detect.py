# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal detect`: from a folder of pictures to the table that `calibrate` takes."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from fastcal.camera.rendering import render
from fastcal.cli import demo_camera, main
from fastcal.io.robot_file import load_robot

from ..cells import camera_scene as scene

COUNT = 14
EMPTY = 5


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cell, its poses and its pictures, of which one shows no board; only to be read."""
    where = tmp_path_factory.mktemp("pictures")
    scene.write(where, count=COUNT)
    spec = load_robot(where / "cell.yaml").spec
    (where / "shots").mkdir()
    for k, q in enumerate(scene.postures(COUNT, 1)):
        T = np.linalg.inv(scene.flange(q) @ scene.WRIST) @ scene.PLATE
        T[:3, 3] *= 1e-3
        picture = render(spec["cameras"]["wrist"], spec["boards"]["plate"], T, seed=k)
        cv2.imwrite(
            str(where / "shots" / f"shot_{k + 1:02d}.png"), np.full_like(picture, 110) if k == EMPTY else picture
        )
    return where


def test_pictures_become_a_table_that_calibrates_the_arm(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table, out = tmp_path / "corners.csv", tmp_path / "out"
    cell, poses = str(folder / "cell.yaml"), str(folder / "poses.csv")
    assert main(["detect", str(folder / "shots"), "--cell", cell, "--joints", poses, "-o", str(table)]) == 0
    said = capsys.readouterr()
    assert f"{COUNT - 1} of {COUNT} pictures show a board; {(COUNT - 1) * 24} corners" in said.out
    assert "which count from 1" in said.out
    assert f"shot_{EMPTY + 1:02d}.png: row {EMPTY}: plate: no checkerboard of 6 x 4" in said.err
    assert table.read_text().startswith("row,camera,board,corner,u_px,v_px,picture\n0,wrist,plate,0,")

    given = ["calibrate", cell, poses, "--corners", str(table), "--effects", "joint_compliance@joint2"]
    assert main([*given, "-o", str(out)]) == 0
    found = load_robot(out / "model.yaml").spec["cameras"]["wrist"]
    assert np.linalg.norm(np.array(found["xyz_mm"]) - scene.WRIST[:3, 3]) < 1.0
    result = json.loads((out / "result.json").read_text())
    assert result["train"]["kinds"]["corner"]["after"]["rms"] < 0.2


@pytest.mark.parametrize(("more", "code"), [((1, 0), 2), ((-1, -1), 0)])
def test_a_board_of_another_size_is_said_with_its_size(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[int, int], code: int
) -> None:
    """Of a board with a column too many nothing is found; inner corners that are counted are a part of the board."""
    content = yaml.safe_load((folder / "cell.yaml").read_text())
    board = content["boards"]["plate"]
    true = {key: board[key] for key in ("columns", "rows")}
    board |= {key: of + k for (key, of), k in zip(true.items(), more, strict=True)}
    content["arms"]["arm"]["robot"] = str(folder / content["arms"]["arm"]["robot"])
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(content))
    pictures = [str(folder / "shots" / f"shot_{k:02d}.png") for k in (1, 2)]
    given = ["--cell", str(tmp_path / "cell.yaml"), "--joints", str(folder / "poses.csv")]
    assert main(["detect", *pictures, *given, "-o", str(tmp_path / "corners.csv")]) == code
    says = f"write kind: checkerboard, columns: {true['columns']}, rows: {true['rows']}, which count squares"
    assert says in capsys.readouterr().err


def test_the_page_shows_every_picture_with_its_corners(folder: Path, tmp_path: Path) -> None:
    table = tmp_path / "corners.csv"
    assert main(["detect", str(folder / "shots"), "--cell", str(folder / "cell.yaml"), "-o", str(table)]) == 0
    page = (tmp_path / "corners.html").read_text()
    assert page.count("data:image/jpeg;base64,") == COUNT
    assert page.count("<circle cx=") >= (COUNT - 1) * 24
    assert f"{COUNT - 1} of {COUNT}" in page
    german = ["--page-language", "de"]
    assert main(["detect", str(folder / "shots"), "--cell", str(folder / "cell.yaml"), "-o", str(table), *german]) == 0
    assert "Ecken in Bildern" in (tmp_path / "corners.html").read_text()


def test_the_same_corners_are_found_side_by_side(folder: Path, tmp_path: Path) -> None:
    given = ["detect", *map(str, sorted((folder / "shots").iterdir())[:6]), "--cell", str(folder / "cell.yaml")]
    assert main([*given, "-o", str(tmp_path / "a.csv")]) == 0
    assert main([*given, "--jobs", "2", "-o", str(tmp_path / "b.csv")]) == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_a_cell_of_several_arms_finds_the_same_corners(folder: Path, tmp_path: Path) -> None:
    content = yaml.safe_load((folder / "cell.yaml").read_text(encoding="utf-8"))
    content["arms"]["second"] = {"robot": "ur5", "xyz_mm": [2000, 0, 0]}
    (tmp_path / "arm.yaml").write_bytes((folder / "arm.yaml").read_bytes())
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    tables = []
    for where in (folder, tmp_path):
        tables.append(tmp_path / f"{where.name}.csv")
        command = ["detect", str(folder / "shots"), "--cell", str(where / "cell.yaml"), "-o", str(tables[-1])]
        assert main(command) == 0
    assert tables[0].read_text(encoding="utf-8") == tables[1].read_text(encoding="utf-8")


def test_pictures_of_another_size_are_named(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite(str(tmp_path / "0.png"), np.full((480, 640), 110, np.uint8))
    (tmp_path / "1.png").write_text("no picture")
    table = tmp_path / "corners.csv"
    assert main(["detect", str(tmp_path), "--cell", str(folder / "cell.yaml"), "-o", str(table)]) == 2
    said = capsys.readouterr()
    assert "640 x 480 pixels, and those of camera wrist are 1280 x 960" in said.err
    assert "cannot be read as a picture" in said.out
    assert not table.exists()


def test_a_robot_without_cameras_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite(str(tmp_path / "0.png"), np.full((480, 640), 110, np.uint8))
    assert main(["detect", str(tmp_path), "--cell", "ur5", "-o", str(tmp_path / "corners.csv")]) == 2
    assert "no cameras or no boards" in capsys.readouterr().err


def test_a_large_picture_is_found_as_well(folder: Path) -> None:
    """The board is looked for in a smaller picture, and found to a fraction of a pixel of the large one."""
    from fastcal.camera.finding import find_board
    from fastcal.robot.rig import board_corners

    spec = load_robot(folder / "cell.yaml").spec
    board = spec["boards"]["plate"]
    camera = spec["cameras"]["wrist"] | {"size_px": [2592, 1944], "focal_px": [2200.0, 2200.0]}
    camera |= {"centre_px": [1296.0, 972.0], "distortion": []}
    T = np.eye(4)
    T[:3, 3] = [-0.06, -0.04, 0.4]
    seen = find_board(render(camera, board, T), board)
    at = board_corners(board) + T[:3, 3]
    true = 2200.0 * at[:, :2] / at[:, 2:] + camera["centre_px"]
    assert np.sqrt(np.mean(np.sum((seen.uv - true) ** 2, axis=1))) < 0.1


def test_the_page_of_a_calibration_shows_the_worst_pictures(folder: Path, tmp_path: Path) -> None:
    cell, poses, table = (str(folder / name) for name in ("cell.yaml", "poses.csv", "found.csv"))
    assert main(["detect", str(folder / "shots"), "--cell", cell, "--joints", poses, "-o", table]) == 0
    given = ["calibrate", cell, poses, "--corners", table, "--effects", "joint_compliance@joint2", "--page-language"]
    assert main([*given, "de", "-o", str(tmp_path / "out")]) == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Bilder, das schlechteste zuerst" in page
    assert 'id="figure-residual-wrist"' in page
    assert page.count("data:image/jpeg;base64,") == 6
    assert page.count('<figure class="picture" data-row="0:') == 6  # a click chooses the row everywhere
    # Without the pictures the page has their corners all the same.
    for picture in (folder / "shots").iterdir():
        picture.rename(picture.with_suffix(".moved"))
    try:
        assert main([*given, "en", "-o", str(tmp_path / "out")]) == 0
    finally:
        for picture in (folder / "shots").iterdir():
            picture.rename(picture.with_suffix(".png"))
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Pictures, worst first" in page
    assert "data:image/jpeg" not in page


def test_the_demonstration_finds_the_camera_in_its_own_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(demo_camera, "ROWS", 16)
    monkeypatch.setattr(demo_camera, "TEST_ROWS", 4)
    assert main(["demo", "--camera", "-o", str(tmp_path / "demo")]) == 0
    assert "This is a simulation" in capsys.readouterr().out
    result = json.loads((tmp_path / "demo" / "result.json").read_text())
    assert result["test"]["kinds"]["corner"]["after"]["rms"] < 0.2
    assert "Simulated data." in (tmp_path / "demo" / "report.html").read_text()
    assert (tmp_path / "demo" / "camera.calib").is_file()
    # A second one replaces it; another folder is left alone.
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("")
    assert main(["demo", "--camera", "-o", str(tmp_path / "other")]) == 2
