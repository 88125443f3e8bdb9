"""Who asked for a preempt, who took it up, who holds it up: in the events and in what they add to."""

from __future__ import annotations

import os
import signal
import threading

import pytest

import smachpy
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.clock import RealClock, use_clock
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.node import Node
from actionlib_core.shutdown import Shutdown, use_shutdown
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import ActionServerWrapper, Concurrence, State, StateMachine
from smachpy.events import (
    Abandoned,
    Finished,
    Left,
    PreemptRequested,
    PreemptServiced,
    asker_text,
    from_record,
    to_record,
)
from smachpy.events.run_state import RunState


class Work(State):
    """Works for a while; after a preempt it cleans up for `tidy` seconds."""

    def __init__(self, seconds=5.0, tidy=0.0, **options):
        super().__init__(["ok", "preempted"], **options)
        self.seconds = seconds
        self.tidy = tidy

    def execute(self, userdata):
        if self.sleep(self.seconds):
            self.service_preempt()
            self.clock().sleep(self.tidy)
            return "preempted"
        return "ok"


class Silent(State):
    """Takes a preempt up without saying so before its end."""

    def __init__(self):
        super().__init__(["ok", "preempted"])

    def execute(self, userdata):
        return "preempted" if self.sleep(5.0) else "ok"


class Deaf(State):
    def __init__(self, seconds=5.0, **options):
        super().__init__(["ok"], **options)
        self.seconds = seconds

    def execute(self, userdata):
        self.clock().sleep(self.seconds)
        return "ok"


def machine_of(state, **options):
    sm = StateMachine(["done", "preempted", "aborted"], name="P", **options)
    with sm:
        outcome = state.get_registered_outcomes()[0]
        StateMachine.add("A", state, {outcome: "done"})
    return sm


def watch(sm):
    heard = []
    sm.subscribe(heard.append)
    return heard


def requests(heard):
    return [e for e in heard if isinstance(e, PreemptRequested)]


def asked_by(heard):
    """(path, source, by, why) of every request."""
    return [(e.path, e.source, e.by, e.why) for e in requests(heard)]


def serviced(heard):
    return [e.path for e in heard if isinstance(e, PreemptServiced)]


def test_a_program_is_named_by_its_thread_or_by_what_it_says(clock):
    sm = machine_of(Work())
    heard = watch(sm)
    clock.call_later(1.0, lambda: sm.request_preempt(by="the door opened"))
    assert sm.execute() == "preempted"
    everyone = ("program", "the door opened", "")
    assert asked_by(heard) == [("/P", *everyone), ("/P/A", *everyone)]
    heard.clear()
    task = clock.spawn(lambda: (clock.sleep(1.0), sm.request_preempt()), name="supervisor")
    sm.execute()
    task.join()
    assert {(e.source, e.by) for e in requests(heard)} == {("program", "supervisor")}


def test_an_overridden_request_keeps_who_asked(clock):
    class Mine(StateMachine):
        def request_preempt(self):  # as SMACH's programs write it
            super().request_preempt()

    inner = Mine(["ok", "preempted"])
    inner.add("X", Work())
    sm = machine_of(inner)
    heard = watch(sm)
    clock.call_later(1.0, lambda: sm.request_preempt(by="me"))
    sm.execute()
    assert [(e.path, e.by) for e in requests(heard)] == [
        ("/P", "me"),
        ("/P/A", "me"),
        ("/P/A/X", "me"),
    ]


def test_a_state_and_a_callback_are_named_by_their_path(clock):
    class Asks(State):
        def __init__(self):
            super().__init__(["ok"])

        def execute(self, userdata):
            sm.request_preempt()
            return "ok"

    both = Concurrence(["ok", "preempted"], "ok")
    with both:
        Concurrence.add("ASKS", Asks())
        Concurrence.add("WORK", Work())
    sm = machine_of(both)
    heard = watch(sm)
    sm.execute()
    assert {(e.source, e.by) for e in requests(heard)} == {("state", "/P/A/ASKS")}
    assert [e.path for e in requests(heard)][:2] == ["/P", "/P/A"]

    sm = machine_of(Work())
    heard = watch(sm)
    sm.register_start_cb(lambda *_: sm.request_preempt())
    sm.execute()
    assert asked_by(heard) == [("/P", "state", "/P", "")]


