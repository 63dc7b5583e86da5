# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Signs and zeros of an arm of four joints whose motors count from anywhere, from a dozen pictures, to files."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fastcal import _core
from fastcal.calibration.moving_rig import frames_of
from fastcal.cells import joint_zeros as zeros_of
from fastcal.cells.joint_zeros import joint_zeros
from fastcal.cells.touch_zeros import touches_of
from fastcal.cli.app import main
from fastcal.errors import InvalidInput, Undetermined
from fastcal.importers.corners import load_seen
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import board_corners
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

JOINTS = {  # origin xyz, rpy; limits
    "pan": ("0.02 -0.023 0.095", "3.14159265 0 1.57079633", 1.9),
    "lift": ("-0.03 -0.018 -0.054", "-1.57079633 -1.57079633 0", 1.7),
    "elbow": ("-0.113 -0.028 0", "0 0 1.57079633", 1.7),
    "roll": ("0 -0.12 0.018", "1.57079633 0 3.14159265", 2.8),
}
SIGN, ZERO = np.array([1.0, -1.0, 1.0, -1.0]), np.radians([30.0, -100.0, 65.0, 0.0])
COUNT, NOISE_PX = 12, 0.2


def urdf() -> str:
    out, parent = ['<robot name="four"><link name="base"/>'], "base"
    for name, (xyz, rpy, limit) in JOINTS.items():
        out.append(
            f'<link name="{name}_link"/><joint name="{name}" type="revolute"><origin xyz="{xyz}" rpy="{rpy}"/>'
            f'<parent link="{parent}"/><child link="{name}_link"/><axis xyz="0 0 1"/>'
            f'<limit lower="-{limit}" upper="{limit}" effort="9" velocity="9"/></joint>'
        )
        parent = f"{name}_link"
    return "".join([*out, "</robot>"])


def placed(turn: list[float], at: list[float]) -> FloatArray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = _core.exp_so3(np.array(turn)), at
    return T


def written(folder: Path, *, noise_deg: float = 0.1) -> FloatArray:
    """Cell, poses as the motors count, and corners; the chain's joint positions."""
    lens = {"size_px": [640, 480], "focal_px": [600, 600], "centre_px": [320, 240]}
    board = {"on": "world", "kind": "checkerboard", "columns": 8, "rows": 6, "square_mm": 20}
    cell: dict[str, object] = {"arms": {"arm": {"robot": "four.urdf"}}}
    cell |= {"cameras": {"wrist": {"on": "arm", **lens}}, "boards": {"b": board}}
    (folder / "four.urdf").write_text(urdf())
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell))
    arm = load_robot(folder / "cell.yaml")
    random = np.random.default_rng(4)
    middle = np.array([0.0, 0.2, -0.3, 0.1])
    X = placed([0.3, -0.2, 0.5], [0.02, 0.03, -0.03])
    Y = frames_of(arm, middle[np.newaxis], "arm")[0] @ X @ placed([0.2, -0.1, 0.3], [-0.07, -0.05, 0.3])
    points, q, lines = board_corners(arm.description.boards["b"]), [], ["row,camera,board,corner,u_px,v_px"]
    while len(q) < COUNT:
        tried = middle + random.uniform(-1, 1, 4) * [0.6, 0.5, 0.5, 1.2]
        T = np.linalg.inv(frames_of(arm, tried[np.newaxis], "arm")[0] @ X) @ Y
        p = points @ T[:3, :3].T + T[:3, 3]
        uv = 600 * p[:, :2] / p[:, 2:] + [320, 240] + NOISE_PX * random.standard_normal((len(p), 2))
        if (p[:, 2] > 0.1).all() and (uv > 5).all() and (uv < [635, 475]).all():
            lines += [f"{len(q)},wrist,b,{k},{u:.4f},{v:.4f}" for k, (u, v) in enumerate(uv)]
            q.append(tried)
    true = np.array(q)
    counts = SIGN * (true + np.radians(noise_deg) * random.standard_normal(true.shape) - ZERO)
    rows = [",".join(f"{angle:.6f}" for angle in row) for row in np.degrees(counts)]
    (folder / "poses.csv").write_text("\n".join(["j1_deg,j2_deg,j3_deg,j4_deg", *rows]) + "\n")
    (folder / "corners.csv").write_text("\n".join(lines) + "\n")
    return true


def found_in(folder: Path) -> tuple[Robot, dict[str, object]]:
    return load_robot(folder / "z" / "robot.yaml"), json.loads((folder / "z" / "zeros.json").read_text())


