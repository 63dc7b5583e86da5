# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`design` of a cell: postures whose pictures show the board well, and what is then known of the camera."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.moving_rig import frames_of
from fastcal.cli.app import main
from fastcal.design.pictures import PictureDesign, design_pictures
from fastcal.importers.corners import load_seen
from fastcal.io.measurements import load_measurements
from fastcal.io.robot_file import load_robot
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot

from . import camera_scene as scene

NOISE_PX = 0.1


def placed(folder: Path, **board: object) -> Robot:
    """The scene's cell with camera and board where they are."""
    scene.write(folder, 4)
    cell = scene.cell(xyz_mm=scene.WRIST[:3, 3].tolist(), rpy_deg=[-7.0, 1.0, 4.0])
    cell["boards"]["plate"] |= {"xyz_mm": scene.PLATE[:3, 3].tolist(), "rpy_deg": [178.0, -1.0, 15.0], **board}
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell))
    return load_robot(folder / "cell.yaml")


def taken(folder: Path, robot: Robot, q_deg: scene.FloatArray, seed: int = 1) -> float:
    """With 95 % probability the camera is so near [m] to where pictures of these postures put it."""
    uv = np.array([drawn(row) for row in q_deg])
    scene.write_corners(folder, uv + NOISE_PX * np.random.default_rng(seed).standard_normal(uv.shape))
    lines = [",".join(f"arm.q{k}_deg" for k in range(1, 7)), *(",".join(f"{x:.9f}" for x in row) for row in q_deg)]
    (folder / "poses.csv").write_text("\n".join(lines) + "\n")
    data = load_seen([folder / "poses.csv"], robot, folder / "corners.csv")
    return calibrate(robot, data, priors=False).cameras[0].within


def drawn(q_deg: scene.FloatArray) -> scene.FloatArray:
    """(K, 2) px, by the scene's own arm."""
    T = np.linalg.inv(scene.flange(q_deg) @ scene.WRIST) @ scene.PLATE
    return scene.drawn(scene.corners() @ T[:3, :3].T + T[:3, 3])


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Robot, PictureDesign]:
    folder = tmp_path_factory.mktemp("plan")
    robot = placed(folder)
    return folder, robot, design_pictures(robot, 16, sigma_px=NOISE_PX)


def test_the_board_is_in_the_picture_faces_the_camera_and_the_arm_stays_above(
    planned: tuple[Path, Robot, PictureDesign],
) -> None:
    _, robot, found = planned
    uv = np.array([drawn(q) for q in np.degrees(found.poses.q)])
    assert (uv > 0).all()
    assert (uv < scene.SIZE).all()
    assert np.allclose(uv, found.corners, atol=0.5)
    T = frames_of(robot, found.poses.q, "arm") @ pose(robot.description.cameras["wrist"])
    looks, board = T[:, :3, 2], pose(robot.description.boards["plate"])
    assert (looks @ board[:3, 2] > np.cos(np.radians(75))).all()  # 50 deg, and the board off the picture's middle
    assert (np.asarray(robot.core.frame_origins(found.poses.q))[:, -1, 2] > 0).all()
    assert (robot.limits[:, 0] <= found.poses.q).all()
    assert (found.poses.q <= robot.limits[:, 1]).all()
    assert found.coverage["wrist"] > 0.8


def test_what_it_expects_is_what_a_calibration_states(planned: tuple[Path, Robot, PictureDesign]) -> None:
    folder, robot, found = planned
    assert found.before == []  # nothing is known of a nominal cell
    assert taken(folder, robot, np.degrees(found.poses.q)) == pytest.approx(found.after[0].within, rel=0.35)


def test_it_is_better_than_pictures_at_random(planned: tuple[Path, Robot, PictureDesign]) -> None:
    folder, robot, found = planned
    at_random = [taken(folder, robot, scene.postures(16, seed)) for seed in (3, 4)]
    assert found.after[0].within < 0.6 * min(at_random)


