"""Picture of the run-up in the README: `python docs/runup_figure.py` writes docs/runup.png."""

from __future__ import annotations

from pathlib import Path

import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

import rotorsim as rs
from rotorsim.report.orders import add_order_lines, colour_axis, order_traces, spectrum_trace
from rotorsim.report.page import style
from rotorsim.report.run import analyse

ORDER_COLOURS = {1: "#0072B2", 2: "#D55E00", 3: "#009E73"}


def runup_figure(record: xr.Dataset) -> go.Figure:
    """Amplitude of disc y at 1X, 2X, 3X against speed, next to the waterfall of disc y."""
    run = analyse(record)
    titles = ["Disc y: amplitude of the orders", "Disc y: spectra"]
    figure = make_subplots(1, 2, horizontal_spacing=0.09, subplot_titles=titles)
    for order in run.tracked["order"].values:
        amplitude, _ = order_traces(run, int(order), "y")
        figure.add_trace(
            amplitude.update(name=f"{order}X", line={"color": ORDER_COLOURS[int(order)], "width": 3}), 1, 1
        )
    figure.add_trace(spectrum_trace(run, "frequency", run.spectra["amplitude"].sel(axis="y").values), 1, 2)
    add_order_lines(figure, run, (1, 2, 3), 1, 2)
    figure.update_xaxes(title_text=run.abscissa(run.tracked)[1], range=run.reach)
    figure.update_yaxes(title_text="amplitude [µm 0-pk]", rangemode="tozero", col=1)
    figure.update_yaxes(title_text="frequency [Hz]", range=[0, float(run.spectra["frequency"][-1])], col=2)
    style(figure, 700, coloraxis=colour_axis(run), width=1400)
    figure.update_layout(font_size=18, margin={"l": 80, "r": 40, "t": 60, "b": 70})
    figure.update_layout(
        legend={"x": 0.02, "yref": "paper", "xanchor": "left", "y": 0.98, "yanchor": "top", "orientation": "v"}
    )
    figure.update_annotations(font_size=20)
    figure.update_xaxes(showgrid=False, col=2)
    figure.update_yaxes(showgrid=False, col=2)
    return figure


if __name__ == "__main__":
    record = rs.experiments.runup("dtu_gas_bearing")
    rs.report.save_png(runup_figure(record), Path(__file__).with_name("runup.png"))
