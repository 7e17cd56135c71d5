"""Command group `rotorsim experiment`: its commands follow from the experiments, imported when one is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.base.sentences import did_you_mean
from rotorsim.commands.lazy_group import LazyGroup


class Experiments(LazyGroup):
    """Run one virtual test (PRBS, impact ...) and keep its record."""

    epilog = "Example: rotorsim experiment prbs dtu_gas_bearing --amplitude '1 V' --duration '10 s'"

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all experiments."""
        return list(_commands())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of one experiment; raises DataError for an unknown one."""
        known = _commands()
        name = cmd_name.replace("-", "_")
        if name not in known:
            raise DataError(f"experiment: '{cmd_name}' is not known; {did_you_mean(name, known)}")
        return known[name]


def _commands() -> Mapping[str, Any]:
    from rotorsim.commands.experiment.commands import COMMANDS

    return COMMANDS
