"""Running feedback loop: one sample of delay, total reference limited to the actuators' range."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.errors import ControllerError, ConvergenceError
from rotorsim.experiments.experiment import reference_range
from rotorsim.plant.controller import ask, call
from rotorsim.plant.simulation import split_columns

if TYPE_CHECKING:
    from rotorsim.plant.controller import Controller
    from rotorsim.plant.simulation import Simulation


class FeedbackLoop:
    """The running loop: what the controller saw in a sample acts in the next one, added to the external reference."""

    def __init__(self, controller: Controller, Ts: float) -> None:
        self.controller = controller
        self.output = np.zeros(2)
        call(controller, "check_sampling", Ts)
        call(controller, "reset")

    def advance(self, simulation: Simulation, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sample table and the input rows really applied, for rows whose reference is the external one.

        A ConvergenceError or ControllerError carries both, up to the failure, in `where["table"]` and `where["rows"]`.
        """
        used = rows.copy()
        tables: list[np.ndarray] = []
        limit = reference_range(simulation.assembly.machine)
        for k in range(len(rows)):
            used[k, 2:4] = np.clip(rows[k, 2:4] + self.output, -limit, limit)
            try:
                tables.append(simulation.advance(used[k : k + 1]))
            except ConvergenceError as error:
                done = np.concatenate([*tables, error.where["table"]])
                raise ConvergenceError(str(error), table=done, rows=used[:k]) from error
            try:
                self.output = self._ask(simulation, tables[-1], used[k])
            except ControllerError as error:
                raise ControllerError(str(error), table=np.concatenate(tables), rows=used[: k + 1]) from error
        return np.concatenate(tables), used

    def _ask(self, simulation: Simulation, table: np.ndarray, row: np.ndarray) -> np.ndarray:
        seen: dict[str, Any] = split_columns(simulation.assembly, table, row[None])
        speed = seen.get("speed_measured", seen["speed"])[0]
        pressure = seen.get("pressure_measured", seen.get("pressure", row[1:2]))[0]
        time = (simulation.samples - 1) * simulation.assembly.sampling_time
        return ask(self.controller, seen["disc_measured"][0], float(speed), float(pressure), time, row[2:4])
