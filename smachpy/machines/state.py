"""States and their options."""

from __future__ import annotations

from threading import TIMEOUT_MAX
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Generic,
    Literal,
    TypeAlias,
    TypedDict,
    TypeVar,
    overload,
)

from actionlib_core.clock import current_clock
from smachpy.base.context import THREAD, current_path, is_left_behind
from smachpy.base.functions import is_coroutine_function, name_of
from smachpy.base.problems import Problems, as_number, unique_names, unknown_arguments
from smachpy.base.slips import accepts
from smachpy.engine import frame as frames
from smachpy.engine import step as steps
from smachpy.engine.described import StateData
from smachpy.engine.frame import clock_of_run, current_scope
from smachpy.engine.options import NAMES, NO_OPTIONS, Options, Resource, Retry, changed
from smachpy.engine.preempt import (
    REQUESTING,
    PreemptNotice,
    mark_preempt,
    note_serviced,
    on_preempt,
    recall,
    wait_for_preempt,
)
from smachpy.events import Noted
from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterable, Mapping
    from typing import Self, Unpack

    from actionlib_core.clock import Clock
    from actionlib_core.resources import Policy
    from smachpy.base.names import Names
    from smachpy.engine.frame import Frame, Scope
    from smachpy.engine.options import Result
    from smachpy.events.introspection import Kind, Structure
    from smachpy.userdata.user_data import Remapper, UserData

__all__ = [
    "CBState",
    "Options",
    "Resource",
    "Retry",
    "State",
    "StateOptions",
    "current_state",
    "get_options",
    "set_options",
]

Data_co = TypeVar("Data_co", bound=StateData, covariant=True)
T_co = TypeVar("T_co", covariant=True)
Grace: TypeAlias = float | Literal["inherit"] | None
# Includes None: in `RetrySpec | None`, mypy would infer `object` for the items of
# `["aborted", OSError]`.
RetrySpec: TypeAlias = (
    "Retry | tuple[int, float, Result | Iterable[Result]] | tuple[int, float] | int | None"
)


ResourceSpec: TypeAlias = "Resource | tuple[str, Policy] | str | None"

LONGEST_NOTE = 200
"""Characters of a note that are kept."""


class CommonOptions(TypedDict, total=False):
    """The options that no state has as an argument of its own; see `StateOptions`."""

    retry: RetrySpec
    on_exception: Mapping[type[BaseException], str] | None
    on_enter: Callable[[Any], object] | None
    on_exit: Callable[[Any, Any], object] | None
    resume: str | Callable[[Any], str | None] | None
    on_resume: Callable[[Any], object] | None
    idempotent: bool
    transient: Iterable[str]
    success: Iterable[str] | None
    resource: ResourceSpec


class StateOptions(CommonOptions, total=False):
    """The options of any state that SMACH does not have; all are off by default.

    Keys:
        timeout: Longest run [s]. After that the state is preempted and ends with `timeout_outcome`,
            unless it finishes its work first.
        timeout_outcome: Outcome after a timeout; default "aborted". Registered automatically.
        preempt_timeout: Grace after a preempt [s], before the state is interrupted; None waits for
            ever; "inherit", the default, takes that of the container above, at the top 10 s.
        retry: `Retry(attempts, backoff, on)`, or that as a tuple, or the number of attempts.
        on_exception: Exception type -> outcome; the outcomes are registered automatically.
        on_enter: Called with the userdata before the state runs.
        on_exit: Called with the userdata and the outcome after it ran; None if it has raised.
        resume: What a resumed durable run does with this state if it was active when the process
            ended, instead of executing it again: "skip:OUTCOME" ends it with that outcome, "ask"
            pauses the machine until an operator decides, `resume(userdata)` returns the outcome or
            None to execute it. See docs/durable_missions.md, also for the next three.
        on_resume: Called with the userdata before the state continues in a resumed run; for a
            container with its own userdata.
        idempotent: For an action state: its goal may be sent again if the server does not know it.
        transient: For a container: keys of its userdata that the journal does not keep.
        success: The outcomes that are good. All others count as failures, or as preempts if they
            are called so. None, the default, goes by their names (docs/outcomes.md). Exit codes,
            colours, statistics and reports use it.
        resource: What it needs for itself while it executes: a name, `Resource(name, policy)`, or
            that as a tuple. See docs/resources.md.
    """

    timeout: float | None
    timeout_outcome: str
    preempt_timeout: Grace


