"""Actions as the page's server sees them: on virtual time, in one process."""

from __future__ import annotations

import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces import define_action, get_action
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.transport.tokens import Endpoint, Kind, token_key
from smachpy_viz.live import actions as actions_module
from smachpy_viz.live.actions import MAX_KEPT_GOALS, MAX_RUNNING_GOALS, Actions, GoalRefusedError
from smachpy_viz.live.server_goals import GoalsError
from tests.ros2_server import Ros2Server


class World:
    def __init__(self, clock):
        self.clock = clock
        self.network = MemoryNetwork(clock)
        self.viewer = Node("viewer", transport=self.network.session(), clock=clock)
        self.robot = Node("robot", transport=self.network.session(), clock=clock)
        self.changes = 0
        self.actions = Actions(self.viewer, self.count)

    def count(self):
        self.changes += 1

    def serve(self, execute=None, name="count", spec=msg.TestAction):
        def at_once(_goal):
            server.set_succeeded()

        server = SimpleActionServer(
            name, spec, execute or at_once, auto_start=False, node=self.robot
        )
        server.start()
        self.clock.sleep(0.5)
        return server

    def close(self):
        self.actions.close()
        for node in (self.viewer, self.robot):
            node.close()
            node.transport.close()
        self.clock.sleep(60.0)  # servers end their last goal

    def goal(self):
        return self.actions.summary()["goals"][0]


@pytest.fixture
def world(clock):
    world = World(clock)
    yield world
    world.close()


def counting(world):
    def execute(goal):
        for left in range(goal.goal, 0, -1):
            server.publish_feedback(msg.TestFeedback(left))
            if server.is_preempt_requested():
                server.set_preempted(text="stopped")
                return
            world.clock.sleep(1.0)
        server.set_succeeded(msg.TestResult(goal.goal), "done")

    server = world.serve(execute)
    return server


def test_actions_are_found_and_forgotten(world):
    assert world.actions.summary() == {"actions": [], "gone": [], "goals": []}
    server = world.serve()
    (found,) = world.actions.summary()["actions"]
    assert found == {"name": "count", "type": "actionlib/Test", "node": "robot", "servers": 1}
    assert world.actions.summary()["gone"] == []
    assert world.changes
    server.action_server.stop()
    world.clock.sleep(0.5)
    assert world.actions.summary() == {"actions": [], "gone": [], "goals": []}


def test_action_that_a_page_has_used_is_named_when_its_server_has_gone(world):
    server = world.serve()
    world.actions.definition("count")
    server.action_server.stop()
    world.clock.sleep(0.5)
    assert world.actions.summary()["gone"] == ["count"]


def test_a_server_that_is_late_is_not_called_gone(world, monkeypatch):
    server = world.serve()
    monkeypatch.setattr(actions_module.ActionClient, "wait_for_server", lambda *_: False)
    with pytest.raises(GoalRefusedError, match="its server is there, but was not reached"):
        world.actions.send("count", "{goal: 1}")

    def end(*_):
        server.action_server.stop()
        world.clock.sleep(0.5)
        return False

    monkeypatch.setattr(actions_module.ActionClient, "wait_for_server", end)
    with pytest.raises(GoalRefusedError, match="got no server"):
        world.actions.send("count", "{goal: 1}")
    assert world.actions.summary()["goals"] == []


def test_flood_of_invented_action_servers_leaves_nothing_behind(world, monkeypatch, caplog):
    monkeypatch.setattr(actions_module, "MAX_ACTIONS", 20)
    transport = world.robot.transport
    ends = [
        Endpoint(Kind.ACTION_SERVER, f"a{i}", "actionlib/TestAction", "x", "s", "evil", i)
        for i in range(50)
    ]
    tokens = [transport.declare_alive(token_key(end)) for end in ends]
    world.clock.sleep(0.5)
    assert len(world.actions.summary()["actions"]) == 20
    assert len([one for one in caplog.records if one.levelname == "ERROR"]) == 1
    for token in tokens:
        token.close()
    world.clock.sleep(0.5)
    assert world.actions.summary() == {"actions": [], "gone": [], "goals": []}
    assert not world.actions._servers
    assert not world.actions._nodes


def test_a_form_is_told_of_the_fields(world):
    world.serve()
    form = world.actions.definition("count")
    assert form["type"] == "actionlib/Test"
    assert [(one["name"], one["kind"]) for one in form["fields"]] == [("goal", "integer")]
    assert form["values"] == {"goal": "0"}
    assert form["yaml"].startswith("goal: 0")


def test_a_goal_with_feedback_and_result(world):
    counting(world)
    sent = world.actions.send("count", "{goal: 3}")
    world.clock.sleep(1.5)
    goal = world.goal()
    assert (goal["id"], goal["state"], goal["ended"]) == (sent, "ACTIVE", None)
    assert goal["feedback"] == "feedback: 2"
    world.clock.sleep(5.0)
    goal = world.goal()
    assert (goal["status"], goal["text"], goal["result"]) == ("SUCCEEDED", "done", "result: 3")
    assert goal["feedback_count"] == 3
    assert goal["ended"] - goal["sent"] == pytest.approx(3e9, rel=0.1)


