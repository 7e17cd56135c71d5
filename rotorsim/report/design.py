"""Page of a design review: requirements first, then a drawing to scale, modes, responses, clearances, films, rules."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from itertools import zip_longest
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.analysis import standards
from rotorsim.analysis.design_review import (
    MET,
    MISSED,
    OPEN,
    CriticalSpeed,
    DesignCheck,
    DesignReview,
    drawn_places,
    first_forward,
    margin_of,
    operating,
    steady_up_to,
)
from rotorsim.base.cache import installed
from rotorsim.base.units import TO_MPA, TO_RPM, TO_UM
from rotorsim.report.machine_sketch import machine_drawing
from rotorsim.report.page import INK, NEUTRAL, PIN_COLOURS, UNSAFE, Block, Page, curve, page_of, shade_growth, style
from rotorsim.report.units import quantity, unit_name

SIGNS = {MET: "\N{CHECK MARK} met", MISSED: "\N{BALLOT X} not met", OPEN: "? not looked at"}
NO_BREAK = "\N{NO-BREAK SPACE}"
"""Space at which a cell of a table is not broken."""
BEFORE_UNIT = re.compile(r"(?<=\d) (?=[^\s\d])|(?<=g) (?=mm)")
"""Space between a number and its unit, and within a unit."""
LIFTED = " (pulls up: weight beyond the next bearing lifts the shaft here)"
"""Words behind a static load below 0."""
COLUMNS = 2
"""Columns of the mode shapes."""
PANEL = 190
"""Height [px] of a panel."""
Cells = Sequence[Any]


def tables(review: DesignReview) -> dict[str, Block]:
    """Tables of a review by the names of their files: numbers below heads with units, None where there is none."""
    made = (_requirements, _criticals, _cases, _unbalances, _clearances, _grades, _zones, _films, _thrust, _rules)
    return {make.__name__.lstrip("_"): make(review) for make in made}


def numbers(review: DesignReview) -> dict[str, Any]:
    """Every table as a list of rows by its heads, for JSON, with the operating point and the counts of verdicts."""
    plain = {name: [dict(zip(t.heads, row, strict=True)) for row in t.rows] for name, t in tables(review).items()}
    return {"machine": review.plant.machine.name, "machine_hash": review.plant.machine.hash,
            "speeds_rpm": [review.low * TO_RPM, review.high * TO_RPM], "pressure_mpa": review.pressure * TO_MPA,
            "peaks_looked_for_mm": {name: 1e3 * z for name, z in review.places.items()},
            "verdicts": counts(review)} | plain  # fmt: skip


def counts(review: DesignReview) -> dict[str, int]:
    """Number of requirements by verdict."""
    return {verdict: sum(check.verdict == verdict for check in review.checks) for verdict in (MET, MISSED, OPEN)}


def asked(check: DesignCheck) -> str:
    """The limit of a requirement as a text, in the units of the page."""
    return f"{check.sense} {_with_unit(check.limit, check.unit)}"


def answered(check: DesignCheck) -> str:
    """The finding of a requirement as a text, in the units of the page."""
    found = [] if check.found is None else [_with_unit(check.found, check.unit)]
    return ", ".join([*found, *filter(None, [check.detail])]) or "-"


def _with_unit(value: float, unit: str) -> str:
    form = ".0f" if unit == "rpm" else ".3g"
    return quantity(value, unit, form) if unit else format(value, form)


@page_of(DesignReview)
def design_page(review: DesignReview, author: str = "not stated") -> Page:
    """Page of a design review, with the name of its author."""
    made, machine = tables(review), review.plant.machine
    blocks: list[Block] = [
        Block("Document", rows=_head(review, author)),
        _verdicts(review),
        Block("Machine",
              f"To scale. Discs are solid ones of the mass and inertia of the file. Dimensions: {unit_name('mm')}.",
              figure=machine_drawing(machine), tools=False),
        replace(made["criticals"], figure=mode_figure(review) if review.criticals else None),
        made["cases"],
        replace(made["unbalances"], figure=response_figure(review)),
        replace(made["clearances"], figure=envelope_figure(review)),
        Block("Damping over the speed", _damping_text(review), figure=damping_figure(review)),
        _map_block(review),
        _without_empty_columns(made["films"]),
        replace(made["thrust"], figure=axial_figure(review) if review.axial is not None else None),
        made["grades"],
        made["zones"],
        made["rules"],
    ]  # fmt: skip
    about = machine.description or "Design review"
    return Page(f"{machine.name}: design review", f"{about}. {_point(review)}",
                [b for b in blocks if b.rows or b.figure or b.text], _key(review))  # fmt: skip


def _speeds(review: DesignReview) -> str:
    low, high = (f"{v * TO_RPM:.0f}" for v in (review.low, review.high))
    return f"{high} rpm" if low == high else f"{low} to {high} rpm"


def _point(review: DesignReview) -> str:
    text = f"Operating speed {_speeds(review)}"
    text += "" if review.stated else ", the top of its default analyses: the machine file states no highest speed"
    return text + (f"; supply pressure {quantity(review.pressure * TO_MPA, 'MPa')} gauge." if review.pressure else ".")


def _head(review: DesignReview, author: str) -> list[tuple[str, str]]:
    machine = review.plant.machine
    loads = zip(machine.bearing_names, review.loads, strict=True)
    return [
        ("Date", datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")),
        ("Author", author),
        ("Program", f"rotorsim {installed('rotorsim')}"),
        ("Machine", f"{machine.name}, hash {machine.hash}"),
        ("Rotor", f"{quantity(machine.mass, 'kg', '.4g')}, {quantity(machine.shaft.length * 1e3, 'mm', '.4g')} long"),
        ("Static loads W", ", ".join(f"{name} {quantity(w, 'kg', '.4g')}{LIFTED * bool(w < 0)}" for name, w in loads)),
        ("Method", "Equilibria and linear models of film and rotor at each speed; all modes with a damping ratio below "
                   f"0.5 up to {review.searched[1] * TO_RPM:.0f} rpm"),
    ]  # fmt: skip


def _key(review: DesignReview) -> list[tuple[str, str]]:
    found, first = counts(review), first_forward(review)
    speed, _, looked = review.onset
    none = f"none up to {review.searched[1] * TO_RPM:.0f} rpm" if looked else "not known"
    return [
        (str(found[MISSED]), "requirements not met"), (str(found[OPEN]), "not looked at"), (str(found[MET]), "met"),
        (f"{first.speed * TO_RPM:.0f} rpm" if first else "-", "first forward critical speed"),
        (f"{speed * TO_RPM:.0f} rpm" if np.isfinite(speed) else none, "onset of whirl"),
    ]  # fmt: skip


def _verdicts(review: DesignReview) -> Block:
    """The requirements as a reader wants them: those that are not met first."""
    rows = [(SIGNS[c.verdict].replace(" ", NO_BREAK), c.name, asked(c).replace(" ", NO_BREAK),
             BEFORE_UNIT.sub(NO_BREAK, answered(c)), standards.RULES[c.rule].clause, c.remark)
            for verdict in (MISSED, OPEN, MET) for c in review.checks if c.verdict == verdict]  # fmt: skip
    text = "What was not looked at may be unsafe. How far each clause could be read stands below, under Rules."
    return Block("Requirements", text, ("verdict", "requirement", "asked", "found", "rule", "remark"), rows)


def _requirements(review: DesignReview) -> Block:
    rows = [(c.verdict, c.name, c.sense, c.limit, c.found, c.unit, c.detail, standards.RULES[c.rule].clause, c.remark)
            for c in review.checks]  # fmt: skip
    heads = ("verdict", "requirement", "sense", "asked", "found", "unit", "detail", "rule", "remark")
    return Block("Requirements", "", heads, rows)


def _criticals(review: DesignReview) -> Block:
    rows = []
    for k, mode in enumerate(review.criticals, 1):
        needed, found = margin_of(mode, review)
        peak = mode.peak
        rows.append((
            k, mode.speed * TO_RPM, mode.whirl, mode.decrement, _known(1 / (2 * mode.zeta)) if mode.zeta > 0 else None,
            peak and peak.speed * TO_RPM, mode.place or "no peak", _known(peak.amplification) if peak else None, needed,
            found,
        ))  # fmt: skip
    if not rows:
        up_to = f"{review.searched[1] * TO_RPM:.0f} rpm"
        return Block("Critical speeds and mode shapes", f"No mode crosses 1X up to {up_to}, where it was looked at.")
    text = (
        "Speed: where the natural frequency |s| of a damped mode is the speed, as in the Campbell diagram. Peak: where "
        "the response to unbalance is largest, with damping at a higher speed; margins count from it, of a mode "
        "without a peak from the first speed. Looked for at "
        f"{'; '.join(review.places)}. A factor is by half power, '-' where the flanks are not deep enough, and "
        "1/(2 zeta) counts instead; a backward mode without a peak needs no margin, as unbalance turns forward. "
        "Drawn: deflected lines with bearings (triangles), probes (diamonds), nodes (rings)."
    )
    heads = ("mode", "speed [rpm]", "whirl", "log. decrement", "1/(2 zeta)", "peak [rpm]", "highest at",
             "AF, half power", "margin asked [%]", "margin found [%]")  # fmt: skip
    return Block("Critical speeds and mode shapes", text, heads, rows)


def _known(value: float) -> float | None:
    """A number, None for one that is not known."""
    return float(value) if np.isfinite(value) else None


def _cases(review: DesignReview) -> Block:
    rows = [
        (case.name, 1e3 * _place(review, one.position), one.me * 1e6, float(np.degrees(one.phase)), load)
        for case in review.cases
        for one, load in zip_longest(case.unbalances, case.loads)
    ]
    text = (
        "Unbalances of the analysis: in the middle of the bearings and as a couple, and at the antinodes of the modes. "
        "Each is twice API's residual 4 W/N oz in with W in lb, 12700 W/N g mm with W in kg, and "
        f"N = {review.high * TO_RPM:.0f} rpm. "
        "The last one is that of the machine file, or of grade G 2.5 without it."
    )
    return Block("Unbalances", text, ("case", "z [mm]", "unbalance [g mm]", "angle [deg]", "W [kg]"), rows)


def _place(review: DesignReview, position: float | None) -> float:
    return review.plant.assembly.mesh.place(review.file_case.unbalances[0]) if position is None else position


def _unbalances(review: DesignReview) -> Block:
    rows: list[Cells] = []
    at = review.responses["speed"].values
    steady = review.responses["zeta_least"].values >= 0
    within = steady & operating(at, review.low, review.high)
    for case in review.cases:
        for probe, z in review.probes.items():
            sizes = np.where(steady, review.motion(case.name, z), np.nan) * TO_UM
            largest = np.nanmax(sizes, initial=-np.inf)
            rows.append((case.name, probe, at[np.nanargmax(sizes)] * TO_RPM if largest > 0 else None, _known(largest),
                         _known(np.nanmax(sizes[within], initial=-np.inf)),
                         _known(review.scales.get(case.name, np.nan))))  # fmt: skip
    text = (
        "Motion over the speed. Shaded green: the operating speeds"
        f"{'' if steady.all() else '; red: a mode grows, and no response is steady'}. The scale brings the worst "
        f"probe at the operating speeds to Avl. Looked at up to {at[-1] * TO_RPM:.0f} rpm: a largest motion there may "
        "be the foot of a peak beyond."
    )
    heads = ("case", "probe", "largest at [rpm]", "largest [µm pk-pk]", "at operating speeds [µm pk-pk]",
             "scale to Avl")  # fmt: skip
    return Block("Unbalance response", text, heads, rows)


def _clearances(review: DesignReview) -> Block:
    rows = [
        (c.place, 1e3 * c.z, *map(_known, (c.gap * TO_UM, c.motion * TO_UM, 100 * c.motion / c.gap, c.speed * TO_RPM)),
         c.case if np.isfinite(c.motion) else None)
        for c in review.clearances
    ]  # fmt: skip
    text = (
        "Largest motion from rest to the highest operating speed, scaled to Avl, at both ends of every film "
        "and at rubs. A foil counts as rigid. The rule allows 75 % of the diametral clearance."
    )
    heads = ("place", "z [mm]", "diametral clearance [µm]", "scaled motion [µm pk-pk]", "share [%]", "at [rpm]", "case")
    return Block("Clearances along the shaft", text, heads, rows)


def _grades(review: DesignReview) -> Block:
    mass, total = review.plant.machine.mass, sum(one.me for one in review.file_case.unbalances)
    rows: list[Cells] = []
    for grade in standards.GRADES:
        asked = standards.permissible_unbalance(grade, mass, review.high)
        rows.append((f"G {grade:g}", asked * 1e6, asked / mass * TO_UM, total * 1e6, "yes" if total <= asked else "no"))
    residual = standards.residual_unbalance(float(np.abs(review.loads).sum()), review.high)
    rows.append(("API 4 W/N", residual * 1e6, residual / mass * TO_UM, total * 1e6,
                 "yes" if total <= residual else "no"))  # fmt: skip
    text = (
        f"At {review.high * TO_RPM:.0f} rpm, of the whole rotor, all planes. Present: {review.file_case.name}. "
        "API's 4 W/N is in oz in, with W in lb and N in rpm: 6350 W/N g mm with W in kg."
    )
    heads = ("grade", "permissible [g mm]", "eccentricity [µm]", "present [g mm]", "within")
    return Block("Balance", text, heads, rows)


def _zones(review: DesignReview) -> Block:
    rpm = review.high * TO_RPM
    rows = [(zone, limit / np.sqrt(rpm) * TO_UM) for zone, limit in standards.SHAFT_ZONES.items()]
    rows.append(("API Avl", standards.vibration_limit(review.high) * TO_UM))
    low, high = standards.SCOPE
    text = "Limits of relative shaft vibration, ISO 20816-3 and API."
    text += "" if low <= rpm <= high else f" The zones are made for {low:.0f} to {high:.0f} rpm: here for orientation."
    return Block("Zones of shaft vibration", text, ("zone", "up to [µm pk-pk]"), rows)


def _films(review: DesignReview) -> Block:
    warm = any(f.rises.any() for f in review.films)
    rows: list[Cells] = [
        (f.name, f.load, f.eccentricity, f.K[0, 0] * 1e-6, f.K[1, 1] * 1e-6, f.K[0, 1] * 1e-6, f.K[1, 0] * 1e-6,
         f.C[0, 0] * 1e-3, f.C[1, 1] * 1e-3, f.power, f.flow * 1e6, float(f.rises[0]) if warm else None)
        for f in review.films
    ]  # fmt: skip
    text = f"At {review.high * TO_RPM:.0f} rpm; stiffness and damping at the frequency of the speed. "
    text += f"Least film {quantity(review.least_gap * TO_UM, 'µm')}." if review.films else review.not_carried
    text += "" if warm or not review.films else " Isothermal: add [effects.heat_balance] for temperatures."
    text += _load_text(review)
    heads = ("film", "load [N]", "eccentricity ratio", "Kxx [MN/m]", "Kyy [MN/m]", "Kxy [MN/m]", "Kyx [MN/m]",
             "Cxx [kN s/m]", "Cyy [kN s/m]", "friction [W]", "flow [mg/s]", "gas warmer by [K]")  # fmt: skip
    has_film = bool(review.plant.machine.films)
    return Block("Films", text if has_film else "", heads, rows)


def _without_empty_columns(block: Block) -> Block:
    """A table without the columns in which no row has anything: twelve do not fit on a narrow page."""
    kept = [k for k in range(len(block.heads)) if any(row[k] is not None for row in block.rows)]
    return replace(block, heads=[block.heads[k] for k in kept], rows=[[row[k] for k in kept] for row in block.rows])


def _load_text(review: DesignReview) -> str:
    """Distance of the films' loads from the weight's shares of the head; empty without gravity or a film for each."""
    weight = review.plant.machine.effects.get("gravity", ())
    if len(weight) != 1 or len(review.films) != len(review.loads):
        return ""
    g = float(getattr(weight[0], "acceleration", 0.0))
    if not g or min(abs(review.loads)) < 1e-9:
        return ""
    off = max(abs(f.load / (g * abs(w)) - 1) for f, w in zip(review.films, review.loads, strict=True))
    return f" Their loads, which the modes of the model share out, lie within {100 * off:.2g} % of the static loads W."


def _thrust(review: DesignReview) -> Block:
    heads = ("film", "gap [µm]", "load [N]", "K at 0 Hz [MN/m]", "K of the mode [MN/m]", "C of the mode [N s/m]",
             "friction [W]", "flow [mg/s]", "highest pressure [MPa abs]")  # fmt: skip
    if review.axial is None:
        return Block("Thrust bearings", heads=heads)
    state = review.axial.state
    if state is None:
        return Block("Thrust bearings", f"Without an axial state: {review.axial.refused}", heads, [])
    rows = [
        (f.name, f.gap * TO_UM, f.load, f.static_stiffness * 1e-6, f.stiffness * 1e-6, f.damping, f.power, f.flow * 1e6,
         f.p_max * TO_MPA)
        for f in state.films
    ]  # fmt: skip
    hertz = f"{state.wn / (2 * np.pi):.4g} Hz"
    mode = f"the undamped frequency of the axial mode, {hertz}; its damping ratio is {state.zeta:.3g}"
    if state.overdamped:
        mode = f"{hertz}, the rate at which the overdamped axial mode creeps back over 2 pi"
    text = (
        f"At {review.high * TO_RPM:.0f} rpm; K and C of the mode are at {mode}. The load of "
        f"{quantity(state.load, 'N')} displaces the rotor by {quantity(state.displacement * TO_UM, 'µm')} towards +z."
    )
    return Block("Thrust bearings", text, heads, rows)


def axial_figure(review: DesignReview) -> go.Figure:
    """Force of every thrust bearing over the displacement, and the axial mode over the speed."""
    found = review.axial
    assert found is not None
    figure = make_subplots(1, 2, specs=[[{}, {"secondary_y": True}]], horizontal_spacing=0.12,
                           subplot_titles=["force on the rotor towards +z", "axial mode"])  # fmt: skip
    z = found.displacements * TO_UM
    for k, (name, force) in enumerate(zip(review.plant.machine.thrust_names, found.forces, strict=True)):
        figure.add_trace(curve(z, force, PIN_COLOURS[k % 6], name, 1.6), 1, 1)
    load = review.plant.machine.axial_load or 0.0
    figure.add_trace(curve(z, found.forces.sum(axis=0) + load, INK, "with the load", 2.4), 1, 1)
    if found.state is not None:
        figure.add_trace(go.Scatter(x=[found.state.displacement * TO_UM], y=[0.0], mode="markers", hoverinfo="x",
                                    marker={"size": 9, "color": INK}, showlegend=False), 1, 1)  # fmt: skip
    at = found.speeds * TO_RPM
    figure.add_trace(curve(at, found.wn / (2 * np.pi), PIN_COLOURS[0], "frequency", 2, digits=7), 1, 2)
    figure.add_trace(curve(at, found.zeta, UNSAFE, "damping ratio", 2, "dash", digits=7), 1, 2, secondary_y=True)
    figure.update_xaxes(title_text="displacement [µm]", row=1, col=1)
    figure.update_yaxes(title_text="force [N]", row=1, col=1)
    figure.update_xaxes(title_text="speed [rpm]", row=1, col=2)
    figure.update_yaxes(title_text="frequency [Hz]", rangemode="tozero", row=1, col=2)
    figure.update_yaxes(title_text="damping ratio", row=1, col=2, secondary_y=True, showgrid=False, tickmode="auto")
    return style(figure, 340)


def _rules(review: DesignReview) -> Block:
    rows = [(rule.clause, rule.formula, rule.known) for rule in standards.RULES.values()]
    return Block("Rules", "", ("standard and clause", "rule", "how far it could be verified"), rows)


def mode_figure(review: DesignReview) -> go.Figure:
    """Deflected line of every critical speed with bearings, probes and nodes."""
    modes, along = review.criticals, drawn_places(review.plant) * 1e3
    rows = -(-len(modes) // COLUMNS)
    titles = [f"{k}: {m.speed * TO_RPM:.0f} rpm, {m.in_words}" for k, m in enumerate(modes, 1)]
    figure = make_subplots(rows, COLUMNS, shared_xaxes=True, shared_yaxes=True, subplot_titles=titles,
                           horizontal_spacing=0.04, vertical_spacing=0.28 / max(rows, 1))  # fmt: skip
    bearings = [b.position * 1e3 for b in review.plant.machine.bearings]
    for k, mode in enumerate(modes):
        place = {"row": k // COLUMNS + 1, "col": k % COLUMNS + 1}
        figure.add_trace(curve(along, 0 * along, INK, width=0.8, dash="dot", hoverinfo="skip"), **place)
        figure.add_trace(curve(along, mode.line, PIN_COLOURS[k % 6], width=2.4), **place)
        for x, symbol, size, colour in (
            (bearings, "triangle-up", 11, "#56B4E9"),
            ([z * 1e3 for z in review.probes.values()], "diamond-tall", 11, NEUTRAL),
            ([z * 1e3 for z in mode.nodes], "circle-open", 9, INK),
        ):
            figure.add_trace(go.Scatter(x=x, y=[0.0] * len(x), mode="markers", hoverinfo="x",
                                        marker={"symbol": symbol, "size": size, "color": colour}), **place)  # fmt: skip
    figure.update_xaxes(title_text="position along the shaft [mm]", row=rows)
    figure.update_yaxes(range=[-1.15, 1.15], dtick=1)
    figure.update_layout(showlegend=False)
    return style(figure, 90 + PANEL * rows)


def response_figure(review: DesignReview) -> go.Figure:
    """Motion of every probe over speed, a panel for each case of unbalance, with peaks and operating speeds."""
    cases, listed = review.cases, set[str]()
    figure = make_subplots(len(cases), 1, shared_xaxes=True, subplot_titles=[c.name for c in cases],
                           vertical_spacing=0.2 / len(cases))  # fmt: skip
    speed = review.responses["speed"].values
    steady = review.responses["zeta_least"].values >= 0
    for row, case in enumerate(cases, 1):
        for k, (probe, z) in enumerate(review.probes.items()):
            sizes = np.where(steady, review.motion(case.name, z), np.nan) * TO_UM
            figure.add_trace(curve(speed * TO_RPM, sizes, PIN_COLOURS[k % 6], probe, 2, digits=7, legendgroup=probe,
                                   showlegend=row == 1), row, 1)  # fmt: skip
        for mode in (m for m in review.criticals if m.driven_by == case.name and m.peak is not None):
            if mode.place not in review.probes:
                sizes = np.where(steady, review.motion(case.name, review.places[mode.place]), np.nan) * TO_UM
                figure.add_trace(curve(speed * TO_RPM, sizes, INK, mode.place, 1, "dot", 7, legendgroup=mode.place,
                                       showlegend=mode.place not in listed), row, 1)  # fmt: skip
                listed.add(mode.place)
            _add_peak(figure, mode, row)
        _add_operating(figure, review, row)
        figure.update_yaxes(title_text="motion [µm pk-pk]", rangemode="tozero", row=row, col=1)
    _shade(figure, review, len(cases))
    figure.update_xaxes(title_text="speed [rpm]", row=len(cases), col=1)
    return style(figure, 110 + 210 * len(cases))


def _add_peak(figure: go.Figure, mode: CriticalSpeed, row: int) -> None:
    """A peak with its half-power width and amplification factor."""
    peak = mode.peak
    assert peak is not None
    size, level = 2 * peak.size * TO_UM, np.sqrt(2) * peak.size * TO_UM
    known = np.isfinite(peak.amplification)
    figure.add_trace(go.Scatter(x=[peak.speed * TO_RPM], y=[size], mode="markers+text", showlegend=False,
                                text=[f"AF {peak.amplification:.3g}" if known else "AF -"], textposition="middle right",
                                marker={"symbol": "circle-open", "size": 9, "color": INK}), row, 1)  # fmt: skip
    if known:
        figure.add_trace(curve(np.array([peak.low, peak.high]) * TO_RPM, np.array([level, level]), INK, width=1.5,
                               digits=7, showlegend=False, hoverinfo="skip"), row, 1)  # fmt: skip


def _add_operating(figure: go.Figure, review: DesignReview, row: int) -> None:
    """The operating speeds as a band, or a line where there is one."""
    if review.low < review.high:
        figure.add_vrect(review.low * TO_RPM, review.high * TO_RPM, row=row, col=1, fillcolor=NEUTRAL, opacity=0.1,
                         line={"width": 0}, layer="below")  # fmt: skip
    else:
        figure.add_vline(review.high * TO_RPM, row=row, col=1, line={"color": NEUTRAL, "width": 2, "dash": "dash"})


def _shade(figure: go.Figure, review: DesignReview, rows: int) -> None:
    shade_growth(figure, review.responses["speed"].values * TO_RPM, review.responses["zeta_least"].values, rows)


def envelope_figure(review: DesignReview) -> go.Figure:
    """Largest scaled motion along the shaft of every case against the clearances that are known."""
    figure = go.Figure()
    z = review.responses["z"].values * 1e3
    steady = steady_up_to(review.responses, review.high)["major"]
    for k, (name, scale) in enumerate(review.scales.items()):
        largest = 2 * scale * steady.sel(case=name).max("speed").values * TO_UM
        if np.isfinite(largest).any():
            figure.add_trace(curve(z, largest, PIN_COLOURS[k % 6], name, 2))
    ends: dict[str, list[Any]] = {}
    for one in review.clearances:
        ends.setdefault(one.place, []).append(one)
    for place, own in ends.items():
        x = np.array([c.z for c in own]) * 1e3
        for share, dash, text in ((1.0, "solid", "clearance"), (standards.CLEARANCE, "dash", "75 %")):
            y = np.array([share * c.gap for c in own]) * TO_UM
            figure.add_trace(go.Scatter(x=x, y=y, mode="lines+markers", name=f"{text}, {place}",
                                        showlegend=False, marker={"size": 5, "color": UNSAFE},
                                        line={"color": UNSAFE, "width": 2.5, "dash": dash}))  # fmt: skip
    figure.update_xaxes(title_text="position along the shaft [mm]")
    figure.update_yaxes(title_text="motion, gap [µm]", rangemode="tozero")
    return style(figure, 360)


def _damping_text(review: DesignReview) -> str:
    speed, frequency, looked = review.onset
    text = "Least logarithmic decrement of all modes with a damping ratio below 0.5; dashed: 0.1. "
    if np.isfinite(speed):
        return text + f"A mode of {frequency / (2 * np.pi):.4g} Hz grows from {speed * TO_RPM:.0f} rpm."
    return text + ("No mode grows at the speeds that are looked at." if looked else "Not all was looked at.")


def damping_figure(review: DesignReview) -> go.Figure:
    """Least logarithmic decrement over speed, with the limit, the onset of whirl and the operating speeds."""
    figure = make_subplots(1, 1)
    d = review.decrements
    shown = np.clip(d.values, -1.0, 2.0)
    figure.add_trace(curve(d["speed"].values * TO_RPM, shown, PIN_COLOURS[0], "least log. decrement", 2, digits=7,
                           mode="lines+markers", marker={"size": 4}, showlegend=False), 1, 1)  # fmt: skip
    figure.add_hline(standards.LEAST_DECREMENT, line={"color": UNSAFE, "dash": "dash", "width": 1.5})
    figure.add_hline(0.0, line={"color": INK, "width": 1})
    _add_operating(figure, review, 1)
    _shade(figure, review, 1)
    figure.update_xaxes(title_text="speed [rpm]")
    figure.update_yaxes(title_text="log. decrement")
    return style(figure, 320)


def _map_block(review: DesignReview) -> Block:
    title = "Undamped critical speeds over the bearings' stiffness"
    if review.undamped is None:
        return Block(title, f"Not looked at: {review.no_map}")
    text = (
        "The undamped rotor on bearings of one stiffness each, the same in x and y. Thin lines are the stiffness that "
        "the bearings have at each speed, that of films at the frequency of the speed; horizontal: the operating "
        "speed. A critical speed lies near each crossing."
    )
    return Block(title, text, figure=map_figure(review))


def map_figure(review: DesignReview) -> go.Figure:
    """Undamped critical speed map with the bearings' own stiffness over the speed and the operating speed."""
    figure, found = go.Figure(), review.undamped
    assert found is not None
    for k in range(found.sizes["mode"]):
        figure.add_trace(curve(found["stiffness"].values, found["wn"].values[k] * TO_RPM, PIN_COLOURS[k % 6],
                               f"mode {k + 1}", 2.4))  # fmt: skip
    speeds = review.stiffness["speed"].values * TO_RPM
    for k, name in enumerate(review.stiffness["bearing"].values.tolist()):
        for axis, dash in (("x", "solid"), ("y", "dot")):
            K = review.stiffness.sel(bearing=name, axis=axis).values
            if (K > 0).any():
                figure.add_trace(curve(np.where(K > 0, K, np.nan), speeds, INK if k == 0 else UNSAFE,
                                       f"{name} K{axis}{axis}", 1.3, dash))  # fmt: skip
    figure.add_hline(review.high * TO_RPM, line={"color": NEUTRAL, "width": 2, "dash": "dash"})
    figure.update_xaxes(title_text="stiffness of a bearing [N/m]", type="log", exponentformat="power", dtick="D2")
    low = float(np.nanmin(found["wn"].values)) * TO_RPM / 1.5
    high = 1.5 * max(review.high, float(np.nanmin(found["wn"].values[-1]))) * TO_RPM
    figure.update_yaxes(
        title_text="critical speed [rpm]", type="log", dtick="D2", range=[np.log10(low), np.log10(high)]
    )
    return style(figure, 480)
