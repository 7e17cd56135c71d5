"""A run against time: envelopes of its quantities, excitation and response, readings of probes, deceleration."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from identification.records.schema import PINS
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.experiments.summary import lift_off
from rotorsim.report.film import feed_word
from rotorsim.report.page import AXIS_COLOURS, NEUTRAL, PIN_COLOURS, compact, curve, faint, style
from rotorsim.report.run import AnalysedRun, end_of_run, need_time, record_section
from rotorsim.report.units import quantity
from rotorsim.signals import record_blocks as blocks
from rotorsim.signals.orders import Deceleration, deceleration_of

FILM_COLOURS = (NEUTRAL, "#CC79A7", "#E69F00", "#56B4E9")
CONTACT_COLOUR = "#CC3311"
PANELS = {
    "speed": ("speed<br>[rpm]", TO_RPM),
    "disc": ("disc<br>[µm]", TO_UM),
    "disc_measured": ("disc<br>[µm]", TO_UM),
    "h_min": ("smallest film<br>[µm]", TO_UM),
    "film_thickness": ("smallest film<br>[µm]", TO_UM),
    "mass_flow": ("mass flow<br>[mg/s]", 1e6),
    "film_flow": ("mass flow<br>[mg/s]", 1e6),
    "pressure": ("injection<br>[MPa gauge]", 1e-6),
    "temperature_rise": ("warmer by<br>[K]", 1.0),
    "contact": ("contact<br>[% of time]", 100.0),
    "reference": ("reference<br>[V]", 1.0),
    "disc_force": ("force<br>[N]", 1.0),
    "base_acceleration": ("base<br>[m/s²]", 1.0),
    "pin": ("pins<br>[µm]", TO_UM),
    "pin_measured": ("pins<br>[µm]", TO_UM),
}
"""Label of the axis of each variable, and the factor from SI."""
OVERVIEW = tuple(PANELS)[:10]
"""Variables of the overview in order."""
DRIVING = ("reference", "disc_force", "base_acceleration")
"""Variables that are held during a sample."""
BY_BEARING = {"film_thickness": "h_min", "film_flow": "mass_flow"}
"""Variables of each of several films, and those of all that they stand for."""
BANDS = "Bands span least to largest values."


def _band(
    data: blocks.Envelope, column: int, scale: float, colour: str, name: str = "", legend: bool = False
) -> list[go.Scatter]:
    """The band between least and largest value of a column of an envelope, or of its only one."""
    low, high = (v if v.ndim == 1 else v[:, column] for v in (data.least, data.most))
    common = {"x": compact(data.time), "mode": "lines", "line": {"color": colour, "width": 1}, "legendgroup": name,
              "hovertemplate": "%{y:.4g} at %{x:.2f} s<extra></extra>"}  # fmt: skip
    return [
        go.Scatter(y=compact(low * scale), showlegend=False, **common),
        go.Scatter(y=compact(high * scale), showlegend=legend, name=name, fill="tonexty", fillcolor=faint(colour),
                   **common),
    ]  # fmt: skip


def overview_caption(run: AnalysedRun, _: None) -> str:
    """Film thickness, contact and flow in a sentence each."""
    film, contact, flow = (run.summary[k] for k in ("smallest_film", "contact", "mass_flow"))
    sentences = [BANDS]
    if film:
        films = run.summary.get("films", {})
        where = f" in the bearing {min(films, key=lambda name: films[name]['smallest_um'])}" if films else ""
        at = f"{film['time_s']:.2f} s, {film['rpm']:.0f} rpm"
        sentences.append(f"The film is thinnest{where} at {at}{end_of_run(film)}, with {quantity(film['um'], 'µm')}.")
    if contact:
        sentences.append(_contact(contact))
    word = feed_word(run.machine)
    if flow and word:
        sentences.append(f"The {word} take {quantity(flow['mean_nl_min'], 'normal litres per minute')} on average.")
    return " ".join(sentences)


def _contact(contact: dict[str, Any]) -> str:
    """Sentence on the first contact of a journal with its sleeve."""
    if not contact["samples"]:
        return "The journal never touches the sleeve."
    return (
        f"The journal touches the sleeve in {contact['samples']} samples, first at {contact['first_time_s']:.2f} s, "
        f"{contact['first_rpm']:.0f} rpm."
    )


@record_section("The run against time", need_time, overview_caption)
def against_time(run: AnalysedRun, _: None) -> go.Figure:
    """Envelopes of speed [rpm], disc [um], film [um], flow [mg/s] and pressure [MPa] against time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.against_time(record)
    """
    names = _overview_names(run)
    data = blocks.envelopes(run.record, names)
    figure = make_subplots(len(names), 1, shared_xaxes=True, vertical_spacing=0.03)
    for row, name in enumerate(names, 1):
        label, scale = PANELS[name]
        for trace in _panel(run, name, data[name], scale):
            figure.add_trace(trace, row, 1)
        figure.update_yaxes(title_text=label, nticks=4, row=row, col=1)
        if name in ("speed", "pressure", "contact"):
            figure.update_yaxes(rangemode="tozero", row=row, col=1)
    figure.update_xaxes(range=run.time_reach)
    figure.update_xaxes(title_text="time [s]", row=len(names), col=1)
    return style(figure, 90 + 125 * len(names))


def _overview_names(run: AnalysedRun) -> list[str]:
    """Variables with a panel: each of several films stands for all, contact and flow are there if there was any."""
    skipped = {"disc", "disc_measured"} - {blocks.displacement_name(run.record)}
    skipped |= {total for name, total in BY_BEARING.items() if name in run.record}
    unfed = run.machine is not None and not run.machine.fed
    if unfed and not (run.summary["mass_flow"] or {}).get("max_kg_s"):
        skipped |= {"mass_flow", "film_flow", "pressure"}
    if not (run.summary["contact"] or {}).get("samples"):
        skipped.add("contact")
    if run.fastest == 0:
        skipped.add("speed")
    return [name for name in OVERVIEW if name in run.record and name not in skipped]


def _panel(run: AnalysedRun, name: str, data: blocks.Envelope, scale: float) -> list[go.Scatter]:
    if name == "contact":
        share = compact(np.where(data.mean > 0, data.mean * scale, 0))
        return [go.Scatter(x=compact(data.time), y=share, mode="lines", fill="tozeroy", showlegend=False,
                           name="contact", line={"color": CONTACT_COLOUR, "width": 1},
                           hovertemplate="%{y:.1f} % of the time at %{x:.2f} s<extra></extra>")]  # fmt: skip
    if name in BY_BEARING or name == "temperature_rise":
        films = name in BY_BEARING
        own = [f"film {one}" if films else str(one) for one in run.record["bearing" if films else "body"].values]
        legend = not films or name == next(n for n in BY_BEARING if n in run.record)
        return [t for i, label in enumerate(own)
                for t in _band(data, i, scale, FILM_COLOURS[i % len(FILM_COLOURS)], label, legend)]  # fmt: skip
    if data.least.ndim == 2:
        return [
            t for i, axis in enumerate("xy") for t in _band(data, i, scale, AXIS_COLOURS[axis], f"disc {axis}", True)
        ]
    return _band(data, 0, scale, NEUTRAL)


@dataclass(frozen=True)
class PanelLine:
    """A line of a panel: variable, column of it, name in the legend, colour, and whether it is drawn faintly."""

    variable: str
    column: int
    name: str
    colour: str
    faint: bool = False


def _need_excitation(run: AnalysedRun) -> None:
    blocks.need(bool(run.driven) or run.kind == "controlled", "Neither reference nor force changes.")


def excitation_caption(run: AnalysedRun, _: None) -> str:
    """Key to the lines of both columns."""
    text = "Left: bands span least to largest values. Right: every sample about the "
    text += "largest change of the inputs." if run.driven else "middle of the record."
    if "disc" in run.record and "disc_measured" in run.record:
        text += " The measured displacement is drawn faintly under the true one."
    if set(PINS) <= set(run.record):
        text += " So are the measured pins."
    return text


@record_section("Excitation and response", _need_excitation, excitation_caption)
def excitation(run: AnalysedRun, _: None) -> go.Figure:
    """Reference [V], force [N], pins [um] and disc [um] against time [s]: the whole record and a stretch of it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.excitation(record)
    """
    shown = _excitation_panels(run)
    stretch = blocks.eventful_stretch(run.record, sorted(run.driven), run.fastest)
    names = sorted({line.variable for lines in shown.values() for line in lines})
    data = blocks.envelopes(run.record, names)
    figure = make_subplots(len(shown), 2, shared_xaxes="columns", column_widths=[0.6, 0.4], vertical_spacing=0.035,
                           horizontal_spacing=0.07,
                           subplot_titles=["whole record", "every sample of a stretch"])  # fmt: skip
    seen: set[str] = set()
    for row, (panel, lines) in enumerate(shown.items(), 1):
        label, scale = PANELS[panel]
        for line in lines:
            for trace in _band(data[line.variable], line.column, scale, line.colour, line.name):
                figure.add_trace(trace, row, 1)
            figure.add_trace(_samples(run, line, scale, stretch, line.name not in seen), row, 2)
            seen |= set() if line.faint else {line.name}
        figure.update_yaxes(title_text=label, nticks=5, row=row, col=1)
        figure.update_yaxes(nticks=5, row=row, col=2)
    ends = run.record["time"].isel(time=[stretch.start, stretch.stop - 1]).values
    figure.update_xaxes(title_text="time [s]", row=len(shown))
    figure.update_xaxes(range=run.time_reach, col=1)
    figure.update_xaxes(range=[float(ends[0]), float(ends[1])], col=2)
    return style(figure, 110 + 165 * len(shown))


def _excitation_panels(run: AnalysedRun) -> dict[str, list[PanelLine]]:
    """Lines per panel of what the record holds and what moves."""
    shown: dict[str, list[PanelLine]] = {}
    for name in DRIVING:
        if name in run.driven:
            shown[name] = [PanelLine(name, k, axis, AXIS_COLOURS[axis]) for k, axis in enumerate("xy")]
    for name in [one for one in PINS if one in run.record] if "reference" in run.driven else ():
        count = min(run.record[name].shape[1], len(PIN_COLOURS))
        below = name == "pin_measured" and "pin" in run.record
        lines = [PanelLine(name, k, f"pin {k + 1}", PIN_COLOURS[k], below) for k in range(count)]
        shown["pin"] = lines + shown.get("pin", [])
    both = "disc" in run.record and "disc_measured" in run.record
    shown["disc"] = [PanelLine(run.output, k, axis, AXIS_COLOURS[axis], both) for k, axis in enumerate("xy")]
    shown["disc"] += [PanelLine("disc", k, axis, AXIS_COLOURS[axis]) for k, axis in enumerate("xy") if both]
    return shown


def _samples(run: AnalysedRun, line: PanelLine, scale: float, stretch: slice, legend: bool) -> go.Scatter:
    part = run.record[line.variable].isel(time=stretch)
    values = np.asarray(part.values[:, line.column], float) * scale
    held = line.variable in DRIVING
    colour = faint(line.colour, 0.4) if line.faint else line.colour
    return go.Scatter(
        x=compact(run.record["time"].isel(time=stretch).values, 7), y=compact(values), mode="lines", name=line.name,
        line={"color": colour, "width": 1.5, "shape": "vh" if held else "linear", "simplify": False},
        showlegend=legend and not line.faint, legendgroup=line.name, 
        hovertemplate="%{y:.4g} at %{x:.4f} s<extra></extra>",
    )  # fmt: skip


def _need_readings(run: AnalysedRun) -> None:
    blocks.need(blocks.READINGS in run.record, "The record holds no readings of probes.")


def readings_caption(run: AnalysedRun, _: None) -> str:
    """Direction and quantity of each probe."""
    columns = (run.record[name].values for name in ("probe", "probe_quantity", "probe_angle"))
    if not {"probe_quantity", "probe_angle"} <= set(run.record.coords):
        return BANDS
    rows = "; ".join(
        f"{name} {str(q).replace('_', ' ')} at {np.degrees(a):.4g}°" for name, q, a in zip(*columns, strict=True)
    )
    return f"{BANDS} {rows}."


@record_section("Readings of the probes", _need_readings, readings_caption)
def probe_readings(run: AnalysedRun, _: None) -> go.Figure:
    """Envelopes of the readings of all probes against time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> record = rs.experiments.runup("probes.toml", stop=300.0)  # doctest: +SKIP
    >>> figure = rs.report.probe_readings(record)  # doctest: +SKIP
    """
    known, scales = blocks.probe_names(run.record), [blocks.SHOWN[unit] for unit in blocks.probe_units(run.record)]
    data = blocks.envelopes(run.record, [blocks.READINGS])[blocks.READINGS]
    figure = make_subplots(len(known), 1, shared_xaxes=True, vertical_spacing=0.12 / (len(known) + 2))
    for k, (name, (unit, scale)) in enumerate(zip(known, scales, strict=True)):
        for trace in _band(data, k, scale, PIN_COLOURS[k % len(PIN_COLOURS)]):
            figure.add_trace(trace, k + 1, 1)
        figure.update_yaxes(title_text=f"{name}<br>[{unit}]", nticks=4, row=k + 1, col=1)
    figure.update_xaxes(range=run.time_reach)
    figure.update_xaxes(title_text="time [s]", row=len(known), col=1)
    return style(figure, 90 + 125 * len(known), showlegend=False)


def _friction(run: AnalysedRun) -> dict[str, blocks.Envelope]:
    blocks.need("friction_torque" in run.record, "The record holds no torque of friction.")
    blocks.need(run.swept, "The speed hardly changes.")
    return blocks.envelopes(run.record, ["speed", "friction_torque"])


def friction_caption(run: AnalysedRun, found: dict[str, blocks.Envelope]) -> str:
    """The torque at both ends, and where the shaft leaves its sleeves."""
    speed, torque = found["speed"].mean, found["friction_torque"].mean
    ends = (f"{quantity(1e3 * torque[k], 'mN m')} at {speed[k] * TO_RPM:.0f} rpm" for k in (0, -1))
    marks = (f"{name.replace('_', '-')} at {one['rpm']:.0f} rpm" for name, one in lift_off(run.record).items())
    return f"Mean torque {', '.join((*ends, *marks))}. {BANDS}"


@record_section("Friction torque over speed", _friction, friction_caption)
def friction_curve(run: AnalysedRun, found: dict[str, blocks.Envelope]) -> go.Figure:
    """Torque [mN m] of friction in films and contacts over the speed [rpm], with lift-off and touch-down.

    Examples
    --------
    >>> import rotorsim as rs
    >>> up = rs.experiments.runup("rigid_rotor_self_acting", 0.0, 100.0, 100.0)
    >>> figure = rs.report.friction_curve(up)
    """
    speed, torque = found["speed"].mean * TO_RPM, found["friction_torque"]
    figure = go.Figure()
    for values, fill in ((torque.least, None), (torque.most, "tonexty")):
        line = {"color": faint(NEUTRAL), "width": 0.5}
        figure.add_scatter(x=compact(speed), y=compact(1e3 * values), mode="lines", line=line, fill=fill,
                           fillcolor=faint(NEUTRAL), showlegend=False, hoverinfo="skip")  # fmt: skip
    hover = "%{y:.4g} mN m at %{x:.0f} rpm<extra></extra>"
    figure.add_trace(curve(speed, 1e3 * torque.mean, NEUTRAL, width=2, showlegend=False, hovertemplate=hover))
    for name, one in lift_off(run.record).items():
        figure.add_vline(one["rpm"], line={"color": CONTACT_COLOUR, "dash": "dash", "width": 1},
                         annotation={"text": name.replace("_", "-"), "font": {"color": CONTACT_COLOUR}})  # fmt: skip
    figure.update_yaxes(title_text="friction torque [mN m]", rangemode="tozero")
    figure.update_xaxes(title_text="speed [rpm]", rangemode="tozero")
    return style(figure, 380)


def deceleration_caption(run: AnalysedRun, found: Deceleration) -> str:
    """From where to where, and the largest deceleration."""
    i = int(found.rate.argmax())
    text = (
        f"From {found.speed[0] * TO_RPM:.0f} to {found.speed[-1] * TO_RPM:.0f} rpm; the largest deceleration is "
        f"{found.rate[i] * TO_RPM:.3g} rpm/s at {found.speed[i] * TO_RPM:.0f} rpm"
    )
    if found.speed[-1] > 0.05 * found.speed[0]:
        text += f", the last {found.rate[-1] * TO_RPM:.3g} rpm/s at {found.speed[-1] * TO_RPM:.0f} rpm"
    return text + "."


@record_section("Speed and deceleration", lambda run: deceleration_of(run.record), deceleration_caption)
def deceleration_curve(run: AnalysedRun, found: Deceleration) -> go.Figure:
    """Speed [rpm] and deceleration [rpm/s] of a coast-down against time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> down = rs.experiments.coastdown(plant, start=300.0, stop=280.0, rate=100.0, pressure=0.5e6)
    >>> figure = rs.report.deceleration_curve(down)
    """
    figure = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06)
    for row, values, unit in ((1, found.speed, "rpm"), (2, found.rate, "rpm/s")):
        hover = f"%{{y:.4g}} {unit} at %{{x:.2f}} s<extra></extra>"
        trace = curve(found.time, values * TO_RPM, NEUTRAL, width=2, showlegend=False, hovertemplate=hover)
        figure.add_trace(trace, row, 1)
    figure.update_yaxes(title_text="speed [rpm]", rangemode="tozero", row=1)
    figure.update_yaxes(title_text="deceleration<br>[rpm/s]", rangemode="tozero", row=2)
    figure.update_xaxes(title_text="time [s]", row=2)
    return style(figure, 440)
