# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a calibrated cell still hold? A picture or a few, cameras and boards where the model has them.

All corners of a picture may share one error, as that of its joints: with the noise s [px] of the calibration the mean
square m of n pictures is held against

    6 n m / s^2 ~ chi^2(6 n),

six being the numbers that a picture says of its posture. Each camera, each board and each joint's zero is then moved to
where the corners want it, and those that explain them about as well as the best are named, by BIC. Where another focal
length and centre of a camera explain them better than any move, its lens is named.

The errors of real pictures scatter more than s, since postures repeat worse in some places and the model fits worse
in others: a change is one only if the best of K explanations by k numbers takes more of the squares than such scatter,

    F = ((S_0 - S) / k) / (S / (6 n - k)) ~ F(k, 6 n - k),   K p(F) < LEVEL,

S_0 and S the squares m summed before and after. Else the check cannot tell. One picture leaves nothing to scatter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from fastcal import _core
from fastcal.arrays import BoolArray, FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.levers import levers
from fastcal.calibration.pictures import seen_by_model
from fastcal.calibration.unknowns import CORNERS, of_corners
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.causes import LEVEL
from fastcal.place import joint_name, place_of
from fastcal.robot.rig import PLACEMENT, lens_numbers
from fastcal.robot.robot import Robot
from fastcal.units import from_si

NUMBERS = 6  # that a picture says
ALIKE = 10.0  # BIC within which two explanations are: odds of 1 : 150


@dataclass(frozen=True)
class Moved:
    """What may have moved, and by how much: a camera or board by mm and degrees, a joint's zero by degrees or mm."""

    owner: str
    shift_mm: float | None
    turn_deg: float | None

    @property
    def text(self) -> str:
        """In words."""
        sizes = [(self.shift_mm, "mm"), (self.turn_deg, "deg")]
        return f"{self.owner} by {' and '.join(f'{size:.3g} {unit}' for size, unit in sizes if size is not None)}"


@dataclass(frozen=True)
class LensChange:
    """Another lens than that of the calibration: whose, and by how much its focal lengths [%] and its centre differ."""

    camera: str
    focal_percent: float
    centre_px: float

    @property
    def text(self) -> str:
        """In words."""
        focal, centre = f"{self.focal_percent:.2g} %", f"{self.centre_px:.2g} px"
        return f"the lens of camera {self.camera}: its focal length by {focal}, its centre by {centre}"


@dataclass(frozen=True)
class PictureCheck:
    """What pictures say of a calibrated cell.

    Attributes:
        verdict: holds, changed, or cannot_tell: larger errors, which nothing that was tried explains.
        rms_px: RMS distance by row of its corners from where they are expected.
        expected_px: The same of the calibration's noise alone.
        p_value: Of errors as large where nothing moved.
        moved: What explains them, the likeliest first; empty where nothing moved or a lens explains it.
        lens: What explains them better than any move.
    """

    verdict: str
    sentence: str
    rms_px: dict[int, float]
    expected_px: float
    p_value: float
    moved: tuple[Moved, ...]
    notes: tuple[str, ...] = ()
    lens: LensChange | None = None

    def to_json_dict(self) -> dict[str, Any]:
        """As check.json has it."""
        rows = [{"row": row, "rms_px": rms} for row, rms in self.rms_px.items()]
        rest = {"notes": list(self.notes), "lens": None if self.lens is None else vars(self.lens)}
        return {**vars(self), "rms_px": rows, "moved": [vars(of) for of in self.moved], **rest}


def check_pictures(model: Robot, data: Dataset, threads: int = 1) -> PictureCheck:
    """Holds a calibrated cell against new pictures.

    Args:
        model: With its cameras, boards and the noise of its calibration: model.yaml.
        data: Postures, and the corners seen in them.
        threads: Cores.

    Raises:
        InvalidInput: There are no corners, or the model was not calibrated with any.
    """
    noise = None if model.record is None else model.record.sigma(CORNERS)
    if CORNERS not in data.kinds or noise is None:
        raise InvalidInput(f"{data.source}: expected corners of boards, and a model that was calibrated with corners")
    looked = seen_by_model(model, data, threads)
    data = looked.data
    measured = measurements(data, model)
    start = np.asarray(model.error_model.start)
    theta = np.concatenate([start, np.zeros(len(measured.parameters))])
    near = _core.linearize(model.error_model, model.samples(data), measured, theta, [1.0] * len(measured.observations))
    own = of_corners(near, measured)
    r, J, row = np.asarray(near.r)[own], np.asarray(near.J)[own], np.asarray(near.row)[own]
    pictures = len(np.unique(row))
    scale = NUMBERS * pictures / len(r) / noise**2
    p_value = float(stats.chi2.sf(scale * float(r @ r), NUMBERS * pictures))
    rms, expected = {int(i): _rms_distance(r[row == i]) for i in np.unique(row)}, float(np.sqrt(2) * noise)
    moved: tuple[Moved, ...] = ()
    lens: LensChange | None = None
    verdict = "holds"
    if p_value < LEVEL:
        G = levers(model.core, data, measured, theta[len(start) :], threads)[row, np.asarray(near.number)[own]]
        tried = _explanations(model, measured, J[:, len(start) :], G, r, scale, pictures)
        best = tried[0].fit
        other = _another_lens(model, data, r, own, scale, pictures, best.cost - ALIKE)
        if other is not None:
            best, lens = other.fit, other.change
        else:
            moved = tuple(of.moved for of in tried if of.fit.cost - best.cost < ALIKE)
        count = len(tried) + len(model.description.cameras)
        verdict = "changed" if best.exceeds_scatter(scale * float(r @ r), pictures, count) else "cannot_tell"
        moved, lens = (moved, lens) if verdict == "changed" else ((), None)
    sentence = _sentence(verdict, _rms_distance(r), expected, pictures, moved, lens)
    return PictureCheck(verdict, sentence, rms, expected, p_value, moved, looked.notes, lens)


