"""States: what a machine is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias, TypedDict

from actionlib_core.clock import current_clock
from smachpy._core.names import unique_names
from smachpy._core.retry import Retry, as_retry
from smachpy._runtime.frame import current_scope, note_serviced
from smachpy.exceptions import InvalidStateError
from smachpy.introspection import Structure
from smachpy.util import has_smach_interface

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterable, Mapping
    from typing import Unpack

    from actionlib_core.clock import Clock
    from smachpy._runtime.frame import Scope
    from smachpy.introspection import Kind
    from smachpy.user_data import Remapper, UserData

__all__ = ["CBState", "Retry", "State", "StateOptions"]

Grace: TypeAlias = float | Literal["inherit"] | None
RetrySpec: TypeAlias = "Retry | tuple[int, float, Iterable[str | type[BaseException]]] | int"


class _Epoch:
    """Counts changes of states' interfaces, so that nobody has to look at every state."""

    value = 0


EPOCH = _Epoch()


class StateOptions(TypedDict, total=False):
    """What any state can be told beyond SMACH; all are off by default.

    Keys:
        timeout: Longest run [s]; then the state is preempted and ends with `timeout_outcome`,
            unless it finished after all.
        timeout_outcome: Outcome after a timeout; default "aborted". It is registered by itself.
        preempt_timeout: Grace after a preempt [s] before the state is abandoned; None waits for
            ever; "inherit", the default, takes the container's, in the end 10 s.
        retry: `Retry(attempts, backoff, on)`, or that as a tuple, or the number of attempts.
        on_exception: Exception type -> outcome; the outcomes are registered by themselves.
        on_enter: Called with the userdata before the state runs.
        on_exit: Called with the userdata and the outcome after it ran.
    """

    timeout: float | None
    timeout_outcome: str
    preempt_timeout: Grace
    retry: RetrySpec | None
    on_exception: Mapping[type[BaseException], str] | None
    on_enter: Callable[[Any], object] | None
    on_exit: Callable[[Any, str], object] | None


