"""A campaign on two workers

A plan names machine, experiments and axes; two processes run its cases. The same command continues a campaign that
was interrupted. Here: how unbalance and the stiffness of a bearing change the vibration of the plain rotor.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import rotorsim as rs

PLAN = """
name = "unbalance_and_stiffness"
machine = "plain_rotor"
keep = []
summary = ["numbers"]

[experiments.steady]
kind = "steady"
duration = "1 s"
pressure = "0 MPa"
speed = "3600 rpm"

[axes."effects.unbalance.me"]
list = ["5 g*mm", "15 g*mm", "25 g*mm"]

[axes."bearings.1.kxx"]
list = ["10 MN/m", "0.5 MN/m"]
"""

Path("plan.toml").write_text(PLAN)
plan = rs.campaign.load_plan("plan.toml")
rs.campaign.run_campaign(plan, Path("store"), rs.campaign.Settings(workers=2))
table = rs.campaign.collect(Path("store"), "steady", variables=[])
print(f"{table.sizes['case']} cases")
figure, axes = plt.subplots(figsize=(8, 4.5))
for stiffness in (1e7, 5e5):
    rows = table.where(table["set_bearings.1.kxx"] == stiffness, drop=True)
    axes.plot(
        rows["set_effects.unbalance.me"] * 1e6, rows["numbers.largest_orbit_um"], "o-", label=f"{stiffness / 1e6:g}"
    )
axes.set(xlabel="unbalance [g mm]", ylabel="largest orbit [um]", title="Plain rotor at 3600 rpm: six cases")
axes.legend(title="stiffness of the right bearing [MN/m]")
axes.grid(alpha=0.3)
figure.savefig("campaign.png", dpi=100, bbox_inches="tight")
