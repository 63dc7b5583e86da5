# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal predict` and `fastcal evaluate`: predictions for other poses, and how far they are from measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fastcal.cli.console import emit, progress, say, tell, warn
from fastcal.cli.options import Corners, DataFiles, ModelFile, OutFile, Threads, file_names

if TYPE_CHECKING:
    from fastcal.calibration.evaluation import Evaluation


def predict(
    model: ModelFile,
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Poses; only joint positions and conditions are read.")],
    output: OutFile,
    threads: Threads = 1,
) -> None:
    """Predict tool poses and their uncertainty, into a CSV file."""
    import numpy as np

    from fastcal.calibration.prediction import predict as predicted
    from fastcal.importers import load_measurements
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tables import write_csv
    from fastcal.io.tree_file import is_cell
    from fastcal.units import from_si

    if is_cell(model):
        from fastcal.cli.cell_uses import predict_cell

        predict_cell(model, data, output, threads)
        return
    robot = load_robot(model)
    poses = load_measurements(data, robot, require_measured=False)
    with progress() as show:
        show("predicting")
        found = predicted(robot, poses, threads=threads)
    write_csv(output, {"row": range(len(poses)), **found.columns()})
    notes = [*poses.notes, *found.notes]
    warn(notes)
    sigma = from_si(found.sigma_position, "mm")
    largest = float(sigma.max()) if np.isfinite(sigma).all() else None
    known = "" if largest is None else f"; standard deviation of a coordinate at most {largest:.3g} mm"
    turn = None if found.sigma_rotation is None else float(from_si(found.sigma_rotation, "deg").max())
    known += "" if turn is None else f", of a turn {turn:.3g} deg"
    say(f"{output}: {len(poses)} poses of {robot.name} predicted{known}")
    emit(
        {
            "file": str(output),
            "robot": robot.name,
            "poses": len(poses),
            "largest_sigma_mm": largest,
            "largest_sigma_deg": turn,
            "notes": notes,
        }
    )


def evaluate(
    model: ModelFile,
    data: DataFiles,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Also write the figures, as JSON.")
    ] = None,
    corners: Corners = None,
    threads: Threads = 1,
) -> None:
    """Compare a model with measured poses.

    Prints error statistics, and accuracy and repeatability by ISO 9283 where poses repeat.
    """
    from fastcal.calibration.evaluation import evaluate as evaluated
    from fastcal.calibration.extrapolation_notes import range_notes
    from fastcal.calibration.inspection import readback_notes
    from fastcal.calibration.pictures import seen_by_model
    from fastcal.calibration.prediction import correction_notes
    from fastcal.importers.corners import load_seen
    from fastcal.io.results import write_json
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tree_file import is_cell
    from fastcal.report.language import _

    if is_cell(model):
        from fastcal.cli.cells import evaluate_cell

        evaluate_cell(model, data, corners, output)
        return
    robot = load_robot(model)
    looked = seen_by_model(robot, load_seen(data, robot, corners), threads)
    measured = looked.data
    found = evaluated(robot, measured, threads=threads)
    if output is not None:
        write_json(output, found.to_json_dict())
    beyond = [*range_notes(robot, measured), *correction_notes(robot, measured)]
    warn([*looked.notes, *measured.notes, *beyond, *readback_notes(robot, measured)])
    say_evaluation(found, _("{robot} on {files}", robot=robot.name, files=file_names(data)))


def say_evaluation(found: Evaluation, title: str) -> None:
    """The figures of `evaluate` in a few lines."""
    from fastcal.report.summaries import evaluation_lines

    tell(found, evaluation_lines(found, title))
