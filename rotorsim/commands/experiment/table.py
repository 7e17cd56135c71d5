"""Result table that `rotorsim experiment` prints."""

from __future__ import annotations

from typing import Any

from rotorsim.signals.probes import shown

Rows = list[tuple[str, str]]


def result_rows(summary: dict[str, Any]) -> Rows:
    """Labels and values of the results; `summary` as from `rotorsim.experiments.summary`."""
    speed, disc = summary["speed_rpm"], summary["disc"]
    rows = [
        ("Duration", f"{summary['duration_s']:.4g} s, {summary['samples']} samples"),
        ("Speed", f"{speed['first']:.0f} to {speed['last']:.0f} rpm"),
        ("Disc x, y: mean", pair(disc["mean_um"], "µm")),
        ("Disc x, y: rms about the mean", pair(disc["rms_um"], "µm")),
        ("Disc x, y: peak from the mean", pair(disc["peak_um"], "µm")),
        ("Largest distance of the disc from its mean", f"{summary['largest_orbit_um']:.3g} µm"),
    ]
    if summary["smallest_film_um"] is not None:
        rows.append(("Smallest film thickness", f"{summary['smallest_film_um']:.3g} µm"))
        rows.append(("Contact", f"{summary['contact_samples']} samples" if summary["contact_samples"] else "none"))
    for key, label, unit in (("reference_peak_v", "Reference x, y: peak", "V"), ("force_peak_n", "Force: peak", "N")):
        if summary[key] and any(summary[key]):
            rows.append((label, pair(summary[key], unit)))
    for name, p in summary.get("probes", {}).items():
        text = f"{shown(p['peak'], p['unit'])}, {shown(p['rms'], p['unit'])}"
        rows.append((f"Probe {name}: peak, rms about the mean", text))
    beyond = [("Beyond the checked range", text) for text in summary.get("beyond_checked_range", ())]
    return rows + special_rows(summary) + beyond


def special_rows(summary: dict[str, Any]) -> Rows:
    """Result rows specific to one kind of experiment."""
    rows: Rows = []
    for axis, found in summary.get("static_gain", {}).items():
        rows.append((f"Static gain of r_{axis} on x, y", pair(found["gain_um_per_v"], "µm/V")))
        rows.append(("  largest deviation from linear", pair(found["deviation_max_um"], "µm")))
        rows.append(("  rms deviation from linear", pair(found["deviation_rms_um"], "µm")))
        rows.append(("  opening between up and down", pair(found["hysteresis_um"], "µm")))
    if "deceleration" in summary:
        found = summary["deceleration"]
        end = "" if found["reached_stop"] else ", before the speed asked for"
        rows.append(("Deceleration", f"{found['time_s']:.4g} s{end}, {found['mean_rpm_per_s']:.4g} rpm/s on average"))
    if "sensor_error_peak_um" in summary:
        rows.append(("Measured less true displacement: peak", pair(summary["sensor_error_peak_um"], "µm")))
    if "impulse_n_s" in summary:
        rows.append(("Impulse of all hits x, y", pair(summary["impulse_n_s"], "N s")))
    if "saturated_samples" in summary:
        rows.append(("Reference at its limit", saturation(summary["saturated_samples"], summary["samples"])))
    if "controller_alarms" in summary:
        rows.append(("Controller", summary["controller_alarms"]))
    return rows


def saturation(limited: int, samples: int) -> str:
    """Number of samples with a saturated reference, with a warning if they are most."""
    share = f"{limited} samples, {100 * limited / samples:.3g} %"
    if limited <= samples / 2:
        return share
    return f"{share}: the loop is not in control; check the signs and the order of the sensors' axes, then the gain"


def pair(values: list[float], unit: str) -> str:
    """Two numbers with their unit."""
    return f"{values[0]:.3g}, {values[1]:.3g} {unit}"
