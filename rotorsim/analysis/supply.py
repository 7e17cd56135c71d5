r"""Supply pressure: from which a film carries the rotor (lift-off), what it then carries, how much of it is felt.

The lift-off pressure is the lowest supply pressure at which there is an equilibrium, by bisection. The load capacity is
the static load under which the most eccentric journal reaches half of its clearance. The load is the rotor's weight,
scaled: distributed along the shaft as its mass and directed as gravity, so that several bearings share it as they share
the weight. Machines without weight are loaded downwards.

Behind a supply line the pressure at the injectors is less than at the regulator. The flow at rest depends on the
pressure at the injectors alone, so it is that of the machine without its line; the regulator's pressure is the one that
leaves, behind the line with this flow, the pressure that was read.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import scipy  # loads its packages where they are first used

from rotorsim.analysis.axes import checked
from rotorsim.base.errors import ConvergenceError, DataError, NoLiftOffError
from rotorsim.effects import numeric_fields
from rotorsim.effects.rotor.gravity import Gravity
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.calls import Call
from rotorsim.plant.simulation import describe, settle

AT_REST = 1e9
"""Time [s] in which a line has filled."""


def regulator_pressure(a: Assembly, speed: float, pressure: float) -> float:
    """Gauge pressure [Pa] at the regulator for `pressure` [Pa, gauge] at the injectors, at rest at `speed` [rad/s].

    The same without a supply line that loses anything. Raises as `settle`.
    """
    lines = [call for call in a.calls if call.effect.port == "supply"]
    if not lines:
        return pressure
    free = replace(a, record=_neutral(a, lines))
    flow = float(describe(free, settle(free, speed, pressure)).mass_flow.sum())
    left = a.module.supply_line
    ambient = a.machine.gas.ambient_pressure

    def missing(regulator: float) -> float:
        return pressure + ambient - float(left(a.w.copy(), a.parameters, AT_REST, regulator + ambient, flow)[1])

    loss = missing(pressure)
    return pressure if loss == 0 else float(scipy.optimize.newton(missing, pressure, x1=pressure + loss, tol=1e-3))


def felt(machines: Sequence[Machine], pressures: Sequence[float] | np.ndarray) -> np.ndarray:
    """Gauge pressures (p,) [Pa] that act on the machines: all, or 0 alone where gas is supplied to none.

    Raises DataError for a pressure below vacuum, also where none acts.
    """
    for machine in machines:
        for pressure in pressures:
            machine.gas.absolute(float(pressure))
    supplied = any(machine.supplied for machine in machines)
    return np.asarray(pressures, float) if supplied else np.zeros(1)


def _neutral(a: Assembly, lines: list[Call]) -> Any:
    """The parameter record with these effects switched off."""
    record = a.record.copy()
    for call in lines:
        off = type(call.effect)()
        for name in numeric_fields(type(call.effect)):
            if hasattr(off, name):
                record[0][call.record][name] = getattr(off, name)
    return record


HIGHEST = 2e6
"""Gauge pressure [Pa] up to which is looked."""
EXACT = 0.5e3
"""Width [Pa] of the last bracket."""
BELOW = (0.97, 0.9, 0.75, 0.5)
"""Shares of the highest pressure refused at which the refusal is put to the test."""
RATIO = 0.5
"""Eccentricity ratio at which the load is read."""
EARTH = 9.80665
HEAVIEST = 1e6
"""Acceleration [m/s2] up to which is looked."""
CONTACT = 1.0


def lift_off(
    plant: Plant, speeds: Sequence[float] | np.ndarray, highest: float = HIGHEST, least_film: float = 0.0
) -> np.ndarray:
    """Lift-off pressures (n_speed,) [Pa, gauge]; 0 where speed alone carries, NaN where `highest` does not.

    Carried is a rotor with an equilibrium and at least `least_film` [m] left; a turning shaft rides on very thin films.
    More pressure carries more. Raises DataError for a machine without injectors.

    Examples
    --------
    >>> import rotorsim as rs
    >>> bool(rs.analysis.lift_off(plant, [0.0])[0] > 0)
    True
    """
    if not plant.machine.fed:
        raise DataError("lift-off: the machine has no injectors, so no pressure lifts it; vary the speed instead")
    speeds = checked("lift-off: speeds [rad/s]", speeds)
    return np.array([lowest(partial(carries, plant, v, least_film=least_film), highest) for v in speeds.tolist()])


def lowest(carried: Callable[[float], bool], highest: float) -> float:
    """Lowest pressure [Pa] at which the rotor is carried; NaN where `highest` does not.

    A search for an equilibrium can fail where there is one: pressures below those refused are tried too, and one that
    carries is the start of a new bisection.
    """
    if carried(0.0):
        return 0.0
    low, high = 0.0, min(0.1e6, highest)
    while not carried(high):
        low, high = high, 2 * high
        if low >= highest:
            return float("nan")
    while True:
        while high - low > EXACT:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if carried(middle) else (middle, high)
        below = next((low * share for share in BELOW if low * share > EXACT and carried(low * share)), None)
        if below is None:
            return high
        low, high = 0.0, below


def carries(plant: Plant, speed: float, pressure: float, least_film: float = 0.0) -> bool:
    """Whether there is an equilibrium with so much film [m]."""
    try:
        return plant.equilibrium(speed, pressure).h_min >= least_film
    except NoLiftOffError:
        return False


def load_capacity(plant: Plant, speed: float = 0.0, pressure: float = 0.0, ratio: float = RATIO) -> float:
    """Static load [N] of the whole rotor at which the largest eccentricity ratio of its films is `ratio`.

    Parameters
    ----------
    plant : Plant
    speed, pressure : float
        Operating point [rad/s], [Pa, gauge].
    ratio : float
        Eccentricity ratio, above 0 and below 1.

    Raises
    ------
    DataError
        For a machine without a film, or a ratio out of its range.
    NoLiftOffError
        Where the films do not even carry the journals at this ratio under a hundredth of the weight.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.load_capacity(plant, 0.0, 0.5e6) > 0
    True
    """
    if plant.machine.film is None:
        raise DataError("load capacity: the machine has no gas film; its bearings are linear and carry any load")
    if not 0 < ratio < 1:
        raise DataError(f"load capacity: an eccentricity ratio of {ratio:g} is not between 0 and 1; give e.g. 0.5")
    if "gravity" not in plant.machine.effects:  # a weight that can be scaled
        effects = plant.machine.effects | {"gravity": (Gravity(acceleration=EARTH),)}
        plant = Plant(plant.machine.with_({"effects": effects}))

    def excess(acceleration: float) -> float:
        return _eccentricity(plant.assembly, speed, pressure, acceleration) - ratio

    low, high = 0.01 * EARTH, EARTH
    if excess(low) >= 0:
        raise NoLiftOffError("load capacity: the films carry less than a hundredth of the weight at this ratio")
    while excess(high) < 0:
        low, high = high, 4 * high
        if high > HEAVIEST:
            others = (
                "; its other bearings carry the load" if len(plant.machine.films) < len(plant.machine.bearings) else ""
            )
            raise ConvergenceError(
                f"load capacity: {HEAVIEST / EARTH:.3g} times the weight does not move a journal to {ratio:g} of its "
                f"clearance{others}; ask for a smaller ratio"
            )
    return plant.machine.mass * float(scipy.optimize.brentq(excess, low, high, rtol=1e-4))


def _eccentricity(a: Assembly, speed: float, pressure: float, acceleration: float) -> float:
    """Largest eccentricity ratio under a weight of this acceleration [m/s2]; 1 where the films do not carry it."""
    record = a.record.copy()
    first = next(call for call in a.calls if isinstance(call.effect, Gravity))
    record[0][first.record]["acceleration"] = acceleration
    heavier = replace(a, record=record)
    try:
        return float(describe(heavier, settle(heavier, speed, pressure)).eccentricity_ratios.max())
    except (NoLiftOffError, ConvergenceError):
        return CONTACT
