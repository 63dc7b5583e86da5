# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The SR210D paper's BSO-MLP on a simulated arm: tables 8 and 9, and table 2's comparison of search algorithms.

    python bench/papers/sr210d_network.py [--seeds N] [--jobs J] [--out FILE] [--searches]

Geometry, ratios and coupling from 50 poses without load, joint stiffness from 50 with 210 kg, the network from 200 with
210 kg, 200 others unseen (Y. Wang and others, section 6). The true arm has tilting bearings, gears that are not round,
and errors outside the library; the identified model has none of these. Poses are random in a box of 2 by 3.2 by 2.1 m,
wrist joints within 90 degrees. --searches times BAS beside particle
swarm, genetic algorithm and artificial bee colony of the library NiaPy (pip install niapy) until the Michalewicz
function is within 0.0001 of its minimum.
"""

from __future__ import annotations

import copy
import time

import numpy as np
from network_arm import arguments, lengths, measure, run, table

from fastcal import Robot, calibrate, load_robot, perturbed, random_poses
from fastcal.networks.beetles import antennae_search, michalewicz
from fastcal.networks.bso_mlp import fit_bso_mlp
from fastcal.networks.device import one_thread
from fastcal.networks.mlp import fit_mlp
from fastcal.networks.options import Options
from fastcal.networks.problem import problem_of
from fastcal.robot.robot import pose

LOAD, NOISE = 210.0, 3e-5
SIZES = (6e-5, 1.1e-4, 1.1e-4, 1e-4, 1e-4, 1e-4)
LEARNT, UNSEEN = 200, 200
MODEL = "geometry,reduction_ratio,coupling_ratio@joint6<-joint5"
MINIMUM, CLOSE = -1.8013034, 1e-4
TIMES = {"BAS": 0.087843, "PSO": 0.215134, "GA": 0.262317, "ABC": 0.132563}


def true_arm(nominal: Robot, seed: int) -> Robot:
    random = np.random.default_rng((seed, 3))
    effects = [
        {"effect": "joint_compliance", "owner": f"joint{j}", "parameters": {"compliance_rad_nm": value}}
        for j, value in ((2, 4e-7), (3, 5e-7), (4, 2e-6), (5, 3e-6))
    ]
    effects += [
        {"effect": "bearing_tilt", "owner": f"joint{j}", "parameters": {"rad_nm": value}}
        for j, value in ((1, 4e-8), (4, 8e-7))
    ]
    effects += [
        {
            "effect": "gear_harmonic",
            "owner": f"joint{j}",
            "order": 1,
            "parameters": {"amplitude_rad": 1.5e-4, "phase_rad": float(random.uniform(-3, 3))},
        }
        for j in (2, 3)
    ]
    return perturbed(Robot(nominal.spec | {"effects": effects}), seed=seed)


def within(nominal: Robot) -> Robot:
    """The arm with its wrist's limits at 90 degrees."""
    spec = copy.deepcopy(nominal.spec)
    for joint in spec["joints"][3:]:
        joint |= {"min_deg": -90.0, "max_deg": 90.0}
    return Robot(spec)


