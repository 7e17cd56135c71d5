"""A measured run-up, diagnosed

1X of a rotor kit, one probe and a sweep of 229 rpm/s. Supports, unbalance and shaft of the machine are re-calibrated
with the same sweep, and what is still missing is looked for: a runout, which an equal bow of the shaft resembles.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import identification as idn
import rotorsim as rs

data = next((folder / "rk4" for folder in Path(__file__).resolve().parents if (folder / "rk4").exists()), None)
if data is None:
    raise SystemExit("no folder rk4 with runup.csv and runup.toml here or above: the page of this example has them")
vectors = idn.read(data / "runup.csv", data / "runup.toml")

found = rs.discrepancy.diagnose("bently_rk4", [vectors], effects=["runout", "shaft_bow"])
print(f"verdict: {found.status}")
for effect in found.effects:
    print(" or ".join(effect.tie_class), "of which the sizes are those of", effect.form)
    print({name: f"{value:.3g} +- {effect.sd[name]:.2g}" for name, value in effect.parameters.items()})
for note in found.notes:
    print(note)

parts = [part for role in found.spectra.values() for part in role]  # rows to fit, held out and untouched
speed = np.concatenate([part["speeds"] for part in parts]) * 30 / np.pi
order = np.argsort(speed)
curves = {"measured": np.concatenate([part["measured_vectors"][0, 0] for part in parts])}
for stage, name in enumerate(("machine file as given", "re-calibrated", "with a runout")):
    curves[name] = np.concatenate([part["simulated_vectors"][stage][0, 0] for part in parts])

figure, (top, bottom) = plt.subplots(2, 1, figsize=(8, 6), sharex=True)
styles = ({"marker": ".", "linestyle": "none", "color": "k"}, {"color": "0.7"}, {"color": "C1"}, {"color": "C0"})
for (name, values), style in zip(curves.items(), styles, strict=True):
    top.plot(speed[order], np.abs(values[order]) * 1e6, label=name, **style)
    bottom.plot(speed[order], np.degrees(np.unwrap(-np.angle(values[order]))), **style)
top.set(ylabel="1X amplitude [um 0-pk]", title="Run-up of a rotor kit, 229 rpm/s, one probe")
top.legend()
bottom.set(xlabel="speed [rpm]", ylabel="phase lag [deg]")
bottom.invert_yaxis()
for axes in (top, bottom):
    axes.grid(alpha=0.3)
figure.savefig("diagnose_runup.png", dpi=100, bbox_inches="tight")
