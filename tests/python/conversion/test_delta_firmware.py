# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Numbers for a delta printer's firmware: those it was built with, and carriages as Klipper moves them."""

from __future__ import annotations

import re
from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from fastcal import delta_numbers, firmware_text, load_robot, perturbed
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot

ANGLES = np.radians([210.0, 330.0, 90.0])
BED = np.column_stack([a.ravel() for a in np.meshgrid([-0.06, 0.0, 0.06], [-0.06, 0.0, 0.06])])


def built(arms: Any = (250.0,) * 3, radius: float = 125.0, angles: Any = ANGLES, low: Any = (0.0,) * 3) -> Robot:
    """One arm a tower, whose carriage is `low` mm lower than its number says."""
    joints: list[dict[str, Any]] = []
    for name, angle, z in zip("abc", angles, low, strict=True):
        place = [radius * np.cos(angle), radius * np.sin(angle), -z]
        joints.append({"name": name, "type": "prismatic", "axis": [0, 0, 1], "on": "base", "start_mm": 240})
        joints[-1] |= {"origin": {"xyz_mm": place, "rpy_deg": [0, 0, 0]}, "min_mm": 100, "max_mm": 400}
    for name, axis in zip("xyz", np.eye(3).tolist(), strict=True):
        joints.append({"name": name, "type": "prismatic", "axis": axis, "passive": True, "min_mm": -300, "max_mm": 300})
        joints[-1]["origin"] = {"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 0]}
    joints[3]["on"] = "base"
    loops = [{"from": f"link{k + 1}", "to": "link6", "length_mm": float(arms[k])} for k in range(3)]
    return load_robot({"name": "printer", "kinematics": "urdf", "joints": joints, "loops": loops})


def test_an_ideal_printer_has_the_numbers_it_was_built_with() -> None:
    angles = ANGLES + np.array([0.01, -0.02, 0.005])
    found = delta_numbers(built((249.0, 250.5, 251.0), 124.0, angles, (0.5, -0.2, 0.1)))
    assert found.arms == pytest.approx([0.249, 0.2505, 0.251], abs=1e-7)
    assert found.radius == pytest.approx(0.124, abs=1e-7)
    assert np.angle(np.exp(1j * (found.angles - angles))) == pytest.approx(0.0, abs=1e-7)
    assert found.raised == pytest.approx([5e-4, -2e-4, 1e-4], abs=1e-7)
    assert found.most < 1e-7


def test_the_shipped_printer_of_six_arms_is_one_of_three() -> None:
    found = delta_numbers(load_robot("delta_printer"))
    assert found.arms == pytest.approx(0.25, abs=1e-8)
    assert found.radius == pytest.approx(0.085, abs=1e-8)  # towers at 125 mm, arms 15 mm in front, effector of 25 mm
    assert found.most < 1e-8
    assert delta_numbers(perturbed(load_robot("delta_printer"), seed=1)).left > 1e-5  # a platform that tilts


@pytest.mark.parametrize("bed", [None, np.array([0.004, -0.003, 2e-3])])
def test_klipper_with_the_new_numbers_meets_the_bed(bed: np.ndarray | None) -> None:
    nominal = built()
    real = built((249.4, 250.3, 250.1), 124.6, ANGLES + np.array([0.004, 0.0, -0.006]), (0.4, -0.5, 0.2))
    switches = 300.0 + np.array([0.0, 1.0, 2.0])
    before, after = delta_numbers(nominal), delta_numbers(real, bed)
    text = firmware_text("klipper", after, before, switches.tolist())
    arm, angle, endstop = (
        np.array(re.findall(rf"{key}: (\S+)", text), dtype=float) for key in ("arm_length", "angle", "position_endstop")
    )
    radius = float(re.findall(r"delta_radius: (\S+)", text)[0])
    # A carriage at its switch is at position_endstop + (arm^2 - radius^2)^0.5 (klippy/kinematics/delta.py).
    at_switch = endstop + np.sqrt(arm**2 - radius**2)
    was_at_switch = switches + np.sqrt(250.0**2 - 125.0**2)
    towers = radius * np.column_stack([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    sent = np.sqrt(arm**2 - ((towers - 1e3 * BED[:, np.newaxis]) ** 2).sum(axis=2))
    q = np.zeros((len(BED), 6))
    q[:, :3] = (sent + was_at_switch - at_switch) / 1e3
    point = real.forward(q)[:, :3, 3]
    if bed is not None:  # n . p = offset, n the turned z axis
        rx, ry, offset = bed
        height = point @ [np.sin(ry), -np.sin(rx), np.cos(np.hypot(rx, ry))] - offset
    else:
        height = point[:, 2]
    assert np.abs(height).max() < 2e-6 + after.most  # towers lean against a bed that leans
    moved = np.linalg.norm(point[:, np.newaxis, :2] - point[np.newaxis, :, :2], axis=2)
    assert moved == pytest.approx(np.linalg.norm(BED[:, np.newaxis] - BED, axis=2), abs=5e-6 + after.most)


def test_marlin_s_lines_hold_the_same_numbers() -> None:
    text = firmware_text("marlin", delta_numbers(built((249.0, 250.0, 251.0))), delta_numbers(built()), [250.0])
    assert re.search(
        r"M665 L250\.000 R125\.000 H251\.155 X-?0\.000 Y-?0\.000 Z-?0\.000 A-1\.000 B-?0\.000 C1\.000", text
    )
    x, y, z = (float(v) for v in re.findall(r"M666 X(\S+) Y(\S+) Z(\S+)", text)[0])
    assert [x, y, z] == pytest.approx([0.0, -1.155, -2.309], abs=2e-3)  # 250 / 216.5 mm a mm of arm


def test_what_is_no_delta_printer_and_what_is_no_firmware_is_refused() -> None:
    with pytest.raises(InvalidInput, match="three motors slide"):
        delta_numbers(load_robot("delta"))
    found = delta_numbers(built())
    with pytest.raises(InvalidInput, match="klipper or marlin"):
        firmware_text("smoothie", found, found, [250.0])
    with pytest.raises(InvalidInput, match="one height"):
        firmware_text("klipper", found, found, [250.0, 251.0])
    spec = deepcopy(built().spec)
    for joint in spec["joints"][:3]:
        joint |= {"min_mm": 240.0, "max_mm": 240.001}
    for joint in spec["joints"][3:]:
        joint |= {"min_mm": 1000.0, "max_mm": 1001.0}
    with pytest.raises(InvalidInput, match="hang below"):
        delta_numbers(load_robot(spec))
