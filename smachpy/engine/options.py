"""The options of a state, and their checks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.exceptions import InvalidNameError
from actionlib_core.names import check_name
from actionlib_core.resources import POLICIES
from smachpy.base.frozen import Frozen
from smachpy.base.problems import Problems, as_number, plain, unknown_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import TypeAlias

    from actionlib_core.resources import Policy

    Result: TypeAlias = str | type[BaseException]


class Retry(Frozen):
    """Run a state again when it ends badly.

    Attributes:
        attempts: Maximum number of runs, including the first one; >= 1.
        backoff: Wait before the second attempt [s]; doubled for each further one.
        on: Outcomes and exception types after which the state runs again.

    Raises:
        InvalidStateError: a value is wrong; all problems at once.
    """

    __slots__ = ("attempts", "backoff", "on")

    attempts: int
    backoff: float
    on: tuple[Result, ...]

    def __init__(
        self,
        attempts: int = 2,
        backoff: float = 0.0,
        on: Result | Iterable[Result] = ("aborted",),
    ) -> None:
        problems = Problems("")
        expected = "a whole number of attempts >= 1"
        checked = {
            "attempts": problems.whole("retry: attempts", attempts, 1, expected),
            "backoff": problems.seconds("retry: backoff", backoff, optional=False),
            "on": _results(problems, on),
        }
        problems.raise_all()
        self._set(**checked)

    def wants(self, attempt: int, result: str | BaseException) -> bool:
        """Return whether to run again after attempt number `attempt` (from 1) gave `result`."""
        if attempt >= self.attempts:
            return False
        if isinstance(result, BaseException):
            kinds = tuple(kind for kind in self.on if isinstance(kind, type))
            return isinstance(result, kinds)
        return isinstance(result, str) and result in self.on

    def wait_s(self, attempt: int) -> float:
        """Return the pause after attempt number `attempt` (from 1) [s]."""
        return float(self.backoff * 2.0 ** min(attempt - 1, _DOUBLINGS))

    def __str__(self) -> str:
        on = ", ".join(item if isinstance(item, str) else item.__name__ for item in self.on)
        return f"{self.attempts} attempts, {self.backoff:g} s apart, on {on}"


_DOUBLINGS = 60  # of a pause, which lasts for ever by then; 1,024 of them are no float any more
REFUSED = "refused"


class Resource(Frozen):
    """What a state needs for itself while it executes, such as the base of the robot.

    Attributes:
        name: A ROS name; relative to the namespace of the node.
        policy: While another one holds it: "wait" until it is free, "preempt" the holder and wait
            until it has stopped, or "refuse" to execute and end with the outcome 'refused'.

    Raises:
        InvalidStateError: a value is wrong; all problems at once.
    """

    __slots__ = ("name", "policy")

    name: str
    policy: Policy

    def __init__(self, name: str, policy: Policy = "wait") -> None:
        problems = Problems("")
        word = problems.word("resource: name", name)
        try:
            check_name(word or "x", "resource name")
        except InvalidNameError as error:
            problems.add(f"resource: {error}")
        if not isinstance(policy, str) or policy not in POLICIES:
            problems.add(f"resource: policy: got {policy!r}; expected one of {list(POLICIES)}.")
        problems.raise_all()
        self._set(name=word, policy=plain(policy))

    def __str__(self) -> str:
        return self.name if self.policy == "wait" else f"{self.name}, {self.policy}"


class Options(NamedTuple):
    """The options of one state, checked; `smachpy.machines.state.StateOptions` describes them."""

    timeout: float | None = None
    timeout_outcome: str = "aborted"
    preempt_timeout: Any = "inherit"
    retry: Retry | None = None
    on_exception: Mapping[type[BaseException], str] = {}
    on_enter: Callable[[Any], object] | None = None
    on_exit: Callable[[Any, Any], object] | None = None
    resume: str | Callable[[Any], Any] | None = None
    on_resume: Callable[[Any], object] | None = None
    idempotent: bool = False
    transient: tuple[str, ...] = ()
    success: tuple[str, ...] | None = None
    resource: Resource | None = None

    def made_outcomes(self) -> tuple[str, ...]:
        """Return the outcomes that these options add to a state."""
        own = () if self.timeout is None else (self.timeout_outcome,)
        skipped = () if self.skipped is None else (self.skipped,)
        may_refuse = self.resource is not None and self.resource.policy == "refuse"
        return (*own, *self.on_exception.values(), *skipped, *[REFUSED][:may_refuse])

    @property
    def skipped(self) -> str | None:
        """The outcome of `resume="skip:OUTCOME"`; None for any other `resume`."""
        is_skip = isinstance(self.resume, str) and self.resume.startswith(SKIP)
        return str(self.resume)[len(SKIP) :] if is_skip else None


SKIP = "skip:"
ASK = "ask"
NO_OPTIONS = Options()
NAMES = Options._fields


def _is_caught(kind: object) -> bool:
    """Return whether `kind` is a type of exceptions of states; what ends a program is none."""
    if not (isinstance(kind, type) and issubclass(kind, BaseException)):
        return False
    return issubclass(kind, Exception) or issubclass(ExceptionGroup, kind)


def _results(problems: Problems, on: Any) -> tuple[Any, ...]:
    found = (on,) if isinstance(on, (str, type)) or not isinstance(on, Iterable) else tuple(on)
    wrong = [item for item in found if not ((isinstance(item, str) and item) or _is_caught(item))]
    if wrong or not found:
        problems.add(f"retry: on: got {wrong or on!r}; expected outcomes or exception types.")
    return found


def changed(options: Options, given: Mapping[str, Any], problems: Problems) -> Options:
    """Return a copy of `options` with the values in `given`, whose names are valid."""
    checked = {name: _CHECKS[name](problems, name, value) for name, value in given.items()}
    return options._replace(**checked)


def outcome_problems(options: Options, outcomes: Iterable[str]) -> Iterator[str]:
    """Yield the problems of the options that name outcomes, for a state with these outcomes."""
    known = {*outcomes, *options.made_outcomes(), "preempted"}
    for name in options.success or ():
        if name not in known:
            yield unknown_name("success: outcome", name, known)
    retry = options.retry
    # One that can occur is enough; others beside it do no harm.
    if retry is None or any(isinstance(one, type) or one in known for one in retry.on):
        return
    yield (
        f"retry: got {retry!r}; expected outcomes of the state that ask for another attempt, of "
        f"{sorted(known)}, or exception types. Try retry=({retry.attempts}, {retry.backoff:g}, "
        "[...])."
    )


def _preempt_timeout(problems: Problems, name: str, given: Any) -> Any:
    return given if isinstance(given, str) and given == "inherit" else problems.seconds(name, given)


def _retry(problems: Problems, name: str, given: Any) -> Retry | None:
    if given is None or isinstance(given, Retry):
        return given
    with problems:
        if isinstance(given, tuple) and 1 <= len(given) <= 3:  # noqa: PLR2004  the three fields
            return Retry(*given)
        if as_number(given) is not None:
            return Retry(given)
        problems.add(
            f"{name}: got {given!r}; expected Retry(attempts, backoff, on), that as a tuple, or a "
            "number of attempts."
        )
    return None


def _on_exception(problems: Problems, name: str, given: Any) -> dict[type[BaseException], str]:
    holds = "exception type -> outcome"
    if given is not None and not isinstance(given, Mapping):
        problems.add(f"{name}: got {given!r}; expected a dict: {holds}.")
        return {}
    for kind, outcome in (given or {}).items():
        if not _is_caught(kind):
            problems.add(f"{name}: got {kind!r} in it; expected {holds}.")
        if not isinstance(outcome, str) or not outcome:
            problems.add(f"{name}: got outcome {outcome!r} in it; expected {holds}.")
    known = given or {}
    return {kind: plain(o) if isinstance(o, str) else o for kind, o in known.items()}


def _resume(problems: Problems, name: str, given: Any) -> Any:
    if given is None or given == ASK:
        return given
    if isinstance(given, str) and given.startswith(SKIP) and given != SKIP:
        return given
    if isinstance(given, str) or not callable(given):
        problems.add(
            f"{name}: got {given!r}; expected 'skip:OUTCOME', 'ask', or a function "
            "resume(userdata)."
        )
        return None
    return problems.function(name, given, "resume(userdata)", 1)


def _flag(problems: Problems, name: str, given: Any) -> bool:
    if not isinstance(given, bool):
        problems.add(f"{name}: got {given!r}; expected True or False.")
    return given is True


def _resource(problems: Problems, name: str, given: Any) -> Resource | None:
    if given is None or isinstance(given, Resource):
        return given
    with problems:
        if isinstance(given, str):
            return Resource(given)
        if isinstance(given, tuple) and 1 <= len(given) <= 2:  # noqa: PLR2004  the two fields
            return Resource(*given)
        problems.add(f"{name}: got {given!r}; expected a name, Resource(name, policy), or a tuple.")
    return None


_CHECKS: dict[str, Callable[[Problems, str, Any], Any]] = {
    "timeout": Problems.seconds,
    "timeout_outcome": Problems.word,
    "preempt_timeout": _preempt_timeout,
    "retry": _retry,
    "on_exception": _on_exception,
    "on_enter": lambda p, name, f: p.function(name, f, "on_enter(userdata)", 1),
    "on_exit": lambda p, name, f: p.function(name, f, "on_exit(userdata, outcome)", 2),
    "resume": _resume,
    "on_resume": lambda p, name, f: p.function(name, f, "on_resume(userdata)", 1),
    "idempotent": _flag,
    "transient": Problems.names,
    "resource": _resource,
    "success": lambda p, name, given: None if given is None else p.names(name, given),
}
