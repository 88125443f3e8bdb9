"""The plans of missions/smachpy_missions/pnp: loaded, checked, and driven on the simulated robot."""

import contextlib
from pathlib import Path

import pytest

import smachpy
import smachpy_missions.pnp
from actionlib_core.node import Node, use_node
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import State, events
from smachpy.command import main
from smachpy.command.surroundings import ROBOT_ACTIONS, _robots_of
from smachpy.exceptions import MissionError
from smachpy.places.pose import Pose2D
from smachpy.pnp import load, load_plan
from smachpy.pnp.mapping import read_mapping
from smachpy.sim.server import RobotServer
from smachpy.sim.world import Robot, World
from smachpy_missions.pnp.robot import look, say

FOLDER = Path(smachpy_missions.pnp.__file__).parent
PLANS = ["rounds", "look", "together", "avoid", "errand", "meet"]


def driven(plan):
    heard = []
    plan.subscribe(heard.append)
    outcome = plan.execute()
    return outcome, [e.path for e in heard if isinstance(e, events.Left)]


@pytest.mark.parametrize("name", PLANS)
def test_nothing_is_wrong_with_them(name):
    plan = load_plan(FOLDER / f"{name}.pnml")
    assert plan.problems == ()
    assert smachpy.check(plan).ok, str(smachpy.check(plan))


def test_together(clock, simulation):
    outcome, left = driven(load_plan(FOLDER / "together.pnml"))
    assert outcome == "goal"
    assert left == ["/together/say_hello", "/together/wait_2", "/together/goto_kitchen"]
    assert simulation.robot.body.pose.x == pytest.approx(4.6, abs=0.3)


def test_look(clock, simulation):
    plan = load_plan(FOLDER / "look.pnml")
    plan.userdata.cup = True
    outcome, left = driven(plan)
    assert outcome == "goal"
    assert "/look/say_cup" in left


def test_avoid(clock, simulation):
    plan = load_plan(FOLDER / "avoid.pnml")
    clock.call_later(3.0, lambda: plan.post("obstacle"))
    outcome, left = driven(plan)
    assert outcome == "goal"
    assert left.count("/avoid/goto_kitchen") == 2


def test_errand(clock, simulation):
    outcome, left = driven(load_plan(FOLDER / "errand.pnml"))
    assert outcome == "goal"
    assert left[-2:] == ["/errand/avoid", "/errand/goto_hall"]


class Count(State):
    def __init__(self, *parameters):
        super().__init__(["succeeded"], io_keys=["rounds"])

    def execute(self, ud):
        ud.rounds = ud.rounds + 0.5 if "rounds" in ud else 0.5
        return "succeeded"


def test_rounds():
    conditions = read_mapping(FOLDER / "actions.yaml").conditions
    plan = load(FOLDER / "rounds.pnml", {"goto": Count}, conditions)
    outcome, left = driven(plan)
    assert (outcome, len(left)) == ("goal", 4)


def test_meet_with_two_simulated_robots(clock, office, office_robot):
    network = MemoryNetwork(clock)
    world = World(office)
    robots = []
    with contextlib.ExitStack() as stack:
        for name, pose in (("robot_0", Pose2D(2.0, 10.6, 0.0)), ("robot_1", office_robot.start)):
            node = Node("robot", transport=network.session(), clock=clock, namespace=name)
            stack.enter_context(node)
            robots.append(Robot(world, office_robot, pose, clock.now()))
            server = RobotServer(robots[-1], node=node)
            server.start()
            stack.callback(server.close)
        node = stack.enter_context(Node("mission", transport=network.session(), clock=clock))
        stack.enter_context(use_node(node))
        outcome, left = driven(load_plan(FOLDER / "meet.pnml"))
    assert outcome == "goal"
    assert set(left[:2]) == {"/meet/robot_0#goto_kitchen", "/meet/robot_1#goto_hall"}
    (kitchen, hall) = (robot.body.pose for robot in robots)
    assert (kitchen.x, kitchen.y) == pytest.approx((4.6, 10.6), abs=0.3)
    assert (hall.x, hall.y) == pytest.approx((9.8, 7.1), abs=0.3)


def test_meet(clock):
    class Drive(State):
        def __init__(self, place):
            super().__init__(["succeeded", "preempted"])
            self.seconds = {"kitchen": 5.0, "hall": 2.0}[place]

        def execute(self, ud):
            return "preempted" if self.sleep(self.seconds) else "succeeded"

    plan = load(FOLDER / "meet.pnml", {"goto": Drive, "say": say, "look": look})
    outcome, left = driven(plan)
    assert outcome == "goal"
    assert clock.now() == pytest.approx(5.0)
    assert left[:2] == ["/meet/robot_1#goto_hall", "/meet/robot_0#goto_kitchen"]


def test_two_robots_meet_by_the_command_line_alone(capsys):
    assert main(["run", str(FOLDER / "meet.pnml"), "--time", "virtual", "--plain"]) == 0
    assert "meet: goal after" in capsys.readouterr().out


def calls(*names):
    """Return name -> type of actions, with the types of the simulated robot."""
    return {name: ROBOT_ACTIONS.get(name.rpartition("/")[2], "") for name in names}


@pytest.mark.parametrize(
    ("names", "robots"),
    [
        (["/move_base"], ("", 1)),
        (["/robot_2/move_base", "/robot_2/charge"], ("robot_2", 1)),
        (["/robot_0/move_base", "/robot_2/move_base", "/speak"], ("", 3)),
        ([], ("", 1)),
    ],
)
def test_which_robots_a_mission_needs(names, robots):
    assert _robots_of(calls(*names)) == robots


def test_robots_of_other_names_are_not_brought():
    with pytest.raises(MissionError):
        _robots_of(calls("/left/move_base", "/right/move_base"))


def test_actions_of_other_types_need_no_robot():
    needed = {"/robot_0/move_base": "mbf_msgs/MoveBaseAction", "/robot_1/charge": "my/ChargeAction"}
    assert _robots_of(needed) == ("", 1)
