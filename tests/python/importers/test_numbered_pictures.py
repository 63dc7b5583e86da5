# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Folders of RoboDK's and Zivid's hand-eye samples, laid out as theirs, through to a camera and its lens."""

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.cli import main
from fastcal.importers.numbered_pictures import read_numbered_pictures
from fastcal.importers.picture_set import PictureSet
from fastcal.io.robot_file import load_robot
from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners

FloatArray = NDArray[np.float64]

SIZE = (640, 480)
K = np.array([[700.0, 0.0, 330.0], [0.0, 702.0, 236.0], [0.0, 0.0, 1.0]])
BENT = np.array([-0.3, 0.1, 0.001, -0.0005, 0.0])
X = pose({"xyz_mm": [40.0, -50.0, 80.0], "rpy_deg": [5.0, -4.0, 30.0]})
Y = pose({"xyz_mm": [600.0, 50.0, 10.0], "rpy_deg": [3.0, -2.0, 20.0]})
COUNT = 14


def flange_poses(seed: int) -> list[FloatArray]:
    random = np.random.default_rng(seed)
    out = []
    for _ in range(COUNT):
        at = [*random.uniform(-60, 60, 2), random.uniform(350, 550)]
        view = pose({"xyz_mm": at, "rpy_deg": (random.uniform(-35, 35, 3) * [1, 1, 4]).tolist()})
        out.append(Y @ np.linalg.inv(X @ view))
    return out


def picture(file: Path) -> None:
    cv2.imwrite(str(file), np.full(SIZE[::-1], 128, dtype=np.uint8))


def robodk(folder: Path, poses: list[FloatArray], *, joints: int = 6) -> None:
    """N.png and N.json, of R = Rx Ry Rz."""
    for k, T in enumerate(poses):
        R = T[:3, :3]
        angles = [np.arctan2(-R[1, 2], R[2, 2]), np.arcsin(R[0, 2]), np.arctan2(-R[0, 1], R[0, 0])]
        content = {"joints": [float(10 * k + i) for i in range(joints)]}
        content["pose_flange"] = [*(1e3 * T[:3, 3]).tolist(), *map(float, angles)]
        (folder / f"{k}.json").write_text(json.dumps(content, indent=2))
        picture(folder / f"{k}.png")


def zivid_samples(folder: Path, poses: list[FloatArray]) -> None:
    """ImgNN.png and posNN.yaml, as OpenCV writes PoseState."""
    for k, T in enumerate(poses, start=1):
        there = T.copy()
        there[:3, 3] *= 1e3
        storage = cv2.FileStorage(str(folder / f"pos{k:02d}.yaml"), cv2.FILE_STORAGE_WRITE)
        storage.write("PoseState", there)
        storage.release()
        picture(folder / f"img{k:02d}.png")


def zivid_library(folder: Path, poses: list[FloatArray]) -> None:
    """ImgN.png and posN.yaml, as Zivid's Matrix4x4 is saved."""
    for k, T in enumerate(poses):
        there = T.copy()
        there[:3, 3] *= 1e3
        rows = ",\n".join(f"    [ {', '.join(f'{v:.7g}' for v in row)} ]" for row in there)
        (folder / f"pos{k}.yaml").write_text(f"__version__: 1\nFloatMatrix:\n  Data: [\n{rows}]\n")
        picture(folder / f"img{k}.png")


def read(folder: Path) -> PictureSet:
    found = read_numbered_pictures([folder])
    assert found is not None
    return found


