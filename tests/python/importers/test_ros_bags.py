# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""ROS bags written by rosbags itself, as a recorder beside an arm and a tracker would: an arm that stops at poses."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.errors import InvalidInput, ParseError, TooLarge
from fastcal.importers import import_measurements, load_measurements
from fastcal.importers.bag_clocks import delay, still_windows
from fastcal.importers.bag_joints import Stream, joint_states
from fastcal.importers.bag_path import is_bag
from fastcal.importers.writing import imported_dataset

pytest.importorskip("rosbags", reason="the extra [ros] is not installed")
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
T = STORE.types
NAMES = ["shoulder", "upper", "elbow", "roll", "bend", "flange"]
START = 1_790_000_000.0  # [s]
STILL, MOVE, RATE, TRACKER = 1.0, 0.6, 20.0, 30.0  # [s], [s], [Hz], [Hz]


def header(time: float, frame: str = "tracker"):
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](int(time), round((time % 1) * 1e9)), frame)


def pose(x, q):
    point = T["geometry_msgs/msg/Point"](*map(float, x))
    return T["geometry_msgs/msg/Pose"](point, T["geometry_msgs/msg/Quaternion"](*map(float, q)))


def joint_state(time: float, names, q):
    empty = np.zeros(0)
    return T["sensor_msgs/msg/JointState"](header(time), list(names), np.asarray(q, float), empty, empty)


class Bag:
    """A bag that is being written."""

    def __init__(self, path: Path, storage=StoragePlugin.SQLITE3) -> None:
        self.writer = Writer(path, version=9, storage_plugin=storage)
        self.connections: dict[str, object] = {}

    def __enter__(self):
        self.writer.open()
        return self

    def __exit__(self, *_):
        self.writer.close()

    def add(self, topic: str, time: float, message) -> None:
        kind = message.__msgtype__
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=STORE)
        self.writer.write(self.connections[topic], int(time * 1e9), STORE.serialize_cdr(message, kind))


@pytest.fixture(scope="module")
def arm():
    """An arm whose URDF names its joints, the one that there is, and 30 postures."""
    from fastcal.conversion import convert

    spec = convert(fastcal.load_robot("ur5"), "urdf").spec
    for joint, name in zip(spec["joints"], NAMES, strict=True):
        joint["name"] = name
    nominal = fastcal.load_robot(spec)
    true = fastcal.perturbed(nominal, seed=2)
    q = np.random.default_rng(0).uniform(-2.5, 2.5, (30, 6))
    return nominal, true, q


def joints_at(q: np.ndarray, time: float) -> np.ndarray:
    """The arm stands STILL seconds at each posture and goes to the next in MOVE seconds."""
    k, rest = divmod(time, STILL + MOVE)
    share = max(0.0, (rest - STILL) / MOVE)
    here, there = q[min(int(k), len(q) - 1)], q[min(int(k) + 1, len(q) - 1)]
    return here + share * (there - here)


def test_a_gripper_that_speaks_first_is_not_the_arm(arm, tmp_path: Path) -> None:
    """Its joint states came before the arm's, and the arm was passed over: "holds no joints of this robot"."""
    robot, true, q = arm
    with Bag(tmp_path / "early") as bag:
        bag.add("/joint_states", START - 1, joint_state(START - 1, ["left_finger", "right_finger"], [0.01, 0.01]))
        record(bag, true, q)
    found = import_measurements([tmp_path / "early"], robot=robot)
    assert (found.joints, len(found)) == (6, len(q))


