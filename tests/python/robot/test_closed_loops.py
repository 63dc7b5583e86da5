# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Closed loops: against closed forms of a delta, a five-bar and a hexapod, against differences, and calibrated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import (
    _core,
    calibrate,
    design_poses,
    diagnose,
    inverse_kinematics,
    load_measurements,
    load_robot,
    perturbed,
    random_poses,
    robots,
    simulate,
)
from fastcal.conversion import convert
from fastcal.errors import InvalidInput, ParseError
from fastcal.measurements.dataset import Dataset
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]
Spec = dict[str, Any]
LOOPED = sorted(set(robots.available()) - set(robots.serial()))
THIRDS = (0.0, 120.0, 240.0)


def joint(axis: list[float], xyz: Any = (0, 0, 0), rpy: Any = (0, 0, 0), **more: Any) -> Spec:
    origin = {"xyz_mm": [float(v) for v in xyz], "rpy_deg": [float(v) for v in rpy]}
    kind = more.pop("type", "revolute")
    limits = {"min_mm": -2000, "max_mm": 2000} if kind == "prismatic" else {}
    return {"type": kind, "origin": origin, "axis": axis} | limits | more


def named(joints: list[Spec]) -> list[Spec]:
    return [{"name": f"axis{i + 1}"} | each for i, each in enumerate(joints)]


def platform(z_mm: float) -> list[Spec]:
    """Six passive joints that let a platform go anywhere."""
    axes = np.eye(3).tolist()
    slides = [joint(axes[k], type="prismatic", passive=True) for k in range(3)]
    slides[0]["on"], slides[2]["start_mm"] = "base", z_mm
    return [*slides, *(joint(axis, passive=True) for axis in axes)]


def delta(wide: float = 40.0) -> Spec:
    """Arms of 250 mm on a circle of 200, pairs of rods of 550 to a platform of 60."""
    arms, rods = [], []
    for k, angle in enumerate(THIRDS):
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        arms.append(joint([0, 1, 0], (200 * c, 200 * s, 0), (0, 0, angle), on="base", min_deg=-60, max_deg=100))
        for side, y in (("a", wide), ("b", -wide)):
            to = [60 * c - y * s, 60 * s + y * c, 0.0]
            ends = {"from": f"link{k + 1}", "to": "link9", "from_xyz_mm": [250.0, y, 0.0], "to_xyz_mm": to}
            rods.append({"name": f"rod{k + 1}{side}", "length_mm": 550.0} | ends)
    return {"name": "delta", "kinematics": "urdf", "joints": named(arms + platform(-450)), "loops": rods}


def five_bar() -> Spec:
    joints = [
        joint([0, 0, 1], (-100, 0, 0), start_deg=120, min_deg=0, max_deg=180),
        joint([0, 0, 1], (100, 0, 0), on="base", start_deg=60, min_deg=0, max_deg=180),
        joint([0, 0, 1], (200, 0, 0), passive=True, start_deg=60),
    ]
    rod = {"name": "rod", "from": "link1", "to": "tool", "from_xyz_mm": [200.0, 0.0, 0.0], "length_mm": 320.0}
    return {
        "name": "five-bar",
        "kinematics": "urdf",
        "joints": named(joints),
        "tool": {"xyz_mm": [320, 0, 0]},
        "loops": [rod],
    }


BASE_PINS = [
    [300 * np.cos(a), 300 * np.sin(a), 0.0] for a in np.radians([-10, 10, 110, 130, 230, 250])
]  # of a Gough-Stewart platform [mm]
TOP_PINS = [[150 * np.cos(a), 150 * np.sin(a), 0.0] for a in np.radians([-50, 50, 70, 170, 190, 290])]


def hexapod() -> Spec:
    legs = [joint([0, 0, 1], on="base", type="prismatic", min_mm=-130, max_mm=130) for _ in range(6)]
    rods = [
        {
            "name": f"leg{k + 1}",
            "from": "base",
            "to": "link12",
            "from_xyz_mm": [float(v) for v in BASE_PINS[k]],
            "to_xyz_mm": [float(v) for v in TOP_PINS[k]],
            "length_mm": 450.0,
            "joints": {f"joint{k + 1}": 1.0},
        }
        for k in range(6)
    ]
    return {"name": "hexapod", "kinematics": "urdf", "joints": named(legs + platform(400)), "loops": rods}


