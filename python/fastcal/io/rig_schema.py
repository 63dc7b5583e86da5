# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a robot or cell file says of cameras and boards, in canonical form: see docs/cells.md."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.errors import InvalidInput
from fastcal.io.fields import Fields
from fastcal.io.hand_eye_read import read_hand_eye
from fastcal.io.lens_file import read_lens, read_target
from fastcal.io.urdf_links import UrdfLinks
from fastcal.robot.robot_spec import frame_spec

Spec = dict[str, Any]

ARM = "arm"  # the only arm of a robot file
BOARDS = ("checkerboard", "charuco", "april_grid", "circles", "points")
LENSES = {"pinhole": 8, "fisheye": 4}  # most coefficients
_COEFFICIENTS = {"pinhole": 5, "fisheye": 4}  # of a lens that is to be found
_LEAST_SIZE = 16  # pixels a side, of a picture that is one
_MOST_ROWS = 10**9
_LATEST = 10.0  # [s] that a picture is later than its joints
_FEWEST = (4, 6)  # points of a board, in a plane and not, that say where it is
_ON_A_LINE, _FLAT = 1e-3, 1e-6  # of a board's largest extent: its second, its third one
_FOCAL = (0.05, 50.0)  # of the larger side: no lens for a robot is wider or longer


def check_rig(top: Fields, frame: Callable[[Fields, str], str]) -> Spec:
    """`cameras` and `boards` as a robot or cell keeps them; what is not given has no key.

    Args:
        top: The file's fields.
        frame: What `on` names, as it is kept; refuses what there is not, by the fields of the camera or board.

    Raises:
        ParseError: The sentence names the camera or board and the key.
    """
    spec: Spec = {}
    checks: tuple[tuple[str, Callable[[Fields], Spec]], ...] = (("cameras", _camera), ("boards", _board))
    owners: dict[str, str] = {}
    for key, check in checks:
        if not top.has(key):
            continue
        named = Fields(top.take(key) or {}, key, top.path).rest()
        found: Spec = {}
        for name, given in named.items():
            fields = Fields(given, f"{key}.{name}", top.path)
            if not re.fullmatch(r"[A-Za-z_][\w-]*", str(name)):
                fields.refuse("", "a name begins with a letter and has letters, digits, - and _ only")
            if name in owners:
                fields.refuse("", f"the name is given to two things, here and in {owners[name]}")
            owners[name] = key
            fields = _with_files(fields, str(name))
            found[name] = _placement(fields, frame) | check(fields)
            fields.done()
        spec[key] = found
    return spec


def _with_files(fields: Fields, name: str) -> Fields:
    """The entry with what the files hold that it names: `lens` and `place` of a camera, `target` of a board."""
    readers = (("lens", lambda path: read_lens(path, name)), ("target", read_target), ("place", _read_place))
    for key, read in readers:
        if fields.has(key):
            file = Path(fields.path).parent / fields.text(key)
            fields = Fields(read(file) | fields.rest(), fields.where, fields.path)
    return fields


def _read_place(path: Path) -> Spec:
    """Where a camera is, as another program found it."""
    return frame_spec(read_hand_eye(path))


def _placement(fields: Fields, frame: Callable[[Fields, str], str]) -> Spec:
    """What it stands on, where it is there, and how well that is known."""
    out: Spec = {
        "on": frame(fields, fields.text("on")),
        **fields.frame(),
    }
    fixed = fields.truth("fixed", False)
    if fixed:
        out["fixed"] = True
    out |= fields.sigmas()
    if fields.has("knocked"):
        out["knocked"] = check_knocked(fields.inner("knocked"))
    if (std := fields.optional("identified")) is not None:
        out["identified"] = Fields(std, f"{fields.where}.identified", fields.path).rest()
    return out


def check_knocked(fields: Fields) -> Spec:
    """Where it stood before a row of the data that it was found in, from where it stands since."""
    out: Spec = {"at_row": fields.count("at_row", 0, _MOST_ROWS)}
    for unit in ("mm", "deg"):
        out[f"before_{unit}"] = fields.vector(f"before_{unit}", 3)
    fields.done()
    return out


def check_arm_rig(top: Fields, joint_count: int, arm: str = ARM) -> Spec:
    """`check_rig` of the only arm; `arm` as `on` names it. Links of a URDF stay as they are named, ARM/LINK."""
    return check_rig(top, partial(_frame_of_arm, joint_count=joint_count, arm=arm))


