# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every measurement file that cannot be meant has its own sentence, with file and line or column, and what would do."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from fastcal.errors import ParseError
from fastcal.io.measurements import load_measurements

ARM = SimpleNamespace(
    joint_types=["revolute", "prismatic"],
    limits=np.array([[-3.0, 3.0], [0.0, 1.0]]),
    mimics=(),
    beside=(),
    passive=(),
    follow=lambda q: q,
    reach=1.5,
    joint_count=2,
)
HEADER = "q1_deg,q2_mm,x_mm,y_mm,z_mm"
ROW = "10,20,30,40,50"


def columns(added: str, *cells: str) -> list[str]:
    """A good file of two rows with columns added to it."""
    return [f"{HEADER},{added}", *(f"{ROW},{row}" for row in cells)]


# The lines of a file, the line that the error names (None: the whole file) and what it says.
BAD: list[tuple[list[str], int | None, str]] = [
    # joints
    (
        ["q1_deg,x_mm,y_mm,z_mm", "1,2,3,4"],
        None,
        r"joint 2 has no column; expected q2_m, q2_mm, q2_um or q2_in, got 'q1",
    ),
    (["q2_mm,x_mm", "1,2"], None, r"joint 1 has no column; expected q1_rad, q1_mrad or q1_deg, got 'q2_mm', 'x_mm'$"),
    ([HEADER, ROW, "nan,20,30,40,50"], 3, r"column 'q1_deg': expected a finite number, got 'nan'$"),
    ([HEADER, ROW, "10,,30,40,50"], 3, r"column 'q2_mm': expected a finite number, got an empty cell$"),
    ([HEADER, ROW, "ten,20,30,40,50"], 3, r"column 'q1_deg': expected a number, got 'ten'$"),
    ([HEADER, ROW, "inf,20,30,40,50"], 3, r"column 'q1_deg': expected a number, got 'inf'$"),
    (
        [HEADER, "600,20,30,40,50"],
        2,
        r"at most 360 deg outside joint 1's limits of -171.887 to 171.887 deg \(is its unit right\?\), got '600'$",
    ),
    (
        [HEADER, "10,-1501,30,40,50"],
        2,
        r"at most 1500 mm outside joint 2's limits of 0 to 1000 mm \(is its unit right\?\), got '-1501'$",
    ),
    (columns("q3_deg", "1"), None, r"column 'q3_deg' names no joint of this robot; its joints are numbered 1 to 2$"),
    (columns("q0_deg", "1"), None, r"column 'q0_deg' names no joint"),
    (columns("approach3", "1"), None, r"column 'approach3' names no joint"),
    # units
    (["q1,q2_mm,x_mm,y_mm,z_mm", ROW], None, r"column 'q1' has no unit; expected q1_rad, q1_mrad or q1_deg$"),
    (["q1_deg,q2_mm,x,y_mm,z_mm", ROW], None, r"column 'x' has no unit; expected x_m, x_mm, x_um or x_in$"),
    (columns("payload", "1"), None, r"column 'payload' has no unit; expected payload_kg or payload_g$"),
    (
        ["q1_deg,q2_mm,x_cm,y_mm,z_mm", ROW],
        None,
        r"column 'x_cm': 'cm' is no unit of length .*; expected x_m, x_mm, x_um",
    ),
    (["q1_turns,q2_mm,x_mm,y_mm,z_mm", ROW], None, r"column 'q1_turns': 'turns' is no unit of angle"),
    (["q1_mm,q2_mm,x_mm,y_mm,z_mm", ROW], None, r"column 'q1_mm': 'mm' is no unit of angle .*; expected q1_rad"),
    (["q1_deg,q2_deg,x_mm,y_mm,z_mm", ROW], None, r"column 'q2_deg': 'deg' is no unit of length"),
    (["q1_deg,q2_mm,x_mm_s,y_mm,z_mm", ROW], None, r"column 'x_mm_s': 'mm_s' is no unit of length"),
    (columns("temperature_r", "520"), None, r"column 'temperature_r': 'r' is no unit .*; expected temperature_c, temp"),
    (columns("time_ms", "70"), None, r"column 'time_ms': 'ms' is no unit of time known here; expected time_s$"),
    (columns("q1_read", "1"), None, r"column 'q1_read' has no unit; expected q1_read_rad"),
    # headers
    ([f"{HEADER},x_mm", f"{ROW},1"], None, r"column 'x_mm' comes twice, as columns 3 and 6$"),
    (columns("x_m", "1"), None, r"columns 'x_mm' and 'x_m' both give x; expected one of them$"),
    ([HEADER], None, r"holds no rows; expected rows of numbers below a header$"),
    (["1,2,3,4,5", "6,7,8,9,10"], None, r"joint 1 has no column; expected q1_rad.* got '1', '2', '3', '4', '5'$"),
    ([HEADER, ROW, ROW + ",60"], 3, r"expected 5 cells as in the header, got 6"),
    ([HEADER, ROW, "10,20,30"], 3, r"expected 5 cells as in the header, got 3$"),
    # what was measured
    (
        ["q1_deg,q2_mm,x_mm,z_mm", "1,2,3,4"],
        None,
        r"expected also y_m, y_mm, y_um or y_in, as position is given only in",
    ),
    ([HEADER, ROW, "10,20,30,forty,50"], 3, r"column 'y_mm': expected a number, got 'forty'$"),
    ([HEADER, ROW, "10,20,30,400000,50"], 3, r"column 'y_mm': expected .* reach of 1500 mm \(is its unit right\?\)"),
    (columns("distance_mm", "-5"), 2, r"column 'distance_mm': expected a length greater than 0, got '-5'$"),
    (
        columns("distance_mm,anchor", "5,a", "5,"),
        3,
        r"column 'anchor': expected the label of this length's anchor, got an",
    ),
    # orientation
    (columns("qw,qx,qy", "1,0,0"), None, r"expected also qz, as rotation is given only in part$"),
    (
        columns("rx_deg,rz_deg", "1,0"),
        None,
        r"expected also ry_rad, ry_mrad or ry_deg, as rotation is given only in part$",
    ),
    (
        columns("rx_deg,ry_deg,rz_deg,qw", "1,0,0,0"),
        None,
        r"holds the orientation twice; expected either qw qx qy qz or",
    ),
    (
        columns("qw,qx,qy,qz", "1,0,0,0", "1,0,,0"),
        3,
        r"column 'qy': expected the whole orientation .*, got an empty cell$",
    ),
    (
        columns("rx_deg,ry_deg,rz_deg", ",,", "1,2,"),
        3,
        r"column 'rz_deg': expected the whole orientation in a row, or none",
    ),
    (
        columns("qw,qx,qy,qz", "0,0,0,0"),
        2,
        r"column 'qw': expected a quaternion of length 1 \(here it is 0\), got '0'$",
    ),
    (columns("qw,qx,qy,qz", "1,0,0,0.5"), 2, r"expected a quaternion of length 1 \(here it is 1.11803\)"),
    # standard deviations
    (
        columns("sigma_mm", "0.1", "-0.1"),
        3,
        r"column 'sigma_mm': expected a standard deviation greater than 0, got '-0.1'$",
    ),
    (columns("sigma_mm", "0"), 2, r"column 'sigma_mm': expected a standard deviation greater than 0, got '0'$"),
    (columns("sigma_mm", "1", ""), 3, r"column 'sigma_mm': expected a standard deviation greater than 0, got an empty"),
    (
        columns("sigma_x_mm,sigma_y_mm", "1,1"),
        None,
        r"expected also sigma_z_m, sigma_z_mm, .*, as sigma_position is given",
    ),
    (
        columns("sigma_x_mm,sigma_y_mm,sigma_z_mm", "1,-2,3"),
        2,
        r"column 'sigma_y_mm': expected a standard .*, got '-2'$",
    ),
    (columns("sigma_x_mm,sigma_y_mm,sigma_z_mm,sigma_mm", "1,2,3,4"), None, r"expected one sigma column .*'sigma_mm'$"),
    (columns("qw,qx,qy,qz,sigma_rot_deg", "1,0,0,0,-1"), 2, r"column 'sigma_rot_deg': expected a standard deviation"),
    # conditions
    (columns("payload_kg", "-1"), 2, r"column 'payload_kg': expected a mass of at least 0, got '-1'$"),
    (
        columns("temperature_c", "20", ""),
        3,
        r"column 'temperature_c': expected a finite number in every row, got an empty",
    ),
    (
        columns("temperature_c", "-300"),
        2,
        r"column 'temperature_c': expected a temperature above absolute zero, got '-300'",
    ),
    (columns("time_s", "noon"), 2, r"column 'time_s': expected a number, got 'noon'$"),
    (
        columns("fx_n,fy_n,fz_n,mx_nm,my_nm", "1,1,1,1,1"),
        None,
        r"expected also mz_nm, as wrench is given only in part$",
    ),
    (columns("current1_a", "1"), None, r"expected also current2_a, as current is given only in part$"),
    (columns("station", "A", ""), 3, r"column 'station': expected a label, got an empty cell$"),
    (columns("approach2", "1", "0"), 3, r"column 'approach2': expected \+1 or -1, or an empty cell .*, got '0'$"),
    (columns("approach1", "1", "0.5"), 3, r"column 'approach1': expected \+1 or -1 .*, got '0.5'$"),
]


