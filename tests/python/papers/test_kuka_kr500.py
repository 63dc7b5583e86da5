# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The KR500 study: its hidden arm is table IV, and what its page shows follows from the runs."""

from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal_studies import kuka_kr500, run_study


@pytest.fixture
def content(known_kr500: None) -> dict[str, Any]:
    return run_study("kuka_kr500", arms=1)


def test_without_own_weight_and_noise_table_iv_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kuka_kr500, "OWN_WEIGHT", 0.0)
    true, nominal = kuka_kr500.true_arm(0), kuka_kr500.nominal_arm()
    q = np.radians(kuka_kr500.JOINTS_DEG)
    data = fastcal.simulate(true, q, payload=np.full(20, kuka_kr500.LOAD_N / 9.80665))
    found = fastcal.calibrate(nominal, data, effects=kuka_kr500.MODELS["33"], loss="none")
    assert found.rank == len(found.parameters) == 33
    values = {f"{p.owner} {p.name}": p.value - p.nominal for p in found.parameters}
    for k, (alpha, theta, a) in enumerate(
        zip(kuka_kr500.ALPHA_DEG, kuka_kr500.THETA_DEG, kuka_kr500.A_MM, strict=True), start=1
    ):
        if k > 1:  # row 1 is the base's
            assert values[f"joint{k} alpha_deg"] == pytest.approx(alpha, abs=1e-4)
            assert values[f"joint{k} a_mm"] == pytest.approx(a, abs=1e-3)
        if 1 < k < 6:  # joint 6 is the tool's
            assert values[f"joint{k} theta_deg"] == pytest.approx(theta, abs=1e-4)
    for k, stiffness in enumerate(kuka_kr500.STIFFNESS_NM_RAD[1:], start=2):
        assert values[f"joint{k} compliance_rad_nm"] * stiffness == pytest.approx(1, rel=0.01)


def test_the_paper_s_figure_is_reached_and_bettered(content: dict[str, Any]) -> None:
    (headline,) = content["headlines"]
    assert headline["reached"]
    assert headline["bettered"]
    assert headline["method"]["median"] < 0.5 < content["runs"][0]["15"]["27"]["held_out"]["max"]


def test_more_poses_come_near_the_noise(content: dict[str, Any]) -> None:
    """The noise of three coordinates of 0.03 mm alone has a mean length of 0.048 mm."""
    unseen = content["runs"][0]["100"]
    assert unseen["best100"]["unseen"]["mean"] < 0.055 < unseen["33"]["unseen"]["mean"]


def test_a_rigid_arm_s_numbers_are_those_of_its_errors(content: dict[str, Any]) -> None:
    held_out = np.linalg.norm(content["runs"][0]["15"]["33"]["held_out_mm"], axis=1)
    said = content["runs"][0]["15"]["33"]["held_out"]
    assert (held_out.mean(), held_out.std(ddof=1), held_out.max()) == pytest.approx(
        (said["mean"], said["std"], said["max"])
    )
