# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Gradient training of a whole population at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray

from fastcal.arrays import IndexArray
from fastcal.networks.optimizers import Optimizer

Progress = Callable[[str], None]
Watch = Callable[[int, torch.Tensor], None]
BySlope = Callable[[torch.Tensor], torch.Tensor]  # dL/derror (P, B, k) of errors (P, B, k)


class Model(Protocol):
    """What `fit` trains: P models whose numbers are the rows of theta."""

    def error(self, theta: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """(P, B, k) predicted less wanted for rows (P, B), in units of the residuals' size."""

    def at(self, theta: torch.Tensor) -> Callable[[torch.Tensor, BySlope], torch.Tensor]:
        """dL/dtheta (P, size) by rows (P, B), as theta changes in place: of L whose slope by errors is given."""


@dataclass(frozen=True)
class Schedule:
    """How long and how.

    Attributes:
        epochs: Passes over the training rows, at most.
        batch: Rows a step; 0: all.
        rule: Of `optimizers`, for all or one a member.
        rate: Learning rate, for all or one a member.
        cosine: Let the rate fall to zero along half a cosine.
        huber: Use the Huber loss with its corner at this error; 0: squares.
        patience: Stop a member that has not become better on its validation rows for so many checks; 0: never.
        check: Epochs between two looks at the validation rows.
        decay: Weight decay, decoupled (Loshchilov, Hutter 2019), for all or one a member.
    """

    epochs: int = 200
    batch: int = 200
    rule: str | Sequence[str] = "adam"
    rate: float | Sequence[float] = 3e-3
    cosine: bool = True
    huber: float = 0.0
    patience: int = 0
    check: int = 5
    decay: float | Sequence[float] = 0.0


def loss(error: torch.Tensor, huber: float) -> torch.Tensor:
    """(P,) mean over rows of the squares, halved, or of Huber's function, summed over coordinates."""
    half = error * error / 2
    if huber > 0:
        size = error.abs()
        near = torch.clamp(size, max=huber)
        half = near * (size - near / 2)
    return half.sum(dim=2).mean(dim=1)


def taken(values: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
    """(P, B, ...) of values (N, ...) at each member's rows (P, B): values[rows], copied a row at a time."""
    return torch.nn.functional.embedding(rows, values.view(len(values), -1)).view(*rows.shape, *values.shape[1:])


def taken_own(values: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
    """(P, B, k) of each member's own values (P, N, k) at its rows (P, B)."""
    firsts = values.shape[1] * torch.arange(len(values), device=values.device)[:, None]
    return taken(values.view(-1, values.shape[2]), rows + firsts)


def slope(error: torch.Tensor, huber: float) -> torch.Tensor:
    """(P, B, k) slope of each member's loss by its errors."""
    return (torch.clamp(error, -huber, huber) if huber > 0 else error) * (1 / error.shape[1])


def fit(
    model: Model,
    theta: torch.Tensor,
    rows: Sequence[IndexArray],
    schedule: Schedule,
    seeds: Sequence[int],
    *,
    validation: Sequence[IndexArray] | None = None,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> tuple[torch.Tensor, NDArray[np.float64]]:
    """Trains all members; each sees its own rows in its own order, so that it becomes what it would alone.

    Members with fewer rows than others go round theirs again to make up the steps of an epoch.

    Args:
        model: Gives the errors.
        theta: (P, size) where to start.
        rows: Training rows of each member.
        schedule: How long and how.
        seeds: Of the order of rows, one a member.
        validation: Rows of each member that decide which of its states is kept; None: the last one.
        progress: Called with a sentence every ten epochs.
        watch: Called every `schedule.check` epochs with how many are over and theta (P, size) as it then is.

    Returns:
        (P, size) the trained members and (P,) their loss on the validation rows (or on the training rows) at the end.
    """
    device = theta.device
    theta = theta.clone()
    count = len(theta)
    rules = [schedule.rule] * count if isinstance(schedule.rule, str) else list(schedule.rule)
    rates = [schedule.rate] * count if isinstance(schedule.rate, (int, float)) else list(schedule.rate)
    decays = [schedule.decay] * count if isinstance(schedule.decay, (int, float)) else list(schedule.decay)
    shrink = _column(decays, theta) * _column(rates, theta)
    optimizer = Optimizer(rules, rates, theta)
    randoms = [np.random.default_rng((seed, 1)) for seed in seeds]
    longest = max(len(own) for own in rows)
    batch = min(schedule.batch or longest, longest)
    steps = math.ceil(longest / batch)
    judged = _padded(rows if validation is None else validation, device)

    by_theta, by_error = model.at(theta), partial(slope, huber=schedule.huber)
    decaying = any(decays)
    best, best_loss = theta.clone(), torch.full((count,), math.inf, device=device)
    waited = torch.zeros(count, device=device)
    for epoch in range(schedule.epochs):
        share = (1 + math.cos(math.pi * epoch / schedule.epochs)) / 2 if schedule.cosine else 1.0
        order = torch.tensor(
            np.array([_order(own, longest, r) for own, r in zip(rows, randoms, strict=True)]), device=device
        )
        for k in range(steps):
            with torch.no_grad():
                gradient = by_theta(order[:, k * batch : (k + 1) * batch], by_error)
                if decaying:
                    theta *= 1 - share * shrink
                optimizer.step(theta, gradient.nan_to_num_(), share)
        if validation is not None and ((epoch + 1) % schedule.check == 0 or epoch + 1 == schedule.epochs):
            now = _judged(model, theta, judged, schedule.huber)
            better = (now < best_loss) & (waited < max(schedule.patience, 1))
            best = torch.where(better[:, None], theta, best)
            best_loss = torch.where(better, now, best_loss)
            stopped = waited >= max(schedule.patience, 1)
            waited = torch.where(stopped, waited, torch.where(better, torch.zeros_like(waited), waited + 1))
            if not schedule.patience:
                waited.zero_()
            elif bool((waited >= schedule.patience).all()):
                break
        if watch is not None and (epoch + 1) % schedule.check == 0:
            watch(epoch + 1, theta)
        if progress is not None and epoch % 10 == 0:
            progress(f"training {count} networks, epoch {epoch} of {schedule.epochs}")
    if validation is None:
        return theta, _judged(model, theta, judged, schedule.huber).cpu().numpy().astype(float)
    return best, best_loss.cpu().numpy().astype(float)


def _column(values: Sequence[float], theta: torch.Tensor) -> torch.Tensor:
    """(P, 1), one a member."""
    return torch.tensor(list(values), dtype=theta.dtype, device=theta.device)[:, None]


def _order(own: IndexArray, count: int, random: np.random.Generator) -> IndexArray:
    """A shuffle of the rows, begun again where `count` are more than there are."""
    shuffles = [random.permutation(own) for _ in range(math.ceil(count / len(own)))]
    return np.concatenate(shuffles)[:count]


def _padded(rows: Sequence[IndexArray], device: torch.device) -> torch.Tensor:
    """(P, longest): each member's rows, repeated evenly to one length."""
    longest = max(len(own) for own in rows)
    return torch.tensor(np.array([np.resize(own, longest) for own in rows]), device=device)


def _judged(model: Model, theta: torch.Tensor, rows: torch.Tensor, huber: float) -> torch.Tensor:
    with torch.no_grad():
        found = loss(model.error(theta, rows), huber)
    return torch.where(torch.isfinite(found), found, torch.full_like(found, math.inf))
