# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which modules a command loads: half of a short command's time was imports that it did not need."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fastcal

# Each takes a tenth of a second or more.
HEAVY = {"scipy.stats", "scipy.spatial", "scipy.optimize", "scipy.special", "scipy.linalg", "scipy.signal", "pyarrow"}
HEAVY |= {"pandas", "openpyxl", "torch", "sklearn", "joblib"}

PROBE = """
import sys
from fastcal.cli import main
sys.argv = ["fastcal", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(*sorted(sys.modules), file=open("modules.txt", "w"))
"""


def loaded(folder: Path, *arguments: str) -> set[str]:
    subprocess.run([sys.executable, "-c", PROBE, *arguments], cwd=folder, check=True, capture_output=True)
    return set((folder / "modules.txt").read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a robot file, measurements and a model."""
    path = tmp_path_factory.mktemp("imports")
    robot = fastcal.load_robot("staubli_rx160l")
    robot.save(path / "robot.yaml")
    data = fastcal.simulate(
        fastcal.perturbed(robot, seed=1), fastcal.random_poses(robot, 40, seed=2), noise=5e-5, seed=3
    )
    fastcal.write_measurements(path / "data.csv", data)
    drifting = np.array(data.position) + 2e-4 * np.sin(np.linspace(0, 6, 40))[:, np.newaxis]
    fastcal.write_measurements(
        path / "drifting.csv", fastcal.Dataset.from_arrays(data.q, position=drifting, robot=robot)
    )
    fastcal.calibrate(robot, data).model.save(path / "model.yaml")
    return path


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["calibrate", "robot.yaml", "data.csv", "-o", "out"],
        ["predict", "model.yaml", "data.csv", "-o", "predicted.csv"],
        ["evaluate", "model.yaml", "data.csv"],
        ["convert", "robot.yaml", "--to", "poe", "-o", "poe.yaml"],
    ],
    ids=lambda arguments: arguments[0].strip("-"),
)
def test_a_command_loads_only_what_it_needs(folder: Path, arguments: list[str]) -> None:
    assert loaded(folder, *arguments) & HEAVY == set()


def test_noise_with_a_memory_needs_no_spectra_of_scipy(folder: Path) -> None:
    seen = loaded(folder, "calibrate", "robot.yaml", "drifting.csv", "-o", "drifted")
    assert "the noise drifts" in (folder / "drifted" / "result.json").read_text(encoding="utf-8")
    assert "scipy.fft" not in seen


@pytest.mark.parametrize(
    "arguments",
    [
        ["diagnose", "robot.yaml", "data.csv", "-o", "diagnosis"],
        ["check", "model.yaml", "data.csv"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_summary_needs_no_tables(folder: Path, arguments: list[str]) -> None:
    assert not loaded(folder, *arguments) & {"pandas", "pyarrow", "openpyxl"}


def test_the_help_loads_no_arrays_and_a_command_no_other_command(folder: Path) -> None:
    assert not loaded(folder, "--help") & {"numpy", "pydantic"}
    seen = loaded(folder, "predict", "model.yaml", "data.csv", "-o", "predicted.csv")
    assert "fastcal.cli.models" in seen
    assert not seen & {"fastcal.cli.calibrate", "fastcal.cli.compensate", "fastcal.report", "asyncio"}


def test_a_measurement_file_needs_no_dialect(folder: Path) -> None:
    seen = loaded(folder, "evaluate", "model.yaml", "data.csv")
    assert not seen & {"fastcal.importers.words", "fastcal.importers.rosbag"}


def test_the_probe_sees_a_heavy_module(folder: Path) -> None:
    rivals = "joint_compliance@joint2,joint_compliance@joint3"
    chosen = ["--count", "12", "--candidate-count", "64", "--separate", rivals, "--payload-kg", "0,10", "-o", "p.csv"]
    assert "scipy.stats" in loaded(folder, "design", "robot.yaml", *chosen)