def test_cancel(world):
    counting(world)
    sent = world.actions.send("count", "{goal: 30}")
    world.clock.sleep(1.5)
    world.actions.cancel(sent)
    assert world.goal()["cancelled"]
    world.clock.sleep(2.0)
    assert (world.goal()["status"], world.goal()["text"]) == ("PREEMPTED", "stopped")
    with pytest.raises(GoalRefusedError, match="has ended already: PREEMPTED"):
        world.actions.cancel(sent)
    with pytest.raises(GoalRefusedError, match="not sent from here"):
        world.actions.cancel("another")


def test_bad_values_are_named_with_their_fields_and_nothing_is_sent(world):
    world.serve()
    for do in (world.actions.send, world.actions.check):
        with pytest.raises(GoalRefusedError) as caught:
            do("count", "{goal: many, gaol: 1}")
        assert [one["path"] for one in caught.value.problems] == ["$.goal", "$.gaol"]
    assert world.actions.summary()["goals"] == []


def test_what_is_checked_comes_back_in_both_forms(world):
    world.serve()
    found = world.actions.check("count", "{goal: 0x10}")
    assert found["values"] == {"goal": "16"}
    assert found["yaml"].startswith("goal: 16")


def test_a_server_that_dies_loses_its_goal_and_says_so(world):
    counting(world)
    world.actions.send("count", "{goal: 30}")
    world.clock.sleep(1.5)
    world.robot.transport.kill()
    world.clock.sleep(1.0)
    goal = world.goal()
    assert goal["status"] == "LOST"
    assert goal["ended"] is not None
    assert goal["text"]
    with pytest.raises(GoalRefusedError, match="/count: got no server; expected one"):
        world.actions.send("count", "{goal: 1}")


def test_a_definition_that_is_not_known_here_names_the_way_out(world):
    spec = define_action("gone_msgs/Vanish", "---\n---\n")
    server = world.serve(spec=spec, name="vanish")
    from actionlib_core.interfaces._registry import registry

    assert server
    (end,) = (world.actions._server("vanish"),)
    world.actions._servers["vanish"] = {"x": end._replace(type="nowhere_msgs/NothingAction")}
    with pytest.raises(GoalRefusedError, match="SMACHPY_INTERFACE_PATH"):
        world.actions.definition("vanish")
    world.actions._servers["vanish"] = {"x": end._replace(md5="0" * 32)}
    with pytest.raises(
        GoalRefusedError, match="of the definition here; expected that of the server"
    ):
        world.actions.definition("vanish")
    assert registry.action("gone_msgs/Vanish") is spec


def test_installed_packages_make_their_definitions_known(world, monkeypatch):
    loaded = []

    class Point:
        value = "own.interfaces"

        def load(self):
            loaded.append(self.value)
            define_action("late_msgs/Late", "uint8 x\n---\n---")

    class Broken(Point):
        def load(self):
            raise RuntimeError("broken package")

    monkeypatch.setattr("smachpy_viz.live.actions.entry_points", lambda group: [Broken(), Point()])
    world.serve()
    end = world.actions._server("count")
    other = get_action("actionlib/Test")
    assert other._md5sum == end.md5
    world.actions._servers["late"] = {"x": end._replace(type="late_msgs/LateAction")}
    with pytest.raises(
        GoalRefusedError, match="of the definition here; expected that of the server"
    ):  # but it is found
        world.actions.definition("late")
    assert loaded == ["own.interfaces"]


def test_ended_goals_are_forgotten_and_running_ones_are_limited(world):
    world.serve()
    for _ in range(MAX_KEPT_GOALS + 5):
        world.actions.send("count", "{goal: 0}")
        world.clock.sleep(0.2)
    assert len(world.actions.summary()["goals"]) == MAX_KEPT_GOALS
    from actionlib_core.action.server import ActionServer

    ActionServer("many", msg.TestAction, lambda handle: handle.set_accepted(), node=world.robot)
    world.clock.sleep(0.5)
    for _ in range(MAX_RUNNING_GOALS):
        world.actions.send("many", "{goal: 1}")
    with pytest.raises(GoalRefusedError, match=f"expected fewer than {MAX_RUNNING_GOALS}"):
        world.actions.send("many", "{goal: 1}")


