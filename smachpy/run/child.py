"""The library's data of one state or container; all other attributes of it belong to the user.

`smachpy.run` runs what is described here and imports no states; `smachpy.machines` builds them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from smachpy.machines.problems import unique_names
from smachpy.run.options import NO_OPTIONS

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Iterable, Mapping
    from typing import Self, TypeAlias

    from actionlib_core.clock import Event as ClockEvent
    from smachpy.events import Event
    from smachpy.events.buffer import EventBuffer
    from smachpy.run.frame import Frame, Gate, RunJournal
    from smachpy.run.options import Options
    from smachpy.run.visit import Origin
    from smachpy.userdata.user_data import UserData

    Callback: TypeAlias = tuple[Callable[..., object], tuple[Any, ...]]


class _Epoch:
    """Its value is replaced whenever anything changes that a run keeps in a compiled form.

    These are the interfaces of states, and the callbacks, initial states, subscribers and control
    of machines. A run compares one object instead of asking every state below it whether it has
    changed. It is no counter, because two threads that increase one at once may count one change
    only.
    """

    value = object()


EPOCH = _Epoch()


@dataclass(slots=True, eq=False)
class StateData:
    """The library's data of one state.

    Attributes:
        outcomes: Its outcomes.
        input_keys: Keys that it reads.
        output_keys: Keys that it writes.
        options: Its options.
        version: Increases with each change of the above.
        with_hooks: Its options, and the same options with the hooks of its class; None until
            needed.
        preempt_callbacks: Called on each request to stop.
        is_async: Its callback is a coroutine function.
        code: The user's functions that get its userdata, and the messages made from it.
    """

    outcomes: tuple[str, ...] = ()
    input_keys: tuple[str, ...] = ()
    output_keys: tuple[str, ...] = ()
    options: Options = NO_OPTIONS
    version: int = 0
    with_hooks: tuple[Options, Options] | None = None
    is_async: bool = False
    code: tuple[Any, ...] = ()
    preempt_callbacks: list[Callable[[], object]] = field(default_factory=list)

    def add(self, name: str, names: Iterable[str]) -> None:
        """Add outcomes or keys to the attribute `name`."""
        argument = name.replace("_", " ")
        more = unique_names(names, argument)
        setattr(self, name, unique_names((*getattr(self, name), *more), argument))
        self.changed()

    def changed(self) -> None:
        """Mark the plans of all machines with this state as stale."""
        self.version += 1
        EPOCH.value = object()

    def copy(self) -> Self:
        """Return the data for a copy of the state, without anything that belongs to a run."""
        made = type(self)()
        names = ("outcomes", "input_keys", "output_keys", "options", "version", "is_async", "code")
        for name in names:
            setattr(made, name, getattr(self, name))
        return made


@dataclass(slots=True, eq=False)
class ContainerData(StateData):
    """The library's data of one container.

    Attributes:
        children: Label -> child, in the order in which they were added.
        remappings: Label -> key of the child -> key of the container.
        start_cbs: Called at the start of each run; each with its extra arguments.
        transition_cbs: The same, after each transition.
        termination_cbs: The same, at the end.
        open_tokens: One for each `with` block in which it is open.
        context_kwargs: The arguments of `opened`.
        frame: Where it runs; None between runs, and between two attempts of one run.
        root: The root's frame while it runs as the root of a machine.
        lock: The lock of its runs as a root; made once, as that takes as long as entering a
            machine.
        plan: Its children, compiled; None when they have changed.
        plain_plan: The plan of a state machine that is entered just by making a frame, because it
            has no callbacks, listeners or keys to copy. None if it must be called.
        listeners: Called with each event of it and of all below it.
        buffers: Event buffers that take the same events.
        control: The operator's control, once it was used.
        journal: The journal of its next run as a root, or None.
        callback: The frame of its callback or hook that runs now, or None.
        answered: Its last run ended because a request to stop was serviced.
        origin: Who asked it to stop before its run.
        is_passing_on: A request to stop is being passed on to its children.
        end_waiters: Events to set when it stops running.
    """

    children: dict[str, Any] = field(default_factory=dict)
    remappings: dict[str, dict[str, str]] = field(default_factory=dict)
    start_cbs: list[Callback] = field(default_factory=list)
    transition_cbs: list[Callback] = field(default_factory=list)
    termination_cbs: list[Callback] = field(default_factory=list)
    open_tokens: list[Any] = field(default_factory=list)
    context_kwargs: dict[str, Any] = field(default_factory=dict)
    frame: Frame | None = None
    root: Frame | None = None
    lock: threading.RLock | None = None
    plan: Any = None
    plain_plan: Any = None
    listeners: tuple[Callable[[Event], object], ...] = ()
    buffers: tuple[EventBuffer, ...] = ()
    control: Gate | None = None
    journal: RunJournal | None = None
    callback: Any = None  # a smachpy.run.callback.CallbackFrame, which imports this module
    answered: bool = False
    origin: Origin | None = None
    is_passing_on: bool = False
    end_waiters: list[ClockEvent] = field(default_factory=list)

    _kept: ClassVar[tuple[str, ...]] = ()

    def copy(self) -> Self:
        """Return the data for a copy of the container: its structure and callbacks only."""
        made = StateData.copy(self)  # no `super()`: a dataclass with slots is another class
        own = ("children", "remappings", "start_cbs", "transition_cbs", "termination_cbs")
        for name in (*own, *self._kept):
            value = getattr(self, name)
            setattr(made, name, value.copy() if isinstance(value, (dict, list)) else value)
        return made


class Child(Protocol):
    """The part of a state that `smachpy.run` uses."""

    _preempt_requested: bool
    _smachpy_request_preempt: ClassVar[object]

    @property
    def _smachpy(self) -> StateData: ...
    @property
    def _smachpy_is_container(self) -> bool: ...
    @property
    def execute(self) -> Callable[[Any], Any]:
        """Runs the state and returns the outcome; may be a coroutine function."""

    def request_preempt(self) -> None:
        """Ask it to stop; may be overridden by the user."""

    @property
    def _smachpy_grace(self) -> Callable[[Any], Any] | None:
        """Computes its grace from that of its containers; None to use its option."""


class Parent(Child, Protocol):
    """The part of a container that `smachpy.run` uses."""

    @property
    def _smachpy(self) -> ContainerData: ...
    @property
    def name(self) -> str | None:
        """Name of the machine when it is the root."""

    @property
    def userdata(self) -> UserData:
        """Its userdata."""

    def get_initial_states(self) -> list[str]:
        """Return the labels of the children that run first."""

    def get_children(self) -> Mapping[str, Any]:
        """Return label -> child."""
