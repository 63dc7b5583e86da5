# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Programs are read as their languages mean them, and written back byte for byte."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fastcal.errors import InvalidInput, ParseError
from fastcal.programs import Cell, Frames, read_program

LANGUAGES = ("RAPID", "KRL", "FANUC LS", "URScript")


def moves(program) -> list[tuple[str, str | None, str | None]]:
    return [(program.targets[m.target].name, m.tool, m.frame) for m in program.moves]


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_is_not_changed_stays_byte_for_byte(programs, language) -> None:
    program = read_program(programs[language])
    assert program.language.name == language
    words = [word for target in program.targets for word in (*target.numbers, *target.words.values())]
    for changes in ([], [(word, word.text) for word in words]):
        written = program.rewritten(changes)
        assert {d.name: d.text.encode("latin-1") for d in written} == programs[language]


@pytest.mark.parametrize("language", LANGUAGES)
def test_only_the_numbers_of_targets_change(programs, language) -> None:
    program = read_program(programs[language])
    numbers = [number for target in program.targets for number in target.numbers]
    written = program.rewritten([(number, "<>") for number in numbers])
    for place, (before, after) in enumerate(zip(program.documents, written, strict=True)):
        pieces = after.text.split("<>")
        here = sorted((n for n in numbers if n.document == place), key=lambda n: n.start)
        assert len(pieces) == len(here) + 1
        assert "".join(a + b for a, b in zip(pieces, [*(n.text for n in here), ""], strict=True)) == before.text


def test_rapid(programs) -> None:
    program = read_program(programs["RAPID"])
    assert [t.name for t in program.targets] == [
        *("jHome", "pApproach", "p10", "pBead{1}", "pBead{2}", "the target of line 26", "the target of line 30")
    ]
    assert moves(program) == [
        ("jHome", "tool0", "wobj0"),
        ("pApproach", "tGun", "wDoor"),
        ("p10", "tGun", "wDoor"),
        ("p10", "tGun", "wDoor"),
        ("pBead{1}", "tGun", "wDoor"),
        ("pBead{2}", "tGun", "wDoor"),
        ("the target of line 26", "tGun", "wDoor"),
        ("the target of line 30", "tool0", "wobj0"),
    ]
    assert program.moves[2].offset == (0.0, 0.0, 0.025)
    np.testing.assert_allclose(program.targets[0].values, np.radians([0, 10, -15, 0, 55, 0]))
    np.testing.assert_allclose(program.targets[1].values[:3], [0.12025, 0.04, 0.15], rtol=1e-15)
    gun = program.tools["tgun"]
    np.testing.assert_allclose(gun[:3, 3], [0.031792, -0.0125, 0.229639])
    turn = Rotation.from_quat([0.945518576, 0, 0.325568154, 0], scalar_first=True)
    np.testing.assert_allclose(gun[:3, :3], turn.as_matrix(), atol=1e-9)
    # uframe times oframe: 12.5 mm up in a frame that is turned about z.
    np.testing.assert_allclose(program.frames["wdoor"][:3, 3], [1.85, -0.25, 0.7325])
    assert list(map(program.said, program.left)) == [
        "glue.mod:29: MoveL is left as it is: RelTool(pFound,0,0,-100) is no target of plain numbers here"
    ]


def test_krl(programs) -> None:
    program = read_program(programs["KRL"])
    assert moves(program) == [
        ("the target of line 21", "of FHOME", "of FHOME"),
        ("XP1", "1", "2"),
        ("XP2", "1", "2"),
        ("XP3", "1", "2"),
        ("the target of line 35", "1", "2"),
        ("the target of line 40", "$TOOL of line 38", "0"),
    ]
    assert "FCORNER" not in [target.name for target in program.targets]  # a frame that no move goes to
    turn = Rotation.from_euler("ZYX", [178.5, 0.5, 179.0], degrees=True)
    xp1 = next(target for target in program.targets if target.name == "XP1")
    np.testing.assert_allclose(program.language.pose(xp1.values)[:3, :3], turn.as_matrix(), atol=1e-12)
    assert {name: word.text for name, word in xp1.words.items()} == {"S": "2", "T": "35"}
    np.testing.assert_allclose(program.tools["1"][:3, 3], [0.0125, -0.00325, 0.31275])
    assert [(left.line, left.what) for left in program.left] == [
        *((19, "PTP XHOME"), (36, "LIN_REL {Z 25.0}"), (37, "LIN XP7"))
    ]


