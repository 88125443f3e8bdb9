"""The preemption contract: cut everywhere, and look whether it holds."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import os
import signal
import socket
import sys
import threading
import time
from collections import Counter
from pathlib import Path

import pytest

import smachpy
from actionlib_core import shutdown
from actionlib_core.clock import RealClock, VirtualClock, current_clock, use_clock
from smachpy.base.context import current_frame
from smachpy.engine import frame, preempt, step
from smachpy.engine.interrupt import Interruption
from smachpy.events import (
    Abandoned,
    CallbackFailed,
    Entered,
    Failed,
    Finished,
    Left,
    Preempted,
    PreemptRequested,
)


class Work(smachpy.State):
    """Works for a while and listens; `polls` looks at the flag, otherwise it waits for it."""

    def __init__(self, seconds=1.0, outcome="ok"):
        super().__init__(outcomes=[outcome, "preempted"])
        self.seconds = seconds
        self.outcome = outcome

    def execute(self, userdata):
        if self.sleep(self.seconds):
            self.service_preempt()
            return "preempted"
        return self.outcome


class Deaf(smachpy.State):
    """Finishes whatever happens."""

    def __init__(self, seconds=0.0, outcome="ok"):
        super().__init__(outcomes=[outcome])
        self.seconds = seconds
        self.outcome = outcome
        self.runs = 0

    def execute(self, userdata):
        self.runs += 1
        if self.seconds:
            current_clock().sleep(self.seconds)
        return self.outcome


def chain(*states, outcomes=("done", "preempted"), **options):
    sm = smachpy.StateMachine(outcomes=outcomes, **options)
    with sm:
        for i, state in enumerate(states):
            target = f"S{i + 1}" if i + 1 < len(states) else "done"
            smachpy.StateMachine.add(f"S{i}", state, {state.get_registered_outcomes()[0]: target})
    return sm


def mission():
    """Everything nested in everything."""
    inner = smachpy.StateMachine(outcomes=["done", "preempted"])
    with inner:
        smachpy.StateMachine.add("A", Work(1.0), {"ok": "B"})
        smachpy.StateMachine.add("B", Deaf(0.5), {"ok": "done"})
    loop = smachpy.Iterator(["done", "preempted"], [], [], it=range(3), exhausted_outcome="done")
    with loop:
        smachpy.Iterator.set_contained_state("EACH", Work(0.5), loop_outcomes=["ok"])
    both = smachpy.Concurrence(["done", "preempted"], "done")
    with both:
        smachpy.Concurrence.add("INNER", inner)
        smachpy.Concurrence.add("LOOP", loop)
        smachpy.Concurrence.add("LEAF", Work(2.0))
    sm = smachpy.StateMachine(outcomes=["done", "preempted"])
    with sm:
        smachpy.StateMachine.add("FIRST", Work(1.0), {"ok": "BOTH"})
        smachpy.StateMachine.add("BOTH", both, {"done": "LAST"})
        smachpy.StateMachine.add("LAST", Work(1.0), {"ok": "done"})
    return sm


def every_state(container):
    for child in container.get_children().values():
        yield child
        if isinstance(child, smachpy.Container):
            yield from every_state(child)


def assert_clean(sm):
    assert not sm.preempt_requested()
    assert not sm.is_running()
    for state in every_state(sm):
        assert not state.preempt_requested(), state


@pytest.mark.parametrize("seed", [None, *range(12)])
@pytest.mark.parametrize("at", [i * 0.25 for i in range(17)])
def test_preempt_at_every_instant_ends_it_and_leaves_nothing(at, seed):
    with VirtualClock(seed) as clock, use_clock(clock):
        sm = mission()
        events = []
        sm.subscribe(events.append)
        asked = clock.spawn(lambda: (clock.sleep(at), sm.request_preempt()), name="operator")
        outcome = sm.execute()
        ended = clock.now()
        asked.join()
        if at < 4.0:
            assert outcome == "preempted"
            assert ended <= at + 0.5  # the deaf leaf ends by itself
        assert Counter(e.path for e in events if isinstance(e, Entered)) == Counter(
            e.path for e in events if isinstance(e, Left)
        )
        if not sm.preempt_requested():  # it came after the end: then it is for the next run
            assert_clean(sm)
        else:
            assert sm.execute() == "preempted"
        before = clock.now()
        assert sm.execute() == "done"
        assert clock.now() - before == 4.0
        assert_clean(sm)


LIBRARY = str(Path(smachpy.__file__).parent)


class CutAt:
    """Requests a preempt at the n-th line that the library executes in this thread."""

    def __init__(self, sm, n):
        self.sm = sm
        self.left = n
        self.done = False
        self.over = False  # the run is over: what comes now is for the next one

    def trace(self, frame, event, _arg):
        if frame.f_code.co_name == "_forget_late_request":
            self.done = self.over = True
        if self.done or not frame.f_code.co_filename.startswith(LIBRARY):
            return None
        return self.line

    def line(self, frame, event, _arg):
        if event == "line" and not self.done:
            self.left -= 1
            if self.left < 0:
                self.done = True
                sys.settrace(None)
                self.ask()
        return self.line

    def ask(self):
        # Another thread makes the request. At a line that holds a lock that one waits for this
        # thread, so its answer is waited for in vain.
        preempt.ANSWER_S = 0.02 if self.is_locked() else 60.0
        self.sm.request_preempt()

    def is_locked(self):
        meant = preempt.frame_of(self.sm)
        return preempt.FLAGS._is_owned() or (meant is not None and meant.run.lock._is_owned())

    def run(self):
        before = sys.gettrace()
        sys.settrace(self.trace)
        try:
            return self.sm.execute()
        finally:
            sys.settrace(before)


class LateCutAt(CutAt):
    """The same on a computer so busy that the request is passed on when the run is over."""

    def __init__(self, sm, n):
        super().__init__(sm, n)
        self.held = []

    def ask(self):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(preempt, "ANSWER_S", 0.0)
            patch.setattr(RealClock, "spawn", lambda _clock, target, **_: self.held.append(target))
            self.sm.request_preempt()

    def pass_on(self):
        thread = threading.Thread(target=self.held.pop())
        thread.start()
        thread.join()


def nested_and_deaf():
    inner = chain(Deaf(), outcomes=["done", "preempted"])
    loop = smachpy.Iterator(["done", "preempted"], [], [], it=range(2), exhausted_outcome="done")
    with loop:
        smachpy.Iterator.set_contained_state("EACH", Deaf())
    return chain(Deaf(), inner, loop)


@pytest.mark.skipif(
    sys.version_info < (3, 11, 4),
    reason="Debian's Python 3.11.2 itself ends with a segmentation fault while it traces threads",
)
@pytest.mark.parametrize("watched", [False, True])
def test_preempt_at_every_line_of_the_machinery(watched, monkeypatch):
    monkeypatch.setattr(preempt, "ANSWER_S", preempt.ANSWER_S)  # each cut sets it
    n = 0
    cuts = Counter()
    sm = nested_and_deaf()
    if watched:
        sm.subscribe(lambda event: None)
    while True:
        cut = CutAt(sm, n)
        outcome = cut.run()
        if cut.over:
            break
        assert cut.done  # else no function ends the run any more as this test knows it
        cuts[outcome] += 1
        assert outcome in {"done", "preempted"}
        assert_clean(sm)
        assert sm.execute() == "done"
        assert_clean(sm)
        n += 1
    assert cuts["preempted"] > 50
    assert cuts["done"] > 3


@pytest.mark.skipif(
    sys.version_info < (3, 11, 4),
    reason="Debian's Python 3.11.2 itself ends with a segmentation fault while it traces threads",
)
def test_preempt_at_every_line_of_the_machinery_that_is_passed_on_late_meets_no_other_run():
    held = []

    def work(_userdata):
        if held:
            held.pop().pass_on()
        return "done"

    sm = chain(smachpy.CBState(work, outcomes=["done"]), Deaf())
    for n in itertools.count():
        for moment in ("after", "in the next"):
            cut = LateCutAt(sm, n)
            assert cut.run() == "done"
            if cut.over:
                break
            if moment == "after":
                cut.pass_on()
                assert_clean(sm)
            else:
                held.append(cut)
            assert sm.execute() == "done"
            assert held == cut.held == []
            assert_clean(sm)
        if cut.over:
            break
    assert n > 50


@pytest.mark.parametrize(
    ("asked", "passed_on", "first", "as_root"),
    [
        ("before", "before", "preempted", True),
        ("before", "within", "preempted", True),
        ("before", "after", "done", True),
        ("before", "in the next", "done", True),
        ("before", "before", "preempted", False),
        ("before", "within", "preempted", False),
        ("before", "after", "done", False),
        ("before", "in the next", "done", False),
        ("at the end", "at the end", "done", True),
        ("at the end", "after", "done", True),
        ("at the end", "in the next", "done", True),
    ],
)
def test_request_of_the_main_thread_that_is_passed_on_late_never_meets_another_run(
    monkeypatch, asked, passed_on, first, as_root
):
    """On a busy computer, a stop that came as a run began, or ended, stopped the next one."""
    held, runs = [], []

    def ask():
        with monkeypatch.context() as patch:
            patch.setattr(preempt, "ANSWER_S", 0.0)
            patch.setattr(RealClock, "spawn", lambda _clock, target, **_: held.append(target))
            sm.request_preempt()

    def now(moment):
        if moment == asked:
            ask()
        if moment == passed_on:
            held.pop()()

    def work(_userdata):
        runs.append("run")
        now({1: "within", 2: "in the next"}.get(len(runs)))
        return "done"

    def hear(event):
        if isinstance(event, Finished) and len(runs) == 1:
            now("at the end")

    sm = chain(smachpy.CBState(work, outcomes=["done"]), Work(0.0))
    root = sm if as_root else chain(sm)
    root.subscribe(hear)
    now("before")
    found = [root.execute()]
    now("after")
    assert_clean(root)
    assert [*found, root.execute(), root.execute()] == [first, "done", "done"]
    assert held == []
    assert len(runs) == 3 - (passed_on == "before")


def test_request_of_the_main_thread_that_is_passed_on_late_meets_the_next_attempt(monkeypatch):
    held, runs = [], []

    def work(_userdata):
        runs.append("run")
        if len(runs) == 1:
            return "failed"
        held.pop()()
        return "done"

    each = smachpy.CBState(work, outcomes=["done", "failed"])
    retry = smachpy.Retry(2, on=["failed"])
    sm = chain(each, Work(60.0), outcomes=["done", "failed", "preempted"], retry=retry)
    with monkeypatch.context() as patch:
        patch.setattr(preempt, "ANSWER_S", 0.0)
        patch.setattr(RealClock, "spawn", lambda _clock, target, **_: held.append(target))
        sm.request_preempt()
    assert sm.execute() == "preempted"
    assert runs == ["run", "run"]


def test_request_of_the_main_thread_waits_on_although_one_wait_was_too_short(monkeypatch):
    """On a busy computer, all the time was over before the other thread had run at all."""
    held, waits = [], []

    class Busy:
        def set(self):
            pass

        def wait(self, seconds):
            waits.append(seconds)
            if len(waits) == 3:
                held.pop()()
            return not held

    sm = chain(Work(0.0))
    with monkeypatch.context() as patch:
        patch.setattr(RealClock, "event", lambda _clock: Busy())
        patch.setattr(RealClock, "spawn", lambda _clock, target, **_: held.append(target))
        sm.request_preempt()
    assert sm.preempt_requested()
    assert len(waits) == 3
    assert max(waits) < preempt.ANSWER_S / 10


@pytest.mark.parametrize(
    ("ask", "looks"), [(smachpy.StateMachine.request_preempt, 2), (preempt.request_soon, 1)]
)
def test_request_is_not_lost_if_the_container_goes_on_while_it_waits_for_the_lock(
    monkeypatch, ask, looks
):
    """It was for the code around the children, which had begun them meanwhile."""
    looked, left = threading.Event(), [looks]

    def frame_of(container, real=preempt.frame_of):
        found = real(container)
        left[0] -= 1
        if left[0] == 0:
            looked.set()
        return found

    class Own(smachpy.StateMachine):
        def execute(self, parent_ud=None):
            lock.append(preempt.frame_of(self).run.lock)
            lock[0].acquire()
            monkeypatch.setattr(preempt, "frame_of", frame_of)
            asker.start()
            assert looked.wait(60.0)
            return super().execute(parent_ud)

    def work(_userdata):
        lock[0].release()
        asker.join(60.0)
        return "ok"

    lock = []
    inner = Own(["ok", "preempted"])
    inner.add("A", smachpy.CBState(work, outcomes=["ok"]), {"ok": "B"})
    inner.add("B", Work(0.0))
    asker = threading.Thread(target=ask, args=[inner])
    sm = smachpy.StateMachine(["ok", "preempted"])
    sm.add("IN", inner)
    assert sm.execute() == "preempted"
    assert not asker.is_alive()


def test_preempts_from_another_thread_at_any_moment_never_stick():
    """Real threads, switched as often as Python can."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        sm = nested_and_deaf()
        go, asked = threading.Semaphore(0), threading.Semaphore(0)

        over = False

        def ask():
            for n in itertools.count():
                go.acquire()
                if over:
                    return
                for _ in range(n % 40):
                    pass
                sm.request_preempt()
                asked.release()

        thread = threading.Thread(target=ask)
        thread.start()
        outcomes = Counter()
        # On a busy computer most requests come too late: go on until one was in time.
        while outcomes.total() < 150 or not outcomes["preempted"]:
            go.release()
            outcome = sm.execute()
            asked.acquire()
            if sm.preempt_requested():  # it came when the run was over: it is for the next one
                outcomes["late"] += 1
                assert sm.execute() == "preempted"
            outcomes[outcome] += 1
            assert_clean(sm)
            assert sm.execute() == "done"
        over = True
        go.release()
        thread.join()
    finally:
        sys.setswitchinterval(interval)


