# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A camera on a robot of six axes that looks at a board, drawn by numpy alone."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

COLUMNS, ROWS, SQUARE_MM = 7, 5, 25.0  # squares
FOCAL, CENTRE, SIZE = (1100.0, 1102.0), (640.0, 480.0), (1280, 960)
LENS = (-0.1, 0.05, 1e-4, -2e-4, 0.0)  # k1 k2 p1 p2 k3
DH = [(0.0, 400.0, 25.0, -90.0), (-90.0, 0.0, 455.0, 0.0), (0.0, 0.0, 35.0, -90.0)]
DH += [(0.0, 420.0, 0.0, 90.0), (0.0, 0.0, 0.0, -90.0), (0.0, 80.0, 0.0, 0.0)]


def pose(xyz: tuple[float, float, float], rpy_deg: tuple[float, float, float]) -> FloatArray:
    """(4, 4) in mm, R = Rz Ry Rx."""
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in np.radians(rpy_deg))
    T = np.eye(4)
    T[:3, :3] = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    T[:3, :3] = T[:3, :3] @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    T[:3, 3] = xyz
    return T


WRIST = pose((5.0, -68.0, 52.0), (-7.0, 1.0, 4.0))  # true; the file says something else
PLATE = pose((720.0, 40.0, 90.0), (178.0, -1.0, 15.0))


def flange(q_deg: FloatArray, error_mm: float = 0.0) -> FloatArray:
    """(4, 4) of one posture; `error_mm` lengthens the second link."""
    T = np.eye(4)
    for k, ((theta, d, a, alpha), q) in enumerate(zip(DH, q_deg, strict=True)):
        t, r = np.radians(theta + q), np.radians(alpha)
        T = T @ np.array(
            [
                [np.cos(t), -np.sin(t) * np.cos(r), np.sin(t) * np.sin(r), (a + error_mm * (k == 1)) * np.cos(t)],
                [np.sin(t), np.cos(t) * np.cos(r), -np.cos(t) * np.sin(r), (a + error_mm * (k == 1)) * np.sin(t)],
                [0, np.sin(r), np.cos(r), d],
                [0, 0, 0, 1],
            ]
        )
    return T


def corners() -> FloatArray:
    """(K, 3) in mm, row by row."""
    return np.array([[c * SQUARE_MM, r * SQUARE_MM, 0.0] for r in range(ROWS - 1) for c in range(COLUMNS - 1)])


def drawn(points: FloatArray) -> FloatArray:
    """(K, 2) px of points (K, 3) in the camera's frame."""
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    s = x**2 + y**2
    k1, k2, p1, p2, k3 = LENS
    a = 1 + k1 * s + k2 * s**2 + k3 * s**3
    u = a * x + 2 * p1 * x * y + p2 * (s + 2 * x**2)
    v = a * y + p1 * (s + 2 * y**2) + 2 * p2 * x * y
    return np.column_stack([FOCAL[0] * u + CENTRE[0], FOCAL[1] * v + CENTRE[1]])


def postures(count: int, seed: int) -> FloatArray:
    """(count, 6) [deg] in which the whole board is in the picture."""
    random = np.random.default_rng(seed)
    out: list[FloatArray] = []
    while len(out) < count:
        q = np.array([0.0, 10.0, 20.0, 0.0, 60.0, 0.0]) + random.uniform(-1, 1, 6) * [25, 25, 25, 60, 40, 170]
        uv = seen(q)
        if uv is not None and (uv > 0).all() and (uv < SIZE).all():
            out.append(q)
    return np.array(out)


def seen(q_deg: FloatArray, error_mm: float = 0.0) -> FloatArray | None:
    """(K, 2) px without noise; None where the board is not before the camera, or far away."""
    T = np.linalg.inv(flange(q_deg, error_mm) @ WRIST) @ PLATE
    points = corners() @ T[:3, :3].T + T[:3, 3]
    return drawn(points) if (points[:, 2] > 150).all() and (points[:, 2] < 900).all() else None


def cell(**camera: Any) -> dict[str, Any]:
    """The cell file, whose camera and board are not where they are."""
    wrist = {"on": "arm", "xyz_mm": [0, -70, 50], "rpy_deg": [-8, 0, 5], "size_px": list(SIZE)}
    wrist |= {"focal_px": list(FOCAL), "centre_px": list(CENTRE), "distortion": list(LENS), **camera}
    plate = {"on": "world", "xyz_mm": [700, 0, 100], "rpy_deg": [180, 0, 0], "kind": "checkerboard"}
    plate |= {"columns": COLUMNS, "rows": ROWS, "square_mm": SQUARE_MM}
    return {
        "cell": "test",
        "arms": {"arm": {"robot": "arm.yaml"}},
        "cameras": {"wrist": wrist},
        "boards": {"plate": plate},
    }


def write(
    folder: Path,
    count: int = 30,
    seed: int = 1,
    noise_px: float = 0.1,
    error_mm: float = 0.0,
    joint_noise_deg: float = 0.0,
) -> FloatArray:
    """Writes cell.yaml, arm.yaml, poses.csv and corners.csv; the pictures (N, K, 2)."""
    joints = [{"type": "revolute", "theta_deg": t, "d_mm": d, "a_mm": a, "alpha_deg": r} for t, d, a, r in DH]
    (folder / "arm.yaml").write_text(yaml.safe_dump({"name": "six", "kinematics": "dh", "joints": joints}))
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell()))
    q = postures(count, seed)
    rows = [",".join(f"{angle:.9f}" for angle in row) for row in q]
    (folder / "poses.csv").write_text("\n".join([",".join(f"arm.q{k}_deg" for k in range(1, 7)), *rows]) + "\n")
    random = np.random.default_rng(seed + 100)
    true = q + joint_noise_deg * random.standard_normal(q.shape)
    uv = np.array([seen(row, error_mm) for row in true]) + noise_px * random.standard_normal((count, len(corners()), 2))
    write_corners(folder, uv)
    return uv


def write_corners(folder: Path, uv: FloatArray, name: str = "corners.csv") -> None:
    """A table of pictures (N, K, 2); NaN: not seen."""
    lines = ["row,camera,board,corner,u_px,v_px"]
    lines += [
        f"{i},wrist,plate,{k},{u:.5f},{v:.5f}"
        for i, picture in enumerate(uv)
        for k, (u, v) in enumerate(picture)
        if np.isfinite(u)
    ]
    (folder / name).write_text("\n".join(lines) + "\n")
