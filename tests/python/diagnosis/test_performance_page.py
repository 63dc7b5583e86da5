# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of the diagnosis' performance is what its committed record says."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

TOP = Path(__file__).parents[3]
RECORD = TOP / "bench" / "python" / "bench_diagnosis.json"


def test_the_page_is_rendered_from_the_record() -> None:
    command = [sys.executable, str(TOP / "bench" / "python" / "bench_diagnosis.py"), "--render", str(RECORD)]
    page = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert page == (TOP / "docs" / "diagnosis-performance.md").read_text(encoding="utf-8")


def test_a_model_is_judged_on_many_poses_in_the_conditions_of_a_usual_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of sixty held-out poses chance makes some model seem 2 % worse; a clock ten times as long would ask for more."""
    monkeypatch.syspath_prepend(str(TOP / "bench" / "python"))
    from diagnosis_arms import setting

    at = setting(np.random.default_rng(1), "ur10e", 120)
    assert (at.count, len(at.poses)) == (120, 1120)
    time = at.poses.time
    assert time is not None
    assert time[-1] - time[119] == pytest.approx(0.5 * (time[119] - time[0]), rel=0.1)


def test_a_run_that_was_cut_goes_on_where_its_record_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TOP / "bench" / "python"))
    import bench_diagnosis

    entries = json.loads(RECORD.read_text(encoding="utf-8"))[:4]
    out = tmp_path / "record.json"
    out.write_text(json.dumps([entries[2], entries[0]]), encoding="utf-8")
    made: list[int] = []

    def tried(number: int, seed: int, only: str | None) -> bench_diagnosis.Record | str:
        made.append(number)
        return "set 3: an error" if number == 3 else bench_diagnosis.Record(**entries[number])

    monkeypatch.setattr(bench_diagnosis, "tried", tried)
    monkeypatch.setattr(sys, "argv", ["bench_diagnosis.py", "--sets", "4", "--out", str(out), "--go-on"])
    bench_diagnosis.main()
    assert made == [1, 3]  # an error is no record: its set is tried again
    assert json.loads(out.read_text(encoding="utf-8")) == entries[:3]
