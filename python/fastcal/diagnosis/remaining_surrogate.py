# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Unexplained error: it gets a place and, if this improves held-out poses, a surrogate in the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.unknowns import given_rig, unknowns_by_owner
from fastcal.diagnosis import held_out, rules
from fastcal.diagnosis.adaptation import Judge, gap_step, nominal
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.gap import GapStep
from fastcal.diagnosis.held_out import shows_between
from fastcal.diagnosis.noise_scales import without_scales
from fastcal.diagnosis.result import AdaptedModel, Unexplained
from fastcal.robot.robot import Robot
from fastcal.surrogate import AddedSurrogate, Thresholds, add_surrogate, formulas
from fastcal.surrogate.candidates import SLOW, posture_inputs

# Evidence of a surrogate of what remains [twice a log of likelihoods]; with SURROGATE_HELD_OUT none on 14 of 14 sets
# where nothing is missing. Simulated.
SURROGATE_EVIDENCE = 60.0
# Evidence of a further one.
FURTHER_SURROGATE_EVIDENCE = 30.0
# RMS of poses left out with the surrogates over that without, from which on none is added.
SURROGATE_HELD_OUT = 0.95

# Surrogates at most.
MAX_SURROGATES = 3
_COLUMNS = {"time": "time_s", "temperature": "temperature_c", "payload": "payload_kg"}


def with_surrogate(
    last: AdaptedModel,
    before: GapStep,
    fit: Fit,
    reached: NDArray[np.bool_],
    judge: Judge,
    unexplained: Unexplained | None,
    *,
    drifts: bool = False,
) -> tuple[AdaptedModel | None, GapStep | None, Unexplained | None]:
    """The last model with surrogates of what it leaves, its step of the gap, and what is unexplained by its place.

    Args:
        last: The model with everything that was found.
        before: Its step of the gap.
        fit: The fit behind it: its noise and the unknowns of its observations.
        reached: (N,) rows that it reaches.
        judge: The rows on which models are judged.
        unexplained: What remains, as the score tests place it; None: nothing that they see. It is kept where no block
            has evidence that poses left out confirm; where it is None, only what is added counts as unexplained.
        drifts: Something moves in time that is no noise with a memory.
    """
    problem = fit.problem
    found = surrogate_of(last.model, fit, reached, drifts=drifts, threads=judge.threads)
    if found is None or found.owner is None or found.evidence < SURROGATE_EVIDENCE:
        return None, None, unexplained
    on = tuple(_COLUMNS.get(name, name) for name in found.depends_on)
    is_borne_out = found.held_out < SURROGATE_HELD_OUT
    hints = tuple(f.text for f in formulas(found.depends_on, found.inputs, found.curve)) if is_borne_out else ()
    added = ",".join(dict.fromkeys(found.added)) or None
    placed = Unexplained(found.owner, found.share, on, added, hints)
    if added is None:
        return None, None, placed if unexplained is not None and is_borne_out else unexplained
    unknowns = unknowns_by_owner(problem.measured, found.unknowns) | given_rig(found.model, problem.data)
    model = judge.of(found.model, nominal(fit), unknowns)
    held_out, was = before.main.held_out_rms, before.main.train_rms
    step = gap_step(added, model, None if held_out is None else held_out * found.held_out, reached)
    if not (step.main.train_rms or 0.0) < (was or 0.0):  # it bends what was linear
        return None, None, replace(placed, added=None)
    return model, step, placed


def surrogate_of(
    model: Robot,
    fit: Fit,
    reached: NDArray[np.bool_],
    *,
    drifts: bool,
    folds: Sequence[NDArray[np.intp]] = (),
    threads: int = 1,
) -> AddedSurrogate | None:
    """What a model leaves of rows that it reaches, as surrogates; arguments as `with_surrogate`'s.

    None for pictures: corners of one err together, and curves would be drawn through that. None of the posture where
    the rows are a grid of few positions of each joint: rows held out repeat those that are learnt, and none shows what
    is between. `folds` (N,) are those of `add_surrogate`, over all rows.
    """
    problem = fit.problem
    if problem.repeatability is not None:
        return None
    data, noise = without_scales(problem)
    exclude = SLOW if problem.noise.memory > 0 and not drifts else frozenset()  # a memory is such a curve too
    if not shows_between(data):
        exclude |= posture_inputs(data.q.shape[1])
    return add_surrogate(
        model,
        data.select(reached),
        noise=noise,
        thresholds=thresholds(),
        unknowns=np.concatenate([np.zeros(0), *(fit.unknowns | given_rig(model, data)).values()]),
        exclude=exclude,
        folds=[fold[reached] for fold in folds],
        threads=threads,
    )


def thresholds() -> Thresholds:
    """What the rules ask of a surrogate."""
    return Thresholds(
        evidence=SURROGATE_EVIDENCE,
        further_evidence=FURTHER_SURROGATE_EVIDENCE,
        held_out=SURROGATE_HELD_OUT,
        lead=rules.UNNAMED_LEAD,
        later=rules.MIN_GAIN,
        blocks=MAX_SURROGATES,
        bins=held_out.POSITION_BINS,
    )
