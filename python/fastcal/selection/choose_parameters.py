# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which parameters to identify: the set that predicts best what was not fitted, by K-fold cross-validation.

    EV_K = 1/K sum_k MSE_k      (X. Chen, Q. Zhang, Y. Sun 2020, equations 4 and 5)

The paper fits every set K times and takes the least EV_K. Here the problem is linearized once, at the fit of all
parameters, where all 2^m sets take a fraction of a second (`_core.SubsetSearch`); the best are identified again, each
judged by a linearization at its own solution, which differs from K nonlinear fits by the square of what folds change.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.inspection import check_columns, check_fit
from fastcal.calibration.problem import prepare
from fastcal.errors import InvalidInput
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.selection.cross_validation import CrossValidation
from fastcal.selection.set_search import TIE, shortlist, stepwise
from fastcal.units import from_si

SEARCHES = ("auto", "exhaustive", "stepwise")
RULES = ("least", "one_standard_error")
MOST_EXHAUSTIVE = 20  # optional parameters of which `auto` tries all sets: a million, in ten folds in a second


@dataclass(frozen=True)
class Candidate:
    """One set of parameters.

    Attributes:
        parameters: Joint and effect parameters that are identified; base and tool besides.
        error: EV_K over the squared noise of the fit of all parameters: little above 1 where nothing but noise is left.
        standard_error: Of that mean, from the spread over the folds.
        searched_error: EV_K as the search saw it, linearized at the fit of all parameters.
    """

    parameters: tuple[str, ...]
    error: float
    standard_error: float
    searched_error: float


@dataclass(frozen=True, eq=False)
class Selection:
    """What `choose_parameters` chose.

    Attributes:
        parameters: The chosen set, as `calibrate` takes it.
        table: The sets that were refitted, best first.
        result: The calibration with the chosen set.
        full: The set of all parameters, for comparison.
        evaluated: How many sets were compared.
        search: exhaustive or stepwise.
        sigma: Noise of a coordinate or a length [m], the root of an error of 1; None: only orientations were measured.
    """

    parameters: tuple[str, ...]
    table: list[Candidate]
    result: CalibrationResult
    full: Candidate
    evaluated: int
    search: str
    folds: int
    rule: str
    sigma: float | None

    def rms_mm(self, candidate: Candidate) -> float | None:
        """K-fold error of one coordinate [mm], root of the mean square; a point's is sqrt(3) times that."""
        return None if self.sigma is None else from_si(self.sigma, "mm") * candidate.error**0.5

    def to_json_dict(self) -> dict[str, Any]:
        """The choice for a program; `result` has its own."""
        return {
            "parameters": list(self.parameters),
            "search": self.search,
            "evaluated": self.evaluated,
            "folds": self.folds,
            "rule": self.rule,
            "full": asdict(self.full) | {"rms_mm": self.rms_mm(self.full)},
            "table": [asdict(candidate) | {"rms_mm": self.rms_mm(candidate)} for candidate in self.table],
        }


