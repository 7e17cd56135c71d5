"""Page of a diagnosis for readers new to the method; its first screen has verdict, place, next step and gap."""

from collections.abc import Iterator, Sequence
from itertools import cycle
from textwrap import wrap
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.discrepancy import Diagnosis
from rotorsim.discrepancy.decision import DecisionSteps
from rotorsim.discrepancy.discovery import DiscoveredLaw
from rotorsim.discrepancy.equivalent_input import EquivalentInput
from rotorsim.discrepancy.force_shape import ForceShape
from rotorsim.discrepancy.gap import reduction
from rotorsim.discrepancy.law_terms import PART
from rotorsim.discrepancy.machine_file import difference
from rotorsim.discrepancy.result import NOTHING_BEYOND, located
from rotorsim.discrepancy.verdict import LEAST_SHOWN, NOTHING, Explanation, shown_share
from rotorsim.report.machine_sketch import MARKS, machine_sketch
from rotorsim.report.page import (
    AXIS_COLOURS,
    INK,
    NEUTRAL,
    SPECTRUM_SCALE,
    Block,
    Page,
    compact,
    page_of,
    phase_axes,
    phase_lag,
    style,
)
from rotorsim.report.units import quantity

METHOD = (
    "A simulated twin of the machine was run with the same speeds, pressures and excitation as the measured records. "
    "What the two differ by is compared with a floor: the scatter of the records, the declared tolerance of the model "
    "and the proven error of its solver. First the machine's calibration was fitted anew, so that ordinary errors of "
    "coefficients do not pass for physics; then every effect of the catalogue was tried."
)
HELD_OUT = {
    True: " Records held out at other operating points helped to choose.",
    False: " No record was held out: those that were fitted chose too.",
}
UNTOUCHED = {
    True: " Untouched records took no part in anything and are the test.",
    False: " No record was left untouched: nothing tests the verdict.",
}
"""Sentences of the method on records that were not fitted, by whether there are any."""
ALSO = {"found": "", "rival": "or ", "force": ""}
"""Words before a place by its role."""
MOST_PROPOSALS = 8
MORE_COLOURS = ("#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of curves after those of two axes."""
SPREAD = 2.0
"""Half width of the band of a law, in standard deviations."""
MOST_TURNS = 4.0
"""Way of a force over a motion, in its own ranges, above which the force does not follow from that motion alone."""
OVER_MOTION = (
    f"Force at the place over its motion{{by}}, in {100 * PART:.0f} % of a record's period, or more of a short one, "
    "about the largest motion: dots are the records, the line is what was found"
)
ALONE = ", its band two standard deviations of its numbers, taken one by one. "
WITH_MORE = (
    " from moment to moment. The force depends on more than this motion; where it depends on the motion before, the "
    "line is a loop. "
)
"""Caption of a force, and its end where the force is a function of the motion and where it is not."""


@page_of(Diagnosis)
def diagnosis_page(d: Diagnosis) -> Page:
    """Page of a diagnosis."""
    heading = f"{d.machine.name}: diagnosis"
    method = METHOD + HELD_OUT["held_out" in d.roles] + UNTOUCHED["untouched" in d.roles]
    blocks: list[Block | Sequence[Block]] = [_first_screen(d), *_blocks(d), Block("How it was found", method)]
    return Page(heading, d.sentence, blocks, _key_numbers(d))


def _key_numbers(d: Diagnosis) -> list[tuple[str, str]]:
    cards = [(d.status.replace("_", " "), "verdict")]
    if d.discovered is not None:
        cards += [(shown_share(d.discovered.probability), "probability of the law")]
    else:
        cards += [(shown_share(e.probability), _short_name(e)) for e in d.leading[:1]]
    cards += [(f"{len(d.localisation)}", "groups of lines beyond the floor")]
    share = reduction(d.gap)
    if d.explained and np.isfinite(share):
        cards.append((f"{100 * share:.0f} %", "gap gone on untouched records"))
    return cards


def _short_name(e: Explanation) -> str:
    if e.name == NOTHING:
        return f"that {e.name}"
    others = [" with ".join(keys) for keys in e.alike]
    return " or ".join([e.name, *(others if len(others) == 1 else [f"{len(others)} others"] if others else [])])


UNMARKED = {"recalibrated": "No effect is marked: numbers of the machine file differ, not what acts on the machine."}
"""Text of the sketch of the machine without a mark, by verdict."""


def _first_screen(d: Diagnosis) -> tuple[Block, ...]:
    """Blocks that a reader sees without scrolling."""
    places = located(d)
    sentences = [(f"{ALSO[one.role]}{one.sentence}", MARKS[one.role][1]) for one in places]
    marked = [(one.role, place) for one in places for place in one.places]
    scattered = d.status == "unknown" and not d.localisation  # nothing is beyond the scatter of the records
    meaning = NOTHING_BEYOND if scattered else d.texts.meaning
    notes = f"{len(d.notes)} notes" if len(d.notes) > 1 else "a note"
    unmarked = UNMARKED.get(d.status, "Nothing is marked: no effect was found.")
    blocks = [
        Block("Where on the machine", "" if sentences else unmarked,
              figure=machine_sketch(d.machine, marked), legend=sentences, tools=False),
        Block("What to do next", d.next_step, texts=(meaning, *d.file_notes[:1]), anchor="next",
              link=(f"The limits of these records: {notes} below.", "notes") if d.notes else None),
        Block("Gap before and after", "Rms of measured less simulated; line: scatter.",
              figure=gap_by_role(d), tools=False,
              legend=list(stages_of(d).items())),
    ]  # fmt: skip
    if d.explanations:
        blocks.insert(0, Block("How probable each explanation is", figure=leading_odds(d), tools=False))
    return tuple(blocks)


def _blocks(d: Diagnosis) -> Iterator[Block]:
    if d.steps is not None:
        yield _steps(d.steps)
    if d.explanations:
        yield _odds(d)
    if d.planned is not None:
        yield _plan(d.planned.as_dict())
    if d.effects:
        yield _effects(d)
    if d.discovered is not None:
        yield _law(d.discovered)
    if d.inputs:
        yield _inputs(d.inputs)
    yield Block(
        "The gap, record by record",
        "Rms of measured less simulated, both channels. Grey: the file as given; orange: re-calibrated; blue: with the "
        "effect. The tick is the scatter of the records, below which nothing can be seen: of periods and repeats, "
        "of neighbouring rows of a table, or the accuracy that is stated.",
        figure=gap_bars(d),
    )
    yield _gap_table(d)
    yield from _bode(d)
    if d.localisation:
        largest = [f"{f.group}, {f.channel} ({f.record}): {f.place}" for f in d.localisation if f.place]
        yield Block(
            "Where it disagrees",
            "Groups of lines whose residual, after re-calibration, is beyond the floor. 1X is the speed of the shaft, "
            "'slow' the mean and its drift, 'between' lines that nothing excites, 'unsteady' what does not repeat.",
            figure=flag_map(d),
            texts=[f"Largest residual: {'; '.join(largest)}."] if largest else (),
        )
        yield from _spectra(d)
    if d.unknown and d.unknown["lines"]:
        yield _unknown(d.unknown)
    if d.shape is not None:
        yield _shape(d.shape)
    if d.notes:
        yield Block("Limits of these records", texts=d.notes, anchor="notes")
    if d.tried:
        yield _tried(d)
    if d.priors:
        heads = ("size of an effect", "prior standard deviation", "shown by these records from")
        rows = [(key, sd, d.seen_from.get(key, "")) for key, sd in sorted(d.priors.items())]
        yield Block(
            "Sizes that were likely before the records, and that they show", heads=heads, rows=rows, folded=True
        )
    yield from _recalibration(d)
    if d.effects:
        yield Block("Machine file: what was added", code=difference(d.machine, d.apply()), folded=True)


def _recalibration(d: Diagnosis) -> Iterator[Block]:
    """Calibrated numbers of the machine file, and what was fitted with them."""
    heads = ("number", "in the machine file", "re-calibrated", "standard deviation", "change")
    yield Block("Re-calibration", heads=heads, rows=[row.cells for row in d.changes()], texts=d.file_notes[:1])
    if others := list(d.other_changes()):
        text = (
            "They are not among the numbers of the machine file as it was, or the records do not show them. Those "
            "without a unit are relative changes; mesh and law are shares of a finer mesh and of the other law of the "
            "injectors."
        )
        yield Block("What was fitted besides", text, ("number", "value", "standard deviation"), others, folded=True)


def _steps(steps: DecisionSteps) -> Block:
    """Odds after each step of a loop of diagnoses and experiments."""
    names = dict.fromkeys(n for step in steps.steps for n, p in step.odds.items() if p >= LEAST_SHOWN)
    rows = [
        (str(k), before, f"{step.minutes:.0f}", *(shown_share(step.odds.get(name, 0.0)) for name in names))
        for k, (step, before) in enumerate(zip(steps.steps, steps.names, strict=True))
    ]
    heads = ("step", "experiment", "rig time [min]", *names)
    return Block("Odds after each experiment", heads=heads, rows=rows, texts=[steps.sentence])


def _odds(d: Diagnosis) -> Block:
    """Explanations with their probabilities and the evidence for them."""
    text = (
        "Probability of each explanation, of nothing missing and of something that is not in the catalogue, from the "
        "evidence of the records. Explanations that no record distinguishes are one row."
    )
    rows = [
        (" or ".join([e.name, *(" with ".join(keys) for keys in e.alike)]), shown_share(e.probability),
         f"{e.evidence:.1f}" if np.isfinite(e.evidence) else "-",
         f"{100 * e.error:.2g} %" if np.isfinite(e.error) else "-", "yes" if e.refitted else "no")
        for e in d.explanations if e.probability >= LEAST_SHOWN
    ]  # fmt: skip
    heads = ("explanation", "probability", "log. evidence", "error of the form", "re-fitted")
    unseen = [f"Nothing is missing: {e.unseen_sentence}." for e in d.explanations if e.unseen]
    return Block("Probabilities", text, heads, rows, texts=unseen)


def _plan(plan: dict[str, Any]) -> Block:
    """Next experiments of `Plan.as_dict`: a sentence, what nothing separates, the best ones."""
    rows = [
        (p["experiment"], f"{p['minutes']:.0f}", f"{p['entropy_bit']:.2f}", f"{100 * p['chance_of_decision']:.0f} %")
        for p in plan["proposals"][:MOST_PROPOSALS]
    ]
    heads = ("experiment", "rig time [min]", "entropy left [bit]", "chance of a decision")
    return Block("What to record next", heads=heads, rows=rows, texts=(plan["sentence"], *plan["unbreakable"]))


def _effects(d: Diagnosis) -> Block:
    rows = [(f.form, p, value, sd or "held") for f in d.effects for p, value, sd in f.sizes()]
    alike = [
        f"{f.form} is indistinguishable from {', '.join(k for k in f.tie_class if k != f.form)}."
        for f in d.effects if len(f.tie_class) > 1
    ]  # fmt: skip
    texts = [*alike, *(f"Fits as well: {' with '.join(t)}." for t in d.ties)]
    return Block("What is missing", "", ("effect", "parameter", "value", "standard deviation"), rows, texts=texts)


def _law(law: DiscoveredLaw) -> Block:
    """The law that was discovered, with its numbers, and force against motion where it has a curve."""
    rows = [(key, value, sd or "held") for key, value, sd in law.sizes()]
    texts = [f"Its probability is {shown_share(law.probability)}; {law.refuted_by}"]
    texts += [f"These records do not exclude {', '.join(law.near)}."] if law.near else []
    texts += [f"{law.chosen.sentence}."] if law.chosen is not None else []
    figure = force_over_motion(law.curve) if law.curve else None
    heads, text = ("number", "value", "standard deviation"), "" if figure is None else caption(figure)
    return Block("The law that was discovered", text, heads, rows, texts=texts, figure=figure, code=law.law)


def _shape(shape: ForceShape) -> Block:
    """The force of free shape where neither an effect nor a law explains the gap."""
    rows = [(name, f"{fall:.0f}") for name, fall in shape.depends.items()]
    rows += [(f"at {place} instead", f"{less:.0f}") for place, less in shape.near.items()]
    figure = force_over_motion(shape.curve)
    text = caption(figure, ", by a Gaussian process") + "It proposes where to look and of what a force may be."
    heads = ("quantity or place", "fall of the log. evidence without it")
    return Block("The shape of a force that would explain it", text, heads, rows, texts=[shape.sentence], figure=figure)


def _inputs(inputs: Sequence[EquivalentInput]) -> Block:
    """The references of the pins that would make the gap, over the commanded ones."""
    text = (
        "Ratio of the input that would make the measured response to the commanded one, next to a new calibration. "
        "Dots with two standard deviations are the records, the line is what was found. A phase that falls with the "
        "frequency is an input that comes late; pins that follow one reference are better known together."
    )
    texts = [f"{one.sentence}." for one in inputs]
    return Block("Equivalent input of the injectors", text, figure=ratios_of(inputs), texts=texts)


def ratios_of(inputs: Sequence[EquivalentInput]) -> go.Figure:
    """Gain [1] and phase [deg] of the equivalent over the commanded input, over frequency."""
    figure = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.08)
    for one, colour in zip(inputs, cycle([*AXIS_COLOURS.values(), *MORE_COLOURS])):
        gain = one.gain, one.gain_sd, np.abs(one.law)
        phase = tuple(map(np.rad2deg, (one.phase, one.phase_sd, np.angle(one.law))))
        for row, (y, sd, law) in enumerate((gain, phase), 1):
            own = {"x": compact(one.frequency), "name": one.name, "legendgroup": one.name,
                   "visible": True if len(one.injectors) > 1 else "legendonly"}  # fmt: skip
            bars = {"array": compact(SPREAD * sd), "color": colour}
            figure.add_scatter(**own, y=compact(y), mode="markers", error_y=bars, showlegend=row == 1,
                               marker={"color": colour}, row=row, col=1)  # fmt: skip
            if law.size:
                figure.add_scatter(**own, y=compact(law), mode="lines", line={"color": colour}, showlegend=False,
                                   row=row, col=1)  # fmt: skip
    for row, title in enumerate(("gain", "phase [deg]"), 1):
        figure.update_yaxes(title=title, row=row, col=1)
    figure.update_xaxes(title="frequency [Hz]", row=2, col=1)
    return style(figure, 480)


