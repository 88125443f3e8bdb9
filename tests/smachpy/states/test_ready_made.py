"""The ready-made states under the test kit; `AskOperator` has a file of its own."""

from __future__ import annotations

import math

import pytest

from actionlib_core.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    TransformStamped,
    Vector3,
)
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.std_msgs.msg import Bool, Header
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from actionlib_core.time import Duration
from smachpy import InvalidStateError, State, StateMachine, get_options
from smachpy.places.pose import quaternion_of
from smachpy.states import (
    AwaitMessage,
    Pose2D,
    Serve,
    Wait,
    Waypoint,
    drive_back,
    drive_to,
    goal_at,
    locate,
    pose_of,
    serve_during,
    turn,
)

PLACE = Pose2D(1.0, 2.0, 0.5)
ENDS = ["succeeded", "aborted", "preempted"]


@pytest.fixture
def base(mission):
    server = mission.action_server("move_base", MoveBaseAction)
    server.default_result(duration=5.0)
    return server


def alone(state, **userdata):
    """A machine with this one state."""
    sm = StateMachine(state.get_registered_outcomes(), name="ALONE")
    sm.userdata.update(userdata)
    sm.add("STATE", state)
    return sm


def target(goal):
    return pytest.approx(pose_of(goal.target_pose.pose))


def yields(message):
    yield True


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: Wait(-1), "seconds: got -1"),
        (lambda: Wait(math.nan), "seconds: got nan"),
        (lambda: Wait("5"), "Try 5"),
        (lambda: AwaitMessage("a b", Bool, bool, timeout=1.0), "topic: got 'a b'"),
        (lambda: AwaitMessage("a", 3, bool, timeout=1.0), "msg_type: got 3"),
        (lambda: AwaitMessage("a", Bool, yields, timeout=1.0), "without `yield`"),
        (lambda: AwaitMessage("a", Bool, bool, timeout=-1), "timeout: got -1"),
        (lambda: drive_to(None), "pose: got None; expected a Pose2D of finite numbers"),
        (lambda: drive_to((1.0, 2.0, 0.0)), "pose: got"),
        (lambda: drive_to(Pose2D(1.0, math.nan, 0.0)), "pose: got Pose2D"),
        (lambda: drive_to(Pose2D("1", 2.0, 0.0)), "pose: got Pose2D"),
        (lambda: turn(math.inf), "degrees: got inf"),
        (lambda: turn("90"), "degrees: got '90'"),
        (lambda: Serve(None), "maker: got None"),
        (lambda: serve_during(alone(Wait(1.0)), lambda node: node), "maker"),
    ],
)
def test_wrong_arguments_are_refused_where_they_are_given(make, problem):
    """They were noticed during the mission; a pose that is no number was sent to the robot."""
    with pytest.raises(InvalidStateError, match=problem):
        make()


def test_a_pose_of_the_userdata_that_is_no_number_is_not_sent(mission, base):
    with pytest.raises(InvalidStateError, match="/ALONE/STATE: pose: got Pose2D"):
        mission(alone(drive_to("place"), place=Pose2D(math.nan, 0.0, 0.0)))
    assert base.goals == []


def test_a_goal_holds_the_pose():
    goal = goal_at(PLACE, frame="base_link")
    assert goal.target_pose.header.frame_id == "base_link"
    assert target(goal) == PLACE


def test_it_drives_to_a_fixed_pose(mission, base):
    mission(alone(drive_to(PLACE))).assert_outcome("succeeded")
    assert [goal.target_pose.header.frame_id for goal in base.goals] == ["map"]
    assert target(base.goals[0]) == PLACE


@pytest.mark.parametrize(
    "value",
    [
        PLACE,
        Waypoint("desk", PLACE),
        goal_at(PLACE).target_pose,
        goal_at(PLACE).target_pose.pose,
    ],
    ids=lambda value: type(value).__name__,
)
def test_it_drives_to_whatever_pose_the_userdata_holds(mission, base, value):
    mission(alone(drive_to("place"), place=value)).assert_outcome("succeeded")
    assert target(base.goals[0]) == PLACE


@pytest.mark.parametrize(("stamped", "frame"), [("base_link", "base_link"), ("", "map")])
def test_it_drives_to_a_stamped_pose_in_its_own_frame(mission, base, stamped, frame):
    value = goal_at(PLACE, frame=stamped).target_pose
    mission(alone(drive_to("place"), place=value)).assert_outcome("succeeded")
    assert base.goals[0].target_pose.header.frame_id == frame


def test_a_value_that_is_no_pose_is_an_error_of_the_state(mission, base):
    with pytest.raises(Exception, match="STATE"):
        mission(alone(drive_to("place"), place="the kitchen"))


