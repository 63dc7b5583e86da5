# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A compensated program, run by a controller with nominal kinematics, brings the real tool where it says."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.compensation import TargetRefused, compensate_program, target_points
from fastcal.compensation.configurations import Configurations
from fastcal.errors import InvalidInput, ParseError
from fastcal.programs import Cell, read_program

# Language: the arm that runs it, and how exact its decimals are [m].
ARMS = {
    "RAPID": ("siasun_sr210d", 2e-6),
    "KRL": ("siasun_sr210d", 2e-6),
    "FANUC LS": ("siasun_sr210d", 1e-4),  # three decimals of a degree, 2 m out
    "URScript": ("ur5", 1e-6),
}


def frame(xyz, *euler) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(*euler, degrees=True).as_matrix() if euler else np.eye(3)
    T[:3, 3] = xyz
    return T


CELL = Cell(tools={"1": frame([0.02, 0, 0.2], "y", 10)}, frames={"1": frame([1.75, -0.15, 0.82])})


def own_pose(language: str, target) -> np.ndarray:
    """T_frame_tool of a target's numbers, by scipy."""
    values = [number.value for number in target.numbers]
    scale = 1.0 if language == "URScript" else 1e-3
    turn = {
        "RAPID": lambda v: Rotation.from_quat(v, scalar_first=True),
        "KRL": lambda v: Rotation.from_euler("ZYX", v, degrees=True),
        "FANUC LS": lambda v: Rotation.from_euler("xyz", v, degrees=True),
        "URScript": Rotation.from_rotvec,
    }[language](values[3:])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn.as_matrix(), np.array(values[:3]) * scale
    return T


def flange_poses(language: str, program, cell: Cell) -> dict[int, np.ndarray]:
    """T_base_flange of every cartesian target of a program."""
    tools, frames = ({name.lower(): T for name, T in known.items()} for known in (cell.tools, cell.frames))
    tools = {name.lower(): T for name, T in program.tools.items()} | tools
    frames = {name.lower(): T for name, T in program.frames.items()} | frames
    out = {}
    for i, target in enumerate(program.targets):
        move = next((m for m in program.moves if m.target == i), None)
        if target.kind == "pose":
            tool, base = (move.tool or target.tool).lower(), (move.frame or target.frame).lower()
            out[i] = frames[base] @ own_pose(language, target) @ np.linalg.inv(tools[tool])
    return out


