from __future__ import annotations

import json
import math

import pytest
from PIL import Image

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from actionlib_core.interfaces.std_srvs.srv import Trigger
from smachpy import events as ev
from smachpy.checks import check
from smachpy.exceptions import MissionError
from smachpy.places.exceptions import InputFileError
from smachpy.places.maps import OFFICE_TOUR
from smachpy.places.pose import Pose2D
from smachpy.states import goal_at
from smachpy_missions.tour.waypoints import waypoints

LINE = "name,x,y,yaw,dwell,task,angle,service\n"
THREE = LINE + "a,1,0\nb,2,0\nc,3,0\n"


@pytest.fixture
def file(tmp_path):
    def write(text=THREE, name="list.csv"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


@pytest.fixture
def robot(mission):
    server = mission.action_server("move_base", MoveBaseAction)
    server.default_result(duration=10)
    return server


def places(robot):
    return [goal.target_pose.pose.position.x for goal in robot.goals]


def at(x):
    message = Odometry()
    message.pose.pose.position.x = x
    message.pose.pose.orientation.w = 1.0
    return message


def scan(ranges=(1.0, 2.0, math.inf, 3.0)):
    return LaserScan(angle_min=0.0, angle_increment=math.pi / 2, range_max=8.0, ranges=list(ranges))


def test_it_drives_to_all_of_them_in_order(mission, robot, file):
    run = mission(waypoints(file()))
    run.assert_outcome("succeeded")
    assert places(robot) == [1, 2, 3]
    assert run.duration == 30


def test_it_loops(mission, robot, file):
    mission(waypoints(file(), loop=2)).assert_outcome("succeeded")
    assert places(robot) == [1, 2, 3, 1, 2, 3]


def test_it_loops_until_it_is_stopped(mission, robot, file):
    mission.preempt(at=995)
    run = mission(waypoints(file(), loop=0))
    run.assert_outcome("preempted")
    assert len(robot.goals) == 100
    assert len(robot.cancelled) == 1


def test_it_stays_as_long_as_the_file_says(mission, robot, file):
    assert mission(waypoints(file(LINE + "a,1,0,0,7.5\n"))).duration == 17.5


# -- skipping --------------------------------------------------------------------------------------


def test_a_waypoint_out_of_reach_is_tried_again_and_then_skipped(mission, robot, file):
    robot.reply_conditionally(lambda goal: goal.target_pose.pose.position.x == 2, status="aborted")
    run = mission(waypoints(file(), tries=3))
    run.assert_outcome("incomplete")
    run.assert_userdata(skipped=["b"])
    assert places(robot) == [1, 2, 2, 2, 3]
    assert run.duration == 10 + 2 + 4 + 10  # it waits between the tries


def test_or_it_stops_there(mission, robot, file):
    robot.reply_conditionally(lambda goal: goal.target_pose.pose.position.x == 2, status="aborted")
    run = mission(waypoints(file(), tries=1, on_failure="stop"))
    run.assert_outcome("aborted")
    assert places(robot) == [1, 2]


def test_a_second_try_may_succeed(mission, robot, file):
    robot.reply(status="aborted")
    mission(waypoints(file())).assert_outcome("succeeded")
    assert places(robot) == [1, 1, 2, 3]


def test_it_does_not_loop_for_ever_where_nothing_can_be_reached(mission, robot, file):
    robot.default_result(status="aborted")
    run = mission(waypoints(file(), tries=1, loop=0))
    run.assert_outcome("aborted")
    assert places(robot) == [1, 2, 3]


def test_a_robot_that_dies_and_comes_back_costs_a_try(mission, robot, file):
    robot.die(after=3, back_after=1)
    mission(waypoints(file())).assert_outcome("succeeded")
    assert places(robot) == [1, 1, 2, 3]


# -- where it begins -------------------------------------------------------------------------------


def test_it_begins_at_the_nearest_and_visits_all(mission, robot, file):
    mission.topic("odom", Odometry).publish(at(2.4), latch=True)
    run = mission(waypoints(file(), start="nearest"))
    run.assert_outcome("succeeded")
    assert places(robot) == [2, 3, 1]


def test_without_a_pose_there_is_no_nearest(mission, robot, file):
    run = mission(waypoints(file(), start="nearest"))
    run.assert_outcome("aborted")
    assert not robot.goals


def test_it_goes_on_with_the_waypoint_that_was_interrupted(mission, robot, file, tmp_path):
    kept = tmp_path / "deep" / "state.json"
    mission.preempt(at=25)
    mission(waypoints(file(), resume=kept)).assert_outcome("preempted")
    assert json.loads(kept.read_text())["done"] == 2
    robot.goals.clear()
    mission(waypoints(file(), resume=kept)).assert_outcome("succeeded")
    assert places(robot) == [3]
    assert not kept.exists()
    robot.goals.clear()
    mission(waypoints(file(), resume=kept)).assert_outcome("succeeded")
    assert places(robot) == [1, 2, 3]


def test_it_resumes_a_round_that_began_at_the_nearest(mission, robot, file, tmp_path):
    kept = tmp_path / "state.json"
    mission.topic("odom", Odometry).publish(at(2.0), latch=True)
    mission.preempt(at=15)
    mission(waypoints(file(), resume=kept, start="nearest")).assert_outcome("preempted")
    robot.goals.clear()
    mission(waypoints(file(), resume=kept, start="nearest")).assert_outcome("succeeded")
    assert places(robot) == [3, 1]


@pytest.mark.parametrize("loop", [1, 0])
def test_after_a_round_in_vain_it_tries_again(mission, robot, file, tmp_path, loop):
    kept = tmp_path / "state.json"
    bad = robot.reply_conditionally(lambda goal: True, status="aborted", duration=1)
    mission(waypoints(file(), tries=1, loop=loop, resume=kept)).assert_outcome("aborted")
    assert kept.exists() == (loop == 0)
    bad.status = "succeeded"
    robot.goals.clear()
    mission.preempt(at=2.5)
    mission(waypoints(file(), tries=1, loop=loop, resume=kept))
    assert places(robot) == [1, 2, 3]


@pytest.mark.parametrize(
    ("text", "got"),
    [
        ("{", "no JSON"),
        ("[]", "something else"),
        ('{"task": "x"}', "another list or of other settings"),
        (None, "other values"),
    ],
)
def test_a_state_that_does_not_belong_here_is_refused_before_anything_moves(
    file, tmp_path, text, got
):
    kept = tmp_path / "state.json"
    machine = waypoints(file(), resume=kept)
    if text is None:
        guide = machine["BEGIN"]._smachpy.code[0].__self__
        text = json.dumps({"task": guide.kept.task, "first": 0, "done": "two"})
    kept.write_text(text)
    with pytest.raises(MissionError, match=r"state\.json: got .*expected.*Try deleting"):
        waypoints(file(), resume=kept)
    with pytest.raises(MissionError, match=got):
        waypoints(file(), resume=kept)


# -- tasks -----------------------------------------------------------------------------------------


def test_a_photo_is_a_picture_of_what_the_scanner_sees(mission, robot, file, tmp_path):
    mission.topic("odom", Odometry).publish(at(5.0), latch=True)
    mission.topic("scan", LaserScan).publish_every(0.1, [scan()] * 200)
    photos = tmp_path / "photos"
    text = LINE + "desk at the window,5,0,,,photo\n"
    mission(waypoints(file(text), photos=photos)).assert_outcome("succeeded")
    (path,) = photos.iterdir()
    assert path.name == "01_desk_at_the_window.png"
    with Image.open(path) as picture:
        colours = {colour for _, colour in picture.convert("RGB").getcolors(1_000_000)}
        assert picture.getpixel((360 + 72, 360)) == (200, 48, 36)  # a wall 1 m ahead
        assert picture.getpixel((360, 360 - 72)) == (255, 249, 219)  # free on the left
    assert (38, 103, 191) in colours


def test_without_a_scan_there_is_no_photo(mission, robot, file, tmp_path):
    mission.topic("odom", Odometry).publish(at(5.0), latch=True)
    text = LINE + "a,5,0,,,photo\nb,6,0\n"
    run = mission(waypoints(file(text), photos=tmp_path / "photos"))
    run.assert_outcome("incomplete")
    run.assert_userdata(skipped=["a"])
    assert not (tmp_path / "photos").exists()


def test_a_photo_that_cannot_be_written_fails_the_waypoint(mission, robot, file, tmp_path):
    mission.topic("odom", Odometry).publish(at(5.0), latch=True)
    mission.topic("scan", LaserScan).publish_every(0.1, [scan()] * 200)
    (tmp_path / "photos").write_text("in the way")
    run = mission(waypoints(file(LINE + "a,5,0,,,photo\n"), photos=tmp_path / "photos"))
    run.assert_outcome("aborted")
    failed = [event for event in run.events if isinstance(event, ev.CallbackFailed)]
    assert "FileExistsError" in failed[0].error


def test_a_turn_is_made_on_the_spot(mission, robot, file):
    mission(waypoints(file(LINE + "a,5,0,,,turn,-90\n"))).assert_outcome("succeeded")
    turn = robot.goals[1].target_pose
    assert turn.header.frame_id == "base_link"
    assert turn == goal_at(Pose2D(0, 0, -math.pi / 2), "base_link").target_pose


@pytest.mark.parametrize(
    ("answer", "outcome"), [(True, "succeeded"), (False, "aborted"), (None, "aborted")]
)
def test_it_waits_for_a_service(mission, robot, file, answer, outcome):
    loader = mission.service_server("cargo/loaded", Trigger)
    if answer is None:
        loader.fail("the gate is jammed")
    else:
        loader.reply({"success": answer}, duration=20)
    run = mission(waypoints(file(LINE + "gate,5,0,,,wait_for_service,,cargo/loaded\n")))
    run.assert_outcome(outcome)
    run.assert_visited("WAIT_FOR_CARGO_LOADED")
    assert len(loader.requests) == 1


def test_a_service_that_never_comes_fails_the_waypoint(mission, robot, file):
    run = mission(waypoints(file(LINE + "gate,5,0,,,wait_for_service,,nobody\nb,6,0\n")))
    run.assert_outcome("incomplete")
    assert places(robot) == [5, 6]
    assert run.duration == 10 + 60 + 10


# -- progress --------------------------------------------------------------------------------------


def drives(robot, length):
    """Every drive takes ten seconds and reports its way."""
    for start in range(length):
        poses = []
        for step in range(1, 11):
            feedback = MoveBaseFeedback()
            feedback.base_position.pose.position.x = start + step / 10
            poses.append(feedback)
        robot.reply(duration=10, feedback=poses)


def test_it_says_how_far_it_is_and_how_long_it_will_take(mission, robot, file):
    drives(robot, 3)
    run = mission(waypoints(file()))
    told = [
        (event.t, event.value)
        for event in run.events
        if isinstance(event, ev.UserdataWritten) and event.key == "progress"
    ]
    shares = [progress.fraction for _, progress in told]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert {progress.text for _, progress in told} == {"1/3 a", "2/3 b", "3/3 c", "3/3"}
    start = run.events[0].t
    late = [(t - start, p.seconds_left) for t, p in told if 20 < t - start < 30 and p.seconds_left]
    for t, left in late:  # two legs of 10 s have taught it the pace
        assert left == pytest.approx(30 - t, abs=5)
    assert late[-1][1] < 2


def test_a_loop_without_end_has_no_estimate(mission, robot, file):
    drives(robot, 3)
    mission.preempt(at=25)
    run = mission(waypoints(file(), loop=0))
    assert run.userdata["progress"].seconds_left is None
    assert run.userdata["progress"].text == "3 c"


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "value"), [("loop", -1), ("tries", 0)])
def test_numbers_that_make_no_sense_are_refused(file, name, value):
    with pytest.raises(MissionError, match=f"{name}: got {value}; expected"):
        waypoints(file(), **{name: value})


