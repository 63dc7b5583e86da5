# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A sound file for every reader of the package, and what reads it into finite numbers."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import yaml
from fuzz_cells import finite
from fuzz_cells import readers as readers_of_cells
from fuzz_damage import damaged, damaged_correction, damaged_workbook

import fastcal
from fastcal.correction.applicability import Guard
from fastcal.correction.correction import Correction
from fastcal.correction.experts import Neighbours
from fastcal.correction.inputs import Scaling
from fastcal.correction.uncertainty import Uncertainty
from fastcal.fleet.arms import read_list
from fastcal.importers.importing import import_measurements
from fastcal.importers.mapping import read_map
from fastcal.importers.writing import imported_dataset
from fastcal.io.acceptance_plan import load_plan
from fastcal.io.budget_file import load_budget
from fastcal.io.cell_file import load_cell
from fastcal.io.correction_file import read_correction
from fastcal.io.instruments_file import load_instruments
from fastcal.io.measurements import load_measurements
from fastcal.io.programs import load_program
from fastcal.io.results import read_json
from fastcal.io.robot_file import load_robot
from fastcal.io.surroundings_file import load_surroundings
from fastcal.io.targets import load_targets
from fastcal.io.ur_files import LINKS, with_ur_deltas
from fastcal.monitoring.history import history

PROGRAMS = Path(__file__).resolve().parent.parent / "tests" / "python" / "data" / "programs"
Read = Callable[[Path], object]
Array = np.typing.NDArray[np.float64]


def read_measurements(path: Path) -> None:
    """A measurement file."""
    data = load_measurements(path, ROBOT)
    finite(data.q, data.position, data.rotation, data.sigma_position, data.payload, data.temperature, data.wrench)


def read_robot(path: Path) -> None:
    """Also what it predicts and what it would write."""
    robot = load_robot(path)
    T = robot.forward(np.full((1, len(robot.joint_types)), 0.3), payload=1.0)
    if not np.isfinite(T).all():
        raise AssertionError("the pose is not finite")
    robot.save(path.with_name("saved.yaml"))
    if not all(map(math.isfinite, numbers(yaml.safe_load(path.with_name("saved.yaml").read_text())))):
        raise AssertionError("a number that is none was written")


def read_mechanism(path: Path) -> None:
    """A robot with loops, of which a robot file beside it names motors and tool."""
    wrapper = path.with_name("wrapper.yaml")
    wrapper.write_text(f"kinematics: urdf\nurdf: {path.name}\ntip_link: tool\nmotors: [left, right]\n")
    read_looped(wrapper)


def read_looped(path: Path) -> None:
    """A robot file with loops and where they close."""
    robot = load_robot(path)
    finite(robot.assemble(np.array(robot.core.home)).q)


def numbers(tree: Any) -> list[float]:
    """The numbers of a YAML tree; what a text holds, such as that of a URDF, is the user's."""
    if isinstance(tree, dict):
        tree = list(tree.values())
    if isinstance(tree, list):
        return [number for value in tree for number in numbers(value)]
    return [tree] if isinstance(tree, float) else []


def read_program(path: Path) -> None:
    """A robot program: its numbers and poses."""
    program = load_program(path)
    for target in program.targets:
        values = np.array([number.value for number in target.numbers])
        if not np.isfinite(values).all():
            raise AssertionError("a target is not finite")
        if target.kind == "pose" and not np.isfinite(program.language.pose(values)).all():
            raise AssertionError("a pose is not finite")


def read_network(path: Path) -> None:
    """A trained correction and what it gives."""
    from fastcal.correction.inputs import Inputs

    found = read_correction(path)
    with np.errstate(all="ignore"):
        corrected = found(Inputs(np.full((2, 6), 0.2), np.zeros(2), np.zeros((2, 3, 6))))
    if not all(np.isfinite(part).all() for part in corrected):
        raise AssertionError("a correction is not finite")


