"""Requests to stop, and kills at every write around them: none is lost, none comes back."""

from __future__ import annotations

import contextlib
import json
import threading

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, current_clock, use_clock
from smachpy import Concurrence, Iterator, State, StateMachine
from smachpy.engine.preempt import asking, request_soon
from smachpy.engine.visit import Origin
from tests.smachpy.durable.killing_store import Kill, KillingStore

ENDS = ["done", "cleaned", "preempted"]
REQUEST_S = 5.0


class Work(State):
    """Works for ten seconds, or until it is asked to stop; what it returned is in `ends`."""

    def __init__(self, ends, name, outcomes=("done", "preempted"), seconds=10.0):
        super().__init__(outcomes)
        self.ends, self.name, self.seconds = ends, name, seconds

    def execute(self, userdata):
        stopped = self.sleep(self.seconds)
        outcome = self.end(stopped=stopped)
        self.ends.append(f"{self.name} {outcome}")
        return outcome

    def end(self, *, stopped):
        return "preempted" if stopped else "done"


class Finishes(Work):
    """Has finished its work when it is asked to stop."""

    def end(self, *, stopped):
        return "done"


def cleans_up(ends, kind=Work, **options):
    """DRIVE, after which comes a tidy-up if it was stopped, and more work after that."""
    sm = StateMachine(ENDS, name="M", **options)
    sm.add("DRIVE", kind(ends, "DRIVE"), {"preempted": "HOME"})
    sm.add("HOME", Work(ends, "HOME"), {"done": "LOOK"})
    sm.add("LOOK", Work(ends, "LOOK"), {"done": "cleaned"})
    return sm


def within(inner):
    sm = StateMachine(ENDS, name="R")
    sm.add("M", inner)
    return sm


def beside(inner):
    both = Concurrence(ENDS, "preempted", outcome_map={o: {"M": o} for o in ENDS})
    both.add("M", inner)
    sm = StateMachine(ENDS, name="R")
    sm.add("BOTH", both)
    return sm


def for_each(inner):
    each = Iterator(ENDS, [], [], it=[1], exhausted_outcome="done")
    each.set_contained_state("M", inner, ["done"], ["cleaned", "preempted"])
    sm = StateMachine(ENDS, name="R")
    sm.add("EACH", each)
    return sm


SHAPES = {
    "root": (cleans_up, "/M"),
    "nested": (lambda *a, **o: within(cleans_up(*a, **o)), "/R/M"),
    "branch": (lambda *a, **o: beside(cleans_up(*a, **o)), "/R/BOTH/M"),
    "item": (lambda *a, **o: for_each(cleans_up(*a, **o)), "/R/EACH/M"),
}


def of_the_run(sm, _path):
    sm.request_preempt(by="the door sensor")


def of_a_container(sm, path):
    sm.control.preempt(path)


def of_a_leaf(sm, path):
    sm.control.preempt(f"{path}/DRIVE")


def forced(sm, path):
    sm.control.force_outcome(f"{path}/DRIVE", "done")


def jumped(sm, path):
    sm.control.jump(f"{path}/LOOK")


def paused(sm, _path):
    sm.control.pause(running="cancel")
    sm._smachpy.live.frame.run.clock.call_later(3.0, sm.control.resume)


REQUESTS = [of_the_run, of_a_container, of_a_leaf, forced, jumped, paused]


def live(make, path, ask, ends, store):
    """Run, or go on, in a process of its own; None: it was killed."""
    sm = make(ends)
    written = any(b'"PreemptRequested"' in entry for entry in store.entries.get("m", ()))

    def request():
        with contextlib.suppress(Kill, smachpy.SmachError):  # it ends, or DRIVE has ended
            ask(sm, path)

    with VirtualClock() as clock, use_clock(clock):
        if ask is not None and not written:
            clock.call_later(REQUEST_S, request)
        try:
            return smachpy.run_durable(sm, store, mission="m")
        except Kill:
            return None


