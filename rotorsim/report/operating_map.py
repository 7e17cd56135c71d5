"""Operating map: what is safe, Campbell diagram, whirl onset and lift-off, film coefficients; its page."""

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.analysis.operating_map import unsafe_lines, unsafe_reasons
from rotorsim.base.errors import DataError
from rotorsim.base.rounding import whirl_sense
from rotorsim.base.units import TO_HZ, TO_MPA, TO_RPM, TO_UM
from rotorsim.report.page import (
    INK,
    PIN_COLOURS,
    UNSAFE,
    Block,
    Page,
    compact,
    curve,
    faint,
    machine_entry,
    page_of,
    shade_growth,
    style,
)
from rotorsim.report.units import quantity

UNKNOWN = "#5f6b73"
MAP_SCALE = [[0, "#ffffff"], [0.5, "#cfe2f1"], [1, "#6fa9d6"]]
"""Light enough for numbers on the lines and for the shade above."""
DASHES = ("solid", "dash", "dot", "dashdot")
WHIRLS = {"forward": "triangle-up", "backward": "triangle-down"}
"""Mark of each sense of whirl; others are circles."""
EQUAL = 1e-6
"""Relative difference below which values count as one."""
HEADS = ("speed [rpm]", "pressure [MPa]", "eccentricity ratio", "lower mode [Hz]", "its damping ratio",
         "upper mode [Hz]", "its damping ratio")  # fmt: skip
CRITICAL_HEADS = ("pressure [MPa]", "order", "speed [rpm]", "damping ratio", "counts for safe")
GAINS = ("gain x by x [µm/V]", "gain y by y [µm/V]")
MOST_ROWS = 400
Panel = tuple[str, str, float, dict[str, int | str]]
CONTOURS: tuple[Panel, ...] = (
    ("eccentricity ratio", "eccentricity_ratio", 1.0, {}),
    ("smallest film [µm]", "h_min", TO_UM, {}),
    ("gas flow [mg/s]", "mass_flow", 1e6, {"injector": "sum"}),
    ("lower mode [Hz]", "wn", TO_HZ, {"mode": 0}),
    ("upper mode [Hz]", "wn", TO_HZ, {"mode": 1}),
    ("least damping ratio", "zeta_least", 1.0, {}),
    ("gain x by x [µm/V]", "static_gain", TO_UM, {"axis": 0, "reference": 0}),
    ("gain y by y [µm/V]", "static_gain", TO_UM, {"axis": 1, "reference": 1}),
    ("gain x by y [µm/V]", "static_gain", TO_UM, {"axis": 0, "reference": 1}),
    ("delay x [ms]", "delay", 1e3, {"axis": 0}),
    ("delay y [ms]", "delay", 1e3, {"axis": 1}),
    ("whirl ratio, lower mode", "whirl_ratio", 1.0, {"mode": 0}),
)


@page_of(xr.Dataset, "map")
def map_page(found: xr.Dataset) -> Page:
    """Page of an operating map; of further axes the first value is drawn."""
    check_modes("map", found)
    return Page(f"{machine_entry(found.attrs)}: operating map", _about(found), blocks(plane(found)))


def check_modes(name: str, found: xr.Dataset) -> None:
    """Raise DataError for a map none of whose points has modes."""
    if not {"wn", "zeta_least"} <= set(found):
        raise DataError(f"{name}: no point of the map has modes, so none can be drawn; give a higher supply pressure",
                        argument="result", value=name)  # fmt: skip


