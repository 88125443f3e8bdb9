"""What all containers share: children, userdata, callbacks, construction, the frame of a run."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

from smachpy import log
from smachpy._construction import Openable
from smachpy._core.typed import CheckedDict
from smachpy._runtime.asker import asking, current_asker
from smachpy._runtime.callbacks import Callbacks
from smachpy._runtime.frame import FRAME, Frame
from smachpy._runtime.root import execute_root
from smachpy._runtime.step import Step
from smachpy._runtime.watch import arm, disarm, grace_of
from smachpy.events import PreemptRequested, TimedOut
from smachpy.exceptions import (
    InconsistentMachineError,
    InvalidStateError,
    did_you_mean,
)
from smachpy.state import EPOCH, State
from smachpy.user_data import UserData, reset, typed_userdata

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from typing import Unpack

    from actionlib_core.clock import Event as ClockEvent
    from smachpy._runtime.asker import Asker
    from smachpy._runtime.guarded import Timeout
    from smachpy.control import Control
    from smachpy.state import StateOptions
    from smachpy.user_data import Remapper

__all__ = ["Container"]


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

    is_container: ClassVar[bool] = True
    name: str | None = None
    _end_waiters: tuple[ClockEvent, ...] = ()
    _asker: Asker | None = None  # of a preempt that came before the run

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
        State.__init__(self, outcomes, input_keys, output_keys, **options)
        Openable.__init__(self)
        Callbacks.__init__(self)
        self.userdata = UserData() if userdata_type is None else typed_userdata(userdata_type)
        if name is not None:
            self.name = name
        self._states: dict[str, State] = {}
        self._remappings: dict[str, dict[str, str]] = {}
        self._frame: Frame | None = None
        self._plan: Any = None
        self._control: Control | None = None
        self._answered = False  # the last run ended because a preempt was taken up
        # Held while a preempt is passed on, and by the runner when it ends a child: re-entrant,
        # because a signal handler may come in between.
        self._lock = threading.RLock()

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy of the container needs: the structure and the userdata, no run."""
        state = dict(self.__dict__)
        for name in ("_lock", "_frame", "_plan", "_control", "_group"):
            state.pop(name, None)
        return {**state, "_listeners": (), "_tapes": (), "_end_waiters": (), "_open_tokens": []}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take the structure and userdata over; not running."""
        self.__dict__.update(state)
        self._lock = threading.RLock()
        self._frame = self._plan = self._control = None

    # -- structure -----------------------------------------------------------------------------

    def _repr_svg_(self) -> str | None:
        """Return the picture that a notebook shows."""
        from smachpy.pictures import draw_svg

        return draw_svg(self)

    def __getitem__(self, key: str) -> State:
        """Return the child with this label."""
        try:
            return self._states[key]
        except KeyError:
            self._no_child(key)

    def get_children(self) -> dict[str, State]:
        """Return label -> child, in the order in which they were added."""
        return self._states

    def set_initial_state(
        self, initial_states: Sequence[str], userdata: UserData | None = None
    ) -> None:
        """Choose where the next run begins, and add to the userdata."""
        raise NotImplementedError

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the edges inside as (outcome, from label, to label or container outcome)."""
        raise NotImplementedError

    def find_problems(self, where: str) -> tuple[str, ...]:
        """Return what is wrong with this container itself, its children left out."""
        raise NotImplementedError

    def check_consistency(self) -> None:
        """Check this container and all below it.

        Raises:
            InconsistentMachineError: with all problems found.
        """
        where = f"/{self.name or 'SM_ROOT'}"
        problems = [*_all_problems(self, where)]
        if problems:
            raise InconsistentMachineError(f"{type(self).__name__} {where!r}", problems)

    def is_running(self) -> bool:
        """Tell whether it runs."""
        return self._frame is not None

    def wait_ended(self, timeout: float | None = None) -> bool:
        """Wait until it does not run.

        Returns:
            Whether that came within `timeout` [s].

        Blocks: until then; None waits for ever.
        """
        ended = self._clock().event()
        with self._lock:
            self._end_waiters = (*self._end_waiters, ended)
        try:
            # First the mark, then the look: see the end of `_run`.
            return self._frame is None or ended.wait(timeout)
        finally:
            with self._lock:
                self._end_waiters = tuple(e for e in self._end_waiters if e is not ended)

    def reset_userdata(self) -> None:
        """Bring the userdata, also of all containers below, back to its defaults, or to none."""
        reset(self.userdata)
        for child in self.get_children().values():
            if isinstance(child, Container):
                child.reset_userdata()

    def _store_child(
        self, label: object, state: object, remapping: Mapping[str, str] | None
    ) -> None:
        if not isinstance(label, str) or not label:
            raise InvalidStateError(f"label: got {label!r}; expected a string, not empty.")
        if label in self._states:
            raise InvalidStateError(
                f"{label}: label is taken: got a second state with it; expected a label not in "
                f"{sorted(self._states)}."
            )
        if not isinstance(state, State):
            hint = f" Try {state.__name__}()." if isinstance(state, type) else ""
            raise InvalidStateError(
                f"{label}: state: got {state!r}; expected an instance of State.{hint}"
            )
        self._states[label] = state
        self._remappings[label] = dict(remapping or {})
        self._plan = None

    def _no_child(self, key: str) -> NoReturn:
        labels = sorted(self.get_children())
        raise KeyError(
            f"{type(self).__name__}: no such state: got {key!r}; expected one of {labels}."
            f"{did_you_mean(key, labels)}"
        ) from None

    # -- running -------------------------------------------------------------------------------

    def execute(self, parent_ud: UserData | Remapper | None = None) -> str:
        """Run to the end and return the outcome.

        Args:
            parent_ud: Where input keys are copied from and output keys to.

        Raises:
            InconsistentMachineError: the machine does not hold together.
            InvalidUserCodeError: a state or callback raised; the cause is chained.
            InvalidTransitionError: a state returned something that is none of its outcomes.

        Blocks: until the machine has ended; after a preempt, see docs/preemption.md.
        Threads: one run at a time; from several threads one after another.
        """
        parent = FRAME.get()
        if parent is None:
            return execute_root(self, parent_ud)
        frame = Frame(self, parent)
        step = parent.step
        if step is None or step.state is self:
            return self._run(frame, parent_ud)
        # A state runs this container by hand, maybe in a thread that it has started: a preempt of
        # the state is one of the container.
        frame.thread = threading.get_ident()
        if frame.thread != parent.thread:
            frame.boundary = None
        forget = step.state._on_preempt(self.request_preempt)  # noqa: SLF001  a state too
        try:
            return self._run(frame, parent_ud)
        finally:
            forget()

    def _run(self, frame: Frame, parent_ud: UserData | Remapper | None) -> str:
        """Run in `frame`: copy the keys, call the callbacks, run the children."""
        plan = self._plan
        if plan is None or plan.userdata is not self.userdata or plan.epoch != EPOCH.value:
            plan = self._plan = self._current_plan(frame, plan)
        if self._frame is not None:
            raise InvalidStateError(
                f"{frame.path}: execute: got a second call while it runs; expected one run at a "
                "time."
            )
        self._frame = frame
        token = FRAME.set(frame)
        try:
            if self._listeners or self._tapes:
                frame.run.watched = True
            if parent_ud is not None:
                self._copy_input_keys(parent_ud, self.userdata)
            outcome = self._run_children(frame, plan)
            if parent_ud is not None:
                self._copy_output_keys(self.userdata, parent_ud)
            return outcome
        finally:
            FRAME.reset(token)
            # Whoever passes a preempt on sets its mark first and looks at the frame then; here
            # it is the other way round, so one of the two always sees the other.
            if self._frame is frame:
                self._frame = None
                self._answered = frame.answered
            if self._preempt_requested or frame.told is not None or self._end_waiters:
                self._leave(frame)

    def _current_plan(self, frame: Frame, plan: Any) -> Any:
        """Return a plan for the states as they are now."""
        epoch = EPOCH.value
        if plan is None or plan.userdata is not self.userdata or plan.is_stale():
            plan = self._compile(frame)
        plan.epoch = epoch
        return plan

    def _compile(self, frame: Frame) -> Any:
        """Return this container's plan.

        Raises:
            InconsistentMachineError: it does not hold together.
        """
        raise NotImplementedError

    def _run_children(self, frame: Frame, plan: Any) -> str:
        """Run the children and return the outcome."""
        raise NotImplementedError

    def _make_step(self, label: str) -> Step:
        return Step(label, self._states[label], self.userdata, self._remappings[label])

    def _leave(self, frame: Frame) -> None:
        """Forget the run; with it ends the preempt that belonged to it."""
        with self._lock:
            if frame.dead:
                return
            if self._preempt_requested and not frame.asked:  # by a hook, or between two attempts
                asker = self._asker
                frame.called_off = asker is None or asker.source != "timeout"
            if self._frame is None:
                self._preempt_requested = False
                for ended in self._end_waiters:
                    ended.set()
            told = frame.told
            if told is not None:
                disarm(frame)
                told.state.recall_preempt()

    def _forget_preempt(self) -> None:
        with self._lock:
            if self._frame is None:
                self._preempt_requested = False

    def request_preempt(self, *, by: str = "") -> None:
        """Ask the container and all active states below it to stop.

        Before a run it ends the next one at once. When it returns, every active descendant has
        been told.

        Args:
            by: Who asks, for those who watch; "" finds out what it can (see
                `smachpy.events.PreemptRequested`).

        Threads: any thread, callback or signal handler; never waits for a state.
        """
        if by:
            with asking("program", by):
                self._preempt()
        else:
            self._preempt()

    def _preempt(self) -> None:
        with self._lock:
            State.request_preempt(self)
            frame = self._frame
            if frame is None:
                self._asker = current_asker()
            else:
                if frame.parent is None:
                    asker = current_asker()
                    frame.asked = True
                    frame.called_off = frame.called_off or asker.source != "timeout"
                    frame.note(frame.path, PreemptRequested, *asker)
                self._tell_children(frame)
        if frame is not None and frame.parent is None:
            frame.run.flush()

    def _tell_children(self, frame: Frame) -> None:
        """Pass the preempt on to what runs; called with the lock held."""
        step = frame.step
        if step is not None:
            self._tell(frame, step)

    def _tell(self, frame: Frame, step: Step) -> None:
        """Ask one child to stop and see that it does; called with the lock held."""
        frame.told = step
        frame.timed_out = False
        if frame.run.watched:
            grace = None if step.state.is_container else grace_of(frame, step)
            fields = (*current_asker(), grace)
            frame.note(f"{frame.path}/{step.label}", PreemptRequested, *fields)
        step.state.request_preempt()
        arm(frame, step)

    def _stop_child(self, frame: Frame, step: Step, override: Any = None) -> bool:
        """Ask the child of `step` to stop, but not this container; tell whether it ran."""
        with self._lock:
            stopped = self._stop_now(frame, step, override)
        frame.run.flush()
        return stopped

    def _stop_now(self, frame: Frame, step: Step, override: Any) -> bool:
        """Do the work of `_stop_child`; called with the lock held."""
        before, frame.told = frame.told, step  # first the mark, then the look: see `_run`
        if frame.step is not step or frame.ended or frame.dead or self._frame is None:
            frame.told = before
            return False
        frame.override = override
        self._tell(frame, step)
        return True

    def _time_out_child(self, frame: Frame, step: Step, timeout: Timeout) -> None:
        """Ask the child of `step` to stop because its time is over, if it has not ended."""
        with self._lock:
            if timeout.ended:
                return
            timeout.passed = True
            alone = frame.told is None
            frame.note(f"{frame.path}/{step.label}", TimedOut, timeout.seconds)
            if self._stop_now(frame, step, None if alone else frame.override):
                frame.timed_out = alone
        frame.run.flush()

    def _running_frames(self, frame: Frame) -> list[Frame]:
        """Return the frames that have a running child each: one, or the concurrence's branches."""
        return [frame]

    def _copy_input_keys(self, parent_ud: UserData | Remapper, ud: UserData) -> None:
        for key in self._input_keys:
            try:
                ud[key] = parent_ud[key]
            except KeyError:
                log.logwarn(f"{type(self).__name__}: input key {key!r} has no value to copy.")

    def _copy_output_keys(self, ud: UserData, parent_ud: UserData | Remapper) -> None:
        for key in self._output_keys:
            try:
                parent_ud[key] = ud[key]
            except KeyError:
                log.logwarn(f"{type(self).__name__}: output key {key!r} has no value to copy.")

    @property
    def control(self) -> Control:
        """The operator's control of this machine: pause, step, jump and so on; see `Control`."""
        if self._control is None:
            from smachpy.control import Control

            self._control = Control(self)
        return self._control


def _all_problems(container: Container, where: str) -> Iterator[str]:
    yield from container.find_problems(where)
    yield from _key_problems(container, where)
    for label, child in container.get_children().items():
        if isinstance(child, Container):
            yield from _all_problems(child, f"{where}/{label}")


def _key_problems(container: Container, where: str) -> Iterator[str]:
    """Yield the keys of children that typed userdata has no field for."""
    data = container.userdata._data  # noqa: SLF001  one machinery
    if not isinstance(data, CheckedDict):
        return
    fields = data.fields
    for label, state in container.get_children().items():
        names = container._remappings[label]  # noqa: SLF001  its own module
        keys = (*state.get_registered_input_keys(), *state.get_registered_output_keys())
        for key in dict.fromkeys(names.get(key, key) for key in keys):
            if "." not in key and key not in fields.types:
                yield (
                    f"{where}/{label}: userdata key is no field of {fields.kind.__name__}: got "
                    f"{key!r}; expected one of {sorted(fields.types)}."
                    f"{did_you_mean(key, fields.types)}"
                )
