# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every kind of reading has an error and a noise of its own, checks of its residuals, and is named where worthless.

The arm and what instruments read of it are in numpy, written from the docs alone.
"""

import os
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import fastcal
from fastcal import Dataset, calibrate
from fastcal.calibration.variance_components import _factors
from fastcal.measurements.kinds import kind_named
from fastcal.report.diagnosis_report import diagnosis_page
from fastcal.report.next_step import next_step
from fastcal.report.summaries import summary
from fastcal.units import factor

from .bench_arm import disturbed, postures, robot, tool_points
from .kind_sets import ALONE, ANCHORS, NOISE, PAIRS, read
from .spoilt_kinds import SPOILT, Spoil, conjugated

SETS = 13 if os.environ.get("FASTCAL_TEST_FULL") == "1" else 2  # of each way to spoil a kind: 104 in all
WIDTH = {"position": 3, "orientation": 3, "length": 1, "plane": 1, "tilt": 2}


def test_rows_that_are_outliers_are_told_apart_in_the_summary() -> None:
    data = read(("position",), 120, 3)
    points = np.array(data.position)
    points[[7, 70]] += 0.05
    found = calibrate(robot(), replace(data, position=points))
    assert found.outliers == [7, 70]
    told = next(line for line in summary(found) if line.startswith("  without the rows that are outliers: RMS 0."))
    kept = np.delete(found.train.kinds["position"].after, [7, 70])
    assert f"RMS {1e3 * np.sqrt(np.mean(kept**2)):.4f} mm after, largest {1e3 * kept.max():.4f} mm" in told


@pytest.mark.parametrize("kinds", [*ALONE, *PAIRS], ids="+".join)
def test_each_kind_has_its_noise_and_its_error_before_and_after(kinds: tuple[str, ...]) -> None:
    found = calibrate(robot(), read(kinds, 120, 3))
    assert found.status == "converged"
    content = found.to_json_dict()
    assert set(content["noise"]) == set(content["train"]["kinds"]) == set(kinds)
    for kind in kinds:
        unit = kind_named(kind).unit
        assert found.noise[kind].value == pytest.approx(NOISE[kind], rel=0.3 if len(kinds) > 1 else 0.15)
        assert content["noise"][kind] == {
            "value": pytest.approx(found.noise[kind].value / factor(unit)),
            "unit": unit,
            "source": "residual",
        }
        block = content["train"]["kinds"][kind]
        expected = NOISE[kind] * WIDTH[kind] ** 0.5 / factor(unit)  # less what the parameters take
        assert 0.6 * expected < block["after"]["rms"] < 1.2 * expected
        assert 3 * expected < block["before"]["rms"] if kind != "orientation" else expected < block["before"]["rms"]
    main = "position" if "position" in kinds else next(iter(content["train"]["kinds"]))  # or lengths in their place
    in_mm = content["noise"][main]["value"] if kind_named(main).unit == "mm" else None
    assert content["sigma_mm"] == found.sigma_mm == in_mm
    for when in ("before", "after"):
        in_mm = content["train"]["kinds"][main][when] if kind_named(main).unit == "mm" else None
        assert content["train"][f"{when}_mm"] == in_mm
    record = found.model.record
    assert record is not None
    assert set(record.noise) == set(kinds)


def test_before_is_the_nominal_arm_with_tool_and_anchors_fitted() -> None:
    """The least that any tool and anchors leave of the nominal arm's lengths, by scipy."""
    from scipy.optimize import least_squares

    data = read(("length",), 120, 3)
    found = calibrate(robot(), data)
    before, _after = found.train.kinds["length"].statistics
    assert before is not None
    assert data.distance is not None
    assert data.anchor is not None
    lengths, anchor = data.distance, data.anchor
    T = robot().forward(data.q)
    R, p = T[:, :3, :3], T[:, :3, 3]

    def left(x: np.ndarray) -> np.ndarray:
        points = p + np.einsum("nij,j->ni", R, x[:3])
        return np.linalg.norm(points - x[3:].reshape(-1, 3)[anchor], axis=1) - lengths

    places = [found.unknowns[f"anchor {name}"] for name in data.anchor_names]
    least = least_squares(left, np.concatenate([np.zeros(3), *places]), x_scale=1e-3)
    rms = float(np.sqrt(np.mean(least.fun**2)))
    assert before.rms == pytest.approx(rms, rel=0.05)  # Huber's loss, not squares


