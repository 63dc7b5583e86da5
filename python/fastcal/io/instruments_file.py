# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is measured in a pose, as a YAML file for a design; points and normals in the measuring frame.

points: true
levels: [link2, link3]
sigma_tilt_mrad: 0.1
planes: {table: {point_mm: [800, 0, 300], normal: [0, 0, 1]}}
"""

from __future__ import annotations

import os

from fastcal.design.instruments import SIGMA_TILT, Instruments
from fastcal.io.fields import Fields
from fastcal.io.yaml_file import read_yaml
from fastcal.units import from_si, to_si


def load_instruments(path: str | os.PathLike[str]) -> Instruments:
    """Reads such a file; every key may be left out.

    Raises:
        ParseError: An unknown key or a value of the wrong kind; one sentence with file and key.
    """
    top = Fields(read_yaml(path), "", path)
    points = top.truth("points", True)
    levels = top.names("levels", [], expected="a list of links, such as [link2, link3]")
    sigma_tilt = top.quantity("sigma_tilt", "mrad", from_si(SIGMA_TILT, "mrad"))
    if not sigma_tilt > 0:
        top.fail("sigma_tilt_mrad", "an angle above 0", sigma_tilt)
    planes = top.take("planes", {})
    if not isinstance(planes, dict):
        top.fail("planes", "a mapping of labels to planes", planes)
    found = {str(label): _plane(Fields(plane, f"planes.{label}", path)) for label, plane in planes.items()}
    top.done()
    return Instruments(points, tuple(levels), to_si(sigma_tilt, "mrad"), found)


def _plane(fields: Fields) -> tuple[list[float], list[float]]:
    point = [to_si(x, "mm") for x in fields.quantities("point", "mm", 3)]
    normal = fields.vector("normal", 3)
    if not any(normal):
        fields.fail("normal", "a direction", normal)
    fields.done()
    return point, normal
