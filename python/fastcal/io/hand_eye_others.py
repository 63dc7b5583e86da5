# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A camera's place, or its lens, in the files of easy_handeye (ROS 1), Zivid, ViSP and Kalibr: texts of `HandEye`."""

from __future__ import annotations

import json

import numpy as np

from fastcal import _core
from fastcal.errors import InvalidInput
from fastcal.robot.hand_eye import HandEye
from fastcal.units import from_si

_RADTAN = 4  # coefficients of Kalibr's Brown model


def easy_handeye(found: HandEye) -> str:
    """What easy_handeye keeps in ~/.ros/easy_handeye: parameters, and a transformation in metres."""
    kind = "hand" if found.in_hand else "base"
    w, x, y, z = found.wxyz.tolist()
    numbers = dict(zip(("x", "y", "z"), found.T_parent_camera[:3, 3].tolist(), strict=True))
    numbers |= {"qx": x, "qy": y, "qz": z, "qw": w}
    return "\n".join(
        [
            "parameters:",
            f"  eye_on_hand: {str(found.in_hand).lower()}",
            "  freehand_robot_movement: true",
            "  move_group: manipulator",
            "  move_group_namespace: /",
            f"  namespace: {json.dumps(f'/{found.camera}_eye_on_{kind}/')}",
            f"  robot_base_frame: {json.dumps(found.base)}",
            f"  robot_effector_frame: {json.dumps(found.parent if found.in_hand else found.effector)}",
            f"  tracking_base_frame: {json.dumps(found.camera)}",
            f"  tracking_marker_frame: {json.dumps(found.marker)}",
            "transformation:",
            *(f"  {name}: {value!r}" for name, value in numbers.items()),
            "",
        ]
    )


def zivid(found: HandEye) -> str:
    """A 4 x 4 matrix in millimetres, as Zivid's Matrix4x4 loads it."""
    T = found.T_parent_camera.copy()
    T[:3, 3] = from_si(T[:3, 3], "mm")
    rows = ",\n    ".join(f"[ {', '.join(repr(v) for v in row)} ]" for row in T.tolist())
    return f"__version__: 1\nFloatMatrix:\n  Data: [\n    {rows}]\n"


def visp(found: HandEye) -> str:
    """A vpPoseVector: a place in metres and a rotation vector."""
    numbers = [
        *found.T_parent_camera[:3, 3].tolist(),
        *np.asarray(_core.log_so3(found.T_parent_camera[:3, :3])).tolist(),
    ]
    return "rows: 6\ncols: 1\ndata:\n" + "".join(f"  - [{value!r}]\n" for value in numbers)


def kalibr(found: HandEye) -> str:
    """A camchain of one camera: its lens alone.

    Raises:
        InvalidInput: Only poses were read, or the lens has more coefficients than Kalibr's.
    """
    if found.lens is None:
        raise InvalidInput(f"camera {found.camera} has no lens here: only poses were read")
    fisheye = found.lens["model"] == "fisheye"
    given = [float(k) for k in found.lens["distortion"]]
    given += [0.0] * (_RADTAN - len(given))
    if any(given[_RADTAN:]):
        raise InvalidInput(
            f"camera {found.camera}: Kalibr's radtan has k1, k2, p1, p2, and this lens more; identify it with "
            "distortion: [0, 0, 0, 0]"
        )
    intrinsics = [float(v) for v in (*found.lens["focal_px"], *found.lens["centre_px"])]
    return "\n".join(
        [
            "cam0:",
            "  camera_model: pinhole",
            f"  distortion_coeffs: {given[:_RADTAN]!r}",
            f"  distortion_model: {'equidistant' if fisheye else 'radtan'}",
            f"  intrinsics: {intrinsics!r}",
            f"  resolution: {[int(side) for side in found.lens['size_px']]!r}",
            f"  rostopic: {json.dumps(f'/{found.camera}/image_raw')}",
            "",
        ]
    )
