# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The contract of kinds and commands: each kind of reading alone, and each pair, goes through all that models meet."""

import json
from pathlib import Path

import numpy as np
import pytest

import fastcal

from ..calibration.bench_arm import disturbed, robot
from ..calibration.kind_sets import ALONE, PAIRS, read

MOVED = 2e-3  # [rad] of joint 3's zero


@pytest.mark.parametrize("kinds", [*ALONE, *PAIRS], ids="+".join)
def test_check_update_compare_history_and_evaluate_take_every_kind(kinds: tuple[str, ...], tmp_path: Path) -> None:
    rows = disturbed(3)
    model = fastcal.calibrate(robot(), read(kinds, 120, 3)).model
    model.save(tmp_path / "model.yaml")
    model = fastcal.load_robot(tmp_path / "model.yaml")

    same = fastcal.check(model, read(kinds, 40, 99, truth=rows))
    assert same.verdict == "holds"
    content = same.to_json_dict()
    assert set(content["kinds"]) == set(content["noise"]) == set(kinds)
    for kind in content["kinds"].values():
        assert 0.5 * kind["expected_rms"] < kind["after"]["rms"] < 1.6 * kind["expected_rms"]
    assert (content["rms_mm"] is not None) == ("position" in kinds)

    moved = rows.copy()
    moved[2, 0] += MOVED
    data = read(kinds, 40, 98, truth=moved)
    changed = fastcal.check(model, data)
    assert changed.verdict == "changed"
    assert changed.causes[0].label == "joint3 zero"
    (zero,) = changed.causes[0].changes
    assert zero.change == pytest.approx(np.degrees(MOVED), abs=5 * zero.std)

    seen = fastcal.evaluate(model, read(kinds, 40, 97, truth=rows))
    assert set(seen.kinds) == set(kinds)

    updated = fastcal.update(model, data)
    assert updated.status == "converged"
    for kind, before, after in updated.errors:
        if kind.name != "orientation" or len(kinds) == 1:
            assert after < 0.5 * before
    apart = fastcal.compare(model, updated.model)
    assert any(d.owner == "joint3" and d.name == "theta_deg" for d in apart.significant)

    changed.save(tmp_path / "check.json")
    changed.save(tmp_path / "check.html")
    updated.save(tmp_path / "updated")
    apart.save(tmp_path / "compared")
    months = fastcal.history(tmp_path)
    months.save(tmp_path / "history")
    assert any(arm.state == "changed" for arm in months.arms)
    assert json.loads((tmp_path / "check.json").read_text())["verdict"] == "changed"


def test_a_kind_whose_noise_nobody_knows_is_left_out_and_said() -> None:
    model = fastcal.calibrate(robot(), read(("position",), 120, 3)).model
    both = read(("position", "length"), 40, 99, truth=disturbed(3))
    found = fastcal.check(model, both)
    assert any("lengths are not used: neither the model nor a sigma_mm column" in note for note in found.notes)
    assert list(found.to_json_dict()["kinds"]) == ["position"]
    with pytest.raises(fastcal.InvalidInput, match="lengths are not used"):
        fastcal.check(model, read(("length",), 40, 99, truth=disturbed(3)))


def test_a_tolerance_is_of_points() -> None:
    model = fastcal.calibrate(robot(), read(("length",), 120, 3)).model
    with pytest.raises(fastcal.InvalidInput, match="a tolerance is of points"):
        fastcal.check(model, read(("length",), 40, 99, truth=disturbed(3)), tolerance=1e-3)
