# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Errors of masses and centres come with whatever follows loads, and with nothing else."""

import copy

import numpy as np

from fastcal import Robot
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.problem import with_nuisances

from .rules.small_arm import arm, measured, problem

COMPLIANCE = {"effect": "joint_compliance", "owner": "joint2"}
BACKLASH = {"effect": "backlash", "owner": "joint2"}


def test_what_follows_loads_brings_the_errors_of_masses() -> None:
    found = {(e["effect"], e["owner"]) for e in with_nuisances([COMPLIANCE], arm())}
    links = {(effect, f"link{k}") for effect in ("link_mass", "link_com") for k in (1, 2, 3)}
    assert found == {("joint_compliance", "joint2")} | links
    assert with_nuisances([BACKLASH], arm()) == [BACKLASH]


def test_wrong_masses_leave_nothing_beside_a_large_compliance() -> None:
    """Without them so large a compliance would leave the shadow of masses that are 8 % off."""
    heavier = copy.deepcopy(arm().spec)
    for joint, factor in zip(heavier["joints"], (1.05, 0.94, 1.08), strict=True):
        joint["link"]["mass_kg"] *= factor
    stiffness = {**COMPLIANCE, "parameters": {"compliance_rad_nm": 3e-4}}
    given = problem(measured([stiffness], robot=Robot(heavier)))
    (cause,) = (n for n in given.names if n.key == ("joint_compliance", "joint2"))
    found = fit(given, [cause])
    assert abs(found.remaining - found.freedom) < 4 * np.sqrt(2 * found.freedom)
