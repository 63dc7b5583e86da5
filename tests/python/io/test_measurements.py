# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measurement files: every quantity comes out in SI, from every format, and what is unknown is kept and told."""

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet
import pytest
from scipy.spatial.transform import Rotation

from fastcal.errors import ParseError
from fastcal.io.measurements import load_measurements
from fastcal.io.robot_file import load_robot

ARM = SimpleNamespace(
    joint_types=["revolute", "prismatic"],
    limits=np.array([[-math.pi, math.pi], [0.0, 1.0]]),
    mimics=(),
    passive=(),
    follow=lambda q: q,
    reach=1.5,
    joint_count=2,
)
SIX = SimpleNamespace(
    joint_types=["revolute"] * 6,
    limits=np.tile([-2 * math.pi, 2 * math.pi], (6, 1)),
    mimics=(),
    passive=(),
    follow=lambda q: q,
    reach=1.3,
    joint_count=6,
)


@pytest.fixture
def file(tmp_path: Path) -> Callable[..., Path]:
    def write(*lines: str) -> Path:
        path = tmp_path / "data.csv"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write


def test_every_quantity_in_si(file: Callable[..., Path]) -> None:
    data = load_measurements(
        file(
            "q1_deg,q2_mm,q1_read_mrad,q2_read_m,x_mm,y_um,z_in,qw,qx,qy,qz,distance_m,anchor,sigma_um,sigma_rot_deg,"
            "payload_g,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,current1_a,current2_a,temperature_c,time_s,station,mount,"
            "approach1,approach2",
            "90,250,1570,0.2501,1,2,3,1,0,0,0,2.5,wall,20,0.5,1500,1,2,3,4,5,6,7,8,20.5,9,B,m1,1,-1",
            "-180,0,,,,5,,,,,,,,30,,,1,2,3,4,5,6,7,8,-1,10,A,m1,+1,",
        ),
        ARM,
    )
    np.testing.assert_array_equal(data.q, [[math.pi / 2, 0.25], [-math.pi, 0.0]])
    np.testing.assert_array_equal(data.q_read, [[1.57, 0.2501], [np.nan] * 2])
    np.testing.assert_array_equal(data.position, [[0.001, 2e-6, 0.0762], [np.nan, 5e-6, np.nan]])
    np.testing.assert_array_equal(data.rotation, [[1, 0, 0, 0], [np.nan] * 4])
    np.testing.assert_array_equal(data.distance, [2.5, np.nan])
    assert (data.anchor.tolist(), data.anchor_names) == ([0, -1], ("wall",))
    np.testing.assert_array_equal(data.sigma_position, [[2e-5] * 3, [3e-5] * 3])
    np.testing.assert_array_equal(data.sigma_rotation, [math.pi / 360, np.nan])
    np.testing.assert_array_equal(data.payload, [1.5, 0.0])
    np.testing.assert_array_equal(data.wrench, [[1, 2, 3, 4, 5, 6]] * 2)
    np.testing.assert_array_equal(data.current, [[7, 8]] * 2)
    np.testing.assert_allclose(data.temperature, [293.65, 272.15], rtol=1e-15)
    np.testing.assert_array_equal(data.time, [9, 10])
    assert (data.station.tolist(), data.station_names) == ([0, 1], ("B", "A"))
    assert (data.mount.tolist(), data.mount_names) == ([0, 0], ("m1",))
    np.testing.assert_array_equal(data.approach, [[1, -1], [1, 0]])
    assert data.notes == ("payload is empty in 1 rows and taken as 0 there",)
    assert data.source.endswith("data.csv")


def test_names_are_read_in_any_case(file: Callable[..., Path]) -> None:
    data = load_measurements(file("Q1_DEG,q2_M,X_mm,Y_MM,z_Mm", "90,0.5,1,2,3"), ARM)
    np.testing.assert_array_equal(data.q, [[math.pi / 2, 0.5]])
    np.testing.assert_array_equal(data.position, [[0.001, 0.002, 0.003]])


