"""Verdicts of `diagnose` on records of ROSS (`ross_records.py`), as a table of truth and verdict.

    python studies/benchmarks/diagnose_ross.py RECORDS [CASE ...]

RECORDS is the folder that `ross_records.py` wrote; every case goes through files and the machine file of the rotor, as
a user's records do. A verdict is right if it names what is hidden, alone; `class` if a tie or class holds it; `unknown`
if it is unknown or partial; and wrong for any other name, also of a second effect, and for re-calibrated numbers where
an effect is hidden. The script ends with 1 on a wrong one.
"""

import argparse
import sys
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

from rotorsim.discrepancy import Diagnosis, diagnose
from rotorsim.machine import Machine, load_machine

DAMPING = 0.02
TRUTH = {
    "sound": (), "two_planes": (), "bow": ("shaft_bow",), "coupling": ("coupling",), "crack": ("crack",),
    "rub": ("rub",),
}  # fmt: skip
"""Effects by the beginning of a case's name. A second plane of unbalance is seen at the disc as one."""
FIRST = ("right", "class", "unknown", "wrong")


def machine(case: str) -> Machine:
    """The plain rotor with a shaft that is damped more; where it rubs, without weight."""
    plain = load_machine("plain_rotor").replace("shaft.damping_ratio", DAMPING)
    return plain.replace("effects.gravity.acceleration", "0 m/s^2") if case.startswith("rub") else plain


def truth(case: str) -> tuple[str, ...]:
    """Effects hidden in a case."""
    return next(effects for name, effects in TRUTH.items() if case.startswith(name))


def verdict(hidden: Sequence[str], found: Diagnosis) -> str:
    """right, class, unknown or wrong; raises ValueError for a status that no diagnosis has."""
    if found.status in ("unknown", "partial", "discovered", "stochastic"):
        return "unknown"
    if found.status == "no_disagreement":
        return "unknown" if hidden else "right"
    if found.status == "recalibrated":
        return "wrong" if hidden else "right"
    if found.status not in ("named", "tie"):
        raise ValueError(f"status {found.status!r} of a diagnosis is not known here")
    proposed = [tuple(sorted(f.effect for f in found.effects))]
    proposed += [tuple(sorted(key.split(".")[0] for key in keys)) for keys in found.ties]
    alike = {key.split(".")[0] for f in found.effects for key in f.tie_class} if len(found.effects) == 1 else set()
    if proposed[0] == tuple(hidden) and found.status == "named":
        return "right"
    return "class" if hidden and (tuple(hidden) in proposed or set(hidden) <= alike) else "wrong"


def main() -> int:
    """Diagnose each case and print a row of the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("records", type=Path, help="folder that ross_records.py wrote")
    parser.add_argument("case", nargs="*", help="folder in it; all when not given")
    asked = parser.parse_args()
    folder = asked.records
    cases = asked.case or (sorted(p.name for p in folder.iterdir() if p.is_dir()) if folder.is_dir() else [])
    if not cases or not all((folder / case).is_dir() for case in cases):
        parser.error(f"{folder} has no such folders of records; make them with ross_records.py")
    warnings.filterwarnings("ignore")
    verdicts = []
    print("| case | hidden | status | effects | ties | verdict | seconds |\n|---|---|---|---|---|---|---|")
    for case in cases:
        own = {role: sorted((folder / case).glob(f"{role}_*.csv")) for role in ("fit", "held_out", "untouched")}
        begin = time.perf_counter()
        found = diagnose(machine(case), own["fit"], own["held_out"], own["untouched"])
        verdicts.append(verdict(truth(case), found))
        effects = ", ".join(
            f"{f.form} ({'; '.join(f'{p} {value}' + (f' +- {sd}' if sd else '') for p, value, sd in f.sizes())})"
            for f in found.effects
        )
        ties = ", ".join(" with ".join(keys) for keys in found.ties)
        alike = ", ".join(k for f in found.effects for k in f.tie_class if k != f.form)
        cells = (case, " ".join(truth(case)) or "-", found.status, effects, f"{ties} {alike}".strip(), verdicts[-1],
                 f"{time.perf_counter() - begin:.0f}")  # fmt: skip
        print(f"| {' | '.join(cells)} |", flush=True)
        for note in found.notes:
            print(f"  {note}", file=sys.stderr, flush=True)
    print("\n" + ", ".join(f"{verdicts.count(v)} {v}" for v in FIRST) + f" of {len(verdicts)}")
    return int("wrong" in verdicts)


if __name__ == "__main__":
    sys.exit(main())
