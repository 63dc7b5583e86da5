# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The SR210D study without networks: its hidden arm is the printed one, and its parts find it."""

from collections.abc import Callable
from typing import Any

import pytest

from fastcal_studies import siasun_sr210d
from fastcal_studies.learning import WITHOUT_TORCH


def test_without_waves_the_printed_arm_comes_back(
    monkeypatch: pytest.MonkeyPatch, shown: Callable[..., dict[str, Any]]
) -> None:
    """Lengths read off the hidden axes are table 3's, and currents find its flexibilities."""
    monkeypatch.setattr(siasun_sr210d, "HAS_TORCH", False)
    monkeypatch.setattr(siasun_sr210d, "FRICTION", 0.0)
    monkeypatch.setattr(siasun_sr210d, "OWN_WEIGHT", 1e-9)  # its sag without load would go into the geometry
    monkeypatch.setattr(siasun_sr210d, "WAVES_RAD", (0.0,) * 6)
    monkeypatch.setattr(siasun_sr210d, "SENT", 5)
    run = siasun_sr210d.one_arm(0, full=False)
    printed = dict(zip(("L1 (mm)", "L2 (mm)", "L3 (mm)", "L4 (mm)"), siasun_sr210d.LENGTHS_MM, strict=True))
    assert {name: run["screws"]["true"][name] for name in printed} == pytest.approx(printed)
    for joint, hidden in enumerate(siasun_sr210d.FLEXIBILITY_RAD_A, start=1):
        if hidden:
            found = run["flexibility"]["joint"][f"joint{joint}"]
            assert found["value"] == pytest.approx(hidden, abs=5 * found["std"] + 1e-8)
    for joint, ratio in enumerate(siasun_sr210d.RATIOS, start=1):
        found = run["transmission"][f"joint{joint}"]
        assert found["value"] == pytest.approx(ratio - 1, abs=5 * found["std"])
    assert run["without_waves"]["held_out"] == run["geometry"]["best_held_out"]
    assert run["without_waves"]["others"] == run["stiffness"]["best_others"]
    assert run["commands"]["best"]["mean"] < 0.2 < 3 < run["commands"]["none"]["mean"]
    assert run["commands"]["full"]["mean"] <= 1.05 * run["commands"]["one_step"]["mean"]
    out = shown("siasun_sr210d", run)
    assert [e["why"] for s in out["sections"] for e in s["exhibits"] if e["number"] == "Table 8"] == [WITHOUT_TORCH]
