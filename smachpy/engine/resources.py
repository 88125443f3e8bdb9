"""A state with the option `resource` holds that resource while it executes, as the only one."""

from __future__ import annotations

import copy
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.node import known_node
from actionlib_core.resources import CircleError, Claim, around_here, inside, resources_on
from smachpy.base import log
from smachpy.base.context import current_frame
from smachpy.engine.interrupt import Interruption
from smachpy.engine.options import REFUSED
from smachpy.engine.preempt import ask, asking, on_preempt
from smachpy.events import ResourceUse
from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Event
    from actionlib_core.resources import Resources
    from smachpy.engine.described import Child
    from smachpy.engine.frame import Frame
    from smachpy.engine.options import Resource


LOOK_S: Final = 0.5
"""How often a state that waits for a mission of another process looks whether it has ended [s]."""


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
    with asking("state", taker.who(), why):
        with frame.run.lock:
            if frame.visit is not visit:
                return
            frame.run.journal.asked_one(frame, step, None)
            ask(frame, step)
        frame.run.journal.commit()
        frame.run.flush_soon()


def _take(frame: Frame, state: Child, all_of: Resources, claim: Claim) -> str | None:
    """Take the resource; return the outcome of the state if it does not get it.

    Blocks: until it is free, or a preempt.
    """
    asked = frame.run.clock.event(f"a request to {frame.here()}")

    def wake() -> None:
        asked.set()
        claim.wake.set()

    forget = on_preempt(state, wake)
    try:
        waited = _wait_for_former(frame, claim, asked)
        if waited is not None:
            waited = _wait_here(frame, all_of, claim, asked, waited=waited)
        # The missions of this process come first: others see one holder in all of it.
        if waited is not None and not asked.is_set() and frame.run.journal.is_durable:
            waited = _wait_outside(frame, all_of, claim, asked, waited=waited)
        if waited is None:
            return REFUSED
        control = frame.run.control
        if waited and control is not None and control.is_paused():  # nothing starts meanwhile
            control.pass_gate(frame, frame.step)
    finally:
        forget()
    if state._preempt_requested or not all_of.holds(claim):
        return "preempted"
    if frame.visit is not None:
        frame.visit.holds = claim.resource
    frame.emit(ResourceUse, claim.resource, "holds")
    return None


def _wait_for_former(frame: Frame, claim: Claim, asked: Event) -> bool | None:
    """Let the state go first that held the resource before a resume; return as `_wait_here`.

    Its goal may still move the robot.
    """
    path, journal = frame.here(), frame.run.journal
    former = journal.former_holder(claim.resource, path)
    if former is None:
        return False
    if _must_not_wait(frame, claim, former):
        return None
    while journal.former_holder(claim.resource, path) and not asked.wait(LOOK_S):
        pass
    return True


def _wait_here(
    frame: Frame, all_of: Resources, claim: Claim, asked: Event, *, waited: bool
) -> bool | None:
    """Wait for the states of this process; return whether it did, None if the claim refuses to.

    `waited`: it did before.
    """
    try:
        holder = all_of.claim(claim)
    except CircleError as error:
        if asked.is_set():  # by who waits for what is around it: it ends, and so does the circle
            return True
        raise InvalidStateError(f"{frame.here()}: resource: {error}") from error
    if holder is None:
        return waited
    if _must_not_wait(frame, claim, holder.who()):
        return None
    if claim.policy == "preempt":
        holder.stop(claim)
        claim.has_asked = True
    claim.wake.wait()
    return True


def _wait_outside(
    frame: Frame, all_of: Resources, claim: Claim, asked: Event, *, waited: bool
) -> bool | None:
    """Wait for the missions of other processes, too; return as `_wait_here`."""
    by = _take_outside(frame, all_of, claim)
    if by is None:
        return waited
    if _must_not_wait(frame, claim, by):
        return None
    while by is not None and not asked.wait(LOOK_S):
        by = _take_outside(frame, all_of, claim)
    return True


def _must_not_wait(frame: Frame, claim: Claim, by: str) -> bool:
    """Tell that `by` holds the resource; return whether the claim refuses to wait for it."""
    refuses = claim.policy == "refuse"
    frame.emit(ResourceUse, claim.resource, REFUSED if refuses else "waits", by)
    what = f"{by} holds it; refused" if refuses else f"waits, held by {by}"
    log.loginfo(f"{frame.here()}: resource {claim.resource}: {what}")
    return refuses


def _take_outside(frame: Frame, all_of: Resources, claim: Claim) -> str | None:
    """Take the resource from the missions of other processes; return who is in the way."""
    journal = frame.run.journal
    others = all_of.others(claim)
    if claim.give is None and any(one.give is not None for one in others):
        return None  # what is around the claim has it from them
    claim.give = partial(journal.give, claim.resource)

    def stop(by: str) -> None:
        taker = copy.copy(claim)
        taker.who = lambda: by
        claim.stop(taker)

    return journal.take(claim.resource, frame.here(), claim.policy, stop)


def _release(frame: Frame, all_of: Resources, claim: Claim) -> None:
    """Release the resource; a pending interruption of the state does not prevent it."""
    while True:
        try:
            if claim.give is not None:
                # Before others here get it, who would take it from the other processes meanwhile.
                left = all_of.others(claim)  # inside of it, in a thread that was left behind
                if left:
                    left[0].give = claim.give
                else:
                    claim.give()
            all_of.release(claim)
            break
        except Interruption:
            continue
    visit = frame.visit
    if visit is not None and visit.holds and not frame.dead:  # else it was never told to hold it
        visit.holds = ""
        frame.emit(ResourceUse, claim.resource, "free")