def read_export(path: Path) -> None:
    """Joints and points of one export, or its points beside sound joints."""
    joints = path.with_name("joints.csv") if path.suffix in (".txt", ".log") else None
    data = imported_dataset(import_measurements([path], joints=joints, orientation="abc"), ROBOT)
    finite(data.q, data.position, data.rotation)


def read_points(path: Path) -> None:
    """Points that only their labels, under a title of no language, join with sound joints in another order."""
    data = imported_dataset(import_measurements([path], joints=path.with_name("labelled.csv")), ROBOT)
    finite(data.q, data.position)


def read_joints(path: Path) -> None:
    """Joints beside sound points."""
    data = imported_dataset(import_measurements([path.with_name("report.txt")], joints=path), ROBOT)
    finite(data.q, data.position)


def read_targets(path: Path) -> None:
    """Targets."""
    finite(load_targets(path, ROBOT).poses)


def read_budget(path: Path) -> None:
    """A budget of uncertainty."""
    budget = load_budget(path)
    finite(budget.instrument, np.array([each.standard for each in budget.inputs]), np.array(budget.level))


def read_plan(path: Path) -> None:
    """An acceptance test's plan."""
    finite(load_plan(path, ROBOT).q)


def read_check(path: Path) -> None:
    """A folder with this check in it; what `history` writes must be JSON with finite numbers."""
    place = path.with_name("checks")
    place.mkdir(exist_ok=True)
    (place / "check.json").write_bytes(path.read_bytes())
    json.dumps(history(place).to_json_dict(), allow_nan=False)


def read_deltas(path: Path) -> None:
    """Corrections of a UR controller, applied to the arm."""
    finite(fastcal.Robot(with_ur_deltas(ROBOT.spec, path)).forward(np.full((1, 6), 0.3)))


