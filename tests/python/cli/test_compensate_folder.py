# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compensate` on a folder of programs, back again, and the table of corrections."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest

import fastcal as library
from fastcal.programs import read_program

CELL = """\
tools: {"1": {xyz_mm: [20, 0, 200], rpy_deg: [0, 10, 0]}}
frames: {"1": {xyz_mm: [1750, -150, 820]}}
"""
ARM = "siasun_sr210d"


@pytest.fixture
def cell(tmp_path, programs, monkeypatch) -> Path:
    """line/: RAPID, a KRL pair in a folder below, a program without targets, and a text that is none; a real arm."""
    below = tmp_path / "line" / "second"
    below.mkdir(parents=True)
    (tmp_path / "line" / "glue.mod").write_bytes(programs["RAPID"]["glue.mod"])
    for name, content in programs["KRL"].items():
        (below / name).write_bytes(content)
    (tmp_path / "line" / "logic.mod").write_text("MODULE logic\nPROC wait()\nWaitTime 1;\nENDPROC\nENDMODULE\n")
    (tmp_path / "line" / "readme.txt").write_text("not a program")
    (tmp_path / "cell.yaml").write_text(CELL)
    library.perturbed(library.load_robot(ARM), seed=3).save(tmp_path / "real.yaml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


MORE = ("--nominal", ARM, "--cell", "cell.yaml", "--payload-kg", "5")


def test_a_folder_goes_there_and_back(cell, process, fastcal) -> None:
    said = process("compensate", "real.yaml", "line", *MORE, "-o", "done", "--corrections", "table.csv", cwd=cell)
    assert said.code == 0, said.err
    written = sorted(path.relative_to("done").as_posix() for path in Path("done").rglob("*") if path.is_file())
    assert written == ["glue.mod", "logic.mod", "second/weld.dat", "second/weld.src"]
    assert Path("done/logic.mod").read_bytes() == Path("line/logic.mod").read_bytes()
    assert "line/logic.mod: holds no targets of plain numbers; written as it is" in said.err

    before = read_program({"glue.mod": Path("line/glue.mod").read_bytes()})
    after = read_program({"glue.mod": Path("done/glue.mod").read_bytes()})
    rows = list(csv.DictReader(Path("table.csv").read_text().splitlines()))
    mine = [row for row in rows if row["file"] == "glue.mod"]
    assert [row["target"] for row in mine] == [target.name for target in before.targets]
    assert {Path(row["file"]).stem for row in rows} == {"glue", "weld"}
    for row, old, new in zip(mine, before.targets, after.targets, strict=True):
        assert int(row["line"]) == old.line
        assert float(row["error_mm"]) > 0.01
        if old.kind == "joints":
            changed = np.degrees(new.values - old.values)
            np.testing.assert_allclose([float(row[f"dq{k}_deg"]) for k in range(1, 7)], changed, atol=1e-4)
        else:
            # The frame of the work object is only moved and turned: a shift keeps its length.
            shift = np.linalg.norm([float(row[f"shift_{axis}_mm"]) for axis in "xyz"])
            assert shift == pytest.approx(1000 * np.linalg.norm(new.values[:3] - old.values[:3]), abs=1e-3)

    said = fastcal("compensate", "real.yaml", "done", *MORE, "--inverse", "-o", "back")
    assert said.code == 0
    assert "targets brought back to nominal" in said.out
    again = read_program({"glue.mod": Path("back/glue.mod").read_bytes()})
    for old, new in zip(before.targets, again.targets, strict=True):
        np.testing.assert_allclose(new.values, old.values, atol=1e-4)  # of a quaternion of rounded length


def test_a_program_s_corrections_say_how_surely_they_are_known(tmp_path, programs, fastcal, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    nominal = library.load_robot("ur5")
    poses = library.random_poses(nominal, 60, seed=1)
    data = library.simulate(library.perturbed(nominal, seed=1), poses, noise=1e-4)
    library.calibrate(nominal, data).model.save("model.yaml")
    Path("a.script").write_bytes(programs["URScript"]["palletize.script"])
    said = fastcal("compensate", "model.yaml", "a.script", "-o", "b.script", "--corrections", "c.csv")
    rows = list(csv.DictReader(Path("c.csv").read_text().splitlines()))
    largest = max(float(row["sigma_mm"]) for row in rows)
    assert 0.001 < largest < 0.2
    assert f"; its standard deviation {largest:.3g} mm per coordinate" in said.out


def test_a_table_of_poses_has_its_corrections_too(cell, fastcal) -> None:
    real, nominal = library.load_robot("real.yaml"), library.load_robot(ARM)
    q = np.array([[0.1, -0.4, 1.9, 0.2, 0.9, 0.1], [0.2, -0.5, 2.0, 0.1, 0.8, 0.0]])
    T = nominal.forward(q)
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, [3, 0, 1, 2]]
    table = np.column_stack([1000 * T[:, :3, 3], turn])
    head = "x_mm,y_mm,z_mm,qw,qx,qy,qz"
    np.savetxt("targets.csv", table, delimiter=",", header=head, comments="", fmt="%.12g")
    said = fastcal("compensate", "real.yaml", "targets.csv", "--nominal", ARM, "-o", "q.csv", "--corrections", "c.csv")
    assert said.code == 0, said.err
    rows, commands = (list(csv.DictReader(Path(name).read_text().splitlines())) for name in ("c.csv", "q.csv"))
    assert [row["row"] for row in rows] == ["0", "1"]
    sent = np.radians([[float(row[f"q{k}_deg"]) for k in range(1, 7)] for row in commands])
    ends = {"base": real.spec["base"], "tool": real.spec["tool"]}
    moved = library.Robot(nominal.spec | ends).forward(sent)[:, :3, 3] - T[:, :3, 3]
    shift = [[float(row[f"shift_{axis}_mm"]) for axis in "xyz"] for row in rows]
    np.testing.assert_allclose(shift, 1000 * moved, atol=1e-5)
    assert [row["sigma_mm"] for row in rows] == [row["sigma_mm"] for row in commands]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("line", "-o", "line"), "expected a folder that is not in line, whose programs are read"),
        (("line", "-o", "line/done"), "expected a folder that is not in line"),
        (("line", "-o", "cell.yaml"), "is an input of this command"),
        (("empty", "-o", "done"), "empty: holds no robot program; known by their endings are"),
        (("line", "--method", "one-step", "--inverse", "-o", "done"), "the inverse needs method='full'"),
        (("line", "--path", "line", "-o", "done"), "--path is for tables of poses"),
        (("targets.csv", "--inverse", "-o", "done.csv"), "fastcal predict says where a table of joint positions leads"),
        (("bad", "-o", "done"), "bad/bad.ls:1: expected a section /POS"),
        (("line", "-o", "done", "--corrections", "real.yaml"), "is an input of this command"),
    ],
)
def test_folders_that_do_not_fit_are_refused_and_nothing_is_written(cell, fastcal, arguments, sentence) -> None:
    Path("empty").mkdir()
    Path("targets.csv").write_text("x_mm\n1\n")
    Path("bad").mkdir()
    Path("bad/bad.ls").write_text("/PROG  BAD\n")
    source, *options = arguments
    more = MORE[:2] if source == "targets.csv" else MORE
    said = fastcal("compensate", "real.yaml", source, *more, *options)
    assert said.code == 2
    assert sentence in said.err
    assert not Path("done").exists()
    assert not Path("line/done").exists()


