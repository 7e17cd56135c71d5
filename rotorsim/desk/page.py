"""Page of the desk: the head that all pages share, and the component that draws everything below it."""

from pathlib import Path

from nicegui import ui
from nicegui.element import Element

from rotorsim.live.page import WEB as SHARED, page_head

WEB = Path(__file__).parent / "web"


class DeskViews(Element, component="web/desk.js", esm={"rotorsim-desk": "web", "rotorsim-live": str(SHARED)}):
    """List of parts, drawing and panels."""


def show_desk() -> None:
    """Put the page together."""
    ui.add_css(WEB / "desk.css")
    with page_head("rotorsim desk"):
        pass
    DeskViews().classes("w-full")
