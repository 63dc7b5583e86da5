# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal design`: which poses to measure, in which order, with which payload and direction of approach.

The table, and a program that drives there.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from fastcal.cli.console import emit, progress, say, warn
from fastcal.cli.options import BesideLanguage, DwellS, OutFile, RobotFile, Seed, SpeedPercent, Threads, Views, no_views

if TYPE_CHECKING:
    from fastcal.design import PoseDesign
    from fastcal.measurements.dataset import Dataset
    from fastcal.measurements.targets import Targets
    from fastcal.robot.robot import Robot


def design(
    robot: RobotFile,
    output: OutFile,
    count: Annotated[int, typer.Option(min=1, help="Number of poses; with --until-sigma-mm the maximum.")],
    effects: Annotated[
        str, typer.Option(metavar="LIST", help="Effects to be identified, such as geometry,joint_compliance@joint2.")
    ] = "geometry",
    criterion: Annotated[
        Literal["O1", "O2", "O3", "O4", "O5", "variance"] | None,
        typer.Option(help="An observability index (O1), or the mean variance of predictions at the targets."),
    ] = None,
    targets: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Poses or joint positions where the arm will work; selects by the variance there."
        ),
    ] = None,
    separate: Annotated[
        str | None,
        typer.Option(metavar="A,B", help="Effects (EFFECT@OWNER) that half of the poses shall distinguish."),
    ] = None,
    surroundings: Annotated[
        Path | None, typer.Option(metavar="FILE", help="YAML file with keep_out, region, tracker, link_radius_mm.")
    ] = None,
    instruments: Annotated[
        Path | None, typer.Option(metavar="FILE", help="YAML file with points, levels, sigma_tilt_mrad, planes.")
    ] = None,
    payload_kg: Annotated[str, typer.Option(metavar="LIST", help="Available payloads, such as 0,6,12.")] = "0",
    corners: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Corners detected by cameras in the poses of --measured.")
    ] = None,
    sigma_px: Annotated[
        float | None, typer.Option(min=1e-6, help="Standard deviation of a corner in a picture.")
    ] = None,
    focus_mm: Annotated[
        str | None, typer.Option(metavar="NEAR,FAR", help="Range of board distances at which pictures are sharp.")
    ] = None,
    measured: Annotated[
        Path | None, typer.Option(metavar="DATA", help="Poses already measured; the design adds to them.")
    ] = None,
    until_sigma_mm: Annotated[
        float | None, typer.Option(help="Stop when the predicted standard deviation of a coordinate is below this.")
    ] = None,
    sigma_mm: Annotated[float | None, typer.Option(help="Standard deviation of a measured coordinate.")] = None,
    sigma_rot_deg: Annotated[
        float | None,
        typer.Option(help="Standard deviation of a measured orientation; without it only positions are measured."),
    ] = None,
    candidates: Annotated[
        Literal["grid", "random"], typer.Option(help="Candidates on a grid over the joints, or random postures.")
    ] = "grid",
    candidate_count: Annotated[int, typer.Option(min=2, help="Maximum number of candidates.")] = 80_000,
    restarts: Annotated[int, typer.Option(min=0, help="Additional searches from random designs.")] = 0,
    views: Views = "",
    language: BesideLanguage = None,
    dwell_s: DwellS = 3.0,
    speed_percent: SpeedPercent = 20.0,
    seed: Seed = 0,
    threads: Threads = 1,
) -> None:
    """Choose the poses to measure: a CSV file and a program.

    For a cell with cameras and boards, designs poses for pictures, unless an option for measured points is given.
    """
    from fastcal.cli.design_pictures import design_of_pictures
    from fastcal.design import design_poses
    from fastcal.io.design_out import design_candidates, program_beside, write_poses_and_program
    from fastcal.io.instruments_file import load_instruments
    from fastcal.io.measurements import load_measurements
    from fastcal.io.robot_file import load_robot
    from fastcal.io.surroundings_file import load_surroundings
    from fastcal.io.tree_file import is_cell
    from fastcal.report.language import _
    from fastcal.robot.rig import has_rig
    from fastcal.units import from_si, to_si

    if is_cell(robot):
        from fastcal.cli.cell_uses import design_cell

        chosen = {"restarts": restarts, "seed": seed, "threads": threads}
        of_one_arm = {
            "--effects": (effects, "geometry"),
            "--criterion": (criterion, None),
            "--targets": (targets, None),
            "--separate": (separate, None),
            "--surroundings": (surroundings, None),
            "--instruments": (instruments, None),
            "--payload-kg": (payload_kg, "0"),
            "--corners": (corners, None),
            "--measured": (measured, None),
            "--until-sigma-mm": (until_sigma_mm, None),
            "--language": (language, None),
        }
        design_cell(robot, output, count, views, (sigma_mm, sigma_rot_deg, sigma_px), focus_mm, chosen, of_one_arm)
        return
    no_views(views)
    arm = load_robot(robot)
    place = program_beside(output, arm, language)
    around = None if surroundings is None else load_surroundings(surroundings)
    driving: dict[str, Any] = {"surroundings": around, "dwell_s": dwell_s, "speed": speed_percent / 100}
    of_points = (criterion, targets, separate, instruments, until_sigma_mm, sigma_mm, sigma_rot_deg)
    if has_rig(arm.description) and not any(option is not None for option in of_points):
        of_pictures = {"--effects": (effects, "geometry"), "--payload-kg": (payload_kg, "0")}
        options = {"sigma_px": sigma_px, "seed": seed, "threads": threads}
        design_of_pictures(arm, count, output, place, measured, corners, focus_mm, of_pictures, options, driving)
        return
    with progress() as show:
        found = design_poses(
            arm,
            count,
            effects=effects,
            criterion=criterion or ("O1" if targets is None else "variance"),
            targets=None if targets is None else _targets(targets, arm),
            candidates=candidates,
            candidate_count=candidate_count,
            surroundings=around,
            instruments=None if instruments is None else load_instruments(instruments),
            payloads=_masses(payload_kg),
            separate=[] if separate is None else [name.strip() for name in separate.split(",")],
            measured=None if measured is None else load_measurements(measured, arm, require_measured=False),
            until_sigma=None if until_sigma_mm is None else to_si(until_sigma_mm, "mm"),
            sigma=None if sigma_mm is None else to_si(sigma_mm, "mm"),
            sigma_rotation=None if sigma_rot_deg is None else to_si(sigma_rot_deg, "deg"),
            restarts=restarts,
            seed=seed,
            threads=threads,
            progress=show,
        )
    poses = design_candidates(found)
    files, notes = write_poses_and_program(output, poses, arm, place, **driving)
    _say(found, separate)
    for line in [*(_("program: {file}", file=file) for file in files[1:]), *notes]:
        say(line)
    emit(
        {
            "poses": len(found),
            "candidates": found.candidate_count,
            "rejected": found.rejected,
            "criterion": found.criterion,
            "observability": found.observability,
            "sigma_mm": from_si(found.sigma, "mm"),
            "efficiency": found.efficiency,
            "unidentifiable": found.unidentifiable,
            "enough": found.enough,
            "files": list(map(str, files)),
        }
    )
    warn(found.notes)
    if not found.enough:
        warn([f"{until_sigma_mm} mm is not reached with {len(found)} poses"])