@pytest.mark.parametrize("kinds", [("position", "orientation"), ("orientation",), ("length",), ("tilt",), ("plane",)])
def test_a_missing_effect_is_reported_whatever_was_measured(kinds: tuple[str, ...]) -> None:
    """Joint 2 errs as a wave of its own position: the arm is where q is not."""
    q = postures(300, 53)
    wave = np.zeros_like(q)
    wave[:, 1] = 1.5e-3 * np.sin(2 * q[:, 1] + 0.4)
    data = read(kinds, seed=3, q=q + wave)
    data = replace(data, q=data.q - wave)
    found = calibrate(robot(), data)
    assert any("the stated deviations and intervals do not hold" in caveat for caveat in found.caveats)
    assert found.notes[0] == found.caveats[0] or "do not show" in found.notes[0]


@pytest.mark.parametrize("kinds", [("length",), ("orientation",), ("position", "tilt")])
def test_a_part_that_moved_is_found_in_any_kind(kinds: tuple[str, ...]) -> None:
    data = read(kinds, 120, 4)
    late = np.arange(120) >= 70
    if data.rotation is not None:
        half = 2e-3
        q = data.rotation.copy()  # turned by 4 mrad about z of the measuring frame
        w, x, y, z = q.T
        turned = np.column_stack([w - half * z, x - half * y, y + half * x, z + half * w]) / (1 + half**2) ** 0.5
        data = replace(data, rotation=np.where(late[:, np.newaxis], turned, q))
    elif data.position is not None:
        data = replace(data, position=data.position + np.where(late[:, np.newaxis], [2e-3, -1e-3, 1e-3], 0.0))
    elif data.distance is not None:  # as if the arm had been shifted before its anchors
        points, motion = tool_points(disturbed(4), data.q), np.array([8e-3, -6e-3, 5e-3])
        place = ANCHORS[np.array([int(name[1:]) for name in data.anchor_names])[data.anchor]]
        change = np.linalg.norm(points + motion - place, axis=1) - np.linalg.norm(points - place, axis=1)
        data = replace(data, distance=data.distance + np.where(late, change, 0.0))
    found = calibrate(robot(), data)
    assert any("from row 70 on" in note for note in found.notes), found.notes


def refusal(data: Dataset) -> str:
    """What calibration refuses the data with; empty where it takes them."""
    try:
        calibrate(robot(), data)
    except fastcal.InvalidInput as refused:
        return str(refused)
    return ""


WAYS = [(kind, way) for kind, ways in SPOILT.items() for way in ways]


@pytest.mark.parametrize(("kind", "way"), WAYS, ids=lambda each: getattr(each, "__name__", each))
def test_a_worthless_kind_beside_good_points_is_named(kind: str, way: Spoil) -> None:
    kinds = ("position",) if kind == "plane" else ("position", kind)
    for seed in range(SETS):
        data = way(read(kinds, 80, seed, claimed=seed == 1), np.random.default_rng(seed))
        refused = refusal(data)
        if refused:
            assert kind == "orientation"
            assert ("the quaternion conjugated" if way is conjugated else "the orientations do not fit") in refused
        else:
            assert way is not conjugated
        found = calibrate(robot(), data, as_read=bool(refused))
        assert [misfit.kind.name for misfit in found.misfits] == [kind]
        assert found.notes[0] == found.misfits[0].text
        assert next_step(found).startswith(f"next: check the {found.misfits[0].kind.plural}: ")
        assert "do not fit the positions" in found.notes[0]
        points = found.train.after
        assert points is not None
        assert points.rms < 1e-4  # and it does no harm to them


@pytest.mark.parametrize("kinds", PAIRS, ids="+".join)
def test_a_kind_that_fits_is_never_named(kinds: tuple[str, ...]) -> None:
    for seed in range(SETS):
        found = calibrate(robot(), read(kinds, 80, seed, claimed=bool(seed % 2)))
        assert (found.status, found.misfits) == ("converged", [])


