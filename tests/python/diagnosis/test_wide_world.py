# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The wide world of the benchmark: what files differ in is drawn, and what is drawn is judged."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BENCH = Path(__file__).parents[3] / "bench" / "python"


@pytest.fixture(autouse=True)
def on_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCH))


def test_every_value_of_every_factor_is_drawn() -> None:
    import diagnosis_worlds as worlds

    drawn = [worlds.world(np.random.default_rng([1, k])) for k in range(60)]
    for what, shares in (("masses", worlds.MASSES), ("payload", worlds.PAYLOADS), ("place", worlds.PLACES)):
        assert {w.factors[what] for w in drawn} >= {k for k, share in shares.items() if share >= 0.1}
    assert {w.at.nominal.joint_count for w in drawn} >= {4, 6, 7}
    assert {w.at.has_masses for w in drawn} == {True, False}
    assert min(w.at.count for w in drawn) < 80 < 400 < max(w.at.count for w in drawn)
    assert all(len(w.at.poses) == w.at.count + 1000 for w in drawn)


@pytest.mark.parametrize("name", ["scara", "gantry", "kuka_kr210_r2700 on a rail", "lbr_iiwa14 on a rail"])
def test_arms_that_slide_reach_along_their_slides(name: str) -> None:
    import diagnosis_worlds as worlds

    arm = worlds.MADE_ARMS[name]()
    slides = [k for k, joint in enumerate(arm.spec["joints"]) if joint["type"] == "prismatic"]
    middle = np.zeros(arm.joint_count)
    along = []
    for k in slides:
        out = middle.copy()
        out[k] = 0.1
        step = arm.forward(out[np.newaxis])[0, :3, 3] - arm.forward(middle[np.newaxis])[0, :3, 3]
        assert np.linalg.norm(step) == pytest.approx(0.1)
        along.append(step / 0.1)
    gram = np.array(along) @ np.array(along).T
    assert gram == pytest.approx(np.eye(len(slides)), abs=1e-9)
    if "rail" in name:
        assert along[0][2] == pytest.approx(0.0, abs=1e-9)  # level


def test_each_slip_changes_its_column_alone() -> None:
    import diagnosis_slips as slips
    import diagnosis_worlds as worlds

    random = np.random.default_rng(3)
    world = next(
        w
        for w in (worlds.world(np.random.default_rng([2, k])) for k in range(100))
        if w.factors["payload"] == "three" and all(w.factors[c] == "there" for c in ("time", "temperature", "approach"))
    )
    data = world.data([], random)
    for column, slip in slips.SLIPS.values():
        changed = slip(data, random)
        for name in ("q", "payload", "temperature", "approach", "time"):
            same = np.array_equal(getattr(changed, name), getattr(data, name))
            assert same == (name != column)


def test_what_each_station_sees_is_one_rigid_motion() -> None:
    import diagnosis_worlds as worlds

    world = next(
        w
        for w in (worlds.world(np.random.default_rng([4, k])) for k in range(100))
        if w.factors["set-ups"] == "stations"
    )
    seen, still, codes = world.seen([]), world.at.still, world.at.poses.station
    for code in np.unique(codes):
        a, b = (x[codes == code][:40] for x in (seen, still))
        lengths = [np.linalg.norm(x[:, np.newaxis] - x[np.newaxis], axis=2) for x in (a, b)]
        assert lengths[0] == pytest.approx(lengths[1], abs=1e-9)
    assert not np.allclose(seen, still)


@pytest.fixture
def record() -> Callable[..., Any]:
    import diagnosis_wide

    return diagnosis_wide.wide_record


def test_a_set_is_the_same_whatever_was_asked_before(record: Callable[..., Any]) -> None:
    from dataclasses import replace

    import diagnosis_wide

    first, again = (replace(record(0, 7, "single"), seconds=0.0) for _ in range(2))
    assert first == again
    assert first.truth
    assert first.noise_um > 0
    assert diagnosis_wide.wide_line(first).strip().startswith("0")


def test_the_page_counts_what_the_records_say() -> None:
    from diagnosis_wide import WideRecord
    from diagnosis_wide_page import wide_demands, wide_rendered

    factors = {"payload": "one", "masses": "none"}
    right = WideRecord(0, "single", factors, ["backlash@joint2"], [20.0], ["backlash@joint2"], found=[True],
                       named=1, b_names=1, noise_um=50, geometry_um=100, model_um=52, plain_um=90)  # fmt: skip
    wrong = WideRecord(1, "none", factors, [], [], named=1, b_names=1, wrong=["B backlash@joint1"], noise_um=50,
                       geometry_um=50, model_um=60, plain_um=50)  # fmt: skip
    fallen = WideRecord(2, "outside", factors, ["bump@joint2"], [30.0], error="ValueError: x")
    counted = {d.what: (d.hits, d.count) for d in wide_demands([right, wrong, fallen])}
    assert list(counted.values()) == [(2, 3), (1, 2), (0, 2), (1, 2), (0, 1), (1, 1)]
    assert right.closed == pytest.approx(1 - (52**2 - 50**2) / (100**2 - 50**2))
    page = wide_rendered([right, wrong, fallen])
    assert "| sets that are answered | 3 | 66.7% |" in page
    assert "MISSED" in page
