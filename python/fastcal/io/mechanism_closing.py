# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a file with loops does not say: a posture in which they close, and passive joints that no loop places.

e(q) = 0 by Gauss-Newton, e the pins' distances [m] and turns [rad] that are held; the rank of de/dq_passive.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.io.mechanism import EVERY, JointOf, Mechanism

_INDEPENDENT = 1e-6  # of the largest column
_CLOSED = 1e-9  # [m], [rad]
_STEPS = 200
_LONGEST = 0.2  # [rad], [m] of a step


class _Equations:
    """Of all pins, by joints of one degree of freedom from where the file draws them."""

    def __init__(self, of: Mechanism) -> None:
        self.of = of
        self.joints = [joint for joint in of.joints if joint.kind in ("revolute", "prismatic")]
        self.way: dict[str, list[JointOf]] = {}  # joints to each link
        left = list(of.joints)
        for root in [link for link in of.links if link not in {joint.child for joint in of.joints}]:
            self.way[root] = []
        self.tree: list[JointOf] = []
        while ready := [joint for joint in left if joint.parent in self.way]:
            for joint in ready:
                left.remove(joint)
                self.tree.append(joint)
                self.way[joint.child] = [*self.way[joint.parent], joint]

    def at(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """E (m,) and J (m, n) at positions q (n,)."""
        position = dict(zip(map(id, self.joints), q, strict=True))
        poses = {link: np.eye(4) for link, way in self.way.items() if not way}
        mounts: dict[int, FloatArray] = {}
        for joint in self.tree:
            T = poses[joint.parent] @ joint.T_parent_joint
            mounts[id(joint)] = T
            poses[joint.child] = T @ joint.motion(position.get(id(joint), 0.0)) @ joint.T_joint_child
        values, slopes = [], []
        for pins in self.of.pins:
            S, E = (poses[link] @ T for link, T in zip(pins.links, pins.T_link_pin, strict=True))
            turn = _core.log_so3(S[:3, :3].T @ E[:3, :3])
            ends = [{id(joint) for joint in self.way[link]} for link in pins.links]
            J = np.zeros((6, len(self.joints)))
            for k, joint in enumerate(self.joints):
                sign = (id(joint) in ends[1]) - (id(joint) in ends[0])
                T = mounts[id(joint)]
                axis = sign * (T[:3, :3] @ joint.axis)
                if joint.kind == "prismatic":
                    J[:3, k] = axis
                else:
                    J[:3, k], J[3:, k] = np.cross(axis, E[:3, 3] - T[:3, 3]), axis
            rows = [EVERY.index(part) for part in pins.fixed]
            values.append(np.concatenate([S[:3, :3].T @ (E[:3, 3] - S[:3, 3]), turn])[rows])
            slopes.append(np.vstack([S[:3, :3].T @ J[:3], S[:3, :3].T @ J[3:]])[rows])
        return np.concatenate(values), np.vstack(slopes)

    def closed(self, q: FloatArray, moved: list[int]) -> tuple[FloatArray, float]:
        """Q with the joints `moved` where the pins meet, and the largest distance or turn that is left."""
        q = q.copy()
        for _ in range(_STEPS):
            e, J = self.at(q)
            if np.abs(e).max() < _CLOSED:
                break
            step = -np.linalg.lstsq(J[:, moved], e, rcond=_INDEPENDENT)[0]
            q[moved] += step * min(1.0, _LONGEST / max(float(np.abs(step).max()), np.finfo(float).tiny))
        return q, float(np.abs(self.at(q)[0]).max())


def close(of: Mechanism, motors: Collection[str]) -> None:
    """Gives joints a start at which balls and welds close, and fixes passive ones that nothing places.

    Passive joints are moved first, and the motors too where these alone close nothing. A passive joint that no loop
    places, as the spin of a rod between two balls, stays where it is, which a note says.
    """
    if not of.pins:
        return
    equations = _Equations(of)
    joints = equations.joints
    passive = [k for k, joint in enumerate(joints) if joint.name not in motors]
    q = np.array([joint.start for joint in joints])
    found, gap = equations.closed(q, passive)
    if gap > _CLOSED:
        found, gap = equations.closed(q, list(range(len(joints))))
    q = found if gap <= _CLOSED else q
    placed = _independent(equations.at(q)[1][:, passive])
    loose = [joints[k] for at, k in enumerate(passive) if at not in placed]
    for joint, value in zip(joints, q.tolist(), strict=True):
        joint.start = float(value)
    for joint in loose:
        joint.T_parent_joint = joint.T_parent_joint @ joint.motion(joint.start)
        joint.kind = "fixed"
    if loose:
        of.notes.append(f"no loop places joints {', '.join(j.name for j in loose)}; they are held where they stand")


def _independent(J: FloatArray) -> list[int]:
    """Columns of which no other ones are the sum, the longest first."""
    A = J.copy()
    chosen: list[int] = []
    least = _INDEPENDENT * max(float(np.linalg.norm(A, axis=0).max(initial=0.0)), np.finfo(float).tiny)
    for _ in range(min(A.shape)):
        size = np.linalg.norm(A, axis=0)
        k = int(np.argmax(size))
        if size[k] <= least:
            break
        chosen.append(k)
        u = A[:, k] / size[k]
        A -= np.outer(u, u @ A)
        A[:, chosen] = 0.0
    return chosen
