"""One goal at a time: the three policies."""

from __future__ import annotations

import hypothesis.strategies as st
import pytest
from hypothesis import given

from actionlib_core.goal.server import REPEATED_S, ServerGoal
from actionlib_core.goal.single import POLICIES, SingleGoal
from actionlib_core.goal.states import Status


class Goal(str):  # noqa: SLOT000  it has an attribute
    """A goal that tests call by its name."""

    def __init__(self, name):
        self.record = ServerGoal(name, 0)


class Policy(SingleGoal):
    """The policy, with goals called by their names; each of them is a repetition."""

    def __init__(self, *policy):
        super().__init__(*policy)
        self.goals = {}

    def named(self, name):
        return self.goals.setdefault(name, Goal(name))

    def on_goal(self, name, made_at):
        goal = self.named(name)
        goal.record.made_at, goal.record.age = float(made_at), REPEATED_S
        return super().on_goal(goal)

    def on_cancel(self, name, *, recall_waiting):
        return super().on_cancel(self.named(name), recall_waiting=recall_waiting)

    def end(self, name):
        self.named(name).record.status = Status.SUCCEEDED


def test_newer_goal_preempts_and_the_waiting_one_is_recalled():
    policy = Policy()
    assert policy.on_goal("a", 1).announce
    assert policy.accept() == ("a", None)
    first = policy.on_goal("b", 2)
    assert (first.preempt, first.recall) == (True, ())
    second = policy.on_goal("c", 3)
    assert (second.preempt, second.recall) == (True, ("b",))
    assert policy.preempt_requested
    policy.end("a")
    assert policy.accept() == ("c", None)
    assert not policy.preempt_requested


def test_older_goal_that_comes_late_is_recalled():
    policy = Policy()
    policy.on_goal("a", 5)
    policy.accept()
    decision = policy.on_goal("old", 4)
    assert decision.recall == ("old",)
    assert not decision.preempt
    assert policy.on_goal("same", 5).announce


@pytest.mark.parametrize("age", [REPEATED_S, 100.0])
@pytest.mark.parametrize("client", ["", "one", "two"])
def test_goal_that_was_sent_again_is_placed_by_its_age_or_its_client_s_stamps(client, age):
    running = ServerGoal("running", 50, client="one", made_at=1000.0)
    goals = [
        ServerGoal("late", stamp, client=client, made_at=1000.0 + shift, age=age)
        for stamp in (49, 50, 51)
        for shift in (-0.1, 0.0, 0.1)
    ]
    older = [goal.is_older_than(running) for goal in goals]
    by_stamp, by_age = [True] * 3 + [False] * 6, [True, False, False] * 3
    assert older == (by_stamp if client == "one" else by_age)


def test_first_copy_of_a_goal_is_never_older_whatever_its_stamp():
    running = ServerGoal("running", 50, client="one", made_at=1000.0)
    for client in ("one", "two"):
        goal = ServerGoal("new", 1, client=client, made_at=0.0, age=REPEATED_S * 0.99)
        assert not goal.is_older_than(running)


@pytest.mark.parametrize("made_at", [0, 1, 2])
def test_goals_that_have_ended_count_for_nothing(made_at):
    """After a clock was put back, an idle server recalled every goal."""
    policy = Policy()
    policy.on_goal("a", 1)
    policy.accept()
    policy.end("a")
    assert policy.on_goal("b", made_at).announce


def test_goal_older_than_the_waiting_one_is_recalled_and_stops_nothing():
    policy = Policy()
    policy.on_goal("waiting", 5)
    assert policy.on_goal("old", 4).recall == ("old",)
    assert policy.accept() == ("waiting", None)


def test_accepting_while_one_runs_pushes_it_aside():
    policy = Policy()
    policy.on_goal("a", 1)
    policy.accept()
    policy.on_goal("b", 2)
    assert policy.accept() == ("b", "a")


def test_cancel_of_the_waiting_goal_recalls_it_or_starts_it_preempted():
    policy = Policy()
    policy.on_goal("a", 1)
    assert policy.on_cancel("a", recall_waiting=True).recall == ("a",)
    assert policy.accept() == (None, None)
    policy.on_goal("b", 2)
    assert policy.on_cancel("b", recall_waiting=False).recall == ()
    policy.accept()
    assert policy.preempt_requested


def test_each_goal_of_a_queue_is_cancelled_for_itself():
    """A cancel counted only for the goal that was next."""
    policy, names = Policy("queue"), ["a", "b", "c", "d"]
    for name in names:
        policy.on_goal(name, 1)
    assert policy.on_cancel("c", recall_waiting=False).recall == ()
    policy.on_cancel("d", recall_waiting=False)
    preempted = []
    for name in names:
        assert policy.accept()[0] == name
        preempted.append(policy.preempt_requested)
        policy.end(name)
    assert preempted == [False, False, True, True]


@pytest.mark.parametrize("policy_name", POLICIES)
def test_cancel_of_a_goal_that_is_withdrawn_preempts_no_other(policy_name):
    """The next goal began as if it had been cancelled."""
    policy = Policy(policy_name)
    policy.on_goal("a", 1)
    policy.on_cancel("a", recall_waiting=False)
    assert policy.withdraw() == "a"
    policy.on_goal("b", 2)
    assert policy.accept() == ("b", None)
    assert not policy.preempt_requested


def test_queue_runs_goals_in_order_and_preempts_none():
    policy = Policy("queue")
    policy.on_goal("a", 3)
    policy.accept()
    for name, stamp in (("b", 2), ("c", 1)):
        decision = policy.on_goal(name, stamp)
        assert (decision.preempt, decision.recall) == (False, ())
    policy.end("a")
    assert policy.accept()[0] == "b"
    policy.end("b")
    assert policy.accept()[0] == "c"


def test_reject_turns_goals_away_while_one_runs_or_waits():
    policy = Policy("reject")
    policy.on_goal("a", 1)
    assert policy.on_goal("b", 2).reject == "b"
    policy.accept()
    assert policy.on_goal("c", 3).reject == "c"
    policy.end("a")
    assert policy.on_goal("d", 4).announce


def test_unknown_policy_names_the_known():
    with pytest.raises(ValueError, match=r"'fifo'.*'preempt', 'queue', 'reject'"):
        SingleGoal("fifo")


@given(
    st.sampled_from(POLICIES),
    st.lists(st.tuples(st.sampled_from("gcae"), st.integers(0, 5)), max_size=40),
)
def test_every_goal_is_accepted_or_turned_away_once(policy_name, events):
    policy = Policy(policy_name)
    sent, fate = [], {}

    def note(goals, what):
        for goal in goals:
            assert goal not in fate
            fate[goal] = what

    for kind, number in events:
        if kind == "g":
            goal = f"g{len(sent)}"
            sent.append(goal)
            decision = policy.on_goal(goal, number)
            note(decision.recall, "recalled")
            note([decision.reject] if decision.reject else [], "rejected")
        elif kind == "c" and sent:
            decision = policy.on_cancel(sent[number % len(sent)], recall_waiting=True)
            note(decision.recall, "recalled")
        elif kind == "a" and not policy.running:
            new, pushed = policy.accept()
            assert pushed is None
            note([new] if new else [], "accepted")
        elif kind == "e" and policy.current:
            policy.end(policy.current)
    while policy.waiting:
        note([policy.accept()[0]], "accepted")
    assert set(fate) == set(sent)