class DataOf(Generic[Data_co]):
    """Descriptor behind `_smachpy`, reached only if `State.__init__` was not called: raises so."""

    def __init__(self, kind: type[Data_co]) -> None:
        self.kind = kind

    @overload
    def __get__(self, state: None, owner: type) -> Self: ...
    @overload
    def __get__(self, state: State, owner: type) -> Data_co: ...
    def __get__(self, state: State | None, owner: type) -> Self | Data_co:
        if state is None:
            return self
        name = owner.__name__
        problem = (
            f"state: got a {name} that is not initialised: its __init__ did not call "
            f"State.__init__. Try `super().__init__(outcomes=[...])` as the first line of "
            f"{name}.__init__ (in __post_init__ for a dataclass)."
        )
        if self.kind is StateData and accepts(problem):
            return vars(state).setdefault("_smachpy", self.kind())  # type: ignore[no-any-return]
        raise InvalidStateError(f"{name}: {problem}", [problem])


class Shown(Generic[T_co]):
    """A read-only attribute that yields to one of the same name set by the user.

    Unlike a property it is a non-data descriptor, so an attribute of the instance hides it.
    """

    def __init__(self, get: Callable[[Any], T_co]) -> None:
        self._get = get
        self.__doc__ = get.__doc__

    @overload
    def __get__(self, state: None, owner: type) -> Self: ...
    @overload
    def __get__(self, state: State, owner: type) -> T_co: ...
    def __get__(self, state: State | None, owner: type) -> Self | T_co:
        return self if state is None else self._get(state)


