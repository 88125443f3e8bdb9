"""Preempts hold whatever children, callbacks and listeners do, and no flag outlives its run."""

from __future__ import annotations

import io
import logging
import os
import signal
import sys
import threading

import pytest

import smachpy
from actionlib_core import shutdown
from actionlib_core.clock import RealClock, use_clock
from actionlib_core.node import Node
from actionlib_core.shutdown import Shutdown, use_shutdown
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import Concurrence, Iterator, State, StateMachine
from smachpy.base.context import current_frame
from smachpy.engine.preempt import on_preempt
from smachpy.events import (
    Abandoned,
    CallbackFailed,
    Left,
    PreemptRequested,
    PreemptServiced,
    Resumed,
)
from smachpy.network.server import IntrospectionServer

LONG_S = 60.0


class Work(State):
    """Works for `seconds`, unless it is asked to stop."""

    def __init__(self, seconds=1.0, **options):
        super().__init__(["done", "preempted"], output_keys=["n"], **options)
        self.seconds = seconds

    def execute(self, userdata):
        if self.sleep(self.seconds):
            return "preempted"
        userdata.n = 1
        return "done"


class Stone(State):
    """Works for 50 s, whatever is asked of it or raised in it."""

    def __init__(self, clock):
        super().__init__(["done"])
        self.clock = clock

    def execute(self, userdata):
        end = self.clock.now() + 50.0
        while self.clock.now() < end:
            try:
                self.clock.sleep(end - self.clock.now())
            except BaseException:  # what a stone does
                continue
        return "done"


def both(*states, **options):
    made = Concurrence(
        ["done", "other", "preempted"],
        "other",
        outcome_map={"done": {f"S{i}": "done" for i in range(len(states))}},
        **options,
    )
    for number, state in enumerate(states):
        made.add(f"S{number}", state)
    return made


def chain(*states, **options):
    made = StateMachine(["done", "preempted"], **options)
    for number, state in enumerate(states):
        target = "done" if number == len(states) - 1 else f"S{number + 1}"
        ways = dict.fromkeys(("done", "other"), target)
        known = state.get_registered_outcomes()
        made.add(f"S{number}", state, {o: way for o, way in ways.items() if o in known})
    return made


# -- no flag outlives its run -------------------------------------------------------------------


def test_a_preempt_in_a_start_callback_leaves_nothing_for_the_next_run(clock):
    machine = both(Work(3.0), Work(3.0), preempt_timeout=1.0)
    asked = []
    machine.register_start_cb(lambda *_: asked or (asked.append(1), machine.request_preempt()))
    heard = []
    machine.subscribe(heard.append)
    assert machine.execute() == "preempted"
    told = [e.path for e in heard if isinstance(e, PreemptRequested)]
    assert told == ["/SM_ROOT"]  # children that never began are told nothing
    assert machine.execute() == "done"
    assert clock.now() == 3.0
    assert not any(isinstance(e, Abandoned) for e in heard)


@pytest.mark.parametrize("where", ["execute", "on_exit"])
def test_the_request_of_a_state_itself_does_not_survive_what_it_raises(clock, where):
    class Breaks(State):
        broken = True

        def __init__(self):
            super().__init__(["done", "preempted"], on_exit=self.leave)

        def leave(self, *_):
            if self.broken and where == "on_exit":
                raise OSError("gripper")

        def execute(self, userdata):
            if self.broken:
                self.request_preempt()
                if where == "execute":
                    raise OSError("gripper")
                return "done"
            return "preempted" if self.sleep(1.0) else "done"

    for wrap in (
        lambda state: chain(state),
        lambda state: both(state, Work()),
        lambda state: Iterator(["done", "preempted"], [], [], it=[1, 2], exhausted_outcome="done"),
    ):
        state = Breaks()
        machine = wrap(state)
        if isinstance(machine, Iterator):
            machine.set_contained_state("W", state, loop_outcomes=["done"])
        with pytest.raises(smachpy.InvalidUserCodeError):
            machine.execute()
        assert not state.preempt_requested()
        state.broken = False
        assert machine.execute() == "done"


