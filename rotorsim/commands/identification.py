"""`rotorsim identify` and `rotorsim study`: models from records, without a machine file, and held against the physics.

Records at one operating point give a linear model, records at several a parameter-varying one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Column

from rotorsim.base.display import counter, told_apart
from rotorsim.base.errors import DataError
from rotorsim.base.files import replacing_all, write_json
from rotorsim.commands import options
from rotorsim.commands.registry import CommandGroup, command, group
from rotorsim.commands.results import files, refuse_campaign, study as study_folder

if TYPE_CHECKING:
    from identification import Prefilter
    from identification.campaign import SourceResult
    from rotorsim.study.identify_records import StudyGrid

RESULTS = ("model.json", "model_2.json", "report.html", "study.json")
"""Files in the folder; where the last is, the others are complete."""


@command(
    "identify", "rotorsim identify records --model 3 --out model.json", "rs.identify_records(['records'], model=3)"
)
def identify(
    paths: Annotated[list[Path], typer.Argument(metavar="PATHS", help="Folder of records, or files.")],
    model: Annotated[str, typer.Option(help="1, 2, 2-rate, 3, actuator or blackbox.")] = "3",
    order: Annotated[int | None, typer.Option(help="Order of a black-box model; 6 if not given.")] = None,
    method: Annotated[str, typer.Option(help="auto, oe, two-stage (closed loop) or pem.")] = "auto",
    surfaces: Annotated[str, typer.Option(help="Degree over speed and pressure, or hold-out.")] = "2",
    refine: Annotated[str, typer.Option(help="Refinement of the surfaces: none, frequency or global.")] = "none",
    dead_time: Annotated[str, typer.Option(help="Dead time of model 3: free, 0, or e.g. '0.8 ms'.")] = "free",
    runout: Annotated[str, typer.Option(help="Runout filter: harmonic, table or none.")] = "harmonic",
    median: Annotated[int, typer.Option(help="Samples of a running median against spikes.")] = 1,
    lowpass: Annotated[str, typer.Option(help="Corner of a Butterworth filter, e.g. '800 Hz'.")] = "",
    probes: Annotated[str, typer.Option(help="Probes of one plane as outputs, e.g. 'DE_x,DE_y'.")] = "",
    mapping: Annotated[Path | None, typer.Option(help="TOML file: which column is which.")] = None,
    out: Annotated[Path, typer.Option(help="Model file (JSON) to write.")] = Path("model.json"),
    force: Annotated[bool, typer.Option("--force", help="Replace the model file if it is there.")] = False,
    jobs: Annotated[int, typer.Option(help="Records identified at a time.")] = 2,
    advice: Annotated[bool, typer.Option("--advice", help="Propose order, delay and model, and fit nothing.")] = False,
    compare: Annotated[
        list[Path] | None, typer.Option(help="Model file to hold against the records; fits nothing.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Identify a grey-box, black-box or LPV model from records.

    Records at several operating points give an LPV model.
    """
    from identification import Prefilter
    from identification.local.fits import FREE

    _check(surfaces, refine, runout, median)
    corner = options.quantity("lowpass", lowpass, "Hz") if lowpass else None
    outputs = tuple(name.strip() for name in probes.split(",")) if probes else ()
    settings = Prefilter(runout=runout, median=median, lowpass=corner, probes=outputs)
    if advice or compare:
        if advice and compare:
            raise DataError("--advice and --compare: one at a time")
        if advice:
            print_advice(paths, settings, mapping, as_json)
        else:
            print_comparison(paths, compare or [], settings, mapping, as_json)
        return
    dead = (
        dead_time if dead_time == FREE else 0.0 if dead_time == "0" else options.quantity("dead-time", dead_time, "s")
    )
    degree = int(surfaces) if surfaces.isdecimal() else surfaces
    shown = partial(counter, things="records")
    from rotorsim.study.identify_records import identify_records

    with files(out, force=force):
        made, found = identify_records(
            paths, model, order, method, settings, mapping, degree, refine, jobs, shown, dead
        )
        made.save(out)
    _print_models(found, made, out, as_json)


def _check(surfaces: str, refine: str, runout: str, median: int) -> None:
    """Refuse what would be refused after minutes of work."""
    from identification.lpv_fit import ORDERS, REFINEMENTS
    from identification.records.sensors import KINDS

    degrees = (*map(str, ORDERS), "hold-out")
    for option, value, known in (
        ("surfaces", surfaces, degrees),
        ("refine", refine, REFINEMENTS),
        ("runout", runout, (*KINDS, "none")),
    ):
        if value not in known:
            raise DataError(f"--{option}: '{value}' is not known; choose one of {', '.join(known)}")
    if median < 1 or median % 2 == 0:
        raise DataError(f"--median: {median} samples; give an odd number, 1 for no filter")


