# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal calibrate`: a robot and its measurements in; model.yaml, result.json and report.html out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fastcal.cli.console import NOT_CONVERGED, emit, fail, progress, say, warn
from fastcal.cli.options import (
    AsRead,
    Corners,
    DataFiles,
    HandEyes,
    Loss,
    Mend,
    Method,
    OutFolder,
    PageLanguage,
    RobotFile,
    Rule,
    Solver,
    TestCorners,
    Threads,
    left_out_geometry,
    words_of,
)
from fastcal.cli.tracker import Tracker, seen_by
from fastcal.cli.who import Who

if TYPE_CHECKING:
    from fastcal.calibration.acceptance_limit import LimitJudged
    from fastcal.calibration.calibrate import CalibrationResult
    from fastcal.selection.choose_parameters import Selection


def calibrate(
    robot: RobotFile,
    data: DataFiles,
    output: OutFolder,
    test: Annotated[Path | None, typer.Option(metavar="TEST", help="Held-out poses, never used for fitting.")] = None,
    corners: Corners = None,
    test_corners: TestCorners = None,
    mend: Mend = False,
    hand_eye: HandEyes = None,
    effects: Annotated[
        str,
        typer.Option(
            metavar="LIST",
            help="Effects to identify beside base, tool, cameras and boards; none: these alone, with the arm as it is.",
        ),
    ] = "geometry",
    method: Annotated[Method, typer.Option(help="Minimization method.")] = "nls",
    solver: Annotated[
        Solver,
        typer.Option(
            help=(
                "For nls. newton: Newton steps with the exact second derivatives of the loss, and Ceres' trust "
                "region if a step is rejected or a bound is active; ceres: Ceres' trust region only."
            )
        ),
    ] = "newton",
    loss: Annotated[Loss, typer.Option(help="Robust loss on the whitened error of a row.")] = "tukey",
    priors: Annotated[
        bool | None,
        typer.Option(
            "--priors/--no-priors",
            help=(
                "Hold all parameters near nominal, or none. By default only the geometry is held, if there are few "
                "poses for the noise; the data determine how strongly."
            ),
        ),
    ] = None,
    choose: Annotated[
        Rule | None,
        typer.Option(
            help=(
                "Identify only the parameters that predict held-out poses best, or the fewest that do so within one "
                "standard error; the others keep their nominal values."
            )
        ),
    ] = None,
    limit_mm: Annotated[
        float | None,
        typer.Option(metavar="L", help="Acceptance limit of the error of a pose, judged on the test poses."),
    ] = None,
    page_language: PageLanguage = "en",
    as_read: AsRead = False,
    threads: Threads = 1,
    tracker: Tracker | None = None,
    who: Who | None = None,
) -> None:
    """Identify a robot from measured poses."""
    from fastcal.calibration import calibrate as calibration
    from fastcal.calibration import inspection
    from fastcal.calibration.acceptance_limit import judge_limit
    from fastcal.cli.hand_eye import check_hand_eyes, write_hand_eyes
    from fastcal.errors import InvalidInput
    from fastcal.importers.corners import load_seen, load_seen_or_open, picture_files
    from fastcal.io.folder import check_folder
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tree_file import is_cell
    from fastcal.measurements.dataset import Dataset
    from fastcal.report.calibration_files import FILES, write_calibration
    from fastcal.selection.choose_parameters import choose_parameters
    from fastcal.units import to_si

    if is_cell(robot):
        from fastcal.cli.cells import calibrate_cell, not_given

        only_of_arms: dict[str, tuple[Any, Any]] = {
            "--method": (method, "nls"),
            "--solver": (solver, "newton"),
            "--priors": (priors, None),
            "--choose": (choose, None),
            "--limit-mm": (limit_mm, None),
            "--tracker": (tracker, None),
            **not_given(who),
        }
        both = (corners, test_corners)
        calibrate_cell(
            robot,
            data,
            output,
            test,
            both,
            effects,
            {"mend": mend, "loss": loss, "as_read": as_read, "threads": threads},
            only_of_arms,
            hand_eye or [],
            page_language,
        )
        return
    _check_options(limit_mm, choose, least_squares=method == "nls" and solver == "newton" and not priors)
    check_folder(output, FILES)
    nominal = load_robot(robot)
    check_hand_eyes(hand_eye or [], nominal)
    measured = load_seen_or_open(data, nominal, corners, lambda rows: seen_by(tracker, rows))
    if choose is not None and not isinstance(measured, Dataset):
        raise InvalidInput(
            f"{measured.source}: --choose holds rows out again and again: it needs them in memory, and takes fewer"
        )
    other = None if test is None else load_seen([test], nominal, test_corners)
    with progress() as show:
        given: dict[str, Any] = {"test": other, "effects": effects, "loss": loss, "as_read": as_read}
        minimized: dict[str, Any] = {"method": method, "solver": solver}
        given |= {"threads": threads, "progress": show, "who": who}
        choice = None
        if choose is not None and isinstance(measured, Dataset):
            choice = choose_parameters(nominal, measured, rule=choose, **given)
        found = (
            choice.result
            if choice
            else calibration.calibrate(nominal, measured, **minimized, priors=priors, mend=mend, **given)
        )
        notes = [*left_out_geometry(effects), *found.notes, *inspection.readback_notes(nominal, found.train.data)]
        if found.degrees_of_freedom <= 0:
            notes.append(
                "as many parameters as measured numbers: nothing is left to estimate the noise or any standard "
                "deviation from"
            )
        found = replace(found, notes=notes)
        show("writing the report")
        limit = None if limit_mm is None else judge_limit(found, to_si(limit_mm, "mm"))
        more = None if choice is None else {"choice": choice.to_json_dict()}
        seen_in = picture_files(corners)
        write_calibration(found, output, more=more, limit=limit, language=page_language, pictures=seen_in)
    warn(found.notes)
    write_hand_eyes(found, hand_eye or [])
    if limit is not None:
        say_limit(limit)
    if other is not None:
        warn(f"{test}: {note}" for note in other.notes if note not in found.notes)
    if choice is not None:
        say_choice(choice)
    seen = [] if corners is None else ["--corners", str(corners)]
    say_result(found, output, [*words_of(robot), *map(str, data), *seen])
    if found.status != "converged":
        model = "model.yaml is what could be fitted, not to be relied on" if found.parameters else "no model.yaml"
        fail(f"{found.status.replace('_', ' ')}: {found.message}; {model}")
        raise typer.Exit(NOT_CONVERGED)


