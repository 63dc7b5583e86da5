# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do 95 % intervals hold the truth 95 times in 100, for every effect, groups of three and every kind of reading?

Each set has an arm of its own (geometry off by 0.5 mm and 0.5 mrad, effects of their plausible sizes), and poses,
conditions and noise of its own; fastcal simulates it and, given which effects there are, identifies them. Counted are
the effects' parameters; what is reported as unidentifiable is not promised, and counted apart. FILE holds every row
as soon as it is counted: the same command again goes on where it was stopped. `--kinds` counts kinds of reading
instead, alone and in pairs (`coverage_of_kinds.py`), `--touches` those of balls, cubes and dial gauges alone.

    python bench/python/bench_coverage.py [--sets 200] [--jobs N] [--loss tukey none] [--out FILE]
        [--effects NAME ... | --kinds | --touches]
"""

from __future__ import annotations

import argparse
import copy
import functools
import json
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import coverage_of_kinds
import joblib
import numpy as np
from scipy import special

from fastcal.calibration.calibrate import LOSSES, CalibrationResult, calibrate
from fastcal.calibration.options_from_data import with_origins
from fastcal.calibration.simulation import perturbed, random_poses, simulate
from fastcal.calibration.smoothing import prior_deviations
from fastcal.effects.entries import build_effects, edge_name, edge_unit, full_name, parse_effects
from fastcal.io.atomic import write_text
from fastcal.io.robot_file import load_robot
from fastcal.io.structure_schema import check_structure
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, Spec
from fastcal.units import from_si, to_si

LEVEL = 0.95
GOAL = (0.93, 0.97)
POSES = 200
NOISE = to_si(0.03, "mm")
GROUPS = "groups of three"
SCALE = "measurement_scale"  # needs known lengths: identified by itself, without geometry
AT_A_POSITION = ("posture_backlash", "encoder_jump")  # counted alone: the groups of the record were drawn before them

# Where on the arm each effect is visible.
OWNERS: dict[str, tuple[str, ...]] = {
    "backlash": ("@joint1", "@joint2", "@joint3", "@joint4", "@joint5", "@joint6"),
    "base_drift": ("@base",),
    "base_settling": ("@base:tau_s=3000",),
    "base_step": ("@base",),
    "beam_gravity": ("@structure",),
    "bearing_tilt": ("@joint1", "@joint2", "@joint3"),
    "compensator_spring": ("@joint2",),
    "coupling_ratio": ("@joint3<-joint2", "@joint5<-joint4", "@joint6<-joint4", "@joint6<-joint5"),
    "current_compliance": ("@joint1", "@joint2", "@joint3", "@joint4", "@joint5", "@joint6"),
    "encoder_jump": ("@joint1", "@joint2", "@joint3", "@joint5"),
    "gear_harmonic": ("@joint1:order=2", "@joint3:order=2", "@joint4:order=1", "@joint5:order=2:side=motor"),
    "joint_compliance": ("@joint2", "@joint3", "@joint4", "@joint5"),
    "joint_compliance_nonlinear": ("@joint2", "@joint3"),
    "joint_profile": ("@joint1", "@joint2", "@joint3", "@joint4", "@joint5"),
    "link_bending": ("@link2", "@link4"),
    "link_com": ("@link2", "@link3"),
    "link_mass": ("@link2", "@link3", "@link4"),
    "link_torsion": ("@link2", "@link4"),
    SCALE: ("@instrument",),
    "payload_com": ("@payload",),
    "payload_mass": ("@payload",),
    "posture_backlash": ("@joint1<-joint2", "@joint3<-joint5", "@joint5<-joint3", "@joint2<-joint1"),
    "range_step": ("@instrument",),
    "range_wave": ("@instrument:period_mm=700",),
    "reduction_ratio": ("@joint1", "@joint2", "@joint3", "@joint4", "@joint5", "@joint6"),
    "regressor": ("@base:column=tilt:axis=rx", "@link3:column=tilt:axis=z"),
    "station_offset": ("@base",),
    "thermal_base": ("@base",),
    "thermal_bending": ("@link2", "@link4"),
    "thermal_expansion": ("@robot", "@link2", "@link4"),
    "thermal_offset": ("@joint1", "@joint2", "@joint3", "@joint4", "@joint5"),
    "thermal_spring": ("@joint1", "@joint2", "@joint3", "@joint5"),
    "tool_shift": ("@tool",),
    "tool_step": ("@tool",),
    "zero_step": ("@joint1", "@joint2", "@joint3", "@joint5"),
}
# They describe an arm without masses, with loops, a history or an instrument, and have recovery tests of their own.
ELSEWHERE = {
    "friction",
    "gravity_sag",
    "pin_compliance",
    "pin_slack",
    "rod_compliance",
    "rod_slack",
    "settling",
    "surrogate",
    "tracker_angle",
    "tracker_range",
}
# Weights show through compliances alone; an arm of 500 kg is stiffer than most.
THROUGH = ("joint_compliance@joint2", "joint_compliance@joint3", "joint_compliance@joint5")
WEIGHTS = ("compensator_spring", "link_com", "link_mass", "payload_com", "payload_mass")
STIFF = {"rad_nm": 0.3}
CURVATURE = 1e-3  # of true joint profiles; the one that is fitted with is found by cross-validation


@functools.cache
def arm() -> Robot:
    """The KR500 with a spring, gear ratios and an upper arm that bends, before an instrument that stands askew."""
    spec = copy.deepcopy(load_robot("kuka_kr500_3").spec)
    spec["base"] = {"xyz_mm": [4500.0, -300.0, 700.0], "rpy_deg": [0.5, -0.8, 35.0]}
    spec["compensator"] = {
        "joint": 2,
        "anchor_mm": [-500.0, 0.0, 0.0],
        "arm_mm": [300.0, 400.0, 0.0],
        "stiffness_n_m": 2e5,
        "free_length_mm": 600.0,
    }
    tube = {"young_pa": 2.1e11, "shear_pa": 8.1e10, "area_m2": 0.02}
    tube |= {"inertia_y_m4": 1e-4, "inertia_z_m4": 1e-4, "torsion_m4": 2e-4}
    structure = {
        "nodes": [
            {"name": "shoulder", "frame": "joint2", "held": "all"},
            {"name": "elbow", "frame": "joint3", "moves": "link2"},
        ],
        "sections": {"tube": tube},
        "elements": [
            {
                "name": "upper_arm",
                "start": "shoulder",
                "end": "elbow",
                "section": "tube",
                "mass_kg": 420,
                "up_frame": "joint3",
            }
        ],
    }
    spec["structure"] = check_structure(structure, [joint["type"] for joint in spec["joints"]], Path(__file__))
    for joint in spec["joints"]:
        joint["motor_ratio"] = 15.0  # as few as make waves that 200 poses tell apart
    return Robot(spec)


def conditions(random: np.random.Generator) -> Dataset:
    """Poses and all conditions that an effect may need, in the order of time."""
    time = np.sort(random.uniform(0.0, 14400.0, POSES))
    q = random_poses(arm(), POSES, seed=int(random.integers(2**31)))
    return Dataset.from_arrays(
        q,
        payload=random.choice([0.0, 200.0, 400.0], POSES),
        temperature=to_si(20 + 12 * (1 - np.exp(-time / 5000)) + random.normal(0, 0.3, POSES), "c"),
        time=time,
        station=["hall", "door", *random.choice(["hall", "door"], POSES - 2)],
        mount=[1, 2, *random.integers(1, 3, POSES - 2)],
        approach=random.choice([-1.0, 1.0], q.shape),
        current=random.normal(0, 3, q.shape),
        extra={"tilt": random.normal(0, 1, POSES)},
    )


def drawn(entry: Spec, random: np.random.Generator) -> Spec:
    """The entry with true parameters: normal with their plausible size, or 0.5 to 2 of it where they have a sign."""
    name = entry["effect"]
    if name == "gear_harmonic":
        return entry | {"parameters": {"amplitude_rad": random.uniform(1e-4, 5e-4), "phase_rad": random.uniform(-3, 3)}}
    if name in ("base_step", "range_step", "tool_step", "zero_step"):
        entry = entry | {"at_s": random.uniform(4000.0, 10000.0)}
    if name in AT_A_POSITION:
        low, high = from_si(arm().limits[int(entry["owner"][-1]) - 1], "deg")
        entry = entry | {"at_deg": low + random.uniform(0.25, 0.75) * (high - low)}
    (effect,) = build_effects([entry], arm().core)
    size = np.array([STIFF.get(p.unit, 1.0) * p.sigma for p in effect.parameters])
    if name == "joint_profile":
        size = np.minimum(size, prior_deviations(CURVATURE, np.asarray(effect.penalty)))
    values = size * np.where(
        [p.lower == 0 for p in effect.parameters],
        random.uniform(0.5, 2.0, len(size)),
        random.standard_normal(len(size)),
    )
    if name == "joint_compliance_nonlinear":
        values[1] = random.uniform(0.2, 0.5) * values[0]  # stiffer beyond the corner, or there is none
    return entry | {
        "parameters": {
            edge_name(p, geometry=False): from_si(float(v), edge_unit(p, geometry=False))
            for p, v in zip(effect.parameters, values, strict=True)
        }
    }


@dataclass(frozen=True)
class Miss:
    """One parameter of one set: its miss in deviations, None where it was reported as unidentifiable; covered?"""

    effect: str
    name: str
    deviations: float | None
    covered: bool


def trial(label: str, seed: int, loss: str) -> list[Miss] | None:
    """Simulates and identifies one set of an effect, or of a group of three; None where it did not converge."""
    if label.startswith(coverage_of_kinds.HEAD):
        found = coverage_of_kinds.numbers(label, seed, loss)
        return None if found is None else [_miss(label, number) for number in found]
    random = np.random.default_rng([zlib.crc32(label.encode()), seed])
    names = [label]
    if label == GROUPS:
        drawn_from = [name for name in OWNERS if name not in (SCALE, *AT_A_POSITION)]
        names = sorted(random.choice(drawn_from, 3, replace=False).tolist())
    asked = [name + str(random.choice(OWNERS[name])) for name in names]
    soft = [name.partition("@")[2] for name in asked if name.startswith("joint_compliance")]
    through = [other for other in THROUGH if set(names) & set(WEIGHTS) and other.partition("@")[2] not in soft]
    poses = conditions(random)
    entries = parse_effects([*asked, *through], arm().core)[1]
    entries = [drawn(with_origins(entry, arm(), poses), random) for entry in entries]
    nominal = arm()
    built = nominal if label == SCALE else perturbed(nominal, seed=int(random.integers(2**31)))
    truth = Robot(built.spec | {"effects": entries})
    measured = simulate(truth, poses, noise=NOISE, seed=int(random.integers(2**31)))
    geometry = [] if label == SCALE else ["geometry"]
    result = calibrate(nominal, measured, effects=[*geometry, *asked, *through], loss=loss)
    if result.status != "converged":
        return None
    return [miss for entry in entries[: len(asked)] for miss in misses(entry, result)]


def _miss(label: str, number: coverage_of_kinds.Number) -> Miss:
    off = (number.value - number.true) / number.std
    return Miss(label, number.name, off, covered=number.low <= number.true <= number.high)


def misses(entry: Spec, result: CalibrationResult) -> Iterable[Miss]:
    """What became of each true parameter of an effect."""
    undetermined = {name for direction in result.unidentifiable for name in direction.parameters}
    found = {(p.owner, p.name): i for i, p in enumerate(result.parameters)}
    intervals = result.interval(LEVEL)
    (effect,) = build_effects([entry], arm().core)
    names = [full_name(p) for p in effect.parameters]
    order = f"_{effect.parameters[0].name.removeprefix('sine_')}_rad"  # the name of a harmonic: amplitude_2x_rad
    for name, (key, true) in zip(names, entry["parameters"].items(), strict=True):
        if name in undetermined or (undetermined.intersection(names) and "order" in entry):
            yield Miss(entry["effect"], key, None, covered=False)
            continue
        i = found[entry["owner"], key.replace("_rad", order) if "order" in entry else key]
        parameter, bound = result.parameters[i], result.parameters[i].bound
        low, high = intervals[i]
        if key == "phase_rad":  # the turn that brings the true one next to the value
            true += 2 * np.pi * round((parameter.value - true) / (2 * np.pi))
        # On a bound it is the estimate without the bound that scatters as its deviation says.
        value, std = (parameter.value, parameter.std) if bound is None else (bound.unbounded, bound.std)
        yield Miss(entry["effect"], key, (value - true) / std, covered=bool(low <= true <= high))


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % bounds of a share (E. Wilson 1927)."""
    if count == 0:
        return 0.0, 1.0
    z = float(special.ndtri(0.5 + LEVEL / 2))
    middle = (hits + z * z / 2) / (count + z * z)
    half = z / (count + z * z) * (hits * (count - hits) / count + z * z / 4) ** 0.5
    return middle - half, middle + half


