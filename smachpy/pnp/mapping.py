"""The YAML file that maps the names of a plan's actions and conditions to code.

actions:
  goto:                                # goto_kitchen: a goal for move_base
    action: move_base
    type: move_base_msgs/MoveBase
    goal: {target_pose.header.frame_id: map, target_pose.pose.orientation.w: 1.0}
    cases:
      kitchen: {target_pose.pose.position.x: 4.0, target_pose.pose.position.y: 1.5}
    timeout: 60
  say: {run: "my_robot.speech:say"}     # a function, a state, or a class of states
conditions:
  low_battery: {topic: battery, type: std_msgs/Float32, when: "data < 20"}
  loaded: {userdata: "parcels > 0"}
  seen: {run: "my_robot.eyes:seen", every: 0.5}
strict: false
events: once
server: true      # or {action: ..., conditions: ..., robot: ...}: see `PNPServer`

`run:` imports a module, which runs code: whoever only looks at a plan reads the file without it.
"""

from __future__ import annotations

import importlib
import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, get_args

from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile, Limits
from actionlib_core.inputs.expression import WHOLE, ExpressionError
from smachpy.base.problems import unknown_name
from smachpy.exceptions import InvalidStateError
from smachpy.machines.state import State
from smachpy.pnp.actions import Function, Goal, Made, NotImported
from smachpy.pnp.knowledge import Events, Expression, Polled, TopicCondition
from smachpy.pnp.problems import PlanError, PlanProblem
from smachpy.pnp.server import PNPServer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actionlib_core.inputs.checked_file import Problem, Section


@dataclass(frozen=True)
class Registered:
    """The content of the file; the attributes are the arguments of `smachpy.pnp.load`."""

    actions: dict[str, Any] = field(default_factory=dict)
    conditions: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)

    def named(self) -> list[str]:
        """Return what `run:` names, "module:name", if the file was read without imports."""
        conditions = [getattr(one, "function", one) for one in self.conditions.values()]
        found = [*self.actions.values(), *conditions]
        return [one.name for one in found if isinstance(one, NotImported)]


_SERVER: Final = ("action", "conditions", "events", "robot", "every", "timeout")
_ACTIONS: Final = (State, Function, Goal, Made)
_GOAL: Final = ("action", "type", "goal", "cases", "timeout", "server_wait_timeout")
_POSITIVE: Final = Limits(above=0)


def mapping_beside(plan: Path) -> Path | None:
    """Return the file that belongs to a plan: STEM.actions.yaml or actions.yaml beside it."""
    names = (f"{plan.name.partition('.')[0]}.actions.yaml", "actions.yaml")
    return next((plan.parent / n for n in names if (plan.parent / n).is_file()), None)


def read_mapping(file: Path | str, *, imports: bool = True) -> Registered:
    """Read the file.

    Args:
        file: The file.
        imports: False to import no module: `NotImported` stands for what `run:` names.

    Raises:
        PlanError: it cannot be read, or is wrong; all problems at once, with their lines.
    """
    source = CheckedFile(Path(file), _error, may_be_empty=True)
    found = _registered(source.top, imports)
    source.check()
    return found


def _error(problems: Sequence[Problem]) -> PlanError:
    return PlanError(
        PlanProblem("mapping", "error", p.text, p.field, p.file, p.line) for p in problems
    )


def _registered(top: Section, imports: bool) -> Registered:
    actions, conditions = top.section("actions"), top.section("conditions")
    found = Registered(
        {name: _action(actions.section(name), imports) for name in actions},
        {name: _condition(conditions, name, imports) for name in conditions},
    )
    top.allow("strict", "events", "event_life")
    if "strict" in top:
        found.options["strict"] = top.flag("strict", REQUIRED)
    if "events" in top:
        found.options["events"] = top.text("events", REQUIRED, get_args(Events))
    if "event_life" in top:
        found.options["event_life"] = _seconds(top, "event_life")
    if top.value("server", default=False) is not False:
        found.options["server"] = _server(top)
    top.close()
    return found


def _server(top: Section) -> PNPServer | None:
    if top.value("server") is True:
        return PNPServer()
    section = top.section("server")
    values = {key: section.value(key) for key in _SERVER if key in section}
    section.allow(*_SERVER)
    section.close()
    try:
        return PNPServer(**values)
    except InvalidStateError as error:
        section.report_each(error.problems)
        return None


