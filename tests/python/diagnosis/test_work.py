# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How many fits and linearizations a diagnosis takes: a count, which a busy machine does not change.

The counts are those of today. A change that needs half as many again says so here, with its reason; chance in the last
digit of a fit moves a count by a few percent.
"""

from collections import Counter
from typing import Any

import numpy as np
import pytest

from fastcal import Robot, diagnose, perturbed, simulate
from fastcal.diagnosis.problem import Problem
from fastcal.diagnosis.search import Search
from fastcal.measurements.dataset import Dataset

from .rules.small_arm import SIGMA, arm, measured

ROWS = 90
MORE = 1.5  # times as much, or as little: worth a look
SOFT = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 8e-6}}
SOFTER = {"effect": "joint_compliance", "owner": "joint3", "parameters": {"compliance_rad_nm": 2e-5}}
PLAY = {"effect": "backlash", "owner": "joint2", "parameters": {"gap_rad": 4e-4}}


def with_play() -> Dataset:
    data = measured([], rows=ROWS)
    poses = Dataset.from_arrays(
        data.q, payload=data.payload, approach=np.random.default_rng(3).choice([-1.0, 1.0], (ROWS, 3))
    )
    true = Robot(dict(perturbed(arm(), seed=3, length=5e-4, angle=5e-4).spec) | {"effects": [PLAY]})
    return simulate(true, poses, noise=SIGMA, seed=3)


def jumping() -> Dataset:
    """A joint whose zero is another one over a third of its range: nothing in the library does that."""
    data = measured([], rows=ROWS)
    assert data.position is not None
    off = np.where(data.q[:, 1:2] > np.quantile(data.q[:, 1], 0.66), 3e-4, 0.0)
    return Dataset.from_arrays(data.q, payload=data.payload, position=data.position + off * [1.0, -0.5, 0.7])


def counted(data: Dataset, monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Linearizations with their derivatives, and sets of names that were fitted."""
    work: Counter[str] = Counter()
    linearized, state = Problem.linearized, Search.state

    def count(self: Problem, *args: Any, columns: bool = True, **options: Any) -> Any:
        work["linearizations"] += columns
        return linearized(self, *args, columns=columns, **options)

    def fitted(self: Search, *args: Any) -> Any:
        before = len(self.seen)
        found = state(self, *args)
        work["sets"] += len(self.seen) - before
        return found

    monkeypatch.setattr(Problem, "linearized", count)
    monkeypatch.setattr(Search, "state", fitted)
    diagnose(arm(), data)
    return work


@pytest.mark.parametrize(
    ("data", "linearizations", "sets"),
    [
        (lambda: measured([], rows=ROWS), 20, 0),  # 13, and 7 for steps, which pass for noise in rows without times
        (lambda: measured([SOFT], rows=ROWS), 68, 5),  # 60, and 8 for plain models fitted again without idle joints
        (lambda: measured([SOFT, SOFTER], rows=ROWS), 144, 19),
        (with_play, 58, 8),
        (jumping, 48, 1),
    ],
    ids=["nothing", "one yields", "two yield", "play", "jump"],
)
def test_a_diagnosis_takes_no_more_work(
    data: Any, linearizations: int, sets: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = counted(data(), monkeypatch)
    assert linearizations / MORE <= work["linearizations"] <= MORE * linearizations
    assert sets / MORE <= work["sets"] <= MORE * sets
