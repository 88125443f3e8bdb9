"""`PNPCmd`: runs single actions from a Python program, like PNP's class of the same name.

    with PNPCmd({"goto": goto, "say": say}) as cmd:
        cmd.exec_action("goto", "hall", interrupt="obstacle", recovery="wait_5; restart_action")
        if cmd.get_condition("door_open"):
            cmd.start_action("say", "hello")

The names and arguments are those of `pnp_cmd_base` of PetriNetPlans 1.4.
"""

from __future__ import annotations

import contextlib
import threading
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from actionlib_core.clock import current_clock
from smachpy.base.problems import Problems
from smachpy.events import Left
from smachpy.events.outcome_classes import outcome_class
from smachpy.exceptions import InconsistentMachineError, InvalidStateError, did_you_mean
from smachpy.pnp.build import Action, action
from smachpy.pnp.container import PetriNetPlan, load, plans_in
from smachpy.pnp.files import load_plan
from smachpy.pnp.knowledge import Knowledge, Polled
from smachpy.pnp.reading import plan_file
from smachpy.pnp.text import rule_of
from smachpy.userdata.user_data import UserData

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path
    from typing import Self

    from actionlib_core.clock import Task
    from smachpy.events import Event
    from smachpy.pnp.server import PNPServer

Status: TypeAlias = Literal["", "run", "success", "failure", "interrupt"]

_BUILT_IN: Final = ("timeout_", "action_failed")


class _Running:
    """An action or a plan that was started.

    Attributes:
        plan: The plan, or the one around the action.
        hears: The plans that are told of events. The one around an action asks `PNPCmd` itself.
        task: The thread of one that was started without waiting for its end.
    """

    def __init__(self, plan: PetriNetPlan, hears: Sequence[PetriNetPlan]) -> None:
        self.plan = plan
        self.hears = hears
        self.task: Task | None = None


