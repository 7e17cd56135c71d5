"""Completeness of the table of commands: every command that writes files is fault-tested."""

import typer

from fault_injection.commands import COMMANDS, ELSEWHERE, LIKE, SILENT, leaves, writes
from rotorsim.commands.registry import app

FOUND = dict(leaves(typer.main.get_command(app)))
TABLE = {one.words for one in COMMANDS} | set(ELSEWHERE)


def stands_for(words):
    """The command that is in the table for one of a group whose commands are one function."""
    return LIKE.get(words[:-1], words)


def test_every_command_is_in_a_table():
    missing = [" ".join(words) for words in FOUND if stands_for(words) not in TABLE and words not in SILENT]
    assert not missing, f"add to fault_injection/commands.py: {', '.join(missing)}"


def test_a_command_with_a_file_to_write_is_disturbed():
    missing = [" ".join(words) for words, one in FOUND.items() if writes(one) and stands_for(words) not in TABLE]
    assert not missing, f"add to COMMANDS in fault_injection/commands.py: {', '.join(missing)}"


def test_no_command_of_the_tables_is_gone():
    assert not [words for words in TABLE | SILENT if words not in FOUND]
