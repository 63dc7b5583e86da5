# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the titles of exports mean, in the languages of the instruments' software.

A title is split into words; one of them says what is measured (a joint, a coordinate, an angle ...), the others in
which sense: measured, nominal, a deviation, computed by the controller.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache

from fastcal.measurements.labels import LABEL_WORDS, title_words


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


# Words of an export: a unit of fastcal and how many of it one is.
UNIT_WORDS: dict[str, tuple[str, float]] = {
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres", "milimetros"), ("mm", 1.0)),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres", "metros"), ("m", 1.0)),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), ("mm", 10.0)),
    **dict.fromkeys(("um", "\N{MICRO SIGN}m", "\N{GREEK SMALL LETTER MU}m", "micron", "microns"), ("um", 1.0)),
    **dict.fromkeys(("in", "inch", "inches"), ("in", 1.0)),
    **dict.fromkeys(
        ("deg", "degs", "degree", "degrees", "°", "grad", "degre", "degres", "gradi", "grados"), ("deg", 1.0)
    ),
    **dict.fromkeys(("rad", "rads", "radian", "radians", "radiant"), ("rad", 1.0)),
    "mrad": ("mrad", 1.0),
    "gon": ("deg", 0.9),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sek", "sekunden"), ("s", 1.0)),
    **dict.fromkeys(("ms", "milliseconds"), ("s", 1e-3)),
    "kg": ("kg", 1.0),
    "g": ("g", 1.0),
    "n": ("n", 1.0),
    "nm": ("nm", 1.0),
    "a": ("a", 1.0),
    **dict.fromkeys(("°c", "degc", "celsius", "c"), ("c", 1.0)),
    "k": ("k", 1.0),
    "-": ("1", 1.0),
}
LENGTHS, ANGLES = ("mm", "m", "um", "in"), ("deg", "rad", "mrad")

MEASURED = _words(
    """
    meas measured measurement mes mesure mesuree mesures gemessen mess messwert misurato misurata medido medida
    gemeten tracker laser lt leica faro radian vicon optitrack observed smr tmac
    """
)
ACTUAL = _words("actual act ist istwert istposition real fb feedback read curr")
NOMINAL = _words(
    """
    nom nominal nominale theo theorique theoretical soll sollwert ref reference cad design nennwert programmed
    prog cmd command commanded target desired setpoint teorico teorica planned
    """
)
DEVIATION = _words("dev deviation delta diff difference abw abweichung ecart err error residual d scarto")
CONTROLLER = _words("tcp cart cartesian robot controller ctrl tool ee eef flange posact")
# A coordinate or a joint with one of these is something else.
OTHER = _words(
    """
    velocity vel speed qd qdd acceleration acc accel force torque moment effort current temp temperature voltage
    pressure humidity normal vector direction dir tol tolerance upper lower size offset rms std stdev stddev sd
    sigma uncertainty unc precision streuung min max mean average quality marker weight gain control momentum i
    """
)
_TEMPERATURE = _words("temp temperature temperatur temperatura ambient air room robot arm luft raum umgebung roboter")
_PAYLOAD = _words("payload load mass masse traglast nutzlast last zuladung charge carga carico")
NEUTRAL = _words(
    """
    pos position coord coords coordinate coordinates coordonnee coordonnees koordinate point punkt pt value wert
    val data field msg message pose transform translation the of in states state joint angle winkel angles
    """
)
POLAR = _words("azimuth azimut acimut elevation elevacion zenith zenit cenit horizontal vertical hz v")
ROTATION = _words("rotation rot orientation ori quaternion quat q")
JOINT = _words(
    """
    q j joint axis achse axe asse eje gelenk theta jnt jt ax rax jointangle articulation articulacion articulacao
    giunto junta eixo osa os
    """
)
# Chinese and Japanese titles have no blanks between their words.
_IDEOGRAMS = {
    **dict.fromkeys(("关节", "關節", "関節"), "joint"),
    **dict.fromkeys(("轴", "軸"), "axis"),
    **dict.fromkeys(("角度", "坐标", "座標", "位置"), "position"),
    **dict.fromkeys(("测量", "測量", "实测", "測定"), "measured"),
    **dict.fromkeys(("理论", "理論", "名义"), "nominal"),
    **dict.fromkeys(("点名", "点号", "点", "名称"), "point"),
}
_IDEOGRAM = re.compile("|".join(sorted(_IDEOGRAMS, key=len, reverse=True)))
_UR_ORDER = {"pan": 1, "lift": 2, "elbow": 3}
NAME = _words(
    """
    name point target messpunkt punkt pkt nom label tag bezeichnung feature nombre nome ponto punto pose id
    messpunktname pointname pointid
    """
)
NUMBERING = _words("no nr num number index idx id row n frame count pr lfd line sample seq zeile numero")
TIME = _words("time timestamp zeit uhrzeit heure stamp hora ora zeitstempel epoch unix t")
DATE = _words("date datum fecha data jour")
VALID = _words("valid gultig valide enabled use used")
STATISTICS = _words(
    """
    mean average avg mittelwert mittel moyenne media std stdev stddev sd standardabweichung stabw ecarttype
    ecart min max minimum maximum range spanne rms sum summe somme total count anzahl median sigma deviation
    variance
    """
)


