"""A robot's mission and the coordinator's line under the test kit."""

from __future__ import annotations

import sys

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy.sim.interfaces import ChargeAction
from smachpy.testing import mission_kit
from smachpy_missions.fleet.coordinator import fleet
from smachpy_missions.fleet.robot import GentleHands, deliver, main, recharge
from smachpy_missions.interfaces import DeliverAction, DeliverGoal, RechargeAction, RechargeGoal
from smachpy_missions.interfaces.srv import Permit, PermitRequest

YES, NO = {"granted": True}, {"granted": False, "reason": "it is no longer yours"}


class Hands:
    """Remember what they did; with `empty` they find nothing."""

    def __init__(self, *, empty=False):
        self.deeds = []
        self.empty = empty

    def take(self, order):
        self.deeds.append(("take", order))
        return not self.empty

    def put_back(self, order):
        self.deeds.append(("put back", order))

    def give(self, order):
        self.deeds.append(("give", order))


@pytest.fixture
def base(action_server):
    server = action_server("move_base", MoveBaseAction)
    server.default_result(duration=10)
    return server


@pytest.fixture
def permit(service_server):
    server = service_server("/fleet/permit", Permit)
    server.default_response(YES)
    return server


@pytest.fixture
def run(mission):
    def run(hands, charge=0.5):
        goal = DeliverGoal(order="order 1", attempt=2)
        goal.pickup.position.x, goal.dropoff.position.x = 1.0, 9.0
        machine = deliver("robot_0", hands, lambda: charge)
        return mission(machine, userdata={"action_goal": goal})

    return run


def test_every_step_that_cannot_be_undone_is_asked_for_first(run, base, permit):
    hands = Hands()
    done = run(hands)
    done.assert_outcome("succeeded")
    asked = [(r.order, r.attempt, r.robot, r.step) for r in permit.requests]
    assert asked == [
        ("order 1", 2, "robot_0", step)
        for step in (PermitRequest.PICK_UP, PermitRequest.DRIVE_OFF, PermitRequest.HAND_OVER)
    ]
    assert hands.deeds == [("take", "order 1"), ("give", "order 1")]
    assert [goal.target_pose.pose.position.x for goal in base.goals] == [1.0, 9.0]
    result = done.userdata["action_result"]
    assert (result.aboard, result.text) == (False, "handed over")
    assert result.charge == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("refused_at", "deeds", "aboard"),
    [
        (1, [], False),
        (2, ["take", "put back"], False),
        (3, ["take"], True),
    ],
)
def test_without_a_yes_nothing_is_done(run, base, service_server, refused_at, deeds, aboard):
    permit = service_server("/fleet/permit", Permit)
    for _ in range(refused_at - 1):
        permit.reply(YES)
    permit.default_response(NO)
    hands = Hands()
    done = run(hands)
    done.assert_outcome("aborted")
    assert [deed for deed, _ in hands.deeds] == deeds
    assert done.userdata["action_result"].aboard is aboard


@pytest.mark.parametrize("fault", ["fail", "never_answer", "die"])
def test_a_coordinator_that_fails_is_no_yes(run, base, service_server, fault):
    permit = service_server("/fleet/permit", Permit)
    permit.reply(YES)
    permit.reply(YES)
    for _ in range(3):
        getattr(permit, fault)()
    hands = Hands()
    done = run(hands)
    done.assert_outcome("aborted")
    assert hands.deeds == [("take", "order 1")]
    assert done.userdata["action_result"].aboard is True
    done.assert_duration(at_most=24 + 3 * 3.0 + 2.0)


def test_an_answer_that_is_late_is_asked_for_again(run, base, service_server):
    permit = service_server("/fleet/permit", Permit)
    permit.never_answer()
    permit.default_response(YES)
    run(Hands()).assert_outcome("succeeded")
    assert [r.step for r in permit.requests] == [1, 1, 2, 3]


