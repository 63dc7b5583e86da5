# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The study of real arms: its rows, its splits, its test of differences, its page."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

import fastcal
from fastcal.calibration.simulation import perturbed, random_poses
from fastcal.cli import main
from fastcal_studies import real
from fastcal_studies.page import paper_page
from fastcal_studies.paired import paired
from fastcal_studies.real_data import CAMPAIGNS, split
from fastcal_studies.real_page import CURVED, NAMES, OURS, PAPERS

COUNT = 160


def noise() -> np.ndarray:
    return np.random.default_rng(9).normal(scale=5e-5, size=(COUNT, 3))


@pytest.fixture
def published(tmp_path: Path) -> Path:
    """Files in the form of the public ones, of simulated arms."""
    for k, campaign in enumerate(CAMPAIGNS):
        arm = perturbed(campaign.nominal(), length=1e-3, angle=1e-3, seed=k)
        q = random_poses(arm, COUNT, seed=k)
        points = 1e3 * (arm.forward(q)[:, :3, 3] + noise())
        path = tmp_path / campaign.file
        path.parent.mkdir(parents=True, exist_ok=True)
        columns = [*campaign.joints, *(name for parts in campaign.points for name in parts)]
        joints = np.degrees(q) if campaign.joint_unit == "deg" else q
        with path.open("w", newline="") as file:
            table = csv.writer(file, delimiter=campaign.delimiter)
            table.writerow(columns)
            for row, point in zip(joints, points, strict=True):
                split_up = [x / len(names) for x, names in zip(point, campaign.points, strict=True) for _ in names]
                table.writerow([repr(float(x)).replace(".", campaign.decimal) for x in (*row, *split_up)])
    return tmp_path


def test_published_rows_are_read_whatever_their_decimal_mark_and_unit(published: Path) -> None:
    for k, campaign in enumerate(CAMPAIGNS):
        data = campaign.rows(published)
        arm = perturbed(campaign.nominal(), length=1e-3, angle=1e-3, seed=k)
        assert data.q == pytest.approx(random_poses(arm, COUNT, seed=k), abs=1e-12)
        assert data.position == pytest.approx(arm.forward(data.q)[:, :3, 3] + noise(), abs=1e-12)


def test_a_file_that_is_missing_or_of_another_form_is_named(published: Path) -> None:
    path = published / CAMPAIGNS[0].file
    path.write_text(path.read_text().replace("joint_3", "elbow"))
    with pytest.raises(fastcal.InvalidInput, match=f"{path.name}: expected numbers in a column 'joint_3'"):
        CAMPAIGNS[0].rows(published)
    path.unlink()
    with pytest.raises(fastcal.InvalidInput, match=r"expected the published rows of the UR5 at .*No such file"):
        real.run_real(published, splits=1)


def test_a_split_shares_no_row_and_loses_none(published: Path) -> None:
    data = CAMPAIGNS[0].rows(published)
    learnt, unseen = split(data, 3)
    assert (len(learnt), len(unseen)) == (112, 48)
    rows = {tuple(row) for row in np.vstack([learnt.q, unseen.q])}
    assert rows == {tuple(row) for row in data.q}
    assert not np.array_equal(learnt.q, split(data, 4)[0].q)


def test_the_difference_of_two_methods_by_hand() -> None:
    first, second = [3.0, 5.0, 4.0, 6.0], [1.0, 2.0, 2.5, 3.0]
    found = paired(first, second, 70, 30)
    d = np.subtract(first, second)
    scale = np.sqrt((1 / 4 + 30 / 70) * d.var(ddof=1))
    assert found.mean == pytest.approx(d.mean())
    assert (found.low, found.high) == pytest.approx(stats.t.interval(0.95, 3, d.mean(), scale))
    assert found.p == pytest.approx(2 * stats.t.sf(d.mean() / scale, 3))
    plain = stats.ttest_rel(first, second)
    assert found.p > plain.pvalue  # the splits share rows
    assert not paired([1.0], [0.0], 70, 30).is_certain


@pytest.mark.full
def test_the_page_says_where_a_network_wins_and_where_not(
    published: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("torch")
    from fastcal_studies import real_methods

    cheap = dict.fromkeys(real_methods.FITS, real_methods.FITS["bp"])
    monkeypatch.setattr(real_methods, "FITS", cheap)
    out = tmp_path / "out"
    assert main(["paper", "real", "--data", str(published), "--splits", "2", "--threads", "1", "-o", str(out)]) == 0
    assert "it is not certain to in UR5 mean, UR5 rms" in capsys.readouterr().out
    page = (out / "report.html").read_text()
    assert "Simulated data" not in page
    assert "2 random splits" in page
    assert all(NAMES[key] in page for key in (*PAPERS, *OURS, *CURVED))


def made_up(leaves: dict[str, float], seed: int) -> dict[str, Any]:
    values = {key: dict.fromkeys(("mean", "rms", "max"), 1.0 + 0.01 * seed) for key in NAMES}
    values |= {key: dict.fromkeys(("mean", "rms", "max"), value + 0.01 * seed) for key, value in leaves.items()}
    return {"campaign": "UR5", "seed": seed, "rows": {"learnt": 70, "unseen": 30}, "unseen": values}


def test_a_network_that_is_worse_is_said_to_win_nowhere() -> None:
    better = real.content([made_up({"mlp": 0.5}, seed) for seed in range(3)])
    assert better["sentence"].endswith("in UR5 mean, UR5 rms and UR5 max, everywhere measured.")
    worse = real.content([made_up({"mlp": 2.0, "gp": 2.0}, seed) for seed in range(3)])
    assert "leaves less than the best of the papers' networks in none of the measures" in worse["sentence"]
    assert paper_page(worse).count("<figure") == 1


@pytest.mark.parametrize("line", [["real"], ["kuka_kr500", "--data", "."]])
def test_data_belong_to_the_study_of_real_arms(
    line: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["paper", *line, "-o", str(tmp_path / "out")]) == 2
    assert "--data FOLDER belongs to 'real'" in capsys.readouterr().err