def on_links(rig: Spec, links: UrdfLinks | None, top: Fields) -> Spec:
    """Cameras and boards that stand on links of a URDF, ARM/LINK, on the frames of the arm that carry these."""
    for key in ("cameras", "boards"):
        for name, entry in rig.get(key, {}).items():
            link = entry["on"].partition("/")[2]
            if not link:
                continue
            if links is None:
                top.refuse(f"{key}.{name}.on", f"the arm is of no URDF and has no link '{link:.60}'")
            try:
                on, place = links.placed(link, entry)
            except InvalidInput as error:
                top.refuse(f"{key}.{name}.on", str(error))
            rig[key][name] = entry | place | {"on": on}
    return rig


def _frame_of_arm(fields: Fields, on: str, *, joint_count: int, arm: str) -> str:
    """world, arm (its flange), arm.base, arm.linkN or arm/LINK of a URDF; kept with ARM as the arm's name."""
    if on == "world":
        return on
    if on.startswith(f"{arm}/"):
        return ARM + on.removeprefix(arm)
    name, _, part = on.partition(".")
    if name == arm and part in ("", "base", *(f"link{k}" for k in range(1, joint_count + 1))):
        return ARM + (f".{part}" if part else "")
    return fields.refuse("on", f"there is no frame '{on:.60}'; expected world, {arm}, {arm}.base or {arm}.link1 ...")


def _camera(fields: Fields) -> Spec:
    model = fields.choice("model", tuple(LENSES), "pinhole")
    size = [fields.checked_number(f"size_px[{i}]", x) for i, x in enumerate(_pair(fields, "size_px"))]
    if any(side != int(side) or side < _LEAST_SIZE for side in size):
        fields.fail("size_px", "width and height in whole pixels", str(size))
    is_open = not fields.has("focal_px")
    focal, centre = _lens_from_pictures(size) if is_open else _lens(fields, size)
    distortion = fields.take("distortion", [0.0] * _COEFFICIENTS[model] if is_open else [])
    if not isinstance(distortion, list) or len(distortion) > LENSES[model]:
        fields.fail("distortion", f"a list of at most {LENSES[model]} coefficients", distortion)
    return {
        **_timing_and_sag(fields),
        "model": model,
        "size_px": [int(side) for side in size],
        "focal_px": focal,
        "centre_px": centre,
        "distortion": fields.checked_vector("distortion", distortion, len(distortion)),
        "intrinsics": _intrinsics(fields, is_open=is_open),
    }


def _intrinsics(fields: Fields, *, is_open: bool) -> str:
    given = fields.choice("intrinsics", ("known", "identify"), "identify" if is_open else "known")
    if is_open and given == "known":
        fields.refuse("focal_px", "expected focal lengths where intrinsics are known; leave out both to find the lens")
    return given


def _lens_from_pictures(size: Sequence[float]) -> tuple[list[float], list[float]]:
    """Focal lengths and centre of a lens that is to be found: what many have."""
    return [max(size)] * 2, [(side - 1) / 2 for side in size]


def _lens(fields: Fields, size: Sequence[float]) -> tuple[list[float], list[float]]:
    focal = [fields.checked_number(f"focal_px[{i}]", x) for i, x in enumerate(_pair(fields, "focal_px"))]
    least, most = (share * max(size) for share in _FOCAL)
    if any(not least <= f <= most for f in focal):
        fields.fail(
            "focal_px", f"focal lengths in pixels, {least:.0f} to {most:.0f} for a picture of this size", str(focal)
        )
    centre = [fields.checked_number(f"centre_px[{i}]", x) for i, x in enumerate(_pair(fields, "centre_px"))]
    if any(not 0 <= c <= side for c, side in zip(centre, size, strict=True)):
        fields.fail("centre_px", f"a pixel of a picture of {size[0]:.0f} x {size[1]:.0f}", str(centre))
    return focal, centre


def _timing_and_sag(fields: Fields) -> Spec:
    """How late its pictures are, and how its mount gives under its own weight, of each unit of gravity's direction."""
    out: Spec = {}
    for name in ("time_offset", "readout"):
        if (seconds := fields.optional(f"{name}_s")) is not None:
            out[f"{name}_s"] = fields.checked_number(f"{name}_s", seconds)
            if not abs(out[f"{name}_s"]) <= _LATEST:
                fields.fail(f"{name}_s", f"at most {_LATEST:g} seconds", seconds)
    for unit in ("mm", "deg"):
        if (rows := fields.optional(f"sag_{unit}")) is not None:
            if not isinstance(rows, list) or len(rows) != 3:
                fields.fail(f"sag_{unit}", "three lists of three numbers", rows)
            out[f"sag_{unit}"] = [fields.checked_vector(f"sag_{unit}[{i}]", row, 3) for i, row in enumerate(rows)]
    return out


