"""`rotorsim experiment NAME` and `rotorsim runup`: one command per virtual experiment, made from its dataclass.

Options, their defaults and help, the example and the call in Python follow from the parameters; the summary, the table
and the page from the record. `rotorsim experiment controlled` takes a law from its file or
a built-in one, dither and impacts besides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from shlex import split
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError
from rotorsim.base.interrupt import done
from rotorsim.base.units import RIG_SAMPLE, parse, show
from rotorsim.commands import options
from rotorsim.commands.registry import CommandGroup, example, group, with_options
from rotorsim.experiments.catalogue.controlled import Controlled
from rotorsim.experiments.catalogue.impact import Impact
from rotorsim.experiments.catalogue.prbs import Prbs
from rotorsim.experiments.experiment import REFERENCE_LIMIT, Experiment, check_parameters, param, sequence

if TYPE_CHECKING:
    from dataclasses import Field

    from rotorsim.base.quantity import Quantity
    from rotorsim.commands.options import ResultFolder
    from rotorsim.control import Law
    from rotorsim.experiments import Experiment, Outcome, ProportionalLaw, WithHarmonics
    from rotorsim.plant import Plant

LawFile = Annotated[
    Path | None, typer.Option("--law", help="Law that 'rotorsim design' wrote, in place of controller and gains.")
]
WithoutOrbit = Annotated[
    bool,
    typer.Option(
        "--without-orbit", help="Add harmonics of the speed that keep the references from following the orbit."
    ),
]
History = Annotated[
    Path | None,
    typer.Option("--history", help="CSV file of accelerations over time (time, x, y) in place of the half sine."),
]
FILES: dict[str, dict[str, tuple[Any, Any]]] = {
    "controlled": {"law": (LawFile, None), "without_orbit": (WithoutOrbit, False)},
    "shock": {"history": (History, None)},
}
"""Options of experiments that are no parameters: annotation and default."""
BUILT_IN = ("controller", "gain_x", "gain_y", "low_pass")
"""Parameters of the built-in law."""


@dataclass(frozen=True)
class ClosedLoopSetup:
    """Closed loop with a controller, dither and hits."""

    speed: float = param("rad/s", "Shaft speed.", 0.0, low=0)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)
    duration: float = param("s", "Length of the record.", 10.0, above=0, samples=True)
    controller: str = param("1", "Controller: p is proportional feedback of the displacement.", "p", choices=("p",))
    gain_x: float = param("V/m", "Volts of reference x per displacement x; positive pushes outwards.", 0.25e6)
    gain_y: float = param("V/m", "Volts of reference y per displacement y.", 0.22e6)
    low_pass: float = param("Hz", "Bandwidth of the law's low-pass.", 1000.0, above=0, sampled=True)
    bias_x: float = param("V", "Constant reference x.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    bias_y: float = param("V", "Constant reference y.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    dither: float = param("V", "Level of binary references on both axes; 0 for none.", 0.0, low=0, high=REFERENCE_LIMIT)
    hold: float = param("s", "Shortest time between jumps of the dither.", Prbs.hold, above=0, samples=True)
    sequence: int = sequence()
    hit: float = param("N", "Peak of a hammer's hit on the disc every second; 0 for none.", 0.0, low=0)
    hit_angle: float = param("rad", "Direction of the hits.", 0.0)
    law: Path | None = None
    without_orbit: bool = False
    Ts: float = RIG_SAMPLE

    def __post_init__(self) -> None:
        check_parameters(self)
        given = [f.name for f in fields(self) if f.name in BUILT_IN and getattr(self, f.name) != f.default]
        if self.law is not None and given:
            words = ", ".join(f"--{name.replace('_', '-')}" for name in given)
            raise DataError(f"--law: the law of the file replaces the built-in one; leave out {words}")
        drawn = [name for name in ("hold", "sequence") if getattr(self, name) != getattr(Prbs, name)]
        if drawn and not self.dither:
            raise DataError(f"--{drawn[0]}: is of the dither, which is 0; give e.g. --dither '0.3 V'")

    def experiment(self, plant: Plant) -> Controlled:
        """The experiment; the built-in law acts on the displacement from the plant's equilibrium."""
        point = (self.speed, self.pressure, self.duration)
        return Controlled(*point, self.bias_x, self.bias_y, self.controlled_by(plant), self.excitations(), Ts=self.Ts)

    def controlled_by(self, plant: Plant) -> Law | ProportionalLaw | WithHarmonics:
        """The law, with harmonics of the speed where these are asked for."""
        law = self._law(plant)
        if not self.without_orbit:
            return law
        from rotorsim.experiments.laws import without_orbit

        return without_orbit(plant, law, self.speed, self.pressure)

    def _law(self, plant: Plant) -> Law | ProportionalLaw:
        """The law of the file, or the built-in one."""
        if self.law is not None:
            from rotorsim.control import load_law

            return load_law(self.law)
        from rotorsim.experiments.laws import ProportionalLaw

        centre = plant.equilibrium(self.speed, self.pressure).disc
        return ProportionalLaw(self.gain_x, self.gain_y, self.low_pass, (float(centre[0]), float(centre[1])), self.Ts)

    def excitations(self) -> tuple[Experiment, ...]:
        """Dither and hits."""
        added: list[Experiment] = []
        if self.dither:
            signal = Prbs(
                amplitude=self.dither, duration=self.duration, bias=0.0, hold=self.hold, sequence=self.sequence,
                Ts=self.Ts,
            )  # fmt: skip
            added.append(signal)
        if self.hit:
            added.append(Impact(peak=self.hit, angle=self.hit_angle, hits=max(round(self.duration), 1), Ts=self.Ts))
        return tuple(added)


