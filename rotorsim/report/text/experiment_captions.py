"""Captions of experiment figures, written from their numbers."""

from __future__ import annotations

import numpy as np

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.report.export.display_units import displacement, quantity
from rotorsim.report.figures.probes.filtered_orbit_plots import mean_orders
from rotorsim.report.figures.transfer_plots import NAMES, UNITS
from rotorsim.report.pages.run import Run
from rotorsim.signals.frequency_response import Transfer, peak_of
from rotorsim.signals.impact import RingDown
from rotorsim.signals.orders import Deceleration
from rotorsim.signals.probes import RunoutProfile
from rotorsim.signals.spectra import SensorError, Spectrum
from rotorsim.signals.static_gain import Branches, HysteresisLoop

MANY_MODES = 0.15
"""Scatter of the logarithms of the extremes from which on a decay is not that of one mode."""


def seen_by(run: Run) -> str:
    """Which displacement a figure is made of, where there are two."""
    both = "disc" in run.record and "disc_measured" in run.record
    return " Made from the measured displacement." if both and run.output == "disc_measured" else ""


def excitation_caption(run: Run) -> str:
    """Key to lines and markers."""
    text = "Left: bands span the least and the largest value of each stretch of time. Right: every sample about the "
    text += "largest change of the inputs." if run.driven else "middle of the record."
    if "disc" in run.record and "disc_measured" in run.record:
        text += " The measured displacement is drawn faintly under the true one."
    return text


def transfer_caption(run: Run, transfer: Transfer) -> str:
    """Where the direct responses peak, and how they were estimated."""
    peaks = [(k, *peak_of(transfer, k, i)) for i, k in enumerate(transfer.inputs)]
    unit = UNITS[transfer.input_name]
    parts = [f"{'xy'[k]} responds to {'xy'[k]} most at {f:.4g} Hz with {quantity(size * TO_UM, unit)}."
            for k, f, size in peaks if np.isfinite(f)]  # fmt: skip
    text = " ".join(parts) or "No peak stands out with a coherence above one half."
    times = "impact" if transfer.input_name == "disc_force" else "segment"
    text += f" H1 estimate from {transfer.count} {times}{'s' * (transfer.count > 1)}"
    known = transfer.coherence is not None
    text += "; the coherence is the share of the motion the input makes." if known else "; a coherence takes more."
    if transfer.together:
        text += f" Both {NAMES[transfer.input_name]}s move together; their responses cannot be separated."
    if run.revolutions >= 1 and transfer.input_name == "reference":
        text += " The unbalance response lowers the coherence at multiples of the shaft speed."
    return text + seen_by(run)


def ring_down_caption(run: Run, downs: list[RingDown]) -> str:
    """Frequency and damping after each pulse."""
    return " ".join(_decay_sentence(down) for down in downs) + seen_by(run)


def _decay_sentence(down: RingDown) -> str:
    axis = "xy"[down.pulse.axis]
    if down.decay is None:
        return f"Along {axis}: {down.why}"
    d = down.decay
    text = (
        f"Along {axis} the disc rings at {d.frequency:.4g} Hz with a logarithmic decrement of {d.decrement:.3g}, "
        f"a damping ratio of {d.zeta:.3g}, from {d.time.size} extremes."
    )
    if d.scatter > MANY_MODES:
        text += f" The extremes scatter by {100 * d.scatter:.0f} % about that decay: more than one mode rings."
    return text


def gain_caption(run: Run, gains: list[Branches]) -> str:
    """Gains, and what departs from the line."""
    parts = []
    for g in gains:
        own, cross = g.gain[g.axis] * TO_UM, g.gain[1 - g.axis] * TO_UM
        a, b = "xy"[g.axis], "xy"[1 - g.axis]
        text = f"Reference {a} moves the disc by {quantity(own, 'µm/V')} along {a} and "
        text += f"{quantity(cross, 'µm/V', '.3f')} along {b}; "
        away = displacement(np.abs(g.deviation[:, g.axis]).max(), ".2g")
        text += f"the rests depart from the line by up to {away} along {a}"
        opening = g.opening[g.axis] * TO_UM
        text += (
            f", rising and falling branch by up to {quantity(opening, 'µm', '.2g')} from each other."
            if np.isfinite(opening)
            else "."
        )
        if g.other_moves:
            text += f" Reference {b} moves as well, so its share is in the line."
        parts.append(text)
    return " ".join(parts) + seen_by(run)


