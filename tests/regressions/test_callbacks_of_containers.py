"""Whatever the callbacks of a container do, it returns after a preempt, within its grace."""

from __future__ import annotations

import enum
import os
import signal
import threading

import pytest

import smachpy
from actionlib_core.clock import RealClock, use_clock
from smachpy import Concurrence, Iterator, State, StateMachine
from smachpy.events import Abandoned, CallbackFailed, Entered, Finished, Left, PreemptRequested

GRACE_S = 0.1
LONG_S = 60.0


class Work(State):
    """Works for `seconds`, unless it is asked to stop; a busy computer lets it stop late."""

    def __init__(self, seconds=0.0, *, preempt_timeout=LONG_S):
        super().__init__(["done", "preempted"], preempt_timeout=preempt_timeout)
        self.seconds = seconds
        self.ran = 0

    def execute(self, userdata):
        self.ran += 1
        return "preempted" if self.sleep(self.seconds) else "done"


def machine_of(*states, **options):
    made = StateMachine(["done", "preempted"], preempt_timeout=GRACE_S, **options)
    for number, state in enumerate(states or (Work(), Work())):
        last = number == len(states or (1, 2)) - 1
        made.add(f"S{number}", state, {"done": "done" if last else f"S{number + 1}"})
    return made


def both_of(*states, **options):
    made = Concurrence(["done", "preempted"], "done", preempt_timeout=GRACE_S, **options)
    for number, state in enumerate(states or (Work(), Work())):
        made.add(f"S{number}", state)
    return made


def iterator_of(it=(1, 2), state=None, **options):
    made = Iterator(
        ["done", "preempted"],
        [],
        [],
        it=it,
        exhausted_outcome="done",
        preempt_timeout=GRACE_S,
        **options,
    )
    made.set_contained_state("S0", state or Work(), loop_outcomes=["done"])
    return made


def items_of(callback):
    def items():
        yield 1
        callback()
        yield 2

    return items


def registered(make, name):
    def place(callback):
        machine = make()
        getattr(machine, f"register_{name}_cb")(callback)
        return machine

    return place


# Every place where a container itself calls code of the user: callback -> machine.
PLACES = {
    **{
        f"{kind}: {name}": registered(make, name)
        for kind, make in (("machine", machine_of), ("both", both_of), ("iterator", iterator_of))
        for name in ("start", "transition", "termination")
    },
    "both: child_termination_cb": lambda f: both_of(child_termination_cb=f),
    "both: outcome_cb": lambda f: both_of(outcome_cb=f),
    "iterator: function of the items": lambda f: iterator_of(it=lambda: f() or [1]),
    "iterator: generator of the items": lambda f: iterator_of(it=items_of(f)),
    "machine: on_enter": lambda f: machine_of(on_enter=f),
    "machine: on_exit": lambda f: machine_of(on_exit=lambda *_: f()),
    "both: on_enter": lambda f: both_of(on_enter=f),
    "both: on_exit": lambda f: both_of(on_exit=lambda *_: f()),
}

AROUND = {
    "root": lambda machine: machine,
    "in a machine": machine_of,
    "in a concurrence": lambda machine: both_of(machine, Work(LONG_S)),
    "in a machine in a concurrence": lambda machine: both_of(machine_of(machine), Work(LONG_S)),
}

IN_ALL = (
    "machine: transition",
    "both: child_termination_cb",
    "both: termination",
    "both: on_enter",
)


def in_thread(machine):
    """Run `machine` in another thread than the main one; return what `execute` returned."""
    outcomes = []
    thread = threading.Thread(target=lambda: outcomes.append(machine.execute()), daemon=True)
    thread.start()
    thread.join(LONG_S)
    return outcomes[0] if outcomes else None


