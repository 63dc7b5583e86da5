# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`design` and `check --plan` end with a program in the arm's language beside the table: the same joints in both."""

from pathlib import Path

import numpy as np
import pytest

import fastcal as library
from fastcal.io.programs import load_program
from fastcal.programs.measuring import LANGUAGES, language_for

FEW = ("--candidates", "random", "--candidate-count", 600)


def driven(path: Path, arm: library.Robot) -> np.ndarray:
    """The joints of the program's moves, as the chain has them."""
    program = load_program(path)
    assert program.notes == ()
    return arm.pendant.chain(np.array([program.targets[move.target].values for move in program.moves]))


@pytest.mark.parametrize("name", ["abb_irb1200_5_90", "kuka_kr6_r900", "fanuc_lrmate200id", "ur5e"])
def test_a_design_is_driven_by_the_arms_own_program(name, tmp_path, fastcal) -> None:
    out = tmp_path / "poses-2.csv"
    said = fastcal("design", name, "--count", 12, *FEW, "-o", out)
    assert said.code == 0
    suffix = LANGUAGES[language_for(name)][0]
    program = tmp_path / f"poses_2{suffix}"
    assert f"program: {program}" in said.out
    arm = library.load_robot(name)
    table = library.load_measurements(out, arm, require_measured=False)
    assert ("j1_deg" in out.read_text()) == ("fanuc" in name)
    way = driven(program, arm)  # one run-up, to the first pose
    np.testing.assert_allclose(way[1:], table.q, atol=1e-8)
    np.testing.assert_allclose(way[0], way[1] - np.radians(2) * table.approach[0], atol=2e-5)
    assert fastcal("design", name, "--count", 12, *FEW, "-o", out).code == 0  # its own program may be replaced


def test_the_poses_of_a_check_are_driven_too(tmp_path, fastcal) -> None:
    arm = library.load_robot("fanuc_lrmate200id")
    data = library.simulate(arm, library.random_poses(arm, 40, seed=1), noise=2e-5, seed=2)
    library.calibrate(arm, data).model.save(tmp_path / "model.yaml")
    said = fastcal("check", tmp_path / "model.yaml", "--plan", 6, "-o", tmp_path / "month.csv")
    assert said.code == 0, said.err
    table = library.load_measurements(tmp_path / "month.csv", arm, require_measured=False)
    np.testing.assert_allclose(driven(tmp_path / "month.ls", arm), table.q, atol=1e-8)
    options = ("--language", "rapid", "--dwell-s", 4, "--speed-percent", 10)
    said = fastcal("check", tmp_path / "model.yaml", "--plan", 6, *options, "-o", tmp_path / "month.csv")
    text = (tmp_path / "month.mod").read_text()
    assert "VelSet 10,5000" in text
    assert text.count("WaitTime \\InPos,4;") == 6
    assert fastcal("check", tmp_path / "model.yaml", "--language", "krl").error == "--language goes with --plan"


def test_touches_are_left_to_the_hand(tmp_path, fastcal) -> None:
    (tmp_path / "shop.yaml").write_text("planes: {table: {point_mm: [500, 0, 200], normal: [0, 0, 1]}}\n")
    options = ("--instruments", tmp_path / "shop.yaml", "-o", tmp_path / "poses.csv")
    said = fastcal("design", "ur5e", "--count", 20, *FEW, *options)
    arm = library.load_robot("ur5e")
    table = library.load_measurements(tmp_path / "poses.csv", arm, require_measured=False)
    touching = table.label_codes("plane")[0] >= 0
    assert 0 < touching.sum() < 20
    assert f"not in the program: poses that touch a plane, {touching.sum()}; drive to them by hand" in said.out
    way = driven(tmp_path / "poses.script", arm)
    for q in table.q[~touching]:
        assert np.abs(way - q).max(axis=1).min() < 1e-8
    for q in table.q[touching]:
        assert np.abs(way - q).max(axis=1).min() > 1e-4


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("spray_7dof",), 0, "which language spray_7dof speaks is not known"),
        (("staubli_rx160l",), 0, "staubli_rx160l speaks VAL3; --language rapid, krl, fanuc or urscript writes one"),
        (("lbr_iiwa7", "--language", "krl"), 2, "this robot has 7 joints"),
        (("ur5e", "--language", "none"), 0, ""),
        (("ur5e", "-o", "poses.script"), 2, "expected the name of a table, such as poses.csv"),
        (("ur5e", "-o", "mine.csv"), 2, "mine.script: is there and was not written by this command"),
        (("ur5e", "-o", "poses.xlsx"), 2, "only CSV can be written"),
    ],
)
def test_where_no_program_is_written_a_sentence_says_why(
    tmp_path, fastcal, monkeypatch, arguments, code: int, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.script").write_text("def mine():\nend\n")
    output = () if "-o" in arguments else ("-o", "poses.csv")
    found = fastcal("design", *arguments, "--count", 12, *FEW, *output)
    assert found.code == code
    assert said in (found.out if code == 0 else found.error)
    assert {path.name for path in tmp_path.iterdir()} == {"mine.script", *(["poses.csv"] if code == 0 else [])}
