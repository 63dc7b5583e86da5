# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""K-fold cross-validated errors of sets of parameters, from one linearization.

    J_opt (theta - theta_nominal)_opt + J_kept x = J_opt (theta* - theta_nominal)_opt - r(theta*)

is what every set fits as well as its columns can, theta* being where the problem is linearized: what a set leaves out
stays at nominal, what all sets hold (base, tool, anchors) moves freely. Columns are in plausible sizes, rows whitened.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.critical_loads import with_critical_loads
from fastcal.calibration.evaluation import pose_groups
from fastcal.calibration.kind_noise import length_noise, noise_by_kind
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.unset_options import fill_unset_options
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.splits import deal
from fastcal.selection.set_search import Sets

LEAST_EFFECT = 0.1  # standard deviations a plausible size: what has less is held at nominal, as in identification


class CrossValidation:
    """K-fold errors of sets of parameters. The fit of all gives every set its rows, weights and noise.

    Args:
        start: Where identification starts, all parameters asked for.
        data: What was measured.
        always: Names in every set; base, tool and anchors are.
        folds: K.
        deals: How often the rows are dealt again into folds.
        seed: Of the deals.
        loss: As in `calibrate`.
        threads: Cores; the result does not depend on it.

    Attributes:
        names: Of the model's parameters; a set is a list of their indices, ascending.
        identifiable: Parameters beside base, tool and `always` that are identifiable.
        sigma: Noise of a coordinate or a length [m], which errors are multiples of; None: only turns were measured.

    Raises:
        InvalidInput: An unknown name, fewer than two folds, or fewer poses than folds.
    """

    def __init__(
        self,
        start: CalibrationProblem,
        data: Dataset,
        always: Sequence[str],
        *,
        folds: int,
        deals: int,
        seed: int,
        loss: str,
        threads: int,
    ) -> None:
        self._problem = fill_unset_options(with_critical_loads(start.with_(loss=loss, threads=threads)))
        self.names = self._problem.names
        for name in always:
            if name not in self.names:
                raise InvalidInput(f"there is no parameter '{name}' to identify; there are {', '.join(self.names)}")

        full = self._problem.identify()
        count = len(self.names)
        self._theta = np.asarray(full.theta)
        self._noise = full.common_noise
        parameters = full.parameters
        self._size = np.array([parameter.sigma for parameter in parameters])
        self._weights = np.asarray(full.weights)
        random = np.random.default_rng(seed)
        self._folds = [fold_of_rows(data, self._weights > 0, folds, random) for _ in range(deals)]
        frames = [i for i in start.asked if parameters[i].owner in ("base", "tool")]
        self.always = [i for i in start.asked if self.names[i] in always]
        self._kept = [*frames, *self.always, *range(count, len(parameters))]
        self.identifiable = [i for i in full.free if i < count and i not in self._kept]
        self._set_unit(full)

    def _set_unit(self, full: _core.Identification) -> None:
        """Makes 1 of the mean square that the fit leaves: weights below 1 and too large claims of noise shrink it."""
        near = self._near(self._theta)
        weight = self._weights[np.asarray(near.row)]
        left = float(np.sum(weight * np.asarray(near.r) ** 2)) / max(full.degrees_of_freedom, 1)
        self._unit = left if left > 0 else 1.0
        self._weights = self._weights / self._unit
        self.sigma = length_noise(noise_by_kind(self._problem.measured, full))

    def _near(self, theta: FloatArray) -> _core.Linearization:
        return self._problem.linearize(theta, self._noise)

    def linearized(self, optional: list[int], theta: FloatArray | None = None) -> Sets:
        """The sets of some parameters, near theta; None: near the fit of all."""
        at = self._theta if theta is None else theta
        near = self._near(at)
        row = np.asarray(near.row)
        used = self._weights[row] > 0
        row = row[used]
        root = np.sqrt(self._weights[row])
        J = root[:, None] * np.asarray(near.J)[used] * self._size
        moved = np.zeros(len(at))  # from where x counts to theta
        moved[optional] = ((at - np.append(self._problem.model.start, at[len(self.names) :])) / self._size)[optional]
        target = J @ moved - root * np.asarray(near.r)[used]
        prior, wanted = self._priors(at, moved, [*self._kept, *optional])
        J, target = np.vstack([J, prior]), np.append(target, wanted)
        always_fitted = np.full(len(wanted), -1, dtype=np.int32)
        kept, free = J[:, self._kept], J[:, optional]
        folds = (np.append(fold[row], always_fitted) for fold in self._folds)
        return Sets([_core.SubsetSearch(kept, free, target, fold, least_norm=LEAST_EFFECT) for fold in folds])

    def _priors(self, at: FloatArray, moved: FloatArray, columns: list[int]) -> tuple[FloatArray, FloatArray]:
        """Rows of x / deviation = wanted / deviation for the parameters with a prior; in the unit of the others."""
        limits = self._problem.limits()
        if "prior_sigma" not in limits:
            return np.zeros((0, len(at))), np.zeros(0)
        deviation = limits["prior_sigma"] / self._size * self._unit**0.5
        held = np.array([i for i in columns if np.isfinite(deviation[i])], dtype=np.intp)
        rows = np.zeros((len(held), len(at)))
        rows[np.arange(len(held)), held] = 1 / deviation[held]
        wanted = moved + (limits["prior_mean"] - at) / self._size
        return rows, (wanted / deviation)[held]

    def refitted(self, chosen: list[int]) -> tuple[float, float]:
        """K-fold error of one set and its standard error, linearized at its own nonlinear fit."""
        kept = [i for i in self._kept if i < len(self.names)]
        theta = np.asarray(self._problem.with_(asked=sorted([*kept, *chosen])).identify().theta)
        found = self.linearized(chosen, theta).of(np.ones((1, len(chosen)), dtype=np.bool_))
        return float(found.error[0]), float(found.standard_error[0])


def fold_of_rows(data: Dataset, used: NDArray[np.bool_], folds: int, random: np.random.Generator) -> NDArray[np.int32]:
    """(N,) the fold of each row, -1 where it is not used: poses are dealt out at random, all visits of one to one fold.

    Raises:
        InvalidInput: Fewer than two folds, or fewer poses than folds.
    """
    group = pose_groups(data)
    poses = np.unique(group[used])
    if not 2 <= folds <= len(poses):
        raise InvalidInput(f"there must be at least 2 folds and at most one a pose, {len(poses)}; got {folds}")
    fold = np.full(group.max() + 1, -1, dtype=np.int32)
    fold[poses] = deal(len(poses), folds, random)
    return np.where(used, fold[group], np.int32(-1))
