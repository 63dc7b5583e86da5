# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compensate`: target poses, or a robot program, in; commands that bring the calibrated robot there out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from fastcal.cli.cell_arm import load_arm
from fastcal.cli.compensate_programs import compensate_programs, spread
from fastcal.cli.console import emit, progress, say, warn
from fastcal.cli.options import ModelFile, OfCell, OutFile, Threads
from fastcal.said import said

if TYPE_CHECKING:
    from fastcal.compensation import Compensation, Targets
    from fastcal.robot.robot import Robot


_STATUSES = {
    "reached": said("reached"),
    "limit": said("limit"),
    "unreachable": said("unreachable"),
    "singular": said("singular"),
    "bad_target": said("bad_target"),
    "configuration": said("configuration"),
}


def compensate(
    model: ModelFile,
    targets: Annotated[
        Path,
        typer.Argument(
            metavar="TARGETS",
            help="A table of poses, a program (.mod .prg .src .dat .ls .script), or a folder of them.",
        ),
    ],
    output: OutFile,
    method: Annotated[
        Literal["full", "one-step"], typer.Option(help="Iterate to convergence, or take one Jacobian step.")
    ] = "full",
    nominal: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="The controller's own model; default: the one stored in MODEL."),
    ] = None,
    single: Annotated[
        bool, typer.Option("--single", help="The rows are single points, not a path: each is solved separately.")
    ] = False,
    hold: Annotated[
        list[int] | None,
        typer.Option(metavar="JOINT", help="A joint, counted from 1, that keeps the position of the first row's seed."),
    ] = None,
    path: Annotated[
        Literal["line", "arc"] | None,
        typer.Option(
            help="The rows are joined by lines, or by arcs through every second row: report the error in between."
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="With --path: write an HTML page with the error along the path."),
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(metavar="CELL", help="For a program: tools and frames that it refers to by name only."),
    ] = None,
    payload_kg: Annotated[
        float | None, typer.Option(min=0, help="For a program: payload; default: as it states. A table has a column.")
    ] = None,
    temperature_c: Annotated[
        float | None, typer.Option(help="For a program: temperature of the arm; a table has a column for it.")
    ] = None,
    inverse: Annotated[
        bool, typer.Option("--inverse", help="Reverse: turn a compensated program back into the nominal one.")
    ] = False,
    again: Annotated[
        bool, typer.Option("--again", help="Compensate a program even if it is marked as compensated.")
    ] = False,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Exit with code 5 if a part of a program was not understood and left unchanged."),
    ] = False,
    corrections: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write the correction of each target, as CSV.")
    ] = None,
    name: OfCell = "",
    threads: Threads = 1,
) -> None:
    """Correct target poses or a robot program for the real arm.

    A table of poses becomes a table of joint positions; a program, or each program in a folder, becomes the same
    program with corrected targets.
    """
    from fastcal.errors import InvalidInput
    from fastcal.io.tree_file import is_cell
    from fastcal.programs import language_of, other_language, refusal
    from fastcal.units import to_si

    conditions: dict[str, float] = {}
    if payload_kg is not None:
        conditions["payload"] = payload_kg
    if temperature_c is not None:
        conditions["temperature"] = to_si(temperature_c, "c")
    before = None if nominal is None else load_arm(nominal, name if is_cell(nominal) else "")[0]
    options: dict[str, Any] = {"nominal": before, "method": method}
    options["threads"] = threads
    if (report is not None and path is None) or (path is not None and (single or hold or method != "full")):
        raise InvalidInput("--report needs --path, and --path takes neither --single, --hold nor --method one-step")
    if language_of(targets.name) is not None or targets.is_dir():
        if path is not None:
            raise InvalidInput(f"{targets}: --path is for tables of poses, and this is a robot program")
        asked = options | conditions | {"inverse": inverse, "again": again}
        compensate_programs(_arm(model, name, before), targets, output, cell, corrections, asked, strict=strict)
    elif (other := other_language(targets.name)) is not None:
        raise InvalidInput(refusal(str(targets), other))
    elif inverse:
        raise InvalidInput(
            f"{targets}: --inverse is for robot programs; fastcal predict says where a table of joint positions leads"
        )
    elif conditions or cell is not None or again or strict:
        raise InvalidInput(
            f"{targets}: --cell, --payload-kg, --temperature-c, --again and --strict are for robot programs"
        )
    else:
        _table(
            _arm(model, name, before),
            targets,
            output,
            options | {"along_path": not single, "hold": hold or ()},
            path,
            report,
            corrections,
        )


