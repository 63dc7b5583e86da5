# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every instruction set gives the same answers; FASTCAL_ISA forces each that the processor has."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SETS = ["baseline", "avx2", "avx512"]

# Kinematics, an identification with its standard deviations, inverse kinematics and beams, through the public calls.
WORK = """
import sys
import numpy as np
import fastcal
from fastcal import _core

robot = fastcal.load_robot("staubli_rx160l")
truth = fastcal.perturbed(robot, seed=1)
q = fastcal.random_poses(robot, 203, seed=2)
data = fastcal.simulate(truth, q, noise=5e-5, seed=3)
found = fastcal.calibrate(robot, data, effects=["geometry", "joint_compliance"])
beams = fastcal.load_robot("spray_7dof")
straight = fastcal.random_poses(robot, 500, seed=3)
straight[:, 4] = 1e-8
anywhere = fastcal.random_poses(robot, 500, seed=5)
np.savez(
    sys.argv[1],
    used=_core.instruction_set(),
    poses=truth.forward(q),
    jacobian=truth.parameter_jacobian(q[:20], rows=6),
    values=[p.value for p in found.parameters],
    std=[p.bound.std if p.bound else p.std for p in found.parameters],
    reached=truth.forward(fastcal.inverse_kinematics(truth, robot.forward(q[:40]), q[:40]).q),
    bent=beams.forward(fastcal.random_poses(beams, 10, seed=4)),
    singular=fastcal.inverse_kinematics(robot, robot.forward(straight), anywhere).reached,
)
"""


def run(set_name: str, path: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "FASTCAL_ISA": set_name}
    return subprocess.run(
        [sys.executable, "-c", WORK, str(path)], env=environment, check=False, capture_output=True, text=True
    )


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, np.ndarray]]:
    """By instruction set, those that this processor has."""
    folder = tmp_path_factory.mktemp("sets")
    found = {}
    for name in SETS:
        path = folder / f"{name}.npz"
        done = run(name, path)
        if "FASTCAL_ISA" in done.stderr:
            continue  # not on this processor
        assert done.returncode == 0, done.stderr
        with np.load(path) as arrays:
            found[name] = dict(arrays)
    return found


def test_the_forced_set_is_the_one_that_runs(answers: dict[str, dict[str, np.ndarray]]) -> None:
    assert "baseline" in answers
    assert {name: str(answer["used"]) for name, answer in answers.items()} == {name: name for name in answers}


@pytest.mark.skipif(not Path("/proc/cpuinfo").is_file(), reason="needs Linux")
def test_the_widest_set_is_what_the_system_says_of_the_processor() -> None:
    """A wheel linked with a runtime that finds no features ran the baseline on every processor, without a word."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    flags = next((set(line.split()) for line in lines if line.startswith("flags")), set())
    if not flags:
        pytest.skip("not x86")
    wide = {"avx512": {"avx512f", "avx512dq", "avx512vl", "fma"}, "avx2": {"avx2", "fma"}}
    expected = next((name for name, needed in wide.items() if needed <= flags), "baseline")
    environment = {name: value for name, value in os.environ.items() if name != "FASTCAL_ISA"}
    command = [sys.executable, "-c", "from fastcal import _core; print(_core.instruction_set())"]
    found = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout.strip()
    assert found == expected


def test_no_answer_depends_on_the_set(answers: dict[str, dict[str, np.ndarray]]) -> None:
    base = answers["baseline"]
    for answer in answers.values():
        np.testing.assert_allclose(answer["poses"], base["poses"], atol=1e-14)
        np.testing.assert_allclose(answer["jacobian"], base["jacobian"], atol=1e-13)
        np.testing.assert_allclose(answer["reached"], base["reached"], atol=2e-9)  # both are at the targets to 1e-9
        np.testing.assert_allclose(answer["bent"], base["bent"], atol=1e-12)
        assert answer["singular"].all()  # the baseline set once missed 1 % of these
        assert np.max(np.abs(answer["values"] - base["values"]) / base["std"]) < 1e-9


def test_a_set_that_is_not_there_is_refused(tmp_path: Path) -> None:
    done = run("mmx", tmp_path / "none.npz")
    assert done.returncode != 0
    assert "FASTCAL_ISA must be baseline, avx2 or avx512, as far as the processor has them, got mmx" in done.stderr
