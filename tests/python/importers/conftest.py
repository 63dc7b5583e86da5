# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A session at a tracker: where a UR5 was sent, what was measured, written as instruments and controllers write it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal import load_robot, simulate
from fastcal.calibration.simulation import random_poses
from fastcal.importers import import_measurements
from fastcal.importers.reading import Reading

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Session:
    """Poses as the files have them.

    Attributes:
        q: (N, 6) [deg], four decimals.
        points: (N, 3) [mm], four decimals.
        xyzw: (N, 4) quaternions of the target.
        names: P001 ...
        folder: Where files may be written.
    """

    q: FloatArray
    points: FloatArray
    xyzw: FloatArray
    names: list[str]
    folder: Path

    def write(self, name: str, content: str | bytes) -> Path:
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def table(self, head: str, row: str, name: str = "export.csv", **options: str) -> Path:
        """A file with a line a pose; the row is a format of name, q, p (mm), m (metres), r (rad), w (quaternion), k."""
        lines = [
            row.format(k=k + 1, name=n, q=q, p=p, m=p / 1000, r=np.radians(q), w=w)
            for k, (n, q, p, w) in enumerate(zip(self.names, self.q, self.points, self.xyzw, strict=True))
        ]
        return self.write(
            name, ("\n".join([*([head] if head else []), *lines]) + "\n").encode(options.get("encoding", "utf-8"))
        )

    def joints(self, name: str = "joints.csv") -> Path:
        return self.table("Name,J1 [deg],J2 [deg],J3 [deg],J4 [deg],J5 [deg],J6 [deg]", "{name}," + Q, name)

    def euler(self, sequence: str) -> FloatArray:
        """(N, 3) angles [deg] by SciPy's letters: capitals turn about moving axes."""
        return Rotation.from_quat(self.xyzw).as_euler(sequence, degrees=True)


Q = "{q[0]:.4f},{q[1]:.4f},{q[2]:.4f},{q[3]:.4f},{q[4]:.4f},{q[5]:.4f}"
P = "{p[0]:.4f},{p[1]:.4f},{p[2]:.4f}"


@pytest.fixture(scope="session")
def measured() -> tuple[FloatArray, FloatArray, FloatArray]:
    robot = load_robot("ur5")
    q = np.round(np.degrees(random_poses(robot, 30, seed=5)), 4)
    data = simulate(robot, np.radians(q), noise=5e-5, noise_rotation=1e-4, seed=5)
    assert data.position is not None
    assert data.rotation is not None
    return q, np.round(data.position * 1000, 4), data.rotation[:, [1, 2, 3, 0]]


@pytest.fixture
def session(measured: tuple[FloatArray, FloatArray, FloatArray], tmp_path: Path) -> Session:
    return Session(*measured, [f"P{k:03d}" for k in range(1, 31)], tmp_path)


def check(reading: Reading, session: Session, *, turned: bool = False, rows: list[int] | None = None) -> None:
    """The reading holds the joints, points and orientations of the session, in any unit and order."""
    from fastcal.importers.writing import imported_dataset

    data = imported_dataset(reading, None)
    assert data.position is not None
    chosen = list(range(len(session.q))) if rows is None else rows
    assert len(data) == len(chosen)
    order = np.lexsort(np.round(np.degrees(data.q), 3).T)
    wanted = np.array(chosen)[np.lexsort(np.round(session.q[chosen], 3).T)]
    np.testing.assert_allclose(np.degrees(data.q[order]), session.q[wanted], atol=2e-4)
    np.testing.assert_allclose(data.position[order] * 1000, session.points[wanted], atol=2e-3)
    assert (data.rotation is not None) == turned
    if data.rotation is not None:
        off = Rotation.from_quat(data.rotation[order][:, [1, 2, 3, 0]]).inv() * Rotation.from_quat(session.xyzw[wanted])
        assert np.degrees(off.magnitude()).max() < 1e-3


__all__ = ["P", "Q", "Session", "check", "import_measurements"]
