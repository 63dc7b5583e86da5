# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The files of the project that pages show: reports in a frame, and what is downloaded."""

from __future__ import annotations

from nicegui import app
from starlette.responses import FileResponse, PlainTextResponse, Response

from fastcal.errors import InvalidInput
from fastcal.studio.state import Studio

PREFIX = "/project"
_PAGES = {".html"}


def address(name: str) -> str:
    """Where a file of the project is served."""
    return f"{PREFIX}/{name}"


def add_files(studio: Studio) -> None:
    """Serves the files of the project that is open; nothing outside its folder."""

    @app.get(PREFIX + "/{name:path}")
    def read(name: str) -> Response:
        try:
            path = studio.project.path(name)
        except InvalidInput as error:
            return PlainTextResponse(str(error), 404)
        if not path.is_file():
            return PlainTextResponse(f"{name}: is not in the project", 404)
        kind = "inline" if path.suffix in _PAGES else "attachment"
        return FileResponse(
            path, content_disposition_type=kind, filename=path.name, headers={"cache-control": "no-store"}
        )
