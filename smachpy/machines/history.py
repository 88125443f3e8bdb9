"""History: a machine that was interrupted begins again where it was."""

from __future__ import annotations

from typing import Any


def remember(container: Any) -> None:
    """Let the next run of a running machine begin where it is now, with the userdata that it has.

    Machines inside of it that are active do the same; an iterator begins with its first item, a
    concurrence with all its children. Called before it is asked to stop, with the run's lock held.
    """
    frame = container._smachpy.live.frame
    if frame is None or frame.tidying is not None:
        return
    container._smachpy.live.goes_on = "last"
    for each in frame.running():
        step = each.step
        if step is None:
            continue
        if hasattr(container._smachpy, "next_initial"):
            container._smachpy.next_initial = step.label
        if step.state._smachpy_is_container:
            remember(step.state)


def forget(state: Any) -> None:
    """Undo `remember`: the next run begins anew."""
    if not state._smachpy_is_container or not state._smachpy.live.goes_on:
        return
    state._smachpy.live.goes_on = ""
    if hasattr(state._smachpy, "next_initial"):
        state._smachpy.next_initial = None
    for child in state._smachpy.children.values():
        forget(child)


def go_on(state: Any) -> None:
    """Let the next run of a machine begin where its last one was interrupted, and all below it."""
    if state._smachpy_is_container and state._smachpy.live.stopped_at:
        state._smachpy.live.goes_on = "deep"
