"""`rotorsim --version`."""

from importlib.metadata import version


def test_the_version_is_one_line_with_the_name(run):
    assert run("--version") == (0, f"rotorsim {version('rotorsim')}\n", "")