def lives(make, path, ask=None):
    """Yield, for a kill at each write, where it was, and what it ended with after the resume."""
    calm, store = [], KillingStore()
    expected = live(make, path, ask, calm, store)
    yield "never", expected, calm
    for kill_at in range(1, store.writes):
        for written in (False, True):
            ends, killed = [], KillingStore()
            killed.arm(kill_at, written=written)
            if live(make, path, ask, ends, killed) is None and killed.rows["m"].status != "ended":
                killed.arm(0, written=False)
                yield (kill_at, written), live(make, path, ask, ends, killed), ends


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("ask", REQUESTS)
def test_a_request_comes_once_however_often_the_process_is_killed(shape, ask):
    """HOME was stopped as well, by the request that DRIVE had serviced long before."""
    make, path = SHAPES[shape]
    found = list(lives(make, path, ask))
    _, expected, calm = found[0]
    assert "HOME preempted" not in calm
    for place, outcome, ends in found[1:]:
        assert outcome == expected, (place, ends)
        assert ends[-1] == calm[-1], (place, ends)


# A timer's thread writes to the journal, and is killed there, as all others.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("shape", SHAPES)
def test_a_timeout_comes_once_however_often_the_process_is_killed(shape):
    make, path = SHAPES[shape]
    found = list(lives(lambda ends: make(ends, timeout=5.0, timeout_outcome="preempted"), path))
    _, expected, calm = found[0]
    for place, outcome, ends in found[1:]:
        assert outcome == expected, (place, ends)
        assert not [end for end in ends if end in {"HOME preempted", "LOOK preempted"}], place
        assert ends[-1] == calm[-1], (place, ends)


@pytest.mark.parametrize("shape", SHAPES)
def test_work_that_a_pause_did_not_stop_is_not_done_again_after_a_kill(shape):
    make, path = SHAPES[shape]
    for place, outcome, ends in lives(lambda ends: make(ends, Finishes), path, paused):
        assert outcome == "done", (place, ends)


def stopped_by_a_sibling(ends):
    both = Concurrence(
        ENDS,
        "preempted",
        outcome_map={o: {"M": o} for o in ENDS},
        child_termination_cb=lambda _: True,
    )
    both.add("M", cleans_up(ends))
    both.add("WATCH", Work([], "WATCH", seconds=REQUEST_S))
    sm = StateMachine(ENDS, name="R")
    sm.add("BOTH", both)
    return sm


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_sibling_stops_a_child_once_however_often_the_process_is_killed():
    """The resumed run called the callback for the ended sibling again, which stopped HOME."""
    found = list(lives(stopped_by_a_sibling, ""))
    _, expected, calm = found[0]
    assert expected == "cleaned"
    for place, outcome, ends in found[1:]:
        assert outcome == expected, (place, ends)
        assert not [end for end in ends if end in {"HOME preempted", "LOOK preempted"}], place
        assert ends[-1] == calm[-1], (place, ends)


class Deaf(Work):
    """Does not hear that it is asked to stop, and finishes its work just after that."""

    def execute(self, userdata):
        current_clock().sleep(REQUEST_S + 1.0)
        self.ends.append(f"{self.name} done")
        return "done"


class Serves(Work):
    """Services the request, and has finished its work: its container goes on."""

    def end(self, *, stopped):
        if stopped:
            self.service_preempt()
        return "done"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize(("kind", "outcome"), [(Deaf, "preempted"), (Serves, "cleaned")])
def test_a_sibling_s_end_reaches_a_branch_that_is_quicker_after_a_kill(kind, outcome):
    """The branch had ended, and begun its next child, before the sibling's end was seen again."""

    def machine(ends):
        branch = StateMachine(ENDS, name="M")
        branch.add("DRIVE", kind(ends, "DRIVE"), {"done": "LOOK"})
        branch.add("LOOK", Work(ends, "LOOK"), {"done": "cleaned"})
        both = Concurrence(
            ENDS,
            "preempted",
            outcome_map={o: {"M": o} for o in ENDS},
            child_termination_cb=lambda _: True,
        )
        both.add("M", branch)
        both.add("WATCH", Work([], "WATCH", seconds=REQUEST_S))
        sm = StateMachine(ENDS, name="R")
        sm.add("BOTH", both)
        return sm

    for place, ended, ends in lives(machine, ""):
        assert ended == outcome, (place, ends)
        assert ("LOOK done" in ends) is (outcome == "cleaned"), (place, ends)


