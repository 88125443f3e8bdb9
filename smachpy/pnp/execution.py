"""One run of a plan: fires transitions, starts and stops actions, waits for changes."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from smachpy.base import log
from smachpy.engine.callback import call_bounded
from smachpy.engine.child import run_child
from smachpy.engine.interrupt import Interruption
from smachpy.engine.preempt import ask_child, asking, on_preempt
from smachpy.engine.threads import ChildBranch, Group
from smachpy.engine.visit import Why
from smachpy.events import Fired, HeldBack, Preempted
from smachpy.pnp.actions import Order, parse_name
from smachpy.pnp.firing import called

if TYPE_CHECKING:
    from collections.abc import Sequence

    from smachpy.engine.frame import Frame
    from smachpy.engine.step import Step
    from smachpy.pnp.conditions import Condition
    from smachpy.pnp.container import PetriNetPlan
    from smachpy.pnp.firing import Firing, Moment, Table
    from smachpy.pnp.knowledge import Knowledge

_TIMEOUT = "timeout_"


class Branches(Group):
    """The running actions: those in threads of their own, and the one in the plan's thread."""

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame, [], each=True)

    def begin(self, step: Step) -> ChildBranch:
        """Start a child in a thread of its own."""
        branch = ChildBranch(self, step)
        self.started = True
        with self.frame.run.lock:
            self.branches.append(branch)
            self.left += 1
        container = self.frame.container
        # A request that came before the branch was in the list has not reached it.
        if container._preempt_requested:
            self.ask([branch])
        try:
            self.frame.run.clock.spawn(branch.work, name=branch.here())
        except RuntimeError as error:  # the system cannot start another thread
            waiting = branch.end(None, error)
            if waiting is not None:
                waiting.set()
        return branch

    def running(self) -> list[Any]:
        """Return the frames in which children run."""
        own = [] if self.frame.step is None else [self.frame]
        return [*own, *super().running()]

    def threads(self) -> list[ChildBranch]:
        """Return the branches that have not ended."""
        return super().running()

    def forget(self, branch: ChildBranch) -> None:
        """Remove a branch that has ended without an error."""
        with self.frame.run.lock:
            self.branches.remove(branch)

    def notice(self) -> None:
        """Wake the plan's thread."""
        self.wake.set()

    def wait_for_change(self, timeout: float | None) -> None:
        """Wait until a child ends, `notice` is called, or the time [s] is over.

        A change between two calls is not lost: the second call returns at once.
        """
        # Cleared after the wait: callers look at reports and conditions only after this returns.
        if not self.reports:
            self.wake.wait(timeout)
        self.wake.clear()


