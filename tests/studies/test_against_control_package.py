"""Own numerics of designs give what the package `control` gives, with slycot also truncation and H-infinity."""

import numpy as np
import pytest

pytest.importorskip("control")

from studies.benchmarks import control_package

ALONE = [name for name in control_package.USED if name not in control_package.Tasks.needs_slycot]


@pytest.fixture(scope="module")
def tasks():
    return control_package.Tasks()


def deviation(tasks, name):
    """Largest deviation relative to the largest value."""
    own, library = (np.asarray(job()) for job in getattr(tasks, name)())
    return np.abs(own - library).max() / np.abs(library).max()


@pytest.mark.parametrize("name", ALONE)
def test_the_package_gives_the_same(tasks, name):
    assert deviation(tasks, name) < 1e-8


@pytest.mark.parametrize("name", control_package.Tasks.needs_slycot)
def test_slycot_gives_the_same(tasks, name):
    """Both searches for gamma end within 1e-6."""
    pytest.importorskip("slycot")
    assert deviation(tasks, name) < control_package.BOUNDS.get(name, 1e-8)


def test_the_table_has_a_decision_for_every_task(monkeypatch):
    monkeypatch.setattr(control_package, "USED", {"poles": control_package.USED["poles"]})
    monkeypatch.setattr(control_package, "REPEATS", 1)
    lines = control_package.markdown(control_package.compared()).splitlines()
    assert len(lines) == 3 and lines[-1].startswith("| poles | ") and lines[-1].endswith("three systems |")


def test_no_file_of_the_packages_imports_slycot():
    """It is under the GPL: an extra of the tests alone."""
    from pathlib import Path

    root = Path(control_package.__file__).parents[2]
    folders = ("reynolds", "fe_shaft", "identification", "rotorsim", "fmu")
    texts = [path.read_text(encoding="utf-8") for name in folders for path in (root / name).rglob("*.py")]
    assert not [text for text in texts if "import slycot" in text]