def recorded_bag(path: Path, q: Array, points: Array) -> bytes:
    """An arm that stands still at each posture, joints and points ten times a second; [rad], [m]."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = {name.rpartition("/")[2]: kind for name, kind in store.types.items()}
    empty = np.zeros(0)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        joints = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        poses = writer.add_connection("/point", "geometry_msgs/msg/PointStamped", typestore=store)
        for k in range(6 * len(q)):
            head = kinds["Header"](kinds["Time"](1000 + k // 10, 100_000_000 * (k % 10)), "tracker")
            names = [f"j{i}" for i in range(1, 7)]
            state = kinds["JointState"](head, names, np.ascontiguousarray(q[k // 6]), empty, empty)
            point = kinds["PointStamped"](head, kinds["Point"](*map(float, points[k // 6])))
            for connection, message in ((joints, state), (poses, point)):
                content = store.serialize_cdr(message, connection.msgtype)
                writer.write(connection, 1_000_000_000 * 1000 + 100_000_000 * k, content)
    (file,) = path.glob("*.mcap")
    return file.read_bytes()


def corpus(folder: Path) -> dict[str, tuple[str, bytes, Read, Callable[[random.Random, bytes], bytes]]]:
    """A sound file a reader: its ending, its content, what reads it, what damages it."""
    import openpyxl
    import pyarrow as pa
    import pyarrow.parquet

    rng = np.random.default_rng(0)
    q = np.degrees(rng.uniform(-1.5, 1.5, (12, 6)))
    names = [*(f"q{i}_deg" for i in range(1, 7)), "x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"]
    names += ["sigma_mm", "payload_kg", "temperature_c", "time_s"]
    more = np.column_stack([np.full(12, 0.05), np.arange(12.0) % 3, 20 + np.arange(12.0), np.arange(12.0)])
    rows = np.column_stack([q, rng.uniform(-500, 500, (12, 3)), rng.uniform(-90, 90, (12, 3)), more]).round(3)
    table = "\n".join([",".join(names), *(",".join(map(str, row)) for row in rows.tolist())]) + "\n"
    book = openpyxl.Workbook()
    for row in [names, *rows.tolist()]:
        book.active.append(row)
    book.save(folder / "book.xlsx")
    pa.parquet.write_table(pa.table(dict(zip(names, rows.T, strict=True))), folder / "table.parquet")
    arm = fastcal.load_robot("staubli_rx160l")
    effects = [{"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 4e-7}}]
    fastcal.Robot(arm.spec | {"effects": effects}).save(folder / "arm.yaml")
    fastcal.Robot(fastcal.convert(ROBOT, "urdf").spec).save(folder / "arm.urdf")
    low, high = np.full(7, -3.0), np.full(7, 3.0)
    guard = Guard(low, high, np.ones(7), np.ones(6), rng.normal(size=(20, 13)), 50.0, 100.0)
    near = Neighbours(Scaling(np.zeros(7), np.ones(7)), rng.normal(size=(20, 7)), 1e-3 * rng.normal(size=(20, 3)), 3)
    sure = Uncertainty(np.full(6, 1e-5), np.ones(6), np.full(6, 1e-4))
    network = Correction("knn", (near,), guard, 0.01, 0.01, sure, {"held_out_mm": {"mean": 0.1}})
    fastcal.Robot(ROBOT.spec | {"correction": network}).save(folder / "model.yaml")
    poses = "x_mm,y_mm,z_mm,qw,qx,qy,qz,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n"
    poses += "400,300,500,1,0,0,0,10,-50,60,20,70,30,2\n-300,200,400,0,1,0,0,0,-40,50,0,60,10,0\n"
    cell = "base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 90]}\ntools: {tGun: {xyz_mm: [0, 0, 230], rpy_deg: [0, 35, 0]}}\n"
    room = "keep_out: [{min_mm: [-100, -100, 0], max_mm: [100, 100, 500]}]\nlink_radius_mm: 60\n"
    room += "tracker: {xyz_mm: [3000, 0, 1000]}\nregion: {min_mm: [200, -500, 100], max_mm: [900, 500, 900]}\n"
    result = json.dumps({"status": "converged", "parameters": [{"name": "a", "value": 1.5}], "sigma_mm": 0.1})
    log = "KUKA log\nName;A1;A2;A3;A4;A5;A6;X [mm];Y [mm];Z [mm];A [deg];B [deg];C [deg]\n"
    log += "".join(f"P{k};" + ";".join(map(str, row[:12])) + "\n" for k, row in enumerate(rows.tolist()))
    report = "FARO CAM2 Measure 10\nUnits: MM / DEG\n"
    echo = ""
    for k, row in enumerate(rows.tolist()):
        report += f"\nPoint: P{k}\n   ACTUAL  NOMINAL  DEVIATION\n"
        report += "".join(f"  {axis}  {value}  0.0  0.0\n" for axis, value in zip("XYZ", row[6:9], strict=True))
        echo += f"header:\n  stamp:\n    sec: {100 + k}\n    nanosec: 5\nname: [j1, j2, j3, j4, j5, j6]\n"
        echo += f"position: {np.radians(row[:6]).round(6).tolist()}\nvelocity: []\n---\n"
    (folder / "report.txt").write_text(report)
    (folder / "joints.csv").write_text("Name;J1 [deg];J2 [deg];J3 [deg];J4 [deg];J5 [deg];J6 [deg]\n" + "".join(
        f"P{k};" + ";".join(map(str, row[:6])) + "\n" for k, row in enumerate(rows.tolist())))  # fmt: skip
    sheet = openpyxl.Workbook()
    for line in log.splitlines()[1:]:
        sheet.active.append([_cell(cell) for cell in line.split(";")])
    sheet.save(folder / "log.xlsx")
    named = "columns: {q1_deg: A1, q2_deg: 2, x_mm: X, rx_deg: A, name: Name}\norientation: abc\nskip_rows: 1\n"
    (network_file,) = folder.glob("model-*.safetensors")
    kinematics = {
        link: dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), UR5[k], strict=True)) for k, link in enumerate(LINKS)
    }
    (folder / "parallelogram.urdf").write_text(PARALLELOGRAM)
    (folder / "ur.yaml").write_text(yaml.safe_dump({"kinematics": kinematics | {"hash": "calib_1"}}, sort_keys=False))
    plan = (
        "pose,direction,cycle,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg,approach1,target_x_mm,target_y_mm\n"
    )
    plan += "".join(
        f"P{k},{'ab'[k % 2]},1," + ",".join(map(str, row[:6])) + ",5,1,400,-200.5\n"
        for k, row in enumerate(rows.tolist())
    )
    titled = "foo;J1 [deg];J2 [deg];J3 [deg];J4 [deg];J5 [deg];J6 [deg]\n"
    joints = [f"K-{k}x;" + ";".join(map(str, row[:6])) + "\n" for k, row in enumerate(rows.tolist())]
    (folder / "labelled.csv").write_text(titled + "".join(joints[::-1]))
    labelled = "Nr;bar;X [mm];Y [mm];Z [mm]\n"
    labelled += "".join(f"{k};k {k}X;" + ";".join(map(str, row[6:9])) + "\n" for k, row in enumerate(rows.tolist()))
    marked = "% by hand\n% " + table.replace(",", " ")
    side = "\n".join(",".join(map(str, [name, *column])) for name, column in zip(names, rows.T.tolist(), strict=True))
    japanese = "名前,関節1,関節2,関節3,関節4,関節5,関節6,測定X [mm],測定Y [mm],測定Z [mm]\n"
    japanese += "".join(f"点{k}," + ",".join(map(str, row[:9])) + "\n" for k, row in enumerate(rows.tolist()))
    book = openpyxl.load_workbook(folder / "log.xlsx")
    book.active.cell(1, 14, "twice")
    for line in range(4, 8):
        book.active.cell(line, 14, f"=A{line}*2")
    book.save(folder / "formulas.xlsx")
    arrays = {"q": rows[:, :6], "position": rows[:, 6:9]}
    scipy.io.savemat(folder / "arrays.mat", {"session": arrays})
    np.savez(folder / "arrays.npz", **arrays)
    bag = b""
    if find_spec("rosbags") is not None:
        bag = recorded_bag(folder / "bag", np.radians(rows[:, :6]), 1e-3 * rows[:, 6:9])
    found = {
        "measurements, CSV": (".csv", table.encode(), read_measurements, damaged),
        "measurements, xlsx": (".xlsx", (folder / "book.xlsx").read_bytes(), read_measurements, damaged_workbook),
        "measurements, Parquet": (".parquet", (folder / "table.parquet").read_bytes(), read_measurements, damaged),
        "measurements, marked": (".csv", marked.encode("utf-16"), read_measurements, damaged),
        "targets": (".csv", poses.encode(), read_targets, damaged),
        "robot, YAML": (".yaml", (folder / "arm.yaml").read_bytes(), read_robot, damaged),
        "robot with a structure": (".yaml", STRUCTURE.encode(), read_robot, damaged),
        "robot, URDF": (".urdf", (folder / "arm.urdf").read_bytes(), read_robot, damaged),
        "robot, URDF 1.1": (".urdf", URDF_1_1.encode("cp932"), read_robot, damaged),
        "cell": (".yaml", cell.encode(), load_cell, damaged),
        "surroundings": (".yaml", room.encode(), load_surroundings, damaged),
        "instruments": (".yaml", INSTRUMENTS.encode(), load_instruments, damaged),
        "network": (".safetensors", network_file.read_bytes(), read_network, damaged_correction),
        "result": (".json", result.encode(), read_json, damaged),
        "export, table": (".csv", log.encode(), read_export, damaged),
        "export, xlsx": (".xlsx", (folder / "log.xlsx").read_bytes(), read_export, damaged_workbook),
        "export, formulas": (".xlsx", (folder / "formulas.xlsx").read_bytes(), read_export, damaged_workbook),
        "export, MATLAB": (".mat", (folder / "arrays.mat").read_bytes(), read_export, damaged),
        "export, NumPy": (".npz", (folder / "arrays.npz").read_bytes(), read_export, damaged),
        "export, labels": (".csv", labelled.encode(), read_points, damaged),
        "export, on its side": (".csv", side.encode(), read_export, damaged),
        "export, cp932": (".csv", japanese.encode("cp932"), read_export, damaged),
        "export, report": (".txt", report.encode(), read_export, damaged),
        "export, ROS": (".yaml", echo.encode(), read_joints, damaged),
        "export, ROS bag": (".mcap", bag, read_export, damaged),
        "map": (".yaml", named.encode(), read_map, damaged),
        "UR kinematics": (".yaml", (folder / "ur.yaml").read_bytes(), read_robot, damaged),
        "UR calibration": (".conf", UR_CALIBRATION.encode(), read_deltas, damaged),
        "robot, xacro": (".xacro", XACRO.encode(), read_robot, damaged),
        "robot, MJCF": (".xml", MJCF.encode(), read_mechanism, damaged),
        "robot, SDF": (".sdf", SDF.encode(), read_mechanism, damaged),
        "robot, loops of a URDF": (".yaml", LOOPS.encode(), read_looped, damaged),
        "budget": (".yaml", BUDGET.encode(), read_budget, damaged),
        "acceptance plan": (".csv", plan.encode(), read_plan, damaged),
        "check": (".json", json.dumps(CHECK).encode(), read_check, damaged),
        "list of arms": (".csv", LIST.encode(), read_list, damaged),
    }
    found |= {name: (*parts, damaged) for name, parts in readers_of_cells(folder).items()}
    for name in ("glue.mod", "weld.src", "PICK.LS", "palletize.script"):
        path = PROGRAMS / name
        found[f"program, {path.suffix.lower()}"] = (path.suffix, path.read_bytes(), read_program, damaged)
    return found


STRUCTURE = """name: arm
kinematics: dh
joints:
  - {type: revolute, theta_deg: 0, d_mm: 500, a_mm: 0, alpha_deg: -90, link: {mass_kg: 40, com_mm: [0, 0, 0]}}
  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 800, alpha_deg: 0, link: {mass_kg: 30, com_mm: [-400, 0, 0]}}
  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 600, alpha_deg: 0, link: {mass_kg: 10, com_mm: [-300, 0, 0]}}