def test_a_parcel_that_is_not_there_is_reported(run, base, permit):
    hands = Hands(empty=True)
    done = run(hands)
    done.assert_outcome("aborted")
    assert done.userdata["action_result"].aboard is False
    assert hands.deeds == [("take", "order 1")]


@pytest.mark.parametrize(
    ("way", "aboard", "text"),
    [(0, False, "driving to the pickup"), (1, True, "driving to the dropoff")],
)
def test_a_way_that_is_blocked_says_where_the_parcel_is(
    run, action_server, permit, way, aboard, text
):
    base = action_server("move_base", MoveBaseAction)
    for _ in range(way):
        base.reply(duration=10)
    base.reply(status="aborted")
    done = run(Hands())
    done.assert_outcome("aborted")
    result = done.userdata["action_result"]
    assert (result.aboard, result.text) == (aboard, text)


@pytest.mark.parametrize(
    ("state", "deeds", "aboard"),
    [
        ("TO_PICKUP", [], False),
        ("TAKE", [], False),
        ("TO_DROPOFF", ["take"], True),
        ("GIVE", ["take"], True),
    ],
)
def test_a_preempt_leaves_the_parcel_where_it_is(mission, run, base, permit, state, deeds, aboard):
    mission.preempt(on=state, after=1.0)
    hands = Hands()
    done = run(hands)
    done.assert_outcome("preempted")
    assert [deed for deed, _ in hands.deeds] == deeds
    assert done.userdata["action_result"].aboard is aboard


def gives_only_what_it_took_and_may(run):
    """Never hands over without a yes, and says truly what is on board."""
    given = "done" in run.outcomes("GIVE")
    if given and "succeeded" not in run.outcomes("ASK_TO_GIVE"):
        return False
    return run.outcome != "succeeded" or given


def test_whatever_happens_it_gives_nothing_without_a_yes(mission):
    goal = {"action_goal": DeliverGoal(order="order 1")}
    found = mission.explore(
        lambda: deliver("robot_0", GentleHands(), lambda: 1.0),
        userdata=goal,
        invariants=[gives_only_what_it_took_and_may],
        max_runs=150,
        max_time=30,
    )
    found.assert_ok()


def run_recharge(mission):
    machine = recharge(lambda: 0.9)
    return mission(machine, userdata={"action_goal": RechargeGoal(until=0.9)})


def test_it_charges_and_leaves_the_dock(mission, action_server, base):
    dock = action_server("charge", ChargeAction)
    dock.default_result(duration=60)
    run = run_recharge(mission)
    run.assert_outcome("succeeded")
    run.assert_path(["TO_DOCK", "CHARGE", "LEAVE"])
    assert run.userdata["action_result"].left is True
    assert dock.goals[0].until == pytest.approx(0.9)


def test_a_dock_that_does_not_charge_is_left_again(mission, action_server, base):
    action_server("charge", ChargeAction).reply(status="aborted")
    run = run_recharge(mission)
    run.assert_outcome("aborted")
    assert run.userdata["action_result"].left is True


@pytest.mark.parametrize("replies", [1, 2])
def test_a_robot_that_does_not_get_away_says_that_it_has_not_left(mission, action_server, replies):
    base = action_server("move_base", MoveBaseAction)
    for _ in range(replies - 1):
        base.reply(duration=10)
    base.reply(status="aborted")
    action_server("charge", ChargeAction).default_result(duration=60)
    run = run_recharge(mission)
    run.assert_outcome("aborted")
    assert run.userdata["action_result"].left is False


@pytest.mark.parametrize("state", ["TO_DOCK", "CHARGE", "LEAVE"])
def test_a_preempt_ends_the_charge(mission, action_server, base, state):
    action_server("charge", ChargeAction).default_result(duration=60)
    mission.preempt(on=state, after=1.0)
    run_recharge(mission).assert_outcome("preempted")


# -- the coordinator, with scripted robots ---------------------------------------------------------


