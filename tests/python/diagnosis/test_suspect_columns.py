# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A payload column that is not what its title says is told, with the reading that fits, and makes no cause."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import diagnose
from fastcal.measurements.dataset import Dataset

from .rules.small_arm import arm, measured

ROWS = 90
YIELDING = [{"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 8e-6}}]


def written(payload: NDArray[np.float64], data: Dataset) -> Dataset:
    return replace(data, payload=payload)


def test_a_payload_as_it_was_measured_is_believed() -> None:
    found = diagnose(arm(), measured(YIELDING, rows=ROWS))
    assert [f.label for f in found.effects] == ["joint_compliance@joint2"]
    assert "payload column" not in found.sentence


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda load: np.where(np.arange(len(load)) < 55, load, load / 0.45359237),
            "11.02 and 22.05 kg, fit as pounds",
        ),
        (lambda load: np.r_[load[1:], load[-1:]], "that of the row before fits"),
        (lambda load: np.where(load == 5, 10.0, np.where(load == 10, 5.0, load)), "with 5 and 10 kg exchanged it does"),
    ],
)
def test_another_reading_of_the_payload_is_told(change, words: str) -> None:  # type: ignore[no-untyped-def]
    data = measured(YIELDING, rows=ROWS)
    found = diagnose(arm(), written(change(data.payload), data))
    assert found.sentence.startswith("The payload column does not fit these rows: ")
    assert words in found.sentence
    assert words in found.notes[0]
    assert [f.label for f in found.effects] == ["joint_compliance@joint2"]
