# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sets over all that measurement files differ in: what `bench_diagnosis --world wide` asks about.

Each factor is drawn by itself, so that any two meet:
    arm         those that are shipped; a SCARA, a gantry, an arm of six and one of seven joints on a rail
    masses      in the file, 6 % or 30 % wrong, or not in the file
    payload     no column, zeros, one, two, three, many; one in ten labelled wrong
    rows        40 to 700: spread, in a small box, on a grid, along paths; in the order of measuring or shuffled
    columns     time, temperature and approach, or not; names, an order, a sensor that has nothing to do with it
    set-ups     one, two or three stations, mounts or files, between which the instrument or the target moved or turned
    noise       white, heavy-tailed, serial, unequal, with gross rows, joints rounded; sigma: none, true, 0.4, 2.5 times
    joints      repeat well, or to 0.03, 0.1 or 0.3 mrad
    measured    points, full poses, lengths to four anchors
    missing     nothing; one, two or three causes; all joints yield; one outside the library; one outside and one in
                it; one that follows a column of the user's; one beside a column that is wrong (`diagnosis_slips`)
Papers' arms and rows of real arms are drawn by `diagnosis_given`.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from diagnosis_arms import (
    ARMS,
    HELD_OUT,
    Setting,
    built,
    complete_arm,
    drawn_joints,
    noise_of,
    spread_by_joints,
    spread_of,
    stopped,
    without_links,
)
from diagnosis_made_arms import MADE, MADE_ARMS
from diagnosis_sets import Truth, points_of
from numpy.typing import NDArray

from fastcal import Robot, _core, load_robot, random_poses
from fastcal.measurements.dataset import Dataset

FloatArray = NDArray[np.float64]
Random = np.random.Generator

# payload [kg] that they carry
MORE_ARMS = ARMS | {
    "abb_irb1200_5_90": 5.0,
    "abb_irb1200_7_70": 7.0,
    "abb_irb6700_200_260": 200.0,
    "fanuc_lrmate200id": 7.0,
    "fanuc_m20ia": 20.0,
    "franka_fr3": 3.0,
    "franka_panda": 3.0,
    "lbr_iiwa7": 7.0,
    "siasun_sr210d": 210.0,
    "ur10": 10.0,
    "ur16e": 16.0,
    "ur20": 20.0,
    "ur3e": 3.0,
    "ur5": 5.0,
    "ur5e": 5.0,
}
MADE_SHARE = 0.12  # of the sets
MASSES = {"in the file": 0.4, "6 % wrong": 0.15, "30 % wrong": 0.05, "none": 0.4}
PAYLOADS = {"no column": 0.25, "zeros": 0.1, "one": 0.2, "two": 0.12, "three": 0.18, "many": 0.1, "labels": 0.05}
PLACES = {"spread": 0.6, "box": 0.1, "grid": 0.15, "paths": 0.15}
SET_UPS = {"one": 0.66, "stations": 0.12, "mounts": 0.1, "both": 0.05, "files": 0.07}
NOISES = {"white": 0.5, "heavy-tailed": 0.1, "serial": 0.1, "unequal": 0.1, "gross": 0.1, "rounded": 0.1}
SIGMAS = {"none": 0.7, "true": 0.15, "0.4 times": 0.07, "2.5 times": 0.08}
MEASURED = {"points": 0.8, "poses": 0.13, "lengths": 0.07}
ABSENT = 0.45  # of the sets have no time, temperature, approach
SHUFFLED, NAMED, SENSOR = 0.15, 0.3, 0.25  # of the sets
ROWS = (40, 700)
FEWEST_LENGTHS = 150  # rows: one number each
BOX = 0.2  # of the limits' range
GROSS, GROSS_M = 0.04, 2e-3  # share and size
ROUNDED = np.deg2rad(0.01)
WEAR_ANGLE = 5e-5  # of a measured orientation about each axis [rad]
SESSION_S = 4 * 3600.0
PATH_ROWS = 25