def test_a_preempt_before_the_run_is_told_when_it_begins(clock):
    sm = machine_of(Work())
    heard = watch(sm)
    sm.request_preempt(by="early")
    sm.execute()
    assert asked_by(heard) == [("/P", "program", "early", "")]
    assert serviced(heard) == ["/P"]
    heard.clear()
    sm.execute()
    assert requests(heard) == []
    sm.request_preempt(by="recalled")
    sm.recall_preempt()
    sm.execute()
    assert requests(heard) == []


def test_a_timeout_names_its_state(clock):
    inner = StateMachine(["ok", "preempted"], timeout=2.0)
    inner.add("X", Work(), {"ok": "ok"})
    sm = machine_of(inner)
    heard = watch(sm)
    assert sm.execute() == "aborted"
    asker = ("timeout", "/P/A", "2 s")
    assert asked_by(heard) == [("/P/A", *asker), ("/P/A/X", *asker)]
    assert serviced(heard) == ["/P/A/X", "/P/A"]


def test_a_concurrence_names_the_child_that_ended_and_how(clock):
    both = Concurrence(["ok"], "ok", child_termination_cb=lambda outcomes: True)
    with both:
        Concurrence.add("SHORT", Deaf(1.0))
        Concurrence.add("LONG", Work())
    sm = machine_of(both)
    heard = watch(sm)
    sm.execute()
    assert asked_by(heard) == [
        ("/P/A/LONG", "concurrence", "/P/A/SHORT", "ended with 'ok'"),
    ]


def test_a_concurrence_names_the_child_that_raised(clock):
    def fail(userdata):
        clock.sleep(1.0)
        raise ValueError("motor")

    both = Concurrence(["ok"], "ok")
    with both:
        Concurrence.add("FAILS", smachpy.CBState(fail, outcomes=["ok"]))
        Concurrence.add("LONG", Work())
    sm = machine_of(both)
    heard = watch(sm)
    with pytest.raises(smachpy.InvalidUserCodeError):
        sm.execute()
    assert asked_by(heard) == [
        ("/P/A/LONG", "concurrence", "/P/A/FAILS", "raised ValueError"),
    ]


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (lambda c: c.preempt("/P"), "preempt of /P"),
        (lambda c: c.preempt("/P/A"), "preempt of /P/A"),
        (lambda c: c.force_outcome("/P/A", "ok"), "force 'ok' of /P/A"),
        (lambda c: c.jump("/P/A"), "jump to /P/A"),
        (lambda c: c.pause(running="cancel"), "pause"),
    ],
)
def test_an_operators_command_is_told(clock, command, why):
    sm = machine_of(Work(2.0))
    heard = watch(sm)
    clock.call_later(1.0, lambda: command(sm.control))
    clock.call_later(1.5, sm.control.resume)
    sm.execute()
    assert {e[3:6] for e in requests(heard)} == {("operator", "", why)}


def test_a_remote_operator_is_told_by_the_node(clock):
    from smachpy.network.remote_control import ControlClient

    network = MemoryNetwork(clock)
    robot = Node("robot", transport=network.session(), clock=clock)
    desk = Node("desk", transport=network.session(), clock=clock)
    sm = machine_of(Work())
    heard = watch(sm)
    server = smachpy.IntrospectionServer("robot", sm, "/P", node=robot, control=True)
    server.start()
    client = ControlClient("/robot", desk)
    task = clock.spawn(sm.execute, name="mission")
    clock.sleep(0.5)
    assert client.send({"command": "preempt", "path": "/P"})["ok"]
    assert task.join(5.0)
    assert {e[3:6] for e in requests(heard)} == {("operator", "desk", "preempt /P")}
    heard.clear()
    task = clock.spawn(sm.execute, name="mission")
    clock.sleep(0.5)
    client.send({"command": "preempt", "path": "/P/A", "by": "Ada at the page"})
    assert task.join(5.0)
    assert {e.by for e in requests(heard)} == {"Ada at the page"}
    client.close()
    server.stop()
    desk.close()
    robot.close()


