"""Live rig served to the browser by a local web server: loopback only, protected by a token, no external resources.

Malformed messages of a page are dropped, errors of the program are one line each on stderr, and the page is opened by a
private file, which keeps the token out of command lines that all users can read. What computes is imported by
`serve_rig` alone, so the page about an invalid machine comes at once.

Three checks on every request: the Host header names the loopback address the server is bound to (a foreign name that
was made to point here is refused), an Origin header names that same place, and the cookie holds the token, which a page
gets by opening the address with `?token=` once. Messages that are too long or too many end their connection.
"""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
import shutil
import socket
import sys
import tempfile
import time
import webbrowser
from collections.abc import Awaitable, Callable, Iterable, Iterator, Mapping, MutableMapping, Sequence
from contextlib import contextmanager
from html import escape
from inspect import iscoroutinefunction
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs

import orjson

from rotorsim.base.errors import DataError
from rotorsim.base.interrupt import Interrupt
from rotorsim.machine import Machine, load_machine

if TYPE_CHECKING:
    from rotorsim.live.folder import RigFolder
    from rotorsim.live.records import Replay

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]

LONGEST = 64_000
"""Longest message or body [bytes]."""
MOST_MESSAGES = 300
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
            await _answer(send, 403, "this page answers only itself; open the address that was printed")
        elif _token_in_address(scope) and hmac.compare_digest(_token_in_address(scope), self.token):
            await _welcome(send, f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/", scope["method"])
        elif not self._known(headers):
            await _answer(send, 403, "the token is missing or wrong; open the whole address that was printed")
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
        return self._count <= MOST_MESSAGES


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
    page = b'<meta name="color-scheme" content="light dark"><meta http-equiv="refresh" content="0; url=/">\n'
    await send({"type": "http.response.body", "body": b"" if method == "HEAD" else page})


async def _answer(send: Send, status: int, sentence: str) -> None:
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"{sentence}\n".encode()})


HOST = "127.0.0.1"
TRIES = 50
GRACE = 10
"""Seconds without any window after which the server ends."""
Announce = Callable[[str, int], None]


def print_address(address: str, taken: int) -> None:
    """Print where the page is."""
    print(f"the page is at {address}; closing it or Ctrl-C ends it")


def serve_rig(
    machine: Machine | str | Path,
    laws: Sequence[Path] | Mapping[str, Any] = (),
    seed: int = 0,
    out: str | Path = "live",
    port: int = 8750,
    browser: bool = True,
    keep_open: bool = False,
    values: Mapping[str, Any] | None = None,
    record: Replay | str | Path | None = None,
    announce: Callable[[str, int], None] = print_address,
) -> None:
    """Run a machine in real time with its page in the browser, until the page is closed or Ctrl-C.

    Parameters
    ----------
    machine : Machine, name or path
    laws : sequence of path, or mapping
        Files of control laws to switch on, or what `read_laws` returns.
    seed : int
        Of the machine's noise.
    out : path
        Folder of scenes and records.
    port : int
        Port on this computer; the next free one if it is taken.
    browser, keep_open : bool
        Whether to open the browser, and to run on after the last window is closed.
    values : mapping, optional
        Settings of a scene.
    record : path, optional
        Record to replay, or its `Replay`.
    announce : callable
        Given the address and the port of the page.

    Raises
    ------
    DataError, LawError

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.live.serve_rig("dtu_gas_bearing")  # doctest: +SKIP
    """
    from rotorsim.live.folder import open_folder
    from rotorsim.live.laws import read_laws
    from rotorsim.live.records import Replay

    loaded = machine if isinstance(machine, Machine) else load_machine(machine)
    known = laws if isinstance(laws, Mapping) else read_laws([Path(path) for path in laws], loaded)
    played = record if isinstance(record, Replay | None) else Replay(Path(record))
    run_rig(open_folder(loaded, known, seed, Path(out), values, played), port, announce, browser, keep_open)


def free_port(wanted: int) -> tuple[socket.socket, int]:
    """Listening socket at the wanted port or the next free one; raises DataError."""
    for port in range(wanted, min(wanted + TRIES, 65536)):
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if sys.platform != "win32":
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((HOST, port))
            listener.listen()
        except OSError:
            listener.close()
            continue
        return listener, listener.getsockname()[1]
    raise DataError(f"--port: none of {wanted} to {wanted + TRIES - 1} is free; give another")


def application(rig_folder: RigFolder) -> Any:
    """Web application of a rig without access control: the page at / and its frames."""
    from rotorsim.live.page import Board

    app = bare_application()

    @app.get("/frame")
    def frame() -> Any:
        return reply(rig_folder.runner.frame())

    @app.get("/settings")
    def settings() -> Any:
        return reply(rig_folder.runner.rig.in_force())

    return with_page(app, lambda: Board(rig_folder))


def bare_application() -> Any:
    """Web application without a page and without the pages that describe it."""
    from fastapi import FastAPI

    return FastAPI(docs_url=None, redoc_url=None, openapi_url=None)


def reply(content: Any) -> Any:
    """Response of plain data, which no browser keeps."""
    from fastapi import Response

    return Response(orjson.dumps(content), media_type="application/json", headers={"cache-control": "no-store"})


def with_page(app: Any, root: Callable[[], object], title: str = "rotorsim live") -> Any:
    """The application with a page of what `root` puts there at /; other addresses are not found."""
    from nicegui import ui

    def page() -> None:
        root()

    ui.page("/")(page)
    ui.run_with(app, title=title, show_welcome_message=False, favicon="🌀", dark=None)
    return app