def test_roll_pitch_yaw_are_about_fixed_axes(file: Callable[..., Path]) -> None:
    angles = np.random.default_rng(0).uniform(-180, 180, (200, 3))
    lines = [f"0,0,{rx!r},{ry!r},{rz!r}" for rx, ry, rz in angles.tolist()]
    data = load_measurements(file("q1_deg,q2_mm,rx_deg,ry_deg,rz_deg", *lines, "0,0,,,"), ARM)
    expected = Rotation.from_euler("xyz", angles, degrees=True)  # lower case: fixed axes, R = Rz Ry Rx
    got = Rotation.from_quat(data.rotation[:-1], scalar_first=True)
    assert (got.inv() * expected).magnitude().max() < 1e-14
    assert np.isnan(data.rotation[-1]).all()


def test_one_sigma_a_coordinate(file: Callable[..., Path]) -> None:
    lines = ("q1_deg,q2_mm,x_mm,y_mm,z_mm,sigma_x_mm,sigma_y_um,sigma_z_mm", "0,0,1,2,3,0.01,20,0.03", "0,0,1,,3,1,,3")
    data = load_measurements(file(*lines), ARM)
    np.testing.assert_allclose(data.sigma_position, [[1e-5, 2e-5, 3e-5], [1e-3, np.nan, 3e-3]], rtol=1e-15)


def test_unknown_columns_are_kept_and_reported(file: Callable[..., Path]) -> None:
    header = "q1_deg,q2_mm,x_mm,y_mm,z_mm,order,x_nominal_mm,operator,when,,station_id"
    data = load_measurements(file(header, "0,0,1,2,3,5,1.5,Jo,2026-01-02,7,s1", "0,0,1,2,4,,2.5,12,,8,s2"), ARM)
    assert list(data.extra) == ["order", "x_nominal_mm", "unnamed10"]
    np.testing.assert_array_equal(data.extra["order"], [5.0, np.nan])
    np.testing.assert_array_equal(data.extra["x_nominal_mm"], [1.5, 2.5])
    assert data.extra_labels == {"operator": ["Jo", "12"], "when": ["2026-01-02", ""], "station_id": ["s1", "s2"]}
    names = ("x_nominal_mm", "operator", "when", "unnamed10", "station_id")
    assert data.notes == tuple(f"column '{name}' is not known and is kept as it is" for name in names)


def test_a_comment_with_points_does_not_disturb_decimal_commas(file: Callable[..., Path]) -> None:
    data = load_measurements(file("when;q1_deg;q2_mm;x_mm;y_mm;z_mm", "2.1.2026;1,5;0;1,5;2;3"), ARM)
    assert data.position[0].tolist() == [0.0015, 0.002, 0.003]
    assert data.extra_labels["when"] == ["2.1.2026"]


def test_lengths_without_anchors_belong_to_one_and_that_is_reported(file: Callable[..., Path]) -> None:
    data = load_measurements(file("q1_deg,q2_mm,distance_mm", "0,0,1000", "1,0,900"), ARM)
    assert data.anchor.tolist() == [0, 0]
    assert data.notes == ("there is no column 'anchor': all lengths are taken to one and the same",)


def test_joints_slightly_outside_their_limits_are_reported(file: Callable[..., Path]) -> None:
    data = load_measurements(file("q1_deg,q2_mm,x_mm,y_mm,z_mm", "-190,-2,1,2,3", "-200,5,1,2,3"), ARM)
    assert data.notes == (
        "joint 1 is outside its limits in 2 rows, by 20 deg at most",
        "joint 2 is outside its limits in 1 row, by 2 mm at most",
    )


def test_to_predict_only_joints_and_conditions_are_needed(file: Callable[..., Path]) -> None:
    path = file("q1_deg,q2_mm,temperature_c", "0,0,20")
    data = load_measurements(path, ARM, require_measured=False)
    assert data.position is None
    assert data.temperature.tolist() == [293.15]
    with pytest.raises(ParseError, match=r"holds nothing measured; expected numbers in x_mm y_mm z_mm"):
        load_measurements(path, ARM)
    with pytest.raises(ParseError, match=r"holds nothing measured"):
        load_measurements(file("q1_deg,q2_mm,x_mm,y_mm,z_mm", "0,0,,,"), ARM)