def _action(section: Section, imports: bool) -> Any:
    if "run" in section:
        thing = _thing(section, imports)
        section.close()
        if not (thing is None or callable(thing) or isinstance(thing, _ACTIONS)):
            got = f"got {section.value('run')!r}, which is {thing!r}"
            section.report("run", f"{got}; expected a function or a state.")
        return thing
    section.allow("run", *_GOAL)
    section.close()
    if "action" not in section:
        if section.is_good("run", "action"):
            text = "got neither 'run' nor 'action'; expected module:name, or an action's name."
            section.report("", text)
        return None
    action, spec = section.text("action", REQUIRED), _interface(section, "action")
    cases = section.section("cases")
    options = {
        option: _seconds(section, key)
        for key, option in (("timeout", "exec_timeout"), ("server_wait_timeout",) * 2)
        if key in section
    }
    return Goal(
        action,
        spec,
        _fields(section.section("goal")),
        {case: _fields(cases.section(case)) for case in cases},
        options,
    )


def _fields(section: Section) -> dict[str, Any]:
    return {name: section.value(name) for name in section}


def _condition(conditions: Section, name: str, imports: bool) -> Any:
    if isinstance(conditions.value(name), bool):
        return conditions.value(name)
    section = conditions.section(name)
    kinds = {"topic": ("type", "when"), "userdata": (), "run": ("every",)}
    both = {*kinds, *(key for more in kinds.values() for key in more)}
    section.allow(*both)
    section.close()
    first = next((one for one in kinds if one in section), "")
    for key in section if first else ():
        if key in both - {first, *kinds[first]}:  # it would have no effect
            section.report(key, f"got {key!r} beside {first!r}; expected one of them.")
    if "userdata" in section:
        return _expression(section, "userdata")
    if "run" in section:
        function = _thing(section, imports)
        if "every" not in section:
            return function
        return Polled(function, section.number("every", REQUIRED, _POSITIVE, "s"))
    if "topic" in section:
        when, kind = _expression(section, "when"), _interface(section, "msg")
        known = [] if kind is None else list(kind.__slots__)
        for field in sorted(() if when is None or kind is None else when.names - {*known, WHOLE}):
            section.report("when", unknown_name("field", field, known))
        return TopicCondition(
            section.text("topic", REQUIRED),
            kind,
            lambda message: when is not None and when(message),
        )
    if section.is_good("topic", "userdata", "run"):
        text = "got none of topic, userdata and run; expected true, false, or one of these."
        section.report("", text)
    return None


def _seconds(section: Section, key: str) -> float | None:
    """Read a duration; None: no limit."""
    if section.value(key) is None or section.value(key) == math.inf:
        return None
    return section.number(key, REQUIRED, Limits(low=0), "s")


def _expression(section: Section, key: str) -> Expression | None:
    text = str(section.value(key, ""))
    try:
        return Expression(text)
    except ExpressionError as error:
        section.report(key, f"got {text!r}: {error.problem}")
        return None


def _interface(section: Section, kind: str) -> Any:
    from actionlib_core.interfaces import get_action, get_message

    name = section.text("type", REQUIRED)
    if section.is_good("type"):
        try:
            return (get_action if kind == "action" else get_message)(name)
        except Exception as error:  # noqa: BLE001  told with its line
            section.report("type", f"got {name!r}: {error}")
    return None


def _files_of(module: str, folder: Path) -> list[Path]:
    """Return the files in a folder that `import module` may mean there."""
    path = folder.joinpath(*module.split("."))
    files = (path / "__init__.py", path.with_suffix(".py"))
    return [file.resolve() for file in files if file.is_file()]


def _thing(section: Section, imports: bool) -> Any:
    """Return what `run: module:name` names; a module beside the file comes first."""
    text = section.text("run", REQUIRED)
    module, colon, name = text.partition(":")
    if not (module and colon and name):
        section.problem("run", "'module:name'")
        return None
    if not imports:
        return NotImported(text)
    folder = str(section.file.folder.resolve())
    sys.path.insert(0, folder)
    try:
        thing: Any = importlib.import_module(module)
        # A module of this name that the program has already is not imported again.
        found, beside = getattr(thing, "__file__", None), _files_of(module, Path(folder))
        if beside and (found is None or Path(found).resolve() not in beside):
            got = f"got {text!r}, whose module is {found} already; expected {beside[0]}"
            section.report("run", f"{got}. Try another name for the file.")
            return None
        for part in name.split("."):
            thing = getattr(thing, part)
    except Exception as error:  # noqa: BLE001  the user's module
        section.report("run", f"got {text!r}: {type(error).__name__}: {error}")
        return None
    finally:
        sys.path.remove(folder)
    return thing
