"""Nothing is said of code that is right, or that may be: one test for each way to be so."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import os
import runpy
import threading
import time

import pytest

import smachpy
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy import CBState, Concurrence, SimpleActionState, State, StateMachine, current_state
from smachpy.checks import IgnoreError, check


def rules(child, outcomes=("done", "failed", "preempted")):
    """Return the rules that a machine of this one child breaks, by the child's own doing."""
    sm = StateMachine(outcomes, name="M")
    sm.add("A", child)
    found = check(sm, enable=["no-timeout"])
    return [p.rule for p in found.problems if p.path.startswith("/M/")]


def hint_of(child):
    sm = StateMachine(["done", "preempted"], name="M")
    sm.add("A", child)
    (problem,) = [p for p in check(sm).problems if p.rule == "deaf-loop"]
    return problem.hint


# -- loops -----------------------------------------------------------------------------------------


def polls(ud):
    me = smachpy.current_state()
    while not me.sleep(1.0):
        if os.path.exists("/x"):
            return "done"
    return "preempted"


def stopped():
    return current_state().preempt_requested()


def asks_a_helper(ud):
    while not stopped():
        time.sleep(1)
    return "done"


stopped_too = functools.partial(stopped)


def asks_a_helper_of_another_kind(ud):
    while not stopped_too():
        time.sleep(1)
    return "done"


def calls_what_it_is_given(ud):
    ready = ud.ready
    while not ready():
        time.sleep(1)
    return "done"


def joins_paths(ud):
    for name in ud.names:
        print(os.path.join("/tmp", name))
    return "done"


def takes_a_lock(ud):
    lock = threading.Lock()
    for _ in range(30):
        lock.acquire()
        lock.release()
    return "done"


def blinks(ud):
    for _ in range(3):
        time.sleep(0.1)
    return "done"


def blinks_all(ud):
    for led in ud.leds:
        led.on()
        time.sleep(0.1)
    return "done"


@pytest.mark.parametrize(
    "function",
    [
        polls,
        asks_a_helper,
        asks_a_helper_of_another_kind,
        calls_what_it_is_given,
        joins_paths,
        takes_a_lock,
        blinks,
        blinks_all,
    ],
)
def test_a_loop_that_may_look_at_the_preempt_or_is_over_soon(function):
    assert rules(CBState(function, outcomes=["done"])) == []


class Renamed(State):
    def execute(self, ud):
        me = self
        while not me.sleep(1.0):
            pass
        return "done"


class HandsALookOn(State):
    def execute(self, ud):
        while not ud.wait(lambda: self.preempt_requested()):
            time.sleep(1)
        return "done"


class StopsItsOwnWay(State):
    def request_preempt(self):
        self.stop = True
        super().request_preempt()

    def execute(self, ud):
        self.stop = False
        while not self.stop:
            time.sleep(1)
        return "done"


@pytest.mark.parametrize("kind", [Renamed, HandsALookOn, StopsItsOwnWay])
def test_a_loop_of_a_class_that_may_look_at_the_preempt(kind):
    assert rules(kind(["done"])) == []


def deaf(ud):
    while not os.path.exists("/x"):
        time.sleep(0.1)
    return "done"


def deaf_for_long(ud):
    for _ in range(20):
        time.sleep(0.5)
    return "done"


def waits_for_threads(ud):
    for thread in ud.threads:
        thread.join()
    return "done"


@pytest.mark.parametrize("function", [deaf, deaf_for_long, waits_for_threads])
def test_a_loop_that_is_deaf_is_told(function):
    assert rules(CBState(function, outcomes=["done"])) == ["deaf-loop"]


def test_the_hint_fits_a_function_as_it_does_a_class():
    class Deaf(State):
        def execute(self, ud):
            while not os.path.exists("/x"):
                time.sleep(0.1)
            return "done"

    assert "self.sleep" in hint_of(Deaf(["done"]))
    assert "self." not in hint_of(CBState(deaf, outcomes=["done"]))
    assert "smachpy.current_state().sleep" in hint_of(CBState(deaf, outcomes=["done"]))


def test_a_comment_in_a_function_switches_a_rule_off():
    def short(ud):
        while not os.path.exists("/x"):  # smachpy: ignore[deaf-loop] the file is there soon
            time.sleep(0.1)
        return "done"

    assert rules(CBState(short, outcomes=["done"])) == []
    assert rules(smachpy.state(outcomes=["done"])(short)) == []

    def wrong(ud):
        return "done"  # smachpy: ignore[daef-loop] never mind

    with pytest.raises(IgnoreError, match="comment in function wrong"):
        rules(CBState(wrong, outcomes=["done"]))


