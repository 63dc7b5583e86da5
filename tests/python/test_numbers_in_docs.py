# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Numbers and options that the documentation quotes are those of the code and of the committed records.

A number that changes in the code is found here, by the page that still tells the old one. A new quotation of a constant
in a page belongs into QUOTED.
"""

from __future__ import annotations

import json
import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal import _core, robots
from fastcal.cli import main
from fastcal.cli.app import COMMANDS, installed
from fastcal.io import long_files
from fastcal.monitoring import causes, check, common_gauge, refit

ROOT = Path(__file__).parents[2]
RECORDS = ROOT / "bench" / "python"
WORDS = {"two": 2, "three": 3, "four": 4, "five": 5, "ten": 10, "twenty": 20}

TORSOS = json.loads((RECORDS / "bench_torsos.json").read_text(encoding="utf-8"))["sums"]

# Page, the words about the number, and what it is.
QUOTED = [
    ("monitoring.md", r"come to rest after (\S+) steps", refit._ROUNDS),
    ("monitoring.md", r"of the two p-values is below (\S+)\.\s", causes.LEVEL),
    ("monitoring.md", r"Within (\S+) standard deviations of a coordinate", check.GUARD),
    ("monitoring.md", r"may be off by (\S+) events", refit.EVENT_SIZES),
    ("monitoring.md", r"over (\S+) postures of the joint ranges", common_gauge.POSTURES),
    ("benchmarks.md", r"less than 1.1 in (\S+) of 25", TORSOS["within_1.1"]),
    ("benchmarks.md", r"and in (\S+) of 25 where it has none", TORSOS["named_without"]),
    ("measurement-files.md", r"a CSV of more than (\S+) MB", long_files.LONG_BYTES / 1e6),
    ("measurement-files.md", r"a Parquet file of more than (\S+) million cells", long_files.LONG_CELLS / 1e6),
]


def page(name: str) -> str:
    return " ".join((ROOT / "docs" / name).read_text(encoding="utf-8").split())


def record(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((RECORDS / name).read_text(encoding="utf-8"), parse_constant=no_number)
    return found


def no_number(name: str) -> None:
    raise ValueError(f"{name} is no JSON")


@pytest.mark.parametrize("name", sorted(path.name for path in RECORDS.glob("*.json")))
def test_a_record_is_strict_json(name: str) -> None:
    """Python writes Infinity and NaN, which other readers refuse."""
    assert record(name)


@pytest.mark.parametrize(("name", "words", "value"), QUOTED, ids=[words for _, words, _ in QUOTED])
def test_a_quoted_constant_is_that_of_the_code(name: str, words: str, value: float) -> None:
    said = re.findall(words, page(name))
    assert len(said) == 1, f"{name} no longer says '{words}': mend QUOTED"
    assert WORDS.get(said[0]) == value or float(said[0].replace(",", "")) == value


def test_the_ur10_s_campaigns_are_those_of_their_record() -> None:
    text, found = page("monitoring.md").partition("## A real arm")[2], record("ur10_months.json")
    draws = found["draws"]
    changed = [draw for draw in draws if draw["verdict"] == "changed"]
    rms = [draw["rms_mm"] for draw in changed]
    assert f"Campaign b ({found['rows']['b']:,} poses)" in text
    assert f"RMS {min(rms):.2f} to {max(rms):.2f} mm where {draws[0]['expected_rms_mm']:.2f} is expected" in text
    left = [draw["rest_updated_mm"] for draw in draws]
    assert f"leaves {min(left):.2f} to {max(left):.2f} mm" in text
    number = {2: "twice", 4: "Four times", 8: "eight"}
    assert f"says changed for {number[len(changed)]}" in text


def test_the_table_of_coverage_is_that_of_its_record() -> None:
    text, found = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8"), record("bench_coverage.json")
    rows = dict(re.findall(r"^\| `(\w+)` \| \d+ \| ([\d.]+)% \(", text, re.MULTILINE))
    by_effect = found["losses"]["tukey"]
    assert set(rows) <= set(by_effect)
    assert len(rows) > 20
    for effect, covered in rows.items():
        assert float(covered) == pytest.approx(100 * by_effect[effect]["covered"], abs=0.051), effect


def test_every_kind_of_reading_is_in_the_table_of_coverage_and_within_the_goal() -> None:
    text, found = page("benchmarks.md"), record("bench_coverage_kinds.json")["losses"]["tukey"]
    touched = record("bench_coverage_touches.json")["losses"]["tukey"]  # each alone
    touched = {label: row for label, row in touched.items() if label != "pooled"}
    assert touched.keys() == {"kind ball", "kind cube", "kind dial"}
    others = {"corner", *(label.removeprefix("kind ") for label in touched)}
    kinds = [kind for kind in _core.observation_names() if kind not in others]
    for pair in [*combinations(kinds, 1), *combinations(kinds, 2)]:
        row = found["kind " + "+".join(pair)]
        assert 0.93 <= row["covered"] <= 0.97, pair
        assert f"| {', '.join(pair)} | {row['counted']} | {100 * row['covered']:.1f}% (" in text
    for label, row in touched.items():
        assert 0.93 <= row["covered"] <= 0.97, label
        assert f"| {label.removeprefix('kind ')} | {row['counted']} | {100 * row['covered']:.1f}% (" in text


def test_cameras_boards_and_lenses_are_in_the_table_of_coverage_and_within_the_goal() -> None:
    text, found = page("benchmarks.md"), record("bench_coverage_cameras.json")
    assert found["sets"] >= 300
    assert found["parts"].keys() == {"arm", "camera", "lens", "board"}
    for part, row in found["parts"].items():
        assert 0.93 <= row["covered"] <= 0.97, part
        assert f"| {part} | {row['counted']} | {100 * row['covered']:.1f}% (" in text


def test_places_and_arms_of_cells_are_in_the_table_of_coverage_and_within_the_goal() -> None:
    text, found = page("benchmarks.md"), record("bench_coverage_cells.json")
    assert found["sets"] >= 60
    assert found["parts"].keys() == {"arms", "places", "turns", "axis", "ratio"}
    for part, row in found["parts"].items():
        assert row["low"] <= 0.97, part
        assert row["high"] >= 0.93, part
        assert f"| {part} | {row['counted']} | {100 * row['covered']:.1f}% (" in text


def test_pages_of_3000_points_open_and_turn_as_their_records_say() -> None:
    text = page("gallery.md")
    for name in ("bench_page.json", "bench_page_cell.json"):
        found = record(name)
        assert found["rows"] == 3000
        assert found["opens_s"] < 1
        assert found["frames_per_second"] >= 30
        assert f"{found['bytes'] / 1e6:.2f} MB" in text
        assert f"after {found['opens_s']:.1f} s" in text
        assert f"after {found['drawn_s']:.1f} s" in text
        assert f"at {found['frames_per_second']:.0f} frames" in text
        assert f"--seed {found['seed']}`" in text


def test_the_way_through_the_studio_takes_what_its_record_says() -> None:
    text, found = page("studio.md"), record("bench_studio.json")
    assert f"one waits {found['all']:.0f} s, {found['diagnose']:.0f} s of which are the diagnosis" in text
    assert found["all"] < 600  # ten minutes, the goal
    assert found["all"] == pytest.approx(sum(seconds for step, seconds in found.items() if step != "all"), abs=0.5)


def test_what_sensors_on_arms_see_is_in_the_table_of_coverage_and_within_the_goal() -> None:
    text, found = page("benchmarks.md"), record("bench_coverage_sensors.json")
    assert found["sets"] >= 60
    assert found["parts"].keys() == {"points", "turns"}
    for part, row in found["parts"].items():
        assert 0.93 <= row["covered"] <= 0.97, part
        assert f"| {part} | {row['counted']} | {100 * row['covered']:.1f}% (" in text


def test_what_is_said_of_causes_seen_from_an_arm_is_that_of_its_record() -> None:
    text, found = page("several-arms.md"), record("bench_sensor_causes.json")["found"]
    words = [word for of in found.values() for word in of]
    assert "wrong A" not in words
    right = sum(n for of in found.values() for word, n in of.items() if word.startswith("right"))
    sure = sum(of.get("right, A", 0) for of in found.values())
    assert f"all {right} causes that can be told were named with their arm, {sure} of them with grade A" in text
    assert found["none"] == {"not named": 8}
    assert found["bending"] == {"named, not sure": 8}


def test_the_table_of_hand_eyes_is_that_of_its_record() -> None:
    text, levels = page("benchmarks.md"), record("bench_kinhec.json")["levels"]
    for track in dict.fromkeys(of["track"] for of in levels):
        own = [of for of in levels if of["track"] == track]
        told = [of for of in own if not of["undetermined"]]
        shift, turn = (float(np.median([of[u] / of[f"best_{u}"] for of in told])) for u in ("mm", "deg"))
        better = sum(of["mm"] <= of["best_mm"] for of in told)
        counts = f"| {track} | {sum(of['sessions'] for of in own)} | {len(told)} of {len(own)} "
        assert f"{counts}| {shift:.2f} | {turn:.2f} | {better} of {len(told)} |" in text


def test_the_table_of_other_hand_eyes_is_that_of_its_record() -> None:
    text, levels = page("benchmarks.md"), record("bench_kinhec_47001.json")["levels"]
    for track in dict.fromkeys(of["track"] for of in levels):
        own = [of for of in levels if of["track"] == track]
        told = [of for of in own if not of["undetermined"]]
        times = {u: [of[u] / of[f"best_{u}"] for of in told] for u in ("mm", "deg")}
        better = sum(ratio <= 1 for ratio in times["mm"])
        row = f"| {track} | {len(told)} of {len(own)} | {np.median(times['mm']):.2f} | {np.median(times['deg']):.2f} "
        assert f"{row}| {better} of {len(told)} | {max(times['mm']):.2f} |" in text
    without = [of for of in levels if of["mm"] is None]
    assert all(of["undetermined"] == of["sessions"] and of["null"] for of in without)
    assert f"refuses the sessions of {('no', 'one', 'two', 'three')[len(without)]} of these levels" in text


def test_the_table_of_arms_that_are_wrong_is_that_of_its_record() -> None:
    text, found = page("benchmarks.md"), record("bench_kinhec_robot_error.json")
    joints = {of["level"]: of for of in found["with_joints"]}
    for of in found["levels"]:
        own = joints[of["level"]]
        assert of["sessions"] == own["sessions"] == 40
        times = " | ".join(f"{of[u] / of[f'best_{u}']:.2f}" for u in ("mm", "deg"))
        assert f"| `{of['level'].replace('|', ', ')}` | {times} | {own['mm']:.3f} | {own['shah_lm_mm']:.3f} |" in text
    single = found["single"]["robot_error"]
    assert f"fastcal at {single['fastcal'][0]:.2f}" in text


def test_the_table_of_known_noise_is_that_of_its_records() -> None:
    text = page("benchmarks.md")
    for track in ("robot_error", "motion"):
        found = record(f"bench_kinhec_known_noise_{track}.json")["tracks"][track]
        own, known = (found["draws"][name] for name in ("fastcal", "known noise"))
        row = f"| {track} | {own['of']} | {own['levels']:.1f} | {known['levels']:.1f} | {own['all']:.1%} | "
        row += f"{known['all']:.1%} | {own['times']:.2f} | {known['times']:.2f} |"
        assert row.replace("%", " %") in text
    levels = record("bench_kinhec_known_noise_robot_error.json")["tracks"]["robot_error"]["levels"]
    of = next(of for of in levels if of["level"] == "dh_len_mm=0.1|dh_ang_deg=0.1")
    numbers = f"{of['mm']:.2f} mm off in the median of {of['sessions']} sessions, known noise {of['known_mm']:.2f} and"
    assert f"{numbers} the best solver {of['best_mm']:.2f} mm" in text


def test_the_table_of_thinned_pictures_is_that_of_its_record() -> None:
    text, draws = page("benchmarks.md"), record("bench_thinned_pictures.json")["draws"]
    worse = [of["calibrate"] / of["hand_eye"] for of in draws if of["calibrate"] > of["hand_eye"]]
    for key in dict.fromkeys((of["cameras"], of["count"], of["others"]) for of in draws):
        own = [of for of in draws if (of["cameras"], of["count"], of["others"]) == key]
        found, plain = (np.median([of[way] for of in own]) for way in ("calibrate", "hand_eye"))
        assert found < plain
        count = sum(of["calibrate"] > of["hand_eye"] for of in own)
        head = f"| {key[0].replace(' ', ', ')} | {key[1]} | {key[2]} "
        assert f"{head}| {found:.3f} | {plain:.3f} | {count} of {len(own)} |" in text
    assert f"In {len(worse)} of {len(draws)} draws it is worse, by at most {100 * (max(worse) - 1):.0f} %" in text


def test_the_table_of_sockets_is_that_of_its_record() -> None:
    text, found = page("benchmarks.md"), record("bench_sockets.json")
    for name, of in found.items():
        fitted, predicted = of["touches"]
        figures = " | ".join(f"{of[key]:.3f}" for key in ("published", "calibrate", "diagnose"))
        named = ", ".join(of["named"]) or "none"
        assert f"| {name} | {fitted} | {predicted} | {of['nominal']:.2f} | {figures} | {named} |" in text
    several = [of for name, of in found.items() if not name.startswith("dinova")]
    for way in ("calibrate", "diagnose"):
        times = [of[way] / of["published"] for of in several]
        assert f"{np.median(times):.2f} times" in text
        assert f"({min(times):.2f} to {max(times):.2f})" in text


def test_the_table_of_the_humanoid_is_that_of_its_record() -> None:
    text, found = page("benchmarks.md"), record("bench_humanoid.json")["rms_mm"]
    for split, of in found.items():
        sizes = " | ".join(f"{of[key]:.2f}" for key in ("before", "geometry", "with effects"))
        last = f"{of['diagnosed']:.2f}" if "diagnosed" in of else "-"
        assert f"| {split} | {sizes} | {last} |" in text
        assert of["with effects"] < 5.0


def test_many_networks_at_once_are_as_much_faster_as_their_record_says() -> None:
    text, found = page("networks.md"), record("bench_networks.json")["ratios"]
    swarm, population = (f"{min(found[name]):.1f} to {max(found[name]):.1f}" for name in ("swarm", "population"))
    assert f"evaluated {swarm} times as fast as its beetles one by one" in text
    assert f"trained {population} times as fast as one after another" in text


def test_wheels_and_arms_are_those_of_this_version() -> None:
    for file in (ROOT / "README.md", ROOT / "docs" / "installation.md"):
        named = set(re.findall(r"fastcal-([\d.]+)-cp", file.read_text(encoding="utf-8")))
        assert named == {fastcal.__version__}, file.name
    assert "more than twenty arms" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert 20 < len(robots.available()) < 30


def options(capsys: pytest.CaptureFixture[str], command: str) -> set[str]:
    capsys.readouterr()
    assert main([command, "--help"]) == 0
    listed = capsys.readouterr().out.partition("Options:")[2].partition("Examples:")[0]
    return set(re.findall(r"--[a-z][a-z0-9-]*", listed))


def test_the_page_of_commands_names_every_option_and_none_that_is_gone(capsys: pytest.CaptureFixture[str]) -> None:
    text = page("commands.md")
    there = {command: options(capsys, command) for command in [*COMMANDS, *installed()]}
    written = {"--output", "--help"}  # as -o; of every program
    missing = {(c, o) for c, own in there.items() for o in own - written if not re.search(rf"{o}(?![\w-])", text)}
    assert missing == set()
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", text))
    assert named - set().union(*there.values()) == {"--install-completion"}
