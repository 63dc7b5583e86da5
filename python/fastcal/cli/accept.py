# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal accept`: the ISO 9283 test as a robot program, and a verdict on what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from fastcal.cli.accept_path import judge_path, plan_path_test
from fastcal.cli.cell_arm import load_arm
from fastcal.cli.console import emit, progress, say, tell, warn
from fastcal.cli.options import DwellS, OfCell, PageLanguage, SpeedPercent, file_names, three_numbers
from fastcal.cli.who import Who

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance
    from fastcal.robot.robot import Robot

CANNOT_TELL, FAILED = 3, 4


def accept(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A calibrated robot, or a nominal one.")],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="OUT", help="With --plan the file of the program, otherwise a folder."),
    ],
    data: Annotated[
        list[Path] | None, typer.Argument(metavar="[DATA...]", help="The measurements of the test.")
    ] = None,
    plan: Annotated[bool, typer.Option("--plan", help="Write the robot program and its plan, OUT_plan.csv.")] = False,
    language: Annotated[
        Literal["rapid", "krl", "fanuc", "urscript"] | None, typer.Option(help="Language of the program.")
    ] = None,
    compensated: Annotated[
        bool,
        typer.Option("--compensated", help="Command the joint positions that bring the calibrated arm to the poses."),
    ] = False,
    directions: Annotated[
        bool, typer.Option("--directions", help="Also approach P1, P2 and P4 from three sides, for vAP.")
    ] = False,
    cycles: Annotated[
        int | None, typer.Option(min=1, help="Visits of each pose, default 30; with --path runs, default 10.")
    ] = None,
    centre_mm: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="Centre of the cube in the base frame; default: the largest cube."),
    ] = None,
    edge_mm: Annotated[float | None, typer.Option(help="Edge length of the cube.")] = None,
    tool_rpy_deg: Annotated[
        str | None,
        typer.Option(metavar="R,P,Y", help="Orientation of the tool in the base frame, the same in all poses."),
    ] = None,
    payload_kg: Annotated[float, typer.Option(min=0, help="Payload.")] = 0.0,
    temperature_c: Annotated[
        float | None,
        typer.Option(help="With --plan --compensated: temperature of the arm; default: the median of MODEL's data."),
    ] = None,
    dwell_s: DwellS = 3.0,
    speed_percent: SpeedPercent = 50.0,
    targets: Annotated[
        Path | None, typer.Option(metavar="PLAN", help="The plan: which pose was commanded when.")
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(metavar="CORNERS", help="DATA are recordings of a path of straight lines through these points."),
    ] = None,
    speed_mm_s: Annotated[float, typer.Option(help="With --plan --path: speed along the lines.")] = 100.0,
    blend_mm: Annotated[
        float, typer.Option(help="With --plan --path: radius of the zone at corners; 0: the arm stops there.")
    ] = 0.0,
    tolerance_mm: Annotated[
        float | None, typer.Option(metavar="T", help="Limit for AP, the accuracy of each pose; with --path for AT.")
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE", help="A further limit, such as rp_mm=0.05, or with --path rt_mm=0.1; repeatable."
        ),
    ] = None,
    budget: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="YAML file with the uncertainties of instrument and conditions."),
    ] = None,
    align: Annotated[
        Literal["fit", "model"] | None,
        typer.Option(help="Fit the instrument's frame, or take MODEL's base; default: fit, with --path model."),
    ] = None,
    name: OfCell = "",
    page_language: PageLanguage = "en",
    who: Who | None = None,
) -> None:
    """Test an arm by ISO 9283: the program, then the verdict.

    Exit code 0: within the limits, or none were given. 4: a limit is exceeded. 3: the measurement cannot decide.
    """
    from fastcal.errors import InvalidInput
    from fastcal.units import to_si

    robot, forgets_nominal = load_arm(model, name)
    if forgets_nominal and compensated:
        raise InvalidInput(
            f"{model}: a cell does not keep its nominal geometry, from which --compensated corrects; plan without it, "
            "and compensate the program with --nominal"
        )
    if plan:
        if data or targets or tolerance_mm or limit or budget:
            raise InvalidInput("--plan takes no DATA, --targets, --tolerance-mm, --limit or --budget, which judge")
        if language is None:
            raise InvalidInput("--plan needs --language rapid, krl, fanuc or urscript")
        options = {
            "language": language,
            "compensate": compensated,
            "rotation": _rotation(tool_rpy_deg),
            "payload": payload_kg,
            "temperature": None if temperature_c is None else to_si(temperature_c, "c"),
            "dwell_s": dwell_s,
            **({} if cycles is None else {"cycles": cycles}),
        }
        placed = {"directions": directions} | _placed(centre_mm, edge_mm)
        if path is None:
            _plan(robot, output, options | placed | {"speed": speed_percent / 100})
        else:
            driven = {"speed": to_si(speed_mm_s, "mm"), "blend": to_si(blend_mm, "mm")}
            plan_path_test(robot, path, output, options | driven, placed)
        return
    if path is not None:
        if targets or budget:
            raise InvalidInput("--path takes no --targets or --budget: how sure its figures are, its runs show")
        limits = _limits(limit or [], tolerance_mm, "at_mm")
        verdict = judge_path(robot, data or [], path, output, page_language, align=align == "fit", limits=limits)
    else:
        if not data:
            raise InvalidInput("expected DATA to judge, or --plan to write the program")
        options = {"limits": _limits(limit or [], tolerance_mm, "ap_mm"), "align": align != "model", "who": who}
        verdict = _judge(robot, data, output, targets, budget, options, page_language).verdict
    if verdict in ("fail", "cannot_tell"):
        raise typer.Exit(FAILED if verdict == "fail" else CANNOT_TELL)


