"""Timeout, retry, exceptions, hooks, coroutines and functions as states."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading

import pytest

import smachpy
from actionlib_core.clock import RealClock, current_clock, use_clock
from actionlib_core.shutdown import Shutdown, use_shutdown
from smachpy.engine.interrupt import Interruption
from smachpy.engine.preempt import Visit
from smachpy.engine.step import Timeout
from smachpy.events import (
    Abandoned,
    Finished,
    Left,
    PreemptRequested,
    PreemptServiced,
    Retried,
    TimedOut,
)


class Waits(smachpy.State):
    def __init__(self, seconds, **options):
        super().__init__(["ok", "preempted"], **options)
        self.seconds = seconds

    def execute(self, userdata):
        return "preempted" if self.sleep(self.seconds) else "ok"


class Fails(smachpy.State):
    """Fails so often, then is 'ok'."""

    def __init__(self, times, error=None, **options):
        super().__init__(["ok", "aborted"], **options)
        self.left = times
        self.error = error or ValueError("motor")
        self.runs = 0

    def execute(self, userdata):
        self.runs += 1
        if self.left:
            self.left -= 1
            if isinstance(self.error, Exception):
                raise self.error
            return self.error
        return "ok"


def run(state, *, path=()):
    sm = smachpy.StateMachine([*state.get_registered_outcomes()])
    sm.add("A", state)
    events = []
    sm.subscribe(events.append)
    return sm.execute(), events


def test_timeout_ends_with_aborted_or_the_given_outcome(clock):
    outcome, events = run(Waits(10.0, timeout=2.0))
    assert outcome == "aborted"
    assert clock.now() == 2.0
    assert [(e.path, e.timeout) for e in events if isinstance(e, TimedOut)] == [("/SM_ROOT/A", 2.0)]
    assert run(Waits(10.0, timeout=2.0, timeout_outcome="late"))[0] == "late"


def test_timeout_leaves_a_finished_state_alone(clock):
    assert run(Waits(1.0, timeout=2.0))[0] == "ok"
    current_clock().sleep(5.0)


def test_timeout_of_a_state_that_ignores_it_comes_after_the_grace(clock):
    logging.disable(logging.CRITICAL)

    class Deaf(smachpy.State):
        def execute(self, userdata):
            current_clock().sleep(1000.0)
            return "ok"

    state = Deaf(["ok"], timeout=2.0, preempt_timeout=3.0)
    try:
        assert run(state)[0] == "aborted"
    finally:
        logging.disable(logging.NOTSET)
    assert clock.now() == 5.0
    assert not state.preempt_requested()


def test_timeout_of_a_container_and_of_the_root(clock):
    inner = smachpy.StateMachine(["ok", "preempted"], timeout=2.0, timeout_outcome="late")
    inner.add("W", Waits(10.0))
    assert run(inner)[0] == "late"
    assert inner.execute() == "late"
    assert clock.now() == 4.0


def beside(*states, **options):
    both = smachpy.Concurrence(["ok", "aborted", "preempted"], "ok", **options)
    for i, state in enumerate(states):
        both.add(f"C{i}", state)
    return both


def root_of(state, **options):
    sm = smachpy.StateMachine(["ok", "preempted"], name="ROOT", **options)
    sm.add("A", state)
    events = []
    sm.subscribe(events.append)
    return sm, events


def test_timeout_of_the_root_is_told_as_that_of_a_state(clock):
    sm, events = root_of(Waits(10.0), timeout=2.0)
    assert sm.execute() == "aborted"
    assert [(e.path, e.timeout) for e in events if isinstance(e, TimedOut)] == [("/ROOT", 2.0)]
    asked = [e[3:6] for e in events if isinstance(e, PreemptRequested) and e.path == "/ROOT"]
    assert asked == [("timeout", "/ROOT", "2 s")]
    assert [e.path for e in events if isinstance(e, PreemptServiced)] == ["/ROOT/A", "/ROOT"]


def test_timeout_of_the_root_ends_with_its_attempt(clock):
    state = Listens([9.0, 1.0], says=True)
    sm, events = root_of(state, timeout=2.0, retry=3)
    assert sm.execute() == "ok"
    assert (state.runs, clock.now()) == (2, 3.0)
    assert [(e.path, e.reason) for e in events if isinstance(e, Retried)] == [("/ROOT", "aborted")]
    assert [e.path for e in events if isinstance(e, PreemptServiced)] == ["/ROOT/A", "/ROOT"]


@pytest.mark.parametrize("asked_at", [1.0, 2.5])
def test_a_root_that_is_asked_to_stop_makes_no_further_attempt(clock, asked_at):
    """Asked before its timeout at 2 s, or while it cleans up after it."""

    class Tidies(Listens):
        def execute(self, userdata):
            outcome = super().execute(userdata)
            current_clock().sleep(1.5)
            return outcome

    state = Tidies([9.0] * 5, says=True)
    again = smachpy.Retry(5, 0, ["aborted", "preempted"])
    sm, events = root_of(state, timeout=2.0, retry=again)
    clock.call_later(asked_at, sm.request_preempt)
    sm.execute()
    assert state.runs == 1
    assert not [e for e in events if isinstance(e, Retried)]
    assert [e.path for e in events if isinstance(e, PreemptServiced)] == ["/ROOT/A", "/ROOT"]
    state.seconds = [0.0]
    assert sm.execute() == "ok"


@pytest.mark.parametrize("watched", [True, False])
@pytest.mark.parametrize("asks", ["program", "shutdown", "hook"])
def test_a_root_that_was_asked_before_it_began_makes_no_attempt(clock, asks, watched):
    state = Fails(9, "preempted")
    sm = smachpy.StateMachine(["ok", "aborted", "preempted"], retry=(3, 0.0, "preempted"))
    sm.add("A", state)
    events = []
    if watched:
        sm.subscribe(events.append)
    if asks == "hook":
        smachpy.set_options(sm, on_enter=lambda _userdata: sm.request_preempt())
    with use_shutdown(Shutdown()) as shutdown:
        if asks == "shutdown":
            shutdown.request()
        elif asks == "program":
            sm.request_preempt()
        assert sm.execute() == "preempted"
    assert state.runs == 0
    assert not [e for e in events if isinstance(e, Retried)]
    smachpy.set_options(sm, on_enter=None)
    state.left = 0
    assert sm.execute() == "ok"


def test_a_root_that_is_asked_between_two_attempts_makes_no_third_one(clock):
    state = Fails(9, "aborted")
    again = smachpy.Retry(5, 0, ["aborted", "preempted"])
    sm, events = root_of(state, retry=again)
    sm.register_outcomes(["aborted"])
    sm.subscribe(lambda event: sm.request_preempt() if isinstance(event, Retried) else None)
    assert sm.execute() == "preempted"
    assert state.runs == 1
    assert len([e for e in events if isinstance(e, Retried)]) == 1


def test_timeout_of_the_root_that_comes_too_late_does_not_end_the_next_run():
    asking, over, asked = threading.Event(), threading.Event(), threading.Event()

    class Held(smachpy.StateMachine):
        def request_preempt(self, **options):
            asking.set()
            over.wait(0.1)  # the run ends meanwhile, unless it waits for this
            super().request_preempt(**options)
            asked.set()

    def wait(userdata):
        assert asking.wait(60.0)
        return "ok"

    with use_clock(RealClock()):
        sm = Held(["ok", "preempted"], timeout=0.001)
        sm.add("A", smachpy.CBState(wait, outcomes=["ok"]))
        sm.execute()
        over.set()
        assert asked.wait(60.0)
        smachpy.set_options(sm, timeout=None)
        assert sm.execute() == "ok"


class Stone(smachpy.State):
    """Cannot be broken into, in virtual time either; ends some day."""

    def execute(self, userdata):
        end = current_clock().now() + 500.0
        while current_clock().now() < end:
            with contextlib.suppress(BaseException):
                current_clock().sleep(end - current_clock().now())
        return "ok"


@pytest.mark.parametrize("asked_at", [None, 2.5])
@pytest.mark.parametrize("where", ["branch", "machine in a branch", "root in a task"])
def test_timeout_of_what_must_be_left_behind(clock, where, asked_at):
    """Its outcome, unless somebody asked it to stop meanwhile."""
    limits = {"timeout": 2.0, "timeout_outcome": "late", "preempt_timeout": 1.0}
    sm, _ = root_of(Stone(["ok"]), **limits)
    if where == "branch":
        sm = beside(Stone(["ok"], **limits), outcome_map={"aborted": {"C0": "late"}})
    elif where == "machine in a branch":
        sm = beside(sm, outcome_map={"aborted": {"C0": "late"}})
    if asked_at is not None:
        clock.call_later(asked_at, sm.request_preempt)
    outcomes, events = [], []
    sm.subscribe(events.append)
    clock.spawn(lambda: outcomes.append(sm.execute()), name="mission").join()
    clock.sleep(1000.0)
    assert outcomes == (["late" if sm.name else "aborted"] if asked_at is None else ["preempted"])
    ends = [e.outcome for e in events if isinstance(e, Left | Finished)]
    assert ends[-1] == outcomes[0]
    assert ends[-2] == ("preempted" if sm.name or asked_at else "late")


@pytest.mark.parametrize("outcome", ["ok", "aborted"])
def test_what_was_left_behind_has_no_other_attempt_and_no_hook(clock, outcome):
    """It was executed again, maybe after the end of the mission, if it returned in the end."""
    ends = []

    class Again(Stone):
        attempts = 0

        def execute(self, userdata):
            self.attempts += 1
            super().execute(userdata)
            return outcome

    state = Again(
        ["ok", "aborted"], preempt_timeout=1.0, retry=3, on_exit=lambda *_: ends.append(1)
    )
    sm = beside(state)
    clock.call_later(2.5, sm.request_preempt)
    clock.spawn(sm.execute, name="mission").join()
    clock.sleep(3000.0)
    assert (state.attempts, ends) == (1, [])


def test_timeout_in_a_concurrence_ends_that_branch_only(clock):
    both = smachpy.Concurrence(["done", "mixed"], "done", outcome_map={"mixed": {"A": "aborted"}})
    both.add("A", Waits(10.0, timeout=1.0))
    both.add("B", Waits(3.0))
    assert both.execute() == "mixed"
    assert clock.now() == 3.0


@pytest.mark.parametrize("backoff", [0.0, 1e-300])
def test_attempts_have_no_limit_but_the_given_one(backoff):
    """The 1,025th ended the mission: OverflowError."""
    state = Fails(1500, "aborted", retry=(2000, backoff))
    assert (run(state)[0], state.runs) == ("ok", 1501)


@pytest.mark.parametrize("spec", [3, (3,), (3, 0.0), smachpy.Retry(3, on=("aborted",))])
def test_retry_on_an_outcome(spec):
    state = Fails(2, "aborted", retry=spec)
    outcome, events = run(state)
    assert (outcome, state.runs) == ("ok", 3)
    assert [(e.attempt, e.reason) for e in events if isinstance(e, Retried)] == [
        (1, "aborted"),
        (2, "aborted"),
    ]


def test_each_attempt_of_a_machine_hands_out_its_outputs_and_begins_with_its_own_userdata():
    """As SMACH does at each end, whatever the outcome."""
    seen = []

    @smachpy.state(["done", "aborted"], io_keys=["count", "own"])
    def work(userdata):
        userdata.count += 1
        userdata.own += 1
        seen.append((userdata.count, userdata.own))
        return "done" if userdata.count == 3 else "aborted"

    inner = smachpy.StateMachine(
        ["done", "aborted"], ["count"], ["count"], userdata={"own": 0}, retry=5
    )
    inner.add("WORK", work)
    sm = smachpy.StateMachine(["done", "aborted"], userdata={"count": 0})
    sm.add("INNER", inner)
    assert sm.execute() == "done"
    assert seen == [(1, 1), (2, 1), (3, 1)]
    assert sm.userdata.count == 3


def test_retry_on_an_exception_backs_off_twice_as_long_each_time(clock):
    state = Fails(3, retry=(4, 1.0, [ValueError]))
    assert run(state)[0] == "ok"
    assert clock.now() == 1.0 + 2.0 + 4.0


def test_retry_gives_up(clock):
    assert run(Fails(9, "aborted", retry=3))[0] == "aborted"
    with pytest.raises(smachpy.InvalidUserCodeError, match="motor"):
        run(Fails(9, retry=(3, 0.0, ValueError)))


class FailsLate(Fails):
    """Fails after three seconds, whoever asks it to stop meanwhile."""

    def execute(self, userdata):
        self.clock().sleep(3.0)
        return super().execute(userdata)


class FailsAsync(Fails):
    async def execute(self, userdata):
        return super().execute(userdata)


def flaky(kind, result):
    """A state that waits for its second attempt, or is in its first one, between 0 s and 3 s."""
    options = {"retry": (9, 100.0, OSError if isinstance(result, Exception) else result)}
    if kind == "container":
        return within(Fails(9, result), **options)
    state = {"waits": Fails, "runs": FailsLate, "async": FailsAsync}[kind](9, result, **options)
    state.register_outcomes(["preempted"])
    return state


REQUESTS = {
    "request": (lambda sm: sm.request_preempt(), "cleaned"),
    "operator": (lambda sm: sm.control.preempt("/M/IN/FLAKY"), "cleaned"),
    "forced": (lambda sm: sm.control.force_outcome("/M/IN/FLAKY", "ok"), "ok"),
    "jump": (lambda sm: sm.control.jump("/M/IN/NEXT"), "jumped"),
}


@pytest.mark.parametrize("result", ["aborted", OSError("busy")], ids=["outcome", "exception"])
@pytest.mark.parametrize("kind", ["waits", "runs", "async", "container"])
@pytest.mark.parametrize("asks", REQUESTS)
def test_a_request_to_a_state_that_would_run_again_ends_it_preempted(clock, result, kind, asks):
    """It raised the error that `retry` covers, past every choice of the operator's."""
    inner = smachpy.StateMachine(["ok", "aborted", "cleaned", "jumped", "preempted"])
    inner.add("FLAKY", flaky(kind, result), {"preempted": "CLEAN_UP"})
    inner.add("CLEAN_UP", Waits(1.0), {"ok": "cleaned"})
    inner.add("NEXT", Waits(1.0), {"ok": "jumped"})
    sm = smachpy.StateMachine(["ok", "aborted", "cleaned", "jumped", "preempted"], name="M")
    sm.add("IN", inner)
    ask, outcome = REQUESTS[asks]
    clock.call_later(1.0, lambda: ask(sm))
    assert sm.execute() == outcome
    began = 3.0 if kind == "runs" else 1.0
    assert clock.now() == began + (0.0 if outcome == "ok" else 1.0)