# -- waits -----------------------------------------------------------------------------------------


async def waits_for_five_seconds(ud):
    try:
        await asyncio.wait_for(ud.event.wait(), 5)
    except TimeoutError:
        return "failed"
    return "done"


async def waits_with_a_limit_around(ud):
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(5):
            await ud.event.wait()
            return "done"
    return "failed"


async def waits_in_a_task(ud):
    task = asyncio.ensure_future(ud.event.wait())
    _, late = await asyncio.wait({task}, timeout=5)
    return "failed" if late else "done"


@pytest.mark.parametrize(
    "function", [waits_for_five_seconds, waits_with_a_limit_around, waits_in_a_task]
)
def test_a_wait_that_something_around_it_limits(function):
    assert rules(CBState(function, outcomes=["done", "failed"])) == []


async def waits(ud):
    await ud.event.wait()
    return "done"


async def waits_below_a_limit_of_none(ud):
    async with asyncio.timeout(None):
        await ud.event.wait()
    return "done"


@pytest.mark.parametrize("function", [waits, waits_below_a_limit_of_none])
def test_a_coroutine_s_wait_without_a_limit_is_told(function):
    assert rules(CBState(function, outcomes=["done"])) == ["no-timeout"]


# -- outcomes --------------------------------------------------------------------------------------


def hears(ud):
    result = "failed"

    def on_message(message):
        nonlocal result
        result = "done"

    ud.subscribe(on_message)
    return result


def matches(ud):
    out = "failed"
    match ud.words:
        case [out]:
            pass
        case {"out": "x", **out}:
            pass
    return out


def is_given(ud, out="done"):
    if ud:
        out = "failed"
    return out


@pytest.mark.parametrize("function", [hears, matches, is_given])
def test_an_outcome_that_gets_its_value_elsewhere(function):
    assert rules(CBState(function, outcomes=["done", "failed"])) == []


# -- userdata --------------------------------------------------------------------------------------


def helper(ud):
    return ud.n if "n" in ud else 0


def hands_on(ud):
    helper(ud)
    return "done"


def tries(ud):
    try:
        ud.total = ud.n
    except KeyError:
        ud.total = 0
    return "done"


def suppresses(ud):
    with contextlib.suppress(KeyError):
        print(ud.n)
    return "done"


def counts(ud):
    if ud.first:
        ud.n = 0
    ud.n += 1
    return "done"


def writes_in_a_block(ud):
    with open(os.devnull):
        ud.n = 1
        print(ud.n)
    return "done"


def reads_the_last_pass(ud):
    for i in range(3):
        if i:
            print(ud.n)
        ud.n = i
    return "done"


def reads_later(ud):
    def read():
        return ud.n

    ud.n = 1
    read()
    return "done"


@pytest.mark.parametrize(
    "function",
    [
        hands_on,
        tries,
        suppresses,
        counts,
        writes_in_a_block,
        reads_the_last_pass,
        reads_later,
        lambda ud: "done",
    ],
)
def test_a_key_that_may_have_a_value_or_do_without(function):
    assert rules(CBState(function, outcomes=["done"], io_keys=["n"])) in ([], ["unread-key"])


def test_a_key_that_the_class_below_may_read():
    class Base(State):
        def execute(self, ud):
            return "done" if "n" in ud else "failed"

    class Above(Base):
        def execute(self, ud):
            return super().execute(ud)

    assert rules(Above(["done", "failed"], input_keys=["n"])) == []


def adds(ud):
    ud.n += 1
    return "done"


def reads_then_writes(ud):
    ud.n = ud.n + 1
    return "done"


def reads_in_a_handler(ud):
    try:
        os.stat("/x")
    except OSError:
        return ud.n
    return "done"


@pytest.mark.parametrize("function", [adds, reads_then_writes, reads_in_a_handler])
def test_a_key_that_is_certainly_read_is_told(function):
    assert "unset-key" in rules(CBState(function, outcomes=["done"], io_keys=["n"]))


