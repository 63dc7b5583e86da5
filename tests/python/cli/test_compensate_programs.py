# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compensate` on robot programs, as a process: a program in, the same program for the real robot out."""

import json
from pathlib import Path

import numpy as np
import pytest

import fastcal as library
from fastcal.programs import read_program, stamp

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
    before = read_program(programs[language])
    assert stamp.stamped_line(read_program(written)) is not None
    bare = stamp.stamped(read_program(written).documents, language, None)
    after = read_program({document.name: document.text.encode("latin-1") for document in bare})
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
            "t.csv: --cell, --payload-kg, --temperature-c, --again and --strict are for robot",
        ),
    ],
)
def test_wrong_usage_is_one_line(cell, fastcal, monkeypatch, arguments, sentence) -> None:
    monkeypatch.chdir(cell)
    (cell / "bad.yaml").write_text("tools: {'1': {xzy_mm: [1, 2, 3]}}\n")
    said = fastcal("compensate", "siasun_sr210d_real.yaml", *arguments)
    assert said.code == 2
    assert said.error.startswith(sentence)


def test_without_an_option_the_payload_is_the_programs_own(fastcal, programs, tmp_path, monkeypatch) -> None:
    """As the studio does; a cell file knows masses that the program only names."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1790000000")
    monkeypatch.chdir(tmp_path)
    yields = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 4e-6}}
    library.perturbed(library.load_robot("ur5").with_(effects=[yields]), seed=3).save("real.yaml")
    Path("p.script").write_bytes(programs["URScript"]["palletize.script"])
    common = ("compensate", "real.yaml", "p.script", "--nominal", "ur5")
    said = fastcal(*common, "-o", "own.script", "--json")
    assert json.loads(said.out)["payloads_kg"] == [2.35]
    assert "fastcal: warning: payload as the program states it: 2.35 kg" in said.err
    for payload in ("2.35", "0"):
        assert fastcal(*common, "--payload-kg", payload, "-o", f"{payload}.script").code == 0
    assert Path("own.script").read_bytes() == Path("2.35.script").read_bytes() != Path("0.script").read_bytes()
    Path("q.src").write_text("DEF q()\nBAS(#TOOL,2)\nPTP {A1 0,A2 -60,A3 80,A4 0,A5 30,A6 0}\nEND\n")
    Path("cell.yaml").write_text("loads: {'2': {mass_g: 4500}}\n")
    common = ("compensate", "real.yaml", "q.src", "--nominal", "ur5", "--cell", "cell.yaml")
    said = fastcal(*common, "-o", "r.src", "--json")
    assert json.loads(said.out)["payloads_kg"] == [pytest.approx(4.5)]
    Path("cell.yaml").write_text("loads: {'2': {mass_kg: -1}}\n")
    said = fastcal(*common, "-o", "s.src")
    assert said.error.startswith("cell.yaml: loads.2.mass_kg: expected a mass of 0 or more, got -1")


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


SCRIPT = """def a():
  set_tcp(p[0, 0, 0.1, 0, 0, 0])
  movej([0, -1.2, 1.3, -1.6, -1.5, 0])
  movel(p[-0.4, -0.2, 0.3, 0, 3.14, 0])
  movel(p[-0.4, -0.2, 0.3 + h, 0, 3.14, 0])
end
"""


def test_a_program_is_not_compensated_twice(cell, fastcal, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.script").write_text(SCRIPT)
    arm = (cell / "ur5_real.yaml",)
    assert fastcal("compensate", *arm, "a.script", "--nominal", "ur5", "-o", "b.script").code == 0
    twice = ("compensate", *arm, "b.script", "--nominal", "ur5", "-o", "c.script")
    said = fastcal(*twice)
    assert said.code == 2
    assert said.error == (
        "b.script:2: this program says that it was compensated already; --again compensates it once more, --inverse "
        "brings it back"
    )
    assert not Path("c.script").exists()
    assert fastcal(*twice, "--again").code == 0
    assert fastcal(*twice[:-1], "back.script", "--inverse").code == 0
    assert Path("back.script").read_text().count("fastcal") == 0
    assert Path("c.script").read_text().count("fastcal compensated") == 1


def test_what_is_left_is_said_and_strict_fails(cell, fastcal, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.script").write_text(SCRIPT)
    given = ("compensate", cell / "ur5_real.yaml", "a.script", "--nominal", "ur5", "-o", "b.script")
    said = fastcal(*given)
    assert said.code == 0
    assert "a.script:5: movel is left as it is: 0.3 + h is no plain number" in said.err
    assert fastcal(*given, "--strict").code == 5
    assert "0.3 + h" in Path("b.script").read_text()
    Path("a.script").write_text(SCRIPT.replace(" + h", ""))
    assert fastcal(*given, "--strict").code == 0


def test_another_maker_s_language_is_a_warning(cell, fastcal, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.src").write_text("DEF A()\nPTP {A1 0,A2 -70,A3 70,A4 0,A5 40,A6 0}\nEND\n")
    said = fastcal("compensate", cell / "ur5_real.yaml", "a.src", "--nominal", "ur5", "-o", "b.src")
    assert said.code == 0
    assert "the arm ur5 speaks URScript, and this program is in KRL" in said.err


@pytest.mark.parametrize("ending", ["jbi", "pgx", "as", "pcs", "drl", "mb5", "pdl", "kl", "tp", "urp"])
def test_a_language_that_is_not_read_is_refused_by_name(cell, fastcal, tmp_path, monkeypatch, ending) -> None:
    name = f"a.{ending}"
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(b"NOP\n\xff\x00")
    said = fastcal("compensate", cell / "ur5_real.yaml", name, "-o", f"b{name[1:]}")
    assert said.code == 2
    assert said.error.startswith(f"{name}: is in ")
    assert said.error.endswith("programs are read in RAPID (ABB), KRL (KUKA), FANUC LS and URScript (Universal Robots)")


def test_melfa_is_told_from_rapid_by_its_lines(cell, fastcal, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.prg").write_text("1 Servo On\n2 Mov P1\n3 End\n")
    said = fastcal("compensate", cell / "ur5_real.yaml", "a.prg", "-o", "b.prg")
    assert said.error.startswith("a.prg: is in MELFA BASIC (Mitsubishi)")