def test_the_programs_end_is_told(clock):
    with use_shutdown(Shutdown()) as shutdown:
        sm = machine_of(Work())
        heard = watch(sm)
        clock.call_later(1.0, lambda: shutdown.request("battery empty"))
        assert sm.execute() == "preempted"
    assert {e[3:5] for e in requests(heard)} == {("shutdown", "battery empty")}
    with use_shutdown(Shutdown()) as shutdown:
        heard.clear()
        clock.call_later(1.0, lambda: shutdown.request("SIGTERM"))
        sm.execute()
    assert {e[3:5] for e in requests(heard)} == {("signal", "SIGTERM")}


def in_real_time(sm, act):
    """Run `sm` in the main thread and call `act` when its leaf waits."""
    ready = threading.Event()
    smachpy.set_options(sm["A"], on_enter=lambda _userdata: ready.set())
    thread = threading.Thread(target=lambda: (ready.wait(60.0), act()))
    thread.start()
    with use_clock(RealClock()), use_shutdown(Shutdown()):
        outcome = sm.execute()
    thread.join()
    return outcome


def test_ctrl_c_is_told():
    sm = machine_of(Work(20.0))
    heard = watch(sm)
    assert in_real_time(sm, lambda: os.kill(os.getpid(), signal.SIGINT)) == "preempted"
    assert {e[3:5] for e in requests(heard)} == {("signal", "SIGINT")}


def test_a_signal_handler_of_the_program_is_told():
    sm = machine_of(Work(20.0))
    heard = watch(sm)

    def handler(number, _stack):
        sm.request_preempt(by=signal.Signals(number).name)

    before = signal.signal(signal.SIGUSR1, handler)
    try:
        assert in_real_time(sm, lambda: os.kill(os.getpid(), signal.SIGUSR1)) == "preempted"
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert {e[3:5] for e in requests(heard)} == {("signal", "SIGUSR1")}


def test_an_action_clients_cancel_and_a_newer_goal_are_told(clock):
    network = MemoryNetwork(clock)
    robot = Node("robot", transport=network.session(), clock=clock)
    desk = Node("desk", transport=network.session(), clock=clock)
    sm = machine_of(Work())
    heard = watch(sm)
    wrapper = ActionServerWrapper(
        "do", Action, sm, succeeded_outcomes=["done"], preempted_outcomes=["preempted"], node=robot
    )
    wrapper.run_server()
    client = SimpleActionClient("do", Action, node=desk)
    assert client.wait_for_server(5.0)
    client.send_goal(Goal(1))
    clock.sleep(1.0)
    client.cancel_goal()
    client.wait_for_result()
    (whole,) = {e[3:6] for e in requests(heard)}
    assert whole[:2] == ("action", "do")
    assert whole[2].startswith("cancel of goal /desk-")
    heard.clear()
    client.send_goal(Goal(1))
    clock.sleep(1.0)
    client.send_goal(Goal(2))
    clock.sleep(1.0)
    (whole,) = {e[3:6] for e in requests(heard)}
    assert whole[2].startswith("newer goal /desk-")
    heard.clear()
    wrapper.stop()
    assert {e[3:6] for e in requests(heard)} == {("action", "do", "the server stops")}
    desk.close()
    robot.close()


def test_the_test_kit_is_told(mission):
    mission.preempt(at=1.0)
    run = mission(machine_of(Work()))
    assert {e[3:5] for e in requests(run.events)} == {("test", "")}


def test_who_said_it_does_not_stay_for_later_or_for_tasks(clock):
    """What a preempt's callback starts is not the asker's."""
    other = machine_of(Work())
    heard = watch(other)

    class Starts(Work):
        def request_preempt(self):
            super().request_preempt()
            clock.spawn(other.request_preempt, name="helper")

    running = clock.spawn(other.execute, name="second mission")
    sm = machine_of(Starts())
    clock.call_later(1.0, lambda: sm.request_preempt(by="me"))
    sm.execute()
    running.join()
    assert len(requests(heard)) == 2
    assert all(e.by != "me" for e in requests(heard))


# -- who took it up, who holds it up ------------------------------------------------------------


