# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The spray robot's study, small: which errors are redundant, and what beams and commands do."""

from collections.abc import Callable
from typing import Any

import pytest

from fastcal_studies import spray_7dof


def test_beams_and_commands(monkeypatch: pytest.MonkeyPatch, shown: Callable[..., dict[str, Any]]) -> None:
    """Redundant errors wander off and what is left converges; identified beams are better than the file's."""
    monkeypatch.setattr(spray_7dof, "WAVES_RAD", (0.0,) * 7)
    monkeypatch.setattr(spray_7dof, "CANDIDATES", 3000)
    monkeypatch.setattr(spray_7dof, "FITTED", 120)
    monkeypatch.setattr(spray_7dof, "UNSEEN", 20)
    monkeypatch.setattr(spray_7dof, "MANY", 130)
    run = spray_7dof.one_arm(1, full=False)
    assert run["rank"] == 27
    assert run["steps"]["removed"][-1] < spray_7dof.DONE
    assert run["steps"]["damped"][-1] < spray_7dof.DONE
    assert max(run["steps"]["kept"]) > 1.0  # metres, on an arm of 4 m
    for axis in "XY":
        sent = [run["commands"][name][axis]["mean"] for name in ("best", "gravity", "rigid", "before")]
        assert sent == sorted(sent)
    assert run["design"]["random"] < run["design"]["greedy"] <= run["design"]["exchanged"]
    assert run["without_waves"] == run["unseen"]["best"]
    shown("spray_7dof", run)