Rows = list[tuple[str, str]]
Seed = Annotated[str, typer.Option("--seed", help="Seed of the machine's noise.")]
COMMON: dict[str, tuple[Any, Any]] = {
    "settings": (options.PlantOptions, options.PlantOptions()),
    "seed": (Seed, "0"),
    "result": (options.ResultOptions, options.ResultOptions()),
}
"""Options of every experiment: annotation and default."""
IN_ORDER = (
    "slow_roll",
    "runup",
    "coastdown",
    "steady",
    "impact",
    "shock",
    "staircase",
    "prbs",
    "multisine",
    "chirp",
    "controlled",
)
"""Experiments in the order in which a rig meets them, which is that of the help; others follow by their names."""
OF_FILM = "pressure"
"""Parameter that a machine without a gas film has no use for."""


@group("experiment", "Example: rotorsim experiment prbs dtu_gas_bearing --amplitude '1 V' --duration '10 s'")
class Experiments(CommandGroup):
    """Run one virtual test (PRBS, impact ...) and keep its record."""

    def names(self) -> Iterable[str]:
        """Names of all experiments."""
        from rotorsim.experiments.experiment import EXPERIMENTS

        return sorted(sorted(EXPERIMENTS), key=lambda name: [*IN_ORDER, name].index(name))

    def function(self, name: str) -> Callable[..., None]:
        """The command's function of one experiment; raises DataError for an unknown one."""
        known = name.replace("-", "_")
        if known not in self.names():
            raise DataError(f"experiment: '{name}' is not known; {did_you_mean(known, self.names())}")
        return experiment_function(known, f"experiment {known}")


def experiment_function(name: str, words: str) -> Callable[..., None]:
    """Function of the command `rotorsim WORDS` of an experiment: an option for each parameter, then the common ones."""
    from rotorsim.experiments.experiment import EXPERIMENTS, parameters

    kind = EXPERIMENTS[name]
    setup: Any = ClosedLoopSetup if name == "controlled" else kind
    files = FILES.get(name, {})
    entries = list(parameters(setup))

    def command(**values: Any) -> None:
        given = {entry.name: read(entry.name, values.pop(entry.name), known) for entry, known in entries}
        given |= {key: values.pop(key) for key in files}
        run_experiment(kind, setup, {key: value for key, value in given.items() if value is not None}, **values)

    table = {"machine": (options.MachineName, "dtu_gas_bearing")}
    table |= {entry.name: option(entry, known) for entry, known in entries} | files | COMMON
    command.__doc__ = (kind.__doc__ or "").splitlines()[0]
    line = f"rotorsim {words} dtu_gas_bearing {kind.example}"
    return example(line, kind.python or python_call(kind, entries))(with_options(command, table))


