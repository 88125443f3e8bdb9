"""The operator's hand on a running machine."""

from __future__ import annotations

import contextlib
import sys
import threading

import pytest

import smachpy
from actionlib_core.clock import current_clock
from actionlib_core.shutdown import Shutdown, use_shutdown
from smachpy.engine.control import ControlError
from smachpy.engine.preempt import ask_child, on_preempt
from smachpy.engine.visit import Override
from smachpy.events import Entered, Jumped, OutcomeForced, Paused, Resumed, Started
from tests.smachpy.pnp.nets import net_of


class Work(smachpy.State):
    def __init__(self, seconds=1.0):
        super().__init__(["ok", "failed", "preempted"])
        self.seconds = seconds
        self.runs = 0

    def execute(self, userdata):
        self.runs += 1
        return "preempted" if self.sleep(self.seconds) else "ok"


def mission():
    inner = smachpy.StateMachine(["ok", "failed", "preempted"])
    with inner:
        smachpy.StateMachine.add("X", Work(), {"ok": "Y"})
        smachpy.StateMachine.add("Y", Work())
    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    with sm:
        smachpy.StateMachine.add("A", Work(), {"ok": "INNER"})
        smachpy.StateMachine.add("INNER", inner, {"ok": "Z", "preempted": "Z"})
        smachpy.StateMachine.add("Z", Work())
    sm.events = []
    sm.subscribe(sm.events.append)
    return sm


def at(clock, *commands):
    for when, command in commands:
        clock.call_later(when, command)


def entered(sm):
    return [e.path for e in sm.events if isinstance(e, Entered)]


def test_pause_holds_before_the_next_state_and_resume_goes_on(clock):
    sm = mission()
    seen = []
    at(
        clock,
        (0.5, sm.control.pause),
        (5.0, lambda: seen.append((sm.control.waiting(), sm.control.is_paused()))),
        (9.0, sm.control.resume),
    )
    assert sm.execute() == "ok"
    assert clock.now() == 9.0 + 3.0
    assert seen == [(("/P/INNER",), True)]
    assert [type(e) for e in sm.events if isinstance(e, (Paused, Resumed))] == [Paused, Resumed]


def test_pause_before_the_run_holds_at_the_first_state(clock):
    sm = mission()
    sm.control.pause()
    at(clock, (4.0, sm.control.resume))
    assert sm.execute() == "ok"
    assert clock.now() == 8.0


def test_pause_that_cancels_runs_the_state_again(clock):
    sm = mission()
    at(clock, (0.5, lambda: sm.control.pause(running="cancel")), (2.0, sm.control.resume))
    assert sm.execute() == "ok"
    assert sm["A"].runs == 2
    assert clock.now() == 2.0 + 4.0


@pytest.mark.parametrize("kind", ["iterator", "concurrence"])
def test_pause_that_cancels_in_other_containers(clock, kind):
    work = Work()
    if kind == "iterator":
        sm = smachpy.Iterator(["ok", "preempted"], [], [], it=[1, 2], exhausted_outcome="ok")
        sm.set_contained_state("EACH", work, loop_outcomes=["ok", "failed"])
    else:
        sm = smachpy.Concurrence(["ok", "preempted"], "ok")
        sm.add("W", work)
    at(clock, (0.5, lambda: sm.control.pause(running="cancel")), (3.0, sm.control.resume))
    assert sm.execute() == "ok"
    assert clock.now() == (5.0 if kind == "iterator" else 4.0)
    assert work.runs == (3 if kind == "iterator" else 2)


def test_only_the_root_has_the_control(clock):
    sm = mission()
    errors = []

    def wrong():
        with pytest.raises(ControlError, match="not the root"):
            sm["INNER"].control.pause()
        errors.append("told")

    at(clock, (1.5, wrong))
    assert sm.execute() == "ok"
    assert errors == ["told"]


