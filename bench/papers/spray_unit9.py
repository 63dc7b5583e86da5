# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Unit 9 of the spray robot, the telescope: the stiffness that its table in spray_7dof.yaml samples.

    python bench/papers/spray_unit9.py        prints the table

A tube of length L = 0.6 m + d6 runs on rollers in the sleeve (unit 8), the more loosely the further it is out, and
turns in it with theta5; its section is a rectangle, stiffer along x5 than along y5. Flexibility of its end, the sleeve
held, bending along x5 (I = I_A) and alike along y5 (I_B), with the rollers' share r(L):
    F = ([L^3/3, L^2/2; L^2/2, L] + r [L^2, L; L, 1]) / (E I),   r = R (L / (L_MAX + OVERLAP - L)).
The sizes are this project's own; the paper prints none.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

YOUNG_PA, SHEAR_PA = 7.0e10, 2.6e10
AREA_M2, TORSION_M4 = 3.36e-3, 8.4e-6
I_A, I_B = 6.6e-6, 5.8e-6
L_0, L_MAX, OVERLAP, ROLLERS = 0.6, 1.4, 0.5, 0.05

# Chebyshev's places: polynomials through them stay near between them.
ANGLES_DEG = np.round(-170 * np.cos(np.pi * np.arange(9) / 8)) + 0.0
EXTENSIONS_MM = np.round(400 - 400 * np.cos(np.pi * np.arange(8) / 7))


def roller_length(length: float) -> float:
    """r(L) [m]: the rollers yield under a moment as much as r of the tube does."""
    return ROLLERS * length / (L_MAX + OVERLAP - length)


def unit9_stiffness(theta5: float, d6: float) -> NDArray[np.float64]:
    """(6, 6) K of the end with the start clamped; x along the tube, y along x5 at theta5 = 0; N, m, rad."""
    length = L_0 + d6
    own = np.array([[length**3 / 3, length**2 / 2], [length**2 / 2, length]])
    rollers = roller_length(length) * np.array([[length**2, length], [length, 1.0]])
    bending = YOUNG_PA * np.linalg.inv(own + rollers)
    K = np.zeros((6, 6))
    K[0, 0], K[3, 3] = YOUNG_PA * AREA_M2 / length, SHEAR_PA * TORSION_M4 / length
    K[np.ix_([1, 5], [1, 5])] = I_A * bending
    K[np.ix_([2, 4], [2, 4])] = I_B * bending * np.array([[1, -1], [-1, 1]])
    c, s = math.cos(theta5), math.sin(theta5)
    R = np.kron(np.eye(2), np.array([[1, 0, 0], [0, c, -s], [0, s, c]]))
    return R @ K @ R.T


def table() -> str:
    """The lists of the table in the robot file: places of the grid, and the upper triangles angle by angle."""
    lines = [f"angle_deg: {[int(x) for x in ANGLES_DEG]}", f"extension_mm: {[int(x) for x in EXTENSIONS_MM]}"]
    lines.append("matrices_si:")
    for angle in ANGLES_DEG:
        for extension in EXTENSIONS_MM:
            K = unit9_stiffness(math.radians(angle), extension / 1000)
            K[np.abs(K) < 1e-12 * K.max()] = 0
            lines.append("  - [" + ", ".join(f"{x:.7g}" for x in K[np.triu_indices(6)]) + "]")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table())