def _targets(path: Path, arm: Robot) -> Targets | Dataset:
    """Poses of the tool where the file has points, else joint positions."""
    from fastcal.io.columns import match_columns
    from fastcal.io.measurements import load_measurements
    from fastcal.io.tables import read_table
    from fastcal.io.targets import load_targets

    known, _ = match_columns(read_table(path), arm.joint_types)
    return load_targets(path, arm) if "x" in known else load_measurements(path, arm, require_measured=False)


def _say(found: PoseDesign, separate: str | None) -> None:
    """The design in a few lines."""
    from fastcal.report.language import _

    for line in found.summary().splitlines():
        say(line)
    if found.separation is not None and separate is not None:
        names = [name.strip() for name in separate.split(",")]
        before, after = found.separation.power_before, found.separation.power_after
        for i, present in enumerate(names):
            for j, fitted in enumerate(names):
                if i != j:
                    text = _(
                        "{fitted} in place of {present} is refused: {before:.0f} % before, {after:.0f} % after",
                        fitted=fitted,
                        present=present,
                        before=100.0 * float(before[i, j]),
                        after=100.0 * float(after[i, j]),
                    )
                    say(text)


def _masses(text: str) -> list[float]:
    from fastcal.errors import InvalidInput

    try:
        return [float(mass) for mass in text.split(",")]
    except ValueError:
        raise InvalidInput(f"--payload-kg takes masses, such as 0,6,12; got '{text}'") from None
