# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The PMC study without networks: its hidden arm is table 4, three costs, and loads that are dealt evenly."""

from collections.abc import Callable
from typing import Any

import pytest

from fastcal_studies import pmc6va030


def test_the_arm_is_as_far_off_as_the_paper_s_before_calibration(
    monkeypatch: pytest.MonkeyPatch, shown: Callable[..., dict[str, Any]]
) -> None:
    monkeypatch.setattr(pmc6va030, "HAS_TORCH", False)
    monkeypatch.setattr(pmc6va030, "BLOCKS_KG", (0.0, 5, 10, 15, 20, 30))
    monkeypatch.setattr(pmc6va030, "TRAINED_LOADS", 4)
    monkeypatch.setattr(pmc6va030, "TRAINED_FOR_TESTS", 2)
    run = pmc6va030.one_arm(0, full=False)
    assert run["before"]["mean"] == pytest.approx(3.704, rel=0.05)
    assert run["before"]["std"] == pytest.approx(1.351, rel=0.1)
    squares, root, printed = (run["kinematic"][method] for method in pmc6va030.METHODS)
    assert root["rms"] == pytest.approx(squares["rms"], rel=1e-6)
    assert printed["mean"] < squares["mean"]
    assert squares["rms"] < printed["rms"]
    assert squares["rank"] == 27
    assert run["jump"] == {"owner": "joint1<-joint2", "deg": pytest.approx(-72, abs=1), "right": 1.0}
    assert run["hidden"]["joint2 a_mm"] == 270.017  # table 4, under its own heading
    assert run["hidden"].keys() == {name for name in run["identified"] if name.startswith("joint")}
    for name, within in (("joint2 compliance_rad_nm", 0.2), ("joint1 rad_nm", 0.3), ("joint1<-joint2 gap_rad", 0.05)):
        assert run["yields"][name]["found"] == pytest.approx(run["yields"][name]["hidden"], rel=within)
    noise = 2e-2 * 3**0.5  # mm
    assert 0.9 * noise < run["kinematic"]["slack"]["rms"] < 1.5 * noise < squares["rms"]
    assert run["split_slack"]["others"]["mean"] < 1.5 * noise < run["split"]["others"]["mean"]
    assert run["untrained"]["best"]["mean"] < 1.5 * noise < run["untrained"]["model"]["mean"]
    dealt = run["loads"]
    assert sorted({*dealt["GA10"], *dealt["GA20"]}) == [0.0, 5, 10, 15, 20, 30]
    assert sorted([*dealt["GB10"], *dealt["GB20"]]) == dealt["GA10"]
    assert dealt["GB30"] == dealt["GA20"]
    shown("pmc6va030", run)