def test_a_preempt_at_a_branch_that_a_pause_holds_back_lets_it_go(clock):
    machine = both(Work(), Work(), child_termination_cb=lambda _: True)
    machine.control.add_breakpoint("/SM_ROOT/S1")
    paused = []

    def listen(event):
        if isinstance(event, smachpy.events.Paused):
            paused.append(event.path)

    machine.subscribe(listen)
    held = clock.spawn(lambda: (clock.sleep(2.0), machine.control.resume()), name="operator")
    assert machine.execute() in {"other", "preempted"}
    held.join()
    assert not machine["S1"].preempt_requested()
    machine.control.remove_breakpoint("/SM_ROOT/S1")
    machine.control.resume()


# -- a child's own request_preempt --------------------------------------------------------------


class Own(Work):
    """Overrides `request_preempt` as programs for SMACH do; `what` is what else it does."""

    def __init__(self, what, seconds=30.0, **options):
        super().__init__(seconds, **options)
        self.what = what
        self.calls = 0

    def request_preempt(self):
        self.calls += 1
        super().request_preempt()
        self.what(self)


def raises(error):
    def what(_state):
        raise error

    return what


@pytest.mark.parametrize(
    "error", [ConnectionError("no answer"), SystemExit(1), KeyboardInterrupt()], ids=repr
)
@pytest.mark.parametrize("kind", [both, chain])
def test_a_request_that_raises_stops_nothing(clock, kind, error):
    machine = kind(Own(raises(error)), Work(30.0), Work(30.0))
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == 1.0
    failed = [e for e in heard if isinstance(e, CallbackFailed)]
    assert [e.path for e in failed] == ["/SM_ROOT/S0"]
    assert type(error).__name__ in failed[0].error
    assert not any(state.preempt_requested() for state in machine.get_children().values())


def test_a_request_that_raises_keeps_the_grace(clock):
    class Deaf(Own):
        def execute(self, userdata):
            self.clock().sleep(30.0)
            return "done"

    machine = both(Deaf(raises(OSError("bus"))), Work(30.0), preempt_timeout=2.0)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == 3.0


def test_a_request_that_does_not_pass_it_on_has_a_grace_too(clock):
    class Refuses(Work):
        def request_preempt(self):
            """Say nothing."""

        def execute(self, userdata):
            self.clock().sleep(30.0)
            return "done"

    machine = both(Refuses(), Work(30.0), preempt_timeout=2.0)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == 3.0


@pytest.mark.parametrize("kind", [both, chain])
def test_a_request_that_blocks_holds_nobody_up(clock, kind):
    never = clock.event("never")
    machine = kind(Own(lambda _: never.wait(500.0)), Work(30.0), Work(30.0), preempt_timeout=2.0)
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() <= 3.0
    told = {e.path: e.t for e in heard if isinstance(e, PreemptRequested)}
    assert set(told.values()) == {1.0}
    never.set()


@pytest.mark.parametrize("kind", [both, chain])
def test_a_request_that_asks_the_root_or_itself_ends(clock, kind):
    def again(state):
        machine.request_preempt()
        if state.calls < 100:
            state.request_preempt()

    state = Own(again)
    machine = kind(state, Work(30.0))
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == 1.0
    assert not state.preempt_requested()


def test_a_container_that_overrides_it_is_told_and_called_once(clock):
    class Mine(StateMachine):
        calls = 0

        def request_preempt(self):
            self.calls += 1
            super().request_preempt()
            raise RuntimeError("mine")

    inner = Mine(["done", "preempted"])
    inner.add("X", Work(30.0))
    machine = chain(inner)
    clock.call_later(1.0, machine.request_preempt)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == 1.0
    assert inner.calls == 1
    assert not inner.preempt_requested()


def test_what_a_late_request_does_meets_no_later_visit(clock):
    """The next visit waits for the request of the last one."""
    order = []

    class Slow(Own):
        def execute(self, userdata):
            order.append("run")
            return super().execute(userdata)

    def slow(_state):
        clock.sleep(0.5)
        order.append("told")

    state = Slow(slow, 2.0)
    machine = StateMachine(["done", "preempted"])
    machine.add("S", state, {"preempted": "S", "done": "done"})
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "done"
    assert order == ["run", "told", "run"]


