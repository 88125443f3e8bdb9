"""The states that a plan's action names stand for: the user's, functions, goals, sub-plans."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from smachpy.base.problems import Problems
from smachpy.engine.frame import clock_of_run
from smachpy.engine.preempt import on_preempt
from smachpy.exceptions import InvalidStateError, did_you_mean, error_text
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from smachpy.pnp.knowledge import Knowledge
    from smachpy.pnp.server import PNPServer

OUTCOMES: Final = ("succeeded", "aborted", "preempted")


@dataclass(frozen=True, slots=True)
class Call:
    """The parts of an executable's name, `[ROBOT#]ACTION[_P1[_P2...]]`.

    Attributes:
        name: The whole name.
        robot: The robot, or "".
        action: The action. If it contains a `_` itself, it must be registered to be recognised.
        parameters: The parameters; "@VAR" stands for the userdata key VAR.
    """

    name: str
    robot: str
    action: str
    parameters: tuple[str, ...]

    @property
    def variables(self) -> tuple[str, ...]:
        """The userdata keys that parameters stand for."""
        return tuple(dict.fromkeys(p[1:] for p in self.parameters if p.startswith("@")))

    def values(self, userdata: Any) -> tuple[str, ...]:
        """Return the parameters, variables replaced by their values."""
        return tuple(str(userdata[p[1:]]) if p.startswith("@") else p for p in self.parameters)


def parse_name(name: str, actions: Iterable[str] = ()) -> Call:
    """Split an executable's name; `actions` are the registered names."""
    robot, hash_, rest = name.partition("#")
    if not hash_:
        robot, rest = "", name
    parts = rest.split("_")
    known = set(actions)
    # '_' separates parameters, but action names contain it, too: the longest registered name wins.
    for count in range(len(parts), 0, -1):
        action = "_".join(parts[:count])
        if action in known:
            return Call(name, robot, action, tuple(parts[count:]))
    return Call(name, robot, parts[0], tuple(parts[1:]))


# -- kinds of actions that can be registered -------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Made:
    """An action whose state is created by a function.

    Attributes:
        make: Called with the `Call`, once for each name, when the plan is built; returns a state.
    """

    make: Callable[[Call], State]


