# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Ranges over the arms, counts and steps that docs/papers.md gives are those of the committed results."""

import math
import statistics
from pathlib import Path
from typing import Any

import pytest

from fastcal.io.results import read_json
from fastcal.report.formatting import significant
from fastcal_studies.simulated import WORLD_NAMES

ROOT = Path(__file__).parents[3]
RX160L_LINES = (
    "GA-DNN, the paper's",
    "GA-DNN behind geometry of the same rows",
    "fastcal's best: gp behind geometry of the same rows",
)


def kept(name: str) -> dict[str, Any]:
    return read_json(ROOT / "bench" / "papers" / f"{name}.json")


def unwrapped(file: str) -> str:
    """The text of a page, whatever its line breaks."""
    return " ".join((ROOT / file).read_text(encoding="utf-8").split())


def table_of(study: str, title: str) -> dict[str, Any]:
    """A kept table by its title."""
    exhibits = [exhibit for section in kept(study)["sections"] for exhibit in section["exhibits"]]
    table: dict[str, Any]
    (table,) = [exhibit for exhibit in exhibits if exhibit["kind"] == "table" and exhibit["title"] == title]
    return table


def cell_of(study: str, title: str, row: str, column: str) -> Any:
    """A cell of a kept table as it is: a median with the range over the arms, or a number."""
    table = table_of(study, title)
    (cells,) = [cells for cells in table["rows"] if cells[0] == row]
    return cells[table["columns"].index(column)]


def test_the_ranges_over_the_arms_are_the_kept_ones() -> None:
    text = unwrapped("docs/papers.md")
    ratios, searches = "reduction and coupling ratios", "searches on the Michalewicz function"
    coupling = cell_of("siasun_sr210d", ratios, "h65", "found")
    hidden = cell_of("siasun_sr210d", ratios, "h65", "hidden (printed)")
    assert f"the coupling ({coupling['low']:.4f} to {coupling['high']:.4f}, hidden is {hidden:.5f})" in text
    reached = {name: cell_of("siasun_sr210d", searches, name, "reached, % of the starts") for name in ("BSO", "PSO")}
    reached |= {name: cell_of("siasun_sr210d", searches, name, "reached, % of the starts") for name in ("GA", "ABC")}
    assert all(reached[name]["low"] == 100 for name in ("PSO", "GA", "ABC"))
    assert f"reach it in all, BSO in {reached['BSO']['low']:.0f} to {reached['BSO']['high']:.0f} % an arm" in text
    rigid = table_of("kuka_kr500", "identified parameters, medians of the arms")
    (joint6,) = [row for row in rigid["rows"] if row[0] == "joint6 compliance (nrad/N m)"]
    assert (joint6[-1], kept("kuka_kr500")["arms"]) == (10, 10)
    assert "joint 6 ends rigid on ten of ten arms" in text
    counts = kept("pmc6va030")["headlines"]
    assert counts[0]["measure"].startswith("geometry without load, 159 to 168 configurations")
    assert counts[1]["measure"].startswith("SOMM-ANN, 795 to 840 rows not trained on")
    assert (
        "159 to 168 configurations an arm are in reach of one posture (the paper has 168), and so 795 to 840 rows"
        in text
    )


def test_the_leads_across_the_worlds_are_the_kept_ones() -> None:
    text = unwrapped("docs/papers.md")

    def in_worlds(study: str, title: str, column: str) -> list[float]:
        return [cell_of(study, f"{title} (mm)", world, column)["median"] for world in WORLD_NAMES.values()]

    joints, _, links = in_worlds("siasun_sr210d", "mean error of 200 poses not learnt", "gp behind fastcal's model")
    assert f"but across the joints it leaves {links / joints:.1f} times what it leaves of its own form. On the" in text
    title = "mean error of the rows not trained on"
    somm, mlp = (
        in_worlds("pmc6va030", title, f"{name} behind fastcal's model") for name in ("SOMM-ANN", "fastcal's mlp")
    )
    assert max(abs(a - b) for a, b in zip(somm, mlp, strict=True)) < 0.003
    assert "SOMM-ANN behind fastcal's model is within 0.003 mm of `mlp` in all three" in text
    title = "mean error of 708 poses not learnt"
    own, same, best = (in_worlds("staubli_rx160l", title, column) for column in RX160L_LINES)
    gained = [1 - a / b for a, b in zip(same, own, strict=True)]
    assert f"GA-DNN gains {100 * max(gained):.0f} % at most from the geometry of all rows, across the joints" in text
    assert gained[2] < 0
    assert all(c < min(a, b) for a, b, c in zip(own, same, best, strict=True))
    assert f"across the joints it leaves {best[2] / best[0]:.1f} times what it leaves of its own form." in text


def test_the_worst_arm_of_the_jump_is_told() -> None:
    title = "rows not trained on: GB10 and GB30 (mm)"
    largest = cell_of("pmc6va030", title, "fastcal's mlp behind fastcal's model", "max")
    high, median = (significant(largest[key]) for key in ("high", "median"))
    assert "98 % on the worst arm" in kept("pmc6va030")["remarks"][0]
    told = f"98 % of them are put on their side, and the largest error there is {high} mm (median of the arms"
    assert f"On the worst arm {told} {median} mm)" in unwrapped("docs/papers.md")


