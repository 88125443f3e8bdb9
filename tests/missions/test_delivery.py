from __future__ import annotations

import contextlib
from functools import partial

import pytest

from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_msgs.msg import Bool, String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import events as ev
from smachpy.checks import check
from smachpy.exceptions import MissionError
from smachpy.places.exceptions import InputFileError
from smachpy.places.maps import OFFICE_DOORS, OFFICE_MAP, OFFICE_ROBOT
from smachpy.sim.simulation import simulation
from smachpy_missions.delivery.delivery import delivery

LAB, WAIT, HOME = (17.9, 5.4), (18.0, 7.7), (9.8, 7.1)


@pytest.fixture(scope="module")
def machine():
    return delivery()  # reading the map takes longer than a run


@pytest.fixture
def robot(mission):
    server = mission.action_server("move_base", MoveBaseAction)
    server.default_result(duration=10)
    return server


@pytest.fixture
def door(mission):
    """The door's service; the door is open three seconds after each call."""
    leaf = mission.topic("doors/lab/open", Bool)
    leaf.publish(Bool(data=False), latch=True)
    service = mission.service_server("doors/lab/set", SetBool)

    def set_door(request):
        mission.clock.call_later(3.0, partial(leaf.publish, Bool(data=request.data), latch=True))
        return True, ""

    service.set_door = set_door
    for _ in range(20):
        service.custom_reply(set_door)
    return service


@pytest.fixture
def answer(mission):
    """`answer(state, text)`: the operator answers two seconds after that state began."""
    topic = mission.topic("operator/answer", String)
    return lambda at, text: topic.publish_at(at, String(text))


def places(robot):
    stamped = [
        goal.target_pose for goal in robot.goals if goal.target_pose.header.frame_id == "map"
    ]
    return [(pose.pose.position.x, pose.pose.position.y) for pose in stamped]


def test_it_brings_it_through_the_door_and_comes_home(mission, machine, robot, door, answer):
    answer(30.0, "yes")
    run = mission(machine)
    run.assert_outcome("succeeded")
    run.assert_path(
        [
            *("APPROACH", "GO/OPEN/CALL", "GO/OPEN/WAIT", "ENTER", "CONFIRM"),
            *("TURN", "RELEASE", "NOTE"),
            *("COME_BACK/OPEN/CALL", "COME_BACK/OPEN/WAIT", "DRIVE_HOME", "CLOSE", "REPORT"),
        ]
    )
    assert places(robot) == [WAIT, LAB, HOME]
    assert [request.data for request in door.requests] == [True, True, False]
    assert run.duration == 30 + 10 + 3 + 10


def test_it_does_not_enter_before_the_door_is_open(mission, machine, robot, door, answer):
    answer(30.0, "yes")
    run = mission(machine)
    entered = {event.path: event.t for event in run.events if isinstance(event, ev.Entered)}
    assert entered["/DELIVERY/GO/ENTER"] - entered["/DELIVERY/GO/OPEN/CALL"] == 3.0


@pytest.mark.parametrize(("word", "asked"), [("no", 30.0), (None, 23.0 + 45.0)])
def test_without_a_yes_it_brings_it_back(mission, robot, door, answer, word, asked):
    if word is not None:
        answer(asked, word)
    run = mission(delivery(patience=45.0))
    run.assert_outcome("brought_back")
    run.assert_not_visited("HAND_OVER")
    assert places(robot) == [WAIT, LAB, HOME]
    assert run.duration == asked + 10


@pytest.mark.parametrize("fault", ["refuses", "raises", "dies", "is silent", "is not there"])
def test_a_door_that_does_not_open_sends_it_home(mission, machine, robot, fault):
    if fault != "is not there":
        service = mission.service_server("doors/lab/set", SetBool)
        for _ in range(20):
            {
                "refuses": lambda: service.reply({"success": False, "message": "locked"}),
                "raises": lambda: service.fail("no power"),
                "dies": lambda: service.die(),
                "is silent": lambda: service.never_answer(),
            }[fault]()
    run = mission(machine)
    run.assert_outcome("brought_back")
    run.assert_not_visited("ENTER", "CONFIRM")
    assert places(robot) == [WAIT, HOME]


def test_a_door_that_says_yes_and_stays_shut_sends_it_home(mission, machine, robot):
    mission.topic("doors/lab/open", Bool).publish(Bool(data=False), latch=True)
    mission.service_server("doors/lab/set", SetBool).default_response({"success": True})
    run = mission(machine)
    run.assert_outcome("brought_back")
    run.assert_not_visited("ENTER")
    assert run.outcomes("GO/OPEN/WAIT") == ("timeout",)