def test_step_lets_one_state_run(clock):
    sm = mission()
    sm.control.pause()
    waits = []
    for when in (1.0, 4.0, 7.0):
        at(clock, (when, lambda: waits.append(sm.control.waiting())), (when, sm.control.step))
    at(clock, (20.0, sm.control.resume))
    assert sm.execute() == "ok"
    assert waits == [("/P/A",), ("/P/INNER",), ("/P/INNER/X",)]


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (lambda c: c.add_breakpoint("/P/INER/Y"), r"no such state; .* Did you mean '/P/INNER/Y'"),
        (lambda c: c.add_breakpoint("/P"), "no such state"),
        (lambda c: c.add_breakpoint("A"), "no such state"),
        (lambda c: c.add_breakpoint("/P/A", "okay"), r"got 'okay'; expected one of \['failed'"),
        (lambda c: c.pause(running="stop"), "got 'stop'; expected 'keep' or 'cancel'"),
    ],
)
def test_a_command_that_could_have_no_effect_is_refused(clock, command, words):
    """The machine never paused, or for ever."""
    sm = mission()
    with pytest.raises(ControlError, match=words):
        command(sm.control)
    assert sm.execute() == "ok"
    assert not any(isinstance(event, Paused) for event in sm.events)


def test_breakpoint_on_a_state_and_on_an_edge(clock):
    sm = mission()
    sm.control.add_breakpoint("/P/INNER/Y")
    sm.control.add_breakpoint("/P/A", "ok")
    seen = []
    for when in (3.0, 8.0):
        at(clock, (when, lambda: seen.append(sm.control.waiting())), (when, sm.control.resume))
    assert sm.execute() == "ok"
    assert seen == [("/P/INNER",), ("/P/INNER/Y",)]
    assert sm.control.breakpoints() == (("/P/A", "ok"), ("/P/INNER/Y", None))
    sm.control.remove_breakpoint("/P/INNER/Y")
    sm.control.remove_breakpoint("/P/A", "ok")
    before = clock.now()
    assert sm.execute() == "ok"
    assert clock.now() - before == 4.0


@pytest.mark.parametrize(
    ("path", "outcome", "said"),
    [
        ("/P/NONE", None, "there is no such state"),
        ("A", None, "there is no such state"),
        ("/P/A", "none", "none"),
    ],
)
def test_a_breakpoint_that_cannot_be_there_is_not_removed_in_silence(path, outcome, said):
    control = mission().control
    with pytest.raises(ControlError, match=said):
        control.remove_breakpoint(path, outcome)
    control.remove_breakpoint("/P/A")  # it could be there, and is not
    assert control.breakpoints() == ()


def test_breakpoint_on_an_outcome_holds_also_if_it_is_forced(clock):
    sm = mission()
    sm.control.add_breakpoint("/P/A", "ok")
    seen = []
    at(
        clock,
        (0.5, lambda: sm.control.force_outcome("/P/A", "ok")),
        (3.0, lambda: seen.append(sm.control.waiting())),
        (3.0, sm.control.resume),
    )
    assert sm.execute() == "ok"
    assert seen == [("/P/INNER",)]
    assert clock.now() == 6.0


def test_preempt_while_paused_ends_the_mission(clock):
    sm = mission()
    at(clock, (0.5, sm.control.pause), (3.0, sm.request_preempt))
    assert sm.execute() == "preempted"
    assert clock.now() == 3.0
    sm.control.resume()
    assert sm.execute() == "ok"


class Slows(smachpy.State):
    """Takes two seconds to stop."""

    def __init__(self):
        super().__init__(["ok", "failed", "preempted"])
        self.runs = 0

    def execute(self, userdata):
        self.runs += 1
        if not self.wait_preempt(50.0):
            return "ok"
        current_clock().sleep(2.0)
        return "preempted"


