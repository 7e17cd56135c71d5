"""Page of the live rig: a column of controls and the views that `web/views.js` draws; all windows operate one rig."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count, groupby
from pathlib import Path
from typing import Any

from nicegui import ui
from nicegui.element import Element
from nicegui.elements import scene as nicegui_scene

from rotorsim.base.errors import RotorsimError
from rotorsim.live.folder import RigFolder
from rotorsim.live.rig import SCATTER
from rotorsim.live.settings import BEARING, Control

WEB = Path(__file__).parent / "web"
SCENE = Path(nicegui_scene.__file__).parent / "dist"
REFRESH = 0.2
"""Seconds between two readings of the rig."""
LIST = 2.0
"""Seconds between two listings of the folder of its files."""
LEVERS = ("drive", "sense", "noise", "controller", BEARING)
"""Switches of the rig."""


@contextmanager
def page_head(title: str) -> Iterator[None]:
    """Head of a page: its title, what is put into the block, and the switch between dark and light."""
    dark = ui.dark_mode(value=None)
    ui.add_css(WEB / "live.css")
    with ui.row().classes("live-head w-full items-center gap-4"):
        ui.label(title).classes("text-h6")
        yield
        ui.button("Dark / light", on_click=lambda: dark.set_value(not dark.value), color=None).props("dense flat")


class PageViews(Element, component="web/views.js", esm={"rotorsim-live": "web", "nicegui-scene": str(SCENE)}):
    """Plots and readings of the rig."""

    def __init__(self, geometry: dict[str, Any]) -> None:
        super().__init__()
        self._props["rig"] = geometry


class Slider(ui.slider):
    """Slider positioned by the browser alone, so that echoes do not pull it back during a fast drag."""

    LOOPBACK = False


class Board:
    """Page of one browser window.

    A control that was turned here shows again the rig's value once the rig has carried out its last order.
    """

    def __init__(self, rig_folder: RigFolder) -> None:
        self.rig_folder, self.runner = rig_folder, rig_folder.runner
        self.settings = self.runner.rig.settings
        self._fields: dict[str, list[Callable[[Any], None]]] = {}
        self._ordered: dict[str, int] = {}
        self._obeyed: dict[str, int] = {}
        self._orders = count()
        self._typing: set[str] = set()
        self._showing = False
        self._seen, self._notified = -1, self.runner.rig.sentences
        self._build()
        ui.timer(REFRESH, self._refresh)
        ui.timer(LIST, self._list)

    def _build(self) -> None:
        with page_head(f"rotorsim live: {self.rig_folder.machine.name}"):
            self._toggle("pace", "simulation speed")
            ui.button("Hit x", on_click=lambda: self.runner.strike(0)).props('dense aria-label="hit x"')
            ui.button("Hit y", on_click=lambda: self.runner.strike(1)).props('dense aria-label="hit y"')
            ui.button("Reset", on_click=self.runner.reset).props('dense outline aria-label="reset to equilibrium"')
            self._record = ui.button("Record", on_click=self._toggle_record).props('dense outline aria-label="record"')
            self._state = ui.label("").props('aria-live="polite"')
        with ui.row().classes("live-page w-full items-start"):
            with ui.column().classes("live-controls"):
                self._tabs()
            with ui.column().classes("live-main"):
                PageViews(self.runner.geometry.as_dict()).classes("w-full").on("shortcut", self._key)

    def _tabs(self) -> None:
        with ui.tabs().props("dense") as tabs:
            names = ["Operate", "Effects", "Tour", "Files"]
            pages = [ui.tab(name) for name in names]
        with ui.tab_panels(tabs, value=pages[0]).classes("w-full"):
            for page, build in zip(pages, (self._operate, self._effects, self._tour, self._files), strict=True):
                with ui.tab_panel(page).classes("q-pa-sm"):
                    build()

    def _operate(self) -> None:
        for key in self._levers():
            with ui.row().classes("items-center"):
                ui.label(key).classes("live-name")
                self._toggle(key, key)
        for control in self.settings.operating.values():
            self._number(control)

    def _levers(self) -> list[str]:
        """Switches of the rig that can be turned: with a law to switch on, noise to switch off."""
        idle = {"controller"} if len(self.settings.switches["controller"]) < 2 else set()
        if not any(key in self.settings.sliders for key in SCATTER):
            idle.add("noise")
        return [key for key in LEVERS if key not in idle and key in self.settings.switches]

    def _effects(self) -> None:
        ui.label("A slider begins where its effect changes nothing.").classes("text-caption")
        ui.button("Back to the machine file", on_click=self.runner.restore_effects).props("dense outline no-caps")
        for name, controls in groupby(self.settings.sliders.values(), key=lambda c: c.key.partition(".")[0]):
            with ui.expansion(name.replace("_", " ")).props("dense").classes("w-full"):
                for control in controls:
                    self._number(control)

    def _tour(self) -> None:
        for stop in self.rig_folder.tour:
            with ui.card().props("flat bordered").classes("w-full q-pa-sm"):
                ui.button(stop.title, on_click=lambda stop=stop: self.rig_folder.visit(stop)).props("dense")
                ui.label(stop.text).classes("text-body2")

    def _files(self) -> None:
        name = ui.input("name of a scene", value="scene").props("dense").classes("w-full")
        ui.button("Save scene", on_click=lambda: self._try(lambda: self.rig_folder.save_scene(name.value))).props(
            "dense"
        )
        ui.label(f"in {self.rig_folder.folder}").classes("text-caption")
        self._lists = ui.column().classes("w-full")
        self._listed: Any = None
        ui.button("Back to the plant", on_click=lambda: self.runner.play(None)).props("dense outline")
        self._place = Slider(min=0, max=1, step=0.01, value=0).props('aria-label="place in the replay"')
        self._place.on("change", lambda: self._seek())

    def _number(self, control: Control) -> None:
        """A slider and a field for one number."""
        key, least = control.key, -1 if control.low < control.neutral else 0
        low, high = f"{control.low / control.scale:.6g}", f"{control.high / control.scale:.6g}"
        with ui.row().classes("live-number items-center no-wrap"):
            ui.label(f"{control.label}" + (f" [{control.shown}]" if control.shown else "")).classes("live-name")
            slider = Slider(min=least, max=1, step=0.001, value=0).props(f'dense aria-label="{key}"')
            field = ui.number(format="%.6g").props(f'dense aria-label="{key} value"').classes("live-field")
            field.tooltip(f"{control.doc} {low} to {high}".strip())

        def show(value: float) -> None:
            if control.clamp(control.value(slider.value))[0] != value:
                slider.value = control.place(value)
            field.value = float(f"{value / control.scale:.6g}")

        def turned(event: Any) -> None:
            if not self._showing and is_number(event.value):
                self._order(key, control.value(event.value))

        def typing() -> None:
            if not self._showing:
                self._typing.add(key)

        def typed() -> None:
            self._typing.discard(key)
            if is_number(field.value):
                self._order(key, float(field.value) * control.scale)

        def left() -> None:
            self._typing.discard(key)
            self._seen = -1

        slider.on_value_change(turned)
        field.on_value_change(typing)
        field.on("change", typed)
        field.on("blur", left)
        self._fields.setdefault(key, []).append(show)

    def _toggle(self, key: str, label: str) -> None:
        def turned(event: Any) -> None:
            if not self._showing:
                self._order(key, event.value)

        switch = ui.toggle(list(self.settings.switches[key]), value=self.settings.positions[key], on_change=turned)
        switch.props(f'dense no-caps aria-label="{label}"')
        self._fields.setdefault(key, []).append(lambda value: _stand(switch, value))

    def _order(self, key: str, value: Any) -> None:
        number = self._ordered[key] = next(self._orders)

        def obey() -> None:
            try:
                self.runner.apply(key, value)
            finally:
                self._obeyed[key] = max(number, self._obeyed.get(key, number))

        if not self.runner.order(obey):
            self._obeyed[key] = number
            ui.notify("too many changes at once; wait a moment", type="warning")

    def _refresh(self) -> None:
        """Show the rig's settings, messages and files."""
        self._refresh_controls()
        rig = self.runner.rig
        for number, sentence in list(rig.messages):
            if number > self._notified:
                self._notified = number
                ui.notify(sentence, position="bottom-left", timeout=8000, multi_line=True)
        recorder, replay = self.runner.recorder, self.runner.replay
        self._record.text = "Record" if recorder is None else f"Stop ({recorder.seconds:.0f} s)"
        self._state.text = "" if replay is None else f"replay of {replay.name}"

    def _refresh_controls(self) -> None:
        """Show every setting but those being typed, and those that were ordered and are not yet carried out."""
        settings = self.runner.rig.settings
        obeyed = [key for key, number in self._ordered.items() if self._obeyed.get(key) == number]
        if self._seen == settings.revision and not obeyed:
            return
        self._seen = settings.revision
        for key in obeyed:
            del self._ordered[key]
        for key, value in settings.everything().items():
            if key not in self._ordered and key not in self._typing:
                self._show(key, value)

    def _show(self, key: str, value: Any) -> None:
        """Put a value into a control without taking that for somebody's hand."""
        self._showing = True
        try:
            for show in self._fields.get(key, ()):
                show(value)
        finally:
            self._showing = False

    def _list(self) -> None:
        """Files by name, drawn again when there are others."""
        found = (tuple(self.rig_folder.scenes()), tuple(self.rig_folder.records()))
        if found == self._listed:
            return
        self._listed = found
        self._lists.clear()
        with self._lists:
            for title, names, act in (
                ("Scenes", found[0], self.rig_folder.load_scene),
                ("Records", found[1], self.rig_folder.replay),
            ):
                ui.label(title if names else f"{title}: none yet").classes("text-subtitle2")
                for name in names:
                    button = ui.button(name, on_click=lambda act=act, name=name: self._try(lambda: act(name)))
                    button.props("dense flat no-caps")

    def _toggle_record(self) -> None:
        if self.runner.recorder is None:
            self._try(self.rig_folder.record)
        else:
            self._try(self.runner.stop_recording)

    def _seek(self) -> None:
        replay = self.runner.replay
        if replay is not None:
            place = float(self._place.value) * replay.samples if is_number(self._place.value) else 0.0
            self.runner.order(lambda: replay.seek(place * replay.Ts))

    def _try(self, what: Callable[[], Any]) -> None:
        try:
            what()
        except (RotorsimError, OSError) as error:
            ui.notify(str(error), type="negative", multi_line=True)

    def _key(self, event: Any) -> None:
        acts: dict[str, Callable[[], Any]] = {
            " ": self.runner.toggle_pause, "x": lambda: self.runner.strike(0), "y": lambda: self.runner.strike(1),
            "r": self.runner.reset,
        }  # fmt: skip
        if event.args in acts:
            acts[event.args]()


def is_number(value: Any) -> bool:
    """True if a page sent a number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _stand(switch: ui.toggle, value: str) -> None:
    switch.value = value
