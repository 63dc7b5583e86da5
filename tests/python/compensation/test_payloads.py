# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A program is compensated for the payload that it states, and says where it states none that can be used."""

import numpy as np
import pytest

from fastcal.compensation import CompensatedProgram, compensate_program
from fastcal.programs import Cell, read_program

P = [[0.1, -1.2, 1.3, -1.6, -1.5, 0.2], [0.4, -1.0, 1.1, -1.6, -1.5, 0.2], [0.7, -0.8, 1.0, -1.6, -1.5, 0.2]]


def compensated(arms, *lines: str, cell: Cell | None = None, **conditions: float) -> CompensatedProgram:
    """A script of the UR5, whose joints 2 and 3 yield."""
    nominal, real = arms("ur5")
    program = read_program({"a.script": "\n".join([*lines, ""]).encode()})
    return compensate_program(real, program, nominal=nominal, cell=cell, **conditions)


def texts(done: CompensatedProgram) -> list[str]:
    """What was written, without the mark."""
    return [line for line in done.documents[0].text.splitlines() if not line.startswith("#")]


def test_each_target_is_reached_with_the_payload_that_it_is_passed_with(arms) -> None:
    """The real arm, driven to what was written, carries what the program says and is where the nominal one would be."""
    nominal, real = arms("ur5")
    done = compensated(arms, f"movej({P[0]})", "set_payload(40, [0,0,0])", f"movej({P[1]})", "set_payload(20)",
                       f"movej({P[2]})")  # fmt: skip
    np.testing.assert_array_equal(done.payload, [0, 40, 20])
    for k, mass in enumerate((0.0, 40.0, 20.0)):
        written = read_program({"a.script": done.documents[0].text.encode()}).targets[k].values
        got, wanted = real.forward(written, payload=mass)[0], nominal.forward(P[k])[0]
        assert np.linalg.norm(got[:3, 3] - wanted[:3, 3]) < 1e-6
        if mass == 0:
            continue
        unloaded = real.forward(written, payload=0.0)[0]
        assert np.linalg.norm(unloaded[:3, 3] - wanted[:3, 3]) > 1e-5
    assert "payload as the program states it: 20 kg, 40 kg" in done.notes
    assert "the program states no payload for the target of line 1: 0 kg are taken" in done.notes
    assert not done.assumed


def test_one_payload_of_the_program_is_as_if_it_were_given(arms, programs) -> None:
    nominal, real = arms("ur5")
    program = read_program(programs["URScript"])
    own = compensate_program(real, program, nominal=nominal)
    given = compensate_program(real, program, nominal=nominal, payload=2.35)
    none = compensate_program(real, program, nominal=nominal, payload=0.0)
    assert own.documents == given.documents
    assert own.documents != none.documents
    assert not [note for note in given.notes if "payload" in note]
    assert "0 kg are taken as the payload, as asked for; the program states 2.35 kg" in none.notes


def test_a_target_of_two_payloads_is_corrected_for_the_greater_and_says_what_is_left(arms) -> None:
    nominal, real = arms("ur5")
    lines = [f"a={P[0]}", "set_payload(0)", "movej(a)", "set_payload(5)", "movej(a)"]
    done = compensated(arms, *lines)
    assert texts(done) == texts(compensated(arms, *lines, payload=5.0))
    left = real.forward(done.q, payload=0.0)[0, :3, 3] - nominal.forward(P[0])[0, :3, 3]
    sentence = "a: passed with more than one payload and corrected for the greatest; with the least at most "
    assert f"{sentence}{1000 * np.linalg.norm(left):.3f} mm are left" in done.notes


def test_a_mass_that_is_not_known_is_said_and_a_cell_file_gives_it(arms) -> None:
    nominal, real = arms("siasun_sr210d")
    files = {"w.src": b"DEF w()\nBAS(#TOOL,1)\nPTP {A1 5,A2 -60,A3 80,A4 0,A5 30,A6 0}\nEND\n"}
    done = compensate_program(real, read_program(files), nominal=nominal)
    assert done.assumed == (
        "the mass of load 1 is not in the program: for the target of line 3 0 kg are taken; a payload for the whole "
        "program or a cell file decides",
    )
    known = compensate_program(real, read_program(files), nominal=nominal, cell=Cell(loads={"1": 90.0}))
    assert known.documents == compensate_program(real, read_program(files), nominal=nominal, payload=90.0).documents
    assert not known.assumed
    assert known.payload.tolist() == [90.0]


@pytest.mark.parametrize("stated", ["set_payload(2.35)", "set_payload(w)"])
def test_an_arm_that_does_not_yield_says_that_the_payload_is_of_no_use(arms, stated: str) -> None:
    nominal, _real = arms("ur5")
    program = read_program({"a.script": f"{stated}\nmovej({P[0]})\n".encode()})
    done = compensate_program(nominal, program)
    said = "the program states a payload of 2.35 kg; this model does not depend on it"
    assert (said in done.notes) == (stated == "set_payload(2.35)")
    assert not done.assumed


def test_the_way_back_takes_the_same_payloads(arms) -> None:
    nominal, real = arms("ur5")
    done = compensated(arms, "set_payload(4)", f"movej({P[1]})", "set_payload(1)", f"movej({P[2]})")
    back = compensate_program(
        real, read_program({"a.script": done.documents[0].text.encode()}), nominal=nominal, inverse=True
    )
    again = read_program({"a.script": back.documents[0].text.encode()})
    np.testing.assert_allclose([target.values for target in again.targets], P[1:], atol=2e-7)
