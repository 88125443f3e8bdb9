"""A planted bug of each kind is found, and nothing is said where nothing can be known."""

from __future__ import annotations

import ast
import json
import linecache
import os
import threading
import time

import pytest

import smachpy
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy import (
    CBState,
    Concurrence,
    InvalidStateError,
    Iterator,
    SimpleActionState,
    State,
    StateMachine,
    any_of,
    cb_interface,
    describe,
    when,
)
from smachpy.checks import (
    RULES,
    Ignore,
    IgnoreError,
    Place,
    Problem,
    PropertyError,
    Report,
    after_preempt,
    always_reaches,
    before,
    check,
    ignore,
    never,
)
from smachpy.checks.report import FORMATS
from smachpy.pnp import PetriNetPlan
from tests.smachpy.pnp.nets import net_of


class Leaf(State):
    """Ends with anything it declares; nobody can know which."""

    def __init__(self, *outcomes, **kwargs):
        super().__init__(outcomes or ("done",), **kwargs)
        self.next = outcomes[0] if outcomes else "done"

    def execute(self, ud):
        return self.choose(ud)

    def choose(self, ud):
        return self.next


class Reads(State):
    """Reads those of these keys that it declares."""

    def __init__(self, *keys, output_keys=()):
        super().__init__(["done"], keys, output_keys)

    def execute(self, ud):
        self.all = ud.a, ud["b"], ud.c, ud.goal, ud.i, ud.n, ud.pose
        return "done"


def machine(*children, outcomes=("done",), **kwargs):
    sm = StateMachine(outcomes, name="M", **kwargs)
    with sm.opened(check=False):
        for label, state, transitions, *remapping in children:
            sm.add(label, state, transitions, *remapping)
    return sm


def rules(found):
    return [problem.rule for problem in found.problems]


def the(found, rule):
    (problem,) = [problem for problem in found.problems if problem.rule == rule]
    return problem


def test_a_sound_machine_has_no_problems():
    class Go(State):
        def __init__(self):
            super().__init__(["done", "failed", "preempted"], io_keys=["tries"])

        def execute(self, ud):
            ud.tries = ud.tries + 1
            while not self.sleep(1):
                pass
            return "preempted" if self.preempt_requested() else "done" if ud.tries else "failed"

    sm = machine(
        ("GO", Go(), {"failed": "GO", "done": "TURN"}),
        ("TURN", Leaf("done", "failed"), {}),
        outcomes=["done", "failed", "preempted"],
    )
    sm.userdata.tries = 0
    found = check(sm)
    assert found
    assert found.ok, found
    assert found.problems == ()


# -- structure -------------------------------------------------------------------------------------


def test_inconsistent_machine():
    sm = machine(("A", Leaf(), {"done": "NOWHERE"}))
    assert rules(check(sm)) == ["inconsistent"]
    assert the(check(sm), "inconsistent").path == "/M/A"


def test_unmapped_outcome():
    found = check(machine(("A", Leaf("done", "odd"), {})))
    assert the(found, "unmapped-outcome").path == "/M/A"


def test_unreachable_state():
    found = check(machine(("A", Leaf(), {}), ("B", Leaf(), {"done": "A"})))
    assert the(found, "unreachable-state").path == "/M/B"


def test_a_state_behind_an_impossible_outcome_is_unreachable():
    def work(ud):
        return "done"

    sm = machine(("A", CBState(work, outcomes=["done", "odd"]), {"odd": "B"}), ("B", Leaf(), {}))
    found = check(sm)
    assert the(found, "unreachable-state").path == "/M/B"
    assert the(found, "impossible-outcome").path == "/M/A"


@pytest.mark.parametrize(
    "cases",
    [
        [when("1 > 2", "B"), "done"],
        [when("True", "B"), "done"],
        [when("x < 1", "B"), when("x < 1", "A"), "done"],
    ],
)
def test_a_condition_that_decides_nothing(cases):
    found = check(machine(("A", Leaf(), {"done": cases}), ("B", Leaf(), {})))
    assert the(found, "dead-case").path == "/M/A"


def test_container_outcome_that_nothing_leads_to():
    found = check(machine(("A", Leaf(), {}), outcomes=["done", "odd"]))
    assert "'odd'" in the(found, "impossible-outcome").message


def test_preempted_is_made_by_the_machine_itself():
    assert check(machine(("A", Leaf(), {}), outcomes=["done", "preempted"])).ok


