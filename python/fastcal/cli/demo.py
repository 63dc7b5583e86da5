# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal demo`: a shipped arm, measured by simulation, calibrated for real, and marked as simulated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fastcal.cli import calibrate
from fastcal.cli.console import NOT_CONVERGED, progress, say
from fastcal.cli.options import PageLanguage, Seed, Threads

if TYPE_CHECKING:
    from fastcal.measurements.dataset import Dataset
    from fastcal.robot.robot import Robot

ARM = "staubli_rx160l"
DIAGNOSIS = "diagnosis"  # the folder of it in the demonstration
HEAD = "Written by fastcal demo: a simulated arm, no real one was measured."
ROWS, TEST_ROWS = 150, 60
BASE = {"xyz_mm": [2400.0, -650.0, 310.0], "rpy_deg": [0.4, -0.3, 155.0]}  # where the tracker sees it
REGION_MM = [[600.0, -900.0, -300.0], [1800.0, 900.0, 1500.0]]  # in front of the arm, before the tracker
NOISE_MM = 0.03
REPEATABILITY_DEG = 0.001
PAYLOADS_KG = (0.0, 5.0, 10.0)
OUTLIER_SHARE = 0.03
OUTLIER_MM = 5.0
# A joint of an arm this size gives way by some tenths of a milliradian under 1,000 N m.
COMPLIANCE_RAD_NM = {"joint2": 4e-7, "joint3": 6e-7}
EFFECTS = ",".join(["geometry", *(f"joint_compliance@{joint}" for joint in COMPLIANCE_RAD_NM)])

Folder = Annotated[Path, typer.Option("-o", "--output", metavar="OUT", help="The folder to write into.")]


def demo(
    output: Folder = Path("fastcal-demo"),
    seed: Seed = 1,
    threads: Threads = 1,
    camera: Annotated[
        bool,
        typer.Option("--camera", help="Use a camera on the flange and pictures of a board instead of a tracker."),
    ] = False,
    page_language: PageLanguage = "en",
) -> None:
    """Simulate measurements of an arm, calibrate and diagnose it.

    The last line is the path of the report.
    """
    from fastcal.calibration.calibrate import calibrate as identify
    from fastcal.diagnosis import diagnose as diagnosed
    from fastcal.io.measurements import load_measurements
    from fastcal.io.robot_file import load_robot
    from fastcal.report.calibration_files import write_calibration
    from fastcal.report.diagnosis_report import write_diagnosis

    _check_ours(output)
    if camera:
        _seen_by_a_camera(output, seed, threads, page_language)
        return
    say(f"This is a simulation: a {ARM} with random errors and compliant joints, measured by a simulated tracker.")
    with progress() as show:
        show("simulating")
        _write_measurements(output, seed)
        # From here on as with anyone's files.
        nominal = load_robot(output / "robot.yaml")
        data = load_measurements(output / "measurements.csv", nominal)
        test = load_measurements(output / "test.csv", nominal)
        found = identify(nominal, data, test=test, effects=EFFECTS, threads=threads, progress=show)
        show("writing the report")
        write_calibration(found, output, simulated=True, language=page_language)
        missing = diagnosed(nominal, data, test=test, threads=threads, progress=show)
        write_diagnosis(missing, output / DIAGNOSIS, simulated=True, language=page_language)
    say(f"what the geometry alone would miss: {missing.sentence}")
    say(str(output / DIAGNOSIS / "report.html"))
    calibrate.say_result(found, output, [str(output / "robot.yaml"), str(output / "measurements.csv")])
    if found.status != "converged":
        raise typer.Exit(NOT_CONVERGED)


