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

    The tool's pose stays the same for every joint position.
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
    warn([f"a URDF has no place for {', '.join(lost)}, which was left out"] if lost else [])
