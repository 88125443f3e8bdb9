"""Records a run in its journal, and resumes a recorded run: the `RunJournal` of `smachpy.engine`.

This module handles the machine and its threads. `smachpy.durable.position` gives entries their
meaning, `smachpy.durable.journal` writes them.
"""

from __future__ import annotations

import copy
import json
import os
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock.forks import is_copy
from actionlib_core.shutdown import AT_EXIT
from smachpy.base import log
from smachpy.base.functions import name_of
from smachpy.durable.codec import NotDurableError, decode, encode, is_named_secret
from smachpy.durable.position import OF_PROCESS
from smachpy.durable.store import FencedError, StoreError, digest_of
from smachpy.engine.described import walk
from smachpy.engine.interrupt import Interruption
from smachpy.engine.journal import RunJournal
from smachpy.engine.options import ASK
from smachpy.engine.preempt import (
    ask,
    ask_child,
    asking,
    call_off,
    current_origin,
    pass_on,
    request_soon,
)
from smachpy.engine.visit import Origin, Override
from smachpy.exceptions import InvalidUserCodeError, MissionError, error_text
from smachpy.machines.container import Container, control_of
from smachpy.machines.history import remember, remembered
from smachpy.machines.state import get_options
from smachpy.userdata.kept_types import register_annotations
from smachpy.userdata.readonly import ATOMS
from smachpy.userdata.secret import is_secret
from smachpy.userdata.user_data import CheckedDict, ConstantKey, data_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from actionlib_core.clock import Clock
    from actionlib_core.resources import Policy
    from smachpy.durable.held import Held
    from smachpy.durable.journal import Journal
    from smachpy.durable.position import Position
    from smachpy.durable.store import MissionRow
    from smachpy.engine.frame import Frame
    from smachpy.engine.step import Step

_MADE_AGAIN = frozenset({"timeout", "concurrence", "plan"})
"""Origins of requests that a resumed run makes by itself, if their cause still holds."""

RESUME_S: Final = 2.0
"""Longest time for which resumed leaves, and requests to stop, wait until all states that were
active have been entered again [s]. An operator may hold one of them for hours.
"""

SUSPENDS: Final = frozenset({"SIGTERM", "SIGHUP", "SIGQUIT", AT_EXIT})
"""Ends of the process that are no end of the mission: a service is stopped, a terminal closed.
Ctrl-C is typed by the operator of the mission, who wants the robot to stop.
"""

_MISSING = object()

_SHORT: Final = 64
"""Values whose JSON is longer are compared by a digest, so that the text need not be kept."""

MAX_LISTED_GOALS: Final = 500
"""Resumed states, and outages, that the event `Recovered` lists at most."""


class SteadyTime:
    """The time of a mission: the time of day when it began, and from there on a steady clock.

    Args:
        clock: The clock.
        begin_ns: Its present time [ns since the Unix epoch]; None: the time of day.
    """

    def __init__(self, clock: Clock, begin_ns: int | None = None) -> None:
        self._clock = clock
        self._origin = clock.now()
        self._begin_ns = clock.time_ns() if begin_ns is None else begin_ns

    def now_ns(self) -> int:
        """Return the time [ns since the Unix epoch]."""
        return self._begin_ns + round((self._clock.now() - self._origin) * 1e9)

    def ahead_ns(self) -> int:
        """Return how far it is ahead of the time of day [ns]: clocks are set, and outages end."""
        return self.now_ns() - self._clock.time_ns()


