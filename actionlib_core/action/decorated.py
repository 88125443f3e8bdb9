"""An action server as one decorated function.

    @server("dock", DockAction)
    def dock(goal, ctx):
        if goal.bay > 3:
            raise Reject("there are three bays")
        for metres in approach(goal.bay):
            ctx.feedback(DockFeedback(distance=metres))
            if ctx.sleep(0.1):
                raise Preempted("stopped before the bay")
        return DockResult(docked=True)

    with dock.start() as running:
        running.wait()

The function can still be called directly, which is how to test it. It may be `async`: a cancel or a
newer goal then cancels its task.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

from actionlib_core.action.simple_server import TEXT_ACCEPTED, SimpleActionServer
from actionlib_core.exceptions import ActionlibError
from actionlib_core.goal.states import TERMINAL, Status
from actionlib_core.inputs.arguments import check_function, is_async

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from typing import Self

    from actionlib_core.action._action_spec import ActionSpec
    from actionlib_core.action.server import OnClientLost, ServerGoalHandle
    from actionlib_core.goal.single import Policy
    from actionlib_core.node import Node
    from actionlib_core.resources import Policy as ResourcePolicy

G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")


class GoalEnd(Exception):  # noqa: N818  an end is not always an error
    """Ends the goal that is being executed; raise one of the three subclasses.

    Attributes:
        text: The reason, which the client sees.
        result: The result to send; None: one with default values.
    """

    def __init__(self, text: str = "", result: Any = None) -> None:
        self.text = text
        self.result = result
        super().__init__(text)


class Abort(GoalEnd):
    """Raised in a `server` function: the goal failed, ABORTED.

    Args:
        text: The reason, for people.
        result: The result message (XResult); None sends one with default values.
    """


class Preempted(GoalEnd):
    """Raised in a `server` function: the goal was stopped on request, PREEMPTED.

    The arguments are those of `Abort`.
    """


class Reject(GoalEnd):
    """Raised in a `server` function: the goal is refused, REJECTED; ABORTED if it was accepted.

    The arguments are those of `Abort`.
    """


class GoalContext(Generic[F]):
    """The second argument of a `server` function: feedback and preempts of its goal.

    In an `async` function, wait with `await` instead of `sleep` and `wait_preempt`, which would
    hold up its loop; a preempt cancels its task.

    The goal is accepted when the function first uses the context, at the latest when it returns.
    Until then the function can still reject it.

    Attributes:
        goal_id: The goal's id.
    """

    def __init__(self, runner: _DecoratedServer, handle: ServerGoalHandle) -> None:
        self._runner = runner
        self._handle = handle
        self.goal_id: str = handle.record.id

    def accept(self, text: str = TEXT_ACCEPTED) -> None:
        """Accept the goal unless it is accepted already; then it can no longer be rejected."""
        if self._handle.record.status in {Status.PENDING, Status.RECALLING}:
            self._handle.set_accepted(text)

    def feedback(self, message: F) -> None:
        """Send feedback to the client.

        Raises:
            ActionException: `message` is not of the action's type.
            FieldError: a field of it has a wrong type.
        """
        self.accept()
        self._handle.publish_feedback(message)

    @property
    def preempted(self) -> bool:
        """Whether the goal is asked to stop, by a cancel or a newer goal, or has ended."""
        self.accept()
        return self._is_over() or self._runner.is_preempt_requested()

    def wait_preempt(self, timeout: float | None = None) -> bool:
        """Wait until the goal is asked to stop; return whether it is, or has ended.

        Blocks: until then, `timeout` [s] at most; None: no limit.

        Threads: any; one that outlives the function hears of the goal's end.
        """
        self.accept()
        return self._is_over() or self._runner.wait_preempt(timeout) or self._is_over()

    def _is_over(self) -> bool:
        """Return whether the function has ended, but not a thread of it: the next goal may run."""
        return self._handle.record.status in TERMINAL

    def sleep(self, seconds: float) -> bool:
        """Sleep, but wake up when the goal is asked to stop.

        Returns:
            Whether the sleep ended early because of that.

        Blocks: for `seconds`, or until the goal is asked to stop.
        """
        return self.wait_preempt(seconds)


class _DecoratedServer(SimpleActionServer):
    """A simple action server whose goals are accepted by their function (`GoalContext.accept`)."""

    _accepts = False

    def __init__(self, function: Any, **kwargs: Any) -> None:
        self._function = function
        self._is_async = is_async(function)
        self._cancel_task: Callable[[], object] = bool  # cancels the task of an async function
        super().__init__(execute_cb=lambda _goal: None, **kwargs)

    def _tell_preempt(self) -> None:
        super()._tell_preempt()
        self._cancel_task()

    def _call(self, goal: Any, context: GoalContext[Any]) -> Any:
        """Call the function; one that is `async` runs in a loop of its own.

        Raises:
            Preempted: it was asked to stop, and has let that end it.
        """
        made = self._function(goal, context)
        if not self._is_async:
            return made
        import asyncio  # here, as it slows down the start of programs that do not use it

        async def main() -> Any:
            loop, task = asyncio.get_running_loop(), asyncio.ensure_future(made)

            def cancel() -> None:
                self._cancel_task = bool  # once: what it does after that is its clean-up
                loop.call_soon_threadsafe(task.cancel)

            with self.lock:
                self._cancel_task = cancel
                if self.is_preempt_requested():
                    cancel()
            try:
                return await task
            finally:
                with self.lock:  # nobody calls it after the loop is closed
                    self._cancel_task = bool

        try:
            return self._clock.run_async(main())
        except asyncio.CancelledError as error:
            if not self.is_preempt_requested():
                raise ActionlibError("its task was cancelled, but not by a preempt") from error
            raise Preempted("its task was cancelled") from error

    def _execute(self, handle: ServerGoalHandle) -> None:
        context: GoalContext[Any] = GoalContext(self, handle)
        try:
            result = self._call(handle.get_goal(), context)
        except Reject as end:
            accepted = handle.record.status in {Status.ACTIVE, Status.PREEMPTING}
            self._end("raise Reject", "abort" if accepted else "reject", end.result, end.text)
        except Preempted as end:
            context.accept()
            self._end("raise Preempted", "cancel", end.result, end.text)
        except Abort as end:
            context.accept()
            self._end("raise Abort", "abort", end.result, end.text)
        except Exception:  # the base class aborts the goal, for which it must be accepted
            context.accept()
            raise
        else:
            context.accept()
            self._end("return", "succeed", result, "")
        finally:
            self._preempted.set()  # wakes a thread of the function that outlives it


class RunningServer:
    """A started `GoalServer`; a context manager that stops it."""

    def __init__(self, runner: _DecoratedServer) -> None:
        self._runner = runner

    @property
    def name(self) -> str:
        """The action's full name."""
        return self._runner.action_server.ns

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the server has stopped; return whether it has.

        Raises:
            ServerConflictError: it stopped because an older server has the name.

        Blocks: until then, `timeout` [s] at most; None: no limit.
        """
        return self._runner.wait(timeout)

    def stop(self) -> None:
        """Stop the running goal and leave the name; see `SimpleActionServer.stop`."""
        self._runner.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


class GoalServer(Generic[G, R, F]):
    """A function that can be offered as an action. Made by `server`.

    `R` is what the function returns: the result message, or a coroutine of it.
    """

    def __init__(
        self,
        function: Callable[[G, GoalContext[F]], R],
        name: str,
        spec: type[ActionSpec[G, Any, F]],
        options: dict[str, Any],
    ) -> None:
        self._function = function
        self._options = options
        self.name = name
        self.spec = spec
        self.__doc__ = function.__doc__

    def __call__(self, goal: G, ctx: GoalContext[F]) -> R:
        """Call the function itself."""
        return self._function(goal, ctx)

    def start(self, name: str | None = None, *, node: Node | None = None) -> RunningServer:
        """Offer the action.

        Args:
            name: The action's name; None: the decorator's.
            node: The server's node; None: the current node.

        Raises:
            ServerConflictError: the name has a server already.
            InvalidNameError: the name breaks the ROS rules.
            TransportError: the network session is closed.

        Blocks: until the network has listed the servers of the name, 1 s at most.
        """
        return RunningServer(
            _DecoratedServer(
                self._function,
                name=name if name is not None else self.name,
                ActionSpec=self.spec,
                node=node,
                **self._options,
            )
        )


def server(
    name: str,
    ActionSpec: type[ActionSpec[G, R, F]],  # noqa: N803  as everywhere
    *,
    policy: Policy = "preempt",
    on_client_lost: OnClientLost = "continue",
    resource: str | tuple[str, ResourcePolicy] | None = None,
) -> _Decorator[G, R, F]:
    """Turn a function `execute(goal, ctx) -> result` into an action server.

    The usual way to offer an action; others: docs/howto/which_way.md.

    The function returns the result (SUCCEEDED) or raises `Abort`, `Preempted` or `Reject`; any
    other exception aborts the goal with its text.

    It may be `async`: it then runs in an event loop of its own, in the thread that runs the goals.
    A preempt cancels its task, once; if it lets `asyncio.CancelledError` pass, the goal is
    PREEMPTED, and if it catches that, it ends the goal as it likes.

    Args:
        name: The action's name.
        ActionSpec: The action class (XAction).
        policy: The effect of a new goal while one runs; see `SimpleActionServer`.
        on_client_lost: What happens to the goal of a client that died; see `SimpleActionServer`.
        resource: What a goal needs for itself while it runs; see `SimpleActionServer`.

    Returns:
        A decorator, which returns a `GoalServer`; `start` it.
    """
    options = {"policy": policy, "on_client_lost": on_client_lost, "resource": resource}
    return _Decorator(name, ActionSpec, options)


class _Decorator(Generic[G, R, F]):
    """What `server` returns."""

    def __init__(self, name: str, spec: type[ActionSpec[G, R, F]], options: dict[str, Any]) -> None:
        self._name = name
        self._spec = spec
        self._options = options

    @overload
    def __call__(
        self, function: Callable[[G, GoalContext[F]], Coroutine[Any, Any, R]]
    ) -> GoalServer[G, Coroutine[Any, Any, R], F]: ...

    @overload
    def __call__(self, function: Callable[[G, GoalContext[F]], R]) -> GoalServer[G, R, F]: ...

    def __call__(self, function: Callable[[G, GoalContext[F]], Any]) -> GoalServer[G, Any, F]:
        """Return the function as a server that can be started."""
        if function is None:
            raise ActionlibError(f"action {self._name!r}: function: got None; expected a function.")
        if not is_async(function):
            check_function(f"action {self._name!r}", "function", function)
        return GoalServer(function, self._name, self._spec, self._options)
