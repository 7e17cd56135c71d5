"""Access control of the live server: host, origin, token and message rate.

Three checks on everything: the Host header names the loopback address the server is bound to (a foreign name that was
made to point here is refused), an Origin header names that same place, and the cookie holds the token, which a page
gets by opening the address with `?token=` once. Messages that are too long or too many end their connection.
"""

from __future__ import annotations

import hmac
import time
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qs

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]

LONGEST = 64_000
"""Longest message or body [bytes]."""
MOST = 300
"""Messages of a connection, or bodies of all, in a second."""


class Guard:
    """ASGI middleware that checks host, origin, token and message rate."""

    def __init__(self, app: Any, token: str, host: str, port: int) -> None:
        self.app, self.token = app, token
        self.places = {f"{host}:{port}", f"localhost:{port}"}
        self.cookie = f"rotorsim_{port}"
        self._bodies = MessageRate()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer it here."""
        if scope["type"] == "http":
            await self._http(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
        else:
            await self.app(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = _headers(scope)
        if not self._from_here(headers):
            await _answer(send, 403, "this rig answers only pages of its own; open the address it printed")
        elif _token_in_address(scope) and hmac.compare_digest(_token_in_address(scope), self.token):
            await _welcome(send, f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/", scope["method"])
        elif not self._known(headers):
            await _answer(send, 403, "the token is missing or wrong; open the whole address that rotorsim live printed")
        elif not headers.get("content-length", "0").isdecimal() or int(headers.get("content-length", "0")) > LONGEST:
            await _answer(send, 413, "the message is too long")
        elif scope["method"] != "GET" and not self._bodies.fits():
            await _answer(send, 429, "too many messages")
        else:
            await self.app(scope, _limited(receive, MessageRate()), send)

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = _headers(scope)
        if "origin" in headers and self._from_here(headers) and self._known(headers):
            await self.app(scope, _limited(receive, MessageRate()), send)
            return
        await receive()
        await send({"type": "websocket.close", "code": 1008})

    def _from_here(self, headers: dict[str, str]) -> bool:
        origin = headers.get("origin")
        return headers.get("host") in self.places and (
            origin is None or origin.removeprefix("http://") == headers["host"]
        )

    def _known(self, headers: dict[str, str]) -> bool:
        pairs = (part.strip().partition("=") for part in headers.get("cookie", "").split(";"))
        return any(name == self.cookie and hmac.compare_digest(held.encode(), self.token.encode())
                   for name, _, held in pairs)  # fmt: skip


class MessageRate:
    """Counter of events within one second."""

    def __init__(self) -> None:
        self._begin, self._count = 0.0, 0

    def fits(self) -> bool:
        """Count an event; True if it is within the limit."""
        now = time.monotonic()
        if now - self._begin > 1.0:
            self._begin, self._count = now, 0
        self._count += 1
        return self._count <= MOST


def _limited(receive: Receive, rate: MessageRate) -> Receive:
    """Incoming messages; too many of them count as a closed connection."""
    total = 0

    async def take() -> MutableMapping[str, Any]:
        nonlocal total
        message = await receive()
        if message["type"] == "http.request":
            total += len(message.get("body", b""))
            return message if total <= LONGEST else {"type": "http.disconnect"}
        if message["type"] == "websocket.receive":
            size = len(message.get("bytes") or b"") + len(message.get("text") or "")
            if size > LONGEST or not rate.fits():
                return {"type": "websocket.disconnect", "code": 1009}
        return message

    return take


def _headers(scope: Scope) -> dict[str, str]:
    return {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}


def _token_in_address(scope: Scope) -> str:
    if scope["path"] != "/":
        return ""
    token = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])[0]
    return token if token.isascii() else ""


async def _welcome(send: Send, cookie: str, method: str) -> None:
    """Give the cookie and lead on to / by a page of this server: after a redirect from elsewhere, as from the file that
    opens the browser, a strict cookie would not be sent."""
    headers = [(b"content-type", b"text/html; charset=utf-8"), (b"set-cookie", cookie.encode())]
    headers += [(b"cache-control", b"no-store"), (b"referrer-policy", b"no-referrer")]
    await send({"type": "http.response.start", "status": 200, "headers": headers})
    body = b"" if method == "HEAD" else b'<meta http-equiv="refresh" content="0; url=/">\n'
    await send({"type": "http.response.body", "body": body})


async def _answer(send: Send, status: int, sentence: str) -> None:
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"{sentence}\n".encode()})
