"""`PetriNetPlan`, a plan as a container; and `load`, which reads one from files."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from smachpy.base.problems import Problems
from smachpy.engine.described import ContainerData
from smachpy.engine.step import Plan as CompiledChildren
from smachpy.events.introspection import NetRecord, NetTransitionRecord, PlaceRecord, Structure
from smachpy.exceptions import InvalidStateError, did_you_mean
from smachpy.machines.container import Container, below, shared_below
from smachpy.machines.state import DataOf, Shown
from smachpy.pnp.actions import Binder, NotImported, Order, SetVariable, Unbound, Wait, WaitFor
from smachpy.pnp.execution import Execution
from smachpy.pnp.firing import Table
from smachpy.pnp.knowledge import EVENT_LIFE_S, Knowledge, Polled, is_built_in
from smachpy.pnp.net import Net
from smachpy.pnp.plan import Plan, problem_of, understand
from smachpy.pnp.problems import PlanError, PlanProblem, raise_errors
from smachpy.pnp.reading import find_plan, read_net
from smachpy.userdata.user_data import CheckedDict, data_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from typing import Unpack

    from smachpy.base.names import Names
    from smachpy.checks.model import Problem
    from smachpy.engine.frame import Frame
    from smachpy.events.introspection import Kind
    from smachpy.machines.state import State, StateOptions
    from smachpy.pnp.knowledge import Events
    from smachpy.pnp.server import PNPServer
    from smachpy.userdata.user_data import Fields, UserData

__all__ = ["PetriNetPlan", "load"]

OUTCOMES = ("goal", "fail", "preempted")


class PlanData(ContainerData):
    """The library's data of one plan.

    Attributes:
        net_plan: The plan itself.
        names: Label of a child -> the plan's name for it.
        knowledge: The conditions and events that its guards ask for.
        registered: The actions that were registered.
        unbound: Label -> the problem of an action for which nothing is registered.
        execution: The current run, or None.
    """

    __slots__ = ("execution", "knowledge", "names", "net_plan", "registered", "unbound")
    _kept = ("knowledge", "names", "net_plan", "registered", "unbound")

    def __init__(self) -> None:
        super().__init__()
        self.net_plan: Any = None
        self.names: dict[str, str] = {}
        self.knowledge: Any = None
        self.registered: dict[str, Any] = {}
        self.unbound: dict[str, PlanProblem] = {}
        self.execution: Execution | None = None

    def labels(self) -> dict[str, str]:
        """Return the plan's name for a child -> its label."""
        return {name: label for label, name in self.names.items()}


class _Compiled(CompiledChildren):
    """A plan, compiled: its children, and the table of its firings."""

    __slots__ = ("table",)

    def __init__(self, machine: PetriNetPlan) -> None:
        super().__init__(machine)
        data = machine._smachpy
        for step in self.steps.values():
            # A child's outcome leads nowhere by itself: the net decides what follows.
            step.end_always()
        self.table = Table(
            data.net_plan,
            data.labels(),
            {label: step.state._smachpy.outcomes for label, step in self.steps.items()},
            lambda name: data.knowledge.source_of(name) is not None,
        )