def test_other_keys_and_callbacks_of_the_caller_are_kept(mission, base):
    def note(userdata, _status, _result):
        userdata.visits = userdata.visits + 1

    state = drive_to("place", result_cb=note, input_keys=["visits"], output_keys=["visits"])
    machine = alone(state, place=PLACE, visits=2)
    mission(machine).assert_outcome("succeeded")
    assert machine.userdata.visits == 3


def test_a_drive_ends_after_its_limit(mission, base):
    base.default_result(duration=10_000.0)
    run = mission(alone(drive_to(PLACE)))
    run.assert_outcome("aborted")
    assert run.duration == pytest.approx(600.0, abs=1.0)


def test_driving_back_tries_three_times(mission, base):
    base.default_result(status="aborted")
    mission(alone(drive_back(), home=PLACE)).assert_outcome("aborted")
    assert len(base.goals) == 3


def test_a_turn_is_a_goal_in_the_robots_own_frame(mission, base):
    mission(alone(turn(90.0))).assert_outcome("succeeded")
    assert base.goals[0].target_pose.header.frame_id == "base_link"
    assert target(base.goals[0]) == (0.0, 0.0, math.pi / 2)


def test_locating_writes_the_pose(mission):
    here = Odometry()
    here.pose.pose = goal_at(PLACE).target_pose.pose
    mission.topic("odom", Odometry).publish(here, latch=True)
    machine = alone(locate("home"))
    mission(machine).assert_outcome("valid")
    assert machine.userdata.home == pytest.approx(PLACE)


def odometry(pose=PLACE, frame="odom", **orientation):
    message = Odometry(header=Header(frame_id=frame))
    message.pose.pose = Pose(Point(pose.x, pose.y, 0.0), Quaternion(*quaternion_of(pose.yaw)))
    for field, value in orientation.items():
        setattr(message.pose.pose.orientation, field, value)
    return message


NOWHERE = {
    "NaN": odometry(Pose2D(math.nan, 2.0, 0.0), "map"),
    "infinite": odometry(Pose2D(1.0, math.inf, 0.0), "map"),
    "no orientation": odometry(frame="map", z=0.0, w=0.0),
    "NaN orientation": odometry(frame="map", z=math.nan),
    "another frame": odometry(),
}


@pytest.mark.parametrize("name", NOWHERE)
def test_locating_writes_no_place_that_is_none(mission, name, caplog):
    mission.topic("odom", Odometry).publish(NOWHERE[name], latch=True)
    machine = alone(locate("home"))
    run = mission(machine)
    run.assert_outcome("invalid")
    assert run.duration == 5.0
    assert "home" not in machine.userdata


def test_locating_waits_until_the_robot_is_localised(mission):
    topic = mission.topic("odom", Odometry)
    topic.publish(NOWHERE["NaN"], latch=True)
    topic.publish_at(2.0, odometry(frame="/map"))
    machine = alone(locate())
    run = mission(machine)
    run.assert_outcome("valid")
    assert run.duration == 2.0
    assert machine.userdata.here == pytest.approx(PLACE)


def localisation(parent="map", child="odom", **rotation):
    made = TransformStamped(Header(frame_id=parent), child)
    made.transform.translation = Vector3(10.0, 20.0, 0.0)
    made.transform.rotation = Quaternion(*quaternion_of(math.pi / 2))
    return made


@pytest.mark.parametrize(
    ("name", "frames"),
    [
        ("/tf", [localisation()]),
        ("/tf_static", [localisation()]),
        ("/robot_0/tf", [localisation()]),
        ("/tf", [localisation(child="bad/"), localisation("map", "world"), localisation("map")]),
    ],
)
def test_locating_applies_the_transforms_of_a_localisation(mission, name, frames):
    mission.topic("/robot_0/odom", Odometry).publish(odometry(), latch=True)
    mission.topic(name, TFMessage).publish(TFMessage(frames), latch=True)
    machine = alone(locate(topic="robot_0/odom"))
    mission(machine).assert_outcome("valid")
    assert machine.userdata.here == pytest.approx((8.0, 21.0, math.pi / 2 + 0.5))


@pytest.mark.parametrize("orientation", [{"z": 0.0, "w": 0.0}, {"z": math.nan}])
def test_no_goal_is_sent_for_a_pose_that_nobody_has_filled_in(mission, base, orientation):
    place = odometry(**orientation).pose.pose
    with pytest.raises(InvalidStateError, match="place: got"):
        mission(alone(drive_to("place"), place=PoseStamped(Header(frame_id="map"), place)))
    assert not base.goals


def test_locating_gives_up_without_odometry(mission):
    run = mission(alone(locate()))
    run.assert_outcome("aborted")
    assert run.duration == 5.0


