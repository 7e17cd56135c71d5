"""Generated module of a machine: atomic write, and a full cache folder."""

import inspect
from pathlib import Path

import pytest

import rotorsim as rs
from fuzzing.disk import largest_file
from rotorsim.base.files import _node
from rotorsim.effects.sensors import sensor_delay
from rotorsim.plant import Plant
from rotorsim.plant.calls import load_module
from rotorsim.plant.compose import KernelModule

TEXT = "number = 1\n" + "# \n" * 1000


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """Cache and folder for temporary files."""
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    return tmp_path / "cache" / "plants", tmp_path / "temporary"


def test_a_module_is_written_whole_and_what_a_killed_process_left_is_removed(folders):
    folders[0].mkdir(parents=True)
    (folders[0] / f".made_here.py.{_node()}-999999999-0.part").touch()
    assert load_module("made_here", lambda: TEXT).number == 1
    assert [path.name for path in folders[0].iterdir() if path.is_file()] == ["made_here.py"]


def test_a_cache_that_takes_no_more_is_no_error(folders, monkeypatch):
    """It ended a command in "no space left on device"."""
    from rotorsim.plant import calls

    write = calls.write_text

    def full(path, text):
        if path.parent == folders[0]:
            with largest_file(100):
                write(path, text)
        write(path, text)

    monkeypatch.setattr(calls, "write_text", full)
    module = load_module("made_there", lambda: TEXT)
    assert module.number == 1 and folders[1] in Path(module.__file__).parents


def test_a_composed_module_has_the_functions_of_the_protocol():
    module = Plant("plain_rotor").assembly.module
    for name, declared in inspect.getmembers(KernelModule, inspect.isfunction):
        if not name.startswith("_"):
            own = getattr(module, name)
            takes = list(inspect.signature(getattr(own, "py_func", own)).parameters)
            assert ["self", *takes] == list(inspect.signature(declared).parameters), name


def test_machine_code_follows_a_number_that_a_kernel_takes_from_another_file(folders, monkeypatch):
    """The length of the ring is compiled in, and its file is none of the plant's."""
    machine = rs.load_machine("plain_rotor").replace("effects.sensor_delay.delay", "1 ms")
    before = rs.Plant(machine).assembly.module.__name__
    monkeypatch.setattr(sensor_delay, "LENGTH", 128)
    assert rs.Plant(machine).assembly.module.__name__ != before
