"""Writes a machine as a mission file; says what cannot be written."""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.inputs.yaml_text import MAX_YAML_LENGTH, load_yaml
from smachpy.engine.options import NO_OPTIONS
from smachpy.exceptions import MissionError
from smachpy.files.reading import KEYS, ItemsOf, StopOthers
from smachpy.files.reference import Origin
from smachpy.machines.concurrence import Concurrence
from smachpy.machines.container import Container
from smachpy.machines.iterator import Iterator
from smachpy.machines.state import FunctionState, State
from smachpy.machines.state_machine import Sequence, StateMachine
from smachpy.userdata.user_data import CheckedDict, ConstantKey, data_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from collections.abc import Sequence as SequenceOf

    from smachpy.engine.options import Options

PLAIN = (str, int, float, bool, type(None))
MOST_ITEMS: Final = 10_000
"""Items of a range, which is written as a list."""
_PARAMETER: Final = re.compile(r"\${(\w+)}")
# Mappings whose order means something: which state is first, which rule counts, what is computed.
_IN_ORDER: Final = ("states", "outcome_map", "with")


class NotWrittenError(MissionError):
    """A machine has parts that no file can name.

    Try: give the parts that are listed a name that can be imported, or leave them in Python.

    Attributes:
        problems: The parts, as texts.
    """

    def __init__(self, problems: SequenceOf[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(problems))


def write(machine: StateMachine, path: str | Path | None = None) -> str:
    """Write a machine as a mission file; return the text.

    States must be named by a file that was loaded, or be functions and classes of a module that can
    be imported, made without arguments. Comments and the order of a file that is there already are
    kept where its parts stay.

    Args:
        machine: A state machine.
        path: Where to write it; None only returns the text.

    Raises:
        NotWrittenError: some parts cannot be written, or another file is there; all at once,
            nothing was written.
        OSError: the file cannot be written.
    """
    from ruamel.yaml import YAML

    writer = _Writer()
    name, about = machine.name or "SM_ROOT", machine._smachpy.made_from
    shown = about if isinstance(about, dict) else {}  # of the file that it was loaded from
    data = {"name": name, **shown, **writer.container(machine, f"/{name}")}
    if writer.problems:
        raise NotWrittenError(writer.problems)
    data["parameters"] = dict(data.get("parameters", {}))
    _drop(data, [one for one in data["parameters"] if one not in _used(data)])
    yaml = YAML()
    yaml.width = 120
    text = "" if path is None else _there(Path(path))
    if text:
        old: Any = load_yaml(text)
        data = {**{key: old[key] for key in ("smachpy", "help") if key in old}, **data}
        text = _onto(text, data, yaml)
    text = text or _dumped(data, yaml)
    if path is not None:
        whole = Path(path).resolve()
        part = whole.with_name(f".{whole.name}.{os.getpid()}")
        try:  # a full disk must not leave a half of what was there
            part.write_text(text, encoding="utf-8")
            part.replace(whole)
        finally:
            part.unlink(missing_ok=True)
    return text


def _there(path: Path) -> str:
    """Return the text of the file that is there; "" if there is none, or nothing in it.

    Raises:
        NotWrittenError: it is no mission file.
        OSError: it cannot be read.
    """
    if not path.exists():
        return ""
    try:
        text = read_limited(path, MAX_YAML_LENGTH).decode("utf-8-sig")
        data = load_yaml(text)
    except ValueError as error:
        data, problem = None, f"not YAML: {error}"
    else:
        problem = "no mission"
        if data is None or (isinstance(data, dict) and "states" in data):
            return text if data else ""
    expected = "expected a mission file or none. Try another name."
    raise NotWrittenError([f"{path}: the file that is there is {problem}; {expected}"])


def _dumped(data: Any, yaml: Any) -> str:
    stream = io.StringIO()
    yaml.dump(data, stream)
    return stream.getvalue()


def _used(data: Mapping[str, Any]) -> set[str]:
    """Return the parameters that a file uses."""
    rest = repr({key: value for key, value in data.items() if key != "parameters"})
    return set(_PARAMETER.findall(rest))


def _drop(data: Any, names: Iterable[str]) -> None:
    """Drop parameters that nothing uses any more: they would have no effect."""
    for name in names:
        del data["parameters"][name]
    if "parameters" in data and not data["parameters"]:
        del data["parameters"]


def _onto(text: str, data: Mapping[str, Any], yaml: Any) -> str:
    """Return the text of a file, with its comments, as `data`; "" if it cannot be that."""
    from ruamel.yaml.error import YAMLError

    old = yaml.load(text)
    before, there = _used(old), old.get("parameters", {})
    parameters = {**there, **data.get("parameters", {})} if isinstance(there, dict) else {}
    if parameters:
        data = {**data, "parameters": parameters}
    values = {
        name: one["default"]
        for name, one in parameters.items()
        if isinstance(one, dict) and "default" in one
    }
    with contextlib.suppress(YAMLError):  # an alias before its anchor
        old = yaml.load("".join(_Arranged(text, yaml).lines(old, data, 0, sys.maxsize)))
    _merge(old, data, values)
    _drop(old, [name for name in before - _used(old) if name in old.get("parameters", {})])
    text = _dumped(old, yaml)
    # What stands in several places of `old` by an anchor has only one value, for example.
    found: Any = load_yaml(text)
    return (
        text if _same({**found, "parameters": None}, {**data, "parameters": None}, values) else ""
    )


def _merge(old: Any, new: Mapping[str, Any], values: Mapping[str, Any], name: str = "") -> None:
    """Make `old`, which has comments, equal to `new`; `values` are the defaults of parameters."""
    for key in [key for key in old if key not in new]:
        del old[key]
    for key, value in new.items():
        if isinstance(value, dict) and isinstance(old.get(key), dict):
            _merge(old[key], value, values, key)
        elif key not in old or not _same(old[key], value, values):
            old[key] = value
    if name in _IN_ORDER and [*old] != [*new]:  # all on one line, for example
        for key in new:
            old.move_to_end(key)


class _Arranged:
    """Puts the lines of a file in the order of its new content, each key with its comments.

    For YAML's readers a comment above a key belongs to what is before it.
    """

    def __init__(self, text: str, yaml: Any) -> None:
        self._lines = text.splitlines(keepends=True)
        self._yaml = yaml

    def lines(self, old: Any, new: Any, first: int, end: int, name: str = "") -> list[str]:
        """Return the lines of a mapping.

        Args:
            old: It, as it was read.
            new: What it is to become.
            first: Number of its first line, from 0.
            end: That of the first line behind it.
            name: Its key.
        """
        as_it_is = self._lines[first:end]
        if not isinstance(old, dict) or not isinstance(new, dict):
            return as_it_is
        known = old.lc.data or {}  # type: ignore[attr-defined]
        places: dict[str, tuple[int, int]] = {key: known.get(key, (-1, 0))[:2] for key in old}
        rows = [row for row, _ in places.values()]
        if not rows or rows != sorted({*rows}) or not first <= rows[0] <= rows[-1] < end:
            return as_it_is  # of an anchor elsewhere, or not on lines of its own
        begins = [self._above(row, column, first) for row, column in places.values()]
        if not name:
            begins[0] = rows[0]  # what is above is about the file
        parts = dict(zip(old, zip(begins, [*begins[1:], end], strict=True), strict=True))
        column = next(iter(places.values()))[1]
        found = self._lines[first : begins[0]]
        for key in new if name in _IN_ORDER else [key for key in old if key in new]:
            if key not in parts:
                found.append(" " * column + _dumped({key: None}, self._yaml))
                continue
            inside = parts[key][0], places[key][0] + 1
            found += self._lines[slice(*inside)]
            found += self.lines(old[key], new[key], inside[1], parts[key][1], key)
        return found

    def _above(self, row: int, column: int, first: int) -> int:
        """Return the first line of the comments above a key."""
        while row > first:
            text = self._lines[row - 1]
            bare = text.strip()
            if bare and not (bare.startswith("#") and text.index("#") <= column):
                break
            row -= 1
        return row


def _same(there: Any, new: Any, values: Mapping[str, Any], name: str = "") -> bool:
    """Return whether the file has a value: as it is, or in a text with the defaults filled in."""
    if isinstance(there, str) and there != new:
        there = _filled(there, values)
    if isinstance(there, dict) and isinstance(new, dict):
        order: Any = list if name in _IN_ORDER else set
        return order(there) == order(new) and all(
            _same(there[key], new[key], values, key) for key in new
        )
    if isinstance(there, list) and isinstance(new, (list, tuple)):
        return len(there) == len(new) and all(
            _same(*pair, values) for pair in zip(there, new, strict=True)
        )
    return bool(there == new) and isinstance(there, bool) is isinstance(new, bool)


def _filled(text: str, values: Mapping[str, Any]) -> Any:
    names = _PARAMETER.findall(text)
    if not all(name in values for name in names):
        return text
    if text == "".join(f"${{{name}}}" for name in names[:1]):
        return values[names[0]]
    return _PARAMETER.sub(lambda match: str(values[match[1]]), text)


class _Writer:
    def __init__(self) -> None:
        self.problems: list[str] = []

    def _refuse(self, path: str, what: str) -> None:
        self.problems.append(f"{path}: {what}")

    def container(self, container: Container, path: str) -> dict[str, Any]:
        """Return the section of a container."""
        data: Any = container._smachpy
        if data.start_cbs or data.transition_cbs or data.termination_cbs:
            self._refuse(path, "got callbacks; expected none.")
        if type(container) not in {StateMachine, Sequence, Concurrence, Iterator}:
            self._refuse(
                path, f"got a {type(container).__name__}; expected a container of smachpy."
            )
            return {}
        found: dict[str, Any] = {"outcomes": list(data.outcomes)}
        for key in ("input_keys", "output_keys"):
            if getattr(data, key):
                found[key] = list(getattr(data, key))
        found |= self._userdata(container, path)
        found |= self._options(data.options, path)
        if isinstance(container, Iterator):
            return found | self._iterator(container, path) | self._cleanup(container, path)
        if isinstance(container, Concurrence):
            found |= self._policy(container, path)
        if isinstance(container, Sequence):
            found["connector"] = data.connector_outcome
        if data.reenter != "first":
            found["reenter"] = data.reenter
        return found | self._children(container, path)

    def _userdata(self, container: Container, path: str) -> dict[str, Any]:
        """Return the values with which a container begins."""
        if isinstance(data_of(container.userdata), CheckedDict):
            self._refuse(path, "userdata_type: got types; expected none.")
        values = {
            k: v for k, v in data_of(container.userdata).items() if type(k) is not ConstantKey
        }
        values |= container._smachpy.begins_with
        plain = {k: self._plain(v, f"{path}: userdata {k}") for k, v in values.items()}
        return {"userdata": plain} if plain else {}

    def _children(self, container: Container, path: str) -> dict[str, Any]:
        """Return the states and the clean-up."""
        data: Any = container._smachpy
        others, found = data.others(), dict[str, Any]()
        if isinstance(container, StateMachine) and data.initial != next(iter(others), None):
            found["initial"] = data.initial
        found["states"] = {
            label: self._entry(container, label, state, f"{path}/{label}")
            for label, state in others.items()
            if not hasattr(state, "_smachpy_form")  # of a transition with `confirm`
        }
        return found | self._cleanup(container, path)

    def _cleanup(self, container: Container, path: str) -> dict[str, Any]:
        label = container._smachpy.cleanup
        if not label:
            return {}
        state = container._smachpy.children[label]
        return {"cleanup": {label: self._entry(container, label, state, f"{path}/{label}")}}

    def _entry(self, parent: Container, label: str, state: State, path: str) -> dict[str, Any]:
        data: Any = parent._smachpy
        found = self._state(state, path)
        names = data.remappings[label]
        constants = {
            key: data_of(parent.userdata)[name]
            for key, name in names.items()
            if type(name) is ConstantKey
        }
        renamed = {key: name for key, name in names.items() if type(name) is not ConstantKey}
        if renamed:
            found["remapping"] = renamed
        if constants:
            found["constants"] = {k: self._plain(v, f"{path}: {k}") for k, v in constants.items()}
        transitions = getattr(data, "transitions", {}).get(label, {})
        guards = getattr(data, "guards", {}).get(label, {})
        if transitions:
            found["on"] = {
                outcome: self._confirmed(parent, target, path)
                or self._target(target, guards.get(outcome, ()), outcome, path)
                for outcome, target in transitions.items()
            }
        return found

    def _confirmed(self, parent: Container, target: str | None, path: str) -> dict[str, Any]:
        """Return a transition that a person confirms; nothing if it is none."""
        form = getattr(parent.get_children().get(target or ""), "_smachpy_form", None)
        if form is None or target is None:
            return {}
        from smachpy.states.confirming import PATIENCE_S  # here: few files need what it imports

        level, question, patience = form
        data: Any = parent._smachpy
        leads = data.transitions[target]
        if patience != PATIENCE_S or leads["no"] != leads["no_answer"]:
            self._refuse(path, "got a `confirm` with `patience` or two other ways; expected none.")
        found = {"to": leads["yes"], "confirm": level}
        if leads["no"] != "preempted":
            found["otherwise"] = leads["no"]
        if question != f"Go on to {leads['yes']}?":
            found["question"] = question
        return found

    def _target(self, target: str | None, cases: Any, outcome: str, path: str) -> Any:
        if not cases:
            return target
        rows = []
        for case in cases:
            if not isinstance(case.condition, str):
                self._refuse(
                    path, f"got the function {case.text!r} as a condition; expected a text."
                )
            rows.append({"when": case.text, "to": case.target})
        return [*rows, {"to": target or outcome}]

    def _state(self, state: State, path: str) -> dict[str, Any]:
        origin = state._smachpy.made_from
        origin = getattr(origin, "origin", origin)
        if isinstance(origin, Origin):
            found: dict[str, Any] = {origin.kind: origin.name}
            if origin.arguments:
                found["with"] = dict(origin.arguments)
            options = self._changed(state, path, origin.name, origin.options, origin.loaded)
            return {**found, **origin.keys, **options}
        if isinstance(state, Container):
            kinds = {
                StateMachine: "machine",
                Sequence: "sequence",
                Concurrence: "concurrence",
                Iterator: "iterator",
            }
            return {kinds.get(type(state), "machine"): self.container(state, path)}
        name, fresh = self._name(state)
        if fresh is None:
            self._refuse(
                path,
                f"got a {type(state).__name__} made by code; expected a state of a module, made "
                "without arguments, or a registered one. Try a function in a module that returns "
                "it.",
            )
            return {}
        # A function's own state may have been changed: another process has what its module says.
        loaded = NO_OPTIONS if fresh is state else fresh._smachpy.options
        return {
            "state": name,
            "outcomes": list(state._smachpy.outcomes),
            **self._changed(state, path, name, {}, loaded),
        }

    def _name(self, state: State) -> tuple[str, State | None]:
        """Return `module:Name` of a state, and what importing that gives, if it is an equal one."""
        if isinstance(state, FunctionState):
            function: Any = state.__wrapped__
            module, name = function.__module__, function.__qualname__
            fresh: Any = _attribute(module, name)
            same = isinstance(fresh, FunctionState) and fresh.__wrapped__ is function
        else:
            kind = type(state)
            module, name = kind.__module__, kind.__qualname__
            if _attribute(module, name) is not kind:
                return "", None
            try:
                fresh = kind()
            except Exception:  # noqa: BLE001  it needs arguments: told by the caller
                return "", None
            own = {k: v for k, v in vars(state).items() if not k.startswith("_smachpy")}
            plain = {k: v for k, v in vars(fresh).items() if not k.startswith("_smachpy")}
            same = own == plain
        same = same and all(
            getattr(state._smachpy, key) == getattr(fresh._smachpy, key) for key in KEYS
        )
        return f"{module}:{name}", fresh if same else None

    def _changed(
        self,
        state: State,
        path: str,
        name: str,
        in_file: Mapping[str, Any],
        loaded: Options | None,
    ) -> dict[str, Any]:
        """Return the options as in the file, and those that the program has set since.

        Args:
            state: The state.
            path: Its path.
            name: Its name in the file.
            in_file: The options as in the file.
            loaded: All options that it has by its name and those; None if it has no others.
        """
        found = dict(in_file)
        if loaded is None or loaded == state._smachpy.options:
            return found
        now = self._options(state._smachpy.options, path, loaded)
        then = self._options(loaded, path, loaded)
        for key in {**then, **now}:
            if key in now and now[key] != then.get(key):
                found[key] = now[key]
                if key == "timeout":  # until its code is imported, a state has only those of a file
                    found["timeout_outcome"] = now["timeout_outcome"]
            elif key not in now and found.pop(key, None) is None:
                self._refuse(path, f"{key}: got none; expected that of {name}.")
        return found

    def _options(self, options: Options, path: str, known: Options | None = None) -> dict[str, Any]:
        """Return options as a file has them; code is refused unless `known` options have it."""
        found: dict[str, Any] = {}
        if options.timeout is not None:
            found |= {"timeout": options.timeout, "timeout_outcome": options.timeout_outcome}
        if options.preempt_timeout != "inherit":
            found["preempt_timeout"] = options.preempt_timeout
        if options.retry is not None:
            retry = options.retry
            found["retry"] = {
                "attempts": retry.attempts,
                "backoff": retry.backoff,
                "on": self._plain(retry.on, f"{path}: retry: on"),
            }
        for name in ("on_exception", "on_enter", "on_exit", "on_resume"):
            if getattr(options, name) and getattr(known, name, None) != getattr(options, name):
                self._refuse(path, f"{name}: got code; expected none.")
        if options.resume is not None:
            found["resume"] = self._plain(options.resume, f"{path}: resume")
        for name, none in (("idempotent", False), ("transient", ()), ("success", None)):
            value = getattr(options, name)
            if value != none:
                found[name] = list(value) if isinstance(value, tuple) else value
        if options.resource is not None:
            found["resource"] = {
                "name": options.resource.name,
                "policy": options.resource.policy,
            }
        return found

    def _policy(self, container: Concurrence, path: str) -> dict[str, Any]:
        data = container._smachpy
        found: dict[str, Any] = {"default_outcome": data.default_outcome}
        if not data.default_outcome:
            self._refuse(path, "default_outcome: got none; expected one.")
        if data.outcome_cb is not None:
            self._refuse(path, "outcome_cb: got a function; expected rules.")
        stop = data.child_termination_cb
        if isinstance(stop, StopOthers):
            found["stop_others"] = True if stop.labels is None else list(stop.labels)
        elif stop is not None:
            self._refuse(path, "child_termination_cb: got a function; expected `stop_others`.")
        rules: dict[str, Any] = {}
        for outcome, rule in data.rules:
            if outcome in rules:
                self._refuse(path, f"got two rules for {outcome!r}; expected one.")
            of = {k: list(w) if len(w) > 1 else w[0] for k, w in rule.conditions}
            is_all = rule.need == len(rule.conditions)
            has_words = {*of} in ({"any"}, {"need", "of"})  # which mean other rules
            rules[outcome] = of if is_all and not has_words else {"need": rule.need, "of": of}
        if rules:
            found["outcome_map"] = rules
        return found

    def _iterator(self, container: Iterator, path: str) -> dict[str, Any]:
        data = container._smachpy
        found: dict[str, Any] = {"item_key": data.items_label, "exhausted": data.exhausted_outcome}
        if isinstance(data.items, ItemsOf):
            found["items_from"] = data.items.key
        elif isinstance(data.items, range) and data.items[MOST_ITEMS:]:
            self._refuse(path, f"items: got {data.items}; expected at most {MOST_ITEMS} items.")
        elif isinstance(data.items, (list, tuple, range)):
            found["items"] = [self._plain(one, f"{path}: items") for one in data.items]
        else:
            self._refuse(path, "items: got code; expected a list.")
        for key in ("loop_outcomes", "break_outcomes"):
            if getattr(data, key):
                found[key] = list(getattr(data, key))
        if data.final_outcome_map:
            found["final_outcomes"] = dict(data.final_outcome_map)
        ((label, state),) = data.others().items()
        return {**found, "each": {label: self._entry(container, label, state, f"{path}/{label}")}}

    def _plain(self, value: Any, where: str) -> Any:
        if isinstance(value, (list, tuple)):
            return [self._plain(one, where) for one in value]
        if isinstance(value, dict) and all(isinstance(key, str) for key in value):
            return {key: self._plain(one, where) for key, one in value.items()}
        if isinstance(value, str) and "${" in value:
            self._refuse(where, f"got {value!r}; expected no '${{', which names a parameter.")
        if not isinstance(value, PLAIN):
            self._refuse(where, f"got a {type(value).__name__}; expected plain data.")
            return None
        return value


def _attribute(module: str, name: str) -> Any:
    found: Any = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return found