def _pair(fields: Fields, key: str) -> list[Any]:
    value = fields.take(key)
    if not isinstance(value, list) or len(value) != 2:
        fields.fail(key, "a list of 2 numbers", value)
    return list(value)


def _board(fields: Fields) -> Spec:
    kind = fields.choice("kind", BOARDS)
    if kind == "points":
        return {"kind": kind, "points_mm": _points(fields)}
    least = 3 if kind in ("checkerboard", "charuco") else 1  # squares, between which corners lie
    out: Spec = {
        "kind": kind,
        "columns": fields.count("columns", least, 1000),
        "rows": fields.count("rows", least, 1000),
    }
    if kind == "circles" and min(out["columns"], out["rows"]) < 2:
        fields.refuse("", "circles on one line do not show how the board is turned; expected two rows and columns")
    if kind == "circles" and fields.truth("asymmetric", default=False):
        out["asymmetric"] = True
    lengths = {"april_grid": ("tag", "gap"), "charuco": ("square",)}.get(kind, ("square",))
    for length in lengths:
        out[f"{length}_mm"] = fields.quantity(length, "mm")
        if not out[f"{length}_mm"] > 0:
            fields.fail(f"{length}_mm", "a length above 0", out[f"{length}_mm"])
    if fields.has_quantity("bend", "mm"):
        out["bend_mm"] = fields.quantities("bend", "mm", 3)
    if kind in ("charuco", "april_grid"):
        out["dictionary"] = fields.text("dictionary", "5X5_250" if kind == "charuco" else "36h11")
    if kind == "charuco":
        out["marker_mm"] = fields.quantity("marker", "mm", 0.75 * out["square_mm"])
    return out


def _points(fields: Fields) -> list[Any]:
    points = fields.take("points_mm")
    if not isinstance(points, list) or len(points) < _FEWEST[0]:
        fields.fail("points_mm", "a list of four points at least", points)
    places = [fields.checked_vector(f"points_mm[{i}]", p, 3) for i, p in enumerate(points)]
    if problem := _unseen_pose(np.array(places)):
        fields.refuse("points_mm", problem)
    return places


def _unseen_pose(points: NDArray[np.float64]) -> str:
    """Why one picture of points (K, 3) does not say where they are, in words; "" where it does."""
    if _width(points) < _ON_A_LINE:
        return "points on one line do not show how the board is turned; expected four of which no three are on a line"
    about = points - points.mean(axis=0)
    extents = np.linalg.svd(about, compute_uv=False)
    if extents[2] >= _FLAT * extents[0]:
        if len(points) < _FEWEST[1]:
            return f"points that are not in one plane must be six at least, got {len(points)}"
    elif any(_width(np.delete(points, k, axis=0)) < _ON_A_LINE for k in range(len(points))):
        return "all points but one are on a line; expected four of which no three are on a line"
    return ""


def _width(points: NDArray[np.float64]) -> float:
    """The second extent of points (K, 3) over the first: 0 where they are on a line."""
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(extents[1] / extents[0]) if extents[0] > 0 else 0.0


def check_unknowns(fields: Fields, known: Sequence[str]) -> Spec:
    """What a calibrated model keeps of its cameras and boards: names, and their rows of the root behind `known`."""
    names, rows = fields.names("parameters"), fields.take("covariance_root")
    if not isinstance(rows, list) or len(rows) != len(names):
        fields.fail("covariance_root", f"a list of {len(names)} rows", rows)
    checked = [fields.checked_vector(f"covariance_root[{i}]", row, len(known) + i + 1) for i, row in enumerate(rows)]
    fields.done()
    return {"parameters": list(names), "covariance_root": checked}


def check_cell_names(top: Fields) -> Spec:
    """`cell` of a robot file: what the cell and its arm were called; columns may carry the arm's name."""
    if not top.has("cell"):
        return {}
    fields = top.inner("cell")
    names = {"name": fields.text("name"), "arm": fields.text("arm", ARM)}
    fields.done()
    return {"cell": names}