class SlowToStop(Work):
    """Takes two more seconds when it is asked to stop."""

    def end(self, *, stopped):
        if stopped:
            current_clock().sleep(2.0)
        return super().end(stopped=stopped)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("shape", SHAPES)
def test_a_pause_does_not_void_an_operators_jump_after_a_kill_either(shape):
    make, path = SHAPES[shape]

    def jumped_then_paused(sm, path):
        clock = sm._smachpy.live.frame.run.clock
        sm.control.jump(f"{path}/LOOK")
        clock.call_later(1.0, lambda: sm.control.pause(running="cancel"))
        clock.call_later(6.0, sm.control.resume)

    def build(ends):
        return make(ends, SlowToStop)

    for place, outcome, ends in lives(build, path, jumped_then_paused):
        assert outcome == "cleaned", (place, ends)
        assert ends[-1] == "LOOK done", (place, ends)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_pause_begins_nothing_again_that_a_sibling_has_stopped_after_a_kill_either():
    def build(ends):
        both = Concurrence(ENDS, "done", child_termination_cb=lambda _: True)
        both.add("DRIVE", SlowToStop(ends, "DRIVE", seconds=60.0))
        both.add("WATCH", Work([], "WATCH", seconds=REQUEST_S))
        sm = StateMachine(ENDS, name="R")
        sm.add("BOTH", both)
        sm.register_start_cb(lambda *_: pause(sm))
        return sm

    def pause(sm):
        clock = current_clock()
        clock.call_later(REQUEST_S + 1.0, lambda: sm.control.pause(running="cancel"))
        clock.call_later(REQUEST_S + 4.0, sm.control.resume)

    for place, _, ends in lives(build, ""):
        assert "DRIVE done" not in ends, place


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("ask", [of_the_run, of_a_container, of_a_leaf, forced, jumped])
def test_nobody_is_asked_whether_a_state_goes_on_that_was_asked_to_stop(shape, ask, caplog):
    """An operator was asked to decide about a state that an operator had left."""

    class Asks(Work):
        def __init__(self, ends, name):
            super().__init__(ends, name)
            smachpy.set_options(self, resume="ask")

    make, path = SHAPES[shape]
    calm, store = [], KillingStore()
    expected = live(lambda ends: make(ends, Asks), path, ask, calm, store)
    requests = 0
    for kill_at in range(1, store.writes):
        ends, killed = [], KillingStore()
        killed.arm(kill_at, written=True)
        assert live(lambda ends: make(ends, Asks), path, ask, ends, killed) is None
        if b'"PreemptRequested"' not in killed.entries["m"][-1]:
            continue
        requests += 1
        ends.clear()  # the state has not learnt that its process is dead
        killed.arm(0, written=False)
        assert live(lambda ends: make(ends, Asks), path, ask, ends, killed) == expected
        assert "an operator decides" not in caplog.text
        assert ends == [end for end in calm if not end.startswith("DRIVE")]
    assert requests


def test_a_request_before_the_first_state_reaches_the_resumed_run():
    """It waited until the states that were active had been entered again: there was none."""
    ends, store = [], KillingStore()

    def machine(request):
        sm = StateMachine(ENDS, name="M")
        sm.add("WORK", Work(ends, "WORK"))
        sm.register_start_cb(lambda *_: request(sm))
        return sm

    def ask(sm):
        store.kill_at, store.written = store.writes + 1, True  # not `arm`, which begins a new life
        sm.request_preempt(by="the door sensor")

    def run(request):
        with VirtualClock() as clock, use_clock(clock):
            return smachpy.run_durable(machine(request), store, mission="m")

    with pytest.raises(Kill):
        run(ask)
    assert is_written(store, "PreemptRequested")
    store.arm(0, written=False)
    assert run(lambda _: None) == "preempted"
    assert ends == []
    assert sum(b'"PreemptRequested"' in entry for entry in store.entries["m"]) <= 1


