# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal detect`: pictures of boards in, a table of their corners out, and a page that shows them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fastcal.cli.console import emit, progress, say, warn
from fastcal.cli.options import PageLanguage

if TYPE_CHECKING:
    from fastcal.camera.detection import Detection
    from fastcal.robot.rig import Seeing


def detect(
    pictures: Annotated[list[Path], typer.Argument(metavar="PICTURES...", help="Pictures, or folders of them.")],
    cell: Annotated[str, typer.Option(metavar="CELL", help="The cell file with the cameras and boards.")],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FILE", help="The table of corners; a page is written next to it."),
    ],
    joints: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The poses; pictures are matched to rows by name, number, time, or else order."
        ),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Number of processes; the results do not depend on it.")] = 1,
    page_language: PageLanguage = "en",
) -> None:
    """Find the corners of boards in pictures.

    The table is what --corners of `fastcal calibrate` takes.
    """
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tables import check_csv_name
    from fastcal.io.tree_file import is_cell, load_cell

    check_csv_name(output)
    nominal = load_cell(cell) if is_cell(cell) else load_robot(cell).description
    with progress() as show:
        found = write_detection(nominal, pictures, joints, output, jobs, page_language, show)
    for picture in found.pictures:
        say(f"{picture.path.name}: {picture.told}")
    page, columns = output.with_suffix(".html"), found.columns(output.parent)
    warn(f"{picture.path}: {picture.told}" for picture in found.empty)
    warn(
        f"{picture.path}: is of no row of the poses, and was left out"
        for picture in found.pictures
        if picture.row is None and picture.count
    )
    for camera, how in found.joins.items():
        say(f"camera {camera}: pictures joined to rows {how}")
    with_board = len(found.pictures) - len(found.empty)
    say(f"{with_board} of {len(found.pictures)} pictures show a board; {len(columns['row'])} corners")
    say(str(page))
    say(str(output))
    emit(
        {
            "file": str(output),
            "page": str(page),
            "corners": len(columns["row"]),
            "joined": dict(found.joins),
            "pictures": [
                {
                    "picture": str(picture.path),
                    "camera": picture.camera,
                    "row": picture.row,
                    "corners": {name: seen.count for name, seen in picture.boards.items()},
                    "why": None if picture.count else picture.told,
                }
                for picture in found.pictures
            ],
        }
    )


def write_detection(
    cell: Seeing,
    pictures: list[Path],
    joints: Path | None,
    output: Path,
    jobs: int,
    language: str,
    show: Callable[[str], None],
) -> Detection:
    """Finds the boards and writes the table of corners and the page beside it.

    Raises:
        InvalidInput: No picture shows a board; what was found in each is said all the same.
    """
    from fastcal.camera.detection import detect as detected
    from fastcal.camera.other_size import other_size
    from fastcal.errors import InvalidInput
    from fastcal.io.atomic import atomic_paths
    from fastcal.io.tables import csv_text, read_table
    from fastcal.report.detection_report import detection_page

    poses = None if joints is None else read_table(joints)
    found = detected(cell, pictures, poses=poses, jobs=jobs, progress=show)
    columns = found.columns(output.parent)
    if not columns["row"]:
        for picture in found.pictures:
            say(f"{picture.path.name}: {picture.told}")
        first = found.pictures[0]
        show("no board was found: looking for one of another size")
        shown = other_size([picture.path for picture in found.pictures if picture.boards], cell.boards)
        shown = shown or f"{first.path.name}: {first.told}"
        raise InvalidInput(f"no board was found in any of {len(found.pictures)} pictures; {shown}")
    if part := other_size([next(of.path for of in found.pictures if of.count)], cell.boards, larger=True):
        warn([part])
    show("writing the page")
    with atomic_paths([output, output.with_suffix(".html")]) as (table_file, page_file):
        table_file.write_text(csv_text(columns), encoding="utf-8", newline="\n")
        page_file.write_text(detection_page(found, cell, language=language), encoding="utf-8")
    return found
