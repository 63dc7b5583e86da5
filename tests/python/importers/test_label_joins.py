# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lists of unlike order are joined by their labels, whatever these are called, or not without a word."""

import random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fastcal import load_robot
from fastcal.errors import InvalidInput
from fastcal.importers.label_columns import LabelColumn, best_match
from fastcal.importers.names import counts_rows, pairs_by_name

from .conftest import P, Q, Session, check, import_measurements

HEADERS = {
    "English": ["Name", "Point", "Pt", "Item", "Object", "Target", "Id", "Label", "Tag", "No.", "#", "Pose", "Feature"],
    "German": ["Punktname", "Objekt", "Messpunkt", "Bezeichnung", "Lfd. Nr.", "Kennung", "Nummer", "Ziel", "Stellung"],
    "French": ["Nom", "Repère", "Cible", "N° de point", "Étiquette", "Désignation"],
    "Spanish": ["Nombre", "Punto", "Etiqueta", "Número", "Identificador", "Objetivo"],
    "Italian": ["Nome", "Punto misurato", "Etichetta", "Numero", "Bersaglio"],
    "Czech": ["Název", "Bod", "Číslo bodu", "Označení", "Pořadí"],
    "Russian": ["Имя", "Точка", "Номер", "Номер точки", "Обозначение", "Метка"],
    "Chinese": ["名称", "编号", "点号", "点名", "序号", "标签", "目标点"],
    "Japanese": ["名前", "番号", "測定点", "ポイント", "点名", "ターゲット"],
    "Korean": ["이름", "번호", "측정점", "대상"],
    "made up": ["foo", "A", "T", "Station", "Ref", "Stamp", "Data", "X1b", "q", "Wert", "Position", "W"],
}
ALL = [header for headers in HEADERS.values() for header in headers]
LABELS = {
    "text": [f"P{k:03d}" for k in range(1, 31)],
    "words": [f"{a}{b}{c}" for a in "ABC" for b in "xyzuv" for c in "st"],
    "numbers": [str(7 * k % 31 + 100) for k in range(30)],
    "levels": [f"{k // 7 + 1}.{k % 7 + 1}" for k in range(30)],
    "counted": [str(k) for k in range(1, 31)],
}


def dice(seed: int) -> random.Random:
    return random.Random(seed)  # noqa: S311


def files(session: Session, heads: tuple[str, str], labels: list[str], order: list[int]):
    """The joints in the session's order, and the points in another; columns of their labels first."""
    joints = "\n".join([f"{heads[1]};J1;J2;J3;J4;J5;J6", *_rows(session, labels, range(30), Q)])
    points = "\n".join([f"{heads[0]};X [mm];Y [mm];Z [mm]", *_rows(session, labels, order, P)])
    return session.write("points.csv", points), session.write("joints.csv", joints)


def _rows(session: Session, labels: list[str], order, form: str) -> list[str]:
    return [f"{labels[k]};" + form.format(p=session.points[k], q=session.q[k]).replace(",", ";") for k in order]


@pytest.mark.parametrize("kind", LABELS)
def test_lists_are_joined_by_labels_of_any_title(session: Session, kind: str) -> None:
    """Sixty titles of eight languages and more, in both lists; no robot is there to help."""
    assert len(ALL) >= 60
    rng = dice(0)
    for head in ALL if kind == "text" else ALL[::5]:
        order = rng.sample(range(30), 30)
        points, joints = files(session, (head, head), LABELS[kind], order)
        found = import_measurements([points], joints=joints)
        check(found, session)
        (said,) = [note for note in found.notes if "joined with their poses by name" in note]
        assert f"('{head}')" in said
        assert found.names == LABELS[kind]


def test_the_two_lists_may_call_them_differently(session: Session) -> None:
    rng = dice(1)
    for _ in range(25):
        heads = (rng.choice(ALL), rng.choice(ALL))
        order = rng.sample(range(30), rng.choice([30, 26]))
        points, joints = files(session, heads, LABELS[rng.choice([*LABELS])], order)
        check(import_measurements([points], joints=joints), session, rows=sorted(order))


def test_other_columns_are_no_labels(session: Session) -> None:
    """Beside the label: a counter of each list's own, a reading, a remark and a column that is the same in all rows."""
    rng = dice(2)
    order = rng.sample(range(30), 30)
    joints = ["Index;Objekt;Speed;Remark;J1;J2;J3;J4;J5;J6"]
    joints += [
        f"{k + 1};{row.replace(';', ';100;ok;', 1)}"
        for k, row in enumerate(_rows(session, LABELS["text"], range(30), Q))
    ]
    points = ["No;Bezug;RMS;X [mm];Y [mm];Z [mm]"]
    points += [
        f"{k + 1};{row.replace(';', f';{rng.randint(1, 30)};', 1)}"
        for k, row in enumerate(_rows(session, LABELS["text"], order, P))
    ]
    found = import_measurements(
        [session.write("points.csv", "\n".join(points))], joints=session.write("joints.csv", "\n".join(joints))
    )
    check(found, session)
    assert any("by name ('Bezug' of the points, 'Objekt' of the poses)" in note for note in found.notes)
    assert any("joints.csv that are not known are left out: 'Speed', 'Remark'" in note for note in found.notes)
    assert any("points.csv that are not known are left out: 'RMS'" in note for note in found.notes)


