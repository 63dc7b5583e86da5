# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How well a set of poses shows its parameters: the observability indices O1 to O5.

With singular values s_1 >= ... >= s_p of the stacked Jacobian of n poses (Y. Sun, J. Hollerbach, "Observability index
selection for robot calibration", ICRA 2008):

    O1 = (s_1 ... s_p)^(1/p) / sqrt(n)   O2 = s_p / s_1   O3 = s_p   O4 = s_p^2 / s_1   O5 = 1 / (1/s_1 + ... + 1/s_p)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.errors import InvalidInput

INDICES = ("O1", "O2", "O3", "O4", "O5")


def observability_indices(J: ArrayLike, poses: int) -> dict[str, float]:
    """O1 to O5 of a stacked Jacobian (rows, p), columns scaled; the larger the better, 0 where a direction is unseen.

    Args:
        J: Derivatives of all measured numbers by the parameters that are identified, scaled so that 1 is of like weight
            in each column, and whitened.
        poses: n, how many poses the rows come from.
    """
    rows = np.asarray(J, dtype=float)
    if rows.ndim != 2 or rows.shape[1] == 0 or poses < 1 or not np.isfinite(rows).all():
        raise InvalidInput(f"J must be finite, of shape (rows, p), and poses at least 1, got {rows.shape} and {poses}")
    s = np.zeros(rows.shape[1])
    values = np.linalg.svd(rows, compute_uv=False)[::-1]
    s[len(s) - len(values) :] = values
    s[s <= 1e-12 * s[-1]] = 0.0  # rounding of a direction that is not seen at all
    return {name: _core.observability_index(name, s**2, poses) for name in INDICES}