def python_call(kind: type[Experiment], entries: list[tuple[Field[Any], Quantity]]) -> str:
    """Call of an experiment's function with the values of its example, SI."""
    words, known = split(kind.example), {entry.name: quantity for entry, quantity in entries}
    given = {word[2:].replace("-", "_"): text for word, text in zip(words[::2], words[1::2], strict=True)}
    values = (f"{key}={_literal(text, known.get(key))}" for key, text in given.items())
    return f"rs.experiments.{kind.name}(plant, {', '.join(values)})"


def _literal(text: str, known: Quantity | None) -> str:
    """Value of an option as Python reads it; those that are no parameters are whole numbers."""
    if known is None:
        return text
    return repr(text) if known.choices else f"{parse(text, known.unit):.6g}"


def option(entry: Field[Any], known: Quantity) -> tuple[Any, Any]:
    """Annotation and default text of a parameter's option."""
    hint = f" One of {', '.join(known.choices)}." if known.choices else ""
    name = f"--{entry.name.replace('_', '-')}"
    default: Any = entry.default
    if default is None:
        return Annotated[str | None, typer.Option(name, help=known.doc + hint)], None
    shown = str(default) if known.choices or not isinstance(default, int | float) else show(default, known.unit)
    if entry.name == OF_FILM:  # whether it was given must be seen
        return Annotated[
            str | None, typer.Option(name, help=known.doc + hint, show_default=f"{shown}, {options.FED}")
        ], None
    return Annotated[str, typer.Option(name, help=known.doc + hint)], shown


def read(name: str, text: str | None, known: Quantity) -> Any:
    """Value of an option's text."""
    if text is None or known.choices:
        return text
    return options.quantity(name.replace("_", "-"), text, known.unit, known.suggestion)


def run_experiment(
    kind: type[Experiment], setup: Any, given: dict[str, Any], machine: str, settings: options.PlantOptions, seed: str,
    result: options.ResultOptions,
) -> None:  # fmt: skip
    """Run an experiment, write its record and page, and print its table.

    `setup` is what the options make: the experiment, or an object with a method `experiment(plant)` that returns it.
    """
    result.check()
    number = read_seed(seed)
    plant = settings.plant(machine)
    if not kind.drives_reference:  # those that do are refused as a whole without a film
        _check_film(plant, given.get(OF_FILM), settings.grid)
        options.note_unfed(plant.machine, bool(given.get(OF_FILM)))
    from rotorsim.experiments.experiment import ask_speeds
    from rotorsim.experiments.running import record

    chosen = setup(**given, Ts=plant.machine.sampling_time)
    ask_speeds(plant.machine, chosen)
    with result.folder(kind.name, f"{kind.name}.nc", page=kind.page or f"{kind.name}.html") as folder:
        path = folder.add("record", f"{kind.name}.nc")
        options.note_compiling(plant.assembly, "settle", "run")
        experiment = chosen.experiment(plant) if hasattr(chosen, "experiment") else chosen
        outcome = record(plant, experiment, path, number, progress=not result.as_json)
        options.leave_if_empty(outcome, path)
        with options.reporting_kept_samples(path):
            _report(path, folder, plant, experiment, outcome)
    options.leave_if_cut(outcome, path)
    done()


def _check_film(plant: Plant, pressure: float | None, grid: str | None) -> None:
    """Raise DataError for an option of the gas film of a machine that has none; no pressure is accepted."""
    for option, given in (("pressure", bool(pressure)), ("grid", grid is not None)):
        if given and plant.machine.film is None:
            raise DataError(f"--{option}: {plant.machine.name} has no gas film; leave the option out")


