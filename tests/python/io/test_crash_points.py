# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Killed before any file operation, a command leaves the old result or the new one, each whole.

The operations are counted once; then the command runs anew in a child for each of them and dies just before it.
"""

import os
import shutil
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import fastcal
from fastcal.acceptance import accept, plan_acceptance
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.cli import main
from fastcal.correction.applicability import Guard
from fastcal.correction.correction import Correction
from fastcal.correction.experts import Neighbours
from fastcal.correction.inputs import Scaling
from fastcal.correction.uncertainty import Uncertainty
from fastcal.io import atomic, folder
from fastcal.io.acceptance_plan import load_plan, write_test
from fastcal.monitoring.history import history
from fastcal.monitoring.update import update
from fastcal.report import acceptance_report, calibration_files, monitoring_files

OPERATIONS = {
    *("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate", "os.chmod"),
    *("shutil.rmtree", "shutil.move"),
}
Work = Callable[[], object]


def files(place: Path) -> dict[str, bytes]:
    """What a reader of the folder sees; temporary files are hidden."""
    return {
        str(path.relative_to(place)): path.read_bytes()
        for path in sorted(place.rglob("*"))
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(place).parts)
    }


def child(work: Work, place: Path, at_each: Work) -> int:
    """Runs `work` in a child that calls `at_each` before every operation in or beside `place`; its wait status."""
    pid = os.fork()
    if pid:
        return os.waitpid(pid, 0)[1]
    for module, name, call in ((os, "fsync", os.fsync), (folder, "exchange", folder.exchange)):
        setattr(module, name, lambda *given, call=call: (at_each(), call(*given))[1])

    def hook(event: str, given: tuple[object, ...]) -> None:
        names = [os.fsdecode(each) for each in given if isinstance(each, str | bytes | os.PathLike)]
        if event in OPERATIONS and any(name.startswith(str(place.parent)) for name in names):
            at_each()

    sys.addaudithook(hook)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(1, 2)
    code = 9
    try:
        work()
        code = 0
    finally:
        os._exit(code)


def count_operations(work: Work, place: Path) -> int:
    read, write = os.pipe()
    assert child(work, place, lambda: os.write(write, b".")) == 0
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        return len(pipe.read())


def killed_before(k: int, work: Work, place: Path) -> None:
    """Runs `work` in a child that dies before operation k, from 0."""
    left = [k]

    def strike() -> None:
        if left[0] == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        left[0] -= 1

    assert os.WIFSIGNALED(child(work, place, strike))


def fill(place: Path, content: dict[str, bytes]) -> None:
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    for name, each in content.items():
        (place / name).write_bytes(each)


def sweep(place: Path, old: dict[str, bytes], work: Work) -> tuple[int, dict[str, bytes]]:
    """Kills `work` before each operation; returns how many there are and what `work` leaves unharmed."""
    fill(place, old)
    work()  # imports what it needs here, and not in every child
    fill(place, old)
    count = count_operations(work, place)
    new = files(place)
    assert not list(place.parent.rglob(f"{atomic.PREFIX}*"))
    for k in range(count):
        fill(place, old)
        killed_before(k, work, place)
        now = files(place)
        assert now in (old, new), f"killed before operation {k} of {count}: {sorted(now)}"
    work()
    assert files(place) == new
    assert not list(place.parent.rglob(f"{atomic.PREFIX}*")), "what the killed ones left stays"
    return count, new


def sweep_parts(place: Path, old: dict[str, bytes], work: Work) -> dict[str, bytes]:
    """Kills `work` before each operation: what is there is of one result, if not all of it; returns the new one."""
    fill(place, old)
    work()
    new = files(place)
    fill(place, old)
    count = count_operations(work, place)
    for k in range(count):
        fill(place, old)
        killed_before(k, work, place)
        now = files(place).items()
        assert now <= old.items() or now <= new.items(), f"killed before operation {k} of {count}: {sorted(dict(now))}"
    work()
    assert files(place) == new
    return new


@pytest.fixture(scope="module")
def fitted() -> CalibrationResult:
    rng = np.random.default_rng(0)
    robot = fastcal.load_robot("ur5")
    q = rng.uniform(-1.5, 1.5, (40, 6))
    data = fastcal.Dataset.from_arrays(q, position=robot.forward(q)[:, :3, 3] + rng.normal(scale=1e-5, size=(40, 3)))
    return calibrate(robot, data)


def test_a_result_folder_changes_as_a_whole(
    fitted: CalibrationResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also with a file of somebody else's in it, which stays, and a model that the new result does not have."""
    old = {"model.yaml": b"old", "result.json": b"old", "report.html": b"old", "mine.txt": b"mine"}
    monkeypatch.setattr(calibration_files, "calibration_page", lambda result, simulated, **_: "<html></html>")
    failed = replace(fitted, status="not_converged", parameters=[])
    count, new = sweep(tmp_path / "out", old, lambda: calibration_files.write_calibration(failed, tmp_path / "out"))
    assert count > 10
    assert new.keys() == {"result.json", "report.html", "mine.txt"}
    assert new["mine.txt"] == b"mine"


