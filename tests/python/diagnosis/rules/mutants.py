# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which check falls when a rule of the diagnosis is turned off or pushed hard."""

from collections.abc import Callable

Check = Callable[[], None]

MUTANTS: list[tuple[str, object, Check]] = []


def falls_with(**mutated: object) -> Callable[[Check], Check]:
    """Registers a check that holds with the rules as they are, and fails with each of these values in turn."""

    def register(check: Check) -> Check:
        MUTANTS.extend((name, value, check) for name, value in mutated.items())
        return check

    return register