structure:
  nodes:
    - {name: foot, frame: base, held: all}
    - {name: elbow, frame: link2, moves: link2, mass_kg: 12}
    - {name: wrist, frame: link3, moves: link3, carries: [payload]}
  sections:
    tube: {young_pa: 7.0e10, shear_pa: 2.6e10, area_m2: 3.0e-3, inertia_y_m4: 8.0e-6, inertia_z_m4: 8.0e-6,
           torsion_m4: 1.6e-5}
  elements:
    - {name: upper_arm, start: foot, end: elbow, section: tube, mass_kg: 40, group: upper}
    - {name: forearm, start: elbow, end: wrist, section: tube, mass_kg: 25, group: fore}
effects:
  - {effect: beam_gravity, owner: structure}
"""
UR5 = [
    *(
        (0, 0, 0.089159, 0, 0, 0),
        (0, 0, 0, 1.570796327, 0, 0),
        (-0.425, 0, 0, 0, 0, 0),
        (-0.39225, 0, 0.10915, 0, 0, 0),
    ),
    *((0, -0.09465, 0, 1.570796327, 0, 0), (0, 0.0823, 0, 1.57079632, 3.14159265, 3.14159265)),
]
UR_CALIBRATION = """[mounting]
delta_theta = [ 9.1e-08, 0.178461, 6.682833, -0.578117, 6.1e-06, -5.0e-07]
delta_a = [ -0.000243, 0.003811, 0.034503, 0.000107, -0.000198, 0]
delta_d = [ 9.2e-05, 12.062, 17.6719, -29.733996, -2.8e-05, 0.000217]
delta_alpha = [ 0.001156, 0.003585, 0.003921, 0.000406, -0.002011, 0]
"""
XACRO = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="long" value="0.4"/>
  <xacro:macro name="joint" params="n below above z">
    <link name="${above}"/>
    <joint name="j${n}" type="revolute">
      <parent link="${below}"/><child link="${above}"/><origin xyz="${long / 2} 0 ${z}" rpy="0 ${pi / 4} 0"/>
      <axis xyz="0 ${n % 2} ${1 - n % 2}"/><limit lower="-3" upper="3" effort="10" velocity="1"/>
    </joint>
  </xacro:macro>
  <link name="base"/>
  <xacro:joint n="1" below="base" above="a" z="0.3"/>
  <xacro:joint n="2" below="a" above="b" z="${long}"/>
  <xacro:if value="true"><xacro:joint n="3" below="b" above="c" z="0.2"/></xacro:if>
</robot>
"""
MJCF = """<mujoco model="square"><compiler angle="degree"/><default><joint axis="0 1 0" range="-80 80"/></default>
  <worldbody><frame pos="0 0 0.1">
    <body name="a" euler="0 0 0"><joint name="left"/><inertial mass="1" pos="0 0 0.1"/>
      <body name="bar" pos="0 0 0.3"><joint name="elbow"/><site name="end" pos="0.2 0 0" quat="1 0 0 0"/>
        <body name="arm" pos="0.2 0 0"><joint name="right"/><site name="tool" pos="0.1 0 0.02" zaxis="0 0 1"/></body>
      </body></body>
    <body name="b" pos="0.2 0 0"><joint name="rod" limited="false"/></body></frame></worldbody>
  <equality><connect body1="b" body2="bar" anchor="0 0 0.3"/></equality>
  <actuator><motor joint="left"/><motor joint="right"/></actuator></mujoco>
"""
SDF = """<sdf version="1.9"><model name="square"><link name="base"/><link name="a"><pose>0 0 0.1 0 0 0</pose>
  <inertial><mass>2</mass><pose>0 0 0.1 0 0 0</pose></inertial></link>
  <link name="bar"><pose relative_to="a">0 0 0.3 0 0 0</pose></link><link name="b"><pose>0.2 0 0.1 0 0 0</pose></link>
  <link name="arm"><pose relative_to="bar">0.2 0 0 0 0 0</pose></link>
  <frame name="tool" attached_to="arm"><pose degrees="true">0.1 0 0 0 0 10</pose></frame>
  <joint name="left" type="revolute"><parent>base</parent><child>a</child><axis><xyz>0 1 0</xyz></axis></joint>
  <joint name="elbow" type="revolute"><parent>a</parent><child>bar</child><axis><xyz>0 1 0</xyz></axis></joint>
  <joint name="rod" type="revolute"><parent>base</parent><child>b</child><axis><xyz>0 1 0</xyz></axis></joint>
  <joint name="pin" type="revolute"><pose>0.2 0 0 0 0 0</pose><parent>b</parent><child>bar</child>
    <axis><xyz expressed_in="base">0 1 0</xyz></axis></joint>
  <joint name="right" type="revolute"><parent>bar</parent><child>arm</child><axis><xyz>0 1 0</xyz>
    <limit><lower>-1.5</lower><upper>1.5</upper></limit></axis></joint></model></sdf>
"""
PARALLELOGRAM = """<robot name="square"><link name="base"/><link name="a"/><link name="bar"/><link name="b"/>
  <link name="tool"/>
  <joint name="left" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
    <limit lower="-1.4" upper="1.4"/></joint>
  <joint name="elbow" type="revolute"><parent link="a"/><child link="bar"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
    <limit lower="-1.4" upper="1.4"/></joint>
  <joint name="right" type="revolute"><parent link="bar"/><child link="tool"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1.4" upper="1.4"/></joint>
  <joint name="rod" type="revolute"><parent link="base"/><child link="b"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1.4" upper="1.4"/></joint>
</robot>
"""
LOOPS = """name: square
kinematics: urdf
urdf: parallelogram.urdf
tip_link: tool
motors: [left, right]
start_deg: {left: 5, elbow: -5}
loops:
  - {name: pin, from: b, to: bar, from_xyz_mm: [0, 0, 300], to_xyz_mm: [200, 0, 0], fixed: [x, z]}
"""
URDF_1_1 = """<?xml version="1.0" encoding="cp932"?>
<robot name="腕" version="1.1"><link name="base"/><link name="a"/><link name="b"/>
  <joint name="j1" type="revolute"><origin xyz="0 0 0.2" quat_xyzw="0 0 0.3826834 0.9238795"/><parent link="base"/>
    <child link="a"/><axis xyz="0 0 1"/></joint>
  <joint name="j2" type="prismatic"><origin rpy="0 0.1 0"/><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1"/></joint>
</robot>
"""
BUDGET = """level: 0.95
instrument: {xyz_mm: [3000, 0, 1200.5]}
inputs:
  - {name: range, kind: range, half_width_um_m: 5}
  - {name: angles, kind: angle, expanded_um_m: 12, coverage_factor: 2}
  - {name: reflector, kind: target, half_width_um: 6, distribution: triangular}
  - {name: room, kind: temperature, half_width_k: 1, expansion_1_k: 11.5e-6, degrees_of_freedom: 12}
  - {name: load, kind: payload, standard_kg: 0.1, common: true}
"""
CHECK = {
    "robot": "arm",
    "verdict": "changed",
    "sentence": "the zero of joint 2 moved",
    "rms_mm": 0.12,
    "expected_rms_mm": 0.06,
    "p_value": 1e-4,
    "misfit_p_value": 0.003,
    "tests": [
        {
            "kind": "zero",
            "owner": "joint2",
            "name": "theta_deg",
            "unit": "deg",
            "value": 0.02,
            "std": 0.004,
            "std_noise": 0.003,
        },
        {"kind": "tool", "owner": "tool", "name": "x_mm", "unit": "mm", "value": 0.01, "std": 0.02, "std_noise": 0.02},
    ],
    "made_by": {"serial": "4711", "date": "2026-03-01", "robot_sha256": "00ff"},
}
INSTRUMENTS = """points: true
levels: [link2, link3]
sigma_tilt_mrad: 0.1
planes:
  table: {point_mm: [800, 0, 300], normal: [0, 0, 1]}
  "2": {point_m: [0.4, 0.9, 0.1], normal: [0.3, -1, 0]}
"""
LIST = "robot,data,test,name\nur5,one.csv,,first\narm.yaml,two.csv,test.csv,second\nur5,three.csv,,\n"
ROBOT = fastcal.load_robot("ur5")
NAMES = [
    *("measurements, CSV", "measurements, xlsx", "measurements, Parquet", "measurements, marked", "targets"),
    *("robot, YAML", "robot with a structure", "robot, URDF", "robot, URDF 1.1", "cell", "surroundings"),
    *("instruments", "network", "result"),
    *("export, table", "export, xlsx", "export, formulas", "export, labels", "export, on its side", "export, cp932"),
    *("export, MATLAB", "export, NumPy", "export, report", "export, ROS", "export, ROS bag", "map"),
    *("robot, MJCF", "robot, SDF", "robot, loops of a URDF"),
    *("UR kinematics", "UR calibration", "robot, xacro", "budget", "acceptance plan", "check", "list of arms"),
    *("cell with a camera", "corners", "cell of two arms", "readings of a cell", "rows that come"),
    *("program, .mod", "program, .src", "program, .ls", "program, .script"),
]


def _cell(text: str) -> float | str:
    """A number where the text is one."""
    try:
        return float(text)
    except ValueError:
        return text
