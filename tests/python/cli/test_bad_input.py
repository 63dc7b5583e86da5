# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every input that can't be meant gives one line on standard error and exit code 2, and leaves no file."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

Edit = Callable[[list[list[str]]], object]


def cell(row: int, column: int, text: str) -> Edit:
    return lambda rows: rows[row].__setitem__(column, text)


def renamed(old: str, new: str) -> Edit:
    return lambda rows: rows[0].__setitem__(rows[0].index(old), new)


def scaled(name: str, factor: float) -> Edit:
    def edit(rows: list[list[str]]) -> None:
        place = rows[0].index(name)
        for row in rows[1:]:
            row[place] = repr(float(row[place]) * factor)

    return edit


def swapped(first: int, second: int) -> Edit:
    def edit(rows: list[list[str]]) -> None:
        for row in rows[1:]:
            row[first], row[second] = row[second], row[first]

    return edit


def shuffled(rows: list[list[str]]) -> None:
    """The points of other poses: no reading of the columns explains them."""
    points = [row[6:9] for row in rows[1:]]
    for row, point in zip(rows[1:], points[7:] + points[:7], strict=True):
        row[6:9] = point


# What formats.md lists: the edit of a good file, and what the line says.
LISTED: dict[str, tuple[Edit, str]] = {
    "nan": (cell(3, 1, "nan"), ".csv:4: column 'q2_deg': expected a finite number, got 'nan'"),
    "text": (cell(2, 7, "left"), ".csv:3: column 'y_mm': expected a number, got 'left'"),
    "duplicate": (renamed("y_mm", "x_mm"), ".csv: column 'x_mm' comes twice, as columns 7 and 8"),
    "no rows": (lambda rows: rows.__delitem__(slice(1, None)), ".csv: holds no rows; expected rows of numbers"),
    "missing joint": (renamed("q4_deg", "turn"), ".csv: joint 4 has no column; expected q4_rad, q4_mrad or q4_deg"),
    "limits": (cell(5, 0, "900"), ".csv:6: column 'q1_deg': expected at most 360 deg outside joint 1's limits"),
    "scale": (scaled("x_mm", 1e6), "column 'x_mm': expected a number that fits an arm with a reach of"),
    "no unit": (renamed("x_mm", "x"), ".csv: column 'x' has no unit; expected x_m, x_mm, x_um or x_in"),
    "other unit": (renamed("x_mm", "x_cm"), ".csv: column 'x_cm': 'cm' is no unit of length known here"),
    "nothing measured": (lambda rows: [row.__delitem__(slice(6, 9)) for row in rows], "holds nothing measured"),
}
# What the columns were probably meant to be, and what can't be any measurement of this arm.
MISREAD: dict[str, tuple[Edit, str]] = {
    "joints swapped": (swapped(1, 2), "with the columns of joints 2 and 3 swapped it would be"),
    "joint turned": (scaled("q2_deg", -1.0), "with the sign of joint 2 turned it would be"),
    "all joints turned": (lambda rows: all_turned(rows), "with the signs of all joints turned it would be"),
    "left-handed": (scaled("z_mm", -1.0), "left-handed"),
    "a slip of the wrist": (scaled("q6_deg", -1.0), "with the sign of joint 6 turned it would be"),
    "another arm": (shuffled, "every point in the row of its pose?"),
}


def all_turned(rows: list[list[str]]) -> None:
    for row in rows[1:]:
        row[:6] = [repr(-float(text)) for text in row[:6]]


@pytest.fixture
def good(demo: Path, tmp_path: Path, rewritten) -> Path:
    """Forty of the demonstration's rows, and a result of an older calibration beside them."""
    (tmp_path / "out").mkdir()
    (tmp_path / "out/model.yaml").write_text("older")
    return rewritten(demo / "measurements.csv", tmp_path / "good.csv", lambda rows: rows.__delitem__(slice(41, None)))


def assert_nothing_written(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} - {"good.csv", "bad.csv", "bad.yaml"} == {"out"}
    assert [(path.name, path.read_text()) for path in (folder / "out").iterdir()] == [("model.yaml", "older")]


@pytest.mark.parametrize("case", LISTED)
def test_a_bad_file_is_refused_by_the_process(demo, good, tmp_path, case, process, rewritten) -> None:
    edit, line = LISTED[case]
    bad = rewritten(good, tmp_path / "bad.csv", edit)
    said = process("calibrate", demo / "robot.yaml", bad, "-o", "out", cwd=tmp_path)
    assert said.code == 2
    assert line in said.error
    assert "bad.csv" in said.error
    assert said.out == ""
    assert_nothing_written(tmp_path)


@pytest.mark.parametrize("case", MISREAD)
def test_mislabelled_columns_are_refused_with_the_evidence(demo, good, tmp_path, fastcal, case, rewritten) -> None:
    edit, line = MISREAD[case]
    said = fastcal(
        "calibrate", demo / "robot.yaml", rewritten(good, tmp_path / "bad.csv", edit), "-o", tmp_path / "out"
    )
    assert said.code == 2
    assert line in said.error
    assert_nothing_written(tmp_path)