def test_undeclared_outcome_with_its_line():
    class Typo(State):
        def __init__(self):
            super().__init__(["done", "failed"])

        def execute(self, ud):
            if time:
                return "dnoe"
            return "failed"

    found = check(machine(("A", Typo(), {"failed": "done"})))
    problem = the(found, "undeclared-outcome")
    assert "'dnoe'" in problem.message
    assert problem.place.file == __file__


def test_outcomes_of_timeouts_and_exceptions_are_possible():
    class Go(State):
        def execute(self, ud):
            return "done"

    state = Go(["done"], timeout=3, on_exception={OSError: "failed"})
    sm = machine(("A", state, {"aborted": "done", "failed": "done"}))
    assert check(sm).ok


def test_computed_outcomes_are_trusted():
    class Go(State):
        def execute(self, ud):
            return self.pick()

        def pick(self):
            return "odd"

    assert check(machine(("A", Go(["done", "odd"]), {"odd": "done"}))).ok


def test_a_local_name_that_only_gets_strings_is_known():
    class Go(State):
        def execute(self, ud):
            answer = "done"
            if time:
                answer = "odd"
            return answer

    found = check(machine(("A", Go(["done", "odd", "never"]), {"odd": "done", "never": "done"})))
    assert "'never'" in the(found, "impossible-outcome").message


# -- userdata --------------------------------------------------------------------------------------


def test_a_key_read_on_some_path_before_anyone_writes_it():
    sm = machine(
        ("LOOK", Leaf("found", "blind"), {"found": "FIND", "blind": "USE"}),
        ("FIND", Leaf(output_keys=["pose"]), {"done": "USE"}),
        ("USE", Reads("goal"), {}, {"goal": "pose"}),
    )
    problem = the(check(sm), "unset-key")
    assert problem.path == "/M/USE"
    assert problem.steps == ("/M/LOOK -blind->", "/M/USE")
    assert "'pose'" in problem.message


def test_keys_set_beforehand_given_by_the_caller_or_by_containers_are_written():
    inner = machine(
        ("READ", Reads("a", "b", output_keys=["c"]), {}),
        input_keys=["a", "b"],
        output_keys=["c"],
    )
    sm = machine(
        ("IN", inner, {"done": "OUT"}),
        ("OUT", Reads("c"), {}),
        input_keys=["b"],
    )
    sm.userdata.a = 1
    assert check(sm).ok
    inner._smachpy.input_keys = ("a",)
    assert the(check(sm), "unset-key").path == "/M/IN/READ"


def test_a_declared_key_that_the_code_asks_for_first_or_never_reads_is_no_problem():
    class Asks(State):
        def execute(self, ud):
            if "pose" in ud:
                return "done"
            return "done"

    class Writes(State):
        def execute(self, ud):
            ud.count = 0
            return str(ud.count) and "done"

    sm = machine(
        ("A", Asks(["done"], input_keys=["pose"]), {"done": "B"}),
        ("B", Writes(["done"], io_keys=["count"]), {}),
    )
    assert check(sm).ok


def test_keys_that_a_callback_may_write_are_not_known():
    sm = machine(("A", Reads("pose"), {}))
    assert not check(sm).ok
    sm.register_start_cb(lambda ud, initial: ud.update({"pose": 1}))
    assert check(sm).ok


def test_a_decorated_execute_is_not_known():
    import functools

    def renamed(function):
        @functools.wraps(function)
        def wrapper(self, ud):
            return "odd" if function(self, ud) else "done"

        return wrapper

    class Go(State):
        @renamed
        def execute(self, ud):
            return "done"

    assert check(machine(("A", Go(["done", "odd"]), {"odd": "done"}))).ok


def test_a_key_written_in_one_branch_and_read_in_another_is_a_race():
    both = Concurrence(["done"], "done")
    with both:
        both.add("READ", Reads("pose"))
        both.add("FIND", Leaf(output_keys=["pose"]))
    problem = the(check(machine(("BOTH", both, {}))), "unset-key")
    assert problem.path == "/M/BOTH/READ"


def test_a_rule_of_a_concurrence_says_which_child_wrote():
    both = Concurrence(
        ["found", "lost"], "lost", outcome_map={"found": {"FIND": "done"}}, output_keys=["pose"]
    )
    with both:
        both.add("FIND", Leaf("done", "failed", output_keys=["pose"]))
        both.add("WATCH", Leaf())
    sm = machine(("BOTH", both, {"found": "USE", "lost": "done"}), ("USE", Reads("pose"), {}))
    assert check(sm).ok


def test_the_item_of_an_iterator_is_written():
    each = Iterator(["done"], [], [], it=range(3), it_label="i", exhausted_outcome="done")
    with each:
        Iterator.set_contained_state("DO", Reads("i"))
    assert check(machine(("EACH", each, {}))).ok


