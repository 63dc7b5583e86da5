# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""No command writes over what it reads; nothing that a file holds moves the terminal's cursor."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fastcal as fc

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
