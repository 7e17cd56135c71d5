"""The desk served to a browser: acts on a design, and answers that arrive panel by panel, under the live page's guard.

A request for answers is overtaken by the next one of its window: what was not begun is left out. A machine without
films is answered in this process; one with films in a child process, which ends where nobody waits for its answer any
more; a report in a child of its own. So nothing that is computed holds up what is typed, and no report a panel.
"""

from __future__ import annotations

import asyncio
import gc
import hashlib
import subprocess
import sys
import warnings
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from threading import Lock, Timer
from time import monotonic
from typing import Any

import orjson
from fastapi import FastAPI, Request, Response
from fastapi.responses import StreamingResponse
from nicegui import app as pages

from fe_shaft.rotor import is_saved_rotor
from rotorsim.base.errors import DataError, MachineFileError, NotCarried, RotorsimError
from rotorsim.base.files import make_folder
from rotorsim.base.processes import Child, ProcessDiedError, one_thread
from rotorsim.desk.design import (
    Design,
    FileChangedError,
    RefusedError,
    machine_from,
    open_design,
    unsaved_edits,
)
from rotorsim.desk.page import show_desk
from rotorsim.desk.panels import (
    FIRST,
    HIGHEST,
    PANELS,
    SLOW,
    TITLES,
    DesignCase,
    DeskPoint,
    answer,
    as_commands,
    as_python,
    in_order,
    point_of,
    too_large,
)
from rotorsim.desk.parts import listed, problem_fields
from rotorsim.desk.starts import STARTS, begin, free
from rotorsim.live.serving import Announce, bare_application, print_address, reply, serve, with_page
from rotorsim.machine import from_ross, machine_text, shipped_machines
from rotorsim.machine.schema import Machine, leaves
from rotorsim.report.design import design_page
from rotorsim.report.machine_sketch import side_view
from rotorsim.report.page import html

NEAR = ("static",)
"""Panels that are answered in this process for machines with films too."""
CALM = 1.5
"""Time [s] without another question after which a slow panel is begun."""
START = 120.0
"""Longest start [s] of a live rig."""