@pytest.mark.parametrize("stop", ["pause", "emergency", "resource"])
@pytest.mark.parametrize("chosen", ["preempt", "force", "jump"])
def test_what_an_operator_has_chosen_outlasts_a_pause_and_a_taker_of_the_resource(
    clock, chosen, stop
):
    """Stopped for good, and then by the emergency stop: it drove on after the release."""
    drive = Slows()
    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    sm.add("A", drive, {"preempted": "B", "failed": "C"})
    for label in "BCD":
        sm.add(label, Work())
    sm.events = []
    sm.subscribe(sm.events.append)
    live = sm._smachpy.live
    choose = {
        "preempt": lambda: sm.control.preempt("/P/A"),
        "force": lambda: sm.control.force_outcome("/P/A", "failed"),
        "jump": lambda: sm.control.jump("/P/D"),
    }[chosen]
    pause = {
        "pause": lambda: sm.control.pause(running="cancel"),
        "emergency": sm.control.emergency_stop,
        "resource": lambda: ask_child(live.frame, live.frame.step),
    }[stop]
    at(clock, (1.0, choose), (2.0, pause), (10.0, sm.control.resume))
    assert sm.execute() == "ok"
    after = {"preempt": "/P/B", "force": "/P/C", "jump": "/P/D"}[chosen]
    assert entered(sm) == ["/P/A", after]
    assert drive.runs == 1


class Watches(Work):
    """Ends after a second, as a sibling that has seen enough, or broken."""

    def __init__(self, error=None):
        super().__init__()
        self.error = error

    def execute(self, userdata):
        super().execute(userdata)
        if self.error is not None:
            raise self.error
        return "ok"


def beside(drive, error=None):
    both = smachpy.Concurrence(
        ["ok", "failed", "preempted"], "ok", child_termination_cb=lambda _: True, name="P"
    )
    both.add("DRIVE", drive)
    both.add("WATCH", Watches(error))
    return both


def interrupted(drive):
    net = net_of(
        """
        init* -> DRIVE.exec : DRIVE.start
        DRIVE.exec -> goal0 : DRIVE.end
        DRIVE.exec -> r : DRIVE.interrupt [obstacle]
        r -> B.exec : B.start
        B.exec -> goal : B.end
        """
    )
    plan = smachpy.pnp.PetriNetPlan(net, {"DRIVE": drive, "B": Work()}, name="P")
    current_clock().call_later(1.0, lambda: plan.post("obstacle"))
    return plan


def taken(drive):
    sm = smachpy.StateMachine(["ok", "preempted"], name="P")
    sm.add("DRIVE", drive, {"failed": "ok"})
    live = sm._smachpy.live
    current_clock().call_later(1.0, lambda: ask_child(live.frame, live.frame.step))
    return sm


@pytest.mark.parametrize("when", [0.5, 1.5], ids=["before", "after"])
@pytest.mark.parametrize("command", ["pause", "emergency"])
@pytest.mark.parametrize(
    "make",
    [beside, lambda drive: beside(drive, OSError("laser lost")), interrupted, taken],
    ids=["sibling", "error", "plan", "resource"],
)
def test_a_pause_does_not_begin_again_what_others_have_stopped(clock, make, command, when):
    """With the battery low, it drove on after the release, and nobody asked it any more."""
    drive = Slows()
    sm = make(drive)
    pause = {
        "pause": lambda: sm.control.pause(running="cancel"),
        "emergency": sm.control.emergency_stop,
    }[command]
    at(clock, (when, pause), (9.0, sm.control.resume))
    with contextlib.suppress(smachpy.InvalidUserCodeError):
        sm.execute()
    assert drive.runs == 1
    assert clock.now() < 12.0


@pytest.mark.parametrize(
    ("command", "choice"),
    [
        (lambda control: control.preempt("/P/A"), Override()),
        (lambda control: control.force_outcome("/P/A", "failed"), Override(outcome="failed")),
        (lambda control: control.jump("/P/B"), Override(label="B")),
        (lambda control: control.pause(running="cancel"), Override(label="A", if_stopped=True)),
    ],
)
def test_what_an_operator_has_chosen_is_known_when_the_state_hears_that_it_is_asked(
    clock, command, choice
):
    """A durable state that ended at once wrote 'preempted', and a kill then lost the choice."""
    seen = []

    class Hears(Work):
        def execute(self, userdata):
            frame = sm._smachpy.live.frame
            forget = on_preempt(self, lambda: seen.append(frame.visit.override))
            try:
                return super().execute(userdata)
            finally:
                forget()

    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    sm.add("A", Hears(), {"ok": "B"})
    sm.add("B", Work())
    at(clock, (0.5, lambda: command(sm.control)), (5.0, sm.control.resume))
    sm.execute()
    assert seen == [choice]


