"""Short invocations of all commands that write files, and a list of those that write none."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

OUT = "results"
"""Folder of the results, below the folder in which a command runs."""
ROTOR, RIG = "plain_rotor", "{inputs}/rig.toml"


@dataclass(frozen=True)
class Command:
    """A command line and the files that it leaves in the folder `OUT`.

    Attributes
    ----------
    words : the command's name
    rest : its arguments; {inputs} is the folder of prepared files
    files : what it leaves; of a folder with an unknown number of files the patterns
    record : the record that grows while the command runs, if there is one
    compiles : whether it compiles kernels of the plant
    resumes : whether the same command continues with what an interrupted one has left
    kept : whether results that are there are never replaced, not even on demand
    code : exit code without a fault; 10 when a diagnosis names an effect
    """

    words: tuple[str, ...]
    rest: tuple[str, ...]
    files: tuple[str, ...]
    record: str = ""
    compiles: bool = True
    resumes: bool = False
    kept: bool = False
    code: int = 0
    label: str = ""

    @property
    def name(self) -> str:
        """Name in tables."""
        return " ".join((*self.words, self.label)).strip()

    def line(self, inputs: str) -> list[str]:
        """The command line."""
        return [*self.words, *(text.replace("{inputs}", inputs) for text in self.rest)]


COMMANDS = (
    Command(
        ("runup",), (ROTOR, "--stop", "4000 rpm", "--rate", "400 rpm/s", "--out", f"{OUT}/run"),
        ("run/runup.nc", "run/report.html"), record="run/runup.nc",
    ),
    Command(
        ("experiment", "steady"), (ROTOR, "--duration", "8 s", "--out", f"{OUT}/run"),
        ("run/steady.nc", "run/steady.html"), record="run/steady.nc",
    ),
    Command(
        ("experiment", "steady"), (ROTOR, "--duration", "1 s", "--figures", "csv", "--out", f"{OUT}/run"),
        ("run/steady.nc", "run/steady.html", "run/steady_spectra.csv"), record="run/steady.nc", label="figures",
    ),
    Command(
        ("map",), (ROTOR, "--speed", "100 rpm:200 rpm:2", "--pressure", "0 MPa", "--out", f"{OUT}/map"),
        ("map/map.nc", "map/report.html"),
    ),
    Command(
        ("sweep",), (ROTOR, "--over", "speed=100 rpm:200 rpm:2", "--what", "frequency", "--workers", "1", "--out",
                     f"{OUT}/sweep"),
        ("sweep/sweep.nc", "sweep/sweep.csv", "sweep/report.html", "sweep/campaign/store.json",
         "sweep/campaign/plan.toml", "sweep/campaign/index.sqlite", "sweep/campaign/campaign.log"),
        resumes=True,
    ),
    Command(
        ("response",), (ROTOR, "--speeds", "100 rpm:300 rpm:3", "--unbalance", "10 g*mm", "--out", f"{OUT}/response"),
        ("response/response.nc", "response/response.csv", "response/report.html"),
    ),
    Command(
        ("campbell",), (ROTOR, "--speeds", "0 rpm:300 rpm:3", "--modes", "4", "--out", f"{OUT}/campbell"),
        ("campbell/campbell.nc", "campbell/campbell.csv", "campbell/report.html"),
    ),
    Command(("modes",), (ROTOR, "--no-pictures", "--out", f"{OUT}/modes"), ("modes/modes.nc",)),
    Command(
        ("campaign", "run"), ("{inputs}/plan.toml", "--workers", "1", "--out", f"{OUT}/store"),
        ("store/store.json", "store/plan.toml", "store/index.sqlite", "store/campaign.log", "store/cases/*/*.nc"),
        resumes=True,
    ),
    Command(
        ("campaign", "retry"), (f"{OUT}/store", "--workers", "1"),
        ("store/store.json", "store/plan.toml", "store/index.sqlite", "store/campaign.log", "store/cases/*/*.nc"),
        resumes=True,
    ),
    Command(("campaign", "collect"), ("{inputs}/store", "--out", f"{OUT}/all.nc"), ("all.nc",), compiles=False),
    Command(
        ("campaign", "collect"), ("{inputs}/store", "--out", f"{OUT}/all.csv"), ("all.csv",), compiles=False,
        label="table",
    ),
    Command(
        ("identify",), ("{inputs}/excited.nc", "--model", "blackbox", "--order", "4", "--out", f"{OUT}/model.json"),
        ("model.json",), compiles=False,
    ),
    Command(
        ("design",), ("p", "{inputs}/linear.json", "--report", "--out", f"{OUT}/p.json"), ("p.json", "p.html"),
        compiles=False,
    ),
    Command(
        ("verify",), ("{inputs}/law.json", RIG, "--quick", "--out", f"{OUT}/verification"),
        ("verification/table.json", "verification/report.html"), code=1,
    ),
    Command(("hide",), (ROTOR, "--out", f"{OUT}/hidden"), ("hidden/records/*.nc", "hidden/sealed/truth.json"),
            kept=True),
    Command(
        ("diagnose",), (ROTOR, "{inputs}/hidden/records", "--effect", "runout", "--out", f"{OUT}/diagnosis"),
        ("diagnosis/diagnosis.json", "diagnosis/gap.nc", "diagnosis/report.html", "diagnosis/report_data.npz"),
        resumes=True, code=10,
    ),
    Command(
        ("report", "diagnosis"), ("{inputs}/diagnosed", "--out", f"{OUT}/page.html"), ("page.html",), compiles=False
    ),
    Command(
        ("report", "tables"), ("{inputs}/sweep.nc", "--out", f"{OUT}/tables.xlsx"), ("tables.xlsx",), compiles=False
    ),
    Command(
        ("report", "design"), (ROTOR, "--speed", "1000 rpm", "--out", f"{OUT}/review"),
        ("review/requirements.csv", "review/criticals.csv", "review/unbalances.csv", "review/clearances.csv",
         "review/grades.csv", "review/zones.csv", "review/films.csv", "review/rules.csv", "review/report.html"),
    ),
    Command(
        ("optimise",), (ROTOR, "--over", "discs.0.mass=3.8 kg, 4 kg", "--objective", "critical_1", "--out",
                        f"{OUT}/best"),
        ("best/path.csv", "best/report.html"),
    ),
    Command(("report", "record"), ("{inputs}/sweep.nc", "--out", f"{OUT}/page.html"), ("page.html",), compiles=False),
    Command(
        ("balance",), ("bently_rk4", "{inputs}/vectors.csv", "--mapping", "{inputs}/vectors.toml",
                       "--out", f"{OUT}/balance"),
        ("balance/balance.json", "balance/unbalance.csv", "balance/report.html"), compiles=False,
    ),
    Command(("machine", "new"), (f"{OUT}/mine.toml", "--from", ROTOR), ("mine.toml",), compiles=False),
    Command(
        ("machine", "calibrate"), (RIG, "--targets", "{inputs}/targets.toml", "--passes", "2",
                                   "--out", f"{OUT}/calibrated.toml"),
        ("calibrated.toml",),
    ),
    Command(("data", "convert"), ("{inputs}/excited.nc", f"{OUT}/record.nc"), ("record.nc",), compiles=False),
    Command(
        ("data", "convert"), ("{inputs}/excited.nc", f"{OUT}/record.csv"), ("record.csv",), compiles=False,
        label="csv",
    ),
    Command(
        ("data", "convert"), ("{inputs}/excited.nc", f"{OUT}/record.mat"), ("record.mat",), compiles=False,
        label="mat",
    ),
    Command(
        ("compare",), ("{inputs}/sweep.nc", "{inputs}/excited.nc", "--out", f"{OUT}/compare"),
        ("compare/compare.json", "compare/report.html"), compiles=False,
    ),
    Command(
        ("data", "vectors"), ("{inputs}/sweep.nc", f"{OUT}/record.nc", "--turns", "1"), ("record.nc",), compiles=False
    ),
    Command(("data", "cut"), ("{inputs}/excited.nc", f"{OUT}/record.nc"), ("record.nc",), compiles=False),
    Command(
        ("data", "resample"), ("{inputs}/excited.nc", f"{OUT}/record.nc", "--rate", "1 kHz"), ("record.nc",),
        compiles=False,
    ),
    Command(("fmu", "export"), (ROTOR, "--out", f"{OUT}/rotor.fmu"), ("rotor.fmu",)),
    Command(("fmu", "export"), ("--law", "{inputs}/law.json", "--out", f"{OUT}/law.fmu"), ("law.fmu",), compiles=False,
            label="law"),
    Command(("fmu", "system"), ("{inputs}/law.json", RIG, "--out", f"{OUT}/loop.ssp"), ("loop.ssp",)),
)  # fmt: skip
"""A line for each format of a command."""
ELSEWHERE = {
    ("study", "identification-vs-physics"): "test_studies.py: a study takes minutes to hours",
    ("machine", "table"): "tests/machine/test_rotor_import.py: it changes one file in place",
    ("desk",): "tests/desk: it writes on what is typed in its page",
    ("live",): "test_recorder.py; it writes on a click in its page (tests/live)",
}
"""Commands that write and are disturbed in another file."""
SILENT = {
    ("campaign", "check"), ("campaign", "status"), ("data", "check"), ("data", "mapping"), ("fmu", "check"),
    ("fmu", "info"), ("machine", "check"), ("machine", "effects"), ("machine", "show"), ("warm",), ("cite",),
}  # fmt: skip
"""Commands that write no file outside the cache."""
LIKE = {("experiment",): ("experiment", "steady")}
"""Groups whose commands are one function: the command that stands for all."""


def leaves(group: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Words and click command of every command of a group."""
    for name in group.list_commands(None):
        one = group.get_command(None, name)
        if hasattr(one, "list_commands"):
            yield from leaves(one, (*words, name))
        else:
            yield (*words, name), one


def writes(command: Any) -> bool:
    """Whether a parameter names a file or folder to write."""
    return any(
        p.name in ("out", "keep") or "to write" in (getattr(p, "help", "") or "").lower() for p in command.params
    )
