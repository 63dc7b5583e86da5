# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do poses of a kind lie within a limit? The share that does, judged by counting, whatever the errors' distribution.

Of n poses k lie beyond the limit. With X binomial (n, 1 - SHARE): kept where P(X <= k) is at most 1 - CONFIDENCE, so
that at least SHARE of all such poses lie within it with that confidence (C. Clopper and E. Pearson 1934); exceeded
where P(X >= k) is at most 1 - CONFIDENCE; else the poses are too few to decide. It takes 59 poses without an exception
to keep one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fastcal.calibration.evaluation import distances
from fastcal.calibration.result import CalibrationResult
from fastcal.errors import InvalidInput
from fastcal.units import from_si

SHARE = 0.95
CONFIDENCE = 0.95
Verdict = Literal["pass", "fail", "cannot_tell"]


@dataclass(frozen=True)
class LimitJudged:
    """What poses show about a limit.

    Attributes:
        limit: [m].
        poses, beyond: Judged, and of these beyond the limit.
        on_test: Were they test poses? Those of the fit are too good a sample to pass on.
        confidence: That at least SHARE of such poses lie within the limit.
        verdict: pass, fail or cannot_tell.
    """

    limit: float
    poses: int
    beyond: int
    on_test: bool
    confidence: float
    verdict: Verdict

    def to_json_dict(self) -> dict[str, Any]:
        """The block `acceptance` of result.json."""
        return {
            "limit_mm": from_si(self.limit, "mm"),
            "poses": self.poses,
            "beyond": self.beyond,
            "on_test": self.on_test,
            "share": SHARE,
            "sure": CONFIDENCE,
            "confidence": self.confidence,
            "verdict": self.verdict,
        }


def judge_limit(result: CalibrationResult, limit: float) -> LimitJudged:
    """Holds the errors after calibration against a limit [m]: of the test poses, or of the fit where there are none.

    Raises:
        InvalidInput: The limit is not above 0, or no point or length was measured.
    """
    from scipy import special  # late: a calibration without a limit needs no SciPy

    if not limit > 0:
        raise InvalidInput(f"a limit must be above 0, got {from_si(limit, 'mm'):g} mm")
    judged = result.test or result.train
    errors = distances(judged.error_after, judged.length_after)
    errors = errors[~np.isnan(errors)]
    n, k = len(errors), int(np.sum(errors > limit))
    if n == 0:
        raise InvalidInput("a limit needs measured points or lengths, and there are none")
    confidence = 1 - float(special.bdtr(k, n, 1 - SHARE))
    at_least = 1.0 if k == 0 else float(special.bdtrc(k - 1, n, 1 - SHARE))
    on_test = result.test is not None
    verdict: Verdict = "cannot_tell"
    if confidence >= CONFIDENCE and on_test:
        verdict = "pass"
    elif at_least <= 1 - CONFIDENCE:
        verdict = "fail"
    return LimitJudged(limit, n, k, on_test, confidence, verdict)
