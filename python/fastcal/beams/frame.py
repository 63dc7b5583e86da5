# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Frames of beams under their own weight and loads on their nodes, posture by posture.

The matrix displacement method, K u = f (J. S. Przemieniecki, Theory of Matrix Structural Analysis, 1968, chapters 5 and
6; the spray-painting paper's eq. 24 to 31 with its sign of the weight mended): straight prismatic elements,
Euler-Bernoulli or, with shear areas, Timoshenko, small displacements; weight is spread evenly along an element.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.beams.element_stiffness import ElementMatrices, ElementStiffness, StiffnessTable, as_numbers, rows
from fastcal.errors import InvalidInput

__all__ = ["BeamFrame", "StiffnessTable"]

GRAVITY_M_S2 = 9.80665
DIRECTIONS = {2: ("ux", "uy", "rz"), 3: ("ux", "uy", "uz", "rx", "ry", "rz")}

Hinge = tuple[int, int] | tuple[int, int, str]
Support = int | tuple[int, str]


class BeamFrame:
    """What a frame of beams is, apart from the positions of its nodes.

    E elements, M nodes, B displacements of a node. Of a section's numbers, one is meant for all elements.

    Args:
        elements: (start, end) nodes of each element; its local x runs from start to end.
        young_pa: E.
        area_m2: A.
        inertia_m4: I of a plane frame. It, and no other, makes the frame a plane one.
        inertia_y_m4: I_y of a space frame, bending in the local x-z plane.
        inertia_z_m4: I_z, bending in the local x-y plane.
        torsion_m4: Torsion constant J.
        shear_pa: G.
        mass_kg: Mass of each element.
        fixed: Supports: a node, held in every direction, or (node, "ux uy") with names from ux, uy, rz in the plane
            and ux, uy, uz, rx, ry, rz in space.
        hinges: (element, end), end 0 or 1: the element's end turns freely against its node. In space that leaves
            torsion connected; (element, end, "z") names the local axes it turns about, any of x, y, z.
        shear_area_m2: Effective shear area (kappa A) of a plane frame: Timoshenko elements. None: stiff in shear.
        shear_area_y_m2: In space, the area for forces along local y.
        shear_area_z_m2: In space, the area for forces along local z.
        stiffness: {element: K} for elements whose stiffness is no section's: a matrix (`beam_stiffness`), a
            StiffnessTable over the posture, or None where every call of `solve` brings its own.

    Raises:
        InvalidInput: It is no frame; the sentence names the element or node.
    """

    def __init__(
        self,
        elements: Iterable[tuple[int, int]],
        *,
        young_pa: ArrayLike,
        area_m2: ArrayLike,
        inertia_m4: ArrayLike | None = None,
        inertia_y_m4: ArrayLike | None = None,
        inertia_z_m4: ArrayLike | None = None,
        torsion_m4: ArrayLike | None = None,
        shear_pa: ArrayLike | None = None,
        mass_kg: ArrayLike = 0.0,
        fixed: Iterable[Support],
        hinges: Iterable[Hinge] = (),
        shear_area_m2: ArrayLike | None = None,
        shear_area_y_m2: ArrayLike | None = None,
        shear_area_z_m2: ArrayLike | None = None,
        stiffness: Mapping[int, ElementStiffness] | None = None,
    ) -> None:
        self.elements = _pairs(elements)
        self.node_count = 1 + max(max(pair) for pair in self.elements)
        self.dimension = 3 if inertia_m4 is None else 2
        space = {"inertia_y_m4": inertia_y_m4, "inertia_z_m4": inertia_z_m4, "torsion_m4": torsion_m4}
        space_only = {**space, "shear_area_y_m2": shear_area_y_m2, "shear_area_z_m2": shear_area_z_m2}
        if self.dimension == 2:
            _refuse(space_only, "a plane frame (inertia_m4)")
            _require({"shear_pa": shear_pa} if shear_area_m2 is not None else {}, "shear_area_m2")
        else:
            _refuse({"shear_area_m2": shear_area_m2}, "a space frame")
            _require({**space, "shear_pa": shear_pa}, "a space frame; a plane one needs inertia_m4")
        columns = {
            "young_pa": young_pa,
            "area_m2": area_m2,
            "inertia_z_m4": inertia_m4 if self.dimension == 2 else inertia_z_m4,
            "inertia_y_m4": inertia_y_m4,
            "torsion_m4": torsion_m4,
            "shear_pa": shear_pa,
            "shear_area_y_m2": shear_area_m2 if self.dimension == 2 else shear_area_y_m2,
            "shear_area_z_m2": shear_area_z_m2,
            "mass_kg": mass_kg,
        }
        sections = np.column_stack([self._per_element(name, value) for name, value in columns.items()])
        self._matrices = ElementMatrices(stiffness or {}, len(self.elements), self.freedom_count)
        self._solver = _core.BeamSolver(
            self.dimension,
            self.node_count,
            self.elements,
            np.ascontiguousarray(sections),
            [index in self._matrices.own for index in range(len(self.elements))],
            [self._hinge_bits(hinge) for hinge in hinges],
            [self._support_bits(support) for support in fixed],
        )

    @property
    def freedom_count(self) -> int:
        """B, displacements of a node: 3 in the plane (ux, uy, rz), 6 in space (ux, uy, uz, rx, ry, rz)."""
        return len(DIRECTIONS[self.dimension])

    def solve(
        self,
        nodes: ArrayLike,
        load: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
        *,
        up: ArrayLike | None = None,
        angle_rad: ArrayLike | None = None,
        extension_m: ArrayLike | None = None,
        stiffness: Mapping[int, ArrayLike] | None = None,
        scale: ArrayLike = 1.0,
        threads: int = 1,
        out: FloatArray | None = None,
    ) -> FloatArray:
        """Displacements of the nodes in N postures.

        Args:
            nodes: (N, M, 2) or (N, M, 3) positions [m].
            load: Forces and moments on the nodes in global axes, (N, M, 3) or (N, M, 6) [N, N m]; (M, 3) or (M, 6)
                for all postures.
            gravity: (2,) or (3,), or one for each posture [m/s^2]. None: 9.80665 along -y in the plane, -z in space.
            up: In space, a direction in the local x-z plane on the side of +z, that distinguishes y from z: (3,),
                (E, 3) or (N, E, 3). None: global z; an element whose y and z are alike needs none.
            angle_rad: (N,) where a StiffnessTable is to be read.
            extension_m: (N,) likewise.
            stiffness: {element: K} or {element: (N, ...) K} for elements that were given with None, or instead.
            scale: Factor on the stiffness of each element, (E,).
            threads: How many threads share the postures; the result is the same, bit for bit.
            out: (N, M, B) float64 in C order to write to.

        Returns:
            (N, M, B) [m, rad] in global axes; 0 where held, and for a rotation of a node that every element's hinge
            leaves free.

        Raises:
            InvalidInput: Wrong shapes, or a frame that is a mechanism at some posture: node and direction are named.
        """
        given = self._given(nodes, load, gravity, up, angle_rad, extension_m, stiffness, threads)
        displacement = self._output(out, (len(given[0]), self.node_count, self.freedom_count))
        self._solver.solve(*given, list(self._per_element("scale", scale)), threads, displacement)
        return displacement

    def solve_with_derivative(
        self,
        nodes: ArrayLike,
        groups: Sequence[Iterable[int]],
        *,
        scale: ArrayLike = 1.0,
        threads: int = 1,
        **given: Any,
    ) -> tuple[FloatArray, FloatArray]:
        """Displacements and their derivatives by stiffness factors: K du/ds = -K_group u.

        Args:
            nodes: As in `solve`, and so are scale, threads and the other keywords.
            groups: Elements of each group; its factor s multiplies their stiffness on top of `scale`, s = 1.
            scale: Factor on the stiffness of each element, (E,).
            threads: As in `solve`.
            given: load, gravity, up, angle_rad, extension_m, stiffness of `solve`.

        Returns:
            (N, M, B) displacements and (N, M, B, G) derivatives by the G factors.
        """
        group = np.full(len(self.elements), -1)
        for column, members in enumerate(groups):
            for element in members:
                if not 0 <= element < len(group) or group[element] >= 0:
                    raise InvalidInput(f"group {column} holds element {element}, which does not exist or is in a group")
                group[element] = column
        keywords = {name: given.pop(name, None) for name in _SOLVE_KEYWORDS}
        if given:
            raise InvalidInput(f"solve knows no {', '.join(given)}")
        arrays = self._given(nodes, **keywords, threads=threads)
        displacement = np.empty((len(arrays[0]), self.node_count, self.freedom_count))
        derivative = np.empty((*displacement.shape, len(groups)))
        factors = list(self._per_element("scale", scale))
        self._solver.solve_with_derivative(
            *arrays, factors, group.tolist(), len(groups), threads, displacement, derivative
        )
        return displacement, derivative

    def __repr__(self) -> str:
        return f"BeamFrame({self.dimension}D, {self.node_count} nodes, {len(self.elements)} elements)"

    def _given(
        self,
        nodes: ArrayLike,
        load: ArrayLike | None,
        gravity: ArrayLike | None,
        up: ArrayLike | None,
        angle_rad: ArrayLike | None,
        extension_m: ArrayLike | None,
        stiffness: Mapping[int, ArrayLike] | None,
        threads: int,
    ) -> tuple[FloatArray, FloatArray | None, FloatArray, FloatArray | None, FloatArray | None]:
        """The arrays of a call, checked, as the core takes them."""
        D, M, B = self.dimension, self.node_count, self.freedom_count
        if threads < 1:
            raise InvalidInput(f"threads must be at least 1, got {threads}")
        positions = as_numbers("nodes", nodes)
        if positions.ndim != 3 or positions.shape[1:] != (M, D):
            raise InvalidInput(f"nodes must have shape (N, {M}, {D}), got {positions.shape}")
        count = len(positions)
        weight = (0.0,) * (D - 1) + (-GRAVITY_M_S2,) if gravity is None else gravity
        if up is not None:
            if D == 2:
                raise InvalidInput("up is for space frames")
            direction = as_numbers("up", up)
            up = np.broadcast_to(direction, (len(self.elements), 3)) if direction.shape == (3,) else direction
        return (
            positions,
            None if load is None else rows("load", load, (M, B), count),
            rows("gravity", weight, (D,), count),
            None if up is None else rows("up", up, (len(self.elements), 3), count),
            self._matrices.at(count, angle_rad, extension_m, stiffness or {}),
        )

    def _per_element(self, name: str, value: ArrayLike | None) -> FloatArray:
        numbers = as_numbers(name, 0.0 if value is None else value)
        if numbers.shape not in ((), (len(self.elements),)):
            raise InvalidInput(f"{name} must be one number or have shape ({len(self.elements)},), got {numbers.shape}")
        return np.broadcast_to(numbers, len(self.elements))

    def _output(self, out: FloatArray | None, shape: tuple[int, ...]) -> FloatArray:
        if out is None:
            return np.empty(shape)
        if out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous:
            raise InvalidInput(f"out must be a float64 array in C order of shape {shape}, got {out.dtype} {out.shape}")
        return out

    def _hinge_bits(self, hinge: Hinge) -> tuple[int, int, int]:
        axes = str(hinge[2]) if len(hinge) == 3 else ("z" if self.dimension == 2 else "yz")
        if not axes or set(axes) - set("xyz"):
            raise InvalidInput(f"a hinge of element {hinge[0]} turns about some of x, y, z, got {axes!r}")
        return int(hinge[0]), int(hinge[1]), sum(1 << "xyz".index(axis) for axis in set(axes))

    def _support_bits(self, support: Support) -> tuple[int, int]:
        names = DIRECTIONS[self.dimension]
        if not isinstance(support, tuple):
            return int(support), (1 << len(names)) - 1
        held = support[1].split()
        if not held or set(held) - set(names):
            raise InvalidInput(f"the support at node {support[0]} may hold {' '.join(names)}, got {support[1]!r}")
        return int(support[0]), sum(1 << names.index(name) for name in set(held))


_SOLVE_KEYWORDS = ("load", "gravity", "up", "angle_rad", "extension_m", "stiffness")


def _pairs(elements: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    pairs = [(int(start), int(end)) for start, end in elements]
    if not pairs:
        raise InvalidInput("a frame needs at least one element")
    return pairs


def _require(values: Mapping[str, object], what: str) -> None:
    missing = [name for name, value in values.items() if value is None]
    if missing:
        raise InvalidInput(f"{', '.join(missing)} must be given for {what}")


def _refuse(values: Mapping[str, object], what: str) -> None:
    given = [name for name, value in values.items() if value is not None]
    if given:
        raise InvalidInput(f"{', '.join(given)} has no meaning in {what}")