@pytest.mark.parametrize("result", ["aborted", OSError("busy")], ids=["outcome", "exception"])
@pytest.mark.parametrize("kind", ["waits", "runs", "async", "container"])
def test_a_sibling_or_a_timeout_stops_a_state_that_would_run_again(clock, result, kind):
    both = smachpy.Concurrence(
        ["ok", "failed"],
        "failed",
        outcome_map={"ok": {"DRIVE": "ok", "WATCH": "preempted"}},
        child_termination_cb=lambda _: True,
    )
    both.add("DRIVE", Waits(1.0))
    both.add("WATCH", flaky(kind, result))
    assert both.execute() == "ok"
    limited = within(flaky(kind, result), timeout=1.0, timeout_outcome="late")
    assert run(limited)[0] == "late"


def test_exceptions_become_outcomes():
    assert run(Fails(1, on_exception={ValueError: "aborted"}))[0] == "aborted"
    assert run(Fails(1, KeyError("x"), on_exception={LookupError: "lost"}))[0] == "lost"
    with pytest.raises(smachpy.InvalidUserCodeError):
        run(Fails(1, on_exception={OSError: "aborted"}))


@pytest.mark.parametrize("kind", [KeyboardInterrupt, SystemExit, GeneratorExit, object])
def test_what_ends_a_program_becomes_no_outcome_and_no_other_attempt(kind):
    """It was accepted, and had no effect."""
    with pytest.raises(smachpy.InvalidStateError, match="on_exception: got <class"):
        Fails(1, on_exception={kind: "aborted"})
    with pytest.raises(smachpy.InvalidStateError, match="retry: on: got"):
        Fails(1, retry=(3, 0.0, ["aborted", kind]))


