# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What surrounds an arm that is measured, as a YAML file; points in the measuring frame.

keep_out: [{min_mm: [-2000, 600, 0], max_mm: [2000, 900, 2500]}]
region: {min_mm: [400, -800, 200], max_mm: [1500, 800, 1600]}
tracker: {xyz_mm: [4000, 0, 1200], nearest_mm: 1000, farthest_mm: 20000, reflector: [0, 0, 1], acceptance_deg: 30}
link_radius_mm: 120
mounting: true        # above the arm's mounting face and out of its own column; false where it may reach below
"""

from __future__ import annotations

import math
import os

from fastcal.design.surroundings import Corners, Surroundings, Tracker
from fastcal.io.fields import Fields
from fastcal.io.yaml_file import read_yaml
from fastcal.units import to_si


def load_surroundings(path: str | os.PathLike[str]) -> Surroundings:
    """Reads such a file; every key may be left out.

    Raises:
        ParseError: Something is unknown or invalid; one sentence with file and key.
    """
    top = Fields(read_yaml(path), "", path)
    boxes = top.take("keep_out", [])
    if not isinstance(boxes, list):
        top.fail("keep_out", "a list of boxes", boxes)
    keep_out = [_corners(Fields(box, f"keep_out[{i}]", path)) for i, box in enumerate(boxes)]
    region = top.optional("region")
    tracker = top.optional("tracker")
    radius = top.quantity("link_radius", "mm", 0.0)
    if radius < 0:
        top.fail("link_radius_mm", "a length of at least 0", radius)
    mounting = top.truth("mounting", True)
    top.done()
    return Surroundings(
        keep_out=keep_out,
        region=None if region is None else _corners(Fields(region, "region", path)),
        tracker=None if tracker is None else _tracker(Fields(tracker, "tracker", path)),
        link_radius=to_si(radius, "mm"),
        mounting=mounting,
    )


def _corners(fields: Fields) -> Corners:
    low, high = (fields.quantities(name, "mm", 3) for name in ("min", "max"))
    if not all(a < b for a, b in zip(low, high, strict=True)):
        fields.refuse("", f"min_mm must be below max_mm in x, y and z, got {low} and {high}")
    fields.done()
    return [to_si(x, "mm") for x in low], [to_si(x, "mm") for x in high]


def _tracker(fields: Fields) -> Tracker:
    position = fields.quantities("xyz", "mm", 3)
    nearest = fields.quantity("nearest", "mm", 0.0)
    farthest = fields.quantity("farthest", "mm", float("inf"))
    if not 0 <= nearest < farthest:
        fields.refuse("", f"nearest_mm must be at least 0 and below farthest_mm, got {nearest} and {farthest}")
    reflector = fields.vector("reflector", 3) if fields.has("reflector") else None
    if reflector is not None and not any(reflector):
        fields.fail("reflector", "a direction in the tool's axes", reflector)
    acceptance = to_si(fields.quantity("acceptance", "deg", 30.0), "deg")
    if not 0 < acceptance <= math.pi:
        fields.refuse("acceptance_deg", "must be an angle above 0 and at most half a turn")
    fields.done()
    return Tracker(
        position=[to_si(x, "mm") for x in position],
        nearest=to_si(nearest, "mm"),
        farthest=to_si(farthest, "mm"),
        reflector=reflector,
        acceptance=acceptance,
    )