def _rms_distance(r: FloatArray) -> float:
    """RMS length of the errors of corners, two numbers each."""
    return float(np.sqrt(2 * np.mean(r**2)))


@dataclass(frozen=True, eq=False)
class _Fit:
    """What columns leave of the corners: numbers x, squares S (scaled to 6 n), BIC."""

    x: FloatArray
    squares: float
    cost: float

    @staticmethod
    def of(columns: FloatArray, r: FloatArray, scale: float, pictures: int) -> _Fit:
        x = np.asarray(np.linalg.lstsq(columns, -r, rcond=1e-10)[0], dtype=np.float64)
        left = r + columns @ x
        squares = scale * float(left @ left)
        return _Fit(x, squares, squares + columns.shape[1] * float(np.log(NUMBERS * pictures)))

    def exceeds_scatter(self, before: float, pictures: int, count: int) -> bool:
        """Does this, the best of `count` explanations, take more of the squares `before` than scatter does?"""
        k = len(self.x)
        freedom = NUMBERS * pictures - k
        if pictures == 1 or freedom < 1:
            return True
        F = (before - self.squares) / k / (self.squares / freedom)
        return count * float(stats.f.sf(F, k, freedom)) < LEVEL


@dataclass(frozen=True, eq=False)
class _Explanation:
    moved: Moved
    fit: _Fit


def _explanations(
    model: Robot, measured: _core.Measurements, J: FloatArray, G: FloatArray, r: FloatArray, scale: float, pictures: int
) -> list[_Explanation]:
    """Each camera, board and zero moved to where the corners want it, the likeliest first."""
    places: dict[str, list[int]] = {}
    for k, parameter in enumerate(measured.parameters):
        if parameter.name in PLACEMENT:
            places.setdefault(parameter.owner, []).append(k)
    blocks = {owner: J[:, own] for owner, own in places.items()}
    if not model.of_poses:
        blocks |= {joint_name(joint): G[:, joint : joint + 1] for joint in range(G.shape[1])}
    found = []
    for owner, columns in blocks.items():
        fit = _Fit.of(columns, r, scale, pictures)
        found.append(_Explanation(_moved(model, owner, fit.x), fit))
    return sorted(found, key=lambda of: of.fit.cost)


@dataclass(frozen=True, eq=False)
class _OtherLens:
    """A lens that explains the corners: how it changed, and what it leaves of them."""

    change: LensChange
    fit: _Fit


def _another_lens(
    model: Robot, data: Dataset, r: FloatArray, own: BoolArray, scale: float, pictures: int, least: float
) -> _OtherLens | None:
    """What has changed of a camera's focal lengths and centre, where its BIC is less than `least`; else None."""
    cameras, step = model.description.cameras, 1e-3  # [px]
    best: _OtherLens | None = None
    for name, camera in cameras.items():
        columns = []
        for k in range(4):
            numbers = np.array(lens_numbers(camera))
            numbers[k] += step
            other = {"focal_px": numbers[:2].tolist(), "centre_px": numbers[2:4].tolist()}
            measured = measurements(data, model.with_(cameras={**cameras, name: {**camera, **other}}))
            theta = np.append(model.error_model.start, np.zeros(len(measured.parameters)))
            near = _core.linearize(
                model.error_model, model.samples(data), measured, theta, [1.0] * len(measured.observations)
            )
            columns.append((np.asarray(near.r)[own] - r) / step)
        fit = _Fit.of(np.column_stack(columns), r, scale, pictures)
        if fit.cost < least:
            share = 100 * float(np.mean(fit.x[:2] / np.array(camera["focal_px"])))
            least, best = fit.cost, _OtherLens(LensChange(name, share, float(np.linalg.norm(fit.x[2:]))), fit)
    return best


def _moved(model: Robot, owner: str, x: FloatArray) -> Moved:
    if len(x) == NUMBERS:
        shift, turn = (float(np.linalg.norm(part)) for part in (x[:3], x[3:]))
        return Moved(owner, from_si(shift, "mm"), from_si(turn, "deg"))
    size = abs(float(x[0]))
    if model.joint_types[place_of(owner).number - 1] == "prismatic":
        return Moved(owner, from_si(size, "mm"), None)
    return Moved(owner, None, from_si(size, "deg"))


def _sentence(
    verdict: str, rms: float, expected: float, pictures: int, moved: tuple[Moved, ...], lens: LensChange | None
) -> str:
    seen = f"{pictures} picture{'s' * (pictures > 1)}, {rms:.2f} px where {expected:.2f} px are expected"
    if verdict == "holds":
        return f"The cell holds: {seen}."
    if verdict == "cannot_tell":
        return (
            f"No verdict ({seen}): the errors are larger, but no move of a camera, a board or a joint and no other "
            "lens explains them. Take pictures in postures like those of the calibration, or calibrate with these as "
            "well."
        )
    if lens is not None:
        act = "Were focus, zoom or the size of the pictures changed? Calibrate again, with `intrinsics: identify`"
        return f"Something changed ({seen}): {lens.text}. {act}."
    if len(moved) == 1:
        return f"Something moved ({seen}): {moved[0].text}."
    choices = ", or ".join(of.text for of in moved)
    return f"Something moved ({seen}): {choices}. Pictures from other postures tell them apart."
