# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Chosen poses: against all choices of a small problem, against linear algebra, and against what was asked of them."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal import _core
from fastcal.design import Surroundings, Tracker, design_poses, observability_indices
from fastcal.design.poses import CRITERIA
from fastcal.design.search import Search
from fastcal.errors import InvalidInput

Array = NDArray[np.float64]

ANYWHERE = Surroundings(mounting=False)


@pytest.fixture(scope="module")
def arm() -> fastcal.Robot:
    return fastcal.load_robot("staubli_rx160l")


def small(criterion: str, seed: int = 0, **options: int) -> tuple[Array, Array, Search]:
    """13 candidates of 3 rows and 5 parameters, B, and the search."""
    random = np.random.default_rng(seed)
    J = random.standard_normal((13, 3, 5)) * np.array([1.0, 2.0, 0.5, 1.0, 3.0])
    targets = random.standard_normal((20, 5))
    B = targets.T @ targets / 20
    candidates = _core.Candidates(J.reshape(39, 5), 3)
    return J, B, Search(candidates, criterion, 1e-9 * np.eye(5), B, **options)


def worth(J: Array, B: Array, criterion: str, members: tuple[int, ...]) -> float:
    rows = J[list(members)].reshape(-1, 5)
    if criterion == "variance":
        return 1 / float(np.trace(np.linalg.inv(rows.T @ rows) @ B))
    return observability_indices(rows, len(members))[criterion]


@pytest.mark.parametrize("criterion", CRITERIA)
def test_the_best_of_all_choices_is_found(criterion: str) -> None:
    J, B, search = small(criterion, restarts=5)
    found = search.run(6)
    best = max(worth(J, B, criterion, members) for members in itertools.combinations(range(13), 6))
    assert len(set(found.members)) == 6
    assert worth(J, B, criterion, tuple(found.members)) >= (1 - 1e-9 if criterion in ("O1", "variance") else 0.9) * best


@pytest.mark.parametrize("criterion", ["O1", "variance"])
def test_the_promised_share_of_the_best_is_kept(criterion: str) -> None:
    for seed in range(5):
        J, B, search = small(criterion, seed)
        best = max(worth(J, B, criterion, members) for members in itertools.combinations(range(13), 5))
        search.exchange = False
        found = search.run(5)
        assert found.efficiency is not None
        assert 0 < found.efficiency <= worth(J, B, criterion, tuple(found.members)) / best + 1e-6


def test_growth_takes_the_best_next_one() -> None:
    J, _, search = small("O1")
    search.exchange = False
    members = search.run(6).members
    M = search.known.copy()
    for member in members:
        gains = [np.linalg.slogdet(M + block.T @ block)[1] for block in J]
        taken = members[: members.index(member)]
        assert member == max((c for c in range(13) if c not in taken), key=lambda c: gains[c])
        M += J[member].T @ J[member]


def test_many_poses_of_few_come_near_the_continuous_optimum() -> None:
    """Frank-Wolfe's weights reach the D-optimum that the equivalence theorem proves: max tr(J M^-1 J^T) = p."""
    random = np.random.default_rng(4)
    J = random.standard_normal((60, 3, 4))
    weights = np.full(60, 1 / 60)
    for _ in range(3000):  # D. Titterington's multiplicative step
        M = np.einsum("c,cki,ckj->ij", weights, J, J)
        weights *= np.einsum("cki,ij,ckj->c", J, np.linalg.inv(M), J) / 4
    assert np.einsum("cki,ij,ckj->c", J, np.linalg.inv(M), J).max() == pytest.approx(4, rel=1e-3)
    limit = np.linalg.det(M) ** (1 / 8)
    copies = np.repeat(J, 10, axis=0)
    search = Search(_core.Candidates(copies.reshape(-1, 4), 3), "O1", 1e-9 * np.eye(4), np.eye(4))
    members = search.run(40).members
    assert observability_indices(copies[members].reshape(-1, 4), 40)["O1"] == pytest.approx(limit, rel=0.01)


