# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a palletizer misses with its program as taught and as compensated, from a table of points to the program.

Each seed is a palletizer as a workshop builds it (lengths off by 0.5 mm, angles by 0.5 mrad). 60 designed postures are
measured with a noise of 0.05 mm, `fastcal calibrate --priors` and `fastcal compensate` are run as processes on the
table and on a program of 50 targets (two pallets, for the measured tool) in RAPID and in KRL. The controller, the
nominal robot, then works out its motors from the targets that the program has, and the simulated robot moves there.
A pallet is taught as a frame, so the distances are those that are left after the best rigid motion of all targets.

    python bench/python/bench_palletizer_program.py [--first 0] [--robots 10]
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from fastcal import design_poses, inverse_kinematics, load_robot, perturbed, simulate, write_measurements
from fastcal.compensation.configurations import at_axes
from fastcal.io.programs import load_program
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Vector

POINTS, NOISE, TARGETS = 60, 5e-5, 50


def places(seed: int) -> np.ndarray:
    """x, y, z [mm] of the tool's point on a pallet on the left and one on the right, and its turn about z [deg]."""
    random = np.random.default_rng(seed)
    side = np.where(np.arange(TARGETS) < TARGETS // 2, 1.0, -1.0)
    x, y = random.uniform(1100, 1900, TARGETS), side * random.uniform(200, 1000, TARGETS)
    return np.column_stack([x, y, random.uniform(300, 1200, TARGETS), random.uniform(-60, 60, TARGETS)])


def downward(x: float, y: float, z: float, turn: float) -> np.ndarray:
    """(4, 4) a tool upside down, turned about the vertical [mm, deg]."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    return np.array([[c, s, 0, x / 1000], [s, -c, 0, y / 1000], [0, 0, -1, z / 1000], [0, 0, 0, 1]])


def rapid(nominal: Robot, tool: Vector, at: np.ndarray) -> str:
    """A module, each target with the quarter turns of axes 1 and 6 in its configuration."""
    far, seed = "[9E9,9E9,9E9,9E9,9E9,9E9]", np.asarray(nominal.core.home)
    lines = ["MODULE Stack"]
    lines.append(f"  PERS tooldata grip:=[TRUE,[{list(tool)},[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];")
    lines.append(f"  CONST jointtarget home:=[[0,10,30,0,0,0],{far}];")
    for k, (x, y, z, turn) in enumerate(at):
        seed = inverse_kinematics(nominal, downward(x, y, z, turn), seed=seed).q[0]
        axes = nominal.pendant.shown(seed)
        quarters = [int(np.floor(np.degrees(axes[axis]) / 90)) for axis in (0, 5)]
        half = np.radians(turn) / 2
        turned = f"[0,{np.cos(half):.9f},{np.sin(half):.9f},0]"
        lines.append(
            f"  CONST robtarget p{k}:=[[{x:.4f},{y:.4f},{z:.4f}],{turned},[{quarters[0]},0,{quarters[1]},0],{far}];"
        )
    lines += ["  PROC main()"]
    for k in range(len(at)):
        lines += ["    MoveAbsJ home,v500,fine,tool0;"] * (k % (TARGETS // 2) == 0)
        lines += [f"    MoveJ p{k},v500,fine,grip;"]
    return "\n".join([*lines, "  ENDPROC", "ENDMODULE", ""])


def krl(tool: Vector, at: np.ndarray) -> str:
    """The same as a KRL file of linear moves."""
    lines = ["DEF stack()", "  BASE_DATA[1] = {X 0, Y 0, Z 0, A 0, B 0, C 0}"]
    lines.append(f"  TOOL_DATA[1] = {{X {tool[0]}, Y {tool[1]}, Z {tool[2]}, A 0, B 0, C 0}}")
    lines += ["  $BASE = BASE_DATA[1]", "  $TOOL = TOOL_DATA[1]"]
    for k, (x, y, z, turn) in enumerate(at):
        lines += ["  PTP {A1 0, A2 10, A3 30, A4 0, A5 0, A6 0}"] * (k % (TARGETS // 2) == 0)
        lines += [f"  LIN {{X {x:.4f}, Y {y:.4f}, Z {z:.4f}, A {turn:.5f}, B 0, C 180}}"]
    return "\n".join([*lines, "END", ""])


def apart(real: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Distances after the best rigid motion [m] (Kabsch)."""
    a, b = real - real.mean(0), wanted - wanted.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return np.linalg.norm(a @ turn - b, axis=1)


def reached(program: Path, nominal: Robot, real: Robot) -> np.ndarray:
    """Where the real robot's tool goes with a program that the nominal one works out [m]."""
    content, at, seed = load_program(program), [], np.asarray(nominal.core.home)
    for target in content.targets:
        if target.kind == "joints":
            seed = at_axes(nominal, target.values)
            continue
        found = inverse_kinematics(nominal, content.language.pose(target.values), seed=seed)
        seed = found.q[0]
        at.append(real.forward(seed)[0, :3, 3])
    return np.array(at)


def tried(seed: int, folder: Path) -> dict[str, np.ndarray]:
    """Distances with the taught program and with the compensated ones [m]."""
    nominal = load_robot("palletizer")
    real = perturbed(nominal, seed=seed)
    poses = design_poses(nominal, POINTS, candidates="random", candidate_count=2000)
    data = simulate(real, poses.q, noise=NOISE, seed=seed + 1)
    write_measurements(folder / "measured.csv", data, nominal.joint_types, nominal.passive)
    calibrate = ["fastcal", "calibrate", "palletizer", "measured.csv", "--priors", "-q", "-o", "out"]
    subprocess.run(calibrate, cwd=folder, check=True)
    tool, at = nominal.description.tool.xyz_mm, places(seed)
    wanted, out = at[:, :3] / 1000, {}
    for name, text in (("stack.mod", rapid(nominal, tool, at)), ("stack.src", krl(tool, at))):
        (folder / name).write_text(text)
        command = ["fastcal", "compensate", "out/model.yaml", name, "-q", "-o", f"real_{name}"]
        subprocess.run(command, cwd=folder, check=True)
        out[f"taught {name[-3:]}"] = apart(reached(folder / name, nominal, real), wanted)
        out[f"compensated {name[-3:]}"] = apart(reached(folder / f"real_{name}", nominal, real), wanted)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--robots", type=int, default=10)
    given = parser.parse_args()
    every: dict[str, list[np.ndarray]] = {}
    for seed in range(given.first, given.first + given.robots):
        with tempfile.TemporaryDirectory() as folder:
            found = tried(seed, Path(folder))
        for name, distances in found.items():
            every.setdefault(name, []).append(distances)
        print(
            seed, *(f"{name} {1e3 * d.mean():.3f} (most {1e3 * d.max():.3f})" for name, d in found.items()), flush=True
        )
    for name, distances in every.items():
        all_of = np.concatenate(distances)
        print(f"{name:16} mean {1e3 * all_of.mean():.3f} mm, most {1e3 * all_of.max():.3f} mm, {len(all_of)} targets")


if __name__ == "__main__":
    main()
