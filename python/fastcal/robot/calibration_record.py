# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a calibrated model keeps about its own certainty: the key `calibration` of a robot file."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.units import UNITS, to_si

_LARGEST = 1e100  # whose square is a number as well
LACKS_EFFECT = "lacks_effect"  # key beside the record: the residuals of the calibration depended on the posture
_ROOM_C = (20.0, 20.0)
_LINE = 76  # characters of base64 in a line, as MIME has them
_MOST_LISTED = 150  # parameters: with more, a root of millions of digits takes longer to read than to use


def lower_root(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lower triangular L (P, P) with L L^T = covariance (P, P), which rounding may have left a little indefinite.

    By the eigenvectors of the correlations, D V L V^T D, and a QR of the root: where directions are all but lost, a
    Cholesky factorization ends on a negative pivot of the size of rounding.
    """
    deviation = np.sqrt(np.diag(covariance))
    scale = np.where(deviation > 0, deviation, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, np.newaxis] * vectors * np.sqrt(np.maximum(values, 0.0))
    R = np.asarray(np.linalg.qr(root.T, mode="r"))
    return np.asarray(R.T * np.where(np.diag(R) < 0, -1.0, 1.0))


def packed(root: NDArray[np.float64]) -> str:
    """A lower triangle (P, P), row by row, as little-endian doubles in lines of base64."""
    text = base64.b64encode(root[np.tri(len(root), dtype=bool)].astype("<f8").tobytes()).decode("ascii")
    return "".join(f"{text[at : at + _LINE]}\n" for at in range(0, len(text), _LINE))


def unpacked(text: str, count: int) -> NDArray[np.float64]:
    """The lower triangle (count, count) of `packed`.

    Raises:
        ValueError: The text is no base64, or not of that many numbers below 1e100.
    """
    numbers = np.frombuffer(base64.b64decode("".join(text.split()), validate=True), dtype="<f8")
    if len(numbers) != count * (count + 1) // 2 or not (np.abs(numbers) < _LARGEST).all():
        raise ValueError(f"{len(numbers)} numbers are no root of {count} parameters, or one of them is none")
    root = np.zeros((count, count))
    root[np.tril_indices(count)] = numbers
    return root


@dataclass(frozen=True)
class CalibrationRecord:
    """Identified parameters and the root of their covariance, what was held, and what the measurements covered.

    Attributes:
        parameters: Names as `Robot.parameter_names` gives them, of the identified (free) parameters.
        root: (P, P) lower triangular L in SI, covariance = L L^T.
        noise: Of one number of each kind of reading, and its unit: "position" to (0.03, "mm").
        degrees_of_freedom: Measured numbers less identified parameters.
        moved: Names of the (M,) parameters that move with what was held.
        directions: (M, held) SI; column k: how the parameters move, unseen by the measurements, when the k-th held one
            is off by its plausible size.
        covered: Least and greatest of the measured rows by quantity, with its unit: "q3_deg", "payload_kg",
            "temperature_c"; empty in files of older versions.
        unknowns: Names of the (U,) numbers of cameras and boards: "camera wrist x", a change of where the file has it.
        unknown_root: (U, P + U) further rows of L, of these: their covariance with the parameters is in it.
    """

    parameters: list[str]
    root: NDArray[np.float64]
    noise: dict[str, tuple[float, str]]
    degrees_of_freedom: int
    moved: list[str] = field(default_factory=list)
    directions: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
    covered: dict[str, tuple[float, float]] = field(default_factory=dict)
    unknowns: list[str] = field(default_factory=list)
    unknown_root: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def sigma_mm(self) -> float | None:
        """Noise of one measured coordinate; None where no point was measured."""
        return self.noise.get("position", (None, ""))[0]

    @property
    def sigma_deg(self) -> float | None:
        """Noise of a measured orientation about each axis; None where none was measured, or in older files."""
        return self.noise.get("orientation", (None, ""))[0]

    @property
    def roots(self) -> dict[str, NDArray[np.float64]]:
        """(P + U,) rows of the root of the covariance of parameters and unknowns, by name."""
        own = np.hstack([self.root, np.zeros((len(self.root), len(self.unknowns)))])
        return dict(zip([*self.parameters, *self.unknowns], [*own, *self.unknown_root], strict=True))

    def sigma(self, kind: str) -> float | None:
        """Noise of a number of a kind [m or rad]; None where the calibration had none of it."""
        known = self.noise.get(kind)
        return None if known is None else to_si(*known)

    @property
    def length_sigma(self) -> float | None:
        """Noise of a length [m]: that of a point's coordinate, else of a wire or a touch; None: none was measured."""
        known = (to_si(value, unit) for value, unit in self.noise.values() if UNITS[unit].kind == "length")
        return next(known, None)

    @property
    def temperature(self) -> float:
        """[K] The middle of the measured temperatures; that of a room where none was measured."""
        return float(np.mean(to_si(np.array(self.covered.get("temperature_c", _ROOM_C)), "c")))

    @staticmethod
    def from_spec(spec: dict[str, Any] | None) -> CalibrationRecord | None:
        """Reads the key `calibration`; None where there is none."""
        if not spec:
            return None
        count, rows = len(spec["parameters"]), spec["covariance_root"]
        root = unpacked(rows, count) if isinstance(rows, str) else np.zeros((count, count))
        for i, row in enumerate(() if isinstance(rows, str) else rows):
            root[i, : i + 1] = row
        held = spec.get("held") or {"parameters": [], "directions": []}
        return CalibrationRecord(
            list(spec["parameters"]),
            root,
            _noise_of(spec),
            int(spec["degrees_of_freedom"]),
            list(held["parameters"]),
            np.array(held["directions"], dtype=float).reshape(len(held["directions"]), len(held["parameters"])).T,
            {name: (float(low), float(high)) for name, (low, high) in (spec.get("covered") or {}).items()},
            *_unknowns_of(spec.get("unknowns"), count),
        )

    def to_spec(self) -> dict[str, Any]:
        """Plain numbers for the robot file."""
        is_short = len(self.root) <= _MOST_LISTED
        rows = [row[: i + 1] for i, row in enumerate(self.root.tolist())] if is_short else packed(self.root)
        spec: dict[str, Any] = {
            "parameters": list(self.parameters),
            "covariance_root": rows,
            "sigma_mm": self.sigma_mm,
            "degrees_of_freedom": int(self.degrees_of_freedom),
        }
        if self.sigma_deg is not None:
            spec["sigma_deg"] = float(self.sigma_deg)
        spec["noise"] = {kind: {"value": float(value), "unit": unit} for kind, (value, unit) in self.noise.items()}
        if self.directions.size:
            columns = self.directions.T.tolist()
            spec["held"] = {"parameters": list(self.moved), "directions": columns}
        if self.covered:
            spec["covered"] = {name: [float(low), float(high)] for name, (low, high) in self.covered.items()}
        if self.unknowns:
            first = len(self.parameters) + 1
            rows = [row[: first + k] for k, row in enumerate(self.unknown_root.tolist())]
            spec["unknowns"] = {"parameters": list(self.unknowns), "covariance_root": rows}
        return spec


def _unknowns_of(spec: dict[str, Any] | None, count: int) -> tuple[list[str], NDArray[np.float64]]:
    """The key `unknowns`, behind `count` parameters."""
    if not spec:
        return [], np.zeros((0, 0))
    rows = spec["covariance_root"]
    root = np.zeros((len(rows), count + len(rows)))
    for k, row in enumerate(rows):
        root[k, : count + 1 + k] = row
    return list(spec["parameters"]), root


def _noise_of(spec: dict[str, Any]) -> dict[str, tuple[float, str]]:
    """The noise by kind; files of older versions have that of points, and of orientations."""
    if "noise" in spec:
        return {kind: (float(of["value"]), str(of["unit"])) for kind, of in spec["noise"].items()}
    old = {"position": (spec.get("sigma_mm"), "mm"), "orientation": (spec.get("sigma_deg"), "deg")}
    return {kind: (float(value), unit) for kind, (value, unit) in old.items() if value is not None}
