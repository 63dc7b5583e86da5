# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How good a hand-eye from KinHEC's poses can be: least squares with the noise that was drawn, which no user knows.

Of A X = Y B the residuals r (N, 6) of the board in the camera, shift and turn, have the covariance

    C = diag(camera) + T (flange + s_q^2 J J^T) T^T + (T D) (T D)^T,

T = dr/dxi of the flange's twist, J its Jacobian, and D the columns of all DH parameters times their standard
deviations, which couple all poses of a session. The best X of A X = Y B that errs by chance alone has the weights
C^-1. It is held beside fastcal and KinHEC's eleven solvers (`bench_kinhec`), all sessions, and then in draws of as many
sessions a level as KinHEC's tier has: in how many levels is it no worse than the best of the eleven?

    python bench/python/bench_kinhec_known_noise.py [--tracks robot_error,motion] [--data FOLDER] --seed S --repeats N
        [--out FILE]
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from bench_kinhec import finite, judged, sessions
from numpy.typing import NDArray

from fastcal.io.atomic import write_text

FloatArray = NDArray[np.float64]

TRACKS = ("robot_error", "motion")
KNOWN = "known noise"
DRAWS = 2000
_STEP = 1e-6
_ROUNDS = 5


def derivative(f: Callable[[FloatArray], FloatArray], count: int) -> FloatArray:
    """df/dp at 0 by central differences, p (count,) the last axis."""
    steps = _STEP * np.eye(count)
    return np.stack([(f(step) - f(-step)) / (2 * _STEP) for step in steps], axis=-1)


def left(A: FloatArray, S: FloatArray, X: FloatArray, Y: FloatArray) -> FloatArray:
    """(N, 6) how far the board Y is from where it was read, S (N, 4, 4) in the camera, [m] and [rad]."""
    from kinhec import se3

    there = se3.inverse(A @ X) @ Y
    turns = se3.log_so3(np.swapaxes(S[:, :3, :3], 1, 2) @ there[:, :3, :3])
    return np.concatenate([there[:, :3, 3] - S[:, :3, 3], turns], axis=1)


def covariance(session: Any, A: FloatArray, S: FloatArray, X: FloatArray, Y: FloatArray) -> FloatArray:
    """(6 N, 6 N) of the residuals as they were drawn."""
    from kinhec import se3

    m, count = session.manifest, len(A)
    shift = [m["camera_trans_std_m"]] * 2 + [m["camera_trans_std_z_m"]]
    own = np.diag(np.square([*shift, *[m["camera_rot_std_rad"]] * 3]))
    T = derivative(lambda xi: left(A @ se3.exp_se3(xi), S, X, Y), 6)
    flange = np.diag(np.square([m["robot_rot_std_rad"]] * 3 + [m["robot_trans_std_m"]] * 3))
    blocks = own + T @ flange @ T.transpose(0, 2, 1)
    shared = np.zeros((6 * count, 0))
    if m["joint_std_rad"] or m["dh_len_std_m"] or m["dh_ang_std_rad"]:
        D = T @ geometry(session, A)
        joints = D.shape[2] // 4
        turned = D[:, :, 3 * joints :]
        blocks = blocks + m["joint_std_rad"] ** 2 * turned @ turned.transpose(0, 2, 1)
        sigma = np.repeat([m["dh_len_std_m"], m["dh_len_std_m"], m["dh_ang_std_rad"], m["dh_ang_std_rad"]], joints)
        shared = (D * sigma).reshape(6 * count, -1)
    C = shared @ shared.T
    for k in range(count):
        C[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] += blocks[k]
    return np.asarray(C)


def geometry(session: Any, A: FloatArray) -> FloatArray:
    """(N, 6, 4 n) twist of the flange, in its axes, by a, d, alpha and theta of n joints, at poses A of the session."""
    from kinhec import se3
    from kinhec.kinematics import forward_kinematics_batch
    from kinhec.robots import get_robot

    arm, every = get_robot(session.manifest["robot"]), session.axyb_poses()[0]
    of_row = [int(np.argmin(np.abs(every - pose).sum(axis=(1, 2)))) for pose in A]
    q = session.robot.q_meas[session.camera.has_measurement][of_row]
    here = se3.inverse(forward_kinematics_batch(arm, q))
    out = []
    for name in ("a", "d", "alpha", "theta_offset"):
        for joint in range(arm.dof):
            values = np.array(getattr(arm, name), dtype=float)
            values[joint] += _STEP
            moved = here @ forward_kinematics_batch(replace(arm, **{name: values.tolist()}), q)
            out.append(np.stack([se3.log_se3(pose) for pose in moved]) / _STEP)
    return np.stack(out, axis=-1)


