# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lens files that are no YAML, as the mappings that OpenCV or Kalibr would have written in their place.

| file | written by | a pixel's centre |
|---|---|---|
| <opencv_storage> | OpenCV's FileStorage, as its calibration sample writes it | (0, 0) |
| <root> <camera> | ViSP's vpXmlParserCamera | (0, 0) |
| CAMERA_ID MODEL WIDTH HEIGHT ... | COLMAP's cameras.txt | (0.5, 0.5) |
| .npz | numpy.savez(mtx=, dist=) | (0, 0) |
| FocalLength, PrincipalPoint | MATLAB's cameraParameters or cameraIntrinsics by jsonencode | (1, 1) |
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from fastcal.errors import ParseError
from fastcal.io.regular_file import read_bytes
from fastcal.io.xml_text import declared_as_utf8, read_xml

Spec = dict[str, Any]

_MOST_BYTES = 64_000_000  # of an archive of arrays, among which may be those of every picture
_COLMAP = re.compile(r"\A(?:\s*#[^\n]*\n)*\s*\d+[ \t]+[A-Z_]{6,}[ \t]+\d+[ \t]+\d+[ \t]+\S")
_COLMAP_CENTRE = 0.5  # [px] of the first pixel
_MATLAB_CENTRE = 1.0
# Of COLMAP's models: their numbers in the order of the file, k1, k2, p1, p2 ... as OpenCV has them; the others are 0.
_COLMAP_MODELS = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
}
_BROWN, _FISHEYE = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), ("k1", "k2", "k3", "k4")


def other_storage(path: Path, text: str) -> Spec | None:
    """What a text holds that is XML or a list of cameras; None: it is neither.

    Raises:
        ParseError: It is, and cannot be read.
    """
    if text.lstrip("\ufeff \t\r\n").startswith("<"):
        return _of_xml(path)
    return _of_colmap(text, path) if _COLMAP.match(text) else None


def of_archive(path: Path) -> Spec:
    """The arrays of numpy's archive by their names, as lists.

    Raises:
        ParseError: It is none, or holds objects.
    """
    try:
        with np.load(io.BytesIO(read_bytes(path, _MOST_BYTES)), allow_pickle=False) as archive:
            return {name: archive[name].tolist() for name in archive.files if archive[name].dtype.kind in "fiuU"}
    except (ValueError, OSError, zipfile.BadZipFile, AttributeError):
        raise ParseError("is no archive of arrays of numbers, as numpy.savez writes it", path) from None


def of_matlab(content: Mapping[str, Any], path: Path) -> Spec:
    """MATLAB's lens, whose first pixel is (1, 1) and whose older matrix is the transposed one.

    Raises:
        ParseError: A number is missing or none.
    """
    try:
        name = next((key for key in ("K", "IntrinsicMatrix") if key in content), None)
        if "FocalLength" in content:
            (fx, fy), (cx, cy) = content["FocalLength"], content["PrincipalPoint"]
        else:
            K = np.asarray(content[name or "K"], dtype=np.float64).reshape(3, 3)
            K = K if K[2, 0] == K[2, 1] == 0 else K.T
            (fx, fy), (cx, cy) = (K[0, 0], K[1, 1]), K[:2, 2]
        k1, k2, *more = [*map(float, np.ravel(content["RadialDistortion"]))]
        p1, p2 = map(float, content.get("TangentialDistortion", (0.0, 0.0)))
        out = _opencv([float(v) for v in (fx, fy, cx, cy)], [k1, k2, p1, p2, *more], _MATLAB_CENTRE)
        if content.get("ImageSize"):
            out["image_height"], out["image_width"] = (int(v) for v in content["ImageSize"])
    except (KeyError, TypeError, ValueError) as error:
        raise ParseError(
            f"expected MATLAB's FocalLength and PrincipalPoint, RadialDistortion, ImageSize; {error} is amiss", path
        ) from None
    return out


