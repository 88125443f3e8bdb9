"""A state with the option `resource` holds that resource while it executes, as the only one."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.node import known_node
from actionlib_core.resources import CircleError, Claim, around_here, inside, resources_on
from smachpy.base import log
from smachpy.base.context import current_frame
from smachpy.engine.interrupt import Interruption
from smachpy.engine.options import REFUSED
from smachpy.engine.preempt import ask_child, asking, on_preempt
from smachpy.events import ResourceUse
from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.resources import Resources
    from smachpy.engine.described import Child
    from smachpy.engine.frame import Frame
    from smachpy.engine.options import Resource


def holding(
    state: Child, resource: Resource, execute: Callable[[Any], Any]
) -> Callable[[Any], Any]:
    """Return a function that executes a state while it holds its resource."""

    def run(userdata: Any) -> Any:
        frame: Frame = current_frame()
        claim = _claim(frame, resource)
        all_of = resources_on(frame.run.clock)
        try:
            outcome = _take(frame, state, all_of, claim)
            if outcome is not None:
                return outcome
            with inside(claim):
                return execute(userdata)
        finally:
            _release(frame, all_of, claim)

    return run


def _claim(frame: Frame, resource: Resource) -> Claim:
    node = known_node()
    name = resource.name.lstrip("/") if node is None else node.resolve(resource.name, "resource")
    visits: list[object] = []
    path = frame.here()
    above: Frame | None = frame
    while above is not None:
        visits += [above.visit] if above.visit is not None else []
        above = above.parent
    visits += around_here()

    def who() -> str:
        return f"{path} (its thread was left behind)" if frame.dead else path

    wake = frame.run.clock.event(f"resource {name}, for {path}")
    stop = partial(_stop, frame, frame.step, frame.visit)
    return Claim(name, resource.policy, tuple(visits), who, stop, wake)


def _stop(frame: Frame, step: Any, visit: Any, taker: Claim) -> None:
    """Ask a holder to stop, unless that visit has ended."""
    why = f"takes {taker.resource}"
    with asking("state", taker.who(), why), frame.run.lock:
        if frame.visit is visit:
            frame.run.journal.asked_one(frame, step, None)
            ask_child(frame, step)


def _take(frame: Frame, state: Child, all_of: Resources, claim: Claim) -> str | None:
    """Take the resource; return the outcome of the state if it does not get it.

    Blocks: until it is free, or a preempt.
    """
    forget = on_preempt(state, claim.wake.set)
    try:
        try:
            holder = all_of.claim(claim)
        except CircleError as error:
            raise InvalidStateError(f"{frame.here()}: resource: {error}") from error
        if holder is not None:
            by = holder.who()
            if claim.policy == "refuse":
                frame.emit(ResourceUse, claim.resource, REFUSED, by)
                log.loginfo(f"{frame.here()}: resource {claim.resource}: {by} holds it; refused")
                return REFUSED
            frame.emit(ResourceUse, claim.resource, "waits", by)
            log.loginfo(f"{frame.here()}: waits for resource {claim.resource}, held by {by}")
            if claim.policy == "preempt":
                holder.stop(claim)
            claim.wake.wait()
            control = frame.run.control
            if control is not None and control.is_paused():  # nothing starts meanwhile
                control.pass_gate(frame, frame.step)
    finally:
        forget()
    if state._preempt_requested or not all_of.holds(claim):
        return "preempted"
    if frame.visit is not None:
        frame.visit.holds = claim.resource
    frame.emit(ResourceUse, claim.resource, "holds")
    return None


def _release(frame: Frame, all_of: Resources, claim: Claim) -> None:
    """Release the resource; a pending interruption of the state does not prevent it."""
    while True:
        try:
            all_of.release(claim)
            break
        except Interruption:
            continue
    visit = frame.visit
    if visit is not None and visit.holds and not frame.dead:  # else it was never told to hold it
        visit.holds = ""
        frame.emit(ResourceUse, claim.resource, "free")
