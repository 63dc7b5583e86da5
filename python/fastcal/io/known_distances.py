# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The key `known_distances` of a robot file: lengths between points that are touched, as two sockets of a block."""

from __future__ import annotations

from typing import Any

from fastcal.io.fields import Fields


def check_known_distance(fields: Fields) -> dict[str, Any]:
    """One of them in its canonical form."""
    ends = {"from": fields.text("from"), "to": fields.text("to")}
    length = fields.positive("", "mm")
    if length is None:
        length = fields.number("mm")
    sigma = fields.positive("sigma", "mm")
    fields.done()
    return {**ends, "mm": length, "sigma_mm": 0.01 if sigma is None else sigma}
