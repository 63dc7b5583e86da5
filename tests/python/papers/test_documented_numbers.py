# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The numbers that the docs give of the papers' studies are those of the committed results."""

from pathlib import Path
from typing import Any

import pytest

from fastcal.io.results import read_json
from fastcal.report.formatting import significant
from fastcal_studies import NAMES
from fastcal_studies.exhibits import COMPARED
from fastcal_studies.page import paper_page
from fastcal_studies.real_page import NAMES as REAL_NAMES

ROOT = Path(__file__).parents[3]


def kept(name: str) -> dict[str, Any]:
    return read_json(ROOT / "bench" / "papers" / f"{name}.json")


def unwrapped(file: str) -> str:
    """The text of a page, whatever its line breaks."""
    return " ".join((ROOT / file).read_text(encoding="utf-8").split())


def median(content: dict[str, Any], title: str, row: str, column: str) -> str:
    """The median in a cell of a kept table, with the page's three digits."""
    tables = [e for s in content["sections"] for e in s["exhibits"] if e["kind"] == "table" and e["title"] == title]
    (table,) = tables
    (cells,) = [cells for cells in table["rows"] if cells[0] == row]
    cell = cells[table["columns"].index(column)]
    value = cell["median"] if isinstance(cell, dict) else cell
    return f"{value:.0f}" if float(value).is_integer() else significant(value)


# Lines of the docs by file, with a place for every number that comes from a kept file:
# (study, title of the table, row, column).
PAIRS = "compliance by payload pairs, medians of the arms"
FEW, MANY = "fitted to 15 poses", "the same fitted to 100 random poses (not in the paper)"
KR500 = ("27 here", "33 here", "fastcal's best")
RIVALS = "mean error (mm) with equal budgets"
PATH = "all errors kept: strength by generalized cross-validation, and by what is expected"
PATH_PRIOR, PATH_LEFT = "damping 1: errors of 10 mm and 10 mrad expected", "100 poses not fitted, RMS (mm)"
SPRAY = ("geometry", "geometry and beams as in the file, the paper's", "geometry and beams of identified stiffness")
LINES: list[tuple[str, str, list[tuple[str, str, str, str]]]] = [
    (
        "docs/papers.md",
        "| 15 poses fitted, largest error of five others | 0.5 | {} | {} | {} |",
        [("kuka_kr500", FEW, "five held out, max", column) for column in KR500],
    ),
    (
        "docs/papers.md",
        "| the same poses, 200 unseen, mean | | {} | {} | {} |",
        [("kuka_kr500", FEW, "200 unseen, mean", column) for column in KR500],
    ),
    (
        "docs/papers.md",
        "| 100 poses fitted, 200 unseen, mean | | {} | {} | {} |",
        [("kuka_kr500", MANY, "200 unseen, mean", column) for column in KR500],
    ),
    (
        "docs/papers.md",
        "33 parameters fitted so leave {} mm of the unseen poses in place of {}",
        [("kuka_kr500", FEW, "200 unseen, mean", column) for column in ("33 at equilibrium", "33 here")],
    ),
    (
        "docs/papers.md",
        "weight for softness: {} nrad/N m, hidden are {}",
        [
            ("kuka_kr500", "identified parameters, medians of the arms", "joint2 compliance (nrad/N m)", column)
            for column in ("33, 15 poses", "hidden (printed)")
        ],
    ),
    (
        "docs/papers.md",
        "| network, 200 poses not trained on | 0.6522 | {} | {} |",
        [("siasun_sr210d", "200 others", "after, mean", column) for column in COMPARED[2:]],
    ),
    (
        "docs/papers.md",
        "behind the same fit by currents the same Gaussian process leaves {} mm",
        [("siasun_sr210d", RIVALS, "fastcal's gp behind compliances by current", "200 others")],
    ),
    (
        "docs/papers.md",
        "alone leave {} and {} mm, and of the same arm without its waves {} and {} mm",
        [
            ("siasun_sr210d", "of fastcal's models, with the waves and without, mean (mm)", row, column)
            for row in ("fastcal's models", "the same without waves")
            for column in ("50 others without load", "200 others under it")
        ],
    ),
    (
        "docs/papers.md",
        "learns 200, 600 and 1,400 poses leaves {}, {} and {} mm",
        [
            ("siasun_sr210d", "fastcal's best by poses learnt (mm)", poses, "200 others, mean")
            for poses in ("200", "600", "1400")
        ],
    ),
    (
        "docs/papers.md",
        "errors to points pays off more: `mlp` behind the paper's own model leaves {} mm",
        [("siasun_sr210d", RIVALS, "fastcal's mlp behind the paper's model", "200 others")],
    ),
    (
        "docs/papers.md",
        "in evaluations it needs {} of them, the others {}, {} and {}.",
        [
            ("siasun_sr210d", "searches on the Michalewicz function", name, "evaluations where reached")
            for name in ("BSO", "PSO", "GA", "ABC")
        ],
    ),
    (
        "docs/papers.md",
        "particle swarm, genetic algorithm and bee colony leave {}, {} and {} mm",
        [("siasun_sr210d", RIVALS, name, "200 others") for name in ("PSO", "GA", "ABC")],
    ),
    (
        "docs/papers.md",
        "the same network leaves {} mm, from the beetle swarm's {} mm",
        [("siasun_sr210d", RIVALS, name, "200 others") for name in ("a random start", "BSO, the paper's")],
    ),
    (
        "docs/papers.md",
        "leaves {} mm RMS of the 100 poses that are not fitted, where the redundant errors removed leave {} mm",
        [("spray_7dof", PATH, row, PATH_LEFT) for row in (PATH_PRIOR, "redundant errors removed")],
    ),
    (
        "docs/papers.md",
        "cross-validation uses {} numbers where 27 can be identified, and leaves {} mm, truncated {} and {} mm",
        [
            ("spray_7dof", PATH, row, column)
            for row in ("damped (levenberg)", "singular values cut off (truncated)")
            for column in ("numbers used", PATH_LEFT)
        ],
    ),
    (
        "docs/papers.md",
        "within 3,000 evaluations in {} % of the starts",
        [("siasun_sr210d", "searches on the Michalewicz function", "BAS", "reached, % of the starts")],
    ),
    *(
        (
            "docs/papers.md",
            f"| {axis} ({word}) | {{}} ({{}}) | {{}} ({{}}) | {{}} ({{}}) |",
            [
                ("spray_7dof", "errors of the hidden arm (mm)", f"{model}, {axis}", statistic)
                for model in SPRAY
                for statistic in ("mean", "max")
            ],
        )
        for axis, word in (("X", "reach"), ("Y", "vertical"), ("Z", "rail"))
    ),
]