def test_a_key_that_nobody_reads():
    inner = machine(("WRITE", Leaf(output_keys=["junk"]), {}))
    problem = the(check(machine(("IN", inner, {}))), "unread-key")
    assert (problem.path, problem.severity) == ("/M/IN/WRITE", "warning")
    # At the root the caller may look at it after the run.
    found = check(inner)
    assert the(found, "unread-key").severity == "note"
    assert found.ok


# -- values that are changed or kept ---------------------------------------------------------------


def appends(ud):
    ud.seen.append(1)
    return "done"


def assigns_a_part(ud):
    ud["seen"][0].x = 1
    return "done"


def deletes_a_part(ud):
    del ud.seen[0]
    return "done"


def counts_a_part(ud):
    ud.seen["n"] += 1
    return "done"


def changes_a_copy(ud):
    seen = [*ud.seen]
    seen.append(len(ud.seen))
    ud.other.append(2)
    return "done"


@pytest.mark.parametrize("code", [appends, assigns_a_part, deletes_a_part, counts_a_part])
def test_a_change_of_an_input_is_found_with_its_line(code):
    state = CBState(code, outcomes=["done"], input_keys=["seen"])
    sm = machine(("A", state, {}))
    sm.userdata.seen = [0]

    problem = the(check(sm), "changed-input")

    assert problem.path == "/M/A"
    assert "'seen'" in problem.message
    assert problem.place.line == code.__code__.co_firstlineno + 1


@pytest.mark.parametrize(
    ("code", "inputs", "outputs"),
    [(appends, ["seen"], ["seen"]), (changes_a_copy, ["seen", "other"], ["other"])],
)
def test_what_may_be_changed_is_no_problem(code, inputs, outputs):
    sm = machine(
        ("A", CBState(code, outcomes=["done"], input_keys=inputs, output_keys=outputs), {})
    )
    sm.userdata.update({"seen": [0], "other": []})

    assert "changed-input" not in [problem.rule for problem in check(sm)]


@pytest.mark.parametrize(
    ("again", "writes", "fresh", "is_found"),
    [
        (True, True, False, True),
        (False, True, False, False),  # no run gets there twice
        (True, False, False, False),  # nothing writes it
        (True, True, True, False),  # each visit begins afresh
    ],
)
def test_a_value_that_a_visit_leaves_to_the_next_is_found(again, writes, fresh, is_found):
    inner = StateMachine(["done"], userdata={"pose": None} if fresh else None)
    if not fresh:
        inner.userdata.pose = None
    with inner:
        inner.add("LOOK", Leaf(output_keys=["pose"] if writes else []))
    sm = machine(
        ("FIND", inner, {"done": "GRIP"}),
        ("GRIP", Leaf("done", "again"), {"again": "FIND" if again else "done"}),
    )

    found = [p for p in check(sm) if p.rule == "kept-value"]

    assert [p.path for p in found] == (["/M/FIND"] if is_found else [])


# -- loops, waits, preempts ------------------------------------------------------------------------


def test_a_loop_with_no_way_out():
    sm = machine(
        ("A", Leaf("done", "again"), {"again": "B"}),
        ("B", Leaf(), {"done": "C"}),
        ("C", Leaf(), {"done": "B"}),
    )
    problem = the(check(sm), "endless-loop")
    assert "B, C" in problem.message
    assert problem.steps[0] == "/M/A -again->"


def test_a_loop_that_only_a_preempt_ends_has_a_way_out():
    sm = machine(("A", Leaf("done", "preempted"), {"done": "A"}), outcomes=["preempted"])
    assert check(sm).ok


def at_once(ud):
    print("again", len("text"))
    return "done"


def calls_a_function(ud):
    at_once(ud)
    return "done"


def calls_a_builtin_by_name(ud, abs=time.sleep):  # noqa: A002
    abs(1.0)
    return "done"


@pytest.mark.parametrize(
    ("code", "severity"),
    [(at_once, "warning"), (calls_a_function, "note"), (calls_a_builtin_by_name, "note")],
)
def test_a_loop_for_ever_is_a_warning_if_no_state_of_it_takes_time(code, severity):
    sm = machine(
        ("A", CBState(code, outcomes=["done"]), {"done": "B"}),
        ("B", CBState(at_once, outcomes=["done"]), {"done": "A"}),
        outcomes=["preempted"],
    )

    problem = the(check(sm), "endless-loop")

    assert problem.severity == severity
    assert ("take no time" in problem.message) == (severity == "warning")


