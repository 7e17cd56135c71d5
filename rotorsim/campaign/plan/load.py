"""Plans by name or path: those that come with rotorsim, and plan files."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from rotorsim.base.file_kinds import instead
from rotorsim.campaign.errors import PlanError
from rotorsim.campaign.plan.parse import make_plan
from rotorsim.campaign.plan.plan import Plan
from rotorsim.campaign.plan.plan_file import read_plan


def shipped_plans() -> tuple[str, ...]:
    """Names of the plans that come with rotorsim.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.campaign.shipped_plans()
    ('thesis',)
    """
    folder = files("rotorsim.campaign") / "plans"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def load_plan(name_or_path: str | Path) -> Plan:
    """Shipped plan by name or plan file by path; machine files are searched in the same folder.

    Raises
    ------
    PlanError
        One sentence that names the field, the value and the way out.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.campaign.load_plan("thesis")) > 0
    True
    """
    name = str(name_or_path)
    if name in shipped_plans():
        text = (files("rotorsim.campaign") / "plans" / f"{name}.toml").read_text(encoding="utf-8")
        return make_plan(text)
    if not Path(name).exists():
        known = ", ".join(shipped_plans())
        raise PlanError(f"'{name}' is neither a shipped plan ({known}) nor a file; give one of these or a path")
    try:
        return make_plan(read_plan(Path(name)), Path(name).parent)
    except PlanError as error:
        ours = instead(name, "a plan", "a plan of a campaign")
        raise PlanError(f"{name}: {ours}; give a plan" if ours else f"{name}: {error}") from error
