# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal check`: does a calibrated model still hold? Exit code 0: it holds. 4: changed. 3: the poses can't tell."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fastcal.cli.console import CANNOT_TELL, CHANGED, emit, progress, say, tell, warn
from fastcal.cli.options import AsRead, BesideLanguage, Corners, DwellS, PageLanguage, SpeedPercent, Threads
from fastcal.cli.tracker import Tracker, seen_by
from fastcal.cli.who import Who

if TYPE_CHECKING:
    from fastcal.monitoring.result import CheckResult
    from fastcal.robot.robot import Robot


def check(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL", help="A calibrated robot (model.yaml), or a folder with one subfolder per arm."
        ),
    ],
    data: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="DATA...", help="Five to ten measured poses. Several files: several set-ups of the instrument."
        ),
    ] = None,
    tolerance_mm: Annotated[
        float | None, typer.Option(min=1e-6, help="Largest distance of a point from the model that is accepted.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write check.json, or a page if the name ends in .html. For a folder of arms: a folder.",
        ),
    ] = None,
    plan: Annotated[
        int | None,
        typer.Option(min=4, max=50, help="Do not check yet: write this many poses to be measured to FILE."),
    ] = None,
    surroundings: Annotated[
        Path | None, typer.Option(metavar="FILE", help="With --plan: YAML file of obstacles, as for `design`.")
    ] = None,
    language: BesideLanguage = None,
    dwell_s: DwellS = 3.0,
    speed_percent: SpeedPercent = 20.0,
    files: Annotated[
        str | None,
        typer.Option(
            metavar="PATTERN", help="For a folder of arms: which files to check; default: the newest of each arm."
        ),
    ] = None,
    page_language: PageLanguage = "en",
    corners: Corners = None,
    as_read: AsRead = False,
    threads: Threads = 1,
    tracker: Tracker | None = None,
    who: Who | None = None,
) -> None:
    """Check whether a calibrated model still holds.

    The base is refitted, since the instrument has been set up again. Reports what changed and by how much, or what to
    measure to find out.
    """
    from fastcal.cli.cells import check_cell, not_given
    from fastcal.errors import InvalidInput
    from fastcal.importers.corners import load_seen
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tree_file import is_cell
    from fastcal.monitoring.check import check as checked
    from fastcal.report.monitoring_files import write_check
    from fastcal.units import to_si

    tolerance = None if tolerance_mm is None else to_si(tolerance_mm, "mm")
    if is_cell(model):
        only_of_arms: dict[str, tuple[Any, Any]] = {
            "--plan": (plan, None),
            "--surroundings": (surroundings, None),
            "--language": (language, None),
            "--files": (files, None),
            "--tracker": (tracker, None),
            **not_given(who),
        }
        check_cell(model, data or [], corners, output, tolerance, as_read, threads, page_language, only_of_arms)
        return
    if Path(model).is_dir():
        _refuse_of_one_arm(model, data, plan, tracker)
        options = {"files": files, "tolerance": tolerance, "as_read": as_read, "who": who, "threads": threads}
        _check_arms(model, output, options, page_language)
        return
    if files is not None:
        raise InvalidInput("--files needs a folder of arms as MODEL")
    robot = load_robot(model)
    if plan is not None or surroundings is not None or language is not None:
        driving = {"dwell_s": dwell_s, "speed": speed_percent / 100}
        _plan(robot, plan, data, output, surroundings, language, driving)
        return
    if not data:
        raise InvalidInput("expected DATA, the measured poses, or --plan N")
    if corners is not None:
        _check_pictures(robot, data, corners, output, page_language, threads)
        return
    measured = seen_by(tracker, load_seen(data, robot, None))
    with progress() as show:
        show("checking")
        found = checked(
            robot,
            measured,
            tolerance=tolerance,
            as_read=as_read,
            who=who,
            threads=threads,
        )
    if output is not None:
        write_check(found, output, language=page_language)
    warn(found.notes)
    say_check(found)
    if found.verdict == "cannot_tell":
        raise typer.Exit(CANNOT_TELL)
    if found.verdict == "changed" or found.within_tolerance is False:
        raise typer.Exit(CHANGED)


