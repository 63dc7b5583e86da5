# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Commands for target poses: smooth along a path, in the right configuration, honest about what can't be reached."""

from itertools import pairwise

import numpy as np
import pytest

import fastcal
from fastcal.compensation.curves import between
from fastcal.correction import Corrected
from fastcal.errors import InvalidInput
from fastcal.robot.controller_robot import nominal_record, nominal_robot

START = {
    "staubli_rx160l": [10.0, 20.0, 80.0, 15.0, 50.0, -20.0],
    "lbr_iiwa14": [20.0, 35.0, -15.0, -70.0, 25.0, 60.0, 10.0],
}


@pytest.mark.parametrize("name", START)
def test_a_line_is_followed_without_a_jump(arms, name) -> None:
    nominal, real = arms(name)
    T = nominal.forward(np.radians(START[name]))[0]
    end = T.copy()
    end[:3, 3] += [-0.25, 0.2, -0.15]
    poses = between(T, end, 200)
    found = fastcal.compensate(real, poses, np.radians(START[name]), nominal=nominal, payload=3.0)
    assert (found.status == "reached").all()
    assert found.jumps == ()
    np.testing.assert_allclose(real.forward(found.q, payload=3.0), poses, atol=1e-8)
    steps = np.abs(np.diff(found.q, axis=0))
    assert steps.max() < 0.02  # 350 mm in 200 steps, a metre out
    # Smooth: the second difference of a smooth curve is small beside its steps.
    assert np.abs(np.diff(found.q, n=2, axis=0)).max() < 0.1 * steps.max()


@pytest.mark.parametrize("name", START)
def test_far_rows_of_a_path_keep_the_configuration(arms, name) -> None:
    """Four corners far apart: the same solutions as with all poses between them."""
    nominal, _ = arms(name)
    q = np.radians(START[name])
    corners = np.repeat(nominal.forward(q), 4, axis=0)
    corners[1:, :3, 3] += [[-0.15, 0.3, 0.1], [-0.2, 0.1, 0.25], [-0.1, -0.2, 0.1]]
    sides = [between(a, b, 60) for a, b in pairwise(corners)]
    fine = fastcal.compensate(nominal, np.vstack(sides), q)
    assert fine.reached.all()
    found = fastcal.compensate(nominal, corners, q)
    assert found.jumps == fine.jumps == ()
    np.testing.assert_allclose(found.q[0], q, atol=1e-7)
    tolerance = 1e-7 if name == "staubli_rx160l" else 0.15  # a redundant arm's joints depend on the steps
    np.testing.assert_allclose(found.q[1:], fine.q[59::60], atol=tolerance)


@pytest.mark.parametrize("method", ["full", "one-step"])
def test_a_held_joint_of_a_redundant_arm_stays(arms, method) -> None:
    nominal, real = arms("lbr_iiwa14")
    q = np.radians(START["lbr_iiwa14"])
    T = nominal.forward(q)[0]
    end = T.copy()
    end[:3, 3] += [-0.1, 0.15, 0.1]
    poses = between(T, end, 30)
    found = fastcal.compensate(real, poses, q, nominal=nominal, hold=[3], method=method)
    assert found.reached.all()
    assert found.jumps == ()
    np.testing.assert_array_equal(found.q[:, 2], q[2])
    np.testing.assert_allclose(
        real.forward(found.q)[:, :3, 3], poses[:, :3, 3], atol=1e-8 if method == "full" else 1e-4
    )
    assert np.ptp(fastcal.compensate(real, poses, q, nominal=nominal).q[:, 2]) > 1e-3  # else it moves