class Recorder(RunJournal):
    """Writes each action of a run to the journal first, and resumes the run of an earlier process.

    Args:
        machine: The root.
        journal: Its journal.
        held: The resources that it holds.
        resumed: Whether the position comes from an earlier process.
        time: Its time.
        shift_ns: How far deadlines move because no process ran the mission [ns].
        gone_ns: Length of the outage before this process [ns].
        row: The mission's row in the store.

    Attributes:
        mission: The mission's id.
        held: The resources that it holds.
        time: Its time.
        run: The name of this run in recordings and viewers. It differs when a mission of the same
            id is started anew.
        broken: The error after which nothing is written any more and the run was preempted; None
            while there is none.
        on_fenced: Called before that preempt if another runner has taken the mission over, or None.
        on_suspend: Called with the signal and the top frame, instead of a preempt, if the process
            is to end; or None.

    Threads: any thread of the run calls the methods, as `smachpy.engine.journal.RunJournal` says.
    """

    is_durable = True

    def __init__(
        self,
        machine: Container,
        journal: Journal,
        held: Held,
        *,
        row: MissionRow,
        resumed: bool,
        time: SteadyTime,
        shift_ns: int = 0,
        gone_ns: int = 0,
    ) -> None:
        self.mission, self.run = row.id, row.run
        self.time = time
        self.broken: Exception | None = None
        self._noted = 0  # the number of the last request to stop
        self.on_fenced: Callable[[FencedError], object] | None = None
        self.on_suspend: Callable[[str, Any], object] | None = None
        self._is_suspended = False
        self._pid = os.getpid()
        self._machine = machine
        self._journal = journal
        self.held = held
        self._is_resumed = resumed
        self._shift_ns = shift_ns
        self._gone_ns = gone_ns
        self._top: Frame | None = None
        self._root = f"/{machine.name or 'SM_ROOT'}"
        # Visits of the earlier process: those whose states have not been entered again, and those
        # that continue now. A path is in at most one of the two.
        self._unresumed: dict[str, dict[str, Any]] = {}
        self._resumed: dict[str, dict[str, Any]] = {}
        self._markings: dict[str, list[str]] = {}  # of plans that have not been resumed yet
        # Children that had been asked to stop, to be asked again: frame, child, origin, override.
        self._to_stop: list[tuple[Frame, Step, tuple[str, str, str], Override | None]] = []
        # Requests to containers that are passed on once all states have been entered again; and by
        # container, those that it has served: if they come again, its present child is not meant.
        self._preempts = _unserved(journal.position) if resumed else []
        self._served: dict[str, list[tuple[str, str, str]]] = {}
        self._open: dict[str, list[tuple[str, str, str]]] = {}  # those that it has not served
        # By child, the requests that have reached it, and those that it has withdrawn.
        self._heard: dict[str, set[tuple[str, str, str]]] = {}
        self._recalled: dict[str, set[tuple[str, str, str]]] = {}
        self._is_asking = False  # `_ask_again` passes requests on
        self._held: list[tuple[Container, tuple[str, str, str]]] = []  # the same, already asked
        self._gave_up_waiting = False  # not all states were entered again within `RESUME_S`
        self._questions = 0  # states about which an operator is asked now
        # Children whose begin is in the journal already, in the entry that chose them.
        self._chosen: set[str] = set()
        self._numbers: dict[str, int] = {}  # path of an iterator -> index of its item
        self._containers: dict[str, Container] = {
            path: state for path, state in walk(machine, self._root) if isinstance(state, Container)
        }
        self._has_history = any(
            each._smachpy.reenter != "first" for each in self._containers.values()
        )
        # Two containers may share a userdata object: it is kept once, under the first path.
        self._homes: dict[int, str] = {}
        for path, container in self._containers.items():
            self._homes.setdefault(id(container.userdata), path)
        self._transient = {
            path: frozenset(get_options(container).transient)
            for path, container in self._containers.items()
        }
        self._knowledge: dict[str, Any] = {}  # path of a plan -> its conditions and events
        self._known_changes: dict[str, int] = {}  # path of a plan -> its changes that were written
        # Container -> key -> the children that write it while they run, side by side with others.
        self._writers: dict[str, dict[str, set[str]]] = {}
        # Path -> key -> the value, and its JSON, or the digest of a long one, as last written.
        self._known: dict[str, dict[str, tuple[Any, str]]] = {}
        for path, container in self._containers.items():
            own: Any = container._smachpy
            if container._smachpy_kind == "plan":
                self._knowledge[path] = own.knowledge
            data = data_of(container.userdata)
            if isinstance(data, CheckedDict):
                register_annotations(data.fields.kind)

    def restore(self) -> None:
        """Restore the machine's userdata, and the events of its plans.

        Raises:
            MissionError: a value cannot be decoded.
        """
        for path in self._homes.values():
            kept = self._journal.position.userdata.get(path, {})
            data = data_of(self._containers[path].userdata)
            # The mission's code may have set a key that the run has deleted since.
            for key in [key for key, value in data.items() if self._is_kept(path, key, value)]:
                if key not in kept:
                    del data[key]
            known = self._known[path] = {}
            for key, found in kept.items():
                encoded = self._journal.value(found)
                data[key] = decode(encoded)
                known[key] = (data[key], _shortened(json.dumps(encoded)))
        shift_ns = self._shift_ns - self.time.ahead_ns()
        for path, conditions in self._journal.position.conditions.items():
            if path in self._knowledge:
                self._knowledge[path].restore(conditions, shift_ns)
        self.held.restore(self._journal.position.visits)

    # -- writing -------------------------------------------------------------------------------

    def _write(self, kind: str, path: str, **facts: Any) -> bool:
        """Write an entry; return whether that worked.

        If it did not, its effect must not happen: the run is preempted.
        """
        return self._write_with(None, None, kind, path, facts)

    def _write_with(
        self,
        frame: Frame | None,
        step: Step | None,
        kind: str,
        path: str,
        facts: dict[str, Any],
        value: str = "",
        *,
        at_once: bool = True,
    ) -> bool:
        """Write an entry with the changes in the userdata of `frame`; see `_changes`.

        `value` is the name of the fact that is an encoded value, which may be large. `at_once` is
        False while the run's lock is held: `commit` writes the entry.
        """
        if is_copy(self._pid):  # a process that a state has forked: the mission is its parent's
            return True
        if self.broken is not None:
            return False
        journal = self._journal
        # The lock covers reading the userdata and queueing the entry: a change that an entry
        # reports must not be older than the one that an earlier entry has reported.
        with journal.lock:
            entry = {"kind": kind, "path": path, "stamp_ns": self.time.now_ns(), **facts}
            if value:
                entry[value] = journal.compact(facts[value], json.dumps(facts[value]))
            learn: Callable[[], None] | None = None
            if frame is not None:
                changes, learn = self._changes(frame, step, path)
                entry.update(changes)
            if entry.pop("only_changes", False) and "userdata" not in entry:
                return True
            number = journal.put(entry)
            if learn is not None:
                learn()
            if not at_once:
                self._noted = number
                return True
        return self._commit(number)

    def _commit(self, number: int) -> bool:
        # Without the lock: other branches queue their entries meanwhile, see `Journal`.
        try:
            self._journal.commit(number)
            self.held.give_ended(self._journal.position.visits)
        except (StoreError, FencedError) as error:
            self.stop(error)
            return False
        return True

    def _note_request(self, kind: str, path: str, **facts: Any) -> None:
        self._write_with(None, None, kind, path, facts, at_once=False)

    def commit(self) -> None:
        if self._noted and self.broken is None and not self._is_suspended:
            self._commit(self._noted)

    @property
    def is_taken_over(self) -> bool:
        return isinstance(self.broken, FencedError)

    def stop(self, error: Exception) -> None:
        """Preempt the run because its journal cannot be written; only the first `error` counts."""
        if self.broken is not None or self._is_suspended:
            return
        self.broken = error
        if self.on_fenced is not None and isinstance(error, FencedError):
            self.on_fenced(error)
        log.logerr(f"{self._root}: the journal cannot be written, the run is preempted: {error}")
        with asking("program", "journal", str(error)):
            request_soon(self._machine)

    def _changes(
        self, frame: Frame, step: Step | None, child: str
    ) -> tuple[dict[str, Any], Callable[[], None] | None]:
        """Return the changes in the userdata of the container of `frame`, for an entry of `child`.

        The second one is to be called once the entry is put: then they are known as written.

        A state may change a list or message in place, so identity proves nothing for the values
        that `step` can write, or for all without a `step`: their JSON is compared.

        What only others write that run side by side is not in it. It is written as they end: one
        that is executed again after a kill begins with the userdata with which it began.
        """
        userdata = frame.container.userdata
        path = self._homes.get(id(userdata))
        if path is None:
            return {}, None
        written = None if step is None else set(getattr(step.userdata, "_output", {}).values())
        data = dict(data_of(userdata))  # a copy, as other branches may write at the same time
        known = self._known.setdefault(path, {})
        changed: dict[str, Any] = {}
        seen: dict[str, tuple[Any, str]] = {}
        for key, value in data.items():
            if self._is_written_by_others(frame.path, key, child):
                continue
            before = known.get(key)
            if before is not None and before[0] is value:
                if type(value) in ATOMS or (written is not None and key not in written):
                    continue
            elif not self._is_kept(path, key, value):
                continue
            encoded = _encoded(value, key, frame.here())
            text = json.dumps(encoded)  # texts, because 1 == True == 1.0
            short = _shortened(text)
            if before is None or before[1] != short:
                changed[key] = self._journal.compact(encoded, text)
            seen[key] = (value, short)
        gone = [
            key
            for key in known
            if key not in data and not self._is_written_by_others(frame.path, key, child)
        ]

        def learn() -> None:
            known.update(seen)
            for key in gone:
                del known[key]

        found: dict[str, Any] = {"userdata": {path: changed}} if changed else {}
        return {**found, "deleted": {path: gone}} if gone else found, learn

    def _is_written_by_others(self, container: str, key: str, child: str) -> bool:
        """Return whether only siblings of a child write a key that run now."""
        writers = self._writers.get(container, {}).get(key)
        if not writers or child in writers:
            return False
        found = map(self._journal.position.visits.get, writers)
        return any(visit is not None and visit["outcome"] is None for visit in found)

    def _is_kept(self, path: str, key: str, value: object) -> bool:
        """Return whether a key is kept; constants come from the machine's code."""
        is_constant = type(key) is ConstantKey
        return not is_constant and key not in self._transient[path] and not is_secret(value)

    # -- the run -------------------------------------------------------------------------------

    def attach(self, root: Frame) -> tuple[Any, ...] | None:
        self._top, run = root, root.run
        # Entries are written where events are published.
        run.watched = run.careful = True
        if self._is_resumed:
            self._write("Recovered", self._root, shift_ns=self._shift_ns, gone_ns=self._gone_ns)
            if self._journal.position.data.get("emergency"):
                control_of(self._machine).emergency_stop()
            # A copy: the position changes with each entry from here on.
            self._unresumed = copy.deepcopy(self._journal.position.visits)
            for path, visit in self._unresumed.items():
                self._served[path] = [
                    (source, by, why) for source, by, why in visit.get("served", ())
                ]
                self._open[path] = [
                    (source, by, why) for source, by, why in visit.get("requests", ())
                ]
                self._recalled[path] = {
                    (source, by, why) for source, by, why in visit.get("recalled", ())
                }
            self._markings = dict(self._journal.position.markings)
            stopped = self._journal.position.data.get("stopped", {})
            for path, container in self._containers.items():
                container._smachpy.live.stopped_at = stopped.get(path, "")
            remember(self._machine, self._root, self._journal.position.data.get("goes_on", {}))
            self._resumed[self._root] = self._unresumed.pop(self._root)
            self._all_back = run.clock.event("the states that were active")
            if not self._unresumed:
                self._ask_at_start()
            if self._unresumed and self._machine._preempt_requested:
                # Requested before the run: a state that was active must be entered again before it
                # can stop, or its goal would run on without anybody to cancel it.
                source, by, why = self._machine._smachpy.live.origin or ("program", "", "")
                self._machine._preempt_requested = False
                self.asked(root, Origin(source, by, why))
            return self._recovered()
        with self._journal.lock:
            facts: dict[str, Any] = {"in": "", "userdata": {}}
            for path in self._homes.values():
                values = data_of(self._containers[path].userdata)
                known = self._known[path] = {}
                kept = facts["userdata"][path] = {}
                for key, value in values.items():
                    if self._is_kept(path, key, value):
                        encoded = _encoded(value, key, path)
                        text = json.dumps(encoded)
                        kept[key] = self._journal.compact(encoded, text)
                        known[key] = (value, _shortened(text))
        self._write("Started", self._root, **facts)
        return None

    def _ask_at_start(self) -> None:
        """Let the run end at its start if it was asked to stop before its first child began."""
        preempts, self._preempts = self._preempts, []
        for request in preempts:
            if request["path"] == self._root and not self._machine._preempt_requested:
                origin = Origin(request["source"], request["by"], request["why"])
                self._machine._smachpy.live.origin = origin
                self._machine._preempt_requested = True

    def _recovered(self) -> tuple[Any, ...]:
        """Return the fields of the event `Recovered`."""
        data = self._journal.position.data
        active = [
            (path, visit.get("entered_ns", visit["since_ns"]))  # not in journals of old versions
            for path, visit in data["visits"].items()
            if visit["outcome"] is None
        ]
        outages = tuple(map(tuple, data["outages"][-MAX_LISTED_GOALS:]))
        return self.mission, data["started_ns"], outages, tuple(active[:MAX_LISTED_GOALS])

    def finish(self, outcome: str) -> None:
        self._write("Finished", self._root, outcome=outcome)

    def enter(self, frame: Frame, step: Step) -> str | None:
        if frame.path not in self._containers:
            return None  # a state runs this container by itself; it is not part of the machine
        path = step.path_in(frame)
        self._note_writes(frame, step, path)
        visit = self._unresumed.pop(path, None)
        outcome: str | None = None
        if visit is None:
            self._resumed.pop(path, None)
            has_siblings = frame.tidying is None and _kind(frame) in {"concurrence", "plan"}
            self._drop_below(path if has_siblings else frame.path)
            self._markings.pop(path, None)
            # The child before had ended after these, and it is followed now: they are served.
            self._served.setdefault(frame.path, []).extend(self._open.pop(frame.path, ()))
            self._forget_requests(path)
            if not self._write_entered(frame, path):
                call_off(frame)
                return "preempted"
        else:
            outcome = visit["outcome"]
            if outcome is None:
                self._resumed[path] = visit
                if visit.get("stopping"):
                    origin = ("plan", frame.path, "before the resume")
                    self._to_stop.append((frame, step, origin, None))
                request = visit.get("asked")
                if request is not None:
                    origin = (request["source"], request["by"], request["why"])
                    wanted = request["override"] and Override(*request["override"])
                    self._to_stop.append((frame, step, origin, wanted))
            if not self._unresumed:
                self._note_all_back()
            elif outcome is not None or not isinstance(step.state, Container):
                # The end of this child may stop its siblings. They must have been entered again
                # before, to cancel their goals.
                self._all_back.wait(RESUME_S)
        outcome = self._held_outcome(step, visit, outcome)
        # An outcome without a transition was accepted because the child had been asked to stop:
        # ask again, so that it is accepted now, too. What an operator has chosen stays as it is.
        if outcome is not None and outcome not in step.next:
            with asking("program", "journal", "before the resume"), frame.run.lock:
                chosen = None if frame.visit is None else frame.visit.override
                ask(frame, step, override=chosen)
            frame.run.flush()
        return outcome

    def _drop_below(self, path: str) -> None:
        """What was active below `path` before the resume is not entered again any more.

        A container that raised before it had entered its children again may be visited anew.
        """
        if not (self._unresumed or self._resumed or self._markings):
            return
        has_waited = bool(self._unresumed)
        for places in (self._unresumed, self._resumed, self._markings):
            for each in tuple(places):  # a copy: other branches take theirs out at the same time
                if each.startswith(f"{path}/"):
                    places.pop(each, None)
        if has_waited and not self._unresumed:
            self._note_all_back()

    def _note_writes(self, frame: Frame, step: Step, path: str) -> None:
        """Note what a leaf writes while others run beside it; a container does so as it ends."""
        if _kind(frame) in {"concurrence", "plan"} and not isinstance(step.state, Container):
            with self._journal.lock:
                writers = self._writers.setdefault(frame.path, {})
                for key in getattr(step.userdata, "_output", {}).values():
                    writers.setdefault(key, set()).add(path)

    def _forget_writes(self, frame: Frame, step: Step, path: str) -> None:
        """Note that a child has ended, which others run beside."""
        if frame.path in self._writers:
            with self._journal.lock:
                for key in getattr(step.userdata, "_output", {}).values():
                    self._writers[frame.path].get(key, set()).discard(path)

    def _held_outcome(
        self, step: Step, visit: dict[str, Any] | None, outcome: str | None
    ) -> str | None:
        """Return 'preempted' for a state of before the resume if an emergency stop holds it.

        One with a goal is executed: it is to cancel that, and was told so before it begins.
        """
        if visit is None or isinstance(step.state, Container) or visit["goal"] is not None:
            return outcome
        stopped = control_of(self._machine).emergency() is not None
        return "preempted" if stopped and outcome is None else outcome

    def _write_entered(self, frame: Frame, path: str) -> bool:
        """Write that the state at `path` begins; return whether that worked."""
        facts: dict[str, Any] = {"in": frame.path}
        kind = _kind(frame)
        if frame.tidying is not None:
            facts["ending"] = list(frame.tidying.ending)
        elif kind in {"concurrence", "plan"}:
            facts["beside"] = True
        elif kind == "iterator":
            facts["number"] = self._numbers.get(frame.path, 0)
        if path in self._chosen:
            self._chosen.discard(path)
            visit = self._journal.position.visits.get(path)
            # The entry that chose it has begun its visit. Only a transition callback may have
            # changed the userdata since.
            if visit is not None and not visit.get("stopping"):
                if not frame.data.transition_cbs:
                    return self.broken is None
                facts["only_changes"] = True
        return self._write_with(frame, None, "Entered", path, facts)

    def _note_all_back(self) -> None:
        """Continue what waited until all states that were active have been entered again."""
        self._ask_again()
        control = control_of(self._machine)
        if control.emergency() is not None:
            control.emergency_stop()  # for those that are back: a goal of one may be running
        self._all_back.set()

    def _ask_again(self) -> None:
        """Pass on the requests to stop that waited until the active states were entered again."""
        self._is_asking = True
        stopping, self._to_stop = self._to_stop, []
        for frame, step, origin, override in stopping:
            path = step.path_in(frame)
            asked = self._journal.position.visits.get(path, {}).get("asked") or {}
            with frame.run.lock:
                remember(step.state, path, asked.get("goes_on", {}))
            with asking(*origin):
                ask_child(frame, step, override)
        held, self._held = self._held, []
        for inner, origin in held:
            assert self._top is not None
            with asking(*origin), self._top.run.lock:
                pass_on(inner)
            self._top.run.flush_soon()
        preempts, self._preempts = self._preempts, []
        for request in preempts:
            container = self._containers.get(request["path"])
            if container is not None:
                with asking(request["source"], request["by"], request["why"]):
                    request_soon(container)
        self._is_asking = False

    def execute(self, frame: Frame, step: Step, userdata: Any) -> Any:
        visit = self._resumed.get(frame.here())
        if visit is None:
            return self._left(frame, step, step.execute(userdata))
        state: Any = step.state
        options = get_options(state)
        if options.on_resume is not None:
            own = state.userdata if isinstance(state, Container) else userdata
            self._call(frame, options.on_resume, own)
        # The option `resume` does not apply to a container, whose children are resumed. An action
        # looks for its goal first, and calls `decide` itself if the server does not know it.
        if isinstance(state, Container) or state._smachpy_kind == "action":
            return self._left(frame, step, step.execute(userdata))
        decided = self.decide(frame, userdata)
        return self._left(frame, step, step.execute(userdata) if decided is None else decided)

    def decide(self, frame: Frame, userdata: Any) -> Any:
        """Return the outcome that `resume` gives; for "ask" it blocks until an operator answers."""
        options = get_options(frame.step.state)
        policy = options.resume
        if policy is None:
            return None
        if options.skipped is not None:
            return options.skipped
        if policy != ASK:
            assert callable(policy)
            return self._call(frame, policy, userdata)
        # One that had been asked to stop does not go on, whatever anybody would answer.
        return "preempted" if frame.step.state._preempt_requested else self._ask_operator(frame)

    def _ask_operator(self, frame: Frame) -> str | None:
        """Hold the state until an operator decides how it continues."""
        # Imported here: the question needs the network, which other missions may do without.
        from smachpy.durable.question import RESUME, open_question

        path, state = frame.here(), frame.step.state
        log.logwarn(
            f"{path}: was active when the process ended; an operator decides: resume, to execute "
            f"it again, or an outcome. Try 'smachpy answer resume --state {path}', or "
            "'smachpy run ... --view --control'."
        )
        control = control_of(self._machine)
        outcomes = state.get_registered_outcomes()
        with open_question(path, outcomes, lambda: control.release(path)) as inbox:
            with self._journal.lock:
                self._questions += 1
            control.hold(frame, path, "resume", until=lambda: inbox.answer is not None)
        answer, by = inbox.close(RESUME)
        with self._journal.lock:
            self._questions -= 1
            is_last = self._questions == 0
        if state._preempt_requested:
            return "preempted"
        if by:
            log.loginfo(f"{path}: {by} answered {answer!r}")
            # `hold` has paused the machine; without an answer the operator has resumed it.
            if is_last:
                control.resume()
        return None if answer == RESUME else answer

    def _call(self, frame: Frame, hook: Callable[[Any], Any], userdata: Any) -> Any:
        try:
            return hook(userdata)
        except Exception as error:
            where = frame.here()
            raise InvalidUserCodeError(
                f"{where}: hook {name_of(hook)} raised {error_text(error)}", path=where
            ) from error

    def _left(self, frame: Frame, step: Step, outcome: Any) -> Any:
        """Write that `step` has ended with `outcome`, and return that."""
        path = step.path_in(frame)
        self._resumed.pop(path, None)
        if frame.dead:  # left behind: the journal has recorded another end for this visit
            raise Interruption
        if frame.path not in self._containers or not isinstance(outcome, str):
            return outcome
        visit, state = frame.visit, step.state
        facts: dict[str, Any] = self._places(state, path)
        choice, counts = _choice(frame, outcome), outcome
        if choice is None:
            step.decide(frame, outcome)
        elif choice.outcome is not None:
            counts = choice.outcome
        else:  # a jump: a resumed run enters the child, to ask it again
            if facts:
                self._write("Noted", path, **facts)
            return outcome
        facts["outcome"] = counts
        target = step.next[counts].target if counts in step.next else None
        asked = state._preempt_requested or (visit is not None and visit.is_asked())
        asked = asked or frame.container._preempt_requested
        if target is None:
            if not asked:
                return outcome  # an unknown one: the machine raises an error right after this
        # The next child begins in the same entry, so that no kill can come between. Not if the
        # child was asked to stop: the container may end instead.
        elif not (asked or target.final) and hasattr(frame.data, "transitions"):
            facts["next"] = f"{frame.path}/{target.label}"
            self._chosen.add(facts["next"])
        answered = visit is not None and visit.has_answered(outcome)
        if answered and outcome != "preempted" and _kind(frame) not in {"concurrence", "plan"}:
            facts["served"] = True
        # Start callbacks get the userdata itself and may keep it: compare all keys, not only those
        # that this child writes.
        callbacks = frame.data.start_cbs
        self._write_with(frame, None if callbacks else step, "Left", path, facts)
        self._forget_writes(frame, step, path)
        return outcome

    def _places(self, state: Any, path: str) -> dict[str, Any]:
        """Return where the next runs of a machine that has ended begin, for an entry."""
        if not isinstance(state, Container):
            return {}
        goes_on: dict[str, str] = {}
        if state._smachpy.live.goes_on or path in self._journal.position.data.get("goes_on", {}):
            goes_on = remembered(state, path)
        elif not self._has_history:
            return {}
        stopped = {
            where: each._smachpy.live.stopped_at
            for where, each in walk(state, path)
            if isinstance(each, Container) and each._smachpy.live.stopped_at
        }
        return {"stopped": stopped, **({"goes_on": goes_on} if goes_on else {})}

    def take(
        self, resource: str, path: str, policy: Policy, stop: Callable[[str], object]
    ) -> str | None:
        if is_copy(self._pid):
            return None
        try:
            return self.held.take(resource, path, policy, stop)
        except (StoreError, FencedError) as error:
            self.stop(error)
            raise

    def former_holder(self, resource: str, path: str) -> str | None:
        former = self.held.former(resource)
        is_back_soon = former in self._unresumed or former in self._resumed
        return former if former != path and is_back_soon else None

    def give(self, resource: str) -> None:
        # A suspended mission keeps what it holds for the process that resumes it, and so does one
        # whose store is gone. A thread that was left behind may end after the mission.
        is_over = self._machine._smachpy.live.journal is not self
        if is_copy(self._pid) or self._is_suspended or is_over or self.broken is not None:
            return
        try:
            self.held.give(resource)
        except (StoreError, FencedError) as error:
            self.stop(error)

    # -- the position before the resume --------------------------------------------------------

    def _children(self, path: str) -> list[str]:
        """Return the paths of a container's children that have not been entered again."""
        if path not in self._containers:
            return []
        # `tuple`: other branches take their visits out at the same time.
        return [each for each, visit in tuple(self._unresumed.items()) if visit["in"] == path]

    def resumed_label(self, frame: Frame) -> str | None:
        children = self._children(frame.path) if self._unresumed else []
        return children[0][len(frame.path) + 1 :] if children else None

    def wanted_label(self, frame: Frame) -> str | None:
        for child in self._children(frame.path) if self._unresumed else ():
            override = (self._unresumed[child].get("asked") or {}).get("override")
            if override is not None and not Override(*override).if_stopped:
                return Override(*override).label
        return None

    def ending(self, frame: Frame) -> Sequence[Any] | None:
        for child in self._children(frame.path) if self._unresumed else ():
            found: Sequence[Any] | None = self._unresumed[child].get("ending")
            if found is not None:
                return found
        return None

    def cleaned_up(self, frame: Frame, step: Step) -> None:
        path = step.path_in(frame)
        if path in self._journal.position.visits and not frame.dead:
            self._write("CleanedUp", path)

    def item(self, frame: Frame, number: int) -> int:
        children = self._children(frame.path) if self._unresumed else []
        self._numbers[frame.path] = number
        return number - self._unresumed[children[0]]["number"] if children else 1

    def check_items(self, frame: Frame, count: int) -> None:
        """Raise a MissionError if there are fewer items than before the resume."""
        # An item that was reached has been entered again by now, and its visit is gone.
        for child in self._children(frame.path):
            number = self._unresumed[child]["number"]
            raise MissionError(
                f"{frame.path}: items: got {count} after the resume; expected at least "
                f"{number + 1}, as before it. Try items that are the same each time."
            )

    def has_begun(self, path: str) -> bool:
        return path in self._markings or (bool(self._unresumed) and bool(self._children(path)))

    # -- plans ---------------------------------------------------------------------------------

    def fired(
        self,
        frame: Frame,
        transitions: Sequence[str],
        marking: Sequence[str],
        ends: Sequence[str],
        begins: Sequence[str],
    ) -> None:
        path = frame.path
        if path not in self._containers:
            return
        facts: dict[str, Any] = {
            "transitions": list(transitions),
            "marking": list(marking),
            "ends": [f"{path}/{label}" for label in ends],
            "begins": [f"{path}/{label}" for label in begins],
            **self._new_conditions(frame),
        }
        self._chosen.update(facts["begins"])
        self._write_with(frame, None, "Fired", path, facts)

    def note_conditions(self, frame: Frame) -> None:
        facts = self._new_conditions(frame)
        if facts and frame.path in self._containers:
            self._write("Noted", frame.path, **facts)

    def _new_conditions(self, frame: Frame) -> dict[str, Any]:
        """Return the conditions that have changed in the plan and its sub-plans, for an entry."""
        found: dict[str, Any] = {}
        for path, knowledge in self._knowledge.items():
            is_here = path == frame.path or path.startswith(f"{frame.path}/")
            if is_here and self._known_changes.get(path, 0) != knowledge.changes:
                self._known_changes[path], kept = knowledge.kept(frame.run.clock)
                ahead_ns = self.time.ahead_ns()
                events = [[name, at_ns + ahead_ns] for name, at_ns in kept["events"]]
                found[path] = {**kept, "events": events}
        return {"conditions": found} if found else {}

    def resumed_plan(self, frame: Frame) -> tuple[list[str], dict[str, Any]] | None:
        path = frame.path
        marking = self._markings.pop(path, None)
        if marking is None:
            return None
        children: dict[str, Any] = {}
        for child in self._children(path):
            visit = self._unresumed[child]
            label = child[len(path) + 1 :]
            has_more = visit["goal"] is not None or child in self._markings
            if visit["outcome"] is not None:
                del self._unresumed[child]
            elif visit.get("stopping") and not (has_more or self._children(child)):
                # A leaf without a goal that was stopping: the end of the process has stopped it.
                del self._unresumed[child]
                if not visit.get("again"):
                    continue
                visit = {**visit, "stopping": False}
            begun_ns = visit.get("begun_ns", visit["since_ns"]) - self.time.ahead_ns()
            children[label] = {**visit, "begun_ns": begun_ns}
        if not self._unresumed:
            self._note_all_back()
        return marking, children

    def attempt(self, frame: Frame) -> tuple[int, float]:
        visit = self._resumed.get(frame.here())
        if visit is None:
            return 1, 0.0
        wait = visit["since_ns"] - self.time.now_ns()
        return visit["attempt"], max(0.0, wait / 1e9)

    def time_left(self, frame: Frame, seconds: float) -> float:
        visit = self._resumed.get(frame.here())
        if visit is None:
            return seconds
        return float(seconds - (self.time.now_ns() - visit["since_ns"]) / 1e9)

    def goes_on(self, frame: Frame) -> bool:
        visit = self._resumed.get(frame.here())
        return visit is None or visit["goal"] is not None or self.has_begun(frame.here())

    def retried(self, frame: Frame, attempt: int, wait: float, reason: str) -> None:
        path = frame.here()
        # The next attempt is a normal one: `resume`, the goal and the time left were for this one.
        self._resumed.pop(path, None)
        self._markings.pop(path, None)
        self._drop_below(path)
        self._forget_requests(path)
        if path in self._journal.position.visits:
            at_ns = self.time.now_ns() + int(wait * 1e9)
            facts = {"attempt": attempt, "reason": reason, "at_ns": at_ns}
            is_inside = frame.path in self._containers
            self._write_with(frame if is_inside else None, None, "Retried", path, facts)

    def asked(self, frame: Frame, origin: Origin) -> bool:
        path = frame.here() if frame.parent is None else frame.path
        source, by, why = origin
        if source in OF_PROCESS and by in SUSPENDS:
            self._suspend(by)
            return True
        request = {"path": path, "source": source, "by": by, "why": why}
        if source in _MADE_AGAIN or path not in self._containers:
            return False
        if not self._is_known(path, origin):
            self._note_request("PreemptRequested", **request)
        if not self._unresumed or self._gave_up_waiting:
            return False
        # Kept until all states that were active have been entered again, or `RESUME_S` is over.
        if request not in self._preempts:
            self._preempts.append(request)
            self._wait_for_all()
        return True

    def _wait_for_all(self) -> None:
        assert self._top is not None
        self._top.run.clock.call_later(RESUME_S, self._give_up_waiting)

    def has_served(self, path: str) -> bool:
        source, by, why = origin = current_origin()
        if path not in self._containers or source == "plan":
            return False
        if self._is_asking or source in _MADE_AGAIN:
            is_open = (source, by, why) in self._open.get(path, ())
            if not is_open and (source, by, why) in self._served.get(path, ()):
                return True
        if not self._is_known(path, origin):
            facts = {"source": source, "by": by, "why": why, "passed": True}
            self._note_request("PreemptRequested", path, **facts)
        return False

    def holds_back(self, path: str) -> bool:
        source, by, why = current_origin()
        if path not in self._containers or source == "plan":
            return False
        if not self._unresumed or self._gave_up_waiting or not self.has_begun(path):
            return False
        # A timeout that is over already, for one: its children are entered again before they stop.
        self._held.append((self._containers[path], (source, by, why)))
        self._wait_for_all()
        return True

    def passes(self, path: str) -> bool:
        source, by, why = current_origin()
        again = self._is_asking or source in _MADE_AGAIN
        if again and (source, by, why) in self._recalled.get(path, ()):
            return False
        self._heard.setdefault(path, set()).add((source, by, why))
        return True

    def recalled(self, path: str) -> None:
        if path in self._journal.position.visits:
            origins = sorted(self._heard.pop(path, ()))
            self._recalled.setdefault(path, set()).update(origins)
            self._note_request("Recalled", path, origins=origins)

    def stopped(self) -> None:
        if not self._journal.position.data.get("emergency"):
            self._write("Stopped", self._root)

    def released(self) -> None:
        if self._journal.position.data.get("emergency") and not self._is_suspended:
            self._write("Released", self._root)

    def must_return(self, path: str) -> bool:
        return path in self._unresumed

    def halted(self, path: str) -> None:
        if path in self._journal.position.visits:
            self._write("Halted", path)

    def went_on(self, path: str) -> None:
        if path in self._journal.position.visits:
            self._write("WentOn", path)

    def _forget_requests(self, path: str) -> None:
        """A visit, or an attempt, begins: a timeout of it is another one."""
        self._heard.pop(path, None)
        self._recalled.pop(path, None)
        self._served.pop(path, None)
        self._open.pop(path, None)

    def _is_known(self, path: str, origin: tuple[str, str, str]) -> bool:
        """Return whether the journal has a request to a container that it has not served yet."""
        visit = self._journal.position.visits.get(path, {})
        return list(origin) in visit.get("requests", ())

    def _suspend(self, by: str) -> None:
        """Let the process end without an end of the mission, because of the signal `by`."""
        if self._is_suspended:
            return
        self.commit()  # a request that has been told just now
        self._is_suspended = True  # before the lease is released, so that its loss is no error
        self._journal.freeze()
        if self.on_suspend is not None:
            self.on_suspend(by, self._top)

    def asked_one(
        self,
        frame: Frame,
        step: Step,
        override: Override | None,
        left: Mapping[str, str] | None = None,
    ) -> None:
        path = step.path_in(frame)
        if path in self._journal.position.visits:
            source, by, why = current_origin()
            wanted = None if override is None else list(override)
            facts = {"source": source, "by": by, "why": why, "override": wanted}
            left_at = {"goes_on": left} if left else {}
            self._note_request("PreemptRequested", path, **facts, **left_at)

    def _give_up_waiting(self) -> None:
        """Pass on the requests, although an operator still holds some of the states."""
        if self._unresumed:
            self._gave_up_waiting = True
            self._ask_again()

    # -- userdata ------------------------------------------------------------------------------

    def check_value(self, frame: Frame, path: str, key: str, value: Any) -> None:
        """Raise a NotDurableError if the value cannot be kept."""
        # Here rather than at the end of the state, so that the traceback shows the assignment.
        home = self._homes.get(id(frame.container.userdata))
        if type(value) in ATOMS and not is_named_secret(key, value):
            return
        if home is not None and self._is_kept(home, key, value):
            _encoded(value, key, path)

    # -- goals and side effects ----------------------------------------------------------------

    def goal_of(self, frame: Frame) -> dict[str, Any] | None:
        visit = self._resumed.get(frame.here())
        goal = None if visit is None else visit["goal"]
        if goal is None:
            return None
        result, ahead_ns = goal["result"], self.time.ahead_ns()
        times = {at: goal[at] for at in ("taken_ns", "begun_ns") if at in goal}
        return {
            **goal,
            **{at: None if ns is None else ns - ahead_ns for at, ns in times.items()},
            "result": None if result is None else decode(self._journal.value(result)),
        }

    def goal_sent(self, frame: Frame, action: str, goal_id: str) -> None:
        """Write it, or raise the StoreError or FencedError: then the goal must not be sent."""
        if self._visit_of(frame) is None:
            return
        if frame.dead:  # a thread that was left behind must not start anything
            raise Interruption
        written = self._write("GoalSent", frame.here(), action=action, goal_id=goal_id)
        if not written and self.broken is not None:
            raise self.broken

    def goal_taken(self, frame: Frame, goal_id: str, *, begun: bool) -> None:
        if self._has_goal(frame, goal_id):
            self._write("GoalTaken", frame.here(), goal_id=goal_id, begun=begun)

    def goal_done(
        self, frame: Frame, goal_id: str, status: str, text: str, result: Any, *, preempted: bool
    ) -> None:
        if self._has_goal(frame, goal_id):
            kept = None if result is None else encode(result, key="result", path=frame.here())
            facts = {"goal_id": goal_id, "status": status, "text": text, "result": kept}
            if preempted:
                facts["preempted"] = True
            self._write_with(None, None, "GoalDone", frame.here(), facts, "result")

    def _has_goal(self, frame: Frame, goal_id: str) -> bool:
        visit = self._visit_of(frame)
        return visit is not None and visit["goal"] is not None and visit["goal"]["id"] == goal_id

    def _visit_of(self, frame: Frame) -> dict[str, Any] | None:
        return self._journal.position.visits.get(frame.here())

    def met(self, frames: Sequence[Frame]) -> None:
        visits = self._journal.position.visits
        paths = [path for path in (frame.here() for frame in frames) if path in visits]
        if paths and not self._write("Met", paths[0], paths=paths):
            assert self.broken is not None
            raise self.broken

    def has_met(self, frame: Frame) -> bool:
        visit = self._journal.position.visits.get(frame.here())
        return visit is not None and visit.get("met", False)

    def once(self, frame: Frame, key: str, call: Callable[[], Any]) -> Any:
        """Call or remember it; raise a NotDurableError if the result of `call` cannot be kept."""
        path = frame.here()
        visits = self._journal.position.visits
        while path and path not in visits:  # a state runs this container by itself: use its visit
            path = path.rpartition("/")[0]
        if not path:
            return call()
        kept = visits[path]["once"].get(key, _MISSING)
        if kept is not _MISSING:
            return decode(self._journal.value(kept))
        value = call()
        facts = {"key": key, "value": _encoded(value, key, path)}
        if frame.dead:
            raise Interruption
        if not self._write_with(None, None, "Once", path, facts, "value"):
            assert self.broken is not None
            raise self.broken
        return value