@dataclass(frozen=True)
class World:
    """A setting with what its file shows of it.

    Attributes:
        at: The arm and all its rows, with every column; the last HELD_OUT are not measured.
        factors: What was drawn of each factor.
    """

    at: Setting
    factors: dict[str, str]
    most: float  # payload [kg]
    shifts: FloatArray  # (mounts, 3) of the point on the tool [m]
    turns: FloatArray  # (mounts, 3, 3) of a target with an orientation, on the tool
    moves: FloatArray  # (stations, 4, 4) of the measuring frame
    anchors: FloatArray  # (4, 3) of lengths

    def seen(self, truths: Sequence[Truth], stops: FloatArray | None = None) -> FloatArray:
        """(N, 3) where the points are, on their mount and from their station [m]; `stops` (N, 4, 4): the flange is."""
        poses, out = self.at.poses, points_of(self.at, truths)
        T = self.at.true.poses(poses) if stops is None else stops
        out = out if stops is None else out + T[:, :3, 3] - self.at.still
        if poses.mount is not None:
            R = T[:, :3, :3]
            out = out + np.einsum("nij,nj->ni", R, self.shifts[poses.mount])
        if poses.station is not None:
            T = self.moves[poses.station]
            out = np.einsum("nij,nj->ni", T[:, :3, :3], out) + T[:, :3, 3]
        return out

    def data(self, truths: Sequence[Truth], random: Random) -> Dataset:
        """The rows that are diagnosed as their file has them."""
        at, drawn, poses = self.at, self.factors, self.at.poses
        stops = at.true.poses(stopped(at.poses, at.joints, random))
        points = self.seen(truths, stops)
        error = _noise(drawn["noise"], at, points, random)
        seen = replace(at.poses, position=points + error)
        if drawn["measured"] == "poses":
            turn = WEAR_ANGLE * random.standard_normal((len(points), 3))
            R = stops[:, :3, :3]
            R = R if poses.mount is None else R @ self.turns[poses.mount]
            R = R if poses.station is None else self.moves[poses.station][:, :3, :3] @ R
            seen = replace(seen, rotation=_quaternions(R, turn))
        elif drawn["measured"] == "lengths":
            anchor = random.integers(len(self.anchors), size=len(points))
            length = np.linalg.norm(seen.position - self.anchors[anchor], axis=1)
            names = tuple(f"a{k}" for k in range(len(self.anchors)))
            seen = replace(seen, position=None, distance=length, anchor=anchor, anchor_names=names)
        if drawn["noise"] == "rounded":
            seen = replace(seen, q=np.round(seen.q / ROUNDED) * ROUNDED)
        rows = np.arange(at.count)
        if drawn["order"] == "shuffled":
            rows = random.permutation(rows)
        return _without_columns(seen.select(rows), drawn, self.most, random)


