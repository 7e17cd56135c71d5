"""User-defined effects as candidates of a diagnosis, by import or from an installed package."""

import json
import os
import subprocess
import sys

from rotorsim.machine import load_machine

MODULE = '''
"""Pull of a belt on the shaft."""
from dataclasses import dataclass

from reynolds.jit import inlined
from rotorsim.effects import Effect, param, register


@inlined
def belt(t, angle, speed, acceleration, p):
    return p.pull, 0.0


@register
@dataclass(frozen=True)
class Belt(Effect):
    """Pull of a belt at the left end."""

    name, port, kernel, place = "belt", "force", belt, "start"
    pull: float = param("N", bounds=(0.0, 100.0), doc="Force towards x.")
'''
ASK = """
import json
from rotorsim.effects import REGISTRY
from rotorsim.machine import load_machine
if "belt" not in REGISTRY:
    print(json.dumps({}))
    raise SystemExit
from fmu.model import PlantUnit
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.twin import Twin
from rotorsim.live.settings import equip, sliders
from rotorsim.machine.catalogue import catalogue
from rotorsim.plant import Plant
machine = load_machine("plain_rotor").replace("effects.belt.pull", "5 N")
print(json.dumps({
    "machine file": machine.effects["belt"][0].pull,
    "catalogue": [e["title"] for e in catalogue() if e["name"] == "belt"],
    "diagnosis": [(f.label, f.parameters[0].low) for f in candidates(Twin(load_machine("plain_rotor")), ["belt"])],
    "live rig": [(key, s.low, s.high) for key, s in sliders(equip(machine)).items() if key.startswith("belt.")],
    "unit": [(v.name, v.start) for v in PlantUnit(Plant(machine), 0.0, 0.0).variables if "belt" in v.name],
}))
"""


def interpreter(folder, *words, entry=True, source=MODULE):
    """A fresh interpreter with a package that has an effect, as pip leaves it."""
    (folder / "belt_effect.py").write_text(source)
    about = folder / "belt_effect-1.0.dist-info"
    about.mkdir(exist_ok=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: belt-effect\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[rotorsim.effects]\nbelt = belt_effect\n" if entry else "")
    path = os.pathsep.join([str(folder), *filter(None, sys.path)])
    environment = {**os.environ, "PYTHONPATH": path}
    return subprocess.run([sys.executable, *words], env=environment, capture_output=True, text=True, check=False)


def installed(folder, **package):
    """The answer to `ASK` and the warnings."""
    done = interpreter(folder, "-c", ASK, **package)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr


def test_an_effect_of_an_installed_package_is_in_every_room_without_an_edit(tmp_path):
    found, warned = installed(tmp_path)
    assert not warned
    assert found == {
        "machine file": 5.0,
        "catalogue": ["Pull of a belt on the shaft."],
        "diagnosis": [["belt.pull", 0.0]],
        "live rig": [["belt.pull", 0.0, 100.0]],
        "unit": [["effects.belt.pull", 5.0]],
    }


def test_a_module_that_no_installed_package_declares_is_never_imported(tmp_path):
    assert installed(tmp_path, entry=False) == ({}, "")


def test_a_package_for_another_version_is_named_in_a_sentence_and_the_rest_works(tmp_path):
    """It imports a name that is not there: every command ended in a traceback."""
    found, warned = installed(tmp_path, source="from rotorsim.effects.base import gone\n")
    assert found == {}
    assert "effect 'belt' of the package belt-effect is left out (ImportError" in warned
    assert "update or uninstall the package" in warned


def test_the_command_line_says_the_sentence_alone(tmp_path):
    """It was a Python warning with path and source, and spoke of a circular import."""
    source = "from rotorsim.effects import Effect, gone\n"
    reason = "(ImportError: cannot import name 'gone' from 'rotorsim.effects')"
    left = f"effect 'belt' of the package belt-effect is left out {reason}; update or uninstall the package\n"
    machine = tmp_path / "belt.toml"
    machine.write_text(load_machine("plain_rotor").text + "\n[effects.belt]\npull = '5 N'\n")
    done = interpreter(tmp_path, "-m", "rotorsim", "machine", "show", str(machine), source=source)
    unknown = f"its package belt-effect could not be loaded {reason}; update or uninstall it\n"
    assert done.returncode == 2 and not done.stdout and done.stderr.startswith(left)
    assert done.stderr.endswith(f"effects.belt: {unknown}") and done.stderr.count("\n") == 2
    done = interpreter(tmp_path, "-m", "rotorsim", "machine", "effects", "belt", source=source)
    assert done.stderr == f"{left}belt: {unknown}"
