"""Lift-off of a self-acting rotor

At rest the rotor lies on its sleeves. As it runs up, dry friction gives way to the film, which carries it from the
lift-off speed on: no contact for a whole revolution. Slowed down again, it touches down.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs
from rotorsim.experiments.summary import lift_off

rpm = 2 * np.pi / 60
contact = {"stiffness": "200 MN/m", "friction": 0.15, "damping": "1 s/m", "asperity": "1 um"}
machine = rs.load_machine("rigid_rotor_self_acting").with_(
    {"effects.contact": contact, "drive.speed_recovery_time": "10 ms"}
)
plant = rs.Plant(machine, n_theta=32, n_z=16, dt=2e-4)
up = rs.experiments.runup(plant, start=0.0, stop=500 * rpm, rate=100 * rpm)
lifts = lift_off(up)["lift_off"]["rpm"]
down = rs.experiments.coastdown(plant, start=500 * rpm, stop=0.0, rate=100 * rpm)
touches = lift_off(down)["touch_down"]["rpm"]
print(f"lift-off at {lifts:.0f} rpm, touch-down at {touches:.0f} rpm")

figure, (torque, gap) = plt.subplots(2, 1, figsize=(7, 6), sharex=True)
for record, name in ((up, "run-up"), (down, "coast-down")):
    speed = record["speed"].values / rpm
    torque.semilogy(speed[1:], 1e3 * record["friction_torque"].values[1:], label=name)
    gap.plot(speed, 1e6 * record["h_min"].values, label=name)
for axes in (torque, gap):
    axes.axvline(lifts, color="0.5", linestyle="--")
    axes.grid(alpha=0.3)
    axes.legend()
torque.set(ylabel="friction torque [mN m]")
gap.set(xlabel="speed [rpm]", ylabel="smallest gap [um]", ylim=(0, None))
figure.savefig("lift_off.png", dpi=100, bbox_inches="tight")
