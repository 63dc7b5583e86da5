# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What commands have in common: lists, --quiet, --json, examples in --help, completion, the line on what to do next."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

import fastcal as library
from fastcal import _core, robots
from fastcal.cli.app import COMMANDS, GROUPS, installed
from fastcal.cli.demo import NOISE_MM
from fastcal.cli.manners import EXAMPLES

NAMES = list(COMMANDS)


def help_of(fastcal, *arguments: str) -> str:
    said = fastcal(*arguments, "--help")
    assert said.code == 0
    return str(said.out)


def test_no_summary_of_a_command_is_cut(fastcal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    text = help_of(fastcal)
    lines = dict(re.findall(r"^  (\w+) {2,}(.+)$", text.split("Calibrate:")[1], re.MULTILINE))
    assert list(lines) == [*NAMES, *installed()]
    assert re.findall(r"^(\w+):$", text.split("Options:")[1], re.MULTILINE) == [*GROUPS, "Installed"]
    assert all(line.endswith(".") and not line.endswith("...") for line in lines.values())


@pytest.mark.parametrize("name", NAMES)
def test_help_has_examples_with_options_that_the_command_has(fastcal, name: str) -> None:
    text = help_of(fastcal, name)
    assert "-q, --quiet" in text
    assert "--json" in text
    for example in EXAMPLES[name]:
        assert f"  {example}\n" in text, "cut or wrapped"
        words = shlex.split(example)
        assert words[:2] == ["fastcal", name]
        for option in [word for word in words if word.startswith("-")]:
            assert re.search(rf"(?m)^ +.*{re.escape(option)}\b", text.split("Examples:")[0]), option


@pytest.mark.parametrize("option", ["-V", "--version"])
def test_the_version_is_told(fastcal, option: str) -> None:
    assert fastcal(option).out == f"fastcal {library.__version__}\n"


def test_a_list_of_effects_without_the_geometry_is_taken_as_it_is_and_said(fastcal, demo: Path, tmp_path: Path) -> None:
    arguments = ("calibrate", demo / "robot.yaml", demo / "test.csv", "-o", tmp_path / "out", "--effects")
    ratio = "reduction_ratio@joint2"
    said = fastcal(*arguments, ratio)
    assert f"--effects {ratio} leaves the geometry as ROBOT has it" in said.err
    assert f"write --effects geometry,{ratio}" in said.err
    owners = {entry["owner"] for entry in json.loads((tmp_path / "out" / "result.json").read_text())["parameters"]}
    assert owners == {"base", "tool", "joint2"}
    assert "leaves the geometry" not in fastcal(*arguments, f"geometry,{ratio}").err


def test_robots_lists_what_is_shipped(fastcal) -> None:
    said = fastcal("robots")
    assert [line.split()[0] for line in said.out.splitlines()] == list(robots.available())
    listed = json.loads(fastcal("robots", "--json").out)["robots"]
    assert [entry["name"] for entry in listed] == list(robots.available())
    assert {entry["name"]: entry["joints"] for entry in listed}["lbr_iiwa7"] == 7


def test_effects_lists_what_can_be_named(fastcal) -> None:
    named = [line.split()[0] for line in fastcal("effects").out.splitlines()[:-1]]
    assert named == ["geometry", *_core.effect_names()]
    listed = json.loads(fastcal("effects", "--json").out)["effects"]
    assert [entry["name"] for entry in listed] == named


def test_quiet_and_json(fastcal, demo: Path, tmp_path: Path) -> None:
    arguments = ("calibrate", demo / "robot.yaml", demo / "measurements.csv", "-o", tmp_path / "out")
    said = fastcal(*arguments, "--quiet")
    assert (said.code, said.out) == (0, "")
    said = fastcal(*arguments, "--json")
    assert json.loads(said.out) == json.loads((tmp_path / "out" / "result.json").read_text())
    # The manner of one run is not that of the next.
    assert fastcal(*arguments).out.splitlines()[-1] == str(tmp_path / "out" / "report.html")
    said = fastcal("evaluate", tmp_path / "out" / "model.yaml", demo / "test.csv", "--json")
    assert json.loads(said.out)["count"] == 60


CALLS = {  # arguments besides -o FILE, the ending of FILE, and something that the summary says
    "predict": ("predict MODEL TEST", "csv", {"poses": 60}),
    "predict by nominal": ("predict ROBOT TEST", "csv", {"largest_sigma_mm": None}),
    "simulate": ("simulate ROBOT TEST --noise-mm 0.05 --seed 3", "csv", {"poses": 60, "noise_mm": 0.05, "seed": 3}),
    "convert": ("convert MODEL --to mdh", "yaml", {"from": "dh", "to": "mdh", "robot": "staubli_rx160l"}),
    "convert, dropping": ("convert MODEL --to urdf --drop-effects", "urdf", {"to": "urdf"}),
    "convert to UR's kinematics": ("convert ur5 --to ur_kinematics", "yaml", {"from": "dh", "to": "ur_kinematics"}),
    "template": ("template ur5", "csv", {"columns": [*(f"q{k}_deg" for k in range(1, 7)), "x_mm", "y_mm", "z_mm"]}),
    "check --plan": ("check MODEL --plan 5", "csv", {"poses": 5}),
    "import --print-map": ("import TEST --print-map", "yaml", {}),
}


@pytest.mark.parametrize("call", CALLS)
def test_every_command_has_its_summary_as_json(fastcal, demo: Path, tmp_path: Path, call: str) -> None:
    words, ending, expected = CALLS[call]
    files = {"MODEL": demo / "model.yaml", "ROBOT": demo / "robot.yaml", "TEST": demo / "test.csv"}
    output = tmp_path / f"out.{ending}"
    arguments = [*(files.get(word, word) for word in words.split()), "-o", output]
    said = fastcal(*arguments, "--json")
    assert said.code == 0
    summary = json.loads(said.out)
    assert summary["file"] == str(output)
    assert {key: summary[key] for key in expected} == expected
    assert [f"fastcal: warning: {note}" for note in summary.get("notes", [])] == said.err.splitlines()
    plain = fastcal(*arguments).out
    assert call == "import --print-map" or plain.startswith(f"{output}: ")


def test_a_demonstration_prints_its_result_as_json(fastcal, tmp_path: Path) -> None:
    said = fastcal("demo", "-o", tmp_path / "demo", "--json")
    assert json.loads(said.out) == json.loads((tmp_path / "demo" / "result.json").read_text())


def test_the_last_but_one_line_says_what_to_do_next(fastcal, demo: Path, tmp_path: Path) -> None:
    """The demonstration yields under load: its geometry alone leaves more than noise, with the compliances nothing."""
    robot, data = demo / "robot.yaml", demo / "measurements.csv"
    line = fastcal("calibrate", robot, data, "-o", tmp_path / "a").out.splitlines()[-2]
    assert line.startswith("next: the remaining error is not all noise: it depends on ")
    assert line.endswith(f"find the cause with: fastcal diagnose {robot} {data} -o {tmp_path / 'a'}_diagnosis")
    effects = "geometry,joint_compliance@joint2,joint_compliance@joint3"
    # Nothing but the residuals says how large the noise is: what remains may be all noise, or not.
    line = fastcal("calibrate", robot, data, "--effects", effects, "-o", tmp_path / "b").out.splitlines()[-2]
    assert line.startswith("next: no trend shows in what remains, but neither repeated poses nor a sigma column")
    assert line.endswith(f"look closer with: fastcal diagnose {robot} {data} -o {tmp_path / 'b'}_diagnosis")
    head, *rows = data.read_text().splitlines()
    sure = tmp_path / "sure.csv"
    sure.write_text("\n".join([f"{head},sigma_mm", *(f"{row},{NOISE_MM}" for row in rows)]) + "\n")
    line = fastcal("calibrate", robot, sure, "--effects", effects, "-o", tmp_path / "c").out.splitlines()[-2]
    assert line.startswith("next: what remains looks like noise; check the model on other poses")
    named = ("--effects", effects, "--test", demo / "test.csv", "-o", tmp_path / "d")
    line = fastcal("calibrate", robot, sure, *named).out.splitlines()[-2]
    assert line == "next: what remains looks like noise; the model is ready for fastcal compensate"


def test_the_shell_completes_names_of_arms(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    from fastcal.cli import main

    monkeypatch.setenv("_FASTCAL_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "fastcal calibrate ur1")
    monkeypatch.setenv("COMP_CWORD", "2")
    with pytest.raises(SystemExit) as end:
        main([])
    assert end.value.code == 0
    assert {"ur10", "ur10e", "ur16e"} <= set(capsys.readouterr().out.split())
