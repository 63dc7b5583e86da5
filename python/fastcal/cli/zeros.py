# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal zeros`: signs and zeros of joints whose motors count from anywhere, by a dozen pictures or touches."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fastcal.cli.console import emit, progress, say, warn
from fastcal.cli.options import DataFiles, OutFolder, RobotFile

FILES = ("robot.yaml", "zeros.json", "counted.urdf", "lerobot.json")


def zeros(
    robot: RobotFile,
    data: DataFiles,
    output: OutFolder,
    corners: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Corners of the board in each picture (from `detect`); not needed if points were touched (socket).",
        ),
    ] = None,
    lerobot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="LeRobot's calibration with which the joints were read; a corrected copy is written."
        ),
    ] = None,
) -> None:
    """Find the signs and zeros of joints.

    For arms with arbitrary motor zeros. The lengths are those of the URDF; the poses of camera and board, or the points
    touched by the tip of the hand, need not be known. Joint positions are those of the motors, in degrees.
    """
    from fastcal.cells.joint_zeros import joint_zeros
    from fastcal.errors import InvalidInput
    from fastcal.importers.corners import load_seen
    from fastcal.io.atomic import write_text
    from fastcal.io.counted_urdf import counted_urdf, lerobot_calibration, read_lerobot
    from fastcal.io.folder import atomic_folder, check_folder
    from fastcal.io.results import write_json
    from fastcal.io.robot_file import load_robot
    from fastcal.units import from_si

    check_folder(output, FILES)
    arm = load_robot(robot)
    if arm.description.pendant:
        raise InvalidInput(f"{robot}: has a pendant already, which says how joints are counted; leave it out")
    old = None if lerobot is None else read_lerobot(lerobot)
    rows = load_seen(data, arm, corners)
    with progress() as show:
        found = joint_zeros(arm, rows, progress=show)
    names = [joint.name or name for joint, name in zip(arm.joints, found.names, strict=True)]
    written, turned = (None, []) if old is None else lerobot_calibration(old, names, found)
    urdf = counted_urdf(arm.spec, found)
    content, what = found.to_json_dict(), "pictures" if corners else "touches"
    with atomic_folder(output, owned=FILES) as folder:
        arm.with_(pendant=found.pendant()).save(folder / "robot.yaml")
        write_json(folder / "zeros.json", content)
        if urdf is not None:
            write_text(folder / "counted.urdf", urdf)
        if written is not None:
            write_json(folder / "lerobot.json", written)
    for name, joint in zip(names, content["joints"], strict=True):
        told = f"zero not shown by {what}: it moves with the base or the {'mount' if corners else 'tip'}"
        if (std := joint["std_deg"]) is not None:
            told = f"zero {joint['zero_deg']:.2f} deg, known to {2 * std:.2g} deg (95 %)"
        say(f"{name}: sign {joint['sign']:+d}, {told}")
    say(f"{what} are left {from_si(found.misfit, 'mm'):.2f} mm from where the arm has them")
    for sign, zero in found.others:
        told = ", ".join(f"{s:+.0f} {from_si(z, 'deg'):.1f}" for s, z in zip(sign.tolist(), zero.tolist(), strict=True))
        say(f"fits as well (sign, zero in deg): {told}")
    warn([f"{name} counts the other way round, which LeRobot's degrees cannot say" for name in turned])
    say(str(output))
    emit(content)
