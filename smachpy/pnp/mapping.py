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
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.yaml_text import YamlTextError, load_yaml
from smachpy.exceptions import InvalidStateError, did_you_mean
from smachpy.pnp.actions import Goal
from smachpy.pnp.knowledge import Expression, Polled, TopicCondition
from smachpy.pnp.problems import PlanProblem, raise_errors
from smachpy.pnp.server import PNPServer

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


@dataclass(frozen=True)
class Registered:
    """The content of the file; the attributes are the arguments of `smachpy.pnp.load`."""

    actions: dict[str, Any] = field(default_factory=dict)
    conditions: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)


_TOP: Final = ("actions", "conditions", "strict", "events", "event_life", "server")
_SERVER: Final = ("action", "conditions", "events", "robot", "every", "timeout")
_GOAL: Final = ("action", "type", "goal", "cases", "timeout", "server_wait_timeout")
_CONDITION: Final = ("topic", "type", "when", "userdata", "run", "every", "value")


def mapping_beside(plan: Path) -> Path | None:
    """Return the file that belongs to a plan: STEM.actions.yaml or actions.yaml beside it."""
    names = (f"{plan.name.partition('.')[0]}.actions.yaml", "actions.yaml")
    return next((plan.parent / n for n in names if (plan.parent / n).is_file()), None)


def read_mapping(file: Path | str) -> Registered:
    """Read the file.

    Raises:
        PlanError: it cannot be read, or is wrong; all problems at once, with their lines.
    """
    path = Path(file)
    reader = _Reader(path)
    try:
        data = load_yaml(path.read_text(encoding="utf-8"), kind="rt")
    except OSError as error:
        reader.problem(0, error.strerror or type(error).__name__)
    except UnicodeDecodeError:
        reader.problem(0, "is not UTF-8; expected YAML.")
    except YamlTextError as error:
        reader.problem(error.line, f"is no YAML: {error.reason}.")
    else:
        found = reader.read(data)
        raise_errors(reader.problems)
        return found
    raise_errors(reader.problems)
    raise AssertionError  # there is an error


