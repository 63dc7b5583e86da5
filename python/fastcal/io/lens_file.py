# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lenses and targets out of the files of other programs: ROS' camera_info, OpenCV's FileStorage, Kalibr and others.

`lens: FILE` of a camera and `target: FILE` of a board in a cell file take the place of the keys that they hold.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.errors import ParseError
from fastcal.io.lens_others import of_archive, of_matlab, other_storage
from fastcal.io.yaml_file import parsed_yaml, read_text
from fastcal.units import from_si

Spec = dict[str, Any]

_MATRIX = ("camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "intrinsic_matrix", "mtx", "K", "M1", "M")
_DISTORTION = (
    *("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs", "distortion", "D"),
    *("dist_coeff", "dist_coefs", "distortion_coeffs", "dist", "D1"),
)
_WIDTH, _HEIGHT = ("image_width", "image_Width", "width"), ("image_height", "image_Height", "height")
_SIZE = ("image_size", "imageSize", "img_size", "resolution")  # width and height
_SKEW = 1e-3  # of the focal length: axes of pixels that lean by more are no noise of a calibration
_MODELS = {"plumb_bob": "pinhole", "rational_polynomial": "pinhole", "radtan": "pinhole", "equidistant": "fisheye"}
_MODELS |= {"fisheye": "fisheye", "pinhole": "pinhole", "none": "pinhole", "": "pinhole"}


def read_lens(path: Path, camera: str) -> Spec:
    """The keys of a camera that a file holds: focal_px, centre_px, distortion, model and, mostly, size_px.

    Args:
        path: YAML of ROS or Kalibr, OpenCV's FileStorage, or one of `lens_others`.
        camera: Its name in the cell, by which one of several is taken.

    Raises:
        ParseError: It is none of these, or has a model of lens that is not known here.
    """
    content = storage(path)
    if "RadialDistortion" in content:
        content = of_matlab(content, path)
    chain = {name: entry for name, entry in content.items() if isinstance(entry, Mapping) and "intrinsics" in entry}
    if chain:
        name = camera if camera in chain else next(iter(chain))
        if name != camera and len(chain) > 1:
            raise ParseError(f"holds cameras {', '.join(chain)}; name the camera of the cell as one of them", path)
        return _of_kalibr(chain[name], path)
    matrix = _numbers(content, _MATRIX, path)
    if matrix is None or matrix.size != 9:
        raise ParseError(
            f"holds no camera matrix of 3 x 3; expected one of {', '.join(_MATRIX)}, or Kalibr's cam0", path
        )
    K = matrix.reshape(3, 3)
    if abs(K[0, 1]) > _SKEW * abs(K[0, 0]):
        raise ParseError(f"has a skew of {K[0, 1]:.4g} px; expected rows and columns of pixels at right angles", path)
    distortion = _numbers(content, _DISTORTION, path)
    out: Spec = {
        "focal_px": [float(K[0, 0]), float(K[1, 1])],
        "centre_px": [float(K[0, 2]), float(K[1, 2])],
        "distortion": [] if distortion is None else _trimmed(distortion.ravel().tolist()),
        "model": _model(content.get("distortion_model", content.get("camera_model", "")), path),
    }
    size = [next((content[key] for key in keys if key in content), None) for keys in (_WIDTH, _HEIGHT)]
    both = _numbers(content, _SIZE, path)
    if None not in size:
        out["size_px"] = size
    elif both is not None and both.size == 2:
        out["size_px"] = both.ravel().tolist()
    return out


def read_target(path: Path) -> Spec:
    """The keys of a board that a Kalibr target file holds; a checkerboard there counts inner corners.

    Raises:
        ParseError: It is none, or of a kind that is not known here.
    """
    content = storage(path)
    kind = content.get("target_type")
    mm = float(from_si(1.0, "mm"))
    try:
        if kind == "aprilgrid":
            tag = float(content["tagSize"]) * mm
            size = {"columns": content["tagCols"], "rows": content["tagRows"]}
            return {"kind": "april_grid", **size, "tag_mm": tag, "gap_mm": tag * float(content["tagSpacing"])}
        if kind in ("checkerboard", "circlegrid"):
            more, spacing = (1, "rowSpacingMeters") if kind == "checkerboard" else (0, "spacingMeters")
            more_of = {"asymmetric": True} if content.get("asymmetricGrid") else {}
            size = {"columns": content["targetCols"] + more, "rows": content["targetRows"] + more}
            name = "checkerboard" if more else "circles"
            return {"kind": name, **size, **more_of, "square_mm": float(content[spacing]) * mm}
    except (KeyError, TypeError, ValueError) as error:
        raise ParseError(f"is a target of kind {kind}, and its key {error} is missing or no number", path) from None
    raise ParseError(f"expected target_type aprilgrid, checkerboard or circlegrid, got '{kind!s:.60}'", path)


def storage(path: Path) -> Spec:
    """A mapping out of YAML, in which what OpenCV writes differs by its first line and by tags, or of `lens_others`."""
    if path.suffix.lower() == ".npz":
        return of_archive(path)
    text = read_text(path)
    if (other := other_storage(path, text)) is not None:
        return other
    if text.startswith("%YAML:"):
        text = re.sub(r"\A%YAML:[^\n]*\n", "", text)
    content = parsed_yaml(re.sub(r"!!opencv-(matrix|nd-matrix)", "", text), path)
    if not isinstance(content, dict):
        raise ParseError("expected a YAML mapping of a camera or a target", path)
    return content


def _numbers(content: Mapping[str, Any], names: tuple[str, ...], path: Path) -> np.ndarray[Any, Any] | None:
    """The numbers of the first of some keys, as a list, nested lists or rows, cols and data."""
    value = next((content[name] for name in names if name in content), None)
    if value is None:
        return None
    try:
        return np.asarray(value["data"] if isinstance(value, Mapping) else value, dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        raise ParseError("expected matrices as lists of numbers, or with rows, cols and data", path) from None


def _of_kalibr(entry: Mapping[str, Any], path: Path) -> Spec:
    if entry.get("camera_model") != "pinhole":
        raise ParseError(f"expected Kalibr's camera_model pinhole, got '{entry.get('camera_model')!s:.60}'", path)
    fx, fy, cx, cy = (float(v) for v in entry["intrinsics"])
    out: Spec = {"focal_px": [fx, fy], "centre_px": [cx, cy], "distortion": list(entry.get("distortion_coeffs", []))}
    out["model"] = _model(entry.get("distortion_model", ""), path)
    return out | ({"size_px": list(entry["resolution"])} if "resolution" in entry else {})


def _model(name: Any, path: Path) -> str:
    if str(name).lower() not in _MODELS:
        known = ", ".join(key for key in _MODELS if key)
        raise ParseError(f"has a lens of model '{name!s:.60}'; known are {known}", path)
    return _MODELS[str(name).lower()]


def _trimmed(values: list[float]) -> list[float]:
    """Without the zeros behind OpenCV's eight coefficients, of a thin prism and a tilted sensor.

    Others than zeros are kept, so that they are refused and not forgotten.
    """
    while len(values) > 8 and values[-1] == 0:
        values = values[:-1]
    return values