def palletizer() -> Spec:
    """Four motors; the wrist stays level, q4 = -(q2 + q3), a passive joint that belts turn."""
    joints = [
        joint([0, 0, 1], (0, 0, 500)),
        joint([0, 1, 0], (200, 0, 0), start_deg=-20),
        joint([0, 1, 0], (0, 0, 800), start_deg=60),
        joint([0, 1, 0], (900, 0, 0), passive=True),
        joint([0, 0, 1], (150, 0, -100)),
    ]
    for each, mass in zip(joints, (200.0, 80.0, 60.0, 20.0, 10.0), strict=True):
        each["link"] = {"mass_kg": mass, "com_mm": [100.0, 0.0, 50.0]}
    gear = {"name": "belt", "joint": 4, "ratios": {"joint2": -1.0, "joint3": -1.0}}
    return {"name": "palletizer", "kinematics": "urdf", "joints": named(joints), "loops": [gear]}


def postures(robot: Robot, count: int, seed: int = 0, spread: float = 0.35) -> FloatArray:
    random = np.random.default_rng(seed)
    q = np.tile(np.asarray(robot.core.home), (count, 1))
    scale = np.where(np.array(robot.joint_types) == "prismatic", 0.1, 1.0)
    return np.asarray(robot.assemble(q + spread * scale * random.uniform(-1, 1, q.shape)).q)


ROBOTS = [delta(), five_bar(), hexapod(), palletizer()]
EVERY = pytest.mark.parametrize("spec", ROBOTS, ids=lambda spec: str(spec["name"]))


@EVERY
def test_loops_close_in_every_row(spec: Spec) -> None:
    robot = load_robot(spec)
    assembly = robot.assemble(postures(robot, 50))
    assert set(assembly.status) == {"closed"}
    assert assembly.gap.max() < 1e-10


@EVERY
def test_derivatives_are_those_of_differences(spec: Spec) -> None:
    entry = {"effect": "reduction_ratio", "owner": "joint2", "parameters": {"error": {"value": 1e-3}}}
    robot = load_robot(spec | {"effects": [entry]})
    model, q = robot.error_model, postures(robot, 6)
    theta, samples = np.array(model.start), robot.conditions(q)
    J = robot.parameter_jacobian(q, rows=6)
    row_by_row = np.zeros_like(J)
    for k in range(len(theta)):
        step = np.zeros(len(theta))
        step[k] = 1e-6
        ahead, behind = (np.asarray(model.predict(samples, theta + sign * step)) for sign in (1, -1))
        row_by_row[:, :, k] = motion(ahead, behind) / 2e-6
    assert np.abs(J - row_by_row).max() < 2e-8
    J_q = robot.joint_jacobian(q)
    for k in set(range(robot.joint_count)) - set(robot.passive):
        step = np.zeros(robot.joint_count)
        step[k] = 1e-6
        found = motion(robot.forward(q + step), robot.forward(q - step)) / 2e-6
        further = 1.001 if k == 1 else 1.0  # the effect is not in the joint's own motion
        assert np.abs(found / further - J_q[:, :, k]).max() < 2e-8


def motion(ahead: FloatArray, behind: FloatArray) -> FloatArray:
    """(N, 6) [v; w] from one pose to the other, both near each other."""
    turn = ahead[:, :3, :3] @ np.swapaxes(behind[:, :3, :3], 1, 2)
    w = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], 1) / 2
    return np.concatenate([ahead[:, :3, 3] - behind[:, :3, 3], w], axis=1)


def test_delta_is_where_its_closed_form_says() -> None:
    robot = load_robot(delta())
    q = postures(robot, 40)
    centres = []
    for k, angle in enumerate(np.radians(THIRDS)):
        out = 0.2 + 0.25 * np.cos(q[:, k]) - 0.06
        centres.append(np.stack([out * np.cos(angle), out * np.sin(angle), -0.25 * np.sin(q[:, k])], axis=1))
    assert np.abs(robot.forward(q)[:, :3, 3] - three_spheres(*centres, 0.55)).max() < 1e-9


def three_spheres(a: FloatArray, b: FloatArray, c: FloatArray, radius: float) -> FloatArray:
    """(N, 3) the lower point that has one distance from three centres."""
    ex = b - a
    d = np.linalg.norm(ex, axis=1, keepdims=True)
    ex /= d
    i = np.sum(ex * (c - a), axis=1, keepdims=True)
    ey = c - a - i * ex
    j = np.linalg.norm(ey, axis=1, keepdims=True)
    ey /= j
    ez = np.cross(ex, ey)
    x, y = d / 2, (i**2 + j**2 - i * d) / (2 * j)
    z = np.sqrt(radius**2 - x**2 - y**2)
    found = [a + x * ex + y * ey + sign * z * ez for sign in (1, -1)]
    return np.where(found[0][:, 2:] < found[1][:, 2:], *found)