Row = dict[str, Any]
SUMS = ("not_converged", "counted", "told", "hits", "squares")


def row_of(trials: list[list[Miss] | None]) -> Row:
    """What the sets of one effect come to, as `rates` of their sums."""
    found = [miss for trial in trials for miss in trial or ()]
    z = np.array([miss.deviations for miss in found if miss.deviations is not None])
    missing = sum(trial is None for trial in trials)
    hits = sum(miss.covered for miss in found)
    return rates(dict(zip(SUMS, (missing, len(z), len(found) - len(z), hits, float(np.sum(z**2))), strict=True)))


def rates(sums: Row) -> Row:
    """The share covered, its bounds, and the root of the mean squared miss in deviations (1 is honest)."""
    count = sums["counted"]
    low, high = wilson(sums["hits"], count)
    rms = (sums["squares"] / count) ** 0.5 if count else None
    return sums | {"covered": sums["hits"] / max(count, 1), "low": low, "high": high, "rms_deviations": rms}


def pooled(rows: Iterable[Row]) -> Row:
    """All rows as one."""
    rows = list(rows)
    return rates({key: sum(row[key] for row in rows) for key in SUMS})


def measure(
    labels: list[str],
    sets: int,
    jobs: int,
    loss: str,
    known: dict[str, Row] | None = None,
    keep: Callable[[dict[str, Row]], None] = lambda rows: None,
) -> dict[str, Row]:
    """The table of one loss: a row an effect, one of the groups, one a kind or pair of kinds, one of all.

    Args:
        labels: Effects, GROUPS, kinds.
        sets: Of each.
        jobs: Processes.
        loss: Robust loss.
        known: The table so far; its rows stay.
        keep: Called with the table after each new row.
    """
    table = known or {}
    for label in labels:
        if label not in table:
            rows = table | {
                label: row_of(joblib.Parallel(jobs)(joblib.delayed(trial)(label, k, loss) for k in range(sets)))
            }
            kinds = [*coverage_of_kinds.LABELS, *coverage_of_kinds.TOUCH_LABELS]
            rows = {each: rows[each] for each in [*OWNERS, GROUPS, *kinds] if each in rows}
            table = rows | {"pooled": pooled(rows.values())}
            keep(table)
    return table