def _arm(model: str, name: str, nominal: Robot | None) -> Robot:
    """The arm of MODEL, which keeps what it was before or is given beside that."""
    from fastcal.errors import InvalidInput

    robot, forgets_nominal = load_arm(model, name)
    if forgets_nominal and nominal is None:
        raise InvalidInput(
            f"{model}: a cell does not keep its nominal geometry; give --nominal with the cell file that was calibrated"
        )
    return robot


def _table(
    robot: Robot,
    path: Path,
    output: Path,
    options: dict[str, Any],
    kind: str | None,
    report: Path | None,
    corrections: Path | None,
) -> None:
    """A table of poses into a table of commands."""
    from fastcal.compensation import compensate, path_accuracy
    from fastcal.io.targets import load_targets, write_commands
    from fastcal.report.language import _
    from fastcal.units import from_si

    wanted = load_targets(path, robot)
    with progress() as show:
        show("compensating")
        found = compensate(robot, wanted, **options)
        if kind is not None:
            show("driving along the path")
            driven = path_accuracy(robot, wanted, kind=kind, nominal=options["nominal"], threads=options["threads"])
    residual = (found.position_error, found.rotation_error)
    write_commands(output, robot, found.q, residual, found.sigma, found.status, found.correction_weight)
    if corrections is not None:
        _corrections(robot, corrections, wanted, found, options["nominal"])
    warn(found.notes)
    _say(found)
    if kind is None:
        emit(_figures(found))
        return
    along = {}
    for name, size, off in (("without", driven.before, driven.off_before), ("with", driven.after, driven.off_after)):
        mean, most, aside = (from_si(float(value), "mm") for value in (size.mean(), size.max(), off.max()))
        sizes = _(
            "mean {mean:.4f} mm, largest {most:.4f} mm, perpendicular to the path {aside:.4f} mm",
            mean=float(mean),
            most=float(most),
            aside=float(aside),
        )
        say(
            _("error on the path with compensation: {sizes}", sizes=sizes)
            if name == "with"
            else _("error on the path without compensation: {sizes}", sizes=sizes)
        )
        along[f"{name}_compensation"] = {"mean_mm": mean, "largest_mm": most, "perpendicular_mm": aside}
    emit(_figures(found) | {"path": along})
    if report is not None:
        from fastcal.report import write_path_report

        write_path_report(driven, robot.name, report, targets_name=path.name)
        say(str(report))


def _corrections(robot: Robot, path: Path, wanted: Targets, found: Compensation, nominal: Robot | None) -> None:
    """By how much the commanded pose of each reached row differs from the target, along the measuring frame's axes."""
    import numpy as np

    from fastcal.compensation.commands import shifts
    from fastcal.io.corrections_out import write_corrections

    rows = np.flatnonzero(found.reached & np.isfinite(found.nominal_q).all(axis=1))
    shift, error = shifts(robot, found, wanted, rows, nominal)
    joints = found.q[rows] - found.nominal_q[rows]
    write_corrections(path, robot, {"row": rows.tolist()}, shift, joints, error, found.sigma[rows])


def _figures(found: Compensation) -> dict[str, Any]:
    """The summary as plain data."""
    from fastcal.units import from_si

    counts = {status: int((found.status == status).sum()) for status in dict.fromkeys(found.status.tolist())}
    left = {"mm": found.position_error[found.reached], "deg": found.rotation_error[found.reached]}
    largest = {
        f"largest_residual_{u}": float(from_si(each, u).max()) if len(each) else None for u, each in left.items()
    }
    return {"targets": len(found), "status": counts, **largest}


def _say(found: Compensation) -> None:
    """The result in a line or two."""
    import numpy as np

    from fastcal.report.language import _
    from fastcal.units import from_si

    counts = {status: int((found.status == status).sum()) for status in dict.fromkeys(found.status.tolist())}
    listed = ", ".join(f"{count} {_(_STATUSES.get(status, status))}" for status, count in counts.items())
    say(f"{_('1 target') if len(found) == 1 else _('{count} targets', count=len(found))}: {listed}")
    if found.reached.any():
        left = from_si(float(np.max(found.position_error[found.reached])), "mm")
        turn = from_si(float(np.max(found.rotation_error[found.reached])), "deg")
        sizes = {"left": float(left), "turn": float(turn)}
        text = _("predicted error of the reached ones: at most {left:.3g} mm and {turn:.3g} deg", **sizes)
        say(text + spread(found.sigma[found.reached]))
