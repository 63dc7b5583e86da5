# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal drop`: a model without some of its effects."""

from __future__ import annotations

from typing import Annotated

import typer

from fastcal.cli.console import emit, say
from fastcal.cli.options import ModelFile, OutFile


def drop(
    model: ModelFile,
    effects: Annotated[
        list[str],
        typer.Argument(
            metavar="EFFECT[@OWNER]...",
            help=(
                "Effects to remove, at all places unless an owner is given; 'correction' is what fastcal train added."
            ),
        ),
    ],
    output: OutFile,
) -> None:
    """Remove effects from a model.

    Geometry and all other parameters keep the values identified with them; use fastcal calibrate to fit them again.
    """
    from fastcal.io.robot_file import load_robot, write_spec
    from fastcal.robot.dropped_effects import CORRECTION, drop_effects, name_of
    from fastcal.robot.robot import Robot

    def names(robot: Robot) -> list[str]:
        return [*map(name_of, robot.entries), *([CORRECTION] if robot.correction else [])]

    robot = load_robot(model)
    bare = drop_effects(robot, [name for words in effects for name in words.split(",")])
    kept = names(bare)
    gone = [name for name in names(robot) if name not in kept]
    write_spec(bare.spec, output, f"Without {', '.join(gone)}; everything else is as it was identified with it")
    say(f"{output}: {bare.name} without {', '.join(gone)}")
    emit({"file": str(output), "robot": bare.name, "dropped": gone, "effects": kept})
