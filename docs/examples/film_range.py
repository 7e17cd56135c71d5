"""Range in which a film's model holds

Every assumption of the film has a number. Each line is the largest of them over its limit, so that 1 is where a film's
model ends; the rig's own model was compared with measurements to 6000 rpm alone, and a run beyond states so.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs
from rotorsim.plant.validity import BOUNDS, film_numbers

rpm = 2 * np.pi / 60
machines = {"dtu_gas_bearing": 0.5e6, "rigid_rotor_self_acting": 0.0, "grooved_turbo_rotor": 0.0}
speeds = np.geomspace(3000, 300_000, 25)
keys = [key for key, bound in BOUNDS.items() if bound.limit > 0]
colours = dict(zip(keys, ("tab:blue", "tab:red", "tab:green", "tab:purple", "tab:brown"), strict=True))

figure, panels = plt.subplots(1, 3, figsize=(12, 4.2), sharey=True)
for axes, (name, pressure) in zip(panels, machines.items(), strict=True):
    plant = rs.Plant(name)
    found = [film_numbers(plant.start(speed * rpm, pressure))[0] for speed in speeds]
    for key in keys:
        shares = [numbers[key] / BOUNDS[key].limit for numbers in found]
        if max(shares) > 0:
            axes.loglog(speeds, shares, color=colours[key], label=BOUNDS[key].name)
    ends = [speed for speed in speeds if rs.plant.range_of_validity(plant, speed * rpm, pressure)]
    print(f"{name}: {len(ends)} of {len(speeds)} speeds beyond")
    axes.axhline(1.0, color="black", lw=0.8, ls="--")
    if plant.machine.checked:
        axes.axvspan(speeds[0], plant.machine.checked.highest_speed / rpm, color="tab:green", alpha=0.12)
        axes.text(3300, 1.4, "compared with\nmeasurements", fontsize=8)
    axes.set(title=name, xlabel="speed [rpm]", ylim=(1e-3, 5))
    axes.grid(alpha=0.3)
panels[0].set_ylabel("number over its limit")
panels[0].legend(fontsize=7, loc="lower right")

plant = rs.Plant("dtu_gas_bearing")
record = rs.experiments.runup(plant, 5900 * rpm, 6100 * rpm, 1000 * rpm, 0.5e6)
print(record.attrs["beyond_checked_range"])
slow = rs.Plant(plant.machine.replace("limits.tip_speed", "44 m/s"))
print(rs.experiments.runup(slow, 5900 * rpm, 6100 * rpm, 1000 * rpm, 0.5e6).attrs["ended"])
figure.savefig("film_range.png", dpi=100, bbox_inches="tight")
