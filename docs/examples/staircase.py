"""A staircase of the reference: static gain and hysteresis

The reference of the x axis goes up, down and home in steps, as on the test rig. The rest positions give the static
gain, the distance from a straight line, and the opening between the ways up and down.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
record = rs.experiments.staircase(plant, speed=0.0, pressure=0.6e6, axis="x", amplitude=2.0, hold=0.3)
gains = rs.experiments.static_gain_map(record)
gain = float(gains["gain"].sel(output="x", input="x"))
print(f"static gain of x: {gain * 1e6:.2f} um/V")

figure, (above, below) = plt.subplots(2, 1, figsize=(8, 7))
above.plot(record["time"], record["reference"].sel(axis="x"), color="tab:orange")
above.set(xlabel="time [s]", ylabel="reference x [V]", title="Staircase at 0.6 MPa, shaft at rest")
motion = above.twinx()
motion.plot(record["time"], record["disc_measured"].sel(axis="x") * 1e6, color="tab:blue", linewidth=0.7)
motion.set_ylabel("disc x, measured [um]")
volts = gains["reference"].sel(axis="x")
below.plot(volts, gains["disc"].sel(axis="x") * 1e6, "o-", label="rest positions")
below.plot(
    volts, (gains["offset"].sel(output="x", input="x") + gain * volts) * 1e6, "k--", label=f"{gain * 1e6:.2f} um/V"
)
below.set(xlabel="reference x [V]", ylabel="disc x [um]")
below.legend()
figure.savefig("staircase.png", dpi=100, bbox_inches="tight")