@pytest.fixture
def scripted(action_server):
    """Two robots whose actions do what the test says."""
    made = {}
    for robot in ("robot_0", "robot_1"):
        deliver = action_server(f"/{robot}/deliver", DeliverAction)
        deliver.default_result({"charge": 0.9, "text": "handed over"}, duration=30)
        base = action_server(f"/{robot}/move_base", MoveBaseAction)
        base.default_result(duration=10)
        dock = action_server(f"/{robot}/recharge", RechargeAction)
        dock.default_result({"left": True, "charge": 0.9}, duration=60)
        made[robot] = (deliver, base, dock)
    return made


def test_the_orders_are_shared_out(mission, scripted):
    run = mission(fleet(2, 5, start=False))
    run.assert_outcome("succeeded")
    assert run.goals_left == ()
    orders = [goal.order for deliver, *_ in scripted.values() for goal in deliver.goals]
    assert sorted(orders) == [f"order {n}" for n in range(1, 6)]
    assert run.userdata["report"] == "5 delivered, 0 in doubt, 0 undelivered"


def test_a_robot_that_dies_has_its_order_given_to_the_other(mission, scripted):
    scripted["robot_0"][0].die(after=5)
    run = mission(fleet(2, 2, start=False))
    run.assert_outcome("succeeded")
    lost = scripted["robot_0"][0].goals[0].order
    assert [goal.attempt for goal in scripted["robot_1"][0].goals if goal.order == lost] == [2]


def test_a_low_battery_sends_a_robot_to_a_dock(mission, scripted):
    scripted["robot_0"][0].reply({"charge": 0.2, "text": "handed over"}, duration=30)
    scripted["robot_0"][0].default_result({"charge": 0.9, "text": "handed over"}, duration=30)
    run = mission(fleet(2, 4, start=False))
    run.assert_outcome("succeeded")
    assert len(scripted["robot_0"][2].goals) == 1


@pytest.mark.parametrize("after", [5.0, 35.0])
def test_a_preempt_stops_all_of_them(mission, scripted, after):
    mission.preempt(at=after)
    run = mission(fleet(2, 8, start=False))
    run.assert_outcome("preempted")
    assert run.goals_left == ()
    assert "undelivered: the fleet has ended" in run.userdata["report"]


def test_robots_that_never_come_are_lost(mission):
    run = mission(fleet(2, 1, start=False))
    run.assert_outcome("undelivered")
    run.assert_duration(at_most=200)
    lost = [f"robot_{n} was lost while it was handed out" for n in (0, 1)]  # the last one is told
    assert any(text in run.userdata["report"] for text in lost)


def test_a_robot_that_comes_back_gets_no_more_orders_in_this_run(mission, scripted):
    scripted["robot_0"][0].die(after=5, back_after=2)
    run = mission(fleet(2, 4, start=False))
    run.assert_outcome("succeeded")
    assert len(scripted["robot_0"][0].goals) == 1


@pytest.mark.slow
def test_the_same_seed_gives_the_same_run_twice():
    def verdict(seed):
        with mission_kit(seed=seed) as kit:
            for robot in ("robot_0", "robot_1", "robot_2"):
                server = kit.action_server(f"/{robot}/deliver", DeliverAction)
                if robot == "robot_1":
                    server.die(after=5)
                server.default_result({"charge": 0.9, "text": "handed over"}, duration=30)
                kit.action_server(f"/{robot}/move_base", MoveBaseAction).default_result(duration=10)
                kit.action_server(f"/{robot}/recharge", RechargeAction)
            run = kit(fleet(3, 9, start=False))
            return run.outcome, run.path, run.duration, run.userdata["report"]

    first = [verdict(seed) for seed in range(20)]
    assert first == [verdict(seed) for seed in range(20)]
    assert {outcome for outcome, *_ in first} == {"succeeded"}


def test_a_missing_package_is_named_with_its_extra(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert main(["robot_0"]) == 2
    expected = "fleet_robot: package 'PIL' is missing. Try: pip install 'smachpy[sim]'\n"
    assert capsys.readouterr().err == expected