def test_labels_that_do_not_agree_are_asked_about(session: Session) -> None:
    points, joints = files(session, ("Bezug", "Objekt"), LABELS["words"], list(range(30)))
    joints.write_text(
        joints.read_text()
        .replace("As", "one")
        .replace("\nA", "\none ")
        .replace("\nB", "\ntwo ")
        .replace("\nC", "\nsix ")
    )
    with pytest.raises(InvalidInput, match=r"'Bezug' may name the points, and 'Objekt' the poses .*--map, name: TITLE"):
        import_measurements([points], joints=joints)
    found = import_measurements([points], joints=joints, robot=load_robot("ur5"))
    check(found, session)
    assert any("no row has slipped" in note for note in found.notes)


def test_labels_of_one_list_alone_are_told(session: Session) -> None:
    points, _ = files(session, ("Bezug", "Objekt"), LABELS["words"], list(range(30)))
    joints = session.table("J1;J2;J3;J4;J5;J6", Q.replace(",", ";"), "bare.csv")
    found = import_measurements([points], joints=joints)
    check(found, session)
    assert any("'Bezug' of" in note and "may name the rows" in note for note in found.notes)


def test_two_labels_that_contradict_are_asked_about(session: Session) -> None:
    rng = dice(3)
    order = rng.sample(range(30), 30)
    other = rng.sample(LABELS["words"], 30)
    joints = ["Objekt;Bezug;J1;J2;J3;J4;J5;J6"]
    joints += [f"{LABELS['words'][k]}z;{row}" for k, row in enumerate(_rows(session, LABELS["words"], range(30), Q))]
    points = ["Objekt;Bezug;X [mm];Y [mm];Z [mm]"]
    points += [f"{other[k]}z;{row}" for k, row in enumerate(_rows(session, LABELS["words"], order, P))]
    exports = session.write("points.csv", "\n".join(points)), session.write("joints.csv", "\n".join(joints))
    with pytest.raises(InvalidInput, match=r"could each name the points.*--map, name: TITLE"):
        import_measurements([exports[0]], joints=exports[1])
    answer = session.write("map.yaml", "columns: {name: Bezug}")
    from fastcal.importers import read_map

    check(import_measurements([exports[0]], joints=exports[1], mapping=read_map(answer)), session)


def test_a_counter_beside_names_in_another_order_is_told(session: Session) -> None:
    """Whether 7 means the seventh row or the point P007 nobody can see."""
    rng = dice(4)
    order = rng.sample(range(30), 30)
    points, joints = files(session, ("Nr.", "Name"), LABELS["text"], order)
    rows = points.read_text().splitlines()
    points.write_text("\n".join([rows[0], *(f"{k};{row.split(';', 1)[1]}" for k, row in enumerate(rows[1:], start=1))]))
    joints.write_text("\n".join([joints.read_text().splitlines()[0], *_rows(session, LABELS["text"], order, Q)]))
    found = import_measurements([points], joints=joints)
    assert any("'Nr.' counts the rows" in note and "the join is wrong" in note for note in found.notes)


def written(name: str, rng: random.Random) -> str:
    """As another program would write the same label."""
    way = rng.randrange(5)
    if way == 1:
        return name.upper()
    if way == 2:
        return f" {name} "
    if way == 3:
        return name.replace("_", " ")
    return name.replace("_0", "_") if way == 4 else name