def test_a_retry_takes_time():
    waits = CBState(at_once, outcomes=["done"], retry=smachpy.Retry(3, backoff=5.0, on=["done"]))
    sm = machine(("A", waits, {"done": "A"}), outcomes=["preempted"])

    assert the(check(sm), "endless-loop").severity == "note"


def test_a_loop_inside_a_concurrence_has_its_way_out():
    inner = machine(("A", Leaf("done", "again"), {"again": "B"}), ("B", Leaf(), {"done": "A"}))
    both = Concurrence(["done"], "done")
    with both:
        both.add("LOOP", inner)
        both.add("OTHER", Leaf())
    assert check(machine(("BOTH", both, {})), properties=[always_reaches("done")]).ok


def test_a_wait_without_a_timeout():
    class Waits(State):
        def execute(self, ud):
            self.event.wait()
            self.event.wait(3)
            return "done"

    sm = machine(("A", Waits(["done"]), {}))
    assert "self.event.wait()" in the(check(sm, enable=["no-timeout"]), "no-timeout").message
    limited = machine(("A", Waits(["done"], timeout=5), {"aborted": "done"}))
    assert check(limited, enable=["no-timeout"]).ok
    assert check(
        machine(("A", machine(("B", Waits(["done"]), {}), timeout=9), {"aborted": "done"})),
        enable=["no-timeout"],
    ).ok


def test_an_action_state_without_a_timeout():

    ends = {"succeeded": "done", "aborted": "done", "preempted": "preempted"}
    outcomes = ["done", "preempted"]
    sm = machine(("A", SimpleActionState("move_base", MoveBaseAction), ends), outcomes=outcomes)
    assert the(check(sm, enable=["no-timeout"]), "no-timeout").path == "/M/A"
    limited = SimpleActionState("move_base", MoveBaseAction, exec_timeout=60.0)
    assert check(machine(("A", limited, ends), outcomes=outcomes), enable=["no-timeout"]).ok


def test_a_rule_that_is_off_is_looked_for_when_somebody_asks():
    ends = {"succeeded": "done", "aborted": "done", "preempted": "preempted"}
    sm = machine(
        ("A", SimpleActionState("move_base", MoveBaseAction), ends), outcomes=["done", "preempted"]
    )
    assert [rule.name for rule in RULES.values() if not rule.is_on] == ["no-timeout", "outside"]
    assert check(sm).problems == ()
    assert rules(check(sm, enable=["no-timeout"])) == ["no-timeout"]
    with pytest.raises(IgnoreError, match="Did you mean 'no-timeout'"):
        check(sm, enable=["no-timeouts"])


def test_what_no_recording_has_is_looked_for_when_somebody_asks():
    def look(ud):
        return "done" if os.environ.get("HOME") else "failed"

    sm = machine(("A", CBState(look, outcomes=["done", "failed"]), {"failed": "done"}))
    found = the(check(sm, enable=["outside"]), "outside")
    assert "/M/A uses os.environ.get, which no recording has" in found.message


def test_a_transition_to_the_name_of_a_state_and_an_outcome():
    def two(label):
        leads = {"failed": "done"}
        return machine(
            ("A", CBState(print, outcomes=["ok"]), {"ok": label}),
            (label, CBState(print, outcomes=["ok", "failed"]), {"ok": "done", **leads}),
            outcomes=["done", "failed", "preempted"],
        )

    found = the(check(two("failed")), "ambiguous-target")
    assert found.message == (
        "/M has a state and an outcome 'failed': transitions to it lead to the state."
    )
    assert "ambiguous-target" not in rules(check(two("B")))


def reads(code):
    """What the rule `outside` finds in the body of a state."""
    lines = [f"    {line}" for line in code.splitlines()]
    text = "\n".join([*_IMPORTS, "def look(ud):", *lines, "    return 'done'", ""])
    name = f"<outside {len(linecache.cache)}>"
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    scope = {"__name__": "looked_at"}
    exec(compile(text, name, "exec"), scope)
    found = check(machine(("A", CBState(scope["look"], outcomes=["done"]), {})), enable=["outside"])
    texts = [p.message for p in found.problems if p.rule == "outside"]
    return [text.removeprefix("/M/A uses ").partition(",")[0] for text in texts]


_IMPORTS = """
import datetime
import linecache
import os
import os.path as files
import pathlib
import random
import socket
import time
import uuid
import numpy as np
import smachpy
from datetime import date, datetime as dt
from os import environ as env, getpid as own_id
from pathlib import Path
from random import random as roll
from time import monotonic, sleep, time as now
from uuid import uuid4 as fresh
""".splitlines()