def test_indices_are_those_of_the_singular_values() -> None:
    J = np.random.default_rng(1).standard_normal((30, 4))
    s = np.linalg.svd(J, compute_uv=False)
    found = observability_indices(J, 10)
    expected = [np.prod(s) ** 0.25 / 10**0.5, s[3] / s[0], s[3], s[3] ** 2 / s[0], 1 / np.sum(1 / s)]
    assert list(found.values()) == pytest.approx(expected, rel=1e-12)
    assert set(observability_indices(J[:2], 1).values()) == {0.0}
    with pytest.raises(InvalidInput, match="J must be finite"):
        observability_indices(J[0], 1)


def test_a_gantry_may_hang_from_its_base() -> None:
    slides = [{"type": "prismatic", "v": v, "min_mm": 0, "max_mm": 1000} for v in ([1, 0, 0], [0, 1, 0], [0, 0, -1])]
    turns = [
        {"type": "revolute", "omega": omega, "point_mm": [0, 0, 0], "min_deg": -110, "max_deg": 110}
        for omega in ([0, 0, 1], [0, 1, 0])
    ]
    home = {"xyz_mm": [60, 20, -250], "rpy_deg": [0, 0, 0]}
    gantry = fastcal.load_robot({"name": "gantry", "kinematics": "poe", "joints": [*slides, *turns], "home": home})
    q = fastcal.random_poses(gantry, 20, seed=1)
    assert not Surroundings().obstacles(gantry, q).any()


@pytest.mark.parametrize("name", ["ur5", "kuka_kr6_r900", "fanuc_m20ia", "lbr_iiwa7"])
@pytest.mark.parametrize("candidates", ["grid", "random"])
def test_an_arm_stays_above_its_mounting_face_and_out_of_its_column(name: str, candidates: str) -> None:
    """A tilted base too: the face is the arm's own. The points are those of the arm's joints, by its own frames."""
    robot = fastcal.Robot(fastcal.load_robot(name).spec | {"base": {"xyz_mm": [100, 0, 900], "rpy_deg": [0, 90, 0]}})
    found = design_poses(robot, 25, candidates=candidates, candidate_count=5_000)
    T_base_world = np.linalg.inv(robot.core.base_and_tool(robot.core.nominal)[0])
    tool = (T_base_world @ robot.forward(found.q))[:, :3, 3]
    assert (tool[:, 2] >= 0).all()
    upright = fastcal.load_robot(name)
    shoulder = np.asarray(upright.core.frame_origins(found.q))[:, 3, 2] - upright.spec["base"]["xyz_mm"][2] / 1e3
    assert ((np.hypot(tool[:, 0], tool[:, 1]) >= 0.1 * robot.reach) | (tool[:, 2] >= shoulder)).all()
    assert found.rejected["go below the mounting face or into the arm's own column"] > 0
    free = design_poses(robot, 25, candidates=candidates, candidate_count=5_000, surroundings=ANYWHERE)
    lowest = (T_base_world @ robot.forward(free.q))[:, 2, 3].min()
    assert lowest < 0
    assert len(found.parameters) == len(free.parameters)


def test_given_postures_are_taken_as_they_are(arm: fastcal.Robot) -> None:
    q = fastcal.random_poses(arm, 40, seed=1)
    assert design_poses(arm, 30, candidates=q).candidate_count == 40
    clear = Surroundings().obstacles(arm, q) == 0
    assert design_poses(arm, 3, candidates=q, surroundings=Surroundings()).candidate_count == clear.sum() < 40