def _check_options(limit_mm: float | None, choose: Rule | None, *, least_squares: bool) -> None:
    from fastcal.errors import InvalidInput

    if limit_mm is not None and not limit_mm > 0:
        raise InvalidInput(f"--limit-mm must be above 0, got {limit_mm:g}")
    if choose is not None and not least_squares:
        raise InvalidInput(
            "--choose compares sets by least squares without priors: leave out --priors, --method and --solver"
        )


def say_limit(limit: LimitJudged) -> None:
    """Whether the poses keep the acceptance limit."""
    from fastcal.report.language import _
    from fastcal.units import from_si

    verdicts = {"pass": _("pass"), "fail": _("fail"), "cannot_tell": _("cannot tell")}
    numbers = {"limit": float(from_si(limit.limit, "mm")), "beyond": limit.beyond, "poses": limit.poses}
    on = _("test") if limit.on_test else _("training")
    verdict = verdicts[limit.verdict]
    say(_("limit {limit:g} mm: {verdict}; {beyond} of {poses} {on} poses beyond it", verdict=verdict, on=on, **numbers))


def say_choice(choice: Selection) -> None:
    """What was chosen, and what it gains where poses were held out."""
    from fastcal.report.language import _

    best = next(candidate for candidate in choice.table if candidate.parameters == choice.parameters)
    say(
        _(
            "chosen: {count} of {all} parameters besides base and tool, of {sets} sets: {names}",
            count=len(choice.parameters),
            all=len(choice.full.parameters),
            sets=choice.evaluated,
            names=", ".join(choice.parameters) or _("none"),
        )
    )
    chosen, full = choice.rms_mm(best), choice.rms_mm(choice.full)
    if chosen is not None and full is not None:
        sizes = {"chosen": float(chosen), "full": float(full)}
        say(_("error of a coordinate on held-out poses: {chosen:.4f} mm, {full:.4f} mm with all parameters", **sizes))


def say_result(result: CalibrationResult, output: Path, inputs: Sequence[str] = ()) -> None:
    """The result in a few lines; the last two are what to do next and the report's path.

    Args:
        result: What was found.
        output: The folder that it was written into.
        inputs: ROBOT and DATA, for a command line that can be copied.
    """
    from fastcal.report.next_step import next_step
    from fastcal.report.summaries import summary

    for line in summary(result):
        say(line)
    say(next_step(result, [*inputs, "-o", f"{output}_diagnosis"] if inputs else []))
    say(str(output / "report.html"))
    emit(result.to_json_dict())
