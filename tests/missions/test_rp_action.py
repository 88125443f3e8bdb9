from __future__ import annotations

import math

import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.exceptions import InvalidNameError
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.geometry_msgs.msg import Twist
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import list_endpoints
from smachpy import events as ev
from smachpy.checks import check
from smachpy.exceptions import MissionError, SmachError
from smachpy.places.pose import Pose2D, wrap_angle
from smachpy.states import goal_at
from smachpy_missions.course.rp_action import gotopose, rp_action, stopmove, turn
from smachpy_missions.course.turn_server import TurnServer
from smachpy_missions.interfaces import TurnAction, TurnGoal

DEGREE = math.radians(1.0)


@pytest.fixture
def robot(simulation):
    """A simulated robot with its turn server; `robot.turn(...)` turns it and returns the client."""
    server = TurnServer(node=simulation.node)
    client = SimpleActionClient("turn", TurnAction, node=simulation.node)

    def turn(*goal, **callbacks):
        client.send_goal(TurnGoal(*goal), **callbacks)
        client.wait_for_result()
        return client

    simulation.turn, simulation.client = turn, client
    yield simulation
    server.close()


def facing(robot, degrees):
    body = robot.robot.body
    body.yaw = math.radians(degrees)
    x, y, _ = body.pose
    robot.server._publish_odometry()
    robot.node.clock.sleep(0.01)  # or a goal may overtake it
    return x, y


@pytest.mark.parametrize(
    ("start", "goal", "turned"),
    [
        (90, (90, "REL"), 90),
        (90, (-90, "REL"), -90),
        (90, (0, "REL"), 0),
        (170, (20, "REL"), 20),
        (0, (270, "REL"), 270),
        (0, (-720, "REL"), -720),
        (0, (90, "ABS"), 90),
        (170, (-170, "ABS"), 20),
        (-170, (170, "ABS"), -20),
        (10, (350, "ABS"), -20),
        (0, (-1000, "ABS"), 80),
        (45, (45, "ABS"), 0),
    ],
)
def test_the_robot_turns_on_the_spot(robot, start, goal, turned):
    x, y = facing(robot, start)
    client = robot.turn(*goal)
    assert client.get_state() == GoalStatus.SUCCEEDED
    body = robot.robot.body
    assert client.get_result().turned == pytest.approx(turned, abs=1.0)
    assert abs(wrap_angle(body.yaw - math.radians(start + turned))) < DEGREE
    assert body.standing
    assert (body.x, body.y) == (x, y)


def test_it_tells_in_words_how_it_goes(robot):
    facing(robot, 0)
    told = []
    client = robot.turn(90, "REL", feedback_cb=told.append)
    assert told[0].feedback == "turned 0 deg, heading 0 deg, 90 deg left"
    assert [f.left for f in told] == sorted((f.left for f in told), reverse=True)
    assert client.get_result().result == "turned 90 deg, heading 90 deg"
    assert client.get_goal_status_text() == client.get_result().result


def test_it_turns_no_faster_than_asked(clock, robot):
    rates = []
    Subscriber("odom", Odometry, lambda m: rates.append(m.twist.twist.angular.z), node=robot.node)
    start = clock.now()
    robot.turn(90, "REL", 20.0)
    assert max(rates) == pytest.approx(math.radians(20.0), abs=0.01)
    assert 4.5 < clock.now() - start < 8.0


def test_a_turn_takes_little_longer_than_it_must(clock, robot):
    start = clock.now()
    robot.turn(90, "REL")
    assert clock.now() - start < 4.0


def test_a_cancel_stops_the_robot_on_the_way(clock, robot):
    facing(robot, 0)
    robot.client.send_goal(TurnGoal(180, "REL", 30.0))
    clock.sleep(2.0)
    robot.client.cancel_goal()
    robot.client.wait_for_result()
    assert robot.client.get_state() == GoalStatus.PREEMPTED
    assert robot.client.get_goal_status_text().startswith("stopped on request; turned ")
    assert robot.robot.body.standing
    assert 30 < math.degrees(robot.robot.body.yaw) < 90


def test_a_newer_turn_takes_over(clock, robot):
    facing(robot, 0)
    first = SimpleActionClient("turn", TurnAction, node=robot.node)
    first.send_goal(TurnGoal(180, "REL", 30.0))
    clock.sleep(1.0)
    robot.turn(0, "ABS")
    assert first.get_state() == GoalStatus.PREEMPTED
    assert robot.client.get_state() == GoalStatus.SUCCEEDED
    assert abs(robot.robot.body.yaw) < DEGREE