def _of_xml(path: Path) -> Spec:
    text = read_xml(path)
    if "<!DOCTYPE" in text:
        raise ParseError("is XML with a DOCTYPE; expected a camera as OpenCV or ViSP writes it", path)
    try:
        root = ET.fromstring(declared_as_utf8(text).encode())  # noqa: S314 - no DOCTYPE, so no entities
    except ET.ParseError as error:
        raise ParseError(f"is not valid XML: {error}", path) from None
    if root.tag == "opencv_storage":
        return {entry.tag: _of_opencv(entry) for entry in root}
    if (camera := next(root.iter("camera"), None)) is not None:
        return _of_visp(camera, path)
    raise ParseError(f"is XML of <{root.tag:.60}>; expected a camera as OpenCV or ViSP writes it", path)


def _of_opencv(entry: ET.Element) -> Any:
    """A matrix, a text, or one number or several."""
    if len(entry):
        return {part.tag: _of_opencv(part) for part in entry}
    text = (entry.text or "").strip()
    if text.startswith('"'):
        return text.strip('"')
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return text
    return numbers if len(numbers) != 1 or entry.tag == "data" else numbers[0]


def _of_visp(camera: ET.Element, path: Path) -> Spec:
    """The lens with distortion where there are both: u = u0 + px x (1 + kud (x^2 + y^2))."""
    models = {str(of.findtext("type", "")).strip(): of for of in camera.iter("model")}
    with_distortion = models.get("perspectiveProjWithDistortion")
    model = models.get("perspectiveProjWithoutDistortion") if with_distortion is None else with_distortion
    if model is None:
        raise ParseError(f"has a lens of model '{', '.join(models):.60}'; expected ViSP's perspectiveProj...", path)

    def number(of: ET.Element, name: str) -> float:
        try:
            return float(of.findtext(name, ""))
        except ValueError:
            raise ParseError(f"expected a number in <{name}> of ViSP's camera", path) from None

    bend = [] if with_distortion is None else [number(model, "kud")]
    out = _opencv([number(model, name) for name in ("px", "py", "u0", "v0")], bend, 0.0)
    if camera.find("image_width") is not None:
        out |= {key: int(number(camera, key)) for key in ("image_width", "image_height")}
    return out


def _of_colmap(text: str, path: Path) -> Spec:
    """All cameras by their number, as a chain of Kalibr's."""
    out: Spec = {}
    for count, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if len(words) < 2 or words[1] not in _COLMAP_MODELS:
            known, model = ", ".join(_COLMAP_MODELS), " ".join(words[1:2])
            raise ParseError(f"has a camera of COLMAP's model '{model:.40}'; known are {known}", path, count)
        names = _COLMAP_MODELS[words[1]]
        try:
            size, numbers = [int(word) for word in words[2:4]], dict(zip(names, map(float, words[4:]), strict=True))
        except ValueError:
            raise ParseError(f"expected width, height and {', '.join(names)} of {words[1]}", path, count) from None
        is_fisheye = words[1] == "OPENCV_FISHEYE"
        fx, fy = (numbers.get(key, numbers.get("f", 0.0)) for key in ("fx", "fy"))
        bend = [numbers.get(key, 0.0) for key in (_FISHEYE if is_fisheye else _BROWN)]
        out[words[0]] = {
            "camera_model": "pinhole",
            "intrinsics": [fx, fy, *(numbers[key] - _COLMAP_CENTRE for key in ("cx", "cy"))],
            "distortion_model": "equidistant" if is_fisheye else "radtan",
            "distortion_coeffs": bend if is_fisheye else _without_zeros(bend),
            "resolution": size,
        }
    return out


def _without_zeros(bend: list[float]) -> list[float]:
    while bend and bend[-1] == 0:
        bend = bend[:-1]
    return bend


def _opencv(lens: list[float], bend: list[float], first: float) -> Spec:
    """A matrix and coefficients of a lens whose first pixel is (first, first)."""
    fx, fy, cx, cy = lens
    K = [[fx, 0.0, cx - first], [0.0, fy, cy - first], [0.0, 0.0, 1.0]]
    return {"camera_matrix": K, "distortion_coefficients": bend}