def record(bag: Bag, true, q, *, topic="/tracker/pose", kind="pose") -> None:
    end = len(q) * (STILL + MOVE)
    rng = np.random.default_rng(1)
    for k in range(int(end * RATE)):
        time = k / RATE
        order = np.argsort(NAMES)  # by the alphabet, as ros2_control often does
        position = joints_at(q, time)[order]
        bag.add("/joint_states", START + time, joint_state(START + time, np.array(NAMES)[order], position))
        bag.add("/gripper/joint_states", START + time, joint_state(START + time, ["finger"], [0.01 * k]))
    times = np.arange(int(end * TRACKER)) / TRACKER
    poses = true.forward(np.array([joints_at(q, time) for time in times]))
    for k, (time, at) in enumerate(zip(times, poses, strict=True)):
        x = at[:3, 3] + rng.normal(0, 3e-5, 3)
        turn = Rotation.from_matrix(at[:3, :3]).as_quat() * (-1) ** k  # q and -q are one rotation
        if kind == "pose":
            message = T["geometry_msgs/msg/PoseStamped"](header(START + time), pose(x, turn))
        elif kind == "point":
            message = T["geometry_msgs/msg/PointStamped"](header(START + time), pose(x, turn).position)
        else:
            vector = T["geometry_msgs/msg/Vector3"](*map(float, x))
            moved = T["geometry_msgs/msg/Transform"](vector, pose(x, turn).orientation)
            one = T["geometry_msgs/msg/TransformStamped"](header(START + time), "target", moved)
            message = T["tf2_msgs/msg/TFMessage"]([one])
        bag.add(topic, START + time, message)


@pytest.fixture(scope="module")
def bags(arm, tmp_path_factory) -> Path:
    _, true, q = arm
    folder = tmp_path_factory.mktemp("bags")
    with Bag(folder / "session") as bag:
        record(bag, true, q)
    return folder


def check(data, arm, *, turned=True) -> None:
    nominal, true, q = arm
    assert len(data) == len(q)
    np.testing.assert_allclose(data.q, q, atol=1e-9)
    expected = true.forward(q)
    assert np.abs(data.position - expected[:, :3, 3]).max() < 3e-5  # the mean of some 24 samples of 30 um each
    assert (data.rotation is not None) == turned
    if turned:
        w = data.rotation
        got = Rotation.from_quat(w[:, [1, 2, 3, 0]])
        assert (got * Rotation.from_matrix(expected[:, :3, :3]).inv()).magnitude().max() < 1e-6
    found = fastcal.calibrate(nominal, data)
    assert found.status == "converged"
    assert found.train.after.rms < 5e-5


def test_a_bag_becomes_a_row_a_standstill(arm, bags) -> None:
    check(load_measurements(bags / "session", arm[0]), arm)


@pytest.mark.parametrize(("kind", "storage"), [("point", StoragePlugin.MCAP), ("transform", StoragePlugin.SQLITE3)])
def test_points_and_transforms_are_read_too(arm, tmp_path, kind, storage) -> None:
    nominal, true, q = arm
    with Bag(tmp_path / "bag", storage) as bag:
        record(bag, true, q, kind=kind, topic="/tf" if kind == "transform" else "/point")
    if kind == "point":
        (file,) = (tmp_path / "bag").glob("*.mcap")
        check(load_measurements(file, nominal), arm, turned=False)
        return
    with pytest.raises(InvalidInput, match=r"which poses were measured\? Say it with --sheet TOPIC: /tf:target"):
        import_measurements([tmp_path / "bag"], robot=nominal)
    found = import_measurements([tmp_path / "bag"], robot=nominal, sheet="/tf:target")
    assert (found.joints, len(found)) == (6, len(q))


def test_the_command_writes_a_measurement_file_of_a_bag(arm, bags, tmp_path, capsys) -> None:
    from fastcal.cli import main

    arm[0].save(tmp_path / "arm.yaml")
    arguments = ["import", bags / "session", "--robot", tmp_path / "arm.yaml", "-o", tmp_path / "data.csv"]
    assert main([str(argument) for argument in arguments]) == 0
    said = capsys.readouterr().out
    assert "30 rows, 6 joints, points, orientations; read as ROS 2 bag" in said
    assert "joints read from the topic /joint_states\n" in said  # and not /gripper/joint_states
    assert "measured poses read from the topic /tracker/pose\n" in said
    check(load_measurements(tmp_path / "data.csv", arm[0]), arm)


