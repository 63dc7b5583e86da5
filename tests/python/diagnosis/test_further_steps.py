# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What stepped more than once is named at each of its moments; what only drifts is no staircase."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fastcal import (
    Dataset,
    Robot,
    calibrate,
    design_poses,
    diagnose,
    drop_effects,
    load_robot,
    random_poses,
    simulate,
)
from fastcal.arrays import FloatArray
from fastcal.diagnosis import Diagnosis, scans
from fastcal.diagnosis.rounds import _cuts_memory_into_steps
from fastcal.effects.entries import identity_options
from fastcal.report import write_report

ROWS = 150
TIME = 12.0 * np.arange(ROWS)
NOISE = 5e-5  # [m]


def step(owner: str, row: int, way_mm: list[float]) -> dict[str, Any]:
    names = ("step_x_mm", "step_y_mm", "step_z_mm")
    parameters = dict(zip(names, way_mm, strict=True))
    return {"effect": f"{owner}_step", "owner": owner, "at_s": TIME[row] - 6.0, "parameters": parameters}


def arm(effects: list[dict[str, Any]]) -> Robot:
    return load_robot("ur10").with_(effects=effects)


def found(effects: list[dict[str, Any]], seed: int, *, timed: bool, way: FloatArray | float = 0.0) -> Diagnosis:
    data = simulate(arm(effects), random_poses(arm([]), ROWS, seed=seed), noise=NOISE, seed=seed, time=TIME)
    assert data.position is not None
    moved = data.position + np.reshape(way, (-1, 1)) * [0.6, -0.5, 0.6]
    time = TIME if timed else None
    return diagnose("ur10", Dataset.from_arrays(data.q, position=moved, robot=arm([]), time=time))


def moments(of: Diagnosis, key: str) -> list[float]:
    return sorted(f.parameters[key].value for f in of.effects)


@pytest.mark.parametrize("owner", ["tool", "base"])
def test_two_steps_are_two_names_each_at_its_own_time(owner: str, tmp_path: Path) -> None:
    first, second = step(owner, 30, [0.3, -0.4, 0.2]), step(owner, 104, [0.4, 0.3, -0.3])
    of = found([first, second], 1, timed=True)
    assert [(f.label, f.grade) for f in of.effects] == [(f"{owner}_step@{owner}", "A")] * 2
    assert moments(of, "at_s") == pytest.approx([first["at_s"], second["at_s"]], abs=6.0)
    assert all(f"at {moment:g} s" in of.sentence for moment in moments(of, "at_s"))
    assert of.gap[-1].held_out_rms_mm == pytest.approx(1e3 * NOISE * np.sqrt(3), rel=0.15)
    write_report(of, tmp_path / "page.html")
    first_s, second_s = moments(of, "at_s")
    page = (tmp_path / "page.html").read_text()
    assert all(f"model.yaml {owner}_step@{owner}:at_s={at:g} -o" in page for at in (first_s, second_s))
    left = drop_effects(of.model, f"{owner}_step@{owner}:at_s={second_s:g}").entries
    assert [identity_options(entry) for entry in left] == [{"at_s": first_s}]


def test_there_and_back_around_a_row_is_a_gross_error() -> None:
    """One gross row of an arm with nothing missing was two steps of the base, 90 s apart."""
    data = Dataset.from_arrays(np.zeros((ROWS, 1)), time=TIME)
    first, *others = (SimpleNamespace(entry={"at_s": TIME[k] - 6.0}) for k in (30, 31, 34, 35, 70))
    enough = [scans._leaves_rows_between([other, first], data) for other in others]
    assert enough == [False, False, True, True]
    assert not scans._leaves_rows_between([others[-1], first, others[0]], data)


def test_without_times_they_are_told_by_their_rows() -> None:
    of = found([step("tool", 20, [0.4, 0.2, 0.1]), step("tool", 108, [-0.1, 0.5, 0.3])], 5, timed=False)
    assert [f.label for f in of.effects] == ["tool_step@tool"] * 2
    assert moments(of, "at_row") == [20, 108]
    assert not [one for one in of.untestable if one.effect.endswith("_step")]
    assert sorted(identity_options(entry)["at_row"] for entry in of.model.entries) == [20, 108]


def test_a_step_that_is_asked_for_is_the_one_that_is_there() -> None:
    there = [step("tool", 30, [0.3, -0.4, 0.2])]
    data = simulate(arm(there), random_poses(arm([]), 60, seed=1), noise=NOISE, seed=1, time=TIME[:60])
    model = calibrate(arm(there), data, effects="geometry,tool_step").model
    assert [identity_options(entry) for entry in model.entries] == [{"at_s": 354.0}]
    plan = design_poses(model, 10, effects="geometry,tool_step", candidates="random", candidate_count=100)
    assert len(plan) == 10


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.full)])
def test_what_drifts_is_no_staircase(seed: int, *, timed: bool) -> None:
    """A random walk, and a slow wave."""
    walk = np.cumsum(np.random.default_rng(seed).normal(0, 4e-5, ROWS))
    wave = 4e-4 * np.sin(2 * np.pi * np.arange(ROWS) / ROWS)
    for way in (walk, wave):
        of = found([], seed, timed=timed, way=way)
        assert not [f.label for f in of.effects if f.effect.endswith("_step") and (f.grade != "C" or not timed)]


@pytest.mark.parametrize(
    ("effect", "time", "memory", "cut"),
    [
        ("tool_step", None, 0.5, True),
        ("tool_step", None, 0.0, False),
        ("tool_step", TIME, 0.5, False),
        ("backlash", None, 0.5, False),
    ],
)
def test_steps_beside_which_noise_remembers_are_looked_at_again(
    effect: str, time: FloatArray | None, memory: float, *, cut: bool
) -> None:
    problem = SimpleNamespace(data=SimpleNamespace(time=time), noise=SimpleNamespace(memory=memory))
    search: Any = SimpleNamespace(problem=problem)
    best: Any = SimpleNamespace(names=[SimpleNamespace(effect=effect)])
    assert _cuts_memory_into_steps(search, best) == cut


def test_noise_with_a_memory_is_not_cut_into_steps() -> None:
    """Of rows without times, whose range drifts along the line of sight."""
    random, rho = np.random.default_rng(3), 0.6
    drawn = random.normal(0, 1e-4, ROWS)
    drift = np.zeros(ROWS)
    for i in range(ROWS):
        drift[i] = (rho * drift[i - 1] if i else 0.0) + np.sqrt(1 - rho**2) * drawn[i]
    of = found([], 3, timed=False, way=drift)
    assert of.effects == []
    assert of.search.problem.noise.memory > 0.2
