# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""bench/papers/spray_calibration.py with fewer postures: what the spray-painting paper found, on an independent arm."""

import copy
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.robot.robot import Robot

PAPERS = Path(__file__).parents[2] / "bench" / "papers"


@pytest.fixture(scope="module")
def bench() -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PAPERS)
        return runpy.run_path(str(PAPERS / "spray_calibration.py"))


@pytest.fixture(scope="module")
def found(bench: dict[str, Any]) -> dict[str, Any]:
    out: dict[str, Any] = bench["study"](1, "random", fitted=80, unseen=60, stiffnesses=(1.0,))
    return out


def test_redundant_errors_wander_and_what_is_left_converges(bench: dict[str, Any], found: dict[str, Any]) -> None:
    assert found["kept"]["steps"][-1] > 1.0  # metres, on an arm of 4 m
    assert found["removed"]["steps"][-1] < bench["DONE"]
    assert len(found["removed"]["steps"]) <= 10
    assert found["damped"]["steps"][-1] < bench["DONE"]
    assert found["removed"]["excursion"] < 0.05


def test_gravity_takes_off_more_than_the_paper_s_share(bench: dict[str, Any], found: dict[str, Any]) -> None:
    errors = found["stiffness 1"]
    for axis, percent in bench["PAPER"].items():
        assert errors["gravity"][axis] < (1 - percent / 100) * errors["rigid"][axis] < errors["before"][axis]


def test_stiffness_factors_lie_within_three_deviations(found: dict[str, Any]) -> None:
    for name, group in found["groups"].items():
        assert abs(group["found"] - group["true"]) < 3 * group["std"], name
        assert group["std"] < 0.3 * group["true"], name


def test_the_arm_that_is_measured_bends_as_the_fitted_one_but_for_shear(bench: dict[str, Any]) -> None:
    nominal = fastcal.load_robot("spray_7dof")
    q = fastcal.random_poses(nominal, 10, seed=3)
    load = np.full(10, 8.0)
    rigid = nominal.forward(q)[:, :3, 3]
    stiff = bench["FineArm"](copy.deepcopy(nominal.spec), 1e9).points(q, load)
    assert stiff == pytest.approx(rigid, abs=1e-7)
    sag = bench["FineArm"](copy.deepcopy(nominal.spec)).points(q, load) - rigid
    bent: Robot = bench["with_beams"](nominal, 1.0)
    own = bent.forward(q, payload=load)[:, :3, 3] - rigid
    assert np.linalg.norm(sag - own) < 0.1 * np.linalg.norm(sag)
    assert (np.linalg.norm(sag, axis=1) > np.linalg.norm(own, axis=1)).all()


def test_the_coupled_jacobian_is_the_papers_but_for_bent_frames(bench: dict[str, Any]) -> None:
    """J* of section 5.2 (eq. 11 to 13, 36): ^iJ_7 G_i E_i with the last frame where gravity takes it."""
    nominal = fastcal.load_robot("spray_7dof")
    bent = bench["with_beams"](nominal, 1.0)
    q = fastcal.random_poses(nominal, 5, seed=4)
    J = bent.parameter_jacobian(q, rows=6)
    names = bent.parameter_names
    motion = bench["FineArm"].__init__.__globals__["motion"]
    for row, pose, columns in zip(q, bent.forward(q), J, strict=True):
        T = np.eye(4)
        for i, (joint, position) in enumerate(zip(nominal.spec["joints"], row, strict=True), start=1):
            slides = joint["type"] == "prismatic"
            alpha, theta = np.radians([joint["alpha_deg"], joint["theta_deg"]])
            before = T @ motion(0, alpha)
            T = before @ motion(0, 0, joint["a_mm"] / 1000) @ motion(2, theta + (not slides) * position)
            T = T @ motion(2, 0, joint["d_mm"] / 1000 + slides * position)
            # Eq. 18: a moves along n_(i-1), alpha turns about it, theta and d about and along a_i, beta about o_i.
            for name, axis, at, turns in (
                ("a", before[:3, 0], before, False),
                ("alpha", before[:3, 0], before, True),
                ("theta", T[:3, 2], T, True),
                ("d", T[:3, 2], T, False),
                ("beta", T[:3, 1], T, True),
            ):
                column = columns[:, names.index(f"joint{i} {name}")]
                lever = pose[:3, 3] - at[:3, 3]
                expected = np.concatenate([np.cross(axis, lever), axis] if turns else [axis, np.zeros(3)])
                # Frames before the last one are bent too, by less than 2 mrad: the paper leaves them straight.
                assert column == pytest.approx(expected, abs=0.01), (i, name)


@pytest.fixture(scope="module")
def measured(bench: dict[str, Any]) -> tuple[Robot, fastcal.Dataset]:
    """An arm in the tracker's frame and what is measured of it, its beams those of OpenSees."""
    perturbed = fastcal.perturbed(fastcal.load_robot("spray_7dof"), length=1e-3, angle=1e-3, seed=1)
    true = Robot(perturbed.spec | {"base": bench["BASE"]})
    return true, bench["measured"](true, fastcal.random_poses(true, 60, seed=1), 11, payload=bench["PAYLOAD"])


def test_diagnosis_of_the_rigid_model_names_its_beams_and_no_joint(measured: tuple[Robot, fastcal.Dataset]) -> None:
    found = fastcal.diagnose(fastcal.load_robot("spray_7dof"), measured[1])
    assert (found.verdict, [cause.label for cause in found.effects]) == ("named", ["beam_gravity@structure"])
    assert found.effects[0].equivalents == ()
    scale = found.effects[0].parameters["scale"]
    assert scale.std is not None
    assert abs(scale.value - 1.0) < 3 * scale.std + 0.05  # shear bends the finer frame by a few percent more


def test_diagnosis_names_a_joint_that_yields_and_no_beams(measured: tuple[Robot, fastcal.Dataset]) -> None:
    true, poses = measured
    yielding = {"effect": "joint_compliance", "owner": "joint3", "parameters": {"compliance_rad_nm": 2e-7}}
    data = fastcal.simulate(Robot(dict(true.spec) | {"effects": [yielding]}), poses, noise=6e-5, seed=1)
    found = fastcal.diagnose(fastcal.load_robot("spray_7dof"), data)
    assert [cause.label for cause in found.effects] == ["joint_compliance@joint3"]
    assert ("beam_gravity", "structure") not in found.effects[0].equivalents
