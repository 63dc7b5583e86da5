# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the RX160L study shows: tables 1 to 3 and figures 2, 6, 8 and 10 to 15."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fastcal.place import place_of
from fastcal_studies.exhibits import (
    Absent,
    Cell,
    Chart,
    Exhibit,
    Headline,
    Page,
    Section,
    Series,
    Table,
    spread,
    terms_table,
    worlds_section,
    worlds_won,
)
from fastcal_studies.learning import WITHOUT_TORCH
from fastcal_studies.staubli_rx160l_tables import (
    BEST,
    ERRORS,
    FIGURE_12,
    LOADS,
    NETWORKS,
    PRINTED,
    RATES,
    TERMS,
    TRACKER_MM,
    WORLD_LINES,
)
from fastcal_studies.study import Run


def page(runs: Sequence[Run]) -> Page:
    """All tables and figures; those of networks only where networks were trained."""
    trained = "networks" in runs[0]
    headlines = [
        Headline(
            "chosen set, 40 poses held out, mean (mm)",
            0.29,
            spread(runs, "selection", "held_out", "mean"),
            spread(runs, *(("best", "few") if trained else ("selection", "profiles")), "mean"),
            "a Gaussian process on joint errors behind geometry, no choice of a set"
            if trained
            else "geometry with a profile of each joint, no choice of a set",
            "The waves and harmonics of the simulated joints are sized for about that.",
        )
    ]
    remarks = []
    if trained:
        headlines += [
            Headline(
                f"GA-DNN, 708 poses not learnt, {name} (mm)",
                paper,
                spread(runs, "networks", "ga_dnn", "unseen", name),
                spread(runs, "best", "unseen", name),
                "a Gaussian process on joint errors behind geometry fitted to the same rows",
                _what_waves_cost(runs),
            )
            for name, paper in (("mean", 0.07), ("max", 0.21))
        ]
        headlines += [
            Headline(
                f"any payload, {load}, 98 % of 168 poses (mm)",
                0.22,
                spread(runs, "loads", load, "global", "98"),
                spread(runs, "best", "loads", load, "98"),
                "the same process and compliances that do not change with the load",
                _own_load(runs),
            )
            for load in LOADS
        ]
        plain, deep, mlp = (
            spread(runs, "networks", key, "unseen", "mean").median for key in ("bp5_adam", "ga_dnn", "mlp")
        )
        remarks.append(
            f"A plain network of five layers, trained as long, leaves {plain:.3f} mm where the genetic search's leaves "
            f"{deep:.3f}. fastcal's mlp behind the same model needs no search and leaves {mlp:.3f}, less than GA-DNN "
            f"in {worlds_won(runs, 'mlp', 'ga_dnn')} of hidden errors."
        )
        remarks.append(_what_remains(runs))
        gain = [1 - np.mean([run["loads"][load]["global"]["mean"] / run["loads"][load]["network"]["mean"]
                             for load in LOADS]) for run in runs]  # fmt: skip
        less = 100 * np.median(gain)
        remarks.append(f"Global compensation leaves {less:.0f} % less than the network alone (paper: 63 %).")
    sections = [_selection(runs), _stiffness(runs)]
    if trained:
        worlds = worlds_section(runs, "mean error of 708 poses not learnt", WORLD_LINES)
        sections += [_networks(runs), _loads(runs), worlds]
    else:
        names = ("Figure 10", "Figure 11", "Figure 12", "Figure 13", "Figure 15")
        sections.append(Section("Networks", "What geometry leaves.", [Absent(n, WITHOUT_TORCH) for n in names]))
    return Page(headlines, sections, remarks)


def _what_waves_cost(runs: Sequence[Run]) -> str:
    """The same network on the same arm without periodic joint errors: what is left is not theirs."""
    before, after = (spread(runs, "others", "round_gears", key, "mean").median for key in ("before", "ga_dnn"))
    wavy = spread(runs, "networks", "ga_dnn", "unseen", "mean").median
    deep = spread(runs, "networks", "bp5_adam", "unseen", "mean").median
    return (
        "The periodic errors of the simulated joints are what it does not learn: trained alike on the same arm without "
        f"them it leaves {after:.3f} mm of {before:.3f} in the mean, with them {wavy:.3f}; a plain network of five "
        f"layers leaves {deep:.3f}."
    )


