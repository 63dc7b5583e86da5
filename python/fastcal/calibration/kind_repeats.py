# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pure noise of any kind of reading, from postures that were read more than once.

Visits of one posture, with its payload, direction, set-up and the kind's own labels (an anchor, a plane), differ by
noise alone: s^2 = sum over groups of |e_i - mean e|^2 / (n - 1) numbers, whatever a model predicts there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fastcal import _core
from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.repeatability import numbered, visit_groups
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import Kind


@dataclass(frozen=True)
class Repeats:
    """What repeated readings of a kind show.

    Attributes:
        sigma: Pure noise of one number [m or rad].
        freedom: Numbers that it rests on, less a mean of each posture.
    """

    kind: Kind
    sigma: float
    freedom: int

    def to_json_dict(self) -> dict[str, float | int]:
        """The block `repeats` of a kind."""
        return {"noise": self.kind.shown(self.sigma), "freedom": self.freedom}


def repeats_of(data: Dataset, of: KindErrors) -> Repeats | None:
    """The pure noise of a kind; None where no posture was read twice.

    Args:
        data: The rows of the errors.
        of: Predicted less measured, of these rows.
    """
    labels = [field.name for field in _core.observation_entry(of.kind.name).fields if field.role == "label"]
    codes = [data.label_codes(name)[0].astype(np.intp) for name in labels if data.has_labels(name)]
    group = numbered(np.column_stack([visit_groups(data), *codes]))
    if len(np.unique(group)) == len(data):
        return None
    square, freedom = 0.0, 0
    for values in np.moveaxis(of.numbers, 0, -1).reshape(-1, len(data)):
        known = ~np.isnan(values)
        own, at = np.unique(group[known], return_inverse=True)
        if not len(own):
            continue
        mean = np.bincount(at, values[known]) / np.bincount(at)
        square += float(np.sum((values[known] - mean[at]) ** 2))
        freedom += int(known.sum()) - len(own)
    return Repeats(of.kind, (square / freedom) ** 0.5, freedom) if freedom > 0 else None