def test_an_unavoidable_jump_is_reported(arms) -> None:
    """From one side of the arm to the other through axis 1, where joint 1 meets its limit: row 1 jumps, alone."""
    nominal, _ = arms("staubli_rx160l")
    q = np.radians([[150.0, 20.0, 80.0, 0.0, 50.0, 0.0], [-150.0, 20.0, 80.0, 0.0, 50.0, 0.0]])
    poses = nominal.forward(q)
    poses = np.concatenate([poses, between(poses[1], nominal.forward(q[1] + 0.05)[0], 5)])
    found = fastcal.compensate(nominal, poses, q[0])
    assert found.reached.all()
    assert found.jumps == (1,)
    assert "no smooth path leads from the previous row to row 1: the joints jump there" in found.notes
    assert fastcal.compensate(nominal, poses, q[0], along_path=False).jumps == ()


def test_a_path_that_leaves_the_workspace_comes_back_in_the_same_configuration(arms) -> None:
    """Out along the forearm and back: the rows out of reach point where the others do."""
    nominal, real = arms("staubli_rx160l")
    q = np.radians(START["staubli_rx160l"])
    T = nominal.forward(q)[0]
    far = T.copy()
    far[:3, 3] *= 1.6
    poses = np.concatenate([between(T, far, 20), between(far, T, 20)])
    found = fastcal.compensate(real, poses, q, nominal=nominal)
    assert not found.reached[17:23].any()
    assert found.reached[[0, 39]].all()
    assert found.jumps == ()
    assert np.abs(found.q[39] - q).max() < 0.01
    assert np.abs(np.diff(found.q, axis=0)).max() < 1.0


def test_every_kind_of_bad_target_has_its_status_and_sentence(arms) -> None:
    nominal, real = arms("staubli_rx160l")
    good = np.radians(START["staubli_rx160l"])
    stretched = np.radians([10.0, 20.0, 80.0, 15.0, 0.0, -20.0])  # axes 4 and 6 in line
    beyond = np.radians([10.0, 20.0, 80.0, 15.0, 50.0, -20.0])
    T = np.concatenate([real.forward(good), nominal.forward(stretched), real.forward(good), real.forward(good)])
    T[2, :3, 3] *= 4
    T[3, 0, 3] = np.nan
    tight = fastcal.Robot(
        real.spec | {"joints": [*real.spec["joints"][:5], real.spec["joints"][5] | {"min_deg": 100.0}]}
    )
    assert tight.limits[5, 0] > beyond[5]
    found = fastcal.compensate(real, T, nominal=nominal, along_path=False)
    assert found.status.tolist()[2:] == ["unreachable", "bad_target"]
    assert found.status[0] == "reached"
    plain = fastcal.compensate(nominal, T[1:2], stretched)
    assert plain.status.tolist() == ["singular"]
    assert plain.notes[0].startswith("row 0: the target is reached in a singular posture")
    near = zip(real.spec["joints"], START["staubli_rx160l"], strict=True)
    narrow = [joint | {"min_deg": q - 5, "max_deg": q + 5} for joint, q in near]
    narrow[5] = narrow[5] | {"min_deg": 0.0, "max_deg": 10.0}
    boxed = fastcal.Robot(real.spec | {"joints": narrow})
    limited = fastcal.compensate(boxed, T[:1], nominal=boxed)
    assert limited.status.tolist() == ["limit"]
    assert limited.notes[0].startswith("row 0: the target can be reached only beyond the joint limits; within them")
    assert ((limited.q >= boxed.limits[:, 0] - 1e-12) & (limited.q <= boxed.limits[:, 1] + 1e-12)).all()
    assert np.isnan(found.q[3]).all()
    assert np.isnan(found.position_error[3])
    assert found.position_error[2] > 1.0
    assert [note.split(":")[0] for note in found.notes[:2]] == ["row 3", "row 2"]


