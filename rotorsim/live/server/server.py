"""Local web server of the live rig: loopback only, protected by a token, no external resources."""

from __future__ import annotations

import asyncio
import secrets
import socket
import sys
import webbrowser
from collections.abc import Callable, Iterable
from threading import Event
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.base.interrupt import Interrupt
from rotorsim.live.desk import Desk
from rotorsim.live.runner import Runner
from rotorsim.live.server.guard import LONGEST, Guard
from rotorsim.live.server.messages import quiet
from rotorsim.live.server.private_page import private_page

HOST = "127.0.0.1"
TRIES = 50
GRACE = 10
"""Seconds without any window after which the server ends."""
Announce = Callable[[str, int], None]


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


def application(desk: Desk) -> Any:
    """Web application of a desk without access control: the page at / and its frames."""
    import orjson
    from fastapi import FastAPI, Response

    from rotorsim.live.page.page import Board

    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)

    @app.get("/frame")
    def frame() -> Response:
        body = orjson.dumps(desk.runner.frame())
        return Response(body, media_type="application/json", headers={"cache-control": "no-store"})

    @app.get("/settings")
    def settings() -> Response:
        return Response(orjson.dumps(desk.runner.rig.in_force()), media_type="application/json")

    return _with_page(app, lambda: Board(desk))


def _with_page(app: Any, root: Callable[[], object]) -> Any:
    """The application with a page of what `root` puts there at /; other addresses are not found."""
    from nicegui import ui

    def page() -> None:
        root()

    ui.page("/")(page)
    ui.run_with(app, title="rotorsim live", show_welcome_message=False, favicon="🌀", dark=None)
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
    from fastapi import FastAPI
    from nicegui import ui

    printed = list(problems)

    def root() -> None:
        ui.label(f"rotorsim live: {name} cannot be run").classes("text-h6")
        for problem in printed:
            ui.label(problem).props('role="alert"').style("font-family: monospace; white-space: pre-wrap")
        ui.label("Correct the file and start rotorsim live again.")

    return _with_page(FastAPI(docs_url=None, redoc_url=None, openapi_url=None), root)


def run_desk(desk: Desk, port: int, announce: Announce, show: bool, keep_open: bool) -> None:
    """Run a desk's rig and serve its page; see `serve`."""
    runner: Runner = desk.runner
    runner.start()
    try:
        serve(application(desk), port, announce, show, keep_open)
    finally:
        runner.close()


def _end_if(server: Any, early: Interrupt) -> None:
    """End a server that Ctrl-C reached before it began."""
    server.should_exit = server.should_exit or early.asked > 0


def serve(
    application: Any, port: int, announce: Announce, show: bool, keep_open: bool, patience: float = float("inf")
) -> None:
    """Serve until Ctrl-C or until the last window is closed; `announce` receives address and port.

    `patience` [s] is how long the first window is waited for.
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
    quiet()
    if not keep_open:
        visited = Event()  # some windows stay for less than a second
        pages.on_connect(visited.set)
        pages.on_startup(lambda: leave_when_empty(server, visited, patience))
    try:
        with private_page(address) as page, Interrupt() as early:
            pages.on_startup(lambda: _end_if(server, early))
            announce(address, taken)
            if show:
                webbrowser.open(page)
            server.run(sockets=[listener])
    except KeyboardInterrupt:
        pass
    finally:
        listener.close()