def read_tables(path: Path | None, sets: int) -> dict[str, dict[str, Row]]:
    """The tables of an earlier run with as many sets; none where there is no such file."""
    if path is None or not path.exists():
        return {}
    found = json.loads(path.read_text(encoding="utf-8"))
    if found["sets"] != sets:
        raise SystemExit(f"{path} holds {found['sets']} sets each, asked were {sets}; name another file")
    return dict(found["losses"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--loss", nargs="+", choices=LOSSES, default=["tukey", "none"])
    parser.add_argument("--effects", nargs="+", choices=[*OWNERS, GROUPS], default=[*OWNERS, GROUPS])
    parser.add_argument("--kinds", action="store_true")
    parser.add_argument("--touches", action="store_true")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    labels = coverage_of_kinds.LABELS if options.kinds else options.effects
    labels = coverage_of_kinds.TOUCH_LABELS if options.touches else labels
    tables = read_tables(options.out, options.sets)

    def keep(loss: str, rows: dict[str, Row]) -> None:
        tables[loss] = rows
        if options.out:
            found = {"sets": options.sets, "level": LEVEL, "losses": tables}
            write_text(options.out, json.dumps(found, indent=1) + "\n")

    for loss in options.loss:
        so_far = tables.get(loss)
        tables[loss] = measure(labels, options.sets, options.jobs, loss, so_far, functools.partial(keep, loss))
        print(f"loss {loss}, {options.sets} sets each")
        print(f"{'':28} counted  undetermined  covered  95 % bounds   rms  not converged")
        for label, row in tables[loss].items():
            print(
                f"{label:28} {row['counted']:7} {row['told']:12}  {row['covered']:7.3f}  "
                f"{row['low']:.3f} {row['high']:.3f}  {row['rms_deviations'] or 0:5.2f} {row['not_converged']:5}"
            )
    if not all(GOAL[0] <= tables[loss]["pooled"]["covered"] <= GOAL[1] for loss in options.loss):
        raise SystemExit(f"the pooled coverage is not within {GOAL}")


if __name__ == "__main__":
    main()