def _print_models(found: list[SourceResult], made: Any, out: Path, as_json: bool) -> None:
    rows = [_row(one, name) for one, name in zip(found, told_apart([one.source.path for one in found]), strict=True)]
    if as_json:
        options.print_json({"model": str(out), "kind": type(made).__name__, "records": rows})
        return
    console = options.Console()
    heads = (
        Column("record", no_wrap=True),
        "rpm",
        "MPa",
        "fit %",
        "black box %",
        "ceiling %",
        "Hz",
        "zeta",
        "delay ms",
    )
    options.print_rows(heads, [_cells(row) for row in rows if "error" not in row])
    if len(found) == 1 and found[0].result is not None:  # its report has its warnings
        console.print(found[0].result.report(), soft_wrap=True)
    else:
        for row in rows:
            for text in [row["error"]] if "error" in row else row["warnings"]:
                console.print(f"{row['record']}: {text}" if "error" not in row else text, soft_wrap=True)
    console.print(f"{out}: {type(made).__name__} written", soft_wrap=True)


def _row(one: SourceResult, name: str) -> dict[str, Any]:
    if one.result is None:
        return {"record": name, "error": one.error}
    from identification.local.models import plain

    r = one.result
    numbers = {"speed": r.speed, "pressure": r.pressure, "fit": r.fit, "ceiling": r.ceiling, "wn": r.wn,
               "zeta": r.zeta, "delay": r.delay, "static_gain": r.static_gain, "parameters": r.parameters,
               "black_box_fit": one.black_box_fit, "noise_free_fit": r.noise_free_fit, "seconds": r.seconds,
               "dead_time": r.dead_time,
               "intervals": [asdict(one) | {"low": one.low, "high": one.high} for one in r.intervals]}  # fmt: skip
    return {"record": name, "warnings": list(r.warnings), "notes": list(r.notes)} | {
        key: plain(value) for key, value in numbers.items()
    }


def _cells(row: dict[str, Any]) -> list[str]:
    def several(values: Any, form: str, scale: float) -> str:
        return ", ".join("-" if value is None else format(value * scale, form) for value in values)

    return [
        row["record"], several([row["speed"]], ".0f", 9.549297), several([row["pressure"]], ".3f", 1e-6),
        several(row["fit"], ".1f", 100), several(row["black_box_fit"] or (), ".1f", 100),
        several(row["ceiling"], ".1f", 100), several(row["wn"], ".2f", 0.1591549),
        several(row["zeta"], ".4f", 1), several(row["delay"], ".3f", 1e3),
    ]  # fmt: skip


def print_advice(paths: Sequence[Path], settings: Prefilter, mapping: Any, as_json: bool) -> None:
    """Print advice about each record that excites."""
    from identification import advise

    _print_each(paths, mapping, as_json, lambda record, steady: advise(record, steady, settings))


def print_comparison(
    paths: Sequence[Path], models: Sequence[Path], settings: Prefilter, mapping: Any, as_json: bool
) -> None:
    """Print how well model files agree with each record that excites."""
    from identification import compare_models, load_model

    names = [path.stem for path in models]
    if len(set(names)) < len(names):
        names = [str(path) for path in models]
    if len(set(names)) < len(names):
        raise DataError(f"--compare: {models[0]} or another model is given twice; give different models")
    loaded = {name: load_model(path) for name, path in zip(names, models, strict=True)}
    _print_each(paths, mapping, as_json, lambda record, steady: compare_models(loaded, record, steady, settings))


def _print_each(paths: Sequence[Path], mapping: Any, as_json: bool, make: Callable[[Any, Any], Any]) -> None:
    """Print what `make` finds of each record that excites, given it and the one without excitation."""
    from identification import open_pair
    from identification.campaign import NO_EXCITATION
    from rotorsim.base.errors import UnfitError
    from rotorsim.study.identify_records import sources_of

    sources = sources_of(paths, mapping)
    if not sources:
        raise UnfitError(f"{paths[0]}: {NO_EXCITATION}")
    names = told_apart([source.path for source in sources])
    found = [(name, make(*open_pair(source, mapping))) for name, source in zip(names, sources, strict=True)]
    if as_json:
        options.print_json({"records": [{"record": name, **_plain(one)} for name, one in found]})
        return
    for name, one in found:
        typer.echo(f"{name}\n{one.report()}")


