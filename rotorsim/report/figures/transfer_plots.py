"""Figure of the disc's frequency response: magnitude, phase and coherence, a column per input."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.report.figures.theme import AXIS_COLOURS, compact, style
from rotorsim.signals.frequency_response import Transfer

UNITS = {"reference": "µm/V", "disc_force": "µm/N"}
NAMES = {"reference": "reference", "disc_force": "force"}
FAINTEST = 0.5
"""Phase is not drawn where the coherence is below this."""
DECADES = 3.0
"""Range of the magnitude; no phase below."""


def transfer_figure(transfer: Transfer) -> go.Figure:
    """Magnitude [um per unit] over phase [deg] over coherence against frequency [Hz]; disc x and disc y in colour."""
    rows = 3 if transfer.coherence is not None else 2
    titles = [f"from {NAMES[transfer.input_name]} {'xy'[k]}" for k in transfer.inputs]
    figure = make_subplots(rows, len(titles), shared_xaxes=True, shared_yaxes=True, subplot_titles=titles,
                           vertical_spacing=0.04, horizontal_spacing=0.04,
                           row_heights=[0.5, 0.3, 0.2][:rows])  # fmt: skip
    for column in range(len(titles)):
        for output, axis in enumerate("xy"):
            for row, trace in enumerate(_traces(transfer, output, column, axis), 1):
                figure.add_trace(trace.update(showlegend=row == column + 1 == 1), row, column + 1)
    top = float(np.log10(np.nanmax(np.abs(transfer.H)) * TO_UM))
    figure.update_yaxes(type="log", range=[top - DECADES, top + 0.15], dtick=1, row=1)
    figure.update_yaxes(range=[-190, 190], tickvals=[-180, -90, 0, 90, 180], row=2)
    if rows == 3:
        figure.update_yaxes(range=[0, 1.05], tickvals=[0, 0.5, 1], row=3)
        figure.update_yaxes(title_text="coherence", row=3, col=1)
    figure.update_yaxes(title_text=f"magnitude [{UNITS[transfer.input_name]}]", row=1, col=1)
    figure.update_yaxes(title_text="phase [deg]", row=2, col=1)
    seen = transfer.frequency[np.isfinite(transfer.H).any(axis=(1, 2))]
    figure.update_xaxes(range=[0, 1.02 * float(seen.max())])
    figure.update_xaxes(title_text="frequency [Hz]", row=rows)
    return style(figure, 640 if rows == 3 else 520)


def _traces(transfer: Transfer, output: int, column: int, axis: str) -> list[go.Scatter]:
    """Magnitude, phase and, where there is one, coherence of one element."""
    H = transfer.H[:, output, column]
    phase = np.where(np.abs(H) > np.nanmax(np.abs(transfer.H)) * 10**-DECADES, np.degrees(np.angle(H)), np.nan)
    if transfer.coherence is not None:
        phase = np.where(transfer.coherence[:, output] >= FAINTEST, phase, np.nan)
    rows = [(np.abs(H) * TO_UM, UNITS[transfer.input_name]), (_gaps(phase), "deg")]
    if transfer.coherence is not None:
        rows.append((np.where(np.isfinite(H), transfer.coherence[:, output], np.nan), ""))
    lone = _is_sparse(H)
    common = {"mode": "lines+markers" if lone else "lines", "name": f"disc {axis}", "legendgroup": axis,
              "line": {"color": AXIS_COLOURS[axis], "width": 1 if lone else 1.8}, "marker": {"size": 4}}  # fmt: skip
    kept = np.isfinite(H) | (not lone)
    return [go.Scatter(x=compact(transfer.frequency[kept], 6), y=compact(y[kept]),
                       hovertemplate=f"%{{y:.3g}} {unit} at %{{x:.1f}} Hz<extra>disc {axis}</extra>", **common)
            for y, unit in rows]  # fmt: skip


def _is_sparse(H: np.ndarray) -> bool:
    """Whether only lines here and there are driven, as by a multisine."""
    seen = np.isfinite(H)
    inside = seen[seen.argmax() : len(seen) - seen[::-1].argmax()]
    return bool(inside.mean() < 0.8)


def _gaps(phase: np.ndarray) -> np.ndarray:
    """Phase (n,) [deg] with a gap where it wraps."""
    jumps = np.abs(np.diff(phase)) > 270
    return np.where(np.append(False, jumps), np.nan, phase)
