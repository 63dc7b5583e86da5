# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One whole arm of each study that has networks; minutes, so only in the full tests."""

import pytest

from fastcal_studies import NAMES, load_study, run_study
from fastcal_studies.page import paper_page


@pytest.mark.full
@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("kuka_kr500", "spray_7dof")])
def test_a_whole_arm_with_its_networks(name: str) -> None:
    found = run_study(name, arms=1)
    assert load_study(name).PAPER.robot == found["paper"]["robot"]
    assert "networks" in found["runs"][0]
    assert found["headlines"][-1]["bettered"]
    assert paper_page(found).count("torch is not installed") == 0
