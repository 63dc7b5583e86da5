# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The frames that ur_description gives the joints of a UR arm, from its DH rows."""

from __future__ import annotations

import numpy as np

from fastcal import units
from fastcal.arrays import FloatArray
from fastcal.conversion.chain import Spec
from fastcal.errors import InvalidInput
from fastcal.robot import se3
from fastcal.robot.core_model import pose

_EXACT = 1e-9


def ur_origins(spec: Spec) -> list[FloatArray]:
    """Origins (4, 4) of the joints in the frame of the one before, each turning about its z.

    A frame lies behind the theta and d of its row: T_i = Tx(a) Rx(alpha) Ry(beta) of row i - 1, then Tz(d) Rz(theta) of
    row i. The last joint's frame is the flange.

    Args:
        spec: Of kind dh.

    Raises:
        InvalidInput: The last row has an a, alpha or beta, or a flange follows it, for which there is no frame.
    """
    origins: list[FloatArray] = []
    behind = np.eye(4)
    for joint in spec["joints"]:
        theta, alpha, beta = (units.to_si(joint[f"{name}_deg"], "deg") for name in ("theta", "alpha", "beta"))
        along = se3.pose(se3.rotation_z(theta), [0.0, 0.0, units.to_si(joint["d_mm"], "mm")])
        origins.append(behind @ along)
        behind = se3.pose(se3.rotation_x(alpha) @ se3.rotation_y(beta), [units.to_si(joint["a_mm"], "mm"), 0.0, 0.0])
    if "flange" in spec:
        behind = behind @ pose(spec["flange"])
    if np.abs(behind - np.eye(4)).max() > _EXACT:
        raise InvalidInput(
            f"{spec['name']}: its last row has an a, alpha or beta, or a flange follows it, and ur_description's tool0 "
            "is the frame of joint 6"
        )
    return origins
