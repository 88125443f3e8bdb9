"""What all containers share: children, userdata, callbacks, construction, the frame of a run."""

from __future__ import annotations

import copy
import sys
from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.base.context import current_frame
from smachpy.base.functions import signature_text, takes
from smachpy.base.problems import Problems, plain, unknown_name
from smachpy.base.slips import accepts
from smachpy.engine.container import run_container
from smachpy.engine.described import EPOCH, NESTED, ContainerData, walk
from smachpy.engine.frame import clock_of_run
from smachpy.engine.options import outcome_problems
from smachpy.engine.preempt import REQUESTING, request_now, serve
from smachpy.engine.step import hook_problems
from smachpy.engine.threads import execute_root
from smachpy.exceptions import (
    InconsistentMachineError,
    InvalidConstructionError,
    InvalidStateError,
    error_text,
)
from smachpy.machines.callbacks import Callbacks
from smachpy.machines.construction import Openable, construction_method
from smachpy.machines.old_states import as_state
from smachpy.machines.state import DataOf, Shown, State
from smachpy.userdata.typed_keys import key_problems
from smachpy.userdata.user_data import (
    TAKEN,
    CheckedDict,
    ConstantKey,
    Remapper,
    UserData,
    data_of,
    reset,
    taken_key,
    typed_userdata,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from typing import TypeAlias, Unpack

    from smachpy.base.names import Names
    from smachpy.engine.control import Control
    from smachpy.engine.frame import Frame
    from smachpy.events.introspection import Structure
    from smachpy.machines.state import StateOptions

    ModeEvent: TypeAlias = tuple[str, Callable[[], object], Callable[[], object] | None]
    """An event for the exploration: its name, what triggers it, and what follows a second later."""

__all__ = ["Container"]

MAX_LEVELS = 300  # of containers in each other
FEW_LEVELS = 50  # within Python's usual limit, also with listeners and options
FRAMES_PER_LEVEL = 12  # of the interpreter, at most
FRAMES_AROUND = 1000

NO_STATES = "states: got none; expected at least one. Try add()."


class Container(Openable, Callbacks, State):
    """A state made of states.

    Args:
        outcomes: Outcomes.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        name: Name of the machine when it is the root, first part of every path below it.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        userdata: Key -> value with which every run begins; a copy, so no run sees what the one
            before it has made of it.
        **options: See `StateOptions`.

    Attributes:
        userdata: The container's own userdata, kept between runs (see `reset_userdata`), except the
            keys of the argument `userdata`.
        name: See above.
    """

    _smachpy_is_container: ClassVar[bool] = True
    _smachpy: DataOf[ContainerData] = DataOf(ContainerData)
    _smachpy_replaces: ClassVar[bool] = False
    """Whether SMACH's container of this kind replaced a child by another one of its label."""
    name: str | None = None
    _states = Shown(lambda container: container._smachpy.children)
    _remappings = Shown(lambda container: container._smachpy.remappings)
    _is_running = Shown(lambda container: container._smachpy.live.frame is not None)

    def __init__(
        self,
        outcomes: Names = (),
        input_keys: Names = (),
        output_keys: Names = (),
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        userdata: Mapping[str, Any] | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        with problems:
            State.__init__(self, outcomes, input_keys, output_keys, **options)
        with problems:
            self.userdata = UserData() if userdata_type is None else typed_userdata(userdata_type)
        begins_with = problems.mapping("userdata", userdata, "key -> value")
        try:
            self.userdata.update(copy.deepcopy(begins_with))
        except Exception as error:  # noqa: BLE001  of the user's class
            problems.add(
                f"userdata: got a value that cannot be set here ({error_text(error)}); expected "
                "values that can be copied for each run. Try register_start_cb."
            )
        if name is not None:
            self.name = problems.word("name", name)
        problems.raise_all()
        # Emptied here, not only in ContainerData: a second call of __init__ starts from scratch.
        data = self._smachpy
        data.children, data.remappings, data.cleanup = {}, {}, ""
        data.begins_with = begins_with
        data.start_cbs, data.transition_cbs, data.termination_cbs = [], [], []

    # -- structure -----------------------------------------------------------------------------

    def _repr_svg_(self) -> str | None:
        """Return the picture that a Jupyter notebook shows."""
        from smachpy.events.pictures import draw_svg

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

    @construction_method
    def add_cleanup(
        self: Container, label: str, state: State, remapping: Mapping[str, str] | None = None
    ) -> State:
        """Add a state or machine that runs at every end of this container, once.

        It runs after success and failure, an exception, a timeout, a preempt, and a shutdown by the
        first Ctrl-C, before the container ends as it would without it. A request to stop that
        comes while it runs gives it its `preempt_timeout` to finish, and asks it only then.
        `smachpy.current_ending()` tells it how the container ends. See docs/cleanup.md.

        Args:
            label: Its name here; unique.
            state: The state.
            remapping: Key of the state -> key of this container's userdata.

        Returns:
            The state.

        Raises:
            InvalidStateError: there is a clean-up already, the label is taken, or an argument has a
                wrong form.
            InvalidConstructionError: called on the class while no such container is open, or it
                runs.
        """
        data, problems = self._smachpy, Problems(str(label))
        if data.live.frame is not None:
            raise InvalidConstructionError(
                f"{label}: add_cleanup: got a new clean-up while it runs; expected it before or "
                "after."
            )
        if data.cleanup:
            problems.add(
                f"clean-up: got a second one, beside {data.cleanup!r}; expected one. Try a "
                "Sequence of both."
            )
        stored = self._smachpy_store_child(label, state, remapping, problems)
        data.cleanup = plain(label)
        return stored

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
        return list(self._smachpy.others())

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the edges as (outcome, from label, to label or container outcome)."""
        edges = self.describe_structure().transitions
        return [(edge.outcome, edge.source, edge.target) for edge in edges]

    def describe_structure(self) -> Structure:
        """Return the children; the kinds of containers add what is between them."""
        from smachpy.events.introspection import Structure

        data = self._smachpy
        children = tuple(
            (label, state, tuple(data.remappings[label].items()))
            for label, state in data.children.items()
        )
        return Structure(
            children,
            tuple(self.get_initial_states()),
            cleanup=data.cleanup,
            success=data.options.success,
        )

    def find_problems(self, where: str) -> tuple[str, ...]:
        """Return the problems of this container itself, not of its children."""
        raise NotImplementedError

    def check_consistency(self) -> None:
        """Check this container and all containers below it.

        Raises:
            InconsistentMachineError: with all problems found.
        """
        where = f"/{self.name or 'SM_ROOT'}"
        checked = NESTED.value  # read first: a change during the check makes it stale again
        depth = allow_depth(self)
        problems = [*self.__own_problems(where), *_all_problems(self, where)]
        if problems:
            raise InconsistentMachineError(f"{type(self).__name__} {where!r}", problems)
        self._smachpy.checked, self._smachpy.depth = checked, depth

    def __own_problems(self, where: str) -> Iterator[str]:
        """Yield the problems of its options; those of a child are found by `add`."""
        data = self._smachpy
        for problem in (*hook_problems(self), *outcome_problems(data.options, data.outcomes)):
            yield f"{where}: {problem}"

    def is_running(self) -> bool:
        """Return whether the container is running."""
        return self._smachpy.live.frame is not None

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
        data, frame = self._smachpy, self._smachpy.live.frame
        if frame is None:
            return True
        ended = clock_of_run().event()
        with frame.run.lock:
            if data.live.frame is not frame:
                return True
            data.live.end_waiters.append(ended)
        try:
            return ended.wait(timeout)
        finally:
            with frame.run.lock:
                if ended in data.live.end_waiters:
                    data.live.end_waiters.remove(ended)

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
        constants: Iterable[str] = (),
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
        label = plain(label)
        problems = problems or Problems(label)
        if "/" in label:
            problem = f"label: got {label!r}; expected no '/': it separates the labels of a path."
            if not accepts(f"{label}: {problem}"):
                problems.add(problem)
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
                known = state.get_registered_input_keys()
                if known:  # a state that declares nothing reads the constants that it gets
                    problems.add(*_unknown_keys("constants", known, constants))
            # Only a container that is somewhere already can be below the new state.
            inside = self._smachpy.is_child and any(each is self for each in below(state))
            if state is self or inside:
                problems.add(f"state: got {state!r}, which contains this container.")
        else:
            hint = f" Try {state.__name__}()." if isinstance(state, type) else ""
            problems.add(f"state: got {state!r}; expected an instance of State.{hint}")
        names = problems.names_of("remapping", remapping, "key of the state -> key here")
        problems.raise_all()
        assert isinstance(state, State)
        self._smachpy_exchange(label, state)
        self._smachpy.remappings[label] = names
        return state

    def _smachpy_exchange(self, label: str, state: State) -> None:
        """Set a child, or replace it between two runs, by a test double for instance."""
        state._smachpy.is_child = True
        self._smachpy.children[label] = state
        self._smachpy.live.plan = None
        self._smachpy.restructured()

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
        if current_frame() is None:
            plan = self._smachpy.live.plan
            if plan is None or plan.epoch is not EPOCH.value:  # something may have been added
                allow_depth(self)
            return execute_root(self, parent_ud)
        return run_container(self, parent_ud)

    _smachpy_execute: ClassVar[object] = execute  # to find out whether a subclass overrides it

    def _smachpy_problems(self, where: str) -> tuple[str, ...]:
        """Return the problems of this container, not of its children."""
        return (*self.__own_problems(where), *problems_of(self, where))

    def _smachpy_terminal_labels(self, frame: Frame) -> list[str]:  # noqa: ARG002  overridden
        """Return the children that ended last: all of them."""
        return list(self._smachpy.others())

    def _smachpy_events(self, label: str) -> tuple[Sequence[ModeEvent], bool]:  # noqa: ARG002  overridden
        """Return the events that end a child from outside, and whether it only waits for them."""
        return (), False

    def _smachpy_situation(self) -> str:
        """Return what the rest of a run depends on, besides the active states and userdata."""
        return ""

    def _smachpy_compile(self) -> Any:
        """Return the plan of this container, which has no problems."""
        raise NotImplementedError

    def _smachpy_run_children(self, frame: Frame, plan: Any) -> str:
        """Run the children and return the outcome."""
        raise NotImplementedError

    def request_preempt(self, *, by: str = "") -> None:
        """Ask the container and all active states below it to stop.

        A request before a run ends that run at once. When this returns, every active descendant has
        been asked. The main thread lets another one pass the request on, as it may be in a signal
        handler: then some are asked right after that, if the code that it has interrupted holds a
        lock.

        Args:
            by: Who asks, for viewers and recordings, or the name of a signal ("SIGUSR1"); "" finds
                it out where possible (see `smachpy.events.PreemptRequested`).

        Threads: any thread, callback or signal handler; never waits for a state.
        """
        if REQUESTING.get() is not self:  # else in `super().request_preempt()` of an override
            request_now(self, by)

    def service_preempt(self) -> None:
        """Service the request from code of this container: a callback, a hook, its `execute`.

        The machine above then follows its outcome. What is to run at every end belongs into
        `add_cleanup`.
        """
        serve(self)

    # To find out whether a subclass overrides the method.
    _smachpy_request_preempt: ClassVar[object] = request_preempt

    @Shown
    def control(self) -> Control:
        """The operator's control of this machine: pause, step, jump and so on; see `Control`."""
        return control_of(self)


def control_of(container: Container) -> Control:
    """Return the operator's control of a container, even if the user has an attribute `control`."""
    from smachpy.engine.control import Control

    data = container._smachpy
    if data.live.control is None:
        data.live.control = Control(container)
    assert isinstance(data.live.control, Control)
    return data.live.control


def state_problems(state: State) -> Iterator[str]:
    """Yield the problems of `state` itself, such as an `execute` that cannot be called.

    Raises:
        InvalidStateError: its `__init__` did not call that of `State`.
    """
    yield from outcome_problems(state._smachpy.options, state.get_registered_outcomes())
    yield from hook_problems(state)
    execute: Any = state.execute
    if not callable(execute):
        yield f"execute: got {execute!r}; expected a method execute(self, userdata)."
    elif not takes(execute, 1):
        name = type(state).__name__
        problem = (
            f"execute: got {name}.execute{signature_text(execute)}, which "
            "cannot be called with the userdata; expected `def execute(self, userdata):`."
        )
        if not accepts(problem):
            yield problem
    data = state._smachpy
    function = data.code[0] if data.is_function else execute
    yield from key_problems(function, dict.fromkeys((*data.input_keys, *data.output_keys)))


def below(state: State) -> Iterator[State]:
    """Yield `state` and all states below it."""
    return (each for _, each in walk(state))


def shared_below(branches: Mapping[str, State]) -> Iterator[tuple[State, str, str]]:
    """Yield each state that several branches contain, with the labels of the first and another."""
    label_of: dict[int, str] = {}
    for label, branch in branches.items():
        for state in {id(state): state for state in below(branch)}.values():
            first = label_of.setdefault(id(state), label)
            if first != label:
                yield state, first, label


def _all_problems(container: Container, where: str) -> Iterator[str]:
    """Yield the problems of `container` and of all below it that was not checked since a change."""
    left = [(container, where)]
    while left:
        container, where = left.pop()
        yield from problems_of(container, where)
        left += [
            (child, f"{where}/{label}")
            for label, child in reversed(container.get_children().items())
            if isinstance(child, Container) and child._smachpy.checked is not NESTED.value
        ]


def allow_depth(container: Container) -> int:
    """Let Python recurse as deeply as a machine is nested, so that it can be run and described.

    Returns:
        How many levels of containers it has.

    Raises:
        InconsistentMachineError: it is nested more than `MAX_LEVELS` deep.
    """
    level, above, depth = [container], 0, 0
    while level:
        inside: dict[int, State] = {}
        for one in level:
            if one._smachpy.checked is NESTED.value:
                depth = max(depth, above + one._smachpy.depth)
            else:
                inside |= {id(child): child for child in one.get_children().values()}
        level = [child for child in inside.values() if isinstance(child, Container)]
        above += 1
        depth = max(depth, above)
        if depth > MAX_LEVELS:
            where = f"/{container.name or 'SM_ROOT'}"
            problem = f"{where}: got more than {MAX_LEVELS} levels of containers; expected fewer."
            raise InconsistentMachineError(f"{type(container).__name__} {where!r}", [problem])
    if depth > FEW_LEVELS:
        needed = FRAMES_AROUND + depth * FRAMES_PER_LEVEL
        sys.setrecursionlimit(max(sys.getrecursionlimit(), needed))
    return depth


def problems_of(container: Container, where: str) -> Iterator[str]:
    """Yield the problems of `container` and of its typed userdata, not those of its children."""
    for label, state in container.get_children().items():
        names = container._smachpy.remappings[label]
        keys = (*state.get_registered_input_keys(), *state.get_registered_output_keys())
        yield from _unknown_keys(f"{where}/{label}: remapping", keys, names)
        for key in TAKEN.intersection((*keys, *names.values())):
            problem = f"{where}/{label}: {taken_key(key)}"
            if not accepts(problem):
                yield problem
    data = data_of(container.userdata)
    if isinstance(data, CheckedDict):
        fields = data.fields
        for label, state in container.get_children().items():
            names = container._smachpy.remappings[label]
            keys = (*state.get_registered_input_keys(), *state.get_registered_output_keys())
            for key in dict.fromkeys(names.get(key, key) for key in keys):
                if type(key) is not ConstantKey and key not in fields.types:
                    what = f"{where}/{label}: userdata key is no field of {fields.kind.__name__}"
                    yield unknown_name(what, key, fields.types)
    yield from container.find_problems(where)


def _unknown_keys(what: str, known: tuple[str, ...], given: Iterable[str]) -> Iterator[str]:
    """Yield the problems of keys given for a state that does not have them."""
    for key in given:
        if key not in known:
            problem = unknown_name(f"{what}: key of the state", key, known)
            if not accepts(problem):
                yield problem
