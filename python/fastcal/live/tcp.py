# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows over TCP: the header line of a measurement file, then a row a line; each answered `ok` or what is wrong.

The server listens on 127.0.0.1 unless it is told otherwise.
"""

from __future__ import annotations

import socketserver
from collections.abc import Callable
from threading import Thread

from fastcal.live.lines import Lines
from fastcal.live.session import LiveSession

_LONGEST = 100_000  # bytes of a line
_CUT = "the line is longer than 100,000 bytes; expected a row of a measurement file"


class RowServer:
    """Feeds a session with what comes in; a connection is a header line and its rows.

    Args:
        session: What takes the rows.
        port: Where to listen; 0: any that is free, see `port`.
        host: The address to listen on.
    """

    def __init__(self, session: LiveSession, port: int = 0, host: str = "127.0.0.1") -> None:
        class Handler(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                answer_lines(session, self.rfile.readline, self.wfile.write)

        class Server(socketserver.ThreadingTCPServer):
            allow_reuse_address = True
            daemon_threads = True

        self._server = Server((host, port), Handler)
        self.port = int(self._server.server_address[1])
        self._thread = Thread(target=self._server.serve_forever, daemon=True, kwargs={"poll_interval": 0.1})

    def start(self) -> RowServer:
        """Begins to listen."""
        self._thread.start()
        return self

    def stop(self) -> None:
        """Ends; rows that came are written."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


def answer_lines(session: LiveSession, read: Callable[[int], bytes], write: Callable[[bytes], object]) -> None:
    """Answers the lines of a connection until it ends; a header that is refused ends it.

    Args:
        session: What takes the rows.
        read: Gives a line of at most so many bytes, empty at the end.
        write: Sends bytes.
    """
    lines = Lines(session)
    while line := read(_LONGEST):
        if not line.endswith(b"\n"):
            if len(line) >= _LONGEST:  # else the connection was cut: no whole row
                write(_CUT.encode() + b"\n")
            return
        answer = lines.answer(line.decode("utf-8", errors="replace"))
        if answer is not None:
            write(f"{answer}\n".encode())
            if not lines.headed:
                return
