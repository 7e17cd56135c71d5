"""Examples of the site: each runs by itself in an empty folder, draws its picture and prints its numbers."""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rotorsim.report.scenes import lacking
from waiting import PATIENCE

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.py"))
SCENES = ("film_pressure", "mode_shape")
"""Examples that draw in three dimensions."""
QUICK = ("campbell", "lab_data", "runup")
"""Examples that run in the quick tests: a linear analysis, a simulated run, measured data."""
MOST_LINES = 60
PRINTED = {
    "balance": (1.8,),
    "broadband_force": ("wanders by 1 %, 1200 rpm: 0.58", 1200, 0.58, 3600, 1.71, 6000, 2.88),
    "campaign": (6,),
    "campbell": (2647, 2647),
    "compare_runups": (25, 489, 2702, 10, 195, 2702),
    "closed_loop_record": (92, 508, 0.46, 0.40, 1.2, 2.8, 0.37, 0.31, 5.7, 13.9),
    "dead_time": (3, 91.4, 90.8, 8, 8, 3, 87.7, 84.1, 8, 8, 2, 91.4, 90.9, 8, 8),
    "decide": ("decided: one explanation has 95 %", "coupling.force_2x"),
    "design_point": ("LQR from 6000 rpm, 0.3 MPa: peak 7.4 um, amplitude at 6000 rpm 4.9",),
    "diagnose": ("verdict: named", "shaft_bow"),
    "diagnose_runup": ("verdict: partial", "runout.amplitude_1x or shaft_bow.bow"),
    "lift_off": (239, 221),
    "starts": (2, 18),
    "discover_law": ("discovered: cubic at disc 1", 1, 2.996e12),
    "film_coefficients": (0.7, 7.0, 5, 10.4, 1000),
    "film_pressure": (67.5, 44),
    "film_range": (
        "dtu_gas_bearing: 21 of 25 speeds beyond",
        "above 6000 rpm: 6100 rpm",
        "ended at 6003 rpm: the rim",
    ),
    "fmu_loop": (10.2, 5.4),
    "frequency_response": (26.4, 118),
    "foil_rotor": (-0.098, 9.0, 6000, 11.9, 28000, 0.061, 8.7, 6000, 9.1, 28000),
    "grooved_rotor": (0.019, 1299, -0.125, 1300),
    "impact": (118.6, 0.0563, 118.8, 0.0565),
    "lab_data": (20000, 2),
    "lpv": (-0.14, -0.16),
    "measured_runup": (1665, 1663),
    "mode_shape": (44.1, 0.0021),
    "mpc": ("Reference of 1 V", 30.5, 10, 22, 27.8, 24.0, 15.3, 28.6, 6.7, 13.6, 28.6, 7.6, 13.2),
    "notebook": (201,),
    "orbit_free_record": (
        0.9,
        2,
        0.53,
        1.04,
        -4.0,
        2.3,
        2,
        0.54,
        1.11,
        -11.1,
        9.2,
        0.0,
        2,
        0.22,
        0.10,
        1.4,
        -15.9,
        2,
        0.26,
        0.15,
        -5.9,
        -10.3,
    ),
    "own_effect": (-133.3, -77.7),
    "operating_map": (0.019, 0.069),
    "own_structure": (118.8, 0.0565, 3.08, 3, 118.3, 0.051, 3.5, 118.9, 0.0549, 3.11, 118.9, 0.0549, 3.09),
    "own_machine": (31.5, 36.2, 256.7, 288.7),
    "prbs_to_controller": (93.2, 92.5, 94.5, 0.549, 2, 0.159, 2),
    "pin_sensors": (0.0, 0.51, 0.51, 0.15, 0.37, 0.37, 0.315, 0.21, 0.21),
    "plan_next": ("bit today", "Next: "),
    "probes": (22.2, 26.0, 35.2, 49.0),
    "pump": (2479, 4.8, 2209, 6.0),
    "python_control": (92, 0.012, 1.34, 2, 0.61, 2),
    "reversed_sensor": (79, 26, "the sensor of x is reversed"),
    "robust_design": ("rig, uncertainty 0.5: gamma 2.14", 0.67, 0.87, 0.44, 0.66, 0.51, 1.37, 0.0, 1.17, 0.74, 0.81),
    "runout_table": ("orbit 4.3 um", "orbit 3.2 um", "today", 3.28, 2.66, 0, 4, 100.3),
    "runup": (59.7, 7805),
    "sensor_ring": (0, 12.3, 8.2, 45, 11.1, 9.7, 1, 0, 8.6, 5.7, 1, 45, 8.6, 5.7),
    "sensitivity": (23, 0.5, 17293, 25, 0.5, 16455, 27, 0.5, 15810),
    "staircase": (3.23,),
    "sweep": (0.15391, 20.0, 21352.0, 20.0, 0.7, 51.484, 20.0, 0.3),
    "unbalance_response": (48, 2984),
    "warm_bearing": (26.4, 150, 26.2, 150, 25.5, 150, 5.86, 150, 4.70, 150),
    "whirl_onset": (0.16, 0.5, 16455),
}
"""Numbers that an example prints, in their order, within 5 %; with words, which are in it too, the first numbers."""
NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e[-+]\d+)?(?!\w)")


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in NAMES])
def test_an_example_runs_draws_its_picture_and_prints_its_numbers(name, tmp_path):
    if name in SCENES and (missing := lacking()):
        pytest.skip(missing)
    if name == "mpc":
        pytest.importorskip("osqp")
    if name == "fmu_loop" and not shutil.which("cc"):
        pytest.skip("no C compiler on this computer")
    script = tmp_path / f"{name}.py"
    script.write_text((EXAMPLES / script.name).read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "rk4").symlink_to(EXAMPLES.parent / "rk4")
    settings = {"MPLBACKEND": "Agg"}
    ran = subprocess.run(
        [sys.executable, script.name],
        cwd=tmp_path,
        env=os.environ | settings,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert ran.returncode == 0, ran.stderr[-2000:]
    assert (tmp_path / f"{name}.png").stat().st_size > 5000
    words = [one for one in PRINTED[name] if isinstance(one, str)]
    numbers = [one for one in PRINTED[name] if not isinstance(one, str)]
    found = [float(number) for number in NUMBER.findall(ran.stdout)]
    assert all(word in ran.stdout for word in words), ran.stdout
    assert (found[: len(numbers)] if words else found) == pytest.approx(numbers, rel=0.05, abs=1e-9), ran.stdout


def test_of_every_example_something_printed_is_asserted():
    assert PRINTED.keys() == set(NAMES) and all(PRINTED.values())


def test_an_example_has_a_title_a_sentence_and_a_picture_and_is_short():
    for name in NAMES:
        text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
        title, _, rest = (ast.get_docstring(ast.parse(text)) or "").partition("\n\n")
        assert title and "\n" not in title and len(rest) > 60, name
        assert text.count("\n") <= MOST_LINES, name
        assert (EXAMPLES / f"{name}.png").stat().st_size > 5000, f"{name}: run it in docs/examples"
    assert len(NAMES) >= 20


def test_every_picture_belongs_to_an_example():
    assert {path.stem for kind in ("png", "gif") for path in EXAMPLES.glob(f"*.{kind}")} <= set(NAMES)
