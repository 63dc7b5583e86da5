# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Hand-eye from poses against the reference solvers of KinHEC (PyPI, MIT), on sessions that KinHEC simulates.

Every solver gets the same poses (KinHEC's own keyframes; clocks of asynchronous streams set by the true offset): pairs
A, B with A X = Y B. fastcal gets them as a cell of an arm of poses. What counts is how far X is from the true one, mm
and degrees, the median over the sessions of a level, and `best` is at each level whichever of KinHEC's solvers is best
there, which nobody can know beforehand; `single` are the medians over the levels of a track of what each of them,
chosen once for all, and fastcal are off, in times the best. "Undetermined": fastcal says that these motions do not show
X, because what it holds or what it knows is more than UNKNOWN.

`--joints`: in `robot_error` the joint positions are known too, and fastcal identifies the arm, which no solver of poses
can. Two stations of three are fitted, by fastcal with the nominal arm and the camera's poses, and by Shah's with
Levenberg and Marquardt; what counts is how far the predicted positions of the camera at the other stations are from
the true ones, mm, the mean of a session and the median of a level.

    python bench/python/bench_kinhec.py [--tracks outliers,motion] [--data FOLDER] [--seed S] [--repeats N] [--joints]
        [--out FILE]

`pip install kinhec` first; without it nothing is measured. --data keeps the sessions, which take minutes to simulate.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core, calibrate
from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.cell import Arm, Cell, Point
from fastcal.cells.pose_arm import pose_arm, pose_joints
from fastcal.cells.readings import Readings
from fastcal.errors import FastcalError
from fastcal.io.atomic import write_text
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose

FloatArray = NDArray[np.float64]

TRACKS = ("robot_error", "outliers", "motion", "pnp", "temporal")
UNKNOWN_MM = 100.0  # standard deviation of a coordinate of X: nobody can use that
REFUSED = "fastcal refuses half of the sessions of this level, or more: there is no median"
_TIER = "small"


def quaternions(T: FloatArray) -> FloatArray:
    """(N, 4) w, x, y, z of poses (N, 4, 4)."""
    out = np.zeros((len(T), 4))
    for k, R in enumerate(T[:, :3, :3]):
        turn = np.asarray(_core.log_so3(R))
        angle = float(np.linalg.norm(turn))
        out[k, 0] = np.cos(angle / 2)
        out[k, 1:] = np.sin(angle / 2) / angle * turn if angle > 0 else 0.0
    return out


def by_fastcal(A: FloatArray, B: FloatArray, *, in_hand: bool) -> tuple[FloatArray, bool]:
    """(4, 4) X of A X = Y B (N, 4, 4), what the flange carries, and whether the motions are said not to show it.

    B are poses of the camera in the board where the camera is in hand, else of the board in the camera.
    """
    S = np.linalg.inv(B) if in_hand else B
    arm = Arm("arm", load_robot(pose_arm("arm")), of_poses=True)
    zero = {"xyz_mm": [0.0] * 3, "rpy_deg": [0.0] * 3}
    on = {"camera": arm.flange, "board": "world"} if in_hand else {"camera": "world", "board": arm.flange}
    points = (Point("board", "target", on["board"], zero), Point("camera", "sensor", on["camera"], zero))
    tables = {"position@board:camera": np.ascontiguousarray(S[:, :3, 3]), "rotation@board:camera": quaternions(S)}
    q = pose_joints(np.ascontiguousarray(A[:, :3, 3]), quaternions(A))
    found = calibrate_cell(Cell("bench", (arm,), points), Readings(q, tables, "KinHEC"))
    carried = next(of for of in found.cell.points if of.on == arm.flange)
    return pose(carried.place), is_undetermined(found, carried.name)


def is_undetermined(found: CellResult, name: str) -> bool:
    """Does the result say that these motions do not show where that is?"""
    std = [p.std for p in found.parameters if p.owner == name and p.unit == "mm"]
    known = len(std) == 3 and all(s is not None and s < UNKNOWN_MM for s in std)
    return found.status != "converged" or not known or bool(found.unidentifiable)


def predicted(session: Any) -> tuple[float, float] | None:
    """How far fastcal with joints, and Shah's with Levenberg and Marquardt, are from the camera at stations left out.

    [mm], means; None where a fit fails.
    """
    from kinhec import solvers
    from kinhec.robots import get_robot

    arm = get_robot(session.manifest["robot"])
    names = ("theta_offset", "d", "a", "alpha", "q_min", "q_max")
    theta, d, a, alpha, low, high = (np.asarray(getattr(arm, name)) for name in names)
    joints = [
        {"type": "revolute"}
        | {f"{key}_deg": float(np.degrees(of[i])) for key, of in (("theta", theta), ("alpha", alpha))}
        | {"d_mm": 1e3 * float(d[i]), "a_mm": 1e3 * float(a[i])}
        | {"min_deg": float(np.degrees(low[i])), "max_deg": float(np.degrees(high[i]))}
        for i in range(arm.dof)
    ]
    spec = {"name": arm.name, "kinematics": {"standard": "dh", "modified": "mdh"}[arm.convention], "joints": joints}
    A, B = session.axyb_poses()
    seen = session.camera.has_measurement
    q, true = session.robot.q_meas[seen], session.axyb_poses(use_gt=True)[1][seen][:, :3, 3]
    rest = np.arange(len(q)) % 3 == 2
    fit = ~rest
    try:
        data = Dataset.from_arrays(q[fit], position=B[fit][:, :3, 3].copy(), rotation=quaternions(B[fit]))
        there = calibrate(load_robot(spec), data).model.forward(q[rest])[:, :3, 3]
    except FastcalError:
        return None
    X, Y = solvers.refine_lm_axyb(A[fit], B[fit], *solvers.shah(A[fit], B[fit]))
    theirs = (np.linalg.inv(Y)[np.newaxis] @ A[rest] @ X)[:, :3, 3]
    own, other = (1e3 * float(np.mean(np.linalg.norm(of - true[rest], axis=1))) for of in (there, theirs))
    return own, other


def with_joints(every: list[Any]) -> list[dict[str, Any]]:
    """Of each level of `robot_error`: sessions, and the medians of `predicted`."""
    found: dict[str, list[tuple[float, float]]] = {}
    for session in every:
        if session.manifest["track"] == "robot_error" and (of := predicted(session)) is not None:
            found.setdefault(session.manifest["level"], []).append(of)
    return [
        {"level": level, "sessions": len(of)}
        | dict(zip(("mm", "shah_lm_mm"), np.median(of, axis=0).tolist(), strict=True))
        for level, of in found.items()
    ]


def sessions(folder: Path, tracks: list[str], seed: int | None, repeats: int = 1) -> list[Any]:
    """KinHEC's sessions of the tracks, simulated into a folder that does not hold them yet; `repeats` times as many."""
    import yaml
    from kinhec.io import load_manifest, load_sequence
    from kinhec.pipeline import generate_dataset
    from kinhec.plans import load_tier

    place = folder / f"{_TIER}-{seed}-{'-'.join(tracks)}-x{repeats}"
    if not (place / "done").exists():
        tier = load_tier(_TIER)
        tier.pop("_path")
        tier["repeats_multiplier"] = repeats
        if seed is not None:
            tier["global_seed"] = seed
        file = folder / "tier.yaml"
        write_text(file, yaml.safe_dump(tier))
        work = folder / "work"
        generate_dataset(str(file), place, tracks=tracks, work_dir=work, write_card=False, progress=False)
        write_text(place / "done", "")
    manifest = load_manifest(place)
    return [load_sequence(place, name, manifest) for name in sorted(manifest["sequence_id"])]


def judged(session: Any) -> dict[str, Any] | None:
    """Errors of X of each solver [mm, deg] in one session; None where it has too few poses."""
    from kinhec.benchmark import SOLVERS, _keyframe_data
    from kinhec.metrics import calibration_errors

    data = _keyframe_data(session, None if session.synchronous else session.time_offset)
    if data is None:
        return None
    random = np.random.default_rng(0)
    errors: dict[str, tuple[float, float]] = {}
    for name, solve in SOLVERS.items():
        try:
            off = calibration_errors(solve(data, random)["X"], session.X)
            errors[name] = (float(off["X_trans_err_mm"]), float(off["X_rot_err_deg"]))
        except Exception:  # noqa: BLE001 - a solver that fails in any way is a result
            errors[name] = (np.inf, np.inf)
    undetermined = True
    try:
        X, undetermined = by_fastcal(data[0], data[1], in_hand=session.eye_in_hand)
        off = calibration_errors(X, session.X)
        errors["fastcal"] = (float(off["X_trans_err_mm"]), float(off["X_rot_err_deg"]))
    except FastcalError:
        errors["fastcal"] = (np.inf, np.inf)
    return {"track": session.manifest["track"], "level": session.manifest["level"]} | {
        "undetermined": undetermined,
        "errors": {name: [e if np.isfinite(e) else np.inf for e in error] for name, error in errors.items()},
    }


def level_rows(found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of each track and level: sessions, medians of fastcal and of the best of the others, how often undetermined."""
    out = []
    for track, level in dict.fromkeys((of["track"], of["level"]) for of in found):
        own = [of["errors"] for of in found if (of["track"], of["level"]) == (track, level)]
        medians = {name: np.median([errors[name] for errors in own], axis=0) for name in own[0]}
        mine = medians.pop("fastcal")
        row: dict[str, Any] = {"track": track, "level": level, "sessions": len(own)}
        row["medians"] = {name: [finite(of) for of in median] for name, median in medians.items()}
        for k, unit in enumerate(("mm", "deg")):
            best = min(medians, key=lambda name: float(medians[name][k]))
            row |= {unit: finite(mine[k]), f"best_{unit}": finite(medians[best][k]), f"best_by_{unit}": best}
        if row["mm"] is None:
            row["null"] = REFUSED
        said = [of["undetermined"] for of in found if (of["track"], of["level"]) == (track, level)]
        out.append(row | {"undetermined": int(sum(said))})
    return out


def finite(of: float) -> float | None:
    """None of what JSON has no number for."""
    return float(of) if np.isfinite(of) else None


def single(rows: list[dict[str, Any]]) -> dict[str, dict[str, list[float | None]]]:
    """Of each track and solver the medians over determined levels of shift and turn, times the best at each level."""
    out: dict[str, dict[str, list[float | None]]] = {}
    for track in dict.fromkeys(row["track"] for row in rows):
        own = [row for row in rows if row["track"] == track and not row["undetermined"]]
        times = {
            name: [
                [np.inf if m is None else m / row[f"best_{u}"] for m, u in zip(of, ("mm", "deg"), strict=True)]
                for row in own
                for of in [row["medians"][name]]
            ]
            for name in (own[0]["medians"] if own else ())
        }
        times["fastcal"] = [[row[u] / row[f"best_{u}"] for u in ("mm", "deg")] for row in own]
        out[track] = {name: [finite(np.median(k)) for k in zip(*of, strict=True)] for name, of in times.items() if of}
    return out


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", default=",".join(TRACKS))
    parser.add_argument("--data", type=Path, help="the folder that keeps the sessions")
    parser.add_argument("--seed", type=int, help="draws other sessions; default: KinHEC's own")
    parser.add_argument("--repeats", type=int, default=1, help="times as many sessions a level")
    parser.add_argument("--joints", action="store_true", help="robot_error with joint positions")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    if importlib.util.find_spec("kinhec") is None:
        print("skipped: kinhec is not installed (pip install kinhec)")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        every = sessions(given.data or Path(folder), given.tracks.split(","), given.seed, given.repeats)
        found = [of for of in map(judged, every) if of is not None]
    rows = level_rows(found)
    print(f"{len(found)} sessions; X off by, median of each level")
    for row in rows:
        own = {unit: np.inf if row[unit] is None else row[unit] for unit in ("mm", "deg")}
        met = own["mm"] <= 1.02 * row["best_mm"] and own["deg"] <= 1.02 * row["best_deg"]
        print(
            f"{'        ' if met else 'WORSE   '}{row['track']:12}{row['level']:50} fastcal {own['mm']:8.3f} mm "
            f"{own['deg']:7.4f} deg, best {row['best_mm']:8.3f} mm ({row['best_by_mm']}) {row['best_deg']:7.4f} deg "
            f"({row['best_by_deg']}), undetermined {row['undetermined']} of {row['sessions']}",
            flush=True,
        )
    alone = single(rows)
    for track, times in alone.items():
        shifts = {name: np.inf if of[0] is None else of[0] for name, of in times.items()}
        told = ", ".join(f"{name} {shift:.2f}" for name, shift in sorted(shifts.items(), key=lambda of: of[1]))
        print(f"{track}: shift, times the best at each level, median: {told}")
    record: dict[str, Any] = {"tier": _TIER, "seed": given.seed, "repeats": given.repeats}
    record |= {"levels": rows, "single": alone}
    if given.joints:
        record["with_joints"] = with_joints(every)
        for row in record["with_joints"]:
            print(
                "with joints: {level:40} {sessions} sessions, fastcal {mm:.3f}, Shah, LM {shah_lm_mm:.3f} mm".format(
                    **row
                )
            )
    if given.out is not None:
        write_text(given.out, json.dumps(record, indent=1, allow_nan=False) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