def test_names_that_differ_in_another_number_are_no_pair() -> None:
    """Where 1-1 had no partner it was paired with 2-1, which has the same last number."""
    poses = ["1-7", "1-8", "1-1", "1-6", "1-5", "1-4", "1-3", "1-9"]
    points = ["1-6", "1-2", "1-5", "1-3", "1-4", "1-7", "2-1", "1-9"]
    found = pairs_by_name(poses, points)
    assert found is not None
    assert sorted((poses[i], points[j]) for i, j in found.pairs) == [(n, n) for n in sorted({*poses} & {*points})]


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.randoms(use_true_random=False), st.integers(6, 40), st.sampled_from(["text", "parts", "number", "float"]))
def test_no_pair_of_shuffled_labels_is_wrong(rng: random.Random, count: int, kind: str) -> None:
    """Subsets of both lists in any order, some measured twice, written by two programs: every pair is right, and all
    that could be found are, where any join is made.
    """
    if kind == "text":
        names = [f"point_{k:02d}" for k in rng.sample(range(90), count)]
    elif kind == "parts":
        names = [f"{a}-{b}" for a in range(1, 10) for b in range(1, 10)][:count]
    else:
        names = [str(k) for k in rng.sample(range(1, 500), count)]
    poses = rng.sample(names, max(4, count - rng.randint(0, count // 4)))
    points = rng.sample(names, max(4, count - rng.randint(0, count // 4)))
    points += [points[0]] * rng.randint(0, 2)
    shown = {
        "text": lambda name: written(name, rng),
        "parts": lambda name: name,
        "number": lambda name: name.zfill(4) if kind == "number" and rng.random() < 0.5 else name,
        "float": lambda name: f"{name}.0",
    }[kind]
    once = {name: shown(name) for name in points}
    found = pairs_by_name(poses, [once[name] for name in points])
    possible = {(i, j) for i, pose in enumerate(poses) for j, point in enumerate(points) if pose == point}
    told = len(possible) >= 0.5 * min(len(poses), len(points)) and not (counts_rows(poses) or counts_rows(points))
    assert found is not None or not told
    if found is not None:
        assert set(found.pairs) == possible


@settings(max_examples=100, deadline=None)
@given(st.randoms(use_true_random=False), st.integers(2, 5), st.integers(2, 5))
def test_the_column_that_names_the_rows_wins_whatever_its_place(rng: random.Random, left: int, right: int) -> None:
    names = [f"{rng.choice('ABCDE')}{k}" for k in range(20)]
    order = rng.sample(range(20), 20)

    def column(title: str, kind: int) -> LabelColumn:
        if kind == 0:
            texts = [str(k) for k in range(1, 21)]  # a counter
        elif kind == 1:
            texts = [str(rng.randint(1000, 10**6)) for _ in range(20)]  # a reading in whole numbers
        else:
            texts = [f"{title}{rng.randint(0, 10**6)}x" for _ in range(20)]  # names of something else
        return LabelColumn(title, texts, rng.random() < 0.5)

    poses = [column(f"left{k}", rng.randrange(3)) for k in range(left)] + [LabelColumn("true", names, False)]
    points = [column(f"right{k}", rng.randrange(3)) for k in range(right)]
    points.append(LabelColumn("true", [names[k] for k in order], False))
    rng.shuffle(poses)
    rng.shuffle(points)
    match = best_match(poses, points, "points.csv")
    assert match is not None
    assert (match.poses.title, match.points.title) == ("true", "true")
    assert [order[j] for _, j in match.pairs] == list(range(20))


@pytest.mark.parametrize(
    ("poses", "points", "expected"),
    [
        (["1", "2", "3"], ["3.0", "1.0", "2.0"], [(0, 1), (1, 2), (2, 0)]),  # as a sheet writes them
        (["1", "10", "100"], ["10.0", "1.0", "100.0"], [(0, 1), (1, 0), (2, 2)]),
        (["P1-1", "P11", "P1-2"], ["P11", "P1-2", "P1-1"], [(0, 2), (1, 0), (2, 1)]),
        (["A1", "B1", "A2"], ["B 1", "A 2", "A 1"], [(0, 2), (1, 0), (2, 1)]),
        (["1.1", "1.2", "2.1"], ["2.1", "1.1", "1.2"], [(0, 1), (1, 2), (2, 0)]),
        (["1.1", "1.2", "2.1"], ["11", "12", "21"], None),
        (["A1", "B1", "A2"], ["1", "2", "7"], None),  # two poses have the number 1
        (["1", "2", "3", "4"], ["4", "2", "1"], [(0, 2), (1, 1), (3, 0)]),  # numbers out of order are names
        (["1", "2", "3", "4"], ["0", "3", "2", "1"], None),  # one counts from 0
        (["1", "2", "3", "4"], ["1", "2", "3"], None),  # a counter does not know what is missing
        (["ｐ１", "p2"], ["P2", "P1"], [(0, 1), (1, 0)]),  # of full width
        (["é1", "a2"], ["a2", "E\u03011"], [(0, 1), (1, 0)]),
    ],
)
def test_how_names_are_compared(poses: list[str], points: list[str], expected: list[tuple[int, int]] | None) -> None:
    found = pairs_by_name(poses, points)
    assert (None if found is None else found.pairs) == expected


def test_long_numbers_are_names(session: Session) -> None:
    """Of more digits than Python takes for a number."""
    labels = [f"{'1' * 4400}{k}" for k in range(30)]
    points, joints = files(session, ("Name", "Name"), labels, list(np.random.default_rng(0).permutation(30)))
    found = import_measurements([points], joints=joints, robot=load_robot("ur5"))
    check(found, session)
