"""Reads and finds plan files, by their endings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from actionlib_core.inputs.checked_file import read_limited
from smachpy.exceptions import did_you_mean
from smachpy.pnp.pnml import LARGEST_FILE, read_pnml
from smachpy.pnp.problems import PlanError, PlanProblem, raise_errors
from smachpy.pnp.text import parse_rules, plan_of_pddl, read_plan_text, unmatched

if TYPE_CHECKING:
    from smachpy.pnp.net import Net

PLANS: Final = (".pnml", ".plan", ".pddlout")


def read_net(file: Path | str) -> tuple[Net, tuple[PlanProblem, ...]]:
    """Read a plan in any form.

    Returns:
        The net, and the warnings about the file.

    Raises:
        PlanError: the file cannot be read, or is not a plan; all problems at once.
    """
    path = Path(file)
    if path.suffix not in PLANS[1:]:
        return read_pnml(path)
    # Execution rules only exist for text forms; a net has its interrupts as transitions.
    beside = path.with_suffix(".er")
    rules = parse_rules(_text(beside), file=str(beside)) if beside.is_file() else ()
    text = _text(path)
    if path.suffix == ".pddlout":
        text = plan_of_pddl(text, str(file))
    net, actions = read_plan_text(text, rules, path.name.partition(".")[0], str(file))
    found = [
        PlanProblem(
            "comment",
            "warning",
            f"{rule.ignored!r} is ignored, as in PNP's generators.",
            f"rule for {rule.action!r}",
            str(beside),
            rule.line,
        )
        for rule in rules
        if rule.ignored
    ]
    return net, (*found, *unmatched(rules, actions, str(beside)))


def find_plan(folder: Path | str, name: str) -> Path | None:
    """Return the file of the plan with this name in a folder, or None."""
    # The name comes from a label: it may be too long for a file, or have a null character.
    try:
        files = (Path(folder) / f"{name}{end}" for end in PLANS)
        return next((file for file in files if file.is_file()), None)
    except (OSError, ValueError):
        return None


def plan_file(folder: Path | str, name: str) -> Path:
    """Return the file of the plan with this name in a folder.

    Raises:
        PlanError: there is no such plan.
    """
    found = find_plan(folder, name)
    if found is None:
        known = sorted(f.stem for f in Path(folder).glob("*") if f.suffix in PLANS)
        text = f"no such plan; expected one of {known}.{did_you_mean(name, known)}"
        raise PlanError([PlanProblem("file", "error", text, f"plan {name!r}", str(folder))])
    return found


def _text(path: Path) -> str:
    try:
        return read_limited(path, LARGEST_FILE).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "is not UTF-8"
        raise_errors([PlanProblem("file", "error", f"{why}; expected a plan.", "", str(path))])
        raise