@pytest.mark.slow
@pytest.mark.parametrize("what", ["raises", "blocks"])
def test_ctrl_c_requests_the_shutdown_whatever_the_root_makes_of_it(what):
    blocked = threading.Event()

    class Root(StateMachine):
        def request_preempt(self, **options):
            super().request_preempt(**options)
            if what == "raises":
                raise ConnectionError("no answer")
            blocked.wait(LONG_S)

    ending = Shutdown()
    with use_clock(RealClock()), use_shutdown(ending):
        machine = Root(["done", "preempted"])
        machine.add("S", Own(raises(OSError("bus"))))
        machine.register_start_cb(lambda *_: os.kill(os.getpid(), signal.SIGINT))
        assert machine.execute() == "preempted"
        assert shutdown.event().wait(LONG_S)
        blocked.set()


def test_a_request_that_is_a_raising_property_is_reported(clock):
    class Odd(Work):
        @property
        def request_preempt(self):
            raise OSError("bus")

    machine = both(Odd(30.0), Work(30.0))
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == 1.0
    (failed,) = [e for e in heard if isinstance(e, CallbackFailed)]
    assert failed.path == "/SM_ROOT/S0"
    assert failed.callback.endswith("Odd.request_preempt")
    assert failed.error == "OSError: bus"


def test_a_callback_that_raises_does_not_keep_the_others_from_a_request(clock):
    """As a state registers it itself, to be told at once."""

    class Hears(Work):
        def execute(self, userdata):
            forget = self.on_preempt(raises_at_once)
            try:
                return super().execute(userdata)
            finally:
                forget()

    def raises_at_once():
        raise OSError("bus")

    machine = both(Hears(30.0), Work(30.0))
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert clock.now() == 1.0
    assert [e.path for e in heard if isinstance(e, CallbackFailed)] == ["/SM_ROOT/S0"]


# -- from a signal handler ----------------------------------------------------------------------


def first_handler(machine):
    return lambda *_: machine.request_preempt()


def handler_that_says_so(machine):
    return lambda number, _: machine.request_preempt(by=signal.Signals(number).name)


class ListenerWithLock:
    def __init__(self):
        self.lock = threading.Lock()
        self.heard = []

    def __call__(self, event):
        with self.lock:
            self.heard.append(event)


LOCKS = {
    "listener": lambda m: m.listener.lock,
    "buffer that is thinned": lambda m: m.buffer._cut,
    "buffer that is read": lambda m: m.buffer._lock,
    "control": lambda m: m.machine.control._lock,
    "container": lambda m: m.machine._smachpy.live.frame.run.lock,
    "child": lambda m: m.machine["S0"]._smachpy.live.frame.run.lock,
    "feed": lambda m: m.server._feed._lock,
    "network": lambda m: m.network.lock,
    "log": lambda m: m.log.lock,
    "timers": lambda m: m.clock._timer_lock,
    "threads": lambda m: threading._active_limbo_lock,
}


class Heard:
    """A machine in another thread, and all sorts of listeners to it."""

    def __init__(self):
        self.log = logging.StreamHandler(io.StringIO())
        self.clock = RealClock()
        self.network = MemoryNetwork(self.clock)
        self.listener = ListenerWithLock()
        self.machine = chain(both(Work(60.0), Own(raises(OSError("bus")), 60.0)))
        self.outcomes = []

    def __enter__(self):
        logging.getLogger("smachpy").addHandler(self.log)
        self.node = Node("robot", transport=self.network.session(), clock=self.clock)
        self.server = IntrospectionServer("viewer", self.machine, "/SM_ROOT", node=self.node)
        self.server.start()
        self.buffer = self.machine.event_buffer(limit=1)
        self.machine.subscribe(self.listener)
        running = threading.Event()
        self.machine["S0"].register_start_cb(lambda *_: running.set())
        self.runner = threading.Thread(target=self.run)
        self.runner.start()
        assert running.wait(LONG_S)
        return self

    def run(self):
        with use_clock(self.clock):
            self.outcomes.append(self.machine.execute())

    def __exit__(self, *_):
        self.runner.join(LONG_S)
        self.server.stop()
        self.node.close()
        logging.getLogger("smachpy").removeHandler(self.log)


