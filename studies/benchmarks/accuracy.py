"""Accuracy of the plant: reference calibration, grid convergence, free decay, mass balance."""

from collections.abc import Iterator

import numpy as np
from scipy.optimize import least_squares

from reynolds import GasBearing, Injector
from rotorsim.base.units import MPA, RPM, TO_UM
from rotorsim.plant import Plant
from studies.benchmarks.result import Figure

REFERENCE = {
    (0.3, 0): (112.63, 0.0960, 118.93, 0.0689, 3.007, 2.777, 0.375, 0.455),
    (0.3, 3000): (112.70, 0.0946, 118.82, 0.0657, 2.957, 2.725, 0.373, 0.451),
    (0.3, 6000): (112.85, 0.0918, 118.61, 0.0556, 2.819, 2.583, 0.367, 0.442),
    (0.5, 0): (119.26, 0.0568, 123.78, 0.0396, 3.070, 2.914, 0.340, 0.389),
    (0.5, 3000): (118.88, 0.0575, 124.13, 0.0373, 3.044, 2.887, 0.339, 0.388),
    (0.5, 6000): (117.94, 0.0589, 125.00, 0.0314, 2.966, 2.811, 0.335, 0.382),
    (0.7, 0): (123.90, 0.0390, 126.75, 0.0303, 3.100, 2.991, 0.316, 0.345),
    (0.7, 3000): (123.01, 0.0399, 127.60, 0.0285, 3.081, 2.973, 0.315, 0.343),
    (0.7, 6000): (121.38, 0.0417, 129.16, 0.0242, 3.028, 2.920, 0.312, 0.340),
}
"""Calibration A at 256x64 by an independent calculation: f1 [Hz], zeta1, f2, zeta2, Gxx, Gyy [um/V], delays [ms]."""
COLUMNS = ("f1 Hz", "zeta1", "f2 Hz", "zeta2", "Gxx um/V", "Gyy um/V", "tau_x ms", "tau_y ms", "Gxy um/V", "Gyx um/V")


def rig_row(plant: Plant, mpa: float, rpm: float) -> tuple[float, ...]:
    """Values of COLUMNS at one operating point."""
    model = plant.linearise(rpm * RPM, mpa * MPA)
    f, gain, delay = model.wn / (2 * np.pi), np.round(model.static_gain * TO_UM, 6) + 0.0, model.delay * 1e3
    return (
        f[0], model.zeta[0], f[1], model.zeta[1], gain[0, 0], gain[1, 1], delay[0], delay[1], gain[0, 1], gain[1, 0],
    )  # fmt: skip


def rig_table(plant: Plant) -> list[tuple[float, float, tuple[float, ...]]]:
    """(pressure [MPa], speed [rpm], values of COLUMNS) over the nine reference points."""
    return [(mpa, rpm, rig_row(plant, mpa, rpm)) for mpa, rpm in REFERENCE]


def rig() -> Iterator[Figure]:
    """Largest deviation of the default rig from its reference calibration."""
    ours = np.array([values[:8] for _, _, values in rig_table(Plant("dtu_gas_bearing"))])
    reference = np.array(list(REFERENCE.values()))
    relative = np.abs(ours / reference - 1).max(axis=0) * 100
    yield Figure("rig against calibration A: natural frequencies", float(max(relative[0], relative[2])), "%", 1.0)
    zeta = np.abs(ours - reference)[:, [1, 3]].max()
    yield Figure("rig against calibration A: damping ratios", float(zeta), "1", 0.003)
    yield Figure("rig against calibration A: static gains", float(relative[4:6].max()), "%", 1.0)
    yield Figure("rig against calibration A: delays", float(np.abs(ours - reference)[:, 6:].max() * 1e3), "us", 5.0)


def grids() -> Iterator[Figure]:
    """Error of the first natural frequency at 0.3 MPa, 6 krpm; the sub-grid correction makes it fall with the grid."""
    sizes = ((32, 8), (32, 16), (48, 16), (96, 24), (128, 32), (192, 48))
    f = [
        Plant("dtu_gas_bearing", n_theta=a, n_z=b).linearise(2 * np.pi * 100, 0.3e6).wn[0] / (2 * np.pi)
        for a, b in sizes
    ]
    for (a, b), value in zip(sizes[:-1], f, strict=False):
        yield Figure(f"frequency error of {a}x{b} against 192x48", abs(value / f[-1] - 1) * 100, "%")
    yield Figure("  32x16 against 128x32", abs(f[1] / f[4] - 1) * 100, "%", 0.2)


def decay() -> Iterator[Figure]:
    """Free decay after a light tap at 0.5 MPa, at rest, against the eigenvalue, with steps of 0.2 ms."""
    plant = Plant("dtu_gas_bearing", dt=2e-4)
    quiet = plant.machine.replace("effects.coupling.force_2x", "0 N").replace("effects.coupling.force_3x", "0 N")
    plant = Plant(quiet)
    model = plant.linearise(0.0, 0.5e6)
    for axis, name in enumerate("xy"):
        force = np.zeros((5000, 2))
        force[0, axis] = 1.0
        record = plant.simulate(1.0, 0.0, 0.5e6, disc_force=force)
        signal = record["disc"].values[100:1500, axis] - plant.equilibrium(0.0, 0.5e6).disc[axis]
        omega, zeta = fit_decay(np.arange(len(signal)) * 2e-4, signal, model.wn[axis], model.zeta[axis])
        yield Figure(
            f"free decay {name}: frequency against eigenvalue", abs(omega / model.wn[axis] - 1) * 100, "%", 0.1
        )
        yield Figure(f"free decay {name}: damping against eigenvalue", abs(zeta - model.zeta[axis]), "1", 3e-4)


def fit_decay(time: np.ndarray, signal: np.ndarray, omega: float, zeta: float) -> tuple[float, float]:
    """Natural frequency [rad/s] and damping ratio of a decaying sinusoid, started at (omega, zeta)."""
    scale = np.abs(signal).max()

    def residual(p: np.ndarray) -> np.ndarray:
        damped = p[0] * np.sqrt(1 - p[1] ** 2)
        envelope = np.exp(-p[1] * p[0] * time)
        basis = np.stack([envelope * np.cos(damped * time), envelope * np.sin(damped * time)], axis=1)
        weights = np.linalg.lstsq(basis, signal, rcond=None)[0]
        return np.asarray((basis @ weights - signal) / scale)

    fit = least_squares(residual, [omega, zeta], x_scale=[omega, max(zeta, 1e-3)], xtol=1e-12, ftol=1e-12)
    return float(fit.x[0]), float(fit.x[1])


def mass() -> Iterator[Figure]:
    """Balance of the film's mass over a march at the default tolerance, relative to the mass injected."""
    injectors = tuple(Injector(angle) for angle in np.deg2rad([90, 0, -90, 180]))
    bearing = GasBearing(0.02, 0.04, 25e-6, injectors=injectors, n_theta=32, n_z=16)
    march = bearing.march(
        lambda t: (2e-6 + 3e-6 * np.sin(500 * t) ** 2, -6e-6), 0.1, 1e-4, 314.159, 0.5e6, tolerance=5e-6
    )
    yield Figure("mass defect of a march, share of the mass injected", march.mass_defect, "1", 1e-9)