@pytest.mark.parametrize(
    ("code", "name"),
    [
        ("time.time()", "time.time"),
        ("now()", "time.time"),
        ("from time import time as t\nt()", "time.time"),
        ("import time as clock\nclock.time_ns()", "time.time_ns"),
        ("time.localtime()", "time.localtime"),
        ("datetime.datetime.now()", "datetime.datetime.now"),
        ("dt.now()", "datetime.datetime.now"),
        ("date.today()", "datetime.date.today"),
        ("fresh()", "uuid.uuid4"),
        ("env['HOME']", "os.environ"),
        ("os.getenv('HOME')", "os.getenv"),
        ("own_id()", "os.getpid"),
        ("files.exists('x')", "os.path.exists"),
        ("open('x')", "open"),
        ("Path('x').read_text()", "pathlib.Path.read_text"),
        ("pathlib.Path('x').exists()", "pathlib.Path.exists"),
        ("p = Path('x')\np.read_bytes()", "read_bytes"),
        ("socket.create_connection(('a', 1))", "socket.create_connection"),
        ("np.random.rand()", "numpy.random.rand"),
        ("random.Random(3)", "random.Random"),
        ("(lambda: time.time())()", "time.time"),
    ],
)
def test_what_no_recording_has_is_named_however_it_was_imported(code, name):
    assert reads(code) == [name]


@pytest.mark.parametrize(
    "code",
    [
        "time.monotonic()",
        "monotonic()",
        "sleep(1)",
        "roll()",
        "random.random()",
        "time.localtime(0)",
        "dt(2020, 1, 1)",
        "smachpy.once('id', fresh)",
        "smachpy.once('t', lambda: time.time())",
        "Path('x') / 'y'",
        "open = len\nopen('x')",
        "time = ud\ntime.time()",
        "ud.time",
        "files.join('a', 'b')",
    ],
)
def test_what_is_the_same_each_time_is_not_named(code):
    assert reads(code) == []


def test_what_no_recording_has_is_found_in_callbacks_too():
    def goal(ud, goal):
        goal.target_pose.header.seq = int(time.time())

    state = SimpleActionState("move_base", MoveBaseAction, goal_cb=goal)
    ends = {"succeeded": "done", "aborted": "done", "preempted": "done"}
    found = the(check(machine(("A", state, ends)), enable=["outside"]), "outside")
    assert "/M/A uses time.time, which no recording has" in found.message


def test_a_loop_that_never_looks_at_the_preempt():
    class Deaf(State):
        def execute(self, ud):
            for _ in range(100):
                time.sleep(1)
            return "done"

    class Hears(State):
        def execute(self, ud):
            for _ in range(100):
                time.sleep(1)
                if self.stop_wanted():
                    return "done"
            return "done"

        def stop_wanted(self):
            return self.preempt_requested()

    class HandsItselfOn(State):
        def execute(self, ud):
            while True:
                time.sleep(1)
                if helper(self):
                    return "done"

    class Cancelled(State):
        async def execute(self, ud):
            import asyncio

            while True:
                await asyncio.sleep(1)
                if time:
                    return "done"

    found = check(machine(("A", Deaf(["done"]), {})))
    assert "`for` loop" in the(found, "deaf-loop").message
    assert the(found, "deaf-loop").place.file == __file__
    for fine in (Hears, HandsItselfOn, Cancelled):
        assert check(machine(("A", fine(["done"]), {}))).ok, fine


def helper(state):
    return state.preempt_requested()


def test_a_concurrence_that_cannot_finish():
    class Guard(State):
        def execute(self, ud):
            self.wait_preempt()
            return "preempted"

    def both(**kwargs):
        made = Concurrence(["done"], "done", **kwargs)
        with made:
            made.add("GUARD", Guard(["preempted"]))
            made.add("GO", Leaf())
        return made

    assert the(check(machine(("BOTH", both(), {}))), "stuck-concurrence").path == "/M/BOTH"
    assert check(machine(("BOTH", both(child_termination_cb=lambda _: True), {}))).ok


def test_an_ambiguous_outcome_map():
    made = Concurrence(
        ["won", "lost"], "lost", outcome_map={"won": {"A": "done"}, "lost": {"B": "done"}}
    )
    with made:
        made.add("A", Leaf("done", "failed"))
        made.add("B", Leaf("done", "failed"))
    sm = machine(("C", made, {"won": "done", "lost": "done"}))
    assert "A:done, B:done" in the(check(sm), "ambiguous-map").message


