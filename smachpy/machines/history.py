"""History: a machine that was interrupted begins again where it was."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy.engine.described import walk

if TYPE_CHECKING:
    from collections.abc import Mapping


def places(container: Any) -> dict[str, str]:
    """Return where a running machine is: path -> label of the active child, for `remember`.

    Machines inside of it that are active are in it, too. An iterator, which begins with its first
    item, and a concurrence, which begins with all its children, have the label "". With the run's
    lock held.
    """
    frame = container._smachpy.live.frame
    if frame is None or frame.tidying is not None:
        return {}
    found = {frame.path: ""}
    for each in frame.running():
        step = each.step
        if step is None:
            continue
        if hasattr(container._smachpy, "next_initial"):
            found[frame.path] = step.label
        if step.state._smachpy_is_container:
            found.update(places(step.state))
    return found


def remember(state: Any, path: str, found: Mapping[str, str]) -> None:
    """Let the next runs of a machine, and of those below it, begin in these `places`.

    They begin with the userdata that they have.
    """
    for where, each in walk(state, path) if found else ():
        label = found.get(where)
        if label is None or not each._smachpy_is_container:
            continue
        each._smachpy.live.goes_on = "last"
        if label in each._smachpy.children and hasattr(each._smachpy, "next_initial"):
            each._smachpy.next_initial = label


def remembered(state: Any, path: str) -> dict[str, str]:
    """Return the `places` in which the next runs begin, as told to `remember`."""
    return {
        where: getattr(each._smachpy, "next_initial", None) or ""
        for where, each in walk(state, path)
        if each._smachpy_is_container and each._smachpy.live.goes_on == "last"
    }


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
