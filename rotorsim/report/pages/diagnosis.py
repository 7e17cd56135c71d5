"""Report of a diagnosis: self-contained HTML page for readers new to the method."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from html import escape
from typing import TYPE_CHECKING, Any

from rotorsim.base.constants import TO_UM
from rotorsim.discrepancy.explanation import LEAST_SHOWN, shown_share
from rotorsim.discrepancy.outcome.machine_file import difference
from rotorsim.report.export.display_units import quantity
from rotorsim.report.figures import diagnosis_plots as plots
from rotorsim.report.pages import html
from rotorsim.report.pages.diagnosis_summary import first_screen

if TYPE_CHECKING:
    from rotorsim.discrepancy import Diagnosis
    from rotorsim.discrepancy.outcome.steps import DecisionSteps

INTRODUCTION = (
    "A simulated twin of the machine was run with the same speeds, pressures and excitation as the measured records. "
    "What the two differ by is compared with a floor: the scatter of repeats, the declared tolerance of the model and "
    "the proven error of its solver. First the machine's calibration was fitted anew, so that ordinary errors of "
    "coefficients do not pass for physics; then every effect of the catalogue was tried. Records held out at other "
    "operating points helped to choose; untouched records took no part in anything and are the test."
)


def page(diagnosis: Diagnosis) -> str:
    """The page's text."""
    title = f"{diagnosis.machine.name}: diagnosis"
    method = html.section("How it was found", f"<p>{INTRODUCTION}</p>")
    body = f"{first_screen(diagnosis)}{''.join(_sections(diagnosis))}{method}"
    return html.document(title, title, diagnosis.sentence, body)


def _sections(d: Diagnosis) -> Iterator[str]:
    if d.steps is not None:
        yield _steps(d.steps)
    if d.explanations:
        yield _odds(d)
    if d.planned is not None:
        yield _plan(d.planned.as_dict())
    if d.effects:
        yield _effects(d)
    yield html.figure_section(
        "The gap, record by record",
        "Rms of measured less simulated, both channels. Grey: the file as given; orange: re-calibrated; blue: with the "
        "effect. The tick is the scatter of repeats, below which nothing can be seen.",
        plots.gap_bars(d),
    )
    yield _gap_table(d)
    yield from _bode(d)
    if d.localisation:
        yield html.figure_section(
            "Where it disagrees",
            "Groups of lines whose residual, after re-calibration, is beyond the floor. 1X is "
            "the speed of the shaft, 'slow' the mean and its drift, 'between' lines that nothing excites, 'unsteady' "
            "what does not repeat from period to period.",
            plots.flag_map(d),
            _largest(d),
        )
        yield from _spectra(d)
    if d.unknown and d.unknown["lines"]:
        yield _unknown(d)
    if d.notes:
        text = "".join(f"<p>{escape(n)}</p>" for n in d.notes)
        yield f'<section id="notes"><h2>Limits of these records</h2>{text}</section>'
    yield _tried(d)
    yield _priors(d)
    text = "A number without a unit is a change relative to the machine file; mesh and law are weights."
    heads = (("fit parameter", "change", "standard deviation"),)
    yield _table("Re-calibration", heads, d.changes(), f"<p>{text}</p>" if d.calibration else "")
    if d.effects:
        yield (
            "<details><summary>Machine file: what was added</summary><pre>"
            f"{escape(difference(d.machine, d.apply()))}</pre></details>"
        )


def _odds(d: Diagnosis) -> str:
    """Explanations with their probabilities and the evidence for them."""
    text = (
        "Of each explanation, of nothing missing and of something that is not in the catalogue, from the evidence of "
        "the records. Explanations that no record distinguishes are one row."
    )
    rows = [
        (" or ".join([e.name, *(" with ".join(keys) for keys in e.alike)]), shown_share(e.probability),
         f"{e.evidence:.1f}", f"{100 * e.error:.2g} %", "yes" if e.refitted else "no")
        for e in d.explanations if e.probability >= LEAST_SHOWN
    ]  # fmt: skip
    unseen = "".join(f"<p>Nothing is missing: {escape(e.unseen_sentence)}.</p>" for e in d.explanations if e.unseen)
    head = ("explanation", "probability", "log. evidence", "error of the form", "re-fitted")
    return html.section("Probabilities", f"<p>{text}</p>{html.table(rows, (head,))}{unseen}")


def _plan(plan: dict[str, Any]) -> str:
    """What to record next: a sentence, what nothing separates, the best experiments; of `Plan.as_dict`."""
    text = "".join(f"<p>{escape(line)}</p>" for line in (plan["sentence"], *plan["unbreakable"]))
    heads = (("experiment", "rig time [min]", "entropy left [bit]", "chance of a decision"),)
    rows = [
        (p["experiment"], f"{p['minutes']:.0f}", f"{p['entropy_bit']:.2f}", f"{100 * p['chance_of_decision']:.0f} %")
        for p in plan["proposals"][:8]
    ]
    return _table("What to record next", heads, rows, text) if rows else html.section("What to record next", text)


def _largest(d: Diagnosis) -> str:
    """Where among the rows of vectors a flagged residual is largest."""
    places = [f"{f.group}, {f.channel} ({f.record}): {f.place}" for f in d.localisation if f.place]
    return f"<p>Largest residual: {escape('; '.join(places))}.</p>" if places else ""


