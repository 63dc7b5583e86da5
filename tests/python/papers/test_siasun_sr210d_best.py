# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What fastcal's best leaves of the SR210D's rows, on few of them."""

from functools import partial

import pytest

pytest.importorskip("torch")

from fastcal.calibration.calibrate import calibrate
from fastcal_studies import siasun_sr210d as study
from fastcal_studies.exhibits import lengths_mm
from fastcal_studies.siasun_sr210d_best import behind, by_rows
from fastcal_studies.simulated import Unmodelled, left


def test_the_process_takes_waves_away_and_more_rows_more_of_them() -> None:
    """Behind the model it leaves less than the model, and nothing that was not there on an arm without waves."""
    nominal, true = study.nominal_arm(), study.true_arm(3)
    q = study.poses(nominal, 500, 40)
    fit = partial(calibrate, nominal, effects=[*study.TRANSMISSION, *study.OWN_SAG])

    waves, still = (Unmodelled(sizes, 1.0, 0.0, 3) for sizes in (study.WAVES_RAD, (0.0,) * 6))
    few, more, unseen = (study.measured(true, waves, q[own], 0.0, 1) for own in _PARTS)
    model = fit(few).model
    plain = lengths_mm(left(model, unseen))["mean"]
    found = behind(model, few, 0, {"fitted": few, "others": unseen})
    assert found["fitted"]["mean"] < found["others"]["mean"] < plain
    assert len(found["others"]["by_pose"]) == len(unseen)
    rows = by_rows(fit, few, more, (100, 300), unseen, 0)
    assert rows["300"] < rows["100"] < found["others"]["mean"]

    few, _, unseen = (study.measured(true, still, q[own], 0.0, 1) for own in _PARTS)
    model = fit(few).model
    plain = lengths_mm(left(model, unseen))["mean"]
    assert behind(model, few, 0, {"others": unseen})["others"]["mean"] < 1.1 * plain


_PARTS = (slice(0, 60), slice(60, 360), slice(360, 500))