# -- requests that a state withdraws ---------------------------------------------------------------


class Recalls(Work):
    """Withdraws each request to stop, and finishes its work; `ends` has when it heard of one."""

    def execute(self, userdata):
        end = current_clock().now() + self.seconds
        while current_clock().now() < end:
            if self.sleep(end - current_clock().now()):
                self.recall_preempt()
                self.ends.append(f"{self.name} heard")
        self.ends.append(f"{self.name} done")
        return "done"


def is_written(store, kind):
    return any(f'"kind":"{kind}"'.encode() in entry for entry in store.entries.get("m", ()))


def timed_out(sm, _path):
    """Nobody asks: a timeout does."""


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("ask", [of_the_run, of_a_container, of_a_leaf, timed_out])
def test_a_request_that_a_state_has_withdrawn_does_not_come_back_after_a_kill(shape, ask):
    make, path = SHAPES[shape]
    options = {"timeout": REQUEST_S, "timeout_outcome": "preempted"} if ask is timed_out else {}

    def build(ends):
        return make(ends, Recalls, **options)

    calm = []
    store = KillingStore()
    expected = live(build, path, ask, calm, store)
    assert calm[:2] == ["DRIVE heard", "DRIVE done"]
    late = 0
    for kill_at in range(1, store.writes):
        for written in (False, True):
            ends, killed = [], KillingStore()
            killed.arm(kill_at, written=written)
            if (
                live(build, path, ask, ends, killed) is not None
                or killed.rows["m"].status == "ended"
            ):
                continue
            withdrawn = is_written(killed, "Recalled")
            before = len(ends)
            killed.arm(0, written=False)
            assert live(build, path, ask, ends, killed) == expected, (kill_at, written, ends)
            if withdrawn:
                late += 1
                assert "DRIVE heard" not in ends[before:], (kill_at, written, ends)
            assert "DRIVE done" in ends, (kill_at, written, ends)
    assert late  # kills came after the state had withdrawn the request


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("ask", [of_the_run, timed_out])
def test_a_request_to_the_run_that_is_withdrawn_for_the_whole_run_does_not_come_back(ask):
    """Written without those whom it had come from, it was made again after the kill."""

    def build(ends):
        class Withdraws(Recalls):
            def recall_preempt(self):
                super().recall_preempt()
                sm.recall_preempt()

        limit = REQUEST_S if ask is timed_out else None
        sm = StateMachine(ENDS, name="M", timeout=limit, timeout_outcome="preempted")
        sm.add("DRIVE", Withdraws(ends, "DRIVE"), {"done": "LOOK"})
        sm.add("LOOK", Work(ends, "LOOK"))
        return sm

    calm, store = [], KillingStore()
    assert live(build, "/M", ask, calm, store) == "done"
    assert calm == ["DRIVE heard", "DRIVE done", "LOOK done"]
    late = 0
    for kill_at in range(1, store.writes):
        ends, killed = [], KillingStore()
        killed.arm(kill_at, written=True)
        assert live(build, "/M", ask, ends, killed) is None
        withdrawn = sum(b'"kind":"Recalled"' in entry for entry in killed.entries["m"])
        before = len(ends)
        killed.arm(0, written=False)
        # Killed between the two, the state has withdrawn it, and the run has not.
        expected = "preempted" if withdrawn == 1 else "done"
        assert live(build, "/M", ask, ends, killed) == expected, (kill_at, ends)
        if withdrawn == 2:
            late += 1
            assert "DRIVE heard" not in ends[before:], (kill_at, ends)
    assert late


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_state_that_withdraws_its_own_timeout_goes_on_after_a_kill():
    def build(ends):
        sm = StateMachine([*ENDS, "aborted"], name="M")
        sm.add(
            "DRIVE",
            Recalls(ends, "DRIVE", ("done", "preempted", "aborted"), seconds=20.0),
            {"done": "LOOK"},
        )
        smachpy.set_options(sm["DRIVE"], timeout=REQUEST_S)
        sm.add("LOOK", Work(ends, "LOOK"))
        return sm

    for place, outcome, ends in lives(build, "/M"):
        assert outcome == "done", (place, ends)
        assert "DRIVE done" in ends