def test_a_door_that_hesitates_is_asked_again(mission, machine, robot, answer):
    mission.topic("doors/lab/open", Bool).publish(Bool(data=True), latch=True)
    service = mission.service_server("doors/lab/set", SetBool)
    service.default_response({"success": True})
    service.reply({"success": False, "message": "someone stands in the doorway"})
    answer(30.0, "yes")
    mission(machine).assert_outcome("succeeded")
    assert [request.data for request in service.requests] == [True, True, True, False]


@pytest.mark.parametrize(
    ("where", "visited"), [(WAIT, [WAIT, HOME]), (LAB, [WAIT, LAB, HOME])], ids=["before", "behind"]
)
def test_a_blocked_way_sends_it_home(mission, machine, robot, door, where, visited):
    def goes_there(goal):
        position = goal.target_pose.pose.position
        return (position.x, position.y) == where

    robot.reply_conditionally(goes_there, status="aborted", duration=5)
    mission(machine).assert_outcome("brought_back")
    assert places(robot) == visited


def test_a_tray_that_cannot_be_turned_is_brought_back(mission, machine, robot, door, answer):
    answer(30.0, "yes")
    robot.reply_conditionally(
        lambda goal: goal.target_pose.header.frame_id == "base_link", status="aborted"
    )
    mission(machine).assert_outcome("brought_back")


def goes_home(goal):
    return goal.target_pose.header.frame_id == "map" and goal.target_pose.pose.position.x == HOME[0]


def test_a_robot_that_cannot_get_home_asks_for_help(mission, robot, door, answer):
    answer(30.0, "yes")
    blocked = robot.reply_conditionally(goes_home, status="aborted", duration=5)
    # It asks when three tries of 5 s, and the 5 s and 10 s between them, are over.
    asked = 30 + 13 + 3 * 5 + 15
    answer(asked + 20.0, "yes")
    mission.clock.call_later(asked + 10.0, lambda: setattr(blocked, "status", "succeeded"))
    run = mission(delivery())
    run.assert_outcome("succeeded")
    assert run.visits("DRIVE_HOME") == 2
    assert places(robot).count(HOME) == 4


def test_and_stays_where_it_is_when_nobody_helps(mission, robot, door, answer):
    answer(30.0, "yes")
    robot.reply_conditionally(goes_home, status="aborted", duration=5)
    run = mission(delivery(patience=100.0))
    run.assert_outcome("aborted")
    assert run.outcomes("HELP") == ("no_answer",)
    assert run.userdata["delivered"] is True


def test_a_door_that_cannot_be_closed_behind_it_spoils_nothing(mission, machine, robot, answer):
    mission.topic("doors/lab/open", Bool).publish(Bool(data=True), latch=True)
    service = mission.service_server("doors/lab/set", SetBool)
    service.default_response({"success": False})
    service.reply({"success": True})
    service.reply({"success": True})
    answer(30.0, "yes")
    mission(machine).assert_outcome("succeeded")
    assert [request.data for request in service.requests] == [True, True, False, False, False]


def test_a_robot_that_dies_and_comes_back_is_sent_home(mission, machine, robot, door):
    robot.reply(duration=10)
    robot.die(after=3, back_after=1)
    mission(machine).assert_outcome("brought_back")


@pytest.mark.parametrize(
    "state", ["APPROACH", "GO/OPEN/WAIT", "ENTER", "CONFIRM", "TURN", "RELEASE", "DRIVE_HOME"]
)
def test_a_preempt_stops_it_anywhere(mission, machine, robot, door, answer, state):
    answer(30.0, "yes")
    mission.preempt(on=state, after=1.0)
    run = mission(machine)
    run.assert_outcome("preempted")
    assert run.goals_left == ()


def test_a_second_run_begins_anew(mission, machine, robot, door, answer):
    answer(30.0, "yes")
    mission(machine).assert_outcome("succeeded")
    mission(machine).assert_outcome("brought_back")


def test_a_place_without_a_door(mission, robot, answer):
    answer(15.0, "yes")
    run = mission(delivery(to="kitchen"))
    run.assert_outcome("succeeded")
    run.assert_path(["ENTER", "CONFIRM", "TURN", "RELEASE", "NOTE", "DRIVE_HOME", "REPORT"])


# -- bad input -------------------------------------------------------------------------------------


def test_an_unknown_place_is_named_with_the_nearest():
    with pytest.raises(MissionError, match=r"got 'lap'; expected one of .* Did you mean 'lab'\?"):
        delivery(to="lap")