def test_a_rule_that_can_never_hold_leaves_its_outcome_impossible():
    made = Concurrence(
        ["won", "lost"],
        "lost",
        outcome_map={"won": any_of({"A": "done"}), "lost": {"A": ["done", "failed"], "B": "done"}},
    )
    with made:
        made.add("A", Leaf("done", "failed"))
        made.add("B", Leaf("done"))
    sm = machine(("C", made, {"won": "done", "lost": "done"}))
    assert "'won'" in the(check(sm), "impossible-outcome").message


def test_a_preempt_that_leaves_a_container_by_the_wrong_outcome():
    def inner(target):
        return machine(
            ("DRIVE", Leaf("done", "preempted"), {"preempted": target}),
            ("STOP", Leaf("stopped"), {"stopped": "preempted"}),
            outcomes=["done", "failed", "preempted"],
        )

    def outer(part):
        ends = {"failed": "NEXT", "done": "NEXT"}
        return machine(("IN", part, ends), ("NEXT", Leaf(), {}), outcomes=["done", "preempted"])

    found = check(outer(inner("failed")))
    assert the(found, "preempt-outcome").path == "/M/IN"
    assert "'failed'" in the(found, "preempt-outcome").message
    found = check(outer(inner("STOP")))
    assert "preempt-outcome" not in rules(found)


# -- properties ------------------------------------------------------------------------------------


def patrol():
    return machine(
        ("UNDOCK", Leaf("done", "failed"), {"done": "DRIVE", "failed": "ABORT"}),
        ("DRIVE", Leaf("done", "failed", "preempted"), {"failed": "DRIVE", "preempted": "STOP"}),
        ("STOP", Leaf("stopped"), {"stopped": "preempted"}),
        ("ABORT", Leaf(), {"done": "aborted"}),
        outcomes=["done", "aborted", "preempted"],
    )


def test_properties_that_hold():
    wanted = [
        before("UNDOCK", "DRIVE"),
        always_reaches("done", "aborted"),
        after_preempt("STOP"),
        "before(/M/UNDOCK, ABORT)",
    ]
    assert check(patrol(), properties=wanted).ok


@pytest.mark.parametrize(
    ("wanted", "steps"),
    [
        (never("ABORT"), ("/M/UNDOCK -failed->", "/M/ABORT")),
        (always_reaches("done"), ("/M/UNDOCK -failed->", "/M/ABORT -done->", "/M -aborted->")),
        (before("DRIVE", "ABORT"), ("/M/UNDOCK -failed->", "/M/ABORT")),
        (
            after_preempt("ABORT"),
            ("/M/UNDOCK -done->", "/M/DRIVE -preempted->", "/M/STOP -stopped->", "/M -preempted->"),
        ),
    ],
)
def test_properties_that_do_not_hold(wanted, steps):
    problem = the(check(patrol(), properties=[wanted]), "property")
    assert str(wanted) in problem.message
    assert problem.steps == steps


def test_always_reaches_finds_a_run_that_never_ends():
    sm = machine(
        ("A", Leaf(), {"done": "B"}), ("B", Leaf("done", "odd"), {"done": "A", "odd": "A"})
    )
    found = check(sm, properties=[always_reaches("done")])
    assert "never ends" in the(found, "property").message


@pytest.mark.parametrize(
    "wanted",
    ["never(NOWHERE)", "always_reaches(odd)", "sometimes(A)", "before(A)", "never", "never()"],
)
def test_properties_that_make_no_sense(wanted):
    with pytest.raises(PropertyError, match="expected"):
        check(patrol(), properties=[wanted])


# -- plans -----------------------------------------------------------------------------------------

RUN = "init* -> A.exec : A.start\nA.exec -> goal : A.end\n"
FORK = "init* -> A.exec A.exec~ : A.start\nA.exec A.exec~ -> goal : A.end"


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        (RUN.replace("goal", "Goal"), "net-label"),
        (RUN.replace(": A.start", ": B.start"), "net-unmatched"),
        (RUN.replace("A.", "B."), "net-unbound"),
        (RUN.replace("A.end", "A.end [c]"), "net-condition"),
        ("init* -> init more : t", "net-bound"),
        (RUN + "init -> x : t", "net-deadlock"),
        ("init* -> x : t", "net-goal"),
        (RUN + "x -> goal : t", "net-dead"),
        (RUN + "A.exec -> goal : A.end [c]", "net-race"),
        (FORK, "net-shared"),
        (RUN + "init -> x : t\nx -> init : u", "net-busy"),
    ],
)
def test_plans(text, rule):
    plan = PetriNetPlan(net_of(text), {"A": lambda ud: None})
    assert rule in [problem.rule for problem in check(machine(("P", plan, {})))]


