# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arrays that MATLAB, Octave and NumPy saved are tables; titles that nobody knows are quoted."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from struct import pack

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

import fastcal
from fastcal import InvalidInput, ParseError
from fastcal.importers import import_measurements
from fastcal.importers.mapping import read_map

Q = np.array([[10.0, 20, 30, -140, 50, 60], [1, -2, 3, 4, -5, 6], [9, 8, 7, 6, 5, 90]])
P = np.array([[700.5, 10.0, 500.0], [650.0, 20.0, 510.0], [600.0, -30.0, 520.25]])


def check(path: Path, **more: object) -> None:
    found = import_measurements([path], **more)
    assert (found.joints, len(found)) == (6, 3)
    np.testing.assert_allclose([found.columns[f"q{k}_deg"] for k in range(1, 7)], Q.T, atol=1e-12)
    np.testing.assert_allclose([found.columns[f"{axis}_mm"] for axis in "xyz"], P.T, atol=1e-12)


@pytest.mark.parametrize("packed", [False, True])
def test_arrays_of_as_many_rows_are_a_table(tmp_path: Path, packed: bool) -> None:
    savemat(tmp_path / "a.mat", {"q": Q, "position": P, "who": "me", "gain": 3.0}, do_compression=packed)
    check(tmp_path / "a.mat")
    savemat(tmp_path / "b.mat", {"session": {"q": Q, "tip": P}}, do_compression=packed)
    check(tmp_path / "b.mat")
    savemat(tmp_path / "4.mat", {"q": Q, "p": P}, format="5", oned_as="row")
    check(tmp_path / "4.mat")


def test_numpy_archives_too(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", q=Q, xyz=P)
    check(tmp_path / "a.npz")
    np.save(tmp_path / "b.npy", np.c_[Q, P])
    (tmp_path / "map.yaml").write_text(
        "columns: {q1_deg: 1, q2_deg: column2, q3_deg: 3, q4_deg: 4, q5_deg: 5, q6_deg: 6, x_mm: 7, y_mm: 8, z_mm: 9}"
    )
    check(tmp_path / "b.npy", mapping=read_map(tmp_path / "map.yaml"))
    with pytest.raises(InvalidInput, match=r"none of its 9 titles is known \('column1', 'column2', 'column3', "):
        import_measurements([tmp_path / "b.npy"])


def test_a_transform_is_a_row(tmp_path: Path) -> None:
    robot = fastcal.load_robot("ur5")
    q = np.radians(Q)
    T = robot.forward(q)
    T[:, :3, 3] *= 1e3
    for name, stack in (("first", T), ("last", np.moveaxis(T, 0, 2))):
        savemat(tmp_path / f"{name}.mat", {"q": Q, "T": stack})
        found = import_measurements([tmp_path / f"{name}.mat"], orientation="matrix")
        np.testing.assert_allclose([found.columns[f"{axis}_mm"] for axis in "xyz"], T[:, :3, 3].T, atol=1e-9)
        w = np.array([found.columns[name] for name in ("qx", "qy", "qz", "qw")]).T
        np.testing.assert_allclose(Rotation.from_quat(w).as_matrix(), T[:, :3, :3], atol=1e-12)


def test_what_is_no_array_is_said(tmp_path: Path) -> None:
    def said(content: bytes) -> str:
        (tmp_path / "a.mat").write_bytes(content)
        with pytest.raises(ParseError) as error:
            import_measurements([tmp_path / "a.mat"])
        return str(error.value)

    assert "save it with save(..., '-v7')" in said(b"MATLAB 7.3 MAT-file, made up")
    assert "is not a readable MATLAB file" in said(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\x0f\x00")
    savemat(tmp_path / "text.mat", {"who": "me", "one": 3.0})
    assert "holds no array of numbers with two rows or more" in said((tmp_path / "text.mat").read_bytes())
    # Half a gigabyte of zeros in half a megabyte.
    bomb = zlib.compressobj(9)
    packed = b"".join(bomb.compress(bytes(1 << 20)) for _ in range(512)) + bomb.flush()
    assert "expected arrays of at most 100 MB" in said(
        b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + pack("<II", 15, len(packed)) + packed
    )
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("q.npy", bytes(1 << 27))
    assert "expected arrays of at most 100 MB" in said((tmp_path / "bomb.npz").read_bytes())
    with zipfile.ZipFile(tmp_path / "no.npz", "w") as archive:
        archive.writestr("q.npy", b"\x93NUMPY no")
    assert "is not a readable NumPy file" in said((tmp_path / "no.npz").read_bytes())


def test_three_points_a_pose_are_counted(tmp_path: Path) -> None:
    robot = fastcal.load_robot("ur5")
    q = fastcal.random_poses(robot, 12, seed=1)
    points = 1e3 * robot.forward(q)[:, :3, 3]
    savemat(tmp_path / "points.mat", {"p": np.repeat(points, 3, axis=0) + np.tile(20 * np.eye(3), (12, 1))})
    savemat(tmp_path / "joints.mat", {"q": np.degrees(q)})
    with pytest.raises(InvalidInput, match="holds 3 points for each of the 12 poses"):
        import_measurements([tmp_path / "points.mat"], joints=tmp_path / "joints.mat", robot=robot)