@pytest.mark.parametrize(
    "choose",
    [
        lambda control: control.force_outcome("/P/DRIVE", "failed"),
        lambda control: control.pause(running="cancel"),
    ],
    ids=["force", "pause"],
)
def test_a_request_that_a_state_withdraws_takes_the_operators_choice_with_it(clock, choose):
    """The next request, of somebody else, ended it with the outcome of the first."""

    class Recalls(Slows):
        def execute(self, userdata):
            self.wait_preempt()
            self.recall_preempt()
            return super().execute(userdata)

    drive = Recalls()
    both = beside(drive)
    at(clock, (0.5, lambda: choose(both.control)), (9.0, both.control.resume))
    ends = []
    both.subscribe(lambda event: ends.append(event) if isinstance(event, OutcomeForced) else None)
    assert both.execute() == "ok"
    assert ends == []
    assert drive.runs == 1


def test_jump_preempts_what_runs_and_goes_there(clock):
    sm = mission()
    at(clock, (0.5, lambda: sm.control.jump("/P/Z")))
    assert sm.execute() == "ok"
    assert clock.now() == 1.5
    assert entered(sm) == ["/P/A", "/P/Z"]
    assert [e.label for e in sm.events if isinstance(e, Jumped)] == ["Z"]


def test_jump_inside_a_sub_machine(clock):
    sm = mission()
    at(clock, (1.5, lambda: sm.control.jump("/P/INNER/Y")))
    assert sm.execute() == "ok"
    assert clock.now() == 3.5


def test_force_outcome_of_a_leaf_and_of_a_sub_machine(clock):
    sm = mission()
    at(clock, (0.5, lambda: sm.control.force_outcome("/P/A", "failed")))
    assert sm.execute() == "failed"
    assert clock.now() == 0.5
    assert [e.outcome for e in sm.events if isinstance(e, OutcomeForced)] == ["failed"]
    at(clock, (1.5, lambda: sm.control.force_outcome("/P/INNER", "failed")))
    assert sm.execute() == "failed"
    assert clock.now() == 2.0


def test_preempt_of_a_sub_machine_follows_its_transition(clock):
    sm = mission()
    at(clock, (1.5, lambda: sm.control.preempt("/P/INNER")))
    assert sm.execute() == "ok"
    assert clock.now() == 2.5
    at(clock, (0.5, lambda: sm.control.preempt("/P")))
    assert sm.execute() == "preempted"


def test_preempt_of_a_machine_that_does_not_run_is_an_error_and_its_next_run_goes_on(clock):
    sm = mission()
    with pytest.raises(ControlError, match="/P: it does not run"):
        sm.control.preempt("/P")
    assert sm.execute() == "ok"
    with pytest.raises(ControlError, match="/P: it does not run"):
        sm.control.preempt("/P")
    assert sm.execute() == "ok"
    sm.request_preempt()  # this is for the next run
    assert sm.execute() == "preempted"


def test_commands_in_a_concurrence_and_an_iterator(clock):
    loop = smachpy.Iterator(["ok", "preempted"], [], [], it=range(3), exhausted_outcome="ok")
    loop.set_contained_state("EACH", Work(), loop_outcomes=["ok", "failed"])
    both = smachpy.Concurrence(
        ["ok", "failed", "preempted"], "ok", outcome_map={"failed": {"W": "failed"}}, name="C"
    )
    both.add("LOOP", loop)
    both.add("W", Work(100.0))
    seen = []
    at(
        clock,
        (0.5, lambda: seen.append(both.control.active())),
        (0.5, lambda: both.control.force_outcome("/C/LOOP/EACH", "failed")),
        (1.0, lambda: both.control.force_outcome("/C/W", "failed")),
    )
    assert both.execute() == "failed"
    assert clock.now() == 2.5
    assert seen == [("/C/LOOP", "/C/LOOP/EACH", "/C/W")]