def test_every_problem_of_the_places_is_named(tmp_path):
    path = tmp_path / "places.yaml"
    path.write_text(
        f"map: {OFFICE_MAP}\nrobot: {OFFICE_ROBOT}\nhome: {{x: 0.5, y: 5}}\n"
        "places:\n"
        "  - {name: lab, x: 17.9, y: 5.4, door: lab}\n"
        "  - {name: lab, x: 17.9, y: 5.4}\n"
        "  - {name: den, x: 17.9, y: 5.4, wait: {x: 18, y: 7.7}}\n"
        "  - {x: 17.9, y: .nan, door: my door}\n"
    )
    with pytest.raises(InputFileError) as error:
        delivery(places=path)
    found = [str(problem).removeprefix(f"{path}:") for problem in error.value.problems]
    assert [text.split(";")[0] for text in found] == [
        "3: home.x: got 0.5",
        "5: places[0].wait.x: got nothing",
        "5: places[0].wait.y: got nothing",
        "6: places[1].name: got 'lab'",
        "7: places[2].wait: got {'x': 18, 'y': 7.7}",
        "8: places[3].name: got nothing",
        "8: places[3].door: got 'my door'",
        "8: places[3].wait.x: got nothing",
        "8: places[3].wait.y: got nothing",
        "8: places[3].y: got nan",
    ]


# -- the whole -------------------------------------------------------------------------------------


def test_a_check_finds_no_problems(machine):
    report = check(machine, name="DELIVERY")
    report.assert_ok()


def hands_over_only_after_a_yes(run):
    return not run.visits("TURN") or "yes" in run.outcomes("CONFIRM")


def ends_at_home_or_says_that_it_does_not(run):
    home = run.outcomes("DRIVE_HOME")[-1:] == ("succeeded",)
    return run.outcome == "preempted" or home == (run.outcome in {"succeeded", "brought_back"})


def succeeds_only_with_what_was_delivered(run):
    return (run.outcome == "succeeded") <= bool(run.visits("NOTE"))


def test_whatever_happens_it_comes_home_or_says_so(mission, machine):
    found = mission.explore(
        machine,
        keep=["NOTE", "REPORT"],
        invariants=[
            hands_over_only_after_a_yes,
            ends_at_home_or_says_that_it_does_not,
            succeeds_only_with_what_was_delivered,
        ],
        max_runs=300,
        max_time=40,
    )
    found.assert_ok()


@pytest.mark.slow
def test_whatever_servers_do_it_ends(mission, machine):
    found = mission.explore(
        machine, real_actions=True, interleavings=False, max_runs=60, max_time=40
    )
    found.assert_ok()


# -- in the simulated office -----------------------------------------------------------------------


@contextlib.contextmanager
def in_the_office(clock):
    """The office with its doors; `answers` are given two seconds after each question."""
    with contextlib.ExitStack() as stack:
        network = MemoryNetwork(clock)
        building = stack.enter_context(Node("building", transport=network.session(), clock=clock))
        node = Node("mission", transport=network.session(), clock=clock, namespace="robot_0")
        stack.enter_context(node)
        stack.enter_context(use_node(node))
        world = stack.enter_context(simulation(OFFICE_DOORS, node=building))
        answer = stack.enter_context(Publisher("/robot_0/operator/answer", String, node=building))

        def on_question(message):
            if message.data:
                world.asked.append(message.data)
                clock.call_later(2.0, lambda: answer.publish(String(world.answers.pop(0))))

        world.asked, world.answers = [], []
        stack.enter_context(
            Subscriber("/robot_0/operator/question", String, on_question, node=building)
        )
        yield world


@pytest.fixture
def office_world(clock):
    with in_the_office(clock) as world:
        yield world


def test_the_simulated_robot_delivers_through_the_door_and_closes_it(office_world):
    office_world.answers = ["yes"]
    body, lab = office_world.robots["robot_0"].body, office_world.world.doors["lab"]
    machine, seen = delivery(), []

    def listen(event):
        if isinstance(event, ev.Left) and event.path in {"/DELIVERY/GO", "/DELIVERY/COME_BACK"}:
            seen.append((round(body.x, 1), round(body.y, 1), lab.is_open))

    machine.subscribe(listen)
    assert machine.execute() == "succeeded"
    assert seen == [(*LAB, True), (*HOME, False)]


def test_it_comes_home_when_nobody_wants_it(office_world):
    office_world.answers = ["no"]
    machine = delivery()
    assert machine.execute() == "brought_back"
    body = office_world.robots["robot_0"].body
    assert (round(body.x, 1), round(body.y, 1)) == HOME
    assert not office_world.world.doors["lab"].is_open


def test_something_in_the_doorway_sends_it_home(office_world):
    office_world.world.add_obstacle(18.0, 6.6, 0.4)
    assert delivery().execute() == "brought_back"
    body = office_world.robots["robot_0"].body
    assert (round(body.x, 1), round(body.y, 1)) == HOME
    assert office_world.asked == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_it_delivers_whoever_goes_first(seed):
    with VirtualClock(seed) as clock, use_clock(clock), in_the_office(clock) as office_world:
        office_world.answers = ["yes"]
        assert delivery().execute() == "succeeded"
