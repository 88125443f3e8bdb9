"""One machine of each shipped mission, run twice: what belongs to a run begins anew."""

from __future__ import annotations

import importlib
import math
import tomllib

import pytest

from actionlib_core.interfaces import get_action
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState, LaserScan
from actionlib_core.interfaces.std_msgs.msg import Bool, String
from actionlib_core.interfaces.std_srvs.srv import Empty, SetBool, SetBoolResponse
from actionlib_core.node import Node
from smachpy import describe
from smachpy import events as ev
from smachpy.machines.mission_info import mission_info
from smachpy.sim.server import RobotServer
from smachpy.sim.world import Robot, World
from smachpy_missions.course.demo_action import DemoActionServer
from smachpy_missions.course.demo_service import server_maker
from smachpy_missions.interfaces import DeliverResult, RechargeResult
from tests.places import ROOT

ARGUMENTS = {
    "fleet": {"robots": 2, "orders": 3, "start": False},
    "rp_action.gotopose": {"robot": "robot_0", "x": 1.0, "y": 2.0},
    "rp_action.stopmove": {"robot": "robot_0"},
    "rp_action.turn": {"client": "robot_0", "angle": 90.0},
}
ROBOT = {"move_base", "charge", "deliver", "recharge", "turn"}  # what the servers here play
OTHERS = {"demo_action.client": DemoActionServer, "demo_service.client": server_maker()}
RESULTS = {"deliver": DeliverResult(charge=1.0), "recharge": RechargeResult(charge=1.0, left=True)}
OUTCOMES = {
    "move_cup": "held",
    "shuttle": "arrived",
    "take_cup": "held",
    "demo_action.server": "preempted",
    "demo_service.server": "preempted",
    "fleet": "undelivered",  # robots that ask the dispatcher for nothing
}
# Missions that drive the robot although no state of theirs says so.
DRIVES = {name: [("move_base", "move_base_msgs/MoveBase")] for name in ("look_at", "shuttle")}
DRIVE_S = 10.0


def listed():
    with (ROOT / "pyproject.toml").open("rb") as file:
        return dict(tomllib.load(file)["project"]["entry-points"]["smachpy.missions"])


def make(name):
    module, _, function = listed()[name].partition(":")
    make = getattr(importlib.import_module(module), function)
    return make, make(**ARGUMENTS.get(name, {}))


def servers_of(machine, serves):
    """Return (name, type) of the robot's actions that a machine calls."""
    facts = (dict(state.details) for state in describe(machine).walk() if state.kind == "action")
    wanted = {(one["action"], one["type"]) for one in facts if one["action"] not in serves}
    return sorted((n, t) for n, t in wanted if n.rpartition("/")[2] in ROBOT)


def surroundings(mission, name, machine, serves):
    """Put a robot that does all it is told around a machine, a door that obeys, and an operator."""
    wanted = servers_of(machine, serves)
    for action, kind in wanted or DRIVES.get(name, ()):
        result = RESULTS.get(action.rpartition("/")[2])
        mission.action_server(action, get_action(kind)).default_result(result, duration=DRIVE_S)
    if name == "rp_action.stopmove":
        for action, kind in (
            ("move_base", "move_base_msgs/MoveBase"),
            ("turn", "mission_msgs/Turn"),
        ):
            mission.action_server(f"robot_0/{action}", get_action(kind))
    odometry = Odometry()
    odometry.pose.pose.orientation.w = 1.0
    scan = LaserScan(angle_increment=math.tau / 8, range_max=3.0, ranges=[2.0] * 8)
    for prefix in ("", "robot_0/"):
        mission.topic(f"{prefix}odom", Odometry).publish_every(0.5, [odometry] * 1000)
        mission.topic(f"{prefix}battery", BatteryState).publish(percentage=1.0, latch=True)
        mission.topic(f"{prefix}scan", LaserScan).publish_every(0.5, [scan] * 1000)
    mission.topic("doors/lab/open", Bool).publish(Bool(data=True), latch=True)
    door = mission.service_server("doors/lab/set", SetBool)
    for _ in range(20):
        door.reply(SetBoolResponse(success=True))
    mission.service_server("move_base/clear_costmaps", Empty)
    mission.topic("operator/answer", String).publish_every(5.0, [String("yes")] * 100)


def story(run):
    """Return what states, actions and servers did, without times and ids."""
    kinds = (ev.Entered, ev.Left, ev.Failed, ev.GoalSent, ev.GoalDone, ev.Finished)
    told = [event for event in run.events if isinstance(event, kinds)]
    return [
        (
            type(event).__name__,
            event.path,
            getattr(event, "outcome", None),
            getattr(event, "status", None),
        )
        for event in told
    ]


@pytest.fixture
def robot(mission, office, office_robot):
    """The simulated robot, for the mission that turns it by `cmd_vel`."""
    with Node("robot", transport=mission.network.session(), clock=mission.clock) as node:
        body = Robot(World(office), office_robot, office_robot.start, mission.clock.now())
        server = RobotServer(body, node=node)
        server.start()
        yield
        server.close()


@pytest.mark.parametrize("name", sorted(listed()))
def test_a_machine_that_runs_again_does_the_same_again(
    mission, name, tmp_path, monkeypatch, request
):
    monkeypatch.chdir(tmp_path)  # maps, photos
    function, machine = make(name)
    if name == "rp_action":
        request.getfixturevalue("robot")
    else:
        surroundings(mission, name, machine, mission_info(function).serves)
    runs = []
    for _ in range(2):
        other = OTHERS[name]() if name in OTHERS else None
        if name.endswith(".server"):
            mission.preempt(at=5.0)
        runs.append(mission(machine))
        if other is not None:
            other.close()
    first, second = runs
    assert first.outcome == OUTCOMES.get(name, "succeeded")
    assert second.outcome == first.outcome
    assert sorted(story(second), key=repr) == sorted(story(first), key=repr)  # branches take turns
