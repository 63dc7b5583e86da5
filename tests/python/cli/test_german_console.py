# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the common commands print passes the translator: with a catalogue of blots nothing is left but names."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest

import fastcal
from fastcal.cli import main
from fastcal.report import language

COMPLIANCE = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 4e-6}}
PROGRAM = "def demo():\n  movej([0.3, -1.4, 1.6, -1.7, -1.5, 0.2], a=1.0, v=0.5)\nend\n"
# Names: of effects and their parameters, files, commands, the arm, losses, units, kinds of program.
NAMES = re.compile(
    r"[\w/]+\.(?:json|html|csv|yaml|script)|\w+@\w+|[a-z0-9]+(?:_[a-z0-9]+)+|fastcal \w+|--[a-z-]+|URScript|"
    r"joint\d \w+|theta|alpha|beta|backlash|tukey|"
    r"\b(?:rms|deg|xyz|rpy|ISO|RMS|ur5|cal|out)\b"
)


class Blotted(dict[str, str]):
    """The catalogue of a language in which every letter is a blot."""

    def get(self, message: str, default: Any = None) -> str:
        parts = re.split(r"(\{.*?\})", message)
        return "".join(part if k % 2 else re.sub(r"[^\W\d_]", "¤", part) for k, part in enumerate(parts))


