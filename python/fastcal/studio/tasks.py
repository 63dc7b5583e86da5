# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the studio does in processes of their own: `python -m fastcal.studio.tasks NAME ARGUMENTS`, in the project.

Each line on standard output is JSON: a step, the result, or the sentence of an error.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import fastcal
from fastcal.errors import FastcalError
from fastcal.report.language import LANGUAGE, _, in_language, language, retold
from fastcal.said import said, sentence_of
from fastcal.units import from_si, to_si

Say = Callable[[str], None]


def calibrate(say: Say, robot: str, data: str, out: str, effects: str = "geometry", test: str | None = None) -> Any:
    """Calibrates and writes model.yaml, result.json and report.html."""
    from fastcal.report.calibration_files import write_calibration

    nominal = fastcal.load_robot(robot)
    measured = fastcal.load_measurements(data, nominal)
    other = None if test is None else fastcal.load_measurements(test, nominal)
    found = fastcal.calibrate(nominal, measured, test=other, effects=effects, progress=say)
    say(said("writing the report"))
    write_calibration(found, out, language=language.get())
    return {"status": found.status, **gap_of(found), "notes": list(found.notes)}


def diagnose(say: Say, robot: str, data: str, out: str, test: str | None = None) -> Any:
    """Finds what the model is missing and writes model.yaml, diagnosis.json and report.html."""
    from fastcal.report.diagnosis_report import write_diagnosis

    nominal = fastcal.load_robot(robot)
    measured = fastcal.load_measurements(data, nominal)
    other = None if test is None else fastcal.load_measurements(test, nominal)
    found = fastcal.diagnose(nominal, measured, test=other, progress=say)
    say(said("writing the report"))
    write_diagnosis(found, out, language=language.get())
    return {"verdict": found.to_json_dict()["verdict"]}


def without(say: Say, robot: str, data: str, model: str, off: Sequence[str]) -> Any:
    """The error once some effects of a model are left out and the rest is fitted again; nothing is written."""
    nominal = fastcal.load_robot(robot)
    measured = fastcal.load_measurements(data, nominal)
    kept = fastcal.load_robot(model)
    if off:
        kept = fastcal.drop_effects(kept, list(off))
    say(said("fitting without {effects}", effects=", ".join(off)) if off else said("fitting with all effects"))
    # The model's own effects stay and are identified again; of the geometry too.
    found = fastcal.calibrate(kept, measured, effects="geometry", checks=False, progress=say)
    return gap_of(found)


def gap_of(found: Any) -> dict[str, float | None]:
    """RMS errors of the points in mm, before and after."""
    before, after = found.train.before, found.train.after
    return {
        "before_mm": None if before is None else from_si(before.rms, "mm"),
        "after_mm": None if after is None else from_si(after.rms, "mm"),
    }


def design(say: Say, robot: str, count: int, out: str, effects: str = "geometry", payloads: Sequence[float] = (0.0,),
           keep_out: Sequence[Any] = (), sigma_mm: float = 0.05) -> Any:  # fmt: skip
    """Plans poses, writes them and the program that drives there; and the predicted error at fewer poses."""
    from fastcal.design import Surroundings, design_poses
    from fastcal.io.design_out import design_candidates, program_beside, write_poses_and_program

    arm = fastcal.load_robot(robot)
    boxes = [tuple(tuple(to_si(float(v), "mm") for v in corner) for corner in box) for box in keep_out]
    around = Surroundings(keep_out=boxes)  # type: ignore[arg-type]
    options: dict[str, Any] = {"effects": effects, "surroundings": around, "payloads": payloads}
    options["sigma"] = to_si(sigma_mm, "mm")
    curve = []
    for fewer in sorted({max(8, count // 4), max(10, count // 2), max(12, 3 * count // 4)}):
        if fewer < count:
            say(said("what {count} poses would do", count=fewer))
            found = design_poses(arm, fewer, candidate_count=4000, candidates="random", **options)
            curve.append((fewer, from_si(found.sigma, "mm")))
    found = design_poses(arm, count, candidate_count=20_000, progress=say, **options)
    curve.append((count, from_si(found.sigma, "mm")))
    say(said("writing poses and program"))
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    place = program_beside(out, arm)
    files, notes = write_poses_and_program(out, design_candidates(found), arm, place, surroundings=around)
    return {"files": [str(file) for file in files], "curve": curve, "notes": [*notes, *found.notes]}


def fleet(say: Say, arms: str, out: str, diagnosed: bool = False) -> Any:
    """Calibrates or diagnoses the arms of a list."""
    from fastcal.fleet import calibrate_many, diagnose_many, read_list
    from fastcal.fleet.page import write_fleet

    listed = read_list(arms)
    spoken = language.get()
    found = diagnose_many(listed, out=out, language=spoken, progress=say) if diagnosed else calibrate_many(
        listed, out=out, reports=True, language=spoken, progress=say
    )  # fmt: skip
    say(said("writing the page"))
    write_fleet(found, Path(out), language=spoken)
    return {"arms": [arm.to_row() for arm in found]}


def check(say: Say, model: str, kept: str, date: str, checks: str, out: str) -> Any:
    """Holds kept.csv against a model, writes kept.json and kept.html, and all checks over time."""
    from fastcal.report.check_report import check_act, check_sentence
    from fastcal.report.monitoring_files import write_check, write_history

    robot = fastcal.load_robot(model)
    say(said("checking"))
    found = fastcal.check(robot, fastcal.load_measurements(f"{kept}.csv", robot), who={"date": date})
    write_check(found, f"{kept}.json")
    write_check(found, f"{kept}.html", language=language.get())
    say(said("writing the page"))
    write_history(fastcal.history(checks), out, language=language.get())
    told = {"sentence": check_sentence(found), "act": check_act(found)}
    return {"verdict": found.verdict, **told, "page": f"{kept}.html"}


_ALL = (calibrate, diagnose, without, design, fleet, check)
TASKS: dict[str, Callable[..., Any]] = {task.__name__: task for task in _ALL}


def main(arguments: Sequence[str]) -> int:
    """Runs a task; 0 where it succeeded."""

    def tell(**said: Any) -> None:
        sys.stdout.write(json.dumps(said) + "\n")
        sys.stdout.flush()

    name, given = arguments
    try:
        with in_language(os.environ.get(LANGUAGE, "en")):
            tell(result=TASKS[name](lambda step: tell(step=_(step)), **json.loads(given)))
    except FastcalError as error:
        with in_language(os.environ.get(LANGUAGE, "en")):
            tell(error=retold(sentence_of(error)))
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