# -- time that an operator takes -------------------------------------------------------------------

HELD_S = 100.0


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("shape", SHAPES)
def test_time_at_the_gate_does_not_count_after_a_kill_either(shape):
    """DRIVE takes 10 s, HOME 10 s and LOOK 10 s of 40 s; an operator holds HOME for 100 s."""
    make, path = SHAPES[shape]

    def build(ends):
        return make(ends, Quick, timeout=40.0, timeout_outcome="preempted")

    def hold(sm, _path):
        sm.control.pause()
        sm._smachpy.live.frame.run.clock.call_later(HELD_S, sm.control.resume)

    found = list(lives(build, path, hold))
    assert found[0][1] == "cleaned"
    for place, outcome, ends in found[1:]:
        assert outcome == "cleaned", (place, ends)


class Notes(Work):
    """Writes an entry after half of its time."""

    def execute(self, userdata):
        self.sleep(self.seconds / 2)
        smachpy.once("half", lambda: True)
        self.seconds /= 2
        return super().execute(userdata)


def test_time_at_the_gate_does_not_count_against_the_held_states_own_timeout():
    """LOOK takes 10 s of its 30 s; the entry of the end of DRIVE has begun it 95 s before."""

    def build(ends):
        sm = StateMachine(ENDS, name="M")
        sm.add("DRIVE", Work(ends, "DRIVE"), {"done": "LOOK"})
        sm.add("LOOK", Notes(ends, "LOOK"))
        smachpy.set_options(sm["LOOK"], timeout=30.0, timeout_outcome="preempted")
        return sm

    def hold(sm, _path):
        sm.control.pause()
        sm._smachpy.live.frame.run.clock.call_later(HELD_S, sm.control.resume)

    for place, outcome, ends in lives(build, "/M", hold):
        assert outcome == "done", (place, ends)


class Quick(Work):
    """Its work is done once it has ended 'preempted', so that HOME follows."""

    def end(self, *, stopped):
        assert not stopped
        return "preempted"


# -- emergency stops -------------------------------------------------------------------------------


def test_an_emergency_stop_before_the_run_holds_the_resumed_run():
    began, store = [], KillingStore()

    def run(*, stopped):
        class Drive(Work):
            def execute(self, userdata):
                began.append(clock.now())
                return "done"

        sm = StateMachine(ENDS, name="M")
        sm.add("DRIVE", Drive([], "DRIVE"))
        if stopped:
            sm.control.emergency_stop()
        with VirtualClock() as clock, use_clock(clock):
            clock.call_later(10.0, sm.control.resume)
            return smachpy.run_durable(sm, store, mission="m")

    store.arm(2, written=True)  # the entry after Started
    with pytest.raises(Kill):
        run(stopped=True)
    store.arm(0, written=False)
    assert run(stopped=False) == "done"
    assert began == [10.0]


def test_an_emergency_stop_while_another_one_is_released_is_in_the_journal():
    store = KillingStore()
    sm = StateMachine(ENDS, name="M")
    sm.add("DRIVE", Work([], "DRIVE"))
    released, kinds = sm.control._note_release, []

    def stops_again():
        sm.control._note_release = released
        sm.control._stop, sm.control._paused = object(), True  # in another thread, just now
        released()

    def look():
        kinds.extend(json.loads(entry)["kind"] for entry in store.entries["m"])

    sm.control._note_release = stops_again
    with VirtualClock() as clock, use_clock(clock):
        clock.call_later(1.0, sm.control.emergency_stop)
        clock.call_later(2.0, sm.control.resume)
        clock.call_later(3.0, look)
        clock.call_later(4.0, sm.control.resume)
        smachpy.run_durable(sm, store, mission="m")
    held = [kind for kind in kinds if kind in {"Stopped", "Released"}]
    assert held == ["Stopped", "Released", "Stopped"]