@pytest.mark.parametrize("lock", LOCKS)
def test_a_signal_handler_may_ask_whatever_lock_it_interrupts(lock):
    with Heard() as heard:
        before = signal.signal(signal.SIGUSR1, handler_that_says_so(heard.machine))
        try:
            with LOCKS[lock](heard):
                signal.raise_signal(signal.SIGUSR1)
        finally:
            signal.signal(signal.SIGUSR1, before)
    assert heard.outcomes == ["preempted"]
    asked = [event for event in heard.listener.heard if isinstance(event, PreemptRequested)]
    assert {event[3:5] for event in asked} == {("signal", "SIGUSR1")}


def test_what_the_main_thread_asks_is_asked_when_it_returns():
    runs, go_on = threading.Event(), threading.Event()

    class Deaf(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, _userdata):
            runs.set()
            go_on.wait(LONG_S)
            return "done"

    with use_clock(RealClock()) as clock:
        machine = chain(both(Deaf()))
        runner = clock.spawn(machine.execute, name="runner")
        assert runs.wait(LONG_S)
        machine.request_preempt()
        was_asked = machine["S0"]["S0"].preempt_requested()
        go_on.set()
        assert runner.join(LONG_S)
    assert was_asked


def test_the_main_thread_asks_itself_if_no_thread_can_be_started(monkeypatch):
    class Asks(State):
        def __init__(self):
            super().__init__(["done", "preempted"])

        def execute(self, _userdata):
            def refuse(*_, **__):
                raise RuntimeError("can't start new thread")

            monkeypatch.setattr(RealClock, "spawn", refuse)
            machine.request_preempt()
            monkeypatch.undo()
            return "preempted" if self.preempt_requested() else "done"

    with use_clock(RealClock()):
        machine = chain(Asks())
        assert machine.execute() == "preempted"


def test_a_signal_handlers_request_is_for_the_run_that_is_on():
    with use_clock(RealClock()):
        machine = chain(Work(0.0))
        before = signal.signal(signal.SIGUSR1, first_handler(machine))
        try:
            machine.register_termination_cb(lambda *_: os.kill(os.getpid(), signal.SIGUSR1))
            for _ in range(20):
                assert machine.execute() == "done"
        finally:
            signal.signal(signal.SIGUSR1, before)


def test_a_signal_handlers_request_before_the_run_ends_it():
    with use_clock(RealClock()):
        machine = chain(Work(LONG_S))
        before = signal.signal(signal.SIGUSR1, first_handler(machine))
        try:
            os.kill(os.getpid(), signal.SIGUSR1)
            assert machine.execute() == "preempted"
        finally:
            signal.signal(signal.SIGUSR1, before)


# -- nothing waits for a user's callback --------------------------------------------------------


@pytest.mark.parametrize("who", ["listener", "log"])
def test_no_timer_waits_for_whoever_hears_of_an_overdue_state(who):
    """A listener holds up the machine, but not the clock's thread, which has other timers."""
    free, blocked = threading.Event(), threading.Event()

    def block(*_):
        blocked.set()
        free.wait(LONG_S)

    class Deaf(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, userdata):
            clock.call_later(
                0.05, machine.request_preempt
            )  # not before it runs: it would not begin
            free.wait(LONG_S)
            return "done"

    log = logging.Handler()
    log.emit = block if who == "log" else lambda _: None
    logging.getLogger("smachpy").addHandler(log)
    clock = RealClock()
    outcomes = []

    def run():
        with use_clock(clock):
            outcomes.append(machine.execute())

    machine = both(Deaf(), Work(60.0), preempt_timeout=0.05)
    machine.subscribe(lambda e: block() if isinstance(e, Abandoned) and who == "listener" else None)
    runner = threading.Thread(target=run)
    try:
        runner.start()
        assert blocked.wait(LONG_S)
        tick = clock.event()
        clock.call_later(0.3, tick.set)
        assert tick.wait(LONG_S / 2)
        assert not free.is_set()
    finally:
        free.set()
        runner.join()
        logging.getLogger("smachpy").removeHandler(log)
    assert outcomes == ["preempted"]