def test_what_is_known_counts(planned: tuple[Path, Robot, PictureDesign], tmp_path: Path) -> None:
    robot = placed(tmp_path)
    q = scene.postures(20, 5)
    within = taken(tmp_path, robot, q)
    data = load_seen([tmp_path / "poses.csv"], robot, tmp_path / "corners.csv")
    of_pictures = design_pictures(robot, 8, measured=data, sigma_px=NOISE_PX)
    assert of_pictures.before[0].within == pytest.approx(within, rel=0.35)
    assert of_pictures.after[0].within < 0.6 * of_pictures.before[0].within
    found = calibrate(robot, data, priors=False)
    of_model = design_pictures(found.model, 8)
    assert of_model.before[0].within == pytest.approx(found.cameras[0].within, rel=0.2)
    assert of_model.after[0].within < 0.6 * of_model.before[0].within


def test_the_distance_is_that_of_the_focus(tmp_path: Path) -> None:
    robot = placed(tmp_path)
    found = design_pictures(robot, 6, focus=(0.55, 0.6))
    T = np.linalg.inv(frames_of(robot, found.poses.q, "arm") @ pose(robot.description.cameras["wrist"]))
    middle = 1e-3 * (scene.PLATE @ np.append(scene.corners().mean(axis=0), 1.0))[:3]
    distance = np.linalg.norm(np.einsum("nij,j->ni", T[:, :3, :3], middle) + T[:, :3, 3], axis=1)
    assert ((distance > 0.55) & (distance < 0.6)).all()


def test_the_same_seed_gives_the_same_postures(planned: tuple[Path, Robot, PictureDesign]) -> None:
    _, robot, found = planned
    again = design_pictures(robot, 16, sigma_px=NOISE_PX)
    assert (again.poses.q == found.poses.q).all()


def test_a_camera_in_the_room_and_one_on_a_link(tmp_path: Path) -> None:
    robot = placed(tmp_path, on="arm", xyz_mm=[0, 0, 60], rpy_deg=[180, 0, 0])
    spec = robot.spec
    spec["cameras"]["wrist"] |= {"on": "world", "xyz_mm": [900, 0, 900], "rpy_deg": [180, -30, 90]}
    to_hand = load_robot(spec)
    assert design_pictures(to_hand, 10).after[0].frame == "base_link"
    spec["cameras"]["wrist"] |= {"on": "arm.link5", "xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 0]}
    spec["boards"]["plate"] |= {"on": "world", "xyz_mm": [700, 0, 100]}
    on_link = load_robot(spec)
    assert len(design_pictures(on_link, 5)) == 5


def test_a_camera_that_only_sees_the_board_from_afar_has_pictures_too(tmp_path: Path) -> None:
    """Boards that take less than a third of the picture are planned where the arm brings them no nearer."""
    scene.write(tmp_path, 4)
    cell = scene.cell(on="world", xyz_mm=[1900.0, 0.0, 900.0], rpy_deg=[-90.0, 0.0, 90.0])
    cell["boards"]["plate"] |= {"on": "arm", "xyz_mm": [-60, -40, 60], "rpy_deg": [0, 180, 0]}
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell))
    found = design_pictures(load_robot(tmp_path / "cell.yaml"), 10)
    assert len(found) == 10
    uv = found.corners
    height = np.nanmax(uv[..., 1], axis=1) - np.nanmin(uv[..., 1], axis=1)
    width = np.nanmax(uv[..., 0], axis=1) - np.nanmin(uv[..., 0], axis=1)
    assert (np.maximum(height, width) > 0.08 * min(scene.SIZE)).all()


def test_the_command_writes_poses_that_load(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = placed(tmp_path)
    out = tmp_path / "plan.csv"
    words = ["design", str(tmp_path / "cell.yaml"), "--count", "6", "-o", str(out), "--language", "urscript"]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "after: camera wrist on flange: known to" in said
    assert "program: " in said
    assert len(load_measurements(out, robot, require_measured=False)) == 6
    assert main([*words[:-2], "--sigma-mm", "0.05", "--candidate-count", "500"]) == 0  # points, as asked
    assert "standard deviation of a coordinate" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--effects", "joint_compliance"], "pictures are planned without it"),
        (["--focus-mm", "700,300"], "the nearer one first"),
        (["--measured", "poses.csv"], "--measured and --corners go together"),
        (["--focus-mm", "3000,4000"], "no view of a board is within the arm's reach"),
    ],
)
def test_what_cannot_be_planned_is_said(
    more: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    placed(tmp_path)
    words = ["design", str(tmp_path / "cell.yaml"), "--count", "6", "-o", str(tmp_path / "plan.csv")]
    assert main([*words, *more]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "plan.csv").exists()
