# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is kept of large things: the latest, up to so many bytes, as long as their owners live."""

import gc

from fastcal.diagnosis.recent import Recent


class Owner:
    pass


def test_the_latest_are_kept_and_others_made_again() -> None:
    recent, made = Recent[int](float, most=10.0), []

    def of(owner: Owner, size: int) -> int:
        return recent.of(owner, lambda: made.append(size) or size)  # type: ignore[func-returns-value]

    a, b, c = Owner(), Owner(), Owner()
    assert not recent.was_asked(a)
    assert [of(a, 4), of(b, 5), of(a, 4)] == [4, 5, 4]
    assert made == [4, 5]
    of(c, 3)  # b was asked for longest ago
    of(a, 4)
    assert made == [4, 5, 3]
    of(b, 5)
    assert made == [4, 5, 3, 5]
    assert recent.was_asked(c)


def test_one_that_is_too_large_is_kept_alone_and_goes_with_its_owner() -> None:
    recent, made = Recent[int](float, most=10.0), []
    owner = Owner()
    for _ in range(2):
        recent.of(owner, lambda: made.append(1) or 99)
    assert made == [1]
    del owner
    gc.collect()
    other = Owner()
    recent.of(other, lambda: 1)
    assert recent._bytes == 1.0