def test_joints_of_a_bag_join_a_tracker_s_own_file_by_time(arm, bags, tmp_path) -> None:
    nominal, true, q = arm
    times = START + np.arange(len(q)) * (STILL + MOVE) + 0.5
    x = 1000 * true.forward(q)[:, :3, 3]
    lines = ["Time [s];X [mm];Y [mm];Z [mm]"]
    lines += [f"{t:.3f};{a:.5f};{b:.5f};{c:.5f}" for t, (a, b, c) in zip(times, x, strict=True)]
    (tmp_path / "tracker.csv").write_text("\n".join(lines))
    found = import_measurements([tmp_path / "tracker.csv"], joints=bags / "session", robot=nominal)
    assert (found.joints, len(found)) == (6, len(q))
    assert any("joined with their poses by time" in note for note in found.notes)
    assert [note for note in found.notes if "topic" in note] == ["joints read from the topic /joint_states"]


def test_a_bag_that_does_not_say_which_poses_is_asked_about(arm, tmp_path) -> None:
    nominal, true, q = arm
    with Bag(tmp_path / "bag") as bag:
        record(bag, true, q[:8])
        message = T["geometry_msgs/msg/PoseStamped"](header(START), pose([0, 0, 1], [0, 0, 0, 1]))
        bag.add("/tcp_pose_broadcaster/pose", START, message)
        bag.add("/camera/pose", START, message)
    with pytest.raises(InvalidInput, match=r"Say it with --sheet TOPIC: /camera/pose, /tracker/pose$"):
        import_measurements([tmp_path / "bag"], robot=nominal)
    found = import_measurements([tmp_path / "bag"], robot=nominal, sheet="/tracker/pose")
    assert len(found) == 8
    assert "measured poses read from the topic /tracker/pose" in found.notes
    with pytest.raises(ParseError, match=r"no poses of '/tracker'; it has /camera/pose, /tcp_pose"):
        import_measurements([tmp_path / "bag"], robot=nominal, sheet="/tracker")
    with pytest.raises(ParseError, match="no pose was measured while the joints stood still"):
        import_measurements([tmp_path / "bag"], robot=nominal, sheet="/camera/pose")


