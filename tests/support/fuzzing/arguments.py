"""Random arguments of `rotorsim runup` and `rotorsim experiment NAME`: valid and faulty short runs."""

from typing import Any

from hypothesis import strategies as st

from fuzzing.machines import free, texts
from fuzzing.values import NONSENSE, beyond, broken, legal, text_of
from rotorsim.base.quantity import Quantity
from rotorsim.base.units import RIG_SAMPLE, show
from rotorsim.commands.experiment import ClosedLoopSetup
from rotorsim.experiments import EXPERIMENTS
from rotorsim.experiments.experiment import parameters

KRPM = 1000 * 3.141592653589793 / 30


def samples(least: int, most: int) -> st.SearchStrategy[str]:
    """A time of whole samples."""
    return st.integers(least, most).map(lambda n: show(float(f"{n * RIG_SAMPLE:.12g}"), "s"))


def mixed(unit: str, *ranges: tuple[float, float]) -> st.SearchStrategy[str]:
    """Values [SI] out of some ranges, all as likely."""
    return st.one_of([st.floats(*ends) for ends in ranges]).map(lambda value: show(value, unit))


SPEED = mixed("rad/s", (0, 0), (0, KRPM), (KRPM, 6 * KRPM), (0, 10 * KRPM), (0, 100 * KRPM))
PRESSURE = mixed("Pa", (0, 0), (0, 2e5), *[(2e5, 8e5)] * 5, (8e5, 1e7), (1e7, 1e12))
REFERENCE = mixed("V", (1e-6, 0.1), (0.1, 5), (5, 5))
POINT = {"speed": SPEED, "pressure": PRESSURE}
AXIS = st.sampled_from(["x", "y", "both"])
SHORT: dict[str, dict[str, st.SearchStrategy[str]]] = {
    "steady": POINT | {"duration": samples(2, 300)},
    "slow_roll": POINT | {"speed": mixed("rad/s", (2 * KRPM, 100 * KRPM)), "revolutions": st.sampled_from(["1", "2"])},
    "staircase": POINT | {
        "axis": AXIS, "hold": samples(1, 20),
        ("amplitude", "step"): st.sampled_from([("5 V", "5 V"), ("4 V", "2 V"), ("0.3 V", "0.1 V"), ("1 mV", "1 mV")]),
    },
    "prbs": POINT | {
        "amplitude": REFERENCE, "duration": samples(20, 300), "bias": samples(0, 25), "hold": samples(1, 400),
    },
    "chirp": POINT | {
        "amplitude": REFERENCE, "low": mixed("Hz", (1e-3, 2500)), "high": mixed("Hz", (1e-3, 2500)),
        "duration": samples(2, 200), "bias": samples(0, 50), "axis": AXIS,
        "law": st.sampled_from(["linear", "logarithmic"]),
    },
    "multisine": POINT | {
        "amplitude": REFERENCE, "low": mixed("Hz", (1, 200)), "high": mixed("Hz", (200, 2600)),
        "period": samples(10, 200), "periods": st.sampled_from(["1", "2"]), "spacing": st.sampled_from(["1", "2", "7"]),
        "tries": st.sampled_from(["1", "3"]), "bias": samples(0, 50), "axis": AXIS,
        "mean_x": mixed("V", (0, 0), (-6, 6)), "mean_y": mixed("V", (0, 0), (-1, 1)),
    },
    "impact": POINT | {
        "peak": mixed("N", (1e-3, 100), (100, 1e4), (1e4, 1e9)), "width": mixed("s", (2e-4, 5e-3)),
        "angle": mixed("rad", (-7, 7), (-1e6, 1e6)), "hits": st.sampled_from(["1", "2", "3"]),
        "spacing": samples(5, 120), "lead": samples(0, 50), "jitter": mixed("s", (0, 0), (0, 0.01)),
        "scatter": mixed("1", (0, 1)),
    },
    "controlled": POINT | {
        "duration": samples(2, 200), "gain_x": mixed("V/m", (-1e6, 1e6), (-1e9, 1e9)),
        "gain_y": mixed("V/m", (-1e6, 1e6)),
        "low_pass": mixed("Hz", (1, 2500)), "bias_x": mixed("V", (-5, 5)), "bias_y": mixed("V", (-5, 5)),
        "dither": mixed("V", (0, 0), (0, 5)), "hold": samples(1, 400),
        "hit": mixed("N", (0, 0), (0, 1e4)), "hit_angle": mixed("rad", (-7, 7)),
    },
    "coastdown": {
        "start": mixed("rad/s", (KRPM, 100 * KRPM)), "stop": mixed("rad/s", (0, KRPM)), "pressure": PRESSURE,
        "longest": samples(2, 200),
    },
    "runup": {
        "start": SPEED, "stop": SPEED, "rate": mixed("rad/s^2", (5e3 * KRPM, 1e5 * KRPM)), "pressure": PRESSURE,
    },
}  # fmt: skip
"""Options of each experiment, so that it lasts a fraction of a second."""
PLACES = (".position", ".start", "sections.0.length", "sections.1.length", "sections.2.length")
"""Changes that move parts off the shaft and are mostly refused."""
LONG = {"duration", "hold", "period", "periods", "longest", "hits", "spacing", "lead", "bias", "revolutions", "rate"}
"""Parameters whose legal values can make a run of days."""
NOT_TIMES = (
    *NONSENSE,
    "-1 s",
    "0 s",
    "1e-9 s",
    "0.05 ms",
    "3e6 s",
    "1e300 s",
    "5e-324 s",
    "1e30",
    "0",
    "1.5",
    "1e-320 rpm/s",
)
NO_GRIDS = ("", "x", "8", "8x", "8x4x2", "0x0", "7x4", "8x3", "9999x4", "1" * 5000 + "x4", "-8x4", "8 x 4")
NO_FOLDERS = ("/proc/nothing/a", "a" * 300, "/dev/null", "")
NO_CHANGES = (
    "=1", "effects=1", "bearings=2", "bearings.9.kxx=1", "effects.unbalance.0.me=1", "effects.unbalance.1.me=1 g*mm",
    "a.b.c.d=1", "effects.nothing.x=1", "name=", "name=\x00", "name='\"\\\n", "bearings.-1.kxx=1",
    "grid.n_theta=" + "1" * 5000, "solver.time_step=0 s", "solver.modes_per_plane=1000",
)  # fmt: skip
"""Values that --set, --grid and --out do not take, or take only by luck."""


