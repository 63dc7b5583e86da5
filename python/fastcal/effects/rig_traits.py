# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes of error that are no effects: numbers of the cell or robot file itself, and a posture that is not told."""

from __future__ import annotations

from fastcal.effects.traits import Traits

INTRINSICS, BOARD_SCALE, BOARD_BEND = "intrinsics", "board_scale", "board_bend"
BRACKET_SAG, TIME_OFFSET, ROLLING_SHUTTER = "bracket_sag", "time_offset", "rolling_shutter"
PLACEMENT_STEP = "placement_step"
LOOP_LENGTH, LOOP_PIN, LOOP_TURN, LOOP_GEAR = "loop_length", "loop_pin", "loop_turn", "loop_gear"
JOINT_PLACE = "joint_place"  # only beside one of these: every robot's joints stand elsewhere than the file says
BRANCH_POSTURE = "branch_posture"

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
    LOOP_LENGTH: Traits("length not as the file says (loop length)", place="anywhere", number="change"),
    LOOP_PIN: Traits("a pin not where the file says (loop pin)", place="anywhere", number="change"),
    LOOP_TURN: Traits("a pin at another angle than the file says (loop turn)", place="anywhere", number="change"),
    LOOP_GEAR: Traits("ratio or offset not as the file says (loop gear)", place="anywhere", number="change"),
    JOINT_PLACE: Traits("mounted elsewhere than the file says (joint place)", place="anywhere", number="change"),
    BRANCH_POSTURE: Traits(
        "something else that stands on it moved, and its posture is not in the data (branch posture)",
        place="anywhere",
        number="turn",
    ),
}
