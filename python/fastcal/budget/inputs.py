# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Inputs of a budget: a cause, its standard uncertainty, and the distribution of what it may be (JCGM 100, 4.3)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fastcal.arrays import FloatArray

# Kind: the quantities that its size may be given in, as fastcal.units names them; "share" and "per_length" are plain.
KINDS: dict[str, tuple[str, ...]] = {
    "range": ("length", "per_length"),
    "angle": ("length", "per_length", "angle"),
    "position": ("length",),
    "target": ("length",),
    "orientation": ("angle",),
    "temperature": ("temperature",),
    "payload": ("mass",),
    "masses": ("share",),
}
# Half width of a distribution in standard deviations: GUM 4.3.7, 4.3.9 and, for the arcsine, H.1.3.4.
HALF_WIDTHS = {"rectangular": math.sqrt(3), "triangular": math.sqrt(6), "arcsine": math.sqrt(2)}
DISTRIBUTIONS = ("normal", *HALF_WIDTHS)
OF_EACH_POSE = ("angle", "position", "orientation")  # unless stated otherwise, drawn again at each pose

_DRAWS: dict[str, Callable[[np.random.Generator, tuple[int, ...]], FloatArray]] = {
    "normal": lambda random, shape: random.standard_normal(shape),
    "rectangular": lambda random, shape: random.uniform(-math.sqrt(3), math.sqrt(3), shape),
    "triangular": lambda random, shape: random.triangular(-math.sqrt(6), 0.0, math.sqrt(6), shape),
    "arcsine": lambda random, shape: math.sqrt(2) * np.sin(random.uniform(-math.pi, math.pi, shape)),
}


@dataclass(frozen=True)
class Input:
    """One cause of error that the measurements themselves don't show.

    Attributes:
        name: As the file calls it.
        kind: One of KINDS.
        quantity: In which its size is given, one of those of its kind.
        standard: Its standard uncertainty: SI, [1] per length or as a share.
        distribution: normal, rectangular, triangular or arcsine.
        freedom: Degrees of freedom of `standard`; infinite where it is known well.
        common: The same at all poses, or drawn again at each?
        expansion: Of the arm, for a temperature [1/K].
    """

    name: str
    kind: str
    quantity: str
    standard: float
    distribution: str = "normal"
    freedom: float = math.inf
    common: bool = True
    expansion: float = 0.0


@dataclass(frozen=True, eq=False)
class Budget:
    """Inputs, where the instrument is, and how sure a statement is to be.

    Attributes:
        inputs: The causes.
        instrument: (3,) its place in the measuring frame [m].
        level: Probability that an interval is to cover.
    """

    inputs: tuple[Input, ...] = ()
    instrument: FloatArray = field(default_factory=lambda: np.zeros(3))
    level: float = 0.95


def drawn(input_: Input, random: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """Amplitudes in standard deviations (variance 1) of an input's distribution.

    With few degrees of freedom, a normal one becomes Student's t, unscaled, as JCGM 101 (6.4.9.5) has it.
    """
    if input_.distribution == "normal" and math.isfinite(input_.freedom):
        return np.asarray(random.standard_t(input_.freedom, shape))
    return _DRAWS[input_.distribution](random, shape)