def bare(robot: fastcal.Robot) -> fastcal.Robot:
    """The robot from its base to its last frame."""
    zero = {"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 0]}
    return fastcal.Robot(robot.spec | {"base": zero, "tool": zero})


@pytest.mark.parametrize("language", ARMS)
def test_the_real_flange_goes_where_the_program_says(programs, arms, language) -> None:
    name, digits = ARMS[language]
    nominal, real = arms(name)
    program = read_program(programs[language])
    done = compensate_program(real, program, nominal=nominal, cell=CELL, payload=20.0)
    written = read_program({d.name: d.text.encode("latin-1") for d in done.documents})
    assert len(written.targets) == len(program.targets)
    wanted, said = flange_poses(language, program, CELL), flange_poses(language, written, CELL)
    assert len(wanted) >= 3
    for i, target in enumerate(written.targets):
        if target.kind == "pose":
            # The controller: nominal inverse kinematics, in the configuration of the first program.
            found = fastcal.inverse_kinematics(bare(nominal), said[i], seed=done.nominal_q[i], restarts=0)
            command, goal = found.q, wanted[i]
        else:
            command = np.array([target.values])
            goal = bare(nominal).forward(program.targets[i].values)[0]
        # Gravity is the robot's own, and its loads hang on it whatever its tool is called.
        got = bare(real).forward(command, payload=20.0)[0]
        assert np.linalg.norm(got[:3, 3] - goal[:3, 3]) < digits
        assert np.abs(got[:3, :3] - goal[:3, :3]).max() < 1e-4
    assert done.error.min() > 1e-3  # it was worth doing


def test_it_is_known_how_surely_the_arm_reaches_the_targets(programs) -> None:
    nominal = fastcal.load_robot("ur5")
    data = fastcal.simulate(fastcal.perturbed(nominal, seed=1), fastcal.random_poses(nominal, 60, seed=1), noise=1e-4)
    model = fastcal.calibrate(nominal, data).model
    program = read_program(programs["URScript"])
    done = compensate_program(model, program)
    each = model.position_deviation(done.q)
    np.testing.assert_allclose(done.sigma, np.sqrt(np.mean(each**2, axis=1)), rtol=1e-12)
    assert np.isnan(compensate_program(nominal, program).sigma).all()


@pytest.mark.parametrize("language", ARMS)
def test_a_robot_as_believed_changes_nothing_but_digits(programs, arms, language) -> None:
    nominal, _ = arms(ARMS[language][0])
    program = read_program(programs[language])
    done = compensate_program(nominal, program, cell=CELL)
    written = read_program({d.name: d.text.encode("latin-1") for d in done.documents})
    for before, after in zip(program.targets, written.targets, strict=True):
        np.testing.assert_allclose(after.values, before.values, atol=2e-4 if language == "RAPID" else 2e-5)
        assert {k: w.text for k, w in after.words.items()} == {k: w.text for k, w in before.words.items()}
    np.testing.assert_allclose(done.error, 0, atol=1e-8)


def krl(values: str, words: str = "S 2,T 35") -> dict[str, bytes]:
    return {"a.src": f"DEF a( )\n$BASE=$NULLFRAME\n$TOOL=TOOL_DATA[0]\nPTP {{{values},{words}}}\nEND\n".encode()}


UR_POSE = "p[-.4, -.2, .3, 0, 3.14, 0]"
UR_HOME = "[0, -1.2, 1.3, -1.6, -1.5, 0]"


def script(*lines: str) -> dict[str, bytes]:
    return {"a.script": "\n".join(["set_tcp(p[0, 0, 0.1, 0, 0, 0])", *lines]).encode()}


def test_a_posture_that_nothing_states_is_not_guessed(arms) -> None:
    """A pose alone is reached in eight postures; joints before it, or the start of a cell file, decide."""
    nominal, real = arms("ur5")
    home = np.array([0, -1.2, 1.3, -1.6, -1.5, 0])
    before = compensate_program(real, read_program(script(f"movej({UR_HOME})", f"movel({UR_POSE})")), nominal=nominal)
    start = compensate_program(real, read_program(script(f"movel({UR_POSE})")), nominal=nominal, cell=Cell(start=home))
    np.testing.assert_allclose(start.nominal_q[0], before.nominal_q[1], atol=1e-9)
    assert not before.left + before.assumed
    assert not start.left + start.assumed


def test_a_script_of_poses_alone_says_what_posture_is_assumed(arms) -> None:
    """URScript has no words for a posture: where no joints stand in it either, one is assumed aloud."""
    nominal, real = arms("ur5")
    lines = [f"movel({UR_POSE})", "movel(p[-.4, -.2, .4, 0, 3.14, 0])"]
    done = compensate_program(real, read_program(script(*lines)), nominal=nominal)
    assert len(done.targets) == 2
    assert len(done.assumed) == 1
    assert done.assumed[0].startswith("a.script:2: nothing in the program says in which of 8 postures")
    assert "start_deg" in done.assumed[0]


def test_only_the_target_without_a_posture_is_left(arms) -> None:
    nominal, real = arms("ur5")
    lines = [f"movel({UR_POSE})", f"movej({UR_HOME})", "movel(p[-.4, -.2, .4, 0, 3.14, 0])"]
    done = compensate_program(real, read_program(script(*lines)), nominal=nominal)
    text = done.documents[0].text.splitlines()
    assert text[2] == lines[0]
    assert text[3] != lines[1]
    assert text[4] != lines[2]
    assert len(done.left) == 1
    assert done.left[0].startswith("a.script:2: the target of line 2 is left as it is: the arm reaches it in ")


@pytest.mark.parametrize("named", [False, True])
def test_the_joints_that_a_pose_is_to_be_near_choose_its_posture(arms, named) -> None:
    """All postures of one pose, each asked for by qnear; without qnear all would be one."""
    nominal, real = arms("ur5")
    T = bare(nominal).forward(np.array([0.4, -1.2, 1.3, -1.6, -1.5, 0.3]))[0] @ frame([0, 0, 0.1])
    turn = Rotation.from_matrix(T[:3, :3]).as_rotvec()
    pose = "p[" + ", ".join(f"{x:.9f}" for x in (*T[:3, 3], *turn)) + "]"
    ways = Configurations(nominal, read_program(script()).language)._ways(
        nominal.forward([0.4, -1.2, 1.3, -1.6, -1.5, 0.3])[0], None
    )
    assert len(ways) == 8
    for q in ways:
        near = "[" + ", ".join(f"{x + 0.05:.6f}" for x in q) + "]"
        lines = (
            [f"q = {near}", f"movej(get_inverse_kin({pose}, qnear=q))"]
            if named
            else [f"movej(get_inverse_kin({pose}, {near}))"]
        )
        done = compensate_program(real, read_program(script(*lines)), nominal=nominal)
        np.testing.assert_allclose(done.nominal_q[0], q, atol=1e-6)


def test_a_krl_target_without_words_needs_the_joints_before_it(arms) -> None:
    nominal, real = arms("siasun_sr210d")
    pose = "{X 1800,Y -210,Z 980,A 180,B 1,C 180}"
    head = "DEF a( )\n$BASE=$NULLFRAME\n$TOOL=$NULLFRAME\n"
    with pytest.raises(InvalidInput, match=r"a\.src:4: .* postures, and nothing says in which"):
        compensate_program(real, read_program({"a.src": f"{head}LIN {pose}\nEND\n".encode()}), nominal=nominal)
    home = "PTP {A1 0,A2 -10,A3 10,A4 175,A5 80,A6 0}\n"
    done = compensate_program(real, read_program({"a.src": f"{head}{home}LIN {pose}\nEND\n".encode()}), nominal=nominal)
    assert not done.left
    assert len(done.targets) == 2


def test_the_words_choose_the_configuration(arms) -> None:
    """The same pose with the wrist one way and the other: S bit 2 and the turns of axes 4 and 6."""
    nominal, _ = arms("siasun_sr210d")
    pose = "X 1800,Y -210,Z 980,A 180,B 1,C 180"
    found = {}
    for words in ("S 2,T 35", "S 6,T 19", "S 6,T 51"):
        q = compensate_program(nominal, read_program(krl(pose, words))).q[0]
        found[words] = q
        status, turn = (int(word.split()[1]) for word in words.split(","))
        assert (q[4] < 0) == bool(status & 4)
        assert [bool(turn >> i & 1) for i in range(6)] == (q < 0).tolist()
    poses = nominal.forward(np.array(list(found.values())))
    np.testing.assert_allclose(poses, np.repeat(poses[:1], 3, axis=0), atol=1e-8)
    np.testing.assert_allclose(found["S 6,T 19"][5] - found["S 6,T 51"][5], 2 * np.pi, atol=1e-8)


def test_words_follow_a_joint_that_crosses_zero(arms) -> None:
    """Joint 1 stands at +0.00002 deg, and the real arm's zero is elsewhere: T bit 0 must become 1."""
    nominal, _ = arms("siasun_sr210d")
    turned = [{"effect": "thermal_offset", "owner": "joint1", "t0_c": 20.0, "parameters": {"rad_k": 1e-4}}]
    real = fastcal.Robot(nominal.spec | {"effects": turned})
    q = np.radians([0.00002, -10, 10, 180, 80, -5])
    T = bare(nominal).forward(q)[0]
    a, b, c = Rotation.from_matrix(T[:3, :3]).as_euler("ZYX", degrees=True)
    x, y, z = T[:3, 3] * 1000
    program = read_program(krl(f"X {x:.9f},Y {y:.9f},Z {z:.9f},A {a:.9f},B {b:.9f},C {c:.9f}", "S 2,T 'B100010'"))
    done = compensate_program(real, program, temperature=303.15)
    assert "T 'B100011'}" in done.documents[0].text
    assert "a.src:4: the target of line 4: T 'B100010' becomes 'B100011', as a joint crosses it" in done.notes


def test_what_is_added_at_run_time_is_reported_with_what_is_left(programs, arms) -> None:
    """Offs(p10, 0, 0, 25): p10's shift 25 mm higher; the figure is the real arm's miss there."""
    nominal, real = arms("siasun_sr210d")
    program = read_program(programs["RAPID"])
    done = compensate_program(real, program, nominal=nominal, payload=20.0)
    note = next(note for note in done.notes if "glue.mod:22: p10 is shifted" in note)
    written = read_program({"glue.mod": done.documents[0].text.encode("latin-1")})
    tool, base = program.tools["tgun"], program.frames["wdoor"]
    up = frame([0, 0, 0.025])
    said = base @ up @ own_pose("RAPID", written.targets[2]) @ np.linalg.inv(tool)
    wanted = base @ up @ own_pose("RAPID", program.targets[2])
    command = fastcal.inverse_kinematics(bare(nominal), said, seed=done.q[2], restarts=0).q
    left = np.linalg.norm((bare(real).forward(command, payload=20.0)[0] @ tool - wanted)[:3, 3])
    assert note.endswith(f"with the correction of p10 {left * 1000:.3f} mm are left there")
    assert 0.001 < left * 1000 < 0.5


def test_backlash_is_taken_from_the_side_the_moves_come_from(arms) -> None:
    """Joint 1 goes up, then down: it is commanded half the gap further each way."""
    nominal, _ = arms("ur5")
    gap = 1e-3
    slack = [{"effect": "backlash", "owner": "joint1", "parameters": {"gap_rad": gap}}]
    real = fastcal.Robot(nominal.spec | {"effects": slack})
    script = "".join(f"movej([{q}, -1.2, 1.3, -1.6, -1.5, 0.2])\n" for q in (0.0, 0.5, 0.1)).encode()
    done = compensate_program(real, read_program({"a.script": script}))
    shift = done.q[:, 0] - done.nominal_q[:, 0]
    expected = [real.forward(q, approach=[s, 0, 0, 0, 0, 0]) for q, s in zip(done.q, (0, 1, -1), strict=True)]
    np.testing.assert_allclose(np.vstack(expected), nominal.forward(done.nominal_q), atol=1e-8)
    np.testing.assert_allclose(np.abs(shift), [0, gap / 2, gap / 2], atol=1e-9)
    assert shift[1] * shift[2] < 0


def test_what_settles_is_taken_from_the_moves_and_comes_back(arms) -> None:
    """Moves were taken to be 0: the tool missed each target by what the last move leaves."""
    nominal, _ = arms("ur5")
    creep = [{"effect": "settling", "owner": "joint2", "parameters": {"rad_rad": {"value": 2e-3}}}]
    real = fastcal.Robot(nominal.spec | {"effects": creep})
    script = "".join(f"movej([0.3, {q}, 1.3, -1.6, -1.5, 0.2])\n" for q in (-1.2, -0.7, -1.6)).encode()
    done = compensate_program(real, read_program({"a.script": script}), nominal=nominal)
    got = fastcal.predict(real, fastcal.Dataset.from_arrays(done.q)).position
    np.testing.assert_allclose(got, nominal.forward(done.nominal_q)[:, :3, 3], atol=5e-6)
    assert done.error.max() > 5e-4
    written = {d.name: d.text.encode("latin-1") for d in done.documents}
    back = compensate_program(real, read_program(written), nominal=nominal, inverse=True)
    np.testing.assert_allclose(back.q, done.nominal_q, atol=2e-6)


def test_a_temperature_that_lags_has_come_to_rest_in_a_program(arms) -> None:
    """It asked for the column time_s, which a program can't have."""
    nominal, _ = arms("ur5")
    script = {"a.script": b"movej([0.3, -1.2, 1.3, -1.6, -1.5, 0.2])\n"}
    warm = {"effect": "thermal_expansion", "owner": "robot", "t0_c": 20.0, "parameters": {"coefficient_1_k": 5e-5}}
    lagging = {**warm, "parameters": {"coefficient_1_k": 5e-5, "lag_s": 1800.0}}
    done = [
        compensate_program(
            fastcal.Robot(nominal.spec | {"effects": [effect]}), read_program(script), temperature=308.15
        )
        for effect in (warm, lagging)
    ]
    np.testing.assert_array_equal(done[0].q, done[1].q)
    assert done[0].error.min() > 1e-4


def test_the_measurement_s_own_effects_are_left_out(arms) -> None:
    nominal, _ = arms("ur5")
    drift = [{"effect": "measurement_scale", "owner": "instrument", "parameters": {"error": 1e-3}}]
    script = {
        "a.script": b"set_tcp(p[0,0,0,0,0,0])\nmovej([0,-1.2,1.3,-1.6,-1.5,0])\nmovel(p[-.4, -.2, .3, 0, 3.14, 0])\n"
    }
    done = compensate_program(fastcal.Robot(nominal.spec | {"effects": drift}), read_program(script))
    np.testing.assert_allclose(done.q, done.nominal_q, atol=1e-9)


@pytest.mark.parametrize(
    ("script", "sentence"),
    [
        (
            b"set_tcp(p[0,0,0,0,0,0])\nmovel(p[-4, -.2, .3, 0, 3.14, 0])\n",
            "a.script:2: the target of line 2: for the nominal robot the",
        ),
        (
            b"# no\nmovel(p[-.4, -.2, .3, 0, 3.14, 0])\n",
            "no target can be compensated: a.script:2: the target of line 2 is left as it is: the program does not say",
        ),
        (b"movej(pose_add(a, b))\n", "no target can be compensated: a.script:1: "),
        (b"sleep(1)\n", "a.script: holds no targets of plain numbers; nothing to compensate"),
    ],
)
def test_a_program_that_cannot_be_run_is_refused(arms, script, sentence) -> None:
    nominal, _ = arms("ur5")
    with pytest.raises(InvalidInput) as caught:
        compensate_program(nominal, read_program({"a.script": script}))
    assert str(caught.value).startswith(sentence)


@pytest.mark.parametrize("fifth", [0.0, 0.1])
def test_home_with_a_stretched_wrist_is_corrected_by_small_moves(arms, fifth) -> None:
    """There the wrist has no exact command, or one whose joints 4 and 6 swing against each other."""
    nominal = arms("kuka_kr6_r900")[0]
    real = fastcal.perturbed(nominal, seed=5)
    lines = f"PTP {{A1 0,A2 -90,A3 90,A4 0,A5 {fifth},A6 0}}\nPTP {{A1 10,A2 -80,A3 95,A4 5,A5 40,A6 0}}\n"
    done = compensate_program(real, read_program({"a.src": f"DEF A()\n{lines}END\n".encode()}), nominal=nominal)
    wanted, got, without = nominal.forward(done.nominal_q), real.forward(done.q), real.forward(done.nominal_q)
    assert np.abs(np.degrees(done.q - done.nominal_q)).max() < 2
    np.testing.assert_allclose(got[0, :3, 3], wanted[0, :3, 3], atol=1e-8)
    left = Rotation.from_matrix(wanted[0, :3, :3].T @ got[0, :3, :3]).magnitude()
    assert 1e-5 < left < 5e-3
    assert np.linalg.norm((without - wanted)[0, :3, 3]) > 1e-4
    np.testing.assert_allclose(got[1], wanted[1], atol=1e-8)
    notes = [note for note in done.notes if "singular" in note]
    assert len(notes) == 1
    assert notes[0].startswith("a.src:2: ")
    assert f" {np.degrees(left):.3f} deg are left there" in notes[0]


def test_a_target_that_cannot_be_reached_is_named_among_where_the_others_are(arms) -> None:
    nominal, real = arms("ur5")
    program = read_program(script(f"movej({UR_HOME})", "movel(p[5, 0, 0, 0, 0, 0])"))
    with pytest.raises(TargetRefused) as refused:
        compensate_program(real, program)
    assert refused.value.target == program.targets[1]
    points = target_points(nominal, program)
    np.testing.assert_allclose(points[0], nominal.forward(np.array([program.targets[0].values]))[0, :3, 3], atol=1e-9)
    base, tool = nominal.core.base_and_tool(nominal.core.nominal)
    flange = np.eye(4)
    flange[:3, 3] = [5, 0, -0.1]  # the script's tool is 0.1 m long
    np.testing.assert_allclose(points[1], (base @ flange @ tool)[:3, 3], atol=1e-9)


def test_other_joints_than_the_robot_s_are_refused(arms) -> None:
    with pytest.raises(ParseError, match=r"a\.script:1: .*expected 7 joints, as lbr_iiwa14 has, got 6"):
        compensate_program(arms("lbr_iiwa14")[0], read_program({"a.script": b"movej([0, 0, 0, 0, 0, 0])\n"}))


def test_all_eight_configurations_are_found_and_distinguished() -> None:
    """An RX160L without limits reaches a pose in eight ways, whose three bits are all different."""
    arm = fastcal.load_robot("staubli_rx160l")
    free = [joint | {"min_deg": -360.0, "max_deg": 360.0} for joint in arm.spec["joints"]]
    arm = fastcal.Robot(arm.spec | {"joints": free})
    program = read_program({"a.mod": b"MODULE a\nENDMODULE\n"})
    configurations = Configurations(arm, program.language)
    T = arm.forward(np.radians([20.0, 30.0, 70.0, 25.0, 40.0, -15.0]))[0]
    ways = configurations._ways(T, None)
    assert len({program.language.branch(q, configurations.arm) for q in ways}) == len(ways) == 8
    np.testing.assert_allclose(arm.forward(np.array(ways)), np.repeat(T[None], 8, axis=0), atol=1e-8)


@pytest.mark.parametrize("language", ARMS)
def test_a_compensated_program_goes_back_to_the_nominal_one(programs, arms, language) -> None:
    """There and back is where it began, within the decimals of the language; a plain program moves as far away."""
    name, _ = ARMS[language]
    nominal, real = arms(name)
    options = {"nominal": nominal, "cell": CELL, "payload": 20.0}
    program = read_program(programs[language])
    there = compensate_program(real, program, **options)
    back = compensate_program(
        real, read_program({d.name: d.text.encode("latin-1") for d in there.documents}), inverse=True, **options
    )
    again = read_program({d.name: d.text.encode("latin-1") for d in back.documents})
    digits = {"FANUC LS": 1.5e-3}.get(language, 1e-4)  # of the numbers as they are written: mm and degrees
    for old, new in zip(program.targets, again.targets, strict=True):
        a, b = (np.array([number.value for number in target.numbers]) for target in (old, new))
        off = np.abs(a - b)
        assert np.minimum(off, np.abs(off - 360)).max() <= digits
    np.testing.assert_allclose(back.error, there.error, atol=1e-5)
    np.testing.assert_allclose(back.q, there.nominal_q, atol=1e-4)
    np.testing.assert_allclose(back.shift, -there.shift, atol=2e-4)
    assert np.linalg.norm(there.shift[:, :3], axis=1).min() > 1e-4


def test_the_way_back_knows_from_which_side_a_joint_came(programs, arms) -> None:
    nominal, _ = arms("siasun_sr210d")
    gap = {"effect": "backlash", "owner": "joint2", "parameters": {"gap_rad": {"value": 2e-3}}}
    real = fastcal.Robot(nominal.spec | {"effects": [gap]})
    program = read_program(programs["RAPID"])
    there = compensate_program(real, program, nominal=nominal, cell=CELL)
    files = {d.name: d.text.encode("latin-1") for d in there.documents}
    back = compensate_program(real, read_program(files), nominal=nominal, cell=CELL, inverse=True)
    np.testing.assert_allclose(back.q, there.nominal_q, atol=1e-5)
    with pytest.raises(InvalidInput, match="the inverse needs method='full'"):
        compensate_program(real, program, nominal=nominal, cell=CELL, inverse=True, method="one-step")