def choose_parameters(
    robot: RobotLike,
    data: DataLike,
    optional: Sequence[str] | None = None,
    *,
    always: Sequence[str] = (),
    test: DataLike | None = None,
    folds: int = 10,
    deals: int = 10,
    effects: str | Sequence[str] = "geometry",
    search: str = "auto",
    rule: str = "least",
    refits: int = 20,
    loss: str = "tukey",
    as_read: bool = False,
    who: Mapping[str, str | None] | None = None,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Selection:
    """Chooses the parameters to identify by K-fold cross-validation, and identifies them.

    Poses that repeat stay in one fold. Rows count with their robust weight in the fit of all parameters, the same for
    all sets. Of sets with the same predictions only the smallest is kept.

    Args:
        robot: Nominal robot; what is not chosen keeps its value.
        data: Measured poses.
        optional: Names such as "joint2 alpha" that may be left out; None: all identifiable parameters of `effects`.
        always: Names that are in every set; base and tool always are.
        test: Held-out poses, never used for fitting.
        folds: K.
        deals: How often the poses are dealt again into folds; the mean is compared. The paper deals once.
        effects: Names as on the command line.
        search: exhaustive tries every set; stepwise adds or drops one at a time, from none and from all; auto is
            exhaustive up to 20 optional parameters.
        rule: least takes the least error, as the paper does; one_standard_error the smallest set whose error is within
            one standard error of the least.
        refits: How many of the best sets are identified again.
        loss: As in `calibrate`.
        as_read: As in `calibrate`.
        who: As in `calibrate`.
        seed: Of the deal into folds; the same seed gives the same choice.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: A name, a search or a rule is unknown, or there are fewer poses than folds.
    """
    _check(optional, always, search=search, rule=rule, refits=refits, deals=deals)
    robot = as_robot(robot)
    data = as_data(data, robot)
    progress = progress or (lambda text: None)
    progress("checking the columns")
    suspected = check_columns(robot, data, as_read=as_read)
    progress("identifying all parameters")
    named = None if optional is None else [*always, *optional]
    start = prepare(robot, data, effects=effects, parameters=named, loss=loss, threads=threads)
    judge = CrossValidation(start, data, always, folds=folds, deals=deals, seed=seed, loss=loss, threads=threads)
    names = judge.names
    columns = judge.identifiable if optional is None else [i for i in start.asked if names[i] in optional]

    sets = judge.linearized(columns)
    every = search == "exhaustive" or (search == "auto" and len(columns) <= MOST_EXHAUSTIVE)
    progress(f"comparing sets of {len(columns)} parameters in {folds} folds")
    searched = sets.all() if every else stepwise(sets)
    best = shortlist(searched, refits, one_standard_error=rule == "one_standard_error")

    progress(f"identifying the best {len(best)}")
    table = []
    for s in best:
        chosen = [column for column, held in zip(columns, searched.members[s], strict=True) if held]
        table.append(_candidate(judge, chosen, *judge.refitted(chosen), float(searched.error[s])))
    table.sort(key=lambda candidate: candidate.error)
    limit = table[0].error + (table[0].standard_error if rule == "one_standard_error" else 0.0)
    within = [candidate for candidate in table if candidate.error <= limit * (1 + TIE)]
    parameters = min(within, key=lambda candidate: (len(candidate.parameters), candidate.error)).parameters
    everything = sets.of(np.ones((1, len(columns)), dtype=np.bool_))
    error = float(everything.error[0])
    result = calibrate(
        robot,
        data,
        test=test,
        effects=effects,
        parameters=parameters,
        loss=loss,
        as_read=True,  # refused or noted above
        who=who,
        threads=threads,
    )
    check_fit(robot, result.train, as_read=as_read)
    return Selection(
        parameters=parameters,
        table=table,
        result=replace(result, notes=[*suspected, *result.notes]),
        full=_candidate(judge, columns, error, float(everything.standard_error[0]), error),
        evaluated=len(searched.error),
        search="exhaustive" if every else "stepwise",
        folds=folds,
        rule=rule,
        sigma=judge.sigma,
    )


def _candidate(
    judge: CrossValidation, chosen: list[int], error: float, standard_error: float, searched_error: float
) -> Candidate:
    named = tuple(judge.names[i] for i in sorted([*judge.always, *chosen]))
    return Candidate(named, error, standard_error, searched_error)


def _check(
    optional: Sequence[str] | None, always: Sequence[str], *, search: str, rule: str, refits: int, deals: int
) -> None:
    if search not in SEARCHES:
        raise InvalidInput(f"search must be one of {', '.join(SEARCHES)}, got '{search}'")
    if rule not in RULES:
        raise InvalidInput(f"rule must be one of {', '.join(RULES)}, got '{rule}'")
    if refits < 1:
        raise InvalidInput(f"refits must be at least 1, got {refits}")
    if deals < 1:
        raise InvalidInput(f"deals must be at least 1, got {deals}")
    named = [*always, *(optional or ())]
    for name in named:
        if name.split(" ")[0] in ("base", "tool"):
            raise InvalidInput(f"base and tool are always identified, got '{name}'")
        if named.count(name) > 1:
            raise InvalidInput(f"'{name}' is named twice")