def read_seed(text: str) -> int:
    """Seed from an option's text; raises DataError."""
    if not text.isdecimal() or len(text) > 16:
        raise DataError(f"--seed: '{text[:30]}' is not a whole number from 0 to 2^53 - 1; give e.g. --seed 1")
    return int(text)


def _report(path: Path, folder: ResultFolder, plant: Plant, experiment: Experiment, outcome: Outcome) -> None:
    """Write the page of a record and print its results as a table or as JSON."""
    from rotorsim.analysis.shaft_motion import passed_too_fast
    from rotorsim.experiments.recording import add_attribute
    from rotorsim.experiments.running import FAST
    from rotorsim.experiments.summary import summarise_experiment
    from rotorsim.report.page import write_page
    from rotorsim.report.record import results as swept_rows, run_page
    from rotorsim.report.run import analyse
    from rotorsim.report.units import unit_system
    from rotorsim.signals.record_blocks import open_record

    data = open_record(path)
    if experiment.swept and outcome.error is None and (text := passed_too_fast(plant, data, experiment.initial()[1])):
        data.close()
        add_attribute(path, FAST, text)
        data = open_record(path)
    with data:
        summary = summarise_experiment(data)
        rows = result_rows(summary) + experiment.table(summary)
        rows += [("Beyond the checked range", text) for text in summary.get("beyond_checked_range", ())]
        rows += [("Passed too fast", summary[FAST])] if FAST in summary else []
        run = analyse(data) if experiment.swept or folder.options.report else None
        if run is not None and experiment.swept:
            del summary["largest_orbit_um"]  # that of the run is measured from the moving mean
            summary |= run.summary
            with unit_system("metric"):  # the page may be in others, the terminal is not
                rows = _merged(swept_rows(run), rows)
        if run is not None and folder.options.report:
            folder.write_page(partial(write_page, partial(run_page, run)))
    numbers = {"parameters": experiment.attrs(), "ended": outcome.ended, "solver": outcome.counters}
    folder.options.show(summary | numbers, rows, folder.files)


def result_rows(summary: dict[str, Any]) -> Rows:
    """Labels and values of the results that every experiment has; `summary` as from `summarise_experiment`."""
    from rotorsim.experiments.experiment import pair
    from rotorsim.signals.record_blocks import shown_reading

    speed, disc = summary["speed_rpm"], summary["disc"]
    rows = [
        ("Duration", f"{summary['duration_s']:.4g} s, {summary['samples']} samples"),
        ("Speed", f"{round(speed['first'])} to {round(speed['last'])} rpm"),
        ("Disc x, y: mean", pair(disc["mean_um"], "µm")),
        ("Disc x, y: rms about the mean", pair(disc["rms_um"], "µm")),
        ("Disc x, y: peak from the mean", pair(disc["peak_um"], "µm")),
        ("Largest distance of the disc from its mean", f"{summary['largest_orbit_um']:.3g} µm"),
    ]
    if summary["smallest_film_um"] is not None:
        rows.append(("Smallest film thickness", f"{summary['smallest_film_um']:.3g} µm"))
        rows.append(("Contact", f"{summary['contact_samples']} samples" if summary["contact_samples"] else "none"))
    for key, label, unit in (("reference_peak_v", "Reference x, y: peak", "V"), ("force_peak_n", "Force: peak", "N")):
        if summary[key] and any(summary[key]):
            rows.append((label, pair(summary[key], unit)))
    for name, p in summary.get("probes", {}).items():
        text = f"{shown_reading(p['peak'], p['unit'])}, {shown_reading(p['rms'], p['unit'])}"
        rows.append((f"Probe {name}: peak, rms about the mean", text))
    return rows


def _merged(swept: Rows, rows: Rows) -> Rows:
    """Duration, the rows of a run over the speed, and those of every experiment that these do not have already."""
    labels = {label for label, _ in swept}
    others = (row for row in rows[1:] if row[0] not in labels and not row[0].startswith("Probe "))
    return [rows[0], *swept, *others]