class _Reader:
    def __init__(self, path: Path) -> None:
        self._path = path
        self.problems: list[PlanProblem] = []

    def problem(self, line: int, text: str, element: str = "") -> None:
        self.problems.append(PlanProblem("mapping", "error", text, element, str(self._path), line))

    def read(self, data: Any) -> Registered:
        if data is None:
            return Registered()
        if not self._is_mapping(data, "the file", 1):
            return Registered()
        self._known(data, _TOP, "")
        found = Registered()
        for name, given in self._items(data, "actions"):
            made = self._action(data["actions"], str(name), given)
            found.actions[str(name)] = made
        for name, given in self._items(data, "conditions"):
            found.conditions[str(name)] = self._condition(data["conditions"], str(name), given)
        for key in ("strict", "events", "event_life"):
            if key in data:
                found.options[key] = data[key]
        if data.get("server", False) is not False:
            found.options["server"] = self._server(data, data["server"])
        if not isinstance(found.options.get("strict", False), bool):
            self.problem(_line(data, "strict"), f"got {data['strict']!r}; expected true or false.")
        return found

    def _server(self, data: Any, given: Any) -> PNPServer | None:
        if given is True or given is None:
            return PNPServer()
        if not self._is_mapping(given, "server", _line(data, "server")):
            return None
        self._known(given, _SERVER, "server")
        try:
            return PNPServer(**{k: v for k, v in _plain(given).items() if k in _SERVER})
        except InvalidStateError as error:
            self.problem(_line(data, "server"), error.message, "server")
            return None

    def _items(self, data: Any, key: str) -> Iterable[tuple[Any, Any]]:
        given = data.get(key)
        if given is None or not self._is_mapping(given, key, _line(data, key)):
            return ()
        return tuple(given.items())

    def _is_mapping(self, data: Any, what: str, line: int) -> bool:
        if hasattr(data, "items"):
            return True
        self.problem(line, f"got {data!r}; expected names and values.", what)
        return False

    def _known(self, data: Mapping[str, Any], names: tuple[str, ...], element: str) -> None:
        for key in data:
            if key not in names:
                text = f"got {key!r}; expected one of {sorted(names)}.{did_you_mean(key, names)}"
                self.problem(_line(data, key), text, element)

    def _action(self, parent: Any, name: str, given: Any) -> Any:
        element, line = f"actions.{name}", _line(parent, name)
        if not self._is_mapping(given, element, line):
            return None
        if "run" in given:
            self._known(given, ("run",), element)
            return self._thing(given["run"], element, _line(given, "run"))
        self._known(given, _GOAL, element)
        if not isinstance(given.get("action"), str):
            text = "got neither 'run' nor 'action'; expected module:name, or an action's name."
            self.problem(line, text, element)
            return None
        spec = self._interface(given, element, "action")
        options = {
            ours: given[key]
            for key, ours in (("timeout", "exec_timeout"), ("server_wait_timeout",) * 2)
            if key in given
        }
        cases = given.get("cases") or {}
        goal = given.get("goal") or {}
        for key, part in (("goal", goal), ("cases", cases)):
            self._is_mapping(part, f"{element}.{key}", _line(given, key))
        return Goal(
            given["action"],
            spec,
            _plain(goal),
            {str(case): _plain(fields) for case, fields in _plain(cases).items()},
            options,
        )

    def _condition(self, parent: Any, name: str, given: Any) -> Any:
        element, line = f"conditions.{name}", _line(parent, name)
        if isinstance(given, bool):
            return given
        if not self._is_mapping(given, element, line):
            return None
        self._known(given, _CONDITION, element)
        if "userdata" in given:
            return self._expression(given, "userdata", element)
        if "run" in given:
            function = self._thing(given["run"], element, _line(given, "run"))
            return Polled(function, given["every"]) if "every" in given else function
        if "topic" in given:
            when = self._expression(given, "when", element)
            spec = self._interface(given, element, "msg")
            return TopicCondition(
                str(given["topic"]),
                spec,
                lambda message: when is not None and when(_Fields(message)),
            )
        text = "expected true, false, or one of topic, userdata and run in it."
        self.problem(line, f"got {_plain(given)!r}; {text}", element)
        return None

    def _expression(self, given: Any, key: str, element: str) -> Expression | None:
        try:
            return Expression(str(given.get(key, "")))
        except ValueError as error:
            self.problem(_line(given, key), f"{key}: {error}", element)
            return None

    def _interface(self, given: Any, element: str, kind: str) -> Any:
        from actionlib_core.interfaces import get_action, get_message

        text = given.get("type")
        try:
            return (get_action if kind == "action" else get_message)(str(text))
        except Exception as error:  # noqa: BLE001  told with its line
            self.problem(_line(given, "type"), f"type: got {text!r}: {error}", element)
            return None

    def _thing(self, text: Any, element: str, line: int) -> Any:
        """Return what "module:name" names; modules beside the file are found, too."""
        module, colon, name = str(text).partition(":")
        if not (module and colon and name):
            self.problem(line, f"run: got {text!r}; expected 'module:name'.", element)
            return None
        folder = str(self._path.parent.resolve())
        sys.path.insert(0, folder)
        try:
            thing: Any = importlib.import_module(module)
            for part in name.split("."):
                thing = getattr(thing, part)
        except Exception as error:  # noqa: BLE001  the user's module
            text = f"run: got {text!r}: {type(error).__name__}: {error}"
            self.problem(line, text, element)
            return None
        finally:
            sys.path.remove(folder)
        return thing


class _Fields:
    """The fields of a message, by key, as an expression asks for them."""

    def __init__(self, message: Any) -> None:
        self._message = message

    def __getitem__(self, key: str) -> Any:
        return getattr(self._message, key)


def _line(data: Any, key: str) -> int:
    try:
        return int(data.lc.key(key)[0]) + 1
    except (AttributeError, KeyError, TypeError):
        return 0


def _plain(data: Any) -> Any:
    """Return YAML's values as Python's own."""
    if hasattr(data, "items"):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_plain(value) for value in data]
    for kind in (bool, int, float, str):
        if isinstance(data, kind):
            return kind(data)
    return data
