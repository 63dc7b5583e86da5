# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Draws the signature of each effect, as fastcal simulates it, into the SVG files beside this script.

python docs/effects/figures.py
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import load_signatures as load
import scanned_signatures as scanned
import signatures as of
from drawing import Figure, svg

FIGURES: tuple[Callable[[], Figure], ...] = (
    of.reduction_ratio,
    of.coupling_ratio,
    of.gear_harmonic,
    of.joint_profile,
    of.backlash,
    of.thermal_expansion,
    of.thermal_offset,
    of.base_drift,
    of.base_step,
    of.station_offset,
    of.tool_shift,
    of.measurement_scale,
    of.tracker_range,
    of.tracker_angle,
    of.settling,
    of.surrogate,
    load.friction,
    load.gravity_sag,
    of.regressor,
    load.joint_compliance,
    load.joint_compliance_nonlinear,
    load.current_compliance,
    load.link_bending,
    load.link_torsion,
    load.bearing_tilt,
    load.beam_gravity,
    load.compensator_spring,
    load.payload_mass,
    load.payload_com,
    load.link_mass,
    load.link_com,
    load.pin_slack,
    load.pin_compliance,
    load.rod_slack,
    load.rod_compliance,
    scanned.tool_step,
    scanned.zero_step,
    scanned.posture_backlash,
    scanned.encoder_jump,
    scanned.range_step,
    scanned.range_wave,
    scanned.thermal_spring,
    scanned.thermal_bending,
    scanned.thermal_base,
    scanned.base_settling,
)


def main() -> None:
    """Writes all figures."""
    for figure in FIGURES:
        (Path(__file__).parent / f"{figure.__name__}.svg").write_text(svg(figure()), encoding="utf-8")


if __name__ == "__main__":
    main()
