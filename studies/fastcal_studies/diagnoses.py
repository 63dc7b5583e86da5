# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What `diagnose` makes of a study's arms, beside what is hidden in them and what anyone would try by hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from fastcal.calibration.calibrate import calibrate
from fastcal.diagnosis.diagnosis import diagnose
from fastcal.diagnosis.result import Diagnosis
from fastcal.effects.entries import label
from fastcal.errors import FastcalError
from fastcal.units import from_si
from fastcal_studies.diagnosed import Sample, sample
from fastcal_studies.exhibits import Section, Table

Run = dict[str, Any]

PLAIN = ("geometry", "geometry,joint_compliance", "geometry,gravity_sag", "geometry,joint_profile")
LOSSES = ("tukey", "none")
RIGHT, WRONG, OPEN = "right", "wrong", "open"
BY_CHANCE = 1.05  # over the best plain calibration, which is chosen on the very rows that judge


def diagnosed_arm(name: str, seed: int) -> Run:
    """One arm of a study: verdict, names and how far the held-out rows are missed, beside the best plain calibration.

    Args:
        name: Of the study.
        seed: Of the arm.

    Returns:
        seed, verdict, hidden (the effects of the arm), names (each with grade and `told`), after_mm, plain_mm, plain;
        None where there is no such number, and `refused` in words where nothing answers.
    """
    given = sample(name, seed)
    plain, best = best_plain(given)
    run: Run = {"seed": seed, "hidden": hidden(given), "plain": plain, "plain_mm": best}
    try:
        found = diagnose(given.nominal, given.data, test=given.test)
    except FastcalError as refused:
        return run | {"verdict": "no answer", "names": [], "after_mm": None, "refused": str(refused)}
    return run | {
        "verdict": found.verdict,
        "names": [
            {"name": f.label, "grade": f.grade, "in_model": f.in_model, "told": told}
            for f, told in zip(found.effects, judged(found, run["hidden"]), strict=True)
        ],
        "after_mm": found.gap[-1].test_rms_mm,
    }


def hidden(given: Sample) -> list[str]:
    """The effects of a hidden arm, EFFECT@OWNER."""
    return [label(entry) for entry in given.true.spec.get("effects") or []]


def judged(found: Diagnosis, there: Sequence[str]) -> list[str]:
    """Of each name whether it, or another that the data can't tell from it, is in the arm; a grade C claims nothing."""
    out = []
    for f in found.effects:
        said = {f.label, *("@".join(other) for other in f.equivalents)}
        out.append(RIGHT if said & set(there) else OPEN if f.grade == "C" else WRONG)
    return out


def best_plain(given: Sample) -> tuple[str, float | None]:
    """The plain calibration that misses the held-out rows least, and by how much [mm, RMS]."""
    missed: dict[str, float] = {}
    for effects in PLAIN:
        for loss in LOSSES:
            try:
                result = calibrate(given.nominal, given.data, test=given.test, effects=effects, loss=loss, checks=False)
            except FastcalError:
                continue  # without masses nothing yields, and so on
            if result.test is not None and result.test.after is not None:
                missed[f"{effects}, {loss}"] = from_si(result.test.after.rms, "mm")
    if not missed:
        return "", None
    best = min(missed, key=missed.__getitem__)
    return best, missed[best]


def diagnosed(name: str, arms: int, progress: Callable[[str], None] | None = None) -> list[Run]:
    """The arms 0, 1, ... of a study."""
    runs = []
    for seed in range(arms):
        runs.append(diagnosed_arm(name, seed))
        if progress is not None:
            progress(f"{len(runs)} of {arms} arms diagnosed")
    return runs


def section(runs: Sequence[Run]) -> Section:
    """The part of the page: a row an arm."""
    columns = ("arm", "verdict", "named right", "named wrong", "open", "diagnose, mm", "best plain, mm", "which")
    rows = [
        [
            str(run["seed"]),
            run["verdict"],
            *(_listed(run, told) for told in (RIGHT, WRONG, OPEN)),
            run["after_mm"],
            run["plain_mm"],
            run["plain"],
        ]
        for run in runs
    ]
    there = ", ".join(runs[0]["hidden"]) if runs else ""
    note = (
        f"Hidden in the arm: {there or 'no effect of the library'}, and errors of its joints that no effect expresses. "
        "A name is right if it, or one that the data can't tell from it, is hidden in the arm; grade C claims none. "
        "Plain calibrations are those that anyone would try, each by least squares and with the default loss. Errors "
        "are root mean squares over the rows that the study holds out."
    )
    known = [(run["after_mm"], run["plain_mm"]) for run in runs if run["after_mm"] is not None]
    answered, worse = len(known), sum(bool(plain) and after > BY_CHANCE * plain for after, plain in known)
    lead = (
        f"`fastcal diagnose` on the study's own rows: {answered} of {len(runs)} arms answer, and {worse} are missed by "
        f"more than {BY_CHANCE} times what the best plain calibration leaves."
    )
    table = Table("Diagnosis", "what is named, and what is left of held-out rows", columns, rows, note)
    return Section("What diagnose finds in these arms", lead, [table])


def _listed(run: Run, told: str) -> str:
    return ", ".join(f"{one['name']} ({one['grade']})" for one in run["names"] if one["told"] == told) or "none"
