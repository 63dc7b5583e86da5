# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which set of a search is the best, and which are asked whether they suffice."""

from typing import Any

import pytest

from fastcal.diagnosis.rounds import _best


class Node:
    def __init__(self, bic: float, suffices: bool | None, *, impossible: bool = False) -> None:
        self.bic, self.impossible, self._suffices = bic, impossible, suffices

    @property
    def suffices(self) -> bool:
        assert self._suffices is not None, "asked in vain"
        return self._suffices


@pytest.mark.parametrize(
    ("last", "chosen"),
    [
        ([Node(70.0, None), Node(50.0, False), Node(55.0, True)], 55.0),  # the likeliest that suffices
        ([Node(70.0, True), Node(50.0, False)], 50.0),  # one that leaves something is likelier by far
        ([Node(70.0, False), Node(50.0, False)], 50.0),  # none suffices
    ],
)
def test_the_likeliest_set_that_suffices_unless_another_is_likelier_by_far(last: list[Any], chosen: float) -> None:
    start: Any = Node(100.0, None)
    assert _best([[start], last]).bic == chosen
