"""`PNPCmd`: actions one by one from a Python program, as PNP's own class of that name has them.

    with PNPCmd({"goto": goto, "say": say}) as cmd:
        cmd.exec_action("goto", "hall", interrupt="obstacle", recovery="wait_5; restart_action")
        if cmd.get_condition("door_open"):
            cmd.start_action("say", "hello")

Source of names and arguments: `pnp_cmd_base` of PetriNetPlans 1.4.
"""

from __future__ import annotations

import contextlib
import threading
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from actionlib_core.clock import current_clock
from smachpy.events import Left
from smachpy.exceptions import InconsistentMachineError, InvalidStateError, did_you_mean
from smachpy.machines.problems import Problems
from smachpy.outcome_classes import outcome_class
from smachpy.pnp.build import Action, action
from smachpy.pnp.container import PetriNetPlan
from smachpy.pnp.files import load_plan
from smachpy.pnp.knowledge import Knowledge, Polled
from smachpy.pnp.text import rule_of
from smachpy.userdata.user_data import UserData

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path
    from typing import Self

    from actionlib_core.clock import Task
    from smachpy.events import Event
    from smachpy.pnp.server import PNPServer

Status: TypeAlias = Literal["", "run", "success", "failure", "interrupt"]

_BUILT_IN: Final = ("timeout_", "action_failed")


class _Running:
    """An action or a plan that was started."""

    def __init__(self, plan: PetriNetPlan) -> None:
        self.plan = plan
        self.task: Task | None = None


