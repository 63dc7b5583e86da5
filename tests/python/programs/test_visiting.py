# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Programs that drive to the poses of a plan, read back by the readers of real programs."""

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal.programs import read_program
from fastcal.programs.measuring import LANGUAGES, language_for
from fastcal.programs.visiting import Visits, visiting_program

FloatArray = NDArray[np.float64]

Q = np.radians([[0.0, 10, 20, 30, 40, 50], [5, 20, 10, 30, 45, 60], [10, 30, 40, 20, 30, 70]])
DEGREE = np.radians(1.0)


def written(language: str, q: FloatArray = Q, **given: object) -> Visits:
    options = {
        "payload": np.zeros(len(q)),
        "approach": None,
        "driven": np.ones(len(q), dtype=bool),
        "program": f"tour{LANGUAGES[language][0]}",
        "title": "a tour",
        "dwell_s": 2.0,
        "speed": 0.2,
        "is_clear": lambda q: np.ones(len(q), dtype=bool),
    }
    return visiting_program(fastcal.load_robot("ur5"), q, language=language, **(options | given))  # type: ignore[arg-type]


def driven(visits: Visits) -> FloatArray:
    program = read_program({d.name: d.text.encode("latin-1") for d in visits.documents})
    assert program.notes == ()
    return np.array([program.targets[move.target].values for move in program.moves])


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_program_drives_to_the_poses_and_says_where_its_digits_lie(language: str) -> None:
    visits = written(language)
    np.testing.assert_allclose(visits.q, Q, atol=1e-5)
    np.testing.assert_array_equal(driven(visits), visits.q)


@pytest.mark.parametrize("language", LANGUAGES)
def test_it_runs_up_where_the_way_comes_from_the_other_side(language: str) -> None:
    """The way is upwards in joint 1: pose 1 comes from nobody knows where, pose 2 as asked, pose 3 from beyond."""
    approach = np.zeros(Q.shape)
    approach[:, 0] = [1, 1, -1]
    visits = written(language, approach=approach)
    way = driven(visits)
    assert len(way) == 5
    np.testing.assert_allclose(way[[0, 3], 0], [-2 * DEGREE, 12 * DEGREE], atol=1e-5)
    np.testing.assert_allclose(way[[0, 3], 1:], Q[[0, 2], 1:], atol=1e-5)
    np.testing.assert_allclose(way[[1, 2, 4]], Q, atol=1e-5)
    assert not any("run up" in note for note in visits.notes)


def test_a_pose_that_cannot_be_run_up_to_is_told() -> None:
    approach = np.zeros(Q.shape)
    approach[:, 0] = [1, 1, -1]
    visits = written("urscript", approach=approach, is_clear=lambda q: q[:, 0] < 11 * DEGREE)
    assert len(driven(visits)) == 4
    assert visits.notes == [
        "1 pose is not approached from its side by the program: there the arm has no room to run up"
    ]
    far = np.array([[2 * np.pi, 0, 0, 0, 0, 0]])  # where joint 1 ends
    assert "no room" in written("urscript", far, approach=-np.eye(6)[:1]).notes[0]
    assert written("urscript", far, approach=np.eye(6)[:1]).notes == []


@pytest.mark.parametrize(
    ("language", "halts"),
    [("rapid", "    Stop;"), ("krl", "HALT"), ("fanuc", "PAUSE ;"), ("urscript", 'popup("payload from here: 5 kg"')],
)
def test_it_halts_where_the_payload_changes(language: str, halts: str) -> None:
    visits = written(language, payload=np.array([0.0, 0, 5]))
    text = visits.documents[0].text
    assert text.count(halts) == 1
    assert "payload: 0 kg" in text
    assert "payload from here: 5 kg" in text
    np.testing.assert_array_equal(driven(visits), visits.q)


def test_what_it_leaves_out_stays_as_it_was() -> None:
    visits = written("fanuc", driven=np.array([True, False, True]))
    np.testing.assert_array_equal(visits.q[1], Q[1])
    assert len(driven(visits)) == 2


def test_no_target_is_named_as_the_program() -> None:
    assert "Q001" in written("rapid", program="P001.mod").documents[0].text


def test_an_arm_speaks_the_language_of_its_maker() -> None:
    arms = ("abb_irb1200_5_90", "kuka_kr6_r900", "fanuc_m20ia", "ur5e", "staubli_rx160l", "my arm")
    assert [language_for(name) for name in arms] == ["rapid", "krl", "fanuc", "urscript", None, None]
