# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal calibrate`: a robot and its measurements in; model.yaml, result.json and report.html out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fastcal.cli.console import fail, progress, say, warn
from fastcal.cli.options import DataFile, Loss, Method, OutFolder, RobotFile, Threads

if TYPE_CHECKING:
    from fastcal.calibration import CalibrationResult

NOT_CONVERGED = 3
FILES = ("model.yaml", "result.json", "report.html")


def calibrate(
    robot: RobotFile,
    data: DataFile,
    output: OutFolder,
    test: Annotated[
        Path | None, typer.Option(metavar="TEST", help="Other poses, only reported on: no choice reads them.")
    ] = None,
    effects: Annotated[
        str, typer.Option(metavar="LIST", help="What to identify; base and tool always are.")
    ] = "geometry",
    method: Annotated[Method, typer.Option(help="How to minimize.")] = "nls",
    loss: Annotated[Loss, typer.Option(help="Robust loss on the whitened error of a row.")] = "tukey",
    priors: Annotated[
        bool, typer.Option("--priors", help="Hold parameters near nominal where the data say little.")
    ] = False,
    threads: Threads = 1,
) -> None:
    """Identify a robot from measured poses."""
    from fastcal import calibration, inspection
    from fastcal.io.folder import check_folder
    from fastcal.io.measurements import load_measurements
    from fastcal.io.robot_file import load_robot

    check_folder(output)
    nominal = load_robot(robot)
    measured = load_measurements(data, nominal)
    other = None if test is None else load_measurements(test, nominal)
    with progress() as show:
        show("looking at the columns")
        suspected = inspection.suspicion(nominal, measured)
        found = calibration.calibrate(
            nominal,
            measured,
            test=other,
            effects=effects,
            method=method,
            loss=loss,
            priors=priors,
            threads=threads,
            progress=show,
        )
        inspection.check_fit(nominal, found.train, suspected)
        notes = [*([suspected] if suspected else []), *found.notes, *inspection.readback_notes(nominal, measured)]
        if found.degrees_of_freedom <= 0:
            notes.append(
                "as many parameters as measured numbers: nothing is left to tell the noise or any deviation by"
            )
        found = replace(found, notes=notes)
        show("writing the report")
        write(found, output)
    warn(found.notes)
    if other is not None:
        warn(f"{test}: {note}" for note in other.notes if note not in found.notes)
    say_result(found, output)
    if found.status != "converged":
        fail(f"{found.status.replace('_', ' ')}: {found.message}; no model.yaml")
        raise typer.Exit(NOT_CONVERGED)


def write(result: CalibrationResult, output: Path, *, simulated: bool = False) -> None:
    """Writes a result's files into a folder, all or none; a model only where the calibration converged."""
    from fastcal import __version__
    from fastcal.io.folder import atomic_folder
    from fastcal.io.results import write_json
    from fastcal.io.robot_file import write_spec
    from fastcal.report import write_report

    with atomic_folder(output, owned=FILES) as folder:
        if result.status == "converged":
            source = Path(result.train.data.source).name
            write_spec(result.model.spec, folder / "model.yaml", f"Identified by fastcal {__version__} from {source}")
        write_json(folder / "result.json", result.to_json_dict())
        write_report(result, folder / "report.html", simulated=simulated)


def say_result(result: CalibrationResult, output: Path) -> None:
    """The result in a few lines; the last is the report's path."""
    rows = len(result.train.data)
    state = result.status.replace("_", " ")
    say(f"{result.model.name}: {state}, {len(result.parameters)} parameters identified from {rows} rows")
    for name, part in (("training", result.train), ("test", result.test)):
        if part is not None and part.before is not None and part.after is not None:
            before, after = part.before.to_mm(), part.after.to_mm()
            say(
                f"error on {name} poses, {part.after.count} rows: RMS {before['rms']:.4f} mm before, "
                f"{after['rms']:.4f} mm after; largest {before['max']:.4f} mm before, {after['max']:.4f} mm after"
            )
    say(f"noise of a measured coordinate: {result.sigma_mm:.4f} mm ({result.sigma_note})")
    say(f"loss: {result.loss}" + ("" if result.loss == "none" else " (robust: rows that fit badly weigh less)"))
    if result.unidentifiable:
        say(f"these data can't tell {len(result.unidentifiable)} directions; their first parameter is held at nominal:")
        for direction in result.unidentifiable:
            say(f"  {direction.direction}")
    if result.outliers:
        say(f"outliers, data rows counted from 0: {', '.join(map(str, result.outliers))}")
    say(str(output / "report.html"))
