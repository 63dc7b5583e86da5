# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compliance`: how far the joints give under load, from the same postures under several payloads."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from fastcal.cli.console import emit, progress, say
from fastcal.cli.options import DataFiles, OutFolder, PageLanguage, RobotFile, Threads

FILES = ("model.yaml", "compliance.json", "report.html")


def compliance(
    robot: RobotFile,
    data: DataFiles,
    output: OutFolder,
    joints: Annotated[
        str,
        typer.Option(
            metavar="N,N,...", help="Joints with compliance; default: all revolute joints loaded by the payloads."
        ),
    ] = "",
    torque: Annotated[
        Literal["all", "payload"],
        typer.Option(help="The load that deflects a joint: all weights, or the payload only."),
    ] = "all",
    level: Annotated[
        float, typer.Option(min=1e-4, max=0.5, help="Significance level for a corner in the compliance.")
    ] = 0.01,
    page_language: PageLanguage = "en",
    threads: Threads = 1,
) -> None:
    """Identify the compliance of joints under load.

    The same postures are measured with several payloads, so that geometry and gear errors cancel in the differences. A
    joint gets a second, stiffer or softer range only if a test finds a corner in its compliance.
    """
    from fastcal.calibration.compliance import identify_compliance
    from fastcal.errors import InvalidInput
    from fastcal.io.atomic import write_text
    from fastcal.io.folder import atomic_folder, check_folder
    from fastcal.io.measurements import load_measurements
    from fastcal.io.results import write_json
    from fastcal.io.robot_file import load_robot
    from fastcal.measurements.dataset import Dataset
    from fastcal.report.compliance_report import compliance_page
    from fastcal.report.language import _

    try:
        asked = [int(part) for part in joints.split(",")] if joints else None
    except ValueError:
        raise InvalidInput(f"--joints takes numbers of joints such as 2,3,5, got '{joints}'") from None
    check_folder(output, FILES)
    arm = load_robot(robot)
    rows = Dataset.concatenate([load_measurements(file, arm) for file in data])
    with progress() as show:
        show("comparing the payloads of each posture")
        found = identify_compliance(arm, rows, joints=asked, torque=torque, level=level, threads=threads)
    content = found.to_json_dict()
    with atomic_folder(output, owned=FILES) as folder:
        found.pairs.model.save(folder / "model.yaml")
        write_json(folder / "compliance.json", content)
        write_text(folder / "report.html", compliance_page(found, arm.name, page_language))
    for joint in content["joints"]:
        values = ", ".join(f"{name} {value['value']:.4g}" for name, value in joint["parameters"].items())
        told = {"joint": joint["owner"], "p": joint["p"], "values": values}
        if joint["corner"]:
            say(_("{joint}: a corner (p {p:.2g}); {values}", **told))
        else:
            say(_("{joint}: no corner (p {p:.2g}); {values}", **told))
    say(str(output / "report.html"))
    emit(content)
