# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A simulated project, which says so: an arm, a tracker's list and a controller's log of it, a program, a fleet."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import fastcal
from fastcal.errors import InvalidInput
from fastcal.io.atomic import write_text
from fastcal.io.tables import write_csv
from fastcal.studio.project import ANSWERS, COMMANDS, Project
from fastcal.units import from_si

ARM = "ur5e"
HEAD = "# A simulation by fastcal studio --demo: no real arm was measured.\n"
ROWS, FLEET = 60, 20
NOISE_M = 3e-5
COMPLIANCE_RAD_NM = 4e-6  # of joint 2
WORN, WORN_TIMES = 7, 5  # the arm of the fleet whose reducer yields so many times as much
PROGRAM = """def demo():
  set_tcp(p[0, 0, 0.1, 0, 0, 0])
  movej([0.30, -1.40, 1.60, -1.70, -1.50, 0.20], a=1.0, v=0.5)
  movej([0.60, -1.20, 1.50, -1.80, -1.40, 0.40], a=1.0, v=0.5)
  movej([0.90, -1.00, 1.30, -1.90, -1.30, 0.60], a=1.0, v=0.5)
  movej([1.20, -1.30, 1.70, -1.60, -1.60, 0.80], a=1.0, v=0.5)
end
"""


def fill(folder: Path, say: Callable[[str], None]) -> None:
    """Writes the project; one of an earlier demonstration is left as it is.

    Raises:
        InvalidInput: The folder holds other files.
    """
    marker = folder / "simulated.txt"
    if marker.exists():
        return
    if folder.exists() and any(path.name not in (ANSWERS, COMMANDS) for path in folder.iterdir()):
        raise InvalidInput(f"{folder}: holds other files; choose an empty folder for the demonstration")
    say(f"This is a simulation: a {ARM} with random errors and a compliant joint, measured by a simulated tracker.")
    project = Project(folder)
    nominal = project.choose_robot(ARM)
    q = fastcal.random_poses(nominal, ROWS, seed=1)
    data = _measured(nominal, q, 1)
    names = [f"P{k + 1:03d}" for k in range(ROWS)]
    order = np.random.default_rng(0).permutation(ROWS)
    point = np.round(from_si(data.points, "mm"), 4)
    text = ["// " + HEAD.strip("# \n"), "Collection,Group,Target,X,Y,Z"]
    text += [f"A,demo,{names[k]},{point[k, 0]},{point[k, 1]},{point[k, 2]}" for k in order]
    joints = np.round(from_si(q, "deg"), 4)
    controller = ["name,J1,J2,J3,J4,J5,J6", *(",".join([n, *map(str, r)]) for n, r in zip(names, joints, strict=True))]
    project.answer("instrument", [project.receive("tracker.txt", "\n".join([*text, ""]).encode())])
    project.answer("controller", project.receive("joints.csv", "\n".join([*controller, ""]).encode()))
    project.receive("demo.script", (HEAD + PROGRAM).encode())
    _write_fleet(project, nominal)
    write_text(marker, HEAD)


def _write_fleet(project: Project, nominal: fastcal.Robot) -> None:
    folder = project.path("fleet_data")
    folder.mkdir(exist_ok=True)
    rows: dict[str, list[str]] = {"robot": [], "data": [], "name": []}
    for arm in range(FLEET):
        q = fastcal.random_poses(nominal, 40, seed=10 + arm)
        name = f"cell_{arm + 1}"
        times = WORN_TIMES if arm + 1 == WORN else 1
        fastcal.write_measurements(folder / f"{name}.csv", _measured(nominal, q, 10 + arm, times), nominal.joint_types)
        rows["robot"].append(ARM)
        rows["data"].append(f"fleet_data/{name}.csv")
        rows["name"].append(name)
    write_csv(project.path("arms.csv"), rows)


def _measured(nominal: fastcal.Robot, q: np.ndarray, seed: int, times: int = 1) -> fastcal.Dataset:
    """Joint 2 yields so many times as much as a healthy one."""
    parameters = {"compliance_rad_nm": times * COMPLIANCE_RAD_NM}
    yielding = {"effect": "joint_compliance", "owner": "joint2", "parameters": parameters}
    base = {"xyz_mm": [1800.0, -650.0, 310.0], "rpy_deg": [0.4, -0.3, 155.0]}
    real = nominal.with_(base=base, effects=[yielding])
    return fastcal.simulate(fastcal.perturbed(real, seed=seed), q, noise=NOISE_M, seed=seed)