def loop_caption(run: Run, loops: list[HysteresisLoop]) -> str:
    """Travel and opening of every loop."""
    parts = [
        f"pin {k.injector} travels {displacement(k.travel)}"
        + (f", its loop opens {displacement(k.opening, '.2g')} "
           f"({100 * k.opening / k.travel:.1f} % of the travel)"
           if np.isfinite(k.opening) else "")
        for k in loops
    ]  # fmt: skip
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}. The opening is the largest distance between the rising and falling branch."


def spectrum_caption(run: Run, spectrum: Spectrum) -> str:
    """The strongest line and the quality of the estimate."""
    k, axis = np.unravel_index(int(spectrum.single.argmax()), spectrum.single.shape)
    full = int(spectrum.full.argmax())
    return (
        f"The strongest line is {displacement(spectrum.single.max())} 0-pk at {spectrum.frequency[k]:.4g} Hz, "
        f"disc {'xy'[axis]}; "
        f"of x + i y it is {displacement(spectrum.full[full])} at {spectrum.signed[full]:.4g} Hz, "
        f"{'forward' if spectrum.signed[full] > 0 else 'backward'}. Hann window, root mean square of {spectrum.count} "
        f"segment{'s' * (spectrum.count > 1)}, resolution {spectrum.resolution:.2g} Hz.{seen_by(run)}"
    )


def filtered_caption(run: Run) -> str:
    """Forward and backward part of 1X and 2X."""
    parts = []
    for n, (x, y) in zip((1, 2), mean_orders(run.tracked), strict=True):
        f, b = abs(x + 1j * y) / 2 * TO_UM, abs(x - 1j * y) / 2 * TO_UM
        parts.append(f"{n}X: {quantity(f, 'µm')} forward, {quantity(b, 'µm')} backward.")
    return (
        " ".join(parts)
        + " Dots mark whole turns of the shaft. 1X and 2X are fitted over whole revolutions and averaged."
    )


def runout_caption(run: Run, runout: RunoutProfile) -> str:
    """Peak-to-peak runout, its harmonics and the scatter."""
    parts = []
    for k, axis in enumerate("xy"):
        order, span = (
            int(np.abs(runout.harmonic[:, k]).argmax()),
            float(np.ptp(runout.mean[np.isfinite(runout.mean[:, k]), k])),
        )
        parts.append(
            f"Disc {axis}: {displacement(span)} pk-pk, "
            "largest "
            f"harmonic {order + 1}X with {displacement(abs(runout.harmonic[order, k]))} 0-pk, scatter about the mean "
            f"{displacement(np.sqrt(np.nanmean(runout.scatter[:, k] ** 2)), '.2g')} rms."
        )
    parts.append(f"Mean of {runout.revolutions:.1f} revolutions; bands are one standard deviation.")
    return " ".join(parts) + seen_by(run)


def difference_caption(run: Run, difference: SensorError) -> str:
    """Noise levels."""
    parts = [
        f"along {axis} {displacement(difference.rms[k])} rms and {displacement(difference.peak_to_peak[k])} pk-pk "
        f"about an offset of {displacement(difference.offset[k] + 0.0, '.3f')}"
        for k, axis in enumerate("xy")
    ]
    text = f"Measured less true displacement is {' and '.join(parts)}."
    return text + (" Lines at multiples of the shaft speed are runout." if run.revolutions >= 1 else "")


def deceleration_caption(run: Run, found: Deceleration) -> str:
    """From where to where, and the largest deceleration."""
    i = int(found.rate.argmax())
    text = (
        f"From {found.speed[0] * TO_RPM:.0f} to {found.speed[-1] * TO_RPM:.0f} rpm; the largest deceleration is "
        f"{found.rate[i] * TO_RPM:.3g} rpm/s at {found.speed[i] * TO_RPM:.0f} rpm"
    )
    if found.speed[-1] > 0.05 * found.speed[0]:
        text += f", the last {found.rate[-1] * TO_RPM:.3g} rpm/s at {found.speed[-1] * TO_RPM:.0f} rpm"
    return text + "."