def _plan(robot: Robot, output: Path, options: dict[str, Any]) -> None:
    """The program and, beside it, the plan."""
    from fastcal.acceptance import plan_acceptance
    from fastcal.io.acceptance_plan import write_test
    from fastcal.programs.measuring import check_axes
    from fastcal.report.language import _
    from fastcal.units import from_si

    check_axes(robot.axis_types)  # before the search for the cube, which may take long
    with progress() as show:
        show("placing the cube")
        made = plan_acceptance(robot, program=output.name, **options)
    files = write_test(output, made, robot)
    warn(made.notes)
    x, y, z = map(float, from_si(made.cube.centre, "mm"))
    edge = float(from_si(made.cube.edge, "mm"))
    say(
        _(
            "cube with an edge of {edge:g} mm about {x:.1f}, {y:.1f}, {z:.1f} mm in the base; {stops} measured stops",
            edge=edge,
            x=x,
            y=y,
            z=z,
            stops=len(made.visits),
        )
    )
    for file in files:
        say(str(file))
    emit(
        {
            "centre_mm": from_si(made.cube.centre, "mm"),
            "edge_mm": edge,
            "visits": len(made.visits),
            "compensated": made.compensated,
            "temperature_c": None if made.temperature is None else from_si(made.temperature, "c"),
            "files": list(map(str, files)),
        }
    )


def _judge(
    robot: Robot,
    data: list[Path],
    output: Path,
    targets: Path | None,
    budget: Path | None,
    options: dict[str, Any],
    language: str,
) -> Acceptance:
    """Figures, verdict and files."""
    from fastcal.acceptance import accept as accepted
    from fastcal.importers import load_measurements
    from fastcal.io.acceptance_plan import load_plan
    from fastcal.io.budget_file import load_budget
    from fastcal.io.folder import check_folder
    from fastcal.report.acceptance_report import FILES, write_acceptance
    from fastcal.report.acceptance_summary import acceptance_lines

    check_folder(output, FILES)
    visits = None if targets is None else load_plan(targets, robot)
    known = None if budget is None else load_budget(budget)
    measured = load_measurements(data, robot)
    with progress() as show:
        show("judging")
        found = accepted(robot, measured, plan=visits, budget=known, **options)
        write_acceptance(found, output, language=language)
    warn([*measured.notes, *found.notes])
    tell(found, acceptance_lines(found, file_names(data)), output)
    return found


def _limits(given: list[str], tolerance_mm: float | None, of_tolerance: str) -> dict[str, float]:
    """NAME=VALUE as a dict, and the limit that --tolerance-mm gives."""
    from fastcal.errors import InvalidInput

    out: dict[str, float] = {}
    for text in given:
        name, _, value = text.partition("=")
        try:
            out[name.strip()] = float(value)
        except ValueError:
            raise InvalidInput(f"--limit takes NAME=VALUE such as rp_mm=0.05, got '{text}'") from None
    return out if tolerance_mm is None else out | {of_tolerance: tolerance_mm}


def _placed(centre_mm: str | None, edge_mm: float | None) -> dict[str, Any]:
    """Where the cube is and how large, as `plan_acceptance` takes it."""
    from fastcal.units import to_si

    return {
        "centre": None if centre_mm is None else _lengths("--centre-mm", centre_mm),
        "edge": None if edge_mm is None else to_si(edge_mm, "mm"),
    }


def _lengths(option: str, text: str) -> Any:
    import numpy as np

    from fastcal.units import to_si

    return to_si(np.array(three_numbers(option, text)), "mm")


def _rotation(text: str | None) -> Any:
    if text is None:
        return None
    import numpy as np

    from fastcal.robot.se3 import rpy_to_rotation
    from fastcal.units import to_si

    return rpy_to_rotation(to_si(np.array(three_numbers("--tool-rpy-deg", text)), "deg"))