def test_pause_holds_the_branches_of_a_concurrence(clock):
    both = smachpy.Concurrence(["ok", "preempted"], "ok", name="C")
    both.add("V", Work())
    both.add("W", Work())
    both.control.pause()
    seen = []
    at(
        clock,
        (2.0, lambda: seen.append(sorted(both.control.waiting()))),
        (3.0, both.control.resume),
    )
    assert both.execute() == "ok"
    assert seen == [["/C/V", "/C/W"]]
    assert clock.now() == 4.0


def test_commands_for_what_does_not_run_say_what_does(clock):
    sm = mission()
    errors = []

    def wrong():
        for command in (
            lambda: sm.control.force_outcome("/P/B", "ok"),
            lambda: sm.control.force_outcome("/P/A", "okk"),
            lambda: sm.control.jump("/P/NOWHERE"),
            lambda: sm.control.jump("/Q/A"),
            lambda: sm.control.preempt("/P/Z"),
        ):
            with pytest.raises(ControlError) as caught:
                command()
            errors.append(caught.value)

    at(clock, (0.5, wrong))
    assert sm.execute() == "ok"
    assert len(errors) == 5
    assert errors[0].active == ("/P/A",)
    assert "Did you mean '/P/A'" in str(errors[0])
    with pytest.raises(ControlError):
        sm.control.force_outcome("/P/A", "ok")


def test_a_second_run_is_controlled_too(clock):
    sm = mission()
    sm.execute()
    at(clock, (0.5, sm.control.pause), (5.0, sm.control.resume))
    before = clock.now()
    sm.execute()
    assert clock.now() - before == 5.0 - 0.0 + 3.0


# -- the first use of the control, while the run has begun and the root has not -----------------


class Fails(Work):
    """Fails at its first run."""

    def execute(self, userdata):
        super().execute(userdata)
        return "failed" if self.runs == 1 else "ok"


@pytest.mark.parametrize("command", ["pause", "emergency_stop", "add_breakpoint"])
@pytest.mark.parametrize("where", ["on_enter", "retry", "Started"])
def test_a_stop_before_the_root_runs_holds_its_first_state(clock, where, command):
    """The machine ran all its states to the end, while `is_paused()` was true."""
    options = {
        "on_enter": {"on_enter": lambda _: clock.sleep(5.0)},
        "retry": {"retry": (2, 5.0, ["failed"])},
        "Started": {},
    }[where]

    def stop():
        getattr(sm.control, command)(*(["/P/A"] if command == "add_breakpoint" else []))

    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P", **options)
    sm.add("A", Fails() if where == "retry" else Work(), {"ok": "B"})
    sm.add("B", Work())
    if where == "Started":
        sm.subscribe(lambda event: stop() if isinstance(event, Started) else None)
    else:
        at(clock, (2.0, stop))
    seen = []
    at(clock, (9.0, lambda: seen.extend(sm.control.waiting())), (9.0, lambda: sm.control.resume()))
    assert sm.execute() == "ok"
    # The next attempt of the machine itself is held before its first state is.
    assert seen == ["/P" if where == "retry" and command != "add_breakpoint" else "/P/A"]
    assert sm["B"].runs == 1
    assert clock.now() == 11.0
    assert not sm.control.is_paused()


def test_an_emergency_stop_in_the_moment_of_the_begin_is_not_lost(clock, monkeypatch):
    sm = mission()
    control, pause = sm.control, sm.control._pause

    def late(stop):
        clock.sleep(1.0)  # the run begins meanwhile
        pause(stop)

    monkeypatch.setattr(control, "_pause", late)
    at(clock, (9.0, control.resume))
    stopping = clock.spawn(control.emergency_stop, name="stops")
    clock.sleep(0.5)
    assert sm.execute() == "ok"
    stopping.join()
    assert sm["A"].runs == 2
    assert clock.now() == 9.0 + 4.0


# -- a pause belongs to one run ------------------------------------------------------------------


class Breaks(Work):
    def execute(self, userdata):
        super().execute(userdata)
        raise OSError("broken")


