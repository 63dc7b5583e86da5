# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The studies' arms as someone would diagnose them: nominal arm, the study's own rows, and what is hidden in them."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any, cast

from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal_studies.study import NAMES


@dataclass(frozen=True)
class Sample:
    """Rows of a study's arm.

    Attributes:
        nominal: As the paper's authors have it.
        data: What they measured.
        test: Rows that the study holds out.
        true: The hidden arm, its hidden effects among it.
    """

    nominal: Robot
    data: Dataset
    test: Dataset
    true: Robot


def sample(name: str, seed: int) -> Sample:
    """The rows of arm `seed` of a study.

    Raises:
        InvalidInput: There is no study of that name.
    """
    if name not in NAMES:
        raise InvalidInput(f"unknown paper '{name}', expected one of {', '.join(NAMES)}")
    module = cast("Any", importlib.import_module(f"fastcal_studies.{name}"))
    return Sample(*module.to_diagnose(seed))
