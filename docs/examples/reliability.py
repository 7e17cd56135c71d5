"""How far odds can be trusted

Of hidden cases whose most probable explanation had about 80 %, eight of ten should be right. The cases that the docs
report are stored with the package; `rotorsim bench diagnose` runs others.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

found = rs.bench.reported_cases()
bins = rs.bench.reliability(found)
error, score = rs.bench.calibration_error(bins), rs.bench.brier(case.odds for case in found)
print(f"{len(found)} cases: expected calibration error {error:.3f}, Brier score {score:.3f}")

figure, axes = plt.subplots(figsize=(6, 5))
axes.plot([0, 100], [0, 100], "k:", lw=1, label="as often right as stated")
for b in bins:
    spread = 100 * (b.stated * (1 - b.stated) / b.cases) ** 0.5  # of so many cases that are as often right as stated
    axes.errorbar(100 * b.stated, 100 * b.right, spread, fmt="o", color="C0", capsize=3)
    axes.annotate(f"{b.cases}", (100 * b.stated, 100 * b.right), (6, -13), textcoords="offset points")
axes.set(xlabel="stated probability of the first explanation [%]", ylabel="share of cases in which it is right [%]")
axes.set(xlim=(0, 110), ylim=(-8, 108), title=f"{len(found)} hidden cases; numbers of cases at the points")
axes.legend(loc="upper left")
axes.grid(alpha=0.3)
figure.savefig("reliability.png", dpi=100, bbox_inches="tight")
