# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`predict`, `simulate`, `design` and `compare` where ROBOT or MODEL is a cell of several arms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fastcal.cli.cells import refuse
from fastcal.cli.console import emit, progress, say, warn

if TYPE_CHECKING:
    from fastcal.monitoring.differences import Difference


def predict_cell(model: str, data: Path, output: Path, threads: int) -> None:
    """Where all targets are."""
    from fastcal.cells.predict import predict_cell as predicted
    from fastcal.io.tree_file import load_cell
    from fastcal.io.tree_readings import load_readings
    from fastcal.io.tree_readings_out import write_cell_prediction
    from fastcal.units import from_si

    cell = load_cell(model)
    postures = load_readings(data, cell, require_measured=False)
    with progress() as show:
        show("predicting")
        found = predicted(cell, postures, threads=threads)
    write_cell_prediction(output, found)
    warn(postures.notes)
    say(f"{output}: {len(postures)} postures of {cell.name} predicted")
    sizes: dict[str, float | None] = {}
    for view, of in found.items():
        known = bool(np.isfinite(of.sigma_position).all())
        sizes[view] = from_si(float(of.sigma_position.max()), "mm") if known else None
        said = f"standard deviation of a coordinate at most {sizes[view]:.3g} mm" if known else "deviation not known"
        say(f"{view}: {said}")
    content = {"cell": cell.name, "postures": len(postures), "largest_sigma_mm": sizes, "notes": list(postures.notes)}
    emit({"file": str(output), **content})


def simulate_cell(
    robot: str,
    poses: Path,
    output: Path,
    views: str,
    noise: tuple[float, float | None, float],
    seed: int,
    threads: int,
    given: Mapping[str, Any],
) -> None:
    """What instruments would read of the targets.

    `noise`: of a coordinate [mm], of an orientation [deg] where one is read, of a joint [deg]. `given`: options of one
    arm, and what they are where they were not given.
    """
    from fastcal.cells.simulate import simulate_cell as simulated
    from fastcal.io.tree_file import load_cell
    from fastcal.io.tree_readings import load_readings
    from fastcal.io.tree_readings_out import write_readings
    from fastcal.units import to_si

    refuse(given)
    cell = load_cell(robot)
    sent = load_readings(poses, cell, require_measured=False)
    noise_mm, noise_deg, joints_deg = noise
    with progress() as show:
        show("simulating")
        found = simulated(
            cell,
            sent,
            listed(views),
            noise=to_si(noise_mm, "mm"),
            noise_rotation=None if noise_deg is None else to_si(noise_deg, "deg"),
            repeatability=to_si(joints_deg, "deg"),
            seed=seed,
            threads=threads,
        )
    write_readings(output, cell, found)
    warn(sent.notes)
    say(f"{output}: {', '.join(found.views)} in {len(found)} postures of {cell.name} read by simulation")
    emit({"file": str(output), "cell": cell.name, "postures": len(found), "views": found.views, "seed": seed})


def design_cell(
    robot: str,
    output: Path,
    count: int,
    views: str,
    sigma: tuple[float | None, float | None, float | None],
    focus_mm: str | None,
    options: Mapping[str, Any],
    given: Mapping[str, Any],
) -> None:
    """Which postures to read; `given` as of `simulate_cell`.

    `sigma`: of a coordinate [mm], an orientation [deg], a corner [px].
    """
    from fastcal.cells.design import design_cell as designed
    from fastcal.cli.design_pictures import focus_range
    from fastcal.design.poses import SIGMA
    from fastcal.io.tables import write_csv
    from fastcal.io.tree_file import load_cell
    from fastcal.io.tree_readings_out import posture_columns
    from fastcal.units import from_si, to_si

    refuse(given)
    cell = load_cell(robot)
    sigma_mm, sigma_deg, sigma_px = sigma
    with progress() as show:
        found = designed(
            cell,
            count,
            listed(views),
            sigma=SIGMA if sigma_mm is None else to_si(sigma_mm, "mm"),
            sigma_rotation=None if sigma_deg is None else to_si(sigma_deg, "deg"),
            sigma_px=sigma_px,
            focus=None if focus_mm is None else focus_range(focus_mm),
            progress=show,
            **options,
        )
    sides = {f"{arm}.approach{joint + 1}": of for (arm, joint), of in found.approach.items()}
    write_csv(output, {"order": range(1, len(found.q) + 1), **posture_columns(cell, found.q), **sides})
    say(f"{output}: {len(found.q)} postures of {found.candidate_count}, to read {', '.join(found.views)} in each")
    expected = None if found.sigma is None else from_si(found.sigma, "mm")
    known = "" if expected is None else f"; a predicted coordinate is then known to {expected:.3g} mm"
    say(f"{len(found.parameters)} parameters{known}")
    for of in found.cameras:
        say(f"then: {of.sentence}")
    if found.efficiency is not None:
        say(f"at least {found.efficiency:.0%} of the best choice of as many")
    warn(found.notes)
    emit(
        {
            "file": str(output),
            "poses": len(found.q),
            "views": found.views,
            "candidates": found.candidate_count,
            "observability": found.observability,
            "sigma_mm": expected,
            "efficiency": found.efficiency,
            "parameters": len(found.parameters),
            "unidentifiable": found.unidentifiable,
            "cameras": [of.to_json_dict() for of in found.cameras],
        }
    )


def compare_cells(first: str, second: str, output: Path | None, language: str, threads: int) -> None:
    """How two models of one cell differ."""
    from fastcal.cells.compare import compare_cells as compared
    from fastcal.io.folder import check_folder
    from fastcal.io.tree_file import load_cell
    from fastcal.report.cell_comparison_report import FILES, write_cell_comparison

    if output is not None:
        check_folder(output, FILES)
    with progress() as show:
        show("comparing")
        found = compared(load_cell(first), load_cell(second), threads=threads)
    if output is not None:
        write_cell_comparison(found, output, language=language)
    warn(found.notes)
    for each in found.ways:
        sizes = each.found.at_tool.to_mm()
        said = f"{len(each.significant)} of {len(each.parameters)} numbers differ beyond noise"
        say(f"{each.way.name}: RMS {sizes['rms']:.4f} mm, at most {sizes['max']:.4f} mm; {said}")
        _say_different(each.significant)
    if (seen := found.seen) is not None:
        for view, of in seen.views.items():
            sizes = of.to_mm()
            say(f"{view}: RMS {sizes['rms']:.4f} mm, at most {sizes['max']:.4f} mm")
        significant, parameters = len(seen.significant), len(seen.parameters)
        say(f"seen by sensors and cameras: {significant} of {parameters} numbers differ beyond noise")
        _say_different(seen.significant)
    if output is not None:
        say(str(output / "report.html"))
    emit(found.to_json_dict())


def _say_different(numbers: Sequence[Difference]) -> None:
    for of in numbers:
        say(f"  {of.owner} {of.name}: {of.difference:+.4g} +- {of.std:.2g} {of.unit}")


def listed(text: str) -> list[str]:
    """The names of a list with commas."""
    return [part.strip() for part in text.split(",") if part.strip()]