def test_fanuc(programs) -> None:
    program = read_program(programs["FANUC LS"])
    assert [(t.name, t.kind, t.frame, t.tool) for t in program.targets] == [
        ("P[1]", "joints", "0", "1"),
        *((f"P[{i}]", "pose", "1", "1") for i in (2, 3, 4, 5)),
    ]
    assert [program.targets[m.target].name for m in program.moves] == ["P[1]", "P[2]", "P[3]", "P[4]", "P[5]", "P[3]"]
    turn = Rotation.from_euler("xyz", [179.0, 0.5, 178.5], degrees=True)
    np.testing.assert_allclose(program.language.pose(program.targets[1].values)[:3, :3], turn.as_matrix(), atol=1e-12)
    assert [program.said(left) for left in program.left] == [
        "PICK.LS:74: P[7] is left as it is: it was never taught",
        "PICK.LS:31: J PR[1] is left as it is: a register has it at run time",
        "PICK.LS:68: P[6] is left as it is: the move goes on by it as an increment in 'L P[6] 100mm/sec FINE INC'",
    ]


def test_urscript(programs) -> None:
    program = read_program(programs["URScript"])
    assert [t.name for t in program.targets] == [
        "home",
        "above",
        *(f"the target of line {i}" for i in (13, 14, 14, 15, 16, 19)),
    ]
    np.testing.assert_allclose(program.targets[0].values[:4], [0, np.radians(-95), np.radians(110), -1.8325957])
    turn = Rotation.from_rotvec([0.02, 3.12, 0])
    np.testing.assert_allclose(program.language.pose(program.targets[3].values)[:3, :3], turn.as_matrix(), atol=1e-12)
    assert {move.frame for move in program.moves} == {"base", "the product of line 16"}
    assert program.moves[7].offset == (0.0, 0.0, 0.05)  # pose_add
    assert program.moves[5].near == tuple(program.targets[0].values)


@pytest.mark.parametrize("language", LANGUAGES)
def test_poses_go_to_the_base_and_back(programs, language) -> None:
    program = read_program(programs[language])
    rng = np.random.default_rng(4)

    def some_frame() -> np.ndarray:
        T = np.eye(4)
        T[:3, :3] = Rotation.random(rng=rng).as_matrix()
        T[:3, 3] = rng.normal(size=3)
        return T

    frames = Frames(program, Cell(some_frame(), some_frame()), some_frame())
    for place, target in enumerate(program.targets):
        if target.kind == "pose":
            T = program.language.pose(target.values)
            np.testing.assert_allclose(frames.from_base(place, frames.to_base(place, T)), T, atol=1e-12)
            written = program.language.values(T, target.values)
            np.testing.assert_allclose(program.language.pose(written), T, atol=1e-12)
            np.testing.assert_allclose(written, target.values, atol=2e-4)  # four digits of a quaternion
    assert {program.targets[i].name for i in frames.left} == (
        {f"P[{i}]" for i in (2, 3, 4, 5)} if language == "FANUC LS" else set()
    )