def _plain(value: Any) -> dict[str, Any]:
    """Fields of a dataclass, of those in it too, for JSON."""
    from identification.local.models import plain

    content = {field.name: getattr(value, field.name) for field in fields(value)}
    rows = content.get("rows")
    return plain(content | ({} if rows is None else {"rows": [_plain(row) for row in rows]}))


@group("study", "Example: rotorsim study identification-vs-physics --out study")
class Studies(CommandGroup):
    """Studies of identification against physics on a virtual rig."""


@command(
    "study identification-vs-physics",
    "rotorsim study identification-vs-physics dtu_gas_bearing --out study --quick",
    "rs.study.study(plant, rs.study.sources_of(['study']))",
)
@options.resumable
def identification_vs_physics(
    machine: options.MachineName = "dtu_gas_bearing",
    out: options.StudyFolder = Path("study"),
    campaign: Annotated[
        list[Path] | None, typer.Option(help="Folder of a campaign of this machine to use; may be repeated.")
    ] = None,
    speed: Annotated[str | None, typer.Option(help="Speeds, e.g. '0 rpm:6000 rpm:7'.")] = None,
    pressure: Annotated[str | None, typer.Option(help="Gauge supply pressures, likewise.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A grid of 3 x 3 points only.")] = False,
    *,
    page: options.PageOptions,
    surfaces: Annotated[int, typer.Option(help="Degree of the surfaces.")] = 2,
    jobs: options.Jobs = 2,
    as_json: options.AsJson = False,
) -> None:
    """Simulate a campaign, identify models from its records alone and hold them against the linearised physics.

    The records are campaigns below --out; they are kept, and the same command continues with them.
    """
    page.check()
    refuse_campaign(out)
    plant, layout = options.plant_of(machine), _layout(quick, speed, pressure)
    from rotorsim.report.page import save_study_page
    from rotorsim.study.identification_vs_physics import HEADS, rows, study, summary
    from rotorsim.study.identify_records import COUNTED, run, sources_of
    from rotorsim.study.pages import identification_blocks

    records = [str(folder.absolute()) for folder in campaign or []]
    inputs = {"kind": "identification", "machine": plant.machine.hash, "records": records, "surfaces": surfaces}
    with study_folder(out, inputs | {"grid": repr(layout)}):
        sources = sources_of(campaign or run(plant.machine, layout, out, jobs))
        total = sum(source.role in COUNTED for source in sources)
        found = study(plant, sources, jobs, surfaces, counter(total, "operating points"))
        numbers = {"errors": summary(found), "heads": HEADS, "rows": rows(found), "rows_model_2": rows(found, "2"),
                   "failed": found.failed}  # fmt: skip
        with replacing_all(out, RESULTS) as part:
            found.refined.save(part / "model.json")
            found.lpv_2.save(part / "model_2.json")
            text = f"{plant.machine.name}, virtual records only. This is a simulation."
            save_study_page(
                "Identification against physics", text, identification_blocks(found), part / "report.html", page.units
            )
            write_json(part / "study.json", numbers)
        page.finish(out / "report.html")
    if as_json:
        options.print_json({key: numbers[key] for key in ("errors", "failed")})
        return
    for model, errors in summary(found).items():
        typer.echo(f"{model} against the physics: " + ", ".join(f"{name} {v:.2g} %" for name, v in errors.items()))
    typer.echo(f"{out / 'report.html'}: report; {out / 'model.json'}: LPV model (Model 3), {out / 'model_2.json'}: "
               f"Model 2; {out / 'study.json'}: numbers")  # fmt: skip


def _layout(quick: bool, speed: str | None, pressure: str | None) -> StudyGrid:
    """Grid of operating points, with the speeds and pressures that are given instead of the usual ones."""
    from rotorsim.analysis.axes import read_axis
    from rotorsim.study.identify_records import QUICK, StudyGrid

    usual = QUICK if quick else StudyGrid()
    speeds = usual.speeds if speed is None else tuple(float(v) for v in read_axis("speed", speed, "rad/s"))
    pressures = usual.pressures if pressure is None else tuple(float(v) for v in read_axis("pressure", pressure, "Pa"))
    return StudyGrid(speeds, pressures)