def _about(found: xr.Dataset) -> str:
    lifted, points = int(found["lifted"].sum()), int(found["lifted"].size)
    extra = [d for d in found["lifted"].dims if d not in ("pressure", "speed")]
    more = ""
    if extra:
        first = ", ".join(f"{found[d].attrs.get('long_name', d)} = {found[d].values[0]:g} "
                          f"{found[d].attrs.get('units', '')}" for d in extra)  # fmt: skip
        more = f" Drawn at {first}; the file holds all values."
    reasons = "; ".join(unsafe_lines(found))
    unsafe = f" Not safe: {reasons}." if reasons else ""
    cut = "" if found.attrs.get("ended") == "complete" else " The map was interrupted and is not complete."
    return (
        f"Linear analysis of film, injectors and rotor together at {points} operating points, {lifted} of them lifted."
        f"{more}{cut}{unsafe} This is a simulation; numbers of a machine file marked calibrated were fitted."
    )


def blocks(one: xr.Dataset) -> list[Block]:
    """Sections that the map allows."""
    margin = 100 * float(one.attrs.get("safe_margin", 0.15))
    least, unknown = float(one.attrs.get("least_amplification", 2.5)), bool(np.isnan(one["safe"].values).any())
    out = []
    if one.sizes["speed"] > 1 and one.sizes["pressure"] > 1 and varying(one):
        shaded = (
            f"Shaded red: not carried by the film, a mode grows or has no damping, or within {margin:g} % of a "
            f"critical speed, where the speed equals the natural frequency of a mode that amplifies {least:.3g} times "
            "or more (searched beyond the ends of the map as far as it matters). "
            + ("Shaded grey: not known, because not every mode could be searched. " if unknown else "")
            + "Whirl ratio: 1 a forward circle, 0 a line, -1 a backward circle. "
            + "".join(f"All over the map: {title} {value:.4g}. " for title, value in constants(one))
        ).strip()
        out.append(Block("Operating map", shaded, figure=contour_figure(one)))
    if one.sizes["speed"] > 1 and np.isfinite(one["branch_wn"]).any():
        text = (
            "The lowest modes, followed over the speed. Triangles up whirl forward at the disc, down backward. "
            "Crosses: orders of the speed meet a mode. Shaded: a mode grows at one of the pressures."
        )
        out.append(Block("Campbell diagram", text, figure=campbell_figure(one)))
    if critical := _critical_rows(one):
        text = "Where an order of the speed meets a mode."
        counted = f" Those of 1X that amplify {least:.3g} times or more, 1/(2 damping ratio), count for what is safe."
        if "crossing_speed" not in one:
            text = "Where the speed meets a mode near enough to decide what is safe; other modes and orders on request."
        out.append(Block("Critical speeds", text + counted, CRITICAL_HEADS, critical[:MOST_ROWS]))
    if has_onset(one):
        out.append(_onset_block(one))
    if one.sizes["pressure"] > 1 and "film_stiffness" in one and np.isfinite(one["film_stiffness"].values).any():
        rpm = float(one["speed"].values[one.sizes["speed"] // 2]) * TO_RPM
        text = f"At {rpm:.0f} rpm, at whirl frequency 0 and those of the two lowest modes unless given otherwise."
        out.append(Block("Film coefficients", text, figure=film_figure(one)))
    missing = _missing(one)
    if missing:
        out.append(Block("Not shown", "", ("figure", "reason"), missing))
    rows = _rows(one)
    text = "" if len(rows) <= MOST_ROWS else f"The first {MOST_ROWS} of {len(rows)} points; all are in the file."
    heads = (*HEADS, *(GAINS if has_gains(one) else ()), "safe")
    return [*out, Block("Point by point", text, heads, rows[:MOST_ROWS])]


def _critical_rows(one: xr.Dataset) -> list[tuple[str, ...]]:
    """Critical speeds by pressure: of every order that was asked for, else those of 1X that decide what is safe."""
    every = "crossing_speed" in one
    found = one if every else one.expand_dims(order=[1]).transpose("pressure", "order", ...)
    name = "crossing" if every else "critical"
    numbers = (found[f"{name}_{part}"].transpose("pressure", "order", ...).values for part in ("speed", "zeta"))
    least = float(one.attrs.get("least_amplification", 2.5))
    return [
        (
            f"{pressure * TO_MPA:.3g}",
            f"{order}X",
            f"{speed * TO_RPM:.0f}",
            f"{zeta:.3g}",
            "yes" if order == 1 and 2 * least * zeta <= 1 else "no",
        )
        for pressure, by_order in zip(found["pressure"].values, zip(*numbers, strict=True), strict=True)
        for order, row in zip(found["order"].values, zip(*by_order, strict=True), strict=True)
        for speed, zeta in zip(*row, strict=True)
        if np.isfinite(speed)
    ]


def _missing(one: xr.Dataset) -> list[tuple[str, str]]:
    """Results that were asked for and hold no number, with the reason."""
    reasons = {"onset_speed": ("whirl onset", "no mode grows at any pressure up to the highest speed searched"),
               "lift_off_pressure": ("lift-off", "no pressure carries the rotor at any of the speeds")}  # fmt: skip
    if "onset_looked" in one and (one["onset_looked"].values != 1).any():
        reasons["onset_speed"] = "whirl onset", "not known: the number of modes is not proven at every speed"
    return [reason for name, reason in reasons.items() if name in one and not np.isfinite(one[name]).any()]


def _rows(one: xr.Dataset) -> list[tuple[object, ...]]:
    rows: list[tuple[object, ...]] = []
    gains, reasons = has_gains(one), unsafe_reasons(one)
    for i, pressure in enumerate(one["pressure"].values):
        for j, speed in enumerate(one["speed"].values):
            p = one.isel(pressure=i, speed=j)
            point = f"{speed * TO_RPM:.0f}", f"{pressure * TO_MPA:.3g}"
            if float(p["lifted"]) != 1:
                rows.append((*point, "not lifted", *[""] * (6 if gains else 4), "no: not carried"))
                continue
            wn, zeta, gain = p["wn"].values * TO_HZ, p["zeta"].values, p["static_gain"].values * TO_UM
            numbers = (float(p["eccentricity_ratio"]), *(float(v) for v in (wn[0], zeta[0], wn[1], zeta[1])))
            own = (float(gain[0, 0]), float(gain[1, 1])) if gains else ()
            why = ", ".join(what for what, there in reasons.items() if bool(there.isel(pressure=i, speed=j)))
            safe = {1.0: "yes", 0.0: f"no: {why}"}.get(float(p["safe"]), "not known")
            rows.append((*point, *numbers, *own, safe))
    return rows


def plane(found: xr.Dataset) -> xr.Dataset:
    """The map over pressure and speed alone: the first value of every further axis that comes with a `pressure`."""
    extra = [d for d in found["lifted"].dims if d not in ("pressure", "speed")]
    return found.isel({d: 0 for d in extra})


def contour_figure(found: xr.Dataset) -> go.Figure:
    """A panel for each quantity that varies over speed [rpm] and pressure [MPa]; shaded where it is not safe."""
    panels = varying(found)
    columns = min(3, len(panels))
    rows = -(-len(panels) // columns)
    figure = make_subplots(rows, columns, shared_xaxes="all", shared_yaxes="all", horizontal_spacing=0.06,
                           vertical_spacing=0.6 / (rows * 5), subplot_titles=[p[0] for p in panels])  # fmt: skip
    x, y = found["speed"].values * TO_RPM, found["pressure"].values * TO_MPA
    for k, (title, name, scale, index) in enumerate(panels):
        row, column = k // columns + 1, k % columns + 1
        values = _values(found, name, index) * scale
        figure.add_trace(
            go.Contour(x=compact(x), y=compact(y), z=compact(values), colorscale=MAP_SCALE, showscale=False,
                       contours={"showlabels": True, "labelfont": {"size": 10, "color": INK}}, line={"width": 0.8},
                       hovertemplate=f"%{{x:.0f}} rpm, %{{y:.3g}} MPa: %{{z:.4g}}<extra>{title}</extra>",
                       ncontours=9), row, column)  # fmt: skip
        for shade in _shades(found, x, y):
            figure.add_trace(shade, row, column)
        figure.update_xaxes(range=[x[0], x[-1]], row=row, col=column)
        figure.update_yaxes(range=[y[0], y[-1]], row=row, col=column)
        if k + columns >= len(panels):
            figure.update_xaxes(showticklabels=True, row=row, col=column)
            figure.update_xaxes(title_text="speed [rpm]", row=row, col=column)
        if column == 1:
            figure.update_yaxes(title_text="pressure [MPa]", row=row, col=column)
    figure = style(figure, 85 + 290 * rows, hovermode="closest")
    return figure.update_annotations(font_size=13).update_xaxes(tickfont_size=12, nticks=5)


def varying(found: xr.Dataset) -> list[Panel]:
    """Panels whose contours show something: of at least four neighbouring points, and not all of one value."""
    return [panel for panel in _present(found) if _drawable(_values(found, panel[1], panel[3]))]


def constants(found: xr.Dataset) -> list[tuple[str, float]]:
    """Titles and values of the quantities that have the same value all over the map."""
    values = {title: _values(found, name, index) * scale for title, name, scale, index in _present(found)}
    return [(title, float(np.nanmean(v))) for title, v in values.items() if np.isfinite(v).any() and _same(v)]


def _present(found: xr.Dataset) -> list[Panel]:
    left_out = () if has_gains(found) else ("static_gain", "delay")
    return [panel for panel in CONTOURS if panel[1] in found and panel[1] not in left_out]


def has_gains(found: xr.Dataset) -> bool:
    """True if a reference of actuators moves the disc anywhere in the map."""
    return "static_gain" in found and bool(np.nanmax(np.abs(found["static_gain"].values), initial=0.0) > 0)


def _same(values: np.ndarray) -> bool:
    good = values[np.isfinite(values)]
    return bool(np.ptp(good) <= EQUAL * np.abs(good).max())


def _drawable(values: np.ndarray) -> bool:
    good = np.isfinite(values)
    cells = good[1:, 1:] & good[1:, :-1] & good[:-1, 1:] & good[:-1, :-1]
    return bool(cells.any()) and not _same(values)


def _values(found: xr.Dataset, name: str, index: dict[str, int | str]) -> np.ndarray:
    data = found[name]
    for dim, at in index.items():
        data = data.sum(dim, skipna=False) if at == "sum" else data.isel({dim: at})
    return np.asarray(data.transpose("pressure", "speed").values)


def _shades(found: xr.Dataset, x: np.ndarray, y: np.ndarray) -> list[go.Contour]:
    """Unsafe points, and unknown ones if there are any, each half way to the next point."""
    safe = found["safe"].transpose("pressure", "speed").values
    shades = [_shade((safe == 0).astype(float), x, y, UNSAFE)]
    return shades + ([_shade(np.isnan(safe).astype(float), x, y, UNKNOWN)] if np.isnan(safe).any() else [])


def _shade(there: np.ndarray, x: np.ndarray, y: np.ndarray, shade: str) -> go.Contour:
    """Region of a map (pressure, speed) where a flag is 1; a contour, because plotly draws those over heat maps."""
    clear, colour = faint(shade, 0.0), faint(shade, 0.42)
    return go.Contour(x=compact(x), y=compact(y), z=there, showscale=False, hoverinfo="skip", zmin=0, zmax=1,
                      colorscale=[[0, clear], [0.5, clear], [0.5, colour], [1, colour]], line={"width": 0},
                      contours={"start": 0.5, "end": 0.5, "size": 1, "coloring": "fill"})  # fmt: skip


def campbell_figure(found: xr.Dataset, pressures: int = 3) -> go.Figure:
    """Natural frequencies and damping ratios of the modes, followed over speed at a few pressures, with 1X, 2X, 3X."""
    wn = found["branch_wn"].transpose("pressure", "branch", "speed").values * TO_HZ
    carried = np.flatnonzero(np.isfinite(wn).any(axis=(1, 2)))
    chosen = carried[np.unique(np.linspace(0, len(carried) - 1, pressures).round().astype(int))]
    figure = make_subplots(2, 1, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.06)
    speed = found["speed"].values * TO_RPM
    for k, i in enumerate(chosen):
        _add_modes(figure, found.isel(pressure=int(i)), speed, PIN_COLOURS[k % len(PIN_COLOURS)])
    for order in (1, 2, 3):
        figure.add_trace(curve(speed, order * np.abs(speed) / 60, INK, f"{order}X", 1, DASHES[order],
                               hoverinfo="skip"), 1, 1)  # fmt: skip
    shade_growth(figure, speed, found["zeta_least"].isel(pressure=chosen).min("pressure").values, rows=2)
    _add_crossings(figure, found)
    first = np.where(np.isnan(wn), np.inf, wn).min(axis=2)[:, :2]
    top = 1.15 * max(first[np.isfinite(first)].max(), np.abs(speed).max() / 60)
    figure.update_yaxes(title_text="natural frequency [Hz]", range=[0.92 * np.nanmin(wn), top], row=1, col=1)
    figure.update_yaxes(title_text="damping ratio", row=2, col=1)
    figure.add_hline(y=0, line={"color": INK, "width": 1}, row=2)
    figure.update_xaxes(title_text="speed [rpm]", range=[speed.min(), speed.max()], row=2, col=1)
    figure.update_xaxes(range=[speed.min(), speed.max()], row=1, col=1)
    return style(figure, 620)


def _add_modes(figure: go.Figure, one: xr.Dataset, speed: np.ndarray, colour: str) -> None:
    label = quantity(float(one["pressure"]) * TO_MPA, "MPa")
    for branch in range(one.sizes["branch"]):
        if not np.isfinite(one["branch_wn"].isel(branch=branch)).any():
            continue
        sense = whirl_sense(one["branch_whirl_ratio"].isel(branch=branch).values).tolist()
        symbols = [WHIRLS.get(s, "circle") for s in sense]
        for row, name, scale in ((1, "branch_wn", TO_HZ), (2, "branch_zeta", 1.0)):
            figure.add_trace(curve(speed, one[name].isel(branch=branch).values * scale, colour,
                                   f"{label}, mode {branch + 1}", 2, DASHES[branch % len(DASHES)],
                                   mode="lines+markers", legendgroup=f"{label}{branch}", showlegend=row == 1,
                                   text=sense, marker={"symbol": symbols, "size": 7},
                                   hovertemplate="%{x:.0f} rpm: %{y:.4g}, %{text}<extra></extra>"),
                             row, 1)  # fmt: skip


def _add_crossings(figure: go.Figure, found: xr.Dataset) -> None:
    """Marks where orders meet modes: of 1X those that the map knows, of all orders where they were asked for."""
    if "crossing_speed" in found:
        by_order = found["crossing_speed"].transpose("order", ...)
        known = {int(order): by_order.sel(order=order).values.ravel() for order in by_order["order"].values}
    else:
        known = {1: found["critical_speed"].values.ravel()}
    speed = found["speed"].values * TO_RPM
    for order, values in known.items():
        x = values * TO_RPM
        good = np.isfinite(x) & (x >= speed.min()) & (x <= speed.max())
        if not good.any():
            continue
        figure.add_trace(go.Scatter(x=compact(x[good]), y=compact(order * np.abs(x[good]) / 60), mode="markers",
                                    name=f"{order}X crossings", marker={"symbol": "x-thin", "size": 9,
                                    "line": {"width": 1.6, "color": INK}},
                                    hovertemplate="%{x:.0f} rpm<extra></extra>"), 1, 1)  # fmt: skip


def film_figure(found: xr.Dataset) -> go.Figure:
    """Film stiffness and damping over pressure at the middle speed, at each whirl frequency; a row for each film."""
    one = found.isel(speed=found.sizes["speed"] // 2)
    names = [f", {name}" for name in one["bearing"].values] if "bearing" in one.dims else [""]
    films = [one.isel(bearing=k) for k in range(len(names))] if "bearing" in one.dims else [one]
    titles = [text + name for name in names for text in ("stiffness K [MN/m]", "damping C [kN s/m]")]
    figure = make_subplots(len(films), 2, horizontal_spacing=0.09, vertical_spacing=0.25 / len(films),
                           subplot_titles=titles)  # fmt: skip
    for row, film in enumerate(films, 1):
        _add_coefficients(figure, film, row)
        figure.update_xaxes(title_text="pressure [MPa]", row=row)
    return style(figure, 520 + 420 * (len(films) - 1))


def _add_coefficients(figure: go.Figure, one: xr.Dataset, row: int) -> None:
    x = one["pressure"].values * TO_MPA
    for a in range(one.sizes["at"]):
        for column, (name, scale) in enumerate((("film_stiffness", 1e-6), ("film_damping", 1e-3)), 1):
            for k, (i, j) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
                values = one[name].isel(at=a, axis=i, to=j).values * scale
                figure.add_trace(curve(x, values, PIN_COLOURS[k], f"{'xy'[i]}{'xy'[j]}, {one['at'].values[a]}",
                                       dash=DASHES[a % 4], mode="lines+markers", legendgroup=f"{a}{k}",
                                       showlegend=column == row == 1, marker={"size": 5}), row, column)  # fmt: skip


def has_onset(found: xr.Dataset) -> bool:
    """True if an onset of whirl or a lift-off pressure was found at all."""
    return any(name in found and np.isfinite(found[name]).any() for name in ("onset_speed", "lift_off_pressure"))


def _onset_block(one: xr.Dataset) -> Block:
    """Whirl onset and lift-off: a figure where one of them is a curve, in words where each is one point."""
    title, points = "Whirl onset and lift-off", _onset_points(one)
    if any(np.isfinite(speed * pressure).sum() > 1 for *_, speed, pressure in points):
        text = "Whirl onset: right of it a mode grows. Lift-off: below it the film does not carry the rotor."
        return Block(title, text, figure=onset_figure(one))
    stated = [
        f"{name[0].upper()}{name[1:]}: {rpm:.0f} rpm at {quantity(pressure, 'MPa')}."
        for name, _, speeds, pressures in points
        for rpm, pressure in zip(speeds, pressures, strict=True)
        if np.isfinite(rpm * pressure)
    ]
    return Block(title, " ".join(stated))


def _onset_points(found: xr.Dataset) -> list[tuple[str, str, np.ndarray, np.ndarray]]:
    """Name and colour of whirl onset and of lift-off, as far as they were searched, with speeds [rpm], pressures [MPa].

    The onset is known over the pressures, lift-off over the speeds.
    """
    known = (
        ("whirl onset", UNSAFE, "onset_speed", "pressure"),
        ("lift-off", PIN_COLOURS[0], "speed", "lift_off_pressure"),
    )
    return [
        (name, colour, found[speed].values * TO_RPM, found[pressure].values * TO_MPA)
        for name, colour, speed, pressure in known
        if speed in found and pressure in found
    ]


def onset_figure(found: xr.Dataset) -> go.Figure:
    """Whirl onset over pressure and lift-off pressure over speed, as far as they were found."""
    figure = go.Figure()
    for name, colour, speeds, pressures in _onset_points(found):
        figure.add_trace(curve(speeds, pressures, colour, name, mode="lines+markers"))
    figure.update_xaxes(title_text="speed [rpm]")
    figure.update_yaxes(title_text="pressure [MPa]", rangemode="tozero")
    return style(figure, 420)