def test_the_steps_and_corners_of_single_arms_are_the_kept_ones() -> None:
    text = unwrapped("docs/papers.md")
    charts = [e for s in kept("spray_7dof")["sections"] for e in s["exhibits"] if e["kind"] == "chart"]
    (first,) = [e for e in charts if e.get("title") == "the same with the redundant errors kept"]
    steps = first["series"][0]["y"]
    assert f"the first step with gravity is {min(steps):.0f} to {max(steps):,.0f} m or rad" in text
    (curves,) = [e for e in charts if e.get("title") == "what is left of the 150 poses, the first arm"]
    assert "4 steps with gravity, 3 without it, 14 to 19 with the redundant errors damped" in curves["note"]
    assert "after four steps with gravity and after three without" in text
    assert "it takes 14 to 19 steps and leaves" in text
    pairs = "compliance by payload pairs, medians of the arms"
    note = table_of("staubli_rx160l", pairs)["note"]
    assert "joint 2's at 9.4 to 127.6 N m (hidden 118.2), joint 3's at 3.9 to 73.2 N m (hidden 75.6)" in note
    assert "and at 9.4 to 127.6 and 3.9 to 73.2 N m on single arms" in text
    succeeds = cell_of("staubli_rx160l", pairs, "joint5 critical (N m)", "arms where it succeeds")
    assert f"on the {succeeds} arms on which it succeeds" in text


def test_networks_on_poses_leave_what_the_page_says() -> None:
    text = unwrapped("docs/networks.md")
    runs = read_json(ROOT / "bench" / "python" / "bench_orientation.json")["runs"]
    for run, arm in zip(runs, ("UR5", "RX160L", "KR 6 R900"), strict=True):
        parts = []
        for part in ("unseen", "commands"):
            (a, b), (c, d) = run[part]["model"], run[part]["network"]
            assert c < a / 2
            assert d < b / 2
            parts.append(f"{significant(a)} mm and {b:.4f} deg, {significant(c)} mm and {d:.4f} deg")
        assert f"| {arm} | {parts[0]} | {parts[1]} |" in text
        assert f"seed {run['seed']})" in text


def test_splits_of_other_seeds_leave_what_the_page_says() -> None:
    record = read_json(ROOT / "bench" / "papers" / "real_splits.json")
    mean = {
        (campaign, name): statistics.median(each["mean"] for each in found)
        for campaign, methods in record["splits"].items()
        for name, found in methods.items()
    }
    last = record["first"] + len(record["splits"]["UR5"]["mlp"]) - 1
    text = unwrapped("docs/papers.md")
    assert f"seeds {record['first']} to {last})" in text
    ur5, ur10 = ([significant(mean[campaign, name]) for name in ("mlp", "gp")] for campaign in ("UR5", "UR10 c"))
    assert f"`mlp` {ur5[0]} mm in the median of the means and `gp` {ur5[1]} mm, on the UR10 c {ur10[0]} and" in text
    assert f" and {ur10[1]} mm." in text
    for (campaign, name), value in mean.items():
        if name != "geometry":
            rows = {"UR5": 300, "UR10 c": 832}[campaign]
            kept_mean = cell_of("real", f"{campaign}, {rows} rows held back (mm)", name, "mean")
            assert value == pytest.approx(kept_mean["median"], rel=0.02)


def test_what_joint_profiles_leave_more_than_mlp_is_the_kept_difference() -> None:
    text = unwrapped("docs/papers.md")
    titles = [f"{campaign}, of the mean errors (mm)" for campaign in ("UR5", "UR10 b", "UR10 c")]
    more = [cell_of("real", title, "joint profiles (no network) less mlp", "mean") for title in titles]
    told = "leave {:.3f} mm more than `mlp` on the UR5 and {:.3f} and {:.3f} mm more on the UR10"
    assert told.format(*more) in text
    near = {part: cell_of("real", titles[0], "BSO-MLP behind joint profiles less mlp", part) for part in ("mean", "p")}
    assert 0 < near["mean"] < 0.002
    assert near["p"] < 0.05
    assert "comes within 0.002 mm of `mlp`, a difference that is small but certain" in text


@pytest.mark.parametrize(
    ("sigma_mm", "line"),
    [
        (0.02, "The tracker's noise has a mean of {} mm. The effect was added"),
        (0.02, "The tracker's noise alone is {} mm. Behind each of"),
        (0.03, "The tracker's noise alone has a mean of {} mm. That fastcal's fits"),
        (0.01, "The tracker's noise alone has a mean of {} mm. Of the plain networks"),
    ],
)
def test_the_mean_of_the_tracker_s_noise(sigma_mm: float, line: str) -> None:
    """A length of three equal normal coordinates has the mean 2 sqrt(2 / pi) sigma."""
    assert line.format(f"{2 * (2 / math.pi) ** 0.5 * sigma_mm:.3f}") in unwrapped("docs/papers.md")
