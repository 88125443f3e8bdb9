"""How a container runs: in a frame of its own, with its keys, callbacks and children."""

from __future__ import annotations

import copy
import threading
from functools import partial
from typing import TYPE_CHECKING, Any

from smachpy.base.context import THREAD
from smachpy.base.log import MESSAGES
from smachpy.base.slips import accepting
from smachpy.engine.cleanup import run_with_cleanup
from smachpy.engine.described import EPOCH
from smachpy.engine.errors import already_runs
from smachpy.engine.frame import Frame
from smachpy.engine.interrupt import Interruption, uninterrupted
from smachpy.engine.preempt import FLAGS, leave, on_preempt, request_soon
from smachpy.exceptions import InconsistentMachineError
from smachpy.userdata.user_data import begin_visit, data_of, leaves, write

if TYPE_CHECKING:
    from smachpy.engine.described import Parent


def run_container(container: Parent, parent_ud: Any) -> str:
    """Run a container below the state that runs in this context; return the outcome.

    Raises:
        InconsistentMachineError: it has structural problems.
        InvalidUserCodeError, InvalidTransitionError: from its children and callbacks.
        InvalidStateError: it is running already.
        Interruption: the thread was left behind.
    """
    first: Frame = THREAD.get()
    parent = first.innermost
    assert parent is not None
    frame = Frame(container, parent, parent.run, first)
    callback = parent.live.callback
    runs_in_callback = callback is not None and callback.parent is parent
    step = callback.step if runs_in_callback else parent.step
    if step is None or step.state is container:  # the parent runs it as its child
        return _run(frame, parent_ud)
    if frame.live.frame is not None:
        raise already_runs(frame.path)
    # The user's code calls `execute` inside a state, maybe in a thread that it has started. A
    # preempt of the state must reach this container, which is not one of the children.
    token = None
    if first.thread != threading.get_ident():
        frame.begin_thread()
        token = THREAD.set(frame)
    forget = on_preempt(step.state, partial(request_soon, container))
    try:
        return _run(frame, parent_ud)
    finally:
        forget()
        if token is not None:
            THREAD.reset(token)
            frame.end_thread()


def _run(frame: Frame, parent_ud: Any) -> str:
    """Copy the keys, call the callbacks, run the children."""
    container, data, live, run = frame.container, frame.data, frame.live, frame.run
    plan = _current_plan(frame)
    if live.frame is not None:
        raise already_runs(frame.path)
    around = live.callback
    if around is not None:  # the user's override of `execute`: its grace pauses meanwhile
        around.end()
    frame.first.innermost = frame
    try:
        with FLAGS:  # a request comes either before this, or to this run
            live.frame = frame
        if live.listeners or live.buffers:
            run.watched = True
        # A durable run that goes on inside this container has its userdata from the journal.
        has_keys = parent_ud is not None and (data.input_keys or data.output_keys)
        frame.goes_on, live.goes_on = data.history(), ""
        if (has_keys or data.begins_with) and not run.journal.has_begun(frame.path):
            _copy_in(frame, parent_ud)
        try:
            run_children = container._smachpy_run_children
            if data.cleanup:
                outcome = run_with_cleanup(frame, plan.cleanup, partial(run_children, frame, plan))
            else:
                outcome = run_children(frame, plan)
        except Interruption:  # a callback outlasted its grace
            outcome = _interrupted(frame)
        if data.termination_cbs:
            outcome = _call_at_end(frame, outcome)
        if data.output_keys and parent_ud is not None:
            _copy_out(container, parent_ud)
        return outcome
    finally:
        uninterrupted(frame, partial(leave, frame))
        frame.first.innermost = frame.parent
        if around is not None and not frame.dead:
            around.begin()


def _current_plan(frame: Frame) -> Any:
    """Return the children as they are now, compiled.

    Raises:
        InconsistentMachineError: the container has problems.
    """
    container, live = frame.container, frame.live
    plan = live.plan
    # Compiled again only if something has changed. The windows of a plan refer to one userdata
    # object, so replacing `container.userdata` makes the plan stale as well.
    is_of_userdata = plan is not None and plan.userdata is container.userdata
    if is_of_userdata and plan.epoch is EPOCH.value:
        return plan
    epoch = EPOCH.value  # read first: a change during compilation makes the plan stale again
    if not is_of_userdata or plan.is_stale():
        if container._smachpy_problems(""):
            where = frame.path  # expensive, so it is made only for the error text
            problems = container._smachpy_problems(where)
            raise InconsistentMachineError(f"{type(container).__name__} {where!r}", problems)
        plan = live.plan = container._smachpy_compile()
    plan.epoch = epoch
    return plan


def _interrupted(frame: Frame) -> str:
    """Return the outcome of the container after one of its callbacks was interrupted."""
    if frame.dead:
        raise Interruption
    return "preempted" if frame.answered else frame.end_preempted()


def _call_at_end(frame: Frame, outcome: str) -> str:
    container = frame.container
    labels, frame.step = container._smachpy_terminal_labels(frame), None
    try:
        container.call_termination_cbs(labels, outcome)
    except Interruption:
        return _interrupted(frame)
    return outcome


def _copy_in(frame: Frame, parent_ud: Any) -> None:
    container, data, userdata = frame.container, frame.data, frame.container.userdata
    keys, values = data.input_keys, data_of(userdata)
    if parent_ud is not None and not accepting():
        # Programs for ROS 1 keep SMACH's way: values of former visits stay.
        begin_visit(userdata, [key for key in keys if key in parent_ud])
    if data.begins_with and not frame.goes_on:
        write(userdata, copy.deepcopy(data.begins_with))
    for key in keys if parent_ud is not None else ():
        if key in parent_ud:
            values[key] = parent_ud[key]
            continue
        _tell_missing(container, "input", key)
        if not leaves(userdata, key):  # a former visit's, which must not be read for it
            values.pop(key, None)


def _copy_out(container: Parent, parent_ud: Any) -> None:
    userdata = container.userdata
    for key in container._smachpy.output_keys:
        if key not in userdata:
            _tell_missing(container, "output", key)
        elif leaves(userdata, key):
            parent_ud[key] = userdata[key]


def _tell_missing(container: Parent, what: str, key: str) -> None:
    MESSAGES.warn(f"{type(container).__name__}: {what} key {key!r} has no value to copy.")