async def leave_when_empty(server: Any, visited: Event, patience: float) -> None:
    """End the server some seconds after its last window was closed, or after `patience` if there never was one.

    A page that is loaded anew is back before.
    """
    from nicegui import Client

    alone = 0
    while not server.should_exit:
        await asyncio.sleep(1.0)
        present = any(client.has_socket_connection for client in list(Client.instances.values()))
        alone = 0 if present else alone + 1
        server.should_exit = server.should_exit or alone >= (GRACE if visited.is_set() else patience)


def complaint(name: str, problems: Iterable[str]) -> Any:
    """Web page for an invalid machine: its problems, one sentence each."""
    from nicegui import ui

    printed = list(problems)

    def root() -> None:
        ui.label(f"rotorsim live: {name} cannot be run").classes("text-h6")
        for problem in printed:
            ui.label(problem).props('role="alert"').style("font-family: monospace; white-space: pre-wrap")
        ui.label("Correct the file and start rotorsim live again.")

    return with_page(bare_application(), root)


def run_rig(rig_folder: RigFolder, port: int, announce: Announce, show: bool, keep_open: bool) -> None:
    """Run a rig and serve its page; see `serve`."""
    rig_folder.runner.start()
    try:
        serve(application(rig_folder), port, announce, show, keep_open)
    finally:
        rig_folder.runner.close()


def serve(
    application: Any,
    port: int,
    announce: Announce,
    show: bool,
    keep_open: bool,
    patience: float = float("inf"),
    name: str = "rotorsim live",
) -> None:
    """Serve until Ctrl-C or until the last window is closed; `announce` receives address and port.

    `patience` [s] is how long the first window is waited for; lines on stderr begin with the `name`.
    """
    import uvicorn
    from nicegui import app as pages

    listener, taken = free_port(port)
    token = secrets.token_urlsafe(24)
    address = f"http://{HOST}:{taken}/?token={token}"
    config = uvicorn.Config(
        Guard(application, token, HOST, taken), log_config=None, access_log=False, ws_max_size=LONGEST,
        timeout_graceful_shutdown=0,
    )  # fmt: skip
    server = uvicorn.Server(config)
    quiet(name)
    if not keep_open:
        visited = Event()  # some windows stay for less than a second
        pages.on_connect(visited.set)
        pages.on_startup(lambda: leave_when_empty(server, visited, patience))
    try:
        with private_page(address) as page, Interrupt() as early:
            pages.on_startup(lambda: setattr(server, "should_exit", server.should_exit or early.asked > 0))
            announce(address, taken)
            if show:
                webbrowser.open(page)
            server.run(sockets=[listener])
    except KeyboardInterrupt:
        pass
    finally:
        listener.close()


LOGGERS = ("nicegui", "engineio", "socketio", "uvicorn", "asyncio")
MOST = 50
"""Lines that are written; a flood of faults shows nothing new."""
ENDED = "graceful shutdown"
"""Words that the server writes when it ends with pages open."""
WITHOUT_MESSAGE = ("connect", "disconnect")
"""Events that carry nothing from the page; the server library tries their handlers with more and fewer arguments."""
MALFORMED = (KeyError, TypeError, ValueError, AttributeError, IndexError)


class OneLine(logging.Handler):
    """Log formatter with one line per entry."""

    def __init__(self, name: str = "rotorsim live") -> None:
        super().__init__(logging.ERROR)
        self.command, self.lines = name, 0

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record to stderr."""
        error = record.exc_info[1] if record.exc_info else None
        if ENDED in record.getMessage() or isinstance(error, asyncio.CancelledError):
            return
        self.lines += 1
        if self.lines > MOST:
            return
        found = [" ".join(record.getMessage().split())] + ([f"{type(error).__name__}: {error}"] if error else [])
        print(f"{self.command}: {'; '.join(found)}"[:400], file=sys.stderr)
        if self.lines == MOST:
            print(f"{self.command}: these were {MOST} lines; no more are written", file=sys.stderr)


def quiet(name: str = "rotorsim live") -> None:
    """Set up the server's logging, and drop malformed messages before they reach the page library."""
    handler = OneLine(name)
    for one in [one for one in logging.root.manager.loggerDict if one.startswith(tuple(f"{n}." for n in LOGGERS))]:
        logging.getLogger(one).handlers = []  # engineio and socketio bring their own
    for one in LOGGERS:
        logger = logging.getLogger(one)
        logger.handlers, logger.propagate = [handler], False
        logger.setLevel(logging.ERROR)
    from nicegui import core

    for handlers in core.sio.handlers.values():
        for event, handle in handlers.items():
            if event not in WITHOUT_MESSAGE:
                handlers[event] = dropping(handle)


def dropping(handle: Callable[..., Any]) -> Callable[..., Any]:
    """Message handler that drops unreadable messages; errors of controls are handled elsewhere."""
    if iscoroutinefunction(handle):

        async def waited(*arguments: Any) -> Any:
            try:
                return await handle(*arguments)
            except MALFORMED:
                return None

        return waited

    def called(*arguments: Any) -> Any:
        try:
            return handle(*arguments)
        except MALFORMED:
            return None

    return called


@contextmanager
def private_page(address: str) -> Iterator[str]:
    """Address of an owner-readable file that redirects to another address; raises DataError."""
    folder = None
    try:
        folder = Path(tempfile.mkdtemp(prefix="rotorsim-live-"))
        path = folder / "live.html"
        path.touch(mode=0o600)
        path.write_text(f'<meta http-equiv="refresh" content="0; url={escape(address)}">\n', encoding="utf-8")
    except OSError as error:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        raise DataError(
            f"{tempfile.gettempdir()}: takes no file ({error}); set TMPDIR to a folder with room"
        ) from error
    try:
        yield path.as_uri()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