def study(seed: int) -> dict[str, float]:
    """Lengths of errors [mm] after each stage, on the rows learnt and on others."""
    nominal = load_robot("siasun_sr210d")
    true = true_arm(nominal, seed)
    region = np.array([[0.6, -1.6, 0.3], [2.6, 1.6, 2.4]])
    q = random_poses(within(nominal), 100 + LEARNT + UNSEEN, region=region, seed=seed)
    parts = np.split(q, [50, 100, 100 + LEARNT])
    loads = (0.0, LOAD, LOAD, LOAD)
    free, loaded, learnt, unseen = (
        measure(true, part, np.full(len(part), load), SIZES, LOAD, NOISE, seed)
        for part, load in zip(parts, loads, strict=True)
    )
    geometry = calibrate(nominal, free, effects=MODEL).model
    names = [f"joint_compliance@joint{j}" for j in (2, 3, 4, 5)]
    stiff = calibrate(geometry, loaded, effects=names, parameters=[f"joint{j} compliance" for j in (2, 3, 4, 5)]).model

    out: dict[str, float] = {}
    problem = problem_of(stiff, learnt, seed=seed)
    own = [np.arange(len(problem))] * 3
    R = pose(stiff.spec["base"])[:3, :3]
    assert unseen.position is not None
    left = (unseen.position - stiff.poses(unseen)[:, :3, 3]) @ R
    inputs = stiff.inputs(unseen.q, unseen.payload)
    with one_thread():
        networks = {
            "bso": fit_bso_mlp(problem, own, Options(seed=seed)),
            "mlp": fit_mlp(problem, own, Options(seed=seed)),
        }
    for part, residuals, at in (("learnt", problem.residuals, problem.inputs), ("unseen", left, inputs)):
        out |= {f"before_{part}_{key}": value for key, value in lengths(residuals).items()}
        for name, members in networks.items():
            said = np.mean([member.displacement(at) for member in members], axis=0)
            out |= {f"{name}_{part}_{key}": value for key, value in lengths(residuals - said).items()}
    for name in networks:
        out[f"{name}_gain"] = 1 - out[f"{name}_unseen_mean"] / out["before_unseen_mean"]
    return out


def searches(repeats: int = 5) -> dict[str, float]:
    """Median seconds of each algorithm until the function is within CLOSE of its minimum."""
    from niapy.algorithms.basic import ArtificialBeeColonyAlgorithm, GeneticAlgorithm, ParticleSwarmOptimization
    from niapy.problems import Problem as Objective
    from niapy.task import Task

    class Michalewicz(Objective):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(dimension=2, lower=0.0, upper=np.pi)

        def _evaluate(self, x: np.ndarray) -> float:
            return float(michalewicz(x[np.newaxis])[0])

    found: dict[str, list[float]] = {name: [] for name in TIMES}
    for seed in range(repeats):
        start = time.perf_counter()
        for attempt in range(1000):
            starts = np.random.default_rng((seed, attempt)).uniform(0, np.pi, (1, 2))
            walked = antennae_search(michalewicz, starts, seed=seed * 1000 + attempt, target=MINIMUM + CLOSE)
            if walked.value <= MINIMUM + CLOSE:
                break
        found["BAS"].append(time.perf_counter() - start)
        for name, algorithm in (
            ("PSO", ParticleSwarmOptimization(population_size=20, seed=seed)),
            ("GA", GeneticAlgorithm(population_size=20, seed=seed)),
            ("ABC", ArtificialBeeColonyAlgorithm(population_size=20, seed=seed)),
        ):
            task = Task(problem=Michalewicz(), max_evals=50_000, cutoff_value=MINIMUM + CLOSE)
            start = time.perf_counter()
            algorithm.run(task)
            found[name].append(time.perf_counter() - start)
    return {name: float(np.median(seconds)) for name, seconds in found.items()}


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--searches", action="store_true", help="time the search algorithms as well")
    given = parser.parse_args()
    m = run(study, given)
    print(f"median of {given.seeds} simulated arms; mm")
    for number, part, paper in (
        (8, "learnt", (0.9262, 0.1632, 1.7435, 0.5907, 0.0760, 0.8834)),
        (9, "unseen", (0.9370, 0.1871, 1.7633, 0.6522, 0.0887, 0.9834)),
    ):
        keys = [f"{stage}_{part}_{key}" for stage in ("before", "bso") for key in ("mean", "std", "max")]
        labels = [f"{stage} BSO-MLP, {key}" for stage in ("before", "after") for key in ("mean", "std", "max")]
        rows = [(label, value, m[key]) for label, value, key in zip(labels, paper, keys, strict=True)]
        rows.append(("after fastcal's mlp, mean", "-", m[f"mlp_{part}_mean"]))
        table(f"table {number}, rows {part}", rows)
    print(f"\nless error on unseen rows: paper 30 %, BSO-MLP {m['bso_gain']:.0%}, fastcal's mlp {m['mlp_gain']:.0%}")
    if given.searches:
        times = searches()
        table("table 2, seconds until within 0.0001", [(name, TIMES[name], times[name]) for name in TIMES])


if __name__ == "__main__":
    main()