def _what_remains(runs: Sequence[Run]) -> str:
    """What is left by the number of rows that fastcal's best has learnt."""
    counts = _counts(runs)
    means = [f"{spread(runs, 'best', 'by_rows', count).median:.3f}" for count in counts]
    few, known = (spread(runs, "best", key, "mean").median for key in ("few", "few_by_many"))
    return (
        f"What fastcal's best leaves is for lack of rows: of the 40 poses held out {few:.3f} mm from the calibration's "
        f"90 poses and {known:.3f} mm from the network's {int(counts[-1]):,}; of the 708 poses {', '.join(means)} mm "
        f"from {', '.join(f'{int(count):,}' for count in counts)}. The tracker's noise alone has a mean of "
        f"{TRACKER_MM:.3f} mm. That it is a Gaussian process, and of how many rows, was chosen on folds of the rows "
        "learnt of two of the arms, and on poses of theirs that are not reported."
    )


def _counts(runs: Sequence[Run]) -> list[str]:
    """Numbers of rows that fastcal's best has learnt from, ascending."""
    return sorted(runs[0]["best"]["by_rows"], key=int)


def _own_load(runs: Sequence[Run]) -> str:
    """What the network leaves under the load it learnt, before any other load comes in."""
    own = spread(runs, "networks", "ga_dnn", "unseen", "98").median
    return (
        f"Under the load that the network learnt, 98 % of the poses it did not learn are within {own:.3f} mm already."
    )


def _selection(runs: Sequence[Run]) -> Section:
    chosen = Counter(name for run in runs for name in run["selection"]["chosen"])
    best20 = runs[0]["selection"]["table"]
    rows: list[list[Cell]] = [
        [name, *printed, *_statistics(runs, "selection", key)]
        for key, name, printed in (
            ("before", "before", (4.51, 7.69)),
            ("held_out", "the chosen set", (0.29, 0.65)),
            ("conventional", "the conventional 23", (None, None)),
            ("all", "all that are identifiable", (None, None)),
            ("profiles", "these and profiles of the joints", (None, None)),
        )
    ]
    if "best" in runs[0]:
        rows.append([BEST, None, None, *_statistics(runs, "best", "few")])
        rows.append(["the same fitted to the network's rows", None, None, *_statistics(runs, "best", "few_by_many")])
    first = runs[0]["selection"]
    poses = [f"{k}" for k in range(1, 41)]
    charts: list[Exhibit] = [
        Chart(
            "Figure 8",
            f"error along {axis}, 40 poses held out, the first arm",
            "pose",
            "error (mm)",
            [
                Series("conventional", poses, first["axes"]["conventional"][k], "before", "bars"),
                Series("chosen set", poses, first["axes"]["chosen"][k], "method", "bars"),
            ],
        )
        for k, axis in enumerate("XYZ")
    ]
    found = first["identified"]
    return Section(
        "Which parameters",
        "90 poses chosen by O1; every one of 2^15 sets in three folds; 40 random poses held out.",
        [
            Chart(
                "Figure 2",
                "orientations of the 90 poses chosen by O1, the first arm",
                "joint 4 (deg)",
                "joint 5 (deg)",
                [Series("pose", runs[0]["poses"]["q4_deg"], runs[0]["poses"]["q5_deg"], "method", "points")],
                "The paper's 46 orientations are those of its own reference [11].",
            ),
            Table(
                "Table 1",
                "how often a parameter is in the chosen set",
                ("parameter", "arms", "hidden (printed)", "found less nominal, first arm (mm, deg)", "std (mm, deg)"),
                [
                    [name, float(count), _hidden(name), *_identified(found, name)]
                    for name, count in sorted(chosen.items(), key=lambda item: (-item[1], item[0]))
                ],
                f"Chosen: {_count(runs)} parameters and base and tool (paper: 17 of 24, though it lists 18).",
            ),
            Table(
                "Folds",
                "the best sets of the first arm",
                ("parameters", "root of the threefold error (mm a coordinate)"),
                [[str(int(count)), error] for count, error in best20],
                "They differ by less than the folds do: which is taken hardly matters.",
            ),
            Table(
                "Table 2",
                "40 poses held out (mm)",
                ("", "paper, mean", "paper, max", "mean", "std", "max"),
                rows,
                "The paper's conventional model is its table 2; its errors are in figure 8 alone.",
            ),
            *charts,
        ],
    )


def _statistics(runs: Sequence[Run], *path: str) -> list[Cell]:
    return [spread(runs, *path, name) for name in ("mean", "std", "max")]


def _identified(found: Run, name: str) -> list[Cell]:
    entry = next((entry for key, entry in found.items() if key.rpartition("_")[0] == name), None)
    return [None, None] if entry is None else [entry["found"], entry["std"]]