@pytest.mark.parametrize("kind", [Exception, BaseException, BaseExceptionGroup])
def test_exceptions_of_all_kinds_become_outcomes(kind):
    error = ExceptionGroup("two", [ValueError("a"), OSError("b")])
    assert run(Fails(1, error, on_exception={kind: "aborted"}))[0] == "aborted"


def test_exceptions_of_children_become_outcomes_of_the_container():
    inner = smachpy.StateMachine(["ok", "aborted"], on_exception={ValueError: "broken"})
    inner.add("F", Fails(1))
    assert run(inner)[0] == "broken"


def within(state, **options):
    sm = smachpy.StateMachine(["ok", "aborted", "preempted"], **options)
    sm.add("IN", state)
    return sm


@pytest.mark.parametrize("around", [within, beside, lambda s, **o: beside(within(s), **o)])
def test_a_container_is_run_again_for_what_its_children_raise(around):
    state = Fails(2, OSError("busy"))
    assert run(around(state, retry=(3, 0.0, OSError)))[0] == "ok"
    assert state.runs == 3
    state = Fails(9, OSError("busy"))
    with pytest.raises(smachpy.InvalidUserCodeError, match="busy"):
        run(around(state, retry=(3, 0.0, ValueError)))
    assert state.runs == 1
    assert run(around(Fails(9, OSError("busy")), on_exception={OSError: "broken"}))[0] == "broken"