@dataclass(frozen=True, slots=True)
class Function:
    """An action that a function executes, `function(userdata, *parameters)`.

    It may be `async`; then a preempt cancels it. If it returns None or True the outcome is
    'succeeded' (None after a request to stop: 'preempted'), False: 'aborted', a text: that text. If
    the function has a parameter named `robot`, it gets the robot's name.

    Attributes:
        function: The function.
        outcomes: Outcomes other than 'succeeded', 'aborted' and 'preempted'.
        input_keys: Userdata keys that it reads.
        output_keys: Userdata keys that it writes.
        options: See `smachpy.machines.state.StateOptions`.
    """

    function: Callable[..., Any]
    outcomes: tuple[str, ...] = ()
    input_keys: tuple[str, ...] = ()
    output_keys: tuple[str, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Goal:
    """An action that sends a goal to an action server.

    Attributes:
        action: Name of the action. If the plan's name has a robot, it is below the robot's name.
        spec: Its class (XAction).
        goal: Field of the goal, with dots ("target_pose.pose.position.x"), -> value. In a text
            "{1}" stands for the first parameter of the plan's name, "{robot}" for the robot and
            "{NAME}" for a userdata key; the text is converted to the type of the field.
        cases: First parameter -> further fields ("kitchen" -> its position).
        options: See `smachpy.SimpleActionState`.
    """

    action: str
    spec: Any
    goal: Mapping[str, Any] = field(default_factory=dict)
    cases: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class NotImported:
    """Stands for what `run: module:name` names in a plan that is only looked at.

    Attributes:
        name: "module:name".
    """

    name: str

    def __call__(self, *_: object) -> Any:
        """Refuse to run.

        Raises:
            InvalidStateError: always.
        """
        raise InvalidStateError(f"{self.name}: it was not imported.")


class Unbound(State):
    """Stands for an action without a state; a plan with one does not run.

    Attributes:
        call: The action.
        is_unknown: Nothing is registered for it; else the state could not be made.
    """

    def __init__(self, call: Call, *, is_unknown: bool = False) -> None:
        super().__init__(OUTCOMES)
        self.call = call
        self.is_unknown = is_unknown

    def execute(self, ud: Any) -> str:
        """Refuse to run.

        Raises:
            InvalidStateError: always.
        """
        del ud
        raise InvalidStateError(f"{self.call.name}: no action is registered for it.")


class FunctionAction(State):
    """Runs a `Function`."""

    _smachpy_kind = "callback"

    def __init__(self, call: Call, function: Function) -> None:
        super().__init__(
            (*OUTCOMES, *function.outcomes),
            (*call.variables, *function.input_keys),
            function.output_keys,
            **function.options,
        )
        from smachpy.actions.interface import adopt_interface

        adopt_interface(self, function.function)
        self._call = call
        self._function = function.function
        self._kwargs = {"robot": call.robot} if _takes_robot(function.function) else {}

    def execute(self, ud: Any) -> str:
        """Call the function.

        Blocks: until it returns.
        """
        return self._outcome(self._function(ud, *self._call.values(ud), **self._kwargs))

    def _outcome(self, result: Any) -> str:
        # A function that stops early because of the request need not return 'preempted'.
        if result is None and self.preempt_requested():
            self.service_preempt()
            return "preempted"
        if result is None or isinstance(result, bool):
            return "aborted" if result is False else "succeeded"
        outcome: str = result
        return outcome


class AsyncFunctionAction(FunctionAction):
    """Runs an `async` `Function`; a preempt cancels it.

    A class of its own, as states are recognised as async by their `execute`.
    """

    async def execute(self, ud: Any) -> str:  # type: ignore[override]
        """Await the function."""
        return self._outcome(await self._function(ud, *self._call.values(ud), **self._kwargs))


# -- built in --------------------------------------------------------------------------------------


class Wait(State):
    """`wait_N`: waits N seconds. Outcomes: 'succeeded', 'preempted'."""

    def __init__(self, call: Call) -> None:
        super().__init__(("succeeded", "preempted"), call.variables)
        _check_count(call, "seconds, as in wait_5", 1)
        self._call = call
        (text,) = call.parameters
        if not text.startswith("@"):  # the value of a variable is known only when it runs
            _seconds(call.name, text)

    def execute(self, ud: Any) -> str:
        """Wait."""
        (text,) = self._call.values(ud)
        return "preempted" if self.sleep(_seconds(self._call.name, text)) else "succeeded"

    def describe_details(self) -> Any:
        """Add the time."""
        kind, details = super().describe_details()
        return kind, (("waits", f"{self._call.parameters[0]} s"), *details)


def _check_count(call: Call, expected: str, most: int | None = None) -> None:
    count = len(call.parameters)
    if count == 0 or (most is not None and count > most):
        raise InvalidStateError(f"{call.name}: got {list(call.parameters)}; expected {expected}.")


def _seconds(name: str, text: str) -> float:
    if not re.fullmatch(r"\d{1,9}(\.\d{1,9})?", text):
        raise InvalidStateError(f"{name}: got {text!r}; expected seconds, as in wait_5.")
    return float(text)


class WaitFor(State):
    """`waitfor_C`: waits until a condition is true; `waitfor_not_C`: until it is false."""

    def __init__(self, call: Call, knowledge: Knowledge) -> None:
        super().__init__(("succeeded", "preempted"), call.variables)
        _check_count(call, "a condition, as in waitfor_door")
        parameters = call.parameters
        self._negated = parameters[0] == "not" and len(parameters) > 1
        self._name = "_".join(parameters[1:] if self._negated else parameters)
        self._knowledge = knowledge

    def execute(self, ud: Any) -> str:
        """Wait.

        Blocks: until the condition has that value, or a preempt.
        """
        del ud
        clock, knowledge = clock_of_run(), self._knowledge
        wake = clock.event(f"condition {self._name}")
        # Both end the wait: a change of a condition, and a preempt.
        forget = [knowledge.subscribe(wake.set), on_preempt(self, wake.set)]
        try:
            while not self.preempt_requested():
                # Clear before looking: a change between the look and the wait sets it again.
                wake.clear()
                if knowledge.value(self._name, self._name, clock.now()) is not self._negated:
                    return "succeeded"
                if not self.preempt_requested():
                    wake.wait(knowledge.every(self._name))
        finally:
            for each in forget:
                each()
        return "preempted"


class SetVariable(State):
    """`setvar_@V_value`: writes the userdata key V. `unknownvar_@V`: deletes it."""

    def __init__(self, call: Call, forget: Callable[[str], None] | None = None) -> None:
        _check_count(call, "a variable, as in setvar_@place_kitchen")
        self._key, *rest = call.parameters
        self._key = self._key.removeprefix("@")
        super().__init__(("succeeded",), (), [self._key])
        self._value = "_".join(rest)  # a value may contain '_'
        self._forget = forget

    def execute(self, ud: Any) -> str:
        """Write or delete the key."""
        if self._forget is not None:
            self._forget(self._key)
        else:
            ud[self._key] = self._value
        return "succeeded"


class Order(State):
    """`restartcurrentplan` and `stopcurrentplan`."""

    def __init__(self, give: Callable[[], object]) -> None:
        super().__init__(("succeeded",))
        self._give = give

    def execute(self, ud: Any) -> str:
        """Give the order."""
        del ud
        self._give()
        return "succeeded"


# -- from names to states --------------------------------------------------------------------------


class Binder:
    """Creates the states of a plan's executables.

    Args:
        actions: Name of an action, or a whole name -> a state (for one name), a class of states
            (called with the parameters), a function (called with the userdata and the parameters),
            `Function`, `Goal`, or `Made`.
        built_in: Name -> function that creates the state from the call.
        server: Executes all other actions; see `PNPServer`.
    """

    def __init__(
        self,
        actions: Mapping[str, Any] | None,
        built_in: Mapping[str, Callable[[Call], State]],
        server: PNPServer | None = None,
    ) -> None:
        problems = Problems("actions")
        holds = "name -> state, class of states, function, Function, Goal or Made"
        self._actions = problems.mapping("actions", actions, holds)
        for name, given in self._actions.items():
            fits = isinstance(given, (State, Function, Goal, Made)) or callable(given)
            if not (isinstance(name, str) and name and fits):
                problems.add(f"got {name!r}: {given!r}; expected {holds}.")
        problems.raise_all()
        if server is not None:  # the others are the robot's own, such as its variables
            built_in = {name: built_in[name] for name in built_in.keys() & server.LOCAL}
        self._built_in = built_in
        self._server = server
        self._taken: dict[int, str] = {}  # id of a state -> the name that has it

    def bind(self, name: str) -> tuple[State, str]:
        """Return the state of an executable, and the problem with it or ""."""
        known = {*self._actions, *self._built_in}
        call = parse_name(name, known)
        given = self._actions.get(name, self._actions.get(call.action))
        if name in self._actions:  # registered under its whole name: it has no parameters
            call = Call(name, call.robot, name, ())
        try:
            if given is None and call.action in self._built_in:
                return self._built_in[call.action](call), ""
            if given is None and self._server is not None:
                return self._server.state(call), ""
            if given is None:
                return Unbound(call, is_unknown=True), _unknown(call, known)
            return self._made(call, given), ""
        except InvalidStateError as error:
            return Unbound(call), error.message
        except Exception as error:  # noqa: BLE001  the user's constructor; reported with the others
            text = f"{name}: making its state raised {error_text(error)}"
            return Unbound(call), text

    def _made(self, call: Call, given: Any) -> State:
        # One name for each state: actions run at the same time, and a state object runs once.
        if isinstance(given, State):
            other = self._taken.setdefault(id(given), call.name)
            if other != call.name:
                raise InvalidStateError(
                    f"{call.name}: got the state that {other!r} has, too; expected one of its "
                    "own. Try its class, or pnp.Made(function)."
                )
            return given
        if isinstance(given, Goal):
            return _goal_state(call, given)
        if isinstance(given, NotImported):
            return FunctionAction(call, Function(given))
        if isinstance(given, type) and issubclass(given, State):
            if call.variables:
                raise InvalidStateError(
                    f"{call.name}: got a class of states; expected a function, because "
                    f"{['@' + v for v in call.variables]} are known only when it runs."
                )
            made: Callable[..., State] = given
            return _checked(call, made(*call.parameters))
        if isinstance(given, Made):
            return _checked(call, given.make(call))
        function = given if isinstance(given, Function) else Function(given)
        is_async = inspect.iscoroutinefunction(function.function)
        count = 1 + len(call.parameters)
        problems = Problems(call.name)
        shown = ", ".join(["userdata", *(f"parameter {n}" for n in range(1, count))])
        kwargs = {"robot": ""} if _takes_robot(function.function) else None
        problems.function(
            "function", function.function, f"function({shown})", count, kwargs, plain=False
        )
        problems.raise_all()
        return (AsyncFunctionAction if is_async else FunctionAction)(call, function)


def _takes_robot(function: Any) -> bool:
    try:
        return "robot" in inspect.signature(function).parameters
    except (TypeError, ValueError):
        return False


def _checked(call: Call, made: Any) -> State:
    if not isinstance(made, State):
        raise InvalidStateError(f"{call.name}: got {made!r}; expected a state.")
    return made


def _unknown(call: Call, known: Iterable[str]) -> str:
    known = sorted(known)
    return (
        f"{call.name}: no action is registered for it: got {call.action!r}; expected one of "
        f"{known}.{did_you_mean(call.action, known)}"
    )


def _goal_state(call: Call, goal: Goal) -> State:
    """Return the state that sends a goal; fields that do not depend on userdata are checked now."""
    from smachpy.actions.simple_action_state import SimpleActionState

    fields = {**goal.goal}
    # The value of a variable is known only when it runs, and is looked up then.
    if not (call.parameters and call.parameters[0].startswith("@")):
        _case(call, goal, call.parameters)
    # "{NAME}" in any text is a userdata key, which the state must declare; "{1}" is a parameter.
    keys = {
        key
        for text in (*fields.values(), *(v for c in goal.cases.values() for v in c.values()))
        if isinstance(text, str)
        for key in re.findall(r"{([A-Za-z]\w*)}", text)
        if key != "robot"
    }
    action = f"{call.robot}/{goal.action}" if call.robot else goal.action

    def fill(ud: Any, made: Any) -> None:
        parameters = call.values(ud)
        case = _case(call, goal, parameters)
        for path, value in {**fields, **case}.items():  # a case replaces fields of the goal
            _set_field(call, made, path, _filled(call, value, parameters, ud))

    state = SimpleActionState(
        action,
        goal.spec,
        goal_cb=fill,
        input_keys=(*call.variables, *sorted(keys)),
        **goal.options,
    )
    if not (call.variables or keys):
        spec: Any = goal.spec
        fill({}, spec().action_goal.goal)  # reports a wrong field now, not during the run
    return state


def _case(call: Call, goal: Goal, parameters: tuple[str, ...]) -> Mapping[str, Any]:
    """Return the further fields for the first parameter.

    Raises:
        InvalidStateError: there are cases, but none for it.
    """
    if not goal.cases:
        return {}
    case = parameters[0] if parameters else ""
    if case not in goal.cases:
        raise InvalidStateError(
            f"{call.name}: cases: got {case!r}; expected one of {sorted(goal.cases)}."
            f"{did_you_mean(case, goal.cases)}"
        )
    return goal.cases[case]


def _filled(call: Call, value: Any, parameters: tuple[str, ...], ud: Any) -> Any:
    if not isinstance(value, str):
        return value

    def one(match: re.Match[str]) -> str:
        word = match[1]
        if word == "robot":
            return call.robot
        if not word.isdecimal():
            return str(ud[word])
        if not 0 < int(word) <= len(parameters):
            raise InvalidStateError(
                f"{call.name}: got {{{word}}}; expected one of its {len(parameters)} parameters."
            )
        return parameters[int(word) - 1]

    return re.sub(r"{(\w+)}", one, value)


def _set_field(call: Call, message: Any, path: str, value: Any) -> None:
    """Set a field of a message; a text is converted to the type of the field.

    Raises:
        InvalidStateError: there is no such field, or the value does not fit it.
    """
    *outer, last = path.split(".")
    for name in outer:
        message = _field(call, message, name, path)
    # New messages have default values, whose types are those of the fields.
    before = _field(call, message, last, path)
    kind = type(before)
    if isinstance(value, str) and kind is not str:
        try:
            value = _read(kind, value)
        except ValueError as error:
            raise InvalidStateError(
                f"{call.name}: goal: {path}: got {value!r}; expected {kind.__name__}."
            ) from error
    try:
        setattr(message, last, value)
    except (TypeError, ValueError, AttributeError) as error:
        raise InvalidStateError(f"{call.name}: goal: {path}: {error}") from error


def _read(kind: type, text: str) -> Any:
    if kind is bool and text.lower() in {"true", "false", "1", "0"}:
        return text.lower() in {"true", "1"}
    if kind not in {int, float}:
        raise ValueError(text)
    return kind(text)


def _field(call: Call, message: Any, name: str, path: str) -> Any:
    known = list(getattr(message, "__slots__", ()))
    if name not in known:
        raise InvalidStateError(
            f"{call.name}: goal: {path}: got {name!r}; expected one of {known}."
            f"{did_you_mean(name, known)}"
        )
    return getattr(message, name)