def test_a_drive_waits_for_a_turn_and_goes_on(clock, robot):
    drive = SimpleActionClient("move_base", MoveBaseAction, node=robot.node)
    there = Pose2D(11.5, 8.0, 0.0)
    drive.send_goal(goal_at(there))
    clock.sleep(1.0)
    assert robot.turn(90, "REL").get_state() == GoalStatus.SUCCEEDED
    drive.wait_for_result()
    assert drive.get_state() == GoalStatus.SUCCEEDED
    assert robot.robot.body.pose.distance(there) < 0.05


@pytest.mark.parametrize(
    ("goal", "text"),
    [
        ((90, "REAL"), "reference: got 'REAL'; expected 'ABS' or 'REL'. Did you mean 'REL'?"),
        ((90, ""), "reference: got ''; expected 'ABS' or 'REL'."),
        ((math.nan, "REL"), "angle: got nan; expected -36000 to 36000 [deg]."),
        ((math.inf, "ABS"), "angle: got inf; expected"),
        ((90, "REL", -1.0), "max_ang_vel: got -1; expected 0 or more [deg/s]."),
    ],
)
def test_a_goal_that_makes_no_sense_moves_nothing(clock, robot, goal, text):
    before = robot.robot.body.pose
    client = robot.turn(*goal)
    assert client.get_state() == GoalStatus.ABORTED
    assert text in client.get_goal_status_text()
    assert robot.robot.body.pose == before


@pytest.fixture
def turn_client(node):
    server = TurnServer()
    yield SimpleActionClient("turn", TurnAction)
    server.close()


def test_without_odometry_it_gives_up(clock, turn_client):
    turn_client.send_goal_and_wait(TurnGoal(90, "ABS"))
    assert turn_client.get_state() == GoalStatus.ABORTED
    assert turn_client.get_goal_status_text().startswith("no odometry on /odom")
    assert clock.now() == pytest.approx(3.0)


def test_a_robot_that_does_not_turn_is_given_up_and_told_to_stop(clock, turn_client):
    commands = []
    Subscriber("cmd_vel", Twist, lambda twist: commands.append(twist.angular.z))
    Publisher("odom", Odometry, latch=True).publish(Odometry())
    turn_client.send_goal_and_wait(TurnGoal(90, "REL"))
    assert turn_client.get_state() == GoalStatus.ABORTED
    assert "the robot does not turn: nothing for 3 s" in turn_client.get_goal_status_text()
    assert clock.now() < 4.0
    clock.sleep(0.01)  # the result may overtake the last command
    assert commands[0] > 0.5
    assert commands[-1] == 0.0


# -- the mission and the commands ------------------------------------------------------------------


def test_the_mission_drives_turns_and_is_stopped(clock, simulation):
    machine, events = rp_action(), []
    machine.subscribe(events.append)
    assert machine.execute() == "succeeded"
    left = {e.path: e.outcome for e in events if isinstance(e, ev.Left)}
    assert left["/RP_ACTION/GO_AND_STOP/GO_FAR"] == "stopped"
    assert simulation.robot.body.standing
    assert 1.0 < simulation.robot.body.pose.distance(Pose2D(11.5, 8.0, 0.0)) < 4.0
    servers = list_endpoints(simulation.node.transport, kind=Kind.ACTION_SERVER, name="turn")
    assert servers == []


def test_a_namespaced_robot_takes_the_commands(clock, simulate, office_robot):
    with simulate(office_robot, namespace="robot_0") as robot:
        with Node("person", transport=robot.network.session(), clock=clock) as person:
            with use_node(person):
                server = turn(server="robot_0")
                task = clock.spawn(server.execute, name="turn server")
                assert gotopose("robot_0", 11.5, 8.0, 90.0).execute() == "succeeded"
                body = robot.robot.body
                assert body.pose.distance(Pose2D(11.5, 8.0, 0.0)) < 0.05
                assert math.degrees(body.yaw) == pytest.approx(90.0, abs=3.0)
                assert turn(-45.0, "REL", client="/robot_0").execute() == "succeeded"
                assert math.degrees(body.yaw) == pytest.approx(45.0, abs=4.0)

                far, outcomes = gotopose("robot_0", 2.0, 3.0), []
                drive = clock.spawn(lambda: outcomes.append(far.execute()), name="drive")
                clock.sleep(3.0)
                assert not body.standing
                assert stopmove("robot_0").execute() == "succeeded"
                assert body.standing
                drive.join()
                assert outcomes == ["aborted"]  # somebody else stopped it
                server.request_preempt()
                task.join()


