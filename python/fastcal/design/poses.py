# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which poses to measure for the most informative calibration: optimal design over postures, payloads and directions.

M = M_0 + sum J_c^T J_c        O1 ~ det M        mean predicted variance = tr(M^-1 B), B = mean J_t^T J_t of targets
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.design.candidates import MOST
from fastcal.design.instruments import Instruments
from fastcal.design.linear import linear_problem
from fastcal.design.measurable import candidates_and_obstacles, too_few_touches
from fastcal.design.measured import information_of
from fastcal.design.observability import INDICES, observability_indices
from fastcal.design.planned import planned_model, target_postures
from fastcal.design.result import PoseDesign, in_order
from fastcal.design.rivals import rival_entries, separated_rivals
from fastcal.design.search import Found, Search
from fastcal.design.separation import Separation
from fastcal.design.surroundings import COLLISIONS, REASONS, Surroundings
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.targets import Targets
from fastcal.robot.robot import Robot
from fastcal.said import said

Progress = Callable[[str], None]

CRITERIA = (*INDICES, "variance")
SIGMA = 5e-5  # [m] of a measured coordinate where nothing better is known: a tracker's and an arm's repeatability
_SEPARATING = 0.5  # share of the poses that are left to separating effects, where that is asked for


def design_poses(
    robot: Robot,
    count: int,
    *,
    effects: str | Sequence[str] = "geometry",
    criterion: str = "O1",
    targets: ArrayLike | Dataset | Targets | None = None,
    candidates: str | ArrayLike = "grid",
    candidate_count: int = MOST,
    surroundings: Surroundings | None = None,
    payloads: Sequence[float] = (0.0,),
    separate: Sequence[str] = (),
    measured: Dataset | None = None,
    until_sigma: float | None = None,
    sigma: float | None = None,
    sigma_rotation: float | None = None,
    instruments: Instruments | None = None,
    exchange: bool = True,
    restarts: int = 0,
    seed: int = 0,
    threads: int = 1,
    progress: Progress | None = None,
) -> PoseDesign:
    """Chooses the poses to measure.

    Args:
        robot: The arm, nominal or identified; its own effects are identified too.
        count: How many poses; with `until_sigma` at most.
        effects: What is to be identified, as in `calibrate`; base and tool always are.
        criterion: O1 to O5, or variance: the mean variance of what the calibrated model predicts at the targets.
        targets: Where the arm will work: postures (T, n), poses of the tool (T, 4, 4) in the measuring frame,
            `Targets`, or a data set, these two with their conditions. None: all candidates clear of keep-out boxes.
        candidates: grid, random, or postures (N, n) [rad or m] to choose from.
        candidate_count: Candidates at most, of a grid or a draw and of its combinations with payloads and directions.
        surroundings: Keep-out boxes, region, tracker. None: candidates that are not given stay above the arm's mounting
            face and out of its column (`Surroundings.mounting`).
        payloads: Masses at hand [kg]; each pose gets one of them.
        separate: Two or more effects, such as "joint_compliance@joint2", that half of the poses are to separate.
        measured: Poses measured already: each kind of reading counts by its own numbers; without any, as a plan.
        until_sigma: Stop at the fewest poses found with which the standard deviation of a predicted coordinate, root of
            the mean square over the targets, is at most this [m].
        sigma: Standard deviation of a measured coordinate [m]; None: that of the robot's calibration, or 0.05 mm.
        sigma_rotation: Of a measured orientation about each axis [rad]; None: positions alone are measured.
        instruments: Levels on links, planes to touch, and whether points are measured; None: points only.
        exchange: False: sequential growth alone.
        restarts: Further exchanges from designs drawn at random; the best counts.
        seed: The same seed gives the same poses.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: An unknown name, a shape that does not fit, an effect that no design can vary, or too few
            candidates.
    """
    noise = _checked_sigma(robot, sigma)
    if criterion not in CRITERIA:
        raise InvalidInput(f"criterion must be one of {', '.join(CRITERIA)}, got '{criterion}'")
    if count < 1 or restarts < 0:
        raise InvalidInput(f"count must be at least 1 and restarts at least 0, got {count} and {restarts}")
    if until_sigma is not None and (separate or not until_sigma > 0):
        raise InvalidInput(f"until_sigma must be above 0 and goes without separate, got {until_sigma}")
    progress = progress or (lambda text: None)
    rivals = rival_entries(separate, robot)
    model, geometry, left_out = planned_model(robot, effects, rivals)
    instruments = Instruments() if instruments is None else instruments
    instruments.check(model)

    progress(said("gathering candidates"))
    everywhere, obstacle = candidates_and_obstacles(
        model, candidates, candidate_count, surroundings, payloads, seed, threads, instruments
    )
    pool = everywhere.select(obstacle == 0)
    rejected = {why: int(np.sum(obstacle == key)) for key, why in REASONS.items() if (obstacle == key).any()}
    if len(pool) < count:
        why = ", ".join(f"{number} {reason}" for reason, number in rejected.items()) or "none was refused"
        raise InvalidInput(f"{count} poses were asked for, and {len(pool)} candidates can be measured: {why}")

    progress(said("linearizing"))
    problem = linear_problem(
        model,
        pool,
        count,
        geometry=geometry,
        sigma=noise,
        sigma_rotation=sigma_rotation,
        seed=seed,
        threads=threads,
        instruments=instruments,
    )
    if not problem.free:
        raise InvalidInput("no requested parameter is identifiable from the candidates")
    rows = problem.rows(pool)
    known, uncounted = problem.known_before, list[str]()
    if measured is not None:
        told, uncounted = information_of(problem, measured)
        known = known + told
    goal, notes = target_postures(model, targets, everywhere.select(~np.isin(obstacle, COLLISIONS)), threads=threads)
    search = Search(
        _core.Candidates(rows, problem.row_count),
        criterion,
        known,
        problem.target_information(goal),
        exchange=exchange,
        restarts=restarts,
        seed=seed,
        threads=threads,
    )

    progress(said("choosing {count} of {pool} poses", count=count, pool=len(pool)))
    separated: Separation | None = None
    if rivals:
        found = search.run(count - int(_SEPARATING * count))
        separated = separated_rivals(problem, pool, rows, found.members, rivals, count - len(found.members))
        found = Found([*found.members, *separated.chosen])
    elif until_sigma is not None:
        found = search.fewest(count, until_sigma)
    else:
        found = search.run(count)
    ordered = in_order(model, pool.select(found.members))
    notes += [*uncounted, *left_out, *too_few_touches(ordered)]
    reached = float(np.sqrt(search.variance(found.members)))
    k = problem.row_count
    measured_rows = rows.reshape(-1, k, rows.shape[1])[found.members].reshape(-1, rows.shape[1])
    indices = observability_indices(measured_rows, len(ordered))
    unseen = indices["O1"] == 0 and measured is None
    if unseen:
        notes += [f"{len(ordered)} poses do not identify all {len(problem.free)} parameters: the others stay nominal"]
    return PoseDesign(
        q=ordered.q,
        payload=ordered.payload,
        approach=np.asarray(ordered.approach),
        plane=None if ordered.plane is None else [str(name) for name in ordered.plane],
        criterion=criterion,
        observability=indices,
        sigma=reached,
        efficiency=None if unseen else found.efficiency,
        parameters=problem.names,
        deviations=problem.sizes * np.sqrt(np.diag(np.linalg.inv(search.information(found.members)))),
        unidentifiable=problem.unidentifiable,
        candidate_count=len(pool),
        rejected=rejected,
        enough=until_sigma is None or reached <= until_sigma,
        separation=separated,
        notes=notes,
        joint_types=tuple(model.joint_types),
    )


def _checked_sigma(robot: Robot, sigma: float | None) -> float:
    record = robot.record
    if sigma is None:
        sigma = (record.length_sigma if record else None) or SIGMA
    if not (np.isfinite(sigma) and sigma > 0):
        raise InvalidInput(f"sigma must be above 0, got {sigma}")
    return sigma
