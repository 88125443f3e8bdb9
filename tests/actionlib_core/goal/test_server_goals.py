"""What a server knows: repeats, the four cancel rules, retention."""

from __future__ import annotations

import pytest

from actionlib_core.goal import server as server_goals
from actionlib_core.goal.server import ON_ITS_WAY_S, Arrival, ServerGoal, ServerGoals
from actionlib_core.goal.states import Status


def book(*goals, **kwargs):
    goals_of_server = ServerGoals("demo", **kwargs)
    for goal_id, stamp in goals:
        assert goals_of_server.on_goal(ServerGoal(goal_id, stamp), 0.0)[0] is Arrival.NEW
    return goals_of_server


def end(goals, goal_id, now=0.0):
    goal = goals.find(goal_id)
    goals.step(goal, "accept", "set_accepted()", now)
    goals.step(goal, "succeed", "set_succeeded()", now)
    goal.result = b"result"
    return goal


def test_goal_arriving_twice_is_new_once():
    goals = book(("a", 5))
    arrival, known = goals.on_goal(ServerGoal("a", 5), 1.0)
    assert arrival is Arrival.REPEAT
    assert known is goals.find("a")


@pytest.mark.parametrize(
    ("goal_id", "stamp", "asked"),
    [
        ("", 0, "abcd"),  # neither: all
        ("", 20, "ab"),  # stamp: at or before
        ("c", 0, "c"),  # id: that goal
        ("d", 10, "ad"),  # both: that goal and those at or before
        ("nobody", 10, "a"),
    ],
)
def test_cancel_rules(goal_id, stamp, asked):
    goals = book(("a", 10), ("b", 20), ("c", 30), ("d", 40))
    assert "".join(goal.id for goal in goals.on_cancel(goal_id, stamp, 0.0)) == asked


def test_cancel_asks_each_goal_once_and_no_ended_one():
    goals = book(("a", 10), ("b", 20))
    end(goals, "a")
    assert [goal.id for goal in goals.on_cancel("", 0, 0.0)] == ["b"]
    assert goals.on_cancel("", 0, 0.0) == []


def test_a_cancel_by_id_walks_over_no_other_goal():
    class Walked(dict):
        walks = 0

        def values(self):
            Walked.walks += 1
            return super().values()

    goals = book(*((f"g{n}", n + 1) for n in range(100)))
    goals.tracked = Walked(goals.tracked)
    for n in range(100):
        assert [goal.id for goal in goals.on_cancel(f"g{n}", 0, 0.0)] == [f"g{n}"]
    assert goals.on_cancel("nobody", 0, 0.0) == []
    assert Walked.walks == 0
    goals.on_cancel("", 0, 0.0)
    assert Walked.walks == 1


def test_cancel_before_goal_recalls_it_and_lists_it_meanwhile():
    goals = book()
    assert goals.on_cancel("late", 0, 0.0) == []
    assert [(g.id, g.status) for g in goals.listed()] == [("late", Status.RECALLING)]
    arrival, goal = goals.on_goal(ServerGoal("late", 7, client="c"), 1.0)
    assert arrival is Arrival.RECALLED
    assert (goal.status, goal.client) == (Status.RECALLED, "c")
    assert goals.on_goal(ServerGoal("late", 7), 2.0)[0] is Arrival.REPEAT


def test_cancel_before_goal_is_forgotten_after_its_time():
    goals = book()
    goals.on_cancel("late", 0, 0.0)
    assert goals.expire(4.0) == server_goals.LISTED_S
    assert goals.expire(5.0) is None
    assert goals.on_goal(ServerGoal("late", 7), 6.0)[0] is Arrival.NEW


@pytest.mark.parametrize(
    ("stamp", "made_at", "recalled"),
    [
        (50, 9.0, True),
        (49, 10.0 + ON_ITS_WAY_S, True),  # it may have been on its way
        (51, 9.0, False),
        (50, 10.01 + ON_ITS_WAY_S, False),  # sent after the cancel: its client's clock is behind
        (0, 9.0, False),  # without a stamp
    ],
)
def test_goal_sent_and_stamped_before_a_cancel_that_came_first_is_recalled(
    stamp, made_at, recalled
):
    goals = book(("a", 10))
    goals.on_cancel("", 50, 10.0)
    arrival, _ = goals.on_goal(ServerGoal("late", stamp, made_at=made_at), 20.0)
    assert arrival is (Arrival.RECALLED if recalled else Arrival.NEW)


def test_each_cancel_by_stamp_counts_for_itself():
    goals = book()
    goals.on_cancel("", 100, 10.0)
    goals.on_cancel("", 50, 20.0)
    sent = {"both": (40, 5.0), "first": (80, 5.0), "second": (40, 15.0), "none": (80, 15.0)}
    recalled = [
        name
        for name, (stamp, made_at) in sent.items()
        if goals.on_goal(ServerGoal(name, stamp, made_at=made_at), 30.0)[0] is Arrival.RECALLED
    ]
    assert recalled == ["both", "first", "second"]


def test_remembered_cancels_are_bounded():
    goals = book()
    for stamp in range(1000, 0, -1):
        goals.on_cancel("", stamp, 10.0)
    assert len(goals._cancels) == server_goals.CANCELS
    goals.on_cancel("", 2000, 10.0)
    assert len(goals._cancels) == 1