class State:
    """One thing a robot does: it reads userdata, runs, and ends with one of its outcomes.

    For what has attributes, helper methods or hooks; other ways: docs/howto/which_way.md.

    Subclass it and define `execute(self, userdata)`, plain or `async`; the rest is optional. The
    options (see `StateOptions`) work for every state, including containers, when a container runs
    it. You may use any attribute name in a state; `get_options` and `set_options` read and change
    the options.

    Args:
        outcomes: Names of the ways it can end.
        input_keys: Userdata keys that it reads.
        output_keys: Userdata keys that it writes.
        io_keys: Keys that it reads and writes.
        **options: See `StateOptions`.

    Raises:
        InvalidStateError: a list is a plain string or has an item that is not a string, or an
            option has an invalid value; all problems at once.
        TypeError: there is no such option.

    Threads: `request_preempt` may be called from any thread, callback or signal handler; everything
        else belongs to the thread that runs the state.
    """

    # Used only until __init__ sets the attribute of the instance, which hides this one.
    _smachpy: DataOf[StateData] = DataOf(StateData)
    _smachpy_is_made = False
    _smachpy_kind: ClassVar[Kind] = "state"
    _outcomes = Shown(lambda state: set(state._smachpy.outcomes))
    _input_keys = Shown(lambda state: set(state._smachpy.input_keys))
    _output_keys = Shown(lambda state: set(state._smachpy.output_keys))
    _smachpy_is_container: ClassVar[bool] = False
    _smachpy_grace: Callable[[Any], Any] | None = None
    _preempt_requested: bool = False  # SMACH's name for it, which programs use

    def __init__(
        self,
        outcomes: Names = (),
        input_keys: Names = (),
        output_keys: Names = (),
        io_keys: Names = (),
        **options: Unpack[StateOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        both = problems.names("io_keys", io_keys)
        # Set on the instance: the hot path reads it, and a class attribute is found much slower.
        # For the same reason no `vars(self)` here: it would make CPython store the attributes in a
        # dict instead of inline.
        try:
            self._preempt_requested = False
        except AttributeError as error:
            raise _read_only(self) from error
        if not self._smachpy_is_made:
            self._smachpy = type(self)._smachpy.kind()
            self._smachpy_is_made = True
        # A second call of __init__ keeps the object, because machines and waiting threads use it.
        data = self._smachpy
        data.outcomes = problems.names("outcomes", outcomes)
        data.input_keys = tuple(dict.fromkeys((*problems.names("input_keys", input_keys), *both)))
        data.output_keys = tuple(
            dict.fromkeys((*problems.names("output_keys", output_keys), *both))
        )
        data.options = NO_OPTIONS
        if options:
            self._smachpy_set_options(options, problems)
        problems.raise_all()
        data.changed()

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes for a copy of the state, with a copy of its data.

        A request to stop is not meant for the copy.
        """
        return {**vars(self), "_preempt_requested": False, "_smachpy": self._smachpy.copy()}

    # The argument has SMACH's name at run time; for type checkers a subclass may call it anything.
    if TYPE_CHECKING:

        def execute(self, ud: Any, /) -> str | Coroutine[Any, Any, str]:
            """Run the state and return the outcome; see below."""

    else:

        def execute(self, ud: Any) -> str:
            """Run the state and return the outcome; a preempt cancels an `async def execute`.

            Args:
                ud: The declared userdata keys, as attributes or items.
            """
            raise NotImplementedError(
                f"{type(self).__name__}.execute is missing; expected a method "
                "`def execute(self, userdata):`."
            )

    # -- interface -----------------------------------------------------------------------------

    def register_outcomes(self, new_outcomes: Iterable[str]) -> None:
        """Add outcomes."""
        self._smachpy.add("outcomes", new_outcomes)

    def get_registered_outcomes(self) -> tuple[str, ...]:
        """Return the outcomes, in the order of their declaration."""
        return self._smachpy.outcomes

    def register_io_keys(self, keys: Iterable[str]) -> None:
        """Add keys that the state reads and writes."""
        names = unique_names(keys, "io_keys")
        self.register_input_keys(names)
        self.register_output_keys(names)

    def register_input_keys(self, keys: Iterable[str]) -> None:
        """Add keys that the state reads."""
        self._smachpy.add("input_keys", keys)

    def get_registered_input_keys(self) -> tuple[str, ...]:
        """Return the keys that the state reads."""
        return self._smachpy.input_keys

    def register_output_keys(self, keys: Iterable[str]) -> None:
        """Add keys that the state writes."""
        self._smachpy.add("output_keys", keys)

    def get_registered_output_keys(self) -> tuple[str, ...]:
        """Return the keys that the state writes."""
        return self._smachpy.output_keys

    # -- preemption ----------------------------------------------------------------------------

    def request_preempt(self) -> None:
        """Ask the state to stop. A request belongs to the current run, or else to the next one.

        A container asks its children without this method. It then calls an override once per visit,
        in a thread of its own, where it cannot block anybody.

        Threads: any thread, callback or signal handler; never waits for the state.
        """
        if REQUESTING.get() is not self:
            mark_preempt(self)

    _smachpy_request_preempt: ClassVar[object] = request_preempt

    def service_preempt(self) -> None:
        """Service the request: the machine then follows the outcome of this state."""
        if self._preempt_requested:
            # The cleared flag is what counts; without a subscriber there is nothing to publish.
            self._preempt_requested = False
            first = THREAD.get()
            if first is not None and first.run.watched:
                note_serviced(self)

    def recall_preempt(self) -> None:
        """Withdraw a request; called by the state itself, that ends its grace too.

        A later request starts a new one. What was told already, such as the children of a container
        or a goal that was cancelled, stays so. An `async` state that goes on after this also calls
        `uncancel()` of its task, or a later request does not cancel it.
        """
        recall(self)

    def preempt_requested(self) -> bool:
        """Return whether the state was asked to stop; True in a thread that was left behind."""
        return self._preempt_requested or is_left_behind()

    def wait_preempt(self, timeout: float | None = None) -> bool:
        """Wait until the state is asked to stop.

        Returns:
            Whether it was asked within `timeout` [s].

        Raises:
            InvalidStateError: `timeout` is not a duration.

        Blocks: until the request or the timeout; None waits for ever.
        """
        return _wait_preempt(self, "wait_preempt: timeout", timeout)

    def sleep(self, seconds: float) -> bool:
        """Sleep, but not longer than until the state is asked to stop.

        Returns:
            Whether the sleep ended early because of a preempt.

        Raises:
            InvalidStateError: `seconds` is not a duration.

        Blocks: for `seconds`, or until the preempt.
        """
        return _wait_preempt(self, "sleep: seconds", seconds)

    def note(self, text: str) -> None:
        """Say in a few words what the state is about now: `self.note("aisle 7")`.

        The page, the list of runs, the log and the terminal show it beside the state's name until
        the next note or visit. Recordings have it as an event `Noted`. The first 200 characters
        are kept.
        """
        scope = current_scope()
        if scope is not None:
            scope.emit(Noted, str(text)[:LONGEST_NOTE])

    def on_preempt(self, callback: Callable[[], object]) -> Callable[[], None]:
        """Call `callback` on each request to stop, and at once if there is one already.

        Returns:
            A function that removes the callback.

        Raises:
            InvalidStateError: `callback` cannot be called without arguments.

        Threads: the callback runs in a thread of its own, so it may block; it never runs twice at
            once, and several requests before its call count as one. An exception that it raises is
            reported (`smachpy.events.CallbackFailed`).
        """
        problems = Problems(current_path() or type(self).__name__)
        problems.function("on_preempt: callback", callback, "callback()", 0, optional=False)
        problems.raise_all()
        notice = PreemptNotice(callback)
        forget = on_preempt(self, notice)

        def forget_both() -> None:
            notice.forget()
            forget()

        return forget_both

    # -- for authors of states -----------------------------------------------------------------

    # The library calls the functions behind these methods, never the methods: a user's state may
    # use their names for something else.

    def clock(self) -> Clock:
        """Return the clock of this run; outside of a run, the current clock.

        Its `now()` [s], `event()` and `spawn()` follow virtual time in tests.
        """
        return clock_of_run()

    def scope(self) -> Scope | None:
        """Return the scope of this run, which publishes events; call it in `execute`.

        None if the state is executed outside of any machine.
        """
        return current_scope()

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Return the kind of the state and pairs (name, text) about it, for pictures.

        Override it to add to the pairs: `kind, details = super().describe_details()`.
        """
        options = self._smachpy.options
        details: list[tuple[str, str]] = []
        if options.timeout is not None:
            details.append(("timeout", f"{options.timeout:g} s -> {options.timeout_outcome}"))
        if options.retry is not None:
            details.append(("retry", str(options.retry)))
        if options.resource is not None:
            details.append(("resource", str(options.resource)))
        return self._smachpy_kind, tuple(details)

    def describe_structure(self) -> Structure:
        """Return the children and transitions; a leaf has none."""
        from smachpy.events.introspection import Structure

        return Structure(success=self._smachpy.options.success)

    def _smachpy_set_options(self, options: Mapping[str, Any], problems: Problems) -> None:
        """Set options; invalid values are added to `problems`.

        Raises:
            TypeError: there is no such option.
        """
        unknown = unknown_arguments(options, NAMES)
        if unknown:
            raise TypeError(f"{type(self).__name__}: {unknown}")
        data = self._smachpy
        data.options = changed(data.options, options, problems)
        data.outcomes = tuple(dict.fromkeys((*data.outcomes, *data.options.made_outcomes())))


def has_smach_interface(obj: object) -> bool:
    """Return whether `obj` declares outcomes and keys like a state."""
    return (
        hasattr(obj, "get_registered_input_keys")
        and hasattr(obj, "get_registered_output_keys")
        and hasattr(obj, "get_registered_outcomes")
    )


def _read_only(state: State) -> InvalidStateError:
    """Return the error for a state, such as a frozen dataclass, that refuses new attributes."""
    name = type(state).__name__
    problem = (
        "state: got a class whose attributes cannot be set; expected one that allows it, as a "
        "preempt sets an attribute. Try the dataclass without frozen=True."
    )
    return InvalidStateError(f"{name}: {problem}", [problem])


# These two are here for their types: the engine knows a state only as what it runs.
def current_state() -> State | Any:
    """Return the state that runs in this thread or task; None outside of any state."""
    return frames.current_state()


def get_options(state: State) -> Options:
    """Return the options of `state`, including hooks that are methods of its class.

    The hooks are `on_enter(self, userdata)`, `on_exit(self, userdata, outcome)`,
    `resume(self, userdata)` and `on_resume(self, userdata)`; further arguments may have defaults. A
    method of one of these names that cannot be called so belongs to the user, and is not called.

    Raises:
        InvalidStateError: a hook is `async` or a generator, so that nothing would run its body.
    """
    found: Any = state
    return steps.get_options(found)


def set_options(state: State, **options: Unpack[StateOptions]) -> None:
    """Change options of `state`, from its next run on.

    Raises:
        InvalidStateError: a value is wrong; all problems at once.
        TypeError: there is no such option.
    """
    problems = Problems(type(state).__name__)
    data = state._smachpy
    before = data.options, data.outcomes
    state._smachpy_set_options(options, problems)
    try:
        problems.raise_all()
    except InvalidStateError:
        data.options, data.outcomes = before
        raise
    data.changed()


def _wait_preempt(state: State, argument: str, seconds: float | None) -> bool:
    """Wait for a preempt of `state`, at most `seconds`; return whether there is one."""
    # The usual numbers are checked here, without the cost of `Problems`.
    if seconds is not None and not (type(seconds) in {float, int} and 0 <= seconds <= TIMEOUT_MAX):
        problems = Problems(current_path() or type(state).__name__)
        number = as_number(seconds)
        past = number is not None and number < 0  # `deadline - now` after the deadline: no error
        seconds = 0.0 if past else problems.seconds(argument, seconds)
        problems.raise_all()
    if state._preempt_requested or is_left_behind():
        return True
    first: Frame | None = THREAD.get()
    clock = current_clock() if first is None else first.run.clock
    return wait_for_preempt(state, clock, seconds)


class CBState(State):
    """A state that calls a function.

    For functions of programs for SMACH; in new code `@smachpy.state`: docs/howto/which_way.md.

    Args:
        cb: Called as `cb(userdata, *cb_args, **cb_kwargs)`; returns the outcome. May be `async`.
        cb_args: Positional arguments.
        cb_kwargs: Keyword arguments.
        outcomes: Outcomes; those of a `cb_interface` are added, here and for the keys.
        input_keys: Keys that it reads.
        output_keys: Keys that it writes.
        io_keys: Keys that it reads and writes.
        **options: See `StateOptions`.
    """

    _smachpy_kind: ClassVar[Kind] = "callback"

    def __init__(
        self,
        cb: Callable[..., Any],
        cb_args: Iterable[Any] = (),
        cb_kwargs: Mapping[str, Any] | None = None,
        outcomes: Names = (),
        input_keys: Names = (),
        output_keys: Names = (),
        io_keys: Names = (),
        **options: Unpack[StateOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        with problems:
            super().__init__(outcomes, input_keys, output_keys, io_keys, **options)
        self.__args = problems.values("cb_args", cb_args)
        self.__kwargs = problems.mapping("cb_kwargs", cb_kwargs, "name -> value")
        self._smachpy.code = (cb,)
        self._smachpy.is_function = type(self).__module__ == __name__  # no subclass of the user's
        self._smachpy.is_async = is_coroutine_function(cb)
        call = "cb(userdata, *cb_args, **cb_kwargs)"
        count = 1 + len(self.__args)
        problems.function("cb", cb, call, count, self.__kwargs, optional=False, plain=False)
        problems.raise_all()
        interface: Any = cb
        if has_smach_interface(cb):
            self.register_input_keys(interface.get_registered_input_keys())
            self.register_output_keys(interface.get_registered_output_keys())
            self.register_outcomes(interface.get_registered_outcomes())

    def execute(self, ud: Remapper | UserData) -> Any:
        """Call the function."""
        return self._smachpy.code[0](ud, *self.__args, **self.__kwargs)

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the function's name."""
        kind, details = super().describe_details()
        return kind, (*details, ("callback", name_of(self._smachpy.code[0])))


class FunctionState(CBState):
    """A state made from a function `f(userdata) -> outcome`; calling it calls the function."""

    def __init__(
        self,
        function: Callable[..., Any],
        outcomes: Names = (),
        input_keys: Names = (),
        output_keys: Names = (),
        io_keys: Names = (),
        **options: Unpack[StateOptions],
    ) -> None:
        super().__init__(function, (), None, outcomes, input_keys, output_keys, io_keys, **options)
        self.__doc__ = function.__doc__
        self.__name__ = getattr(function, "__name__", "state")
        self.__wrapped__ = function

    def __call__(self, userdata: Any) -> Any:
        """Call the function, as a test of it does."""
        return self._smachpy.code[0](userdata)


class _StateDecorator:
    """The decorator `@smachpy.state(outcomes, ...)`; see `help(smachpy.state.__call__)`.

    Its attributes are those of SMACH's module `smach.state`: programs write `smach.state.State`;
    here the name `state` is the decorator, so both must work.
    """

    State: ClassVar[type[State]] = State
    CBState: ClassVar[type[CBState]] = CBState
    Retry: ClassVar[type[Retry]] = Retry

    def __call__(
        self,
        outcomes: Names,
        input_keys: Names = (),
        output_keys: Names = (),
        io_keys: Names = (),
        **options: Unpack[StateOptions],
    ) -> Callable[[Callable[[Any], str | Coroutine[Any, Any, str]]], FunctionState]:
        """Turn a function `f(userdata) -> outcome`, plain or `async`, into a state.

        For functions without a memory; other ways: docs/howto/which_way.md.

            @smachpy.state(outcomes=["charged", "failed"], output_keys=["level"])
            def charge(userdata):
                userdata.level = 1.0
                return "charged"

            StateMachine.add("CHARGE", charge, {"charged": "DRIVE"})

        In the function, `smachpy.current_state()` is the state, for `sleep` and
        `preempt_requested`.

        Args:
            outcomes: Names of the ways it can end; the function returns one of them.
            input_keys: Userdata keys that it reads.
            output_keys: Userdata keys that it writes.
            io_keys: Keys that it reads and writes.
            **options: See `StateOptions`.

        Raises:
            InvalidStateError: a list or an option is wrong, or the function cannot be called so.

        Threads: the function runs in the thread of its container.
        """

        def make(function: Callable[[Any], str | Coroutine[Any, Any, str]]) -> FunctionState:
            return FunctionState(function, outcomes, input_keys, output_keys, io_keys, **options)

        return make

    StateOptions: ClassVar[Any] = StateOptions  # last, as the annotation above means the class


state = _StateDecorator()
