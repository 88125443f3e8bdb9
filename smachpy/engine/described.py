"""The library's data of one state or container; all other attributes of it belong to the user.

`smachpy.engine` runs what is described here and imports no states; `smachpy.machines` builds them.
A description holds what the user said. What belongs to its runs is in one object beside it, `Live`,
which no copy, comparison or file of a machine concerns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from smachpy.base.problems import unique_names
from smachpy.engine.journal import NO_JOURNAL, RunJournal
from smachpy.engine.options import NO_OPTIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from typing import Self, TypeAlias

    from actionlib_core.clock import Event as ClockEvent
    from smachpy.engine.frame import Frame, Gate
    from smachpy.engine.options import Options
    from smachpy.engine.visit import Origin
    from smachpy.events import Event
    from smachpy.events.buffer import EventBuffer
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
NESTED = _Epoch()
"""The same for the structure of what is inside of any container."""


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
        is_function: It is nothing but a function of the user, so that a copy does the same.
        made_from: How a file names it; see `smachpy.files`. None for a state from code.
        is_shared: Two machines that run at the same time have it: each runs a copy.
        is_child: It is, or was, in a container.
    """

    __slots__ = (
        *("outcomes", "input_keys", "output_keys", "options", "version", "with_hooks"),
        *("preempt_callbacks", "is_async", "code", "is_function", "made_from"),
        *("is_shared", "is_child"),
    )

    def __init__(self) -> None:
        self.outcomes: tuple[str, ...] = ()
        self.input_keys: tuple[str, ...] = ()
        self.output_keys: tuple[str, ...] = ()
        self.options: Options = NO_OPTIONS
        self.version = 0
        self.with_hooks: tuple[Options, Options] | None = None
        self.preempt_callbacks: list[Callable[[], object]] = []
        self.is_async = False
        self.code: tuple[Any, ...] = ()
        self.is_function = False
        self.made_from: Any = None
        self.is_shared = False
        self.is_child = False

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
        self.restructured()

    def restructured(self) -> None:
        """Mark what was found out about the structure of containers above it as stale."""
        if self.is_child:
            NESTED.value = object()

    def copy(self) -> Self:
        """Return the data for a copy of the state, without anything that belongs to a run."""
        made = type(self)()
        flags = ("is_async", "is_function", "made_from")
        for name in ("outcomes", "input_keys", "output_keys", "options", "version", "code", *flags):
            setattr(made, name, getattr(self, name))
        return made


class Live:
    """What belongs to the runs of one container: where it runs, who watches and controls it.

    Attributes:
        frame: Where it runs; None between runs, and between two attempts of one run.
        root: The root's frame while it runs as the root of a machine.
        coming: The same from the call of `execute` until it runs, so that there is one at a time.
        callback: The frame of its callback or hook that runs now, or None.
        plan: Its children, compiled; None when they have changed.
        listeners: Called with each event of it and of all below it.
        buffers: Event buffers that take the same events.
        control: The operator's control, once it was used.
        journal: The journal of its next run as a root.
        origin: Who asked it to stop before its run.
        ended: Grows whenever a run of it ends: what was asked before is for no later run.
        is_passing_on: A request to stop is being passed on to its children.
        end_waiters: Events to set when it stops running.
        goes_on: Its next run goes on where the last one was interrupted, with its userdata: "last",
            or "deep", if the machines below it do so, too; "" begins anew.
        stopped_at: The label of the child in which its last run was asked to stop, if it has ended
            'preempted' because of that; else "".
    """

    __slots__ = (
        *("frame", "root", "coming", "callback", "plan", "listeners", "buffers"),
        *("control", "journal", "origin", "ended", "is_passing_on", "end_waiters"),
        *("goes_on", "stopped_at"),
    )

    def __init__(self) -> None:
        self.frame: Frame | None = None
        self.root: Frame | None = None
        self.coming: Frame | None = None
        self.callback: Any = None  # a smachpy.engine.callback.CallbackFrame, which imports this
        self.plan: Any = None
        self.listeners: tuple[Callable[[Event], object], ...] = ()
        self.buffers: tuple[EventBuffer, ...] = ()
        self.control: Gate | None = None
        self.journal: RunJournal = NO_JOURNAL
        self.origin: Origin | None = None
        self.ended = 0
        self.is_passing_on = False
        self.end_waiters: list[ClockEvent] = []
        self.goes_on = ""
        self.stopped_at = ""