def test_preempt_before_execute_runs_no_child_and_holds_for_one_run():
    leaf = Deaf()
    sm = chain(leaf)
    sm.request_preempt()
    sm.request_preempt()
    assert sm.execute() == "preempted"
    assert leaf.runs == 0
    assert sm.execute() == "done"


@pytest.mark.parametrize("make", ["machine", "concurrence", "iterator", "sequence"])
def test_preempt_before_execute_of_every_container(make, clock):
    leaf = Deaf()
    outcomes = ["ok", "preempted"]
    if make == "machine":
        container = smachpy.StateMachine(outcomes)
        container.add("A", leaf)
    elif make == "sequence":
        container = smachpy.Sequence(outcomes, "ok")
        container.add("A", leaf)
    elif make == "concurrence":
        container = smachpy.Concurrence(outcomes, "ok")
        container.add("A", leaf)
    else:
        container = smachpy.Iterator(outcomes, [], [], it=[1], exhausted_outcome="ok")
        container.set_contained_state("A", leaf)
    container.request_preempt()
    assert container.execute() == "preempted"
    assert leaf.runs == 0
    assert container.execute() == "ok"
    assert leaf.runs == 1


def test_finished_work_keeps_its_outcome_and_userdata(clock):
    class Measure(smachpy.State):
        def __init__(self):
            super().__init__(["measured"], output_keys=["value"])

        def execute(self, userdata):
            current_clock().sleep(1.0)
            userdata.value = 42
            return "measured"

    sm = smachpy.StateMachine(["measured", "preempted"])
    sm.add("M", Measure())
    clock.call_later(0.5, sm.request_preempt)
    assert sm.execute() == "measured"
    assert sm.userdata.value == 42
    assert_clean(sm)