def test_anything_but_a_bag_is_refused(arm, tmp_path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\0" * 100)
    (tmp_path / "b.db3").write_bytes(b"SQLite format 3\0" + b"x" * 500)
    (tmp_path / "c.bag").write_bytes(b"#ROSBAG V2.0\n" + b"\xff" * 100)
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    for name in ("a.mcap", "b.db3", "c.bag", "d"):
        assert is_bag(tmp_path / name)
        with pytest.raises(ParseError, match="is no ROS bag that can be read"):
            import_measurements([tmp_path / name], robot=arm[0])
    with Bag(tmp_path / "empty") as bag:
        bag.add("/joint_states", START, joint_state(START, [], []))
    with pytest.raises(ParseError, match="the bag holds neither joint states nor poses"):
        load_measurements(tmp_path / "empty", arm[0])


def spoilt(bag: Bag, true, q, *, late=0.0, joints=lambda k, q: [(NAMES, q)], point=lambda k, x: x) -> None:
    """An arm and a tracker whose clock is late; what each message of joints, and each point, becomes."""
    end = len(q) * (STILL + MOVE)
    for k in range(int(end * RATE)):
        time = k / RATE
        for part, (names, values) in enumerate(joints(k, joints_at(q, time))):
            message = joint_state(START + time, names, values)
            bag.add("/joint_states" if part == 0 else f"/more_joint_states_{part}", START + time, message)
    times = np.arange(int(end * TRACKER)) / TRACKER
    places = true.forward(np.array([joints_at(q, time) for time in times]))[:, :3, 3]
    for k, (time, x) in enumerate(zip(times, places, strict=True)):
        stamp = START + time + late
        body = pose(point(k, x), [0, 0, 0, 1]).position
        bag.add("/tracker", START + time, T["geometry_msgs/msg/PointStamped"](header(stamp), body))


def check_rows(found, arm, q, atol=1e-6) -> None:
    """All postures, each with its point."""
    data = imported_dataset(found, arm[0])
    np.testing.assert_allclose(data.q, q, atol=1e-9)
    np.testing.assert_allclose(data.position, arm[1].forward(q)[:, :3, 3], atol=atol)


@pytest.mark.parametrize("late", [0.3, -0.45, 0.1, -0.05])
def test_a_late_clock_is_found_and_made_up_for(arm, tmp_path, late) -> None:
    """Within half a standstill's length the points are right already; beyond, they move where the joints don't."""
    q = arm[2][:12]
    with Bag(tmp_path / "bag") as bag:
        spoilt(bag, arm[1], q, late=late)
    found = import_measurements([tmp_path / "bag"], robot=arm[0])
    check_rows(found, arm, q)
    said = [note for note in found.notes if "the clock of the poses is" in note]
    assert len(said) == (abs(late) > 0.15)
    if said:
        assert f"{abs(late):.2f} s {'late' if late > 0 else 'early'}" in said[0] or "0.31" in said[0]


def test_clocks_that_differ_by_whole_poses_are_mended_by_the_robot(arm, tmp_path) -> None:
    q = arm[2]
    with Bag(tmp_path / "bag") as bag:
        spoilt(bag, arm[1], q, late=STILL + MOVE)
    found = import_measurements([tmp_path / "bag"], robot=arm[0])
    data = imported_dataset(found, arm[0])
    assert len(data) >= len(q) - 3
    np.testing.assert_allclose(data.position, arm[1].forward(data.q)[:, :3, 3], atol=1e-6)
    assert any("slipped, mended with the robot" in note for note in found.notes)


def test_a_point_that_moves_while_the_joints_stand_is_left_out(arm, tmp_path) -> None:
    q = arm[2][:12]

    def knocked(k, x):  # between 5 and 6 s, of the fourth posture
        return x + np.array([0, 0, 0.02 * (5.3 < k / TRACKER < 5.5)])

    with Bag(tmp_path / "bag") as bag:
        spoilt(bag, arm[1], q, point=knocked)
    found = import_measurements([tmp_path / "bag"], robot=arm[0])
    check_rows(found, arm, np.delete(q, 3, axis=0))
    assert any("in 1 of 12 standstills of the joints the measured point still moves, by" in n for n in found.notes)


def test_a_point_that_never_stands_still_is_refused(arm, tmp_path) -> None:
    with Bag(tmp_path / "bag") as bag:
        spoilt(bag, arm[1], arm[2][:12], point=lambda k, x: x + 0.01 * np.sin(2.5 * k / TRACKER))
    with pytest.raises(ParseError, match=r"the measured point still moves.*are the clocks of .* the same"):
        import_measurements([tmp_path / "bag"], robot=arm[0])


def test_samples_without_a_number_are_left_out_and_counted(arm, tmp_path) -> None:
    q = arm[2][:12]

    def states(k, values):
        broken = [*values[:2], np.nan if k % 37 == 5 else values[2], *values[3:], np.nan]
        return [([*NAMES, "finger"], broken)]

    def points(k, x):
        return x * [1, (np.nan if k % 2 else 1e200) if k % 29 == 3 else 1, 1]

    with Bag(tmp_path / "bag") as bag:
        spoilt(bag, arm[1], q, joints=states, point=points)
    found = import_measurements([tmp_path / "bag"], robot=arm[0])
    check_rows(found, arm, q)
    said = "; ".join(found.notes)
    assert "11 of 384 joint states hold NaN" in said
    assert "20 of 576 measured poses hold NaN" in said
    assert "other joints in the bag are left out: finger" in said


def test_a_joint_that_never_has_a_number_is_left_out() -> None:
    states = Stream("/js", [0.0, 0.1, 0.2, 0.3], [[1, np.nan], [2, np.nan], [np.nan, np.nan], [1e200, np.nan]])
    found = joint_states("bag", {("a1", "finger"): states}, (), None)
    assert (found.names, found.q.tolist()) == (("a1",), [[1.0], [2.0]])
    assert found.notes[1:] == (
        "joints without a number in any message are left out: finger",
        "2 of 4 joint states hold NaN or a number beyond all sizes, and are left out",
    )


@pytest.mark.parametrize(
    ("devices", "count", "expected"),
    [
        ([3, 3], None, "asks"),
        ([7, 7], 7, "asks"),
        ([3, 3], 6, "abcdef"),
        ([6, 2], 6, "abcdef"),
        ([2, 6], None, "cdefgh"),
        ([2, 6, 3], 6, "cdefgh"),
        ([1], None, "a"),
    ],
)
def test_which_messages_are_the_arm_s_without_its_names(devices, count, expected) -> None:
    letters, streams = iter("abcdefghijklmnop"), {}
    for size in devices:
        names = tuple(next(letters) for _ in range(size))
        streams[names] = Stream("/js", [0.0], [[1.0] * size])
    if expected == "asks":
        with pytest.raises(InvalidInput, match="--robot URDF says which are the arm's"):
            joint_states("bag", streams, (), count)
    else:
        assert "".join(joint_states("bag", streams, (), count).names) == expected


def test_the_delay_of_a_noisy_camera_is_none() -> None:
    """Five millimetres of noise are no motion, and nothing is to be made up for."""
    rng = np.random.default_rng(0)
    times = np.arange(0, 40, 0.03)
    places = rng.normal(0, 1, (20, 3))[np.minimum((times / 2).astype(int), 19)] + rng.normal(0, 0.005, (len(times), 3))
    windows = np.array([(2 * k + 0.3, 2 * k + 1.7) for k in range(20)], dtype=float)
    assert delay(windows, times, places) == (0.0, False)
    assert not still_windows(windows, times, places)[0].any()
    late, may_be_another = delay(windows, times + 0.6, places)
    assert abs(late - 0.6) < 0.05
    assert may_be_another  # of 2 s more


def test_a_delay_of_more_than_a_pose_is_found_where_poses_are_held_unequally_long() -> None:
    rng = np.random.default_rng(1)
    begins = np.cumsum(rng.uniform(1.0, 4.0, 25))
    times = np.arange(0, begins[-1], 0.02)
    held = np.searchsorted(begins, times, side="right")
    places = rng.normal(0, 1, (26, 3))[held] + rng.normal(0, 1e-5, (len(times), 3))
    windows = np.column_stack([begins[:-1] + 0.2, begins[1:] - 0.2])
    late, may_be_another = delay(windows, times - 4.3, places)
    assert abs(late + 4.3) < 0.05
    assert not may_be_another


@pytest.mark.parametrize("split", [3, 4, 5])
def test_joints_in_two_messages_are_put_together(arm, tmp_path, split) -> None:
    """As two controllers of one arm publish them; a gripper stays out."""
    q = arm[2][:12]
    order = np.argsort(NAMES)
    names = np.array(NAMES)[order]

    def states(k, values):
        first, second = (names[:split], values[order][:split]), (names[split:], values[order][split:])
        return [first, second, (["finger"], [0.01 * k])] if k % 2 else [second, first]

    with Bag(tmp_path / "bag") as bag:
        spoilt(bag, arm[1], q, joints=states)
    found = import_measurements([tmp_path / "bag"], robot=arm[0])
    check_rows(found, arm, q)
    assert any("joints come in 2 kinds of messages, which are put together" in note for note in found.notes)


def test_a_message_of_some_joints_keeps_them_up_to_date(arm, tmp_path) -> None:
    q = arm[2][:12]

    def states(k, values):
        return [(NAMES, values), (NAMES[:2], values[:2])]

    with Bag(tmp_path / "bag") as bag:
        spoilt(bag, arm[1], q, joints=states)
    check_rows(import_measurements([tmp_path / "bag"], robot=arm[0]), arm, q)


def test_the_bags_of_these_tests_are_ros_bags(bags) -> None:
    with AnyReader([bags / "session"]) as reader:
        kinds = {connection.msgtype for connection in reader.connections}
    assert kinds == {"sensor_msgs/msg/JointState", "geometry_msgs/msg/PoseStamped"}


def test_a_bag_without_end_is_refused(arm, bags, monkeypatch) -> None:
    monkeypatch.setattr("fastcal.importers.rosbag.MAX_MESSAGES", 1000)
    with pytest.raises(TooLarge, match="a bag of at most 1000 joint states and poses"):
        load_measurements(bags / "session", arm[0])
    monkeypatch.undo()
    monkeypatch.setattr("fastcal.importers.rosbag.MAX_SAMPLES", 100)
    with pytest.raises(TooLarge, match="alone of at most 100 samples"):
        import_measurements([bags / "session"], joints=bags / "session", robot=arm[0])


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
def test_a_small_bag_that_unpacks_to_far_more_is_refused(mode: str, arm, tmp_path, monkeypatch) -> None:
    """400 MB of zeros in one message: beyond what a file of the bag, or memory, may grow to."""
    monkeypatch.setenv("TMPDIR", str(tmp_path / "unpacked"))
    monkeypatch.setattr("fastcal.importers.rosbag.MEMORY", 500_000_000)
    (tmp_path / "unpacked").mkdir()
    bag = Bag(tmp_path / "bag")
    bag.writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with bag:
        bag.add("/joint_states", START, joint_state(START, ["a"], [0.0]))
        bag.writer.write(bag.connections["/joint_states"], 1, bytes(400_000_000))
    assert sum(path.stat().st_size for path in (tmp_path / "bag").iterdir()) < 400_000
    with pytest.raises(ParseError, match="is no ROS bag that can be read"):
        load_measurements(tmp_path / "bag", arm[0])
    assert not list((tmp_path / "unpacked").iterdir())


def test_metadata_that_would_take_minutes_are_refused(arm, bags, tmp_path) -> None:
    shutil.copytree(bags / "session", tmp_path / "bag")
    with (tmp_path / "bag" / "metadata.yaml").open("a") as out:
        out.write("# a long comment\n" * 100_000)
    with pytest.raises(TooLarge, match="metadata of at most 1 MB"):
        load_measurements(tmp_path / "bag", arm[0])


def test_joints_without_a_number_in_their_names_are_reported(arm, bags, tmp_path) -> None:
    """Without an arm that names its joints nobody can know which is which."""
    with Bag(tmp_path / "bag") as bag:
        for k in range(40):
            state = joint_state(START + 0.05 * k, ["lift_joint", "arm_1_joint", "arm_2_joint"], [0.1, 0.2, 0.3])
            bag.add("/joint_states", START + 0.05 * k, state)
            message = T["geometry_msgs/msg/PoseStamped"](header(START + 0.05 * k), pose([0, 0, 1], [0, 0, 0, 1]))
            bag.add("/tracker/pose", START + 0.05 * k, message)
    found = import_measurements([tmp_path / "bag"])
    assert found.joints == 2
    said = "of 3 joint states 2 are read, by the numbers in their names: --robot URDF knows the names"
    assert said in found.notes
    assert not any("joint states" in note for note in import_measurements([bags / "session"], robot=arm[0]).notes)