def test_the_run_to_a_deadlock_of_a_plan_is_shown():
    plan = PetriNetPlan(net_of(RUN + "init -> x : t"), {"A": lambda ud: None})
    (problem,) = [p for p in check(plan) if p.rule == "net-deadlock"]
    assert problem.firings == ("t",)
    assert "fired: t" in str(check(plan))


# -- switching off, formats ------------------------------------------------------------------------


def test_switching_a_rule_off_with_a_reason():
    class Waits(State):
        def execute(self, ud):
            self.event.wait()  # smachpy: ignore[no-timeout] the operator decides
            return "done"

    class WaitsToo(State):
        def execute(self, ud):
            self.event.wait()
            return "done"

    found = check(machine(("A", Waits(["done"]), {})), enable=["no-timeout"])
    assert found.ok
    assert [reason for _, reason in found.ignored] == ["the operator decides"]
    state = ignore(WaitsToo(["done"]), "no-timeout", "bounded by hardware")
    assert check(machine(("A", state, {}))).ok
    sm = machine(("A", WaitsToo(["done"]), {}))
    assert check(sm, ignores=[Ignore("no-timeout", "why not", "/M/*")], enable=["no-timeout"]).ok
    assert not check(
        sm, ignores=[Ignore("no-timeout", "why not", "/OTHER/*")], enable=["no-timeout"]
    ).ok


def test_a_rule_is_not_switched_off_without_a_reason_or_by_a_wrong_name():
    with pytest.raises(IgnoreError, match="reason"):
        ignore(Leaf(), "no-timeout", " ")
    with pytest.raises(IgnoreError, match="no-timeout"):
        ignore(Leaf(), "no-timeot", "because")


def test_every_rule_has_a_planted_bug_in_this_file():
    with open(__file__, encoding="utf-8") as file:
        text = file.read()
    # Those of "not-kept" are in files of other tools: tests/smachpy/foreign.
    assert [name for name in RULES if f'"{name}"' not in text] == []


def test_formats():
    report = check(patrol(), properties=["never(ABORT)"])
    assert "run: /M/UNDOCK -failed-> /M/ABORT" in FORMATS["text"]([report])
    data = json.loads(FORMATS["json"]([report]))
    assert data[0]["problems"][0]["rule"] == "property"
    assert FORMATS["github"]([report]).startswith("::error title=property::never(ABORT)")
    sarif = json.loads(FORMATS["sarif"]([report]))
    (result,) = sarif["runs"][0]["results"]
    assert (result["ruleId"], result["level"]) == ("property", "error")
    assert len(result["codeFlows"][0]["threadFlows"][0]["locations"]) == 2
    assert sarif["version"] == "2.1.0"


def test_a_problem_without_a_place_of_its_own_has_none_in_any_format():
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    with sm:
        sm.add("DRIVE", SimpleActionState("move_base", MoveBaseAction))
    report = check(sm, enable=["no-timeout"])
    assert [problem.rule for problem in report.problems] == ["no-timeout"]
    assert json.loads(FORMATS["json"]([report]))[0]["problems"][0]["place"] is None
    assert FORMATS["github"]([report]).startswith("::warning title=no-timeout::")
    (result,) = json.loads(FORMATS["sarif"]([report]))["runs"][0]["results"]
    assert "physicalLocation" not in result["locations"][0]


def test_the_run_that_shows_a_problem_is_drawn(tmp_path):
    report = check(patrol(), properties=["never(ABORT)"])
    (file,) = report.draw(tmp_path)
    assert file.name == "M-1-property.svg"
    assert "ABORT" in file.read_text()


def test_a_report_is_true_when_it_is_ok_and_gives_its_problems():
    noted = check(machine(("WRITE", Leaf(output_keys=["junk"]), {})))
    assert (bool(noted), len(noted), [p.severity for p in noted]) == (True, 1, ["note"])
    noted.assert_ok()
    bad = check(machine(("A", Leaf(), {}), ("B", Leaf(), {"done": "A"})))
    assert (bool(bad), list(bad)) == (False, list(bad.problems))
    with pytest.raises(AssertionError) as error:
        bad.assert_ok()
    assert str(error.value) == str(bad)


def test_the_function_of_the_package():
    assert smachpy.check(patrol()).ok


@cb_interface(outcomes=["done", "odd"])
def work(ud):
    return "done"


