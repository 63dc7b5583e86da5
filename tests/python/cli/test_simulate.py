# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal simulate` and `demo`: seeded, with the noise that was asked for, and said to be simulated."""

import numpy as np
import pytest

import fastcal as library
from fastcal.cli.demo import HEAD


def test_without_noise_the_robot_itself_is_measured(demo, tmp_path, fastcal) -> None:
    model = library.load_robot(demo / "model.yaml")
    out = tmp_path / "simulated.csv"
    said = fastcal("simulate", demo / "model.yaml", demo / "test.csv", "--noise-rot-deg", 0, "-o", out)
    assert (said.code, said.out, said.err) == (0, f"{out}: 60 poses of staubli_rx160l measured by simulation\n", "")
    sent, data = (library.load_measurements(path, model) for path in (demo / "test.csv", out))
    T = model.forward(sent.q, payload=sent.payload)
    np.testing.assert_allclose(data.q, sent.q, atol=1e-15)
    np.testing.assert_array_equal(data.payload, sent.payload)
    np.testing.assert_allclose(data.position, T[:, :3, 3], atol=1e-14)
    np.testing.assert_allclose(np.abs(np.sum(data.rotation * library.predict(model, sent).rotation, axis=1)), 1.0)


def test_a_seed_gives_the_same_numbers_and_another_gives_others(demo, tmp_path, fastcal) -> None:
    arguments = "simulate", demo / "model.yaml", demo / "test.csv", "--noise-mm", 0.1, "--repeatability-deg", 0.01
    for name, seed, threads in (("a", 7, 1), ("b", 7, 2), ("c", 8, 1)):
        out = tmp_path / f"{name}.csv"
        assert fastcal(*arguments, "--seed", seed, "--threads", threads, "-o", out).code == 0
    a, b, c = ((tmp_path / f"{name}.csv").read_text() for name in "abc")
    assert a == b
    assert a != c


def test_motor_currents_are_written_as_asked(demo, tmp_path, fastcal) -> None:
    model = library.load_robot(demo / "model.yaml")
    out = tmp_path / "currents.csv"
    asked = "--torque-per-ampere", "40,40,35,20,9,-9"
    assert fastcal("simulate", demo / "model.yaml", demo / "test.csv", *asked, "-o", out).code == 0
    data = library.load_measurements(out, model)
    sent = library.load_measurements(demo / "test.csv", model)
    held = library.simulate(model, sent, torque_per_ampere=[40, 40, 35, 20, 9, -9]).current
    np.testing.assert_allclose(data.current, held, rtol=1e-12, atol=1e-12)
    assert np.abs(data.current[:, 1]).max() > 1
    for wrong, words in ((("--friction-nm", 3), "give --torque-per-ampere too"), (("--torque-per-ampere", "4x"), "4x")):
        said = fastcal("simulate", demo / "model.yaml", demo / "test.csv", *wrong, "-o", out)
        assert said.code == 2
        assert words in said.err


def test_the_demonstration_says_that_it_simulates_and_ends_with_its_report(tmp_path, process) -> None:
    said = process("demo", "--seed", 3, cwd=tmp_path)
    assert (said.code, said.err) == (0, "")
    first, *_, last = said.out.splitlines()
    assert "simulation" in first
    assert last == "fastcal-demo/report.html"
    out = tmp_path / "fastcal-demo"
    assert "imulated" in (out / "report.html").read_text()
    assert HEAD in (out / "robot.yaml").read_text()
    assert {path.name for path in out.iterdir()} == {
        *("robot.yaml", "measurements.csv", "test.csv"),
        *("model.yaml", "result.json", "report.html", "diagnosis"),
    }
    assert "imulated" in (out / "diagnosis" / "report.html").read_text()


def test_the_demonstration_replaces_an_older_one(demo, tmp_path, fastcal) -> None:
    assert fastcal("demo", "-o", tmp_path, "--seed", 2).code == 0
    older = (tmp_path / "measurements.csv").read_text()
    assert fastcal("demo", "-o", tmp_path).code == 0
    assert (tmp_path / "measurements.csv").read_text() == (demo / "measurements.csv").read_text() != older


def test_the_demonstration_finds_the_arm_that_it_hid(demo) -> None:
    """Compliances within 3.5 of their deviations, the four gross rows, and the tracker's and the joints' noise."""
    model = library.load_robot(demo / "model.yaml")
    found = {entry["owner"]: entry["parameters"]["compliance_rad_nm"] for entry in model.spec["effects"]}
    for owner, hidden in (("joint2", 4e-7), ("joint3", 6e-7)):
        assert abs(found[owner]["value"] - hidden) < 3.5 * found[owner]["std"] < 0.5 * hidden
    test = library.load_measurements(demo / "test.csv", model)
    rms = np.sqrt(np.mean(library.evaluate(model, test).error_after ** 2))
    assert rms == pytest.approx(0.035e-3, rel=0.25)
