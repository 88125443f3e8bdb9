"""What is known of the states of a machine: from the objects and from their source."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

from smachpy._runtime.messages import Outgoing
from smachpy.checks import leaves, suppression
from smachpy.checks._core.model import Facts, OutcomeRule, Place
from smachpy.concurrence import Concurrence
from smachpy.container import Container
from smachpy.iterator import Iterator as IteratorState
from smachpy.state import CBState, State
from smachpy.util import CBInterface

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from smachpy.introspection import StateRecord

# Kinds of states that wait for something outside, and the detail that says how long.
_LIMITS = {
    "action": ("exec_timeout", "the goal"),
    "service": ("timeout", "the call"),
    "monitor": ("timeout", "the wait for a message"),
    "condition": ("timeout", "the wait for the condition"),
}


def collect(machine: State, record: StateRecord) -> dict[str, Facts]:
    """Return path -> what is known, for a machine and all below it."""
    return {path: _facts(state, found) for path, state, found in _walk(machine, record)}


def _walk(state: State, record: StateRecord) -> Iterator[tuple[str, State, StateRecord]]:
    yield record.path, state, record
    children: Mapping[str, State] = state.get_children() if isinstance(state, Container) else {}
    for child in record.children:
        yield from _walk(children[child.label], child)


def _facts(state: State, record: StateRecord) -> Facts:
    ignored = suppression.of_state(state, _callback_of(state))
    if isinstance(state, Container):
        return _of_container(state, ignored)
    return _of_leaf(state, record, ignored)


def _of_container(container: Container, ignored: dict[str, str]) -> Facts:
    rules: tuple[OutcomeRule, ...] = ()
    if isinstance(container, Concurrence):
        rules = tuple(
            OutcomeRule(outcome, rule.need, rule.conditions)
            for outcome, rule in container._rules  # noqa: SLF001  one house
        )
    callbacks = (
        container._start_cbs,  # noqa: SLF001
        container._transition_cbs,  # noqa: SLF001
        container._termination_cbs,  # noqa: SLF001
    )
    return Facts(
        preset=frozenset(container.userdata.keys()),
        outcome_rules=rules,
        any_outcome=getattr(container, "_outcome_cb", None) is not None,
        cuts=getattr(container, "_child_termination_cb", None) is not None,
        watched=any(callbacks),
        made=_made(container),
        empty=isinstance(container, IteratorState) and _is_empty(container._items),  # noqa: SLF001
        ignored=ignored,
    )


def _is_empty(items: Any) -> bool:
    return isinstance(items, (list, tuple, range, dict, set, str)) and not items


def _of_leaf(state: State, record: StateRecord, ignored: dict[str, str]) -> Facts:
    code = _code_of(state)
    waits = tuple(_endless_waits(record, code.place if code else None))
    if code is None:
        return Facts(waits=waits, made=_made(state), reads=_used(state), ignored=ignored)
    is_own = not _is_ours(state)
    returns, undeclared = _outcomes(record, code)
    return Facts(
        place=code.place if is_own or isinstance(state, CBState) else None,
        returns=returns,
        made=_made(state),
        undeclared=undeclared,
        reads=code.reads,
        waits=waits or code.waits,
        loops=code.loops if type(state).request_preempt is State.request_preempt else (),
        is_function=isinstance(state, CBState),
        ignored=ignored,
    )


def _is_ours(state: State) -> bool:
    return type(state).__module__.partition(".")[0] == "smachpy"


def _code_of(state: State) -> leaves.Code | None:
    """Return what is known of the user's code in a leaf."""
    callback = _callback_of(state)
    if callback is not None:
        return leaves.look_at(callback, userdata=0, owner=None)
    execute = type(state).execute
    if execute.__module__.partition(".")[0] == "smachpy" or "execute" in vars(state):
        return None
    return leaves.look_at(execute, userdata=1, owner=type(state))


def _callback_of(state: State) -> Callable[..., Any] | None:
    """Return the function that a callback state calls, if it is a plain one."""
    if isinstance(state, CBState) and type(state).execute is CBState.execute:
        return _function(state._cb)  # noqa: SLF001  one house
    return None


def _function(given: Any) -> Callable[..., Any] | None:
    callback = given._cb if isinstance(given, CBInterface) else given  # noqa: SLF001  one house
    return callback if inspect.isfunction(callback) else None


def _used(state: State) -> frozenset[str] | None:
    """Return the keys that a state of this package certainly reads; None for other states."""
    if not _is_ours(state):
        return None
    keys: set[str] = set()
    callbacks = [getattr(state, "_cond_cb", None)]
    for sent in (getattr(state, "_goal", None), getattr(state, "_request", None)):
        if isinstance(sent, Outgoing):
            keys |= {*sent.slots} if sent.key is None else {sent.key, *sent.slots}
            callbacks.append(sent.callback.function)
    for callback in map(_function, callbacks):
        code = None if callback is None else leaves.look_at(callback, userdata=0, owner=None)
        keys |= set((code.reads if code else None) or ())
    return frozenset(keys)


def _outcomes(
    record: StateRecord, code: leaves.Code
) -> tuple[frozenset[str] | None, tuple[tuple[str, Place], ...]]:
    """Return what the leaf can end with, and what it returns without having declared it."""
    if code.returns is None:
        return None, ()
    undeclared = tuple(
        (outcome, place)
        for outcome, place in code.returns.items()
        if outcome not in record.outcomes and outcome != "preempted"  # the answer to a preempt
    )
    return frozenset(code.returns), undeclared


def _made(state: State) -> frozenset[str]:
    """Return the outcomes that the options of a state give it."""
    made = set((state.on_exception or {}).values())
    if state.timeout is not None:
        made.add(state.timeout_outcome)
    return frozenset(made)


def _endless_waits(record: StateRecord, place: Place | None) -> Iterator[tuple[str, Place]]:
    limit = _LIMITS.get(record.kind)
    details = dict(record.details)
    if limit is None or limit[0] in details or "timeout" in details:
        return
    if record.kind == "condition" and "checks" in details:
        return
    yield limit[1], place or Place("", 0)
