# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which columns of numbers are labels: names, serial numbers and counters say which row it is, not what acted on it.

An error that seems to follow a label follows the order of the rows or the pose. A label is never a cause.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.units import parse_name


def title_words(title: str) -> set[str]:
    """The words of a title in small letters without accents and numbers."""
    bare = "".join(c for c in unicodedata.normalize("NFKD", title).casefold() if unicodedata.category(c) != "Mn")
    return set(re.findall(r"[^\W\d_]+", unicodedata.normalize("NFC", bare)))


# Titles of columns that name or count rows, in small letters without accents: English, German, French, Spanish,
# Italian, Portuguese, Czech, Polish, Russian, Chinese, Japanese, Korean.
LABEL_WORDS = frozenset(
    title_words(
        """
    name names id ids uid nr no num number numbers index idx count counter serial sn label tag point points pt pts pkt
    p pose position pos order row rows line record sample seq sequence item object target marker feature
    punkt punktname messpunkt messpunktname messpunktnummer punktnummer objekt bezeichnung lfd nummer nummern zeile
    reihe kennung seriennummer satz stelle bezeichner stellung
    nom numero repere cible etiquette serie ligne objet identifiant designation
    nombre etiqueta punto puntos fila objetivo objeto identificador
    punti etichetta riga oggetto nome
    ponto pontos linha etiqueta alvo objeto
    nazev cislo bod poradi mereni objekt
    nazwa numer punkt punktu obiekt etykieta wiersz lp
    имя номер точка точки метка объект строка название обозначение п
    名称 编号 序号 点号 点名 点 名字 目标 标签 测点 行号 编码 名稱 編號 序號 點號 點名 點 測點
    名前 番号 点名 測定点 点番号 ポイント 識別子 ラベル 対象
    이름 번호 점 측정점 점번호 라벨 대상 순번
    """
    )
)
_MOST_GAPS = 0.2  # of the numbers between the least and the largest that a counter may lack
_FEWEST = 3  # different numbers of a counter: two are a state


def sensors(columns: Mapping[str, FloatArray], q: FloatArray) -> dict[str, FloatArray]:
    """The columns that an error may depend on: those that no label is.

    Args:
        columns: By name, (N,) each.
        q: (N, n) commanded joint positions.
    """
    return {name: values for name, values in columns.items() if not is_label(name, values, q)}


def is_label(name: str, values: FloatArray, q: FloatArray) -> bool:
    """Whether a column of numbers says which row, or which posture, it is.

    Whole numbers without a unit are a label where the title says so, where each row, or each posture q (N, n), has its
    own, or where they count up. Real numbers are what a sensor read, whatever their title, but for "name".

    Args:
        name: The title.
        values: (N,), NaN where empty.
        q: (N, n) commanded joint positions.
    """
    words = title_words(name)
    if words == {"name"}:
        return True
    known = values[np.isfinite(values)]
    if len(known) == 0 or parse_name(name)[1] is not None or not (known == np.round(known)).all():
        return False
    return (bool(words) and words <= LABEL_WORDS) or tells_rows_apart(known, q[np.isfinite(values)])


def tells_rows_apart(numbers: FloatArray, q: FloatArray) -> bool:
    """Whether whole numbers (N,) are unique a row or a posture q (N, n), or count up."""
    different, code = np.unique(numbers, return_inverse=True)
    if len(different) < _FEWEST:
        return False
    gaps = 1 - len(different) / (different[-1] - different[0] + 1)
    if len(different) == len(numbers) or ((np.diff(numbers) >= 0).all() and gaps <= _MOST_GAPS):
        return True
    _, posture = np.unique(q, axis=0, return_inverse=True)
    pairs = {*zip(code.ravel().tolist(), posture.ravel().tolist(), strict=True)}
    return len(pairs) == len(different) == int(posture.max()) + 1