def test_signs_and_zeros_from_a_dozen_pictures_to_all_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fastcal.cells.joint_zeros.STARTS", 6)  # of two zeros
    true = written(tmp_path)
    ticks = {"id": 1, "drive_mode": 0, "homing_offset": -14, "range_min": 47, "range_max": 4047}
    (tmp_path / "old.json").write_text(json.dumps(dict.fromkeys((*JOINTS, "gripper"), ticks)))
    words = [str(tmp_path / "poses.csv"), "--corners", str(tmp_path / "corners.csv")]
    more = ["--lerobot", str(tmp_path / "old.json"), "-o", str(tmp_path / "z")]
    assert main(["zeros", str(tmp_path / "cell.yaml"), *words, *more]) == 0
    said = capsys.readouterr()
    model, content = found_in(tmp_path)
    joints = content["joints"]
    assert isinstance(joints, list)
    assert [joint["sign"] for joint in joints] == SIGN.tolist()
    for k in (1, 2):
        off = joints[k]["zero_deg"] - np.degrees(ZERO[k])
        assert abs(off) < max(4 * joints[k]["std_deg"], 0.05)
        assert joints[k]["std_deg"] < 1.0
    assert [joints[k]["std_deg"] for k in (0, 3)] == [None, None]
    assert "lift: sign -1, zero -" in said.out
    assert "pan: sign +1, zero not shown" in said.out
    assert "lift counts the other way round" in said.err
    # The same file of poses is read rightly beside the new robot file, but for what no picture shows.
    counts = load_seen([tmp_path / "poses.csv"], model, tmp_path / "corners.csv").q
    assert np.degrees(np.abs(counts[:, 1:3] - true[:, 1:3])).max() < 1.5
    assert main(["calibrate", str(tmp_path / "z" / "robot.yaml"), *words, "-o", str(tmp_path / "out")]) in (0, 3)
    # The URDF counts as the motors do: it is the arm that the robot file is.
    J = np.radians(np.random.default_rng(1).uniform(-40, 40, (5, 4)))
    other = load_robot(tmp_path / "z" / "counted.urdf")
    chain = model.pendant.chain(J)
    np.testing.assert_allclose(frames_of(other, J, "arm"), frames_of(model, chain, "arm"), atol=1e-9)
    low, high = other.limits.T
    assert (low < high).all()
    # LeRobot's degrees of the same ticks are the chain's, but for the sign.
    new = json.loads((tmp_path / "z" / "lerobot.json").read_text())
    assert new["gripper"] == ticks
    for k, name in ((1, "lift"), (2, "elbow")):
        assert 47 <= new[name]["range_min"] < new[name]["range_max"] <= 4047
        middle = (new[name]["range_min"] + new[name]["range_max"]) / 2
        ticks_of = 2047 + np.degrees(J[:, k]) * 4095 / 360
        degrees = (ticks_of - middle) * 360 / 4095
        np.testing.assert_allclose(SIGN[k] * degrees, np.degrees(chain[:, k]), atol=0.1)


