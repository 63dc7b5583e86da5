# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page as a text: well formed, escaped, self-contained, small; every figure valid for Plotly."""

from __future__ import annotations

import base64
import dataclasses
import gzip
import importlib.resources
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest

from fastcal.calibration.acceptance_limit import LimitJudged
from fastcal.calibration.calibrate import CalibrationResult
from fastcal.measurements.kinds import KindNoise, kind_named
from fastcal.report import calibration_page, write_report
from fastcal.report.calibration_report import gap_figures
from fastcal.report.calibration_tables import parameter_table
from fastcal.report.page import opening, prose, to_script_json


def test_a_verdict_opens_with_its_first_sentence() -> None:
    """The rest stands below it, smaller; numbers, abbreviations and file names end no sentence."""
    assert opening("Joint 2 gives by 0.5 mm. With it 0.1 mm remain.") == (
        "Joint 2 gives by 0.5 mm.",
        "With it 0.1 mm remain.",
    )
    assert opening("z. B. Gelenk 2 (Umkehrspiel). Mehr nicht.") == ("z. B. Gelenk 2 (Umkehrspiel).", "Mehr nicht.")
    assert opening("Take model.yaml Or not.") == ("Take model.yaml Or not.", "")
    assert opening("One. Two. Three.") == ("One.", "Two. Three.")


def test_a_command_in_a_sentence_is_code_and_nothing_else_is() -> None:
    assert prose("`fastcal diagnose` looks for <it>") == "<code>fastcal diagnose</code> looks for &lt;it&gt;"
    assert prose("a ` alone & `<b>`") == "a <code> alone &amp; </code>&lt;b&gt;`"


def test_a_line_does_not_end_behind_the_hyphen_of_an_option() -> None:
    told = prose("fastcal drop model.yaml a@joint2 -o without.yaml --seed 1, two-sided - or -3 mm")
    assert re.findall(r'<span class="option">(.*?)</span>', told) == ["-o", "--seed"]


MakeResult = Callable[..., CalibrationResult]
VOID = {"meta", "link", "br", "hr", "img", "input"}
HOSTILE = "</script><img src=x onerror=alert(1)>&\"'`{{7*7}}"
CASES: dict[str, dict[str, Any]] = {
    "full": {},
    "twenty rows, no test, no conditions": {"rows": 20, "test_rows": 0, "conditions": False, "outlier_count": 0},
    "missing coordinates": {"missing": 0.3},
    "lengths only": {"lengths": True},
    "100,000 rows": {"rows": 100_000, "test_rows": 20_000, "outlier_count": 700},
    "no noise": {"noise": {"position": KindNoise(kind_named("position"), 0.0, "residual")}},
    "nothing told": {"parameters": [], "correlated": [], "rank": 0, "status": "too_few_equations"},
}


class Checker(HTMLParser):
    """Collects ids, attributes and texts, and checks that every element is closed where it should be."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.figures: list[dict[str, Any]] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = dict(attrs)
        self.tags.append((tag, known))
        self.ids += [str(known["id"])] if "id" in known else []
        self.links += [str(known[name]) for name in ("href", "src") if name in known]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag, f"</{tag}> closes something else"

    def handle_data(self, data: str) -> None:
        if self.open[-1:] == ["script"] and self.tags[-1][1].get("type") == "application/json":
            self.figures.append(json.loads(data))
        elif self.open[-1:] not in (["script"], ["style"]):
            self.text.append(data)


def check(page: str) -> Checker:
    checker = Checker()
    checker.feed(page)
    checker.close()
    assert checker.open == []
    assert len(set(checker.ids)) == len(checker.ids)
    return checker


def decoded(value: Any) -> Any:
    """Plotly's typed arrays back as arrays."""
    if isinstance(value, dict):
        if "bdata" in value:
            return np.frombuffer(base64.b64decode(value["bdata"]), value["dtype"])
        return {key: decoded(part) for key, part in value.items()}
    return [decoded(part) for part in value] if isinstance(value, list) else value


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest, make_result: MakeResult) -> tuple[str, str]:
    return request.param, calibration_page(make_result(**CASES[request.param]))