class ContainerData(StateData):
    """The library's data of one container.

    Attributes:
        children: Label -> child, in the order in which they were added.
        remappings: Label -> key of the child -> key of the container.
        cleanup: The label of the child that runs at every end of the others; "" for none.
        begins_with: Key -> value of its userdata at the start of each run.
        reenter: "last" or "deep": it goes on where it was interrupted; "first" begins anew.
        start_cbs: Called at the start of each run; each with its extra arguments.
        transition_cbs: The same, after each transition.
        termination_cbs: The same, at the end.
        open_tokens: One for each `with` block in which it is open.
        context_kwargs: The arguments of `opened`.
        checked: The `NESTED.value` for which it and all below it had no problems.
        depth: Levels of containers then, itself included.
        live: Its side of the runs.
    """

    __slots__ = (
        *("children", "remappings", "cleanup", "begins_with", "reenter", "start_cbs"),
        *("transition_cbs", "termination_cbs", "open_tokens", "context_kwargs", "checked"),
        *("depth", "live"),
    )
    _kept: ClassVar[tuple[str, ...]] = ()

    def __init__(self) -> None:
        super().__init__()
        self.children: dict[str, Any] = {}
        self.remappings: dict[str, dict[str, str]] = {}
        self.cleanup = ""
        self.begins_with: dict[str, Any] = {}
        self.reenter = "first"
        self.start_cbs: list[Callback] = []
        self.transition_cbs: list[Callback] = []
        self.termination_cbs: list[Callback] = []
        self.open_tokens: list[Any] = []
        self.context_kwargs: dict[str, Any] = {}
        self.checked: object = None
        self.depth = 0
        self.live = Live()

    def restructured(self) -> None:
        """As that of a state; also what was found out about this container."""
        self.checked = None
        super().restructured()

    def copy(self) -> Self:
        """Return the data for a copy of the container: its structure and callbacks only."""
        made = super().copy()
        made.is_child = self.is_child
        callbacks = ("start_cbs", "transition_cbs", "termination_cbs")
        kept = ("cleanup", "reenter", *callbacks, *self._kept)
        for name in ("children", "remappings", "begins_with", *kept):
            value = getattr(self, name)
            setattr(made, name, value.copy() if isinstance(value, (dict, list)) else value)
        return made

    def history(self) -> str:
        """Return how its next run goes on, as in `Live.goes_on`."""
        own = self.reenter if self.reenter != "first" and self.live.stopped_at else ""
        return self.live.goes_on or own

    def others(self) -> dict[str, Any]:
        """Return label -> child of all children except the clean-up."""
        if not self.cleanup:
            return self.children
        return {label: child for label, child in self.children.items() if label != self.cleanup}


class Child(Protocol):
    """The part of a state that `smachpy.engine` uses."""

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
    """The part of a container that `smachpy.engine` uses."""

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

    def call_termination_cbs(self, terminal_states: Sequence[str], outcome: str) -> None:
        """Call the termination callbacks."""

    def _smachpy_problems(self, where: str) -> tuple[str, ...]:
        """Return its problems, not those of its children."""

    def _smachpy_compile(self) -> Any:
        """Return its children, compiled: a `smachpy.engine.step.Plan`."""

    def _smachpy_run_children(self, frame: Frame, plan: Any) -> str:
        """Run its children and return the outcome."""

    def _smachpy_terminal_labels(self, frame: Frame) -> list[str]:
        """Return the children that ended last."""

    def get_children(self) -> Mapping[str, Any]:
        """Return label -> child."""


def walk(state: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (path, state) for `state`, whose path is given, and for all states below it."""
    left = [(path, state)]  # no recursion: a generator in a generator takes its time at each level
    while left:
        path, state = left.pop()
        yield path, state
        if state._smachpy_is_container:
            children = state.get_children().items()
            left += reversed([(f"{path}/{label}", child) for label, child in children])
