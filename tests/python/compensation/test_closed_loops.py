# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Programs of robots with closed loops: what the controller makes of the new targets brings the real robot there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fastcal import inverse_kinematics, load_robot, perturbed
from fastcal.cli import main
from fastcal.compensation.configurations import at_axes
from fastcal.io.programs import load_program

RAPID = """MODULE Stack
  CONST robtarget above:=[[1600,0,1000],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget place:=[[1500,600,600],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget home:=[[0,10,30,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ home,v500,fine,tool0;
    MoveJ above,v500,fine,tool0;
    MoveL place,v200,fine,tool0;
  ENDPROC
ENDMODULE
"""
KRL = """DEF stack()
  BASE_DATA[1] = {X 0, Y 0, Z 0, A 0, B 0, C 0}
  TOOL_DATA[1] = {X 0, Y 0, Z 0, A 0, B 0, C 0}
  $BASE = BASE_DATA[1]
  $TOOL = TOOL_DATA[1]
  PTP {A1 0, A2 10, A3 30, A4 0, A5 0, A6 0}
  LIN {X 1600, Y 0, Z 1000, A 0, B 0, C 180}
END
"""


@pytest.mark.parametrize(("name", "text"), [("stack.mod", RAPID), ("stack.src", KRL)])
def test_a_palletizers_program_brings_the_real_one_where_it_was_taught(tmp_path: Path, name: str, text: str) -> None:
    nominal = load_robot("palletizer").with_(tool={"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 0]})
    real = perturbed(nominal, length=3e-4, angle=3e-4, seed=1)
    nominal.save(tmp_path / "nominal.yaml")
    real.save(tmp_path / "model.yaml")
    (tmp_path / name).write_text(text)
    new = tmp_path / f"new_{name}"
    command = ["compensate", str(tmp_path / "model.yaml"), str(tmp_path / name), "-o", str(new)]
    assert main([*command, "--nominal", str(tmp_path / "nominal.yaml")]) == 0
    taught, sent = load_program(tmp_path / name), load_program(new)
    count, before = 0, np.asarray(nominal.core.home)
    for old, now in zip(taught.targets, sent.targets, strict=True):
        if old.kind == "joints":
            before = at_axes(nominal, old.values)
            wanted, q = nominal.forward(before)[0], at_axes(nominal, now.values)
        else:
            wanted = taught.language.pose(old.values)
            q = inverse_kinematics(nominal, sent.language.pose(now.values), seed=before).q[0]
        uncorrected = q if old.kind == "pose" else before
        off = real.forward(inverse_kinematics(nominal, wanted, seed=uncorrected).q)[0] - wanted
        assert np.linalg.norm((real.forward(q)[0] - wanted)[:3, 3]) < 2e-6
        assert np.linalg.norm(off[:3, 3]) > 5e-4
        count += 1
    assert count == len(taught.targets) >= 2


def test_bars_that_tilt_the_gripper_make_no_target_unreachable(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nominal = load_robot("palletizer").with_(tool={"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 0]})
    loops = [dict(loop) for loop in nominal.description.loops]
    loops[1]["length_mm"] += 4.0
    nominal.save(tmp_path / "nominal.yaml")
    nominal.with_(loops=loops).save(tmp_path / "model.yaml")
    (tmp_path / "stack.mod").write_text(RAPID)
    model, told = str(tmp_path / "model.yaml"), ["--nominal", str(tmp_path / "nominal.yaml")]
    assert main(["compensate", model, str(tmp_path / "stack.mod"), "-o", str(tmp_path / "new.mod"), *told]) == 0
    err = capsys.readouterr().err
    assert "with 4 motors the position is reached, and the loops set the orientation: up to 1." in err
    assert "singular" not in err
    (tmp_path / "targets.csv").write_text("x_mm,y_mm,z_mm,qw,qx,qy,qz\n1600,0,1000,0,1,0,0\n")
    assert main(["compensate", model, str(tmp_path / "targets.csv"), "-o", str(tmp_path / "q.csv"), *told]) == 0
    assert "1 reached" in capsys.readouterr().out


def test_a_turn_that_only_a_limit_keeps_from_the_tool_is_not_reached() -> None:
    """Axis 6 at its stop, half a degree short: not the bars' doing, and no second posture for a program."""
    robot = load_robot("palletizer")
    q = np.asarray(robot.core.home).copy()
    q[-1] = float(robot.limits[-1, 1])
    T = robot.forward(q)[0]
    at_stop = inverse_kinematics(robot, T, seed=q, restarts=0)
    assert at_stop.reached[0]
    assert np.abs(at_stop.q[0] - q).max() < 1e-6
    c, s = np.cos(0.01), np.sin(0.01)
    beyond = T @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert inverse_kinematics(robot, beyond, seed=q, restarts=0).status[0] == "limit"


def test_a_target_that_is_tilted_more_than_the_bars_let_it_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "stack.mod").write_text(RAPID.replace("[0,1,0,0]", "[0.05,0.99875,0,0]", 1))
    command = ["compensate", "palletizer", str(tmp_path / "stack.mod"), "--nominal", "palletizer"]
    assert main([*command, "-o", str(tmp_path / "new.mod")]) == 2
    err = capsys.readouterr().err
    assert "the point can be reached, but with 4 motors the loops turn the tool otherwise there" in err
    assert "the nearest pose is 0 mm and 5.73" in err
    assert not (tmp_path / "new.mod").exists()


def test_poses_of_a_palletizer_are_driven_by_a_program_of_six_axes(tmp_path: Path) -> None:
    command = ["design", "palletizer", "--count", "8", "--candidates", "random", "--language", "rapid"]
    assert main([*command, "-o", str(tmp_path / "poses.csv")]) == 0
    table = np.genfromtxt(tmp_path / "poses.csv", delimiter=",", names=True)
    targets = load_program(tmp_path / "poses.mod").targets[: len(table)]
    for row, target in zip(table, targets, strict=True):
        shown = np.degrees(target.values)
        assert shown[[0, 1, 2, 5]] == pytest.approx([row[f"j{axis}_deg"] for axis in (1, 2, 3, 6)], abs=1e-4)
        assert not shown[[3, 4]].any()


def test_a_delta_of_three_axes_has_no_such_program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["design", "delta", "--language", "rapid", "--count", "8", "-o", str(tmp_path / "poses.csv")]) == 2
    assert "this robot has 3 joints" in capsys.readouterr().err
