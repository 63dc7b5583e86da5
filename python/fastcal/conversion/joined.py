# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arms that stand one on the other as one serial arm: its screws are those of all, seen from the first one's base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fastcal.conversion import convert, poe_geometry
from fastcal.conversion.chain import Chain, Spec, chain_of
from fastcal.effects.entries import traits_of
from fastcal.errors import InvalidInput
from fastcal.place import place_of
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import frame_spec

_KEPT = ("tool", "payload", "gravity_m_s2", "wrench_frame", "equilibrium")
_ONE_ARM = ("coupling", "pendant", "structure", "compensator", "correction", "loops")


def joined(specs: Sequence[Spec], name: str) -> Spec:
    """The canonical spec of arms on each other, in the kind of the last where that is a table of rows.

    Args:
        specs: Canonical, from the ground on; one alone is given back with its new name.
        name: Of the whole.

    Raises:
        InvalidInput: An arm has something that only a file of its own can say, such as effects.
    """
    if len(specs) == 1:
        return {**specs[0], "name": name}
    kind = specs[-1]["kinematics"]
    out = joined_screws(specs, name)
    return convert(out, kind).spec if kind in ("dh", "mdh") else out


def joined_screws(specs: Sequence[Spec], name: str) -> Spec:
    """The canonical spec of arms on each other as screws (kind poe).

    T(q) = T_base_1 C_1(q_1) T_base_2 C_2(q_2) ... T_tool, T_base_k being where arm k stands on the flange of the one
    before, C_k its chain. Tool and payload are the last one's; gravity is that of the first, on which all stand.

    Raises:
        InvalidInput: As of `joined`.
    """
    for spec in specs:
        check_joins(spec)
    T = np.eye(4)
    chains: list[Chain] = []
    effects: list[Spec] = []
    for i, spec in enumerate(specs):
        effects += _counted_on(spec, sum(len(chain.revolute) for chain in chains))
        T = T @ pose(spec["base"]) if i else T
        chains.append(moved(chain_of(spec), T))
        T = chains[-1].home
    last = specs[-1]
    whole = Chain(
        tuple(turns for chain in chains for turns in chain.revolute),
        np.concatenate([chain.omega for chain in chains]),
        np.concatenate([chain.v for chain in chains]),
        T,
        tuple(body for chain in chains for body in chain.bodies),
    )
    geometry = poe_geometry(whole, [joint for spec in specs for joint in spec["joints"]])
    out: Spec = {"name": name, "kinematics": "poe", "joints": geometry.joints, **geometry.ends}
    out |= {"base": specs[0]["base"], "tool": last["tool"], "payload": last["payload"]}
    out |= {key: last[key] for key in ("wrench_frame", "equilibrium") if key in last}
    out |= {key: specs[0][key] for key in ("gravity_m_s2", "gravity_frame")}
    return out | {"effects": effects, "structure": {}}


def piece(spec: Spec, chain: Chain, joints: Sequence[int], T: np.ndarray, effects: Sequence[Spec]) -> Spec:
    """Some joints of an arm as the canonical spec of an arm of screws, which can be `joined` with others.

    Args:
        spec: Canonical, of the whole arm: what all its parts have.
        chain: Of these joints alone, in the order of `joints` (from 0).
        joints: Whose types, limits and gears they have.
        T: (4, 4) where the part stands.
        effects: Of its joints, numbered in the part.

    Raises:
        InvalidInput: The arm has something that only a file of its own can say.
    """
    check_joins(spec)
    geometry = poe_geometry(chain, [spec["joints"][i] for i in joints])
    own: Spec = {"name": spec["name"], "kinematics": "poe", "joints": geometry.joints, **geometry.ends}
    own |= {key: spec[key] for key in _KEPT if key in spec}
    return own | {"gravity_frame": "measuring", "base": frame_spec(T), "effects": [*effects], "structure": {}}


def joints_of_last(specs: Sequence[Spec]) -> list[Spec]:
    """The joints of the last of arms on each other, of kind urdf: the first in the frame of the joint before it."""
    bare = [{**spec, "effects": []} for spec in specs]
    count = len(specs[-1]["joints"])
    return list(convert(joined_screws(bare, specs[-1]["name"]), "urdf").spec["joints"][-count:])


def check_joins(spec: Spec) -> None:
    """InvalidInput where an arm has something that it cannot bring along into a longer one."""
    if own := next((key for key in _ONE_ARM if spec.get(key)), None):
        raise InvalidInput(
            f"{spec['name']} has '{own}', which an arm that carries another or stands on one cannot bring along"
        )


def _counted_on(spec: Spec, before: int) -> list[Spec]:
    """The effects of an arm's joints, where so many joints come before its own."""
    out = []
    for effect in spec["effects"]:
        place = place_of(effect["owner"])
        if traits_of(effect["effect"]).refers_to != "axes" or place.kind != "joint" or not place.number:
            raise InvalidInput(
                f"{spec['name']} has {effect['effect']}@{effect['owner']}, which an arm that carries another or stands "
                "on one cannot bring along"
            )
        out.append({**effect, "owner": str(replace(place, number=place.number + before))})
    return out


def moved(chain: Chain, T: np.ndarray) -> Chain:
    """The chain seen from the frame in which its base is at T."""
    R, p = T[:3, :3], T[:3, 3]
    omega, v = chain.omega @ R.T, chain.v @ R.T
    v = v + np.where(np.array(chain.revolute)[:, np.newaxis], np.cross(p, omega), 0.0)
    bodies = tuple(None if body is None else body.moved(T) for body in chain.bodies)
    return Chain(chain.revolute, omega, v, T @ chain.home, bodies)