def _unserved(position: Position) -> list[dict[str, str]]:
    """Return the requests to stop that containers have got, and have not served."""
    old = [one for one in position.data["preempts"] if "on_visit" not in one]
    kept = [
        {"path": path, "source": source, "by": by, "why": why}
        for path, visit in position.visits.items()
        for source, by, why in visit.get("requests", ())
    ]
    # A concurrence asks its branches again once it has seen the same end again; a branch that is
    # quicker must not begin another child before.
    passing = OF_PROCESS | {"timeout", "plan"}
    return [one for one in (*old, *kept) if one["source"] not in passing]


def _choice(frame: Frame, outcome: str) -> Override | None:
    """Return what an operator chose to follow instead of a child's `outcome`, or None."""
    visit = frame.visit
    if visit is None or visit.override is None or frame.container._preempt_requested:
        return None
    holds = visit.override.holds(answered=visit.has_answered(outcome))
    return visit.override if holds else None


def _kind(frame: Frame) -> str:
    """Return the kind of the container of `frame`."""
    kind: str = frame.container._smachpy_kind  # type: ignore[attr-defined]
    return kind


def _shortened(text: str) -> str:
    """Return a text that differs if `text` does, and is short."""
    return text if len(text) <= _SHORT else digest_of(text.encode())


def _encoded(value: Any, key: str, path: str) -> Any:
    """Encode a value of userdata or `once`; one that its name calls a secret is refused in clear.

    Raises:
        NotDurableError: it cannot be kept.
    """
    if is_named_secret(key, value):
        reason = "its name says that it is a secret"
        way_out = f"smachpy.Secret(...) for {key!r}, which is not kept, another name"
        raise NotDurableError(key, "", type(value), reason, way_out, path=path)
    return encode(value, key=key, path=path)