def quiet(line: list[str | Path]) -> None:
    assert main([*map(str, line), "--quiet"]) in (0, 3, 4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    there = tmp_path_factory.mktemp("german")
    nominal = fastcal.load_robot("ur5")
    real = fastcal.perturbed(nominal.with_(effects=[COMPLIANCE]), seed=2)
    for name, count in (("fit", 60), ("test", 20), ("later", 12)):
        q = fastcal.random_poses(nominal, count, seed=count)
        data = fastcal.simulate(real, q, noise=3e-5, seed=count)
        fastcal.write_measurements(there / f"{name}.csv", data, nominal.joint_types)
    fastcal.calibrate(nominal, there / "fit.csv").save(there / "cal")
    (there / "demo.script").write_text(PROGRAM)
    targets = fastcal.Dataset.from_arrays(fastcal.random_poses(nominal, 5, seed=3))
    fastcal.write_measurements(there / "poses.csv", targets, nominal.joint_types)
    (there / "arms.csv").write_text("robot,data,name\nur5,fit.csv,a\nur5,test.csv,b\n")
    model = there / "cal" / "model.yaml"
    quiet(["accept", model, "--plan", "--language", "urscript", "--cycles", "2", "-o", there / "iso.script"])
    quiet(["simulate", model, there / "iso_plan.csv", "--noise-mm", "0.02", "-o", there / "iso.csv"])
    (there / "checks").mkdir()
    for month, data in ((1, "later"), (2, "test")):
        kept = there / "checks" / f"{month}.json"
        quiet(["check", model, there / f"{data}.csv", "--date", f"2026-0{month}-01", "-o", kept])
    corners = np.array([[0.0, 0.0, 0.0], [400.0, 0.0, 0.0], [400.0, 400.0, 0.0]])
    share = np.linspace(0.0, 1.0, 60)[:, np.newaxis]
    driven = np.vstack([(1 - share) * a + share * b for a, b in pairwise(corners)])
    noise = np.random.default_rng(5)
    for name, points in (
        ("corners", corners),
        *((f"run_{k}", driven + 0.05 * noise.standard_normal(driven.shape)) for k in (1, 2)),
    ):
        rows = "\n".join(",".join(f"{value:.4f}" for value in point) for point in points)
        (there / f"{name}.csv").write_text(f"x_mm,y_mm,z_mm\n{rows}\n")
    return there


@pytest.mark.parametrize(
    "line",
    [
        "calibrate ur5 fit.csv --test test.csv --limit-mm 0.3 -o out",
        "calibrate ur5 fit.csv --choose least -o out",
        "diagnose ur5 fit.csv --test test.csv -o out",
        "check cal/model.yaml later.csv",
        "evaluate cal/model.yaml test.csv",
        "compensate cal/model.yaml demo.script -o out.script",
        "design ur5 --count 12 --candidates random --candidate-count 400 -o plan.csv",
        "accept cal/model.yaml --plan --language urscript --cycles 2 -o iso.script",
        "accept cal/model.yaml iso.csv --targets iso_plan.csv --tolerance-mm 0.5 -o out",
        "accept cal/model.yaml run_1.csv run_2.csv --path corners.csv -o out",
        "compare cal/model.yaml cal/model.yaml -o out",
        "update cal/model.yaml later.csv -o out",
        "fleet arms.csv -o out",
        "fleet arms.csv --diagnose -o out",
        "history checks -o out",
    ],
)
def test_nothing_english_is_printed(folder: Path, line: str, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(folder)
    capsys.readouterr()
    with mock.patch.object(language, "catalogue", return_value=Blotted()):
        assert main([*line.split(), "--page-language", "de_DE"]) in (0, 3, 4)
    said = capsys.readouterr().out
    assert "¤" in said
    words = re.findall(r"[^\W\d_]{3,}", NAMES.sub(" ", said))
    assert " ".join(sorted({word for word in words if "¤" not in word})) == ""


def test_german_sentences_of_a_command(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setenv("FASTCAL_LANGUAGE", "de_DE.UTF-8")
    assert main(["evaluate", "cal/model.yaml", "test.csv"]) == 0
    out = capsys.readouterr().out
    assert "ur5 an test.csv: 20 Zeilen" in out
    assert re.search(r"Positionsfehler: Mittel 0,\d{4} mm", out)
    monkeypatch.setenv("FASTCAL_LANGUAGE", "fr")
    assert main(["evaluate", "cal/model.yaml", "test.csv"]) == 2
    assert "expected en or de, got 'fr'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "german"),
    [
        ("calibrate ur5 nothing.csv -o out", "Fehler: nothing.csv: diese Datei gibt es nicht"),
        ("calibrate ur6 fit.csv -o out", "Fehler: ur6: diese Datei gibt es nicht, und kein mitgelieferter"),
        ("calibrate ur5 fit.csv", "Fehler: Die Option '-o' / '--output' fehlt. (siehe fastcal calibrate --help)"),
        ("calibrate ur5 bad.csv -o out", "Fehler: bad.csv:2: erwartet 9 Zellen wie in der Kopfzeile, gefunden 8"),
        ("diagnose ur5 few.csv -o out", "Fehler: few.csv: Basis und Werkzeug brauchen mindestens drei gemessene"),
        ("check ur5 fit.csv", "Fehler: ur5 hält keine Kovarianz seiner Parameter; erwartet eine model.yaml"),
        ("compare ur5 ur5", "Warnung: ein Modell ohne Kovarianz hat keine Standardabweichungen"),
        ("detect . --cell ur5 -o out.csv", "Fehler: ur5: hat keine Kameras oder keine Tafeln"),
        ("import bare.csv -o out.csv", "Fehler: bare.csv: hat keine Kopfzeile, daher sind ihre 3 Spalten nicht"),
        ("accept ur5 --plan -o out.mod", "Fehler: --plan braucht --language rapid, krl, fanuc oder urscript"),
        ("fleet nothing.csv -o out", "Fehler: nothing.csv: diese Datei gibt es nicht"),
        ("calibrat ur5", "Fehler: Den Befehl 'calibrat' gibt es nicht. Gemeint 'calibrate'?"),
    ],
)
def test_errors_and_warnings_are_german(
    folder: Path, line: str, german: str, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(folder)
    rows = Path("fit.csv").read_text().splitlines()
    Path("few.csv").write_text("\n".join(rows[:3]) + "\n")
    Path("bad.csv").write_text("\n".join([rows[0], rows[1].rpartition(",")[0]]) + "\n")
    Path("bare.csv").write_text("1,2,3\n4,5,6\n7,8,10\n")
    monkeypatch.setenv("FASTCAL_LANGUAGE", "de_DE.UTF-8")
    main(line.split())
    assert f"fastcal: {german}" in capsys.readouterr().err


def test_json_stays_english(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(folder)
    assert main(["compare", "ur5", "ur5", "--page-language", "de", "--json"]) == 0
    told = capsys.readouterr()
    assert "a model without covariance has no standard deviations" in told.out
    assert "Warnung: ein Modell ohne Kovarianz" in told.err
