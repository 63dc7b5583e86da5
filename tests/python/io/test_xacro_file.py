# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""xacro in: expressions mean what Python means by them, and nothing in a robot file runs code or goes on for ever."""

import math
from pathlib import Path

import pytest

from fastcal.errors import ParseError
from fastcal.io import xacro_macros
from fastcal.io.robot_file import load_robot, read_spec
from fastcal.io.xacro_expressions import NotAllowedError, evaluate
from fastcal.io.xacro_file import expanded

NAMES = {"length": 0.25, "prefix": "left_", "sides": ["left", "right"], "on": True}
NAMES |= {"masses": {"upper": 2.5, "lower": 1.5}}


@pytest.mark.parametrize(
    "expression",
    [
        "-length / 2 + 3 * 0.1",
        "pi/2",
        "radians(90) + sin(pi / 6)",
        "2**10 % 7 // 2",
        "prefix + 'joint_' + str(3)",
        "'%s_%d' % (prefix, 7)",
        "length > 0.2 and not (prefix == '')",
        "0 < length < 1",
        "'a' if on else 'b'",
        "sides[0] + sides[-1]",
        "sides[::-1]",
        "masses['upper'] + sum(masses.values())",
        "[m * 2 for m in masses.values() if m > 2]",
        "{k: v for k, v in masses.items()}",
        "{x + y for x in [1, 2] for y in [10, 20]}",
        "max(map(float, ['1', '2.5'])) + min(1, 2)",
        "prefix.upper().replace('_', '-').split('-')[0]",
        "'left' in sides",
        "'-'.join([s[0] for s in sides])",
        "len(sides) * [length]",
        "dict(a=1)['a'] + max(*[1, 2])",
        "isinstance(length, float) or undefined",
        "1 if sides is None else round(pi, 3)",
        "~5 & 12 | 1 ^ 2 << 3 >> 1",
    ],
)
def test_an_expression_is_what_python_makes_of_it(expression: str) -> None:
    expected = eval(expression, {**vars(math), **NAMES})  # noqa: S307 - written above
    assert evaluate(expression, NAMES) == expected


@pytest.mark.parametrize(
    "expression",
    [
        "().__class__",
        "(lambda: 1)()",
        "[c for c in ().__class__.__base__.__subclasses__()]",
        "'{0.__class__}'.format(1)",
        "f'{length.__class__}'",
        "__import__('os').system('true')",
        "prefix.format_map(masses)",
        "(1).real",
        "sides.append(1)",
        "masses.__init__",
        "masses.pop('upper')",
        "(x := 1)",
        "globals()",
        "vars()",
        "type(length)",
        "open('/etc/passwd')",
        "eval('1')",
        "{**masses}",
        "dict(**masses)",
        "sides.__getattribute__('x')",
        "[].sort.__self__",
        "(_ for _ in [1]).gi_frame",
        "str.mro()",
        "math.__loader__",
        "float.fromhex('1')",
        "sides @ sides",
        "await length",
        "[x.y for x in sides]",
    ],
)
def test_nothing_else_is_known(expression: str) -> None:
    """Each is valid Python that reaches an attribute, a function or syntax beyond what robots need."""
    with pytest.raises((NotAllowedError, NameError, SyntaxError)):
        evaluate(expression, NAMES | {"math": vars(math)})


def test_a_name_that_hides_a_function_of_the_library_gets_no_other_function() -> None:
    with pytest.raises(NotAllowedError, match="function tool"):
        evaluate("tool(1)", {"tool": print})


HEAD = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="a">'
ARM = """<xacro:arg name="reach" default="1"/><xacro:property name="reach" value="$(arg reach)"/>
<xacro:macro name="joint" params="name parent child x"><joint name="${name}" type="revolute"><parent link="${parent}"/>
<child link="${child}"/><axis xyz="0 0 1"/><origin xyz="${x} 0 0"/>
<limit lower="${-pi}" upper="${radians(180)}" effort="1" velocity="1"/></joint><link name="${child}"/></xacro:macro>
<link name="base"/>
<xacro:joint name="j1" parent="base" child="l1" x="${float(reach) * 0.5}"/>
<xacro:joint name="j2" parent="l1" child="l2" x="$(eval 2 * reach)"/>
<xacro:joint name="j3" parent="l2" child="l3" x="${xacro.load_yaml('sizes.yaml').upper.length}"/></robot>"""


