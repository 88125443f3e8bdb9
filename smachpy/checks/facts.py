"""Collects facts about the states of a machine, from the objects and from their source."""

from __future__ import annotations

import inspect
import threading
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from smachpy.actions.messages import Outgoing
from smachpy.checks import source, suppression
from smachpy.checks.model import RULES, Facts, OutcomeRule, Place, Problem, Reads, Subject
from smachpy.machines.concurrence import Concurrence
from smachpy.machines.container import Container, problems_of, state_problems
from smachpy.machines.iterator import Iterator as IteratorState
from smachpy.machines.old_states import Delegate
from smachpy.machines.state import CBState, State, get_options
from smachpy.machines.util import CBInterface

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from smachpy.events.introspection import StateRecord

# Kinds of states that wait for something external, and the detail with their timeout.
_LIMITS = {
    "action": ("exec_timeout", "the goal"),
    "service": ("timeout", "the call"),
    "monitor": ("timeout", "the wait for a message"),
    "condition": ("timeout", "the wait for the condition"),
}


PREVENTS_RUN = frozenset({"inconsistent", "unmapped-outcome", "wrong-signature"})
"""Rules of `find_problems`: a machine with such a problem would not run."""


def find_problems(state: State, path: str) -> Iterator[Problem]:
    """Yield what keeps a machine from running, and what its containers find in themselves.

    `add` refuses most of them; changes that a program made afterwards are found here.
    """
    for text in problems_of(state, path) if isinstance(state, Container) else ():
        if state._smachpy_kind == "plan" and not text.startswith(f"{path}: one state"):
            continue  # reported by the plan itself below, with its line in the plan's file
        rule = "unmapped-outcome" if "outcome has no transition" in text else "inconsistent"
        yield Problem(rule, RULES[rule].severity, text.partition(": ")[0], text)
    check_itself = getattr(state, "_smachpy_check", None)
    if check_itself is not None:
        yield from check_itself(path)
    for text in _signature_problems(state):
        hint = "Try `def execute(self, userdata):`, plain or async, that returns an outcome."
        yield Problem("wrong-signature", "error", path, f"{path}: {text}", hint)
    for label, child in state.get_children().items() if isinstance(state, Container) else ():
        yield from find_problems(child, f"{path}/{label}")


def _signature_problems(state: State) -> Iterator[str]:
    yield from (problem for problem in state_problems(state) if problem.startswith("execute:"))
    code: Any = state.execute
    if getattr(code, "__func__", None) is State.execute:
        yield f"execute: got none in {type(state).__name__}; expected a method of its own."
    if isinstance(state, CBState):
        code = state._smachpy.code[0]
    if inspect.isgeneratorfunction(code) or inspect.isasyncgenfunction(code):
        yield "execute: got a function with `yield`, which returns no outcome; expected `return`."


# CPython 3.11 counts the recursion depth of all threads' parsers together, and may raise
# SystemError if two threads parse at once: a check here, and the viewer's check in its thread.
_reading = threading.Lock()


def collect(machine: State, record: StateRecord) -> Subject:
    """Return a machine with the facts about it and all its states."""
    facts: dict[str, Facts] = {}
    containers: dict[str, Container] = {}

    def walk(state: State, record: StateRecord) -> StateRecord:
        """Collect facts; return the record without states that are run by code of the user."""
        if isinstance(state, Container) and not _has_own_execute(state):
            containers[record.path] = state
            facts[record.path] = _of_container(state)
            states = state.get_children()
            children = tuple(walk(states[child.label], child) for child in record.children)
            return replace(record, children=children)
        # With its own `execute` it may do anything: it is a leaf here.
        if isinstance(state, Container):
            containers[record.path] = state
            record = replace(
                record, kind="state", children=(), initial=(), transitions=(), rules=()
            )
            facts[record.path] = _of_container(state)
        else:
            facts[record.path] = _of_leaf(state, record)
        return record

    with _reading:
        record = walk(machine, record)
    # Values may appear from outside if machines share their userdata, or if a state's code uses the
    # userdata of some machine: nothing is certain about unset keys then.
    owners = Counter(id(container.userdata) for container in containers.values())
    files = {known.place.file for known in facts.values() if known.place is not None}
    kinds = {kind.__name__ for each in containers.values() for kind in type(each).__mro__}
    asides = [source.keys_written_aside(file, kinds) for file in sorted(files)]
    anywhere = None in asides or any(known.reaches for known in facts.values())
    for path, container in containers.items():
        if anywhere or owners[id(container.userdata)] > 1:
            facts[path] = replace(facts[path], watched=True)
    return Subject(record, facts, frozenset().union(*filter(None, asides)))


def _has_own_execute(state: State) -> bool:
    return _is_foreign(type(state).execute) or "execute" in vars(state)