def _hidden(name: str) -> float:
    """What table 1 has of "joint2 a", less nominal [mm, deg]; 0 where it has nothing."""
    owner, _, what = name.partition(" ")
    errors = ERRORS[place_of(owner).number - 1]
    return next((error for key, error in errors.items() if key.rpartition("_")[0] == what), 0.0)


def _count(runs: Sequence[Run]) -> str:
    counts = sorted(int(run["selection"]["count"]) for run in runs)
    return f"{counts[0]}" if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]}"


def _stiffness(runs: Sequence[Run]) -> Section:
    rows: list[list[Cell]] = []
    for name, printed in PRINTED.items():
        known = [run for run in runs if name in run["stiffness"]]
        factor = 1.0 if name.endswith("critical_nm") else 1e9
        values = [factor * run["stiffness"][name]["value"] for run in known]
        stds = [factor * std for run in known if (std := run["stiffness"][name]["std"]) is not None]
        found: list[Cell] = [float(np.median(of)) if of else None for of in (values, stds)]
        unit = "N m" if factor == 1.0 else "nrad/N m"
        rows.append([f"{name.rpartition('_')[0].removesuffix('_rad')} ({unit})", factor * printed, *found])
        rows[-1].append(f"{len(known)} of {len(runs)}")
    joints = [str(joint) for joint in range(2, 7)]
    torques = runs[0]["torques"]
    return Section(
        "Stiffness in pieces",
        "50 poses under each of six loads; the differences between loads of one pose are free of geometry (12).",
        [
            Table(
                "Table 3",
                "compliance by payload pairs, medians of the arms",
                ("", "hidden (printed)", "found", "std", "arms where it succeeds"),
                rows,
                "Where a fit in pieces fails, one piece is fitted, and the row has a dash. That it succeeds shows no "
                f"corner: on single arms it is {_corners(runs)}.",
            ),
            Chart(
                "Figure 6",
                "range of the payload's torque, 2,000 poses",
                "joint",
                "torque (N m)",
                [
                    Series(f"{load}, {name}", joints, torques[load][k], role, "bars")
                    for load, role in (("0.4 kg", "before"), ("14.0 kg", "method"))
                    for k, name in enumerate(("least", "greatest"))
                ],
            ),
        ],
    )


def _networks(runs: Sequence[Run]) -> Section:
    rows: list[list[Cell]] = []
    for key, name in {"before": "before", **NETWORKS}.items():
        paper = {"before": 0.52, "ga_dnn": 0.07}.get(key)
        learnt = spread(runs, "networks", key, "learnt", "mean")
        rows.append([name, paper, learnt, *_statistics(runs, "networks", key, "unseen")])
    same = ("others", "joints_same")
    rows.append([WORLD_LINES["ga_dnn_same"], None, spread(runs, *same, "ga_dnn_learnt", "mean"),
                 *_statistics(runs, *same, "ga_dnn")])  # fmt: skip
    for name, path in (("geometry of the same rows alone", ["best", "before"]), (BEST, ["best"])):
        rows.append([name, None, spread(runs, *path, "learnt", "mean"), *_statistics(runs, *path, "unseen")])
    epochs = sorted(runs[0]["epochs"]["ga_dnn"], key=int)
    roles = {"bp2_sgd": "3", "bp2_adam": "0", "bp5_sgd": "4", "bp5_adam": "1", "ga_dnn": "method"}
    curves = [
        Series(NETWORKS[key], [int(e) for e in epochs], [spread(runs, "epochs", key, e).median for e in epochs], role)
        for key, role in roles.items()
    ]
    own = runs[0]["networks"]
    poses = list(range(1, len(own["before"]["by_pose"]) + 1))
    by_pose = [("before", "before", "before"), ("RBF network", "rbf", "0"), ("GA-DNN", "ga_dnn", "method"),
               ("fastcal's mlp", "mlp", "1")]  # fmt: skip
    places = runs[0]["places"]
    depths = sorted(int(run["depth"]) for run in runs)
    by_rows: list[list[Cell]] = [[f"{int(count):,}", spread(runs, "best", "by_rows", count)] for count in _counts(runs)]
    return Section(
        "Networks for what geometry leaves",
        "2,796 poses learnt, 708 others not, all with the tool of 3.6 kg. All networks trained by gradients have "
        "400 epochs; GA-DNN has a genetic search of its shape besides.",
        [
            terms_table(TERMS),
            Chart("Figure 10", "residuals over the workspace, the first arm", "x (mm)", "y (mm)", _by_size(places),
                  "Large and small ones lie side by side: the residual is one of the posture, not of the place."),
            Chart("Figure 11", "error on poses not learnt as the networks train", "epochs", "mean error (mm)", curves,
                  f"Medians of the arms. Gradient descent at a rate of {RATES['sgd']}, Adam of {RATES['adam']}, both "
                  "falling along half a cosine.", logarithmic=True),
            Chart("Figure 12", "poses learnt, medians of the arms", "of 2,796 poses", "error (mm)",
                  [Series(NETWORKS[key], ["mean", "98 % within", "largest"],
                          [spread(runs, "networks", key, "learnt", part).median for part in ("mean", "98", "max")],
                          role, "bars")
                   for key, role in FIGURE_12.items()]),
            Table("Figures 12 and 13", "poses learnt and not learnt (mm)",
                  ("", "paper, mean", "learnt, mean", "not learnt, mean", "std", "max"), rows,
                  f"The search chose {depths[0]} to {depths[-1]} hidden layers (paper: 11)."),
            Table("More rows", "fastcal's best by rows learnt (mm)", ("rows", "not learnt, mean"), by_rows,
                  "Geometry and hyperparameters are those of all rows. The tracker's noise alone has a mean of "
                  f"{TRACKER_MM:.3f} mm."),
            Chart("Figure 13", "poses not learnt, the first arm", "pose", "error (mm)",
                  [*(Series(name, poses, own[key]["by_pose"], role) for name, key, role in by_pose),
                   Series("fastcal's best", poses, runs[0]["best"]["unseen"]["by_pose"], "best")]),
        ],
    )  # fmt: skip


