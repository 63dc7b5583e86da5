# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes of error in cameras and boards: no effects of an arm, and written into the cell's own numbers."""

from __future__ import annotations

from fastcal.effects.traits import Traits

INTRINSICS, BOARD_SCALE, BOARD_BEND = "intrinsics", "board_scale", "board_bend"
BRACKET_SAG, TIME_OFFSET, ROLLING_SHUTTER = "bracket_sag", "time_offset", "rolling_shutter"
PLACEMENT_STEP = "placement_step"

ALIKE = {  # what a cause looks like, and when
    BOARD_SCALE: "a board that is too large looks like an arm that is too large in every length",
    BRACKET_SAG: "a mount that gives looks like a last link or wrist bearing that gives where it is as stiff one way "
    "as the other",
    TIME_OFFSET: "late pictures look like lost motion where all joints move at one speed, and like a rolling shutter "
    "where the board is at one height in all pictures",
    ROLLING_SHUTTER: "a rolling shutter looks like late pictures where the board is at one height in all pictures",
    PLACEMENT_STEP: "a knocked board looks like a knocked base, and a knocked camera like a slipped zero of the last "
    "joint where it turned about that joint's axis",
}

RIG_TRAITS = {
    INTRINSICS: Traits(
        "lens not as the file says (intrinsics)", place="anywhere", of_the_measurement=True, number="change"
    ),
    BOARD_SCALE: Traits(
        "size not as the file says (board scale)", place="anywhere", of_the_measurement=True, number="share"
    ),
    BOARD_BEND: Traits("not flat (board bend)", place="anywhere", of_the_measurement=True, number="height"),
    BRACKET_SAG: Traits(
        "mount gives under its own weight (bracket sag)", place="anywhere", of_the_measurement=True, number="motion"
    ),
    TIME_OFFSET: Traits(
        "pictures not at the moment of the joints (time offset)",
        place="anywhere",
        of_the_measurement=True,
        number="delay",
    ),
    ROLLING_SHUTTER: Traits(
        "lines of a picture not at the same moment (rolling shutter)",
        place="anywhere",
        of_the_measurement=True,
        number="readout",
    ),
    PLACEMENT_STEP: Traits(
        "knocked between two rows (placement step)", place="anywhere", of_the_measurement=True, number="motion"
    ),
}
