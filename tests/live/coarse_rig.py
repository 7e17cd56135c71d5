"""Live rig on a coarse grid, with a runner advanced by hand."""

from functools import lru_cache

import numpy as np

from rotorsim.live.laws import DECAY, FEWEST, read_laws
from rotorsim.live.rig import Rig
from rotorsim.machine import load_machine
from waiting import until

RPM = np.pi / 30


@lru_cache
def coarse():
    machine = load_machine("dtu_gas_bearing").replace("grid.n_theta", 16).replace("grid.n_z", 8)
    return machine.replace("solver.time_step", "0.2 ms").replace("shaft.max_element_length", "80 mm")


def make_rig(**settings):
    rig = Rig(coarse(), read_laws([]))
    for key, value in settings.items():
        rig.set(key, value)
    rig.reset()
    return rig


def ran(runner, samples):
    for _ in range(samples // 50):
        runner._part(50)


def shown(runner):
    """Status of a runner's frame once nothing is being computed; a check may wait for samples."""

    def settled():
        runner._obey()
        status = runner.frame()["status"]
        if status["reading"]["why"] != "being read" and not status["checking"]:
            return status
        if runner.rig.seen < DECAY + FEWEST:
            runner._part(50)
        return None

    return until(settled)