def test_a_design_beats_random_and_growth(arm: fastcal.Robot) -> None:
    common = {"candidate_count": 3000, "sigma": 5e-5, "surroundings": ANYWHERE}
    by_variance = design_poses(arm, 40, criterion="variance", **common)
    grown = design_poses(arm, 40, criterion="variance", exchange=False, **common)
    by_o1 = design_poses(arm, 40, **common)
    drawn = [
        design_poses(arm, 40, candidates=fastcal.random_poses(arm, 40, seed=seed), targets=by_o1.q, sigma=5e-5)
        for seed in range(7)
    ]
    here = design_poses(arm, 40, candidates=by_variance.q, targets=by_o1.q, sigma=5e-5)
    assert by_variance.sigma < min(grown.sigma, by_o1.sigma)
    assert by_o1.observability["O1"] > max(by_variance.observability["O1"], *(d.observability["O1"] for d in drawn))
    assert here.sigma < np.median([d.sigma for d in drawn]) / 1.1
    assert by_o1.efficiency is not None
    assert by_o1.efficiency > 0.9


def test_seeds_and_threads_and_repeats(arm: fastcal.Robot) -> None:
    options = {"candidates": "random", "candidate_count": 800, "criterion": "variance", "restarts": 1}
    a, b, c = (design_poses(arm, 30, seed=s, threads=t, **options) for s, t in ((1, 1), (1, 3), (2, 1)))
    np.testing.assert_array_equal(a.q, b.q)
    assert (a.q != c.q).any()
    assert len(np.unique(a.q, axis=0)) == 30
    low, high = arm.limits.T
    assert (a.q >= low).all()
    assert (a.q <= high).all()


def test_predicted_deviations_are_those_of_a_calibration(arm: fastcal.Robot) -> None:
    sigma, effects = 3e-5, "geometry,joint_compliance@joint2"
    options = {"payloads": [0, 12], "candidate_count": 4000, "surroundings": ANYWHERE}
    found = design_poses(arm, 60, effects=effects, sigma=sigma, **options)
    compliance = {"compliance_rad_nm": {"value": 2e-7}}
    bent = {"effect": "joint_compliance", "owner": "joint2", "parameters": compliance}
    data = fastcal.simulate(fastcal.Robot(arm.spec | {"effects": [bent]}), found.dataset(), noise=sigma, seed=1)
    result = fastcal.calibrate(arm, data, effects=effects, loss="none", priors=False)
    deviations = np.sqrt(np.diag(result.covariance))
    names = [f"{p.owner} {p.name.removesuffix(f'_{p.unit}')}" for p in result.parameters]
    identified = dict(zip(names, deviations, strict=True))
    told = dict(zip(found.parameters, found.deviations, strict=True))
    for name in ("joint2 compliance", "joint2 a", "joint3 alpha", "tool x"):
        assert told[name] == pytest.approx(identified[name], rel=0.25), name  # the noise is estimated, 18 % either way
    assert set(found.payload) == {0.0, 12.0}
    assert (np.diff(found.payload) >= 0).all()  # a payload is mounted once


def test_with_orientations_all_thirty_parameters_are_identifiable(arm: fastcal.Robot) -> None:
    both = design_poses(arm, 20, sigma_rotation=1e-4, candidate_count=1000, surroundings=ANYWHERE)
    assert (len(both.parameters), "tool rx" in both.parameters) == (30, True)
    few = design_poses(arm, 4, candidate_count=1000)
    assert (few.observability["O1"], few.efficiency) == (0.0, None)
    assert "4 poses do not identify all" in few.notes[0]


def test_directions_are_chosen_where_an_effect_asks_for_them(arm: fastcal.Robot) -> None:
    found = design_poses(arm, 30, effects="geometry,backlash@joint2,backlash@joint4", candidate_count=2000)
    assert set(np.unique(found.approach)) == {-1.0, 1.0}
    way = np.diff(found.q, axis=0)
    moved = way != 0
    direct = np.sign(way) == found.approach[1:]
    assert direct[:, [0, 2, 4, 5]][moved[:, [0, 2, 4, 5]]].all()  # where none asks, as the way comes
    assert not direct[:, [1, 3]][moved[:, [1, 3]]].all()
    assert {"joint2 gap", "joint4 gap"} <= set(found.parameters)
    few = design_poses(arm, 20, effects="backlash@joint2", candidates=fastcal.random_poses(arm, 15))
    assert few.candidate_count == 30  # every posture from both sides