def test_finished_work_that_leads_on_ends_preempted_and_starts_nothing(clock):
    last = Deaf()
    sm = chain(Deaf(1.0), last)
    events = []
    sm.subscribe(events.append)
    clock.call_later(0.5, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert last.runs == 0
    assert [e.label for e in events if isinstance(e, Preempted)] == ["S0"]


def test_served_preempt_follows_the_users_transition(clock):
    stop = Deaf(outcome="stopped")
    sm = smachpy.StateMachine(["preempted"])
    with sm:
        smachpy.StateMachine.add("DRIVE", Work(10.0), {"ok": "DRIVE", "preempted": "STOP"})
        smachpy.StateMachine.add("STOP", stop, {"stopped": "preempted"})
    clock.call_later(1.0, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert stop.runs == 1
    assert clock.now() == 1.0


def test_second_preempt_reaches_the_state_that_cleans_up(clock):
    sm = smachpy.StateMachine(["preempted"])
    with sm:
        smachpy.StateMachine.add("DRIVE", Work(10.0), {"ok": "DRIVE", "preempted": "STOP"})
        smachpy.StateMachine.add("STOP", Work(100.0), {"ok": "preempted"})
    clock.call_later(1.0, sm.request_preempt)
    clock.call_later(3.0, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert clock.now() == 3.0


def test_every_descendant_is_told_before_request_returns(clock):
    sm = mission()
    seen = {}

    def ask():
        sm.request_preempt()
        seen.update({type(s).__name__ + str(i): s for i, s in enumerate(every_state(sm))})
        both = sm["BOTH"]
        assert both.preempt_requested()
        assert both["INNER"].preempt_requested()
        assert both["INNER"]["A"].preempt_requested()
        assert both["LOOP"]["EACH"].preempt_requested()
        assert both["LEAF"].preempt_requested()
        seen["asserted"] = True

    clock.call_later(1.25, ask)
    assert sm.execute() == "preempted"
    assert seen["asserted"]


@pytest.mark.parametrize("where", ["start", "transition", "termination", "listener", "state"])
def test_preempt_from_a_callback(where):
    last = Deaf()
    sm = chain(Deaf(), last)

    def ask(*_args):
        sm.request_preempt()

    if where == "start":
        sm.register_start_cb(ask)
    elif where == "transition":
        sm.register_transition_cb(ask)
    elif where == "termination":
        sm.register_termination_cb(ask)
    elif where == "listener":
        sm.subscribe(lambda e: ask() if isinstance(e, Left) else None)
    else:
        sm["S0"].execute = lambda ud: ask() or "ok"
    expected = "done" if where == "termination" else "preempted"
    assert sm.execute() == expected
    assert last.runs == (1 if where == "termination" else 0)
    assert_clean(sm)


def test_preempt_from_a_signal_handler():
    sm = chain(Work(30.0))
    before = signal.signal(signal.SIGUSR1, lambda *a: sm.request_preempt())
    try:
        sm.register_start_cb(
            lambda *a: current_clock().call_later(
                0.02, lambda: os.kill(os.getpid(), signal.SIGUSR1)
            )
        )
        assert sm.execute() == "preempted"
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert_clean(sm)


def test_leaf_that_raises_while_preempted_raises(clock):
    class Breaks(smachpy.State):
        def __init__(self):
            super().__init__(["ok"])

        def execute(self, userdata):
            self.wait_preempt(5.0)
            raise ValueError("motor")

    sm = chain(Breaks())
    clock.call_later(1.0, sm.request_preempt)
    with pytest.raises(smachpy.InvalidUserCodeError, match="motor"):
        sm.execute()
    assert_clean(sm)


def test_preempting_a_leaf_directly_does_not_stick(clock):
    sm = chain(Deaf(1.0), Work(1.0))
    clock.call_later(0.5, sm["S0"].request_preempt)
    assert sm.execute() == "done"
    assert_clean(sm)


def test_a_machine_that_a_state_runs_by_hand_is_told_too(clock):
    class ByHand(smachpy.State):
        def __init__(self):
            super().__init__(["done", "preempted"])
            self.inner = chain(Work(100.0))

        def execute(self, userdata):
            return self.inner.execute()

    sm = chain(ByHand())
    clock.call_later(1.0, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert clock.now() == 1.0
    assert_clean(sm)
    assert_clean(sm["S0"].inner)


def test_recalled_preempt_is_none(clock):
    sm = chain(Work(1.0))
    sm.request_preempt()
    sm.recall_preempt()
    assert sm.execute() == "done"


def test_unregistered_preempted_of_a_nested_machine_is_no_error(clock):
    inner = smachpy.StateMachine(["done"])
    inner.add("A", Deaf(1.0), {"ok": "B"})
    inner.add("B", Deaf(1.0), {"ok": "done"})
    sm = smachpy.StateMachine(["done"])
    sm.add("INNER", inner)
    clock.call_later(0.5, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert sm.execute() == "done"


# -- leaves that do not listen ---------------------------------------------------------------


def ignore_until(seconds):
    return lambda: current_clock().sleep(seconds)


def swallow_exceptions():
    while True:
        try:  # noqa: SIM105  as users write it
            current_clock().sleep(1.0)
        except Exception:
            pass


class Ignores(smachpy.State):
    def __init__(self, body, **options):
        super().__init__(["ok", "preempted"], **options)
        self.body = body

    def execute(self, userdata):
        self.body()
        return "ok"


@pytest.fixture
def quiet():
    logging.disable(logging.CRITICAL)
    yield
    logging.disable(logging.NOTSET)


@pytest.mark.parametrize("seed", [None, *range(5)])
@pytest.mark.parametrize("body", [ignore_until(3600.0), swallow_exceptions])
@pytest.mark.parametrize("depth", [1, 4])
def test_leaf_that_ignores_is_interrupted_after_its_grace(seed, body, depth, quiet):
    with VirtualClock(seed) as clock, use_clock(clock):
        sm = chain(Ignores(body), preempt_timeout=3.0)
        for _ in range(depth - 1):
            sm = chain(sm)
        events = []
        sm.subscribe(events.append)
        clock.call_later(1.0, sm.request_preempt)
        assert sm.execute() == "preempted"
        assert clock.now() == 4.0
        (report,) = [e for e in events if isinstance(e, Abandoned)]
        assert report.path == "/SM_ROOT" + "/S0" * depth
        assert report.grace == 3.0
        assert "in execute" in report.stack.splitlines()[0]  # the state's code, not what called it
        assert_clean(sm)


@pytest.mark.parametrize("seed", [None, *range(5)])
def test_ignoring_branch_does_not_hold_the_others(seed, quiet):
    with VirtualClock(seed) as clock, use_clock(clock):
        both = smachpy.Concurrence(["done", "preempted"], "done", preempt_timeout=2.0)
        both.add("DEAF", Ignores(ignore_until(3600.0)))
        both.add("DEEP", chain(Ignores(ignore_until(3600.0))))
        both.add("GOOD", Work(3600.0))
        clock.call_later(1.0, both.request_preempt)
        assert both.execute() == "preempted"
        assert clock.now() == 3.0
        assert_clean(both)


@pytest.mark.parametrize("seed", [None, *range(8)])
def test_no_grace_at_all(seed, quiet):
    with VirtualClock(seed) as clock, use_clock(clock):
        sm = mission()
        smachpy.set_options(sm, preempt_timeout=0.0)
        for at in (0.0, 0.5, 1.0, 1.25, 2.5, 3.0):
            clock.spawn(lambda at=at: (clock.sleep(at), sm.request_preempt()), name="operator")
            begun = clock.now()
            outcome = sm.execute()
            assert outcome in {"preempted", "done"}
            assert clock.now() - begun <= at
            clock.sleep(5.0)
            if sm.preempt_requested():
                assert sm.execute() == "preempted"
            assert_clean(sm)


@pytest.mark.parametrize("container", ["machine", "iterator", "concurrence"])
def test_leaf_that_ends_just_when_its_grace_does(container, quiet):
    def just_in_time():
        threading.Event().wait(0.02)

    for _ in range(15):
        leaf = Ignores(just_in_time)
        outcomes = ["ok", "done", "preempted"]
        if container == "machine":
            sm = smachpy.StateMachine(outcomes, preempt_timeout=0.019)
            sm.add("A", leaf)
        elif container == "iterator":
            sm = smachpy.Iterator(outcomes, [], [], it=[1, 2], preempt_timeout=0.019)
            sm.set_contained_state("A", leaf, loop_outcomes=["ok"])
        else:
            sm = smachpy.Concurrence(outcomes, "done", preempt_timeout=0.019)
            sm.add("A", leaf)
        sm.register_start_cb(lambda *a, sm=sm: current_clock().call_later(0.0, sm.request_preempt))
        # On a busy computer the request may come after all is done.
        assert sm.execute() in {"ok", "done", "exhausted", "preempted"}
        assert_clean(sm)


def test_grace_is_the_states_own_then_the_containers_then_ten_seconds(clock, quiet):
    def measure(leaf=None, inner=None, outer=None):
        state = Ignores(ignore_until(3600.0), **(leaf or {}))
        sm = chain(chain(state, **(inner or {})), **(outer or {}))
        before = clock.now()
        clock.call_later(1.0, sm.request_preempt)
        sm.execute()
        return clock.now() - before - 1.0

    assert measure() == 10.0
    assert measure(outer={"preempt_timeout": 7.0}) == 7.0
    assert measure(outer={"preempt_timeout": 7.0}, inner={"preempt_timeout": 5.0}) == 5.0
    assert measure(leaf={"preempt_timeout": 2.0}, inner={"preempt_timeout": 5.0}) == 2.0
    assert measure(leaf={"preempt_timeout": None}) == 3599.0


def spin():
    while True:
        pass


def lock():
    blocked = threading.Lock()
    blocked.acquire()
    blocked.acquire()


def receive():
    a, b = socket.socketpair()
    with a, b:
        a.recv(1)


def swallow():
    while True:
        try:  # noqa: SIM105  as users write it
            threading.Event().wait(0.001)
        except Exception:
            pass


def swallow_twice():
    left = 2
    while left:
        try:
            threading.Event().wait(10)
        except BaseException:
            left -= 1
    threading.Event().wait(10)


@pytest.mark.parametrize("body", [spin, lock, receive, swallow, swallow_twice])
@pytest.mark.parametrize("depth", [1, 3])
def test_blocked_leaf_in_the_main_thread_is_broken(body, depth, quiet):
    sm = chain(Ignores(body), preempt_timeout=0.02)
    for _ in range(depth - 1):
        sm = chain(sm)
    sm.register_start_cb(lambda *a: current_clock().call_later(0.01, sm.request_preempt))
    assert sm.execute() == "preempted"
    assert_clean(sm)


ON_THE_WAY_UP = {
    "child": (step.Step, "outcome_if_interrupted"),
    "container": (frame.Frame, "end_preempted"),
    "leaves": (preempt, "forget_visit"),
    "ends": (preempt.Visit, "end"),
}


@pytest.mark.parametrize("depth", [1, 3])
@pytest.mark.parametrize(
    "further", ["child", "leaves", "child leaves", "child ends", "child container leaves ends"]
)
def test_interruptions_in_a_row_end_with_the_run(depth, further, monkeypatch):
    """A busy computer let the thread not go on between two of them: the visit never ended."""
    visits, left = [], further.split()

    def interrupting(place, real):
        def function(*arguments):
            if place in left and visits and visits[0]._is_on():
                left.remove(place)
                raise Interruption
            return real(*arguments)

        return function

    def leave():
        visits.append(current_frame().visit)
        sm.request_preempt()
        raise Interruption

    sm = chain(Ignores(leave, preempt_timeout=None))
    for _ in range(depth - 1):
        sm = chain(sm)
    for place, (owner, name) in ON_THE_WAY_UP.items():
        monkeypatch.setattr(owner, name, interrupting(place, getattr(owner, name)))
    assert sm.execute() == "preempted"
    assert not visits[0]._is_on()
    assert_clean(sm)


@pytest.mark.parametrize("during", [CallbackFailed, (Left, Failed)])
@pytest.mark.parametrize("how", ["preempted", "ok", "ValueError: gripper"])
def test_an_interruption_in_a_listener_hides_no_end_from_the_others(how, during):
    """On a busy computer it comes while the child's end, or what is before it, is being told."""
    before, after, interrupted = [], [], []

    def end():
        sm.request_preempt()
        current_frame().note("/SM_ROOT", CallbackFailed, "is published before the end", "")
        if how == "preempted":
            raise Interruption
        if how != "ok":
            raise ValueError("gripper")

    def interrupt(event):
        if isinstance(event, during) and not interrupted:
            interrupted.append(event)
            raise Interruption

    sm = chain(Ignores(end, preempt_timeout=None))
    for listener in (before.append, interrupt, after.append):
        sm.subscribe(listener)
    if how.startswith("ValueError"):
        with pytest.raises(smachpy.InvalidUserCodeError, match="gripper"):
            sm.execute()
    else:
        sm.execute()
    assert interrupted
    for heard in (before, after):
        ends = [event for event in heard if isinstance(event, (Left, Failed))]
        assert [event[3] for event in ends] == [how]
    assert_clean(sm)


@pytest.mark.slow
@pytest.mark.parametrize("place", ["branch", "branch machine", "root"])
def test_thread_blocked_in_c_is_left_behind_and_cannot_come_back(place, quiet):
    release = threading.Lock()
    release.acquire()
    late = []
    started = threading.Event()

    class Blocks(smachpy.State):
        def __init__(self):
            super().__init__(["ok"], output_keys=["x"])

        def execute(self, userdata):
            if not late:
                late.append("started")
                started.set()
                try:
                    release.acquire()
                    late.append("went on")
                finally:
                    late.append("ended")
                    userdata.x = "late"
            return "ok"

    after = Deaf()
    machine = chain(Blocks(), after, preempt_timeout=0.02)
    outcomes = []
    if place == "root":
        top = machine
    else:
        top = smachpy.Concurrence(["done", "preempted"], "done", preempt_timeout=0.02)
        top.add("M", machine if place == "branch machine" else Blocks())
    current_clock().spawn(lambda: (started.wait(60.0), top.request_preempt()), name="asks")
    if place == "root":
        runner = threading.Thread(target=lambda: outcomes.append(top.execute()))
        runner.start()
        runner.join(60)
    else:
        outcomes.append(top.execute())
    assert outcomes == ["preempted"]
    assert late == ["started"]
    assert_clean(top)
    assert after.runs == 0
    # The same machine runs again while the old thread still hangs.
    again = threading.Thread(target=lambda: outcomes.append(top.execute()))
    again.start()
    again.join(60)
    assert outcomes[1] in {"done", "preempted"}
    runs = after.runs
    release.release()
    deadline = time.monotonic() + 60
    while any(thread.name.startswith("/SM_ROOT") for thread in threading.enumerate()):
        assert time.monotonic() < deadline
        time.sleep(0.01)  # an idle thread has another name, and lives for seconds
    assert late == ["started", "ended"]
    assert after.runs == runs
    assert "x" not in machine.userdata or machine.userdata.x != "late" or place == "root"


@pytest.mark.parametrize("place", ["branch", "branch machine"])
def test_what_was_left_behind_counts_as_asked_for_ever(clock, place, quiet):
    heard = []

    def goes_on():
        until = clock.now() + 30.0
        while clock.now() < until:
            with contextlib.suppress(BaseException):
                clock.sleep(1.0)
        heard.append((leaf.preempt_requested(), leaf.sleep(5.0), leaf.wait_preempt()))

    leaf = Ignores(goes_on)
    both = smachpy.Concurrence(["done", "preempted"], "done")
    both.add("M", chain(leaf) if place == "branch machine" else leaf)
    clock.call_later(1.0, both.request_preempt)
    assert both.execute() == "preempted"
    assert not leaf.preempt_requested()  # a later run begins without a request
    clock.sleep(60.0)
    assert heard == [(True, True, True)]


# -- other ways to listen ----------------------------------------------------------------------


def test_async_leaf_is_cancelled(clock):
    cleaned = []

    class Drives(smachpy.State):
        def __init__(self):
            super().__init__(["ok", "preempted"])

        async def execute(self, userdata):
            try:
                await asyncio.sleep(100)
            finally:
                cleaned.append(clock.now())
            return "ok"

    sm = chain(Drives())
    clock.call_later(2.0, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert cleaned == [2.0]
    assert_clean(sm)


def test_async_leaf_in_a_thread_with_a_loop_is_refused_with_the_way_out(recwarn):
    """It was "FunctionState raised RuntimeError", with warnings of coroutines never awaited."""

    @smachpy.state(outcomes=["ok"])
    async def drives(userdata):
        await asyncio.sleep(0)
        return "ok"

    sm = chain(drives)

    async def program():
        with pytest.raises(smachpy.InvalidStateError, match=r"Try `outcome = await asyncio.to_th"):
            sm.execute()
        return await asyncio.to_thread(sm.execute)

    with use_clock(RealClock()):
        assert asyncio.run(program()) == "done"
    assert not recwarn
    assert_clean(sm)


@pytest.mark.parametrize("real", [False, True])
def test_async_leaf_that_ignores_its_cancellation_is_interrupted(real, quiet):
    class Deaf(smachpy.State):
        async def execute(self, userdata):
            while True:
                try:  # noqa: SIM105  as users write it
                    await asyncio.sleep(0.01)
                except asyncio.CancelledError:
                    pass

    sm = chain(Deaf(["ok"]), preempt_timeout=0.05)
    with contextlib.ExitStack() as stack:
        if not real:
            clock = stack.enter_context(VirtualClock())
            stack.enter_context(use_clock(clock))
        current_clock().call_later(0.02, sm.request_preempt)
        assert sm.execute() == "preempted"
    assert_clean(sm)


def test_wait_preempt_and_sleep(clock):
    state = Work()
    assert state.wait_preempt(1.0) is False
    assert state.sleep(0.5) is False
    assert clock.now() == 1.5
    clock.call_later(0.25, state.request_preempt)
    assert state.wait_preempt() is True
    assert clock.now() == 1.75
    assert state.sleep(10.0) is True
    assert clock.now() == 1.75


# -- Ctrl-C ------------------------------------------------------------------------------------


@pytest.fixture
def own_shutdown():
    with shutdown.use_shutdown(shutdown.Shutdown()) as mine:
        yield mine


def send(number):
    current_clock().call_later(0.01, lambda: os.kill(os.getpid(), number))


def test_ctrl_c_preempts_and_requests_the_shutdown(own_shutdown):
    sm = chain(Work(30.0))
    sm.register_start_cb(lambda *a: send(signal.SIGINT))
    assert sm.execute() == "preempted"
    assert own_shutdown.requested()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert_clean(sm)
    assert chain(Deaf()).execute() == "preempted"  # the program is ending
    own_shutdown.clear()
    assert chain(Deaf()).execute() == "done"


@pytest.mark.parametrize("number", shutdown.SIGNALS)
def test_every_signal_that_ends_programs_preempts(own_shutdown, number):
    before = signal.getsignal(number)
    sm = chain(Work(30.0))
    sm.register_start_cb(lambda *a: send(number))
    assert sm.execute() == "preempted"
    assert own_shutdown.reason == number.name
    assert signal.getsignal(number) is before


def test_ctrl_c_in_an_interactive_session_stops_one_machine_only(own_shutdown, monkeypatch):
    """After one interrupt in a notebook every later machine ended 'preempted' at once."""
    monkeypatch.setattr(sys, "ps1", "In : ", raising=False)
    heard = []
    sm = chain(Work(30.0))
    sm.subscribe(heard.append)
    sm.register_start_cb(lambda *a: send(signal.SIGINT))
    assert sm.execute() == "preempted"
    assert not own_shutdown.requested()
    asked = [e.asker for e in heard if isinstance(e, PreemptRequested)]
    assert set(asked) == {"signal SIGINT"}
    assert chain(Deaf()).execute() == "done"


def test_a_machine_that_starts_during_the_shutdown_says_why_it_ends(own_shutdown, caplog):
    own_shutdown.request("SIGTERM")
    assert chain(Deaf()).execute() == "preempted"
    assert "ends at once: the program is to end (SIGTERM)" in caplog.text


def test_a_busy_machine_in_virtual_time_is_stopped_by_a_signal(own_shutdown, clock):
    """It never waits, so that no other thread of its clock got a turn."""
    real = RealClock()
    again = smachpy.CBState(lambda ud: "again", outcomes=["again"])
    sm = smachpy.StateMachine(["preempted"])
    sm.add("LOOP", again, {"again": "LOOP"})
    sm.register_start_cb(
        lambda *a: real.call_later(0.01, lambda: os.kill(os.getpid(), signal.SIGTERM))
    )
    assert sm.execute() == "preempted"
    assert own_shutdown.reason == "SIGTERM"


def test_a_busy_state_in_virtual_time_has_its_grace_in_real_time(own_shutdown, clock):
    """It lets no virtual time pass in which its grace could end."""
    real = RealClock()

    def compute(userdata):
        real.call_later(0.01, lambda: os.kill(os.getpid(), signal.SIGTERM))
        while True:
            pass

    busy = smachpy.CBState(compute, outcomes=["done"])
    sm = smachpy.StateMachine(["done", "preempted"], preempt_timeout=0.1)
    sm.add("BUSY", busy)
    assert sm.execute() == "preempted"


def test_second_ctrl_c_is_a_keyboard_interrupt(own_shutdown):
    class Stubborn(smachpy.State):
        def __init__(self):
            super().__init__(["ok"])

        def execute(self, userdata):
            self.wait_preempt()
            send(signal.SIGINT)
            threading.Event().wait(10)
            return "ok"

    sm = chain(Stubborn())
    sm.register_start_cb(lambda *a: send(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        sm.execute()
    assert not sm.is_running()
    assert sm["S0"].preempt_requested() is False


@pytest.mark.parametrize("kind", [KeyboardInterrupt, SystemExit])
def test_exits_are_never_wrapped(kind):
    def leave(ud):
        raise kind

    inner = smachpy.StateMachine(["ok"])
    inner.add("A", smachpy.CBState(leave, outcomes=["ok"]))
    sm = smachpy.StateMachine(["ok"])
    sm.add("INNER", inner)
    with pytest.raises(kind):
        sm.execute()


def test_exits_in_a_branch_are_never_wrapped():
    def leave(ud):
        raise SystemExit(3)

    both = smachpy.Concurrence(["ok"], "ok")
    both.add("A", smachpy.CBState(leave, outcomes=["ok"]))
    both.add("B", Work(30.0))
    with pytest.raises(SystemExit):
        both.execute()


def test_shutdown_requested_by_the_program_preempts(own_shutdown, clock):
    sm = chain(Work(30.0))
    clock.call_later(1.0, own_shutdown.request)
    assert sm.execute() == "preempted"
    assert clock.now() == 1.0


def test_set_shutdown_check_is_obeyed():
    from smachpy.engine import shutdown_check

    answers = iter([False, True, True])
    try:
        smachpy.set_shutdown_check(lambda: next(answers, True))
        last = Deaf()
        assert chain(Deaf(), last).execute() == "preempted"
        assert last.runs == 0
        assert smachpy.is_shutdown()
    finally:
        shutdown_check.reset_shutdown_check()


def test_requests_are_events(clock):
    sm = chain(chain(Work(5.0)))
    events = []
    sm.subscribe(events.append)
    clock.call_later(1.0, sm.request_preempt)
    sm.execute()
    paths = [e.path for e in events if isinstance(e, PreemptRequested)]
    assert paths == ["/SM_ROOT", "/SM_ROOT/S0", "/SM_ROOT/S0/S0"]


class Stone(smachpy.State):
    """Cannot be broken into, in virtual time either; ends some day."""

    def __init__(self):
        super().__init__(["ok"], output_keys=["k"], preempt_timeout=1.0)

    def execute(self, userdata):
        clock = self.clock()
        end = clock.now() + 500.0
        while clock.now() < end:
            with contextlib.suppress(BaseException):
                clock.sleep(end - clock.now())
        return "ok"


@pytest.mark.parametrize("how", ["listener", "buffer"])
@pytest.mark.parametrize("where", ["concurrence", "task"])
def test_what_is_left_behind_has_left_in_the_events_and_says_nothing_more(clock, where, how):
    inner = chain(Stone())
    if where == "concurrence":
        both = smachpy.Concurrence(["done", "preempted"], "done")
        both.add("IN", inner)
        inner = both
    sm = chain(inner, name="P")
    heard = []
    buffer = sm.event_buffer()
    if how == "listener":
        sm.subscribe(lambda event: heard.append(type(event).__name__))
    clock.call_later(1.0, sm.request_preempt)
    if where == "task":
        task = clock.spawn(sm.execute, name="mission")
        task.join()
    else:
        sm.execute()
    told = buffer.read()
    assert clock.now() < 10.0
    entered = [record["path"] for record in told if record["kind"] == "Entered"]
    left = [record["path"] for record in told if record["kind"] == "Left"]
    assert sorted(left) == sorted(entered)
    assert (told[-1]["kind"], told[-1]["outcome"]) == ("Finished", "preempted")
    deepest = max(entered, key=len)
    assert deepest not in [r["path"] for r in told if r["kind"] == "PreemptServiced"]
    count = len(heard)
    clock.sleep(1000.0)
    assert buffer.read() == []
    assert len(heard) == count
