# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal import` and `fastcal template`, and several or foreign files where a command takes DATA."""

import json
from itertools import product
from pathlib import Path

import numpy as np
import openpyxl
import pytest

import fastcal
from fastcal.cli import main
from fastcal.io.measurements import load_measurements

from .conftest import P, Q, Session

POINTS = ("Name,X [mm],Y [mm],Z [mm]", "{name}," + P, "points.csv")


@pytest.fixture
def here(session: Session, monkeypatch: pytest.MonkeyPatch) -> Session:
    monkeypatch.chdir(session.folder)
    session.table(*POINTS)
    session.joints()
    return session


def test_import_writes_a_measurement_file_and_says_how(here: Session, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", "points.csv", "--joints", "joints.csv", "--robot", "ur5", "-o", "out.csv"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "30 points joined with their poses by name ('Name')" in said.out
    assert said.out.splitlines()[-1] == "out.csv: 30 rows, 6 joints, points; read as a table"
    assert len(load_measurements("out.csv", fastcal.load_robot("ur5"))) == 30


def test_the_summary_of_an_import_as_json(here: Session, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", "points.csv", "--joints", "joints.csv", "--robot", "ur5", "-o", "out.csv", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said.pop("notes")[0] == "30 points joined with their poses by name ('Name')"
    assert said == {"file": "out.csv", "rows": 30, "joints": 6, "measured": ["points"], "read_as": "a table"}


def test_a_question_is_one_line_and_nothing_is_written(here: Session, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", "points.csv", "-o", "out.csv"]) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    assert "--joints" in said.err
    assert not Path("out.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["points.csv", "--joints", "joints.csv", "-o", "points.csv"], "is an input of this command"),
        (["points.csv"], "expected -o FILE"),
        (["nothing.csv", "-o", "out.csv"], "there is no such file"),
        (["points.csv", "--orientation", "euler", "-o", "out.csv"], "--orientation: expected rpy"),
        (["points.csv", "--joints", "points.csv", "-o", "out.csv"], "holds no joint positions"),
        (["joints.csv", "-o", "out.csv"], "no measured points"),
    ],
)
def test_invalid_usage(here: Session, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str) -> None:
    assert main(["import", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_print_map_writes_a_file_that_map_reads(here: Session, capsys: pytest.CaptureFixture[str]) -> None:
    here.table("J1,J2,J3,J4,J5,J6,X,Y,Z", Q + "," + P, "both.csv")
    assert main(["import", "both.csv", "--print-map"]) == 0
    assert 'q1_deg: "J1"' in capsys.readouterr().out
    assert main(["import", "both.csv", "--print-map", "-o", "map.yaml"]) == 0
    assert main(["import", "both.csv", "--map", "map.yaml", "-o", "out.csv"]) == 0
    assert len(load_measurements("out.csv", fastcal.load_robot("ur5"))) == 30


@pytest.mark.parametrize("name", ["t.csv", "t.xlsx"])
def test_a_template_that_is_filled_in_is_a_measurement_file(here: Session, name: str) -> None:
    assert main(["template", "lbr_iiwa14", "-o", name]) == 0
    row = [0.1 * k for k in range(1, 8)] + [400.0, 10.0, 900.0]
    if name.endswith(".csv"):
        with Path(name).open("a") as file:
            file.write(",".join(map(str, row)) + "\n")
    else:
        book = openpyxl.load_workbook(name)
        book.worksheets[0].append(row)
        assert [cell.value for cell in book["Columns"]["A"]][:3] == ["column", "q1_deg", "q2_deg"]
        book.save(name)
    data = load_measurements(name, fastcal.load_robot("lbr_iiwa14"))
    assert len(data) == 1
    assert data.notes == ()


def test_a_template_of_another_ending_is_refused(here: Session, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["template", "ur5", "-o", "t.ods"]) == 2
    assert "ends in .csv or .xlsx" in capsys.readouterr().err


def test_calibrate_reads_an_export_as_it_is(here: Session, capsys: pytest.CaptureFixture[str]) -> None:
    here.table("Achse 1;Achse 2;Achse 3;Achse 4;Achse 5;Achse 6;X;Y;Z", (Q + "," + P).replace(",", ";"), "export.csv")
    assert main(["import", "export.csv", "-o", "imported.csv"]) == 0
    for name in ("export", "imported"):
        assert main(["calibrate", "ur5", f"{name}.csv", "-o", name]) == 0
    said = capsys.readouterr()
    assert "taken as degrees" in said.err
    first, second = (json.loads(Path(name, "result.json").read_text()) for name in ("export", "imported"))
    assert first["train"]["after_mm"] == second["train"]["after_mm"]


def test_a_question_of_an_export_names_the_command_that_takes_the_answer(
    here: Session, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "ur5", "points.csv", "-o", "out"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "--joints FILE; these are options of fastcal import" in said


def test_errors_of_a_measurement_file_stay_its_own(here: Session, capsys: pytest.CaptureFixture[str]) -> None:
    here.table("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z", Q + "," + P, "own.csv")
    assert main(["calibrate", "ur5", "own.csv", "-o", "out"]) == 2
    assert "column 'z' has no unit" in capsys.readouterr().err


def test_several_files_are_calibrated_as_one(here: Session) -> None:
    head = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm"
    path = here.table(head, Q + "," + P, "all.csv")
    lines = path.read_text().splitlines()
    Path("monday.csv").write_text("\n".join([head, *lines[1:16]]))
    Path("tuesday.csv").write_text("\n".join([head, *lines[16:]]))
    assert main(["calibrate", "ur5", "all.csv", "-o", "one"]) == 0
    assert main(["calibrate", "ur5", "monday.csv", "tuesday.csv", "-o", "two"]) == 0
    one, two = (json.loads(Path(name, "result.json").read_text()) for name in ("one", "two"))
    assert one["train"]["after_mm"] == two["train"]["after_mm"]
    data = fastcal.load_measurements(["monday.csv", "tuesday.csv"], fastcal.load_robot("ur5"))
    assert data.station_names == data.mount_names == ("monday", "tuesday")
    assert data.station is not None
    assert data.station.tolist() == [0] * 15 + [1] * 15
    assert main(["evaluate", "one/model.yaml", "monday.csv", "tuesday.csv", "-o", "e.json"]) == 0
    assert json.loads(Path("e.json").read_text())["count"] == 30


def test_several_files_are_diagnosed_and_trained_on_as_one(here: Session) -> None:
    """Each file is a set-up of its own, here of the same tracker; a table of both says the same."""
    head = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm"
    path = here.table(head, Q + "," + P, "all.csv")
    lines = path.read_text().splitlines()
    for name, rows in (("monday", lines[1:16]), ("tuesday", lines[16:])):
        Path(f"{name}.csv").write_text("\n".join([head, *rows]))
    labels = [*["monday"] * 15, *["tuesday"] * 15]
    labelled = [f"{row},{day},{day}" for row, day in zip(lines[1:], labels, strict=True)]
    Path("labelled.csv").write_text("\n".join([f"{head},station,mount", *labelled]))
    for out, files in (("one", ["labelled.csv"]), ("two", ["monday.csv", "tuesday.csv"])):
        assert main(["diagnose", "ur5", *files, "-o", out]) == 0
    one, two = (json.loads(Path(name, "diagnosis.json").read_text()) for name in ("one", "two"))
    for found in (one, two):
        found.pop("made_by")
    assert one == two
    pytest.importorskip("torch")
    trained = {}
    for out, files in (("a", ["labelled.csv"]), ("b", ["monday.csv", "tuesday.csv"])):
        assert main(["train", "ur5", *files, "--network", "gp", "--rivals", "none", "--folds", "2", "-o", out]) == 0
        trained[out] = json.loads(Path(out, "training.json").read_text())
    assert trained["a"] == trained["b"]
    assert trained["b"]["rows"] == 30


def test_a_list_of_points_is_joined_with_its_joints_in_python(here: Session) -> None:
    robot = fastcal.load_robot("ur5")
    data = fastcal.load_measurements("points.csv", robot, joints=here.joints())
    assert data.position is not None
    np.testing.assert_allclose(1e3 * data.position, here.points, atol=1e-9)
    np.testing.assert_allclose(np.degrees(data.q), here.q, atol=1e-9)
    assert any("joined" in note for note in data.notes)


def test_a_map_names_points_of_several_targets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A table without a header: three numbers of one reflector, three of another, six joints."""
    (tmp_path / "nests.csv").write_text("1,2,3,4,5,6,0.1,0.2,0.3,0.4,0.5,0.6\n7,8,9,10,11,12,0.6,0.5,0.4,0.3,0.2,0.1\n")
    own = ", ".join(f"q{i}_deg: {i + 6}" for i in range(1, 7))
    points = ", ".join(f"{part}_mm@{target}: {k}" for k, (target, part) in enumerate(product(("n1", "N2"), "xyz"), 1))
    (tmp_path / "map.yaml").write_text(f"columns: {{{points}, {own}}}\n")
    files = ["import", str(tmp_path / "nests.csv"), "--map", str(tmp_path / "map.yaml")]
    assert main([*files, "-o", str(tmp_path / "measurements.csv")]) == 0
    assert (tmp_path / "measurements.csv").read_text().splitlines() == [
        "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm@n1,y_mm@n1,z_mm@n1,x_mm@N2,y_mm@N2,z_mm@N2",
        "0.1,0.2,0.3,0.4,0.5,0.6,1.0,2.0,3.0,4.0,5.0,6.0",
        "0.6,0.5,0.4,0.3,0.2,0.1,7.0,8.0,9.0,10.0,11.0,12.0",
    ]
    capsys.readouterr()
