"""Pages of random machines (distributions, misses, which tolerance matters most) and of a search for the best one."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.analysis.optimise import Optimisation
from rotorsim.analysis.tolerances import AGREED, SURE, WHOLE, RandomResult, Requirement, quantity_of
from rotorsim.base.units import TO_MPA, TO_RPM
from rotorsim.report.page import INK, PIN_COLOURS, UNSAFE, Block, Page, compact, machine_entry, page_of, style
from rotorsim.report.units import quantity

COLUMNS = 2
"""Columns of the distributions."""
PANEL = 230
"""Height [px] of a distribution."""
BINS = 30
"""Most bars of a distribution; fewer than a third of the machines where these are few."""
MOST_ROWS = 400
"""Machines that are listed."""
SHARED = (
    "Shares in the scatter by regression of ranks. They are estimates, which add up to R^2: among few machines values "
    "go together by chance, and one share may be below 0 and another above 100 %."
)
"""Note on the shares of a tolerance."""


@page_of(RandomResult)
def random_page(result: RandomResult) -> Page:
    """Page of random machines."""
    attrs = result.data.attrs
    spread = (
        "quantity",
        "nominal",
        "mean",
        "standard deviation",
        "5 %",
        "50 %",
        "95 %",
        "not known",
        "above the highest",
    )
    rows = [(f"{q.meaning} [{q.shown}]", *map(_number, result.distribution(q.name).values()))
            for q in result.quantities]  # fmt: skip
    laws = {True: "normal, 2 sigma", False: "uniform"}
    varied = [(v.path, f"{v.centre:.6g} {v.unit}", f"{v.half:.4g} {v.unit}", laws[v.normal])
              for v in result.variations]  # fmt: skip
    head, table = result.table()
    cells = [["-" if value is None else _number(value) for value in row] for row in table[:MOST_ROWS]]
    text = "" if len(table) <= MOST_ROWS else f"The first {MOST_ROWS} of {len(table)} machines; all are in the files."
    missed = ("requirement", "missed", "of these not known", "probability", f"interval of {100 * SURE:.0f} %")
    blocks = [
        Block("Probability of a miss", "What is not known counts as a miss.", missed, miss_rows(result)),
        Block("Distributions", f"{confirmed(result)} Dashed: nominal; red: requirement.", spread, rows,
              distributions_figure(result)),
        Block("Which tolerance matters most", SHARED,
              ("quantity", "R^2", "most by", "share"), share_rows(result), shares_figure(result)),
        Block("What varies", "", ("value", "nominal", "tolerance +-", "distribution"), varied),
        Block("Machine by machine", text, head, cells),
    ]  # fmt: skip
    about = (
        f"{result.data.sizes['sample']} machines, a Latin hypercube; supply pressure "
        f"{quantity(attrs['pressure'] * TO_MPA, 'MPa', '.4g')} gauge; speeds up to "
        f"{attrs['highest_speed'] * TO_RPM:.0f} rpm."
    )
    return Page(f"{machine_entry(attrs)}: random machines", about, [b for b in blocks if b.rows])


def confirmed(result: RandomResult) -> str:
    """Sentence on how far followed speeds agree with whole searches."""
    if not result.confirmed:
        return "Every quantity was searched wholly for every machine."
    worst = max(result.confirmed.values())
    text = f"Critical speeds and onsets were followed from the nominal machine; {WHOLE} machines were searched wholly"
    if worst < AGREED:
        return f"{text}, and differ by up to {worst:.1g}."
    bad = ", ".join(name for name, apart in result.confirmed.items() if apart >= AGREED)
    return f"{text}, and DIFFER in {bad}: take these as not known, and sweep them with --over."


def miss_rows(result: RandomResult) -> list[tuple[str, str, str, str, str]]:
    """Requirement, machines that miss it, those not known, probability and interval."""
    found = [(with_mode(one.text, one.quantity, result.modes), result.misses(one)) for one in result.requirements]
    return [(text, str(k), str(unknown), f"{100 * p:.3g} %", f"{100 * low:.3g} to {100 * high:.3g} %")
            for text, (k, unknown, p, low, high) in found]  # fmt: skip


def with_mode(text: str, quantity: str, modes: dict[str, str]) -> str:
    """A text on a quantity; of a critical speed with the nominal mode that has it."""
    return f"{text} ({modes[quantity]})" if quantity in modes else text


def share_rows(result: RandomResult) -> list[tuple[str, str, str, str]]:
    """Quantity, R^2, the value that matters most and its share."""
    rows = []
    for q in result.quantities:
        shares, r2 = result.shares(q.name)
        most = max(shares, key=lambda path: shares[path])
        rows.append((q.meaning, f"{r2:.2f}", most, f"{100 * shares[most]:.0f} %"))
    return rows


def random_rows(result: RandomResult) -> list[tuple[str, str]]:
    """Rows of the terminal: distributions, misses, and what matters most."""
    rows = []
    for q in result.quantities:
        d = result.distribution(q.name)
        rows.append((f"{q.meaning} [{q.shown}]",
                     f"{d['50 %']:.5g} ({d['5 %']:.5g} to {d['95 %']:.5g}), nominal {d['nominal']:.5g}"))  # fmt: skip
    rows += [(f"missed: {text}", f"{p} ({interval}), {k} machines") for text, k, _, p, interval in miss_rows(result)]
    rows += [(f"{name} depends most on", f"{path} ({share})") for name, _, path, share in share_rows(result)]
    return [*rows, ("check", confirmed(result))]


def distributions_figure(result: RandomResult) -> go.Figure:
    """Histogram of every quantity with the nominal value and its requirements."""
    shown, limits = result.quantities, _limits(result)
    rows = -(-len(shown) // COLUMNS)
    figure = make_subplots(rows, COLUMNS, subplot_titles=[q.meaning for q in shown], horizontal_spacing=0.08,
                           vertical_spacing=0.32 / rows)  # fmt: skip
    for k, q in enumerate(shown):
        place = {"row": k // COLUMNS + 1, "col": k % COLUMNS + 1}
        values = result.data[q.name].values * q.factor
        known = values[np.isfinite(values)]
        bins = min(BINS, max(5, len(known) // 3))
        figure.add_trace(go.Histogram(x=compact(known, 6), nbinsx=bins, marker={"color": PIN_COLOURS[0]}), **place)
        figure.update_xaxes(title_text=f"[{q.shown}]", **place)
        nominal = result.nominal.get(q.name, np.nan) * q.factor
        if np.isfinite(nominal):
            figure.add_vline(nominal, line={"color": INK, "dash": "dash", "width": 1.5}, **place)
        for one in limits.get(q.name, ()):
            figure.add_vline(one.limit * q.factor, line={"color": UNSAFE, "width": 2}, **place)
    figure.update_yaxes(title_text="machines", col=1)
    figure.update_layout(showlegend=False, bargap=0.03)
    return style(figure, 60 + PANEL * rows)


def _limits(result: RandomResult) -> dict[str, list[Requirement]]:
    found: dict[str, list[Requirement]] = {}
    for one in result.requirements:
        found.setdefault(one.quantity, []).append(one)
    return found


def shares_figure(result: RandomResult) -> go.Figure:
    """Shares of every value in the scatter of each quantity, stacked."""
    figure, shares = go.Figure(), {q.meaning: result.shares(q.name)[0] for q in result.quantities}
    for k, one in enumerate(result.variations):
        figure.add_trace(go.Bar(y=list(shares), x=[max(by[one.path], 0.0) for by in shares.values()], orientation="h",
                                name=one.path, marker={"color": PIN_COLOURS[k % len(PIN_COLOURS)]}))  # fmt: skip
    figure.update_layout(barmode="stack")
    figure.update_xaxes(title_text="share in the scatter", range=[0, 1.05])
    figure.update_yaxes(autorange="reversed", automargin=True)
    return style(figure, 120 + 40 * len(shares))


def _number(value: float) -> str:
    return f"{value:.5g}" if np.isfinite(value) else "-"


@page_of(Optimisation)
def optimisation_page(result: Optimisation) -> Page:
    """Page of a search: the best machine, the path and its steps."""
    heads, rows = result.table()
    quantity_ = quantity_of(result.objective)
    aim = f"{'Largest' if result.largest else 'Smallest'} {quantity_.meaning}"
    aim = with_mode(aim, result.objective, result.modes)
    limits = "; ".join(with_mode(one.text, one.quantity, result.modes) for one in result.requirements) or "none"
    best = list(result.machine.items())
    text = "" if best else "No step keeps every limit."
    if result.best is not None:
        found = result.data[result.objective].values * quantity_.factor
        at_best, first = (quantity(found[k], quantity_.shown, ".6g") for k in (result.best, 0))
        best.append((result.objective, f"{at_best}; {first} at the first step"))
    if result.confirmed:
        text += f" A whole search of the best machine differs by up to {max(result.confirmed.values()):.1g}."
    blocks = [
        Block("Best machine", text.strip(), (), best),
        Block("Path", "Filled: every limit is kept. The ring is the best step.", figure=path_figure(result)),
        Block(
            "Step by step", "", heads, [[one if isinstance(one, str) else f"{one:.6g}" for one in row] for row in rows]
        ),
    ]
    about = f"{aim}. Limits: {limits}. {len(rows)} machines; a local search, which need not find the best of all."
    return Page(f"{machine_entry(result.data.attrs)}: optimisation", about, blocks)


def path_figure(result: Optimisation) -> go.Figure:
    """Parameters and quantities over the steps of a search."""
    heads, rows = result.table()
    kept = result.data["kept"].values
    figure = make_subplots(len(heads) - 2, 1, shared_xaxes=True, vertical_spacing=0.05)
    steps = np.arange(1, len(rows) + 1)
    for k, head in enumerate(heads[1:-1], 1):
        values = np.array([row[k] for row in rows])
        fills = [PIN_COLOURS[0] if one else "#ffffff" for one in kept]
        figure.add_trace(go.Scatter(x=steps, y=compact(values, 7), mode="lines+markers",
                                    line={"color": PIN_COLOURS[0], "width": 1},
                                    marker={"size": 7, "color": fills,
                                            "line": {"width": 1.5, "color": PIN_COLOURS[0]}}), k, 1)  # fmt: skip
        if result.best is not None:
            figure.add_trace(go.Scatter(x=[result.best + 1], y=[float(values[result.best])], mode="markers",
                                        marker={"symbol": "circle-open", "size": 16, "color": UNSAFE,
                                                "line": {"width": 2}}), k, 1)  # fmt: skip
        figure.update_yaxes(title_text=head.replace(" [", "<br>["), row=k, col=1)
    figure.update_xaxes(dtick=max(1, len(rows) // 10))
    figure.update_xaxes(title_text="step", row=len(heads) - 2, col=1)
    figure.update_layout(showlegend=False)
    return style(figure, 80 + 170 * (len(heads) - 2))