def test_well_formed_and_under_8_mb(case: tuple[str, str]) -> None:
    name, page = case
    checker = check(page)
    assert page.startswith('<!DOCTYPE html>\n<html lang="en">')
    assert len(page.encode()) < 8e6
    assert set(checker.links) <= {f"#{name}" for name in checker.ids} | {"data:,"}, name
    assert not re.search(r"\bnan\b|\bNone\b|\binf\b", " ".join(checker.text))


def test_every_figure_is_valid_and_has_an_alternative_and_units(case: tuple[str, str]) -> None:
    checker = check(case[1])
    plots = [attributes for _, attributes in checker.tags if attributes.get("class") == "plot"]
    assert len(plots) == len(checker.figures) > 0
    assert all(len(str(attributes["aria-label"])) > 30 for attributes in plots)
    for figure in checker.figures:
        go.Figure(decoded(figure))
        layout = figure["layout"]
        axes = [layout["scene"][f"{k}axis"] for k in "xyz"] if "scene" in layout else [layout["xaxis"], layout["yaxis"]]
        for axis in axes:
            # Names say themselves what they are, and stand in the drawing where the axis has none.
            if axis.get("type") == "category" or axis.get("showticklabels") is False:
                continue
            assert re.search(r"\(.+\)", axis["title"]["text"]), axis["title"]


def test_no_address_of_the_network_is_in_the_page_and_none_is_allowed(case: tuple[str, str]) -> None:
    page = case[1]
    assert "http://" not in page
    assert "https://" not in page
    assert "default-src 'none'" in page


def test_parts_of_the_page(make_result: MakeResult) -> None:
    ids = check(calibration_page(make_result())).ids
    for part in ("accuracy", "workspace", "remaining", "parameters", "unidentifiable", "noise", "method"):
        assert part in ids
    drawn = {name.removeprefix("figure-") for name in ids if name.startswith("figure-")}
    flat = {f"flat-{view}-{state}" for view in ("top", "front", "side") for state in ("before", "after")}
    panels = {f"trend-{name}" for name in ("q1", "q2", "q3", "q4", "q5", "q6", "order", "temperature")}
    assert drawn == {"gap", "cumulative", "histogram", "workspace", "sizes", "normal"} | flat | panels


@pytest.mark.parametrize(
    ("said", "tone", "word"), [("pass", "caution", "With remarks"), ("fail", "bad", "Limit not met")]
)
def test_a_limit_that_is_missed_is_the_verdict(make_result: MakeResult, said: Any, tone: str, word: str) -> None:
    limit = LimitJudged(limit=1e-4, poses=300, beyond=40, on_test=True, confidence=0.1, verdict=said)
    page = calibration_page(make_result(rows=60), limit=limit)
    assert f'<section class="verdict {tone}"' in page
    assert f'<span class="tone">{word}</span>' in page


def test_the_gap_is_that_of_the_headline_where_rows_are_outliers(make_result: MakeResult) -> None:
    """Both of the rows that are no outliers; the page drew a gap of metres below a sentence of millimetres."""
    result = make_result(test_rows=0, outlier_count=9)
    kept = np.setdiff1d(np.arange(700), result.outliers)
    error = np.linalg.norm(result.train.error_after[kept], axis=1)
    (drawn,) = gap_figures(result)
    assert drawn.traces[0]["x"][-1] == pytest.approx(1e3 * np.sqrt(np.nanmean(error**2)))
    assert drawn.title == "RMS error on the fitted poses without outliers"


def test_where_nothing_is_identified_no_table_is_drawn(make_result: MakeResult) -> None:
    page = calibration_page(make_result(rows=60, parameters=[], status="too_few_equations", unidentifiable=[]))
    assert "No parameter could be identified." in page
    assert "requested parameters is identified." in page
    assert 'id="parameter-table"' not in page


def test_the_panel_with_the_planted_trend_is_first(make_result: MakeResult) -> None:
    ids = check(calibration_page(make_result(conditions=False))).ids
    panels = [name for name in ids if name.startswith("figure-trend-")]
    assert panels[0] == "figure-trend-q4"


