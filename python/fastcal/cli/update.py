# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal update` and `fastcal compare`: a model brought up to date, and how two models of one arm differ."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fastcal.cli.console import NOT_CONVERGED, fail, progress, tell, warn
from fastcal.cli.options import AsRead, Corners, DataFiles, ModelFile, OutFolder, PageLanguage, Threads
from fastcal.cli.tracker import Tracker, seen_by
from fastcal.cli.who import Who

if TYPE_CHECKING:
    from fastcal.robot.robot import Robot


def update(
    model: ModelFile,
    data: DataFiles,
    output: OutFolder,
    corners: Corners = None,
    page_language: PageLanguage = "en",
    as_read: AsRead = False,
    threads: Threads = 1,
    tracker: Tracker | None = None,
    who: Who | None = None,
) -> None:
    """Bring a calibrated model up to date.

    Twelve new poses do, before an instrument that was set up again, or a few pictures; what the model knows is kept as
    far as it holds.
    """
    from fastcal.cli.cells import not_given, update_cell
    from fastcal.importers.corners import load_seen
    from fastcal.io.folder import check_folder
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tree_file import is_cell
    from fastcal.monitoring.update import update as updated
    from fastcal.report.monitoring_files import UPDATE_FILES, write_update
    from fastcal.report.summaries import summary

    if is_cell(model):
        only_of_arms = {"--as-read": (as_read, False), "--tracker": (tracker, None), **not_given(who)}
        update_cell(model, data, corners, output, threads, page_language, only_of_arms)
        return
    check_folder(output, UPDATE_FILES)
    robot = load_robot(model)
    if corners is not None:
        _update_pictures(robot, data, corners, output, page_language, who, threads)
        return
    measured = seen_by(tracker, load_seen(data, robot, None))
    with progress() as show:
        show("bringing the model up to date")
        found = updated(robot, measured, as_read=as_read, who=who, threads=threads)
        show("writing the report")
        write_update(found, output, language=page_language)
    warn(found.notes)
    tell(found, summary(found), output)
    if found.status != "converged":
        fail("the update has not converged: measure more poses, or calibrate again")
        raise typer.Exit(NOT_CONVERGED)


def _update_pictures(
    robot: Robot, data: list[Path], corners: Path, output: Path, language: str, who: Who | None, threads: int
) -> None:
    """By a few pictures of a cell."""
    from fastcal.importers.corners import load_seen
    from fastcal.monitoring.picture_update import update_pictures
    from fastcal.report.monitoring_files import write_update

    with progress() as show:
        show("bringing the model up to date")
        found = update_pictures(robot, load_seen(data, robot, corners), who=who, threads=threads)
        show("writing the report")
        write_update(found, output, language=language)
    warn(found.notes)
    tell(found, [found.sentence, *(of.sentence for of in found.cameras)], output)
    if found.status != "converged":
        fail("the pictures are not explained by what may have moved: take more pictures, or calibrate again")
        raise typer.Exit(NOT_CONVERGED)


def compare(
    first: Annotated[str, typer.Argument(metavar="MODEL_A", help="A calibrated robot: model.yaml.")],
    second: Annotated[str, typer.Argument(metavar="MODEL_B", help="Another model of the same arm.")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="OUT", help="The folder for compare.json and report.html."),
    ] = None,
    page_language: PageLanguage = "en",
    threads: Threads = 1,
) -> None:
    """Compare two models of one arm.

    Reports which parameters differ by more than noise, and by how many millimetres at the tool. Bases and tools are
    aligned, and the second model is expressed in the gauge of the first, so that unobservable differences do not count.
    """
    from fastcal.io.folder import check_folder
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tree_file import is_cell
    from fastcal.monitoring.compare import compare as compared
    from fastcal.report.monitoring_files import COMPARISON_FILES, write_comparison
    from fastcal.report.summaries import summary

    if is_cell(first) and is_cell(second):
        from fastcal.cli.cell_uses import compare_cells

        compare_cells(first, second, output, page_language, threads)
        return
    if output is not None:
        check_folder(output, COMPARISON_FILES)
    found = compared(load_robot(first), load_robot(second), threads=threads)
    if output is not None:
        write_comparison(found, output, language=page_language)
    warn(found.notes)
    tell(found, summary(found), output)
