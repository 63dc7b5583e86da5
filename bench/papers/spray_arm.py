# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The spray robot that is measured in the study: its beams finer than those that are fitted, and no line of fastcal's.

Forward kinematics by the MDH rows of its robot file, written out here; the deflection by OpenSees: every unit in PARTS
Timoshenko elements, weights on their nodes, pins as nodes of their own, the telescope as a tube on rollers. The tip's
displacement and rotation move the tool, to first order.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import openseespy.opensees as ops
from numpy.typing import NDArray
from spray_unit9 import AREA_M2, I_A, I_B, SHEAR_PA, TORSION_M4, YOUNG_PA, roller_length

FloatArray = NDArray[np.float64]

PARTS = 6
SHEAR_SHARE = 0.44  # of a thin-walled square tube's area, what carries shear along one side
STIFF = 1e11  # N/m and N m/rad where the rollers hold the tube
G = 9.80665
PINS = {"unit3": ("end",), "unit5": ("start", "end")}


def motion(axis: int, turn: float = 0.0, shift: float = 0.0) -> FloatArray:
    """(4, 4) turn about [rad] and shift along [m] one axis."""
    T = np.eye(4)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    T[[a, b], [a, b]] = math.cos(turn)
    T[b, a], T[a, b] = math.sin(turn), -math.sin(turn)
    T[axis, 3] = shift
    return T


def frames(spec: dict[str, Any], q: FloatArray) -> list[FloatArray]:
    """Poses (4, 4) in the base: behind Rx(alpha) Tx(a) of each row, and behind all of it; two a row."""
    out, T = [], np.eye(4)
    for joint, position in zip(spec["joints"], q, strict=True):
        slides = joint["type"] == "prismatic"
        angle = {key: math.radians(joint[f"{key}_deg"]) for key in ("alpha", "theta", "beta")}
        T = T @ motion(0, angle["alpha"], joint["a_mm"] / 1000)
        out.append(T)
        T = T @ motion(2, angle["theta"] + (0 if slides else position), joint["d_mm"] / 1000 + slides * position)
        T = T @ motion(1, angle["beta"])
        out.append(T)
    return out