@pytest.mark.parametrize(
    ("language", "old", "new", "place", "sentence"),
    [
        ("FANUC LS", b"Y =    90.000", b"Y =    9o.000", "PICK.LS:59", "P[4], Y: expected a number, got '9o.000'"),
        (
            "FANUC LS",
            b"Z =    80.000  mm,\r\n\tW",
            b"W",
            "PICK.LS:41",
            "P[2]: expected X, Y, Z, W, P, R, but Z is not given",
        ),
        ("FANUC LS", b"-100.000  mm\r\n}", b"-100.000  mm\r\n", "PICK.LS:41", "expected a position P[n]"),
        ("FANUC LS", b"/POS\r\n", b"", "PICK.LS:1", "expected a section /POS"),
    ],
)
def test_one_bad_line_is_refused_with_its_number(programs, language, old, new, place, sentence) -> None:
    files = {name: content.replace(old, new, 1) for name, content in programs[language].items()}
    assert files != programs[language]
    with pytest.raises(ParseError) as caught:
        read_program(files)
    assert str(caught.value).startswith(f"{place}: ")
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("language", "old", "new", "sentence"),
    [
        ("RAPID", b"[120.25,40,150]", b"[120.25,4O,150]", "glue.mod:11: CONST robtarget pApproach:=[[120.25,4O,150],"),
        (
            "RAPID",
            b"[120.25,40,150]",
            b"[120.25,x,150]",
            "glue.mod:11: pApproach is left as it is: x is no plain number",
        ),
        ("RAPID", b"[120.25,40,150]", b"[120.25,40]", "glue.mod:11: pApproach is left as it is: expected [[x,y,z],"),
        (
            *("RAPID", b"[0.018504,-0.0097,0.99973", b"[0.018504,-0.0097,0.79973"),
            "glue.mod:11: pApproach is left as it is: expected a quaternion of length 1, got 0.8",
        ),
        (
            "RAPID",
            b"[[5,0,-10,0,60,-90]",
            b"[[5,0,-10,0,60]",
            "glue.mod:30: MoveAbsJ is left as it is: expected [[6 joints]",
        ),
        ("KRL", b"Y 40.2500000,Z 80", b"Y ?,Z 80", "weld.dat:11: DECL E6POS XP1={X 112.500000,Y ?,Z 80.0000000,A 178"),
        ("KRL", b"Y 40.2500000,Z 80", b"Y Y0,Z 80", "weld.dat:11: XP1 is left as it is: Y0 is no plain number"),
        (
            *("KRL", b"{X 1780.0,Y -210.0,", b"{X 1780.0,"),
            "weld.src:40: SLIN {X 1780.0,Z 980.0,A 180.0,B 0.0,C 180.0,S 2,T 35} is left as it is: it names only X, Z",
        ),
        ("KRL", b"S 2,T 35} WITH", b"S two,T 35} WITH", "C 180.0,S two,T 35} is left as it is: expected a number as S"),
        ("URScript", b"0.324,", b"0.3.24,", "palletize.script:7: above = p[ -.452, -.1135, 0.3.24,"),
        (
            "URScript",
            b"0.324,",
            b"h,",
            "palletize.script:12: movel is left as it is: above is no target of plain numbers",
        ),
        (
            *("URScript", b"[0.1, -1.6, 1.9, -1.83, -1.57, 0.0]", b"[0.1, -1.6]"),
            "palletize.script:19: movej is left as it is: expected 6 numbers, got 2",
        ),
    ],
)
def test_one_target_that_is_not_understood_is_left_with_its_line(programs, language, old, new, sentence) -> None:
    files = {name: content.replace(old, new, 1) for name, content in programs[language].items()}
    assert files != programs[language]
    before, program = read_program(programs[language]), read_program(files)
    said = [program.said(left) for left in program.left]
    assert any(sentence in line for line in said), said
    assert len(before.targets) - 2 <= len(program.targets) < len(before.targets)


def test_a_tool_that_stands_still_is_doubted(programs) -> None:
    text = programs["RAPID"]["glue.mod"].replace(b"tGun:=[TRUE", b"tGun:=[FALSE")
    left = Frames(read_program({"glue.mod": text}), Cell(), np.eye(4)).left
    assert set(left.values()) == {"tGun is a stationary tool, which fastcal does not follow"}
    assert len(left) == 5


def test_a_target_of_two_tools_is_left(programs) -> None:
    text = programs["RAPID"]["glue.mod"].replace(b"MoveL p10,v100,fine,tGun", b"MoveL p10,v100,fine,tool0")
    left = Frames(read_program({"glue.mod": text}), Cell(), np.eye(4)).left
    assert left == {
        2: "it is used with more than one tool (tGun in line 22, tool0 in line 23), and its numbers can be right for "
        "one only"
    }


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_damage_is_met_with_anything_but_one_sentence(programs, language) -> None:
    """Cut, doubled and overwritten programs are read or refused; what is read is written back byte for byte."""
    random = np.random.default_rng(7)
    rubble = b"[](){},;:=\"'.-+e019 \n\tpP#!%\\\xff"
    read, refused = 0, []
    for _ in range(300):
        files = dict(programs[language])
        name = str(random.choice(list(files)))
        text = bytearray(files[name])
        start = int(random.integers(len(text)))
        stop = start + int(random.choice([1, 3, 40]))
        piece = bytes(random.choice(list(rubble), int(random.integers(1, 4))).tolist())
        text[start:stop] = (b"", piece, bytes(text[start:stop]) * 2)[int(random.integers(3))]
        files[name] = bytes(text)
        try:
            program = read_program(files)
            Frames(program, Cell(), np.eye(4))
        except InvalidInput as error:
            refused.append(str(error))
            continue
        words = [(word, word.text) for t in program.targets for word in (*t.numbers, *t.words.values())]
        assert {d.name: d.text.encode("latin-1") for d in program.rewritten(words)} == files
        assert all(np.isfinite(target.values).all() for target in program.targets)
        read += 1
    assert read > 20
    assert language != "FANUC LS" or len(refused) > 20
    assert not any("\n" in sentence for sentence in refused)
