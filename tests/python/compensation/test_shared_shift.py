# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The part of a program's error that all targets share, which a calibration's error before does not contain."""

from __future__ import annotations

import numpy as np
import pytest

from fastcal.compensation import shared_in_words, shared_shift
from fastcal.report.language import _, in_language


def test_the_shift_is_parted_into_what_is_shared_and_what_is_not() -> None:
    shift = np.array([[1e-3, 2e-3, -2e-3], [1e-3, 2e-3, -2e-3], [1.3e-3, 2e-3, -2e-3], [0.7e-3, 2e-3, -2e-3]])
    shared, about = shared_shift(np.hstack([shift, np.ones((4, 3))]))
    assert shared == pytest.approx(3e-3)
    assert about == pytest.approx(0.3e-3 / np.sqrt(2))
    assert shared**2 + about**2 == pytest.approx(np.mean(np.sum(shift**2, axis=1)))
    said = shared_in_words(shift)
    assert said is not None
    assert said.startswith("3.00 mm of this is one shift that all targets share; about it they are off by 0.21 mm RMS")
    with in_language("de"):
        assert _(said).startswith("3,00 mm davon")


def test_nothing_is_said_where_little_is_shared_or_too_few_targets_share_it() -> None:
    assert shared_in_words(np.array([[1e-3, 0, 0], [-1e-3, 0, 0], [0, 0.1e-3, 0]])) is None
    assert shared_in_words(np.full((2, 3), 1e-3)) is None