class State:
    """One thing a robot does: reads userdata, does it, and ends with one of its outcomes.

    Subclass it and define `execute(self, userdata)`, plain or `async`; the rest is optional. The
    options (see `StateOptions`) work for every state, containers too, when a container runs it.

    Args:
        outcomes: Names of the ways it can end.
        input_keys: Userdata keys that it reads.
        output_keys: Userdata keys that it writes.
        io_keys: Keys that it reads and writes.
        **options: See `StateOptions`.

    Raises:
        InvalidStateError: a list is a plain string or holds something that is no string, or an
            option has no meaning.

    Threads: `request_preempt` may be called from any thread, callback or signal handler; all
        else belongs to the thread that runs the state.
    """

    # Class attributes stand in for subclasses whose __init__ does not call this one.
    _preempt_requested: bool = False
    _preempt_callbacks: list[Callable[[], object]]
    _interface: int = 0
    kind: ClassVar[Kind] = "state"
    is_container: ClassVar[bool] = False

    timeout: float | None = None
    timeout_outcome: str = "aborted"
    preempt_timeout: Any = "inherit"
    retry: Any = None
    on_exception: Mapping[type[BaseException], str] | None = None
    on_enter: Any = None
    on_exit: Any = None

    def __init__(
        self,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        io_keys: Iterable[str] = (),
        **options: Unpack[StateOptions],
    ) -> None:
        both = unique_names(io_keys, "io_keys")
        self._outcomes = unique_names(outcomes, "outcomes")
        self._input_keys = unique_names((*unique_names(input_keys, "input_keys"), *both))
        self._output_keys = unique_names((*unique_names(output_keys, "output_keys"), *both))
        self._preempt_callbacks = []
        if options:
            self._set_options(options)

    def execute(self, ud: Any) -> str | Coroutine[Any, Any, str]:
        """Do it and return the outcome; `async def` in a subclass is cancelled on a preempt.

        Args:
            ud: The declared userdata keys, as attributes or items.
        """
        raise NotImplementedError(f"{type(self).__name__}.execute")

    # -- interface -----------------------------------------------------------------------------

    def register_outcomes(self, new_outcomes: Iterable[str]) -> None:
        """Add outcomes."""
        self._outcomes = unique_names((*self._outcomes, *unique_names(new_outcomes, "outcomes")))
        self._interface += 1
        EPOCH.value += 1

    def get_registered_outcomes(self) -> tuple[str, ...]:
        """Return the outcomes, in the order of their declaration."""
        return self._outcomes

    def register_io_keys(self, keys: Iterable[str]) -> None:
        """Add keys that are read and written."""
        names = unique_names(keys, "io_keys")
        self.register_input_keys(names)
        self.register_output_keys(names)

    def register_input_keys(self, keys: Iterable[str]) -> None:
        """Add keys that are read."""
        self._input_keys = unique_names((*self._input_keys, *unique_names(keys, "input_keys")))
        self._interface += 1
        EPOCH.value += 1

    def get_registered_input_keys(self) -> tuple[str, ...]:
        """Return the keys that are read."""
        return self._input_keys

    def register_output_keys(self, keys: Iterable[str]) -> None:
        """Add keys that are written."""
        self._output_keys = unique_names((*self._output_keys, *unique_names(keys, "output_keys")))
        self._interface += 1
        EPOCH.value += 1

    def get_registered_output_keys(self) -> tuple[str, ...]:
        """Return the keys that are written."""
        return self._output_keys

    # -- preemption ----------------------------------------------------------------------------

    def request_preempt(self) -> None:
        """Ask the state to stop; a request belongs to the run that is on, or else to the next.

        Threads: any thread, callback or signal handler; never waits for the state. An override
            must not wait either.
        """
        self._preempt_requested = True
        for callback in tuple(self._preempt_callbacks):
            callback()

    def service_preempt(self) -> None:
        """Say that the request was answered; the machine follows the outcome then."""
        if self._preempt_requested:
            self._preempt_requested = False
            note_serviced(self)

    def recall_preempt(self) -> None:
        """Take a request back."""
        self._preempt_requested = False

    def preempt_requested(self) -> bool:
        """Tell whether the state was asked to stop."""
        return self._preempt_requested

    def wait_preempt(self, timeout: float | None = None) -> bool:
        """Wait until the state is asked to stop.

        Returns:
            Whether it was, within `timeout` [s].

        Blocks: until the request or the timeout; None waits for ever.
        """
        if self._preempt_requested:
            return True
        wake = self._clock().event()
        forget = self._on_preempt(wake.set)
        try:
            wake.wait(timeout)
        finally:
            forget()
        return self._preempt_requested

    def sleep(self, seconds: float) -> bool:
        """Let time pass, less of it when the state is asked to stop.

        Returns:
            Whether the sleep ended early because of a preempt.

        Blocks: for `seconds`, or until the preempt.
        """
        return self.wait_preempt(seconds)

    def _on_preempt(self, callback: Callable[[], object]) -> Callable[[], None]:
        """Call `callback` on each request, at once if there is one; returns how to forget it.

        Threads: the callback runs in the requester's thread, maybe in a signal handler: it must
            not wait.
        """
        callbacks = self._preempt_callbacks
        callbacks.append(callback)
        if self._preempt_requested:
            callback()

        def forget() -> None:
            if callback in callbacks:
                callbacks.remove(callback)

        return forget

    def _grace(self, inherited: Grace) -> Grace:
        """Return how long the state has after a preempt [s], given what its containers say."""
        own: Grace = self.preempt_timeout
        return inherited if own == "inherit" else own

    # -- for those who write states ------------------------------------------------------------

    def _clock(self) -> Clock:
        """Return the clock of the run, or outside of one that of the context."""
        scope = current_scope()
        return current_clock() if scope is None else scope.clock

    def _scope(self) -> Scope | None:
        """Return this run's scope, to publish events through; call it in `execute`.

        None when the state is executed by hand, outside any machine.
        """
        return current_scope()

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Return the kind of the state and pairs (name, text) about it, for pictures.

        Override it to add to the pairs: `kind, details = super().describe_details()`.
        """
        details: list[tuple[str, str]] = []
        if self.timeout is not None:
            details.append(("timeout", f"{self.timeout:g} s -> {self.timeout_outcome}"))
        if self.retry is not None:
            details.append(("retry", str(self.retry)))
        return self.kind, tuple(details)

    def describe_structure(self) -> Structure:
        """Return what is inside; leaves have nothing."""
        return Structure()

    def _set_options(self, options: StateOptions) -> None:
        known = StateOptions.__annotations__
        unknown = sorted(set(options) - set(known))
        if unknown:
            raise TypeError(
                f"{type(self).__name__}: unknown arguments {unknown}; expected {sorted(known)}."
            )
        for name, value in options.items():
            setattr(self, name, value)
        self.retry = as_retry(self.retry)
        if self.timeout is not None:
            if self.timeout < 0:
                raise InvalidStateError(f"timeout: got {self.timeout!r}; expected seconds >= 0.")
            self.register_outcomes([self.timeout_outcome])
        if self.on_exception:
            self.register_outcomes(self.on_exception.values())


class CBState(State):
    """A state that calls a function.

    Args:
        cb: Called as `cb(userdata, *cb_args, **cb_kwargs)`; returns the outcome. May be `async`.
        cb_args: Positional arguments.
        cb_kwargs: Keyword arguments.
        outcomes: Outcomes; those of a `cb_interface` are added.
        input_keys: Keys read; likewise.
        output_keys: Keys written; likewise.
        io_keys: Keys read and written.
        **options: See `StateOptions`.
    """

    kind: ClassVar[Kind] = "callback"

    def __init__(
        self,
        cb: Callable[..., Any],
        cb_args: Iterable[Any] = (),
        cb_kwargs: Mapping[str, Any] | None = None,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        io_keys: Iterable[str] = (),
        **options: Unpack[StateOptions],
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys, io_keys, **options)
        self._cb = cb
        self._args = tuple(cb_args)
        self._kwargs = dict(cb_kwargs or {})
        interface: Any = cb
        if has_smach_interface(cb):
            self.register_input_keys(interface.get_registered_input_keys())
            self.register_output_keys(interface.get_registered_output_keys())
            self.register_outcomes(interface.get_registered_outcomes())

    def execute(self, ud: Remapper | UserData) -> Any:
        """Call the function."""
        return self._cb(ud, *self._args, **self._kwargs)

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the function's name."""
        kind, details = super().describe_details()
        name = getattr(self._cb, "__qualname__", None) or getattr(self._cb, "__name__", "")
        return kind, (*details, ("callback", name)) if name else details
