# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The contract of kinds and commands, continued: draws, diagnosis, plans and the acceptance of each kind and pair.

`monitoring/test_every_kind.py` has check, update, compare, history and evaluate; `design/test_measured.py` has plans
after readings of each kind.
"""

import os

import numpy as np
import pytest

import fastcal
from fastcal.acceptance import accept, plan_acceptance
from fastcal.measurements.kinds import kind_named
from fastcal.report import write_report

from .bench_arm import disturbed, robot
from .kind_sets import ALONE, PAIRS, read

# Each kind in two pairs; all pairs in ./test --full.
SOME = PAIRS if os.environ.get("FASTCAL_TEST_FULL") == "1" else [PAIRS[i] for i in (0, 4, 7, 9, 3)]
KINDS = pytest.mark.parametrize("kinds", [*ALONE, *SOME], ids="+".join)


@KINDS
def test_calibrate_draws_and_pages_take_every_kind(kinds: tuple[str, ...], tmp_path) -> None:
    found = fastcal.calibrate(robot(), read(kinds, 100, 6))
    assert (found.status, found.misfits) == ("converged", [])
    write_report(found, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert ("do not determine where the arm stands" in page) == ("position" not in kinds)
    if "position" not in kinds:
        assert found.shape is not None
        assert found.shape.scaled < found.shape.point  # some leave a common scale of all lengths open
    drawn = fastcal.bootstrap(robot(), read(kinds, 100, 6), draws=6)
    assert drawn.not_converged == 0
    stated = np.array([p.std for p in drawn.result.parameters])
    assert 0.5 < np.sqrt(np.mean((drawn.std / stated) ** 2)) < 1.6


@KINDS
def test_diagnose_takes_every_kind(kinds: tuple[str, ...]) -> None:
    found = fastcal.diagnose(robot(), read(kinds, 100, 6))
    assert "No missing effect" in found.sentence
    content = found.to_json_dict()
    assert set(content["kinds"]) == set(content["noise"]) == set(kinds)
    assert kind_named(found.main_noise.kind.name).unit in found.sentence


@KINDS
def test_a_model_of_every_kind_is_planned_with_and_accepted(kinds: tuple[str, ...]) -> None:
    model = fastcal.calibrate(robot(), read(kinds, 120, 3)).model
    plan = plan_acceptance(model, language="urscript", program="iso.script", compensate=True, cycles=3)
    true = robot(disturbed(3))
    data = fastcal.simulate(true, fastcal.Dataset.from_arrays(plan.q), noise=1e-5, seed=1)
    found = accept(model, data, limits={"ap_mm": 0.5}, draws=0)
    assert found.verdict == "pass"
    assert found.predicted is not None
    asked = fastcal.design_poses(model, 10, candidates="random", candidate_count=300)
    assert len(asked) == 10
    poses = fastcal.check_poses(model, 6)
    assert len(poses) == 6
    if "position" not in kinds:
        with pytest.raises(fastcal.InvalidInput, match="measured point"):
            accept(model, read(kinds, 40, 9, truth=disturbed(3)), draws=0)
