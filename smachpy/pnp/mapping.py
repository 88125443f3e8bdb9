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
"""

from __future__ import annotations

import importlib
import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, get_args

from actionlib_core.checked_file import REQUIRED, CheckedFile, Limits
from smachpy.exceptions import InvalidStateError
from smachpy.machines.state import State
from smachpy.pnp.actions import Function, Goal, Made
from smachpy.pnp.knowledge import Events, Expression, Polled, TopicCondition
from smachpy.pnp.problems import PlanError, PlanProblem
from smachpy.pnp.server import PNPServer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actionlib_core.checked_file import Problem, Section


@dataclass(frozen=True)
class Registered:
    """The content of the file; the attributes are the arguments of `smachpy.pnp.load`."""

    actions: dict[str, Any] = field(default_factory=dict)
    conditions: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)


_SERVER: Final = ("action", "conditions", "events", "robot", "every", "timeout")
_ACTIONS: Final = (State, Function, Goal, Made)
_GOAL: Final = ("action", "type", "goal", "cases", "timeout", "server_wait_timeout")
_POSITIVE: Final = Limits(above=0)


def mapping_beside(plan: Path) -> Path | None:
    """Return the file that belongs to a plan: STEM.actions.yaml or actions.yaml beside it."""
    names = (f"{plan.name.partition('.')[0]}.actions.yaml", "actions.yaml")
    return next((plan.parent / n for n in names if (plan.parent / n).is_file()), None)


def read_mapping(file: Path | str) -> Registered:
    """Read the file.

    Raises:
        PlanError: it cannot be read, or is wrong; all problems at once, with their lines.
    """
    source = CheckedFile(Path(file), _error, may_be_empty=True)
    found = _registered(source.top)
    source.check()
    return found


def _error(problems: Sequence[Problem]) -> PlanError:
    return PlanError(
        PlanProblem("mapping", "error", p.text, p.field, p.file, p.line) for p in problems
    )


def _registered(top: Section) -> Registered:
    actions, conditions = top.section("actions"), top.section("conditions")
    found = Registered(
        {name: _action(actions.section(name)) for name in actions},
        {name: _condition(conditions, name) for name in conditions},
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


def _action(section: Section) -> Any:
    if "run" in section:
        thing = _thing(section)
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


def _condition(conditions: Section, name: str) -> Any:
    if isinstance(conditions.value(name), bool):
        return conditions.value(name)
    section = conditions.section(name)
    section.allow("topic", "type", "when", "userdata", "run", "every")
    section.close()
    if "userdata" in section:
        return _expression(section, "userdata")
    if "run" in section:
        function = _thing(section)
        if "every" not in section:
            return function
        return Polled(function, section.number("every", REQUIRED, _POSITIVE, "s"))
    if "topic" in section:
        when = _expression(section, "when")
        return TopicCondition(
            section.text("topic", REQUIRED),
            _interface(section, "msg"),
            lambda message: when is not None and when(_Message(message)),
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
    try:
        return Expression(str(section.value(key, "")))
    except ValueError as error:
        section.report(key, str(error))
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


def _thing(section: Section) -> Any:
    """Return what `run: module:name` names; modules beside the file are found, too."""
    text = section.text("run", REQUIRED)
    module, colon, name = text.partition(":")
    if not (module and colon and name):
        section.problem("run", "'module:name'")
        return None
    folder = str(section.file.folder.resolve())
    sys.path.insert(0, folder)
    try:
        thing: Any = importlib.import_module(module)
        for part in name.split("."):
            thing = getattr(thing, part)
    except Exception as error:  # noqa: BLE001  the user's module
        section.report("run", f"got {text!r}: {type(error).__name__}: {error}")
        return None
    finally:
        sys.path.remove(folder)
    return thing


class _Message:
    """The fields of a message, by key, as an expression asks for them."""

    def __init__(self, message: Any) -> None:
        self._message = message

    def __getitem__(self, key: str) -> Any:
        return getattr(self._message, key)