class Execution:
    """A run of a plan.

    Args:
        machine: The plan.
        frame: Its frame.
        steps: Label -> child.
        table: Its firings.

    Attributes:
        moment: The current marking.
        branches: The running actions.
        orders: Pairs (order, transition or "") from other threads, not executed yet.
    """

    def __init__(
        self, machine: PetriNetPlan, frame: Frame, steps: dict[str, Step], table: Table
    ) -> None:
        self._machine = machine
        self._frame = frame
        self._steps = steps
        self._table = table
        self._net = table.plan.net
        self._knowledge: Knowledge = machine._smachpy.knowledge
        self._ended: dict[str, str] = {}  # label -> outcome, until the action is ended or begins
        # An action that a transition has ended is no longer in `_running`, though its thread may
        # still be stopping; `branches` has it until then.
        self._running: dict[str, ChildBranch] = {}
        self._since: dict[str, float] = {}  # label -> begin, on the run's clock [s]
        self._begin_again: set[str] = set()  # to begin once their earlier run has stopped
        self._reported: object = None  # the last `HeldBack`, which is published once
        self._values: dict[str, bool] = {}  # name -> value when the guards were evaluated last
        self._looked = 0.0  # the time of that, for all guards the same [s]
        self.moment = table.moment(self._net.initial)
        self.branches = Branches(frame)
        self.orders: deque[tuple[str, str]] = deque()

    def run(self) -> str:
        """Run to the end and return the outcome."""
        machine, frame = self._machine, self._frame
        frame.group = self.branches
        forget = [
            on_preempt(machine, self.branches.notice),
            self._knowledge.subscribe(self.branches.notice),
        ]
        try:
            with self._knowledge.listening():
                self._resume()
                outcome = self._go()
            self._stop_all("the plan has ended")
            self.branches.raise_errors(None)
        except BaseException as error:
            with asking("plan", frame.path, f"raised {type(error).__name__}"):
                self.branches.ask(self.branches.threads())
            # Not for a KeyboardInterrupt, nor if this thread was left behind.
            if isinstance(error, (Exception, SystemExit, Interruption)) and not frame.dead:
                self._await_all()
            raise
        finally:
            for each in forget:
                each()
            frame.step = frame.group = None
        return outcome

    def _go(self) -> str:
        machine, moment = self._machine, self.moment
        firing: Firing | None
        while True:
            # A reached goal takes precedence over a preempt, and both over orders.
            if moment.end is not None:
                return moment.end
            if machine._preempt_requested:
                return self._preempted()
            if self.orders:
                outcome = self._execute_order(*self.orders.popleft())
                if outcome is not None:
                    return outcome
                moment = self.moment
                continue
            firing = moment.free
            if firing is None:
                firing = self._chosen(moment)
            if firing is not None:
                moment = self._take(firing)
            elif self._may_change(moment):
                self._wait(moment)
            else:
                return self._stuck(moment)

    def _resume(self) -> None:
        """Resume the position of an earlier process, if the journal has one."""
        resumed = self._frame.run.journal.resumed_plan(self._frame)
        if resumed is None:
            return
        marking, children = resumed
        numbers, clock = self._net.place_numbers, self._frame.run.clock
        self.moment = self._table.moment(tuple(sorted(numbers[place] for place in marking)))
        now, now_ns = clock.now(), clock.time_ns()
        begun: list[str] = []
        for label, visit in children.items():
            # An action that was stopping has a goal or children to cancel: it begins, and the
            # journal asks it to stop again. It is not in `_running`, as its transition has fired.
            if visit.get("stopping"):
                self.branches.begin(self._steps[label])
                if visit.get("again"):
                    self._begin_again.add(label)
            elif visit["outcome"] is None or isinstance(self._steps[label].state, Order):
                begun.append(label)  # an order that was executed would have left no visit
            else:
                self._ended[label] = visit["outcome"]
        self._begin_all(begun)
        # `timeout_ACTION_SECONDS` counts from the begin in the earlier process. The journal has
        # wall time, as clocks of runs begin anew.
        for label in self._since:
            begun_ns = children[label].get("begun_ns", now_ns)
            self._since[label] = now - (now_ns - begun_ns) / 1e9

    # -- firing --------------------------------------------------------------------------------

    def _chosen(self, moment: Moment) -> Firing | None:
        """Return the firing that the guards allow now, or None.

        The table keeps a firing under the values of the guards, so that it is computed once. If all
        guards test the same action, its outcome is the key, and no guard is evaluated.
        """
        if not moment.candidates:
            return None
        if not any(moment.guards):  # nothing to evaluate: the same firing each time
            moment.free = self._table.firing(moment, (), moment.candidates)
            return moment.free
        if moment.only is not None:
            key: object = self._ended.get(moment.only)
        else:
            key = self._truths(moment)
        try:
            return moment.firings[key]
        except KeyError:
            truths = self._truths(moment) if moment.only is not None else key
            assert isinstance(truths, tuple)
            true = [t for t, holds in zip(moment.candidates, truths, strict=True) if holds]
            return self._table.firing(moment, key, true)

    def _truths(self, moment: Moment) -> tuple[bool, ...]:
        """Return the value of each guard; a name is evaluated once, for all of them."""
        values: dict[str, bool] = {}

        def value(name: str) -> bool:
            if name not in values:
                values[name] = self._value(name)
            return values[name]

        self._values = values
        self._looked = self._frame.run.clock.now()
        return tuple([guard is None or guard.holds(value) for guard in moment.guards])

    def _value(self, name: str) -> bool:
        test = self._table.outcome_tests.get(name)
        if test is not None:
            return test.holds(self._ended.get(test.label))
        due = self._due(name)
        if due is not None:
            return self._looked >= due
        arguments = name, self._frame.path, self._looked
        # Code of the user may block: after a preempt it is bounded by the plan's grace.
        if self._knowledge.is_code(name):
            return bool(call_bounded(self._machine, self._frame, self._knowledge.value, arguments))
        return self._knowledge.value(*arguments)

    def _due(self, name: str) -> float | None:
        """Return the time at which `timeout_ACTION_SECONDS` becomes true; None for other names."""
        if not name.startswith(_TIMEOUT) or self._knowledge.source_of(name) is not None:
            return None
        action, _, seconds = name.removeprefix(_TIMEOUT).rpartition("_")
        try:
            limit = float(seconds)
        except ValueError:
            return None
        begun = [
            since
            for label, since in self._since.items()
            if action in {label, parse_name(self._machine._smachpy.names[label], [action]).action}
        ]
        return min(begun) + limit if begun and limit >= 0 else None

    def _take(self, firing: Firing) -> Moment:
        """Fire transitions, stop and begin their actions; return the next moment."""
        run, running = self._frame.run, self._running
        # The position changes before its actions begin: `_begin_all` looks at the new moment.
        self.moment = moment = firing.moment
        self._reported = None
        # The lists in the table are right if nothing runs; a running action is not begun again.
        ends, begins = firing.ends, firing.begins
        if running:
            ends, begins = called(firing.calls, running)
        if run.watched:
            self._write_firing(firing.fired, moment, ends, begins)
            self._report_fired(firing)
        # First the ends: an action in both lists is restarted.
        for label in ends:
            self._ended.pop(label, None)
            self._begin_again.discard(label)
            if label in running:
                self._end(label, firing)
        if begins:
            self._begin_all(begins)
        if self._machine._smachpy.transition_cbs:
            self._machine.call_transition_cbs()
        return moment

    def _write_firing(
        self, fired: Sequence[int], moment: Moment, ends: Sequence[str], begins: Sequence[str]
    ) -> None:
        """Write a firing to the journal, before its actions begin or are asked to stop."""
        net, journal = self._net, self._frame.run.journal
        transitions = [net.transitions[number].id for number in fired]
        marking = [net.places[place].id for place in moment.marking]
        journal.fired(self._frame, transitions, marking, ends, begins)

    # -- actions -------------------------------------------------------------------------------

    def _begin_all(self, labels: Sequence[str]) -> None:
        """Begin actions; a single one in this thread if nothing can fire before it ends."""
        for label in labels:
            self._ended.pop(label, None)
        # Saves a thread for each action of a sequence.
        if len(labels) == 1 and self.moment.only == labels[0] and not self.branches.branches:
            self._run_here(self._steps[labels[0]])
            return
        for label in labels:
            self._begin(label)

    def _begin(self, label: str) -> None:
        if any(branch.step.label == label for branch in self.branches.threads()):
            self._begin_again.add(label)  # its earlier run is still stopping
            return
        self._since[label] = self._frame.run.clock.now()
        self._running[label] = self.branches.begin(self._steps[label])

    def _end(self, label: str, firing: Firing) -> None:
        branch = self._running.pop(label)
        self._since.pop(label, None)
        if not branch.ended:
            names = ", ".join(self._net.transition_name(t) for t in firing.fired)
            with asking("plan", self._frame.path, f"fired {names}"):
                self.branches.ask([branch])

    def _run_here(self, step: Step) -> None:
        """Run a child in this thread; nothing can fire before it ends."""
        frame, machine = self._frame, self._machine
        outcome: str | None = None
        while outcome is None and not machine._preempt_requested:
            decision = run_child(frame, step)
            if decision.why is not Why.JUMPED:  # a plan has no next child: this one runs again
                outcome = decision.outcome
        frame.step = None
        if outcome is not None:
            self._ended[step.label] = outcome
        if frame.run.pending:
            frame.run.flush()

    def _take_reports(self) -> bool:
        """Take the reports of children that have ended; return whether one raised."""
        raised = False
        while self.branches.reports:
            branch = self.branches.reports.popleft()
            label = branch.step.label
            if branch.error is not None:
                raised = True
                continue
            self.branches.forget(branch)
            # Otherwise a transition has ended the action before: its outcome no longer counts.
            if self._running.get(label) is branch:
                del self._running[label]
                self._since.pop(label, None)
                assert branch.outcome is not None
                self._ended[label] = branch.outcome
            elif label in self._begin_again:  # it has stopped, and may begin now
                self._begin_again.discard(label)
                self._begin(label)
        return raised

    # -- waiting and ending --------------------------------------------------------------------

    def _may_change(self, moment: Moment) -> bool:
        """Return whether the end of an action or a change outside can make a transition fire."""
        return bool(self.branches.branches or self.branches.reports or moment.externals)

    def _wait(self, moment: Moment) -> None:
        """Wait until a child ends or a condition may have changed.

        Blocks: until then.
        """
        self._frame.run.journal.note_conditions(self._frame)
        self._report_waiting(moment)
        if not self.branches.reports:
            self.branches.wait_for_change(self._longest_wait(moment))
        # The error of an action ends the plan, but first all others are stopped.
        if self._take_reports():
            with asking("plan", self._frame.path, "an action raised"):
                self.branches.ask(self.branches.threads())
            self._await_all()
            self.branches.raise_errors(None)

    def _longest_wait(self, moment: Moment) -> float | None:
        """Return the time after which guards must be evaluated again without notice [s], or None.

        Only polled conditions, those of a robot, and timeouts change without a notice.
        """
        waits = [self._knowledge.every(name) for name in moment.externals]
        dues = [self._due(name) for name in moment.externals]
        now, looked = self._frame.run.clock.now(), self._looked
        # One that has passed since the guards were evaluated is as good as a notice.
        waits += [max(0.0, due - now) for due in dues if due is not None and due > looked]
        return min((wait for wait in waits if wait is not None), default=None)

    def _report_waiting(self, moment: Moment) -> None:
        """Report which guards hold the plan back, and again when their values have changed."""
        run = self._frame.run
        report = id(moment), tuple(self._values.items())
        if run.watched and self._reported != report:
            self._reported = report
            self._report_held_back(moment)

    def _report_fired(self, firing: Firing) -> None:
        """Publish and log the transitions that have just fired."""
        net, frame = self._net, self._frame
        marking = tuple(net.places[p].id for p in firing.moment.marking)
        for number in firing.fired:
            frame.emit_own(Fired, net.transitions[number].id, marking)
        if frame.run.logged:
            fired = ", ".join(net.transition_name(number) for number in firing.fired)
            log.loginfo(f"{frame.path}: {fired} -> {net.words(firing.moment.marking)}")

    def _report_held_back(self, moment: Moment) -> None:
        """Publish and log the guards that are false while the plan waits."""
        net, frame, guards = self._net, self._frame, self._table.plan.guards
        texts = tuple(str(guards[number]) for number in moment.candidates)
        truths = tuple(self._truth_of(guards[number]) for number in moment.candidates)
        ids = tuple(net.transitions[n].id for n in moment.candidates)
        frame.emit_own(HeldBack, ids, texts, truths)
        if frame.run.logged:
            false = ", ".join(
                f"{net.transition_name(number)!r}: [{text}] is false"
                for number, text in zip(moment.candidates, texts, strict=True)
            )
            log.loginfo(f"{frame.path}: waits in {net.words(moment.marking)}; {false or 'ends'}")

    def _truth_of(self, guard: Condition | None) -> str:
        """Return the values of the names in a guard: "low is true, there is false"."""
        values: dict[str, bool] = {}
        for name in () if guard is None else guard.atoms():
            # Other names are not evaluated again, as this would use up events.
            test = self._table.outcome_tests.get(name)
            if test is not None:
                values[name] = test.holds(self._ended.get(test.label))
            elif name in self._values:
                values[name] = self._values[name]
        return ", ".join(f"{name} is {str(value).lower()}" for name, value in values.items())

    def _await_all(self) -> None:
        """Wait until no child runs; all of them were asked to stop, and have their grace."""
        while self.branches.threads() or self.branches.reports:
            if not self.branches.reports:
                self.branches.wait_for_change(None)
            self._begin_again.clear()  # nothing begins any more
            self._take_reports()

    def _stop_all(self, why: str) -> None:
        """Stop all running children, and wait for them."""
        threads = self.branches.threads()
        if threads:
            with asking("plan", self._frame.path, why):
                self.branches.ask(threads)
        self._await_all()
        self._running.clear()
        self._since.clear()

    def _preempted(self) -> str:
        """End because of a preempt, after all children.

        Transitions that begin nothing still fire: if the last action finished just before the
        preempt, the plan ends with 'goal'.
        """
        frame = self._frame
        self._await_all()
        self.branches.raise_errors(None)
        moment = self.moment
        for _ in range(len(self._net.transitions)):  # bounded, as the net may have a loop
            if moment.end is not None:
                return moment.end
            truths = self._truths(moment)
            true = [t for t, holds in zip(moment.candidates, truths, strict=True) if holds]
            firing = self._table.firing_without_begins(moment, true)
            if firing is None:
                break
            moment = self._take(firing)
        if moment.end is not None:
            return moment.end
        frame.answered = True
        frame.emit_own(Preempted, "")
        return "preempted"

    def _stuck(self, moment: Moment) -> str:
        """Log where nothing can fire any more, and return the outcome 'fail'."""
        path = self._frame.path
        ended = ", ".join(f"{name} ended with {how!r}" for name, how in self._ended.items())
        text = f"{path}: nothing can fire any more in {self._net.words(moment.marking)}, "
        text += "not a goal." if self._table.plan.goals else "and there is no goal place."
        log.logwarn(f"{text} {ended}".rstrip())
        return "fail"

    # -- orders --------------------------------------------------------------------------------

    def order(self, what: str, which: str = "") -> None:
        """Add an order, which is executed before the next firing.

        Threads: any.
        """
        self.orders.append((what, which))
        self.branches.notice()
        # A child in the plan's own thread holds up the order: ask it to stop.
        step = self._frame.step
        if what != "fire" or step is None:
            return
        with asking("operator", "", f"fire {which}"):
            ask_child(self._frame, step)

    def _execute_order(self, what: str, which: str) -> str | None:
        if what == "stop":
            return "fail"
        if what == "restart":
            # All actions have stopped before the first ones begin again.
            self._stop_all("the plan starts again")
            self._ended.clear()
            self.moment = self._table.moment(self._net.initial)
            self._write_firing((), self.moment, list(self._steps), ())
            return None
        # Checked only now: the marking may have changed since the order was given.
        number = self._net.transition_numbers[which]
        if self._net.has_tokens(self.moment.marking, number):
            firing = self._table.forced(self.moment, number)
            self._take(firing)
        else:
            log.logwarn(f"{self._frame.path}: fire {which!r}: its places hold too few tokens now.")
        return None

    def active(self) -> Sequence[str]:
        """Return the labels of the running actions."""
        return [frame.step.label for frame in self.branches.running() if frame.step is not None]
