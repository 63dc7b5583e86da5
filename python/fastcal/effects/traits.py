# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an effect states about itself besides its equation; the same for effects of the core and of Python."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, get_args

from fastcal.errors import InvalidInput

Role = Literal["cause", "nuisance", "load modifier", "curve", "scanned", "on request"]
Place = Literal["joint", "link", "base", "tool", "payload", "instrument", "structure", "loop", "frame", "anywhere"]
Reference = Literal["axes", "base", "flange", "rows"]


@dataclass(frozen=True)
class Traits:
    """What diagnosis, report, conversion and compensation know of an effect (cpp/fastcal/effects/traits.hpp).

    In the texts {owner} stands for the owner ("joint6<-joint5"), {n} for the number in it (6), {m} for that behind its
    arrow (5).

    Attributes:
        phrase: What a person understands: "backlash (lost motion)".
        role: A "cause" may be what is wrong with an arm. A "nuisance" is an error of the loads: held by its plausible
            size beside effects that follow loads, never named. A "load modifier" acts through the compliances alone and
            may be the form of another effect of loads. A "curve" stands for no cause: no search names it. "Scanned" is
            a cause whose own number (a moment, a period, a lag) is looked for over a grid, where something remains.
            "On request" is a cause that looks like many others from afar: it is fitted where it is asked for, and no
            search names it.
        place: Where it acts.
        depends_on: "q{n}", "torque" (the load about the joint's axis), "load" (all six of it), columns of the data.
        needs_data: What data and robot file must hold beside poses; "" for nothing.
        shown_by: The poses and conditions that would show it.
        generalizes: Effects of the same owner that it holds as special cases.
        contrast: Two of its parameters, equal where it is no more than that special case.
        refers_to: What its numbers refer to: the joints' "axes" (or nothing that a kind of kinematics sets), the frame
            of the "base" or the "flange", or "rows" that another kind does not have. A conversion keeps the effect
            where these stay.
        of_the_measurement: Is it the instrument's or the set-up's, and not the robot's? Compensation leaves it out.
        plotted_over: The variable of its partial residual; "itself": its own size in the pose.
        options_from_data: Options that the first data decide: "t0_c", "t0_s", "times", "stations", "mounts", "range",
            "order", "size", "begins_s"; "reference": that the first robot does.
        labels: The option that lists the labels of the data which it knows: "stations", "mounts".
        among_parameters: Options that a file lists with the parameters: "order", "at_s", "at_row", "at_deg",
            "at_mm", "lag_s", "period_mm", "tau_s".
        searched: What a search over fits finds: an option ("order", "at_s", "at_deg", "lag_s", "period_mm", "tau_s"),
            or the start of a parameter, "critical".
        diagnosed_with: An option with which a diagnosis tries it, as on a command line: "moments=even".
        forms: Options that make another law of it, "side=load": a diagnosis tries each before it is sure. Behind a
            colon stands an option that is a load, "side=load:width_nm": it is tried over the loads that are met.
        without_masses: Does it stand for weights that the robot file does not give? A diagnosis then tries it where no
            payload varies, and else holds it by its plausible size beside a compliance of its joint.
        is_wave: Are its two parameters a sine and a cosine of one wave?
        number: What its parameter without a name is: "turn per moment".
    """

    phrase: str
    role: Role = "cause"
    place: Place = "frame"
    depends_on: tuple[str, ...] = ()
    needs_data: str = ""
    shown_by: str = ""
    generalizes: tuple[str, ...] = ()
    contrast: tuple[str, ...] = ()
    refers_to: Reference = "rows"
    of_the_measurement: bool = False
    plotted_over: str = "itself"
    options_from_data: tuple[str, ...] = ()
    labels: str = ""
    among_parameters: tuple[str, ...] = ()
    searched: str = ""
    diagnosed_with: str = ""
    forms: tuple[str, ...] = ()
    without_masses: bool = False
    is_wave: bool = False
    number: str = ""

    def __post_init__(self) -> None:
        """Refuses a role, place or reference that is none."""
        for value, known, what in (
            (self.role, Role, "role"),
            (self.place, Place, "place"),
            (self.refers_to, Reference, "refers_to"),
        ):
            if value not in get_args(known):
                raise InvalidInput(f"{what} of an effect must be one of {', '.join(get_args(known))}, got '{value}'")


def filled(text: str, owner: str) -> str:
    """A text of the traits for one owner: {owner}, {n} and {m} replaced."""
    driven, _, source = owner.partition("<-")
    n, m = ("".join(re.findall(r"\d+", part)[:1]) for part in (driven, source))
    return text.replace("{owner}", owner).replace("{n}", n).replace("{m}", m)
