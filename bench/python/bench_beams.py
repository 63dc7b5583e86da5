# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A frame of ten nodes and ten beams with a parallelogram, a new posture each time, beside OpenSees and PyNite.

    python bench/python/bench_beams.py [--json FILE] [--repeats N]

Everybody builds the posture and solves it in the same run: own weight of every beam and 165 kg at the tip, the
parallelogram's rod pinned at both ends and the upper arm at the elbow. The peers are driven as their manuals do, a
model a posture; fastcal takes its postures in one call (and, told apart, in one call each). PyNite has space frames
only, so its plane frame is held out of its plane. CPU time of one thread, best of the repeats; the tips must agree to
1e-10 of their displacement.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import openseespy.opensees as ops
from numpy.typing import NDArray
from Pynite import FEModel3D

from fastcal.beams.frame import BeamFrame

Array = NDArray[np.float64]
# Post, shoulder, upper arm, crank, rod, lever (these four the parallelogram), forearm, hinge, telescope, gun.
ELEMENTS = [(0, 1), (1, 2), (2, 3), (2, 4), (4, 5), (5, 3), (3, 6), (6, 7), (7, 8), (8, 9)]
HINGES = [(4, 0), (4, 1), (2, 1)]  # both ends of the rod, and the upper arm at the elbow
YOUNG, SHEAR, AREA, INERTIA, TORSION, MASS, TIP, G = 2.1e11, 8.1e10, 4e-3, 8e-6, 1.2e-5, 30.0, 165.0, 9.80665
GOALS = {"plane_over_opensees": 25.0, "plane_over_pynite": 1500.0, "space_per_second": 40_000.0}


def postures(count: int) -> Array:
    """Nodes (count, 10, 2): post, shoulder, upper arm with its parallelogram, forearm with a telescope."""
    rng = np.random.default_rng(5)
    upper, fore, reach = rng.uniform(0.9, 1.9, count), rng.uniform(-0.6, 0.4, count), rng.uniform(0.5, 1.0, count)

    def along(angle: Array, length: Array | float) -> Array:
        return np.stack([np.cos(angle) * length, np.sin(angle) * length], axis=-1)

    nodes = np.zeros((count, 10, 2))
    nodes[:, 1], nodes[:, 2] = (0, 0.6), (0.3, 0.9)
    nodes[:, 3] = nodes[:, 2] + along(upper, 1.6)
    nodes[:, 4] = nodes[:, 2] - along(fore, 0.35)
    nodes[:, 5] = nodes[:, 3] - along(fore, 0.35)
    nodes[:, 6] = nodes[:, 3] + along(fore, 0.4)
    nodes[:, 7] = nodes[:, 6] + along(fore, 0.6)
    nodes[:, 8] = nodes[:, 7] + along(fore, reach)
    nodes[:, 9] = nodes[:, 8] + along(fore - 0.5, 0.2)
    return nodes


def plane_frame() -> tuple[BeamFrame, Array]:
    frame = BeamFrame(
        ELEMENTS, young_pa=YOUNG, area_m2=AREA, inertia_m4=INERTIA, mass_kg=MASS, fixed=[0], hinges=HINGES
    )
    load = np.zeros((10, 3))
    load[9, 1] = -TIP * G
    return frame, load


def space_frame() -> tuple[BeamFrame, Array]:
    """The same topology with unlike I_y and I_z; its pins turn about the normal of the linkage, local z."""
    frame = BeamFrame(
        ELEMENTS,
        young_pa=YOUNG,
        area_m2=AREA,
        inertia_y_m4=2 * INERTIA,
        inertia_z_m4=INERTIA,
        torsion_m4=TORSION,
        shear_pa=SHEAR,
        mass_kg=MASS,
        fixed=[0],
        hinges=[(element, end, "z") for element, end in HINGES],
    )
    load = np.zeros((10, 6))
    load[9, 2] = -TIP * G
    return frame, load


def by_opensees(nodes: Array) -> Array:
    tips = np.empty((len(nodes), 2))
    for row, posture in enumerate(nodes):
        ops.wipe()
        ops.model("basic", "-ndm", 2, "-ndf", 3)
        for i, (x, y) in enumerate(posture.tolist()):
            ops.node(i, x, y)
        ops.fix(0, 1, 1, 1)
        ops.geomTransf("Linear", 1)
        ops.timeSeries("Linear", 1)
        ops.pattern("Plain", 1, 1)
        for e, (start, end) in enumerate(ELEMENTS):
            code = ((e, 0) in HINGES) + 2 * ((e, 1) in HINGES)
            released = ("-release", code) if code else ()
            ops.element("elasticBeamColumn", e, start, end, AREA, YOUNG, INERTIA, 1, *released)
            lever = posture[end] - posture[start]
            length = float(np.hypot(*lever))
            across, along = (-MASS * G / length**2 * lever).tolist()
            ops.eleLoad("-ele", e, "-type", "-beamUniform", across, along)
        ops.load(9, 0.0, -TIP * G, 0.0)
        ops.constraints("Plain")
        ops.numberer("RCM")
        ops.system("ProfileSPD")
        ops.algorithm("Linear")
        ops.integrator("LoadControl", 1.0)
        ops.analysis("Static", "-noWarnings")
        ops.analyze(1)
        tips[row] = ops.nodeDisp(9)[:2]
    ops.wipe()
    return tips