def _effects(d: Diagnosis) -> str:
    rows = [(f.form, p, value, sd or "held") for f in d.effects for p, value, sd in f.sizes()]
    text = "".join(
        f"<p>{escape(f.form)} is indistinguishable from {escape(', '.join(k for k in f.tie_class if k != f.form))}.</p>"
        for f in d.effects
        if len(f.tie_class) > 1
    )
    text += "".join(f"<p>Fits as well: {escape(' with '.join(t))}.</p>" for t in d.ties)
    return _table("What is missing", (("effect", "parameter", "value", "standard deviation"),), rows, text)


def _bode(d: Diagnosis) -> Iterator[str]:
    """Bode plot of every order of every table of vectors; the name of a part is that of its table and its role."""
    tables: dict[str, list[dict[str, Any]]] = {}
    for shown in (s for part in d.spectra.values() for s in part if s["orders"]):
        tables.setdefault(str(shown["record"]).rpartition(", ")[0], []).append(shown)
    for name, parts in tables.items():
        for number, order in enumerate(parts[0]["orders"]):
            yield html.figure_section(
                f"{name[:1].upper()}{name[1:]}: {order}X over the speed",
                "Points: measured, all roles. Grey: the file as given; orange: re-calibrated; blue: with the effect.",
                plots.bode(parts, number, bool(d.effects)),
            )


def _spectra(d: Diagnosis) -> Iterator[str]:
    if any(s["orders"] for part in d.spectra.values() for s in part):
        return
    named = bool(d.effects)
    worst = d.localisation[0].record
    chosen = [s for part in d.spectra.values() for s in part if s["record"] == worst]
    untouched = d.spectra.get("untouched", [])
    for title, shown in [("Spectrum where it disagrees most", c) for c in chosen] + [
        ("Spectrum of an untouched record", s) for s in untouched[:1]
    ]:
        yield html.figure_section(
            f"{title}: {shown['point']}", "Lines of measured and of what is left.", plots.spectra(shown, named)
        )
    yield html.figure_section(
        "What is left over the speed", "Residual spectra of all records, one scale.", plots.waterfall(d, named)
    )


def _steps(steps: DecisionSteps) -> str:
    """Odds after each step of a loop of diagnoses and experiments."""
    names = dict.fromkeys(n for step in steps.steps for n, p in step.odds.items() if p >= LEAST_SHOWN)
    rows = [
        (str(k), before, f"{step.minutes:.0f}", *(shown_share(step.odds.get(name, 0.0)) for name in names))
        for k, (step, before) in enumerate(zip(steps.steps, steps.names, strict=True))
    ]
    head = (("step", "experiment", "rig time [min]", *names),)
    return _table("Odds after each experiment", head, rows, f"<p>{escape(steps.sentence)}</p>")


def _priors(d: Diagnosis) -> str:
    """Prior standard deviations of the sizes."""
    if not d.priors:
        return ""
    table = html.table(sorted(d.priors.items()), (("size of an effect", "prior standard deviation"),))
    return f"<details><summary>What sizes were taken for likely before the records</summary>{table}</details>"


def _gap_table(d: Diagnosis) -> str:
    rows = []
    channels = {shown["record"]: shown["channels"] for part in d.spectra.values() for shown in part}
    for i, record in enumerate(d.gap["record"].values):
        for a, axis in enumerate(channels.get(str(record), ("x", "y"))):
            g = d.gap["gap"].values[i, a] * TO_UM
            rows.append(
                (str(d.gap["role"].values[i]).replace("_", " "), str(record), str(d.gap["point"].values[i]), axis,
                 f"{g[0]:.3f}", f"{g[1]:.3f}", f"{g[2]:.3f}" if d.effects else "", f"{g[3]:.3f}")
            )  # fmt: skip
    sizes = (f"{name} [um rms]" for name in ("nominal", "re-calibrated", "with effect", "scatter"))
    head = ("role", "record", "point", "channel", *sizes)
    return f"<details><summary>The gap as numbers</summary>{html.table(rows, (head,))}</details>"


def _unknown(d: Diagnosis) -> str:
    rows = [
        (x["point"], f"{x['frequency_hz']:.4g} Hz" + (", unsteady" if x["unsteady"] else ""),
         "" if x["order"] is None else f"{x['order']:.2f} X",
         f"{quantity(x['force_n'], 'N')}", x["direction"], f"{quantity(x['residual_um'], 'µm')}")
        for x in d.unknown["lines"]
    ]  # fmt: skip
    growth = ", ".join(f"{k} to the power {v:.1f}" for k, v in d.unknown["growth"].items())
    text = f"<p>Acting {escape(d.unknown['where'])}." + (f" It grows with {escape(growth)}.</p>" if growth else "</p>")
    head = ("point", "frequency", "order", "force", "direction", "residual")
    return _table("Equivalent force of what is not explained", (head,), rows, text)


def _tried(d: Diagnosis) -> str:
    rows = [
        (" with ".join(t["effects"]), *("fit failed", "-", "-"))
        if t["failed"]
        else (" with ".join(t["effects"]), f"{100 * t['gone']:.0f} %", f"{t['cost']:.0f}", f"{t['held_out']:.0f}")
        for t in sorted(d.tried, key=lambda t: t["cost"])
    ]
    if not rows:
        return ""
    head = ("explanation", "excess gone", "sum of squares", "excess at held-out points")
    return f"<details><summary>Everything that was re-fitted</summary>{html.table(rows, (head,))}</details>"


def _table(title: str, head: tuple[tuple[str, ...], ...], rows: Iterable[tuple[str, ...]], after: str = "") -> str:
    return html.section(title, html.table(rows, head) + after)
