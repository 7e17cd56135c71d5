"""Reliability of odds

Of hidden cases whose most probable explanation had about 80 %, eight of ten should be right. The cases that the docs
report are stored here; `python studies/benchmarks/measure.py diagnose` runs others.
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))

import matplotlib.pyplot as plt

from studies.benchmarks.diagnose import reported_cases
from studies.benchmarks.odds_score import brier, calibration_error, reliability

found = reported_cases()
bins = reliability(found)
error, score = calibration_error(bins), brier(case.odds for case in found)
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
