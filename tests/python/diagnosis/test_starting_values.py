# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A fit begins at the values of another one, whatever the effect and its options: asked of every one."""

import copy
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from fastcal import _core, load_robot, random_poses
from fastcal.calibration.options_from_data import with_origins
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.diagnosis import diagnose
from fastcal.diagnosis.adaptation import robot_of
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.problem import Noise, Problem, prepared_problem, with_nuisances
from fastcal.diagnosis.starting_values import carried
from fastcal.effects.entries import build_effects, effect_owners, same_parameters
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

ROWS = 40
SIGMA = 4e-5  # [m]
# Values of each option that a file or a search may give, as a file writes it.
VALUES: dict[str, list[dict[str, Any]]] = {
    "side": [{"side": "load"}, {"side": "motor"}],
    "sign": [{"sign": "against"}],
    "width": [{"width_nm": 5.0}, {"width_nm": 50.0}],
    "t0": [{"t0_c": 21.0}, {"t0_s": 30.0}],
    "lag": [{"lag_s": 6.0}, {"lag_s": 12.0}],
    "first": [{"first_s": -10.0}],
    "last": [{"last_s": 9000.0}],
    "at": [{"at_s": 40.0}, {"at_s": 70.0}, {"at_deg": 10.0}, {"at_deg": 40.0}],
    "at_row": [{"at_row": 20.0, "rows": 40.0}, {"at_row": 30.0, "rows": 40.0}],
    "begins": [{"begins_s": -5.0}],
    "tau": [{"tau_s": 30.0}, {"tau_s": 70.0}],
    "period": [{"period_mm": 400.0}, {"period_mm": 900.0}],
    "by": [{"by": "group"}],
    "order": [{"order": 2.0}, {"order": 5.0}],
    "form": [{"form": "cubic"}],
    "pieces": [{"pieces": 3}],
    "torque": [{"torque": "payload"}],
    "motor_ratio": [{"side": "motor", "motor_ratio": 99.0}],
    "moments": [{"moments": "free"}, {"moments": "even"}],
    "low": [{"low_rad": -1.0}],
    "high": [{"high_rad": 1.0}],
    "knots": [{"knots": 9}, {"knots": 14}],
    "periodic": [{"periodic": 1}],
    "target": [{"target": "pose"}],
    "column": [{"column": "tilt"}, {"column": "level"}],
    "axis": [{"column": "tilt", "axis": "z"}, {"column": "tilt", "axis": "rz"}],
    "size": [{"column": "tilt", "size": 2.0}],
    "beam": [{"beam_mm": [300.0, 0.0, 0.0]}],
}
# What geometry, labels or other entries decide and no one writes, and what a surrogate, without parameters, is.
DECIDED = {"even_shares", "shape_shares", "index", "count", "rows", "inputs", "width", "nodes", "weights", "shift"}
HELD = [{}, {"prior": "yes"}, {"curvature": 1.0}]


SPRING = {
    "joint": 2,
    "anchor_mm": [-150.0, -50.0, 0.0],
    "arm_mm": [-60.0, -40.0, 0.0],
    "stiffness_n_m": 2e5,
    "free_length_mm": 80.0,
}
LEAST: dict[str, dict[str, Any]] = {"regressor": {"column": "tilt"}, "base_step": {"at": 40.0}} | {
    "tool_step": {"at": 40.0},
    "zero_step": {"at": 40.0},
    "range_step": {"at": 40.0},
    "range_wave": {"period": 0.5},
    "base_settling": {"tau": 30.0},
}
NAMES = _core.effect_names()


@cache
def arm(with_masses: bool = True) -> Robot:
    spec = copy.deepcopy(load_robot("pmc6va030").spec)
    for joint in spec["joints"]:
        joint["motor_ratio"] = 101.0
    spec["compensator"] = SPRING
    for joint in spec["joints"]:
        if not with_masses:
            joint.pop("link", None)
    return Robot(spec)


@cache
def arm_with(name: str) -> Robot:
    """An arm that has owners for the effect: beams need a structure, slack a pin of a closed loop."""
    others = (load_robot(other) for other in ("spray_7dof", "palletizer"))
    return next(robot for robot in (arm(), *others) if effect_owners(name, robot.core))


@cache
def rows(robot: Robot, payloads: tuple[float, ...] = (0.0, 10.0), seed: int = 3, count: int = ROWS) -> Dataset:
    random = np.random.default_rng(seed)
    n = robot.joint_count
    poses = Dataset.from_arrays(
        random_poses(robot, count, seed=seed),
        robot=robot,
        payload=random.choice(payloads, count),
        temperature=np.linspace(290.0, 300.0, count),
        time=np.linspace(0.0, 100.0, count),
        station=["a", "b", *random.choice(["a", "b"], count - 2)],
        mount=[1, 2, *random.integers(1, 3, count - 2)],
        approach=random.choice([-1.0, 1.0], (count, n)),
        current=random.normal(0, 3, (count, n)),
        extra={"tilt": random.normal(0, 1, count), "level": random.normal(0, 1, count)},
    )
    return simulate(perturbed(robot, seed=seed), poses, noise=SIGMA, seed=seed)


