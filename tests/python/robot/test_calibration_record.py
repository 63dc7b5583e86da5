# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The uncertainty of a model with hundreds of parameters: in its file, and in what it predicts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fastcal.io.robot_file import load_robot
from fastcal.io.yaml_file import MAX_VALUES
from fastcal.robot import robot as robot_module
from fastcal.robot.calibration_record import CalibrationRecord, packed, unpacked
from fastcal.robot.robot import Robot


def record(count: int) -> CalibrationRecord:
    """Of all parameters of a UR5 and of others that it has not."""
    own = load_robot("ur5").parameter_names
    names = [*own, *(f"curve {k}" for k in range(count - len(own)))]
    root = np.tril(np.random.default_rng(1).normal(0, 1e-5, (count, count)))
    return CalibrationRecord(names, root, {"position": (0.05, "mm")}, 1000)


def with_record(held: CalibrationRecord) -> Robot:
    return Robot(load_robot("ur5").spec | {"calibration": held.to_spec()})


@pytest.mark.parametrize("count", [60, 150, 151, 1100])
def test_a_root_comes_back_bit_for_bit(count: int, tmp_path: Path) -> None:
    held = record(count)
    with_record(held).save(tmp_path / "model.yaml")
    found = load_robot(tmp_path / "model.yaml").record
    assert found is not None
    assert found.parameters == held.parameters
    np.testing.assert_array_equal(found.root, held.root)
    is_text = isinstance(held.to_spec()["covariance_root"], str)
    assert is_text == (count > 150)
    if count == 1100:  # as rows of numbers the file would be refused
        assert count * (count + 1) // 2 > MAX_VALUES
    assert (tmp_path / "model.yaml").stat().st_size < 12 * count * (count + 1) / (1 if is_text else 0.5) + 20_000


def test_what_rounding_leaves_of_nothing_is_not_written(tmp_path: Path) -> None:
    """A direction held -7.6e-103, which the reader refuses, and the model was lost."""
    held = record(60)
    root = held.root.copy()
    root[5, 3] = 3e-140
    moved = held.parameters[:2]
    traces = replace(held, root=root, moved=moved, directions=np.array([[1.0], [-7.558047891217663e-103]]))
    with_record(traces).save(tmp_path / "model.yaml")
    found = load_robot(tmp_path / "model.yaml").record
    assert found is not None
    assert found.root[5, 3] == 0
    np.testing.assert_array_equal(found.directions, [[1.0], [0.0]])


def test_rows_of_older_files_are_read() -> None:
    held = record(300)
    rows = [held.root[i, : i + 1].tolist() for i in range(300)]
    old = load_robot(load_robot("ur5").spec | {"calibration": held.to_spec() | {"covariance_root": rows}})
    assert old.record is not None
    np.testing.assert_array_equal(old.record.root, held.root)


def test_a_text_of_other_length_is_none() -> None:
    text = packed(np.tril(np.ones((4, 4))))
    np.testing.assert_array_equal(unpacked(text, 4), np.tril(np.ones((4, 4))))
    for count in (3, 5):
        with pytest.raises(ValueError, match="10 numbers are no root of"):
            unpacked(text, count)


def test_deviations_of_parts_are_those_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = with_record(record(60))
    q = np.random.default_rng(2).uniform(-3, 3, (50, 6))
    whole = robot.position_deviation(q)
    J = robot.parameter_jacobian(q) @ record(60).root[: len(robot.parameter_names)]
    np.testing.assert_allclose(whole, np.sqrt(np.sum(J**2, axis=2)), rtol=1e-12)
    monkeypatch.setattr(robot_module, "_MOST_NUMBERS", 3 * 7 * len(robot.parameter_names))
    np.testing.assert_allclose(robot.position_deviation(q), whole, rtol=1e-14)
    with pytest.raises(ValueError, match="rows 40 to 51 are not among the 50"):
        robot.conditions(q).slice(40, 51)
