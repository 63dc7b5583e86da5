# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Signs and zeros of motors in the files of other programs: a URDF whose joints count as the motors do, and LeRobot's.

Of a joint q = s J + z about its axis u the URDF's origin T becomes T exp(z u), its axis s u, and limits those of J.
LeRobot's degrees are (ticks - middle) 360 / 4095 with the middle of range_min and range_max (huggingface/lerobot,
motors_bus.py): another zero is another middle, and a sign has no place there.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.cells.joint_zeros import JointZeros
from fastcal.errors import InvalidInput, ParseError
from fastcal.robot.core_model import pose
from fastcal.units import from_si, to_si

Spec = Mapping[str, Any]

_TICKS = 4095  # a turn, of the motors' 12 bits
_KEYS = ("id", "drive_mode", "homing_offset", "range_min", "range_max")


def counted_urdf(spec: Spec, found: JointZeros) -> str | None:
    """The URDF that a robot was read from, its joints counted as the motors do; None where it was no URDF."""
    source = spec.get("source", {})
    if "xml" not in source:
        return None
    tree = ET.fromstring(source["xml"])  # noqa: S314 - it was read before
    elements = {element.get("name"): element for element in tree.findall("joint")}
    for joint, sign, zero in zip(spec["joints"], found.sign.tolist(), found.zero.tolist(), strict=True):
        element = elements[joint["name"]]
        axis = np.asarray(joint["axis"], dtype=np.float64)
        turned = pose(joint["origin"])[:3, :3] @ np.asarray(_core.exp_so3(zero * axis / np.linalg.norm(axis)))
        origin = _child(element, "origin")
        origin.set("rpy", " ".join(repr(float(of)) for of in _core.rotation_to_rpy(turned)))
        origin.set("xyz", " ".join(repr(to_si(of, "mm")) for of in joint["origin"]["xyz_mm"]))
        _child(element, "axis").set("xyz", " ".join(repr(sign * of) for of in joint["axis"]))
        limit = element.find("limit")
        if limit is not None and joint["type"] == "revolute" and limit.get("lower") is not None:
            ends = sorted(sign * (to_si(joint[f"{end}_deg"], "deg") - zero) for end in ("min", "max"))
            limit.set("lower", repr(ends[0]))
            limit.set("upper", repr(ends[1]))
    return ET.tostring(tree, encoding="unicode") + "\n"


def _child(element: ET.Element, name: str) -> ET.Element:
    found = element.find(name)
    return ET.SubElement(element, name) if found is None else found


def read_lerobot(path: Path) -> dict[str, dict[str, int]]:
    """LeRobot's calibration: of each motor id, drive_mode, homing_offset, range_min, range_max.

    Raises:
        ParseError: It is none.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return {str(name): {key: int(of[key]) for key in _KEYS} for name, of in content.items()}
    except OSError as error:
        raise ParseError(f"cannot be read: {error.strerror}", path) from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise ParseError(f"expected LeRobot's calibration: of each motor {', '.join(_KEYS)}", path) from None


def lerobot_calibration(
    old: Mapping[str, Mapping[str, int]], names: Sequence[str], found: JointZeros
) -> tuple[dict[str, dict[str, int]], list[str]]:
    """LeRobot's calibration in which 0 is the URDF's zero, and the motors that count the other way round.

    A range keeps within what was recorded: its nearer end decides.

    Args:
        old: That with which the joints were read, in degrees.
        names: Of the joints, as LeRobot calls their motors.
        found: Signs and zeros.

    Raises:
        InvalidInput: A motor is missing, or its zero lies outside the range that was recorded.
    """
    out, turned = {name: dict(of) for name, of in old.items()}, []
    for name, sign, zero in zip(names, found.sign.tolist(), found.zero.tolist(), strict=True):
        if name not in out:
            raise InvalidInput(f"LeRobot's calibration has no motor '{name}'; there are {', '.join(out)}")
        motor = out[name]
        low, high = motor["range_min"], motor["range_max"]
        middle = (low + high) / 2 - sign * from_si(zero, "deg") * _TICKS / 360
        half = min(middle - low, high - middle)
        if half <= 0:
            raise InvalidInput(
                f"motor '{name}': its zero is at {middle:.0f} ticks, outside the range {low} to {high}; turn its horn, "
                "or record the range anew"
            )
        motor["range_min"], motor["range_max"] = round(middle - half), round(middle + half)
        if sign < 0:
            turned.append(name)
    return out, turned