def test_one_step_leaves_errors_of_second_order(arms) -> None:
    """Half the errors leave a quarter: q_n + J^+ e is Newton's first step."""
    nominal, _ = arms("staubli_rx160l")
    q = np.radians(START["staubli_rx160l"]) + np.random.default_rng(2).uniform(-0.3, 0.3, (20, 6))
    poses = nominal.forward(q)
    left = []
    for size in (1.0, 0.5):
        real = fastcal.perturbed(nominal, length=size * 1e-3, angle=size * 1e-3, seed=6)
        found = fastcal.compensate(real, poses, q, nominal=nominal, method="one-step")
        assert (found.status == "reached").all()
        np.testing.assert_allclose(
            found.position_error, np.linalg.norm((real.forward(found.q) - poses)[:, :3, 3], axis=1), atol=1e-15
        )
        left.append(np.median(found.position_error))
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.1)
    assert 1e-7 < left[0] < 3e-5


def test_a_trained_correction_is_compensated_too(arms) -> None:
    class Push:
        """Half a millimetre along x of the base, and some more with joint 2; half a milliradian about z, and so on."""

        joint_count = 6

        def __call__(self, inputs) -> Corrected:
            count = len(inputs.q)
            d = np.column_stack([5e-4 + 1e-3 * np.sin(inputs.q[:, 1]), np.zeros(count), 2e-4 * inputs.payload])
            sigma = np.full((count, 3), 1e-5)
            return Corrected(d, np.ones(count), sigma, d[:, ::-1], sigma)

    nominal, real = arms("staubli_rx160l")
    model = fastcal.Robot(real.spec | {"correction": Push()})
    q = np.radians(START["staubli_rx160l"]) + np.random.default_rng(3).uniform(-0.2, 0.2, (10, 6))
    poses = nominal.forward(q)
    found = fastcal.compensate(model, poses, q, nominal=nominal, payload=2.0)
    assert (found.status == "reached").all()
    np.testing.assert_allclose(model.forward(found.q, payload=2.0), poses, atol=3e-9)
    off = np.abs(real.forward(found.q, payload=2.0) - poses)
    assert off[:, :3, 3].max() > 3e-4
    assert off[:, :3, :3].max() > 3e-4
    np.testing.assert_allclose(found.sigma, 1e-5)


def test_a_target_in_the_gap_of_a_correction_that_jumps_is_not_called_reached(arms) -> None:
    """Where joint 1 is beyond 0.3 the tool is pushed back: what lies in between, no command gives."""

    class Step:
        """As a tree's leaves or a nearest neighbour's cells."""

        joint_count = 6

        def __call__(self, inputs) -> Corrected:
            d = np.zeros((len(inputs.q), 3))
            d[:, 1] = np.where(inputs.q[:, 0] > 0.3, 3e-4, 0.0)
            return Corrected(d, np.ones(len(d)), 0 * d, 0 * d, 0 * d)

    nominal, _ = arms("staubli_rx160l")
    model = fastcal.Robot(nominal.spec | {"correction": Step()})
    q = np.array([[0.30005, 0.4, 1.2, 0.3, 0.7, 0.8], [0.4, 0.4, 1.2, 0.3, 0.7, 0.8]])
    poses = nominal.forward(q)
    found = fastcal.compensate(model, poses, q, nominal=nominal, along_path=False)
    assert found.status.tolist() == ["unreachable", "reached"]
    left = np.linalg.norm((model.forward(found.q) - poses)[:, :3, 3], axis=1)
    np.testing.assert_allclose(found.position_error, left, atol=2e-9)
    assert left[0] == pytest.approx(3e-4, rel=1e-6)
    assert "row 0: the target is out of reach; the nearest pose is 0.3 mm" in found.notes[0]


