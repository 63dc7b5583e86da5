# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compensate` on tables: the columns promised, a status and a sentence for whatever cannot be reached."""

import csv
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal as library
from fastcal.compensation import path_accuracy
from fastcal.measurements.rotations import quaternions

SAID = ["q1_deg", "q2_deg", "q3_deg", "q4_deg", "q5_deg", "q6_deg", "residual_mm", "residual_deg", "sigma_mm", "status"]


def read(path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def write_targets(path, T, **columns) -> None:
    """x_mm ... qz of poses (N, 4, 4), and further columns."""
    table = dict(zip(("x_mm", "y_mm", "z_mm"), T[:, :3, 3].T * 1000, strict=True))
    table |= dict(zip(("qw", "qx", "qy", "qz"), quaternions(T[:, :3, :3]).T, strict=True))
    table |= columns
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        writer.writerows(zip(*[np.asarray(column).tolist() for column in table.values()], strict=True))


def commands(rows) -> np.ndarray:
    return np.radians([[float(row[f"q{i}_deg"]) for i in range(1, 7)] for row in rows])


@pytest.fixture
def model(demo) -> library.Robot:
    return library.load_robot(demo / "model.yaml")


def test_commanded_joints_bring_the_model_to_its_targets(demo, model, tmp_path, process) -> None:
    nominal = library.load_robot(demo / "robot.yaml")
    q = library.random_poses(nominal, 30, seed=5) * 0.8
    payload = np.linspace(0, 10, 30)
    T = model.forward(q, payload=payload)
    write_targets(tmp_path / "targets.csv", T, payload_kg=payload)
    said = process("compensate", demo / "model.yaml", "targets.csv", "-o", "commands.csv", cwd=tmp_path)
    assert said.code == 0, said.err
    assert "30 targets: 30 reached" in said.out
    rows = read(tmp_path / "commands.csv")
    assert list(rows[0]) == SAID
    np.testing.assert_allclose(model.forward(commands(rows), payload=payload), T, atol=1e-8)
    assert all(float(row["residual_mm"]) < 1e-5 and row["status"] == "reached" for row in rows)
    deviation = model.position_deviation(commands(rows), payload=payload) * 1000
    np.testing.assert_allclose(
        [float(row["sigma_mm"]) for row in rows], np.sqrt((deviation**2).mean(axis=1)), rtol=1e-9
    )


def test_a_seed_chooses_the_configuration(demo, model, tmp_path, fastcal) -> None:
    q = np.radians([[20.0, 30.0, 60.0, 10.0, 40.0, -15.0]])
    other = q + np.radians([[0, 0, 0, -180.0, 0, 180.0]])  # the wrist the other way round
    other[:, 4] *= -1
    T = np.repeat(model.forward(q), 2, axis=0)
    seeds = np.degrees(np.vstack([q, other]))
    write_targets(tmp_path / "targets.csv", T, **{f"q{i + 1}_deg": seeds[:, i] for i in range(6)})
    assert fastcal("compensate", demo / "model.yaml", tmp_path / "targets.csv", "-o", tmp_path / "out.csv").code == 0
    found = commands(read(tmp_path / "out.csv"))
    np.testing.assert_allclose(found[0], q[0], atol=1e-7)
    np.testing.assert_allclose(found[1], other[0], atol=0.05)
    np.testing.assert_allclose(model.forward(found), T, atol=1e-8)


def test_what_cannot_be_reached_gets_a_status_and_a_sentence(demo, model, tmp_path, fastcal) -> None:
    q = np.radians([20.0, 30.0, 60.0, 10.0, 40.0, -15.0])
    T = np.repeat(model.forward(q), 3, axis=0)
    base = np.asarray(model.core.base_and_tool(model.core.nominal)[0])[:3, 3]
    T[1, :3, 3] = base + 10 * (T[1, :3, 3] - base)
    write_targets(tmp_path / "targets.csv", T)
    lines = (tmp_path / "targets.csv").read_text().splitlines()
    lines[3] = "nan" + lines[3][lines[3].index(",") :]
    (tmp_path / "targets.csv").write_text("\n".join(lines) + "\n")
    said = fastcal("compensate", demo / "model.yaml", tmp_path / "targets.csv", "-o", tmp_path / "out.csv")
    assert said.code == 0
    rows = read(tmp_path / "out.csv")
    assert [row["status"] for row in rows] == ["reached", "unreachable", "bad_target"]
    assert [rows[2][name] for name in SAID[:-1]] == [""] * 9
    distance = np.linalg.norm(model.forward(commands(rows[1:2]))[0, :3, 3] - T[1, :3, 3]) * 1000
    assert float(rows[1]["residual_mm"]) == pytest.approx(distance, rel=1e-6)
    assert "row 1: the target is out of reach; the nearest pose is" in said.err
    assert "row 2: the target is not a pose" in said.err


@pytest.mark.parametrize(
    ("header", "row", "sentence"),
    [
        ("x_mm,y_mm,z_mm", "1000,0,500", "targets.csv: expected one orientation a row, either qw qx qy qz or rx_deg"),
        ("qw,qx,qy,qz", "1,0,0,0", "targets.csv: holds no target points; expected x_m, x_mm, x_um or x_in"),
        ("x,y_mm,z_mm,qw,qx,qy,qz", "1,2,3,1,0,0,0", "targets.csv: column 'x' has no unit"),
        ("x_mm,y_mm,z_mm,qw,qx,qy,qz", "1,2,red,1,0,0,0", "targets.csv:2: column 'z_mm': expected a number, got 'red'"),
        ("x_m,y_m,z_m,qw,qx,qy,qz", "1500,0,400,1,0,0,0", "targets.csv:2: column 'x_m': expected a number that fits"),
        ("x_mm,y_mm,z_mm,qw,qx,qy,qz,q1_deg", "1,2,3,1,0,0,0,9", "targets.csv: holds q1 as a seed without q2"),
    ],
)
def test_a_bad_table_is_refused_in_one_line(demo, tmp_path, fastcal, monkeypatch, header, row, sentence) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "targets.csv").write_text(f"{header}\n{row}\n")
    said = fastcal("compensate", demo / "model.yaml", "targets.csv", "-o", "out.csv")
    assert said.code == 2
    assert said.error.startswith(sentence)
    assert not (tmp_path / "out.csv").exists()