def caption(figure: go.Figure, by: str = "") -> str:
    """Sentence on a figure of `force_over_motion`."""
    return OVER_MOTION.format(by=by) + (ALONE if any(one.name == "band" for one in figure.data) else WITH_MORE)


def turns(motion: np.ndarray, force: np.ndarray) -> float:
    """Way of a force (n, 2) over a motion (n, 2) in its own ranges: 1 where it rises with it, 2 for a valley."""
    ways = [np.abs(np.diff(f[np.argsort(x, kind="stable")])).sum() for x, f in zip(motion.T, force.T, strict=True)]
    return float(max(ways) / max(np.ptp(force), 1e-300))


def force_over_motion(curve: dict[str, np.ndarray]) -> go.Figure:
    """Force (y) [N] over displacement [µm] or velocity [mm/s], measured and as a law or a process has it.

    It is a line with a band over the motion of which it is a function; else its way from moment to moment, a loop.
    """
    kinds = {"displacement [µm]": curve["displacement"] * TO_UM, "velocity [mm/s]": curve["velocity"] * 1e3}
    ways = {name: turns(motion, curve["law"]) for name, motion in kinds.items()}
    single = min(ways.values()) < MOST_TURNS
    unit = min(ways, key=lambda name: ways[name]) if single else "displacement [µm]"
    motion, figure = kinds[unit], make_subplots(1, 2, subplot_titles=("x", "y"))
    for i, axis in enumerate("xy"):
        order = np.argsort(motion[:, i]) if single else np.arange(len(motion))
        dots = {"x": motion[:, i], "y": curve["measured"][:, i], "name": "measured"}
        line = {"x": motion[order, i], "y": curve["law"][order, i], "name": "model"}
        shown = {"row": 1, "col": i + 1}
        figure.add_trace(go.Scatter(**dots, mode="markers", marker={"size": 4, "color": NEUTRAL}, showlegend=not i),
                         **shown)  # fmt: skip
        if single:
            edge = SPREAD * curve["spread"][order, i]
            band = {"x": np.concatenate([line["x"], line["x"][::-1]]), "name": "band",
                    "y": np.concatenate([line["y"] + edge, (line["y"] - edge)[::-1]])}  # fmt: skip
            figure.add_trace(go.Scatter(**band, mode="lines", fill="toself", opacity=0.3, showlegend=not i,
                                        line={"width": 0, "color": AXIS_COLOURS[axis]}), **shown)  # fmt: skip
        look = {"color": AXIS_COLOURS[axis], "width": 2 if single else 1}
        figure.add_trace(go.Scatter(**line, line=look, mode="lines", showlegend=not i), **shown)
        figure.update_xaxes(title_text=unit, **shown)
    figure.update_yaxes(title_text="force [N]", row=1, col=1)
    return style(figure, 340)


