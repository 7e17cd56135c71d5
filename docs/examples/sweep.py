"""Choose a clearance and a pressure

Whirl onset and gas flow of the gas bearing rig over clearance and supply pressure, with the best point of each: a sweep
of linear models, without time simulation.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

machine = rs.load_machine("dtu_gas_bearing").replace("grid.n_theta", 16).replace("grid.n_z", 8)
over = {"bearings.1.clearance": "20 um:30 um:5", "pressure": "0.3 MPa:0.7 MPa:5"}
found = rs.analysis.sweep(machine, over, ("lift_off", "onset", "flow"))
for name, best in found.best.items():
    print(f"{best['best']} {name}: {best['value']:.5g} {best['unit']} at {best['at']}")

figure, panels = plt.subplots(1, 2, figsize=(10, 4.2), sharey=True)
clearances, pressures = found.data["bearings_1_clearance"], found.data["pressure"]
shown = (("onset", 30 / np.pi, "onset of whirl [rpm]"), ("flow", 1e6, "gas flow [mg/s]"))
for axes, (name, factor, title) in zip(panels, shown, strict=True):
    values = found.data[name].transpose("pressure", "bearings_1_clearance") * factor
    axes.contourf(clearances, pressures, values, levels=10, cmap="Blues")
    lines = axes.contour(clearances, pressures, values, levels=10, cmap="Greys_r", linewidths=0.8)
    axes.clabel(lines, fmt="%.0f", fontsize=8)
    at = found.best[name]["at"]
    place = (float(at["bearings.1.clearance"].split()[0]), float(at["pressure"].split()[0]))
    axes.plot(*place, "D", color="tab:orange", clip_on=False, label=f"best: {found.best[name]['best']}")
    axes.set(xlabel="clearance [um]", title=title)
    axes.legend(loc="upper right", framealpha=0.9)
panels[0].set_ylabel("supply pressure, gauge [MPa]")
figure.tight_layout()
figure.savefig("sweep.png", dpi=100, bbox_inches="tight")
