# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Mistakes with pictures, made on purpose: each changes the files of a scene, and what must be said of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from . import camera_scene as scene
from .camera_scene import FloatArray

PICTURES = 16
ERROR_MM = 0.5  # of the arm's second link
DOWN, ACROSS = scene.ROWS - 1, scene.COLUMNS - 1  # corners

Change = Callable[[Path, FloatArray], None]


@dataclass(frozen=True)
class Mistake:
    """What is changed, what the sentence must hold, and whether the command refuses."""

    change: Change
    says: str
    refused: bool = True


def of_corners(change: Callable[[FloatArray], FloatArray]) -> Change:
    """Of the pictures (N, K, 2)."""
    return lambda folder, uv: scene.write_corners(folder, change(uv.copy()))


def of_joints(change: Callable[[FloatArray], FloatArray], unit: str = "deg") -> Change:
    """Of the joint positions (N, 6) [deg]."""

    def made(folder: Path, uv: FloatArray) -> None:
        write_table(folder, [f"arm.q{k}_{unit}" for k in range(1, 7)], change(joints(folder)))

    return made


def of_cell(change: Callable[[dict[str, Any]], object]) -> Change:
    """Of the content of cell.yaml."""

    def made(folder: Path, uv: FloatArray) -> None:
        content = yaml.safe_load((folder / "cell.yaml").read_text())
        change(content)
        (folder / "cell.yaml").write_text(yaml.safe_dump(content))

    return made


def of_board(**keys: Any) -> Change:
    return of_cell(lambda content: content["boards"]["plate"].update(keys))


def of_camera(**keys: Any) -> Change:
    return of_cell(lambda content: content["cameras"]["wrist"].update(keys))


def of_poses(
    change: Callable[[FloatArray], FloatArray] = lambda T: T,
    order: tuple[int, ...] = (3, 0, 1, 2),
    size: float = 1.0,
    error_mm: float = ERROR_MM,
) -> Change:
    """The arm is known by poses of its flange (N, 4, 4) [mm]; `order` of x y z w stands where w x y z should."""

    def made(folder: Path, uv: FloatArray) -> None:
        write_poses(folder, change(np.array([scene.flange(q, error_mm) for q in joints(folder)])), order, size)

    return made


