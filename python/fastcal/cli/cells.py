# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What commands do where ROBOT or MODEL is a cell of several arms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fastcal.cli.console import CANNOT_TELL, CHANGED, NOT_CONVERGED, emit, fail, progress, say, warn

if TYPE_CHECKING:
    from fastcal.calibration.kind_errors import KindErrors
    from fastcal.cells.calibrate import CellResult
    from fastcal.cells.gap import CellStep


def calibrate_cell(
    cell: str,
    data: list[Path],
    output: Path,
    test: Path | None,
    corners: tuple[Path | None, Path | None],
    effects: str,
    options: Mapping[str, Any],
    given: Mapping[str, Any],
    hand_eye: list[Path],
    language: str,
) -> None:
    """Identifies all arms of a cell and where its members stand.

    `output` gets model.yaml, result.json and report.html. `corners`: of `data` and of `test`. `options`: of
    `fastcal.cells.calibrate.calibrate_cell`. `given`: those of `fastcal calibrate` that a cell does not take, and what
    they are where they were not given.
    """
    from fastcal.cells.asked import with_effects
    from fastcal.cells.calibrate import calibrate_cell as calibrated
    from fastcal.cells.cameras import cell_hand_eyes
    from fastcal.cli.hand_eye import check_hand_eyes, is_of_model, write
    from fastcal.effects.entries import NOTHING
    from fastcal.importers.corners import load_seen_readings
    from fastcal.io.folder import check_folder
    from fastcal.io.tree_file import load_cell
    from fastcal.report.cell_report import CALIBRATION_FILES, write_cell_calibration

    check_folder(output, CALIBRATION_FILES)
    check_hand_eyes(hand_eye)
    refuse(given)
    nominal = load_cell(cell)
    asked = effects not in ("geometry", NOTHING)
    nominal = with_effects(nominal, effects) if asked else nominal
    if hand_eye:
        cell_hand_eyes(nominal)  # says so where there is no sensor
    readings = load_seen_readings(_one(data), nominal, corners[0])
    other = None if test is None else load_seen_readings(test, nominal, corners[1])
    with progress() as show:
        arms = () if effects == NOTHING else None
        found = calibrated(nominal, readings, test=other, effects=asked, arms=arms, progress=show, **options)
        show("writing the report")
        write_cell_calibration(found, output, language=language)
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
        write(cell_hand_eyes(found.cell, found.parameters), is_of_model(found.parameters), hand_eye)
    _end(found, output)


def diagnose_cell(
    cell: str,
    data: list[Path],
    output: Path,
    test: Path | None,
    corners: tuple[Path | None, Path | None],
    exclude: list[str],
    sigma: float | None,
    as_read: bool,
    mend: bool,
    threads: int,
    language: str,
    given: Mapping[str, Any],
    hand_eye: list[Path],
) -> None:
    """Finds what the arms of a cell are missing.

    `output` gets model.yaml, diagnosis.json, report.html and a folder with each way's own page. `corners`: of `data`
    and of `test`. `given`: as for `calibrate_cell`.
    """
    from fastcal.cells.cameras import cell_hand_eyes
    from fastcal.cells.diagnose import diagnose_cell as diagnosed
    from fastcal.cells.sensor_ways import seen_ways
    from fastcal.cli.hand_eye import check_hand_eyes, write
    from fastcal.importers.corners import load_seen_readings
    from fastcal.io.folder import check_folder
    from fastcal.io.tree_file import load_cell
    from fastcal.io.way_readings import way_datasets
    from fastcal.report.cell_diagnosis_report import DIAGNOSIS_FILES, write_cell_diagnosis

    check_folder(output, DIAGNOSIS_FILES)
    refuse(given)
    check_hand_eyes(hand_eye)
    nominal = load_cell(cell)
    if hand_eye:
        cell_hand_eyes(nominal)  # says so where there is no sensor
    readings = load_seen_readings(_one(data), nominal, corners[0])
    ways = seen_ways(nominal, readings)
    rows = way_datasets(_one(data), nominal, ways, readings)
    others: list[Any] = [None] * len(ways)
    held = None if test is None else load_seen_readings(test, nominal, corners[1])
    if test is not None and held is not None:
        others = way_datasets(test, nominal, ways, held)
    with progress() as show:
        found = diagnosed(
            nominal,
            readings,
            list(zip(ways, rows, others, strict=True)),
            test=held,
            exclude=exclude,
            sigma=sigma,
            as_read=as_read,
            mend=mend,
            threads=threads,
            progress=show,
        )
        show("writing the report")
        write_cell_diagnosis(found, output, language=language)
    if hand_eye:
        arms = zip(found.cell.arms, nominal.arms, strict=True)
        of_model = any(now.robot.description.joints != before.robot.description.joints for now, before in arms)
        write(cell_hand_eyes(found.cell), of_model, hand_eye)
    warn([*readings.notes, *found.notes])
    say(f"{nominal.name}: {found.verdict.replace('_', ' ')}")
    say(found.sentence)
    for of in found.effects:
        also = "".join(f" or {effect}@{owner}" for effect, owner in of.finding.equivalents)
        say(f"  {of.finding.grade}  {of.finding.label}{also}, seen by {', '.join(of.seen_by)}")
    for each in found.ways:
        gap = each.found.judged_gap
        sizes = f"RMS {gap.sizes[0]:.4f} {gap.unit}, {gap.sizes[-1]:.4f} with all that was found"
        say(f"{each.way.name}: {sizes} ({gap.on})")
    for line in gap_lines(found.gap):
        say(line)
    say(str(output / "report.html"))
    emit(found.to_json_dict())
    if found.status != "converged":
        raise typer.Exit(NOT_CONVERGED)