def test_a_goal_s_keys_are_certainly_read_and_its_callback_s_only_if_it_reads_them():
    def goal_cb(ud, goal):
        goal.target_pose.header.frame_id = ud.frame

    def drive(**options):
        state = SimpleActionState("move_base", MoveBaseAction, exec_timeout=9.0, **options)
        sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
        sm.add("A", state)
        return [p.rule for p in check(sm).problems]

    assert drive(goal_slots=["target_pose"]) == ["unset-key"]
    assert drive(goal_key="goal") == ["unset-key"]
    assert drive(goal_cb=goal_cb, input_keys=["frame"]) == ["unset-key"]
    assert drive(goal_cb=goal_cb, input_keys=["more"]) == []


# -- containers ------------------------------------------------------------------------------------


class Ends(State):
    """Ends with anything it declares."""

    def execute(self, ud):
        return self.choose()

    def choose(self):
        return self.get_registered_outcomes()[0]


def test_a_root_that_tidies_up_after_a_preempt_passes_it_on_to_nobody():
    sm = StateMachine(["done", "stopped", "preempted"], name="M")
    with sm:
        sm.add("DRIVE", Ends(["done", "preempted"]), {"preempted": "STOP"})
        sm.add("STOP", Ends(["stopped"]))
    assert check(sm).ok


def test_rules_that_hold_at_once_behind_an_outcome_callback():
    def both(**options):
        made = Concurrence(
            ["a", "b"], "a", outcome_map={"a": {"X": "ok"}, "b": {"Y": "ok"}}, **options
        )
        with made:
            made.add("X", Ends(["ok", "no"]))
            made.add("Y", Ends(["ok", "no"]))
        return [p.rule for p in check(made).problems]

    assert both() == ["ambiguous-map"]
    assert both(outcome_cb=lambda outcomes: "a") == []


# -- values that change, and keys that others write ------------------------------------------------


def changed_before_it_is_returned(ud):
    result = "first"
    if ud.x:
        result = "done"
    return result


def changed_when_it_is_tested(ud):
    result = "first" if ud.x else "other"
    while result == "first" or result != "done":
        result = "done"
    return result


def changed_in_a_handler(ud):
    result = "first"
    try:
        result = "done"
    except ValueError:
        result = "failed"
    return result


def looked_up_before_it_is_returned(ud):
    result = "first"
    table = {"first": "done"}
    return table[result]


def changed_in_a_loop(ud):
    result = "first"
    for result in ("done", "failed"):
        print(result)
    return result


@pytest.mark.parametrize(
    "function",
    [
        changed_before_it_is_returned,
        changed_when_it_is_tested,
        changed_in_a_handler,
        looked_up_before_it_is_returned,
        changed_in_a_loop,
    ],
)
def test_a_value_that_may_change_before_the_return_is_not_certain(function):
    child = CBState(function, outcomes=["done", "failed"], input_keys=["x"])
    assert "undeclared-outcome" not in rules(child)


def last_value(ud):
    result = "done"
    if ud.x:
        result = "finished"
    return result


def value_of_a_branch(ud):
    if ud.x:
        result = "done"
    else:
        print("late")
        result = "finished"
    return result


@pytest.mark.parametrize("function", [last_value, value_of_a_branch])
def test_the_last_value_before_the_return_is_certain(function):
    child = CBState(function, outcomes=["done", "failed"], input_keys=["x"])
    assert "undeclared-outcome" in rules(child)


ASIDE = """
import smachpy

work = smachpy.StateMachine(["done"], name="WORK")


def heard(message):
    {write}


def obey(ud):
    print(ud.order)
    return "done"


work.add("OBEY", smachpy.CBState(obey, outcomes=["done"], input_keys=["order"]))
"""


@pytest.mark.parametrize(
    ("write", "problems"),
    [
        ('work.userdata["order"] = message', []),
        ("work.userdata.order = message", []),
        ("work.userdata[message.key] = message", []),
        ("work.userdata.update(order=message)", []),
        ("work.userdata.other = message", ["unset-key"]),
        ("sm = smachpy.StateMachine(['done']); sm.userdata.order = 1", ["unset-key"]),
        ("print(work.userdata.order)", ["unset-key"]),
    ],
)
def test_a_key_that_a_callback_of_the_file_writes_may_be_set(tmp_path, write, problems):
    file = tmp_path / "aside.py"
    file.write_text(ASIDE.format(write=write))
    names = runpy.run_path(str(file))
    found = [problem.rule for problem in check(names["work"]).problems]
    assert found == problems