@pytest.mark.parametrize(
    ("kinds", "seed"), [(("orientation", "length"), 107), (("length", "tilt"), 105), (("plane", "tilt"), 107)]
)
def test_a_claim_that_explains_all_stands_beside_a_kind_without_one(kinds: tuple[str, ...], seed: int) -> None:
    """A noise of 0 beside the claim ended as "the measurements determine none of the 51 requested parameters"."""
    found = calibrate(robot(), read(kinds, 80, seed, claimed=True))
    assert (found.status, found.misfits) == ("converged", [])
    for kind in kinds:
        assert found.noise[kind].value == pytest.approx(NOISE[kind], rel=0.3)


def test_a_frame_that_is_a_little_off_is_told_by_its_turn() -> None:
    from scipy.spatial.transform import Rotation

    data = read(("position", "orientation"), 80, 5)
    turn = Rotation.from_rotvec(np.radians([0.3, -0.8, 0.5]))
    assert data.rotation is not None
    R = turn * Rotation.from_quat(data.rotation[:, [1, 2, 3, 0]])
    found = calibrate(robot(), replace(data, rotation=R.as_quat()[:, [3, 0, 1, 2]]))
    (misfit,) = found.misfits
    said = re.search(r"in another frame, turned by ([0-9.]+) deg", misfit.text)
    assert said is not None
    assert float(said[1]) == pytest.approx(np.degrees(turn.magnitude()), rel=0.02)


def test_a_kind_far_beyond_its_sigma_is_named() -> None:
    data = read(("position", "orientation"), 80, 6, claimed=True)
    optimistic = replace(data, sigma_rotation=np.full(80, NOISE["orientation"] / 8))
    (misfit,) = calibrate(robot(), optimistic).misfits
    assert "8 times more than their sigma says" in misfit.text


def test_a_missing_effect_is_no_sign_of_a_wrong_unit() -> None:
    """Positions that a wave of joint 2 moves by twenty times what their sigma column says."""
    q = postures(150, 53)
    wave = np.zeros_like(q)
    wave[:, 1] = 5e-3 * np.sin(2 * q[:, 1] + 0.4)
    data = read(("position", "orientation"), seed=3, q=q + wave, claimed=True)
    found = calibrate(robot(), replace(data, q=data.q - wave))
    assert found.lacks_effect
    assert found.misfits == []


def test_the_diagnosis_leaves_a_worthless_kind_out_and_says_so() -> None:
    data = SPOILT["orientation"][1](read(("position", "orientation"), 80, 2), np.random.default_rng(2))
    with pytest.raises(fastcal.InvalidInput, match="the orientations do not fit this robot"):
        fastcal.diagnose(robot(), data)
    found = fastcal.diagnose(robot(), data, as_read=True)
    assert found.sentence.startswith("The orientations do not fit the positions")
    assert "No missing effect" not in found.sentence
    assert found.to_json_dict()["misfits"][0]["kind"] == "orientation"
    lines = summary(found)
    assert lines[0] == "bench: none; orientations do not fit"
    assert lines[-1].startswith("next: Check the orientations: the unit and the frame of their columns")
    text = diagnosis_page(found)
    card = text[text.index('id="misfits"') :]
    assert "<h3>Orientations</h3>" in card[: card.index("</section>")]
    assert "Nothing missing; orientations do not fit" in text
    assert 'class="verdict caution"' in text
    clean = fastcal.diagnose(robot(), read(("position", "orientation"), 80, 2))
    assert "No missing effect is detectable" in clean.sentence
    assert 'id="misfits"' not in diagnosis_page(clean)
    content = clean.to_json_dict()
    assert set(content["kinds"]) == set(content["noise"]) == {"position", "orientation"}


@pytest.mark.parametrize("kind", ["length", "orientation", "tilt"])
def test_a_diagnosis_without_points_speaks_of_its_own_kind(kind: str) -> None:
    found = fastcal.diagnose(robot(), read((kind,), 120, 3))
    content = found.to_json_dict()
    unit = kind_named(kind).unit
    assert content["sigma_mm"]["value"] == found.sigma_mm
    assert found.sigma_mm == (content["noise"][kind]["value"] if unit == "mm" else None)
    assert (content["gap"][0]["train_rms_mm"] is None) == (unit != "mm")
    assert content["gap"][0]["kinds"][kind]["unit"] == unit
    assert f"{unit}." in found.sentence
    assert "0.000 mm" not in found.sentence