def test_the_listeners_hear_the_end_of_what_was_left_behind_in_order(clock):
    machine = both(chain(Stone(clock)), Work(), preempt_timeout=2.0)
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.5, machine.request_preempt)
    assert machine.execute() == "preempted"
    ends = [
        (type(e).__name__, e.path)
        for e in heard
        if isinstance(e, (Abandoned, Left)) and e.path.startswith("/SM_ROOT/S0")
    ]
    assert ends == [
        ("Abandoned", "/SM_ROOT/S0/S0"),
        ("Left", "/SM_ROOT/S0/S0"),
        ("Left", "/SM_ROOT/S0"),
    ]
    clock.sleep(100.0)


# -- leaving a state behind ---------------------------------------------------------------------


def test_a_state_is_left_behind_while_others_write_userdata():
    """The copy that its thread keeps is taken in one step."""
    free, stop = threading.Event(), threading.Event()

    class Deaf(State):
        def __init__(self):
            super().__init__(["ok"], input_keys=["x"], output_keys=["y"])

        def execute(self, userdata):
            free.wait(LONG_S)
            userdata.y = "late"
            return "ok"

    def write(userdata):
        number = 0
        while not stop.is_set():
            userdata[f"k{number % 5000}"] = number
            if number % 7 == 0 and f"k{(number - 2500) % 5000}" in userdata:
                del userdata[f"k{(number - 2500) % 5000}"]
            number += 1

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with use_clock(RealClock()):
            machine = Concurrence(["ok", "preempted"], "ok", preempt_timeout=0.05)
            machine.userdata.x = 1
            for number in range(2000):
                machine.userdata[f"a{number}"] = number
            machine.add("DEAF", Deaf())
            ended = threading.Event()
            runner = threading.Thread(target=lambda: (machine.execute(), ended.set()))
            writer = threading.Thread(target=write, args=(machine.userdata,))
            begun = threading.Event()
            machine.register_start_cb(lambda *_: begun.set())
            writer.start()
            runner.start()
            assert begun.wait(LONG_S)
            machine.request_preempt()
            assert ended.wait(LONG_S / 2)
    finally:
        sys.setswitchinterval(interval)
        stop.set()
        free.set()
        writer.join()
        runner.join()
    assert "y" not in machine.userdata


def test_who_waits_for_the_end_hears_of_a_machine_that_was_left_behind(clock):
    inner = chain(Stone(clock))
    machine = both(inner, Work(), preempt_timeout=2.0)
    ended = []
    waiter = clock.spawn(
        lambda: (clock.sleep(1.0), inner.wait_ended(10.0), ended.append(clock.now())),
        name="waiter",
    )
    clock.call_later(1.5, machine.request_preempt)
    assert machine.execute() == "preempted"
    waiter.join()
    assert ended == [pytest.approx(3.6)]
    clock.sleep(100.0)


# -- one state, once ----------------------------------------------------------------------------


def test_one_state_in_two_branches_is_refused():
    state = Work()
    machine = Concurrence(["done"], "done")
    machine.add("A", state)
    with pytest.raises(smachpy.InvalidStateError):
        machine.add("B", state)


def test_one_state_below_two_branches_is_refused(clock):
    shared = Work()
    machine = both(chain(shared), chain(chain(Work(), shared)), chain(Work()))
    with pytest.raises(smachpy.InconsistentMachineError) as caught:
        machine.check_consistency()
    assert len(caught.value.problems) == 1
    with pytest.raises(smachpy.InconsistentMachineError):
        machine.execute()
    one = chain(shared, shared)  # one after the other is fine
    assert one.execute() == "done"


def test_a_container_in_itself_is_refused():
    outer, inner = StateMachine(["done"]), StateMachine(["done"])
    outer.add("INNER", inner)
    for container in (inner, outer):
        with pytest.raises(smachpy.InvalidStateError):
            container.add("SELF", outer)