@pytest.mark.parametrize(
    ("values", "outcome", "seconds"),
    [([False, True], "came", 2.0), ([False, False], "timeout", 10.0)],
)
def test_it_waits_for_a_message_that_is_accepted(mission, values, outcome, seconds):
    topic = mission.topic("button", Bool)
    for at, value in enumerate(values, 1):
        topic.publish_at(float(at), Bool(data=value))
    run = mission(alone(AwaitMessage("button", Bool, lambda m: m.data, timeout=10.0)))
    run.assert_outcome(outcome)
    assert run.duration == seconds


def test_the_message_that_was_waited_for_counts_whatever_comes_right_after_it(mission):
    """The machine raised what the condition raised for the next message."""
    topic = mission.topic("button", Bool)
    topic.publish_at(1.0, Bool(data=True))
    topic.publish_at(1.0, Bool(data=False))
    run = mission(alone(AwaitMessage("button", Bool, lambda m: 1 // m.data, timeout=10.0)))
    run.assert_outcome("came")


def test_a_preempt_ends_waits_at_once(mission):
    for state in (Wait(100.0), AwaitMessage("button", Bool, bool, timeout=100.0), Serve()):
        mission.preempt(on="STATE", after=1.0)
        run = mission(alone(state))
        run.assert_outcome("preempted")
        assert run.duration == 1.0


def test_a_wait_takes_its_seconds_from_the_userdata(mission):
    assert mission(alone(Wait(), seconds=3.0)).duration == 3.0
    assert mission(alone(Wait(Duration(3.0)))).duration == 3.0


@pytest.mark.parametrize(
    "make",
    [
        lambda **options: Wait(100.0, **options),
        lambda **options: AwaitMessage("button", Bool, timeout=100.0, **options),
        lambda **options: locate(**options),
        lambda **options: Serve(**options),
    ],
)
def test_the_options_of_any_state_are_arguments_of_these_too(mission, make):
    left = []
    state = make(on_exit=lambda userdata, outcome: left.append(outcome), resource="base")
    assert get_options(state).resource.name == "base"
    mission.preempt(on="STATE")
    mission(alone(state)).assert_outcome("preempted")
    assert left == ["preempted"]
    with pytest.raises(InvalidStateError, match="on_exit: got 3"):
        make(on_exit=3)


@pytest.mark.parametrize(
    ("given", "told"), [(Duration(3.0), "3 s"), (2, "2 s"), (math.inf, "inf s")]
)
def test_a_picture_tells_how_long_it_waits(given, told):
    """A `Duration` was an error in pictures and checks."""
    assert ("waits", told) in Wait(given).describe_details()[1]


class Server:
    def __init__(self, told, name):
        self.told, self.name = told, name
        told.append(f"make {name}")


class Closing(Server):
    def close(self):
        self.told.append(f"close {self.name}")


class Stopping(Server):
    def stop(self):
        self.told.append(f"stop {self.name}")


MADE = ["make a", "make b", "stop b", "close a"]


def makers(told):
    return (lambda: Closing(told, "a")), (lambda: Stopping(told, "b"))


def test_servers_are_there_during_each_run(mission):
    told = []
    machine = alone(Wait(1.0))
    serve_during(machine, *makers(told))
    for _ in range(2):
        mission(machine)
    assert told == MADE * 2


def test_the_state_serve_closes_its_servers_when_it_is_preempted(mission):
    told = []
    mission.preempt(on="STATE", after=1.0)
    mission(alone(Serve(*makers(told)))).assert_outcome("preempted")
    assert told == MADE


def test_a_server_that_cannot_be_made_leaves_none_behind(mission):
    told = []

    def broken():
        raise OSError("no network")

    with pytest.raises(Exception, match="no network"):
        mission(alone(Serve(makers(told)[0], broken)))
    assert told == ["make a", "close a"]


def test_a_machine_whose_server_cannot_be_made_closes_the_others_when_it_ends(mission):
    told = []

    def broken():
        raise OSError("no network")

    machine = alone(Wait(1.0))
    serve_during(machine, makers(told)[0], broken)
    mission(machine).assert_outcome("done")  # what a start callback raises is logged, as in SMACH
    assert told == ["make a", "close a"]


@pytest.mark.parametrize("nested", [False, True])
def test_servers_are_closed_when_the_machine_raises(mission, nested):
    """They stayed on the network, and the next run opened them a second time."""
    told = []

    class Broken(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, userdata):
            told.append("raise")
            raise OSError("no motor")

    def left(userdata, outcome):
        told.append(f"left {outcome}")

    machine = StateMachine(["done"], retry=(2, 0.0, [OSError]), on_exit=left)
    machine.add("BROKEN", Broken())
    serve_during(machine, *makers(told))
    root = alone(machine) if nested else machine
    with pytest.raises(Exception, match="no motor"):
        mission(root)
    once = ["make a", "make b", "raise", "stop b", "close a"]
    assert [one for one in told if not one.startswith("left")] == once * 2
    assert "left None" in told