@pytest.fixture(params=["main thread", "another thread"])
def execute(request):
    """Run a machine by the real clock, in either kind of thread."""
    with use_clock(RealClock()):
        yield in_thread if request.param == "another thread" else lambda machine: machine.execute()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "around"),
    [
        *((place, "root") for place in PLACES),
        *((place, around) for place in IN_ALL for around in AROUND if around != "root"),
    ],
)
def test_a_callback_that_blocks_is_left_after_the_grace(place, around, execute):
    inside, go_on = threading.Event(), threading.Event()
    blocking = [True]

    def block(*_):
        if blocking[0]:
            inside.set()
            go_on.wait(LONG_S)  # in C: no exception reaches it but in the main thread

    inner = PLACES[place](block)
    machine = AROUND[around](inner)
    heard, reported, finished = [], threading.Event(), threading.Event()

    def listen(event):
        heard.append(event)
        if isinstance(event, Abandoned):
            reported.set()
        if isinstance(event, Finished):
            finished.set()

    machine.subscribe(listen)
    asker = threading.Thread(target=lambda: inside.wait(LONG_S) and machine.request_preempt())
    asker.start()
    try:
        assert execute(machine) == "preempted"
        assert not go_on.is_set()
    finally:
        go_on.set()
        asker.join()
    assert reported.wait(LONG_S)  # both are told in a thread of their own
    assert finished.wait(LONG_S)
    abandoned = [e for e in heard if isinstance(e, Abandoned)]
    assert [e.grace for e in abandoned] == [GRACE_S]
    assert "block" in abandoned[0].stack
    assert abandoned[0].path.count("/") == {"root": 1, "in a machine": 2}.get(
        around, 2 if around == "in a concurrence" else 3
    )
    entered = [e.path for e in heard if isinstance(e, (Entered, smachpy.events.Started))]
    left = [e.path for e in heard if isinstance(e, (Left, Finished))]
    assert sorted(entered) == sorted(left)  # no state is left that was not entered, none stays
    blocking[0] = False
    for state in (machine, inner):
        assert not state.preempt_requested()
        assert not state.is_running()
    if around.startswith("in a concurrence") or "in a concurrence" in around:
        machine["S1"].seconds = 0.0
    assert execute(machine) == "done"


@pytest.mark.parametrize("place", PLACES)
def test_a_callback_that_asks_for_a_preempt_itself_and_blocks(place, execute):
    go_on = threading.Event()

    def ask(*_):
        machine.request_preempt()
        go_on.wait(LONG_S)

    machine = PLACES[place](ask)
    try:
        assert execute(machine) == "preempted"
    finally:
        go_on.set()


@pytest.mark.parametrize("place", PLACES)
def test_a_callback_that_blocks_by_the_runs_clock(place, clock):
    """In virtual time the grace is exact, and nothing is left behind."""

    def block(*_):
        clock.sleep(100.0)

    machine = PLACES[place](block)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == pytest.approx(1.0 + GRACE_S)
    assert not machine.preempt_requested()


@pytest.mark.parametrize("place", PLACES)
def test_a_callback_is_stopped_by_a_timeout_of_its_machine(place, clock):
    def block(*_):
        clock.sleep(100.0)

    inner = PLACES[place](block)
    machine = StateMachine(["done", "late", "preempted"])
    smachpy.set_options(inner, timeout=2.0, timeout_outcome="late")
    machine.add("INNER", inner)
    if "on_e" in place:  # hooks are outside of a state's own timeout
        clock.call_later(2.0, machine.request_preempt)
        assert machine.execute() == "preempted"
    else:
        assert machine.execute() == "late"
    assert clock.now() == pytest.approx(2.0 + GRACE_S)


@pytest.mark.parametrize("place", PLACES)
def test_a_callback_that_returns_in_time_is_not_interrupted(place, clock):
    def wait(*_):
        clock.sleep(GRACE_S / 2)

    machine = PLACES[place](wait)
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(GRACE_S / 4, machine.request_preempt)
    assert machine.execute() in {"done", "preempted"}
    assert not any(isinstance(e, Abandoned) for e in heard)
    clock.sleep(100.0)
    assert machine.execute() in {"done", "preempted"}
    assert not any(isinstance(e, Abandoned) for e in heard)


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
def test_a_callback_that_swallows_the_interruption(place, execute):
    """`except BaseException` as some programs have it, in a loop that ends late."""
    stop = threading.Event()

    def deaf(*_):
        while not stop.is_set():
            try:
                while not stop.is_set():
                    pass
            except BaseException:
                pass

    machine = PLACES[place](deaf)

    def ask():
        stop.wait(0.05)
        machine.request_preempt()
        stop.wait(0.35)
        stop.set()  # in the main thread nothing can be left behind

    asker = threading.Thread(target=ask)
    asker.start()
    try:
        assert execute(machine) in {"done", "preempted"}
    finally:
        stop.set()
        asker.join()
    assert not machine.is_running()
    assert not machine.preempt_requested()