def check_cell(
    model: str,
    data: list[Path],
    corners: Path | None,
    output: Path | None,
    tolerance: float | None,
    as_read: bool,
    threads: int,
    language: str,
    given: Mapping[str, Any],
) -> None:
    """Holds a cell against new postures; `given`: as for `calibrate_cell`."""
    from fastcal.cells.branches import possible_ways, ways_of
    from fastcal.cells.check import check_cell as checked
    from fastcal.cells.check import checked_ways
    from fastcal.cells.whole_check import check_whole
    from fastcal.importers.corners import load_seen_readings
    from fastcal.io.tree_file import load_cell
    from fastcal.io.way_readings import way_datasets
    from fastcal.report.cell_check_report import write_cell_check, write_whole_check

    refuse(given)
    cell = load_cell(model)
    readings = load_seen_readings(_one(data), cell, corners)
    ways = checked_ways(cell, readings)
    if not ways and (cell.record is not None or not possible_ways(cell, readings.views)):
        refuse({"--as-read": (as_read, False)})
        with progress() as show:
            show("checking")
            whole = check_whole(cell, readings, tolerance=tolerance, threads=threads)
        if output is not None:
            write_whole_check(whole, output, language=language)
        warn(whole.notes)
        say(whole.sentence)
        for name, of in whole.kinds.items():
            if (after := of.statistics[1]) is not None:
                rms, expected = of.kind.text(after.rms), of.kind.text(whole.expected[name])
                say(f"{of.kind.plural}: RMS {rms}, expected {expected}")
        if whole.blind:
            say(f"not seen by these readings: {', '.join(whole.blind)}")
        if len(whole.next):
            say(f"{len(whole.next)} postures that would decide it are in next_poses of check.json")
        _end_check(whole.to_json_dict(), whole.verdict, whole.within)
        return
    ways = ways or ways_of(cell, readings.views)
    rows = way_datasets(_one(data), cell, ways, readings)
    with progress() as show:
        show("checking")
        pairs = list(zip(ways, rows, strict=True))
        found = checked(cell, pairs, tolerance=tolerance, as_read=as_read, threads=threads)
    if output is not None:
        write_cell_check(found, output, language=language)
    warn([*readings.notes, *(f"{each.way.name}: {note}" for each in found.ways for note in each.found.notes)])
    say(found.sentence)
    for each in found.ways:
        main = each.found.main
        rms, expected = main.kind.text(each.found.rms), main.kind.text(each.found.expected_rms)
        say(f"{each.way.name}: {each.found.verdict.replace('_', ' ')}; RMS {rms}, expected {expected}")
    _end_check(found.to_json_dict(), found.verdict, found.within_tolerance)