def test_five_bar_is_where_its_closed_form_says() -> None:
    robot = load_robot(five_bar())
    q = postures(robot, 40)
    left = np.stack([-0.1 + 0.2 * np.cos(q[:, 0]), 0.2 * np.sin(q[:, 0])], axis=1)
    right = np.stack([0.1 + 0.2 * np.cos(q[:, 1]), 0.2 * np.sin(q[:, 1])], axis=1)
    half = (right - left) / 2
    length = np.linalg.norm(half, axis=1, keepdims=True)
    up = np.stack([-half[:, 1], half[:, 0]], axis=1) / length
    expected = left + half + up * np.sqrt(0.32**2 - length**2)
    assert np.abs(robot.forward(q)[:, :2, 3] - expected).max() < 1e-9


def test_hexapod_forward_undoes_its_closed_inverse() -> None:
    """A pose says the lengths of all legs at once; the robot finds the pose of these lengths."""
    robot = load_robot(hexapod())
    random = np.random.default_rng(1)
    poses, q = [], np.zeros((20, robot.joint_count))
    for row in range(20):
        T = np.eye(4)
        T[:3, :3] = _core.rpy_to_rotation(random.uniform(-0.2, 0.2, 3))
        T[:3, 3] = random.uniform(-0.05, 0.05, 3) + np.array([0, 0, 0.4])
        ends = np.array(TOP_PINS) / 1e3 @ T[:3, :3].T + T[:3, 3]
        q[row, :6] = np.linalg.norm(ends - np.array(BASE_PINS) / 1e3, axis=1) - 0.45
        poses.append(T)
    assert np.abs(robot.forward(q) - np.array(poses)).max() < 1e-9
    found = inverse_kinematics(robot, np.array(poses), seed=np.asarray(robot.core.home))
    assert set(found.status) == {"reached"}
    assert np.abs(found.q[:, :6] - q[:, :6]).max() < 1e-8


@EVERY
def test_inverse_kinematics_reaches_what_forward_gives(spec: Spec) -> None:
    robot = load_robot(spec)
    q = postures(robot, 10, seed=3, spread=0.2)
    T = robot.forward(q)
    found = inverse_kinematics(robot, T, seed=np.asarray(robot.core.home))
    assert set(found.status) <= {"reached", "singular"}
    assert np.abs(robot.forward(found.q) - T)[:, :3, 3].max() < 1e-8


@pytest.mark.parametrize("name", ["delta", "delta_printer", "five_bar", "hexapod", "palletizer", "parallelogram_6r"])
@pytest.mark.parametrize("restarts", [0, 100])
def test_commands_lead_there_by_the_motors_alone(name: str, restarts: int) -> None:
    """A long step through a fold ends in another way of assembly, where no motor brings the robot."""
    robot = load_robot(name)
    q = random_poses(robot, 60, seed=5)
    T = robot.forward(q)
    found = inverse_kinematics(robot, T, seed=q[::-1] if restarts == 0 else None, restarts=restarts)
    assert found.reached.mean() > (0.3 if restarts == 0 else 0.99)
    there = robot.forward(found.q[found.reached])
    assert np.abs(there - T[found.reached])[:, :3, 3].max() < 1e-8


def test_belts_keep_the_wrist_level_and_share_its_weight() -> None:
    """Torques of the motors are the slope of the potential energy as the motors move, the wrist following."""
    robot = load_robot(palletizer())
    q = postures(robot, 5)
    assert np.abs(robot.forward(q)[:, 2, :3] - [0, 0, 1]).max() < 1e-12
    samples = robot.conditions(q, payload=50.0)
    loads = np.asarray(robot.error_model.loads(samples, robot.error_model.start))
    for k in (1, 2):
        step = np.zeros(robot.joint_count)
        step[k] = 1e-6
        slope = (energy(robot, q + step) - energy(robot, q - step)) / 2e-6
        assert np.allclose(loads[:, 2 * k + 1, 5], -slope, rtol=1e-7)
    assert np.abs(loads[:, 2 * 3 + 1, 5]).max() < 1e-9