def diagnosed_row(name: str, runs: list[dict[str, Any]]) -> str:
    """The line of the table of diagnoses: arms, answers, what is left over the best plain, names by what they claim."""
    over = sorted(run["after_mm"] / run["plain_mm"] for run in runs if run["after_mm"] is not None)
    middle = (over[(len(over) - 1) // 2] + over[len(over) // 2]) / 2
    names = [(one["grade"], one["told"]) for run in runs for one in run["names"]]
    claimed = [sum(grade != "C" and told == what for grade, told in names) for what in ("right", "wrong")]
    doubtful = [sum(grade == "C" and told == what for grade, told in names) for what in ("right", "open")]
    cells = (name, f"{len(over)} of {len(runs)}", f"{middle:.2f} ({over[-1]:.2f})", sum(x > 1.05 for x in over))
    return f"| {' | '.join(map(str, (*cells, *claimed, *doubtful)))} |"


STUDIES = {"siasun_sr210d": "SR210D", "kuka_kr500": "KR500", "pmc6va030": "PMC", "staubli_rx160l": "RX160L"}


@pytest.mark.parametrize("name", NAMES)
def test_the_table_of_diagnoses_is_that_of_the_record(name: str) -> None:
    runs = read_json(ROOT / "bench" / "papers" / "diagnosed.json")["arms"][name]
    assert [run["seed"] for run in runs] == list(range(len(runs)))
    assert diagnosed_row(STUDIES.get(name, "spray"), runs) in (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")


WORLDS = ("waves of the joints", "waves of the point in the base's axes", "waves of the links' tilt and length")
THREE_WORLDS = [
    (
        "docs/papers.md",
        f"| {line} | {{}} | {{}} | {{}} |",
        [(study, f"{measure} (mm)", world, column) for world in WORLDS],
    )
    for study, measure, rows in (
        (
            "siasun_sr210d",
            "mean error of 200 poses not learnt",
            {
                "SR210D, BSO-MLP behind the paper's model": "BSO-MLP behind the paper's model",
                "SR210D, BSO-MLP behind fastcal's model": "BSO-MLP behind fastcal's model",
                "SR210D, `gp` behind fastcal's model": "gp behind fastcal's model",
            },
        ),
        (
            "kuka_kr500",
            "mean error of 200 unseen poses, 15 fitted",
            {"KR500, 33 parameters from 15 poses": "33", "KR500, fastcal's": "fastcal's best"},
        ),
        (
            "pmc6va030",
            "mean error of the rows not trained on",
            {
                "PMC, SOMM-ANN behind the paper's model": "SOMM-ANN, the paper's",
                "PMC, CA-SOMM-ANN behind the paper's model": "CA-SOMM-ANN, the paper's",
                "PMC, SOMM-ANN behind fastcal's model": "SOMM-ANN behind fastcal's model",
                "PMC, `mlp` behind fastcal's model": "fastcal's mlp behind fastcal's model",
            },
        ),
        (
            "staubli_rx160l",
            "mean error of 708 poses not learnt",
            {
                "RX160L, GA-DNN behind the paper's model": "GA-DNN, the paper's",
                "RX160L, GA-DNN behind geometry of the same rows": "GA-DNN behind geometry of the same rows",
                "RX160L, `gp` behind geometry of the same rows": "fastcal's best: gp behind geometry of the same rows",
            },
        ),
        (
            "spray_7dof",
            "mean error of 100 poses not fitted",
            {
                "spray, beams as in the file": SPRAY[1],
                "spray, beams of identified stiffness": SPRAY[2],
            },
        ),
    )
    for line, column in rows.items()
]
REAL = [
    (
        "docs/papers.md",
        f"| {line} | {{}} | {{}} | {{}} |",
        [("real", f"{name}, {count} rows held back (mm)", REAL_NAMES[key], statistic)
         for name, count in (("UR5", 300), ("UR10 b", 449), ("UR10 c", 832))],
    )
    for key, line in {
        "geometry": "geometry",
        "bp": "backpropagation",
        "bso": "BSO-MLP",
        "somm": "SOMM-ANN",
        "ca": "CA-SOMM-ANN",
        "ga_dnn": "GA-DNN",
        "profiles": "joint profiles",
        "bso_profiles": "BSO-MLP behind joint profiles",
        "somm_profiles": "SOMM-ANN behind joint profiles",
        "mlp": "`mlp`",
        "gp": "`gp`",
    }.items()
    for statistic in ("mean", "rms")
]  # fmt: skip
UNTRAINED, UNSEEN = "rows not trained on: GB10 and GB30 (mm)", "poses learnt and not learnt (mm)"
CHOICE, COSTS = "40 poses held out (mm)", "three costs (mm)"
SOMM, CA_SOMM, PMC_BEST = "SOMM-ANN, the paper's", "CA-SOMM-ANN, the paper's", "fastcal's mlp behind fastcal's model"
SOMM_OURS = "SOMM-ANN behind fastcal's model"
SPLIT, SPLIT_BEST = "two thirds of the configurations fitted, and others (mm)", "others, fastcal's best"
WITH_SLACK = "fastcal's best: compliances and a slack whose sides are found"
GA_DNN, GLOBAL = "GA-DNN, the paper's", "GA-DNN and pieces, the paper's"
RX160L_BEST, GLOBAL_BEST = (
    "fastcal's best: gp behind geometry of the same rows",
    "fastcal's best: gp and plain compliances",
)
RX160L: list[tuple[str, str, list[tuple[str, str, str, str]]]] = [
    (
        "docs/papers.md",
        "{} mm within the poses of `fastcal paper staubli_rx160l` (paper: 4.51)",
        [("staubli_rx160l", CHOICE, "before", "mean")],
    ),
    (
        "docs/networks.md",
        "| RX160L, GA-DNN, 708 poses | 0.52, 0.07 | {}, {} | {} |",
        [("staubli_rx160l", UNSEEN, row, "not learnt, mean") for row in ("before", GA_DNN, RX160L_BEST)],
    ),
    (
        "docs/networks.md",
        "| the same with 9.95 kg: network alone, with compliances | 63 % less | {}, {} | {} |",
        [
            ("staubli_rx160l", "168 poses with 9.95 kg (mm)", row, "mean")
            for row in ("GA-DNN alone", GLOBAL, GLOBAL_BEST)
        ],
    ),
    (
        "docs/networks.md",
        "five plain layers trained as long as GA-DNN leave {} mm",
        [("staubli_rx160l", UNSEEN, "backpropagation, 5 layers, Adam", "not learnt, mean")],
    ),
    *(
        (
            "docs/papers.md",
            f"{layers} {{}} mm by gradient descent and {{}} mm by Adam",
            [
                ("staubli_rx160l", UNSEEN, f"backpropagation, {count} layers, {rule}", "not learnt, mean")
                for rule in ("gradient descent", "Adam")
            ],
        )
        for layers, count in (("two layers leave", 2), ("five", 5))
    ),
    (
        "docs/papers.md",
        "they come out at {} and {} N m in the median, hidden at {} and {},",
        [
            ("staubli_rx160l", PAIRS, f"joint{joint} critical (N m)", column)
            for column in ("found", "hidden (printed)")
            for joint in (2, 3)
        ],
    ),
    *(
        (
            "docs/papers.md",
            line,
            [("staubli_rx160l", table, row, column) for row in rows for column in columns],
        )
        for line, table, rows, columns in (
            (
                "| 40 poses held out, chosen set, mean (max) | 0.29 (0.65) | {} ({}) | {} ({}) |",
                CHOICE,
                ("the chosen set", RX160L_BEST),
                ("mean", "max"),
            ),
            (
                "| GA-DNN, 708 poses not trained on, mean (max) | 0.07 (0.21) | {} ({}) | {} ({}) |",
                UNSEEN,
                (GA_DNN, RX160L_BEST),
                ("not learnt, mean", "max"),
            ),
            *(
                (
                    f"| any payload, {load}, 98 % of 168 poses (mean) | 0.22 | {{}} ({{}}) | {{}} ({{}}) |",
                    f"168 poses with {load} (mm)",
                    (GLOBAL, GLOBAL_BEST),
                    ("98 % within", "mean"),
                )
                for load in ("5.95 kg", "9.95 kg")
            ),
        )
    ),
    (
        "docs/papers.md",
        "699, 1,398 and 2,796 rows leave {}, {} and {} mm",
        [
            ("staubli_rx160l", "fastcal's best by rows learnt (mm)", rows, "not learnt, mean")
            for rows in ("699", "1,398", "2,796")
        ],
    ),
    (
        "docs/papers.md",
        "profiles of the joints leave {} mm, and what is fitted to the network's 2,796 rows leaves {} mm",
        [
            ("staubli_rx160l", CHOICE, row, "mean")
            for row in ("these and profiles of the joints", "the same fitted to the network's rows")
        ],
    ),
    (
        "docs/networks.md",
        "`mlp` leaves {} mm behind the paper's model",
        [("staubli_rx160l", UNSEEN, "fastcal's mlp", "not learnt, mean")],
    ),
    *(
        (
            "docs/choosing-parameters.md",
            f"| {row} | {printed} | {{}} ({{}}) |",
            [("staubli_rx160l", CHOICE, row, column) for column in ("mean", "max")],
        )
        for row, printed in (
            ("the chosen set", "0.29 (0.65)"),
            ("the conventional 23", "a figure"),
            ("all that are identifiable", ""),
        )
    ),
]
PMC: list[tuple[str, str, list[tuple[str, str, str, str]]]] = [
    (
        "docs/papers.md",
        "| configurations without load, before, mean | 3.704 | {} | |",
        [("pmc6va030", SPLIT, "before calibration, base aligned", "mean")],
    ),
    (
        "docs/papers.md",
        "| the same after geometry, RMS: (15) as printed, with a slack | 0.383 | {} | {} |",
        [("pmc6va030", COSTS, row, "RMS") for row in ("BFGS on (15) as printed, the mean distance", WITH_SLACK)],
    ),
    ("docs/networks.md", "behind it SOMM-ANN leaves {} mm too", [("pmc6va030", UNTRAINED, SOMM_OURS, "mean")]),
    ("docs/papers.md", "least squares leaves {} mm", [("pmc6va030", COSTS, "least squares", "RMS")]),
    (
        "docs/papers.md",
        "| the same, SOMM-ANN of 50 epochs at most, stopped early | | {} | |",
        [("pmc6va030", UNTRAINED, "SOMM-ANN, 50 epochs and early stop", "mean")],
    ),
    ("docs/papers.md", "of the configurations that were not fitted {} mm", [("pmc6va030", SPLIT, SPLIT_BEST, "mean")]),
    (
        "docs/papers.md",
        "without the sides it leaves {} mm",
        [("pmc6va030", UNTRAINED, "fastcal's mlp behind geometry and compliances", "mean")],
    ),
    *(
        (
            file,
            line,
            [("pmc6va030", UNTRAINED, row, "mean") for row in rows],
        )
        for file, line, rows in (
            ("docs/papers.md", "| rows not trained on, SOMM-ANN, mean | 0.389 | {} | {} |", (SOMM, PMC_BEST)),
            ("docs/papers.md", "| the same, CA-SOMM-ANN | 0.310 | {} | {} |", (CA_SOMM, PMC_BEST)),
            (
                "docs/networks.md",
                "| PMC, SOMM-ANN, rows not trained on | 0.618, 0.389 | {}, {} | {} |",
                ("geometry", SOMM, PMC_BEST),
            ),
            (
                "docs/networks.md",
                "| PMC, CA-SOMM-ANN, the same rows | 0.618, 0.310 | {}, {} | {} |",
                ("geometry", CA_SOMM, PMC_BEST),
            ),
            ("docs/networks.md", "one network with three outputs leaves {} mm", ("one network, three outputs",)),
        )
    ),
]
SENT = "errors of the hidden arm (mm)"
SR210D: list[tuple[str, str, list[tuple[str, str, str, str]]]] = [
    (
        "docs/papers.md",
        "with the load known and 300 poses, leaves {} mm",
        [("siasun_sr210d", RIVALS, "BSO-MLP behind fastcal's model", "200 others")],
    ),
    (
        "docs/papers.md",
        "the ratio of joint 2 ({} of its standard deviations off)",
        [("siasun_sr210d", "reduction and coupling ratios", "k2", "off by (std)")],
    ),
    *(
        ("docs/papers.md", f"| {line} | {{}} |", [("siasun_sr210d", SENT, row, "mean")])
        for line, row in (
            ("nominal joints", "nominal joints"),
            ("the paper's model", "the paper's model, iterated"),
            (
                "the paper's model and network (`train --network bso-mlp`)",
                "the paper's model and its network, iterated",
            ),
            ("fastcal's model", "fastcal's model, iterated"),
            ("fastcal's model and network (`train --network gp`)", "fastcal's model and gp, iterated"),
        )
    ),
    (
        "docs/networks.md",
        "| SR210D, BSO-MLP, 200 poses | 0.9370, 0.6522 | {}, {} | {} |",
        [
            ("siasun_sr210d", "200 others", "before, mean", COMPARED[2]),
            *(("siasun_sr210d", "200 others", "after, mean", column) for column in COMPARED[2:]),
        ],
    ),
    (
        "docs/networks.md",
        "The SR210D's network leaves {} mm from a random start",
        [("siasun_sr210d", RIVALS, "a random start", "200 others")],
    ),
]


@pytest.mark.parametrize(("file", "line", "places"), LINES + SR210D + RX160L + PMC + THREE_WORLDS + REAL)
def test_a_documented_number_is_the_kept_one(file: str, line: str, places: list[tuple[str, str, str, str]]) -> None:
    expected = " ".join(line.format(*(median(kept(study), *place) for study, *place in places)).split())
    assert expected in unwrapped(file)


HEADLINES = [
    ("docs/papers.md", "| geometry, ratios and coupling, 50 poses held out | 0.3008 | {} | {} |", "siasun_sr210d", 0),
    ("docs/papers.md", "| stiffness under 210 kg, 200 poses not fitted | 0.9370 | {} | {} |", "siasun_sr210d", 1),
]


@pytest.mark.parametrize(("file", "line", "study", "place"), HEADLINES, ids=[line[1][:40] for line in HEADLINES])
def test_a_documented_headline_is_the_kept_one(file: str, line: str, study: str, place: int) -> None:
    headline = kept(study)["headlines"][place]
    expected = " ".join(line.format(*(significant(headline[key]["median"]) for key in ("method", "best"))).split())
    assert expected in unwrapped(file)


@pytest.mark.parametrize("name", NAMES)
def test_a_kept_study_can_be_drawn_and_betters_its_paper_s_method(name: str) -> None:
    content = kept(name)
    assert content["paper"]["name"] == name
    assert all(headline["bettered"] for headline in content["headlines"])
    assert all(headline["reached"] or headline["why"] for headline in content["headlines"])
    assert paper_page(content).count("<figure") == sum(
        exhibit["kind"] == "chart" for section in content["sections"] for exhibit in section["exhibits"]
    )
