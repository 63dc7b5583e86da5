# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The spray robot's study, small: which errors are redundant, and what beams and commands do."""

from collections.abc import Callable
from typing import Any

import pytest

from fastcal_studies import spray_7dof
from fastcal_studies.spray_7dof_steps import DONE


def test_beams_and_commands(monkeypatch: pytest.MonkeyPatch, shown: Callable[..., dict[str, Any]]) -> None:
    """Redundant errors wander off and what is left converges; identified beams are better than the file's."""
    monkeypatch.setattr(spray_7dof, "WAVES_RAD", (0.0,) * 7)
    monkeypatch.setattr(spray_7dof, "CANDIDATES", 3000)
    monkeypatch.setattr(spray_7dof, "FITTED", 120)
    monkeypatch.setattr(spray_7dof, "UNSEEN", 20)
    monkeypatch.setattr(spray_7dof, "MANY", 130)
    run = spray_7dof.one_arm(1, full=False)
    assert run["rank"] == 27
    assert all(run["steps"][way][-1] < DONE for way in ("removed", "without", "damped", "kept_without"))
    assert max(run["steps"]["kept"]) > 1.0  # metres, on an arm of 4 m
    assert run["left"]["removed"][-1] < 0.5 * run["left"]["without"][-1]
    for path in (run["paths"][method] for method in ("levenberg", "truncated")):
        flat = [y for used, y in zip(path["used"], path["unseen"], strict=True) if 26.9 < used < 27.1]
        assert flat
        assert max(flat) < 1.3 * run["paths"]["removed"]["unseen"]
        assert max(y for y in path["unseen"] if y is not None) > 100 * max(flat)
    for axis in "XY":
        sent = [run["commands"][name][axis]["mean"] for name in ("best", "gravity", "rigid", "before")]
        assert sent == sorted(sent)
    assert run["design"]["random"] < run["design"]["greedy"] <= run["design"]["exchanged"]
    assert run["without_waves"] == run["unseen"]["best"]
    shown("spray_7dof", run)