def test_a_nominal_robot_is_what_the_first_calibration_began_with(arms) -> None:
    nominal, real = arms("staubli_rx160l")
    once = real.spec | {"calibration": {"nominal": nominal_record(nominal.spec)}}
    again = nominal_record(once)  # calibrated once more, from the calibrated model
    q = np.radians([START["staubli_rx160l"]])
    T_world_base, T_flange_tool = real.core.base_and_tool(real.core.nominal)
    was, end = nominal.core.base_and_tool(nominal.core.nominal)
    expected = T_world_base @ np.linalg.inv(was) @ nominal.forward(q)[0] @ np.linalg.inv(end) @ T_flange_tool
    for record in (once["calibration"]["nominal"], again):
        spec = real.spec | {"calibration": {"parameters": [], "nominal": record}}
        np.testing.assert_allclose(nominal_robot(_Spec(spec)).forward(q)[0], expected, atol=1e-12)
    with pytest.raises(InvalidInput, match="does not keep its nominal geometry; give the nominal robot file"):
        nominal_robot(_Spec(real.spec | {"calibration": {"parameters": ["joint2 a"]}}))
    with pytest.raises(InvalidInput, match="don't have the same joints"):
        nominal_robot(real, arms("lbr_iiwa14")[0])


class _Spec:
    """A robot as far as its nominal kinematics need it."""

    def __init__(self, spec) -> None:
        self.spec, self.name = spec, spec["name"]


def test_conditions_go_with_their_rows(arms) -> None:
    """Six rows, so that one wrench (6,) for all could be taken for a number a row; a bad target cuts row 4 out."""
    nominal, real = arms("staubli_rx160l")
    q = np.radians(START["staubli_rx160l"]) + np.random.default_rng(5).uniform(-0.2, 0.2, (6, 6))
    poses = nominal.forward(q)
    poses[4] = np.nan
    good = np.array([0, 1, 2, 3, 5])
    wrench, payload = np.array([300.0, -200.0, 400.0, 20.0, 10.0, 0.0]), np.arange(6.0)
    found = fastcal.compensate(real, poses, q, nominal=nominal, method="one-step", wrench=wrench, payload=payload)
    got = real.forward(found.q[good], wrench=wrench, payload=payload[good])
    assert found.status.tolist() == ["reached"] * 4 + ["bad_target", "reached"]
    np.testing.assert_allclose(
        found.position_error[good], np.linalg.norm((got - poses[good])[:, :3, 3], axis=1), atol=1e-15
    )


def test_threads_do_not_change_a_digit(arms) -> None:
    nominal, real = arms("staubli_rx160l")
    poses = nominal.forward(fastcal.random_poses(nominal, 40, seed=4) * 0.7)
    one, two = (fastcal.compensate(real, poses, nominal=nominal, along_path=False, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.q, two.q)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"targets": np.eye(3)}, r"targets must have shape \(N, 4, 4\), got \(3, 3\)"),
        ({"targets": np.eye(4), "seed": np.zeros(5)}, r"seed must have shape \(6,\) or \(1, 6\), got \(5,\)"),
        ({"targets": np.eye(4), "method": "two-step"}, "method must be full or one-step, got 'two-step'"),
        (
            {"targets": fastcal.Targets(np.eye(4)[None]), "payload": 3.0},
            "seed and conditions must be among the Targets",
        ),
    ],
)
def test_invalid_input_is_refused(arms, arguments, sentence) -> None:
    with pytest.raises(InvalidInput, match=sentence):
        fastcal.compensate(arms("staubli_rx160l")[1], **arguments)


def test_conditions_of_some_targets_are_those_of_their_rows() -> None:
    """Moves too: a target that is tried again alone needs its own, not those of all."""
    conditions = {
        "payload": np.arange(3.0),
        "move": np.arange(18.0).reshape(3, 6),
        "approach": np.ones(6),
        "temperature": 295.0,
        "extra": {"order": np.arange(3.0)},
    }
    some = fastcal.Targets(np.tile(np.eye(4), (3, 1, 1)), None, conditions).conditions_of(np.array([2, 0]))
    np.testing.assert_array_equal(some["payload"], [2.0, 0.0])
    np.testing.assert_array_equal(some["move"], [[12, 13, 14, 15, 16, 17], [0, 1, 2, 3, 4, 5]])
    np.testing.assert_array_equal(some["approach"], np.ones(6))
    np.testing.assert_array_equal(some["extra"]["order"], [2.0, 0.0])
    assert some["temperature"] == 295.0