def _seen_by_a_camera(output: Path, seed: int, threads: int, language: str) -> None:
    """The demonstration with pictures: drawn, searched for the board's corners, and fitted."""
    from fastcal.calibration.calibrate import calibrate as identify
    from fastcal.cli.demo_camera import ARM as CAMERA_ARM
    from fastcal.cli.demo_camera import write_session
    from fastcal.cli.detect import write_detection
    from fastcal.cli.hand_eye import write_hand_eyes
    from fastcal.importers.corners import load_seen, picture_files
    from fastcal.io.robot_file import load_robot
    from fastcal.report.calibration_files import write_calibration

    say(f"This is a simulation: a {CAMERA_ARM} with random errors and a camera on its flange, in pictures drawn here.")
    cell, corners = output / "cell.yaml", output / "corners.csv"
    with progress() as show:
        show("drawing pictures")
        write_session(output, seed)
        # From here on as with anyone's pictures.
        nominal = load_robot(cell)
        for name in ("", "test_"):
            poses, table = output / f"{name}poses.csv", output / f"{name}corners.csv"
            write_detection(nominal.description, [output / f"{name}pictures"], poses, table, 1, language, show)
        data = load_seen([output / "poses.csv"], nominal, corners)
        test = load_seen([output / "test_poses.csv"], nominal, output / "test_corners.csv")
        found = identify(nominal, data, test=test, threads=threads, progress=show)
        show("writing the report")
        write_calibration(found, output, simulated=True, language=language, pictures=picture_files(corners))
    write_hand_eyes(found, [output / "camera.calib"])
    calibrate.say_result(found, output, [str(cell), str(output / "poses.csv"), "--corners", str(corners)])
    if found.status != "converged":
        raise typer.Exit(NOT_CONVERGED)


def _check_ours(output: Path) -> None:
    """Refuses a folder that holds anything but an older demonstration, whose files may be replaced."""
    from fastcal.errors import InvalidInput
    from fastcal.io.folder import check_folder

    check_folder(output)
    if not output.exists() or not any(output.iterdir()):
        return
    robot = output / "robot.yaml"
    if not robot.is_file() or HEAD not in robot.read_text(encoding="utf-8", errors="replace"):
        raise InvalidInput(f"{output}: holds other files; choose an empty folder for the demonstration with -o")


def _write_measurements(output: Path, seed: int) -> None:
    """robot.yaml (nominal), measurements.csv and test.csv of an arm off by about 0.5 mm and 0.5 mrad, that yields."""
    from fastcal.calibration.simulation import perturbed
    from fastcal.io.folder import atomic_folder
    from fastcal.io.measurements_out import write_measurements
    from fastcal.io.robot_file import load_robot, write_spec

    nominal = load_robot(ARM)
    compliances = [
        {"effect": "joint_compliance", "owner": joint, "parameters": {"compliance_rad_nm": value}}
        for joint, value in COMPLIANCE_RAD_NM.items()
    ]
    true = perturbed(nominal.with_(base=BASE, effects=compliances), seed=seed)
    with atomic_folder(output) as folder:
        write_spec(nominal.spec, folder / "robot.yaml", HEAD)
        for name, rows, outliers, offset in (("measurements", ROWS, OUTLIER_SHARE, 0), ("test", TEST_ROWS, 0.0, 1)):
            data = _measured(nominal, true, rows, outliers, (seed, offset))
            write_measurements(folder / f"{name}.csv", data, nominal.joint_types)


def _measured(nominal: Robot, true: Robot, rows: int, outlier_share: float, seed: tuple[int, int]) -> Dataset:
    import numpy as np

    from fastcal.calibration.simulation import random_poses, simulate
    from fastcal.units import to_si

    random = np.random.default_rng(seed)
    q = random_poses(nominal, rows, region=to_si(np.array(REGION_MM), "mm"), seed=int(random.integers(2**32)))
    data = simulate(
        true,
        q,
        noise=to_si(NOISE_MM, "mm"),
        repeatability=to_si(REPEATABILITY_DEG, "deg"),
        payload=random.choice(PAYLOADS_KG, rows),
        seed=int(random.integers(2**32)),
    )
    gross = random.choice(rows, round(outlier_share * rows), replace=False)
    position = data.points.copy()
    position[gross] += to_si(OUTLIER_MM, "mm") * random.standard_normal((len(gross), 3))
    return replace(data, position=position)