def world(random: Random) -> World:
    """An arm, its rows and its file."""
    made = random.uniform() < MADE_SHARE
    names = MADE if made else MORE_ARMS
    name = str(random.choice(list(names)))
    most = float(names[name])
    complete = MADE_ARMS[name]() if made else complete_arm(load_robot(name), most)
    drawn = {
        what: str(random.choice(list(shares), p=list(shares.values())))
        for what, shares in (
            ("masses", MASSES),
            ("payload", PAYLOADS),
            ("place", PLACES),
            ("set-ups", SET_UPS),
            ("noise", NOISES),
            ("sigma", SIGMAS),
            ("measured", MEASURED),
        )
    }
    for column in ("time", "temperature", "approach"):
        drawn[column] = "none" if random.uniform() < ABSENT else "there"
    drawn["order"] = "shuffled" if random.uniform() < SHUFFLED else "as measured"
    drawn["names"] = "there" if random.uniform() < NAMED else "none"
    drawn["sensor"] = "there" if random.uniform() < SENSOR else "none"
    count = int(np.exp(random.uniform(*np.log(ROWS))))
    if drawn["measured"] == "lengths":
        count, drawn["set-ups"] = max(count, FEWEST_LENGTHS), "one"
    drawn |= {"arm": name, "rows": str(count)}
    mass, com_mm = {"6 % wrong": (0.06, 10.0), "30 % wrong": (0.3, 20.0)}.get(drawn["masses"], (0.02, 2.0))
    true = built(complete, random, mass, com_mm)
    q = _postures(complete, count, drawn["place"], random)
    order = _shuffled_in(count, drawn["place"], random)
    held = {"q": q[order], **{k: v[order] for k, v in _conditions(complete, q, most, drawn, random).items()}}
    sensor = "tilt_column" if drawn["sensor"] == "there" else ""
    extra = {sensor: held.pop("sensor")} if sensor else {}
    held.pop("sensor", None)
    set_ups = _set_ups(drawn["set-ups"], len(q), random)
    labels = {k: [v[i] for i in order] for k, v in set_ups.items()}
    poses = Dataset.from_arrays(held.pop("q"), **held, **labels, extra=extra, source="simulated")
    still = true.poses(poses)[:, :3, 3]
    mounts, stations = (1 if c is None else int(c.max()) + 1 for c in (poses.mount, poses.station))
    shifts = 1e-3 * random.standard_normal((mounts, 3)) * (np.arange(mounts) > 0)[:, np.newaxis]
    nominal = without_links(complete) if drawn["masses"] == "none" else complete
    joints = drawn_joints(random)
    drawn["joints"] = f"{1e3 * joints:g} mrad"
    sigma = float(np.sqrt(np.mean(spread_of(still) ** 2) + spread_by_joints(true, poses, joints) ** 2))
    at = Setting(nominal, complete, true, poses, still, sigma, _leaves(true, poses, count), "white", joints)
    anchors = still.mean(axis=0) + random.uniform(1.5, 3.0, (4, 3)) * random.choice([-1, 1], (4, 3))
    moves = _moves(stations, random)
    return World(at, drawn, most, shifts, _turns(mounts if drawn["measured"] == "poses" else 1, random), moves, anchors)


def _leaves(true: Robot, poses: Dataset, count: int) -> FloatArray:
    """(3 n, k) orthonormal: what geometry, and base and tool of each set-up, take up in the rows that are diagnosed."""
    J = true.parameter_jacobian(poses.q[:count]).reshape(3 * count, -1)
    parts = [J]
    points = true.forward(poses.q[:count])
    for codes, base in ((poses.station, True), (poses.mount, False)):
        for code in range(0 if codes is None else int(codes.max()) + 1):
            own = np.repeat(codes[:count] == code, 3).astype(float)[:, np.newaxis]
            parts.append(own * _rigid(points, base))
    A = np.hstack(parts)
    U, s, _ = np.linalg.svd(A / np.maximum(np.linalg.norm(A, axis=0), 1e-300), full_matrices=False)
    return U[:, s > 1e-9 * s[0]]


def _rigid(T: FloatArray, base: bool) -> FloatArray:
    """(3 N, 6 or 3) what a motion of the base, or a shift of the tool, moves the points by."""
    R, p = T[:, :3, :3], T[:, :3, 3]
    if not base:
        return R.reshape(-1, 3)
    turned = np.cross(np.eye(3)[np.newaxis], p[:, np.newaxis])  # (N, axis, xyz)
    return np.concatenate([np.broadcast_to(np.eye(3), R.shape), turned.transpose(0, 2, 1)], axis=2).reshape(-1, 6)