def by_known_noise(session: Any) -> tuple[float, float]:
    """Errors of X [mm, deg]; both tracks have the camera in hand."""
    from kinhec import se3, solvers
    from kinhec.benchmark import _keyframe_data
    from kinhec.metrics import calibration_errors

    A, B, _, _ = _keyframe_data(session, None if session.synchronous else session.time_offset)
    assert session.eye_in_hand, session.manifest["track"]
    S = se3.inverse(B)
    X, Y = solvers.shah(A, B)
    root = np.linalg.cholesky(covariance(session, A, S, X, Y))
    for _ in range(_ROUNDS):
        J = derivative(
            lambda p, X=X, Y=Y: left(A, S, X @ se3.exp_se3(p[:6]), Y @ se3.exp_se3(p[6:])).ravel(),  # type: ignore[misc]
            12,
        )
        white, r = np.linalg.solve(root, J), np.linalg.solve(root, left(A, S, X, Y).ravel())
        step = -np.linalg.lstsq(white, r, rcond=None)[0]
        X, Y = X @ se3.exp_se3(step[:6]), Y @ se3.exp_se3(step[6:])
    off = calibration_errors(X, session.X)
    return float(off["X_trans_err_mm"]), float(off["X_rot_err_deg"])


def drawn(found: list[dict[str, Any]], name: str, repeats: int) -> dict[str, float]:
    """Of draws of 1 / repeats of the sessions of each level: levels in which it is no worse than the best of others.

    "levels": mean; "all": share of draws in which that holds of every level; "times": the median over the levels of its
    shift over the best, median of draws.
    """
    levels: dict[str, FloatArray] = {}
    for level in dict.fromkeys(of["level"] for of in found):
        own = [of for of in found if of["level"] == level]
        if any(of["undetermined"] for of in own):
            continue
        others = [key for key in own[0]["errors"] if key not in ("fastcal", KNOWN)]
        levels[level] = np.array([[of["errors"][key][0] for key in (name, *others)] for of in own])
    random, counts, times = np.random.default_rng(1), [], []
    for _ in range(DRAWS):
        ratios = []
        for own in levels.values():
            some = own[random.choice(len(own), max(1, len(own) // repeats), replace=False)]
            medians = np.median(some, axis=0)
            ratios.append(float(medians[0] / medians[1:].min()))
        counts.append(sum(ratio <= 1 for ratio in ratios))
        times.append(float(np.median(ratios)))
    return {
        "of": len(levels),
        "levels": float(np.mean(counts)),
        "all": float(np.mean([count == len(levels) for count in counts])),
        "times": float(np.median(times)),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", default=",".join(TRACKS))
    parser.add_argument("--data", type=Path, help="the folder that keeps the sessions")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--repeats", type=int, default=10, help="times as many sessions a level")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    if importlib.util.find_spec("kinhec") is None:
        print("skipped: kinhec is not installed (pip install kinhec)")
        return 0
    record: dict[str, Any] = {"seed": given.seed, "repeats": given.repeats, "tracks": {}}
    with tempfile.TemporaryDirectory() as folder:
        for track in given.tracks.split(","):
            found = []
            for session in sessions(given.data or Path(folder), [track], given.seed, given.repeats):
                if (of := judged(session)) is not None:
                    of["errors"][KNOWN] = list(by_known_noise(session))
                    found.append(of)
            rows = []
            for level in dict.fromkeys(of["level"] for of in found):
                own = [of for of in found if of["level"] == level]
                medians = {key: float(np.median([of["errors"][key][0] for of in own])) for key in own[0]["errors"]}
                best = min((key for key in medians if key not in ("fastcal", KNOWN)), key=lambda key: medians[key])
                rows.append(
                    {"level": level, "sessions": len(own), "undetermined": sum(of["undetermined"] for of in own)}
                    | {"mm": medians["fastcal"], "known_mm": medians[KNOWN]}
                    | {"best_mm": finite(medians[best]), "best_by": best}
                )
                print(f"{track:12}{level:44}{rows[-1]}", flush=True)
            draws = {name: drawn(found, name, given.repeats) for name in ("fastcal", KNOWN)}
            print(track, draws)
            record["tracks"][track] = {"levels": rows, "draws": draws}
    if given.out is not None:
        write_text(given.out, json.dumps(record, indent=1, allow_nan=False) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
