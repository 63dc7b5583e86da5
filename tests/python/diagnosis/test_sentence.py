# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the sentence of a diagnosis lists."""

from types import SimpleNamespace
from typing import Any

from fastcal.diagnosis import words
from fastcal.diagnosis.result import Finding, NamedValue


def test_a_joint_with_several_waves_is_listed_once() -> None:
    owners = ["joint1", "joint1", "joint3", "joint1"]
    waves = [
        Finding("gear_harmonic", owner, "B", {"order": NamedValue(float(order), 0.0)}, 30.0, 0.0)
        for order, owner in enumerate(owners, start=1)
    ]
    found: Any = SimpleNamespace(effects=waves, few="")
    assert words._causes(found).endswith("a periodic gear or encoder error at joint 1, joint 3.")
