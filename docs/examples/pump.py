"""A pump on oil bearings in housings

Oil bearings as tables of stiffness and damping over the speed, each in a housing that moves. Above 2480 rpm the oil
whips the rotor at its first frequency, in rigid housings already above 2210 rpm: those softer sideways help.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rpm = 2 * np.pi / 60
pump = rs.load_machine("pump_on_tables")
rigid = pump.with_({"bearings.0.support": None, "bearings.1.support": None})
speeds = np.linspace(400, 5000, 47) * rpm

figure, (least, response) = plt.subplots(2, 1, figsize=(8, 6), sharex=True, layout="constrained")
for machine, name in ((pump, "housings that move"), (rigid, "rigid housings")):
    found = rs.analysis.unbalance_response(rs.Plant(machine), speeds)
    zeta = found["zeta_least"].values
    onset = np.interp(0.0, -zeta[15:25], speeds[15:25] / rpm)
    orbit = found["major"].sel(place="disc 1") * 1e6
    print(f"{name}: oil whip from {onset:.0f} rpm, largest orbit {float(orbit.max()):.1f} um")
    least.plot(speeds / rpm, zeta, label=name)
    response.semilogy(speeds / rpm, orbit, label=name)
least.axhline(0.0, color="k", linewidth=0.8)
least.set(ylabel="least damping ratio", title="Pump on two oil bearings")
response.set(xlabel="speed [rpm]", ylabel="orbit at the second impeller [um 0-pk]")
for axes in (least, response):
    axes.grid(alpha=0.3)
    axes.legend()
figure.savefig("pump.png", dpi=100, bbox_inches="tight")