def test_of_several_children_that_raise_none_is_lost(clock):
    class LaterToo(Fails):
        def execute(self, userdata):
            self.sleep(1.0)
            return super().execute(userdata)

    def both(error, **options):
        return beside(Fails(1, OSError("busy")), LaterToo(1, error), **options)

    assert run(both(OSError("too"), on_exception={OSError: "broken"}))[0] == "broken"
    with pytest.raises(smachpy.InvalidUserCodeError, match="motor"):
        run(both(ValueError("motor"), on_exception={OSError: "broken"}))
    with pytest.raises(smachpy.InvalidUserCodeError, match="motor"):
        run(both(ValueError("motor"), retry=(3, 0.0, OSError)))
    assert run(both(ValueError("motor"), retry=(3, 0.0, [OSError, ValueError])))[0] == "ok"


@pytest.mark.parametrize("around", [within, beside, lambda s, **o: beside(within(s), **o)])
def test_a_group_that_a_child_itself_raises_is_one_error(around):
    def fails():
        return Fails(1, ExceptionGroup("both wheels", [OSError("left"), ValueError("right")]))

    assert run(around(fails(), on_exception={ExceptionGroup: "broken"}))[0] == "broken"
    assert run(around(fails(), retry=(2, 0.0, ExceptionGroup)))[0] == "ok"
    with pytest.raises(smachpy.InvalidUserCodeError, match="both wheels"):
        run(around(fails(), on_exception={OSError: "broken", ValueError: "broken"}))


