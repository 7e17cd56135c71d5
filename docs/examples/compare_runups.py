"""Compare two run-ups

The same rotor with 25 and with 10 g mm of unbalance: two records in one figure. The ripple above the peak is the free
vibration that a ramp leaves in a rotor with little damping. `rotorsim compare` does the same with files.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

rpm = 0.10472  # rad/s
records = {}
for unbalance in ("25 g*mm", "10 g*mm"):
    plant = rs.Plant(rs.load_machine("plain_rotor").replace("effects.unbalance.me", unbalance))
    records[unbalance] = rs.experiments.runup(plant, start=1000 * rpm, stop=5000 * rpm, rate=100 * rpm, pressure=0.0)

found = rs.signals.compare_runs(records)
for peak in found.peaks():
    if peak["axis"] == "x":
        print(f"{peak['run']}: {peak['um']:.0f} um at {peak['rpm']:.0f} rpm")

figure, axes = plt.subplots(figsize=(8, 4.5))
for unbalance, orders in found.tracked.items():
    axes.semilogy(orders["speed"] / rpm, abs(orders["amplitude"].sel(order=1, axis="x")) * 1e6, label=unbalance)
axes.set(xlabel="speed [rpm]", ylabel="1X amplitude along x, 0-pk [um]", title="Two run-ups of the plain rotor")
axes.legend(title="unbalance")
axes.grid(alpha=0.3, which="both")
figure.savefig("compare_runups.png", dpi=100, bbox_inches="tight")
