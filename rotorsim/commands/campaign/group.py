"""Command group `rotorsim campaign`, which takes a plan as its first word too."""

from __future__ import annotations

from typing import Any, ClassVar

from rotorsim.commands.lazy_group import LazyGroup

USAGE = "rotorsim campaign PLAN --out DIR [OPTIONS] | status DIR | retry DIR | collect DIR | check PLAN"


class Campaign(LazyGroup):
    """Run many experiments by a plan, on all cores or a cluster."""

    epilog = "Example: rotorsim campaign thesis --out my_campaign; rotorsim campaign status my_campaign"
    places: ClassVar = {
        "run": "campaign.commands.run_plan",
        "retry": "campaign.commands.retry",
        "status": "campaign.commands.status",
        "collect": "campaign.commands.collect",
        "check": "campaign.commands.check",
    }

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put `run` before a plan."""
        if args and args[0] not in self.commands and args[0] not in ("-h", "--help"):
            args = ["run", *args]
        rest: list[str] = super().parse_args(ctx, args)
        return rest

    def format_usage(self, ctx: Any, formatter: Any) -> None:
        """Show both forms."""
        formatter.write_usage("", USAGE)
