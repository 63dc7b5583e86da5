# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects and commands of an installed package are found by their entry points, and what cannot be loaded is named."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import fastcal as library

SOURCE = Path(library.__file__).parents[1]
MODULE = '''
import typer
import numpy as np
import fastcal

def effects():
    def basis(states):
        xi = np.zeros((len(states.q), 6, 1))
        xi[:, 5, 0] = states.q[:, 3]
        return xi
    fastcal.register_effect("hose", owners=["joint4"], parameters=[("pull", "rad", 1e-4, "turn a radian")], basis=basis)

def greet(name: str) -> None:
    """Greet a robot.

    At length.
    """
    from fastcal.cli.console import emit, say
    say(f"hello {name}")
    emit({"greeted": name})

greet.examples = ("fastcal greet ur5",)
'''
Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def package(tmp_path: Path) -> Callable[[str], Run]:
    """Installs a package with these entry points; gives a function that runs fastcal with it."""

    def install(points: str) -> Run:
        (tmp_path / "hoses.py").write_text(MODULE)
        info = tmp_path / "hoses-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: hoses\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(points)
        environment = {**os.environ, "PYTHONPATH": f"{SOURCE}{os.pathsep}{tmp_path}"}

        def run(*arguments: object) -> subprocess.CompletedProcess[str]:
            command = [sys.executable, "-m", "fastcal", *map(str, arguments)]
            return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

        return run

    return install


BOTH = "[fastcal.effects]\nhose = hoses:effects\n\n[fastcal.commands]\ngreet = hoses:greet\n"


def test_an_installed_effect_is_listed_and_calibrated(package: Callable[[str], Run], tmp_path: Path) -> None:
    run = package(BOTH)
    listed = json.loads(run("effects", "--json").stdout)["effects"]
    assert "hose" in [entry["name"] for entry in listed]
    robot = library.load_robot("ur5")
    poses = library.random_poses(robot, 40, seed=2)
    data = library.simulate(library.perturbed(robot, seed=1), poses, noise=3e-5, seed=3)
    library.write_measurements(tmp_path / "m.csv", data, robot.joint_types)
    done = run("calibrate", "ur5", "m.csv", "--effects", "geometry,hose", "-o", "out")
    assert done.returncode == 0, done.stderr
    owners = [p["owner"] for p in json.loads((tmp_path / "out" / "result.json").read_text())["parameters"]]
    assert "joint4" in owners
    assert "hose" in (tmp_path / "out" / "model.yaml").read_text()
    # The model is of use in the next process without a line of Python.
    assert run("predict", "out/model.yaml", "m.csv", "-o", "p.csv").returncode == 0


def test_an_installed_command_has_the_manners_of_all(package: Callable[[str], Run]) -> None:
    run = package(BOTH)
    assert run("greet", "ur5").stdout == "hello ur5\n"
    assert json.loads(run("greet", "ur5", "--json").stdout) == {"greeted": "ur5"}
    assert run("greet", "ur5", "--quiet").stdout == ""
    assert "  fastcal greet ur5\n" in run("greet", "--help").stdout
    listed = run("--help").stdout
    assert "Installed:\n  greet       Greet a robot.\n" in listed


def test_what_cannot_be_loaded_is_one_line_that_names_it(package: Callable[[str], Run]) -> None:
    run = package("[fastcal.effects]\nhose = hoses:nothing\n\n[fastcal.commands]\ngreet = hoses:nothing\n")
    for arguments, said in (
        (("effects",), "the effects of the installed package that offers 'hoses:nothing'"),
        (("greet", "ur5"), "the installed command 'greet' (hoses:nothing) cannot be loaded"),
    ):
        done = run(*arguments)
        assert done.returncode == 2
        assert said in done.stderr
        assert done.stderr.count("\n") == 1
    # Effects of fastcal's own need no package.
    assert run("template", "ur5", "-o", "t.csv").returncode == 0


def test_no_package_takes_the_name_of_a_command(package: Callable[[str], Run]) -> None:
    run = package("[fastcal.commands]\ncalibrate = hoses:greet\n")
    assert "Identify a robot from measured poses." in run("calibrate", "--help").stdout
