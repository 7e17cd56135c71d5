"""Let experiments decide

Records of one operating point cannot tell a force at twice a turn from a surface that is not round. The loop plans the
experiment that should tell most, makes it on the hidden machine, and diagnoses again until one explanation has 95 %.
"""

import tempfile

import matplotlib.pyplot as plt

import rotorsim as rs

puzzle = tempfile.mkdtemp() + "/puzzle"
records = rs.hide("plain_rotor", ["coupling.force_2x"], seed=4, out=puzzle)  # stands for the rig
first = [r for r in records if r.attrs["record"] == "fit_3"]
found = rs.discrepancy.decide("plain_rotor", f"virtual:{puzzle}", 30.0, first, ["speed"], ["coupling", "runout"])
print(found.steps.table())
print(found.steps.sentence)

steps = found.steps.steps
names = sorted({name for step in steps for name, p in step.odds.items() if p >= 0.01}, key=found.odds.get)[::-1]
figure, axes = plt.subplots(figsize=(8, 4.5))
left = [0.0] * len(steps)
for name in names:
    share = [100 * step.odds.get(name, 0.0) for step in steps]
    axes.barh(range(len(steps)), share, left=left, label=name)
    left = [a + b for a, b in zip(left, share, strict=True)]
labels = ["\nat ".join((step.experiment or "the first record").rsplit(" at ", 1)) for step in steps]
axes.set(xlabel="probability [%]", yticks=range(len(steps)), yticklabels=labels, xlim=(0, 100))
axes.set_title(found.steps.sentence)
axes.invert_yaxis()
axes.axvline(95, color="k", lw=1, ls=":")
axes.legend(loc="lower left", fontsize="small")
figure.savefig("decide.png", dpi=100, bbox_inches="tight")
