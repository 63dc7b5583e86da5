# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A camera's place on its arm as the files that other programs load; the ending of a name says which.

| ending | read by |
|---|---|
| .calib | easy_handeye2 (YAML of parameters and transform) |
| .launch.py | ROS 2: a static transform, as MoveIt's calibration writes it |
| .urdf, .xacro | a link and a fixed joint for a robot description |
| camera_info.yaml | ROS' camera_info_manager (the lens alone) |
| _eye_on_hand.yaml, _eye_on_base.yaml | easy_handeye of ROS 1 |
| transform.yaml | Zivid (mm) |
| eMc.yaml | ViSP |
| camchain.yaml | Kalibr (the lens alone) |
| .yaml, .yml, .xml, .json | OpenCV's FileStorage |
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.io.hand_eye_others import easy_handeye, kalibr, visp, zivid
from fastcal.robot.hand_eye import HandEye
from fastcal.units import from_si

_PLANE = "plumb_bob", 5  # ROS' name of Brown's model, and its coefficients; with k4 to k6 it is rational_polynomial
_YAML = ("camera_info.yaml", "_eye_on_hand.yaml", "_eye_on_base.yaml", "transform.yaml", "emc.yaml", "camchain.yaml")
_ENDINGS = (".calib", ".launch.py", ".urdf", ".xacro", *_YAML, ".yaml", ".yml", ".xml", ".json")


def hand_eye_texts(found: Sequence[HandEye], path: Path) -> dict[Path, str]:
    """The text of each file: `path` of one camera, else one a camera with the camera's name before the ending.

    Raises:
        InvalidInput: The ending is none of those above, or the format cannot say what is to be written.
    """
    write = _writer(path)
    if len(found) == 1:
        return {path: write(found[0])}
    ending = next(end for end in _ENDINGS if path.name.lower().endswith(end))
    stem = path.name[: len(path.name) - len(ending)]
    return {path.with_name(f"{stem}_{each.camera}{ending}".lstrip("_")): write(each) for each in found}


def check_hand_eye_name(path: Path) -> None:
    """InvalidInput where no program's file ends as this name does."""
    _writer(path)


def _writer(path: Path) -> Callable[[HandEye], str]:
    name = path.name.lower()
    writers = (
        *(_easy_handeye2, _launch, _urdf, _urdf, _camera_info, easy_handeye, easy_handeye, zivid, visp, kalibr),
        *(_opencv_yaml, _opencv_yaml, _opencv_xml, _opencv_json),
    )
    for ending, write in zip(_ENDINGS, writers, strict=True):
        if name.endswith(ending):
            return write
    raise InvalidInput(
        f"{path}: expected a name that ends in .calib (easy_handeye2), _eye_on_hand.yaml (easy_handeye), .launch.py "
        "(MoveIt, ROS 2), .urdf, camera_info.yaml, camchain.yaml (Kalibr), transform.yaml (Zivid), eMc.yaml (ViSP), or "
        ".yaml, .xml, .json (OpenCV)"
    )


def _said(found: HandEye) -> list[str]:
    """What a person wants to know of it, in lines."""
    xyz, turn = from_si(found.std[:3], "mm"), from_si(found.std[3:], "deg")
    out = [f"Camera {found.camera} in {found.parent}: metres and quaternion; found by fastcal"]
    if np.isfinite(found.std).all():
        out.append(
            f"Standard deviations: {', '.join(f'{v:.2g}' for v in xyz)} mm, {', '.join(f'{v:.2g}' for v in turn)} deg"
        )
    if found.of_model:
        out.append("Found with the arm of model.yaml; for the arm as its file says: calibrate --effects none")
    return out


def _comment(found: HandEye) -> str:
    return "".join(f"# {line}\n" for line in _said(found))


def _numbers(found: HandEye) -> tuple[list[str], list[str]]:
    """X y z, and qx qy qz qw."""
    w, x, y, z = found.wxyz.tolist()
    return [_text(v) for v in found.T_parent_camera[:3, 3].tolist()], [_text(v) for v in (x, y, z, w)]


def _text(value: float) -> str:
    """With the digits that give it back, and a point, which some readers need."""
    text = repr(float(value) + 0.0)
    return text if "." in text or "n" in text else text.replace("e", ".0e") if "e" in text else f"{text}.0"


def _easy_handeye2(found: HandEye) -> str:
    xyz, xyzw = _numbers(found)
    lines = [
        "parameters:",
        f"  name: {json.dumps(found.camera)}",
        f"  calibration_type: {'eye_in_hand' if found.in_hand else 'eye_on_base'}",
        f"  robot_base_frame: {json.dumps(found.base)}",
        f"  robot_effector_frame: {json.dumps(found.parent if found.in_hand else found.effector)}",
        f"  tracking_base_frame: {json.dumps(found.camera)}",
        f"  tracking_marker_frame: {json.dumps(found.marker)}",
        "  freehand_robot_movement: true",
        "  move_group_namespace: /",
        "  move_group: manipulator",
        "transform:",
        "  translation:",
        *(f"    {axis}: {value}" for axis, value in zip("xyz", xyz, strict=True)),
        "  rotation:",
        *(f"    {axis}: {value}" for axis, value in zip("xyzw", xyzw, strict=True)),
    ]
    return _comment(found) + "\n".join(lines) + "\n"


