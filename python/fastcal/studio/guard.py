# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Who may look: only a browser that was given the token, at the address that the studio listens on."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlencode

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

_REFUSED = b"401: open the address that fastcal studio printed, with its token.\n"
_WRONG_HOST = b"421: the studio answers at the address that it printed.\n"
# The pages fetch nothing from elsewhere, and nothing else may hold them in a frame. Vue compiles its templates.
_POLICY = (
    "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; connect-src 'self' ws: blob: data:; frame-ancestors 'self'"
)


class Guard:
    """Answers 401 to every request, and closes every socket, without the token.

    The token comes once in the address, and is then kept in a cookie that scripts cannot read and other sites do not
    send. A request for another host is refused, as a name that was bound anew to this machine would send it.

    Args:
        app: What is guarded.
        token: The secret.
        port: That the studio listens on.
        hosts: Names under which it answers.
    """

    def __init__(self, app: Application, token: str, port: int, hosts: tuple[str, ...]) -> None:
        self._app, self._token = app, token
        self._cookie = f"fastcal_studio_{port}"
        self._hosts = {f"{host}:{port}" for host in hosts}

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        if headers.get("host") not in self._hosts:
            await _refuse(scope, send, 421, _WRONG_HOST)
            return
        query = parse_qsl(scope["query_string"].decode("latin-1"))
        if scope["type"] == "http" and self._is_token(dict(query).get("token", "")):
            rest = urlencode([pair for pair in query if pair[0] != "token"])
            await _redirect(send, scope["path"] + (f"?{rest}" if rest else ""), f"{self._cookie}={self._token}")
            return
        kept = SimpleCookie(headers.get("cookie", "")).get(self._cookie)
        if kept is None or not self._is_token(kept.value):
            await _refuse(scope, send, 401, _REFUSED)
            return
        await self._app(scope, receive, _with_policy(send) if scope["path"].count("/") <= 1 else send)

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self._token.encode())


def _with_policy(send: Send) -> Send:
    """Says with a page what it may fetch."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message["headers"], (b"content-security-policy", _POLICY.encode())]
        await send(message)

    return sent


async def _redirect(send: Send, to: str, cookie: str) -> None:
    headers = [
        (b"location", to.encode("latin-1")),
        (b"set-cookie", f"{cookie}; HttpOnly; SameSite=Strict; Path=/".encode("latin-1")),
        (b"referrer-policy", b"no-referrer"),
    ]
    await send({"type": "http.response.start", "status": 303, "headers": headers})
    await send({"type": "http.response.body", "body": b""})


async def _refuse(scope: Message, send: Send, status: int, text: bytes) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 4401})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": text})