def test_lengths_are_drawn_without_arrows(make_result: MakeResult) -> None:
    checker = check(calibration_page(make_result(lengths=True)))
    assert not {"figure-workspace", "workspace"} & set(checker.ids)
    assert "#workspace" not in checker.links
    assert "figure-trend-q1" in checker.ids


def test_simulated_data_are_marked(make_result: MakeResult) -> None:
    result = make_result(rows=30, test_rows=0)
    assert "Simulated data." in check(calibration_page(result, simulated=True)).text
    assert "Simulated data." not in check(calibration_page(result)).text


def test_hostile_names_are_only_text(make_result: MakeResult) -> None:
    result = make_result(
        rows=30,
        name=HOSTILE,
        message=HOSTILE,
        noise={"position": KindNoise(kind_named("position"), 1e-5, "residual", HOSTILE)},
        notes=[HOSTILE],
        correlated=[(HOSTILE, HOSTILE, 0.99)],
    )
    data = dataclasses.replace(result.train.data, source=f"folder/{HOSTILE}.csv")
    first = dataclasses.replace(result.parameters[0], name=f"{HOSTILE}_mm", owner=HOSTILE)
    result = dataclasses.replace(
        result, train=dataclasses.replace(result.train, data=data), parameters=[first, *result.parameters[1:]]
    )
    clean = check(calibration_page(make_result(rows=30, correlated=[("a", "b", 0.99)])))
    hostile = check(calibration_page(result))
    assert {tag for tag, _ in hostile.tags} == {tag for tag, _ in clean.tags}
    assert not any(name.startswith("on") for _, attributes in hostile.tags for name in attributes)
    assert HOSTILE in "".join(hostile.text)


def test_json_in_a_script_cannot_close_it() -> None:
    text = str(
        to_script_json({"a": "</script><!--", "b": np.arange(3), "c": np.array([[1.5, np.nan]]), "d": np.int64(4)})
    )
    assert "<" not in text
    value = json.loads(text)
    assert value["a"] == "</script><!--"
    assert np.frombuffer(base64.b64decode(value["b"]["bdata"]), "<i4").tolist() == [0, 1, 2]
    assert value["c"]["shape"] == "1,2"
    assert value["d"] == 4
    with pytest.raises(TypeError, match="a figure holds set"):
        to_script_json({"a": {1}})
    with pytest.raises(ValueError, match="not JSON compliant"):
        to_script_json(float("nan"))


def test_the_library_is_carried_whole(make_result: MakeResult) -> None:
    """As it is packed; that it has all that the figures need, the browser tests see."""
    page = calibration_page(make_result(rows=20))
    found = re.search(r'id="plotly-gzip">([^<]*)<', page)
    assert found is not None
    packed = importlib.resources.files("fastcal.report") / "plotly" / "plotly.min.js.gz"
    assert base64.b64decode(found[1]) == packed.read_bytes()
    assert gzip.decompress(packed.read_bytes()).startswith(b'"use strict";var Plotly=')
    assert len(found[1]) < 800_000
    assert len(page) < 1_500_000


def test_the_same_result_gives_the_same_file_or_none(make_result: MakeResult, tmp_path: Path) -> None:
    result = make_result(rows=30)
    write_report(result, tmp_path / "a.html")
    write_report(result, tmp_path / "b.html")
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()
    with pytest.raises(AttributeError):
        write_report(dataclasses.replace(result, parameters=[object()]), tmp_path / "c.html")  # type: ignore[list-item]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.html", "b.html"]


def test_what_every_fit_places_has_no_change_in_standard_deviations(make_result: MakeResult) -> None:
    """The robot file expects nothing of where base and tool are; of an effect of the base it expects none."""
    parameters = make_result().parameters
    drift = dataclasses.replace(parameters[-1], name="rate_x_mm_s", owner="base")
    plane = dataclasses.replace(parameters[-1], name="offset_mm", owner="plane A")
    ratios = {
        (parameter.owner, parameter.name): row[-1].text
        for parameter in [*parameters, drift, plane]
        for row in parameter_table([parameter]).groups[0].rows
    }
    for (owner, name), ratio in ratios.items():
        assert (ratio == "") == (owner in ("base", "tool", "plane A") and name != "rate_x_mm_s"), (owner, name)
