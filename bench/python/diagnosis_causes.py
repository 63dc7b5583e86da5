# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes for the wide world of `bench_diagnosis`: several at once, outside the library, along a user's column."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from diagnosis_arms import Setting
from diagnosis_sets import ABSORBED, OUTSIDE, Truth, drawable, loads, outside_truth, scaled, snr, with_effect
from diagnosis_worlds import World
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Random = np.random.Generator

SNR = (8.0, 120.0)
SET_UPS = ("station_offset", "tool_shift")  # where there are stations and mounts, they were moved already
TRIES = 60


def a_size(random: Random, low: float = SNR[0]) -> float:
    """A wanted SNR."""
    return float(np.exp(random.uniform(np.log(low), np.log(SNR[1]))))


def named(world: World, random: Random, kinds: tuple[str, ...] = ()) -> Truth:
    """A cause of the library, or of some of its effects; its kind is drawn first, then its owner.

    Raises:
        LookupError: These rows show none at a plausible size.
    """
    names = drawable(world.at, (*ABSORBED, *SET_UPS))
    there = sorted({name.effect for name in names if not kinds or name.effect in kinds})
    for _ in range(TRIES if there else 0):
        kind = str(random.choice(there))
        some = [name for name in names if name.effect == kind]
        found = scaled(world.at, some[int(random.integers(len(some)))], a_size(random), random)
        if found is not None:
            return found
    raise LookupError("no cause that these rows show")


def different(world: World, count: int, random: Random) -> list[Truth]:
    """Causes of the library, no two of one name."""
    out: dict[tuple[str, str], Truth] = {}
    for _ in range(TRIES):
        found = named(world, random)
        out.setdefault((found.effect, found.owner), found)
        if len(out) == count:
            break
    return list(out.values())


def yielding(world: World, random: Random) -> list[Truth]:
    """Every joint that a load acts on yields; those nearer to the base more clearly."""
    some = [name for name in drawable(world.at) if name.effect == "joint_compliance"]
    found = (scaled(world.at, name, 3 * a_size(random) / (1 + k), random) for k, name in enumerate(some))
    return [truth for truth in found if truth is not None]


def along_sensor(world: World, random: Random) -> Truth:
    """A motion of base, a joint or a link in proportion to the user's own column.

    Raises:
        LookupError: The file has none.
    """
    if not world.at.poses.extra:
        raise LookupError("no column of the user's")
    (column,) = world.at.poses.extra
    n = world.at.nominal.joint_count
    owner = str(random.choice(["base", f"joint{random.integers(1, n + 1)}", f"link{random.integers(1, n)}"]))
    axis = "rz" if owner.startswith("joint") else str(random.choice(["x", "y", "z", "rx", "ry"]))
    entry = {"effect": "regressor", "owner": owner, "column": column, "axis": axis}
    return _of_regressor(world.at, entry, a_size(random, 12.0))


def outside(world: World, random: Random) -> Truth:
    """A cause that no name has.

    Raises:
        LookupError: These rows don't show it.
    """
    at = world.at
    kind = str(random.choice([*OUTSIDE, *WIDER]))
    if kind in OUTSIDE:
        return outside_truth(at, a_size(random), random)
    owner, axis, column = WIDER[kind](at, random)
    hidden = replace(at, poses=replace(at.poses, extra={"hidden": column}))
    entry = {"effect": "regressor", "owner": owner, "column": "hidden", "axis": axis}
    found = _of_regressor(hidden, entry, a_size(random))
    return replace(found, effect=kind, entry={})


def _of_regressor(at: Setting, entry: dict[str, str], wanted: float) -> Truth:
    unit = with_effect(at, entry, np.array([1e-4]))
    size = wanted / max(snr(at, unit), 1e-12)
    if not np.isfinite(size) or np.sqrt(np.mean((size * unit) ** 2)) > 5e-3:
        raise LookupError("no cause that these rows show")
    return Truth(entry["effect"], entry["owner"], wanted, entry, with_effect(at, entry, np.array([1e-4 * size])))


def _joint(at: Setting, random: Random) -> int:
    return int(random.integers(0, at.nominal.joint_count))


def _loaded_wave(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """A gear whose error grows with its load."""
    load = loads(at)
    j = int(np.argsort(-np.ptp(load, axis=0))[int(random.integers(2))])
    return f"joint{j + 1}", "rz", np.sin(2 * at.poses.q[:, j] + random.uniform(0, 6)) * load[:, j] / np.abs(load).max()


def _saw(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """A sawtooth of the position: a thread, a belt."""
    j = _joint(at, random)
    phase = at.poses.q[:, j] / max(float(np.ptp(at.poses.q[:, j])), 1e-9)
    return f"joint{j + 1}", "rz", 2 * ((random.uniform(2, 4) * phase) % 1) - 1


def _jump(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """A joint that jumps at a position."""
    j = _joint(at, random)
    return f"joint{j + 1}", "rz", (at.poses.q[:, j] > np.quantile(at.poses.q[:, j], random.uniform(0.3, 0.7))) * 1.0


def _many_waves(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """Tens of cycles a turn: cogging."""
    j = _joint(at, random)
    return f"joint{j + 1}", "rz", np.sin(float(random.integers(20, 80)) * at.poses.q[:, j] + random.uniform(0, 6))


def _hot_spring(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """A balancer whose gas is warm: temperature times the sine of a joint."""
    j, T = min(1, at.nominal.joint_count - 1), at.poses.temperature
    assert T is not None
    return f"joint{j + 1}", "rz", (T - T.mean()) * np.sin(at.poses.q[:, j])


def _slip(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """The target slips once on the tool."""
    time = at.poses.time
    assert time is not None
    return "tool", str(random.choice(["x", "y", "z"])), (time > np.quantile(time, random.uniform(0.3, 0.7))) * 1.0


def _late_zero(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """A joint's zero that slips once."""
    time = at.poses.time
    assert time is not None
    return f"joint{_joint(at, random) + 1}", "rz", (time > np.quantile(time, random.uniform(0.3, 0.7))) * 1.0


def _settling(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """A base that settles, first fast, then slowly."""
    time = at.poses.time
    assert time is not None
    return "base", str(random.choice(["x", "y", "z", "rx"])), np.exp(-time / (0.2 * np.ptp(time)))


def _hanging(at: Setting, random: Random) -> tuple[str, str, FloatArray]:
    """A holder that gives by how it hangs."""
    down = at.true.poses(at.poses)[:, 2, :3]
    return "tool", "z", down[:, int(random.integers(3))] ** 2


WIDER: dict[str, Callable[[Setting, Random], tuple[str, str, FloatArray]]] = {
    "loaded_wave": _loaded_wave,
    "saw": _saw,
    "jump": _jump,
    "many_waves": _many_waves,
    "hot_spring": _hot_spring,
    "slip": _slip,
    "late_zero": _late_zero,
    "settling": _settling,
    "hanging": _hanging,
}