def test_the_group_that_a_concurrence_makes_of_errors_can_be_asked_for():
    def fails(**options):
        return beside(Fails(1, OSError("busy")), Fails(1), **options)

    assert run(fails(on_exception={ExceptionGroup: "broken"}))[0] == "broken"
    assert run(within(fails(), on_exception={ExceptionGroup: "broken"}))[0] == "broken"
    # The first to fail may stop the other before it has: that one fails at the next attempt.
    assert run(fails(retry=(3, 0.0, ExceptionGroup)))[0] == "ok"


def test_hooks_run_around_the_state():
    heard = []
    state = smachpy.State(["ok"])
    state.execute = lambda ud: heard.append("run") or "ok"
    smachpy.set_options(
        state,
        on_enter=lambda ud: heard.append("enter"),
        on_exit=lambda ud, outcome: heard.append(("exit", outcome)),
    )
    assert run(state)[0] == "ok"
    assert heard == ["enter", "run", ("exit", "ok")]


@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize("breaks", [False, True])
def test_a_state_that_raises_is_left_through_its_hook(caplog, nested, breaks):
    heard = []

    class Grips(smachpy.State):
        def on_enter(self, userdata):
            heard.append("on")

        def execute(self, userdata):
            raise OSError("no current")

        def on_exit(self, userdata, outcome):
            heard.append(("off", outcome))
            if breaks:
                raise ValueError("stuck")

    state = Grips(["ok"])
    if nested:
        inner = smachpy.StateMachine(
            ["ok"], on_exit=lambda ud, outcome: heard.append(("out", outcome))
        )
        inner.add("IN", state)
        state = inner

    with pytest.raises(smachpy.InvalidUserCodeError, match="no current"):
        run(state)

    assert heard == ["on", ("off", None), *([("out", None)] if nested else [])]
    assert ("hook Grips.on_exit" in caplog.text and "stuck" in caplog.text) == breaks