@pytest.mark.parametrize("asked", [False, True])
def test_a_state_that_runs_the_machine_around_it_is_told_so(clock, asked):
    raised = []

    class Runs(State):
        def __init__(self):
            super().__init__(["done", "preempted"])

        def execute(self, userdata):
            self.wait_preempt(5.0)
            try:
                machine.execute()
            except smachpy.SmachError as error:
                raised.append(type(error))
            return "done"

    machine = chain(chain(Runs()))
    if asked:
        clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "done"
    assert raised == [smachpy.InvalidStateError]


def test_pausing_one_item_again_and_again_nests_nothing(clock):
    depths = []

    class Deep(Work):
        def execute(self, userdata):
            frame, depth = sys._getframe(), 0
            while frame is not None:
                frame, depth = frame.f_back, depth + 1
            depths.append(depth)
            return super().execute(userdata)

    machine = Iterator(["done", "preempted"], [], [], it=[1], exhausted_outcome="done")
    machine.set_contained_state("W", Deep(1.0), loop_outcomes=["done"])
    resumed = []
    machine.subscribe(lambda e: resumed.append(e) if isinstance(e, Resumed) else None)

    def operate():
        for _ in range(50):
            clock.sleep(0.3)
            machine.control.pause(running="cancel")
            clock.sleep(0.3)
            machine.control.resume()

    operator = clock.spawn(operate, name="operator")
    assert machine.execute() == "done"
    operator.join()
    assert len(depths) == 51
    assert len(resumed) == 50
    assert max(depths) - min(depths) <= 5


# -- one visit per child --------------------------------------------------------------------------


def test_each_child_that_takes_a_preempt_up_says_so(clock):
    machine = StateMachine(["done", "preempted"])
    machine.add("DRIVE", Work(5.0), {"preempted": "STOP"})
    machine.add("STOP", Work(5.0))
    heard = []
    machine.subscribe(heard.append)
    for moment in (1.0, 2.0):
        clock.call_later(moment, machine.request_preempt)
    assert machine.execute() == "preempted"
    serviced = [event.path for event in heard if isinstance(event, PreemptServiced)]
    assert serviced == ["/SM_ROOT/DRIVE", "/SM_ROOT/STOP", "/SM_ROOT"]


def test_a_preempt_wins_over_an_operator_who_forced_an_outcome(clock):
    class Unregistered(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, userdata):
            self.wait_preempt()
            clock.sleep(1.0)  # time for the second request
            return "preempted"

    machine = StateMachine(["done", "preempted"])
    machine.add("DRIVE", Unregistered())
    control = machine.control
    clock.call_later(1.0, lambda: control.force_outcome("/SM_ROOT/DRIVE", "done"))
    clock.call_later(1.5, machine.request_preempt)
    assert machine.execute() == "preempted"


def test_a_request_between_two_attempts_of_the_root_is_heard_and_told(clock):
    machine = StateMachine(["done", "aborted", "preempted"], retry=(3, 2.0, ["aborted"]))
    made = Work(0.5)
    made.register_outcomes(["aborted"])
    made.execute = lambda userdata: "aborted"
    machine.add("DRIVE", made)
    heard = []
    machine.subscribe(heard.append)
    clock.call_later(1.0, lambda: machine.request_preempt(by="desk"))
    assert machine.execute() == "preempted"
    assert clock.now() == 1.0
    asked = [(e.path, e.by) for e in heard if isinstance(e, PreemptRequested)]
    assert asked == [("/SM_ROOT", "desk")]
    assert not machine.preempt_requested()


class Awaited:
    """A lock that tells when a thread has to wait for it."""

    def __init__(self, lock, awaited):
        self.lock = lock
        self.awaited = awaited

    def __enter__(self):
        if not self.lock.acquire(blocking=False):
            self.awaited.set()
            self.lock.acquire()

    def __exit__(self, *_):
        self.lock.release()


