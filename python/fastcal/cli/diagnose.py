# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal diagnose`: what a robot's model is missing; model.yaml, diagnosis.json and report.html out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fastcal.cli.console import NOT_CONVERGED, progress, tell, warn
from fastcal.cli.options import (
    AsRead,
    Corners,
    DataFiles,
    HandEyes,
    Mend,
    OutFolder,
    PageLanguage,
    RobotFile,
    TestCorners,
    Threads,
)
from fastcal.cli.tracker import Tracker, seen_by
from fastcal.cli.who import Who

if TYPE_CHECKING:
    from fastcal.diagnosis import Diagnosis


def diagnose(
    robot: RobotFile,
    data: DataFiles,
    output: OutFolder,
    test: Annotated[Path | None, typer.Option(metavar="TEST", help="Held-out poses, never used for fitting.")] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option(metavar="EFFECT[@OWNER]", help="A cause to leave out of the search; repeatable."),
    ] = None,
    sigma_mm: Annotated[
        float | None, typer.Option(min=1e-6, help="Standard deviation of a measured coordinate, if known.")
    ] = None,
    corners: Corners = None,
    test_corners: TestCorners = None,
    mend: Mend = False,
    hand_eye: HandEyes = None,
    as_read: AsRead = False,
    threads: Threads = 1,
    tracker: Tracker | None = None,
    page_language: PageLanguage = "en",
    who: Who | None = None,
) -> None:
    """Find what the model is missing and add it.

    Reports the cause if the data single it out; otherwise the causes that fit equally well, or the place of the error.
    """
    from fastcal import diagnosis
    from fastcal.cli.cells import diagnose_cell, not_given
    from fastcal.cli.hand_eye import check_hand_eyes, write
    from fastcal.importers.corners import load_seen
    from fastcal.io.folder import check_folder
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tree_file import is_cell
    from fastcal.report.diagnosis_report import FILES, write_diagnosis
    from fastcal.robot.hand_eye import hand_eyes
    from fastcal.robot.made_by import made_by
    from fastcal.units import to_si

    sigma = None if sigma_mm is None else to_si(sigma_mm, "mm")
    if is_cell(robot):
        only_of_arms: dict[str, tuple[Any, Any]] = {"--tracker": (tracker, None), **not_given(who)}
        seen = (corners, test_corners)
        options = (exclude or [], sigma, as_read, mend, threads, page_language, only_of_arms)
        diagnose_cell(robot, data, output, test, seen, *options, hand_eye or [])
        return
    check_folder(output, FILES)
    nominal = load_robot(robot)
    check_hand_eyes(hand_eye or [], nominal)
    measured = seen_by(tracker, load_seen(data, nominal, corners))
    origin = made_by(nominal, measured, who)
    other = None if test is None else load_seen([test], nominal, test_corners)
    with progress() as show:
        found = diagnosis.diagnose(
            nominal,
            measured,
            test=other,
            exclude=exclude or (),
            sigma=sigma,
            as_read=as_read,
            mend=mend,
            threads=threads,
            progress=show,
        )
        show("writing the report")
        write_diagnosis(found, output, made_by=origin, language=page_language)
    if hand_eye:
        write(hand_eyes(found.model.description), found.model.spec["joints"] != nominal.spec["joints"], hand_eye)
    warn(found.notes)
    say_diagnosis(found, output)
    if found.status != "converged":
        raise typer.Exit(NOT_CONVERGED)


def say_diagnosis(found: Diagnosis, output: Path) -> None:
    """The verdict in a few lines; the last is the report's path."""
    from fastcal.report.summaries import summary

    tell(found, summary(found), output)
