# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`--hand-eye FILE` of `calibrate` and `diagnose`: where a camera is on its arm, in files that other programs load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fastcal.cli.console import say

if TYPE_CHECKING:
    from fastcal.calibration.calibrate import CalibrationResult
    from fastcal.calibration.result import IdentifiedParameter
    from fastcal.robot.hand_eye import HandEye
    from fastcal.robot.robot import Robot


def check_hand_eyes(paths: Sequence[Path], robot: Robot | None = None) -> None:
    """InvalidInput, before anything is done, where a name says no format or an arm has no camera."""
    from fastcal.io.hand_eye_file import check_hand_eye_name
    from fastcal.robot.hand_eye import hand_eyes

    for path in paths:
        check_hand_eye_name(path)
    if paths and robot is not None:
        hand_eyes(robot.description)


def write_hand_eyes(result: CalibrationResult, paths: Sequence[Path]) -> None:
    """The cameras of an arm, into each file, where anything was identified."""
    from fastcal.robot.hand_eye import hand_eyes

    if paths and result.parameters:
        write(hand_eyes(result.model.description), is_of_model(result.parameters), paths)


def is_of_model(parameters: Sequence[IdentifiedParameter]) -> bool:
    """Was an arm identified too?"""
    from fastcal.place import place_of

    return any(place_of(p.owner).kind == "joint" for p in parameters)


def write(found: Sequence[HandEye], of_model: bool, paths: Sequence[Path]) -> None:
    """The cameras into each file, which together are there or not; `of_model`: was an arm identified with them?"""
    from fastcal.io.atomic import atomic_paths
    from fastcal.io.hand_eye_file import hand_eye_texts

    found = [replace(of, of_model=of_model) for of in found]
    texts = {path: text for given in paths for path, text in hand_eye_texts(found, given).items()}
    with atomic_paths(list(texts)) as temporaries:
        for temporary, text in zip(temporaries, texts.values(), strict=True):
            temporary.write_text(text, encoding="utf-8", newline="\n")
    for path in texts:
        say(str(path))