def test_lengths_say_how_surely_they_know_the_shape() -> None:
    found = calibrate(robot(), read(("length",), 120, 3))
    assert found.shape is not None
    assert found.shape.distance < 3e-5 < 3e-4 < found.shape.point
    planes = calibrate(robot(), read(("plane",), 120, 3)).shape
    assert planes is not None
    assert planes.scaled < 3e-5 < 3e-4 < planes.distance
    assert "a common scale of all lengths" in planes.note
    assert calibrate(robot(), read(("position",), 60, 3)).shape is None
    # Distances of the fitted arm are as near to the true ones as said.
    q = postures(200, 70)
    mine, true = found.model.forward(q)[:, :3, 3], tool_points(disturbed(3), q)
    apart = [np.linalg.norm(p[:100] - p[100:], axis=1) for p in (mine, true)]
    assert np.sqrt(np.mean((apart[0] - apart[1]) ** 2)) < 3 * found.shape.distance


def test_variance_components_by_hand() -> None:
    """One parameter, the mean of eight numbers of kind 0 and of four of kind 1.

    Residuals +-1 of kind 0 and +-2 of kind 1 about 0; each number has the leverage w_i^2 / sum w^2.
    """
    J = np.ones((12, 1))
    r = np.array([1.0, -1.0] * 4 + [2.0, -2.0] * 2)
    of = np.repeat([0, 1], [8, 4])
    found = _factors(J, r, of, [True, True])
    assert found is not None
    a, b = found**2  # variances: the squares 8 and 16 over the numbers less their leverages
    s = 8 / a + 4 / b
    assert a == pytest.approx(8 / (8 - 8 / a / s), rel=1e-3)
    assert b == pytest.approx(16 / (4 - 4 / b / s), rel=1e-3)
    assert _factors(J, r, of, [True, False])[1] == 1.0  # type: ignore[index]


def test_a_parameter_has_the_freedom_of_the_readings_that_determine_it() -> None:
    """Of 90 points and 45 touches, joints have that of the points, and planes nearly that of the touches alone."""
    found = calibrate(robot(), read(("position", "plane"), 90, 3))
    assert found.own_freedom is not None
    of = dict(zip([f"{p.owner} {p.name}" for p in found.parameters], found.own_freedom, strict=True))
    touches = 45 - sum(name.startswith("plane") for name in of)
    assert all(0.9 * touches < of[f"plane p{k} {name}"] < 100 for k in range(3) for name in ("rx_deg", "offset_mm"))
    assert of["joint2 theta_deg"] > 0.8 * (3 * 90 - len(of))
    assert max(of.values()) <= found.degrees_of_freedom + 1
    low, high = found.interval().T
    offset = [f"{p.owner} {p.name}" for p in found.parameters].index("plane p0 offset_mm")
    half = 0.5 * (high - low)[offset] / (found.parameters[offset].std or np.nan)
    assert half == pytest.approx(stats.t.ppf(0.975, of["plane p0 offset_mm"]))
    assert calibrate(robot(), read(("position",), 90, 3)).own_freedom is None


def test_evaluation_fits_what_a_kind_hangs_on() -> None:
    found = calibrate(robot(), read(("length",), 120, 3))
    seen = fastcal.evaluate(found.model, read(("length",), 40, 9, truth=disturbed(3)))
    after = seen.kinds["length"].statistics[1]
    assert after is not None
    assert after.rms == pytest.approx(NOISE["length"], rel=0.5)
    few = read(("length",), 40, 9, truth=disturbed(3))[:3]
    assert fastcal.evaluate(found.model, few).kinds == {}


def test_a_set_without_a_kind_is_one_that_never_had_it() -> None:
    from fastcal.measurements.observations import without_kinds

    both = read(("position", "plane"), 20, 1)
    assert list(without_kinds(both, ["plane"]).kinds) == ["position"]
    assert list(without_kinds(both, ["position"]).kinds) == ["plane"]
    assert isinstance(both, Dataset)