def energy(robot: Robot, q: FloatArray, payload: float = 50.0) -> FloatArray:
    """(N,) of all weights [J], along the chain by hand; the tool is the flange."""
    out = []
    for row, T_tool in zip(robot.assemble(q).q, robot.forward(q), strict=True):
        T, total = np.eye(4), payload * T_tool[2, 3]
        for angle, each in zip(row, palletizer()["joints"], strict=True):
            step = np.eye(4)
            step[:3, 3] = np.array(each["origin"]["xyz_mm"]) / 1e3
            step[:3, :3] = _core.exp_so3(angle * np.array(each["axis"], dtype=float))
            T = T @ step
            total += each["link"]["mass_kg"] * (T @ [0.1, 0.0, 0.05, 1.0])[2]
        out.append(9.80665 * total)
    return np.array(out)


@EVERY
def test_a_robot_with_loops_is_calibrated(spec: Spec) -> None:
    """Rods, pins and arms are off by 0.3 mm; held-out points are found within the noise."""
    robot = load_robot(spec)
    random = np.random.default_rng(5)
    model, q = robot.error_model, postures(robot, 90, seed=2)
    theta = np.array(model.start)
    names = robot.parameter_names
    inside = np.array([not name.startswith(("base", "tool")) for name in names])
    truth = theta + 3e-4 * inside * random.normal(size=len(theta))
    points = np.asarray(model.predict(robot.conditions(q), truth))[:, :3, 3]
    measured = points + 2e-5 * random.normal(size=points.shape)
    data = Dataset.from_arrays(q=q[:60], position=measured[:60], robot=robot)
    result = calibrate(robot, data)
    left = np.linalg.norm(result.model.forward(q[60:])[:, :3, 3] - points[60:], axis=1)
    before = np.linalg.norm(robot.forward(q[60:])[:, :3, 3] - points[60:], axis=1)
    assert np.sqrt(np.mean(left**2)) < min(6e-5, 0.5 * float(np.sqrt(np.mean(before**2))))
    assert result.model.assemble(q).gap.max() < 1e-10


def test_heights_of_a_flat_robot_stay_as_the_file_has_them() -> None:
    nominal = load_robot("five_bar")
    truth = perturbed(nominal, seed=4)
    data = simulate(truth, random_poses(truth, 100, seed=5), noise=5e-5, seed=6)
    off = [p for p in calibrate(nominal, data, loss="none", priors=False).parameters if p.owner == "base"]
    assert max(abs(p.value) for p in off if p.name.endswith("_mm")) < 20


def test_a_posture_that_no_assembly_reaches_has_a_status_and_a_sentence() -> None:
    robot = load_robot(five_bar())
    q = np.radians([[170.0, 10.0, 0.0]])
    q[0, 0], q[0, 1] = np.radians(180), 0.0
    apart = load_robot(five_bar() | {"loops": [five_bar()["loops"][0] | {"length_mm": 260.0}]})
    assembly = apart.assemble(np.radians([[179.0, 1.0, 0.0]]))
    assert assembly.status == ["open"]
    assert np.isfinite(assembly.q).all()
    assert "row 0: its loops do not close: 'rod' lacks" in assembly.sentence(0)
    with pytest.raises(InvalidInput, match="'rod' lacks"):
        apart.forward(np.radians([[179.0, 1.0, 0.0]]))
    assert robot.assemble(q).status == ["closed"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"loops": []}, "passive joints need loops"),
        ({"loops": delta()["loops"][:5]}, "5 independent equations for 6 passive joints"),
        ({"loops": [delta()["loops"][0] | {"from": "link77"}]}, "expected base, tool or link1 to link9"),
        ({"loops": [delta()["loops"][0] | {"name": "joint3"}]}, "a name of its own"),
        ({"loops": [each | {"length_mm": 100.0} for each in delta()["loops"]]}, "do not close at the start posture"),
    ],
)
def test_what_is_wrong_with_loops_is_said_at_the_door(change: Spec, message: str) -> None:
    with pytest.raises((InvalidInput, ParseError), match=message):
        load_robot(delta() | change)


@EVERY
def test_loops_are_kept_in_a_robot_file(tmp_path: Path, spec: Spec) -> None:
    robot = load_robot(spec)
    robot.save(tmp_path / "robot.yaml")
    q = postures(robot, 5)
    assert np.array_equal(load_robot(tmp_path / "robot.yaml").forward(q), robot.forward(q))
    with pytest.raises(InvalidInput, match="branches or closed loops"):
        convert(robot, "dh")
    with pytest.raises(InvalidInput, match="no place for branches and closed loops"):
        robot.save(tmp_path / "robot.urdf")