@pytest.mark.parametrize("write", [robodk, zivid_samples, zivid_library], ids=lambda f: f.__name__)
def test_from_the_folder_to_the_camera_and_its_lens(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], write: Callable[[Path, list[FloatArray]], None]
) -> None:
    folder, table, cell = tmp_path / "set", tmp_path / "poses.csv", tmp_path / "poses_cell.yaml"
    folder.mkdir()
    poses = flange_poses(7)
    write(folder, poses)
    assert main(["import", str(folder), "-o", str(table)]) == 0
    said = capsys.readouterr().out
    assert "next: fastcal detect" in said
    assert "write yours into the cell" in said
    np.testing.assert_allclose(read(folder).flange, poses, atol=1e-5)
    random, lines = np.random.default_rng(1), ["row,camera,board,corner,u_px,v_px"]
    corners = board_corners(load_robot(cell).description.boards["board"])
    for k, T in enumerate(poses):
        S = np.linalg.inv(T @ X) @ Y
        uv = cv2.projectPoints(corners, cv2.Rodrigues(S[:3, :3])[0], S[:3, 3], K, BENT)[0].reshape(-1, 2)
        uv += 0.05 * random.standard_normal(uv.shape)
        lines += [f"{k},camera,board,{i},{u:.6f},{v:.6f}" for i, (u, v) in enumerate(uv)]
    (tmp_path / "corners.csv").write_text("\n".join(lines) + "\n")
    words = [str(cell), str(table), "--corners", str(tmp_path / "corners.csv"), "-o", str(tmp_path / "out")]
    assert main(["calibrate", *words, "--hand-eye", str(tmp_path / "camera.calib")]) == 0
    assert "the lens that the boards in its pictures show" in capsys.readouterr().err
    camera = load_robot(tmp_path / "out/model.yaml").description.cameras["camera"]
    np.testing.assert_allclose(pose(camera), X, atol=1e-3)
    np.testing.assert_allclose(camera["focal_px"], [700, 702], rtol=3e-3)
    np.testing.assert_allclose(camera["distortion"][:2], BENT[:2], atol=0.05)
    assert "calibration_type: eye_in_hand" in (tmp_path / "camera.calib").read_text()


def test_robodks_angles_are_those_of_its_library(tmp_path: Path) -> None:
    # robodk.robomath.TxyzRxyz_2_Pose([100, -200, 300, 0.3, -0.4, 0.5]) of robodk 6.0.2, from PyPI.
    T = [
        [0.8083070667743452, -0.4415801631371558, -0.3894183423086505, 0.1],
        [0.3570196416986299, 0.8935594087270837, -0.2721921352954314, -0.2],
        [0.4681630712092062, 0.08098482943778706, 0.879923176281257, 0.3],
        [0.0, 0.0, 0.0, 1.0],
    ]
    content = {"joints": [1, 2, 3, 4, 5, 6], "pose_flange": [100, -200, 300, 0.3, -0.4, 0.5]}
    (tmp_path / "4.json").write_text(json.dumps(content))
    picture(tmp_path / "4.png")
    np.testing.assert_allclose(read(tmp_path).flange[0], T, atol=1e-12)


def test_robodks_joints_are_taken_with_the_arm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, table = tmp_path / "set", tmp_path / "poses.csv"
    folder.mkdir()
    robodk(folder, flange_poses(3))
    assert main(["import", str(folder), "--robot", "ur5e", "-o", str(table)]) == 0
    assert table.read_text().splitlines()[2].startswith("10.0,11.0,12.0,13.0,14.0,15.0,")
    assert load_robot(tmp_path / "poses_cell.yaml").joint_count == 6
    robodk(folder, flange_poses(3), joints=7)
    capsys.readouterr()
    assert main(["import", str(folder), "--robot", "ur5e", "-o", str(table)]) == 2
    assert "holds 7 joints, and" in capsys.readouterr().err


def test_what_is_missing_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    zivid_samples(tmp_path, flange_poses(3))
    words = ["import", str(tmp_path), "-o", str(tmp_path / "poses.csv")]
    (tmp_path / "img03.png").rename(tmp_path / "img03.zdf")
    assert main(words) == 2
    assert "save its 2D image beside it as img03.png" in capsys.readouterr().err
    (tmp_path / "img03.zdf").unlink()
    assert main(words) == 2
    assert "there is no picture 3 beside this pose" in capsys.readouterr().err
    picture(tmp_path / "img03.png")
    for file in tmp_path.glob("pos*.yaml"):
        T = np.eye(4)
        T[:3, 3] = [0.5, 0.1, 0.4]
        rows = ", ".join(str(row) for row in T.tolist())
        file.write_text(f"__version__: 1\nFloatMatrix:\n  Data: [{rows}]\n")
    assert main(words) == 2
    assert "are its poses in m?" in capsys.readouterr().err
    (tmp_path / "pos02.yaml").write_text("PoseStates: 3\n")
    assert main(words) == 2
    assert "holds no matrix of 4 x 4" in capsys.readouterr().err
