# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A correction as settings and arrays, and back; nothing of it is code."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.applicability import Guard
from fastcal.correction.correction import Correction
from fastcal.correction.experts import AxisNetworks, BoostedTrees, ClassifiedNetworks, Expert, Neighbours
from fastcal.correction.joints import GaussianProcess, JointNetwork
from fastcal.correction.packing import Packed, Tensors, setting
from fastcal.correction.uncertainty import Uncertainty
from fastcal.errors import InvalidInput

FORMAT = "fastcal correction"
VERSION = 1
_KINDS = {
    kind.kind: kind
    for kind in (AxisNetworks, BoostedTrees, ClassifiedNetworks, GaussianProcess, JointNetwork, Neighbours)
}


def to_plain(correction: Correction) -> Packed:
    """Settings that JSON can hold, and arrays by name."""
    tensors = correction.guard.pack().under("guard") | correction.uncertainty.pack().under("uncertainty")
    tensors["limit"] = np.array([correction.limit])
    members = []
    for i, member in enumerate(correction.members):
        packed = member.pack()
        members.append({"kind": member.kind, **packed.settings})
        tensors |= packed.under(f"member{i}")
    settings = {"format": FORMAT, "version": VERSION, "network": correction.network, "members": members}
    settings["any_load"] = int(correction.any_load)
    return Packed(settings | {"record": correction.record}, tensors)


def from_plain(settings: Any, values: Mapping[str, NDArray[Any]]) -> Correction:
    """The correction.

    Raises:
        InvalidInput: Something is missing, unknown or invalid.
    """
    if not isinstance(settings, dict) or settings.get("format") != FORMAT:
        raise InvalidInput("it holds arrays, but no correction that fastcal has trained")
    if settings.get("version") != VERSION:
        raise InvalidInput(f"expected version {VERSION} of the format, got {str(settings.get('version'))[:20]}")
    tensors = Tensors(values)
    entries = setting(settings, "members", list)
    members: list[Expert] = []
    for i, entry in enumerate(entries):
        kind = str(setting(entry, "kind", str))
        if kind not in _KINDS:
            raise InvalidInput(f"expected a member of kind {', '.join(_KINDS)}, got {kind[:40]!r}")
        members.append(_KINDS[kind].unpack(entry, tensors.part(f"member{i}")))
    if not members:
        raise InvalidInput("the correction has no members")
    limit = float(tensors.take("limit", (1,))[0])
    found = Correction(
        str(setting(settings, "network", str)),
        tuple(members),
        Guard.unpack(tensors.part("guard")),
        limit,
        Uncertainty.unpack(tensors.part("uncertainty")),
        dict(setting(settings, "record", dict)),
        bool(setting(settings, "any_load", int)),
    )
    tensors.done()
    return found