def test_the_fewest_poses_that_are_enough(arm: fastcal.Robot) -> None:
    options = {"candidate_count": 2000, "criterion": "variance", "sigma": 5e-5}
    found = design_poses(arm, 80, until_sigma=2.5e-5, **options)
    assert found.enough
    assert found.sigma <= 2.5e-5
    assert design_poses(arm, len(found) - 1, **options).sigma > 2.5e-5 * 0.995
    hopeless = design_poses(arm, 30, until_sigma=1e-7, **options)
    assert (hopeless.enough, len(hopeless)) == (False, 30)


def test_surroundings_refuse_what_cannot_be_measured(arm: fastcal.Robot) -> None:
    table = ((-3.0, -3.0, -2.0), (3.0, 3.0, -0.3))
    look = np.array([0.0, 0.0, 1.0])
    surroundings = Surroundings(
        keep_out=[table],
        region=((-2.5, -1.0, -0.2), (2.5, 2.5, 3.0)),
        tracker=Tracker((4.0, 1.0, 1.0), nearest=1.5, farthest=6.0, reflector=look, acceptance=0.7),
        link_radius=0.05,
        mounting=False,
    )
    found = design_poses(arm, 25, surroundings=surroundings, candidates="random", candidate_count=8_000)
    T = arm.forward(found.q)
    beam = np.array([4.0, 1.0, 1.0]) - T[:, :3, 3]
    assert (T[:, 2, 3] > -0.25).all()
    assert (T[:, 1, 3] >= -1.0).all()
    assert (np.linalg.norm(beam, axis=1) > 1.5).all()
    cosine = np.sum((T[:, :3, :3] @ look) * beam, axis=1) / np.linalg.norm(beam, axis=1)
    assert (cosine > np.cos(0.7)).all()
    assert sum(found.rejected.values()) + found.candidate_count == 8_000
    assert len(found.rejected) == 4  # nothing is hidden here


def test_what_stands_between_hides_the_target(arm: fastcal.Robot) -> None:
    """Arm stretched along x: from behind it the arm itself hides the tool, and a wall does from anywhere."""
    stretched = np.array([[0.0, np.pi / 2, 0.0, 0.0, 0.0, 0.0]])
    p = arm.forward(stretched)[0, :3, 3]
    behind = Tracker(p - 5 * p / np.linalg.norm(p))
    aside = Tracker(p + np.array([0.0, 0.0, 5.0]))
    wall = [(tuple(p + np.array([-1.0, -1.0, 1.0])), tuple(p + np.array([1.0, 1.0, 1.1])))]
    for surroundings, reason in (
        (Surroundings(tracker=behind, link_radius=0.2, mounting=False), 5),
        (Surroundings(tracker=aside, link_radius=0.1, mounting=False), 0),
        (Surroundings(tracker=aside, keep_out=wall, mounting=False), 5),
    ):
        assert surroundings.obstacles(arm, stretched).tolist() == [reason]


def test_targets_may_be_postures_poses_or_data(arm: fastcal.Robot) -> None:
    q = fastcal.random_poses(arm, 10, seed=3)
    T = arm.forward(q)
    options = {"candidate_count": 1500, "criterion": "variance"}
    by_q = design_poses(arm, 30, targets=q, **options)
    by_data = design_poses(arm, 30, targets=fastcal.Dataset.from_arrays(q), **options)
    np.testing.assert_array_equal(by_q.q, by_data.q)
    far = T[:1].copy()
    far[0, 0, 3] = 9.0
    by_pose = design_poses(arm, 30, targets=np.concatenate([T, far]), **options)
    assert by_pose.notes == ["1 of 11 targets are out of reach and do not count"]
    assert by_pose.sigma == pytest.approx(by_q.sigma, rel=0.3)
    with pytest.raises(InvalidInput, match="none of the 1 targets"):
        design_poses(arm, 30, targets=far, **options)