def test_stopmove_stops_a_turn_too(clock, simulate, office_robot):
    with simulate(office_robot, namespace="robot_0") as robot:
        server = TurnServer(node=robot.node)
        client = SimpleActionClient("turn", TurnAction, node=robot.node)
        client.send_goal(TurnGoal(3600, "REL", 20.0))
        clock.sleep(2.0)
        assert not robot.robot.body.standing
        assert stopmove("/robot_0").execute() == "succeeded"
        client.wait_for_result()
        assert client.get_state() == GoalStatus.PREEMPTED
        assert robot.robot.body.standing
        server.close()


def test_stopmove_of_a_robot_that_is_not_there(mission):
    run = mission(stopmove("robot_9"))
    run.assert_outcome("aborted")
    run.assert_duration(at_most=3.1)


def test_stopmove_of_a_robot_that_does_not_stop(mission, action_server):
    action_server("robot_0/move_base", MoveBaseAction)
    moving = Odometry()
    moving.twist.twist.linear.x = 1.0
    mission.topic("robot_0/odom", Odometry).publish_every(0.5, [moving] * 20)
    run = mission(stopmove("robot_0"))
    run.assert_outcome("aborted")
    run.assert_duration(at_least=5.0, at_most=5.1)


def test_a_robot_that_dies_on_the_way(mission, action_server):
    action_server("robot_0/move_base", MoveBaseAction).die(after=2)
    mission(gotopose("robot_0", 10, 2)).assert_outcome("aborted")


def test_a_goal_sent_by_gotopose_is_what_was_typed(mission, action_server):
    server = action_server("robot_0/move_base", MoveBaseAction)
    mission(gotopose("robot_0", 10.0, 2.0, 180.0)).assert_outcome("succeeded")
    (goal,) = server.goals
    pose = goal.target_pose
    assert (pose.header.frame_id, pose.pose.position.x, pose.pose.position.y) == ("map", 10.0, 2.0)
    assert pose.pose.orientation.z == pytest.approx(1.0)


def test_a_preempted_turn_cancels_its_goal(mission, action_server):
    server = action_server("robot_0/turn", TurnAction)
    server.default_result(duration=10)
    mission.preempt(on="TURN", after=2.0)
    run = mission(turn(90.0, client="robot_0"))
    run.assert_outcome("preempted")
    assert len(server.cancelled) == 1
    assert run.duration == pytest.approx(2.0)


@pytest.mark.parametrize("state", ["GO", "TURN_LEFT", "GO_FAR", "WAIT"])
def test_a_preempt_anywhere_ends_the_mission(mission, action_server, state):
    action_server("move_base", MoveBaseAction).default_result(duration=5)
    mission.replace("TURN_LEFT", outcomes=["succeeded"], duration=2)
    mission.replace("FACE_EAST", outcomes=["succeeded"], duration=2)
    mission.preempt(on=state, after=0.5)
    run = mission(rp_action())
    run.assert_outcome("preempted")
    assert run.goals_left == ()


def test_whatever_happens_it_ends(mission):
    found = mission.explore(rp_action, max_time=40, max_runs=400)
    found.assert_ok()


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: gotopose("robot 0", 1, 2), "invalid robot name: ' ' is not allowed"),
        (lambda: stopmove(""), "invalid robot name: it is empty"),
        (lambda: turn(90.0, client="robot-0"), "invalid robot name: '-' is not allowed"),
        (lambda: gotopose("robot_0", math.nan, 2), "x: got nan; expected a finite number"),
        (lambda: gotopose("robot_0", 1, 2, math.inf), "theta: got inf; expected"),
        (lambda: turn(90.0, "RELL", client="robot_0"), "Did you mean 'REL'?"),
        (lambda: turn(90.0, "abs", client="robot_0"), "Did you mean 'ABS'?"),
        (lambda: turn(math.nan, client="robot_0"), "angle: got nan"),
        (lambda: turn(client="robot_0"), "angle: got none; expected degrees"),
        (lambda: turn(90.0), "got neither; expected one of -client ROBOT"),
        (lambda: turn(90.0, client="a", server="b"), "got -client a and -server b"),
        (lambda: rp_action(-1.0), "seconds: got -1"),
    ],
)
def test_bad_arguments_are_refused_before_anything_moves(make, text):
    with pytest.raises((MissionError, InvalidNameError, SmachError)) as caught:
        make()
    assert text in str(caught.value)


@pytest.mark.parametrize(
    "make",
    [
        rp_action,
        lambda: gotopose("robot_0", 1, 2),
        lambda: stopmove("robot_0"),
        lambda: turn(90.0, client="robot_0"),
        lambda: turn(server="robot_0"),
    ],
)
def test_a_check_finds_nothing(make):
    report = check(make())
    report.assert_ok()