def _gap_table(d: Diagnosis) -> Block:
    rows = []
    channels = {shown["record"]: shown["channels"] for part in d.spectra.values() for shown in part}
    for i, record in enumerate(d.gap["record"].values):
        for a, axis in enumerate(channels.get(str(record), ("x", "y"))):
            g = d.gap["gap"].values[i, a] * TO_UM
            rows.append(
                (str(d.gap["role"].values[i]).replace("_", " "), str(record), str(d.gap["point"].values[i]), axis,
                 f"{g[0]:.3f}", f"{g[1]:.3f}", f"{g[2]:.3f}" if d.explained else "", f"{g[3]:.3f}")
            )  # fmt: skip
    sizes = (f"{name} [um rms]" for name in ("file as given", "re-calibrated", "with the effect", "scatter"))
    heads = ("role", "record", "point", "channel", *sizes)
    return Block("The gap as numbers", heads=heads, rows=rows, folded=True)


def _bode(d: Diagnosis) -> Iterator[Block]:
    """Bode plot of every order of every table of vectors; the name of a part is that of its table and its role."""
    tables: dict[str, list[dict[str, Any]]] = {}
    for shown in (s for part in d.spectra.values() for s in part if s["orders"]):
        tables.setdefault(str(shown["record"]).rpartition(", ")[0], []).append(shown)
    for name, parts in tables.items():
        for number, order in enumerate(parts[0]["orders"]):
            yield Block(
                f"{name[:1].upper()}{name[1:]}: {order}X over the speed",
                "Points: measured, all roles. Grey: the file as given; orange: re-calibrated; blue: with the effect.",
                figure=bode(parts, number, d.explained),
            )


