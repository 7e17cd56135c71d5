"""Signatures of the experiments for editors and type checkers; a test holds them to the dataclasses."""

# fmt: off
from pathlib import Path

import xarray as xr

from rotorsim.machine import Machine
from rotorsim.plant.plant import Plant

Rig = Plant | Machine | str | Path

def chirp(plant: Rig, speed: float = 0.0, pressure: float = 300000.0, amplitude: float = 1.0, low: float = 1.0,
          high: float = 400.0, duration: float = 10.0, axis: str = 'x', law: str = 'linear', bias: float = 0.4,
          seed: int = 0, progress: bool = False) -> xr.Dataset: ...
def coastdown(plant: Rig, start: float = 628.3185307179587, stop: float = 0.0, rate: float | None = None,
              pressure: float = 300000.0, longest: float = 300.0, seed: int = 0,
              progress: bool = False) -> xr.Dataset: ...
def impact(plant: Rig, speed: float = 0.0, pressure: float = 300000.0, peak: float = 20.0, width: float = 0.001,
           angle: float = 0.0, hits: int = 1, spacing: float = 1.0, lead: float = 0.1, jitter: float = 0.0,
           scatter: float = 0.0, sequence: int = 0, seed: int = 0, progress: bool = False) -> xr.Dataset: ...
def multisine(plant: Rig, speed: float = 0.0, pressure: float = 300000.0, amplitude: float = 1.0, low: float = 1.0,
              high: float = 400.0, period: float = 1.0, periods: int = 10, spacing: int = 1, tries: int = 20,
              bias: float = 0.0, sequence: int = 0, axis: str = 'both', mean_x: float = 0.0, mean_y: float = 0.0,
              seed: int = 0, progress: bool = False) -> xr.Dataset: ...
def prbs(plant: Rig, speed: float = 0.0, pressure: float = 300000.0, amplitude: float = 1.0, duration: float = 10.0,
         bias: float = 0.4, hold: float = 0.005, sequence: int = 0, seed: int = 0,
         progress: bool = False) -> xr.Dataset: ...
def slow_roll(plant: Rig, speed: float = 10.471975511965978, pressure: float = 300000.0, revolutions: int = 5,
              seed: int = 0, progress: bool = False) -> xr.Dataset: ...
def staircase(plant: Rig, speed: float = 0.0, pressure: float = 300000.0, axis: str = 'x', amplitude: float = 2.0,
              step: float = 0.5, hold: float = 0.5, seed: int = 0, progress: bool = False) -> xr.Dataset: ...
def steady(plant: Rig, speed: float = 0.0, pressure: float = 300000.0, duration: float = 10.0, seed: int = 0,
           progress: bool = False) -> xr.Dataset: ...
