# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the studio does that needs no browser: the extra that may be missing, projects, work that is stopped."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

import fastcal
from fastcal.cli import main
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.results import read_json
from fastcal.report.language import in_language, retold
from fastcal.studio import reading
from fastcal.studio.jobs import Job
from fastcal.studio.project import Project
from fastcal.studio.server import free_port
from fastcal.studio.state import Studio

WITHOUT = """
import sys
sys.modules["nicegui"] = None
from fastcal.cli import main
sys.exit(main(["studio", "x"]))
"""


def test_without_the_extra_a_sentence_says_how_to_get_it(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 2
    assert done.stderr == "fastcal: error: the studio needs the extra 'studio': pip install 'fastcal[studio]'\n"
    assert list(tmp_path.iterdir()) == []


def test_no_command_but_this_one_imports_the_web_framework() -> None:
    code = "import sys; from fastcal.cli import main; main(['--help']); sys.exit('nicegui' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0


def test_a_port_that_is_taken_is_told(capsys: Any) -> None:
    import socket

    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(InvalidInput, match="give another one with --port"):
            free_port(other.getsockname()[1])


def test_a_demonstration_leaves_foreign_files_alone(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    assert main(["studio", str(tmp_path), "--demo", "--no-browser"]) == 2
    assert "holds other files" in capsys.readouterr().err


def test_a_project_keeps_its_answers_and_no_file_leaves_it(tmp_path: Path) -> None:
    project = Project(tmp_path / "cell")
    project.choose_robot("ur5")
    assert project.receive("../../a b.csv", b"1") == "inputs/a b.csv"
    assert Project(tmp_path / "cell").answers == {"robot": "ur5"}
    assert project.robot().joint_count == 6
    for name in ("../x", "/etc/passwd", "inputs/../../x"):
        with pytest.raises(InvalidInput, match="outside the project"):
            project.path(name)
    with pytest.raises(InvalidInput, match="expected a file with a name"):
        project.receive(".bashrc", b"")
    (tmp_path / "cell" / "studio.yaml").write_text("- 1\n")
    with pytest.raises(ParseError, match="expected a mapping"):
        Project(tmp_path / "cell")


def test_projects_lie_beside_each_other(tmp_path: Path) -> None:
    studio = Studio(Project(tmp_path / "cell_1"))
    studio.project.choose_robot("ur5")
    studio.open("cell_2")
    assert not studio.project.has_robot
    assert studio.project.beside() == ["cell_1", "cell_2"]
    studio.open("cell_1")
    assert studio.project.robot().joint_count == 6
    for name in ("", ".git", ".."):
        with pytest.raises(InvalidInput, match="expected a file with a name"):
            studio.open(name)


def test_commands_are_kept_once_each_with_quotes_where_needed(tmp_path: Path) -> None:
    project = Project(tmp_path)
    words = ["import", "inputs/a b.csv", "-o", "measurements.csv"]
    assert project.remember(words) == project.remember(words) == "fastcal import 'inputs/a b.csv' -o measurements.csv"
    assert (tmp_path / "commands.txt").read_text().count("\n") == 1


def test_work_says_what_it_does_and_what_went_wrong(tmp_path: Path) -> None:
    job = Job("calibrating", "calibrate", tmp_path, robot="no_such_arm", data="x.csv", out="out")
    job.wait(120)
    assert not job.is_running
    assert job.result is None
    assert "no_such_arm" in job.error
    nominal = fastcal.load_robot("ur5")
    data = fastcal.simulate(fastcal.perturbed(nominal, seed=1), fastcal.random_poses(nominal, 30, seed=2), noise=3e-5)
    fastcal.write_measurements(tmp_path / "m.csv", data, nominal.joint_types)
    job = Job("calibrating", "calibrate", tmp_path, robot="ur5", data="m.csv", out="out")
    assert job.wait(120)["status"] == "converged"
    assert job.step == "writing the report"
    assert (tmp_path / "out" / "report.html").is_file()


CASES = ["04_leica_at960", "08_robodk", "10_excel_german", "17_kuka_abc", "19_fanuc_ls", "21_ur_rtde"]


@pytest.mark.parametrize("case", CASES)
def test_exports_are_understood(case: str, shared_data: Any, tmp_path: Path) -> None:
    """As `fastcal import` does: the same rows, and a map that gives them again."""
    folder = shared_data / "exports" / case
    index = {entry["name"]: entry for entry in yaml.safe_load((shared_data / "exports" / "index.json").read_text())}
    project = Project(tmp_path)
    project.choose_robot("ur5")
    options = index[case]["options"]
    names = [project.receive(name, (folder / name).read_bytes()) for name in index[case]["files"]]
    project.answer("instrument", names)
    if "--joints" in options:
        name = options[options.index("--joints") + 1]
        project.answer("controller", project.receive(name, (folder / name).read_bytes()))
    found = reading.understand(project)
    assert found.problem == ""
    assert found.grade(project.robot().reach) == "good"
    line, rows = reading.save(project, found)
    assert rows == len(reading.table(found)) > 40
    assert line.startswith("fastcal import inputs/")
    expected = fastcal.load_measurements(folder / "expected.csv", project.robot())
    assert len(fastcal.load_measurements(tmp_path / "measurements.csv", project.robot())) == len(expected)


def test_roles_are_changed_one_at_a_time(shared_data: Any, tmp_path: Path) -> None:
    folder = shared_data / "exports" / "01_sa_points"
    project = Project(tmp_path)
    project.choose_robot("ur5")
    project.answer("instrument", [project.receive("a.txt", (folder / "ur5_sa.txt").read_bytes())])
    project.answer("controller", project.receive("b.csv", (folder / "joints.csv").read_bytes()))
    columns = reading.columns_of(project)
    roles = {column.title: column.role for column in columns}
    by_role = {column.role: column for column in columns if column.role}
    assert {"x_mm", "y_mm", "z_mm", "q1_deg", "q6_deg"} <= set(by_role)
    good = reading.understand(project)
    reading.assign(project, by_role["q1_deg"], "q2_deg")  # joint 1 is taken for joint 2, which has then no column
    changed = {column.title: column.role for column in reading.columns_of(project)}
    assert changed[by_role["q1_deg"].title] == "q2_deg"
    assert changed[by_role["q2_deg"].title] == ""
    assert reading.understand(project).problem != ""
    reading.assign(project, by_role["q1_deg"], "q1_deg")
    reading.assign(project, by_role["q2_deg"], "q2_deg")
    assert {column.title: column.role for column in reading.columns_of(project)} == roles
    again = reading.understand(project)
    assert again.rms == pytest.approx(good.rms)
    line, _ = reading.save(project, again)
    assert "--map map.yaml" in line


def test_what_a_file_holds_says_whose_it_is(shared_data: Any, tmp_path: Path) -> None:
    """Whichever field it was dropped into; a file of neither stays what it was dropped as."""
    folder = shared_data / "exports" / "01_sa_points"
    project = Project(tmp_path)
    points = project.receive("points.txt", (folder / "ur5_sa.txt").read_bytes())
    joints = project.receive("joints.csv", (folder / "joints.csv").read_bytes())
    program = project.receive("poses.script", b"def p():\n  movej([0,-1,1,0,1,0])\nend\n")
    both = project.receive("both.csv", b"q1_deg,x_mm,y_mm,z_mm\n1,2,3,4\n5,6,7,8\n")
    other = project.receive("other.txt", b"nothing of use\n")
    for dropped in ("instrument", "controller"):
        found = [reading.kind_of(project, path, dropped) for path in (points, joints, program, both, other)]
        assert found == ["instrument", "controller", "controller", "instrument", dropped]


def test_a_screen_names_no_option_of_a_command(shared_data: Any, tmp_path: Path) -> None:
    """In either language: what a file lacks is said in the words of the screen."""
    folder = shared_data / "exports" / "01_sa_points"
    project = Project(tmp_path)
    project.choose_robot("ur5")
    points = project.receive("points.txt", (folder / "ur5_sa.txt").read_bytes())
    joints = project.receive("joints.csv", (folder / "joints.csv").read_bytes())
    project.answer("instrument", [points])
    problem = reading.understand(project).problem
    assert problem == "points.txt: holds 200 measured points and no joints: drop the controller's log or program"
    project.answer("instrument", [joints])
    assert reading.understand(project).problem == (
        "joints.csv: holds 6 joints in 200 rows and no measured points: drop the instrument's points too, or say above "
        "which columns they are"
    )
    project.answer("instrument", [points])
    project.answer("controller", joints)
    with in_language("de"):
        notes = [retold(note) for note in reading.understand(project).notes]
    assert notes[0] == "200 Punkte nach Namen mit ihren Posen verbunden ('Target' der Punkte, 'Point' der Posen)"
    assert notes[1].startswith("am Roboter geprüft: Jedes Paar passt (0,")
    assert notes[2] == "Spalten von points.txt, die nicht bekannt sind, bleiben weg: 'Collection', 'Group'"
    reading.count_joints(project, [1, 1, -1, 1, 1, 1], "own")
    found = reading.understand(project)
    assert found.suspicion.startswith("With the sign of joint 3 turned the misfit would be ")
    with in_language("de"):
        assert retold(found.suspicion).endswith(": das Vorzeichen von Gelenk 3 umgedreht.")
        assert retold(found.problem).startswith("points.txt: die Punkte passen nicht zu diesem Roboter")


def test_a_result_is_held_against_poses_that_no_fit_sees(tmp_path: Path) -> None:
    nominal = fastcal.load_robot("ur5")
    real = fastcal.perturbed(nominal, seed=1)
    for name, rows in (("measurements.csv", 40), ("test.csv", 12)):
        data = fastcal.simulate(real, fastcal.random_poses(nominal, rows, seed=rows), noise=3e-5, seed=rows)
        fastcal.write_measurements(tmp_path / name, data, nominal.joint_types)
    assert Project(tmp_path).data_files() == ["measurements.csv", "test.csv"]
    names = {"robot": "ur5", "data": "measurements.csv", "test": "test.csv"}
    assert Job("calibrating", "calibrate", tmp_path, out="out", **names).wait(120)["status"] == "converged"
    assert read_json(tmp_path / "out" / "result.json")["test"]["count"] == 12