def test_taking_it_up_is_told_when_it_is_said_and_once(clock):
    sm = machine_of(Work(tidy=2.0))
    heard = watch(sm)
    clock.call_later(1.0, sm.request_preempt)
    sm.execute()
    times = [(type(e).__name__, e.path, e.t) for e in heard[2:]]
    assert times == [
        ("PreemptRequested", "/P", 1.0),
        ("PreemptRequested", "/P/A", 1.0),
        ("PreemptServiced", "/P/A", 1.0),
        ("Left", "/P/A", 3.0),
        ("PreemptServiced", "/P", 3.0),
        ("Finished", "/P", 3.0),
    ]


def test_a_state_that_only_ends_preempted_has_taken_it_up_too(clock):
    sm = machine_of(Silent())
    heard = watch(sm)
    clock.call_later(1.0, sm.request_preempt)
    sm.execute()
    assert [type(e) for e in heard[-4:]] == [PreemptServiced, Left, PreemptServiced, Finished]


def test_finished_work_and_an_abandoned_state_took_nothing_up(clock):
    sm = machine_of(Deaf(5.0))
    heard = watch(sm)
    clock.call_later(1.0, sm.request_preempt)
    assert sm.execute() == "done"
    assert serviced(heard) == []
    sm = machine_of(Deaf(500.0), preempt_timeout=2.0)
    heard = watch(sm)
    clock.call_later(1.0, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert next(type(e) for e in heard if isinstance(e, (PreemptServiced, Abandoned))) is Abandoned
    assert "/P/A" not in serviced(heard)


def test_the_grace_is_told_for_leaves(clock):
    both = Concurrence(["ok", "preempted"], "ok", preempt_timeout=7.0)
    with both:
        Concurrence.add("INHERITS", Work())
        Concurrence.add("OWN", Work(preempt_timeout=3.0))
        Concurrence.add("PATIENT", Work(preempt_timeout=None))
    sm = machine_of(both)
    heard = watch(sm)
    clock.call_later(1.0, sm.request_preempt)
    sm.execute()
    assert {e.path: e.grace for e in requests(heard)} == {
        "/P": None,
        "/P/A": None,
        "/P/A/INHERITS": 7.0,
        "/P/A/OWN": 3.0,
        "/P/A/PATIENT": None,
    }


def test_the_state_of_a_run_tells_who_holds_the_preempt_up(clock):
    both = Concurrence(["ok", "preempted"], "ok", preempt_timeout=60.0)
    with both:
        Concurrence.add("DEAF", Deaf(9.0))
        Concurrence.add("TIDY", Work(20.0, tidy=3.0))
        Concurrence.add("QUICK", Work(20.0))
    sm = machine_of(both)
    state = RunState()
    sm.subscribe(lambda event: state.fold(to_record(event)))
    looks = {}
    clock.call_later(1.0, lambda: sm.request_preempt(by="me"))
    clock.call_later(2.0, lambda: looks.update(two=state.holding_up()))
    clock.call_later(2.0, lambda: looks.update(facts={**state.data["states"]["/P/A/TIDY"]}))
    clock.call_later(6.0, lambda: looks.update(six=state.holding_up()))
    sm.execute()
    assert looks["two"] == ["/P/A/DEAF", "/P/A/TIDY"]
    assert looks["six"] == ["/P/A/DEAF"]
    facts = looks["facts"]
    assert facts["asked"] == {"source": "program", "by": "me", "why": "", "grace": 60.0}
    assert facts["serviced"] is not None
    assert facts["abandoned"] is None
    after = state.data["states"]["/P/A/TIDY"]
    assert [after[name] for name in ("preempt", "asked", "serviced", "abandoned")] == [None] * 4
    assert state.holding_up() == []


def test_records_of_older_runs_have_an_asker_too():
    old = from_record({"kind": "PreemptRequested", "path": "/P", "t": 1.0, "stamp_ns": 2})
    assert old == PreemptRequested("/P", 1.0, 2, "program", "", "", None)
    assert old.asker == "program"


def test_askers_in_words():
    assert asker_text("signal", "SIGINT", "") == "signal SIGINT"
    assert asker_text("timeout", "/P/A", "2 s") == "timeout of /P/A: 2 s"
    event = PreemptRequested("/P", 0.0, 0, "concurrence", "/P/A", "ended with 'low'")
    assert event.asker == "concurrence, after /P/A: ended with 'low'"
    assert asker_text("martian", "Zorg", "") == "martian Zorg"
