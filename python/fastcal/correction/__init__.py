# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A trained residual model evaluated by numpy alone: displacement of the tool, its uncertainty, and where it fades out.

    p_corrected = p_model(q, load) + w(q, load) d(q, load)

d is the mean of the members of an ensemble, w the guard's weight, 1 inside the trained joints and loads and 0 far from
them. `fastcal.networks` trains these and needs torch; using them needs nothing beyond what fastcal itself does.
"""

from fastcal.correction.correction import Corrected, Correction
from fastcal.correction.inputs import Inputs

__all__ = ["Corrected", "Correction", "Inputs"]