@pytest.mark.parametrize("asks", ["preempt", "timeout", "operator"])
def test_a_state_that_was_interrupted_is_left_through_its_hook(clock, asks):
    """A light that on_enter had switched on stayed on, if a preempt had to interrupt the state."""
    heard = []

    class Deaf(smachpy.State):
        def on_enter(self, userdata):
            heard.append("on")

        def execute(self, userdata):
            current_clock().sleep(100.0)
            return "ok"

        def on_exit(self, userdata, outcome):
            heard.append(("off", outcome))

    limit = 2.0 if asks == "timeout" else None
    state = Deaf(["ok", "aborted"], preempt_timeout=1.0, timeout=limit)
    sm = smachpy.StateMachine(["ok", "aborted", "preempted"])
    sm.add("A", state)
    ask = {
        "preempt": sm.request_preempt,
        "operator": lambda: sm.control.preempt("/SM_ROOT/A"),
        "timeout": lambda: None,
    }[asks]
    asked = clock.spawn(lambda: (clock.sleep(2.0), ask()), name="asks")
    ended = {"timeout": "aborted"}.get(asks, "preempted")

    assert sm.execute() == ended
    asked.join()

    assert heard == ["on", ("off", ended)]
    assert clock.now() == 3.0


@pytest.mark.parametrize("finishes", [True, False])
@pytest.mark.parametrize(
    "step", ["has_answered", "service", "take_back", "happen", "settle", "cancel"]
)
def test_an_interruption_at_the_end_of_an_attempt_changes_no_result(
    clock, monkeypatch, step, finishes
):
    """The grace ended just as the state had returned: its result was lost."""
    late, ended, inside = [], [], []
    real_end, kind = Timeout.end, Visit
    if step == "cancel":
        kind = type(clock.call_later(0.0, lambda: None))
    real = getattr(kind, step)

    def end(self, result):
        if not ended:
            ended.append(result)
            late.append(step)
        inside.append(self)
        try:
            return real_end(self, result)
        finally:
            inside.pop()

    def interrupted(self, *arguments):
        if late and inside:
            late.clear()
            raise Interruption
        return real(self, *arguments)

    class Slow(smachpy.State):
        def execute(self, userdata):
            assert self.wait_preempt(50.0)
            return "ok" if finishes else "preempted"

    monkeypatch.setattr(Timeout, "end", end)
    monkeypatch.setattr(kind, step, interrupted)
    outcome, _ = run(Slow(["ok", "preempted", "aborted"], timeout=2.0))
    assert outcome == ("ok" if finishes else "aborted")
    assert late == (["service"] if step == "service" and finishes else [])  # it was not called


def test_a_state_whose_exception_is_an_outcome_is_left_with_that():
    heard = []

    def fails(userdata):
        raise OSError("no current")

    state = smachpy.CBState(
        fails,
        outcomes=["failed"],
        on_exception={OSError: "failed"},
        on_exit=lambda ud, outcome: heard.append(outcome),
    )

    assert run(state)[0] == "failed"
    assert heard == ["failed"]


def test_hooks_may_be_methods_and_failures_name_them():
    class Hooked(smachpy.State):
        def on_enter(self, userdata):
            raise ValueError("door")

        def execute(self, userdata):
            return "ok"

    with pytest.raises(
        smachpy.InvalidUserCodeError, match=r"/SM_ROOT/A: hook Hooked\.on_enter.*door"
    ):
        run(Hooked(["ok"]))


def test_unknown_options_are_told():
    with pytest.raises(TypeError, match=r"unknown arguments \['timeuot'\]"):
        smachpy.State(["ok"], timeuot=1)


@pytest.mark.parametrize(
    "options",
    [{"timeout": -1.0}, {"retry": 0}, {"retry": "x"}, {"retry": (1, -1.0)}, {"retry": (1, 0, 5)}],
)
def test_options_without_meaning_are_told(options):
    with pytest.raises((smachpy.InvalidStateError, TypeError)):
        smachpy.State(["ok"], **options)


def test_async_states_use_the_clock(clock):
    class Drives(smachpy.State):
        async def execute(self, userdata):
            await asyncio.sleep(5.0)
            return "ok"

    assert run(Drives(["ok"]))[0] == "ok"
    assert clock.now() == 5.0


