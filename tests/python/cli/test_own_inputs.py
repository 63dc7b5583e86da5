# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""No command writes over what it reads; nothing that a file holds moves the terminal's cursor."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal as fc
from fastcal.conversion import convert
from fastcal.io.robot_file import read_spec, write_spec

DATA = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,qw,qx,qy,qz\n10,-50,60,20,70,30,400,300,500,1,0,0,0\n"
PROGRAM = "MODULE m\nENDMODULE\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a model, data, and other names of both."""
    monkeypatch.chdir(tmp_path)
    fc.load_robot("ur5").save("model.yaml")
    Path("data.csv").write_text(DATA)
    Path("prog.mod").write_text(PROGRAM)
    Path("sub").mkdir()
    Path("link.csv").symlink_to("data.csv")
    os.link("data.csv", "twin.csv")
    Path("out").mkdir()
    fc.load_robot("ur5").save("out/model.yaml")
    return tmp_path


RUNS = [
    *(
        ("predict", "model.yaml", "data.csv", "-o", to)
        for to in ("data.csv", "sub/../data.csv", "link.csv", "twin.csv")
    ),
    ("predict", "model.yaml", "link.csv", "-o", "data.csv"),
    ("predict", "model.yaml", "data.csv", "-o", "model.yaml"),
    ("evaluate", "model.yaml", "data.csv", "-o", "data.csv"),
    ("simulate", "model.yaml", "data.csv", "-o", "data.csv"),
    ("convert", "model.yaml", "--to", "mdh", "-o", "model.yaml"),
    ("compensate", "model.yaml", "data.csv", "-o", "data.csv"),
    ("compensate", "model.yaml", "prog.mod", "-o", "prog.mod"),
    ("compensate", "model.yaml", "data.csv", "--path", "line", "-o", "c.csv", "--report", "data.csv"),
    ("compensate", "model.yaml", "data.csv", "--nominal", "out/model.yaml", "-o", "out/model.yaml"),
    ("design", "model.yaml", "--count", "9", "--measured", "data.csv", "-o", "data.csv"),
    ("calibrate", "out/model.yaml", "data.csv", "-o", "out"),
    ("diagnose", "out/model.yaml", "data.csv", "-o", "./out/"),
    ("train", "out/model.yaml", "data.csv", "-o", "out"),
]


@pytest.mark.parametrize("run", RUNS, ids=lambda run: " ".join(run))
def test_an_output_that_is_an_input_is_refused(run: tuple[str, ...], here: Path, fastcal: Callable[..., Any]) -> None:
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    said = fastcal(*run)
    assert said.code == 2
    assert "is an input of this command; choose another output" in said.error
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before


def test_what_a_model_names_is_an_input_too(here: Path, fastcal: Callable[..., Any]) -> None:
    Path("arm.urdf").write_text("<robot/>")
    Path("named.yaml").write_text("kinematics: urdf\nurdf: arm.urdf\n")
    said = fastcal("convert", "named.yaml", "--to", "urdf", "-o", "arm.urdf")
    assert said.code == 2
    assert "arm.urdf: is an input" in said.error


def test_other_places_are_written(here: Path, fastcal: Callable[..., Any]) -> None:
    assert fastcal("predict", "out/model.yaml", "data.csv", "-o", "out/data.csv").code == 0
    assert fastcal("predict", "out/model.yaml", "data.csv", "-o", "out/data.csv").code == 0


@pytest.mark.parametrize("name", ["\x1b]0;title\x07", "\x9b2J", "a\u202eb", "line\rover"])
def test_control_characters_are_written_out(name: str, here: Path, fastcal: Callable[..., Any]) -> None:
    Path(f"{name}.csv").write_text(DATA.replace("qz", f"qz,{name}", 1).replace(",0\n", ",0,1\n"))
    runs = [
        ("predict", "model.yaml", f"{name}.csv", "-o", "p.csv"),
        ("evaluate", "model.yaml", f"{name}.csv"),
        ("predict", "model.yaml", f"no{name}.csv", "-o", "p.csv"),
        (name,),
    ]
    for run in runs:
        said = fastcal(*run)
        assert not set(said.out + said.err) & set("\x1b\x07\x9b\u202e\r")


