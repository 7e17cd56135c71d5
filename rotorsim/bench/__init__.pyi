from .accuracy import rig_table as rig_table
from .decide import loop_figures as loop_figures, loops as loops
from .diagnose import cases as cases, reported_cases as reported_cases
from .loop_case import LoopCase as LoopCase
from .measure_parts import measure as measure
from .odds_score import (
    brier as brier,
    calibration_error as calibration_error,
    coverage as coverage,
    reliability as reliability,
)
from .parts import PARTS as PARTS
from .result import Figure as Figure
from .verdicts import Case as Case, confusion as confusion, figures as figures
