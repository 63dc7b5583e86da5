# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compensate`: target poses, or a robot program, in; commands that bring the calibrated robot there out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import typer

from fastcal.cli.console import progress, say, warn
from fastcal.cli.options import ModelFile, OutFile, Threads

if TYPE_CHECKING:
    from fastcal.compensation import Compensation


def compensate(
    model: ModelFile,
    targets: Annotated[
        Path, typer.Argument(metavar="TARGETS", help="A table of poses, or a program: .mod .prg .src .dat .ls .script.")
    ],
    output: OutFile,
    method: Annotated[
        Literal["full", "one-step"], typer.Option(help="Iterate to the end, or take one step by the Jacobian.")
    ] = "full",
    nominal: Annotated[
        str | None, typer.Option(metavar="ROBOT", help="What the controller believes; default: what MODEL keeps of it.")
    ] = None,
    single: Annotated[
        bool, typer.Option("--single", help="The rows are single points and not a path: each is solved by itself.")
    ] = False,
    threads: Threads = 1,
) -> None:
    """Turn target poses, or the targets of a robot program, into commands that reach them."""
    from fastcal.compensation import compensate as compensated
    from fastcal.io.robot_file import load_robot
    from fastcal.io.targets import load_targets, write_commands

    robot = load_robot(model)
    before = None if nominal is None else load_robot(nominal)
    wanted = load_targets(targets, robot)
    with progress() as show:
        show("compensating")
        found = compensated(robot, wanted, nominal=before, method=method, along_path=not single, threads=threads)
    write_commands(output, robot, found.q, (found.position_error, found.rotation_error), found.sigma, found.status)
    warn(found.notes)
    _say(found)


def _say(found: Compensation) -> None:
    """The result in a line or two."""
    from fastcal.units import from_si

    counts = {status: int((found.status == status).sum()) for status in dict.fromkeys(found.status.tolist())}
    say(f"{len(found)} targets: " + ", ".join(f"{count} {status}" for status, count in counts.items()))
    if found.reached.any():
        left = from_si(float(np.max(found.position_error[found.reached])), "mm")
        sigma = found.sigma[found.reached]
        known = np.isfinite(sigma).all()
        spread = f"; its standard deviation {from_si(float(sigma.max()), 'mm'):.3g} mm a coordinate" if known else ""
        say(f"predicted error of the reached ones: at most {left:.3g} mm{spread}")
