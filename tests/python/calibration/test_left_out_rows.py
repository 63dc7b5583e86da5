# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where most rows were left out, the user hears of rows that do not fit and not of too few measurements alone.

A third of the touches of two sockets had their labels exchanged: "too few equations: measure more poses".
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fastcal.calibration.data_notes import thin_data_notes


def ended(status: str, left_out: int) -> Any:
    """A fit of 80 touches of a socket and 35 parameters."""
    return SimpleNamespace(
        status=status,
        residuals=np.zeros((80, 3)),
        outliers=list(range(left_out)),
        free=list(range(35)),
        degrees_of_freedom=1,
        loss="tukey",
    )


@pytest.mark.parametrize(("left_out", "said"), [(80, True), (41, True), (40, False), (0, False)])
def test_rows_that_do_not_fit_are_said_where_too_few_remain(left_out: int, said: bool) -> None:
    notes = thin_data_notes(ended("too_few_equations", left_out), "tukey")
    assert [f"{left_out} of 80 rows do not fit the others" in note for note in notes] == ([True] if said else [])
    assert thin_data_notes(ended("converged", left_out), "tukey") == []