_LONGEST_TITLE = 200  # characters
_MOST_DIGITS = 9  # of a count in a title
_OWN = re.compile(
    r"payload_(kg|g)|sigma(_[xyz])?_(m|mm|um|in)|sigma_rot_(rad|mrad|deg)|temperature_(c|k)|station|mount|plane|approach\d+|"
    r"f[xyz]_n|m[xyz]_nm|current\d+_a|distance_(m|mm|um|in)|anchor|tilt_[xy]_(rad|mrad|deg)@\w+|sigma_tilt_(rad|mrad|deg)"
)


@dataclass(frozen=True)
class Title:
    """What a title means.

    Attributes:
        role: x, y, z; rx, ry, rz, rw (of an unknown convention); roll, pitch, yaw; a, b, c; w, p, r; qw ... qz;
            r11 ...; q3 (a joint); name, number, time, date, valid; or a column of the contract by its own name.
        sense: measured, plain, actual, nominal, deviation, controller.
        unit: The unit of fastcal that it states, and how many of it one is.
        group: The words that are left, which columns of one point or pose have in common.
    """

    role: str
    sense: str = "plain"
    unit: tuple[str, float] | None = None
    group: tuple[str, ...] = ()


def unit_of(text: str) -> tuple[str, float] | None:
    """The unit that a text names, brackets or not; None where it names none."""
    return UNIT_WORDS.get(text.strip().strip("[](){}<>").strip().rstrip(".").lower())


def split_unit(title: str) -> tuple[str, tuple[str, float] | None]:
    """A title without its unit, and the unit: X [mm], X (mm), X_mm, X / mm, X in mm, X, mm."""
    if len(title) > _LONGEST_TITLE:
        return title, None  # a sentence; the patterns' time grows with its square
    bracket = re.fullmatch(r"(.*?)[\s_,]*[\[({<]([^\])}>]*)[\])}>]\s*", title)
    if bracket and bracket[1].strip() and (unit := unit_of(bracket[2])):
        return bracket[1], unit
    tail = re.fullmatch(r"(.*\S)(_|\s*/\s*|\s+in\s+|,\s*|\s+)([^\s_/,]+)\s*", title)
    if tail and (unit := unit_of(tail[3])) and (tail[2].strip() or len(tail[3]) > 1 or tail[3] == "°"):
        return tail[1], unit
    return title, None


def plain_words(text: str) -> list[str]:
    """The words of a title in small letters without accents; J1 is j and 1, but r11 of a matrix stays."""
    spoken = _IDEOGRAM.sub(lambda found: f" {_IDEOGRAMS[found[0]]} ", text.lower())
    bare = "".join(
        c
        for c in unicodedata.normalize("NFKD", spoken.replace("ß", "ss").replace("θ", "theta"))
        if not unicodedata.combining(c)
    )
    return re.findall(r"[a-z]+|\d+", bare.replace("ecart type", "ecarttype"))


