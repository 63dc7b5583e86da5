# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The causes of error in cameras and boards that are tested, and how each changes the cell file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.effects.rig_traits import (
    BOARD_BEND,
    BOARD_SCALE,
    BRACKET_SAG,
    INTRINSICS,
    PLACEMENT_STEP,
    ROLLING_SHUTTER,
    TIME_OFFSET,
)
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import BEND, lens_numbers, sized
from fastcal.robot.robot import Robot, Spec

SAG = tuple(f"{axis}_mm_by_g{of}" for axis in "xyz" for of in "xyz")
SAG += tuple(f"r{axis}_deg_by_g{of}" for axis in "xyz" for of in "xyz")
_LENS = ("fx_px", "fy_px", "cx_px", "cy_px")
_LENS_STEP, _DISTORTION_STEP = 1e-2, 1e-5
_SAG_SIZES = (0.5,) * 9 + (0.2,) * 9  # [mm, deg] of a mount that is still one
_STEP_NUMBERS = ("x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg")
_STEP_SIZES = (10.0,) * 3 + (2.0,) * 3  # [mm, deg] of a knock that nobody saw
_SECONDS_STEP, _SAG_STEP, _STEP_STEP = 1e-4, 1e-3, 1e-3


@dataclass(frozen=True)
class RigCause:
    """Numbers of a camera or board that may not be as the file says.

    Attributes:
        names: Of its numbers, with their unit.
        steps: By which derivatives are taken.
        change: Adds (p,) numbers to a spec's own copy.
        sizes: (p,) plausible ones, by which they are held; empty: nothing is known of them.
        at: Numbers that were looked for over all that they may be, by their names: the row of a knock.
        looked: At so many values of them.
        holds: The cause, of the same owner, that it is with its last numbers at 0; empty: none.
    """

    effect: str
    owner: str
    names: tuple[str, ...]
    steps: tuple[float, ...]
    change: Callable[[Spec, FloatArray], None]
    holds: str = ""
    sizes: tuple[float, ...] = ()
    at: tuple[tuple[str, float], ...] = ()
    looked: int = 1

    @property
    def by_chance(self) -> float:
        """What it gains where nothing is wrong."""
        return len(self.names) + 2 * float(np.log(self.looked))

    @property
    def prior(self) -> FloatArray:
        """(p,) standard deviations of what is known of its numbers before any data."""
        return np.array(self.sizes or [np.inf] * len(self.names))

    @property
    def label(self) -> str:
        """EFFECT@OWNER."""
        return f"{self.effect}@{self.owner}"

    def of(self, robot: Robot, values: FloatArray) -> Robot:
        """The robot with its numbers changed."""
        spec = Robot(robot.spec).spec
        self.change(spec, values)
        return Robot(spec)


def rig_causes(robot: Robot, data: Dataset) -> list[RigCause]:
    """What may be wrong with the cameras and boards of a cell, as far as the data could show it."""
    out = []
    moving = data.speed is not None and bool(np.any(data.speed))
    for name, camera in robot.description.cameras.items():
        if camera["intrinsics"] != "identify":
            coefficients = len(camera["distortion"])
            names = (*_LENS, *(f"distortion{k}" for k in range(1, coefficients + 1)))
            steps = (_LENS_STEP,) * 4 + (_DISTORTION_STEP,) * coefficients
            out.append(RigCause(INTRINSICS, name, names, steps, _lens_change(name)))
        if camera["on"] not in ("world", "arm.base"):
            out.append(RigCause(BRACKET_SAG, name, SAG, (_SAG_STEP,) * 18, _sag_change(name), "", _SAG_SIZES))
        if moving:
            late = ("time_offset_s",)
            out.append(RigCause(TIME_OFFSET, name, late, (_SECONDS_STEP,), _timing_change(name, late)))
            lines = ("time_offset_s", "readout_s")
            steps = (_SECONDS_STEP,) * 2
            out.append(RigCause(ROLLING_SHUTTER, name, lines, steps, _timing_change(name, lines), TIME_OFFSET))
    for name, board in robot.description.boards.items():
        if board["kind"] == "points":
            continue
        out.append(RigCause(BOARD_SCALE, name, ("scale",), (1e-5,), _scale_change(name)))
        out.append(RigCause(BOARD_BEND, name, BEND, (1e-3,) * 3, _bend_change(name)))
    return out


def placement_step(name: str, kind: str, at_row: int, looked: int) -> RigCause:
    """That a camera or board (`kind` cameras or boards) was knocked before a row of the data."""

    def change(spec: Spec, values: FloatArray) -> None:
        of = spec[kind][name]
        known = of.get("knocked", {"before_mm": [0.0] * 3, "before_deg": [0.0] * 3})
        before = np.concatenate([known["before_mm"], known["before_deg"]]) - values
        of["knocked"] = {"at_row": at_row, "before_mm": before[:3].tolist(), "before_deg": before[3:].tolist()}

    at = (("at_row", float(at_row)),)
    return RigCause(PLACEMENT_STEP, name, _STEP_NUMBERS, (_STEP_STEP,) * 6, change, "", _STEP_SIZES, at, looked)


def _lens_change(name: str) -> Callable[[Spec, FloatArray], None]:
    def change(spec: Spec, values: FloatArray) -> None:
        camera = spec["cameras"][name]
        numbers = [a + b for a, b in zip(lens_numbers(camera), values.tolist(), strict=True)]
        camera["focal_px"], camera["centre_px"], camera["distortion"] = numbers[:2], numbers[2:4], numbers[4:]

    return change


def _scale_change(name: str) -> Callable[[Spec, FloatArray], None]:
    def change(spec: Spec, values: FloatArray) -> None:
        spec["boards"][name] = sized(spec["boards"][name], 1.0 + float(values[0]))

    return change


def _bend_change(name: str) -> Callable[[Spec, FloatArray], None]:
    def change(spec: Spec, values: FloatArray) -> None:
        board = spec["boards"][name]
        board["bend_mm"] = (np.asarray(board.get("bend_mm", [0.0, 0.0, 0.0])) + values).tolist()

    return change


def _sag_change(name: str) -> Callable[[Spec, FloatArray], None]:
    def change(spec: Spec, values: FloatArray) -> None:
        camera = spec["cameras"][name]
        for unit, own in (("mm", values[:9]), ("deg", values[9:])):
            known = np.asarray(camera.get(f"sag_{unit}", np.zeros((3, 3))))
            camera[f"sag_{unit}"] = (known + own.reshape(3, 3)).tolist()

    return change


def _timing_change(name: str, keys: tuple[str, ...]) -> Callable[[Spec, FloatArray], None]:
    def change(spec: Spec, values: FloatArray) -> None:
        camera = spec["cameras"][name]
        for key, value in zip(keys, values.tolist(), strict=True):
            camera[key] = camera.get(key, 0.0) + value

    return change