def _refuse_of_one_arm(folder: str, data: list[Path] | None, plan: int | None, tracker: Tracker | None) -> None:
    """Refuses what is of one arm where MODEL is a folder of many."""
    from fastcal.errors import InvalidInput

    if tracker is not None:
        raise InvalidInput("--sigma-range-mm is for one file: for many arms, give the uncertainties in columns")
    if data or plan is not None:
        raise InvalidInput(
            f"{folder} is a folder; for one arm name its model.yaml, for all arms in it leave out DATA and --plan"
        )


def _check_pictures(
    robot: Robot, data: list[Path], corners: Path, output: Path | None, language: str, threads: int
) -> None:
    """One picture or a few, of a cell."""
    from fastcal.calibration.evaluation import evaluate
    from fastcal.importers.corners import load_seen
    from fastcal.monitoring.picture_check import check_pictures
    from fastcal.report.cell_check_report import write_picture_check

    seen = load_seen(data, robot, corners)
    found = check_pictures(robot, seen, threads)
    if output is not None:
        write_picture_check(found, output, evaluate(robot, seen), robot, language=language)
    warn(found.notes)
    tell(found, [found.sentence])
    if found.verdict == "changed":
        raise typer.Exit(CHANGED)
    if found.verdict == "cannot_tell":
        raise typer.Exit(CANNOT_TELL)


def say_check(found: CheckResult) -> None:
    """The verdict in a few lines."""
    from fastcal.report.summaries import summary

    tell(found, summary(found))


def _check_arms(folder: str, output: Path | None, options: dict[str, Any], language: str) -> None:
    """All arms in a folder."""
    from fastcal.io.folder import check_folder
    from fastcal.monitoring.arms import check_arms
    from fastcal.report.monitoring_files import ARMS_FILES, write_arm_checks
    from fastcal.report.summaries import summary

    if output is not None:
        check_folder(output, ARMS_FILES)
    with progress() as show:
        found = check_arms(folder, progress=show, **options)
    if output is not None:
        write_arm_checks(found, output, language=language)
    tell(found, summary(found), output)
    if found.of("changed"):
        raise typer.Exit(CHANGED)
    if found.of("cannot_tell", "unchecked"):
        raise typer.Exit(CANNOT_TELL)


def _plan(
    robot: Robot,
    count: int | None,
    data: list[Path] | None,
    output: Path | None,
    surroundings: Path | None,
    language: str | None,
    driving: dict[str, float],
) -> None:
    """Writes the poses of a check and the program that drives to them."""
    from fastcal.errors import InvalidInput
    from fastcal.io.design_out import program_beside, write_poses_and_program
    from fastcal.io.surroundings_file import load_surroundings
    from fastcal.monitoring.plan import assumed, check_poses

    if count is None:
        raise InvalidInput(f"{'--language' if surroundings is None else '--surroundings'} goes with --plan")
    if data:
        raise InvalidInput("--plan writes poses before anything is measured: leave out DATA")
    if output is None:
        raise InvalidInput("expected -o FILE, the poses to write")
    place = program_beside(output, robot, language)
    clear_of = None if surroundings is None else load_surroundings(surroundings)
    poses = check_poses(robot, count, surroundings=clear_of)
    files, notes = write_poses_and_program(output, poses, robot, place, surroundings=clear_of, **driving)
    warn(assumed(robot))
    say(f"{output}: {count} poses for a check of {robot.name}")
    for line in [*(f"program: {file}" for file in files[1:]), *notes]:
        say(line)
    emit({"file": str(output), "robot": robot.name, "poses": count, "files": list(map(str, files))})
