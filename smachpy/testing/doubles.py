"""Doubles of states, and their exchange in machines."""

from __future__ import annotations

import inspect
from collections import deque
from typing import TYPE_CHECKING, Any, TypeVar

from smachpy.engine.described import walk
from smachpy.events.introspection import describe
from smachpy.exceptions import SmachError
from smachpy.machines.container import Container
from smachpy.machines.state import State, get_options
from smachpy.testing.runs import find_path

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable, Mapping
    from typing import TypeAlias

    from smachpy.events.introspection import StateRecord

    # Name of a state, the function that makes its double, and the list that receives it.
    Replacement: TypeAlias = tuple[str, Callable[[Any], "Double"], list["Double"]]

S = TypeVar("S", bound=State)


class DoubleError(SmachError):
    """A double does not fit the state that it replaces.

    Try: use outcomes and keys that the replaced state has.
    """


class Double(State):
    """Replaces a state: it has the same outcomes, keys and options, and follows a script.

    Args:
        state: The state.
        outcomes: Its outcomes, run after run; the last one is repeated.
        duration: How long each run takes [s]; a preempt ends it early.
        writes: Userdata that it writes.
        execute: A function of the userdata instead of the script; it may be async.

    Attributes:
        runs: How often it ran.
    """

    def __init__(
        self,
        state: State,
        outcomes: Iterable[str] = (),
        *,
        duration: float = 0.0,
        writes: Mapping[str, Any] | None = None,
        execute: Callable[[Any], str | Awaitable[str]] | None = None,
    ) -> None:
        known = state.get_registered_outcomes()
        super().__init__(
            known, state.get_registered_input_keys(), state.get_registered_output_keys()
        )
        self._replaced = state
        self._script = deque(outcomes)
        self._duration = duration
        self._writes = dict(writes or {})
        self._work = execute
        self.runs = 0
        self._smachpy.options = get_options(state)
        self._check(known)
        if inspect.iscoroutinefunction(execute):
            # The machine asks whether `execute` is a coroutine function before it calls it.
            self.execute = self._execute_async  # type: ignore[method-assign, assignment]

    async def _execute_async(self, ud: Any) -> str:
        self.runs += 1
        assert self._work is not None
        work: Any = self._work(ud)
        outcome: str = await work
        return outcome

    def _check(self, known: tuple[str, ...]) -> None:
        name = type(self._replaced).__name__
        unknown = [outcome for outcome in self._script if outcome not in known]
        if unknown:
            raise DoubleError(
                f"double of {name}: outcomes: got {unknown}; expected some of {list(known)}."
            )
        keys = sorted(set(self._writes) - set(self.get_registered_output_keys()))
        if keys:
            raise DoubleError(
                f"double of {name}: writes: got {keys}; expected some of its output keys "
                f"{list(self.get_registered_output_keys())}."
            )
        if self._work is None and not self._script:
            raise DoubleError(f"double of {name}: outcomes: got none; expected at least one.")

    def execute(self, ud: Any) -> str:
        """Follow the script."""
        self.runs += 1
        if self._work is not None:
            outcome = self._work(ud)
            if not inspect.isawaitable(outcome):
                return outcome
            if inspect.iscoroutine(outcome):
                outcome.close()
            raise DoubleError(
                f"double of {type(self._replaced).__name__}: execute: got {outcome!r} from "
                f"{self._work!r}; expected an outcome. Try a function made with `async def`."
            )
        if (
            self._duration > 0
            and self.sleep(self._duration)
            and "preempted" in self.get_registered_outcomes()
        ):
            self.service_preempt()
            return "preempted"
        for key, value in self._writes.items():
            ud[key] = value
        return self._script[0] if len(self._script) == 1 else self._script.popleft()

    @property
    def script(self) -> tuple[str, ...]:
        """The remaining outcomes; set it to start again."""
        return tuple(self._script)

    @script.setter
    def script(self, outcomes: Iterable[str]) -> None:
        self._script = deque(outcomes)

    def describe_details(self) -> Any:
        """Return the details of the replaced state."""
        return self._replaced.describe_details()


class Places:
    """Exchanges states of machines, and restores them."""

    def __init__(self) -> None:
        self._before: list[tuple[Container, str, State]] = []
        self._guards: list[tuple[Any, Any]] = []

    def put(self, root: Container, path: str, make: Callable[[Any], S]) -> S:
        """Replace the state at `path` by the result of `make`.

        Raises:
            UnknownStateError: there is no such state.
            DoubleError: it is the root.
        """
        record = describe(root)
        wanted = find_path(record, path)
        if wanted == record.path:
            raise DoubleError(f"replace: got the root {record.path}; expected a state in it.")
        # The name of a machine may have slashes, so the path is not divided at them.
        container, label = next(
            (container, label)
            for above, container in walk(root, record.path)
            if isinstance(container, Container)
            and (label := wanted.removeprefix(f"{above}/")) in container.get_children()
        )
        return self.exchange(container, label, make)

    def exchange(self, container: Container, label: str, make: Callable[[Any], S]) -> S:
        """Replace a child by the result of `make`."""
        state = container[label]
        double = make(state)
        self._before.append((container, label, state))
        container._smachpy_exchange(label, double)
        return double

    def exchange_guards(self, container: Container, guards: Mapping[str, Any]) -> None:
        """Replace the conditions of a state machine's transitions."""
        data: Any = container._smachpy
        self._guards.append((data, data.guards))
        data.guards, data.live.plan = guards, None

    def describe_whole(self, root: Container) -> StateRecord | None:
        """Return the record of `root` without doubles; None if there are none."""
        if not self._before:
            return None
        doubles = [(container, label, container[label]) for container, label, _ in self._before]
        try:
            # Backwards: a place that was exchanged twice gets its first state last.
            for container, label, state in reversed(self._before):
                container._smachpy_exchange(label, state)
            return describe(root)
        finally:
            for container, label, state in doubles:
                container._smachpy_exchange(label, state)

    def restore(self) -> None:
        """Put the states and conditions back."""
        while self._guards:
            data, guards = self._guards.pop()
            data.guards, data.live.plan = guards, None
        while self._before:
            container, label, state = self._before.pop()
            container._smachpy_exchange(label, state)
