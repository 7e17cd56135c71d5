"""The experiment that should come next

One record cannot tell a bow of the shaft from its unbalance. Every run that the rig can do is ranked by the entropy of
the odds that it should leave; the best one is a plan for `rotorsim campaign`.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

records = rs.hide("plain_rotor", ["shaft_bow.bow"], seed=5)
first = [r for r in records if r.attrs["record"] == "fit_1"]  # one record, at 1200 rpm
found = rs.diagnose("plain_rotor", first, effects=["shaft_bow", "coupling", "runout"])
plan = found.plan(allow=["speed", "axis", "trial-weight", "sensor-ring", "slow-roll"])
print(f"{plan.tried} experiments, {plan.entropy:.2f} bit today")
print(plan.sentence)

best = sorted(plan.proposals, key=lambda p: p.rank)[:12][::-1]
figure, axes = plt.subplots(figsize=(9, 4.5))
axes.barh([p.option.name for p in best], [p.outlook.entropy for p in best])
axes.axvline(plan.entropy, color="k", lw=1, ls=":", label="today")
axes.set(xlabel="entropy of the odds that is left [bit]", title="The best experiments")
axes.tick_params("y", labelsize="small")
axes.legend()
figure.savefig("plan_next.png", dpi=100, bbox_inches="tight")
