# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""No sight of a cell is worse with its arms identified than with the frames alone.

The frames alone are where the members stand with the arms as their files say. A sight, TARGET:SENSOR, is what one
sensor sees of one target; where it is worse, the arms that move it and no other sight are to blame.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.asked import arms_between
from fastcal.cells.cell import Cell

_FAR = 10.0  # medians of the first errors: what is farther counts as that far, so that gross rows do not decide
_CHANCE = 2.0  # standard errors of a mean square's difference, below which one kind of a view is no worse
_SAME = 1e-6  # relative: rounding
_EXACT = 1e-9  # [m, rad, px]: less is rounding

Errors = Mapping[str, FloatArray]  # (n,) sizes of the errors of each view, such as `position@smr:camera`; NaN: not read


def squares(view: str, errors: Errors, first: Errors) -> FloatArray:
    """(n,) of what was read of a view, none farther than _FAR medians of the `first` errors."""
    own = errors[view][np.isfinite(errors[view])]
    return np.asarray(np.maximum(np.minimum(own, _FAR * float(np.nanmedian(first[view]))), _EXACT) ** 2)


def cost(views: Collection[str], errors: Errors, first: Errors) -> float:
    """-2 log likelihood of some views, the noise of each kind being what its errors are."""
    kinds: dict[str, list[FloatArray]] = {}
    for view in views:
        kinds.setdefault(view.partition("@")[0], []).append(squares(view, errors, first))
    every = [np.concatenate(parts) for parts in kinds.values()]
    return sum(len(own) * float(np.log(own.mean())) for own in every if len(own))


def worse_sights(cell: Cell, errors: Errors, frames: Errors) -> set[str]:
    """Sights that arms move and that are worse than by frames alone, as a whole or, beyond chance, in a kind."""
    sights: dict[str, list[str]] = {}
    for view in frames.keys() & errors.keys():
        sights.setdefault(view.partition("@")[2], []).append(view)
    out = set()
    for sight, views in sights.items():
        if not arms_between(cell, sight):
            continue  # no arm is to blame for what stands still
        lost = [squares(view, errors, frames) - squares(view, frames, frames) for view in views]
        beyond = any(of.mean() > _CHANCE * of.std() / np.sqrt(len(of)) for of in lost if len(of))
        count = sum(map(len, lost))
        if beyond or cost(views, errors, frames) > cost(views, frames, frames) + _SAME * count:
            out.add(sight)
    return out


def arms_to_blame(cell: Cell, views: Collection[str], now: Collection[str], worse: Collection[str]) -> frozenset[str]:
    """Names of the arms that move sights which are worse and no other, or else all that move them.

    Args:
        cell: The tree.
        views: All that was read.
        now: Sights that are worse.
        worse: These and those that were before.
    """
    moving = {sight: arms_between(cell, sight) for sight in {view.partition("@")[2] for view in views}}
    own, others = (frozenset().union(*(moving[each] for each in of)) for of in (now, moving.keys() - set(worse)))
    return (own - others) or own