def _spectra(d: Diagnosis) -> Iterator[Block]:
    shown = [s for part in d.spectra.values() for s in part]
    if any(s["orders"] for s in shown):
        return
    named = d.explained
    worst = [("Spectrum where it disagrees most", s) for s in shown if s["record"] == d.localisation[0].record]
    untouched = [("Spectrum of an untouched record", s) for s in d.spectra.get("untouched", [])[:1]]
    for title, one in worst + untouched:
        text = "Lines of measured and of what is left."
        yield Block(f"{title}: {one['point']}", text, figure=spectra(one, named))
    text = "Residual spectra of all records, one scale."
    yield Block("What is left over the speed", text, figure=waterfall(d, named))


def _unknown(unknown: dict[str, Any]) -> Block:
    rows = [
        (x["point"], f"{x['frequency_hz']:.4g} Hz" + (", unsteady" if x["unsteady"] else ""),
         "" if x["order"] is None else f"{x['order']:.2f} X",
         f"{quantity(x['force_n'], 'N')}", x["direction"], f"{quantity(x['residual_um'], 'µm')}")
        for x in unknown["lines"]
    ]  # fmt: skip
    growth = ", ".join(f"{k} to the power {v:.1f}" for k, v in unknown["growth"].items())
    text = f"Acting {unknown['where']}." + (f" The force grows with {growth}." if growth else "")
    if growth and unknown.get("calibrated_share"):
        text += (
            f" That is before re-calibration, which took up {100 * unknown['calibrated_share']:.0f} % of its motion."
        )
    heads = ("point", "frequency", "order", "force", "direction", "residual")
    return Block("Equivalent force of what is not explained", heads=heads, rows=rows, texts=[text])