def test_result_is_kept_until_acknowledged_and_its_id_for_good():
    goals = book(("a", 1))
    end(goals, "a")
    assert goals.find("a").result == b"result"
    goals.on_acknowledged(["a", "unknown"], 1.0)
    assert goals.find("a") is None
    assert not goals.tracked
    assert goals.on_goal(ServerGoal("a", 1), 2.0) == (Arrival.REPEAT, None)
    assert goals.past_status("a") is Status.SUCCEEDED


def test_acknowledging_a_running_goal_changes_nothing():
    goals = book(("a", 1))
    goals.on_acknowledged(["a"], 1.0)
    assert goals.find("a") is not None


def test_result_nobody_acknowledges_leaves_the_list_then_the_memory():
    goals = book(("a", 1), result_timeout=60.0)
    end(goals, "a", now=10.0)
    assert goals.expire(10.0) == 15.0
    assert goals.expire(15.0) == 70.0
    assert goals.listed() == []
    assert goals.find("a") is not None
    assert goals.expire(70.0) is None
    assert goals.find("a") is None


def test_ids_are_remembered_within_bounds(monkeypatch):
    monkeypatch.setattr(server_goals, "MEMORY_GOALS", 3)
    goals = book()
    for index in range(6):
        goals.on_goal(ServerGoal(f"g{index}", 1), 0.0)
        end(goals, f"g{index}")
        goals.on_acknowledged([f"g{index}"], float(index))
    assert [i for i in range(6) if goals.past_status(f"g{i}")] == [3, 4, 5]
    goals.expire(5.0 + server_goals.MEMORY_S)
    assert goals.past_status("g5") is None


def test_memory_of_ids_is_not_walked_through_for_each_goal(monkeypatch):
    """With 100,000 ids each goal, and each tick of the status, took milliseconds."""

    class Past(dict):
        def __iter__(self):
            raise AssertionError("walked through")

    monkeypatch.setattr(server_goals, "MEMORY_GOALS", 2)
    goals = book()
    goals._past = Past()
    for index in range(5):
        goals.on_goal(ServerGoal(f"g{index}", 1), 0.0)
        end(goals, f"g{index}")
        goals.on_acknowledged([f"g{index}"], float(index))
        goals.expire(float(index))
    assert len(goals._past) == 2
    goals.expire(4.0 + server_goals.MEMORY_S)
    assert len(goals._past) == 0


def test_client_lost_asks_only_its_goals():
    goals = ServerGoals("demo")
    goals.on_goal(ServerGoal("a", 1, client="one"), 0.0)
    goals.on_goal(ServerGoal("b", 1, client="two"), 0.0)
    goals.on_goal(ServerGoal("c", 1, client="one", cancel_if_lost=True), 0.0)
    assert [goal.id for goal in goals.on_client_lost("two", every=False)] == []
    assert [goal.id for goal in goals.on_client_lost("one", every=False)] == ["c"]
    assert [goal.id for goal in goals.on_client_lost("one")] == ["a"]


def test_released_goal_becomes_lost():
    goals = book(("a", 1))
    goals.release(goals.find("a"), 0.0)
    assert goals.expire(5.0) is None
    assert goals.past_status("a") is Status.LOST


def test_server_that_takes_no_more_goals_still_knows_those_it_has():
    goals = book(("a", 1))
    goals.on_cancel("cancelled", 0, 0.0)
    goals.close()
    assert goals.on_goal(ServerGoal("a", 1), 1.0)[0] is Arrival.REPEAT
    for late in ("b", "cancelled"):
        assert goals.on_goal(ServerGoal(late, 2), 1.0) == (Arrival.LATE, None)
    assert [goal_id for goal_id, _, _ in goals.taken()] == ["a"]


def test_goals_taken_are_those_whose_end_is_not_acknowledged():
    goals = book(("known", 1), ("forgotten", 2), ("kept", 3), ("running", 4), result_timeout=60.0)
    for goal_id, now in (("known", 0.0), ("forgotten", 0.0), ("kept", 100.0)):
        end(goals, goal_id, now)
    goals.on_acknowledged(["known"], 1.0)
    goals.expire(99.0)
    taken = [(goal_id, status, goal is None) for goal_id, status, goal in goals.taken()]
    assert taken == [
        ("kept", Status.SUCCEEDED, False),
        ("running", Status.PENDING, False),
        ("forgotten", Status.SUCCEEDED, True),
    ]


def test_cancel_from_the_future_recalls_no_later_goal():
    goals = ServerGoals("demo")
    day_ns = 86_400 * 10**9
    early = ServerGoal("early", day_ns, made_at=0.0)
    goals.on_goal(early, 0.0)
    assert goals.on_cancel("", 2 * day_ns, 10.0) == [early]
    later = ServerGoal("later", day_ns + 1, made_at=11.0)
    assert goals.on_goal(later, 11.0)[0] is Arrival.NEW


def test_goals_from_the_future_are_cancelled_as_the_cancel_says():
    """A client whose clock is ahead cancels its own goals by its own clock."""
    goals = ServerGoals("demo")
    ahead = ServerGoal("ahead", 10**18)
    goals.on_goal(ahead, 0.0)
    assert goals.on_cancel("", 10**18, 0.0) == [ahead]
