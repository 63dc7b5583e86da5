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
from fastcal.correction.experts import AxisNetworks, BoostedTrees, ClassifiedNetworks, Expert, Neighbours, Shifted
from fastcal.correction.joints import GaussianProcess, JointNetwork
from fastcal.correction.packing import Packed, Tensors, setting
from fastcal.correction.uncertainty import Uncertainty
from fastcal.errors import InvalidInput

FORMAT = "fastcal correction"
VERSION = 2
DEEPEST = 8  # priors of priors
READABLE = (1, VERSION)  # 1 knew displacements alone: it turns nothing
_KINDS = {
    kind.kind: kind
    for kind in (AxisNetworks, BoostedTrees, ClassifiedNetworks, GaussianProcess, JointNetwork, Neighbours)
}


def to_plain(correction: Correction) -> Packed:
    """Settings that JSON can hold, and arrays by name."""
    tensors = correction.guard.pack().under("guard") | correction.uncertainty.pack().under("uncertainty")
    tensors["limit"] = np.array([correction.limit, correction.turn_limit])
    members = []
    for i, member in enumerate(correction.members):
        packed = member.pack()
        members.append({"kind": member.kind, **packed.settings})
        tensors |= packed.under(f"member{i}")
    settings = {"format": FORMAT, "version": VERSION, "network": correction.network, "members": members}
    settings["any_load"] = int(correction.any_load)
    return Packed(settings | {"record": correction.record}, tensors)


def _member(entry: Any, tensors: Tensors, depth: int = 0) -> Expert:
    """One member; what was trained behind others has them inside."""
    kind = str(setting(entry, "kind", str))
    if kind == Shifted.kind and depth < DEEPEST:
        prior, difference = (
            _member(setting(entry, name, dict), tensors.part(name), depth + 1) for name in ("prior", "difference")
        )
        return Shifted(prior, difference, float(setting(entry, "turning", float)))
    if kind not in _KINDS:
        raise InvalidInput(f"expected a member of kind {', '.join([*_KINDS, Shifted.kind])}, got {kind[:40]!r}")
    return _KINDS[kind].unpack(entry, tensors)


def from_plain(settings: Any, values: Mapping[str, NDArray[Any]]) -> Correction:
    """The correction.

    Raises:
        InvalidInput: Something is missing, unknown or invalid.
    """
    if not isinstance(settings, dict) or settings.get("format") != FORMAT:
        raise InvalidInput("it holds arrays, but no correction that fastcal has trained")
    version = settings.get("version")
    if version not in READABLE or not isinstance(version, int):
        raise InvalidInput(f"expected version {VERSION} of the format, got {str(version)[:20]}")
    tensors = Tensors(values)
    entries = setting(settings, "members", list)
    members: list[Expert] = []
    for i, entry in enumerate(entries):
        members.append(_member(entry, tensors.part(f"member{i}")))
    if not members:
        raise InvalidInput("the correction has no members")
    limit, turn_limit = (*tensors.take("limit", (min(version, 2),)).tolist(), 0.0)[:2]
    found = Correction(
        str(setting(settings, "network", str)),
        tuple(members),
        Guard.unpack(tensors.part("guard")),
        limit,
        turn_limit,
        Uncertainty.unpack(tensors.part("uncertainty")),
        dict(setting(settings, "record", dict)),
        bool(setting(settings, "any_load", int)),
    )
    tensors.done()
    return found
