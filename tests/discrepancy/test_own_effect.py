"""User-defined effects as candidates of a diagnosis, by import or from an installed package."""

import os
import subprocess
import sys

MODULE = '''
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
from rotorsim.effects.base import forms_of_parameters
from rotorsim.effects import REGISTRY
print([(r.parameter, r.signed) for r in forms_of_parameters(REGISTRY["belt"])] if "belt" in REGISTRY else "not there")
"""


def installed(folder, entry=True):
    """A package with an effect, as pip leaves it; the answer of a fresh interpreter."""
    (folder / "belt_effect.py").write_text(MODULE)
    about = folder / "belt_effect-1.0.dist-info"
    about.mkdir(exist_ok=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: belt-effect\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[rotorsim.effects]\nbelt = belt_effect\n" if entry else "")
    path = os.pathsep.join([str(folder), *filter(None, sys.path)])
    done = subprocess.run(
        [sys.executable, "-c", ASK], env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_an_effect_of_an_installed_package_is_known_to_every_command(tmp_path):
    assert installed(tmp_path) == "[('pull', False)]"


def test_a_module_that_no_installed_package_declares_is_never_imported(tmp_path):
    assert installed(tmp_path, entry=False) == "not there"