def _corners(runs: Sequence[Run]) -> str:
    """Where the arms' corners lie: "joint 2's at 9.4 to 127.6 N m (hidden 118.2), ..."."""
    found = []
    for name, hidden in PRINTED.items():
        if name.endswith("critical_nm"):
            own = [run["stiffness"][name]["value"] for run in runs if name in run["stiffness"]]
            if own:
                joint = place_of(name.partition(" ")[0]).number
                where = f"{min(own):.1f} to {max(own):.1f}" if len(own) > 1 else f"{own[0]:.1f}"
                found.append(f"joint {joint}'s at {where} N m (hidden {hidden:.1f})")
    return ", ".join(found)


def _by_size(places: Run) -> list[Series]:
    """The places of poses in the plane of x and y, one series for each third of the residuals by size."""
    error = np.array(places["error_mm"])
    low, high = np.quantile(error, (1 / 3, 2 / 3))
    thirds = {
        f"below {low:.2f} mm": ("0", error <= low),
        f"to {high:.2f} mm": ("1", (error > low) & (error <= high)),
        f"above {high:.2f} mm": ("before", error > high),
    }
    x, y = (np.array(places[axis]) for axis in ("x_mm", "y_mm"))
    return [Series(name, x[own].tolist(), y[own].tolist(), role, "points") for name, (role, own) in thirds.items()]


def _loads(runs: Sequence[Run]) -> Section:
    names = {
        "none": "geometry alone",
        "network": "GA-DNN alone",
        "global": "GA-DNN and pieces, the paper's",
        "joints_same": "GA-DNN behind geometry of the network's rows, and pieces",
        "mlp_pieces": "mlp and pieces",
        "mlp": "mlp and plain compliances",
    }
    best_name = "fastcal's best: gp and plain compliances"
    exhibits: list[Exhibit] = []
    for load in LOADS:
        rows: list[list[Cell]] = [
            [name, 0.22 if key == "global" else None, spread(runs, "loads", load, key, "98"),
             *_statistics(runs, "loads", load, key)]
            for key, name in names.items()
        ]  # fmt: skip
        best = ("best", "loads", load)
        rows.append([best_name, None, spread(runs, *best, "98"), *_statistics(runs, *best)])
        exhibits.append(
            Table("Figure 15", f"168 poses with {load} (mm)",
                  ("", "paper, 98 %", "98 % within", "mean", "std", "max"), rows)
        )  # fmt: skip
        measures = ("mean", "98", "max")
        exhibits.append(
            Chart("Figure 15", f"errors with {load}, medians of the arms", "of 168 poses", "error (mm)",
                  [Series(name, ["mean", "98 % within", "largest"],
                          [spread(runs, *path, measure).median for measure in measures], role, "bars")
                   for name, path, role in (("GA-DNN alone", ("loads", load, "network"), "before"),
                                            ("with pieces", ("loads", load, "global"), "method"),
                                            ("fastcal's best", best, "best"))])
        )  # fmt: skip
    return Section(
        "Any payload",
        "168 of the poses not learnt, measured again with other loads; network and compliances together (14).",
        exhibits,
    )