@pytest.fixture(scope="module")
def months(fitted: CalibrationResult, tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """What is found in the months after a calibration, by the function that writes it."""
    arms = tmp_path_factory.mktemp("arms")
    model = fitted.model
    data = fastcal.simulate(model, fastcal.check_poses(model, 8).q, noise=1e-5, seed=1)
    (arms / "A").mkdir()
    model.save(arms / "A" / "model.yaml")
    fastcal.write_measurements(arms / "A" / "november.csv", data, model.joint_types)
    checks = fastcal.check_arms(arms)
    checks.save(arms / "checks")
    return {
        "write_check": fastcal.check(model, data),
        "write_comparison": fastcal.compare(model, fastcal.update(model, data).model),
        "write_arm_checks": checks,
    }


@pytest.mark.parametrize("writer", ["write_check", "write_comparison", "write_arm_checks"])
def test_what_the_months_after_write_changes_as_a_whole(
    months: dict[str, object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, writer: str
) -> None:
    """A check is a file, all else a folder; an older check of an arm beside them stays."""
    for page in ("check_page", "comparison_page", "arms_page"):
        monkeypatch.setattr(monitoring_files, page, lambda found, language: "<html></html>")
    place = tmp_path / "out"
    target = place / "check.json" if writer == "write_check" else place
    old = {"A_october.json": b"older", "report.html": b"old", "check.json": b"old"}
    write = getattr(monitoring_files, writer)
    count, new = sweep(place, old, lambda: write(months[writer], target))
    assert count > 2
    assert new["A_october.json"] == b"older"
    assert (new["check.json"] == b"old") == (writer != "write_check")
    assert (new["report.html"] == b"old") == (writer == "write_check")


def test_a_diagnosis_changes_as_a_whole(tmp_path: Path) -> None:
    """The same folder, written by a function of its own."""

    def write() -> None:
        with folder.atomic_folder(tmp_path / "out", owned=("model.yaml", "without_*.patch")) as place:
            (place / "model.yaml").write_text("new")
            (place / "diagnosis.json").write_text("new")

    old = {"model.yaml": b"old", "without_backlash.patch": b"old"}
    _, new = sweep(tmp_path / "out", old, write)
    assert new == {"model.yaml": b"new", "diagnosis.json": b"new"}


def of_update(fitted: CalibrationResult, folder: Path) -> Work:
    data = fastcal.simulate(fitted.model, np.random.default_rng(1).uniform(-1.5, 1.5, (12, 6)), noise=1e-5, seed=1)
    found = update(fitted.model, data)
    return lambda: monitoring_files.write_update(found, folder / "out")


def of_history(fitted: CalibrationResult, folder: Path) -> Work:
    (folder / "arms").mkdir()
    fitted.model.save(folder / "arms/model.yaml")
    found = history(folder / "arms")
    return lambda: monitoring_files.write_history(found, folder / "out")


def of_accept(fitted: CalibrationResult, folder: Path) -> Work:
    plan = plan_acceptance(fitted.model, language="urscript", program="test.script", cycles=2)
    (folder / "test").mkdir()
    write_test(folder / "test/test.script", plan, fitted.model)
    visits = load_plan(folder / "test/test_plan.csv", fitted.model)
    found = accept(fitted.model, fastcal.simulate(fitted.model, visits.q, noise=1e-5, seed=2), plan=visits)
    return lambda: acceptance_report.write_acceptance(found, folder / "out")


@pytest.mark.parametrize(
    ("made", "pages", "written"),
    [
        (of_update, {monitoring_files: "update_page"}, monitoring_files.UPDATE_FILES),
        (of_history, {monitoring_files: "history_page"}, monitoring_files.HISTORY_FILES),
        (of_accept, {acceptance_report: "acceptance_page"}, acceptance_report.FILES),
    ],
)
def test_an_update_a_history_and_an_acceptance_change_as_a_whole(
    made: Callable[[CalibrationResult, Path], Work],
    pages: dict[ModuleType, str],
    written: tuple[str, ...],
    fitted: CalibrationResult,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module, page in pages.items():
        monkeypatch.setattr(module, page, lambda *_, **__: "<html></html>")
    old = dict.fromkeys(written, b"old") | {"mine.txt": b"mine"}
    _, new = sweep(tmp_path / "out", old, made(fitted, tmp_path))
    assert new.keys() == old.keys()
    assert all(new[name] != b"old" for name in written)


def test_a_program_never_lies_beside_the_plan_of_another(fitted: CalibrationResult, tmp_path: Path) -> None:
    """Killed anywhere, what is there is of one test: a KRL program has two files, its plan is the third."""
    plan = plan_acceptance(fitted.model, language="krl", program="iso.src", cycles=2)
    place, old = tmp_path / "test", {"iso.src": b"old", "iso.dat": b"old", "iso_plan.csv": b"old", "mine.txt": b"mine"}

    def work() -> object:
        return write_test(place / "iso.src", plan, fitted.model)

    assert sweep_parts(place, old, work).keys() == old.keys()


def test_a_program_never_lies_beside_the_poses_of_another(tmp_path: Path) -> None:
    """`design` writes a table of poses and the program that drives there."""
    place, old = tmp_path / "out", {"poses.csv": b"old", "poses.script": b"old"}
    given = ["design", "ur5", "--count", "12", "--candidate-count", "64", "-o", str(place / "poses.csv")]
    assert sweep_parts(place, old, lambda: main(given)).keys() == old.keys()


POSES = """q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,qw,qx,qy,qz
10,-50,60,20,70,30,400,300,500,1,0,0,0
0,-40,50,0,60,10,300,200,400,0,1,0,0
"""
EXPORT = """Name;A1;A2;A3;A4;A5;A6;X [mm];Y [mm];Z [mm]
P1;10;-50;60;20;70;30;400;300;500
P2;0;-40;50;0;60;10;300;200;400
P3;5;-45;55;10;65;20;350;250;450
"""
COMMANDS = {
    "predict": ("predict", "ur5", "IN/poses.csv", "-o", "OUT/file.csv"),
    "simulate": ("simulate", "ur5", "IN/poses.csv", "-o", "OUT/file.csv"),
    "evaluate": ("evaluate", "ur5", "IN/poses.csv", "-o", "OUT/file.json"),
    "convert": ("convert", "ur5", "--to", "mdh", "-o", "OUT/file.yaml"),
    "convert to a URDF": ("convert", "ur5", "--to", "urdf", "-o", "OUT/file.urdf"),
    "compensate": ("compensate", "ur5", "IN/poses.csv", "-o", "OUT/file.csv"),
    "import": ("import", "IN/export.csv", "-o", "OUT/file.csv"),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_s_file_changes_as_a_whole(command: str, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in/poses.csv").write_text(POSES)
    (tmp_path / "in/export.csv").write_text(EXPORT)
    place = tmp_path / "out"
    given = [word.replace("IN", str(tmp_path / "in")).replace("OUT", str(place)) for word in COMMANDS[command]]
    name = Path(given[-1]).name
    _, new = sweep(place, {name: b"old"}, lambda: main(given))
    assert new.keys() == {name}
    assert new[name] != b"old"


def corrected(seed: int) -> fastcal.Robot:
    """An arm with a correction by three neighbours of twenty rows."""
    rng = np.random.default_rng(seed)
    robot = fastcal.load_robot("ur5")
    low, high = np.full(7, -3.0), np.full(7, 3.0)
    guard = Guard(low, high, np.ones(7), np.ones(6), rng.normal(size=(20, 13)), 50.0, 100.0)
    rows = Neighbours(Scaling(np.zeros(7), np.ones(7)), rng.normal(size=(20, 7)), 1e-3 * rng.normal(size=(20, 3)), 3)
    uncertainty = Uncertainty(np.full(6, 1e-5), np.ones(6), np.full(6, 1e-4))
    return fastcal.Robot(robot.spec | {"correction": Correction("knn", (rows,), guard, 0.01, 0.01, uncertainty)})


def test_a_model_with_its_network_changes_as_a_whole(tmp_path: Path) -> None:
    """Whatever happens, the model that is there loads with the network that it was saved with."""
    first, second = corrected(1), corrected(2)
    place = tmp_path / "out"
    q = np.array([[0.1, -0.7, 0.9, 0.3, 0.8, -0.2]])
    said = [robot.forward(q).tobytes() for robot in (first, second)]
    assert said[0] != said[1]
    place.mkdir()
    first.save(place / "model.yaml")
    old = files(place)
    assert len(old) == 2

    def loads() -> bytes:
        return fastcal.load_robot(place / "model.yaml").forward(q).tobytes()

    count = count_operations(lambda: second.save(place / "model.yaml"), place)
    assert loads() == said[1]
    assert len(files(place)) == 2, "the old network stays"
    found = []
    for k in range(count):
        fill(place, old)
        killed_before(k, lambda: second.save(place / "model.yaml"), place)
        found.append(said.index(loads()))
    assert set(found) == {0, 1}
    assert found == sorted(found)
