# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compensate` on robot programs, as a process: a program in, the same program for the real robot out."""

from pathlib import Path

import numpy as np
import pytest

import fastcal as library
from fastcal.programs import read_program

CELL = """\
tools: {"1": {xyz_mm: [20, 0, 200], rpy_deg: [0, 10, 0]}}
frames: {"1": {xyz_mm: [1750, -150, 820]}}
"""
ARMS = {"RAPID": "siasun_sr210d", "KRL": "siasun_sr210d", "FANUC LS": "siasun_sr210d", "URScript": "ur5"}


@pytest.fixture(scope="module")
def cell(tmp_path_factory, programs) -> Path:
    """A folder with the programs, a cell file and a real arm of each kind."""
    folder = tmp_path_factory.mktemp("cell")
    for files in programs.values():
        for name, content in files.items():
            (folder / name).write_bytes(content)
    (folder / "cell.yaml").write_text(CELL)
    for name in set(ARMS.values()):
        library.perturbed(library.load_robot(name), seed=3).save(folder / f"{name}_real.yaml")
    return folder


@pytest.mark.parametrize("language", ARMS)
def test_a_program_goes_in_and_a_program_comes_out(programs, cell, process, tmp_path, language) -> None:
    names = list(programs[language])
    first, arm = Path(names[0]), ARMS[language]
    said = process(
        *("compensate", f"{arm}_real.yaml", first, "--nominal", arm, "--cell", "cell.yaml", "--payload-kg", 5),
        *("-o", tmp_path / f"new{first.suffix}"),
        cwd=cell,
    )
    assert said.code == 0, said.err
    written = {name: (tmp_path / f"new{Path(name).suffix}").read_bytes() for name in names}
    before, after = read_program(programs[language]), read_program(written)
    assert said.out.startswith(f"{language}: {len(before.targets)} targets changed")
    assert [t.name for t in after.targets] == [t.name for t in before.targets]
    for old, new in zip(before.targets, after.targets, strict=True):
        shift = np.abs(new.values - old.values)
        assert 0 < np.minimum(shift, np.abs(shift - 2 * np.pi)).max() < 0.02  # an angle may go from 180 to -180
    for a, b in zip(before.documents, after.documents, strict=True):
        assert a.text.count("\n") == b.text.count("\n")
        assert a.text.count("\r") == b.text.count("\r")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(f"new{Path(name).suffix}" for name in names)


def test_a_tool_that_is_not_in_the_program_is_not_guessed(cell, process, tmp_path) -> None:
    target = "[[1800,0,1300],[0,0,1,0],[0,0,1,1],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    (tmp_path / "a.mod").write_text(f"MODULE a\nMoveJ {target},v100,fine,tX;\nENDMODULE\n")
    model = ("compensate", cell / "siasun_sr210d_real.yaml", "a.mod", "--nominal", "siasun_sr210d", "-o", "b.mod")
    said = process(*model, cwd=tmp_path)
    assert said.code == 2
    assert "a.mod:2: the target of line 2 is left as it is: tool tX is not in the program; a cell file can" in said.err
    assert not (tmp_path / "b.mod").exists()
    (tmp_path / "cell.yaml").write_text("tools: {tX: {xyz_mm: [0, 0, 10]}}\n")
    said = process(*model, "--cell", "cell.yaml", cwd=tmp_path)
    assert said.code == 0, said.err


@pytest.mark.parametrize(
    ("name", "old", "new", "sentence"),
    [
        (
            "glue.mod",
            b"[120.25,40,150]",
            b"[9120,40,150]",
            "glue.mod:11: pApproach: for the nominal robot the target is out",
        ),
        ("PICK.LS", b"/POS", b"/POT", "PICK.LS:1: expected a section /POS"),
    ],
)
def test_one_bad_line_is_named_and_nothing_is_written(
    cell, programs, fastcal, tmp_path, monkeypatch, name, old, new, sentence
) -> None:
    monkeypatch.chdir(tmp_path)
    for files in programs.values():
        if name in files:
            for other, content in files.items():
                (tmp_path / other).write_bytes(content.replace(old, new, 1))
    before = sorted(tmp_path.iterdir())
    out = f"out{Path(name).suffix}"
    arguments = ("compensate", cell / "siasun_sr210d_real.yaml", name, "--nominal", "siasun_sr210d", "-o", out)
    said = fastcal(*arguments)
    assert said.code == 2
    assert said.error.startswith(sentence)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("glue.mod", "-o", "out.src"), "out.src: a .mod program stays one; give a name that ends in .mod"),
        (("none.mod", "-o", "out.mod"), "none.mod: there is no such file"),
        (
            ("glue.mod", "--cell", "bad.yaml", "-o", "out.mod"),
            "bad.yaml: tools.1: the key 'xzy_mm' is not known; did you",
        ),
        (
            ("t.csv", "--payload-kg", "5", "-o", "out.csv"),
            "t.csv: --cell, --payload-kg and --temperature-c are for robot",
        ),
    ],
)
def test_wrong_usage_is_one_line(cell, fastcal, monkeypatch, arguments, sentence) -> None:
    monkeypatch.chdir(cell)
    (cell / "bad.yaml").write_text("tools: {'1': {xzy_mm: [1, 2, 3]}}\n")
    said = fastcal("compensate", "siasun_sr210d_real.yaml", *arguments)
    assert said.code == 2
    assert said.error.startswith(sentence)


def test_a_calibrated_model_knows_its_controller_s_robot(demo, process, tmp_path) -> None:
    """Without --nominal: the geometry that the calibration began with is kept in model.yaml."""
    model, nominal = library.load_robot(demo / "model.yaml"), library.load_robot(demo / "robot.yaml")
    q = np.radians([[10.0, 20.0, 60.0, 5.0, 40.0, -15.0]])
    row = ",".join(repr(float(v)) for v in np.degrees(q[0]))
    nines = ",".join(["9E9"] * 6)
    (tmp_path / "a.mod").write_text(f"MODULE a\nMoveAbsJ [[{row}],[{nines}]],v100,fine,tool0;\nENDMODULE\n")
    assert process("compensate", demo / "model.yaml", "a.mod", "-o", "b.mod", cwd=tmp_path).code == 0
    command = read_program({"b.mod": (tmp_path / "b.mod").read_bytes()}).targets[0].values
    # The flange of the identified arm, in its own base, is where the nominal one's was.
    goal, got = (flange(robot, joints) for robot, joints in ((nominal, q), (model, command)))
    assert np.linalg.norm(got - goal) < 1e-6
    assert np.linalg.norm(flange(model, q) - goal) > 1e-4


def flange(robot: library.Robot, q) -> np.ndarray:
    T_world_base, T_flange_tool = robot.core.base_and_tool(robot.core.nominal)
    return (np.linalg.inv(T_world_base) @ robot.forward(q)[0] @ np.linalg.inv(T_flange_tool))[:3, 3]
