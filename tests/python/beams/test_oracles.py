# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Random frames against two programs that share nothing with fastcal: PyNite and OpenSees.

Every frame is a welded tree with bars that close loops, hinged where that leaves it rigid, loaded on every node and
with gravity in any direction. The agreement asked for is 1e-8 of the largest displacement; rotations are compared as
movements over one metre, the size of the frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from Pynite import FEModel3D

from fastcal.beams.frame import BeamFrame

try:
    import openseespy.opensees as ops
except ImportError:  # not free software: ./setup --test installs it, and no extra but its own
    ops = None

Array = NDArray[np.float64]
TOLERANCE = 1e-8
FRAMES = 200


@dataclass(frozen=True)
class Frame:
    dimension: int
    nodes: Array
    elements: list[tuple[int, int]]
    hinges: list[tuple[int, int]]
    young: Array
    area: Array
    inertia_y: Array
    inertia_z: Array
    torsion: Array
    shear_area: Array | None
    mass: Array
    fixed: list[int]
    load: Array
    gravity: Array
    up: Array

    SHEAR = 8e10

    def solve(self) -> Array:
        common = {
            "elements": self.elements,
            "young_pa": self.young,
            "area_m2": self.area,
            "mass_kg": self.mass,
            "fixed": self.fixed,
            "hinges": self.hinges,
        }
        if self.dimension == 2:
            shear = {} if self.shear_area is None else {"shear_pa": self.SHEAR, "shear_area_m2": self.shear_area}
            frame = BeamFrame(**common, inertia_m4=self.inertia_z, **shear)
            return frame.solve(self.nodes[None], self.load, self.gravity)[0]
        As = self.shear_area
        areas = {} if As is None else {"shear_area_y_m2": As, "shear_area_z_m2": 0.7 * As}
        frame = BeamFrame(
            **common,
            inertia_y_m4=self.inertia_y,
            inertia_z_m4=self.inertia_z,
            torsion_m4=self.torsion,
            shear_pa=self.SHEAR,
            **areas,
        )
        return frame.solve(self.nodes[None], self.load, self.gravity, up=self.up)[0]

    def released(self, element: int, end: int) -> bool:
        return (element, end) in self.hinges


def random_frame(seed: int, dimension: int, shear: bool = False) -> Frame:
    """A welded tree from node 0, and bars closing loops; each bar may be hinged at either end or at both.

    In the plane a leaf of the tree that such a bar holds at an angle is hinged to its parent, half of the time.
    """
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 11))
    while True:
        nodes = rng.uniform(-1, 1, (count, dimension))
        elements = [(int(rng.integers(0, node)), node) for node in range(1, count)]
        tree = len(elements)
        for _ in range(int(rng.integers(1, 5))):
            a, b = sorted(int(i) for i in rng.choice(count, 2, replace=False))
            if (a, b) not in elements:
                elements.append((a, b) if rng.random() < 0.5 else (b, a))
        lengths = [np.linalg.norm(nodes[a] - nodes[b]) for a, b in elements]
        if min(lengths) > 0.2:
            break
    hinges = [(e, end) for e in range(tree, len(elements)) for end in (0, 1) if rng.random() < 0.6]
    if dimension == 2:
        hinges += [(e, 0) for e in range(tree) if propped(nodes, elements, e, tree) and rng.random() < 0.5]
    E = len(elements)
    up = rng.normal(size=(E, 3))
    B = 3 if dimension == 2 else 6
    return Frame(
        dimension=dimension,
        nodes=nodes,
        elements=elements,
        hinges=hinges,
        young=rng.uniform(0.7e11, 2.1e11, E),
        area=rng.uniform(1e-3, 5e-3, E),
        inertia_y=rng.uniform(1e-6, 9e-6, E),
        inertia_z=rng.uniform(1e-6, 9e-6, E),
        torsion=rng.uniform(1e-6, 9e-6, E),
        shear_area=rng.uniform(5e-4, 2e-3, E) if shear else None,
        mass=rng.uniform(1, 60, E),
        fixed=[0] + ([count - 1] if rng.random() < 0.3 else []),
        load=rng.normal(size=(count, B)) * 300,
        gravity=rng.normal(size=dimension) * 6,
        up=up,
    )


def is_leaf(elements: list[tuple[int, int]], node: int, tree: int) -> bool:
    return all(node != start for start, _ in elements[:tree])


def propped(nodes: Array, elements: list[tuple[int, int]], leaf: int, tree: int) -> bool:
    """Whether the end of a tree's element is a leaf that a bar holds well against turning about the element's start."""
    start, end = elements[leaf]
    for bar in elements[tree:]:
        others = set(bar) - {end}
        if not is_leaf(elements, end, tree) or len(others) == 2 or is_leaf(elements, others.pop(), tree):
            continue
        own, other = nodes[end] - nodes[start], nodes[bar[1]] - nodes[bar[0]]
        if abs(own[0] * other[1] - own[1] * other[0]) > 0.4 * np.linalg.norm(own) * np.linalg.norm(other):
            return True
    return False