@pytest.mark.parametrize("command", ["calibrate", "diagnose"])
def test_columns_are_taken_as_they_are_where_the_user_says_so(
    demo, good, tmp_path, fastcal, rewritten, command
) -> None:
    """A joint whose sign costs little: refused with both misfits, and accepted by --as-read with a warning."""
    turned = rewritten(good, tmp_path / "bad.csv", scaled("q6_deg", -1.0))
    said = fastcal(command, demo / "robot.yaml", turned, "-o", tmp_path / "new")
    assert said.code == 2
    assert "--as-read (in Python as_read=True) accepts the columns as they are" in said.error
    assert not (tmp_path / "new").exists()
    said = fastcal(command, demo / "robot.yaml", turned, "--as-read", "-o", tmp_path / "new")
    assert said.code == 0
    assert "with the sign of joint 6 turned it would be" in said.err
    file = "result.json" if command == "calibrate" else "diagnosis.json"
    assert "with the sign of joint 6 turned" in " ".join(json.loads((tmp_path / "new" / file).read_text())["notes"])


@pytest.mark.parametrize(
    ("robot", "data", "line"),
    [
        (
            "good.csv",
            "ur5",
            "good.csv: is no robot file (.yaml, .urdf, .xacro) and no name of a shipped arm; the robot comes",
        ),
        ("ur5r", "good.csv", "ur5r: there is no such file, and no shipped arm has that name; did you mean ur5"),
        ("mine.yaml", "good.csv", "mine.yaml: there is no such file"),
        ("ur5", "page.csv", "page.csv: is a web page (HTML); expected a table as text, Excel or Parquet"),
        (
            "ur5",
            "joints.csv",
            "holds 6 joints in 2 rows and no measured points: give the instrument's export",
        ),
    ],
)
def test_what_is_mixed_up_or_misspelt_is_named(good, tmp_path, fastcal, monkeypatch, robot, data, line) -> None:
    monkeypatch.chdir(tmp_path)
    Path("page.csv").write_text("<!DOCTYPE html><html><body>a report</body></html>")
    Path("joints.csv").write_text("J1,J2,J3,J4,J5,J6\n1,2,3,4,5,6\n2,3,4,5,6,7\n")
    said = fastcal("calibrate", robot, data, "-o", "new")
    assert said.code == 2
    assert line in said.err
    assert not Path("new").exists()


def test_a_misspelt_effect_and_option_are_named(good, demo, tmp_path, fastcal) -> None:
    said = fastcal("calibrate", demo / "robot.yaml", good, "--effects", "geometry,backlsh", "-o", tmp_path / "new")
    assert "no effect is called 'backlsh'; did you mean 'backlash'? There are geometry" in said.err
    said = fastcal("calibrate", demo / "robot.yaml", good, "--effect", "geometry", "-o", tmp_path / "new")
    assert "--effects" in said.err
    assert "(see fastcal calibrate --help)" in said.err


@pytest.mark.parametrize("command", ["calibrate", "diagnose"])
def test_rows_that_test_what_they_were_fitted_on_are_noticed(demo, good, tmp_path, fastcal, command) -> None:
    said = fastcal(command, demo / "robot.yaml", good, "--test", good, "-o", tmp_path / "new")
    assert said.code == 0
    assert "good.csv: all its rows are among the rows of the fit" in said.err
    said = fastcal(command, demo / "robot.yaml", good, "--test", demo / "test.csv", "-o", tmp_path / "new")
    assert "among the rows of the fit" not in said.err
    assert "elsewhere" not in said.err


@pytest.mark.parametrize("command", ["calibrate", "diagnose"])
def test_a_test_that_was_measured_from_another_place_is_said(demo, good, tmp_path, fastcal, command) -> None:
    rows = [line.split(",") for line in (demo / "test.csv").read_text(encoding="utf-8").splitlines()]
    x, y = rows[0].index("x_mm"), rows[0].index("y_mm")
    for row in rows[1:]:  # turned by 90 degrees about z, and 3 m away
        row[x], row[y] = str(3000 - float(row[y])), row[x]
    (tmp_path / "moved.csv").write_text("\n".join(map(",".join, rows)), encoding="utf-8")
    said = fastcal(command, demo / "robot.yaml", good, "--test", tmp_path / "moved.csv", "-o", tmp_path / "new")
    assert said.code == 0
    assert "moved.csv: these rows fit with 0." in said.err
    assert "moved by 3000 mm and turned by 90 deg" in said.err


