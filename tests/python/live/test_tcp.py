# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows over TCP and from a watched folder: each is answered, and a kill loses none that was."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import fastcal
from fastcal.errors import InvalidInput
from fastcal.live import LiveSession, RowServer, WatchedFolder

SERVER = """
import sys, threading
from fastcal.live import LiveSession, RowServer
print(RowServer(LiveSession("ur5", sys.argv[1])).start().port, flush=True)
threading.Event().wait()
"""


def ask(connection: socket.socket, *lines: str) -> list[str]:
    """The answer to each line."""
    file = connection.makefile("rw", encoding="utf-8", newline="\n")
    out = []
    for line in lines:
        file.write(line + "\n")
        file.flush()
        out.append(file.readline().rstrip("\n"))
    return out


def test_forty_rows_with_a_dropped_beam_and_a_slip(simulated: Any, shift: Any, tmp_path: Path) -> None:
    session = LiveSession(simulated.robot, tmp_path)
    server = RowServer(session).start()
    header, rows = simulated.text(shift)
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as connection:
        assert ask(connection, header) == ["ok"]
        said = ask(connection, *rows)
    server.stop()
    assert [k for k, text in enumerate(said) if text != "ok"] == [15, 25]
    assert "dropped beam" in said[15]
    assert "slip" in said[25]


def test_another_header_ends_the_connection_and_a_bad_row_does_not(simulated: Any, tmp_path: Path) -> None:
    session = LiveSession(simulated.robot, tmp_path)
    server = RowServer(session).start()
    header, rows = simulated.text()
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as connection:
        assert ask(connection, header, "1,2", rows[0])[1:] == [
            f"expected {len(header.split(','))} cells as the header has, got 2",
            "ok",
        ]
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as connection:
        assert ask(connection, "time,place")[0].startswith("the header: column 'time' has no unit")
        assert connection.recv(1) == b""
    server.stop()
    assert len(session.rows) == 2


def test_a_kill_loses_no_row_that_was_answered(simulated: Any, shift: Any, tmp_path: Path) -> None:
    header, rows = simulated.text(shift)
    process = subprocess.Popen([sys.executable, "-c", SERVER, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    with socket.create_connection(("127.0.0.1", int(process.stdout.readline())), timeout=60) as connection:
        said = ask(connection, header, *rows[:28])[1:]
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    process.stdout.close()
    again = LiveSession(simulated.robot, tmp_path)
    assert [row.line for row in again.rows] == rows[:28]
    assert [row.judgement.text or "ok" for row in again.rows] == said
    data = fastcal.load_measurements(tmp_path / "measurements.csv", simulated.robot)
    assert len(data) == said.count("ok") == 26


def test_a_watched_folder_is_read_as_its_files_grow(simulated: Any, shift: Any, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    session = LiveSession(simulated.robot, tmp_path / "session")
    watched = WatchedFolder(session, tmp_path / "in")
    header, rows = simulated.text(shift)
    file = tmp_path / "in" / "a.csv"
    file.write_text("\n".join([header, *rows[:9]]) + "\n" + rows[9][:30])
    assert watched.look() == 9
    assert watched.look() == 0
    with file.open("a") as more:
        more.write(rows[9][30:] + "\n" + rows[10] + "\n")
    assert watched.look() == 2
    (tmp_path / "in" / "b.csv").write_text("\n".join([header, *rows[11:20], ""]))
    (tmp_path / "in" / "c.csv").write_text("no,measurements\n1,2\n")
    assert watched.look() == 9
    assert [row.line for row in session.rows] == rows[:20]
    assert session.rows[15].judgement.kind == "dropped_beam"
    assert "c.csv" in watched.said


def test_the_session_s_own_folder_is_not_watched(simulated: Any, tmp_path: Path) -> None:
    session = LiveSession(simulated.robot, tmp_path)
    with pytest.raises(InvalidInput, match="the session's own files"):
        WatchedFolder(session, tmp_path).start()
    with pytest.raises(InvalidInput, match="expected a folder"):
        WatchedFolder(session, tmp_path / "none").start()