@cache
def problem(name: str) -> Problem:
    robot = arm_with(name)
    return prepared_problem(robot, rows(robot), [], Noise((SIGMA, 1e-4, SIGMA)), 1)


def options_of(name: str) -> list[str]:
    """Options of an effect of the core, as its own refusal lists them."""
    robot, options = arm_with(name), {**LEAST.get(name, {}), "none_such": 1.0}
    with pytest.raises(InvalidInput, match=f"{name} has no option") as refused:
        _core.make_effect(name, robot.core, effect_owners(name, robot.core)[0], options)
    return re.findall(r"[a-z_0-9]+", str(refused.value).partition("there are ")[2])


def variants(name: str) -> Iterator[dict[str, Any]]:
    """Entries of one effect and owner with each value of each option, held in each way."""
    robot = arm_with(name)
    owner = effect_owners(name, robot.core)[1 if len(effect_owners(name, robot.core)) > 1 else 0]
    for option in options_of(name):
        assert option in VALUES or option in DECIDED, f"{name}: give {option} values to be tried with"
    bare = [] if name in LEAST else [{}]
    each = [*bare, *(value for option in options_of(name) for value in VALUES.get(option, []))]
    for option, held in product(each, HELD):
        try:
            entry = with_origins({"effect": name, "owner": owner, **option, **held}, robot, rows(robot))
            build_effects([entry], robot.core)
        except InvalidInput:
            continue  # for another owner, or not alone
        yield entry


def start(name: str, entry: dict[str, Any], near: Fit | None) -> tuple[Fit, dict[str, float]]:
    """A fit of no steps with this entry, and the values that its parameters begin at."""
    given = problem(name)
    entries = with_nuisances([entry], given.start.robot)
    effects = given.effects(entries)
    model, samples = given.model(entries, given.kept, effects)
    theta = carried(given, entries, effects, model, near)
    own = slice(given.own, given.own + len(effects[0].parameters))
    values = dict(zip((p.name for p in effects[0].parameters), map(float, theta[own]), strict=True))
    found = fit(given, [Hypothesis(entry)]) if near is None else near
    theta[given.own :] = np.arange(1.0, len(theta) - given.own + 1)
    return replace(found, entries=entries, added=(), model=model, samples=samples, theta=theta), values


@pytest.mark.parametrize("name", NAMES)
def test_values_go_by_name_to_entries_whose_parameters_mean_the_same_and_to_no_other(name: str) -> None:
    """`sag` that was even and was then free made an internal error: one number for many (options were listed)."""
    entries = list(variants(name))
    assert entries or name == "surrogate"
    for first in entries:
        near, _ = start(name, first, None)
        numbers = dict(
            zip((p.name for p in near.model_effects[0].parameters), near.theta[problem(name).own :], strict=False)
        )
        for second in entries:
            values = start(name, second, near)[1]
            written = {key: value for key, value in second.items() if key not in ("prior", "curvature")}
            same = written == {key: value for key, value in first.items() if key not in ("prior", "curvature")}
            assert (same_parameters(first) == same_parameters(second)) is same
            assert values == ({k: float(numbers[k]) for k in values} if same else start(name, second, None)[1])


def test_a_file_without_masses_and_one_payload_is_answered() -> None:
    """What most users have."""
    true = Robot(
        dict(perturbed(arm(), seed=6).spec)
        | {
            "effects": [
                {"effect": "joint_compliance", "owner": f"joint{i}", "parameters": {"compliance_rad_nm": c}}
                for i, c in ((2, 1.2e-6), (3, 1.5e-6))
            ]
        }
    )
    poses = Dataset.from_arrays(random_poses(arm(), 150, seed=8), robot=arm(), payload=np.full(150, 5.0))
    found = diagnose(arm(with_masses=False), simulate(true, poses, noise=SIGMA, seed=9))
    assert {f.owner for f in found.effects} >= {"joint2"}
    assert found.gap[-1].train_rms_mm < 0.3 * found.gap[0].train_rms_mm


@pytest.mark.parametrize("name", NAMES)
def test_what_is_written_predicts_what_was_fitted(name: str) -> None:
    """A held sag counted from the geometry of its file, and was written without: 0.5 mm became 5 mm."""
    for with_masses in (True, False):
        robot = arm_with(name) if with_masses else arm(with_masses=False)
        if not effect_owners(name, robot.core):
            continue
        given = prepared_problem(robot, rows(robot), [], Noise((SIGMA, 1e-4, SIGMA)), 1)
        for entry in variants(name):
            found = fit(given, [Hypothesis(entry)])
            theta = found.theta[: len(found.model.parameters)]
            fitted = np.asarray(found.model.predict(found.samples, theta, 1, None))
            written = robot_of(found, SIGMA).poses(given.kept)
            np.testing.assert_allclose(written[:, :3, 3], fitted[:, :3, 3], atol=2e-8)