def _postures(robot: Robot, count: int, place: str, random: Random) -> FloatArray:
    """(N, n) count and HELD_OUT postures, in the order of measuring."""
    whole, seed = count + HELD_OUT, int(random.integers(2**31))
    if place == "paths":
        knots = random_poses(robot, whole // PATH_ROWS * 3 + 6, seed=seed)
        parts = [_path(knots[3 * k : 3 * k + 3]) for k in range(len(knots) // 3)]
        return np.vstack(parts)[:whole]
    if place == "box":
        robot = _narrowed(robot, random_poses(robot, 1, seed=seed)[0], BOX)
    q = random_poses(robot, whole, seed=seed)
    if place == "grid":  # joints stop at a few positions each; what is held out lies between them
        low, high = q.min(axis=0), q.max(axis=0)
        levels = random.integers(3, 7, q.shape[1])
        step = (high - low) / levels
        on_grid = low + (np.floor((q - low) / step).clip(max=levels - 1) + 0.5) * step
        rows = random.permutation(whole)[:count]
        q[rows] = on_grid[rows]
        q = np.vstack([q[rows], np.delete(q, rows, axis=0)])
    return q


def _path(knots: FloatArray) -> FloatArray:
    """(PATH_ROWS, n) through three postures, smoothly."""
    t = np.linspace(0, 1, PATH_ROWS)[:, np.newaxis]
    a, b, c = knots
    return np.asarray((1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c)


def _narrowed(robot: Robot, middle: FloatArray, share: float) -> Robot:
    """The robot with limits about a posture."""
    spec = copy.deepcopy(dict(robot.spec))
    for joint, q in zip(spec["joints"], middle, strict=True):
        unit, scale = ("deg", 180 / np.pi) if joint["type"] == "revolute" else ("mm", 1e3)
        low, high = joint[f"min_{unit}"], joint[f"max_{unit}"]
        half = share * (high - low) / 2
        joint[f"min_{unit}"] = float(max(low, q * scale - half))
        joint[f"max_{unit}"] = float(min(high, q * scale + half))
    return Robot(spec)


def _shuffled_in(count: int, place: str, random: Random) -> NDArray[np.intp]:
    """The order of all rows with those that are diagnosed first: they lie among the others in time.

    Of paths whole ones are held out; a grid's rows come first already.
    """
    whole = count + HELD_OUT
    if place == "grid":
        chosen = np.arange(count)
    elif place == "paths":
        paths = random.permutation(-(-whole // PATH_ROWS))
        rows = (paths[:, np.newaxis] * PATH_ROWS + np.arange(PATH_ROWS)).ravel()
        chosen = np.sort(rows[rows < whole][:count])
    else:
        chosen = np.sort(random.permutation(whole)[:count])
    return np.concatenate([chosen, np.setdiff1d(np.arange(whole), chosen)])


def _conditions(
    robot: Robot, q: FloatArray, most: float, drawn: dict[str, str], random: Random
) -> dict[str, FloatArray]:
    """Columns of all rows in the order of measuring; of a grid, whose held-out rows come last, time is drawn anew."""
    N = len(q)
    time = np.sort(random.uniform(0, SESSION_S, N))
    if drawn["place"] == "grid":
        fitted = np.sort(random.permutation(time)[: N - HELD_OUT])
        time = np.concatenate([fitted, random.uniform(0, SESSION_S, HELD_OUT)])
    warm = 10 * (1 - np.exp(-time / 5400)) if random.uniform() < 0.7 else 3 * np.sin(2 * np.pi * time / 7200)
    loads = {"zeros": [0.0], "two": [0.0, 1.0], "three": [0.0, 0.5, 1.0], "labels": [0.0, 0.5, 1.0]}
    if drawn["payload"] == "many":
        payload = most * np.round(random.uniform(0, 1, N), 2)
    elif drawn["payload"] in ("one", "no column"):
        payload = np.full(N, most * round(float(random.uniform(0.3, 1.0)), 2))
    else:
        payload = most * random.choice(loads[drawn["payload"]], N)
    approach = random.choice([-1.0, 1.0], (N, robot.joint_count))
    if drawn["place"] == "paths":
        steps = np.diff(q, axis=0, prepend=2 * q[:1] - q[1:2])
        approach = np.where(steps >= 0, 1.0, -1.0)
    tilt = np.cumsum(random.standard_normal(N))
    tilt = (tilt - tilt.mean()) / max(float(tilt.std()), 1e-9) + 0.3 * random.standard_normal(N)
    return {
        "time": time,
        "temperature": 273.15 + 20 + warm + 0.1 * random.standard_normal(N),
        "payload": payload,
        "approach": approach,
        "sensor": tilt[np.argsort(np.argsort(time))] if drawn["place"] == "grid" else tilt,
    }


def _set_ups(kind: str, count: int, random: Random) -> dict[str, list[str]]:
    """Labels of stations and mounts, one stretch of the order of measuring each."""
    out: dict[str, list[str]] = {}
    for field_, letter, kinds in (("station", "s", ("stations", "both", "files")), ("mount", "m", ("mounts", "both"))):
        if kind in kinds:
            cuts = np.sort(random.uniform(0.25, 0.75, int(random.integers(1, 3)))) * count
            out[field_] = [f"{letter}{int(k)}" for k in np.searchsorted(cuts, np.arange(count))]
    return out


def _turns(count: int, random: Random) -> FloatArray:
    """(count, 3, 3) of a target that is mounted anew: about as it was, or turned by any angle; the first is none."""
    out = np.tile(np.eye(3), (count, 1, 1))
    for R in out[1:]:
        w = random.standard_normal(3)
        w *= np.exp(random.uniform(np.log(1e-4), np.log(3.0))) / np.linalg.norm(w)
        R[:] = _core.exp_so3(w)
    return out


def _moves(count: int, random: Random) -> FloatArray:
    """(count, 4, 4) of the measuring frame: a bump of the tripod, or another place; the first is none."""
    out = np.tile(np.eye(4), (count, 1, 1))
    for T in out[1:]:
        size = float(np.exp(random.uniform(np.log(1e-4), np.log(0.5))))
        a = size * random.standard_normal()
        T[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
        T[:3, 3] = size * random.standard_normal(3)
    return out


def _noise(kind: str, at: Setting, points: FloatArray, random: Random) -> FloatArray:
    if kind in ("white", "heavy-tailed", "serial"):
        return noise_of(kind, points, random)
    error = noise_of("white", points, random)
    if kind == "unequal":
        error *= np.exp(0.7 * random.standard_normal((len(points), 1)))
    elif kind == "gross":
        bad = random.choice(at.count, max(1, int(GROSS * at.count)), replace=False)
        error[bad] += GROSS_M * random.standard_normal((len(bad), 3))
    return error


def _without_columns(data: Dataset, drawn: dict[str, str], most: float, random: Random) -> Dataset:
    """The rows with the columns that their file has."""
    n = len(data)
    out: dict[str, Any] = {}
    if drawn["payload"] == "no column":
        out["payload"] = np.zeros(n)
    if drawn["payload"] == "labels":
        bad = random.uniform(size=n) < 0.1
        out["payload"] = np.where(bad, most * random.choice([0.0, 0.5, 1.0], n), data.payload)
    for column in ("time", "temperature", "approach"):
        if drawn[column] == "none":
            out[column] = None
    if drawn["approach"] == "none":
        out["move"] = None
    if drawn["names"] == "there":
        out["extra_labels"] = {"point": [f"P{i + 1}" for i in range(n)]}
        out["extra"] = {**data.extra, "order": np.arange(1.0, n + 1)}
    if drawn["sigma"] != "none" and data.position is not None:
        factor = {"true": 1.0, "0.4 times": 0.4, "2.5 times": 2.5}[drawn["sigma"]]
        out["sigma_position"] = np.full((n, 3), 0.0) + factor * spread_of(data.position)[:, np.newaxis]
    return replace(data, **out)


def _quaternions(R: FloatArray, turn: FloatArray) -> FloatArray:
    """(N, 4) w x y z of rotations with small further turns."""
    from scipy.spatial.transform import Rotation

    q = (Rotation.from_matrix(R) * Rotation.from_rotvec(turn)).as_quat()
    return np.asarray(np.column_stack([q[:, 3], q[:, :3]]))