@pytest.mark.parametrize("place", PLACES)
def test_a_callback_that_raises_or_recurses_holds_nothing_up(place, clock):
    def recurse():  # without *args: CPython 3.13.0 puts no limit to the recursion of such a function
        recurse()

    machine = PLACES[place](lambda *_: bad())
    again = lambda: machine.is_running() and machine.execute()  # noqa: E731
    for bad in (recurse, again, lambda: 1 / 0):
        heard = []
        forget = machine.subscribe(heard.append)
        try:
            outcome = machine.execute()
        except smachpy.SmachError:
            outcome = "raised"
        forget()
        told = any(isinstance(e, CallbackFailed) for e in heard)
        assert outcome == "raised" or told or ("on_e" in place and bad is again)
        assert not machine.is_running()
        assert not machine.preempt_requested()


def test_a_request_from_a_signal_handler_while_a_callback_blocks():
    with use_clock(RealClock()):
        go_on = threading.Event()

        def block(*_):
            os.kill(os.getpid(), signal.SIGUSR1)
            go_on.wait(LONG_S)

        machine = machine_of()
        machine.register_start_cb(block)
        before = signal.signal(signal.SIGUSR1, lambda *_: machine.request_preempt())
        try:
            assert machine.execute() == "preempted"
            assert not go_on.is_set()
        finally:
            signal.signal(signal.SIGUSR1, before)


def test_the_termination_callbacks_are_called_after_another_one_was_stopped(clock):
    machine = machine_of()
    machine.register_start_cb(lambda *_: clock.sleep(100.0))
    ended = []
    machine.register_termination_cb(lambda _userdata, labels, outcome: ended.append(outcome))
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert ended == ["preempted"]


def test_branches_have_their_own_grace_while_a_callback_blocks(execute):
    """The concurrence is left behind only when its children have ended."""
    inside, go_on = threading.Event(), threading.Event()

    class Slow(Work):
        def execute(self, userdata):
            self.wait_preempt(LONG_S)
            go_on.wait(4 * GRACE_S)  # it comes to rest
            self.ran += 1
            return "preempted"

    def block(_outcomes):
        inside.set()
        go_on.wait(LONG_S)

    slow = Slow()
    machine = both_of(Work(), slow, child_termination_cb=block)
    asker = threading.Thread(target=lambda: inside.wait(LONG_S) and machine.request_preempt())
    asker.start()
    heard = []
    machine.subscribe(heard.append)
    try:
        assert execute(machine) == "preempted"
        assert slow.ran == 1
    finally:
        go_on.set()
        asker.join()
    assert [e.path for e in heard if isinstance(e, Abandoned)] == ["/SM_ROOT"]


def test_a_machine_that_a_callback_runs_is_told_of_the_preempt(clock):
    inner = machine_of(Work(100.0))
    machine = machine_of()
    outcomes = []
    machine.register_start_cb(lambda *_: outcomes.append(inner.execute()))
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert outcomes == ["preempted"]
    assert clock.now() == 1.0
    assert not any(isinstance(e, Abandoned) for e in heard)


def test_the_state_after_a_transition_callback_is_told_nothing_and_not_left(clock):
    second = Work(LONG_S)
    machine = machine_of(Work(), second)
    machine.register_transition_cb(lambda *_: clock.sleep(100.0))
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert second.ran == 0
    assert [e.path for e in heard if isinstance(e, PreemptRequested)] == ["/SM_ROOT"]


def test_a_preempt_timeout_of_none_waits_for_a_callback_as_long_as_it_takes(clock):
    machine = StateMachine(["done", "preempted"], preempt_timeout=None)
    machine.add("S0", Work())
    machine.register_start_cb(lambda *_: clock.sleep(1000.0))
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == 1000.0