def _tried(d: Diagnosis) -> Block:
    rows = [
        (" with ".join(t["effects"]), *("fit failed", "-", "-"))
        if t["failed"]
        else (" with ".join(t["effects"]), f"{100 * t['gone']:.0f} %", f"{t['cost']:.0f}", f"{t['held_out']:.0f}")
        for t in sorted(d.tried, key=lambda t: t["cost"])
    ]
    heads = ("explanation", "excess gone", "sum of squares", "excess at held-out points")
    return Block("Everything that was re-fitted", heads=heads, rows=rows, folded=True)


COLOURS = {"file as given": "#8a949e", "re-calibrated": AXIS_COLOURS["y"], "with the effect": AXIS_COLOURS["x"]}


def flag_map(diagnosis: Diagnosis) -> go.Figure:
    """Flagged groups of lines over operating points: size of the residual over the floor."""
    flags = diagnosis.localisation
    points = list(dict.fromkeys(in_lines(f"{f.record}: {f.point}") for f in sorted(flags, key=lambda f: f.number)))
    groups = list(dict.fromkeys(f"{f.group}, {f.channel}" for f in sorted(flags, key=lambda f: (f.group, f.channel))))
    z = np.full((len(points), len(groups)), np.nan)
    texts = [[""] * len(groups) for _ in points]
    for f in flags:
        row, column = points.index(in_lines(f"{f.record}: {f.point}")), groups.index(f"{f.group}, {f.channel}")
        texts[row][column], z[row, column] = f.place, f.rms / f.floor
    figure = go.Figure(
        go.Heatmap(
            z=compact(z), x=groups, y=points, colorscale=SPECTRUM_SCALE, zmin=0,
            colorbar={"title": "residual<br>over floor"},
            text=texts, hovertemplate="%{y}<br>%{x}<br>%{z:.3g} times the floor<br>%{text}<extra></extra>",
        )
    )  # fmt: skip
    figure = style(figure, max(280, 160 + 34 * len(points)))
    figure.update_yaxes(autorange="reversed", automargin=True)
    figure.update_xaxes(automargin=True)
    return figure