def test_a_broken_file_is_refused_before_anything_moves(file):
    with pytest.raises(InputFileError, match=r"list\.csv:2: waypoints\[0\]\.y: got nothing"):
        waypoints(file("name,x\na,1\n"))


# -- the whole -------------------------------------------------------------------------------------


def office():
    return waypoints(OFFICE_TOUR, start="nearest")


def test_a_check_finds_no_problems():
    for machine in (waypoints(), office()):
        report = check(machine, name="WAYPOINTS")
        report.assert_ok()


def test_whatever_states_return_it_ends_and_skips_only_what_failed(mission, file, tmp_path):
    text = LINE + "a,1,0,,,turn,90\nb,2,0,,,wait_for_service,,gate\n"

    def skips_nothing_that_succeeded(run):
        failures = sum(
            isinstance(event, ev.Left) and event.path == "/WAYPOINTS/SKIP" for event in run.events
        )
        return failures == len(run.userdata.get("skipped", []))

    found = mission.explore(
        lambda: waypoints(file(text), tries=1),
        keep=["BEGIN", "NEXT", "CHOOSE", "TICK_OFF", "SKIP"],
        invariants=[skips_nothing_that_succeeded],
        max_runs=150,
        max_time=40,
    )
    found.assert_ok()


def test_whatever_servers_do_it_ends(mission, file):
    found = mission.explore(
        lambda: waypoints(file(LINE + "a,1,0,,,turn,90\n"), tries=1),
        real_actions=True,
        interleavings=False,
        max_runs=60,
        max_time=40,
    )
    found.assert_ok()
