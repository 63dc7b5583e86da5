# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal convert`: a robot file as another kind."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from fastcal.cli.console import warn
from fastcal.cli.options import OutFile, RobotFile


def convert(
    robot: RobotFile,
    output: OutFile,
    to: Annotated[Literal["urdf", "dh", "mdh", "poe"], typer.Option(help="The kind to convert to.")],
    drop_effects: Annotated[
        bool, typer.Option("--drop-effects", help="Leave out what the new kind can't carry, and name it.")
    ] = False,
) -> None:
    """Write a robot as another kind of file.

    The tool's pose stays the same for every joint position. A robot that was read from a URDF becomes that URDF again
    with other origins of its joints: links, meshes, branches and comments stay.
    """
    from fastcal.conversion import convert as converted
    from fastcal.errors import InvalidInput
    from fastcal.io.robot_file import load_robot, write_spec

    found = converted(load_robot(robot), to, drop_effects)
    if output.suffix.lower() == ".urdf" and to != "urdf":
        raise InvalidInput(f"{output}: a .urdf file holds the kind urdf, not {to}; give a name that ends in .yaml")
    lost = write_spec(found.spec, output, drop_effects=drop_effects)
    warn([f"{name} was dropped" for name in found.dropped])
    warn(found.notes)
    moved = [name for name in ("base", "tool") if name in lost]
    if moved:
        warn([f"{' and '.join(moved)} are of the measurement and not of the URDF: they stay in {robot}"])
    left = [name for name in lost if name not in moved]
    warn([f"a URDF has no place for {', '.join(left)}, which was left out"] if left else [])