def gap_bars(diagnosis: Diagnosis) -> go.Figure:
    """Gap of every record, both channels together: file as given, re-calibrated, with the effect, and the scatter."""
    gap = diagnosis.gap
    total = np.sqrt(np.nansum(gap["gap"].values ** 2, axis=1)) * TO_UM
    order = np.argsort([("fit", "held_out", "untouched").index(r) for r in gap["role"].values], kind="stable")
    points = [f"{r.replace('_', ' ')}: {p}" for r, p in zip(gap["role"].values, gap["point"].values, strict=True)]
    names: list[str] = []
    for i in order:  # records that repeat a point, and planes of one record, by the record's name
        name = points[i] if points.count(points[i]) == 1 else f"{points[i]}, {gap['record'].values[i]}"
        name = in_lines(f"{name} ({len(names) + 1})" if in_lines(name) in names else name)
        names.append(name)
    figure = go.Figure()
    for s, (stage, colour) in enumerate(stages_of(diagnosis).items()):
        figure.add_bar(y=names, x=compact(total[order, s]), name=stage, marker_color=colour, orientation="h")
    figure.add_scatter(
        y=names, x=compact(total[order, 3]), name="scatter", mode="markers",
        marker={"symbol": "line-ns", "size": 14, "line": {"width": 2, "color": INK}},
    )  # fmt: skip
    figure = style(figure, 120 + 38 * len(names), barmode="group")
    figure.update_yaxes(autorange="reversed", automargin=True)
    figure.update_xaxes(title="gap [µm rms]", rangemode="tozero")
    return figure


def spectra(shown: dict[str, Any], with_effect: bool) -> go.Figure:
    """Lines of one record: measured, residual re-calibrated and with the effect, floor."""
    channels = shown["channels"]
    titles = [f"disc, {channel}" for channel in channels]
    figure = make_subplots(rows=len(channels), cols=1, shared_xaxes=True, subplot_titles=titles, vertical_spacing=0.1)
    f = compact(shown["frequency"])
    for c in range(len(channels)):
        first = c == 0
        lines = [("measured", shown["measured"][c], "#8a949e", 1), ("re-calibrated", shown["stages"][1][c],
                 COLOURS["re-calibrated"], 1.4)]  # fmt: skip
        if with_effect:
            lines.append(("with the effect", shown["stages"][2][c], COLOURS["with the effect"], 1.4))
        lines.append(("floor", shown["floor"][c], NEUTRAL, 1.4))
        for name, y, colour, width in lines:
            figure.add_scatter(
                x=f, y=compact(y * TO_UM), name=name, showlegend=first, legendgroup=name, mode="lines",
                line={"color": colour, "width": width, "dash": "dot" if name == "floor" else "solid"}, row=c + 1, col=1,
            )  # fmt: skip
    figure = style(figure, 560 if len(channels) > 1 else 360)
    figure.update_yaxes(type="log", title="amplitude [µm 0-pk]", exponentformat="power")
    figure.update_xaxes(title="frequency [Hz]", row=len(channels), col=1)
    return figure