def test_macros_arguments_and_yaml_come_out_as_numbers(tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text(HEAD + ARM)
    (tmp_path / "sizes.yaml").write_text("upper: {length: !millimeters 425}")
    robot = load_robot(tmp_path / "arm.xacro", xacro={"reach": "3"})
    assert robot.forward([[0.0, 0.0, 0.0]])[0, 0, 3] == pytest.approx(1.5 + 6 + 0.425, abs=1e-12)
    assert robot.limits[0].tolist() == [-math.pi, math.pi]


CODE = "__import__('pathlib').Path('pwned').touch()"
NESTED = "(lambda: [c for c in ().__class__.__base__.__subclasses__()][0])()"


@pytest.mark.parametrize(
    "inside",
    [
        f'<xacro:property name="p" value="${{{NESTED}}}"/><link name="${{p}}"/>',
        f'<xacro:if value="${{{CODE} or True}}"><link name="x"/></xacro:if>',
        '<link name="$(eval [].append)"/>',
        '<xacro:property name="p" value="${open}"/><link name="${p}"/>',
        '<link name="${xacro.load_yaml.__globals__}"/>',
        '<link name="${python.vars()}"/>',
    ],
)
def test_no_code_runs_from_a_robot_file(inside: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # A module of the working directory is not imported either.
    (tmp_path / "xacro.py").write_text("open('pwned', 'w')")
    (tmp_path / "json.py").write_text("open('pwned', 'w')")
    (tmp_path / "arm.xacro").write_text(f"{HEAD}{inside}</robot>")
    with pytest.raises(ParseError, match="xacro can't expand it"):
        expanded("arm.xacro")
    assert not (tmp_path / "pwned").exists()


def test_yaml_beside_the_file_makes_no_objects(tmp_path: Path) -> None:
    (tmp_path / "sizes.yaml").write_text("upper: !!python/object/apply:os.system ['true']")
    (tmp_path / "arm.xacro").write_text(HEAD + ARM)
    with pytest.raises(ParseError, match="could not determine a constructor"):
        expanded(tmp_path / "arm.xacro")


def macros_of_macros(depth: int) -> str:
    lines = ['<xacro:macro name="m0" params=""><link name="x"/></xacro:macro>']
    macros = [f'<xacro:macro name="m{k}" params="">{f"<xacro:m{k - 1}/>" * 10}</xacro:macro>' for k in range(1, depth)]
    return "".join([*lines, *macros, f"<xacro:m{depth - 1}/>"])


@pytest.mark.parametrize(
    ("inside", "sentence"),
    [
        (macros_of_macros(30), f"more than {xacro_macros.MACROS} times"),
        ('<link name="${9**9**9}"/>', "power is too large"),
        ('<link name="${len(list(range(10**12)))}"/>', "more than 10 s"),
        ("<link name=\"${'x' * 10**11}\"/>", "more than 10 s"),
        ('<xacro:macro name="m" params=""><xacro:m/></xacro:macro><xacro:m/>', "xacro can't expand it"),
        ('<xacro:include filename="arm.xacro"/>', "xacro can't expand it"),
    ],
)
def test_what_does_not_end_is_ended(inside: str, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text(f"{HEAD}{inside}</robot>")
    with pytest.raises(ParseError, match=sentence):
        expanded(tmp_path / "arm.xacro")


def test_a_robot_file_opens_a_xacro_only_for_who_asked_for_it(tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text(HEAD + ARM.replace("${xacro.load_yaml('sizes.yaml').upper.length}", "0"))
    (tmp_path / "robot.yaml").write_text("kinematics: urdf\nurdf: arm.xacro\n")
    with pytest.raises(ParseError, match=r"a xacro, which is a program: .* add --xacro yes"):
        read_spec(tmp_path / "robot.yaml")
    assert len(read_spec(tmp_path / "robot.yaml", xacro={})["joints"]) == 3
