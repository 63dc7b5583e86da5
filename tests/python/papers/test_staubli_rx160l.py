# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The RX160L study without networks: its hidden arm is tables 1 and 3, and its parts find them."""

from collections.abc import Callable
from typing import Any

import pytest

from fastcal_studies import staubli_rx160l


def test_without_waves_tables_1_and_3_come_back(
    monkeypatch: pytest.MonkeyPatch, shown: Callable[..., dict[str, Any]]
) -> None:
    """What is left then is what the tool's 3.6 kg bend, which no row of the geometry can be."""
    monkeypatch.setattr(staubli_rx160l, "HAS_TORCH", False)
    monkeypatch.setattr(staubli_rx160l, "WAVES_RAD", (0.0,) * 6)
    monkeypatch.setattr(staubli_rx160l, "HARMONIC_RAD", 0.0)
    monkeypatch.setattr(staubli_rx160l, "CANDIDATES", 300)
    monkeypatch.setattr(staubli_rx160l, "LEARNT", 30)
    run = staubli_rx160l.one_arm(0, full=False)
    assert run["selection"]["held_out"]["mean"] < 0.12 < 2 < run["selection"]["before"]["mean"]
    joint, critical, low, high = staubli_rx160l.STIFFNESS[2]  # the corners of 2 and 3 are hardly reached
    for name, hidden in (("critical_nm", critical), ("low_rad_nm", 1 / low), ("high_rad_nm", 1 / high)):
        found = run["stiffness"][f"joint{joint} {name}"]
        assert found["value"] == pytest.approx(hidden, abs=4 * found["std"]), name
    least, most = run["torques"]["14.0 kg"]
    assert max(abs(least[4]), abs(most[4])) < 5 < max(abs(least[0]), abs(most[0]))  # joint 6 hardly bears any
    shown("staubli_rx160l", run)
