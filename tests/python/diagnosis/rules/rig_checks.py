# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cameras and boards: when one cause leads."""

import numpy as np

from fastcal.diagnosis import rules
from fastcal.diagnosis.rig_causes import chance, leading
from fastcal.diagnosis.rig_library import RigCause

from .mutants import falls_with


def cause(effect: str, numbers: int, holds: str = "") -> RigCause:
    return RigCause(effect, "wrist", ("x",) * numbers, (1.0,) * numbers, lambda spec, values: None, holds)


OFFSET, SHUTTER, SCALE = cause("time_offset", 1), cause("rolling_shutter", 2, "time_offset"), cause("board_scale", 1)


@falls_with(RIG_LEAD=0.0)
@falls_with(RIG_LEAD=1e9)
def a_cause_leads_by_odds() -> None:
    assert leading([OFFSET, SCALE], np.array([50.0, 45.0])) == (0, [1])
    assert leading([OFFSET, SCALE], np.array([50.0, 35.0])) == (0, [])


@falls_with(RIG_LEAD=2.0)
@falls_with(RIG_LEAD=30.0)
def further_numbers_must_lead_too() -> None:
    assert leading([OFFSET, SHUTTER], np.array([50.0, 55.0])) == (0, [])
    assert leading([OFFSET, SHUTTER], np.array([50.0, 70.0])) == (1, [])


@falls_with(ALPHA_RIG=1.0)
@falls_with(ALPHA_RIG=1e-300)
def noise_of_a_hundred_names_is_no_cause() -> None:
    assert chance(20.0, 1, 100) > rules.ALPHA_RIG  # the best of a hundred is that good in 1 of 1,300 sets
    assert chance(40.0, 1, 100) < rules.ALPHA_RIG