def test_requests_that_begin_at_different_containers_do_not_wait_for_each_other():
    """A callback below asks the root while another thread passes the root's request on."""
    begun, below, above = threading.Event(), threading.Event(), threading.Event()
    met = []

    class Both(State):
        def __init__(self):
            super().__init__(["done", "preempted"])

        def execute(self, userdata):
            def callback():
                if not met:
                    below.set()
                    met.append(above.wait(LONG_S))  # the other thread is on its way down
                machine.request_preempt()

            run = current_frame().run
            run.lock = Awaited(run.lock, above)
            forget = on_preempt(self, callback)
            begun.set()
            try:
                return "preempted" if self.sleep(2 * LONG_S) else "done"
            finally:
                forget()

    inner = chain(Both())
    machine = chain(inner)
    with use_clock(RealClock()):
        outcomes = []
        threads = [
            threading.Thread(target=lambda: outcomes.append(machine.execute())),
            threading.Thread(target=lambda: begun.wait(LONG_S) and inner.request_preempt()),
            threading.Thread(target=lambda: below.wait(LONG_S) and machine.request_preempt()),
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(LONG_S)
    assert met == [True]
    assert outcomes == ["preempted"]


# -- callbacks of requests ----------------------------------------------------------------------


class Hears(Work):
    """Has `hear` called for each request."""

    def __init__(self, hear, seconds=30.0):
        super().__init__(seconds)
        self.hear = hear

    def execute(self, userdata):
        forget = self.on_preempt(self.hear)
        try:
            return super().execute(userdata)
        finally:
            forget()


def test_a_callback_of_a_request_that_blocks_holds_nobody():
    go_on, called = threading.Event(), threading.Event()

    def block():
        called.set()
        go_on.wait(LONG_S)

    with use_clock(RealClock()):
        state = Hears(block)
        machine = both(state, Work(30.0))
        entered = threading.Event()
        machine.register_transition_cb(lambda *_: entered.set())
        returned = threading.Event()

        def ask():
            entered.wait(LONG_S)
            machine.request_preempt()
            machine.request_preempt()
            returned.set()

        asker = threading.Thread(target=ask)
        asker.start()
        try:
            assert machine.execute() == "preempted"
            assert returned.wait(LONG_S)
            assert not go_on.is_set()
        finally:
            go_on.set()
            asker.join()


def test_requests_while_their_callback_runs_count_as_one(clock):
    times = []

    def hear():
        times.append(clock.now())
        clock.sleep(1.0)

    class Deaf(Hears):
        def execute(self, userdata):
            forget = self.on_preempt(self.hear)
            self.clock().sleep(5.0)
            forget()
            return "done"

    machine = chain(Deaf(hear))
    for at in (1.0, 1.25, 1.5, 3.5):
        clock.call_later(at, machine.request_preempt)
    machine.execute()
    assert times == [1.0, 2.0, 3.5]


def test_a_callback_is_called_at_once_when_a_request_is_there(clock):
    times = []

    class Late(Work):
        def execute(self, userdata):
            self.clock().sleep(2.0)
            forget = self.on_preempt(lambda: times.append(clock.now()))
            self.clock().sleep(1.0)
            forget()
            return "done"

    machine = chain(Late())
    clock.call_later(1.0, machine.request_preempt)
    machine.execute()
    assert times == [2.0]


@pytest.mark.parametrize("bad", [None, 5, lambda argument: None])
def test_a_callback_that_cannot_be_called_is_refused(bad):
    with pytest.raises(smachpy.InvalidStateError) as caught:
        Work().on_preempt(bad)
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize("at", [0.5, 1.5])  # in its hook, and in its child
def test_a_second_run_is_refused_without_a_trace_on_the_one_that_is_on(clock, at):
    refused, events = [], []
    machine = StateMachine(["done", "preempted"], on_enter=lambda _: clock.sleep(1.0))
    machine.add("WORK", Work(9.0))
    machine.subscribe(lambda event: events.append(type(event).__name__))

    def run_too():
        clock.sleep(at)
        try:
            machine.execute()
        except smachpy.InvalidStateError as error:
            refused.append(error)

    with use_shutdown(Shutdown()) as end:
        second = clock.spawn(run_too, name="second")
        clock.call_later(2.0, lambda: end.request("test"))
        assert machine.execute() == "preempted"  # the program's end still finds it
        second.join()
    assert len(refused) == 1
    assert clock.now() == 2.0
    assert (events.count("Started"), events.count("Finished")) == (1, 1)
