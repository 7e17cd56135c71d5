"""Balance a rotor from measured vectors

1X vectors of a rotor kit, measured by others in 39 conditions with known trial weights, give the influence
coefficients; every condition is then estimated from the others, which is the error to expect of a new one.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import rotorsim as rs

data = next((folder / "rk4" for folder in Path(__file__).resolve().parents if (folder / "rk4").exists()), None)
if data is None:
    raise SystemExit("no folder rk4 with open.csv and balance.toml here or above: the page of this example has them")
conditions = rs.balance.read_conditions([data / "open.csv"], data / "balance.toml")
test = rs.balance.leave_one_out(conditions)
print(f"vector error of a plane: {test.vector_rms * 1e6:.1f} g mm rms")

known = conditions.unbalance[conditions.known]
figure, axes = plt.subplots(figsize=(5.5, 5.5))
for plane in range(known.shape[1]):
    axes.plot(abs(known[:, plane]) * 1e6, abs(test.estimates[:, plane]) * 1e6, "o", label=f"plane {plane + 1}")
largest = abs(known).max() * 1.1e6
axes.plot([0, largest], [0, largest], "k--", linewidth=1)
axes.set(xlabel="unbalance attached [g mm]", ylabel="estimated from the other conditions [g mm]", aspect="equal")
axes.set_title("Balancing a rotor kit: influence coefficients")
axes.legend()
figure.savefig("balance.png", dpi=100, bbox_inches="tight")