@lru_cache(maxsize=4096)
def meaning(title: str) -> Title | None:
    """What a title of an export means; None where it is not known here."""
    base, unit = split_unit(" ".join(title.split()))
    words = plain_words(base)
    if not words:
        return _of_label(title)
    joined = "".join(words)
    if contract := _contract_name(title):
        return contract
    if match := re.fullmatch(r"r?(?:ot)?(?:ation)?(?:matrix)?([123])([123])|[mr]([012])([012])", joined):
        row, column = (int(match[1]), int(match[2])) if match[1] else (int(match[3]) + 1, int(match[4]) + 1)
        if not joined[0].isdigit():
            return Title(f"r{row}{column}")
    if match := re.fullmatch(r"m([012])3", joined):  # the last column of a 4 x 4 matrix
        return Title("xyz"[int(match[1])], unit=unit)
    if match := re.fullmatch(r"([noa])([xyz])", joined):  # its first three, as normal, orientation and approach
        return Title(f"r{'xyz'.index(match[2]) + 1}{'noa'.index(match[1]) + 1}")
    return _joint(words, unit) or _component(words, unit) or _label(words, unit) or _of_label(title)


def _of_label(title: str) -> Title | None:
    """A title that says in any language that the column names or counts the rows."""
    words = title_words(title)
    if title.strip() in ("#", "№"):
        return Title("number")
    known = words <= LABEL_WORDS and len("".join(words)) > 1 - (not title.isascii())
    return Title("name") if words and known and not any(map(str.isdigit, title)) else None


def _contract_name(title: str) -> Title | None:
    """Columns of fastcal's own that are neither joints nor coordinates: by their whole name, or by word and unit."""
    name = title.strip().lower()
    if _OWN.fullmatch(name):
        return Title(name, "own")
    base, unit = split_unit(" ".join(title.split()))
    words = set(plain_words(base))
    for known, units, ours in ((_TEMPERATURE, "ck", "temperature_{}"), (_PAYLOAD, ("kg",), "payload_{}")):
        if unit is not None and unit[0] in units and unit[1] == 1.0 and words and words <= known:
            return Title(ours.format(unit[0]), "own")
    return None


def sense_of(words: list[str]) -> tuple[str, tuple[str, ...]]:
    """In which sense a coordinate is meant, and the words that do not concern it."""
    left = tuple(word for word in words if word not in NEUTRAL)
    for sense, known in (("deviation", DEVIATION), ("controller", CONTROLLER), ("measured", MEASURED)):
        if any(word in known for word in left):
            return sense, left
    for sense, known in (("nominal", NOMINAL), ("actual", ACTUAL)):
        if any(word in known for word in left):
            return sense, left
    return "plain", left


def _joint(words: list[str], unit: tuple[str, float] | None) -> Title | None:
    """J1, A1, Achse 1, actual_q_0, /joint_states/wrist_1_joint/position."""
    if any(word in OTHER for word in words) or (unit and unit[0] not in (*LENGTHS, *ANGLES)):
        return None
    counts = [word for word in words if word.isdigit() and len(word) <= _MOST_DIGITS]
    number = int(counts[-1]) if counts else None
    named = [word for word in words if word in JOINT or (word == "a" and number is not None)]
    if words[-2:] == ["q", words[-1]] and words[-1] in "wxyz":
        return None
    if "wrist" in words and number in (1, 2, 3):
        number, named = number + 3, ["joint"]
    elif ur := next((_UR_ORDER[word] for word in words if word in _UR_ORDER), None):
        number, named = ur, ["joint"]
    if number is None or number > 20 or not named or {"x", "y", "z"} & set(words):
        return None
    if any(word in DEVIATION for word in words):
        return Title(f"q{number}", "deviation", unit)
    read = any(word in ACTUAL | MEASURED for word in words)
    sent = any(word in NOMINAL for word in words)
    known = {*JOINT, *counts, *MEASURED, *ACTUAL, *NOMINAL, *NEUTRAL, "a", "robot", "wrist", "shoulder"}
    # The word for a joint is kept: q1 to q4 beside J1 to J6 are a quaternion.
    group = (named[0], *(word for word in words if word not in known and word not in _UR_ORDER))
    return Title(f"q{number}", "nominal" if sent else "actual" if read else "plain", unit, group)


