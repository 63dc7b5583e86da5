# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal accept`: the ISO 9283 test as a robot program, and a verdict on what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from fastcal.cli.console import emit, progress, say, tell, warn
from fastcal.cli.options import DwellS, PageLanguage, SpeedPercent, file_names, three_numbers
from fastcal.cli.who import Who

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance
    from fastcal.robot.robot import Robot

CANNOT_TELL, FAILED = 3, 4


def accept(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A calibrated robot, or a nominal one.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="OUT", help="With --plan the program's file, else a folder.")
    ],
    data: Annotated[
        list[Path] | None, typer.Argument(metavar="[DATA...]", help="What was measured of the test.")
    ] = None,
    plan: Annotated[bool, typer.Option("--plan", help="Write the robot program and its plan, OUT_plan.csv.")] = False,
    language: Annotated[
        Literal["rapid", "krl", "fanuc", "urscript"] | None, typer.Option(help="Of the program.")
    ] = None,
    compensated: Annotated[
        bool, typer.Option("--compensated", help="Command what brings the calibrated arm to the poses.")
    ] = False,
    directions: Annotated[
        bool, typer.Option("--directions", help="Also approach P1, P2 and P4 from three sides, for vAP.")
    ] = False,
    cycles: Annotated[int, typer.Option(min=1, help="Visits of each pose; the standard has 30.")] = 30,
    centre_mm: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Middle of the cube in the base; default: the largest cube.")
    ] = None,
    edge_mm: Annotated[float | None, typer.Option(help="Edge of the cube.")] = None,
    tool_rpy_deg: Annotated[
        str | None, typer.Option(metavar="R,P,Y", help="Orientation of the tool in the base, in all poses.")
    ] = None,
    payload_kg: Annotated[float, typer.Option(min=0, help="What the tool carries.")] = 0.0,
    temperature_c: Annotated[
        float | None, typer.Option(help="With --plan --compensated: of the arm; default: the middle of MODEL's data.")
    ] = None,
    dwell_s: DwellS = 3.0,
    speed_percent: SpeedPercent = 50.0,
    targets: Annotated[
        Path | None, typer.Option(metavar="PLAN", help="The plan's file: what was commanded, and which pose it was.")
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(metavar="CORNERS", help="DATA are recorded paths, a run a file, of lines through these points."),
    ] = None,
    tolerance_mm: Annotated[
        float | None, typer.Option(metavar="T", help="Limit of AP, the accuracy of each pose.")
    ] = None,
    limit: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Another limit, such as rp_mm=0.05; may be repeated.")
    ] = None,
    budget: Annotated[
        Path | None, typer.Option(metavar="FILE", help="YAML: what is known of instrument and conditions.")
    ] = None,
    align: Annotated[
        Literal["fit", "model"], typer.Option(help="Fit the instrument's frame to the poses, or take MODEL's base.")
    ] = "fit",
    page_language: PageLanguage = "en",
    who: Who | None = None,
) -> None:
    """Test an arm by ISO 9283: the program, then the verdict.

    Exit code 0: within the limits, or none were given. 4: out of a limit. 3: the measurement can't decide.
    """
    from fastcal.errors import InvalidInput
    from fastcal.io.robot_file import load_robot
    from fastcal.units import to_si

    robot = load_robot(model)
    if plan:
        if data or targets or path or tolerance_mm or limit or budget:
            raise InvalidInput(
                "--plan takes no DATA, --targets, --path, --tolerance-mm, --limit or --budget: nothing is judged"
            )
        if language is None:
            raise InvalidInput("--plan needs --language rapid, krl, fanuc or urscript")
        _plan(
            robot,
            output,
            {
                "language": language,
                "compensate": compensated,
                "directions": directions,
                "cycles": cycles,
                "centre": None if centre_mm is None else _lengths("--centre-mm", centre_mm),
                "edge": None if edge_mm is None else to_si(edge_mm, "mm"),
                "rotation": None if tool_rpy_deg is None else _rotation(tool_rpy_deg),
                "payload": payload_kg,
                "temperature": None if temperature_c is None else to_si(temperature_c, "c"),
                "dwell_s": dwell_s,
                "speed": speed_percent / 100,
            },
        )
        return
    if path is not None:
        if targets or tolerance_mm or limit or budget:
            raise InvalidInput("--path takes no --targets, --tolerance-mm, --limit or --budget: nothing is judged")
        _judge_path(robot, data or [], path, output, page_language)
        return
    if not data:
        raise InvalidInput("expected DATA to judge, or --plan to write the program")
    limits = _limits(limit or [])
    if tolerance_mm is not None:
        limits["ap_mm"] = tolerance_mm
    options = {"limits": limits, "align": align == "fit", "who": who}
    found = _judge(robot, data, output, targets, budget, options, page_language)
    if found.verdict in ("fail", "cannot_tell"):
        raise typer.Exit(FAILED if found.verdict == "fail" else CANNOT_TELL)