def test_poses_measured_already_count(arm: fastcal.Robot) -> None:
    options = {"candidate_count": 1500, "criterion": "variance"}
    first = design_poses(arm, 30, **options)
    more = design_poses(arm, 20, measured=first.dataset(), **options)
    assert more.sigma < first.sigma
    assert more.sigma < design_poses(arm, 20, **options).sigma


def test_half_of_the_poses_tell_two_effects_apart(arm: fastcal.Robot) -> None:
    names = ["joint_compliance@joint2", "link_bending@link2"]
    found = design_poses(arm, 30, separate=names, payloads=[0, 14], candidate_count=2000, surroundings=ANYWHERE)
    assert found.separation is not None
    assert len(found) == 30
    assert len(found.separation.chosen) == 15
    assert (found.separation.after >= found.separation.before).all()
    assert np.nanmin(found.separation.power_after) > np.nanmin(found.separation.power_before)


def test_effects_of_the_model_that_no_pose_shows_are_left_out(arm: fastcal.Robot) -> None:
    """The model of an arm that was measured warm and from two stations; with them asked for it is refused."""
    warm = {"effect": "thermal_expansion", "owner": "robot", "parameters": {"coefficient_1_k": 2e-5}}
    stations = {"effect": "station_offset", "owner": "base", "stations": ["A", "B"]}
    model = fastcal.Robot(arm.spec | {"effects": [*(arm.spec.get("effects") or []), warm, stations]})
    found, bare = (design_poses(robot, 12, candidate_count=1000) for robot in (model, arm))
    np.testing.assert_array_equal(found.q, bare.q)
    assert found.notes[0].startswith("the poses are not chosen for thermal_expansion@robot, station_offset@base")
    with pytest.raises(InvalidInput, match="thermal_expansion@robot depends on 'temperature'"):
        design_poses(model, 12, effects="geometry,thermal_expansion", candidate_count=1000)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"criterion": "O6"}, "criterion must be one of"),
        ({"sigma": 0.0}, "sigma must be above 0"),
        ({"until_sigma": -1.0}, "until_sigma must be above 0"),
        ({"restarts": -1}, "restarts at least 0"),
        ({"candidates": "sobol"}, "candidates must be grid, random"),
        ({"candidates": np.zeros((5, 4))}, "got shape"),
        ({"candidates": np.full((5, 6), 9.0)}, "candidate 0 lies beyond"),
        ({"candidate_count": 20}, "two steps of 6 joints"),
        ({"payloads": [-1.0]}, "payloads must be masses"),
        ({"separate": ["joint_compliance@joint2"]}, "two effects or more"),
        ({"separate": ["geometry", "backlash@joint1"]}, "separate takes effects"),
        ({"effects": "thermal_offset"}, "depends on 'temperature'"),
        ({"targets": np.zeros((2, 3))}, "targets must be"),
        (
            {"surroundings": Surroundings(region=((8.0, 8.0, 8.0), (9.0, 9.0, 9.0)))},
            "0 candidates can be measured: 729 leave the region",
        ),
        ({"surroundings": Surroundings(region=((1.0, 0.0, 0.0), (0.0, 1.0, 1.0)))}, "a lower and a higher corner"),
    ],
)
def test_invalid_input_is_refused(arm: fastcal.Robot, options: dict[str, object], said: str) -> None:
    with pytest.raises(InvalidInput, match=said):
        design_poses(arm, 10, **({"candidate_count": 1000} | options))  # type: ignore[arg-type]


def test_the_way_is_nearly_the_shortest() -> None:
    random = np.random.default_rng(0)
    q = random.uniform(size=(7, 3))
    start = np.full(3, 0.5)

    def length(order: tuple[int, ...]) -> float:
        way = np.vstack([start, q[list(order)]])
        return float(np.abs(np.diff(way, axis=0)).max(axis=1).sum())

    shortest = min(length(order) for order in itertools.permutations(range(7)))
    found = tuple(_core.visiting_order(q, start))
    assert sorted(found) == list(range(7))
    assert length(found) <= 1.1 * shortest