def by_pynite(nodes: Array) -> Array:
    tips = np.empty((len(nodes), 2))
    for row, posture in enumerate(nodes):
        model = FEModel3D()
        model.add_material("steel", YOUNG, SHEAR, 0.3, 0.0)
        model.add_section("section", AREA, INERTIA, INERTIA, TORSION)
        for i, (x, y) in enumerate(posture.tolist()):
            model.add_node(f"N{i}", x, y, 0.0)
            model.def_support(f"N{i}", i == 0, i == 0, True, True, True, i == 0)
        for e, (start, end) in enumerate(ELEMENTS):
            model.add_member(f"M{e}", f"N{start}", f"N{end}", "steel", "section")
            i, j = (e, 0) in HINGES, (e, 1) in HINGES
            model.def_releases(f"M{e}", Ryi=i, Rzi=i, Ryj=j, Rzj=j)
            w = -MASS * G / float(np.hypot(*(posture[end] - posture[start])))
            model.add_member_dist_load(f"M{e}", "FY", w, w)
        model.add_node_load("N9", "FY", -TIP * G)
        model.analyze_linear(sparse=False)
        tips[row] = [model.nodes["N9"].DX["Combo 1"], model.nodes["N9"].DY["Combo 1"]]
    return tips


def per_second(run: Callable[[Array], Array], nodes: Array, repeats: int) -> tuple[float, Array]:
    """Postures solved in a second of CPU time, best of the repeats, and the answer."""
    best, answer = np.inf, np.zeros(0)
    for _ in range(repeats):
        start = time.process_time()
        answer = run(nodes)
        best = min(best, time.process_time() - start)
    return len(nodes) / best, answer


def measure(repeats: int) -> dict[str, Any]:
    plane, load = plane_frame()
    space, space_load = space_frame()
    nodes = postures(20_000)
    out, space_out = np.empty((len(nodes), 10, 3)), np.empty((len(nodes), 10, 6))
    upright = np.zeros((*nodes.shape[:2], 3))
    upright[..., 0], upright[..., 2] = nodes[..., 0], nodes[..., 1]

    def one_by_one(some: Array) -> Array:
        return np.array([plane.solve(some[i : i + 1], load)[0, 9, :2] for i in range(len(some))])

    result: dict[str, Any] = {}
    result["plane"], displacement = per_second(lambda p: plane.solve(p, load, out=out), nodes, repeats)
    result["plane, a call a posture"], _ = per_second(one_by_one, nodes[:2000], repeats)
    result["space"], spatial = per_second(
        lambda p: space.solve(p, space_load, up=(0, 1, 0), out=space_out), upright, repeats
    )
    result["opensees"], by_ops = per_second(by_opensees, nodes[:1000], repeats)
    result["pynite"], by_nite = per_second(by_pynite, nodes[:20], repeats)
    tips = displacement[:, 9, :2]
    apart = {"opensees": by_ops, "pynite": by_nite, "space": spatial[:, 9, [0, 2]]}
    result["apart"] = {
        name: float(np.abs(tips[: len(other)] - other).max() / np.abs(other).max()) for name, other in apart.items()
    }
    result["plane_over_opensees"] = result["plane"] / result["opensees"]
    result["plane_over_pynite"] = result["plane"] / result["pynite"]
    result["space_per_second"] = result["space"]
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    result = measure(options.repeats)
    for name in ("plane", "plane, a call a posture", "space", "opensees", "pynite"):
        print(f"{name:28} {result[name]:12,.0f} postures/s")
    for name, goal in GOALS.items():
        print(f"{name:28} {result[name]:12,.0f}   goal {goal:,.0f}   {'met' if result[name] >= goal else 'MISSED'}")
    print("tips apart, relative:", ", ".join(f"{name} {value:.1e}" for name, value in result["apart"].items()))
    if options.json:
        text = json.dumps({"machine": platform.processor() or platform.machine(), **result}, indent=1) + "\n"
        options.json.write_text(text, encoding="utf-8")
    if max(result["apart"].values()) > 1e-10:
        raise SystemExit("the solvers do not agree to 1e-10")


if __name__ == "__main__":
    main()