def in_the_last_state(control):
    """The commands that pause a machine whose last state, /P/Z, runs or is about to end."""
    return {
        "pause": control.pause,
        "cancel": lambda: control.pause(running="cancel"),
        "step": control.step,
        "breakpoint": lambda: control.add_breakpoint("/P/Z", "ok"),
    }


@pytest.mark.parametrize("command", ["pause", "step", "breakpoint"])
@pytest.mark.parametrize("last", [Work, Breaks], ids=["ends", "raises"])
def test_a_pause_ends_with_its_run(clock, command, last):
    """Nobody has paused the next run, and a server's next client waited for ever."""
    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    sm.add("Z", last())
    changes = []
    sm.control.on_change(lambda: changes.append(sm.control.is_paused()))
    at(clock, (0.5, in_the_last_state(sm.control)[command]))
    for _ in range(2):
        with contextlib.suppress(smachpy.InvalidUserCodeError):
            sm.execute()
        assert not sm.control.is_paused()
        if command == "breakpoint":
            sm.control.remove_breakpoint("/P/Z", "ok")
    assert clock.now() == 2.0
    assert changes[-1] is False


@pytest.mark.parametrize("command", ["pause", "cancel", "step"])
@pytest.mark.parametrize("how", ["request", "operator", "shutdown"])
def test_a_stop_of_a_paused_machine_ends_it_and_the_pause(clock, command, how):
    """The tidy-up of a mission that was stopped while it was paused was held as well."""
    with use_shutdown(Shutdown()) as end:
        sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
        sm.add("A", Work(), {"preempted": "Z"})
        sm.add("Z", Work())
        stops = {
            "request": sm.request_preempt,
            "operator": lambda: sm.control.preempt("/P"),
            "shutdown": end.request,
        }
        at(clock, (0.5, in_the_last_state(sm.control)[command]), (0.7, stops[how]))
        held = command == "cancel"  # A waits for its second begin, which is called off
        assert sm.execute() == ("preempted" if held else "ok")
        assert clock.now() == (0.7 if held else 1.7)
        assert not sm.control.is_paused()


def test_a_pause_after_the_stop_holds_the_tidy_up(clock):
    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    sm.add("A", Work(), {"preempted": "Y"})
    sm.add("Y", Work(), {"ok": "Z"})
    sm.add("Z", Work())
    at(clock, (0.5, sm.request_preempt), (0.7, sm.control.pause), (9.0, sm.control.resume))
    assert sm.execute() == "ok"
    assert clock.now() == 10.0


def asks_in_a_callback(clock, sm):
    sm.control.add_breakpoint("/P/B")
    sm.register_transition_cb(lambda *_: sm.request_preempt())


def finishes_after_the_request(clock, sm):
    sm.control.add_breakpoint("/P/A", "ok")
    clock.call_later(0.5, sm.request_preempt)


def answers_the_request(clock, sm):
    sm.control.add_breakpoint("/P/A", "preempted")
    clock.call_later(0.5, sm.request_preempt)


@pytest.mark.parametrize("finishes", [False, True])
@pytest.mark.parametrize(
    "asks", [asks_in_a_callback, finishes_after_the_request, answers_the_request]
)
def test_a_breakpoint_after_the_stop_does_not_hold_the_clean_up(clock, asks, finishes):
    """Nothing was to start there any more: the robot did not dock until it was asked again."""

    class Ends(Work):
        def execute(self, userdata):
            super().execute(userdata)
            return "ok" if finishes else "preempted" if self.preempt_requested() else "ok"

    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    sm.add("A", Ends(), {"ok": "B"})
    sm.add("B", Work())
    sm.add_cleanup("DOCK", Work())
    asks(clock, sm)
    at(clock, (60.0, sm.control.resume))
    assert sm.execute() == "preempted"
    assert clock.now() == (2.0 if asks is asks_in_a_callback else 1.5)
    assert sm["DOCK"].runs == 1
    assert sm["B"].runs == 0