def test_three_poses_leave_nothing_to_estimate_the_noise_from(demo, good, tmp_path, fastcal, rewritten) -> None:
    few = rewritten(good, tmp_path / "few.csv", lambda rows: rows.__delitem__(slice(4, None)))
    said = fastcal("calibrate", demo / "robot.yaml", few, "-o", tmp_path / "new")
    assert said.code == 3
    assert "nothing is left to estimate the noise from" in said.err
    assert json.loads((tmp_path / "new/result.json").read_text())["status"] == "too_few_equations"
    assert not (tmp_path / "new/model.yaml").exists()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ([], "Missing command."),
        (["calibrat"], "No such command 'calibrat'"),
        (["calibrate", "ROBOT"], "Missing argument 'DATA...'"),
        (["calibrate", "ROBOT", "DATA"], "Missing option '-o' / '--output'"),
        (["convert", "ROBOT", "-o", "x.yaml"], "Missing option '--to'. Choose from: urdf, dh, mdh, poe"),
        (["calibrate", "ROBOT", "DATA", "-o", "out", "--loss", "square"], "'square' is not one of 'tukey', 'huber'"),
        (["calibrate", "ROBOT", "DATA", "-o", "out", "--method", "simplex"], "'simplex' is not one of 'nls', 'bfgs'"),
        (["calibrate", "ROBOT", "DATA", "-o", "out", "--threads", "0"], "Invalid value for '--threads'"),
        (["calibrate", "ROBOT", "DATA", "-o", "out", "--effects", "sag"], "no effect is called 'sag'"),
        (["calibrate", "ROBOT", "DATA", "-o", "out", "--effects", "joint_compliance@joint9"], "no owner 'joint9'"),
        (["calibrate", "ROBOT", "nothing.csv", "-o", "out"], "nothing.csv: there is no such file"),
        (["calibrate", "nothing.yaml", "DATA", "-o", "out"], "nothing.yaml: there is no such file"),
        (
            ["calibrate", "ROBOT", "DATA", "-o", "good.csv"],
            "good.csv: is an input of this command",
        ),
        (["calibrate", "ROBOT", "DATA", "-o", "good.csv/in"], "good.csv is not a folder"),
        (["predict", "ROBOT", "DATA", "-o", "none/there.csv"], "none/there.csv: cannot be written: No such file"),
        (["predict", "ROBOT", "DATA", "-o", "out"], "out: cannot be written: it is not a regular file"),
        (["convert", "ROBOT", "--to", "xml", "-o", "new.yaml"], "'xml' is not one of 'urdf', 'dh', 'mdh', 'poe'"),
        (["convert", "ROBOT", "--to", "dh", "-o", "new.urdf"], "a .urdf file holds the kind urdf, not dh"),
        (["simulate", "ROBOT", "DATA", "-o", "new.csv", "--noise-mm", "-1"], "Invalid value for '--noise-mm'"),
        (["simulate", "ROBOT", "DATA", "-o", "new.csv", "--noise-mm", "nan"], "noise"),
        (["demo", "-o", "out"], "out: holds other files"),
    ],
)
def test_wrong_usage_is_answered_in_one_line(demo, good, tmp_path, fastcal, monkeypatch, arguments, line) -> None:
    monkeypatch.chdir(tmp_path)
    places = {"ROBOT": demo / "robot.yaml", "DATA": "good.csv"}
    said = fastcal(*(places.get(argument, argument) for argument in arguments))
    assert said.code == 2
    assert line in said.error
    assert said.out == ""
    assert_nothing_written(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("d_mm: 925", "d_mm: far", "joints[3].d_mm"),
        ("kinematics: dh", "kinematics: hd", "kinematics"),
        ("alpha_deg: -90", "alpha: -90", "alpha"),
        ("name: staubli_rx160l", "name: [", "bad.yaml:"),
    ],
)
def test_a_bad_robot_file_is_refused(demo, good, tmp_path, fastcal, old, new, line) -> None:
    text = (demo / "robot.yaml").read_text()
    assert old in text
    (tmp_path / "bad.yaml").write_text(text.replace(old, new, 1))
    said = fastcal("calibrate", tmp_path / "bad.yaml", good, "-o", tmp_path / "out")
    assert said.code == 2
    assert line in said.error
    assert_nothing_written(tmp_path)


def test_a_fault_of_fastcal_is_one_line_too(demo, good, tmp_path, fastcal, monkeypatch) -> None:
    def breaks(*args: object, **options: object) -> Callable[..., None]:
        raise ZeroDivisionError("a fault\nof two lines")

    monkeypatch.setattr("fastcal.calibration.calibrate.calibrate", breaks)
    said = fastcal("calibrate", demo / "robot.yaml", good, "-o", tmp_path / "out")
    assert said.code == 1
    assert said.error.startswith("internal error, ZeroDivisionError: a fault of two lines")
    assert_nothing_written(tmp_path)


def test_two_poses_cannot_place_the_arm_and_end_with_3(demo, good, tmp_path, fastcal, rewritten) -> None:
    few = rewritten(good, tmp_path / "few.csv", lambda rows: rows.__delitem__(slice(3, None)))
    said = fastcal("calibrate", demo / "robot.yaml", few, "-o", tmp_path / "new")
    assert said.code == 3
    assert "base and tool need at least three measured points or orientations, got 2" in said.error
    assert not (tmp_path / "new").exists()
