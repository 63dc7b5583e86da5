# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An acceptance limit by counting: 59 poses without an exception keep it, 58 do not."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from fastcal.calibration.acceptance_limit import LimitJudged, judge_limit
from fastcal.errors import InvalidInput


def judged(count: int, beyond: int, *, test: bool = True) -> LimitJudged:
    error = np.zeros((count, 3))
    error[:, 0] = 1e-4
    error[:beyond, 0] = 3e-4
    part = SimpleNamespace(error_after=error, length_after=None)
    result: Any = SimpleNamespace(train=part, test=part if test else None)
    return judge_limit(result, 2e-4)


@pytest.mark.parametrize(
    ("count", "beyond", "verdict"),
    [(59, 0, "pass"), (58, 0, "cannot_tell"), (93, 1, "pass"), (92, 1, "cannot_tell"), (60, 6, "cannot_tell"),
     (60, 7, "fail"), (3, 3, "fail"), (1, 0, "cannot_tell")],
)  # fmt: skip
def test_the_verdict_is_that_of_a_binomial_test(count: int, beyond: int, verdict: str) -> None:
    found = judged(count, beyond)
    assert found.verdict == verdict
    assert found.confidence == pytest.approx(1 - stats.binom.cdf(beyond, count, 0.05))
    if verdict == "fail":
        assert stats.binom.sf(beyond - 1, count, 0.05) <= 0.05


def test_poses_of_the_fit_do_not_pass() -> None:
    assert judged(200, 0, test=False).verdict == "cannot_tell"
    assert judged(200, 100, test=False).verdict == "fail"


def test_a_limit_is_above_zero() -> None:
    result: Any = SimpleNamespace(train=None, test=None)
    with pytest.raises(InvalidInput, match="above 0"):
        judge_limit(result, 0.0)
