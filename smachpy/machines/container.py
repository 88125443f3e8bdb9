"""What all containers share: children, userdata, callbacks, construction, the frame of a run."""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]  # `signal` without enums, which are slow
import contextlib
import functools
import inspect
import itertools
import signal
import sys
import threading
from types import MethodType
from typing import TYPE_CHECKING, Any, ClassVar

from actionlib_core.clock import RealClock
from smachpy.context import THREAD
from smachpy.exceptions import InconsistentMachineError, InvalidStateError
from smachpy.introspection import Structure
from smachpy.log import MESSAGES
from smachpy.machines.callbacks import Callbacks
from smachpy.machines.construction import Openable
from smachpy.machines.old_states import as_state
from smachpy.machines.problems import Problems, takes, unknown_name
from smachpy.machines.state import DataOf, Shown, State
from smachpy.run.child import EPOCH, ContainerData
from smachpy.run.frame import Frame, clock_of_run
from smachpy.run.grace import REQUESTING, asking, leave, on_preempt, request, request_soon
from smachpy.run.interrupt import Interruption
from smachpy.run.options import retry_problems
from smachpy.run.threads import already_runs, execute_root
from smachpy.run.visit import Origin
from smachpy.slips import accepts
from smachpy.userdata.user_data import (
    CheckedDict,
    Remapper,
    UserData,
    data_of,
    reset,
    typed_userdata,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from types import CodeType, FrameType
    from typing import Unpack

    from smachpy.events.control import Control
    from smachpy.machines.state import StateOptions

__all__ = ["Container"]

NO_STATES = "states: got none; expected at least one. Try add()."


class Container(Openable, Callbacks, State):
    """A state made of states.

    Args:
        outcomes: Outcomes.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        name: Name of the machine when it is the root, first part of every path below it.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        **options: See `StateOptions`.

    Attributes:
        userdata: The container's own userdata, kept between runs (see `reset_userdata`).
        name: See above.
    """

    _smachpy_is_container: ClassVar[bool] = True
    _smachpy: DataOf[ContainerData] = DataOf(ContainerData)
    _smachpy_replaces: ClassVar[bool] = False
    """Whether SMACH's container of this kind replaced a child by another one of its label."""
    name: str | None = None
    _states = Shown(lambda container: container._smachpy.children)
    _remappings = Shown(lambda container: container._smachpy.remappings)
    _is_running = Shown(lambda container: container._smachpy.frame is not None)

    def __init__(
        self,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        with problems:
            State.__init__(self, outcomes, input_keys, output_keys, **options)
        with problems:
            self.userdata = UserData() if userdata_type is None else typed_userdata(userdata_type)
        if name is not None:
            self.name = problems.word("name", name)
        problems.raise_all()
        # Emptied here, not only in ContainerData: a second call of __init__ starts from scratch.
        data = self._smachpy
        data.children, data.remappings = {}, {}
        data.start_cbs, data.transition_cbs, data.termination_cbs = [], [], []

    # -- structure -----------------------------------------------------------------------------

    def _repr_svg_(self) -> str | None:
        """Return the picture that a Jupyter notebook shows."""
        from smachpy.pictures import draw_svg

        return draw_svg(self)

    def __getitem__(self, key: str) -> State:
        """Return the child with this label."""
        try:
            child: State = self._smachpy.children[key]
        except KeyError:
            what = f"{type(self).__name__}: no such state"
            raise KeyError(unknown_name(what, key, self._smachpy.children)) from None
        return child

    def get_children(self) -> dict[str, State]:
        """Return label -> child, in the order in which they were added."""
        return self._smachpy.children

    def set_initial_state(
        self, initial_states: Sequence[str], userdata: UserData | None = None
    ) -> None:
        """Choose where the next run begins, and update the userdata.

        Args:
            initial_states: Labels.
            userdata: Values to set in the container's userdata; None changes nothing.

        Raises:
            InvalidStateError: a label is unknown.
        """
        known = self._smachpy.children
        for label in initial_states:
            if label not in known:
                raise InvalidStateError(unknown_name("initial state", label, known))
        if userdata is not None:
            self.userdata.update(userdata)

    def get_initial_states(self) -> list[str]:
        """Return the labels of the children that run first: all of them."""
        return list(self._smachpy.children)

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the edges as (outcome, from label, to label or container outcome)."""
        edges = self.describe_structure().transitions
        return [(edge.outcome, edge.source, edge.target) for edge in edges]

    def describe_structure(self) -> Structure:
        """Return the children; the kinds of containers add what is between them."""
        data = self._smachpy
        children = tuple(
            (label, state, tuple(data.remappings[label].items()))
            for label, state in data.children.items()
        )
        return Structure(children, tuple(self.get_initial_states()))

    def find_problems(self, where: str) -> tuple[str, ...]:
        """Return the problems of this container itself, not of its children."""
        raise NotImplementedError

    def check_consistency(self) -> None:
        """Check this container and all containers below it.

        Raises:
            InconsistentMachineError: with all problems found.
        """
        where = f"/{self.name or 'SM_ROOT'}"
        problems = [*self.__own_problems(where), *_all_problems(self, where)]
        if problems:
            raise InconsistentMachineError(f"{type(self).__name__} {where!r}", problems)

    def __own_problems(self, where: str) -> Iterator[str]:
        """Yield the problems of its options; those of a child are found by `add`."""
        data = self._smachpy
        if data.options.retry is not None:
            for problem in retry_problems(data.options, data.outcomes):
                yield f"{where}: {problem}"

    def is_running(self) -> bool:
        """Return whether the container is running."""
        return self._smachpy.frame is not None

    def wait_ended(self, timeout: float | None = None) -> bool:
        """Wait until the container is not running.

        Returns:
            Whether it ended within `timeout` [s].

        Raises:
            InvalidStateError: `timeout` is not a duration.

        Blocks: until then; None waits for ever.
        """
        problems = Problems(type(self).__name__)
        timeout = problems.seconds("wait_ended: timeout", timeout)
        problems.raise_all()
        data, ended = self._smachpy, clock_of_run().event()
        data.end_waiters.append(ended)
        try:
            # First register, then look at `data.frame`; the end of `__run` does it the other way
            # round, so a run that ends in between is noticed here or sets the event.
            return data.frame is None or ended.wait(timeout)
        finally:
            data.end_waiters.remove(ended)

    def reset_userdata(self) -> None:
        """Reset the userdata of this container and of all below it to the defaults, or to empty."""
        reset(self.userdata)
        for child in self.get_children().values():
            if isinstance(child, Container):
                child.reset_userdata()

    def _smachpy_store_child(
        self,
        label: object,
        state: object,
        remapping: Mapping[str, str] | None,
        problems: Problems | None = None,
    ) -> State:
        """Add a child and return it: `state`, or a state that runs it if it is no `State`.

        Raises:
            InvalidStateError: an argument is wrong, or `problems` has some already.
        """
        # `accepts`: programs for ROS 1 are known to make these mistakes and must still run.
        if not isinstance(label, str) or not label:
            problem = f"label: got {label!r}; expected a string, not empty."
            if not isinstance(label, str) or not accepts(problem):
                raise InvalidStateError(problem)
        problems = problems or Problems(label)
        if label in self._smachpy.children:
            problem = (
                "label is taken: got a second state with it; expected a label not in "
                f"{sorted(self._smachpy.children)}."
            )
            if not (self._smachpy_replaces and accepts(f"{label}: {problem}")):
                problems.add(problem)
        state = as_state(state, label)
        if isinstance(state, State):
            with problems:
                problems.add(*state_problems(state))
            if any(each is self for each in below(state)):
                problems.add(f"state: got {state!r}, which contains this container.")
        else:
            hint = f" Try {state.__name__}()." if isinstance(state, type) else ""
            problems.add(f"state: got {state!r}; expected an instance of State.{hint}")
        names = problems.names_of("remapping", remapping, "key of the state -> key here")
        problems.raise_all()
        assert isinstance(state, State)
        self._smachpy.children[label] = state
        self._smachpy.remappings[label] = names
        self._smachpy.plan = self._smachpy.plain_plan = None
        return state

    def _smachpy_exchange(self, label: str, state: State) -> None:
        """Replace a child between two runs, by a test double for instance."""
        self._smachpy.children[label] = state
        self._smachpy.plan = self._smachpy.plain_plan = None

    # -- running -------------------------------------------------------------------------------

    def execute(self, parent_ud: UserData | Remapper | None = None) -> str:
        """Run to the end and return the outcome.

        Args:
            parent_ud: The userdata from which input keys are copied and to which output keys are.

        Raises:
            InconsistentMachineError: the machine has structural problems.
            InvalidUserCodeError: a state or callback raised; the cause is chained.
            InvalidTransitionError: a state returned something that is not one of its outcomes.
            InvalidStateError: the machine is running already.
            KeyboardInterrupt: in the main thread, at the second Ctrl-C.

        Blocks: until the machine has ended; after a preempt, see docs/preemption.md.
        Threads: any, one run at a time. In the main thread the states run in it; otherwise they run
            in a helper thread, which can be left behind.
        """
        first: Frame | None = THREAD.get()
        parent = None if first is None else first.innermost
        if first is None or parent is None:
            # `Container.execute`, not `self.execute`: an override has called this method already.
            return execute_root(self, MethodType(Container.execute, self), parent_ud)
        step = parent.step
        frame = Frame()
        frame.container, frame.data, frame.parent = self, self._smachpy, parent
        frame.run, frame.first = parent.run, first
        frame.above, frame.visit, frame.answered = step, None, False
        callback = parent.data.callback
        if callback is not None and callback.parent is parent:
            step = callback.step  # a callback of the parent runs this container
        if step is None or step.state is self:  # the usual case: the parent runs it as its child
            return self.__run(frame, parent_ud)
        if frame.data.frame is not None:
            raise already_runs(frame.path)
        # The user's code calls `execute` inside a state, maybe in a thread that it has started. A
        # preempt of the state must reach this container, which is not one of the children.
        token = None
        if first.thread != threading.get_ident():
            frame.begin_thread()
            token = THREAD.set(frame)
        forget = on_preempt(step.state, self.request_preempt)
        try:
            return self.__run(frame, parent_ud)
        finally:
            forget()
            if token is not None:
                THREAD.reset(token)
                frame.end_thread()

    _smachpy_execute: ClassVar[object] = execute

    def __run(self, frame: Frame, parent_ud: UserData | Remapper | None) -> str:
        """Run in `frame`: copy the keys, call the callbacks, run the children."""
        data = frame.data
        plan = data.plan
        # Compiled again only if something has changed. The windows of a plan refer to one userdata
        # object, so replacing `self.userdata` makes the plan stale as well.
        if plan is None or plan.userdata is not self.userdata or plan.epoch is not EPOCH.value:
            plan = data.plan = self.__current_plan(frame, plan)
        if data.frame is not None or data.callback is not None:
            return self.__run_inside(frame, parent_ud)
        raised = True
        try:
            data.frame = frame.first.innermost = frame
            if data.listeners or data.buffers:
                frame.run.watched = True
            # A durable run that goes on inside this container has its userdata from the journal.
            journal = frame.run.journal
            resumed = journal is not None and journal.resumes(frame)
            if data.input_keys and parent_ud is not None and not resumed:
                self.__copy_keys(data.input_keys, "input", parent_ud, self.userdata)
            try:
                outcome = self._smachpy_run_children(frame, plan)
            except Interruption:  # a callback outlasted its grace
                outcome = self.__interrupted(frame)
            if data.termination_cbs:
                outcome = self.__call_at_end(frame, outcome)
            if data.output_keys and parent_ud is not None:
                self.__copy_keys(data.output_keys, "output", self.userdata, parent_ud)
            raised = False
            return outcome
        finally:
            frame.first.innermost = frame.parent or frame
            # A requester in another thread sets `_preempt_requested` and then reads `data.frame`
            # (`smachpy.run.grace.pass_on`). Here `data.frame` is cleared first and the flag read
            # after it. So at least one of the two sees the other, and no flag is left for the next
            # run, without taking a lock at the end of each run.
            if data.frame is frame:
                data.frame = None
                data.answered = frame.answered
            if raised or self._preempt_requested or frame.visit is not None or data.end_waiters:
                leave(frame)

    def __run_inside(self, frame: Frame, parent_ud: UserData | Remapper | None) -> str:
        """Run for the user's override of `execute`, whose grace pauses while the children run."""
        data = self._smachpy
        if data.frame is not None:
            raise already_runs(frame.path)
        around = data.callback
        around.end()
        try:
            return self.__run(frame, parent_ud)
        finally:
            if not frame.dead:
                around.begin()

    def __interrupted(self, frame: Frame) -> str:
        """Return the outcome of the container after one of its callbacks was interrupted."""
        if frame.dead:
            raise Interruption
        return "preempted" if frame.answered else frame.end_preempted()

    def __call_at_end(self, frame: Frame, outcome: str) -> str:
        labels, frame.step = self._smachpy_terminal_labels(frame), None
        try:
            self.call_termination_cbs(labels, outcome)
        except Interruption:
            return self.__interrupted(frame)
        return outcome

    def _smachpy_terminal_labels(self, frame: Frame) -> list[str]:  # noqa: ARG002  overridden
        """Return the children that ended last: all of them."""
        return list(self._smachpy.children)

    def __current_plan(self, frame: Frame, plan: Any) -> Any:
        """Return a plan for the children as they are now.

        Raises:
            InconsistentMachineError: the container has problems.
        """
        epoch = EPOCH.value  # read first: a change during compilation makes the plan stale again
        if plan is None or plan.userdata is not self.userdata or plan.is_stale():
            if any((*self.__own_problems(""), *problems_of(self, ""))):
                where = frame.path  # expensive, so it is made only for the error text
                problems = (*self.__own_problems(where), *problems_of(self, where))
                raise InconsistentMachineError(f"{type(self).__name__} {where!r}", problems)
            plan = self._smachpy_compile()
        plan.epoch = epoch
        return plan

    def _smachpy_compile(self) -> Any:
        """Return the plan of this container, which has no problems."""
        raise NotImplementedError

    def _smachpy_run_children(self, frame: Frame, plan: Any) -> str:
        """Run the children and return the outcome."""
        raise NotImplementedError

    def request_preempt(self, *, by: str = "") -> None:
        """Ask the container and all active states below it to stop.

        A request before a run ends that run at once. When this returns, every active descendant has
        been asked. Inside a signal handler the request is only noted, and another thread passes it
        on at once.

        Args:
            by: Who asks, for viewers and recordings; "" finds it out where possible (see
                `smachpy.events.PreemptRequested`).

        Threads: any thread, callback or signal handler; never waits for a state.
        """
        if REQUESTING.get() is self:  # `super().request_preempt()` of an override that was called
            return
        name = signal_being_handled()
        if name:
            self.__note_request(Origin("program", by) if by else Origin("signal", name))
            return
        token = REQUESTING.set(self)
        try:
            with asking("program", by) if by else contextlib.nullcontext():
                run = request(self)
        finally:
            REQUESTING.reset(token)
        if run is not None and run.pending:
            run.flush()

    # To find out whether a subclass overrides the method.
    _smachpy_request_preempt: ClassVar[object] = request_preempt

    def __note_request(self, origin: Origin) -> None:
        """Note a request from a signal handler: no locks, as the interrupted code may hold any."""
        data = self._smachpy
        frame = data.root or data.frame
        if frame is None:
            data.origin = origin
            self._preempt_requested = True
            return

        def ask() -> None:
            with asking(*origin):
                request_soon(self, frame)

        # A new clock, because the interrupted code may hold the locks of the run's clock.
        RealClock().spawn(ask, name=f"preempt of {frame.here()}")

    def __copy_keys(self, keys: Iterable[str], what: str, source: Any, target: Any) -> None:
        for key in keys:
            if key in source:
                target[key] = source[key]
            else:
                MESSAGES.warn(f"{type(self).__name__}: {what} key {key!r} has no value to copy.")

    @Shown
    def control(self) -> Control:
        """The operator's control of this machine: pause, step, jump and so on; see `Control`."""
        return control_of(self)


def control_of(container: Container) -> Control:
    """Return the operator's control of a container, even if the user has an attribute `control`."""
    from smachpy.events.control import Control

    data = container._smachpy
    if data.control is None:
        data.control = Control(container)
    assert isinstance(data.control, Control)
    return data.control


def state_problems(state: State) -> Iterator[str]:
    """Yield the problems of `state` itself, such as an `execute` that cannot be called.

    Raises:
        InvalidStateError: its `__init__` did not call that of `State`.
    """
    yield from retry_problems(state._smachpy.options, state.get_registered_outcomes())
    execute: Any = state.execute
    if not callable(execute):
        yield f"execute: got {execute!r}; expected a method execute(self, userdata)."
    elif not takes(execute, 1):
        name = type(state).__name__
        problem = (
            f"execute: got {name}.execute{inspect.signature(execute, follow_wrapped=False)}, which "
            "cannot be called with the userdata; expected `def execute(self, userdata):`."
        )
        if not accepts(problem):
            yield problem


def below(state: State) -> Iterator[State]:
    """Yield `state` and all states below it."""
    yield state
    if isinstance(state, Container):
        for child in state.get_children().values():
            yield from below(child)


def _all_problems(container: Container, where: str) -> Iterator[str]:
    yield from problems_of(container, where)
    for label, child in container.get_children().items():
        if isinstance(child, Container):
            yield from _all_problems(child, f"{where}/{label}")


def problems_of(container: Container, where: str) -> Iterator[str]:
    """Yield the problems of `container` and of its typed userdata, not those of its children."""
    data = data_of(container.userdata)
    if isinstance(data, CheckedDict):
        fields = data.fields
        for label, state in container.get_children().items():
            names = container._smachpy.remappings[label]
            keys = (*state.get_registered_input_keys(), *state.get_registered_output_keys())
            for key in dict.fromkeys(names.get(key, key) for key in keys):
                if "." not in key and key not in fields.types:
                    what = f"{where}/{label}: userdata key is no field of {fields.kind.__name__}"
                    yield unknown_name(what, key, fields.types)
    yield from container.find_problems(where)


_MAX_ARGUMENTS = 4  # of a signal handler: self, the number, the interrupted frame, one default


def signal_being_handled() -> str:
    """Return the name of the signal whose handler (the program's own) is running here, or "".

    A handler is recognised by its code object. One that has already installed another handler for
    its signal is recognised by its arguments: Python calls it with the signal's number and the
    interrupted frame, which is also its caller.
    """
    # CPython runs Python signal handlers in the main thread only.
    if threading.current_thread() is not threading.main_thread():
        return ""
    handlers: dict[CodeType, int] = {}
    for number in range(1, signal.NSIG):
        handler = _signal.getsignal(number)
        if handler is None or isinstance(handler, int):  # installed by C code, SIG_IGN or SIG_DFL
            continue
        code = _code_of(handler)
        if code is not None:
            handlers[code] = number
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        found = handlers.get(frame.f_code)
        if found is None and frame.f_back is not None:
            found = _number_given(frame)
        if found is not None:
            return signal.Signals(found).name
        frame = frame.f_back
    return ""


def _code_of(handler: Any) -> CodeType | None:
    """Return the code of a handler: a function, method, partial, or object with `__call__`."""
    while isinstance(handler, functools.partial):
        handler = handler.func
    function = getattr(handler, "__func__", handler)
    code = getattr(function, "__code__", None)
    if code is None and callable(handler):
        code = getattr(getattr(type(handler), "__call__", None), "__code__", None)  # noqa: B004
    return code


def _number_given(frame: FrameType) -> int | None:
    """Return the signal's number if `frame` was called with the arguments of a signal handler."""
    code = frame.f_code
    names = code.co_varnames[: code.co_argcount + bool(code.co_flags & inspect.CO_VARARGS)]
    if not names or len(names) > _MAX_ARGUMENTS:
        return None
    local = frame.f_locals
    given: list[Any] = []
    for name in names:
        value = local.get(name)
        given += value if isinstance(value, tuple) else [value]
    for number, interrupted in itertools.pairwise(given):
        if interrupted is frame.f_back and isinstance(number, int):
            return int(number) if number in signal.valid_signals() else None
    return None
