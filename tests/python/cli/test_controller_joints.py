# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm whose controller counts otherwise than its chain: what it is given speaks j1 ..., what it gives is read so.

J3 of a FANUC is counted from the horizontal: q3 = J3 + J2 is written out here by hand.
"""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

import fastcal as library
from fastcal.io.measurements_out import write_measurements
from fastcal.measurements.rotations import quaternions

ARM = "fanuc_m20ia"
LS_JOINTS = re.compile(r"J\d=\s*([-.\d]+) deg")


def table(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def chain(J: np.ndarray) -> np.ndarray:
    q = J.copy()
    q[..., 2] += J[..., 1]
    return q


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Poses of a real arm, measured: q.csv with the chain's joints, j.csv with what the pendant shows; its model."""
    folder = tmp_path_factory.mktemp("shop")
    arm = library.load_robot(ARM)
    real = library.perturbed(arm, seed=2)
    q = library.random_poses(arm, 40, seed=3)
    write_measurements(folder / "q.csv", library.simulate(real, q, noise=2e-5, seed=4), arm.joint_types)
    rows = table(folder / "q.csv")
    for row in rows:
        row["q3_deg"] = float(row["q3_deg"]) - float(row["q2_deg"])
    with (folder / "j.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow([re.sub(r"^q(\d)", r"j\1", name) for name in rows[0]])
        out.writerows([list(row.values()) for row in rows])
    real.save(folder / "real.yaml")
    library.calibrate(arm, library.load_measurements(folder / "q.csv", arm)).model.save(folder / "model.yaml")
    return folder


@pytest.fixture
def here(shop, tmp_path, monkeypatch) -> Path:
    for file in shop.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_what_the_pendant_shows_is_the_same_measurement(here) -> None:
    arm = library.load_robot(ARM)
    mine, shown = (library.load_measurements(here / name, arm) for name in ("q.csv", "j.csv"))
    np.testing.assert_allclose(shown.q, mine.q, atol=1e-12)
    assert shown.notes == mine.notes == ()


def test_both_may_stand_side_by_side_and_are_compared(here) -> None:
    text = (here / "q.csv").read_text().splitlines()
    shown = (here / "j.csv").read_text().splitlines()
    both = [",".join([a, *b.split(",")[:6]]) for a, b in zip(text, shown, strict=True)]
    (here / "both.csv").write_text("\n".join(both) + "\n")
    arm = library.load_robot(ARM)
    assert library.load_measurements(here / "both.csv", arm).notes == ()
    wrong = "\n".join([both[0], *(row.rpartition(",")[0] + ",1.5" for row in both[1:])])
    (here / "both.csv").write_text(wrong + "\n")
    (note,) = library.load_measurements(here / "both.csv", arm).notes
    assert note.startswith("column 'j6_deg' is up to ")


def test_without_a_pendant_the_columns_are_the_chain_s_with_a_word(here) -> None:
    plain = library.load_robot({k: v for k, v in library.load_robot(ARM).spec.items() if k != "pendant"})
    found = library.load_measurements(here / "j.csv", plain)
    assert "columns j1 ... are taken as q1 ..., as the robot file has no pendant" in found.notes


@pytest.mark.parametrize(
    "command", [("design", ARM, "--count", "6"), ("template", ARM), ("check", "model.yaml", "--plan", "6")]
)
def test_what_is_written_for_the_controller_speaks_its_joints(here, fastcal, command) -> None:
    assert fastcal(*command, "-o", "out.csv").code == 0
    header = (here / "out.csv").read_text().splitlines()[0].split(",")
    names = [name for name in header if re.match(r"[qj]\d_", name)]
    assert names == [f"j{joint}_deg" for joint in range(1, 7)]
    if rows := table(here / "out.csv"):
        arm = library.load_robot(ARM)
        read = library.load_measurements(here / "out.csv", arm, require_measured=False)
        J = np.array([[float(row[name]) for name in names] for row in rows])
        np.testing.assert_allclose(np.degrees(read.q), chain(J), atol=1e-9)
        assert (read.q >= arm.limits[:, 0] - 1e-7).all()
        assert (read.q <= arm.limits[:, 1] + 1e-7).all()


def test_the_program_of_a_test_goes_where_its_plan_says(here, fastcal) -> None:
    assert fastcal("accept", "model.yaml", "--plan", "--language", "fanuc", "--cycles", "1", "-o", "iso.ls").code == 0
    written = {
        name: np.array([float(v) for v in LS_JOINTS.findall(body)])
        for name, body in re.findall(r'P\[\d+:"(\w+)"\]\{(.*?)\};', (here / "iso.ls").read_text(), re.S)
    }
    model = library.load_robot("model.yaml")
    nominal = library.load_robot(ARM)
    tool = library.Robot(nominal.spec | {"tool": model.spec["tool"]})
    for row in table(here / "iso_plan.csv"):
        J = np.array([float(row[f"j{joint}_deg"]) for joint in range(1, 7)])
        np.testing.assert_allclose(written[row["pose"]], J, atol=1e-4)
        at = tool.forward(np.radians(chain(J)))[0, :3, 3] * 1e3
        np.testing.assert_allclose(at, [float(row[f"target_{a}_mm"]) for a in "xyz"], atol=0.1)


def test_commands_are_told_in_both(here, fastcal) -> None:
    model = library.load_robot("model.yaml")
    T = model.forward(np.radians([[10.0, 20, 30, 40, -50, 60], [12.0, 22, 28, 38, -52, 58]]))
    lines = ["x_mm,y_mm,z_mm,qw,qx,qy,qz,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg"]
    for pose, seed in zip(T, ([10, 20, 10, 40, -50, 60], [12, 22, 6, 38, -52, 58]), strict=True):
        numbers = [*(pose[:3, 3] * 1e3), *quaternions(pose[None, :3, :3])[0], *seed]
        lines.append(",".join(f"{float(number):.12f}" for number in numbers))
    (here / "targets.csv").write_text("\n".join(lines) + "\n")
    assert fastcal("compensate", "model.yaml", "targets.csv", "-o", "commands.csv").code == 0
    for row in table(here / "commands.csv"):
        assert row["status"] == "reached"
        q = np.array([float(row[f"q{joint}_deg"]) for joint in range(1, 7)])
        J = np.array([float(row[f"j{joint}_deg"]) for joint in range(1, 7)])
        np.testing.assert_allclose(chain(J), q, atol=1e-9)
        assert abs(q[0] - 10) < 3  # the seed's posture


def test_joints_of_a_program_are_the_controller_s(here, fastcal) -> None:
    """LS joints beside a tracker's points: imported as j1 ..., and read as the mechanism's."""
    rows = table(here / "j.csv")
    body = "".join(
        f'P[{k}:"P{k:03}"]{{\n   GP1:\n\tUF : 0, UT : 1,\t\n'
        + ",".join(f"\tJ{j}= {float(row[f'j{j}_deg']):.5f} deg" for j in range(1, 7))
        + "\n};\n"
        for k, row in enumerate(rows, start=1)
    )
    moves = "".join(f"   {k}:J P[{k}] 9% FINE ;\n" for k in range(1, len(rows) + 1))
    (here / "poses.ls").write_text(f"/PROG  POSES\n/MN\n{moves}/POS\n{body}/END\n")
    points = "".join(f"P{k:03},{row['x_mm']},{row['y_mm']},{row['z_mm']}\n" for k, row in enumerate(rows, start=1))
    (here / "points.csv").write_text("Name,X [mm],Y [mm],Z [mm]\n" + points)
    assert fastcal("import", "points.csv", "--joints", "poses.ls", "--robot", ARM, "-o", "session.csv").code == 0
    assert (here / "session.csv").read_text().startswith("name,j1_deg,j2_deg")
    arm = library.load_robot(ARM)
    read = library.load_measurements(here / "session.csv", arm)
    mine = library.load_measurements(here / "q.csv", arm)
    np.testing.assert_allclose(read.q, mine.q, atol=1e-6)


def test_a_controller_s_report_in_a_backup_is_left_and_named(here, fastcal) -> None:
    backup = here / "backup"
    backup.mkdir()
    (backup / "LOGBOOK.LS").write_text("  1 FANUC   12-MAY-26 08:01:55\nLogbook of events\n")
    joints = ",".join(f"\tJ{j}= {v:.3f} deg" for j, v in enumerate((1, 2, 3, 4, -5, 6), start=1))
    program = f"/PROG  A\n/MN\n   1:J P[1] 9% FINE ;\n/POS\nP[1]{{\n   GP1:\n\tUF : 0, UT : 0,\t\n{joints}\n}};\n/END\n"
    (backup / "A.LS").write_text(program)
    said = fastcal("compensate", "model.yaml", "backup", "-o", "real")
    assert said.code == 0
    assert "LOGBOOK.LS: is a controller's report and no program; it is left out" in said.err
    assert [path.name for path in (here / "real").iterdir()] == ["A.LS"]
    assert fastcal("compensate", "model.yaml", "backup/A.LS", "-o", "A.LS").code == 0
    assert (here / "A.LS").read_text() == (here / "real" / "A.LS").read_text() != program


def test_next_poses_of_a_check_are_told_as_the_controller_shows_them(here) -> None:
    model = library.load_robot("model.yaml")
    q = library.check_poses(model, 8).q
    moved = q.copy()
    moved[:, 2] += np.radians(0.05)
    seen = library.simulate(library.load_robot("real.yaml"), moved, noise=2e-5, seed=7)
    found = library.check(model, library.Dataset.from_arrays(q, position=seen.position, robot=model))
    content = json.loads(json.dumps(found.to_json_dict()))
    for pose in content["next_poses"]:
        assert pose["j3_deg"] == pytest.approx(pose["q3_deg"] - pose["q2_deg"], abs=2e-3)


def test_an_arm_that_does_not_say_how_it_counts_is_doubted(here, fastcal) -> None:
    spec = library.load_robot("model.yaml").spec
    library.Robot({k: v for k, v in spec.items() if k != "pendant"}).save("plain.yaml")
    said = fastcal("accept", "plain.yaml", "--plan", "--language", "fanuc", "--cycles", "1", "-o", "iso.ls")
    assert "a FANUC controller shows joint 3 from the horizontal" in said.err
    said = fastcal("compensate", "plain.yaml", "iso.ls", "-o", "real.ls")
    assert "pendant: [] says so" in said.err
    library.Robot(spec | {"pendant": []}).save("plain.yaml")
    assert "horizontal" not in fastcal("compensate", "plain.yaml", "iso.ls", "-o", "real.ls").err