@dataclass(eq=False)
class DesignDesk:
    """A design that windows work on together, and the folder of new files; no design is an empty page."""

    design: Design | None
    folder: Path
    path: Path | None = None
    remark: str = ""
    rigs: list[subprocess.Popen[str]] = field(default_factory=list)

    def state(self, known: int | None = None) -> dict[str, Any]:
        """The state that a page shows of the design, or its number alone where the page has it already."""
        design = self.design
        if design is None:
            starts = [{"key": key, "title": one.title, "text": one.text} for key, one in STARTS.items()]
            files = [path.name for path in _files(self.folder)]
            return {"revision": 0, "starts": starts, "shipped": list(shipped_machines()), "files": files[:200]}
        design.look()
        short = {"revision": design.revision, "saved": design.saved, "changed": design.changed_on_disk(),
                 "file": str(design.path)}  # fmt: skip
        if known == design.revision:
            return short
        machine = design.machine
        view = None if machine is None else _plain_view(machine)
        return short | {
            "name": design.path.name, "undo": len(design.before), "redo": len(design.after), "groups": listed(design),
            "problems": list(design.problems), "at": problem_fields(design), "view": view, "remark": self.remark,
            "unkept": design.unkept,
            "large": "" if machine is None else too_large(machine),
            "films": machine is not None and bool(machine.films), "fed": machine is not None and machine.supplied,
            "panels": [{"name": name, "title": TITLES[name], "slow": name in SLOW} for name in PANELS],
            "text": _digest(design.text), "kept": _digest(design.kept), "tolerance": HIGHEST["tolerance"],
        }  # fmt: skip

    def act(self, name: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """Carry out an act of the page; what it brought besides the new state: a chosen part, or why it was refused."""
        make = ACTS.get(name)
        if make is None or (self.design is None and name not in ("start", "open")):
            return {"refused": {"path": "", "text": "", "sentence": f"{name[:40]!r} is no act of the desk"}}
        try:
            return {"chosen": make(self, {key: str(value) for key, value in values.items()}) or ""}
        except FileChangedError as error:
            return {"conflict": str(error)}
        except (RotorsimError, OSError) as error:
            path = str(getattr(error, "argument", "") or "") if isinstance(error, RefusedError) else ""
            sentence = str(error).removeprefix(f"{path}: ")
            field, _, reason = sentence.partition(": ")
            at = {"field": field, "reason": reason} if name != "set" and self._has(field) else {}
            return {"refused": {"path": path, "text": values.get("text", ""), "sentence": sentence} | at}

    def _has(self, path: str) -> bool:
        """Whether the machine has a field of a path."""
        machine = None if self.design is None else self.design.machine
        return machine is not None and any(path == one for one, *_ in leaves(machine))

    def run_up(self) -> str:
        """Start a live rig of the design as it is; its address."""
        assert self.design is not None
        if self.design.unkept:
            raise RefusedError(f"{self.design.unkept}; save the design elsewhere first", argument="", value="")
        file = self.design.path if self.design.saved else self.design.unsaved
        rig = subprocess.Popen([sys.executable, "-P", "-m", "rotorsim", "live", str(file), "--no-browser"],
                               stdout=subprocess.PIPE, text=True)  # fmt: skip
        self.rigs.append(rig)
        assert rig.stdout is not None
        late, begun = Timer(START, rig.kill), monotonic()
        late.start()
        try:
            for line in rig.stdout:
                if "http://" in line:
                    return line[line.index("http://") :].split()[0]
            code = rig.wait()
        finally:
            late.cancel()
        how = f"ended with exit code {code}" if monotonic() - begun < START else f"did not start within {START:g} s"
        raise MachineFileError(f"the live rig {how}; see the terminal", argument="machine", value=code)

    def close(self) -> None:
        """End the live rigs that were started here."""
        for rig in self.rigs:
            rig.terminate()


def _start(desk: DesignDesk, values: Mapping[str, str]) -> None:
    if values.get("key") not in STARTS:
        raise RefusedError("choose one of the beginnings", argument="", value=values.get("key"))
    _put(desk, begin(values["key"], desk.folder, desk.path))


def _open(desk: DesignDesk, values: Mapping[str, str]) -> None:
    name = values.get("name", "")
    inside = name in {path.name for path in _files(desk.folder)}
    if not inside and name not in shipped_machines():
        raise RefusedError(
            f"{name[:80]!r} is neither a shipped machine nor a file of {desk.folder}", argument="", value=name
        )
    if inside and is_saved_rotor(desk.folder / name):
        with warnings.catch_warnings(record=True, action="always", category=NotCarried) as left:
            machine = from_ross(desk.folder / name)
        _put(desk, Design(machine.text, free(desk.folder, f"{machine.name}_of_ross")))
        desk.remark = " ".join(["This is the machine of a rotor that ROSS saved.", *(str(one.message) for one in left)])
    elif inside:
        _put(desk, open_design(desk.folder / name))
    else:
        _put(desk, Design(machine_text(name), free(desk.folder, name)))


def _files(folder: Path) -> list[Path]:
    """Machine files of a folder, which need not be there yet, and those of rotors that ROSS saved."""
    there = folder.iterdir() if folder.is_dir() else ()
    return sorted(path for path in there if path.suffix in (".toml", ".json") and path.is_file())


def _put(desk: DesignDesk, design: Design) -> None:
    """The design on the desk, its folder made, with the edits of an earlier one that were not saved."""
    make_folder(design.path.parent)
    design.revision = 1 + (desk.design.revision if desk.design is not None else 0)
    left = unsaved_edits(design)
    desk.design, desk.remark = design, ""
    if left is None:
        design.forget_edits()
    else:
        design.replace(left)
        desk.remark = "Edits of an earlier desk that were not saved are here again; undo takes them back."


def _edit(method: Callable[[Design, Mapping[str, str]], Any]) -> Callable[[DesignDesk, Mapping[str, str]], Any]:
    def carry_out(desk: DesignDesk, values: Mapping[str, str]) -> Any:
        assert desk.design is not None
        return method(desk.design, values)

    return carry_out


def _save(desk: DesignDesk, values: Mapping[str, str]) -> None:
    assert desk.design is not None
    name = values.get("name", "")
    if name and (Path(name).name != name or name.startswith(".") or not name.isprintable()):
        way = "is not the name of a file; write e.g. my_rotor.toml"
        raise RefusedError(f"{name[:80]!r} {way}", argument="", value=name)
    path = desk.design.path.with_name(name if name.endswith(".toml") else f"{name}.toml") if name else None
    desk.design.save(path, values.get("anyway") == "yes")
    desk.remark = ""


ACTS: dict[str, Callable[[DesignDesk, Mapping[str, str]], Any]] = {
    "start": _start,
    "open": _open,
    "set": _edit(lambda design, v: design.set(v.get("path", ""), v.get("text", ""), v.get("burst", ""))),
    "add": _edit(lambda design, v: design.add(v.get("kind", ""))),
    "split": _edit(lambda design, v: design.split(v.get("path", ""))),
    "mirror": _edit(lambda design, v: design.mirror(v.get("path", ""))),
    "table": _edit(lambda design, v: design.tabulate(v.get("path", ""), v.get("name", ""), v.get("text", ""))),
    "keep": _edit(lambda design, v: design.keep()),
    "swap": _edit(lambda design, v: design.swap()),
    "forget": _edit(lambda design, v: design.forget()),
    "copy": _edit(lambda design, v: design.copy(v.get("path", ""))),
    "delete": _edit(lambda design, v: design.delete(v.get("path", ""))),
    "undo": _edit(lambda design, v: design.undo()),
    "redo": _edit(lambda design, v: design.redo()),
    "save": _save,
    "take": _edit(lambda design, v: design.take_disk()),
}
"""Questions of a page, by name."""


def _digest(text: str) -> str:
    """Short digest of a text, by which a page distinguishes its answers from those of another; empty for none."""
    return hashlib.sha256(text.encode()).hexdigest()[:12] if text else ""


def _plain_view(machine: Machine) -> dict[str, Any]:
    """Side view as plain data."""
    view = side_view(machine)
    return {
        "shapes": [[s.part, s.kind, [[round(z, 4), round(y, 4)] for z, y in s.corners]] for s in view.shapes],
        "marks": [[m.part, m.kind, round(m.z, 4), round(m.y, 4)] for m in view.marks],
        "rows": [[name, places, [f"{b - a:.5g}" for a, b in pairwise(places)]]
                 for name, places in view.rows.items()],
        "diameters": view.diameters, "start": view.start, "end": view.end, "top": view.top,
    }  # fmt: skip


@lru_cache(maxsize=4)
def case_of(text: str, point: DeskPoint) -> DesignCase:
    """The case of a text; panels of one text share its results."""
    return DesignCase(machine_from(text), point)


def answer_of(text: str, point: DeskPoint, name: str) -> dict[str, Any]:
    """A panel of a text, or the sentence why there is none."""
    try:
        with one_thread():
            return answer(case_of(text, point), name)
    except (RotorsimError, ArithmeticError, ValueError) as error:
        return {"title": TITLES[name], "error": str(error)}


def report_of(text: str, point: DeskPoint) -> str:
    """Page of the design review of a text."""
    return html(design_page(case_of(text, point).review))


def scripts_of(text: str, point: DeskPoint, file: str) -> dict[str, str]:
    """Python script and commands that give the numbers of the page of a text, under the name of its file."""
    case = case_of(text, point)
    return {"python": as_python(case, file), "commands": as_commands(case, file)}


def _takes_long(machine: Machine) -> bool:
    """Whether the panels of a machine are those of a child process."""
    return bool(machine.films or too_large(machine))


@dataclass(eq=False)
class PanelStream:
    """Answers to windows: what each waits for now, and the child that computes films."""

    wanted: dict[str, tuple[int, str, DeskPoint]] = field(default_factory=dict)
    _near: Lock = field(default_factory=Lock)
    _far: Lock = field(default_factory=Lock)
    _child: Child | None = None
    _whole: set[Child] = field(default_factory=set)
    _working: tuple[str, DeskPoint] | None = None
    _closed: bool = False

    async def stream(
        self,
        design: Design,
        window: str,
        names: list[str],
        point: DeskPoint,
        of_kept: Sequence[str] = (),
        near: Sequence[str] = (),
    ) -> AsyncIterator[bytes]:
        """A line of JSON for each panel as soon as it is known, until the window asks for something else.

        Those of the kept design A that the window asks for come after those of the design itself; `near` are the
        panels that are pinned or on view.
        """
        revision, machine = design.revision, design.machine
        if machine is None or design.problems:
            return
        number = self.wanted.get(window, (0, "", point))[0] + 1
        asked = [(design.text, machine, names)]
        if of_kept and design.kept not in ("", design.text):
            asked.append((design.kept, machine_from(design.kept), list(of_kept)))
        self.wanted[window] = number, design.text, point
        self._end_unwanted()
        try:
            for text, one, panels in asked:
                for name in in_order(panels, bool(one.films) and text == design.text, near):
                    if name in SLOW:
                        await asyncio.sleep(CALM)
                    if self.wanted[window][0] != number:
                        return
                    self.wanted[window] = number, text, point
                    far = name in SLOW or (name not in NEAR and _takes_long(one))
                    found = await asyncio.to_thread(self._answer, far, text, point, name, window, number)
                    if found is None:
                        return
                    panel = FIRST.get(name, name)
                    line = {"revision": revision, "panel": panel, "answer": found, "text": _digest(text)}
                    yield orjson.dumps(line) + b"\n"
        finally:
            if self.wanted[window][0] == number:
                self.wanted[window] = number + 1, "", point  # a window that is closed waits for nothing
                self._end_unwanted()

    def _answer(
        self, far: bool, text: str, point: DeskPoint, name: str, window: str, number: int
    ) -> dict[str, Any] | None:
        """A panel; None where the window has asked for something else before it was begun or while a child computed."""
        with self._far if far else self._near:
            if far:
                self._working = text, point  # before it is asked whether that is wanted
            try:
                if self.wanted[window][0] != number:
                    return None
                if not far:
                    return answer_of(text, point, name)
                return dict(self._call(answer_of, text, point, name))
            except ProcessDiedError as error:
                if self.wanted[window][0] != number:
                    return None
                return {"title": TITLES[name], "error": f"the process that computes {error}; type on to try again"}
            finally:
                if far:
                    self._working = None

    async def whole(self, request: Request, function: Callable[..., Any], *arguments: Any) -> Any:
        """Result of a function about the whole of a text, by a child of its own, which ends with the request.

        Raises RotorsimError where the child ends first.
        """
        child = Child()
        self._whole.add(child)
        if self._closed:  # asked after `close` can see the child
            child.kill()
        left = asyncio.create_task(_left(request))
        call = asyncio.create_task(asyncio.to_thread(child.call, function, *arguments))
        try:
            await asyncio.wait((left, call), return_when=asyncio.FIRST_COMPLETED)
            if not call.done():
                child.process.kill()
            return await call
        except ProcessDiedError as error:
            raise RotorsimError(f"the process that computes {error}; ask again") from error
        finally:
            left.cancel()
            child.kill()
            self._whole.discard(child)

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Result of a function by the child, which is begun where there is none."""
        new = self._child is None or not self._child.alive
        child = self._child = Child() if new else self._child
        assert child is not None
        if self._closed:  # asked after `close` can see the child
            child.kill()
        if new:
            child.call(keep_imports)
        return child.call(function, *arguments)

    def _end_unwanted(self) -> None:
        """End the child where it computes what no window waits for."""
        working, child = self._working, self._child
        if working is not None and child is not None and all(one[1:] != working for one in self.wanted.values()):
            with suppress(OSError):
                child.process.kill()

    def close(self) -> None:
        """End the children, and begin no other."""
        self._closed = True
        for child in (self._child, *self._whole):
            if child is not None:
                with suppress(OSError):
                    child.process.kill()


async def _left(request: Request) -> None:
    """Wait until nobody waits for the answer to a request any more."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def _content(request: Request) -> dict[str, Any]:
    """The object that a request holds; an empty one where it holds none."""
    try:
        content = orjson.loads(await request.body())
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _known(names: Any) -> list[str]:
    """The names of panels in what a request holds."""
    return [name for name in names if isinstance(name, str) and name in PANELS] if isinstance(names, list) else []


def application(desk: DesignDesk, answers: PanelStream) -> Any:
    """Web application of a desk without access control: the page at /, the design, its answers and its report."""
    app = bare_application()

    @app.get("/desk")
    def state(known: int = -1) -> Response:
        return reply(desk.state(known))

    @app.post("/desk")
    async def act(request: Request) -> Response:
        content, brought = await _content(request), {}
        acts = content.get("acts", [content])
        for one in acts if isinstance(acts, list) else []:
            if isinstance(one, dict):
                brought = desk.act(str(one.pop("act", "")), one)
        return reply(desk.state() | brought)

    @app.post("/run")
    async def run() -> Response:
        try:
            return reply({"address": await asyncio.to_thread(desk.run_up)})
        except (RotorsimError, OSError, AssertionError) as error:
            return reply({"error": str(error)})

    _add_answers(app, desk, answers)
    return with_page(app, show_desk, "rotorsim desk")


def _add_answers(app: FastAPI, desk: DesignDesk, answers: PanelStream) -> None:
    """Add what is computed of the design: its panels, its scripts and its report."""

    @app.post("/answers")
    async def answer_panels(request: Request) -> Response:
        content = await _content(request)
        names, of_kept, near = (_known(content.get(key)) for key in ("panels", "kept", "near"))
        if desk.design is None:
            return reply({})
        try:
            point = point_of(content)
        except DataError as error:
            return reply({"error": str(error)})
        stream = answers.stream(desk.design, str(content.get("window"))[:40], names, point, of_kept, near)
        return StreamingResponse(stream, media_type="application/x-ndjson", headers={"cache-control": "no-store"})

    @app.post("/scripts")
    async def scripts(request: Request) -> Response:
        content, design = await _content(request), desk.design
        try:
            assert design is not None and design.machine is not None
            asked = design.text, point_of(content), design.path.name
            if _takes_long(design.machine):
                return reply(await answers.whole(request, scripts_of, *asked))
            return reply(await asyncio.to_thread(scripts_of, *asked))
        except (RotorsimError, AssertionError) as error:
            return reply({"error": str(error)})

    @app.get("/report")
    async def report(request: Request, supply: str = "") -> Response:
        if desk.design is None or desk.design.machine is None:
            return Response("begin a design or open one first", media_type="text/plain")
        design = desk.design
        try:
            page = await answers.whole(request, report_of, design.text, point_of({"supply": supply}))
        except RotorsimError as error:
            return Response(str(error), media_type="text/plain; charset=utf-8")
        return Response(page, media_type="text/html; charset=utf-8")


def make_desk(machine: str | Path | None, folder: Path) -> DesignDesk:
    """The desk of a machine file, a shipped machine, a file that is not there yet, or nothing."""
    if machine is None:
        return DesignDesk(None, folder)
    path = Path(machine)
    if path.suffix == ".toml" and not path.exists():
        return DesignDesk(None, path.parent, path)
    desk = DesignDesk(None, path.parent if path.is_file() else folder)
    _put(desk, open_design(machine, folder))
    return desk


def serve_desk(
    machine: str | Path | None = None,
    folder: str | Path = ".",
    port: int = 8760,
    browser: bool = True,
    keep_open: bool = False,
    announce: Announce = print_address,
) -> None:
    """Design a machine in the browser, until the page is closed or Ctrl-C.

    Parameters
    ----------
    machine : name or path, optional
        A machine file, which need not be there yet, or a shipped machine; without it the page is empty.
    folder : path
        Folder of new files.
    port : int
        Port on this computer; the next free one if it is taken.
    browser, keep_open : bool
        Whether to open the browser, and to run on after the last window is closed.
    announce : callable
        Given the address and the port of the page.

    Raises
    ------
    MachineFileError
        For what cannot be read as a machine file.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.desk.serve_desk("plain_rotor")  # doctest: +SKIP
    """
    with ExitStack() as end:
        end.callback(gc.unfreeze)
        keep_imports()
        desk, answers = make_desk(machine, Path(folder)), PanelStream()
        end.callback(desk.close)
        end.callback(answers.close)
        pages.on_shutdown(end.close)  # before the server waits for its threads, which wait for these processes
        serve(application(desk, answers), port, announce, browser, keep_open, name="rotorsim desk")


def keep_imports() -> None:
    """Leave what is imported out of the collector's looks, each of which would take longer than an answer."""
    gc.collect()
    gc.freeze()