def test_a_rotation_may_come_as_angles(demo, model, tmp_path, fastcal) -> None:
    T = model.forward(np.radians([[20.0, 30.0, 60.0, 10.0, 40.0, -15.0]]))
    rpy = Rotation.from_matrix(T[0, :3, :3]).as_euler("xyz", degrees=True)
    numbers = ",".join(repr(float(v)) for v in [*(T[0, :3, 3] * 1000), *rpy])
    (tmp_path / "targets.csv").write_text(f"x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n{numbers}\n")
    assert fastcal("compensate", demo / "model.yaml", tmp_path / "targets.csv", "-o", tmp_path / "out.csv").code == 0
    np.testing.assert_allclose(model.forward(commands(read(tmp_path / "out.csv"))), T, atol=1e-8)


def test_the_one_step_way_leaves_more_and_says_how_much(demo, model, tmp_path, fastcal) -> None:
    nominal = library.load_robot(demo / "robot.yaml")
    T = model.forward(library.random_poses(nominal, 20, seed=8) * 0.7)
    write_targets(tmp_path / "targets.csv", T)
    arguments = ("compensate", demo / "model.yaml", tmp_path / "targets.csv", "--single", "-o", tmp_path / "out.csv")
    assert fastcal(*arguments, "--method", "one-step").code == 0
    rows = read(tmp_path / "out.csv")
    left = np.linalg.norm(model.forward(commands(rows))[:, :3, 3] - T[:, :3, 3], axis=1) * 1000
    np.testing.assert_allclose([float(row["residual_mm"]) for row in rows], left, atol=1e-9)
    assert 1e-4 < np.median(left) < 0.05  # some mm of error went to some um


def test_the_error_between_the_rows_is_reported_and_drawn(demo, model, tmp_path, fastcal) -> None:
    """Three rows on a line: the figures on standard output are those of the library."""
    nominal = library.load_robot(demo / "robot.yaml")
    T = np.repeat(model.forward(np.radians([[20.0, 30.0, 60.0, 10.0, 40.0, -15.0]])), 3, axis=0)
    T[:, 0, 3] += [0, 0.05, 0.1]
    write_targets(tmp_path / "targets.csv", T)
    arguments = ("compensate", demo / "model.yaml", tmp_path / "targets.csv", "-o", tmp_path / "out.csv")
    said = fastcal(*arguments, "--path", "line", "--report", tmp_path / "path.html")
    assert said.code == 0
    found = path_accuracy(model, T, nominal=nominal)
    for name, size in (("without", found.before), ("with", found.after)):
        text = (
            f"error on the path {name} compensation: mean {size.mean() * 1000:.4f} mm, largest {size.max() * 1000:.4f}"
        )
        assert text in said.out
    assert (tmp_path / "path.html").read_text().startswith("<!DOCTYPE html>")
    along = json.loads(fastcal(*arguments, "--path", "line", "--json").out)["path"]
    assert along["with_compensation"]["largest_mm"] == pytest.approx(found.after.max() * 1000)
    assert along["without_compensation"]["perpendicular_mm"] == pytest.approx(found.off_before.max() * 1000)
    assert fastcal(*arguments, "--report", tmp_path / "path.html").error.startswith("--report needs --path")
