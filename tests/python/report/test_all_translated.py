# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every phrase of a page passes the translator: with a catalogue of blots nothing readable is left but names."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np
import pytest

from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.diagnosis.plan import SeparatingPlan
from fastcal.diagnosis.reasons import Because, BlockLabel, CauseLabel, Reason
from fastcal.diagnosis.result import Unexplained
from fastcal.fleet.page import fleet_page
from fastcal.fleet.result import ArmResult, Fleet
from fastcal.measurements.dataset import Dataset
from fastcal.report import language
from fastcal.report.diagnosis_report import diagnosis_page

_KEPT = re.compile(r"(%?\{\{.*?\}\}|\{.*?\})")
_TEXTS = ("text", "ticktext", "label", "labels", "hovertemplate", "title")
# Names of files, columns, commands and units are the same in all languages.
NAMES = {"approach", "arcmin", "arcsec", "arrays", "currentN", "fastcal", "model", "ppm", "yaml", "drop", "without"}
NAMES |= {"backlash", "joint", "pmc", "csv", "next", "poses", "wrist", "Wrist"}


class Blotted(dict[str, str]):
    """The catalogue of a language in which every letter is a blot."""

    def get(self, message: str, default: Any = None) -> str:
        parts = _KEPT.split(message)
        return "".join(part if k % 2 else re.sub(r"\w", "¤", part) for k, part in enumerate(parts))


def left_in_english(draw: Callable[[], str]) -> set[str]:
    """Words of three letters and more on a page that no catalogue was asked for; code and drawings' colours aside."""
    with mock.patch.object(language, "catalogue", return_value=Blotted()):
        page = draw()
    page = re.sub(r"<(style|code)\b.*?</\1>", " ", page, flags=re.DOTALL)
    drawings = re.findall(r'<script type="application/json">(.*?)</script>', page, re.DOTALL)
    page = re.sub(r"<script\b.*?</script>", " ", page, flags=re.DOTALL)
    spoken = [*re.findall(r'(?:aria-label|data-title)="([^"]*)"', page), re.sub(r"<[^>]+>", " ", page)]
    spoken += [text for drawing in drawings for text in _texts(json.loads(drawing))]
    words = re.findall(r"[^\W\d_]{3,}", re.sub(r"%\{[^}]*\}|<[^>]+>", " ", html.unescape(" ".join(spoken))))
    return {word for word in words if "¤" not in word}


def _texts(value: Any, key: str = "") -> Iterator[str]:
    """All strings of a drawing that are read."""
    if isinstance(value, str):
        if key in _TEXTS:
            yield value
    elif isinstance(value, list):
        for each in value:
            yield from _texts(each, key)
    elif isinstance(value, dict):
        for name, each in value.items():
            yield from _texts(each, name)


@pytest.fixture(scope="module")
def found(hidden_backlash) -> Diagnosis:
    return diagnose(hidden_backlash.robot, hidden_backlash.data, test=hidden_backlash.test)


@pytest.mark.parametrize("case", ["none", "named", "one_of", "several", "unexplained", "camera"])
def test_nothing_english_is_left_on_a_page_of_a_diagnosis(found: Diagnosis, case: str) -> None:
    (finding,) = found.effects
    reasons = [
        Because(reason, 0.01, 15.0, (BlockLabel("joint4", ("q4", "torque")),), ((2, 1e-3),)) for reason in Reason
    ]
    doubtful = replace(finding, grade="B", equivalents=(("backlash", "joint4"),), limits=reasons)
    plan = SeparatingPlan(
        Dataset(np.zeros((2, 6)), np.array([0.0, 2.0])), 0.09, 0.9, (CauseLabel("backlash", "joint3"),)
    )
    of_rig = [
        replace(finding, effect=effect, owner="wrist", parameters={})
        for effect in ("intrinsics", "bracket_sag", "time_offset", "placement_step")
    ]
    changed = {
        "none": {"effects": [], "steps": found.steps[:1], "gap": found.gap[:1]},
        "named": {},
        "one_of": {"effects": [doubtful], "plan": plan},
        "several": {"effects": [replace(finding, grade="C", in_model=False, limits=reasons[:3])] * 2},
        "unexplained": {"unexplained": Unexplained("workspace", 0.5, ("x", "y", "z"))},
        "camera": {"effects": of_rig},
    }[case]
    page = replace(found, verdict="several" if case == "camera" else case, **changed)
    assert left_in_english(lambda: diagnosis_page(page, language="de")) - NAMES == set()


def test_nothing_english_is_left_on_the_page_of_a_fleet() -> None:
    arms = [ArmResult(name="r1", status="converged", rows=30, message="")] + [
        ArmResult(name="r2", status=status, rows=3, message="") for status in ("refused", "not_converged")
    ]
    for verdict in ("", "named"):
        fleet = Fleet([replace(arm, verdict=verdict) for arm in arms])
        assert left_in_english(lambda fleet=fleet: fleet_page(fleet, language="de")) - NAMES == set()