def test_async_states_raise_as_others_do(clock):
    class Drives(smachpy.State):
        async def execute(self, userdata):
            raise ValueError("motor")

    with pytest.raises(smachpy.InvalidUserCodeError, match="motor"):
        run(Drives(["ok"]))


def test_async_states_with_timeout(clock):
    class Drives(smachpy.State):
        async def execute(self, userdata):
            await asyncio.sleep(500.0)
            return "ok"

    assert run(Drives(["ok"], timeout=2.0))[0] == "aborted"
    assert clock.now() == 2.0


def test_functions_become_states(clock):
    @smachpy.state(outcomes=["charged", "preempted"], io_keys=["level"])
    def charge(userdata):
        """Charge the battery."""
        state = smachpy.current_state()
        if state.sleep(1.0):
            return "preempted"
        userdata.level += 1
        return "charged"

    sm = smachpy.StateMachine(["charged", "preempted"])
    sm.userdata.level = 0
    sm.add("CHARGE", charge)
    assert sm.execute() == "charged"
    assert sm.userdata.level == 1
    assert charge.__doc__ == "Charge the battery."
    clock.call_later(0.5, sm.request_preempt)
    assert sm.execute() == "preempted"


def test_async_functions_become_states(clock):
    @smachpy.state(outcomes=["ok"], timeout=1.0)
    async def drive(userdata):
        await asyncio.sleep(5.0)
        return "ok"

    assert run(drive)[0] == "aborted"


def test_cb_interface_on_callbacks():
    @smachpy.cb_interface(outcomes=["ok"], input_keys=["x"], output_keys=["y"])
    def double(ud, factor, *, plus):
        ud.y = ud.x * factor + plus
        return "ok"

    state = smachpy.CBState(double, [2], {"plus": 1}, outcomes=["other"])
    assert state.get_registered_outcomes() == ("other", "ok")
    sm = smachpy.StateMachine(["ok", "other"])
    sm.userdata.x = 4
    sm.add("A", state)
    sm.execute()
    assert sm.userdata.y == 9


# -- a timeout belongs to one attempt ------------------------------------------------------------


class Listens(smachpy.State):
    """Stops when it is asked to; `says` whether it says so."""

    def __init__(self, seconds, *, says, **options):
        super().__init__(["ok", "preempted"], **options)
        self.seconds = list(seconds)
        self.says = says
        self.runs = 0

    def execute(self, userdata):
        self.runs += 1
        if self.sleep(self.seconds.pop(0)):
            if self.says:
                self.service_preempt()
            return "preempted"
        return "ok"


@pytest.mark.parametrize("says", [True, False])
def test_an_attempt_that_ran_into_its_timeout_is_made_again(clock, says):
    state = Listens([9.0, 9.0, 1.5], says=says, timeout=2.0, retry=smachpy.Retry(4, 0, ["aborted"]))
    outcome, events = run(state)
    assert outcome == "ok"
    assert (state.runs, clock.now()) == (3, 5.5)
    assert [e.reason for e in events if isinstance(e, Retried)] == ["aborted", "aborted"]


def test_the_grace_of_an_earlier_attempt_does_not_end_a_later_one(clock):
    state = Listens(
        [9.0, 1.5],
        says=True,
        timeout=2.0,
        preempt_timeout=1.0,
        retry=smachpy.Retry(4, 0, ["aborted"]),
    )
    outcome, events = run(state)
    assert outcome == "ok"
    assert clock.now() == 3.5
    assert not [e for e in events if isinstance(e, Abandoned)]


def test_an_interrupted_attempt_is_made_again(clock):
    class Deaf(smachpy.State):
        runs = 0

        def execute(self, userdata):
            self.runs += 1
            current_clock().sleep(100.0 if self.runs == 1 else 1.5)
            return "ok"

    state = Deaf(["ok"], timeout=2.0, preempt_timeout=1.0, retry=smachpy.Retry(2, 0, ["aborted"]))
    outcome, events = run(state)
    assert (outcome, clock.now(), state.runs) == ("ok", 4.5, 2)
    assert len([e for e in events if isinstance(e, Abandoned)]) == 1


