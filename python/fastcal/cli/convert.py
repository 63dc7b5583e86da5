# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal convert`: a robot file as another kind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from fastcal.cli.cell_arm import load_arm
from fastcal.cli.console import emit, say, warn
from fastcal.cli.options import OfCell, OutFile, RobotFile


def convert(
    robot: RobotFile,
    output: OutFile,
    to: Annotated[
        Literal["urdf", "dh", "mdh", "poe", "ur_kinematics"],
        typer.Option(help="The target format; ur_kinematics is the YAML of Universal Robots' ur_description."),
    ],
    drop_effects: Annotated[
        bool, typer.Option("--drop-effects", help="Leave out what the new format cannot represent, and list it.")
    ] = False,
    ur_calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A UR controller's calibration.conf to add to ROBOT; or the kinematics YAML whose hash to keep.",
        ),
    ] = None,
    name: OfCell = "",
) -> None:
    """Convert a robot to another file format.

    The tool's pose stays the same for every joint position. A robot that was read from a URDF becomes the same URDF
    with new joint origins; links, meshes, branches and comments are kept.
    """
    from fastcal.conversion import convert as converted
    from fastcal.errors import InvalidInput
    from fastcal.io.robot_file import read_spec, write_spec
    from fastcal.io.tree_file import is_cell
    from fastcal.io.ur_files import with_ur_deltas

    spec = load_arm(robot, name)[0].spec if name or is_cell(robot) else read_spec(robot)
    of_controller = ur_calibration is not None and ur_calibration.suffix.lower() == ".conf"
    if ur_calibration is not None and of_controller:
        # Through screws, which need no far d where axes are parallel.
        spec = converted(converted(with_ur_deltas(spec, ur_calibration), "poe").spec, "dh").spec
    elif ur_calibration is not None and to != "ur_kinematics":
        raise InvalidInput(f"{ur_calibration}: expected a calibration.conf, or --to ur_kinematics")
    if to == "ur_kinematics":
        notes = _ur_kinematics(spec, output, drop_effects, None if of_controller else ur_calibration)
    else:
        found = converted(spec, to, drop_effects)
        if output.suffix.lower() == ".urdf" and to != "urdf":
            raise InvalidInput(f"{output}: a .urdf file holds the kind urdf, not {to}; give a name that ends in .yaml")
        lost = write_spec(found.spec, output, drop_effects=drop_effects)
        notes = [*(f"{name} was dropped" for name in found.dropped), *found.notes, *_left_out(lost, robot)]
    warn(notes)
    say(f"{output}: {spec['name']} ({to})")
    emit({"file": str(output), "robot": spec["name"], "from": spec["kinematics"], "to": to, "notes": notes})


def _left_out(lost: Sequence[str], robot: str) -> list[str]:
    """What the URDF that was written has no place for, in sentences."""
    moved = [name for name in ("base", "tool") if name in lost]
    left = [name for name in lost if name not in moved]
    out = [f"{' and '.join(moved)} are of the measurement and not of the URDF: they stay in {robot}"] if moved else []
    return out + ([f"a URDF has no place for {', '.join(left)}, which was left out"] if left else [])


def _ur_kinematics(spec: dict[str, Any], output: Path, drop_effects: bool, like: Path | None) -> list[str]:
    """Writes the kinematics file of a UR arm, with the hash of the file `like` or of the one that the arm came from.

    Returns what a reader should know, a sentence each.
    """
    from fastcal.conversion import convert as converted
    from fastcal.conversion.ur_frames import ur_origins
    from fastcal.errors import InvalidInput
    from fastcal.io.atomic import write_text
    from fastcal.io.ur_files import check_six_joints, own_joint_origins, ur_hash, ur_kinematics_text
    from fastcal.io.urdf_file import what_moves_the_tool
    from fastcal.io.urdf_in_place import first_mount
    from fastcal.io.yaml_file import read_yaml

    lost = what_moves_the_tool(spec)
    if lost and not drop_effects:
        raise InvalidInput(
            f"{output}: a kinematics file has no place for {', '.join(lost)}; write a robot file, or --drop-effects"
        )
    check_six_joints(spec)
    if spec["kinematics"] == "urdf":
        origins = own_joint_origins(spec, first_mount(spec))
    else:
        found = converted(spec, "dh", drop_effects=True)
        if found.spec["base"] != spec["base"]:
            raise InvalidInput(f"{spec['name']}: its first axis is not the base's z axis, as that of a UR arm is")
        origins = ur_origins(found.spec)
    named = ur_hash(like, read_yaml(like)) if like is not None else spec.get("source", {}).get("ur_hash")
    write_text(output, ur_kinematics_text(origins, named or "fastcal"))
    notes = [f"{name} was dropped" for name in lost]
    if not named:
        notes.append(
            "the file has no controller's hash, which ur_robot_driver compares; --ur-calibration FILE keeps one"
        )
    return notes