def pynite(frame: Frame) -> Array:
    """PyNite has space frames only: a plane one is held out of its plane."""
    plane = frame.dimension == 2
    model = FEModel3D()
    zero = [] if not plane else [0.0]
    for i, node in enumerate(frame.nodes):
        model.add_node(f"N{i}", *[float(x) for x in node], *zero)
        held = i in frame.fixed
        model.def_support(f"N{i}", held, held, held or plane, held or plane, held or plane, held)
        force = frame.load[i]
        directions = ("FX", "FY", "MZ") if plane else ("FX", "FY", "FZ", "MX", "MY", "MZ")
        for direction, value in zip(directions, force, strict=True):
            model.add_node_load(f"N{i}", direction, float(value))
    for e, (start, end) in enumerate(frame.elements):
        model.add_material(f"E{e}", float(frame.young[e]), frame.SHEAR, 0.3, 0.0)
        iy = frame.inertia_z[e] if plane else frame.inertia_y[e]
        model.add_section(f"S{e}", float(frame.area[e]), float(iy), float(frame.inertia_z[e]), float(frame.torsion[e]))
        model.add_member(f"M{e}", f"N{start}", f"N{end}", f"E{e}", f"S{e}")
        i, j = frame.released(e, 0), frame.released(e, 1)
        model.def_releases(f"M{e}", Ryi=i, Rzi=i, Ryj=j, Rzj=j)
        length = float(np.linalg.norm(frame.nodes[end] - frame.nodes[start]))
        for direction, g in zip(("FX", "FY", "FZ"), frame.gravity, strict=False):
            w = float(frame.mass[e] * g / length)
            model.add_member_dist_load(f"M{e}", direction, w, w)
    model.analyze_linear()
    names = ("DX", "DY", "RZ") if plane else ("DX", "DY", "DZ", "RX", "RY", "RZ")
    return np.array([[getattr(model.nodes[f"N{i}"], d)["Combo 1"] for d in names] for i in range(len(frame.nodes))])


def pynite_up(frame: Frame) -> Array:
    """The local z axes that PyNite gives its members."""
    model = FEModel3D()
    for i, node in enumerate(frame.nodes):
        model.add_node(f"N{i}", *[float(x) for x in node])
    model.add_material("E", 1.0, 1.0, 0.3, 0.0)
    model.add_section("S", 1.0, 1.0, 1.0, 1.0)
    for e, (start, end) in enumerate(frame.elements):
        model.add_member(f"M{e}", f"N{start}", f"N{end}", "E", "S")
    return np.array([np.asarray(model.members[f"M{e}"].T())[2, :3] for e in range(len(frame.elements))])


def opensees(frame: Frame) -> Array:
    ops.wipe()
    freedoms = frame.load.shape[1]
    ops.model("basic", "-ndm", frame.dimension, "-ndf", freedoms)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for i, node in enumerate(frame.nodes):
        ops.node(i, *node.tolist())
        ops.load(i, *frame.load[i].tolist())
        if i in frame.fixed:
            ops.fix(i, *[1] * freedoms)
    for e in range(len(frame.elements)):
        opensees_element(frame, e)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("FullGeneral")
    ops.algorithm("Linear")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    assert ops.analyze(1) == 0
    displacement = np.array([ops.nodeDisp(i) for i in range(len(frame.nodes))])
    ops.wipe()
    return displacement


def opensees_element(frame: Frame, e: int) -> None:
    """Element, orientation and weight; the weight is given along the element's own axes."""
    plane = frame.dimension == 2
    ends, G = frame.elements[e], frame.SHEAR
    numbers = (frame.young, frame.area, frame.inertia_y, frame.inertia_z, frame.torsion)
    E, A, Iy, Iz, J = (float(number[e]) for number in numbers)
    code = frame.released(e, 0) + 2 * frame.released(e, 1)
    ops.geomTransf("Linear", e, *([] if plane else frame.up[e].tolist()))
    if frame.shear_area is not None:
        As = float(frame.shear_area[e])
        section = (E, G, A, Iz, As) if plane else (E, G, A, J, Iy, Iz, As, 0.7 * As)
        ops.element("ElasticTimoshenkoBeam", e, *ends, *section, e)
    elif plane:
        ops.element("elasticBeamColumn", e, *ends, A, E, Iz, e, "-release", code)
    else:
        releases = ("-releasez", code, "-releasey", code)
        ops.element("elasticBeamColumn", e, *ends, A, E, G, J, Iy, Iz, e, *releases)
    lever = frame.nodes[ends[1]] - frame.nodes[ends[0]]
    length = float(np.linalg.norm(lever))
    x, w = lever / length, frame.mass[e] / length * frame.gravity
    if plane:
        across = [float(w @ (-x[1], x[0]))]
    else:
        y = np.cross(frame.up[e], x)
        y /= np.linalg.norm(y)
        across = [float(w @ y), float(w @ np.cross(x, y))]
    ops.eleLoad("-ele", e, "-type", "-beamUniform", *across, float(w @ x))


def assert_agree(ours: Array, theirs: Array) -> None:
    assert np.abs(ours - theirs).max() <= TOLERANCE * np.abs(theirs).max()


@pytest.mark.parametrize("dimension", [2, 3])
def test_random_frames_agree_with_pynite(dimension: int) -> None:
    hinged = 0
    for seed in range(FRAMES):
        frame = random_frame(seed, dimension)
        if dimension == 3:
            frame.up[:] = pynite_up(frame)
        assert_agree(frame.solve(), pynite(frame))
        hinged += len(frame.hinges) > 0
    assert hinged > FRAMES / 2


@pytest.mark.parametrize("shear", [False, True], ids=["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.skipif(ops is None, reason="openseespy is not installed: pip install 'fastcal[opensees]'")
def test_random_frames_agree_with_opensees(dimension: int, shear: bool) -> None:
    for seed in range(FRAMES):
        frame = random_frame(1000 + seed, dimension, shear)
        if shear:
            frame.hinges.clear()  # its Timoshenko element has none
        assert_agree(frame.solve(), opensees(frame))