# -- a container whose `execute` is the user's ---------------------------------------------------


class Around(StateMachine):
    """Does something before and after its own run, as programs for SMACH do."""

    def __init__(self, before, after, *states):
        super().__init__(["done", "preempted"], preempt_timeout=GRACE_S)
        self.before = before
        self.after = after
        for number, state in enumerate(states or (Work(),)):
            self.add(
                f"S{number}", state, {"done": f"S{number + 1}"} if states[number + 1 :] else {}
            )

    def execute(self, parent_ud=None):
        self.before()
        outcome = super().execute(parent_ud)
        self.after()
        return outcome


def nothing():
    """Do nothing."""


@pytest.mark.parametrize("where", ["before", "after"])
def test_a_container_with_an_execute_of_its_own_that_blocks(where, execute):
    inside, go_on = threading.Event(), threading.Event()
    blocking = [True]

    def block():
        if blocking[0]:
            inside.set()
            go_on.wait(LONG_S)

    inner = Around(block if where == "before" else nothing, block if where == "after" else nothing)
    machine = machine_of(inner)
    asker = threading.Thread(target=lambda: inside.wait(LONG_S) and machine.request_preempt())
    asker.start()
    try:
        assert execute(machine) == "preempted"
        assert not go_on.is_set()
    finally:
        go_on.set()
        asker.join()
    blocking[0] = False
    assert execute(machine) == "done"


def test_the_children_of_such_a_container_have_their_own_grace(clock):
    """The grace of what is around them neither ends them nor goes on from before them."""

    class Slow(Work):
        def execute(self, userdata):
            self.wait_preempt()
            self.clock().sleep(5.0)
            self.ran += 1
            return "preempted"

    slow = Slow(preempt_timeout=10.0)
    ended = []
    machine = machine_of(Around(nothing, lambda: ended.append(clock.now()), slow))
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert slow.ran == 1
    assert ended == [6.0]
    assert not any(isinstance(e, Abandoned) for e in heard)


def test_what_follows_an_asked_child_in_such_a_container_has_the_grace(clock):
    machine = machine_of(Around(nothing, lambda: clock.sleep(100.0), Work(LONG_S)))
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == pytest.approx(1.0 + GRACE_S)


class Ends(str, enum.Enum):  # noqa: UP042  its `str` is not its value
    DONE = "done"


def test_an_outcome_callback_may_return_a_member_of_an_enumeration(clock):
    """The concurrence ended with the text 'Ends.DONE', which was no outcome of it."""
    machine = StateMachine(["end"])
    both = Concurrence([Ends.DONE], Ends.DONE, outcome_cb=lambda _ended: Ends.DONE)
    with machine:
        machine.add("BOTH", both, {Ends.DONE: "end"})
        both.add("A", smachpy.CBState(lambda _userdata: Ends.DONE, outcomes=[Ends.DONE]))
    assert machine.execute() == "end"
    assert clock.now() == 0.0


@pytest.mark.parametrize(
    ("answer", "ran"),
    [
        (lambda outcomes: (label for label in outcomes if label == "S1"), 4.0),
        (lambda outcomes: filter(None, []), 4.0),
        (lambda outcomes: dict.fromkeys(["S1", "S2"]).keys(), 1.0),
    ],
)
def test_labels_to_preempt_may_come_from_any_iterable(clock, answer, ran):
    """A generator counted as true: it ended all branches, also if it yielded no label."""
    both = both_of(Work(1.0), Work(2.0), Work(4.0), child_termination_cb=answer)
    begun = clock.now()
    with use_clock(clock):
        assert both.execute() == "done"
    assert clock.now() - begun == ran


def test_the_items_of_an_iterator_may_be_an_enumeration(clock):
    """The class of the enumeration was called, as it can be."""

    class Room(enum.Enum):
        KITCHEN = "kitchen"
        LAB = "lab"

    state = Work()
    with use_clock(clock):
        assert iterator_of(Room, state).execute() == "done"
    assert state.ran == 2