def bode(parts: list[dict[str, Any]], number: int, with_effect: bool) -> go.Figure:
    """Amplitude and phase lag of one order over the speed: measured and simulated, before and after.

    `parts` are the parts of one table, whose rows belong to different roles.
    """
    channels = parts[0]["channels"]
    titles = [f"{what}, disc, {channel}" for what in ("amplitude", "phase lag") for channel in channels]
    figure = make_subplots(rows=2, cols=len(channels), shared_xaxes=True, subplot_titles=titles, vertical_spacing=0.1)
    order = np.argsort(np.concatenate([p["speeds"] for p in parts]))
    speeds = np.concatenate([p["speeds"] for p in parts])[order] * TO_RPM

    def joined(vectors: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([v[:, number] for v in vectors], axis=1)[:, order]

    curves = [("measured", joined([p["measured_vectors"] for p in parts]), INK, "markers")]
    for stage, (name, colour) in enumerate(COLOURS.items()):
        if name != "with the effect" or with_effect:
            curves.append((name, joined([p["simulated_vectors"][stage] for p in parts]), colour, "lines"))
    middle = [np.nan, np.nan]
    for name, values, colour, mode in curves:
        for c in range(len(channels)):
            lag = phase_lag(values[c])
            seen = lag[np.isfinite(lag)]
            middle[c] = float(np.median(seen)) if name == "measured" and seen.size else middle[c]
            if seen.size and np.isfinite(middle[c]):
                lag -= 360 * np.round((np.median(seen) - middle[c]) / 360)
            for row, y in ((1, np.abs(values[c]) * TO_UM), (2, lag)):
                figure.add_scatter(
                    x=compact(speeds), y=compact(y), name=name, mode=mode, legendgroup=name,
                    showlegend=row == 1 and c == 0, marker={"color": colour, "size": 4},
                    line={"color": colour, "width": 1.6}, row=row, col=c + 1,
                )  # fmt: skip
    figure = style(figure, 560)
    figure.update_yaxes(title="amplitude [µm 0-pk]", row=1, col=1)
    phase_axes(figure, 2)
    figure.update_xaxes(title="speed [rpm]", row=2)
    return figure


def waterfall(diagnosis: Diagnosis, with_effect: bool) -> go.Figure:
    """Residual spectra of all records over the speed, before and after, disc x."""
    every = sorted((s for part in diagnosis.spectra.values() for s in part), key=lambda s: s["speed"])
    columns = 2 if with_effect else 1
    titles = ("re-calibrated", "with the effect")[:columns]
    figure = make_subplots(rows=1, cols=columns, shared_yaxes=True, subplot_titles=titles, horizontal_spacing=0.05)
    top = max(float(s["stages"][1].max()) for s in every) * TO_UM
    for k in range(columns):
        for n, s in enumerate(every):
            size = np.hypot(*s["stages"][k + 1]) * TO_UM
            height = n + 1.6 * size / top
            figure.add_scatter(
                x=compact(s["frequency"]), y=compact(height), mode="lines", showlegend=False, fill=None,
                line={"color": list(COLOURS.values())[k + 1], "width": 1}, hovertext=s["point"], row=1, col=k + 1,
            )  # fmt: skip
        figure.update_xaxes(title="frequency [Hz]", row=1, col=k + 1)
    figure = style(figure, 140 + 38 * len(every))
    figure.update_yaxes(
        tickvals=list(range(len(every))), ticktext=[f"{s['speed'] * TO_RPM:.0f}" for s in every], title="", col=1, row=1
    )
    figure.update_yaxes(title="speed [rpm]", col=1)
    return figure


MOST, ALIKE = 5, 2
"""Explanations with a bar of their own, and indistinguishable ones that are named with it."""
LINE = 26
"""Characters of a line of a bar's name."""
ROLES = {"fit": "fitted", "held_out": "held out", "untouched": "untouched"}


def leading_odds(diagnosis: Diagnosis) -> go.Figure:
    """Probability [%] of the leading explanations; the rest together."""
    shown = [e for e in diagnosis.leading if e.probability >= LEAST_SHOWN]
    rest = sum(e.probability for e in diagnosis.leading) - sum(e.probability for e in shown[:MOST])
    bars = [(_name(e), e.probability, NEUTRAL if e.beyond or not e.effects else COLOURS["with the effect"])
            for e in shown[:MOST]]  # fmt: skip
    bars += [("all others", rest, COLOURS["file as given"])] if rest >= 0.005 else []
    names, shares, colours = (list(column) for column in zip(*bars, strict=True))
    figure = go.Figure(
        go.Bar(
            x=[100 * share for share in shares], y=names, orientation="h", marker_color=colours, width=0.62,
            text=[f"<b>{shown_share(share)}</b>" for share in shares], textposition="outside", cliponaxis=False,
            hovertemplate="%{y}<br>%{x:.3g} %<extra></extra>",
        )
    )  # fmt: skip
    lines = sum(max(2, 1 + name.count("<br>")) for name in names)
    style(figure, max(170, 65 + 20 * lines))
    figure.update_layout(margin={"r": 72, "t": 8, "b": 42}, dragmode=False)
    figure.update_yaxes(autorange="reversed", automargin=True, ticks="", fixedrange=True)
    figure.update_xaxes(title="probability [%]", range=[0, 100], fixedrange=True)
    return figure


def _name(one: Explanation) -> str:
    """Name in lines, with the explanations that no record distinguishes from it."""
    alike = [" with ".join(keys) for keys in one.alike]
    texts = [one.name, *(f"or {name}" for name in alike[:ALIKE])]
    texts += [f"or {len(alike) - ALIKE} more"] if len(alike) > ALIKE else []
    return "<br>".join(map(in_lines, texts))


def in_lines(text: str) -> str:
    """Text in lines of at most `LINE` characters."""
    return "<br>".join(wrap(text, LINE, break_on_hyphens=False))


def stages_of(diagnosis: Diagnosis) -> dict[str, str]:
    """Stages of the gap that a diagnosis has, with their colours."""
    return {name: colour for name, colour in COLOURS.items() if name != "with the effect" or diagnosis.explained}


def gap_by_role(diagnosis: Diagnosis) -> go.Figure:
    """Gap [um rms] of the records of each role: file as given, re-calibrated, with the effect, and the scatter."""
    gap = diagnosis.gap
    squares = np.nansum(gap["gap"].values ** 2, axis=1)
    own = {role: squares[gap["role"].values == role] for role in ROLES}
    own = {role: of_role for role, of_role in own.items() if len(of_role)}
    names = [f"{len(of_role)} {ROLES[role]}" for role, of_role in own.items()]
    size = np.array([np.sqrt(of_role.mean(axis=0)) for of_role in own.values()]).reshape(len(own), -1) * TO_UM
    figure = go.Figure()
    for stage, (name, colour) in enumerate(stages_of(diagnosis).items()):
        figure.add_bar(
            y=names, x=compact(size[:, stage]), name=name, orientation="h",
            marker_color=colour, texttemplate="%{x:.2g}", textposition="outside", cliponaxis=False,
            textfont={"size": 11}, constraintext="none",
        )  # fmt: skip
    figure.add_scatter(
        y=names, x=compact(size[:, 3]), name="scatter", mode="markers",
        marker={"symbol": "line-ns", "size": 34, "line": {"width": 2, "color": INK}},
    )  # fmt: skip
    style(figure, 66 + 47 * len(names), barmode="group", bargap=0.12, dragmode=False)
    figure.update_layout(margin={"r": 45, "t": 6, "b": 42}, showlegend=False)
    figure.update_yaxes(autorange="reversed", automargin=True, ticks="", fixedrange=True)
    figure.update_xaxes(title="gap [µm rms]", rangemode="tozero", fixedrange=True)
    return figure