def test_the_callback_of_a_callback_state_is_looked_at():
    found = check(machine(("A", CBState(work), {"odd": "done"})))
    assert "'odd'" in the(found, "impossible-outcome").message


def test_an_execute_that_cannot_be_called_is_found():
    class Yields(smachpy.State):
        def execute(self, userdata):
            yield "done"

    class Good(smachpy.State):
        def execute(self, userdata):
            return "done"

    class Nothing(smachpy.State):
        pass

    def callback(userdata):
        yield

    exchanged, bound = Good(["done"]), Good(["done"])
    states = [
        *(Good(["done"]), Yields(["done"]), Nothing(["done"]), exchanged, bound),
        smachpy.CBState(callback, outcomes=["done"]),
    ]
    sm = smachpy.Concurrence(["done"], "done", name="M")
    for number, state in enumerate(states):
        sm.add(f"S{number}", state)
    exchanged.execute = lambda: "done"
    bound.execute = lambda userdata: "done"
    found = [p.path for p in smachpy.check(sm) if p.rule == "wrong-signature"]
    assert found == ["/M/S1", "/M/S2", "/M/S3", "/M/S5"]


def test_sources_are_parsed_by_one_thread_at_a_time(monkeypatch):
    """CPython 3.11 raises SystemError else, if what collects garbage changes the thread."""
    parse, inside, most = ast.parse, [], []
    other = threading.Event()

    def watched(text):
        inside.append(None)
        most.append(len(inside))
        other.wait(0.05)  # time for the other thread to come in
        inside.pop()
        return parse(text)

    monkeypatch.setattr(ast, "parse", watched)

    def of(name):
        class Own(smachpy.State):
            def __init__(self):
                super().__init__(outcomes=[name])

            def execute(self, _userdata):
                return name

        machine = smachpy.StateMachine(outcomes=[name])
        machine.add("A", Own())
        return machine

    threads = [threading.Thread(target=check, args=(of(name),)) for name in ("one", "two")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most
    assert set(most) == {1}


def nested(*names: str) -> State:
    """A state that takes the last resource, in machines that hold the others."""
    state: State = CBState(lambda _: "ok", outcomes=["ok"], resource=names[-1])
    for name in reversed(names[:-1]):
        machine = StateMachine(["ok", "preempted"], resource=name)
        machine.add("IN", state)
        state = machine
    return state


@pytest.mark.parametrize(
    ("orders", "found"),
    [
        ([("base", "arm"), ("base", "arm"), ("arm",)], []),
        ([("base", "base"), ("arm", "base"), ("base",)], []),
        ([("base", "arm"), ("arm", "base")], ["/C/N1/IN"]),
        ([("base", "arm"), ("arm", "door"), ("door", "base")], ["/C/N2/IN"]),
        ([("base", "arm", "door"), ("door", "base")], ["/C/N1/IN"]),
    ],
)
def test_resources_in_different_orders(orders, found):
    both = Concurrence(["ok", "preempted"], "ok", name="C")
    for number, names in enumerate(orders):
        both.add(f"N{number}", nested(*names))
    problems = [p for p in smachpy.check(both) if p.rule == "resource-order"]
    assert [problem.path for problem in problems] == found


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"properties": "never(ABORT)"},
            r"check: properties: got 'never.*Try \['never\(ABORT\)'\]",
        ),
        ({"enable": "no-timeout"}, r"check: enable: got 'no-timeout'; expected a list"),
        ({"ignores": Ignore("no-timeout", "why")}, r"check: ignores: got Ignore"),
    ],
)
def test_one_where_a_list_is_meant_is_refused(given, said):
    """It said that 'n' is no property."""
    with pytest.raises(InvalidStateError, match=said):
        check(patrol(), **given)


def test_files_are_named_as_the_formats_of_ci_want_them():
    """A space made the SARIF invalid; GitHub took what follows a comma for another field."""
    place = Place("/robot/my missions/50 %, a:b.py", 3)
    problem = Problem("unset-key", "error", "/M/A", "A reads x.", place=place)
    report = Report(describe(StateMachine(["done"], name="M")), (problem,))
    (result,) = json.loads(FORMATS["sarif"]([report]))["runs"][0]["results"]
    where = result["locations"][0]["physicalLocation"]["artifactLocation"]
    assert where["uri"] == "/robot/my%20missions/50%20%25%2C%20a%3Ab.py"
    line = FORMATS["github"]([report])
    assert line.startswith("::error file=/robot/my missions/50 %25%2C a%3Ab.py,line=3,title=unset")