def counted(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """A list that each search is put on, with whether it was by the turns alone."""
    out, search = list[bool](), zeros_of._searched

    def counting(misfits: zeros_of._Misfit, starts: FloatArray) -> tuple[float, FloatArray]:
        out.append(misfits.turns_alone)
        return search(misfits, starts)

    monkeypatch.setattr(zeros_of, "_searched", counting)
    return out


def test_slopes_are_those_of_the_misfits(tmp_path: Path) -> None:
    written(tmp_path)
    touched(tmp_path, 21)
    arm = load_robot(tmp_path / "cell.yaml")
    pictures = zeros_of._views(arm, load_seen([tmp_path / "poses.csv"], arm, tmp_path / "corners.csv"))
    touches = touches_of(load_seen([tmp_path / "touches.csv"], arm, None), 2)
    for views in (pictures, [touches]):
        misfits, z = zeros_of._Misfit(arm, views, SIGN, np.array([1, 2])), np.array([-1.5, 1.0])
        for k, slope in enumerate(misfits.slopes(z).T):
            step = 1e-5 * np.eye(2)[k]
            np.testing.assert_allclose(slope, (misfits(z + step) - misfits(z - step)).ravel() / 2e-5, atol=1e-5)


def test_pictures_of_other_rows_fit_no_signs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fastcal.cells.joint_zeros.STARTS", 2)
    written(tmp_path)
    arm = load_robot(tmp_path / "cell.yaml")
    data = load_seen([tmp_path / "poses.csv"], arm, tmp_path / "corners.csv")
    wrong = data.select(np.arange(COUNT))
    wrong.q[:] = np.random.default_rng(0).uniform(-1, 1, wrong.q.shape)
    searches = counted(monkeypatch)
    with pytest.raises(Undetermined, match=r"no signs and zeros of the joints fit the pictures: .* mm or more"):
        joint_zeros(arm, wrong)
    assert searches == [True] * 2**4  # by the turns, which rule out all signs: with the places nothing fits better


def test_too_few_pictures_are_refused(tmp_path: Path) -> None:
    written(tmp_path)
    arm = load_robot(tmp_path / "cell.yaml")
    data = load_seen([tmp_path / "poses.csv"], arm, tmp_path / "corners.csv").select(np.arange(5))
    with pytest.raises(InvalidInput, match="6 or more pictures"):
        joint_zeros(arm, data)


TIP = np.array([0.012, -0.02, 0.07])


def touched(folder: Path, seed: int, *, noise_deg: float = 0.05, count: int = 12) -> FloatArray:
    """The URDF and touches as the motors count; the chain's joint positions."""
    (folder / "four.urdf").write_text(urdf())
    arm, random = load_robot(folder / "four.urdf"), np.random.default_rng(seed)

    def tip(x: FloatArray) -> FloatArray:
        F = frames_of(arm, x[np.newaxis], "arm")[0]
        return np.asarray(F[:3, :3] @ TIP + F[:3, 3])

    q, rows = [], ["j1_deg,j2_deg,j3_deg,j4_deg,socket"]
    points = [tip(np.array(x)) for x in ([0.0, 0.2, -0.3, 0.1], [0.4, 0.5, -0.1, 0.6], [-0.5, -0.1, 0.2, -0.8])]
    while len(q) < count:
        point = points[len(q) % 3]
        found = least_squares(lambda x, at=point: tip(x) - at, random.uniform(-1, 1, 4) * [1.0, 1.0, 1.0, 2.5])
        if found.cost < 1e-12 and (np.abs(found.x) < [1.9, 1.7, 1.7, 2.8]).all():
            q.append(found.x)
            counts = SIGN * (found.x + np.radians(noise_deg) * random.standard_normal(4) - ZERO)
            rows.append(",".join(f"{angle:.6f}" for angle in np.degrees(counts)) + f",{'abc'[(len(q) - 1) % 3]}")
    (folder / "touches.csv").write_text("\n".join(rows) + "\n")
    return np.array(q)


@pytest.mark.parametrize("seed", [21, 22])
def test_signs_and_zeros_from_a_dozen_touches(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    monkeypatch.setattr("fastcal.cells.joint_zeros.STARTS", 6)
    touched(tmp_path, seed)
    words = ["zeros", str(tmp_path / "four.urdf"), str(tmp_path / "touches.csv"), "-o", str(tmp_path / "z")]
    assert main(words) == 0
    said = capsys.readouterr()
    _, content = found_in(tmp_path)
    joints = content["joints"]
    assert isinstance(joints, list)
    # An arm in a plane and its mirror image touch alike, pan and roll turned round: one is chosen, the other told.
    assert [joint["sign"] for joint in joints][1:3] == SIGN[1:3].tolist()
    others = content["others"]
    assert isinstance(others, list)
    assert SIGN.tolist() in [[joint["sign"] for joint in joints], *(other["sign"] for other in others)]
    for k in (1, 2):
        off = joints[k]["zero_deg"] - np.degrees(ZERO[k])
        assert abs(off) < max(4 * joints[k]["std_deg"], 0.05)
        assert joints[k]["std_deg"] < 1.0
    assert "zero not shown by touches: it moves with the base or the tip" in said.out
    assert "touches are left" in said.out


def test_touches_of_other_points_or_too_few_show_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fastcal.cells.joint_zeros.STARTS", 2)
    touched(tmp_path, 23, count=24)
    arm = load_robot(tmp_path / "four.urdf")
    data = load_seen([tmp_path / "touches.csv"], arm, None)
    wrong = data.select(np.arange(len(data)))
    wrong.q[:] = np.random.default_rng(0).uniform(-2, 2, wrong.q.shape)
    searches = counted(monkeypatch)
    with pytest.raises(Undetermined, match="no signs and zeros of the joints fit the touches"):
        joint_zeros(arm, wrong)
    assert searches == [False] * (2 * 2**4)  # each start once
    with pytest.raises(InvalidInput, match="expected a dozen, of two points or more"):
        joint_zeros(arm, data.select(np.arange(7)))
    (tmp_path / "bare.csv").write_text("j1_deg,j2_deg,j3_deg,j4_deg,x_mm,y_mm,z_mm\n1,2,3,4,5,6,7\n2,3,4,5,6,7,8\n")
    assert main(["zeros", str(tmp_path / "four.urdf"), str(tmp_path / "bare.csv"), "-o", str(tmp_path / "z")]) == 2
    assert "touches of points (column socket)" in capsys.readouterr().err


def test_a_joint_that_slides_has_no_zero_in_degrees() -> None:
    """The search goes round a turn: of a SCARA's quill it gave 0.00 deg, known to 0 deg, and fifty others alike."""
    joint = {"theta_deg": 0, "d_mm": 100, "a_mm": 200, "alpha_deg": 0}
    joints = [{"type": "revolute", **joint}] * 3
    joints.insert(2, {"type": "prismatic", "min_mm": 0, "max_mm": 200, **joint})
    scara = Robot({"name": "scara", "kinematics": "dh", "joints": joints})
    data = Dataset.from_arrays(np.zeros((12, 4)), observed_labels={"socket": ["a"] * 12}, robot=scara)
    with pytest.raises(InvalidInput, match=r"scara: signs and zeros .* these slide: joint ?3$"):
        joint_zeros(scara, data)
