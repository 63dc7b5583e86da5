# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a surrogate must show to be added."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """What a surrogate must show to be added. The values are rules of whoever asks (`fastcal.diagnosis.rules`).

    Attributes:
        evidence: Of the first block, twice the log of a ratio of likelihoods.
        further_evidence: Of a further block.
        held_out: RMS of poses left out with everything that is added over that without, which must be less.
        lead: Standard errors, over poses, by which poses left out must lie nearer with blocks chosen without them.
        later: The same, over the last rows measured, of blocks that change with time or temperature.
        blocks: At most.
        bins: Parts of an input's range: rows in the same parts of all inputs are left out together.
    """

    evidence: float
    further_evidence: float
    held_out: float
    lead: float
    later: float
    blocks: int
    bins: int
