# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What `fastcal calibrate` and `fastcal evaluate` do where ROBOT or MODEL is a cell of several arms."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fastcal.cli.console import NOT_CONVERGED, emit, fail, progress, say, warn

if TYPE_CHECKING:
    from fastcal.calibration.kind_errors import KindErrors

FILES = ("model.yaml", "result.json")


def calibrate_cell(
    cell: str,
    data: list[Path],
    output: Path,
    test: Path | None,
    corners: tuple[Path | None, Path | None],
    mend: bool,
    loss: str,
    threads: int,
    given: Mapping[str, Any],
    hand_eye: list[Path],
) -> None:
    """Identifies all arms of a cell and where its members stand; model.yaml and result.json into `output`.

    `corners`: of `data` and of `test`. `given`: options of `fastcal calibrate` that a cell does not take, and what they
    are where they were not given.
    """
    from fastcal.cells.calibrate import calibrate_cell as calibrated
    from fastcal.cells.cameras import cell_hand_eyes
    from fastcal.cli.hand_eye import check_hand_eyes, write
    from fastcal.importers.corners import load_seen_readings
    from fastcal.io.atomic import write_text
    from fastcal.io.folder import atomic_folder, check_folder
    from fastcal.io.results import write_json
    from fastcal.io.tree_file import cell_text, load_cell

    check_folder(output, FILES)
    check_hand_eyes(hand_eye)
    _refuse(given)
    nominal = load_cell(cell)
    if hand_eye:
        cell_hand_eyes(nominal)  # says so where there is no sensor
    readings = load_seen_readings(_one(data), nominal, corners[0])
    other = None if test is None else load_seen_readings(test, nominal, corners[1])
    with progress() as show:
        found = calibrated(nominal, readings, test=other, mend=mend, loss=loss, threads=threads, progress=show)
    with atomic_folder(output, FILES) as folder:
        write_json(folder / "result.json", found.to_json_dict())
        if found.parameters:
            write_text(folder / "model.yaml", cell_text(found.cell, f"{found.cell.name}, identified by fastcal"))
    warn([*found.notes, *([found.held] if found.held else [])])
    say(
        f"{found.status.replace('_', ' ')}: {len(found.parameters)} parameters of "
        f"{', '.join(arm.name for arm in found.cell.arms)} from {len(readings)} postures; "
        f"{len(found.unidentifiable)} held that the readings do not show"
    )
    _say_kinds(found.train, "")
    if found.test is not None:
        _say_kinds(found.test, "test: ")
    if hand_eye and found.parameters:
        write(cell_hand_eyes(found.cell, found.parameters), hand_eye)
    say(str(output / "model.yaml"))
    emit(found.to_json_dict())
    if found.status != "converged":
        fail(f"{found.status.replace('_', ' ')}: {found.message}; model.yaml is not to be relied on")
        raise typer.Exit(NOT_CONVERGED)


def evaluate_cell(model: str, data: list[Path], corners: Path | None, output: Path | None) -> None:
    """Compares a cell with readings of other postures."""
    from fastcal.cells.errors import kind_errors, kinds_json
    from fastcal.cells.rig_start import judged_readings
    from fastcal.importers.corners import load_seen_readings
    from fastcal.io.results import write_json
    from fastcal.io.tree_file import load_cell

    cell = load_cell(model)
    readings = judged_readings(cell, load_seen_readings(_one(data), cell, corners), known=True)
    kinds = kind_errors(cell, readings)
    content = {"count": len(readings), "kinds": kinds_json(kinds)}
    if output is not None:
        write_json(output, content)
    warn(readings.notes)
    _say_kinds(kinds, f"{cell.name}: ")
    emit(content)


def _say_kinds(kinds: Mapping[str, KindErrors], title: str) -> None:
    for of in kinds.values():
        before, after = of.statistics
        if after is None:
            continue
        unit = of.kind.unit
        then = "" if before is None else f" (before {of.kind.shown(before.rms):.4g})"
        say(
            f"{title}{of.kind.plural}: RMS {of.kind.shown(after.rms):.4g} {unit}{then}, "
            f"at most {of.kind.shown(after.max):.4g} {unit}, {after.count} readings"
        )


def _one(data: list[Path]) -> Path:
    from fastcal.errors import InvalidInput

    if len(data) != 1:
        raise InvalidInput(f"a cell takes one file of postures, got {len(data)}")
    return data[0]


def _refuse(given: Mapping[str, Any]) -> None:
    from fastcal.errors import InvalidInput

    for option, (value, default) in given.items():
        if value != default:
            raise InvalidInput(f"{option} is for one arm; a cell is identified without it")
