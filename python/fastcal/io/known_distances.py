# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The key `known_distances` of a robot file: lengths between points that are touched, as two sockets of a block."""

from __future__ import annotations

from typing import Any

from fastcal.io.fields import Fields


def check_known_distance(fields: Fields) -> dict[str, Any]:
    """One of them in its canonical form."""
    out: dict[str, Any] = {"from": fields.text("from"), "to": fields.text("to"), "mm": fields.number("mm")}
    out["sigma_mm"] = fields.number("sigma_mm", 0.01)
    for key in ("mm", "sigma_mm"):
        if not out[key] > 0:
            fields.fail(key, "a number above 0", out[key])
    fields.done()
    return out
