# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of numbers that are names, serial numbers or counters, and those that a sensor read."""

import numpy as np
import pytest

from fastcal.measurements.dataset import Dataset
from fastcal.measurements.labels import is_label, title_words

ROWS = 24
Q = np.random.default_rng(0).uniform(-1, 1, (ROWS, 6))
TWICE = np.repeat(Q[:12], 2, axis=0)  # each posture visited twice
COUNT = np.arange(1.0, ROWS + 1)
RNG = np.random.default_rng(1)

LABELS = {
    "counted from 1": ("foo", COUNT, Q),
    "from 0, in tens": ("foo", 10 * (COUNT - 1), Q),
    "backwards": ("foo", -COUNT, Q),
    "in any order": ("foo", RNG.permutation(COUNT), Q),
    "serial numbers": ("foo", RNG.integers(10_000, 99_999, ROWS).astype(float), Q),
    "with empty cells": ("foo", np.where(COUNT == 5, np.nan, COUNT), Q),
    "of a layer, counted up": ("foo", np.repeat([1.0, 2.0, 3.0, 4.0], 6), Q),
    "of a layer, one number lost": ("foo", np.repeat([1.0, 2, 3, 4, 5, 7], 4), Q),
    "of a posture": ("foo", np.repeat(RNG.permutation(12) + 4.0, 2), TWICE),
    "batches by their title": ("Serial No.", np.tile([4711.0, 4712.0], 12), Q),
    "numbers called name": ("name", np.linspace(0.5, 0.9, ROWS), Q),
    "German": ("Lfd. Nr.", np.tile([1.0, 2.0, 3.0], 8), Q),
    "Russian": ("Номер точки", np.tile([1.0, 2.0, 3.0], 8), Q),
    "Chinese": ("编号", np.tile([1.0, 2.0, 3.0], 8), Q),
    "Japanese": ("ポイント番号", COUNT, Q),
    "Japanese, repeated": ("ポイント", np.tile([1.0, 2.0], 12), Q),
    "Korean": ("번호", np.tile([1.0, 2.0], 12), Q),
    "Czech": ("Číslo", np.tile([1.0, 2.0], 12), Q),
}
READINGS = {
    "a pressure": ("pressure", RNG.normal(5, 1, ROWS), Q),
    "one that rises": ("oil", np.linspace(20.0, 31.7, ROWS), Q),
    "whole numbers with a unit": ("force_n", COUNT, Q),
    "a state": ("gripper", np.repeat([0.0, 1.0], 12), Q),
    "a level that comes again": ("setting", np.tile([1.0, 5.0, 3.0, 2.0], 6), Q),
    "rounded, in steps of its own": ("humidity", np.round(np.linspace(20, 60, 6)).repeat(4), Q),
    "empty": ("foo", np.full(ROWS, np.nan), Q),
    "the same": ("number_of_bolts", np.full(ROWS, 4.0), Q),
    "a real number called number": ("number", np.linspace(0.5, 0.9, ROWS), Q),
}


@pytest.mark.parametrize("kind", LABELS)
def test_names_and_counters_are_labels(kind: str) -> None:
    assert is_label(*LABELS[kind])


@pytest.mark.parametrize("kind", READINGS)
def test_readings_are_none(kind: str) -> None:
    assert not is_label(*READINGS[kind])


def test_words_lose_case_accents_and_numbers() -> None:
    assert title_words("Point_Nr. 12 / Číslo") == {"point", "nr", "cislo"}
    assert title_words("点名 №") == {"点名", "no"}


def test_a_data_set_knows_its_sensors() -> None:
    data = Dataset.from_arrays(Q, position=Q[:, :3], extra={"name": COUNT, "oil": np.linspace(20.0, 31.7, ROWS)})
    assert list(data.sensors) == ["oil"]
    assert list(data.extra) == ["name", "oil"]
