"""States that change the nodes of a robot: their parameters and, in ROS 2, their life cycles."""

from __future__ import annotations

import contextlib
import threading
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actionlib_core.exceptions import RemoteNodeError, ServiceException, WaitTimeoutError
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.dynamic_reconfigure.msg import Config
from actionlib_core.pubsub.remote_node import (
    ReconfiguredNode,
    RemoteNode,
    add_to_config,
    parameter_value,
)
from smachpy.actions.wakeup import PreemptedError, answer_preempt, call_blocking
from smachpy.base import log
from smachpy.base.context import current_frame, current_path
from smachpy.base.problems import Problems, unknown_name
from smachpy.engine.frame import clock_of_run
from smachpy.machines.state import State
from smachpy.userdata.secret import masked

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from typing import Protocol, TypeVar, Unpack

    from actionlib_core.time import Duration
    from smachpy.actions.interface import UntimedOptions
    from smachpy.engine.frame import Frame
    from smachpy.events.introspection import Kind
    from smachpy.userdata.user_data import UserData

    R = TypeVar("R")

    class Call(Protocol):
        """Calls a function that blocks until a node has answered; a preempt ends it."""

        def __call__(self, function: Callable[[], R]) -> R:
            """Return what it returns, or raise `PreemptedError`."""
            ...


OUTCOMES: Final = ("succeeded", "aborted", "preempted")
NODE_S: Final = 10.0  # [s] a node answers in a moment; this includes the wait for it to appear
LIFECYCLE_S: Final = 60.0  # [s] a node reads maps and plugins when it is configured
MOVING_S: Final = 0.5  # [s] a node that is between two states, because of somebody, is asked again
BEFORE: Final = "parameters_before"

_NOTING: Final = threading.Lock()

TARGETS: Final = ("unconfigured", "inactive", "active", "finalized")
_WAYS: Final = {
    ("unconfigured", "inactive"): "configure",
    ("unconfigured", "active"): "configure",
    ("inactive", "active"): "activate",
    ("inactive", "unconfigured"): "cleanup",
    ("active", "inactive"): "deactivate",
    ("active", "unconfigured"): "deactivate",
}
"""(state of a node, wanted state) -> the transition to request; to "finalized": "shutdown"."""
_MOVING: Final = frozenset(
    ("configuring", "cleaningup", "shuttingdown", "activating", "deactivating", "errorprocessing")
)


class SetParameters(State):
    """Sets parameters of a node. Outcomes: 'succeeded', 'aborted', 'preempted'.

    What they were before goes to a userdata key, before anything is changed, and
    `RestoreParameters` sets them back: as a clean-up, at every end of the machine. A value that the
    key has already is kept, so a second state with the same key, or the next round of a loop,
    changes nothing about what is restored in the end.

    'aborted', with the reason in the log: the node is not there or does not answer, it does not
    have one of the parameters, or it refuses or limits a value. What it had set by then stays set.

    Args:
        node: Name of the node.
        values: Name of the parameter -> value: a bool, int, float or str, in ROS 2 also bytes or a
            list of one of them. Whole numbers for a parameter of floats are sent as floats.
        before: The userdata key.
        ros1: The node is one of ROS 1, and has dynamic_reconfigure, as the parts of move_base have
            (`move_base/DWAPlannerROS`). Parameters that a node reads only when it starts are not
            reached.
        timeout: Longest time [s], including the wait for the node; None: no limit, 0: no time.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "service"

    def __init__(
        self,
        node: str,
        values: Mapping[str, Any],
        *,
        before: str = BEFORE,
        ros1: bool = False,
        timeout: float | Duration | None = NODE_S,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(f"SetParameters {node!r}")
        with problems:
            super().__init__(OUTCOMES, **options)
        self.__node = problems.network_name("node", node)
        self.__values = problems.mapping("values", values, "name of a parameter: value")
        if not self.__values:
            problems.add(f"values: got {values!r}; expected at least one parameter.")
        for name, value in self.__values.items():
            problems.word("values", name)
            try:
                if ros1:
                    add_to_config(Config(), name, value)
                else:
                    parameter_value(value, ros2.get_message("rcl_interfaces/ParameterValue"))
            except ValueError as error:
                problems.add(f"values: {name}: {error}")
        self.__before = problems.word("before", before)
        self.__ros1 = ros1
        self.__timeout_s = problems.seconds("timeout", timeout)
        problems.raise_all()
        self.register_io_keys([before])

    def execute(self, userdata: UserData) -> str:
        """Read what they are, note that, and set them.

        Blocks: until the node has answered, `timeout` or a preempt.
        """

        def change(remote: Any, call: Call) -> None:
            frame: Frame | None = current_frame()

            def read() -> dict[str, Any]:
                return call(lambda: remote.get_parameters(*self.__values))

            # A process that is killed after it has set them must not take them for the old ones.
            now = read() if frame is None else frame.run.journal.once(frame, "parameters", read)
            values = {name: _like(now[name], value) for name, value in self.__values.items()}

            def note(given: Mapping[str, Any]) -> None:
                with _noting(userdata, self.__before) as kept:
                    entries = kept.setdefault(remote.name, {})
                    for name, value in given.items():
                        entry = entries.setdefault(name, {"was": now[name], "set": []})
                        if not _is_one_of(value, entry["set"]):
                            entry["set"] = [*entry["set"], value]
                        if self.__ros1:
                            entry["ros1"] = True

            note(values)
            try:
                call(lambda: remote.set_parameters(values))
            except RemoteNodeError as error:
                if error.values:  # beyond a limit of the node: that is set back, too
                    note(error.values)
                raise

        return _talk(self, _kind_of(self.__ros1), self.__node, self.__timeout_s, change)

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the node and the parameters."""
        kind, details = super().describe_details()
        shown = ((name, masked(value, name)) for name, value in self.__values.items())
        values = ", ".join(f"{name}={value!r}" for name, value in shown)
        return kind, (("node", self.__node), ("parameters", values), *details)