def test_a_breakpoint_on_preempted_holds_also_if_the_state_was_interrupted(clock):
    class Deaf(Work):
        def execute(self, userdata):
            clock.sleep(50.0)

    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    sm.add("A", Deaf(), {"preempted": "B"})
    sm.add("B", Work())
    smachpy.set_options(sm["A"], preempt_timeout=1.0)
    sm.control.add_breakpoint("/P/A", "preempted")
    at(clock, (1.0, lambda: sm.control.preempt("/P/A")), (9.0, sm.control.resume))
    assert sm.execute() == "ok"
    assert clock.now() == 10.0


def test_a_breakpoint_on_an_outcome_holds_also_if_the_state_runs_already(clock):
    """It was the first use of the control, in a run that nobody watched."""
    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    sm.add("A", Work(), {"ok": "B"})
    sm.add("B", Work())
    at(clock, (0.5, lambda: sm.control.add_breakpoint("/P/A", "ok")))
    at(clock, (9.0, lambda: sm.control.resume()))
    assert sm.execute() == "ok"
    assert clock.now() == 10.0


def test_a_held_state_that_is_called_off_meets_no_breakpoint_on_its_outcome(clock):
    """It has not run, so it has not ended either."""
    sm = mission()
    sm.control.pause()
    sm.control.add_breakpoint("/P/A", "preempted")
    sm.events.clear()
    at(
        clock,
        (1.0, lambda: sm.control.preempt("/P/A")),
        (1.0, lambda: sm.control.resume()),
        (9.0, lambda: sm.control.resume()),
    )
    assert sm.execute() == "preempted"
    assert clock.now() == 1.0


def test_a_wrong_outcome_is_told_also_where_an_operator_controls_the_machine(clock):
    """The error was that of looking for a breakpoint on it: a list cannot be in a set."""
    sm = smachpy.StateMachine(["ok"], name="P")
    sm.add("A", smachpy.CBState(lambda _: ["ok"], outcomes=["ok"]))
    sm.control.add_breakpoint("/P/A", "ok")
    with pytest.raises(smachpy.InvalidTransitionError, match=r"got \['ok'\]"):
        sm.execute()


def test_the_stop_of_a_part_leaves_the_machine_paused(clock):
    sm = mission()
    at(
        clock,
        (1.5, sm.control.pause),
        (1.7, lambda: sm.control.preempt("/P/INNER")),
        (9.0, sm.control.resume),
    )
    assert sm.execute() == "ok"
    assert clock.now() == 10.0


# -- states that a pause holds back --------------------------------------------------------------


class Fire(smachpy.State):
    """What must not happen once an operator has decided against it; it listens to nothing."""

    def __init__(self, *outcomes):
        super().__init__([*(outcomes or ("ok", "failed"))])
        self.runs = 0

    def execute(self, userdata):
        self.runs += 1
        return "ok"


def held(kind, fire):
    """A machine whose FIRE comes after a second, in a container of `kind`; then comes SAFE."""
    container = {
        "machine": lambda: smachpy.StateMachine(["ok", "failed", "preempted"]),
        "iterator": lambda: smachpy.Iterator(
            ["ok", "failed", "preempted"], [], [], [1, 2], "i", "ok"
        ),
        "concurrence": lambda: smachpy.Concurrence(
            ["ok", "failed", "preempted"],
            "ok",
            outcome_map={"failed": {"FIRE": "failed"}},
        ),
    }[kind]()
    if kind == "iterator":
        container.set_contained_state("FIRE", fire, break_outcomes=["failed"])
    else:
        container.add("FIRE", fire)
    sm = smachpy.StateMachine(["ok", "failed", "preempted"], name="P")
    with sm:
        smachpy.StateMachine.add("A", Work(), {"ok": "IN"})
        smachpy.StateMachine.add("IN", container, {"ok": "SAFE", "preempted": "SAFE"})
        smachpy.StateMachine.add("SAFE", Work())
    sm.events = []
    sm.subscribe(sm.events.append)
    return sm


def hold(clock, sm):
    sm.control.add_breakpoint("/P/IN/FIRE")
    at(clock, (5.0, lambda: sm.control.remove_breakpoint("/P/IN/FIRE")), (5.0, sm.control.resume))