@pytest.mark.parametrize("name", LOOPED)
def test_a_shipped_arm_closes_its_loops_and_comes_back(name: str) -> None:
    robot = load_robot(name)
    q = postures(robot, 10, spread=0.2)
    assert set(robot.assemble(q).status) == {"closed"}
    found = inverse_kinematics(robot, robot.forward(q), seed=np.asarray(robot.core.home))
    assert np.abs(robot.forward(found.q) - robot.forward(q))[:, :3, 3].max() < 1e-8


def test_a_parallelogram_turns_its_elbow_as_the_crank_says() -> None:
    """An ideal parallelogram: the upper arm keeps the direction of the crank, whatever the lower arm does."""
    robot = load_robot("parallelogram_6r")
    q = postures(robot, 20)
    assert np.abs(q[:, 3] - (q[:, 1] - q[:, 2])).max() < 1e-10


@pytest.mark.parametrize("seed", [1, 5, 9])
def test_no_posture_is_drawn_beyond_the_fold_of_a_parallelogram(seed: int) -> None:
    """Bars that differ by half a millimetre turn round smoothly there, and their joints come back within the limits."""
    built = perturbed(load_robot("palletizer"), seed=seed)
    q = random_poses(built, 300, seed=seed)
    elbow = q[:, 1] - q[:, 2]  # as the crank's parallelogram turns it
    assert np.abs(q[:, 4] - elbow).max() < 0.1


def test_a_measurement_file_has_no_column_for_passive_joints(tmp_path: Any) -> None:
    robot = load_robot(delta())
    q = postures(robot, 5)
    rows = ["q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm"]
    for angles, T in zip(np.degrees(q[:, :3]), robot.forward(q), strict=True):
        rows.append(",".join(repr(float(v)) for v in (*angles, *(1e3 * T[:3, 3]))))
    (tmp_path / "points.csv").write_text("\n".join(rows))
    data = load_measurements(tmp_path / "points.csv", robot)
    assert np.abs(data.q - q).max() < 1e-10


def test_a_pin_of_the_tool_stays_where_it_is_when_the_tool_changes() -> None:
    """What is in the hand is no part of the mechanism: the same motors put the flange where they did."""
    spec = five_bar()
    loop = load_robot(spec).spec["loops"][0]
    assert (loop["to"], loop["to_xyz_mm"]) == ("link3", [320.0, 0.0, 0.0])
    turned = load_robot(spec | {"tool": {"xyz_mm": [320, 0, 0], "rpy_deg": [0, 0, 90]}})
    q = postures(turned, 5)
    assert np.abs(turned.forward(q)[:, :3, 3] - load_robot(spec).forward(q)[:, :3, 3]).max() < 1e-12


@EVERY
@pytest.mark.parametrize("how", ["grid", "random"])
def test_poses_to_measure_are_designed_of_motors_alone(spec: Spec, how: str) -> None:
    """Motors within limits that keep all postures assembled; the passive joints are where the loops close."""
    robot = load_robot(spec)
    design = design_poses(robot, 20, candidates=how, candidate_count=1500)
    assert len(design.q) == 20
    assembly = robot.assemble(design.q)
    assert set(assembly.status) == {"closed"}
    assert np.abs(assembly.q - design.q).max() < 1e-9


def test_the_jacobian_of_a_long_chain_is_that_of_differences() -> None:
    """More joints than inverse kinematics takes: two legs of a humanoid with their bars have fifty."""
    axes = np.eye(3).tolist()
    robot = load_robot(
        {"name": "long", "kinematics": "urdf", "joints": named([joint(axes[k % 3], (50, 10, 20)) for k in range(40)])}
    )
    q = np.random.default_rng(1).uniform(-1, 1, (3, 40))
    J = robot.joint_jacobian(q)
    for k in range(40):
        step = np.zeros(40)
        step[k] = 1e-6
        assert np.abs(motion(robot.forward(q + step), robot.forward(q - step)) / 2e-6 - J[:, :, k]).max() < 1e-8