class PNPCmd:
    """Runs actions and plans one by one.

    Args:
        actions: As for `PetriNetPlan`.
        conditions: Likewise.
        plan_folder: Where `start_plan` finds plans.
        server: As for `PetriNetPlan`.

    Raises:
        InvalidStateError: an argument is wrong.

    Threads: all of it from any thread. An action that was started runs in a thread of its own.
    """

    def __init__(
        self,
        actions: Mapping[str, Any] | None = None,
        conditions: Mapping[str, Any] | None = None,
        *,
        plan_folder: Path | str = ".",
        server: PNPServer | None = None,
    ) -> None:
        problems = Problems(type(self).__name__)
        self._actions = problems.mapping("actions", actions, "name -> what does it")
        problems.raise_all()
        self._folder = plan_folder
        self._userdata = UserData()
        self._server = server
        self._knowledge = Knowledge(conditions, lambda: self._userdata, server=server)
        self._lock = threading.Lock()
        self._status: dict[str, Status] = {}
        self._running: dict[str, _Running] = {}
        self._listening: contextlib.ExitStack | None = None
        self._plan: tuple[str, str] = ("", "")

    # -- beginning and end ---------------------------------------------------------------------

    def begin(self) -> None:
        """Begin to listen to the topics of the conditions."""
        if self._listening is None:
            self._listening = contextlib.ExitStack()
            self._listening.enter_context(self._knowledge.listening())

    def end(self) -> None:
        """Stop what runs, and listen no more.

        Blocks: until everything has stopped, each action within its grace.
        """
        self.quit_running_actions()
        self.wait_for_termination()
        if self._listening is not None:
            self._listening.close()
            self._listening = None

    def __enter__(self) -> Self:
        self.begin()
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    # -- actions -------------------------------------------------------------------------------

    def exec_action(
        self,
        name: str,
        params: str | Iterable[object] = "",
        interrupt: str = "",
        recovery: str = "",
    ) -> Status:
        """Run an action to its end.

        Args:
            name: The action.
            params: Its parameters, as in "kitchen", "hello_you" or a list.
            interrupt: A condition that interrupts it, or "timeout_" and seconds.
            recovery: What is done then: "a; b_c; restart_action". Its last word is one of
                "restart_action", "skip_action", "fail_plan", "goal"; left out: "skip_action".

        Returns:
            "success", "failure" or "interrupt": how its last run ended.

        Raises:
            InvalidStateError: an argument is wrong, or nothing does the action.
            InvalidUserCodeError: the action raised.

        Blocks: until then.
        """
        part = self._part(name, params)
        if interrupt:
            limit = interrupt.removeprefix("timeout_")
            if limit != interrupt and "_" not in limit:
                interrupt = f"timeout_{part.name}_{limit}"
            rule = rule_of(interrupt, recovery or "skip_action")
            part = part.interrupt(rule.condition, *rule.recovery, then=rule.last)
        elif recovery:
            raise InvalidStateError(f"{name}: recovery: got {recovery!r} without interrupt.")
        running = self._begin(part)
        self._run(part.name, running)
        return self.action_status(part.name)

    def start_action(self, name: str, params: str | Iterable[object] = "") -> None:
        """Start an action and go on.

        Raises:
            InvalidStateError: it runs already, an argument is wrong, or nothing does it.
        """
        part = self._part(name, params)
        running = self._begin(part)
        running.task = current_clock().spawn(lambda: self._run(part.name, running), name=part.name)

    def interrupt_action(self, name: str, params: str | Iterable[object] = "") -> None:
        """Ask an action to stop; with no parameters, all that run under this name.

        Threads: any; does not wait.
        """
        with self._lock:
            found = [
                running.plan
                for key, running in self._running.items()
                if self._is(key, name, params)
            ]
        for plan in found:
            plan.request_preempt(by="PNPCmd")

    stop_action = interrupt_action

    def action_cmd(self, name: str, params: str | Iterable[object], cmd: str) -> None:
        """Start, stop or interrupt an action: `cmd` is "start", "stop", "end" or "interrupt"."""
        known = {"start": self.start_action}
        known |= dict.fromkeys(("stop", "end", "interrupt"), self.interrupt_action)
        if cmd not in known:
            raise InvalidStateError(
                f"action_cmd: got {cmd!r}; expected one of {sorted(known)}."
                f"{did_you_mean(cmd, known)}"
            )
        known[cmd](name, params)

    def action_status(self, name: str, params: str | Iterable[object] = "") -> Status:
        """Return "run", how the last run ended, or "" when there was none.

        With no parameters, of any that ran under this name.
        """
        if self._tasks_of(name, params):
            return "run"
        with self._lock:
            found = [how for key, how in self._status.items() if self._is(key, name, params)]
        return found[-1] if found else ""

    def running_actions(self) -> list[str]:
        """Return the names of the actions that run."""
        with self._lock:
            return list(self._running)

    def quit_running_actions(self) -> None:
        """Ask all actions, and a plan, to stop."""
        with self._lock:
            plans = [running.plan for running in self._running.values()]
        for plan in plans:
            plan.request_preempt(by="PNPCmd")

    def wait_for_termination(self, timeout: float | None = None) -> bool:
        """Wait until nothing that was started runs; tell whether that came within `timeout` [s].

        Blocks: until then; None waits for ever.
        """
        clock = current_clock()
        until = None if timeout is None else clock.now() + timeout
        while True:
            with self._lock:
                tasks = [r.task for r in self._running.values() if r.task is not None]
            if not tasks:
                return True
            left = None if until is None else max(0.0, until - clock.now())
            if not tasks[0].join(left):
                return False

    # -- conditions ----------------------------------------------------------------------------

    def get_condition(self, name: str) -> bool:
        """Return what a condition is worth now; an event is used up by it."""
        return self._knowledge.value(name, "PNPCmd", current_clock().now())

    def set_condition(self, name: str, value: bool) -> None:
        """Say what a condition is from now on."""
        self._knowledge.set(name, value)

    def post(self, event: str) -> None:
        """Tell that something happened."""
        self._knowledge.post(event, current_clock())

    # -- plans ---------------------------------------------------------------------------------

    def execute_plan(self, name: str) -> str:
        """Run a plan of the folder to its end; returns "goal", "fail" or "preempted".

        Raises:
            PlanError: it cannot be loaded.

        Blocks: until then.
        """
        running = self._plan_of(name)
        self._run(name, running)
        return self._plan[1]

    def start_plan(self, name: str) -> None:
        """Start a plan of the folder and go on; errors as for `execute_plan`."""
        running = self._plan_of(name)
        running.task = current_clock().spawn(lambda: self._run(name, running), name=name)

    def stop_plan(self) -> None:
        """Ask the plan that runs to stop."""
        with self._lock:
            running = self._running.get(self._plan[0])
        if running is not None:
            running.plan.request_preempt(by="PNPCmd")

    def plan_cmd(self, name: str, cmd: str = "start") -> None:
        """Start a plan, or stop the one that runs: `cmd` is "start" or "stop"."""
        if cmd not in {"start", "stop"}:
            raise InvalidStateError(f"plan_cmd: got {cmd!r}; expected 'start' or 'stop'.")
        if cmd == "start":
            self.start_plan(name)
        else:
            self.stop_plan()

    def plan_name(self) -> str:
        """Return the name of the plan that was started last, or ""."""
        return self._plan[0]

    def plan_status(self) -> str:
        """Return "run", how the last plan ended, or ""."""
        return "run" if self._plan[0] in self._running else self._plan[1]

    # -- inside --------------------------------------------------------------------------------

    def _is(self, whole: str, name: str, params: str | Iterable[object]) -> bool:
        """Tell whether the action `whole` is one that a caller means."""
        meant = self._part(name, params).name
        return whole == meant or (not params and whole.startswith(f"{meant}_"))

    def _tasks_of(self, name: str, params: str | Iterable[object] = "") -> list[Task | None]:
        """Return the tasks of the actions that run; None for one that a caller waits for."""
        with self._lock:
            running = tuple(self._running.items())
        return [one.task for key, one in running if self._is(key, name, params)]

    def _part(self, name: str, params: str | Iterable[object]) -> Action:
        words = [params] if isinstance(params, str) else list(params)
        return action(name, *[word for word in words if word != ""])

    def _begin(self, part: Action) -> _Running:
        net = part.net("PNPCmd")
        first = PetriNetPlan(net, self._actions, server=self._server)
        names = [n for n in first.plan.externals() if not n.startswith(_BUILT_IN)]
        conditions = {name: self._asking(name) for name in names}
        plan = first
        if names:
            plan = PetriNetPlan(net, self._actions, conditions, server=self._server)
        problems = plan.find_problems("PNPCmd")
        if problems:
            raise InconsistentMachineError("PNPCmd", problems)
        return self._note(part.name, plan)

    def _asking(self, name: str) -> Any:
        def ask(_userdata: object) -> bool:
            return self.get_condition(name)

        every = self._knowledge.every(name)
        return ask if every is None else Polled(ask, every)

    def _plan_of(self, name: str) -> _Running:
        from smachpy.pnp.container import load
        from smachpy.pnp.reading import plan_file

        file = plan_file(self._folder, name)
        if self._actions or self._server is not None:
            plan = load(file, self._actions, self._knowledge.sources, server=self._server)
        else:
            plan = load_plan(file)
        problems = plan.find_problems(name)
        if problems:
            raise InconsistentMachineError(name, problems)
        running = self._note(name, plan)
        self._plan = (name, "")
        return running

    def _note(self, name: str, plan: PetriNetPlan) -> _Running:
        with self._lock:
            if name in self._running:
                raise InvalidStateError(f"{name}: it runs already; expected one run at a time.")
            self._running[name] = running = _Running(plan)
            return running

    def _run(self, name: str, running: _Running) -> None:
        last: list[str] = []

        def listen(event: Event) -> None:
            if isinstance(event, Left) and event.path == f"/PNPCmd/{name.replace('/', ':')}":
                last[:] = [event.outcome]

        plan = running.plan
        plan.subscribe(listen)
        forget = self._knowledge.subscribe(plan._smachpy.knowledge.changed)
        status: Status = "failure"
        try:
            outcome = plan.execute()
            words: dict[str, Status] = {"success": "success", "other": "success"}
            words["preempted"] = "interrupt"
            how = outcome_class(last[0]) if last else "preempted"
            status = words.get(how, "failure")
            if self._plan[0] == name:
                self._plan = (name, outcome)
        finally:
            forget()
            with self._lock:
                self._status.pop(name, None)  # the newest is the last
                self._status[name] = status
                del self._running[name]
