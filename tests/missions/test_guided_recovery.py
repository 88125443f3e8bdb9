from __future__ import annotations

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Empty
from smachpy.checks import check
from smachpy.places.pose import Pose2D
from smachpy_missions.guided_recovery import guided_recovery

GOAL, HOME = 17.9, 9.8


@pytest.fixture
def robot(mission):
    """A robot at home whose way to the goal is blocked at first; a drive or a turn takes 10 s."""
    here = Odometry()
    here.pose.pose.position.x, here.pose.pose.orientation.w = HOME, 1.0
    mission.topic("odom", Odometry).publish(here, latch=True)
    server = mission.action_server("move_base", MoveBaseAction)
    server.default_result(duration=10)
    server.blocked = server.reply_conditionally(to_goal, status="aborted", duration=10)
    return server


@pytest.fixture
def costmap(mission):
    return mission.service_server("move_base/clear_costmaps", Empty)


@pytest.fixture
def answer(mission):
    topic = mission.topic("operator/answer", String)
    return lambda at, text: topic.publish_at(at, String(text))


def to_goal(goal):
    return goal.target_pose.pose.position.x == GOAL


def opens(mission, robot, at):
    """The way is free after `at` seconds."""
    mission.clock.call_later(at, lambda: setattr(robot.blocked, "status", "succeeded"))


def test_a_free_way_needs_no_help(mission, robot, costmap):
    opens(mission, robot, 0)
    run = mission(guided_recovery())
    run.assert_outcome("succeeded")
    run.assert_path(["REMEMBER", "DRIVE"])


def test_first_it_clears_the_costmap(mission, robot, costmap):
    opens(mission, robot, 12)
    run = mission(guided_recovery())
    run.assert_path(["REMEMBER", "DRIVE", "CHOOSE", "CLEAR", "DRIVE"])
    run.assert_outcome("succeeded")
    assert len(costmap.requests) == 1


def test_then_it_looks_around(mission, robot, costmap):
    opens(mission, robot, 25)
    run = mission(guided_recovery())
    run.assert_outcome("succeeded")
    run.assert_path([..., "CLEAR", "DRIVE", "CHOOSE", "HALF", "OTHER_HALF", "DRIVE"])


def test_then_it_asks_and_tries_all_again(mission, robot, costmap, answer):
    # Three drives and two half turns of 10 s each.
    answer(50 + 30, "retry")
    opens(mission, robot, 95)
    run = mission(guided_recovery())
    run.assert_outcome("succeeded")
    assert run.outcomes("ASK") == ("retry",)
    assert run.visits("CLEAR") == 3
    assert run.duration == 80 + 2 * 10


@pytest.mark.parametrize(("word", "asked"), [("home", 60.0), (None, 50.0 + 90.0)])
def test_it_comes_home_when_told_so_or_when_nobody_answers(
    mission, robot, costmap, answer, word, asked
):
    if word is not None:
        answer(asked, word)
    run = mission(guided_recovery(patience=90.0))
    run.assert_outcome("returned")
    assert robot.goals[-1].target_pose.pose.position.x == HOME
    assert run.duration == asked + 10


def test_it_gives_up_when_told_so(mission, robot, costmap, answer):
    answer(60.0, "give_up")
    run = mission(guided_recovery())
    run.assert_outcome("aborted")
    run.assert_not_visited("COME_BACK")


@pytest.mark.parametrize("fault", ["is not there", "raises", "is silent", "dies"])
def test_a_costmap_that_cannot_be_cleared_is_no_reason_to_stop(mission, robot, fault):
    if fault != "is not there":
        service = mission.service_server("move_base/clear_costmaps", Empty)
        {"raises": service.fail, "is silent": service.never_answer, "dies": service.die}[fault]()
    robot.blocked.status = "aborted"
    opens(mission, robot, 25)
    run = mission(guided_recovery())
    run.assert_outcome("succeeded")
    run.assert_path(
        ["REMEMBER", "DRIVE", "CHOOSE", "CLEAR", "CHOOSE", "HALF", "OTHER_HALF", "DRIVE"]
    )


def test_a_robot_that_cannot_turn_asks(mission, robot, costmap, answer):
    robot.reply_conditionally(
        lambda goal: goal.target_pose.header.frame_id == "base_link", status="aborted"
    )
    answer(40.0, "give_up")
    run = mission(guided_recovery())
    run.assert_outcome("aborted")
    assert run.outcomes("ROTATE") == ("aborted",)


def test_a_robot_that_cannot_come_home_says_so(mission, robot, costmap, answer):
    answer(60.0, "home")
    robot.reply_conditionally(
        lambda goal: goal.target_pose.pose.position.x == HOME, status="aborted"
    )
    run = mission(guided_recovery())
    run.assert_outcome("aborted")
    assert len([goal for goal in robot.goals if goal.target_pose.pose.position.x == HOME]) == 3


def test_without_a_pose_it_does_not_set_out(mission, action_server):
    robot = action_server("move_base", MoveBaseAction)
    mission(guided_recovery()).assert_outcome("aborted")
    assert not robot.goals


@pytest.mark.parametrize("state", ["DRIVE", "HALF", "ASK"])
def test_a_preempt_stops_it_anywhere(mission, robot, costmap, state):
    mission.preempt(on=state, after=1.0)
    run = mission(guided_recovery())
    run.assert_outcome("preempted")
    assert run.goals_left == ()


def test_a_second_run_begins_with_the_first_measure(mission, robot, costmap, answer):
    machine = guided_recovery()
    mission.preempt(on="HALF", after=1.0)
    mission(machine).assert_outcome("preempted")
    opens(mission, robot, 12)
    mission(machine).assert_path(["REMEMBER", "DRIVE", "CHOOSE", "CLEAR", "DRIVE"])


# -- the whole -------------------------------------------------------------------------------------


def test_a_check_finds_no_problems():
    report = check(guided_recovery(), name="GUIDED_RECOVERY")
    report.assert_ok()


def asks_only_when_all_else_was_tried(run):
    return not run.visits("ASK") or bool(run.visits("CLEAR") and run.visits("HALF"))


def succeeds_only_at_the_goal(run):
    return (run.outcome == "succeeded") <= (run.outcomes("DRIVE")[-1:] == ("succeeded",))


@pytest.mark.slow
def test_whatever_happens_it_ends_and_asks_last(mission):
    found = mission.explore(
        guided_recovery,
        keep=["CHOOSE"],
        invariants=[asks_only_when_all_else_was_tried, succeeds_only_at_the_goal],
        max_runs=200,
        max_depth=12,
        max_time=40,
    )
    found.assert_ok()


@pytest.mark.slow
def test_whatever_servers_do_it_ends(mission):
    here = {"/GUIDED_RECOVERY/REMEMBER": {"home": Pose2D(9.8, 7.1, 0.0)}}
    found = mission.explore(
        guided_recovery, real_actions=True, interleavings=False, writes=here, max_runs=60
    )
    found.assert_ok()