class _WatchedValues(dict[str, Any]):
    """The values of userdata; calls `on_write` after each write, as conditions may depend on it."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.on_write: Any = None
        super().__init__(values)

    def __setitem__(self, key: str, value: Any) -> None:
        super().__setitem__(key, value)
        if self.on_write is not None:
            self.on_write()

    def __delitem__(self, key: str) -> None:
        super().__delitem__(key)
        if self.on_write is not None:
            self.on_write()


class _WatchedCheckedValues(_WatchedValues, CheckedDict):
    """The same for typed userdata."""

    def __init__(self, fields: Fields) -> None:
        self.on_write = None
        CheckedDict.__init__(self, fields)


class Parameters(NamedTuple):
    """The arguments that a plan shares with its sub-plans; see `PetriNetPlan`."""

    actions: Mapping[str, Any]
    conditions: Mapping[str, Any]
    strict: bool = False
    events: Events = "once"
    event_life: float = EVENT_LIFE_S
    server: PNPServer | None = None


class PetriNetPlan(Container):
    """A container that runs a Petri Net Plan. Outcomes: 'goal', 'fail', 'preempted'.

    Each child is an action of the plan, and its label is the plan's name for it ('/' is replaced by
    ':'). A transition `A.start` starts A; `A.end` and `A.interrupt` ask A to stop if it is still
    running. The token moves on at once, but the end of the plan waits for all actions. A has failed
    if its outcome is a failure or a preempt (`smachpy.events.outcome_classes`), otherwise it has
    finished; `A.end` without a condition waits until it has finished, `A.fail` until it has failed.
    An outcome of A is a condition for the transitions behind A, true once A has ended with it.

    The plan ends with 'goal' when all goal places hold exactly their tokens, and with 'fail' when
    all fail places do, or when nothing can fire any more, which is logged.

    Args:
        plan: The plan, or its net.
        actions: Name of an action, or a whole name ("goto_kitchen") -> a state (for one name), a
            class of states, called with the parameters of the name, a function, called with the
            userdata and the parameters, or `Function`, `Goal`, `Made`.
        conditions: Name -> function of the userdata (and of the parameters in the name),
            `Expression`, `TopicCondition`, `Polled`, or a bool. Other names are events: `post`.
        strict: Whether a guarded end also waits for the end of its action; only for a net.
        events: "once": the first guard that reads an event uses it up; "lasting": it holds until
            "not_" and its name is posted.
        event_life: Time after which an unread event is dropped [s]; for "once".
        sub_plans: Name of an action -> the plan that executes it.
        server: A robot that executes the other actions and evaluates the other conditions.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        name: Name when it is the root; default: the net's.
        userdata_type: As for any container.
        userdata: Likewise.
        **options: See `StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.

    Threads: an action runs in the plan's thread if nothing can fire before it ends, otherwise in a
        thread of its own. Conditions are evaluated in the plan's thread.

    Source of the firing rules: the executor of PetriNetPlans 1.4; docs/petri_net_plans.md lists the
    differences.
    """

    _smachpy: DataOf[PlanData] = DataOf(PlanData)
    _smachpy_kind: ClassVar[Kind] = "plan"

    plan: Shown[Plan] = Shown(lambda self: self._smachpy.net_plan)
    problems: Shown[tuple[PlanProblem, ...]] = Shown(lambda self: self._smachpy.net_plan.problems)
    dropped_events: Shown[int] = Shown(lambda self: self._smachpy.knowledge.dropped)

    def __init__(
        self,
        plan: Plan | Net,
        actions: Mapping[str, Any] | None = None,
        conditions: Mapping[str, Any] | None = None,
        *,
        strict: bool = False,
        events: Events = "once",
        event_life: float = EVENT_LIFE_S,
        sub_plans: Mapping[str, PetriNetPlan] | None = None,
        server: PNPServer | None = None,
        input_keys: Names = (),
        output_keys: Names = (),
        name: str | None = None,
        userdata_type: type | None = None,
        userdata: Mapping[str, Any] | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        if isinstance(plan, Net):
            plan = understand(plan, strict=strict)
        if not isinstance(plan, Plan):
            raise InvalidStateError(f"plan: got {plan!r}; expected a net or a plan.")
        raise_errors(plan.problems)
        super().__init__(
            OUTCOMES,
            input_keys,
            output_keys,
            name=(plan.net.name or "plan") if name is None else name,
            userdata_type=userdata_type,
            userdata=userdata,
            **options,
        )
        data = self._smachpy
        data.net_plan = plan
        before = data_of(self.userdata)
        checked = before if isinstance(before, CheckedDict) else None
        values = (
            _WatchedValues(before) if checked is None else _WatchedCheckedValues(checked.fields)
        )
        object.__setattr__(self.userdata, "_data", values)
        data.knowledge = Knowledge(
            conditions, lambda: self.userdata, events=events, life=event_life, server=server
        )
        # Functions and expressions may depend on the userdata.
        if any(map(callable, data.knowledge.sources.values())):
            values.on_write = data.knowledge.changed
        problems = Problems(type(self).__name__)
        subs = problems.mapping("sub_plans", sub_plans, "name -> plan")
        given = problems.mapping("actions", actions, "name -> state or function")
        problems.raise_all()
        data.registered = given
        self.__bind(Binder({**subs, **given}, self.__built_in(), server))

    def __built_in(self) -> dict[str, Any]:
        return {
            "wait": Wait,
            "waitfor": lambda call: WaitFor(call, self._smachpy.knowledge),
            "setvar": SetVariable,
            "unknownvar": lambda call: SetVariable(call, self.__forget_variable),
            "restartcurrentplan": lambda _call: Order(partial(self.__order, "restart")),
            "stopcurrentplan": lambda _call: Order(partial(self.__order, "stop")),
        }

    def __bind(self, binder: Binder) -> None:
        """Create the states of all actions, and record their problems."""
        data = self._smachpy
        for name, known in data.net_plan.executables.items():
            label = name.replace("/", ":")  # '/' separates the labels of a path
            while label in data.children:  # "a/b" and "a:b" would have the same label
                label += "'"
            state, problem = binder.bind(name)
            if problem:
                place = known.places[0] if known.places else -1
                data.unbound[label] = problem_of(
                    data.net_plan.net, "unbound", "error", problem, place=place
                )
            self._smachpy_store_child(label, state, None)
            data.names[label] = name

    # -- structure -----------------------------------------------------------------------------

    def get_initial_states(self) -> list[str]:
        """Return no labels: the net decides what begins first."""
        return []

    def get_active_states(self) -> list[str]:
        """Return the labels of the running actions."""
        execution = self._smachpy.execution
        return [] if execution is None else list(execution.active())

    def set_initial_state(
        self, initial_states: Sequence[str], userdata: UserData | None = None
    ) -> None:
        """Add to the userdata; the tokens of the net determine where the plan begins.

        Raises:
            InvalidStateError: labels are given.
        """
        if initial_states:
            raise InvalidStateError(
                f"initial states: got {list(initial_states)}; expected none: the tokens of the net "
                "say where a plan begins."
            )
        if userdata is not None:
            self.userdata.update(userdata)

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return (name of a transition, label of a child, label of the next child) for the net."""
        net, child = self._smachpy.net_plan.net, self.__children_of_places()
        return [
            (net.transition_name(number), child[source], child[target])
            for number in range(len(net.transitions))
            for source, _ in net.inputs[number]
            if source in child
            for target, _ in net.outputs[number]
            if target in child
        ]

    def __children_of_places(self) -> dict[int, str]:
        """Return number of an exec place -> label of the child that runs there."""
        labels = self._smachpy.labels()
        executables = self._smachpy.net_plan.executables
        return {p: labels[name] for name, known in executables.items() for p in known.places}

    def find_problems(self, where: str) -> tuple[str, ...]:
        """Return the problems that keep the plan from running: wrong labels, unknown actions."""
        errors = [p for p in self._smachpy.net_plan.problems if p.severity == "error"]
        wrong = [f"{where}: {problem}" for problem in (*errors, *self.__unbound(most=1))]
        return (*wrong, *self.__shared_states(where))

    def __unbound(self, most: int) -> list[PlanProblem]:
        """Return the problems of actions that have no state, and no test double either.

        A plan that was loaded without any actions gets one problem for all actions that are not
        registered, if these are more than `most`.
        """
        data = self._smachpy
        missing = [
            (state, problem)
            for label, problem in data.unbound.items()
            if isinstance(state := data.children[label], Unbound)
        ]
        unknown = [state.call for state, _ in missing if state.is_unknown]
        if data.registered or len(unknown) <= most:
            return [problem for _, problem in missing]
        names = sorted({call.action or call.name for call in unknown})
        text = f"has no actions registered; expected one for each of {', '.join(names)}."
        hint = "Try a file actions.yaml beside it, or actions={...}."
        # A name that fits no built-in action, such as wait_here, may be one of the user's.
        wrong = [replace(p, severity="note") for state, p in missing if not state.is_unknown]
        return [*wrong, problem_of(data.net_plan.net, "unbound", "note", text, hint=hint)]

    def __not_imported(self) -> list[PlanProblem]:
        """Return a note about the code that was not looked at."""
        data = self._smachpy
        given = [*data.registered.values(), *data.knowledge.sources.values()]
        things = [one.function if isinstance(one, Polled) else one for one in given]
        names = sorted({one.name for one in things if isinstance(one, NotImported)})
        if not names:
            return []
        text = f"names {', '.join(names)}, which were not imported, as that runs code."
        hint = "Try --import to look at their outcomes and userdata keys, too."
        return [problem_of(data.net_plan.net, "unbound", "note", text, hint=hint)]

    def _smachpy_check(self, path: str) -> Iterator[Problem]:
        """Yield the problems of the plan for `smachpy.check`."""
        from smachpy.pnp.checked import find_problems  # programs that only run need none of it

        return find_problems(self, path)

    def binding_problems(self) -> tuple[PlanProblem, ...]:
        """Return the problems of actions and conditions for which nothing is registered."""
        plan, knowledge = self._smachpy.net_plan, self._smachpy.knowledge
        found = [*self.__unbound(most=0), *self.__not_imported()]
        table = _Compiled(self).table
        # Name -> its first transition: in reverse, so that earlier transitions replace later ones.
        asked = {
            name: number
            for number, guard in reversed(tuple(enumerate(table.guards)))
            if guard is not None
            for name in guard.atoms()
            if name not in table.outcome_tests
            and knowledge.source_of(name) is None
            and not knowledge.asks_server(name)
            and not is_built_in(name)
        }
        if not knowledge.sources:
            names = sorted(asked)
            if names:
                text = f"waits for events that the program has to post: {', '.join(names)}."
                found.append(problem_of(plan.net, "unknown-condition", "note", text))
            return tuple(found)
        for name, number in asked.items():
            text = (
                f"asks for {name!r}, which is not registered; expected one of "
                f"{sorted(knowledge.sources)}, or an event that the program posts."
                f"{did_you_mean(name, knowledge.sources)}"
            )
            found.append(problem_of(plan.net, "unknown-condition", "note", text, transition=number))
        return tuple(found)

    def __shared_states(self, where: str) -> Iterator[str]:
        # Actions run at the same time, and a state object has only one run at a time.
        for state, first, second in shared_below(self._smachpy.others()):
            yield (
                f"{where}: one state for two actions: got one {type(state).__name__} below both "
                f"{first!r} and {second!r}; expected an instance for each."
            )

    def describe_structure(self) -> Structure:
        """Return the children and the net."""
        details = (
            (("strict", "an end waits for its action"),) if self._smachpy.net_plan.strict else ()
        )
        return replace(super().describe_structure(), net=self.__net_record(), details=details)

    def __net_record(self) -> NetRecord:
        plan: Plan = self._smachpy.net_plan
        net, label_of, child = plan.net, self._smachpy.labels(), self.__children_of_places()
        places = tuple(
            PlaceRecord(
                place.id,
                place.name.strip(),
                place.tokens,
                child.get(number, ""),
                "goal" if number in plan.goals else "fail" if number in plan.fails else "place",
            )
            for number, place in enumerate(net.places)
        )
        transitions = tuple(
            NetTransitionRecord(
                transition.id,
                transition.name.strip(),
                "" if plan.conditions[number] is None else str(plan.conditions[number]),
                tuple((label_of[name], function) for name, function in plan.calls[number]),
                tuple((net.places[p].id, weight) for p, weight in net.inputs[number]),
                tuple((net.places[p].id, weight) for p, weight in net.outputs[number]),
            )
            for number, transition in enumerate(net.transitions)
        )
        return NetRecord(places, transitions)

    # -- running -------------------------------------------------------------------------------

    def _smachpy_compile(self) -> _Compiled:
        return _Compiled(self)

    def _smachpy_run_children(self, frame: Frame, plan: _Compiled) -> str:
        data = self._smachpy
        if data.start_cbs:
            self.call_start_cbs()
        data.execution = execution = Execution(self, frame, plan.steps, plan.table)
        try:
            return execution.run()
        finally:
            data.execution = None

    def marking(self) -> dict[str, int]:
        """Return id of a place -> its tokens, for places that hold some; if idle, at the start.

        Threads: any.
        """
        # No lock: a run replaces its moment in one assignment, and a moment never changes its
        # marking.
        execution, net = self._smachpy.execution, self._smachpy.net_plan.net
        marking = net.initial if execution is None else execution.moment.marking
        places = net.places
        return {places[p].id: marking.count(p) for p in dict.fromkeys(marking)}

    def post(self, event: str) -> None:
        """Post an event to the guards of the plan and of all plans below it.

        Args:
            event: Its name; "not_NAME" and "!NAME" make NAME false from now on.

        Threads: any; does not wait.
        """
        frame = self._smachpy.live.frame
        # Its life begins now for a sub-plan that does not run yet, too.
        clock = None if frame is None else frame.run.clock
        for plan in plans_in(self):
            plan._smachpy.knowledge.post(event, clock)

    def set_condition(self, name: str, value: bool | None) -> None:
        """Set a condition of the plan and of all plans below it; None deletes it.

        It has no effect where one of this name is registered.

        Raises:
            InvalidStateError: `name` is empty or no text, or `value` is a text.

        Threads: any; does not wait.
        """
        for plan in plans_in(self):
            plan._smachpy.knowledge.set(name, value)

    def fire(self, transition: str) -> None:
        """Fire a transition now regardless of its guard, if its places hold their tokens.

        An action that it ends, or the only one that the plan was waiting for, is asked to stop.

        Args:
            transition: Its id.

        Raises:
            InvalidStateError: there is no such transition, or the plan is not running.

        Threads: any; does not wait.
        """
        known = self._smachpy.net_plan.net.transition_numbers
        if transition not in known:
            raise InvalidStateError(
                f"fire: got {transition!r}; expected the id of a transition, of {sorted(known)}."
                f"{did_you_mean(transition, known)}"
            )
        self.__order("fire", transition)

    def __order(self, what: str, which: str = "") -> None:
        execution = self._smachpy.execution
        if execution is None:
            raise InvalidStateError(f"{self.name}: {what}: the plan is not running.")
        execution.order(what, which)

    def __forget_variable(self, key: str) -> None:
        if key in self.userdata:
            del self.userdata[key]


def plans_in(state: State) -> list[PetriNetPlan]:
    """Return all plans in a state, itself included, from the outside in."""
    # One instance may be in several places.
    return [s for s in {id(s): s for s in below(state)}.values() if isinstance(s, PetriNetPlan)]


# -- loading ---------------------------------------------------------------------------------------


def load(
    file: Path | str,
    actions: Mapping[str, Any] | None = None,
    conditions: Mapping[str, Any] | None = None,
    *,
    strict: bool = False,
    events: Events = "once",
    event_life: float = EVENT_LIFE_S,
    server: PNPServer | None = None,
    **options: Any,
) -> PetriNetPlan:
    """Load a plan from a file: `.pnml`, or a text form, `.plan` or `.pddlout`.

    A text form uses the execution rules in the file with the same name and the ending `.er`. If an
    action is not registered under its whole name and a file NAME.pnml (or .plan, .pddlout) is
    beside `file`, it is that plan.

    Args:
        file: The file.
        actions: See `PetriNetPlan`; they also apply to sub-plans.
        conditions: Likewise.
        strict: Likewise.
        events: Likewise.
        event_life: Likewise.
        server: Likewise.
        **options: Likewise.

    Raises:
        PlanError: it cannot be read, or has errors; all problems at once, with those of sub-plans.
        InvalidStateError: an argument is wrong.
    """
    parameters = Parameters(actions or {}, conditions or {}, strict, events, event_life, server)
    plan = read_plan(file, parameters, options)
    raise_errors(plan.problems)
    return plan


_MAX_SUBPLAN_DEPTH = 20  # sub-plans in each other


def read_plan(
    file: Path | str,
    parameters: Parameters,
    options: Mapping[str, Any] | None = None,
    above: tuple[Path, ...] = (),
) -> PetriNetPlan:
    """Load a plan even if its labels have errors: it can be drawn and checked, but does not run.

    Args:
        file: As for `load`.
        parameters: The parameters of the plan and its sub-plans.
        options: Other arguments of the plan itself.
        above: The files of the plans above it, if it is a sub-plan.

    Raises:
        PlanError: as for `load`, except errors in labels.
        InvalidStateError: an argument is wrong.
    """
    file = Path(file)
    net, problems = read_net(file)
    plan = understand(net, strict=parameters.strict, problems=problems)
    found: list[PlanProblem] = []
    stack = (*above, file.resolve())
    subs: dict[str, PetriNetPlan] = {}
    for name, known in plan.executables.items():
        # No '/': the name of an action must not lead to files of another folder.
        part = None if "/" in name else find_plan(file.parent, name)
        if name in parameters.actions or part is None:
            continue
        if part.resolve() in stack or len(stack) > _MAX_SUBPLAN_DEPTH:
            line = net.places[known.places[0]].line if known.places else 0
            text = f"{name!r} is the plan {str(part)!r}, which contains itself; expected another."
            found.append(PlanProblem("recursion", "error", text, "", net.file, line))
            continue
        try:
            subs[name] = read_plan(part, parameters, above=stack)
        except PlanError as error:
            found += error.found
    raise_errors(found)
    # The constructor refuses a plan with errors: it gets one without them, replaced below.
    runnable = tuple(problem for problem in plan.problems if problem.severity != "error")
    machine = PetriNetPlan(
        replace(plan, problems=runnable),
        parameters.actions,
        parameters.conditions,
        events=parameters.events,
        event_life=parameters.event_life,
        sub_plans=subs,
        server=parameters.server,
        **(options or {}),
    )
    machine._smachpy.net_plan = plan
    return machine
