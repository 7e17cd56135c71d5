"""Diagnose a puzzle

An effect is hidden in records of the plain rotor; `diagnose` gets the records and the machine file without it, and
finds where they disagree and what is missing. With measured records it is called in the same way.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

records = rs.hide("plain_rotor", ["shaft_bow"], seed=1)  # stands for the measurement
found = rs.diagnose("plain_rotor", records, effects=["shaft_bow", "crack", "coupling"], seed=0)
print(f"verdict: {found.status}; effects: {[one.effect for one in found.effects]}")

gap = found.gap["gap"].where(found.gap["role"] == "untouched", drop=True) * 1e6  # by record, axis and stage
figure, axes = plt.subplots(figsize=(8, 4.5))
for stage in gap["stage"].values:
    axes.plot(gap["point"], gap.sel(stage=stage).mean("axis"), "o-", label=str(stage))
axes.set(ylabel="gap, rms [um]", title=f"Records that took no part in the fit; verdict: {found.status}", yscale="log")
axes.legend()
axes.grid(alpha=0.3, which="both")
figure.savefig("diagnose.png", dpi=100, bbox_inches="tight")