def known(name: str) -> dict[str, Quantity]:
    """Parameters of an experiment's command."""
    kind = ClosedLoopSetup if name == "controlled" else EXPERIMENTS[name]
    return {entry.name: param for entry, param in parameters(kind)}


@st.composite
def options(draw: Any, name: str) -> dict[str, str]:
    """Option -> text of a short run."""
    given: dict[str, str] = {}
    for key, strategy in SHORT[name].items():
        if isinstance(key, tuple):
            given |= dict(zip(key, draw(strategy), strict=True))
        elif key in LONG or name in ("runup", "multisine", "slow_roll") or draw(st.booleans()):
            given[key] = draw(strategy)
    return given


@st.composite
def wrong_options(draw: Any, name: str) -> dict[str, str]:
    """Options of a short run with one that is most likely wrong."""
    given = draw(options(name))
    params = known(name)
    key = draw(st.sampled_from(sorted(params)))
    param = params[key]
    if key in LONG or param.samples:
        given[key] = draw(st.sampled_from(NOT_TIMES))
    elif param.choices:
        given[key] = draw(st.sampled_from(NONSENSE))
    else:
        given[key] = draw(broken(param))
    return given


@st.composite
def changes(draw: Any, machine: str, most: int = 4) -> list[str]:
    """PATH=VALUE of legal values, as a list for --set."""
    table = free(machine)
    picked = draw(st.lists(st.sampled_from(table), max_size=most, unique_by=lambda q: q[0]))
    picked = [q for q in picked if not q[0].endswith(PLACES) or draw(st.integers(0, 9)) == 7]
    return [f"{path}={text_of(draw(legal(spec, value)), spec)}" for path, value, spec in picked]


@st.composite
def wrong_changes(draw: Any, machine: str) -> list[str]:
    """--set with something wrong: value, path or shape."""
    path, _, spec = draw(st.sampled_from(free(machine)))
    return [
        draw(
            st.one_of(
                broken(spec).map(lambda text: f"{path}={text}"),
                beyond(spec).map(lambda value: f"{path}={value!r}"),
                st.sampled_from([f"{path}.x=1", f"{path}.0=1", path, f".{path}=1", f"{path} = 1", *NO_CHANGES]),
                st.text(max_size=20),
            )
        )
    ]


def spelled(given: dict[str, str]) -> list[str]:
    """Options as arguments; '=' lets a value begin with a dash."""
    return [f"--{key.replace('_', '-')}={value}" for key, value in given.items()]


@st.composite
def calls(draw: Any) -> list[str]:
    """Arguments of a short run of a legal machine, on one of the compiled structures."""
    machine = draw(st.sampled_from(sorted(texts())))
    driven = [name for name in sorted(SHORT) if machine != "plain" or not EXPERIMENTS[name].drives_reference]
    name = draw(st.sampled_from(driven))
    as_command = name == "runup" and draw(st.booleans())
    start = ["runup"] if as_command else ["experiment", name]
    sets = [f"--set={change}" for change in draw(changes(machine))]
    seed = [f"--seed={draw(st.sampled_from([0, 1, 2**53 - 1]))}"]
    json = ["--json"] if draw(st.booleans()) else []
    page = [] if draw(st.integers(0, 30)) == 17 else ["--no-report"]
    return [*start, f"{machine}.toml", *spelled(draw(options(name))), *sets, *seed, *json, *page]


@st.composite
def wrong_calls(draw: Any) -> list[str]:
    """Arguments with something wrong: an option, a change, a word too many, a folder that cannot be one."""
    machine = draw(st.sampled_from(sorted(texts())))
    name = draw(st.sampled_from(sorted(SHORT)))
    fault = draw(st.sampled_from(["option", "option", "change", "change", "seed", "grid", "out", "word", "machine"]))
    given = draw(wrong_options(name) if fault == "option" else options(name))
    extra = {
        "change": [f"--set={text}" for text in draw(wrong_changes(machine))],
        "seed": [f"--seed={draw(st.sampled_from(['-1', '1.5', '', '²', '٣', '9' * 16, '9' * 20, '9' * 5000, 'x']))}"],
        "grid": [f"--grid={draw(st.sampled_from(NO_GRIDS))}"],
        "out": [f"--out={draw(st.sampled_from([f'{machine}.toml', f'{machine}.toml/a', *NO_FOLDERS]))}"],
        "word": [
            draw(st.text(max_size=8)),
            draw(st.sampled_from(["--help", "--nothing", "--json=1", "-x", "--", "--set"])),
        ],
    }.get(fault, [])
    file = (
        draw(st.sampled_from(["nothing.toml", ".", "", "/", "a\nb", "é.toml", "\udcff", "/dev/null"]))
        if fault == "machine"
        else f"{machine}.toml"
    )
    start = ["runup"] if name == "runup" and draw(st.booleans()) else ["experiment", name]
    return [*start, file, *spelled(given), *extra, "--no-report"]