def _component(words: list[str], unit: tuple[str, float] | None) -> Title | None:
    """A coordinate, an angle or a part of a quaternion."""
    if any(word in OTHER for word in words) or (unit and unit[0] not in (*LENGTHS, *ANGLES, "1")):
        return None
    role, rest = _own_word(words)
    if role is None:
        return None
    if role in "xyz" and (any(word in ROTATION for word in rest) or (unit and unit[0] in ANGLES)):
        role, rest = f"r{role}", [word for word in rest if word not in ROTATION]
    elif role == "w" and any(word in ROTATION for word in rest):
        role, rest = "rw", [word for word in rest if word not in ROTATION]
    sense, group = sense_of(rest)
    return Title(role, sense, unit, group)


def _own_word(words: list[str]) -> tuple[str | None, list[str]]:
    """The word of a title that names a component, and the others."""
    if words[-1] in "012345" and len(words) > 2 and words[-2] == "pose":
        return ("x", "y", "z", "rx", "ry", "rz")[int(words[-1])], words[:-1]  # actual_TCP_pose_0
    alike = {f"{at}{axis}": axis for axis in "xyz" for at in ("pos", "coord")}
    alike |= {f"{axis}{at}": axis for axis in "xyz" for at in ("pos", "coord")}
    alike |= {
        "tx": "x",
        "ty": "y",
        "tz": "z",
        "px": "x",
        "py": "y",
        "pz": "z",
        "rotx": "rx",
        "roty": "ry",
        "rotz": "rz",
    }
    alike |= {f"{name}winkel": axis for name, axis in (("gier", "yaw"), ("nick", "pitch"), ("roll", "roll"))}
    alike |= {
        "quatw": "qw",
        "quatx": "qx",
        "quaty": "qy",
        "quatz": "qz",
        "gier": "yaw",
        "nick": "pitch",
        "roll": "roll",
    }
    known = {"x", "y", "z", "rx", "ry", "rz", "rw", "qw", "qx", "qy", "qz", "roll", "pitch", "yaw", "o"}
    for place, word in enumerate(words):
        found = alike.get(word, word)
        if found in known or (found in {"a", "b", "c", "w", "p", "r", "t", "e"} and _stands_alone(words, place)):
            return found, [*words[:place], *words[place + 1 :]]
        if word in ("dx", "dy", "dz"):
            return word[1], [*words[:place], "delta", *words[place + 1 :]]
    return None, words


def _stands_alone(words: list[str], place: int) -> bool:
    """Whether a single letter is meant as the name of an angle: alone, or beside words that say in which sense."""
    others = {*words[:place], *words[place + 1 :]}
    return others <= MEASURED | ACTUAL | NOMINAL | DEVIATION | CONTROLLER | NEUTRAL | ROTATION | {"$", "posact"}


def _label(words: list[str], unit: tuple[str, float] | None) -> Title | None:
    """Names, numbers of rows, times and truth values."""
    if words[0] in VALID and len(words) == 1:
        return Title("valid")
    if (any(word in TIME for word in words) and not unit) or (
        unit and unit[0] == "s" and any(word in TIME for word in words)
    ):
        return Title("time", unit=unit)
    if any(word in DATE for word in words) and len(words) <= 2:
        return Title("date")
    known = set(words)
    if known & {"name", "label", "tag", "bezeichnung", "target", "feature"} and not known & {
        "group",
        "file",
        "collection",
    }:
        return Title("name")
    if known <= NUMBERING or joined_number(words):
        return Title("number")
    if known <= NAME | {"number", "no", "nr", "num"} and not known <= NUMBERING:
        return Title("name")
    return None


def joined_number(words: list[str]) -> bool:
    """Point no, Nr."""
    return len(words) > 1 and words[-1] in ("no", "nr", "num", "number", "index") and words[0] in NAME
