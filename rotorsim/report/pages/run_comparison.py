"""Page that compares runs: an order's amplitude and phase over the speed in one picture, and a table of the peaks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.report.export.display_units import in_page_units
from rotorsim.report.figures.comparison_plots import line_look
from rotorsim.report.figures.phase import FAINTEST, next_to, phase_axes, phase_lag
from rotorsim.report.figures.theme import compact, style
from rotorsim.report.pages.study import Block, save_study_page
from rotorsim.signals.orders import RunComparison

HEADS = (
    "run",
    "axis",
    "speed [rpm]",
    "amplitude [µm 0-pk]",
    "phase lag [deg]",
    "speed against the first",
    "amplitude against the first",
)


def overlay(found: RunComparison) -> go.Figure:
    """Amplitude (0-pk, um) over phase lag (deg) of every run against speed; a column an axis.

    Whole turns are taken off the phase of a run so that it lies next to that of the first run with this axis.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.overlay(rs.signals.compare_runs({"before": runup, "after": runup}))
    """
    axes = found.axes
    titles = [f"{found.order}X, {axis}" for axis in axes]
    figure = make_subplots(2, len(axes), shared_xaxes=True, shared_yaxes=True, vertical_spacing=0.06,
                           horizontal_spacing=0.08, row_heights=[0.6, 0.4], subplot_titles=titles)  # fmt: skip
    lags: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for number, (name, tracked) in enumerate(found.tracked.items()):
        look = line_look(number)
        for column, axis in enumerate(axes, 1):
            if axis not in tracked["axis"].values:
                continue
            a = tracked["amplitude"].sel(order=found.order, axis=axis).values
            speed, lag = tracked["speed"].values, phase_lag(a, FAINTEST * float(np.abs(a).max(initial=0.0)))
            lag = next_to(lag, speed, *lags.setdefault(axis, (lag, speed)))
            common = {
                "x": compact(speed * TO_RPM, 6),
                "name": name,
                "legendgroup": name,
                "line": look,
                "mode": "lines",
            }
            figure.add_trace(go.Scatter(y=compact(np.abs(a) * TO_UM), showlegend=column == 1, **common), 1, column)
            figure.add_trace(go.Scatter(y=compact(lag), showlegend=False, **common), 2, column)
    figure.update_xaxes(title_text="speed [rpm]", row=2)
    figure.update_yaxes(title_text="amplitude [µm 0-pk]", row=1, col=1)
    phase_axes(figure, 2)
    return style(figure, 560)


def peak_rows(found: RunComparison) -> list[tuple[str, ...]]:
    """Peaks as text, as `HEADS` names the columns."""
    return [
        (p["run"], p["axis"] + ("" if p["local_maximum"] else ", at the end of the run"), f"{p['rpm']:.0f}",
         f"{p['um']:.3g}", f"{p['phase_lag_deg']:.0f}", *(_percent(p, key) for key in ("rpm_change", "um_change")))
        for p in found.peaks()
    ]  # fmt: skip


def _percent(peak: dict[str, object], key: str) -> str:
    value = peak.get(key)
    return f"{100 * value:+.1f} %" if isinstance(value, float) else ""


@in_page_units
def write_run_comparison(
    found: RunComparison, path: str | Path, units: str = "metric", figures: str | None = None
) -> Path:
    """Write the page; raises WriteError where it cannot be written.

    `units` and `figures` as for `write_report`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.signals.compare_runs({"once": runup, "twice": runup})
    >>> rs.report.write_run_comparison(found, "comparison.html").name
    'comparison.html'
    """
    names = " and ".join(found.tracked)
    blocks = [
        Block(f"{found.order}X over the speed", "Amplitudes are 0-pk; a phase is a lag.", figure=overlay(found)),
        Block("Peaks", "Against the nearest peak of the first run.", HEADS, peak_rows(found)),
    ]
    title, about = f"Comparison of runs: {names}", f"{names}: {found.order}X, side by side."
    save_study_page(title, about, blocks, path, units, figures)
    return Path(path)
