"""A preempt of the whole machine that arrives as a child of a concurrence ends by itself.

The rule's outcome named a child that had been called off and one that had just finished; it was
taken for the answer to the preempt, so a patrol drove to its dock and went on instead of ending.
"""

from __future__ import annotations

import pytest

from smachpy import Concurrence, State, StateMachine


class Waits(State):
    def __init__(self):
        super().__init__(outcomes=["done", "preempted"])

    def execute(self, _):
        return "preempted" if self.wait_preempt(60) else "done"


class Finishes(State):
    """Ends by itself, while somebody asks the whole machine to stop."""

    def __init__(self, machine):
        super().__init__(outcomes=["low", "preempted"])
        self.machine = machine

    def execute(self, _):
        self.sleep(1)
        self.machine.request_preempt()
        return "low"


class Notes(State):
    def __init__(self, ran):
        super().__init__(outcomes=["done"])
        self.ran = ran

    def execute(self, _):
        self.ran.append(True)
        return "done"


def machine_of(make_watch, ran, **options):
    sm = StateMachine(outcomes=["done", "preempted"])
    both = Concurrence(
        outcomes=["low", "preempted"],
        default_outcome="preempted",
        child_termination_cb=lambda _: True,
        **options,
    )
    with sm:
        StateMachine.add("ROUND", both, {"low": "NEXT"})
        with both:
            Concurrence.add("VISIT", Waits())
            Concurrence.add("WATCH", make_watch(sm))
        StateMachine.add("NEXT", Notes(ran))
    return sm


@pytest.mark.parametrize(
    "options",
    [
        {"outcome_map": {"low": {"VISIT": "preempted", "WATCH": "low"}}},
        {"outcome_cb": lambda outcomes: "low" if outcomes["WATCH"] == "low" else "preempted"},
    ],
    ids=["rule", "callback"],
)
def test_finished_work_is_no_answer_to_a_preempt(clock, options):
    ran = []
    assert machine_of(Finishes, ran, **options).execute() == "preempted"
    assert ran == []


def test_an_outcome_that_all_children_gave_because_of_the_preempt_is_followed(clock):
    ran = []
    options = {"outcome_map": {"low": {"VISIT": "preempted", "WATCH": "preempted"}}}
    sm = machine_of(lambda _: Waits(), ran, **options)
    clock.call_later(1, sm.request_preempt)
    assert sm.execute() == "done"
    assert ran == [True]