def _launch(found: HandEye) -> str:
    xyz, xyzw = _numbers(found)
    given = {"frame-id": found.parent, "child-frame-id": found.camera}
    given |= dict(zip("xyz", xyz, strict=True)) | {f"q{axis}": v for axis, v in zip("xyzw", xyzw, strict=True)}
    arguments = "".join(f'                "--{name}",\n                {json.dumps(v)},\n' for name, v in given.items())
    said = "\n".join(_said(found))
    return (
        f'"""{said}\n"""\n\n'
        "from launch import LaunchDescription\nfrom launch_ros.actions import Node\n\n\n"
        "def generate_launch_description():\n    return LaunchDescription([\n        Node(\n"
        '            package="tf2_ros",\n            executable="static_transform_publisher",\n'
        f"            arguments=[\n{arguments}            ],\n        ),\n    ])\n"
    )


def _urdf(found: HandEye) -> str:
    """A description with the parent as its root, so that it is one by itself; the joint is what is to be taken."""
    rpy = " ".join(_text(v) for v in _core.rotation_to_rpy(found.T_parent_camera[:3, :3]).tolist())
    xyz = " ".join(_numbers(found)[0])
    parent, camera = quoteattr(found.parent), quoteattr(found.camera)
    said = "\n  ".join(_said(found))
    return (
        f'<?xml version="1.0"?>\n<!-- {said} -->\n<robot name={camera}>\n  <link name={parent}/>\n'
        f'  <link name={camera}/>\n  <joint name={quoteattr(found.camera + "_joint")} type="fixed">\n'
        f'    <parent link={parent}/>\n    <child link={camera}/>\n    <origin xyz="{xyz}" rpy="{rpy}"/>\n'
        "  </joint>\n</robot>\n"
    )


def _lens(found: HandEye) -> tuple[list[float], list[float], list[int], str]:
    """The camera matrix row by row, the coefficients, width and height, and the model.

    Raises:
        InvalidInput: Only poses were read.
    """
    if found.lens is None:
        raise InvalidInput(f"camera {found.camera} has no lens here: only poses were read")
    (fx, fy), (cx, cy) = found.lens["focal_px"], found.lens["centre_px"]
    matrix = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    return matrix, list(found.lens["distortion"]), list(found.lens["size_px"]), str(found.lens["model"])


def _camera_info(found: HandEye) -> str:
    matrix, distortion, (width, height), model = _lens(found)
    name, count = ("equidistant", 4) if model == "fisheye" else _PLANE
    if model != "fisheye" and len(distortion) > count:
        name, count = "rational_polynomial", 8
    distortion = [*distortion, *[0.0] * (count - len(distortion))]
    projection = [v for row in range(3) for v in (*matrix[3 * row : 3 * row + 3], 0.0)]

    def block(title: str, rows: int, values: Sequence[float]) -> str:
        listed = ", ".join(_text(v) for v in values)
        return f"{title}:\n  rows: {rows}\n  cols: {len(values) // rows}\n  data: [{listed}]\n"

    return (
        f"image_width: {width}\nimage_height: {height}\ncamera_name: {json.dumps(found.camera)}\n"
        + block("camera_matrix", 3, matrix)
        + f"distortion_model: {name}\n"
        + block("distortion_coefficients", 1, distortion)
        + block("rectification_matrix", 3, np.eye(3).ravel().tolist())
        + block("projection_matrix", 3, projection)
    )


def _matrices(found: HandEye) -> dict[str, FloatArray]:
    """What OpenCV's programs call by these names: gripper to base is the arm's, camera to gripper is this."""
    name = "T_gripper_camera" if found.in_hand else "T_base_camera"
    out = {name: found.T_parent_camera}
    if found.lens is not None:
        matrix, distortion, _, _ = _lens(found)
        out |= {"camera_matrix": np.array(matrix).reshape(3, 3), "distortion_coefficients": np.array([distortion])}
        if not distortion:
            out["distortion_coefficients"] = np.zeros((1, 4))
    return out


def _plain(found: HandEye) -> dict[str, str | int]:
    """Beside the matrices."""
    out: dict[str, str | int] = {"camera": found.camera, "parent_frame": found.parent}
    if found.lens is not None:
        _, _, (width, height), model = _lens(found)
        out |= {"image_width": width, "image_height": height, "camera_model": model}
    return out


def _opencv_yaml(found: HandEye) -> str:
    lines = ["%YAML:1.0", "---", *(f"{key}: {json.dumps(value)}" for key, value in _plain(found).items())]
    for name, matrix in _matrices(found).items():
        lines += [f"{name}: !!opencv-matrix", f"   rows: {len(matrix)}", f"   cols: {matrix.shape[1]}", "   dt: d"]
        lines.append(f"   data: [ {', '.join(_text(v) for v in matrix.ravel().tolist())} ]")
    head, *rest = lines
    return f"{head}\n" + _comment(found) + "\n".join(rest) + "\n"


def _opencv_xml(found: HandEye) -> str:
    lines = ['<?xml version="1.0"?>', "<opencv_storage>"]
    lines += [f"<{key}>{_element(value)}</{key}>" for key, value in _plain(found).items()]
    for name, matrix in _matrices(found).items():
        data = " ".join(_text(v) for v in matrix.ravel().tolist())
        size = f"<rows>{len(matrix)}</rows>\n  <cols>{matrix.shape[1]}</cols>"
        lines.append(f'<{name} type_id="opencv-matrix">\n  {size}\n  <dt>d</dt>\n  <data>\n    {data}</data></{name}>')
    return "\n".join([*lines, "</opencv_storage>"]) + "\n"


def _element(value: str | int) -> str:
    return str(value) if isinstance(value, int) else f'"{value}"'


def _opencv_json(found: HandEye) -> str:
    content: dict[str, object] = dict(_plain(found))
    for name, matrix in _matrices(found).items():
        size = {"rows": len(matrix), "cols": matrix.shape[1]}
        content[name] = {"type_id": "opencv-matrix", **size, "dt": "d", "data": matrix.ravel().tolist()}
    return json.dumps(content, indent=4) + "\n"