def test_formats_give_the_same_bits(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    names = ["q1_deg", "q2_mm", "x_mm", "y_mm", "z_mm", "station", "order"]
    # Six decimals: Excel keeps 15 digits.
    rows = [
        [*rng.uniform(0, 99, 5).round(6).tolist(), int(label), row] for row, label in enumerate(rng.integers(1, 4, 40))
    ]
    rows[3][2] = None
    comma = [["" if cell is None else str(cell).replace(".", ",") for cell in row] for row in rows]
    (tmp_path / "b.csv").write_text("\n".join(map(";".join, [names, *comma])), encoding="utf-8-sig")
    (tmp_path / "a.csv").write_text((tmp_path / "b.csv").read_text().replace(",", ".").replace(";", ","))
    columns = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    pyarrow.parquet.write_table(pa.table(columns), tmp_path / "c.parquet")
    book = openpyxl.Workbook()
    for row in [names, *rows]:
        book.active.append(row)
    book.save(tmp_path / "d.xlsx")
    first, *others = [load_measurements(tmp_path / name, ARM) for name in ("a.csv", "b.csv", "c.parquet", "d.xlsx")]
    assert np.isnan(first.position[3, 0])
    for other in others:
        np.testing.assert_array_equal(other.q, first.q)
        np.testing.assert_array_equal(other.position, first.position)
        np.testing.assert_array_equal(other.station, first.station)
        np.testing.assert_array_equal(other.extra["order"], first.extra["order"])
        assert (other.station_names, other.notes) == (first.station_names, first.notes)


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("ur5_tracker/measurements.csv", 700),
        ("ur5_tracker/test_random.csv", 20),
        ("ur10_tmac/campaign_b.csv", 1495),
        ("ur10_tmac/campaign_c.csv", 2773),
        ("hidden_effects/20_two/measurements.csv", None),
    ],
)
def test_real_files_are_read(shared_data: Path, name: str, rows: int | None) -> None:
    path = shared_data / name
    arm = SIX if not name.startswith("hidden") else SimpleNamespace(**{**vars(SIX), "reach": 3.5})
    data = load_measurements(path, arm)
    header, *lines = path.read_text().splitlines()
    assert len(data) == (rows or len(lines))
    last = dict(zip(header.split(","), map(float, lines[-1].split(",")), strict=True))
    np.testing.assert_array_equal(data.position[-1], [last[f"{axis}_mm"] / 1000 for axis in "xyz"])
    np.testing.assert_allclose(data.q[-1], np.radians([last[f"q{joint}_deg"] for joint in range(1, 7)]), rtol=1e-15)


def test_nothing_is_noted_of_own_columns_and_of_rounding(tmp_path: Path) -> None:
    """A pose of `fastcal design` on its limit, in its file's own columns, is as it should be."""
    robot = load_robot("ur5")
    path = tmp_path / "poses.csv"
    path.write_text("order,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n1,360.00000000000006,0,0,0,0,-360.001\n")
    data = load_measurements(path, robot, require_measured=False)
    assert data.notes == ("joint 6 is outside its limits in 1 row, by 0.001 deg at most",)
    assert list(data.extra) == ["order"]


def test_exact_copies_of_rows_are_reported(file: Callable[..., Path]) -> None:
    """Neither a pose that is visited again nor one that is not measured is a copy."""
    head = "q1_deg,q2_mm,x_mm,y_mm,z_mm,time_s"
    once = ["10,500,800.12,0.3,1.5,0", "10,500,800.13,0.3,1.5,1", "20,500,700,0.3,1.5,2", "20,500,,,,3", "20,500,,,,4"]
    assert load_measurements(file(head, *once), ARM).notes == ()
    (note,) = load_measurements(file(head, *once, "10,500,800.12,0.3,1.5,5"), ARM).notes
    assert note.startswith("1 row is an exact copy of another; a copy counts as a measurement of its own")
    (note,) = load_measurements(file(head, *once, *once), ARM).notes
    assert note.startswith("3 rows are exact copies of others")
