# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compensate` on a robot program, or on a folder of them: the same programs for the calibrated robot."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fastcal.cli.console import LEFT, emit, progress, say, warn
from fastcal.errors import InvalidInput

if TYPE_CHECKING:
    from fastcal.arrays import FloatArray
    from fastcal.compensation import CompensatedProgram
    from fastcal.programs import Cell, Program
    from fastcal.robot.robot import Robot

Done = list[tuple[Path, "Program", "CompensatedProgram | None"]]  # file, program, None where it has no targets


def compensate_programs(
    robot: Robot,
    source: Path,
    output: Path,
    cell: Path | None,
    corrections: Path | None,
    options: dict[str, Any],
    *,
    strict: bool = False,
) -> None:
    """Changes a program, or the programs of a folder, and writes them together.

    Of a folder, programs that cannot be read or were compensated already are left out, each with a warning.

    Raises:
        InvalidInput: A program alone is refused, or all of a folder.
        typer.Exit: With `strict`, a part was left as not understood.
    """
    from fastcal.io.cell_file import load_cell
    from fastcal.io.programs import others_in, programs_in, write_programs

    given = None if cell is None else load_cell(cell)
    is_folder = source.is_dir()
    files, reports = programs_in(source, output) if is_folder else ([source], [])
    done: Done = []
    refused: list[InvalidInput] = []
    with progress() as show:
        for file in files:
            show(f"compensating {file.name}")
            try:
                done.append((file, *_changed(robot, file, given, options, alone=not is_folder)))
            except InvalidInput as error:
                refused.append(error)
    if refused and not any(found is not None for _file, _program, found in done):
        raise refused[0]
    places = [output / file.relative_to(source) if is_folder else output for file, _, _ in done]
    documents = [program.documents if found is None else found.documents for _file, program, found in done]
    written = write_programs(list(zip(places, documents, strict=True)), make_folders=is_folder)
    warn(f"{report}: is a controller's report and no program; it is left out" for report in reports)
    if corrections is not None:
        _write_corrections(robot, corrections, done)
    warn(f"{error}; this program is left out" for error in refused)
    if is_folder:
        warn(f"{path}: is in {other}, which is not read; it is left out" for path, other in others_in(source))
    warn(_foreign(robot, done))
    _say(done, inverse=bool(options.get("inverse")))
    for path in written:
        say(str(path))
    _emit(done, written)
    if strict and (refused or any(found is not None and found.left + found.assumed for _file, _program, found in done)):
        raise typer.Exit(LEFT)


def _changed(
    robot: Robot, file: Path, cell: Cell | None, options: dict[str, Any], *, alone: bool
) -> tuple[Program, CompensatedProgram | None]:
    """A program, and it with its targets changed; None for one of a folder that has none and is kept as it is."""
    from fastcal.compensation import AlreadyCompensated, compensate_program
    from fastcal.io.programs import load_program

    program = load_program(file)
    if not program.targets and not program.left and not alone:
        return program, None
    try:
        return program, compensate_program(robot, program, cell=cell, **options)
    except AlreadyCompensated as error:
        if not alone:
            raise
        raise InvalidInput(f"{error}; --again compensates it once more, --inverse brings it back") from None


def _foreign(robot: Robot, done: Done) -> list[str]:
    """A warning for each language that is not the one that the arm's controller speaks."""
    from fastcal.programs import foreign

    return list(dict.fromkeys(filter(None, (foreign(robot.name, program.language.name) for _, program, _ in done))))


def _write_corrections(robot: Robot, path: Path, done: Done) -> None:
    import numpy as np

    from fastcal.io.corrections_out import write_corrections

    rows = [(program, found) for _file, program, found in done if found is not None]
    targets = [(program, target) for program, found in rows for target in found.targets]
    documents = [program.documents[target.numbers[0].document].name for program, target in targets]
    labels: dict[str, list[int] | list[str]] = {
        "file": [Path(name).name for name in documents],
        "line": [target.line for _, target in targets],
        "target": [target.name for _, target in targets],
        "kind": [str(target.kind) for _, target in targets],
    }
    shift, error, sigma = (np.concatenate([getattr(f, key) for _, f in rows]) for key in ("shift", "error", "sigma"))
    joints = np.concatenate([found.q - found.nominal_q for _, found in rows])
    write_corrections(path, robot, labels, shift, joints, error, sigma)


def _say(done: Done, *, inverse: bool) -> None:
    from fastcal.compensation import shared_in_words
    from fastcal.report.language import _
    from fastcal.units import from_si

    for file, program, found in done:
        if found is None:
            warn([f"{file}: holds no targets of plain numbers; written as it is"])
            continue
        warn(f"{file.name}: {note}" if len(done) > 1 else note for note in (*found.left, *found.assumed, *found.notes))
        mean, most = (from_si(float(value), "mm") for value in (found.error.mean(), found.error.max()))
        head = f"{file.name}, {program.language.name}" if len(done) > 1 else program.language.name
        targets, moves = len(found.targets), len(program.moves)
        counted = {
            "targets": _("1 target") if targets == 1 else _("{count} targets", count=targets),
            "moves": _("1 move") if moves == 1 else _("{count} moves", count=moves),
        }
        sizes = {"mean": float(mean), "most": float(most)}
        if inverse:
            say(_("{head}: {targets} brought back to nominal, {moves} and all else kept", head=head, **counted))
            say(_("error that the compensation had removed: mean {mean:.3f} mm, largest {most:.3f} mm", **sizes))
        else:
            say(_("{head}: {targets} changed, {moves} and all else kept", head=head, **counted))
            say(_("error that this removes: mean {mean:.3f} mm, largest {most:.3f} mm", **sizes) + spread(found.sigma))
            if (shared := shared_in_words(found.shift)) is not None:
                say(_(shared))


def spread(sigma: FloatArray) -> str:
    """The end of a sentence about targets: the largest of their deviations (N,) [m]; "" where one is not known."""
    from fastcal.report.language import _
    from fastcal.units import from_si

    if not len(sigma) or any(map(math.isnan, sigma)):
        return ""
    return _("; its standard deviation {sigma:.3g} mm per coordinate", sigma=float(from_si(float(sigma.max()), "mm")))


def _emit(done: Done, written: list[Path]) -> None:
    import numpy as np

    from fastcal.units import from_si

    error = np.concatenate([np.zeros(0), *(found.error for _file, _program, found in done if found is not None)])
    sigma = np.concatenate([np.zeros(0), *(found.sigma for _file, _program, found in done if found is not None)])
    emit(
        {
            "programs": len(done),
            "targets": len(error),
            "mean_error_mm": from_si(float(error.mean()), "mm") if len(error) else None,
            "largest_error_mm": from_si(float(error.max()), "mm") if len(error) else None,
            "largest_sigma_mm": from_si(float(sigma.max()), "mm") if np.isfinite(sigma).all() and len(sigma) else None,
            "payloads_kg": sorted({m for _file, _program, found in done if found for m in found.payload.tolist()}),
            "left": [sentence for _file, _program, found in done if found is not None for sentence in found.left],
            "files": list(map(str, written)),
        }
    )