@pytest.mark.parametrize("says", [True, False])
@pytest.mark.parametrize("asked_at", [1.0, 2.0, 2.5, 3.0])
def test_a_preempt_from_above_is_not_taken_back_with_a_timeout(clock, says, asked_at):
    """It comes before, at, or while the state cleans up after its timeout at 2 s."""

    class Tidies(Listens):
        def execute(self, userdata):
            outcome = super().execute(userdata)
            current_clock().sleep(1.5)
            return outcome

    state = Tidies([9.0] * 5, says=says, timeout=2.0, retry=smachpy.Retry(5, 0, ["aborted"]))
    sm = smachpy.StateMachine(["ok", "preempted", "aborted"])
    sm.add("A", state)
    clock.call_later(asked_at, sm.request_preempt)
    outcome = sm.execute()
    assert state.runs == 1
    assert outcome in {"preempted", "aborted"}
    assert not state.preempt_requested()
    assert not sm.preempt_requested()


@pytest.mark.parametrize("asked_at", [1.0, 2.0, 2.5])
def test_a_concurrence_that_calls_a_child_off_is_obeyed_beside_its_timeout(clock, asked_at):
    class Tidies(Listens):
        def execute(self, userdata):
            outcome = super().execute(userdata)
            current_clock().sleep(1.0)
            return outcome

    state = Tidies([9.0] * 5, says=True, timeout=2.0, retry=smachpy.Retry(5, 0, ["aborted"]))
    both = smachpy.Concurrence(["ok"], "ok", child_termination_cb=lambda outcomes: True)
    with both:
        both.add("A", state)
        both.add("B", Waits(asked_at))
    both.execute()
    assert state.runs == 1


def test_a_coroutine_that_is_cancelled_by_no_preempt_has_failed(clock):
    async def cancels_itself(_userdata):
        asyncio.current_task().cancel()
        await asyncio.sleep(1.0)

    async def awaits_what_is_cancelled(_userdata):
        task = asyncio.ensure_future(asyncio.sleep(1.0))
        task.cancel()
        await task

    for function in (cancels_itself, awaits_what_is_cancelled):
        state = smachpy.CBState(function, outcomes=["ok"])
        with pytest.raises(smachpy.InvalidUserCodeError, match="cancelled") as caught:
            run(state)
        assert caught.value.path == "/SM_ROOT/A"
        mapped = smachpy.CBState(function, outcomes=["ok"], on_exception={RuntimeError: "failed"})
        assert run(mapped)[0] == "failed"


@pytest.mark.parametrize("names", [None, 5, True, [["a"]]])
def test_what_is_no_list_of_names_is_told(names):
    with pytest.raises(smachpy.InvalidStateError, match=r"outcomes: got .*; expected strings"):
        smachpy.State(outcomes=names)


def test_a_state_without_execute_says_what_to_define():
    class Empty(smachpy.State):
        def __init__(self):
            super().__init__(["done"])

    machine = smachpy.StateMachine(["done"], name="M")
    machine.add("A", Empty())
    with pytest.raises(
        smachpy.InvalidUserCodeError, match=r"/M/A: .*def execute\(self, userdata\)"
    ):
        machine.execute()


def test_an_exception_that_becomes_an_outcome_is_logged_with_its_reason(caplog):
    @smachpy.state(["held"], on_exception={OSError: "failed"})
    def hold(_userdata):
        raise OSError("no answer from the gripper")

    machine = smachpy.StateMachine(["held", "failed"], name="M")
    machine.add("HOLD", hold)
    with caplog.at_level(logging.WARNING, logger="smachpy"):
        assert machine.execute() == "failed"
    (record,) = caplog.records
    assert record.getMessage() == (
        "/M/HOLD: OSError: no answer from the gripper; on_exception makes it 'failed'"
    )


@pytest.mark.parametrize("kind", ["state", "machine"])
def test_on_exit_is_called_after_sys_exit(kind):
    """What `on_enter` had switched on stayed on."""
    heard = []
    hooks = {
        "on_enter": lambda ud: heard.append("on"),
        "on_exit": lambda ud, outcome: heard.append(outcome),
    }

    def leave(ud):
        raise SystemExit(3)

    state = smachpy.CBState(leave, outcomes=["ok"], **(hooks if kind == "state" else {}))
    inner = smachpy.StateMachine(["ok"], **(hooks if kind == "machine" else {}))
    inner.add("A", state)
    with pytest.raises(SystemExit):
        inner.execute()
    assert heard == ["on", None]