def test_actions_of_two_networks_are_told_apart(world):
    world.serve()
    elsewhere = MemoryNetwork(world.clock)
    viewer, robot = (
        Node(name, transport=elsewhere.session(), clock=world.clock) for name in ("viewer", "robot")
    )
    done = []
    server = SimpleActionServer(
        "count",
        msg.TestAction,
        lambda goal: (done.append(goal.goal), server.set_succeeded()),
        auto_start=False,
        node=robot,
    )
    server.start()
    world.actions.join(viewer)
    world.clock.sleep(0.5)
    assert [one["name"] for one in world.actions.summary()["actions"]] == ["count", "count (2)"]
    world.actions.send("count (2)", "goal: 7")
    world.clock.sleep(1.0)
    assert done == [7]
    world.actions.leave(viewer)
    assert [one["name"] for one in world.actions.summary()["actions"]] == ["count"]
    viewer.close()
    robot.close()
    world.clock.sleep(60.0)


def test_an_action_of_two_networks_keeps_its_name_until_its_own_server_goes(world):
    elsewhere = MemoryNetwork(world.clock)
    viewer, robot = (
        Node(name, transport=elsewhere.session(), clock=world.clock) for name in ("viewer", "robot")
    )
    first = world.serve()
    world.actions.join(viewer)
    server = SimpleActionServer("count", msg.TestAction, auto_start=False, node=robot)
    server.start()
    world.clock.sleep(0.5)
    first.action_server.stop()
    world.clock.sleep(0.5)
    assert [one["name"] for one in world.actions.summary()["actions"]] == ["count (2)"]
    server.action_server.stop()
    world.clock.sleep(0.5)
    assert world.actions.summary()["actions"] == []
    with pytest.raises(GoalRefusedError, match="got no server"):
        world.actions.send("count (2)", "goal: 7")
    world.serve()
    assert [one["name"] for one in world.actions.summary()["actions"]] == ["count"]
    viewer.close()
    robot.close()
    world.clock.sleep(60.0)


def test_actions_of_a_ros2_robot(clock):
    network = MemoryNetwork(clock)
    sessions = network.session(), network.session()
    config = Config(ros2=(Ros2(domain=42),))
    viewer = Node("viewer", transport=sessions[0], clock=clock, config=config)
    robot = Ros2Server(sessions[1], clock, "navigate_to_pose", NavigateToPose, domain=42)
    robot.on_result = lambda query, uuid: robot.answer_result(query, 4)
    actions = Actions(viewer)
    clock.sleep(0.5)
    (shown,) = actions.summary()["actions"]
    assert (shown["name"], shown["type"]) == ("navigate_to_pose", "nav2_msgs/action/NavigateToPose")
    form = actions.definition("navigate_to_pose")
    assert [field["name"] for field in form["fields"]] == ["pose", "behavior_tree"]
    assert form["values"]["pose"]["pose"]["orientation"]["w"] == "1.0"
    with pytest.raises(GoalRefusedError):
        actions.send("navigate_to_pose", "{poze: {}}")
    actions.send("navigate_to_pose", form["yaml"])
    clock.sleep(1.0)
    (goal,) = actions.summary()["goals"]
    assert goal["status"] == "SUCCEEDED"
    assert robot.problems == []
    actions.close()
    robot.close()
    viewer.close()
    for session in sessions:
        session.close()


def test_a_goal_is_cancelled_though_its_server_takes_seconds_to_answer(world, monkeypatch):
    """It was asked for its goals first, and given up after 1 s; the robot drove on."""
    server = counting(world)
    world.actions.send("count", "{goal: 50}")
    world.clock.sleep(1.0)
    (goal,) = world.actions.server_goals("count")
    query = world.viewer.transport.query

    def slowly(*asked, timeout, on_done, **more):
        world.clock.sleep(min(2.0, timeout))
        if timeout < 2.0:
            return on_done()
        return query(*asked, timeout=timeout, on_done=on_done, **more)

    monkeypatch.setattr(world.viewer.transport, "query", slowly)
    world.actions.cancel_any("count", goal["id"])
    world.clock.sleep(3.0)
    assert not server.is_active()


def test_a_goal_of_a_client_that_is_gone_can_be_cancelled(world):
    """Its own program can no longer do it, and the robot drives on."""
    server = counting(world)
    planner = Node("planner", transport=world.network.session(), clock=world.clock)
    client = SimpleActionClient("count", msg.TestAction, node=planner)
    assert client.wait_for_server(5.0)
    client.send_goal(msg.TestGoal(50))
    world.clock.sleep(1.0)
    (goal,) = world.actions.server_goals("count")
    assert (goal["sender"], goal["gone"], goal["status"]) == ("planner", False, "ACTIVE")
    client.stop()
    planner.close()
    planner.transport.close()
    world.clock.sleep(1.0)
    (goal,) = world.actions.server_goals("count")
    assert goal["gone"]
    with pytest.raises(GoalsError, match="not running"):
        world.actions.cancel_any("count", "planner-9-1.0")
    world.actions.cancel_any("count", goal["id"])
    world.clock.sleep(3.0)
    assert not server.is_active()
    assert world.actions.server_goals("count") == []
