"""What the library knows of one state or container, in one place: all else in it is the user's.

`smachpy.run` runs what is described here and imports no states; `smachpy.machines` builds them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from smachpy.machines.names import unique_names
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
    """Counts changes of what machines were compiled from, so that nobody has to look everywhere.

    That is the interfaces of states, and the callbacks, listeners and initial states of machines.
    """

    value = 0


EPOCH = _Epoch()


class StateData:
    """What the library knows of one state.

    Attributes:
        outcomes: Its outcomes.
        input_keys: Keys that it reads.
        output_keys: Keys that it writes.
        options: Its options.
        version: Changes with each of these.
        with_hooks: Its options and what they are with the hooks of its class; None when not known.
        preempt_callbacks: Called on each request to stop.
        is_async: Its callback is a coroutine function.
        code: What it runs of the user's: functions that get the userdata, and messages made of it.
    """

    __slots__ = (
        "code",
        "input_keys",
        "is_async",
        "options",
        "outcomes",
        "output_keys",
        "preempt_callbacks",
        "version",
        "with_hooks",
    )

    def __init__(self) -> None:
        self.outcomes: tuple[str, ...] = ()
        self.input_keys: tuple[str, ...] = ()
        self.output_keys: tuple[str, ...] = ()
        self.options = NO_OPTIONS
        self.version = 0
        self.with_hooks: tuple[Options, Options] | None = None
        self.is_async = False
        self.code: tuple[Any, ...] = ()
        self.preempt_callbacks: list[Callable[[], object]] = []

    def add(self, name: str, names: Iterable[str]) -> None:
        """Add outcomes or keys to the attribute `name`."""
        argument = name.replace("_", " ")
        more = unique_names(names, argument)
        setattr(self, name, unique_names((*getattr(self, name), *more), argument))
        self.changed()

    def changed(self) -> None:
        """Say that machines with this state are to be compiled again."""
        self.version += 1
        EPOCH.value += 1

    def copy(self) -> Self:
        """Return the data for a copy of the state, which does not run and nobody waits for."""
        made = type(self)()
        for name in ("outcomes", "input_keys", "output_keys", "options", "version", "code"):
            setattr(made, name, getattr(self, name))
        return made


class ContainerData(StateData):
    """What the library knows of one container.

    Attributes:
        children: Label -> child, in the order in which they were added.
        remappings: Label -> key of the child -> key of the container.
        start_cbs: Called at the start of each run, with their own arguments; likewise:
        transition_cbs: after each transition;
        termination_cbs: at the end.
        open_tokens: One for each time that it is open now.
        context_kwargs: What `opened` was given.
        frame: Where it runs; None between runs, and between two attempts of one run.
        root: The root's frame while it runs as the root of a machine.
        lock: That of its runs as a root; made once, as that takes as long as entering a machine.
        plan: Its children, compiled; None when they have changed.
        plain_plan: The plan of a state machine, as long as entering it takes no more than making a
            frame: nobody hears of it, and no keys are copied. None: it has to be called.
        listeners: Called at each event of it and of all below it.
        buffers: Take these events down.
        control: The operator's control, once somebody asked for it.
        journal: Keeps its next run as a root; None: nobody does.
        callback: Runs its callback or hook, while there is one.
        answered: Its last run ended because a request to stop was taken up.
        origin: Who asked it to stop before it ran.
        is_passing_on: A request to stop is being passed on to what runs in it.
        end_waiters: Set when it does not run any more.
    """

    __slots__ = (
        "answered",
        "buffers",
        "callback",
        "children",
        "context_kwargs",
        "control",
        "end_waiters",
        "frame",
        "is_passing_on",
        "journal",
        "listeners",
        "lock",
        "open_tokens",
        "origin",
        "plain_plan",
        "plan",
        "remappings",
        "root",
        "start_cbs",
        "termination_cbs",
        "transition_cbs",
    )
    _kept: ClassVar[tuple[str, ...]] = ()

    def __init__(self) -> None:
        super().__init__()
        self.children: dict[str, Any] = {}
        self.remappings: dict[str, dict[str, str]] = {}
        self.start_cbs: list[Callback] = []
        self.transition_cbs: list[Callback] = []
        self.termination_cbs: list[Callback] = []
        self.open_tokens: list[Any] = []
        self.context_kwargs: dict[str, Any] = {}
        self.frame: Frame | None = None
        self.root: Frame | None = None
        self.lock: threading.RLock | None = None
        self.plan: Any = None
        self.plain_plan: Any = None
        self.listeners: tuple[Callable[[Event], object], ...] = ()
        self.buffers: tuple[EventBuffer, ...] = ()
        self.control: Gate | None = None
        self.journal: RunJournal | None = None
        self.callback: Any = None  # a smachpy.run.callback.CallbackFrame
        self.answered = False
        self.origin: Origin | None = None
        self.is_passing_on = False
        self.end_waiters: list[ClockEvent] = []

    def copy(self) -> Self:
        """Return the data for a copy of the container: its structure and callbacks, no run."""
        made = super().copy()
        own = ("children", "remappings", "start_cbs", "transition_cbs", "termination_cbs")
        for name in (*own, *self._kept):
            value = getattr(self, name)
            setattr(made, name, value.copy() if isinstance(value, (dict, list)) else value)
        return made


class Child(Protocol):
    """What running a state needs of it."""

    _preempt_requested: bool
    _smachpy_request_preempt: ClassVar[object]

    @property
    def _smachpy(self) -> StateData: ...
    @property
    def _smachpy_is_container(self) -> bool: ...
    @property
    def execute(self) -> Callable[[Any], Any]:
        """Does it and returns the outcome; may be a coroutine function."""
        ...

    def request_preempt(self) -> None:
        """Ask it to stop; may be the user's."""

    @property
    def _smachpy_grace(self) -> Callable[[Any], Any] | None:
        """Its own rule: what it makes of the grace of its containers; None: its option."""
        ...


class Parent(Child, Protocol):
    """What running a container needs of it."""

    @property
    def _smachpy(self) -> ContainerData: ...
    @property
    def name(self) -> str | None:
        """Name of the machine when it is the root."""
        ...

    @property
    def userdata(self) -> UserData:
        """Its userdata."""
        ...

    def get_initial_states(self) -> list[str]:
        """Return the labels of the children that run first."""
        ...

    def get_children(self) -> Mapping[str, Any]:
        """Return label -> child."""
        ...