def test_of_a_folder_what_can_be_is_done_and_the_rest_is_named(cell, fastcal) -> None:
    """A listing that is no program, a program of another maker, and results of an earlier run."""
    assert fastcal("compensate", "real.yaml", "line", *MORE, "-o", "done").code == 0
    shutil.copytree("done", "line/results")
    Path("line/LOGBOOK.LS").write_text("no program\n")
    Path("line/weld.jbi").write_text("/JOB\n")
    said = fastcal("compensate", "real.yaml", "line", *MORE, "-o", "again")
    assert said.code == 0
    written = sorted(path.relative_to("again").as_posix() for path in Path("again").rglob("*") if path.is_file())
    assert written == ["glue.mod", "logic.mod", "results/logic.mod", "second/weld.dat", "second/weld.src"]
    assert Path("again/glue.mod").read_bytes() == Path("done/glue.mod").read_bytes()
    assert "line/LOGBOOK.LS: is a controller's report and no program; it is left out" in said.err
    assert "line/weld.jbi: is in INFORM (Yaskawa), which is not read; it is left out" in said.err
    for name in ("glue.mod", "second/weld.src"):
        assert f"line/results/{name}:" in said.err
    assert "says that it was compensated already; this program is left out" in said.err
    assert fastcal("compensate", "real.yaml", "line", *MORE, "-o", "once_more", "--strict").code == 5
