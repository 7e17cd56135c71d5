"""Which number of the rig would give a figure of the thesis?

Two figures are not reproduced: the slow pole of the pins, and the amplitude of the imbalance. Each is measured again
on the rig with one number multiplied; straight lines between give the value that the thesis' figure belongs to.
"""

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))

import rotorsim as rs
from studies.thesis.claims.judge import MET
from studies.thesis.experiments.run import run_experiments
from studies.thesis.experiments.table import chosen_experiments, figure_of

SHOWN = {"unbalance": ("I4.before", "amplitude [um]"), "pd_gain": ("I9.p1_x", "slow pole, x [rad/s]")}

if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    import matplotlib.pyplot as plt

    machine, chosen = rs.Plant("dtu_gas_bearing").machine, chosen_experiments(["unbalance", "pd_gain"])
    found = run_experiments(machine, chosen, Path("experiments"), lambda *_: None)
    figure, both = plt.subplots(1, 2, figsize=(9, 4))
    for axes, one in zip(both, found, strict=True):
        key, label = SHOWN[one.experiment.name]
        rule, factors = figure_of(key), one.experiment.factors
        print(f"{rule.words}: thesis {rule.thesis:g}, here {one.value(key, 1.0):.4g}, at {one.reached(key):.2f} times")
        axes.axhspan(*rule.met, alpha=0.2, color="tab:green", label=MET)
        axes.axhline(rule.thesis, ls=":", color="k", label="thesis")
        axes.plot(factors, [one.value(key, factor) for factor in factors], "o-")
        axes.axvline(1, lw=0.8, color="grey")
        axes.set(title=one.experiment.words, xlabel="times the rig's value", ylabel=label)
        axes.legend()
    figure.tight_layout()
    figure.savefig("two_figures.png", dpi=100, bbox_inches="tight")