@pytest.mark.parametrize(("lines", "line", "message"), BAD)
def test_the_error_says_what_was_expected_what_came_and_where(
    tmp_path: Path, lines: list[str], line: int | None, message: str
) -> None:
    path = tmp_path / "data.csv"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(ParseError, match=message) as caught:
        load_measurements(path, ARM)
    assert (caught.value.path, caught.value.line) == (str(path), line)
    where = str(path) if line is None else f"{path}:{line}"
    assert str(caught.value).startswith(f"{where}: ")
    assert "\n" not in str(caught.value)


def test_the_good_rows_of_these_files_are_good(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(f"{HEADER}\n{ROW}\n")
    np.testing.assert_array_equal(load_measurements(path, ARM).position, [[0.03, 0.04, 0.05]])


def test_blank_lines_and_quoted_line_ends_count(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(f'{HEADER},remark\n\n{ROW},"two\nlines"\n\n,,,,,\n{ROW[:-2]}x,""\n')
    with pytest.raises(ParseError, match=r"data.csv:7: column 'z_mm': expected a number, got 'x'$"):
        load_measurements(path, ARM)


def test_a_file_without_lines_names_the_row(tmp_path: Path) -> None:
    path = tmp_path / "data.parquet"
    values = {name: [1.0, 2.0] for name in HEADER.split(",")} | {"q2_mm": [1.0, np.inf]}
    pyarrow.parquet.write_table(pa.table(values), path)
    with pytest.raises(ParseError, match=r"data.parquet: data row 1, column 'q2_mm': expected a number, got 'inf'$"):
        load_measurements(path, ARM)


def test_numbers_too_large_for_their_unit_are_refused_without_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(f"{HEADER.replace('x_mm', 'x_in')}\n10,20,1e308,40,50\n")
    with pytest.raises(ParseError, match=r"data.csv:2: column 'x_in': expected a finite number, .*, got '1e308'$"):
        load_measurements(path, ARM)