def _is_foreign(code: Any) -> bool:
    return bool((code.__module__ or "").partition(".")[0] != "smachpy")


def _may_write_anything(state: State) -> bool:
    """Tell whether a state is an old one that names no keys, as a stand-in's."""
    return isinstance(state, Delegate) and not state.get_registered_output_keys()


def _of_container(container: Container) -> Facts:
    rules: tuple[OutcomeRule, ...] = ()
    if isinstance(container, Concurrence):
        rules = tuple(
            OutcomeRule(outcome, rule.need, rule.conditions)
            for outcome, rule in container._smachpy.rules
        )
    data = container._smachpy
    items = container._smachpy.items if isinstance(container, IteratorState) else None
    return Facts(
        preset=frozenset(container.userdata.keys()),
        kept=frozenset(container.userdata.keys()) - data.begins_with.keys(),
        outcome_rules=rules,
        any_outcome=getattr(data, "outcome_cb", None) is not None,
        cuts=getattr(data, "child_termination_cb", None) is not None,
        watched=bool(data.start_cbs or data.transition_cbs or data.termination_cbs)
        or any(_may_write_anything(child) for child in container.get_children().values()),
        prepared=get_options(container).on_enter is not None,
        made=frozenset(get_options(container).made_outcomes()),
        empty=isinstance(items, (list, tuple, range, dict, set, str)) and not items,
        ignored=suppression.of_state(container, None),
    )


def _of_leaf(state: State, record: StateRecord) -> Facts:
    callback = _function(state) if type(state).execute is CBState.execute else None
    code = None
    if callback is not None:
        code = source.look_at(callback, userdata=0, owner=None)
    elif _is_foreign(type(state).execute) and "execute" not in vars(state):
        code = source.look_at(type(state).execute, userdata=1, owner=type(state))
    options = get_options(state)
    waits = tuple(_endless_waits(record, code.place if code else None))
    facts = Facts(
        made=frozenset(options.made_outcomes()),
        prepared=options.on_enter is not None,
        waits=waits,
        ignored=suppression.of_state(state, callback),
    )
    if code is None:
        if _is_foreign(type(state)):
            return replace(facts, reads=None)
        callbacks = list(_looked_at(state))
        outside = tuple(found for each in callbacks for found in each.outside)
        return replace(facts, reads=_sent_keys(state, callbacks), outside=outside)
    # An outcome named in the constructor may be declared in some cases, and returned only then.
    known = {*record.outcomes, *source.texts_in_constructors(type(state)), "preempted"}
    returns = code.returns or {}
    return replace(
        facts,
        place=code.place if _is_foreign(type(state)) or isinstance(state, CBState) else None,
        returns=None if code.returns is None else frozenset(code.returns),
        undeclared=tuple(
            (o, place) for o, place in returns.items() if o not in known | code.unsure
        ),
        reads=code.reads,
        changes=code.changes,
        instant=code.is_instant and (options.retry or options.on_enter or options.on_exit) is None,
        reaches=code.reaches,
        waits=waits or code.waits,
        loops=code.loops if type(state).request_preempt is State.request_preempt else (),
        outside=code.outside if _is_foreign(type(state)) or isinstance(state, CBState) else (),
        is_function=isinstance(state, CBState),
    )


def _function(given: Any) -> Callable[..., Any] | None:
    """Return the plain function behind a callback or a CBState, if there is one."""
    callback = given._smachpy.code[0] if isinstance(given, CBState) else given
    callback = callback._cb if isinstance(callback, CBInterface) else callback  # noqa: SLF001
    return callback if inspect.isfunction(callback) else None


def _looked_at(state: State) -> Iterator[source.Code]:
    """Yield what the callbacks of a state of this package do, as far as that is known."""
    for given in state._smachpy.code:
        callback = _function(given.callback.function if isinstance(given, Outgoing) else given)
        code = None if callback is None else source.look_at(callback, userdata=0, owner=None)
        if code is not None:
            yield code


def _sent_keys(state: State, callbacks: Iterable[source.Code]) -> Reads:
    """Return the keys that a state of this package reads to send or test something."""
    keys: set[str] = set()
    sometimes: set[str] = set()
    for code in state._smachpy.code:
        if isinstance(code, Outgoing):
            keys |= {*code.slots} if code.key is None else {code.key, *code.slots}
    for found in callbacks:
        if found.reads is not None:
            keys |= found.reads.always
            sometimes |= found.reads.sometimes
    return Reads(frozenset(keys), frozenset(sometimes - keys))


def _endless_waits(record: StateRecord, place: Place | None) -> Iterator[tuple[str, Place]]:
    limit = _LIMITS.get(record.kind)
    details = dict(record.details)
    if limit is None or limit[0] in details or "timeout" in details:
        return
    if not (record.kind == "condition" and "checks" in details):
        yield limit[1], place or Place("", 0)
