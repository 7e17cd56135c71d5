"""Comparisons: results of several machines of one kind, and an order of several runs, in one figure and a table.

The page of a balancing compares unbalance, estimated and known, and vectors before and after the correction weights.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.analysis.campbell import critical_rows
from rotorsim.analysis.shaft_motion import peak_of
from rotorsim.analysis.sweep import SweepResult, heading
from rotorsim.analysis.sweep_definition import QUANTITIES
from rotorsim.balance import Assessment, Conditions, Correction, LeftOut
from rotorsim.balance.unbalance import estimate_table, result_rows as balance_rows
from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_HZ, TO_MPA, TO_RPM, TO_UM
from rotorsim.report import page
from rotorsim.report.operating_map import check_modes
from rotorsim.report.units import quantity
from rotorsim.signals.orders import RunComparison

DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
Results = Mapping[str, xr.Dataset]
Row = dict[str, Any]
ABOUT = {
    "response": "Unbalance responses at the measuring plane",
    "campbell": "Natural frequencies over the speed",
    "map": "Least damping ratios over the speed",
    "sweep": "Quantities over an axis of the sweeps",
}
HEADS = ("run", "axis", "speed [rpm]", "amplitude [µm 0-pk]", "phase lag [deg]", "speed against the first",
         "amplitude against the first")  # fmt: skip


def compare_results(results: Results) -> go.Figure:
    """Results of one kind by name in one figure: of `unbalance_response`, `campbell`, `map_machine` or `sweep`.

    Responses are those of the measuring plane, of maps the least damping ratio over the speed at each pressure, of
    sweeps every quantity that all have over their longest common axis, at the first values of other axes.

    Raises
    ------
    DataError
        If they are of no such kind, or of several.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.campbell(rs.Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=4)
    >>> figure = rs.report.compare_results({"before": found, "after": found})
    """
    return FIGURES[common_kind(results)](results)


def common_kind(results: Results) -> str:
    """The kind of all results; raises DataError if they have none or several, and if there are none."""
    if not results:
        raise DataError(f"results: there are none; give some of one kind: {', '.join(FIGURES)}", argument="results")
    kinds = {
        name: str(found.attrs.get("kind", "record")) if isinstance(found, xr.Dataset) else repr(type(found))
        for name, found in results.items()
    }
    for name, kind in kinds.items():
        if kind not in FIGURES:
            raise DataError(
                f"{name}: is a {kind}; give results of one kind: {', '.join(FIGURES)}, or records only",
                argument="results",
                value=name,
            )
        if kind == "map":
            check_modes(name, results[name])
    (first, kind), *others = kinds.items()
    for name, other in others:
        if other != kind:
            raise DataError(
                f"{name}: is a {other} and {first} a {kind}; give results of one kind", argument="results", value=name
            )
    return kind


def line_look(number: int, name: str) -> dict[str, Any]:
    """Look of the curves of a run or result by its number and name."""
    colour, dash = page.PIN_COLOURS[number % len(page.PIN_COLOURS)], DASHES[number % len(DASHES)]
    return {"colour": colour, "width": 2, "dash": dash, "digits": 6, "name": name, "legendgroup": name}


def _responses(results: Results) -> go.Figure:
    figure = make_subplots(2, 1, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.06)
    first: tuple[np.ndarray, np.ndarray] | None = None
    for number, (name, found) in enumerate(results.items()):
        one = found.isel(place=0)
        x = one["response_re"].sel(axis="x").values + 1j * one["response_im"].sel(axis="x").values
        speed, lag = found["speed"].values, page.phase_lag(x)
        first = first or (lag, speed)
        rpm, look = speed * TO_RPM, line_look(number, name)
        figure.add_trace(page.curve(rpm, one["major"].values * TO_UM, **look), 1, 1)
        figure.add_trace(page.curve(rpm, page.next_to(lag, speed, *first), showlegend=False, **look), 2, 1)
    figure.update_yaxes(title_text="major half axis [µm 0-pk]", rangemode="tozero", row=1, col=1)
    page.phase_axes(figure, 2, "phase lag of x")
    figure.update_xaxes(title_text="speed [rpm]", row=2, col=1)
    return page.style(figure, 560)


def _campbells(results: Results) -> go.Figure:
    figure = make_subplots(2, 1, shared_xaxes=True, row_heights=[0.65, 0.35], vertical_spacing=0.05)
    for number, (name, found) in enumerate(results.items()):
        speed, look = found["speed"].values * TO_RPM, line_look(number, name)
        for k in range(found.sizes["branch"]):
            one = found.isel(branch=k)
            figure.add_trace(page.curve(speed, one["wn"].values * TO_HZ, showlegend=k == 0, **look), 1, 1)
            figure.add_trace(page.curve(speed, one["log_dec"].values, showlegend=False, **look), 2, 1)
    longest = max(results.values(), key=lambda found: float(found["speed"].max()))["speed"].values
    figure.add_trace(
        page.curve(longest * TO_RPM, longest * TO_HZ, page.INK, "1X", 1, "dash", 6, hoverinfo="skip"), 1, 1
    )
    top = max(float(np.nanmax(found["wn"].values)) for found in results.values()) * TO_HZ
    figure.update_yaxes(title_text="natural frequency [Hz]", range=[0, 1.05 * top], row=1, col=1)
    figure.update_yaxes(title_text="log. decrement", row=2, col=1)
    figure.update_xaxes(title_text="speed [rpm]", row=2, col=1)
    return page.style(figure, 640)


def _maps(results: Results) -> go.Figure:
    pressures = sorted({round(float(p), 3) for found in results.values() for p in found["pressure"].values})
    figure = go.Figure()
    for number, (name, found) in enumerate(results.items()):
        speed = page.compact(found["speed"].values * TO_RPM, 6)
        for one in (found.isel(pressure=k) for k in range(found.sizes["pressure"])):
            at = pressures.index(round(float(one["pressure"]), 3))
            figure.add_scatter(
                x=speed, y=page.compact(one["zeta_least"].values), mode="lines+markers", legendgroup=name,
                name=f"{name}, {quantity(float(one['pressure']) * TO_MPA, 'MPa')}",
                line={"color": page.PIN_COLOURS[number % len(page.PIN_COLOURS)], "width": 2,
                      "dash": DASHES[at % len(DASHES)]},
            )  # fmt: skip
    figure.add_hline(y=0, line={"color": page.INK, "width": 1})
    figure.update_xaxes(title_text="speed [rpm]")
    figure.update_yaxes(title_text="least damping ratio")
    return page.style(figure, 480)


def _sweeps(results: Results) -> go.Figure:
    sizes = [found.sizes for found in results.values()]
    common = [name for name in sizes[0] if all(name in one for one in sizes)]
    shared = [name for name in QUANTITIES if all(name in found for found in results.values())]
    if not common or not shared:
        raise DataError(
            "results: the sweeps have no axis and quantity in common; compare sweeps of the same plan",
            argument="results",
        )
    axis = max(common, key=lambda name: min(one[name] for one in sizes))
    figure = make_subplots(len(shared), 1, shared_xaxes=True, vertical_spacing=0.06)
    for row, name in enumerate(shared, 1):
        for number, (label, found) in enumerate(results.items()):
            one = found[name].isel({dim: 0 for dim in found[name].dims if dim != axis})
            values = np.broadcast_to(one.values, found.sizes[axis]) * QUANTITIES[name].factor
            look = line_look(number, label) | {"showlegend": row == 1}
            figure.add_trace(page.curve(found[axis].values, values, **look), row, 1)
        figure.update_yaxes(title_text=QUANTITIES[name].heading, row=row, col=1)
    figure.update_xaxes(title_text=heading(next(iter(results.values())), str(axis)), row=len(shared), col=1)
    return page.style(figure, 160 + 220 * len(shared))


FIGURES: dict[str, Callable[[Results], go.Figure]] = {
    "response": _responses, "campbell": _campbells, "map": _maps, "sweep": _sweeps,
}  # fmt: skip
"""Figure of the results of each kind."""


def result_rows(results: Results) -> list[Row]:
    """The key figures of each result: peaks, critical speeds at 1X, onset by pressure, or the best points of a sweep.

    Raises
    ------
    DataError
        If the results are of several kinds.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.campbell(rs.Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=4)
    >>> rs.report.result_rows({"plain": found})[0]["result"]
    'plain'
    """
    rows = ROWS[common_kind(results)]
    return [{"result": name, **row} for name, found in results.items() for row in rows(found)]


def _peak(found: xr.Dataset) -> Iterator[Row]:
    peak = peak_of(found, str(found["place"].values[0]))
    if peak is not None:
        yield {"speed [rpm]": peak["rpm"], "peak [µm 0-pk]": peak["um"]}


def _critical(found: xr.Dataset) -> Iterator[Row]:
    rows = [row for row in critical_rows(found) if row[0] == 1]
    for _, rpm, direction, zeta, whirl, mode in rows:
        yield {"1X critical speed [rpm]": rpm, "passes": direction, "damping ratio": zeta, "whirl": whirl, "mode": mode}
    if not rows:
        yield {"1X critical speed [rpm]": None}


def _onset(found: xr.Dataset) -> Iterator[Row]:
    onset = found["onset_speed"].values if "onset_speed" in found else np.full(found.sizes["pressure"], np.nan)
    for pressure, speed, row in zip(found["pressure"].values, onset, found["zeta_least"].values, strict=True):
        least = float(np.nanmin(row)) if np.isfinite(row).any() else np.nan
        yield {
            "pressure [MPa]": float(pressure) * TO_MPA, "whirl onset [rpm]": _number(speed, TO_RPM),
            "least damping ratio": _number(least, 1.0),
        }  # fmt: skip


def _number(value: Any, scale: float) -> float | None:
    return None if np.isnan(value) else float(value) * scale


def _best(found: xr.Dataset) -> Iterator[Row]:
    for name, best in SweepResult(found).best.items():
        at = ", ".join(f"{path} = {value}" for path, value in best["at"].items())
        yield {"quantity": name, "best is the": best["best"], "value": best["value"], "unit": best["unit"], "at": at}


ROWS: dict[str, Callable[[xr.Dataset], Iterator[Row]]] = {
    "response": _peak, "campbell": _critical, "map": _onset, "sweep": _best,
}  # fmt: skip
"""Key figures of a result of each kind."""


@page.page_of(dict)
def result_comparison_page(results: Results) -> page.Page:
    """Page of results of one kind in one figure, with their key figures."""
    kind, rows = common_kind(results), result_rows(results)
    heads = tuple(dict.fromkeys(key for row in rows for key in row))
    table = [tuple(_text(row.get(key)) for key in heads) for row in rows]
    names = " and ".join(results)
    blocks = [page.Block(ABOUT[kind], "", figure=compare_results(results)), page.Block("Key figures", "", heads, table)]
    return page.Page(f"Comparison: {names}", f"{ABOUT[kind]} of {names}.", blocks)


def _text(value: object) -> str:
    return "-" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)


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
        look = line_look(number, name)
        for column, axis in enumerate(axes, 1):
            if axis not in tracked["axis"].values:
                continue
            a = tracked["amplitude"].sel(order=found.order, axis=axis).values
            speed, lag = tracked["speed"].values, page.phase_lag(a, page.FAINTEST * float(np.abs(a).max(initial=0.0)))
            lag = page.next_to(lag, speed, *lags.setdefault(axis, (lag, speed)))
            rpm = speed * TO_RPM
            figure.add_trace(page.curve(rpm, np.abs(a) * TO_UM, showlegend=column == 1, **look), 1, column)
            figure.add_trace(page.curve(rpm, lag, showlegend=False, **look), 2, column)
    figure.update_xaxes(title_text="speed [rpm]", row=2)
    figure.update_yaxes(title_text="amplitude [µm 0-pk]", row=1, col=1)
    page.phase_axes(figure, 2)
    return page.style(figure, 560)


def peak_rows(found: RunComparison) -> list[tuple[str, ...]]:
    """Peaks as text, as `HEADS` names the columns."""
    return [
        (p["run"], p["axis"] + ("" if p["local_maximum"] else ", at an end of the tracked speeds"), f"{p['rpm']:.0f}",
         f"{p['um']:.3g}", f"{p['phase_lag_deg']:.0f}", *(_percent(p, key) for key in ("rpm_change", "um_change")))
        for p in found.peaks()
    ]  # fmt: skip


def _percent(peak: dict[str, object], key: str) -> str:
    value = peak.get(key)
    return f"{100 * value:+.1f} %" if isinstance(value, float) else ""


@page.page_of(RunComparison)
def run_comparison_page(found: RunComparison) -> page.Page:
    """Page of an order of several runs, side by side."""
    names = " and ".join(found.tracked)
    about = "Amplitudes are 0-pk; a phase is a lag." + (f" Note: {found.mixed}." if found.mixed else "")
    blocks = [
        page.Block(f"{found.order}X over the speed", about, figure=overlay(found)),
        page.Block("Peaks", "Against the nearest peak of the first run.", HEADS, peak_rows(found)),
    ]
    return page.Page(f"Comparison of runs: {names}", f"{names}: {found.order}X, side by side.", blocks)


G_MM = 1e6
"""g mm in a kg m."""


@page.page_of(Assessment)
def balance_page(found: Assessment) -> page.Page:
    """Page of a balancing."""
    tests, fix = found.tests, found.correction
    blocks = [page.Block("Results", "Unbalances are in g mm.", ("quantity", "value"), balance_rows(found))]
    if tests:
        blocks.append(
            page.Block("Every label estimated from the others", "Lines lead from the known unbalance to the estimate.",
                  figure=left_out_figure(tests, found.conditions))
        )  # fmt: skip
    if fix is not None:
        blocks.append(
            page.Block("1X vectors before and after the correction weights", "After: predicted, not measured.",
                  figure=correction_figure(fix, found.conditions))
        )  # fmt: skip
    if found.estimates:
        heads, rows = estimate_table(found)
        text = f"Estimated by {found.method}; sd is the standard deviation of either component."
        blocks.append(page.Block("Unbalance of the records without a label", text, heads, rows))
    return page.Page("Balancing", "Unbalance from measured 1X vectors.", blocks)


def left_out_figure(tests: Mapping[str, LeftOut], conditions: Conditions) -> go.Figure:
    """Known and estimated unbalance in the plane of each disc; a row a method."""
    names = [p.name for p in conditions.planes]
    titles = [f"{method}, {name}" for method in tests for name in names]
    figure = make_subplots(len(tests), len(names), subplot_titles=titles, vertical_spacing=0.14,
                           horizontal_spacing=0.1)  # fmt: skip
    for row, test in enumerate(tests.values(), start=1):
        for k in range(len(names)):
            truth, found = test.truth[:, k] * G_MM, test.estimates[:, k] * G_MM
            lines = np.stack([truth, found, np.full(len(truth), np.nan)], axis=1).ravel()
            figure.add_trace(page.curve(lines.real, lines.imag, page.INK, width=1, hoverinfo="skip", showlegend=False),
                             row, k + 1)  # fmt: skip
            for values, name, colour, symbol in (
                (truth, "known", page.NEUTRAL, "circle-open"), (found, "estimated", page.PIN_COLOURS[1], "x-thin-open"),
            ):  # fmt: skip
                figure.add_trace(go.Scatter(x=page.compact(values.real), y=page.compact(values.imag), mode="markers",
                                            name=name, text=list(test.labels), legendgroup=name,
                                            showlegend=row == 1 and k == 0,
                                            marker={"color": colour, "symbol": symbol, "size": 8}),
                                 row, k + 1)  # fmt: skip
    figure.update_xaxes(title_text="at 0 deg [g mm]")
    figure.update_yaxes(title_text="at 90 deg [g mm]", col=1)
    for x, y in zip(figure.select_xaxes(), figure.select_yaxes(), strict=True):  # a degree is a degree in every panel
        y.update(scaleanchor=x.plotly_name.replace("axis", ""))
    return page.style(figure, 460 * len(tests))


def correction_figure(fix: Correction, conditions: Conditions) -> go.Figure:
    """1X vectors of every probe and speed, before and after."""
    figure = go.Figure()
    names = [f"{r.name} {s}".strip() for s in conditions.speeds for r in conditions.readings]
    for values, name, colour in (
        (fix.before, "before", page.PIN_COLOURS[0]),
        (fix.after, "after, predicted", page.PIN_COLOURS[1]),
    ):
        figure.add_trace(go.Bar(x=names, y=page.compact(np.abs(values) * TO_UM), name=name, marker_color=colour))
    figure.update_yaxes(title_text="1X [µm 0-pk]")
    return page.style(figure, 380)