class FineArm:
    """The arm with given numbers in its file, its groups of beams stiffer by given factors.

    Args:
        spec: Canonical spec of the true arm.
        stiffness: Factor of each group, or of all.
    """

    def __init__(self, spec: dict[str, Any], stiffness: dict[str, float] | float = 1.0) -> None:
        self.spec = spec
        groups = {element["group"] for element in spec["structure"]["elements"]}
        self.stiffness = stiffness if isinstance(stiffness, dict) else dict.fromkeys(groups, stiffness)

    def points(self, q: FloatArray, payload: FloatArray) -> FloatArray:
        """(N, 3) where the tool is [m], in the base, without the noise of measuring."""
        return np.array([self._point(row, mass) for row, mass in zip(q, payload, strict=True)])

    def _point(self, q: FloatArray, payload: float) -> FloatArray:
        T = frames(self.spec, q)
        tool = np.asarray(self.spec["tool"]["xyz_mm"]) / 1000
        tip, load_at = (T[13] @ [*np.asarray(p) / 1000, 1] for p in ([300, 0, 0], self.spec["payload"]["com_mm"]))
        nodes = {"carriage": T[1], "turntable": T[3], "shoulder": T[5], "elbow": T[7], "neck": T[8]}
        nodes |= {"sleeve_end": T[9], "wrist": T[11]}
        at = {name: pose[:3, 3] for name, pose in nodes.items()}
        crank = 0.35 * T[7][:3, 1]
        at |= {"crank_end": at["shoulder"] + crank, "lever_end": at["elbow"] + crank, "gun_tip": tip[:3]}
        pin = T[5][:3, 2]
        R = np.column_stack([T[5][:3, 0], T[5][:3, 1], pin])  # the pins turn about z of these axes
        side = {"unit9": T[9][:3, 1], "unit10": T[13][:3, 2]}
        weight = payload * np.array([0, 0, -G])
        load = np.concatenate([weight, np.cross(load_at[:3] - tip[:3], weight)])
        ends = {element["name"]: side.get(element["name"], pin) for element in self.spec["structure"]["elements"]}
        u = self._deflect(
            {k: R.T @ v for k, v in at.items()},
            {k: R.T @ v for k, v in ends.items()},
            np.concatenate([R.T @ load[:3], R.T @ load[3:]]),
            R.T @ [0, 0, -G],
            q[5],
        )
        point = (T[13] @ [*tool, 1])[:3]
        return np.asarray(point + R @ u[:3] + np.cross(R @ u[3:], point - tip[:3]))

    def _deflect(
        self, at: dict[str, FloatArray], side: dict[str, FloatArray], load: FloatArray, gravity: FloatArray, d6: float
    ) -> FloatArray:
        """(6,) displacement and rotation of the gun's tip."""
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", 6)
        names = list(at)
        tag = {name: k for k, name in enumerate(names)}
        for name in names:
            ops.node(tag[name], *at[name].tolist())
        ops.fix(tag["carriage"], *[1] * 6)
        mass = np.zeros(len(names)).tolist()
        for element in self.spec["structure"]["elements"]:
            self._unit(element, at, side[element["name"]], tag, mass, d6)
        ops.timeSeries("Linear", 1)
        ops.pattern("Plain", 1, 1)
        for node, share in enumerate(mass):
            ops.load(node, *(share * gravity).tolist(), 0.0, 0.0, 0.0)
        ops.load(tag["gun_tip"], *load.tolist())
        ops.constraints("Transformation")
        ops.numberer("RCM")
        ops.system("BandGeneral")
        ops.algorithm("Linear")
        ops.integrator("LoadControl", 1.0)
        ops.analysis("Static", "-noWarnings")
        assert ops.analyze(1) == 0
        return np.array(ops.nodeDisp(tag["gun_tip"]))

    def _unit(
        self,
        element: dict[str, Any],
        at: dict[str, FloatArray],
        side: FloatArray,
        tag: dict[str, int],
        mass: list[float],
        d6: float,
    ) -> None:
        """PARTS elements from node to node; `side` lies in their x-z plane."""
        name, factor = element["name"], self.stiffness[element["group"]]
        start, end = at[element["start"]], at[element["end"]]
        chain = [tag[element["start"]]]
        for k in range(PARTS + 1):
            ends = {0: "start", PARTS: "end"}.get(k)
            own = ends is not None and (ends in PINS.get(name, ()) or (name == "unit9" and ends == "start"))
            if k == 0 and not own:
                continue
            if k == PARTS and not own:
                chain.append(tag[element["end"]])
                continue
            ops.node(len(mass), *(start + k / PARTS * (end - start)).tolist())
            chain = [len(mass)] if k == 0 else [*chain, len(mass)]
            if own and name != "unit9":
                ops.equalDOF(tag[element[ends]], len(mass), 1, 2, 3, 4, 5)
            mass.append(0.0)
        if name == "unit9":
            E, shear, A, J, Iy, Iz = YOUNG_PA, SHEAR_PA, AREA_M2, TORSION_M4, I_B, I_A
            along = (end - start) / np.linalg.norm(end - start)
            r = roller_length(0.6 + d6)
            for k, stiffness in enumerate((*[STIFF] * 4, factor * E * Iy / r, factor * E * Iz / r)):
                ops.uniaxialMaterial("Elastic", k + 1, stiffness)
            orient = [*along.tolist(), *np.cross(side, along).tolist()]
            root = (tag[element["start"]], chain[0])
            ops.element("zeroLength", 9999, *root, "-mat", *range(1, 7), "-dir", *range(1, 7), "-orient", *orient)
        else:
            section = self.spec["structure"]["sections"][element["section"]]
            E, shear, A = section["young_pa"], section["shear_pa"], section["area_m2"]
            J, Iy, Iz = section["torsion_m4"], section["inertia_y_m4"], section["inertia_z_m4"]
        number = int(name.removeprefix("unit"))
        ops.geomTransf("Linear", number, *side.tolist())
        areas = (SHEAR_SHARE * A, SHEAR_SHARE * A)
        for k, pair in enumerate(pairwise(chain)):
            numbers = (factor * E, factor * shear, A, J, Iy, Iz, *areas)
            ops.element("ElasticTimoshenkoBeam", 100 * number + k, *pair, *numbers, number)
            for node in pair:
                mass[node] += element["mass_kg"] / PARTS / 2