def unchanged(here: Path, code: int, run: Callable[[], Any]) -> str:
    """What a command says that refuses, with nothing changed in the folder."""
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    said = run()
    assert said.code == code
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before
    assert "is an input of this command; choose another output" in said.error
    return str(said.error)


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize(
    ("rows", "name"),
    [
        (["ur5,../data.csv,one"], "fleet.csv"),
        (["one/model.yaml,../data.csv,one"], "model.yaml"),
        (["ur5,../data.csv,two", "ur5,one/result.json,one"], "result.json"),
    ],
)
def test_a_fleet_keeps_its_list_and_what_that_names(
    rows: list[str], name: str, jobs: int, here: Path, fastcal: Callable[..., Any]
) -> None:
    (here / "F" / "one").mkdir(parents=True)
    listed = Path("F", "fleet.csv" if name == "fleet.csv" else "list.csv")
    listed.write_text("\n".join(["robot,data,name", *rows]) + "\n")
    fc.load_robot("ur5").save("F/one/model.yaml")
    (here / "F" / "one" / "result.json").write_text(DATA)
    said = unchanged(here, 2, lambda: fastcal("fleet", listed, "-o", "F", "--jobs", jobs))
    assert said.startswith(str(Path("F", *(["one"] if name != "fleet.csv" else []), name)))


def test_a_fleet_may_be_run_again_into_its_own_folder(here: Path, fastcal: Callable[..., Any]) -> None:
    rng = np.random.default_rng(0)
    robot = fc.load_robot("ur5")
    data = fc.simulate(robot, rng.uniform(-2, 2, (40, 6)), noise=1e-5, seed=1)
    fc.write_measurements("data.csv", data, robot.joint_types)
    Path("list.csv").write_text("robot,data\nur5,data.csv\n")
    assert fastcal("fleet", "list.csv", "-o", "F").code == 0
    fc.write_measurements("data.csv", data.select(np.arange(30)), robot.joint_types)
    assert fastcal("fleet", "list.csv", "-o", "F").code == 0


def test_the_dat_that_belongs_to_a_program_is_kept(here: Path, fastcal: Callable[..., Any]) -> None:
    """weld.SRC would write weld.dat, which is read with weld.src."""
    source = Path(__file__).parents[1] / "data" / "programs"
    for ending in ("src", "dat"):
        (here / f"weld.{ending}").write_bytes((source / f"weld.{ending}").read_bytes())
    said = unchanged(here, 2, lambda: fastcal("compensate", "model.yaml", "weld.src", "-o", "weld.SRC"))
    assert said.startswith("weld.dat")


@pytest.mark.parametrize("link", [Path.symlink_to, Path.hardlink_to])
def test_a_result_that_links_to_an_input_is_kept(link: Any, here: Path, fastcal: Callable[..., Any]) -> None:
    (here / "out" / "model.yaml").unlink()
    link(here / "out" / "model.yaml", here / "data.csv")
    unchanged(here, 2, lambda: fastcal("calibrate", "model.yaml", "data.csv", "-o", "out"))


def test_what_another_file_names_is_an_input(here: Path, fastcal: Callable[..., Any]) -> None:
    """The URDF of a robot file is on no command line."""
    (here / "parts").mkdir()
    write_spec(convert(read_spec("ur5"), "urdf").spec, here / "parts" / "arm.urdf")
    (here / "robot.yaml").write_text("kinematics: urdf\nurdf: parts/arm.urdf\n")
    unchanged(here, 2, lambda: fastcal("convert", "robot.yaml", "--to", "urdf", "-o", "parts/arm.urdf"))


def test_a_program_may_load_and_save_one_file(here: Path) -> None:
    """Only a command keeps what it reads; who writes Python decides."""
    fc.load_robot("model.yaml").save("model.yaml")
    assert fc.load_robot("model.yaml").joint_count == 6
