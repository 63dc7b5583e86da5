# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Universal Robots' own files: the kinematics of ur_description (YAML) in and out, a controller's calibration.conf in.

`default_kinematics.yaml` of ur_description, and what ur_calibration extracts from a robot, hold the origins of the six
joints, each turning about its z, x y z in m and roll pitch yaw in rad; `hash` tells the driver whose they are. The
first origin is in the controller's own base frame, `base_link_inertia` there; the last joint's frame is `tool0`.
`calibration.conf` holds what the controller adds to the maker's DH rows (theta, a, d, alpha, in rad and m). Where axes
are nearly parallel these d are many metres long and cancel out (ros-industrial/universal_robot, issue 357).
"""

from __future__ import annotations

import copy
import math
import os
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fastcal import units
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.fields import Fields
from fastcal.io.yaml_file import read_text
from fastcal.robot.core_model import pose
from fastcal.robot.se3 import rotation_to_rpy

Spec = dict[str, Any]
LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
JOINTS = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
_XYZ, _RPY = ("x", "y", "z"), ("roll", "pitch", "yaw")
_DELTAS = {"delta_theta": "theta_deg", "delta_a": "a_mm", "delta_d": "d_mm", "delta_alpha": "alpha_deg"}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


def is_ur_kinematics(value: Any) -> bool:
    """Whether plain data are a kinematics file of ur_description."""
    return isinstance(value, dict) and isinstance(value.get("kinematics"), dict) and "shoulder" in value["kinematics"]


def ur_spec(value: Mapping[str, Any], path: str | os.PathLike[str]) -> Spec:
    """The arm of a kinematics file as a spec of kind urdf; its limits, which the file does not hold, are one turn.

    Raises:
        ParseError: An entry is missing or no number; the sentence names it.
    """
    top = Fields(dict(value), "", path)
    fields = top.inner("kinematics")
    joints = []
    for link, name in zip(LINKS, JOINTS, strict=True):
        entry = fields.inner(link)
        xyz = [units.from_si(entry.number(key), "mm") for key in _XYZ]
        rpy = [units.from_si(entry.number(key), "deg") for key in _RPY]
        entry.done()
        origin = {"xyz_mm": xyz, "rpy_deg": rpy}
        joints.append({"name": name, "type": "revolute", "origin": origin, "axis": [0.0, 0.0, 1.0]})
    spec: Spec = {"kinematics": "urdf", "joints": joints}
    if (named := fields.optional("hash")) is not None:
        spec["source"] = {"ur_hash": str(named)}
    fields.done()  # beside `kinematics`, which is all that ur_description reads, the file may hold anything
    return spec


def ur_hash(path: str | os.PathLike[str], value: Any) -> str:
    """The hash of a kinematics file.

    Raises:
        ParseError: It is none, or has none.
    """
    if not is_ur_kinematics(value) or "hash" not in value["kinematics"]:
        raise ParseError("expected a kinematics file of ur_description with its hash", path)
    return str(value["kinematics"]["hash"])


def ur_kinematics_text(origins: Sequence[FloatArray], named: str) -> str:
    """A kinematics file of ur_description; numbers have the digits that read back to the same doubles.

    Args:
        origins: (4, 4) each, of the six joints in the frame of the one before, which turn about z.
        named: The hash.
    """
    lines = ["kinematics:"]
    for link, T in zip(LINKS, origins, strict=True):
        values = zip((*_XYZ, *_RPY), (*T[:3, 3], *rotation_to_rpy(T[:3, :3])), strict=True)
        lines += [f"  {link}:", *(f"    {key}: {_number(value)}" for key, value in values)]
    return "\n".join([*lines, f"  hash: {named}", ""])


def check_six_joints(spec: Spec) -> None:
    """Refuses an arm that can't be one of Universal Robots'."""
    if [joint["type"] for joint in spec["joints"]] != ["revolute"] * len(LINKS):
        raise InvalidInput(f"{spec['name']}: a kinematics file of ur_description is of six turning joints")


def own_joint_origins(spec: Spec, first_mount: FloatArray) -> list[FloatArray]:
    """The origins of a spec of kind urdf as a kinematics file has them.

    Args:
        spec: Of an arm of six turning joints.
        first_mount: (4, 4) of the first joint's parent link in the base: what is fixed before it.

    Raises:
        InvalidInput: Its joints turn about other axes than z, or it has a flange that is not the last joint's frame.
    """
    axes = np.array([joint["axis"] for joint in spec["joints"]])
    if np.abs(axes - [0, 0, 1]).max() > 1e-9:
        raise InvalidInput(
            f"{spec['name']}: its joints do not turn about their z axes, as those of ur_description do; start from "
            "ur_description's own URDF, a kinematics file or a robot file with DH rows"
        )
    if np.abs(pose(spec["flange"]) - np.eye(4)).max() > 1e-9:
        raise InvalidInput(
            f"{spec['name']}: its flange is not the frame of joint 6, which ur_description takes as tool0"
        )
    origins = [pose(joint["origin"]) for joint in spec["joints"]]
    return [np.linalg.inv(first_mount) @ origins[0], *origins[1:]]


def with_ur_deltas(spec: Spec, path: str | os.PathLike[str]) -> Spec:
    """The maker's DH rows with what a controller's calibration.conf adds to them.

    Raises:
        ParseError: A list is missing or has not six numbers.
        InvalidInput: The robot is not of kind dh with six joints.
    """
    if spec["kinematics"] != "dh" or len(spec["joints"]) != len(LINKS):
        raise InvalidInput(
            f"{spec['name']}: a calibration.conf adds to six DH rows; give the maker's arm, such as ur5e"
        )
    text = read_text(path)
    out = copy.deepcopy(spec)
    for key, ours in _DELTAS.items():
        found = re.search(rf"^\s*{key}\s*=\s*\[([^\]]*)\]", text, re.MULTILINE)
        numbers = re.findall(_NUMBER, found[1]) if found else []
        if len(numbers) != len(LINKS):
            raise ParseError(f"{key}: expected a list of {len(LINKS)} numbers, got {len(numbers)}", path)
        unit = ours.rpartition("_")[2]
        for joint, number in zip(out["joints"], numbers, strict=True):
            joint[ours] += units.from_si(float(number), unit)
            if not math.isfinite(joint[ours]):
                raise ParseError(f"{key}: expected finite numbers, got {number}", path)
    return out


def _number(value: float) -> str:
    text = repr(float(value) + 0.0)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text