def _end_check(content: dict[str, Any], verdict: str, within: bool | None) -> None:
    emit(content)
    if verdict == "cannot_tell":
        raise typer.Exit(CANNOT_TELL)
    if verdict == "changed" or within is False:
        raise typer.Exit(CHANGED)


def update_cell(
    model: str,
    data: list[Path],
    corners: Path | None,
    output: Path,
    threads: int,
    language: str,
    given: Mapping[str, Any],
) -> None:
    """Brings a cell up to date; files as of `calibrate_cell`, `given` too."""
    from fastcal.cells.update import update_cell as updated
    from fastcal.importers.corners import load_seen_readings
    from fastcal.io.folder import check_folder
    from fastcal.io.tree_file import load_cell
    from fastcal.report.cell_report import CALIBRATION_FILES, write_cell_calibration

    check_folder(output, CALIBRATION_FILES)
    refuse(given)
    cell = load_cell(model)
    readings = load_seen_readings(_one(data), cell, corners)
    with progress() as show:
        show("bringing the cell up to date")
        found = updated(cell, readings, threads=threads)
        show("writing the report")
        write_cell_calibration(found, output, language=language)
    warn(readings.notes)
    status, moved = found.status.replace("_", " "), ", ".join(found.moved or [])
    if moved:
        say(f"{status}: {len(readings)} postures; {moved} moved")
    else:
        say(f"{status}: {len(readings)} postures; nothing moved")
    if found.outliers:
        say(f"rows left out: {', '.join(map(str, found.outliers))}")
    _say_kinds(found.train, "")
    _end(found, output)


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
    before = {name: {"before": None} | of for name, of in kinds_json(kinds).items()}  # of a model alone there is none
    content = {"count": len(readings), "kinds": before}
    if output is not None:
        write_json(output, content)
    warn(readings.notes)
    _say_kinds(kinds, f"{cell.name}: ")
    emit(content)


def _end(found: CellResult, output: Path) -> None:
    say(str(output / "report.html"))
    emit(found.to_json_dict())
    if found.status != "converged":
        fail(f"{found.status.replace('_', ' ')}: {found.message}; model.yaml is not to be relied on")
        raise typer.Exit(NOT_CONVERGED)


def gap_lines(gap: Sequence[CellStep]) -> list[str]:
    """RMS of each kind before, with the geometry, and of the cell that is written; on the test where there is one."""
    out = []
    for kind, last in ({} if not gap else gap[-1].test or gap[-1].train).items():
        sizes = [(step.test or step.train).get(kind) for step in gap]
        shown = [f"{of.rms:.4g}" if of is not None and of.rms is not None else "-" for of in sizes]
        on = "test: " if gap[-1].test is not None else ""
        steps = (
            f"RMS {shown[0]} {last.kind.unit} before, {shown[1]} with the geometry, {shown[2]} with what model.yaml has"
        )
        out.append(f"{on}{last.kind.plural}: {steps}")
    return out


def _say_kinds(kinds: Mapping[str, KindErrors], title: str) -> None:
    for of in kinds.values():
        before, after = of.statistics
        if after is None:
            continue
        unit = of.kind.unit
        now, most = (f"{of.kind.shown(size):.4g}" for size in (after.rms, after.max))
        if before is None:
            say(f"{title}{of.kind.plural}: RMS {now} {unit}, at most {most} {unit}, {after.count} readings")
        else:
            was = f"{of.kind.shown(before.rms):.4g}"
            say(
                f"{title}{of.kind.plural}: RMS {now} {unit} (before {was}), at most {most} {unit}, "
                f"{after.count} readings"
            )


def _one(data: list[Path]) -> Path:
    from fastcal.errors import InvalidInput

    if len(data) != 1:
        raise InvalidInput(f"a cell takes one file of postures, got {len(data)}")
    return data[0]


def not_given(who: Mapping[str, str | None] | None) -> dict[str, tuple[Any, Any]]:
    """`given` of who measured what, which results of cells do not keep."""
    return {f"--{name}": (text, None) for name, text in (who or {}).items()}


def refuse(given: Mapping[str, Any]) -> None:
    """InvalidInput where an option of one arm was given."""
    from fastcal.errors import InvalidInput

    for option, (value, default) in given.items():
        if value != default:
            raise InvalidInput(f"{option} is for one arm; a cell of several goes without it")