# -- slow disks and databases ----------------------------------------------------------------------


class HangingStore(KillingStore):
    """Writes nothing while it `hangs`."""

    def __init__(self):
        super().__init__()
        self.hangs = False
        self.asked, self.free = threading.Event(), threading.Event()

    def append(self, *args, **options):
        if self.hangs:
            self.asked.set()
            assert self.free.wait(60.0)
        super().append(*args, **options)


@pytest.mark.parametrize("stop", ["request", "operator", "pause", "emergency"])
def test_no_stop_waits_for_a_slow_journal(stop):
    """The robot drove on until the database had answered, or for 8 s."""
    store = HangingStore()
    began = {name: threading.Event() for name in ("LEFT", "RIGHT")}
    told = {name: threading.Event() for name in began}

    class Drive(State):
        def __init__(self, name):
            super().__init__(["done", "preempted"])
            self.name = name

        def execute(self, userdata):
            began[self.name].set()
            assert self.wait_preempt(60.0)
            told[self.name].set()
            return "preempted"

    both = Concurrence(["preempted"], "preempted")
    for name in began:
        both.add(name, Drive(name))
    sm = StateMachine(ENDS, name="M")
    sm.add("BOTH", both)
    stops = {
        "request": sm.request_preempt,
        "operator": lambda: sm.control.preempt("/M/BOTH/RIGHT"),
        "pause": lambda: sm.control.pause(running="cancel"),
        "emergency": sm.control.emergency_stop,
    }

    def operate():
        assert all(each.wait(60.0) for each in began.values())
        store.hangs = True
        threads = [threading.Thread(target=sm.control.preempt, args=["/M/BOTH/LEFT"])]
        threads[0].start()
        assert told["LEFT"].wait(60.0)
        assert store.asked.wait(60.0)
        threads.append(threading.Thread(target=stops[stop]))
        threads[1].start()
        heard.append(told["RIGHT"].wait(60.0))
        store.hangs = False
        store.free.set()
        for thread in threads:
            thread.join()
        sm.request_preempt()
        sm.control.resume()

    heard = []
    operator = threading.Thread(target=operate)
    operator.start()
    try:
        assert smachpy.run_durable(sm, store, mission="m") == "preempted"
    finally:
        store.free.set()
        operator.join()
    assert heard == [True]


def test_a_stop_is_in_the_journal_when_its_request_returns():
    store = KillingStore()
    kinds = []

    def ask():
        sm.request_preempt()
        kinds.extend(json.loads(entry)["kind"] for entry in store.entries["m"])

    sm = StateMachine(ENDS, name="M")
    sm.add("DRIVE", Work([], "DRIVE"))
    with VirtualClock() as clock, use_clock(clock):
        clock.call_later(REQUEST_S, ask)
        assert smachpy.run_durable(sm, store, mission="m") == "preempted"
    assert "PreemptRequested" in kinds


def test_a_suspension_comes_after_the_stops_that_were_told_and_waits_for_no_journal(monkeypatch):
    """The thread that suspended the mission waited for ever for the journal that it had closed."""
    done = []

    def suspend():
        recorder = sm._smachpy.live.journal
        journal, commit = recorder._journal, recorder._journal.commit
        monkeypatch.setattr(journal, "commit", lambda n: (done.append("commit"), commit(n)))
        monkeypatch.setattr(journal, "freeze", lambda: done.append("freeze"))
        recorder.on_suspend = None  # it would end the process
        with recorder._top.run.lock:
            recorder.asked(recorder._top, Origin("operator", "ann"))  # not in the journal yet
        with asking("signal", "SIGTERM"):
            request_soon(sm)
        done.append("returned")

    sm = StateMachine(ENDS, name="M")
    sm.add("DRIVE", Work([], "DRIVE"))
    with VirtualClock() as clock, use_clock(clock):
        clock.call_later(REQUEST_S, suspend)
        smachpy.run_durable(sm, KillingStore(), mission="m")
    assert done[:3] == ["commit", "freeze", "returned"]