def test_the_controllers_axes_are_columns_of_an_arm_with_loops(tmp_path: Path) -> None:
    robot = load_robot("palletizer")
    q = postures(robot, 5)
    shown = robot.pendant.shown(q)
    assert shown.shape == (5, 6)
    assert np.array_equal(shown[:, [0, 1, 2, 5]], q[:, [0, 2, 1, 6]])
    assert not shown[:, [3, 4]].any()
    rows = ["j1_deg,j2_deg,j3_deg,j6_deg,x_mm,y_mm,z_mm"]
    for axes, T in zip(np.degrees(shown[:, [0, 1, 2, 5]]), robot.forward(q), strict=True):
        rows.append(",".join(repr(float(v)) for v in (*axes, *(1e3 * T[:3, 3]))))
    (tmp_path / "points.csv").write_text("\n".join(rows))
    assert np.abs(load_measurements(tmp_path / "points.csv", robot).q - q).max() < 1e-9
    (tmp_path / "points.csv").write_text("\n".join(rows).replace("j6_deg", "j7_deg"))
    with pytest.raises(ParseError, match="joint 6 has no column"):
        load_measurements(tmp_path / "points.csv", robot)


@pytest.mark.parametrize(
    ("pendant", "message"),
    [
        ([{"joint": 2, "axis": 3}], "axis 3 is that of two joints"),
        ([{"joint": 4, "axis": 3}], "joint 4 is passive: it has no motor"),
        ([{"joint": 2, "axis": 3}, {"joint": 3, "axis": 2, "minus": 1}], "plus and minus are for files without axis"),
    ],
)
def test_axes_that_cannot_be_are_refused(pendant: list[Spec], message: str) -> None:
    with pytest.raises(ParseError, match=message):
        load_robot(load_robot("palletizer").spec | {"pendant": pendant})


def test_a_yielding_motor_of_a_palletizer_is_named() -> None:
    robot = load_robot("palletizer")
    yields = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 2e-6}}
    real = perturbed(robot, length=5e-5, angle=5e-5, seed=1).with_(effects=[yields])
    payload = np.random.default_rng(1).choice([0.0, 30.0, 60.0], 60)
    data = simulate(real, random_poses(robot, 60, seed=3), noise=2e-5, seed=2, payload=payload)
    found = diagnose(robot, data)
    assert [f"{each.effect}@{each.owner}" for each in found.effects if each.grade == "A"] == ["joint_compliance@joint2"]


def test_what_cannot_be_assembled_cannot_be_measured() -> None:
    robot = load_robot("five_bar")
    q = np.tile(np.asarray(robot.core.home), (2, 1))
    q[1, :2] = np.radians([179.0, 1.0])
    with pytest.raises(InvalidInput, match="row 1: its loops do not close"):
        simulate(robot.with_(loops=[robot.description.loops[0] | {"length_mm": 260.0}]), q)


def test_the_controller_keeps_the_loops_that_it_had_before_calibration(tmp_path: Path) -> None:
    robot = load_robot("five_bar")
    real = perturbed(robot, seed=1)
    found = calibrate(robot, simulate(real, random_poses(robot, 40, seed=2), noise=5e-5, seed=3))
    assert found.model.description.loops != robot.description.loops
    found.model.save(tmp_path / "model.yaml")
    assert nominal_robot(load_robot(tmp_path / "model.yaml")).description.loops == robot.description.loops


def test_near_a_stretched_posture_passive_joints_are_those_of_the_closed_form() -> None:
    """Rods of 270 and 320 mm nearly in line: what leaves 1e-12 m of the loop leaves 1e-10 rad and more of joint 3.

    The rod at the tool stands at a to the line of the cranks' ends, cos a = (l^2 + d^2 - k^2) / (2 l d).
    """
    spec = load_robot("five_bar").spec
    spec["loops"][0]["length_mm"] = 270
    robot = load_robot(spec)
    opened = 0.2260 + 2e-5 * np.arange(200)  # of both cranks; at 0.22408 all is in line
    found = robot.assemble(np.column_stack([np.pi - opened, opened, np.ones_like(opened)]))
    there = np.array([status == "closed" for status in found.status])
    assert there.sum() > 100
    d = np.longdouble("0.2") + np.longdouble("0.4") * np.cos(opened.astype(np.longdouble))
    k, rod = np.longdouble("0.27"), np.longdouble("0.32")
    a = np.arccos((rod**2 + d**2 - k**2) / (2 * rod * d))
    expected = (np.arccos(np.longdouble(-1)) - a - opened).astype(np.float64)
    assert np.abs(found.q[:, 2] - expected)[there].max() < 2e-12
