# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arms that are not as their controllers believe."""

from collections.abc import Callable
from functools import cache

import pytest

import fastcal


@cache
def _arms(name: str) -> tuple[fastcal.Robot, fastcal.Robot]:
    nominal = fastcal.load_robot(name)
    yielding = [
        {"effect": "joint_compliance", "owner": joint, "parameters": {"compliance_rad_nm": {"value": 4e-7}}}
        for joint in ("joint2", "joint3")
    ]
    return nominal, fastcal.perturbed(fastcal.Robot(nominal.spec | {"effects": yielding}), seed=3)


@pytest.fixture(scope="session")
def arms() -> Callable[[str], tuple[fastcal.Robot, fastcal.Robot]]:
    """(nominal, real) of a shipped arm: real is off by about 0.5 mm and 0.5 mrad, and its joints 2 and 3 yield."""
    return _arms