def _plan(robot: Robot, output: Path, options: dict[str, Any]) -> None:
    """The program and, beside it, the plan."""
    from fastcal.acceptance import plan_acceptance
    from fastcal.io.acceptance_plan import write_test
    from fastcal.programs.measuring import check_axes
    from fastcal.units import from_si

    check_axes(robot.joint_types)  # before the search for the cube, which may take long
    with progress() as show:
        show("placing the cube")
        made = plan_acceptance(robot, program=output.name, **options)
    files = write_test(output, made, robot)
    warn(made.notes)
    middle = ", ".join(f"{value:.1f}" for value in from_si(made.cube.centre, "mm"))
    edge = float(from_si(made.cube.edge, "mm"))
    say(f"cube with an edge of {edge:g} mm about {middle} mm in the base; {len(made.visits)} measured stops")
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


def _judge_path(robot: Robot, data: list[Path], corners: Path, output: Path, language: str) -> None:
    """Accuracy and repeatability of recorded paths."""
    import numpy as np

    from fastcal.acceptance import path_figures
    from fastcal.io.folder import check_folder
    from fastcal.io.recorded_path import load_corners, load_run
    from fastcal.report.measured_path_report import FILES, write_measured_path
    from fastcal.units import from_si

    check_folder(output, FILES)
    commanded = load_corners(corners)
    turned = commanded.rotations
    kept = turned is not None and np.abs(turned - turned[0]).max() < 1e-9
    runs = [load_run(file) for file in data]
    found = path_figures(commanded.points, runs, rotation=turned[0] if turned is not None and kept else None)
    write_measured_path(found, robot.name, output, language=language)
    content = found.to_json_dict()
    say(f"{found.runs} runs: AT {content['AT_mm']:.4f} mm, RT {content['RT_mm']:.4f} mm")
    for corner in found.corners:
        rounding, overshoot = (from_si(float(value), "mm") for value in (corner.rounding, corner.overshoot))
        say(f"corner {corner.corner}: rounding {rounding:.4f} mm, overshoot {overshoot:.4f} mm")
    say(str(output / "report.html"))
    emit(content)


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


def _limits(given: list[str]) -> dict[str, float]:
    """NAME=VALUE as a dict."""
    from fastcal.errors import InvalidInput

    out: dict[str, float] = {}
    for text in given:
        name, _, value = text.partition("=")
        try:
            out[name.strip()] = float(value)
        except ValueError:
            raise InvalidInput(f"--limit takes NAME=VALUE such as rp_mm=0.05, got '{text}'") from None
    return out


def _lengths(option: str, text: str) -> Any:
    import numpy as np

    from fastcal.units import to_si

    return to_si(np.array(three_numbers(option, text)), "mm")


def _rotation(text: str) -> Any:
    import numpy as np

    from fastcal.robot.se3 import rpy_to_rotation
    from fastcal.units import to_si

    return rpy_to_rotation(to_si(np.array(three_numbers("--tool-rpy-deg", text)), "deg"))
