# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal place`: where a tool, a base, a part or the axis of a track is, from a few touches."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from fastcal.cli.console import emit, progress, say, warn
from fastcal.cli.options import DataFiles, OutFile, RobotFile, Threads

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fastcal.calibration.touches import FoundPlace
    from fastcal.cells.place import PlacedMembers

What = Literal["tool", "base", "part", "axis"]


def place(
    robot: RobotFile,
    data: DataFiles,
    output: OutFile,
    what: Annotated[
        What, typer.Option(help="A tool, the arm's base, a part's frame, or the axis of a track or turntable.")
    ],
    name: Annotated[
        str,
        typer.Option(metavar="NAME,...", help="In a cell: the members to locate. For a part: its name."),
    ] = "",
    find_radius: Annotated[
        bool,
        typer.Option("--find-radius", help="Also identify the radius of touched spheres, starting from distance_mm."),
    ] = False,
    threads: Threads = 1,
) -> None:
    """Find a tool, a base, a part or an axis from a few touches.

    The arm's geometry is kept fixed. The output is ROBOT with the frame that was found; a part is written into a cell
    file.
    """
    from fastcal.errors import InvalidInput
    from fastcal.io.tree_file import is_cell

    if find_radius and (is_cell(robot) or what != "tool"):
        raise InvalidInput("--find-radius is for a tool of one arm that touched a sphere")
    if is_cell(robot):
        _in_cell(robot, data, output, what, name, threads)
    else:
        _of_arm(robot, data, output, what, name, find_radius, threads)


def _of_arm(robot: str, data: list[Path], output: Path, what: What, name: str, find_radius: bool, threads: int) -> None:
    """With one arm."""
    from fastcal.calibration.touches import find_place, with_place
    from fastcal.cells.cell import Arm, Cell, Known, Point
    from fastcal.errors import InvalidInput
    from fastcal.importers import load_measurements
    from fastcal.io.robot_file import load_robot, write_spec
    from fastcal.io.tree_file import write_cell
    from fastcal.measurements.dataset import Dataset

    if what == "axis":
        raise InvalidInput(f"{robot}: --what axis expects a cell, of which a track or turntable is an arm of one joint")
    if name and what != "part":
        raise InvalidInput(f"--name names members of a cell, or a part; {robot} is one arm with one {what}")
    arm = load_robot(robot)
    rows = Dataset.concatenate([load_measurements(file, arm) for file in data])
    with progress() as show:
        show(f"finding the {what}")
        found = find_place(arm, rows, what, find_radius=find_radius, threads=threads)
    words = _sentence(found)
    if what == "part":
        known = Known(False, *(_mean(std) for std in found.std))
        part = Point(name or "part", "target", "world", found.place, known)
        write_cell(Cell(arm.name, (Arm("arm", arm, known=Known(fixed=True)),), (part,)), output, words)
    else:
        write_spec(with_place(arm, found).spec, output, words)
    warn([*rows.notes, *_left_out(found.outliers)])
    say(f"{output}: {words}")
    emit({"file": str(output), **found.to_json_dict()})


def _in_cell(cell: str, data: list[Path], output: Path, what: What, name: str, threads: int) -> None:
    """Members of a cell, by what was read of its targets."""
    from fastcal.cells.place import place_axis, place_members
    from fastcal.errors import InvalidInput
    from fastcal.io.tree_file import load_cell, write_cell
    from fastcal.io.tree_readings import load_readings

    if len(data) > 1:
        raise InvalidInput(f"expected one file of postures of a cell, got {len(data)}")
    there = load_cell(cell)
    names = [part for part in name.split(",") if part]
    if what != "axis" and not names:
        listed = ", ".join([*(of.name for of in there.arms), *(of.name for of in there.points)])
        raise InvalidInput(f"--name says which members of the cell are placed; there are {listed}")
    readings = load_readings(data[0], there)
    with progress() as show:
        show("finding where it stands")
        if what == "axis":
            found = place_axis(there, readings, names[0] if names else None, threads=threads)
        else:
            found = place_members(there, readings, names, threads=threads)
    lines = _lines(found)
    write_cell(found.cell, output, "\n".join(lines))
    warn([*readings.notes, *_left_out(found.outliers)])
    for line in lines:
        say(line)
    for text in found.free:
        say(f"not shown, as the file has it: {text}")
    say(str(output))
    emit({"file": str(output), "what": what, **found.to_json_dict()})


def _sentence(found: FoundPlace) -> str:
    from fastcal.units import from_si

    std_mm, std_deg = found.std
    words = f"{found.what} {_place(found.place['xyz_mm'], std_mm, found.place['rpy_deg'], std_deg)}"
    noise = ", ".join(str(of) for of in found.noise.values())
    if found.radius is not None:
        radius, std = (from_si(value, "mm") for value in found.radius)
        words += f", radius of the sphere {radius:.3f} +- {std:.3f} mm"
    return f"{words}; from {found.count} touches, noise of one {noise}"


def _lines(found: PlacedMembers) -> list[str]:
    out = [f"{of.name} on {of.on} {_place(of.xyz_mm, of.std_mm, of.rpy_deg, of.std_deg)}" for of in found.members]
    if found.ratio is not None:
        error, std = found.ratio
        out.append(f"it moves by 1 {error:+.2e} +- {std:.1e} of what it is sent")
    return out


def _place(
    xyz: Sequence[float], std_mm: Sequence[float | None], rpy: Sequence[float], std_deg: Sequence[float | None]
) -> str:
    def numbers(values: Sequence[float], std: Sequence[float | None], digits: int) -> str:
        return ", ".join(
            f"{value:.{digits}f}" + ("" if s is None else f" +- {s:.{digits}f}")
            for value, s in zip(values, std, strict=True)
        )

    turned = f", turned by {numbers(rpy, std_deg, 4)} deg" if any(s is not None for s in std_deg) else ""
    return f"at {numbers(xyz, std_mm, 3)} mm{turned}"


def _mean(std: Sequence[float | None]) -> float | None:
    """The root of the mean square of what is known; None where nothing is."""
    known = [value for value in std if value is not None]
    return (sum(value**2 for value in known) / len(known)) ** 0.5 if known else None


def _left_out(outliers: Sequence[int]) -> list[str]:
    rows: Any = ", ".join(map(str, outliers))
    return [f"rows {rows} do not fit the others and count little"] if outliers else []
