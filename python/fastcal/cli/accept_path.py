# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal accept --path`: the program that drives a path, and what its recordings show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastcal.cli.console import emit, say, warn

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fastcal.acceptance import PathRun
    from fastcal.acceptance.judgement import Verdict
    from fastcal.robot.robot import Robot


def plan_path_test(robot: Robot, corners: Path, output: Path, options: dict[str, Any], placed: dict[str, Any]) -> None:
    """The program that drives a path and, beside it, the corners that judge its recordings; `placed` is of the cube."""
    from fastcal.acceptance import plan_path
    from fastcal.errors import InvalidInput
    from fastcal.io.recorded_path import load_corners, write_path_test
    from fastcal.programs.measuring import check_axes
    from fastcal.report.language import _

    if any(value is not None and value is not False for value in placed.values()):
        raise InvalidInput("--plan --path takes no --directions, --centre-mm or --edge-mm: they are of the cube")
    check_axes(robot.axis_types)
    made = plan_path(robot, load_corners(corners), program=output.name, **options)
    files = write_path_test(output, made)
    warn(made.notes)
    say(_("a path of {corners} corners", corners=len(made.corners)))
    for file in files:
        say(str(file))
    emit({"corners": len(made.corners), "compensated": made.compensated, "files": list(map(str, files))})


def _recorded(file: Path) -> PathRun:
    """A recording in fastcal's columns, or an instrument's export of points.

    Raises:
        ParseError: It is neither; says which columns would do.
    """
    from fastcal.errors import ParseError
    from fastcal.importers.importing import read
    from fastcal.importers.mapping import Mapping
    from fastcal.importers.writing import table_of
    from fastcal.io.recorded_path import load_run, run_of

    try:
        return load_run(file)
    except ParseError as own:
        try:
            (reading,) = read(file, mapping=Mapping(), wanted="points")
            return run_of(table_of(reading))
        except ValueError:  # of the importers, or several sheets
            raise own from None


def judge_path(
    robot: Robot,
    data: list[Path],
    corners: Path,
    output: Path,
    language: str,
    *,
    align: bool,
    limits: Mapping[str, float],
) -> Verdict | None:
    """Accuracy and repeatability of recorded paths, and whether they keep limits."""
    import numpy as np

    from fastcal.acceptance import judged_path, path_figures
    from fastcal.acceptance.judgement import PATH_LIMITS, parsed_limits
    from fastcal.acceptance.path_runs import aligned, runs_of
    from fastcal.io.folder import check_folder
    from fastcal.io.recorded_path import load_corners
    from fastcal.report.acceptance_summary import path_verdict_lines
    from fastcal.report.language import _
    from fastcal.report.measured_path_report import FILES, write_measured_path
    from fastcal.units import from_si

    check_folder(output, FILES)
    parsed_limits(limits, PATH_LIMITS)  # a wrong one is refused before the recordings are read
    commanded = load_corners(corners)
    turned = commanded.rotations
    kept = turned is not None and np.abs(turned - turned[0]).max() < 1e-9
    rotation = turned[0] if turned is not None and kept else None
    runs = runs_of([_recorded(file) for file in data], commanded.points, align=align)
    if align and len(runs) > 1:
        runs = aligned(runs, commanded.points, rotation)
    found = path_figures(commanded.points, runs, rotation=rotation)
    verdict = judged_path(found, limits)
    content = write_measured_path(found, robot.name, output, verdict, language=language)
    at, rt = (float(content[name]) for name in ("AT_mm", "RT_mm"))
    say(_("{runs} runs: AT {at:.4f} mm, RT {rt:.4f} mm", runs=found.runs, at=at, rt=rt))
    for corner in found.corners:
        rounding, overshoot = (from_si(float(value), "mm") for value in (corner.rounding, corner.overshoot))
        text = _(
            "corner {corner}: rounding {rounding:.4f} mm, overshoot {overshoot:.4f} mm",
            corner=corner.corner,
            rounding=rounding,
            overshoot=overshoot,
        )
        say(text)
    for line in path_verdict_lines(verdict):
        say(line)
    say(str(output / "report.html"))
    emit(content)
    return verdict.verdict