def write_poses(folder: Path, T: FloatArray, order: tuple[int, ...] = (3, 0, 1, 2), size: float = 1.0) -> None:
    """An arm that is known by poses (N, 4, 4) of its flange [mm]; arguments as of `of_poses`."""
    quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, list(order)]
    titles = [f"arm.{name}" for name in ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")]
    write_table(folder, titles, np.hstack([T[:, :3, 3] * size, quaternions]))
    of_cell(lambda content: content["arms"].update(arm={"robot": "pose"}))(folder, np.zeros(0))


def joints(folder: Path) -> FloatArray:
    """(N, 6) [deg]."""
    return np.loadtxt(folder / "poses.csv", delimiter=",", skiprows=1)


def write_table(folder: Path, titles: list[str], rows: FloatArray) -> None:
    lines = [",".join(f"{value:.9f}" for value in row) for row in rows]
    (folder / "poses.csv").write_text("\n".join([",".join(titles), *lines]) + "\n")


def exchanged(uv: FloatArray, *pairs: tuple[int, int]) -> FloatArray:
    for i, j in pairs:
        uv[[i, j]] = uv[[j, i]]
    return uv


def slipped(uv: FloatArray, first: int) -> FloatArray:
    """From this row on the pictures stand one row late."""
    out = uv.copy()
    out[first + 1 :], out[first] = uv[first:-1], np.nan
    return out


def changed(uv: FloatArray, rows: Any, change: Callable[[FloatArray], FloatArray]) -> FloatArray:
    uv[rows] = change(uv[rows])
    return uv


def from_other_end(uv: FloatArray) -> FloatArray:
    return uv[:, ::-1]


def mirrored(uv: FloatArray) -> FloatArray:
    return uv.reshape(-1, DOWN, ACROSS, 2)[:, :, ::-1].reshape(uv.shape)


def by_columns(uv: FloatArray) -> FloatArray:
    return uv.reshape(-1, DOWN, ACROSS, 2).transpose(0, 2, 1, 3).reshape(uv.shape)


def image_mirrored(uv: FloatArray) -> FloatArray:
    uv[..., 0] = scene.SIZE[0] - 1 - uv[..., 0]
    return uv


def blurred(uv: FloatArray) -> FloatArray:
    uv[:3] += 8 * np.random.default_rng(1).standard_normal(uv[:3].shape)
    return uv


def upside_down(uv: FloatArray) -> FloatArray:
    """Three pictures as a camera saves them that believes that it stands on its head."""
    return changed(uv, [2, 6, 9], lambda of: np.array(scene.SIZE) - 1 - of)


def a_little_blurred(uv: FloatArray) -> FloatArray:
    """By less than the nominal arm is off, which hid it."""
    uv[:3] += 1.5 * np.random.default_rng(1).standard_normal(uv[:3].shape)
    return uv


def while_moving(uv: FloatArray) -> FloatArray:
    uv[4] += [25, 8]
    return uv


def camera_moved(folder: Path, uv: FloatArray) -> None:
    """From half of the rows on the camera stands elsewhere by 1.8 mm and 0.4 degrees."""
    random, true = np.random.default_rng(5), scene.WRIST.copy()
    q, out = joints(folder), uv.copy()
    try:
        scene.WRIST = true @ scene.pose((1.5, -0.8, 0.6), (0.3, -0.2, 0.1))
        for i in range(len(q) // 2, len(q)):
            seen = scene.seen(q[i], ERROR_MM)
            assert seen is not None
            out[i] = seen + 0.1 * random.standard_normal(seen.shape)
    finally:
        scene.WRIST = true
    scene.write_corners(folder, out)


def turning(*reach_deg: float) -> Change:
    """All postures are within these of one."""

    def made(folder: Path, uv: FloatArray) -> None:
        random = np.random.default_rng(int(1e3 * uv[0, 0, 0]))
        home = next(q for q in scene.postures(40, 3) * [1, 1, 1, 0, 1, 1] if in_picture(q))
        out: list[FloatArray] = []
        while len(out) < len(uv):
            q = home + random.uniform(-1, 1, len(home)) * reach_deg
            if in_picture(q):
                out.append(q)
        write_table(folder, [f"arm.q{k}_deg" for k in range(1, 7)], np.array(out))
        seen = np.array([scene.seen(q, ERROR_MM) for q in out])
        scene.write_corners(folder, seen + 0.1 * random.standard_normal(seen.shape))

    return made


def in_picture(q: FloatArray) -> bool:
    uv = scene.seen(q)
    return uv is not None and bool((uv > 0).all() and (uv < scene.SIZE).all())


def two_cameras(folder: Path, rows: Any, second_focal: tuple[float, float] = scene.FOCAL) -> None:
    """`left` and `right`, 60 mm apart, whose pictures are exchanged in these rows."""
    random, true, focal = np.random.default_rng(7), scene.WRIST, scene.FOCAL
    both = []
    try:
        for shift, scene.FOCAL in ((0.0, focal), (60.0, second_focal)):
            scene.WRIST = true @ scene.pose((shift, 0.0, 0.0), (0.0, 0.0, 0.0))
            seen = np.array([scene.seen(q, ERROR_MM) for q in joints(folder)])
            both.append(seen + 0.1 * random.standard_normal(seen.shape))
    finally:
        scene.WRIST, scene.FOCAL = true, focal
    left, right = both
    left[rows], right[rows] = right[rows].copy(), left[rows].copy()
    lines = ["row,camera,board,corner,u_px,v_px"]
    for name, uv in (("left", left), ("right", right)):
        for i, picture in enumerate(uv):
            lines += [
                f"{i},{name},plate,{k},{u:.5f},{v:.5f}"
                for k, (u, v) in enumerate(picture)
                if -50 < u < scene.SIZE[0] and -50 < v < scene.SIZE[1]
            ]
    (folder / "corners.csv").write_text("\n".join(lines) + "\n")
    content = yaml.safe_load((folder / "cell.yaml").read_text())
    wrist = content["cameras"].pop("wrist")
    second = {**wrist, "xyz_mm": [60, -70, 50], "focal_px": list(second_focal)}
    content["cameras"] = {"left": wrist, "right": second}
    (folder / "cell.yaml").write_text(yaml.safe_dump(content))


def lens(focal: float = 1.0, centre: float = 1.0) -> Change:
    """The lens of pictures so many times as large."""
    return of_camera(focal_px=[focal * f for f in scene.FOCAL], centre_px=[centre * c for c in scene.CENTRE])


def flat_and(change: Change) -> Change:
    """The board nearly faces the camera in all pictures, which shows size and focal length alike; then the mistake."""

    def made(folder: Path, uv: FloatArray) -> None:
        turning(25, 2, 2, 2, 2, 60)(folder, uv)
        change(folder, uv)

    return made


def along_its_axis(change: Change) -> Change:
    """The camera goes along its own axis and turns about it, the arm known by its poses; then the mistake.

    A board that it faces is as wide for a lens of s times the focal length and the board's size over s.
    """

    def made(folder: Path, uv: FloatArray) -> None:
        random = np.random.default_rng(int(1e3 * uv[0, 0, 0]))
        facing = scene.pose((-75.0, -37.5, 380.0), (0.0, 0.0, 0.0))
        poses, out = [], []
        while len(out) < len(uv):
            tilt_x, tilt_y = random.uniform(-0.2, 0.2, 2)
            motion = scene.pose((0.0, 0.0, random.uniform(-120, 120)), (tilt_x, tilt_y, random.uniform(-90, 90)))
            points = scene.corners() @ (T := np.linalg.inv(motion) @ facing)[:3, :3].T + T[:3, 3]
            poses.append(motion @ np.linalg.inv(scene.WRIST))
            out.append(scene.drawn(points) + 0.1 * random.standard_normal((len(points), 2)))
        write_poses(folder, np.array(poses))
        scene.write_corners(folder, np.array(out))
        change(folder, np.array(out))

    return made


def half(uv: FloatArray) -> Any:
    return np.arange(len(uv)) % 2 == 1


MISTAKES: dict[str, Mistake] = {
    "two pictures exchanged": Mistake(
        of_corners(lambda uv: exchanged(uv, (5, 9))), "the pictures of rows 5 and 9 are exchanged", False
    ),
    "two pairs exchanged": Mistake(
        of_corners(lambda uv: exchanged(uv, (5, 9), (2, 12))), "rows 2 and 12 and 5 and 9 are exchanged", False
    ),
    "slipped from row 4 on": Mistake(of_corners(lambda uv: slipped(uv, 4)), "slipped to the next row"),
    "slipped from row 12 on": Mistake(of_corners(lambda uv: slipped(uv, 12)), "slipped to the next row", False),
    "all slipped": Mistake(of_corners(lambda uv: slipped(uv, 0)), "slipped to the next row"),
    "all in the reverse order": Mistake(of_corners(lambda uv: uv[::-1]), "0 and 15 and 1 and 14"),
    "shuffled": Mistake(
        of_corners(lambda uv: np.random.default_rng(2).permutation(uv)), "the pictures do not fit this robot"
    ),
    "some from the other end": Mistake(
        of_corners(lambda uv: changed(uv, [1, 4, 7], from_other_end)),
        "rows 1, 4, 7 it was read from its other end",
        False,
    ),
    "half from the other end": Mistake(
        of_corners(lambda uv: changed(uv, half(uv), from_other_end)), "it was read from its other end", False
    ),
    "some mirrored": Mistake(
        of_corners(lambda uv: changed(uv, [1, 4, 7], mirrored)), "rows 1, 4, 7 its corners are in mirrored", False
    ),
    "all mirrored": Mistake(of_corners(mirrored), "counted from right to left", False),
    "corners down the columns": Mistake(of_corners(by_columns), "corners counted down the columns"),
    "v before u": Mistake(of_corners(lambda uv: uv[:, :, ::-1]), "u_px and v_px are exchanged"),
    "a mirrored image": Mistake(of_corners(image_mirrored), "its pictures are mirrored"),
    "squares in cm": Mistake(of_board(square_mm=2.5), "are its lengths in cm"),
    "squares in m": Mistake(of_board(square_mm=0.025), "are its lengths in m?"),
    "squares in inches": Mistake(of_board(square_mm=25 / 25.4), "are its lengths in inches"),
    "squares ten times too large": Mistake(of_board(square_mm=250.0), "in another unit?"),
    "squares of another board": Mistake(of_board(square_mm=20.0), "1.25 times as large as its file says: measure"),
    "columns and rows exchanged": Mistake(
        of_board(columns=scene.ROWS, rows=scene.COLUMNS), "are columns and rows exchanged"
    ),
    "a column too many": Mistake(
        of_board(columns=scene.COLUMNS + 1), "7 squares in a row, and the file has columns: 8"
    ),
    "corners counted as squares": Mistake(
        of_board(columns=scene.COLUMNS - 1, rows=scene.ROWS - 1), "columns and rows count squares"
    ),
    "lens of half the size": Mistake(lens(0.5, 0.5), "found with pictures 0.5 times as large"),
    "lens of twice the size": Mistake(lens(2.0, 2.0), "(focal_px, centre_px) found with pictures 2 times as large"),
    "focal length of half the size": Mistake(lens(0.5), "focal_px found with pictures 0.5 times as large"),
    "focal length of twice the size": Mistake(lens(2.0), "focal_px found with pictures 2 times as large"),
    "centre of half the size": Mistake(lens(1.0, 0.5), "centre_px found with pictures 0.5 times as large"),
    "another focal length": Mistake(lens(1.4), "a focal length about 0.7"),
    "distortion of the other sign": Mistake(
        of_camera(distortion=[-k for k in scene.LENS]), "contradict the lens stated for camera wrist", False
    ),
    "a pair of which one was mended by hand": Mistake(
        of_corners(lambda uv: np.insert(np.delete(uv, 7, 0), 7, uv[3], 0)),
        "the picture of row 7 fits the posture of row 3, which has one of its own; it is left out",
        False,
    ),
    "all pictures upside down": Mistake(
        of_corners(lambda uv: np.array(scene.SIZE) - 1 - uv), "half turned about its optical axis", False
    ),
    "the camera was moved": Mistake(camera_moved, "from row 8 on camera wrist or board plate stands elsewhere", False),
    "turns about one axis": Mistake(turning(0, 0, 0, 0, 0, 40), "z, rz undetermined", False),
    "another size seen flat": Mistake(
        flat_and(of_board(square_mm=17.5)), "times as large as its file says: measure its squares"
    ),
    "a print that was fitted to the page": Mistake(
        of_board(square_mm=25.75), "board plate: seen with this arm the board is 0.97", False
    ),
    "another focal length seen flat": Mistake(flat_and(lens(1.4)), "fit a focal length about 0.71 times that"),
    "size or lens": Mistake(along_its_axis(of_board(square_mm=17.5)), "these pictures fit each: measure the squares"),
    "no two postures": Mistake(
        of_corners(lambda uv: changed(uv, slice(1, None), np.full_like(uv[1:], np.nan).__add__)), "no joint moved"
    ),
    "blurred pictures": Mistake(of_corners(blurred), "corners of rows 0, 1, 2 do not agree with one another", False),
    "a little blurred": Mistake(
        of_corners(a_little_blurred), "corners of rows 0, 1, 2 do not agree with one another", False
    ),
    "some upside down": Mistake(
        of_corners(upside_down), "the pictures of rows 2, 6, 9 fit no posture of the table", False
    ),
    "taken while moving": Mistake(
        of_corners(while_moving), "row 4 agree with one another and not with their posture", False
    ),
    "degrees as radians": Mistake(of_joints(lambda q: q, "rad"), "is its unit right?"),
    "radians as degrees": Mistake(of_joints(np.radians), "are the joint positions in radians, read as degrees?"),
    "a joint counts the other way": Mistake(
        of_joints(lambda q: q * [1, 1, -1, 1, 1, 1]), "does joint3 count the other way round?"
    ),
    "a zero elsewhere": Mistake(
        of_joints(lambda q: q + np.array([0, 90, 0, 0, 0, 0])), "is the zero of joint2 90 degrees away"
    ),
    "two joints exchanged": Mistake(
        of_joints(lambda q: q[:, [0, 1, 2, 4, 3, 5]]), "are the columns of joint4 and joint5 exchanged?"
    ),
    "camera on another link": Mistake(of_camera(on="arm.link5"), "is camera wrist on arm and board plate on world"),
    "camera in the room": Mistake(
        of_cell(lambda c: (c["cameras"]["wrist"].update(on="world"), c["boards"]["plate"].update(on="arm"))),
        "is camera wrist on arm and board plate on world",
    ),
    "inverse poses": Mistake(of_poses(np.linalg.inv), "are the poses of the arm inverse?"),
    "x y z w as w x y z": Mistake(of_poses(order=(0, 1, 2, 3)), "are the quaternions of the poses of the arm x y z w"),
    "w x y z as x y z w": Mistake(of_poses(order=(2, 3, 0, 1)), "are the quaternions of the poses of the arm w x y z"),
    "poses in m": Mistake(of_poses(size=1e-3), "are its lengths, or those of the arm, in another unit?"),
    "poses in inches": Mistake(of_poses(size=1 / 25.4), "are its lengths, or those of the arm, in another unit?"),
    "cameras exchanged in some rows": Mistake(
        lambda folder, uv: two_cameras(folder, [2, 5, 11]),
        "have each other's pictures of board plate in rows 2, 5, 11",
        False,
    ),
    "cameras exchanged": Mistake(
        lambda folder, uv: two_cameras(folder, slice(None)), "each was found where the file has the other", False
    ),
    "cameras of two lenses exchanged": Mistake(
        lambda folder, uv: two_cameras(folder, slice(None), (900.0, 901.0)), "the cameras' names exchanged?"
    ),
}