class PNPCmd:
    """Runs actions and plans one by one.

    Args:
        actions: As for `PetriNetPlan`.
        conditions: Likewise.
        plan_folder: The folder of the plans for `start_plan` and `execute_plan`.
        server: As for `PetriNetPlan`.

    Raises:
        InvalidStateError: an argument is wrong.

    Threads: any thread may call the methods. A started action runs in a thread of its own.
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
        self._actions = problems.mapping("actions", actions, "name -> state or function")
        problems.raise_all()
        self._folder = plan_folder
        self._userdata = UserData()
        self._server = server
        self._knowledge = Knowledge(conditions, lambda: self._userdata, server=server)
        self._lock = threading.Lock()
        self._status: dict[str, Status] = {}  # name -> how its last run ended; the newest is last
        self._running: dict[str, _Running] = {}
        self._listening: contextlib.ExitStack | None = None
        self._plan: tuple[str, str] = ("", "")  # of the last plan: name, outcome or ""

    # -- beginning and end ---------------------------------------------------------------------

    def begin(self) -> None:
        """Subscribe to the topics of the conditions."""
        if self._listening is None:
            self._listening = contextlib.ExitStack()
            self._listening.enter_context(self._knowledge.listening())

    def end(self) -> None:
        """Stop all actions, and unsubscribe.

        Blocks: until all actions have stopped, each within its grace.
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
            params: Its parameters, such as "kitchen", "hello_you" or a list.
            interrupt: A condition that interrupts it, or "timeout_" and seconds.
            recovery: The actions after an interrupt, "a; b_c; restart_action". The last word is one
                of "restart_action", "skip_action", "fail_plan", "goal"; the default is
                "skip_action".

        Returns:
            The end of its last run: "success", "failure" or "interrupt".

        Raises:
            InvalidStateError: an argument is wrong, or the action is unknown.
            InvalidUserCodeError: the action raised.

        Blocks: until the action has ended.
        """
        part = self._part(name, params)
        if interrupt:
            limit = interrupt.removeprefix("timeout_")
            # Programs leave the action's name out; guards have `timeout_ACTION_SECONDS`.
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
        """Start an action without waiting for its end.

        Raises:
            InvalidStateError: it is running already, an argument is wrong, or it is unknown.
        """
        part = self._part(name, params)
        running = self._begin(part)
        running.task = current_clock().spawn(lambda: self._run(part.name, running), name=part.name)

    def interrupt_action(self, name: str, params: str | Iterable[object] = "") -> None:
        """Ask an action to stop; without parameters, all running actions of this name.

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
        """Return "run", the end of the last run, or "" if there was none.

        Without parameters, it is that of any action of this name.
        """
        if self._tasks_of(name, params):
            return "run"
        with self._lock:
            found = [how for key, how in self._status.items() if self._is(key, name, params)]
        return found[-1] if found else ""

    def running_actions(self) -> list[str]:
        """Return the names of the running actions."""
        with self._lock:
            return list(self._running)

    def quit_running_actions(self) -> None:
        """Ask all running actions and plans to stop."""
        # Without the lock: a plan that ends meanwhile needs it to remove itself.
        with self._lock:
            plans = [running.plan for running in self._running.values()]
        for plan in plans:
            plan.request_preempt(by="PNPCmd")

    def wait_for_termination(self, timeout: float | None = None) -> bool:
        """Wait until all started actions and plans have ended.

        Args:
            timeout: Longest wait [s]; None: no limit.

        Returns:
            Whether they have ended within `timeout`.

        Blocks: until then.
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
        """Return the value of a condition now; an event is used up."""
        return self._knowledge.value(name, "PNPCmd", current_clock().now())

    def set_condition(self, name: str, value: bool) -> None:
        """Set a condition, also of the plans that run or that are started later."""
        for knowledge in self._all_knowledge():
            knowledge.set(name, value)

    def post(self, event: str) -> None:
        """Post an event, also to the plans that run."""
        for knowledge in self._all_knowledge():
            knowledge.post(event, current_clock())

    # -- plans ---------------------------------------------------------------------------------

    def execute_plan(self, name: str) -> str:
        """Run a plan of the folder to its end; return "goal", "fail" or "preempted".

        Raises:
            PlanError: it cannot be loaded.

        Blocks: until the plan has ended.
        """
        running = self._plan_of(name)
        self._run(name, running)
        return self._plan[1]

    def start_plan(self, name: str) -> None:
        """Start a plan of the folder without waiting; errors as for `execute_plan`."""
        running = self._plan_of(name)
        running.task = current_clock().spawn(lambda: self._run(name, running), name=name)

    def stop_plan(self) -> None:
        """Ask the running plan to stop."""
        with self._lock:
            running = self._running.get(self._plan[0])
        if running is not None:
            running.plan.request_preempt(by="PNPCmd")

    def plan_cmd(self, name: str, cmd: str = "start") -> None:
        """Start a plan, or stop the running one: `cmd` is "start" or "stop"."""
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
        """Return "run", the outcome of the last plan, or ""."""
        return "run" if self._plan[0] in self._running else self._plan[1]

    # -- inside --------------------------------------------------------------------------------

    def _is(self, whole: str, name: str, params: str | Iterable[object]) -> bool:
        """Return whether `name` and `params` of a caller mean the action `whole`."""
        # "goto" without parameters also means "goto_kitchen".
        meant = self._part(name, params).name
        return whole == meant or (not params and whole.startswith(f"{meant}_"))

    def _all_knowledge(self) -> list[Knowledge]:
        """Return the conditions of this object and of the running plans."""
        with self._lock:
            plans = [plan for running in self._running.values() for plan in running.hears]
        return [self._knowledge, *(plan._smachpy.knowledge for plan in plans)]

    def _tasks_of(self, name: str, params: str | Iterable[object] = "") -> list[Task | None]:
        """Return the tasks of the running actions; None for one in its caller's thread."""
        with self._lock:
            running = tuple(self._running.items())
        return [one.task for key, one in running if self._is(key, name, params)]

    def _part(self, name: str, params: str | Iterable[object]) -> Action:
        words = [params] if isinstance(params, str) else list(params)
        return action(name, *[word for word in words if word != ""])

    def _begin(self, part: Action) -> _Running:
        # Two plans: the first one reads the names in the guards. In the second one these names are
        # conditions that ask this object, which has the events and set values.
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
        return self._note(part.name, plan, plans_in(plan)[1:])

    def _asking(self, name: str) -> Any:
        def ask(_userdata: object) -> bool:
            return self.get_condition(name)

        every = self._knowledge.every(name)
        return ask if every is None else Polled(ask, every)

    def _plan_of(self, name: str) -> _Running:
        # With own actions the plan uses them; otherwise those of its `actions.yaml`.
        file = plan_file(self._folder, name)
        if self._actions or self._server is not None:
            plan = load(file, self._actions, self._knowledge.sources, server=self._server)
        else:
            plan = load_plan(file)
        problems = plan.find_problems(name)
        if problems:
            raise InconsistentMachineError(name, problems)
        running = self._note(name, plan, plans_in(plan))
        for condition, value in self._knowledge.set_values().items():
            plan.set_condition(condition, value)
        self._plan = (name, "")
        return running

    def _note(self, name: str, plan: PetriNetPlan, hears: Sequence[PetriNetPlan]) -> _Running:
        with self._lock:
            if name in self._running:
                raise InvalidStateError(
                    f"{name}: it is already running; expected one run at a time."
                )
            self._running[name] = running = _Running(plan, hears)
            return running

    def _run(self, name: str, running: _Running) -> None:
        # The last outcome of the action itself: a recovery may start it again, and the plan's
        # outcome does not show an interrupt.
        last: list[str] = []

        def listen(event: Event) -> None:
            if isinstance(event, Left) and event.path == f"/PNPCmd/{name.replace('/', ':')}":
                last[:] = [event.outcome]

        plan = running.plan
        plan.subscribe(listen)
        # An event that is posted to this object must wake the plan, whose guards ask for it.
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
                self._status.pop(name, None)  # so that the newest is the last
                self._status[name] = status
                del self._running[name]