class RestoreParameters(State):
    """Sets parameters back to what they were before `SetParameters`; best used as a clean-up.

    Outcomes: 'succeeded', also if there is nothing to set back; 'aborted': a node is not there,
    does not answer or refuses, and the log says what has stayed; 'preempted'.

    A parameter that is neither what the mission has set nor what it was before has been changed by
    somebody else since. It is left as it is, and the log says so. The key then holds what could not
    be restored, and is empty otherwise.

    Args:
        before: The userdata key that `SetParameters` has written.
        timeout: Longest time for each node [s], including the wait for it; None: no limit, 0: no
            time.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "service"

    def __init__(
        self,
        *,
        before: str = BEFORE,
        timeout: float | Duration | None = NODE_S,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems("RestoreParameters")
        with problems:
            super().__init__(OUTCOMES, **options)
        self.__before = problems.word("before", before)
        self.__timeout_s = problems.seconds("timeout", timeout)
        problems.raise_all()
        self.register_io_keys([before])

    def execute(self, userdata: UserData) -> str:
        """Set them back.

        Blocks: until all nodes have answered, `timeout` for each, or a preempt.
        """
        outcome = "succeeded"
        for node, entries in _kept(userdata, self.__before).items():

            def restore(remote: Any, call: Call, entries: Any = entries) -> None:
                names, missing = list(entries), None
                try:
                    now = call(lambda: remote.get_parameters(*names))
                except RemoteNodeError as error:  # a node that was started anew without some
                    missing = error
                    names = [name for name in names if name not in error.problems]
                    now = call(lambda: remote.get_parameters(*names)) if names else {}
                others = {
                    name: value
                    for name, value in now.items()
                    if not _is_one_of(value, [*entries[name]["set"], entries[name]["was"]])
                }
                for name, value in others.items():
                    got, ours = masked(value, name), masked(entries[name]["set"][-1], name)
                    log.logwarn(
                        f"{_where(self)}: /{remote.name}: {name}: got {got!r}; expected {ours!r}, "
                        "which this mission has set. Somebody has changed it since; it is left as "
                        "it is."
                    )
                # Also what seems to be as before: a request of a state that was asked to stop may
                # still wait at the node, and comes before this one.
                values = {name: entries[name]["was"] for name in names if name not in others}
                if values:
                    call(lambda: remote.set_parameters(values))
                if missing is not None:
                    raise missing

            ros1 = any(entry.get("ros1") for entry in entries.values())
            ended = _talk(self, _kind_of(ros1), f"/{node}", self.__timeout_s, restore)
            if ended == "succeeded":
                with _noting(userdata, self.__before) as kept:
                    kept.pop(node, None)
            else:
                outcome = ended
            if ended == "preempted":
                break
        return outcome


class SetLifecycle(State):
    """Brings a managed ROS 2 node to a state. Outcomes: 'succeeded', 'aborted', 'preempted'.

    It requests the transitions that lead there, one after another; if the node is there already,
    none. While the node is between two states, because of somebody else, it waits.

    'aborted', with the reason in the log: the node is not there or does not answer, refuses a
    transition, or no transition leads there from its state.

    Args:
        node: Name of the node.
        state: "unconfigured", "inactive", "active" or "finalized".
        timeout: Longest time [s], including the wait for the node; None: no limit, 0: no time.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "service"

    def __init__(
        self,
        node: str,
        state: str = "active",
        *,
        timeout: float | Duration | None = LIFECYCLE_S,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(f"SetLifecycle {node!r}")
        with problems:
            super().__init__(OUTCOMES, **options)
        self.__node = problems.network_name("node", node)
        if state not in TARGETS:
            problems.add(unknown_name("state", state, TARGETS))
        self.__target = state
        self.__timeout_s = problems.seconds("timeout", timeout)
        problems.raise_all()

    def execute(self, userdata: UserData) -> str:
        """Request the transitions.

        Blocks: until the node is there, `timeout` or a preempt. A transition that the node has
        begun goes on after a preempt.
        """
        del userdata

        def move(remote: Any, call: Call) -> None:
            requested: set[str] = set()
            while (at := call(remote.state)) != self.__target:
                if at in _MOVING:
                    if State.sleep(self, MOVING_S):
                        raise PreemptedError
                    continue
                ends = at in TARGETS and self.__target == "finalized"
                step = "shutdown" if ends else _WAYS.get((at, self.__target), "")
                if not step or step in requested:
                    why = f"got state {at!r}; expected one from which it can become "
                    why += repr(self.__target)
                    why += f". It had answered that it did {step!r}." if step else "."
                    raise RemoteNodeError(remote.name, {"state": why})
                requested.add(step)
                call(lambda step=step: remote.change_state(step))  # type: ignore[misc]

        return _talk(self, RemoteNode, self.__node, self.__timeout_s, move, managed=True)

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the node and the wanted state."""
        kind, details = super().describe_details()
        return kind, (("node", self.__node), ("state", self.__target), *details)


def _kind_of(ros1: bool) -> type[RemoteNode | ReconfiguredNode]:
    return ReconfiguredNode if ros1 else RemoteNode


def _talk(
    state: State,
    kind: type[RemoteNode | ReconfiguredNode],
    node: str,
    timeout_s: float | None,
    work: Callable[[Any, Call], object],
    *,
    managed: bool = False,
) -> str:
    """Wait for a node and run `work(remote, call)`; return the outcome.

    `work` runs in the state's thread; what it passes to `call` runs in another one. All of it
    together takes `timeout_s` at most.
    """
    if answer_preempt(state):
        return "preempted"
    clock = clock_of_run()
    until = None if timeout_s is None else clock.now() + timeout_s
    remote: Any = kind(node, timeout=timeout_s)

    def call(function: Callable[[], R]) -> R:
        remote.timeout = None if until is None else max(0.0, until - clock.now())
        return call_blocking(state, function, remote.close, f"call of /{remote.name}")

    try:
        which = {"managed": True} if managed else {}
        call(lambda: remote.wait(remote.timeout, **which))
        work(remote, call)
    except PreemptedError:
        answer_preempt(state)  # that of a sleep
        return "preempted"
    except (RemoteNodeError, ServiceException, WaitTimeoutError) as error:
        log.logwarn(f"{_where(state)}: {error}")
        return "aborted"
    finally:
        remote.close()
    return "succeeded"


def _where(state: State) -> str:
    return current_path() or type(state).__name__


def _like(now: Any, value: Any) -> Any:
    """Return a value as the parameter has it: whole numbers as floats, and a tuple as a list."""
    if isinstance(value, (list, tuple)):
        inner = now[0] if isinstance(now, list) and now else None
        return [_like(inner, item) for item in value]
    return float(value) if type(now) is float and type(value) is int else value


def _is_one_of(value: Any, others: Iterable[Any]) -> bool:
    """Return whether a value is one of others; NaN is itself."""
    return any(value == other or repr(value) == repr(other) for other in others)


def _kept(userdata: UserData, key: str) -> dict[str, dict[str, dict[str, Any]]]:
    """Return a copy of what the key has: a value of the userdata belongs to everybody."""
    if key not in userdata:
        return {}
    return {
        node: {name: dict(each) for name, each in entries.items()}
        for node, entries in userdata[key].items()
    }


@contextlib.contextmanager
def _noting(userdata: UserData, key: str) -> Iterator[dict[str, dict[str, dict[str, Any]]]]:
    """Change what the key has, so that no branch loses what another one has noted meanwhile."""
    with _NOTING:
        kept = _kept(userdata, key)
        yield kept
        userdata[key] = kept
