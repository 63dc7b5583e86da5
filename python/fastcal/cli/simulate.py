# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal simulate`: poses in, what an instrument would have measured out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fastcal.cli.console import emit, progress, say, warn
from fastcal.cli.options import OutFile, RobotFile, Seed, Threads, Views, no_views


def simulate(
    robot: RobotFile,
    poses: Annotated[Path, typer.Argument(metavar="POSES", help="Joint positions and conditions, as in DATA.")],
    output: OutFile,
    noise_mm: Annotated[float, typer.Option(min=0, help="Standard deviation of a measured coordinate.")] = 0.0,
    noise_rot_deg: Annotated[
        float | None,
        typer.Option(
            min=0,
            help="Standard deviation of the orientation about each axis; without it no orientation is measured.",
        ),
    ] = None,
    repeatability_deg: Annotated[
        float, typer.Option(min=0, help="Repeatability (standard deviation) of each revolute joint.")
    ] = 0.0,
    points: Annotated[
        bool,
        typer.Option(help="Measure points; without them only the other observations for which POSES has columns."),
    ] = True,
    torque_per_ampere: Annotated[
        str,
        typer.Option(
            metavar="NM_A",
            help=(
                "Measure motor currents: joint torque per ampere, one value for all joints or one each, such as "
                "40,40,35,20,9,9."
            ),
        ),
    ] = "",
    friction_nm: Annotated[
        float, typer.Option(min=0, help="Coulomb friction of each joint that appears in the currents.")
    ] = 0.0,
    views: Views = "",
    seed: Seed = 0,
    threads: Threads = 1,
) -> None:
    """Simulate measurements of a robot, into a CSV file.

    The robot's effects are included, and the specified noise is added.
    """
    from fastcal.errors import InvalidInput
    from fastcal.io.tree_file import is_cell

    if friction_nm and not torque_per_ampere:
        raise InvalidInput("--friction-nm is that of motor currents: give --torque-per-ampere too")
    if is_cell(robot):
        from fastcal.cli.cell_uses import simulate_cell

        noise = (noise_mm, noise_rot_deg, repeatability_deg)
        simulate_cell(
            robot,
            poses,
            output,
            views,
            noise,
            seed,
            threads,
            {"--no-points": (points, True), "--torque-per-ampere": (torque_per_ampere, "")},
        )
        return
    no_views(views)
    from fastcal.calibration.simulation import simulate as simulated
    from fastcal.io.measurements import load_measurements
    from fastcal.io.measurements_out import write_measurements
    from fastcal.io.robot_file import load_robot
    from fastcal.units import to_si

    arm = load_robot(robot)
    sent = load_measurements(poses, arm, require_measured=False)
    turning = [kind == "revolute" for kind in arm.joint_types]
    with progress() as show:
        show("simulating")
        data = simulated(
            arm,
            sent,
            noise=to_si(noise_mm, "mm"),
            noise_rotation=None if noise_rot_deg is None else to_si(noise_rot_deg, "deg"),
            repeatability=[to_si(repeatability_deg, "deg") * turns for turns in turning],
            points=points,
            torque_per_ampere=_numbers(torque_per_ampere),
            friction=friction_nm,
            seed=seed,
            threads=threads,
        )
    write_measurements(output, data, arm.joint_types, arm.passive)
    warn(sent.notes)
    say(f"{output}: {len(data)} poses of {arm.name} measured by simulation")
    emit(
        {
            "file": str(output),
            "robot": arm.name,
            "poses": len(data),
            "noise_mm": noise_mm,
            "noise_rot_deg": noise_rot_deg,
            "repeatability_deg": repeatability_deg,
            "torque_per_ampere": torque_per_ampere or None,
            "friction_nm": friction_nm,
            "seed": seed,
            "notes": list(sent.notes),
        }
    )


def _numbers(text: str) -> list[float] | float | None:
    """One number, or one a joint; None where there is no text."""
    from fastcal.errors import InvalidInput

    try:
        numbers = [float(part) for part in text.split(",")] if text else []
    except ValueError:
        raise InvalidInput(f"--torque-per-ampere takes numbers such as 40 or 40,40,35, got '{text}'") from None
    return numbers if len(numbers) > 1 else next(iter(numbers), None)
