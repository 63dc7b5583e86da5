# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Starts the studio: the pages, the files of the project that they show, and the guard before both."""

from __future__ import annotations

import secrets
import socket
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Thread
from typing import Any

from fastcal.errors import InvalidInput
from fastcal.report.language import in_language
from fastcal.studio.project import Project

HOST, PORT = "127.0.0.1", 8310
_QUASAR: Mapping[str, Any] = {"en": "en-US", "de": "de"}  # as the web framework calls the languages


def check_extra() -> None:
    """Refuses without the web framework.

    Raises:
        InvalidInput: One sentence with how to get it.
    """
    try:
        import nicegui  # noqa: F401 - only whether it is there
    except ImportError:
        raise InvalidInput("the studio needs the extra 'studio': pip install 'fastcal[studio]'") from None


def free_port(asked: int) -> int:
    """The port that was asked for; 0: any that is free.

    Raises:
        InvalidInput: Another program listens there.
    """
    with socket.socket() as test:
        test.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            test.bind((HOST, asked))
        except OSError as error:
            raise InvalidInput(f"port {asked}: {error.strerror}; give another one with --port") from None
        return int(test.getsockname()[1])


def serve(folder: Path, *, port: int = PORT, show: bool = True, say: Callable[[str], None] = print,
          page_language: str = "en") -> None:  # fmt: skip
    """Serves a project until it is interrupted.

    Args:
        folder: Of the project.
        port: Where to listen, on this machine alone; 0: any that is free.
        show: Open the page in the browser.
        say: Takes the line with the address.
        page_language: Of the screens and of the pages that they write.

    Raises:
        InvalidInput: The extra is missing, the port is taken, or the folder cannot be one of a project.
    """
    check_extra()
    project = Project(folder)
    port = free_port(port)
    token = secrets.token_urlsafe(24)
    from nicegui import app, ui

    from fastcal.studio.files import add_files
    from fastcal.studio.guard import Guard
    from fastcal.studio.shell import add_pages
    from fastcal.studio.state import Studio

    studio = Studio(project)
    add_files(studio)
    app.on_shutdown(studio.close)
    app.add_middleware(Guard, token=token, port=port, hosts=(HOST, "localhost"))
    address = f"http://{HOST}:{port}/?token={token}"
    app.on_startup(lambda: Thread(target=_tell, args=(say, address, port), daemon=True).start())
    with in_language(page_language):  # for all that is served: its tasks begin with what holds here
        add_pages(studio)
        ui.run(
            host=HOST,
            port=port,
            title="fastcal studio",
            dark=None,
            language=_QUASAR[page_language],
            show=address if show else False,
            reload=False,
            show_welcome_message=False,
            reconnect_timeout=60.0,  # a page that is back within it goes on as it was: beside robots, machines are busy
            uvicorn_logging_level="error",
            favicon="🦾",
        )


def _tell(say: Callable[[str], None], address: str, port: int) -> None:
    """Says the address as soon as somebody answers there."""
    while True:
        with socket.socket() as test:
            if test.connect_ex((HOST, port)) == 0:
                break
        time.sleep(0.05)
    say(address)
    sys.stdout.flush()