@pytest.mark.parametrize("kind", ["machine", "iterator", "concurrence"])
def test_an_outcome_forced_on_a_held_state_comes_in_place_of_its_run(clock, kind):
    fire = Fire()
    sm = held(kind, fire)
    hold(clock, sm)
    at(clock, (2.0, lambda: sm.control.force_outcome("/P/IN/FIRE", "failed")))
    assert sm.execute() == "failed"
    assert fire.runs == 0
    assert [e.path for e in sm.events if isinstance(e, OutcomeForced)] == ["/P/IN/FIRE"]
    assert "/P/IN/FIRE" not in entered(sm)
    assert [type(e) for e in sm.events if isinstance(e, (Paused, Resumed))] == [Paused, Resumed]


@pytest.mark.parametrize("kind", ["machine", "iterator", "concurrence"])
@pytest.mark.parametrize("command", ["jump", "preempt", "preempt container"])
def test_a_held_state_that_is_called_off_does_not_run(clock, kind, command):
    fire = Fire()
    sm = held(kind, fire)
    hold(clock, sm)
    commands = {
        "jump": lambda: sm.control.jump("/P/SAFE"),
        "preempt": lambda: sm.control.preempt("/P/IN/FIRE"),
        "preempt container": lambda: sm.control.preempt("/P/IN"),
    }
    at(clock, (2.0, commands[command]))
    assert sm.execute() == "ok"
    assert fire.runs == 0
    assert entered(sm)[-1] == "/P/SAFE"


def test_a_held_state_of_the_machine_itself_is_jumped_over(clock):
    fire = Fire()
    sm = smachpy.StateMachine(["ok", "failed"], name="P")
    with sm:
        smachpy.StateMachine.add("FIRE", fire, {"ok": "SAFE"})
        smachpy.StateMachine.add("SAFE", Work(), {"preempted": "failed"})
    sm.control.add_breakpoint("/P/FIRE")
    at(clock, (2.0, lambda: sm.control.jump("/P/SAFE")), (3.0, sm.control.resume))
    assert sm.execute() == "ok"
    assert fire.runs == 0


@pytest.mark.parametrize("kind", ["machine", "iterator", "concurrence"])
def test_a_preempted_state_without_that_outcome_ends_its_container_preempted(clock, kind):
    class Deaf(Fire):
        def execute(self, userdata):
            self.clock().sleep(1000.0)
            return "ok"

    deaf = Deaf()
    smachpy.set_options(deaf, preempt_timeout=1.0)
    sm = held(kind, deaf)
    at(clock, (2.0, lambda: sm.control.preempt("/P/IN/FIRE")))
    assert sm.execute() == "ok"
    assert entered(sm)[-1] == "/P/SAFE"


def test_who_wants_to_know_hears_of_every_change_and_of_nothing_else(clock, caplog):
    sm = mission()
    heard = []
    control = sm.control
    control.on_change(lambda: 1 / 0)
    forget = control.on_change(lambda: heard.append((control.is_paused(), control.breakpoints())))
    control.pause()
    control.pause()
    control.resume()
    control.resume()
    assert heard == [(True, ()), (False, ())]
    control.add_breakpoint("/P/INNER")
    clock.call_later(9.0, control.resume)
    sm.execute()
    stop = ("/P/INNER", None)
    assert heard[2:] == [(False, (stop,)), (True, (stop,)), (False, (stop,))]
    assert "on_change" in caplog.text
    forget()
    control.remove_breakpoint("/P/INNER")
    assert len(heard) == 5


def test_listeners_of_changes_come_and_go_in_many_threads():
    control = mission().control
    heard = []

    def come_and_go():
        for _ in range(300):
            control.on_change(lambda: heard.append("stays"))
            control.on_change(lambda: heard.append("left"))()

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    threads = [threading.Thread(target=come_and_go) for _ in range(4)]
    try:
        for thread in threads:
            thread.start()
    finally:
        for thread in threads:
            thread.join()
        sys.setswitchinterval(before)
    control.pause()
    assert heard == ["stays"] * 1200
