"""The commands at a ROS 2 robot, on a network in memory."""

from __future__ import annotations

import json

import pytest

from actionlib_core.cli import main
from actionlib_core.config import Config, Ros2
from actionlib_core.exceptions import TransportError
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.node import Node
from actionlib_core.pubsub.topic import Publisher
from actionlib_core.transport import Quality
from actionlib_core.wire.ros2 import ends
from actionlib_core.wire.ros2.graph import RosNode, RosType
from actionlib_core.wire.ros2.names import LATCHED, Kind
from tests.ros2_server import Ros2Server

ID = "0123456789abcdef0123456789abcdef"
UUID = bytes.fromhex(ID)


class Robot:
    """A robot with an action `fib`, and commands beside it."""

    def __init__(self, clock, network, capsys):
        self.clock, self._network, self._capsys = clock, network, capsys
        self.session = network.session()
        self.action = Ros2Server(self.session, clock, "arm/fib", Fibonacci, domain=42)
        self.desk = Node("desk", transport=network.session(), clock=clock)
        self.config = None

    def node(self, **settings):
        config = self.config or Config(ros2=(Ros2(domain=42, **settings),))
        return Node("shell", transport=self._network.session(), clock=self.clock, config=config)

    def both(self, *argv, code=0, **settings):
        """Run a command; return what it printed, and its errors."""
        self._capsys.readouterr()
        with self.node(**settings) as node:
            assert main(argv, node=node) == code
        node.transport.close()
        return self._capsys.readouterr()

    def __call__(self, *argv, code=0, **settings):
        out, err = self.both(*argv, code=code, **settings)
        return out if not code else out + err

    def json(self, *argv, code=0, **settings):
        return json.loads(self(*argv, "--json", code=code, **settings))


@pytest.fixture
def robot(clock, network, capsys):
    made = Robot(clock, network, capsys)
    yield made
    assert made.action.problems == []
    made.action.close()
    made.desk.close()
    made.session.close()


def test_what_is_there(robot):
    node = RosNode(robot.session, robot.clock, domain=42, full_name="base/driver")
    ends = [
        node.end(kind, name, RosType(type_name, "RIHS01_" + "0" * 64))
        for kind, name, type_name in (
            (Kind.PUBLISHER, "odom", "nav_msgs/msg/Odometry"),
            (Kind.SUBSCRIPTION, "cmd_vel", "geometry_msgs/msg/Twist"),
            (Kind.SERVICE, "reset", "std_srvs/srv/Empty"),
            (Kind.SERVICE, "_hidden", "std_srvs/srv/Empty"),
        )
    ]
    for end in ends:
        end.show()
    assert robot("list", "-t") == "/arm/fib [test_msgs/action/Fibonacci]\n"
    assert robot("type", "arm/fib") == "test_msgs/action/Fibonacci\n"
    assert robot("find", "test_msgs/Fibonacci") == "/arm/fib\n"
    assert [end["node"] for end in robot.json("info", "arm/fib")["servers"]] == ["/robot"]
    assert robot("topic", "list", "-t").splitlines() == [
        "/cmd_vel [geometry_msgs/msg/Twist]",
        "/odom [nav_msgs/msg/Odometry]",
    ]
    assert robot("service", "list", "-t") == "/reset [std_srvs/srv/Empty]\n"
    assert "/driver  type: nav_msgs/msg/Odometry  type hash: RIHS01_0" in robot(
        "topic", "info", "odom", "-v"
    )
    assert robot("list", namespace="arm") == "/fib\n"
    assert robot("list", robot="robot1") == "/robot1/arm/fib\n"
    for end in ends:
        end.close()


def test_a_goal_and_its_result(robot):
    def on_goal(query, uuid):
        robot.action.accept(query, uuid)
        robot.action.set_state(uuid, 2)

    def on_result(query, uuid):
        robot.action.park(query, uuid)
        robot.action.publish_feedback(uuid, Fibonacci.Feedback(sequence=[0, 1]))
        robot.action.end(uuid, 4, Fibonacci.Result(sequence=[0, 1, 1]))

    robot.action.on_goal, robot.action.on_result = on_goal, on_result
    printed = robot("send_goal", "arm/fib", "{order: 3}", "-f")
    assert "sequence: [0, 1, 1]" in printed
    assert "SUCCEEDED" in printed
    assert [goal.order for goal in robot.action.goals.values()] == [3]
    assert robot("send_goal", "arm/fib", "{oder: 3}", code=2).count("order") > 0
    robot.action.on_goal = robot.action.refuse
    assert "rejected" in robot("send_goal", "arm/fib", "test_msgs/Fibonacci", "{}", code=1)


def test_goals_of_a_server(robot):
    assert robot.json("goal", "list", "arm/fib") == []
    robot.action.set_state(UUID, 2)
    (goal,) = robot.json("goal", "list", "arm/fib")
    assert (goal["id"], goal["status"]) == (ID, "ACTIVE")
    assert robot.json("goal", "info", "arm/fib", ID)["result"] is None
    robot.action.set_state(UUID, 4)
    robot.action.on_result = lambda query, _uuid: robot.action.answer_result(
        query, 4, Fibonacci.Result(sequence=[1])
    )
    assert robot.json("goal", "info", "arm/fib", ID)["result"] == {"sequence": [1]}
    robot.action.on_result = lambda query, _uuid: robot.action.answer_result(query, 0)
    assert robot.json("goal", "info", "arm/fib", "5" * 32, code=1)["status"] == "LOST"


def test_cancel_tells_the_truth(robot):
    robot.action.set_state(UUID, 2)
    assert robot("cancel", "arm/fib", ID) == f"Cancel requested for goal {ID}\n"
    robot.action.on_cancel = robot.action.refuse_cancel
    assert "refused" in robot("cancel", "arm/fib", ID, code=1)
    robot.action.on_cancel = robot.action.let_cancel
    assert "does not know" in robot("cancel", "arm/fib", "5" * 32, code=1)
    assert robot.json("cancel", "arm/fib", "--all") == {"cancelled": [ID]}
    assert robot.action.cancels[-1] == (bytes(16), 0)
    robot.action.on_cancel = lambda query, _uuid: query.finish()
    assert "no answer" in robot("cancel", "arm/fib", ID, code=2)


def test_echo(robot):
    robot.action.set_state(UUID, 2)
    message = robot.json("echo", "arm/fib", "-s", "--once")
    assert message["topic"] == "status"
    assert message["message"]["status_list"][0]["status"] == 2


@pytest.mark.parametrize("distro", ["humble", "kilted"])
def test_another_definition_is_named_with_the_distribution_that_fits(robot, distro):
    if distro == "kilted":  # the same definition
        assert robot("goal", "list", "arm/fib", "-c", distro=distro) == "0\n"
        return
    text = robot("goal", "list", "arm/fib", code=2, distro=distro)
    assert "TypeHashNotSupported" in text
    assert "--distro jazzy" in text


def test_a_name_that_is_not_there(robot):
    text = robot("goal", "list", "arm/fab", code=2)
    assert "/arm/fib" in text


def test_options_of_a_robot_without_its_router(capsys, monkeypatch):
    monkeypatch.delenv("SMACHPY_ROS2", raising=False)
    assert main(["--domain", "3", "list"]) == 2
    assert "--ros2" in capsys.readouterr().err
    for wrong in (
        ("--domain", "-1"),
        ("--domain", "9" * 12),
        ("--distro", "kilt"),
        ("--ros2", " "),
    ):
        with pytest.raises(SystemExit) as caught:
            main([f"{wrong[0]}={wrong[1]}", "list"])
        assert caught.value.code == 2
        assert wrong[1] in capsys.readouterr().err
    assert main(["--ros2", "nonsense", "list"]) == 2
    assert "nonsense" in capsys.readouterr().err


def test_the_bytes_of_a_topic(robot):
    message = ros2.get_message("std_msgs/msg/String")
    node = RosNode(robot.session, robot.clock, domain=42, full_name="talker")
    end = node.end(Kind.PUBLISHER, "chatter", RosType(message._type, message._rihs01), LATCHED)
    publisher = robot.session.publisher(end.key, "", Quality(cache=1))
    publisher.put(message(data="hello").to_cdr(), end.attachment())
    end.show()
    assert "hello" in robot("topic", "echo", "chatter", "--raw", "--once")
    assert robot("topic", "echo", "chatter", "--once") == 'data: "hello"\n---\n'
    end.close()
    publisher.close()


def test_action_that_is_not_there_is_told_with_what_is(robot):
    robot.action.show()
    said = robot("info", "arm/fibb", code=2)
    assert "domain 42: actions: /arm/fib. Did you mean '/arm/fib'?" in said


def test_other_domain_is_told_with_the_one_that_has_nodes(robot):
    other = RosNode(robot.session, robot.clock, domain=7, full_name="other")
    other.show()
    robot.action.close()
    assert "Try --domain 7" in robot("info", "arm/fib", code=2)
    other.close()


def test_who_waits_for_a_server_without_limit_is_told_where_it_is_looked_for(robot):
    robot.action.close()
    late = []

    def appear():
        late.append(Ros2Server(robot.session, robot.clock, "arm/late", Fibonacci, domain=42))
        late[0].on_goal = late[0].refuse

    timer = robot.clock.call_later(10.0, appear)
    said = robot("send_goal", "arm/late", "{order: 3}", code=1)
    timer.cancel()
    assert said.count("no server yet: looked at the program's own network in domain 42") == 1
    late[0].close()


@pytest.mark.parametrize("words", [["--ros2", "tcp/a:1"], ["--domain=4"]])
def test_an_option_of_the_whole_command_after_the_verb_is_told_where_it_belongs(words, capsys):
    with pytest.raises(SystemExit) as caught:
        main(["topic", "list", *words])
    assert caught.value.code == 2
    assert f"Try {words[0].partition('=')[0]} before the verb" in capsys.readouterr().err


# -- a fleet of which one robot is off ---------------------------------------------------------


@pytest.fixture
def fleet(robot, monkeypatch):
    """Commands with two robots in the configuration; the router of robot2 is off."""
    off, joined, join = {"robot2"}, [], ends.network_of

    def network_of(node, settings):
        joined.append(settings.robot)
        if settings.robot in off:
            raise TransportError(f"cannot join tcp/{settings.robot}:7447")
        return join(node, settings)

    monkeypatch.setattr(ends, "network_of", network_of)
    networks = tuple(
        Ros2(domain=42, robot=name, router=f"tcp/{name}:7447") for name in ("robot1", "robot2")
    )
    monkeypatch.setattr(robot, "config", Config(ros2=networks))
    robot.off, robot.joined = off, joined
    robot.action.on_goal = robot.action.refuse
    return robot


@pytest.mark.parametrize("words", [("list", "-t"), ("topic", "list"), ("service", "list")])
def test_list_shows_the_robots_that_are_on_and_names_the_other(fleet, words):
    """All commands failed with the error of the robot that was off."""
    node = RosNode(fleet.session, fleet.clock, domain=42, full_name="base")
    shown = [
        node.end(kind, "scan", RosType("std_msgs/msg/String", "RIHS01_" + "0" * 64))
        for kind in (Kind.PUBLISHER, Kind.SERVICE)
    ]
    for end in shown:
        end.show()
    out, err = fleet.both(*words)
    assert "/robot1/" in out
    assert "actionlib: the names of robot 'robot2' are missing: cannot join tcp/robot2" in err
    for end in shown:
        end.close()


def test_command_joins_the_network_of_its_name_only(fleet):
    for words, code in (
        (("info", "robot1/arm/fib"), 0),
        (("goal", "list", "robot1/arm/fib"), 0),
        (("send_goal", "robot1/arm/fib", "{order: 2}"), 1),
    ):
        _, err = fleet.both(*words, code=code)
        assert "robot2" not in err
    assert set(fleet.joined) == {"robot1"}
    own = Publisher("status", String, node=fleet.desk)
    fleet.joined.clear()
    assert "Publisher count: 1" in fleet.both("topic", "info", "status")[0]
    assert fleet.joined == []
    own.unregister()


def test_command_for_the_robot_that_is_off_says_so(fleet):
    _, err = fleet.both("goal", "list", "robot2/arm/fib", code=2)
    assert "cannot join tcp/robot2:7447" in err
    assert set(fleet.joined) == {"robot2"}


def test_watch_finds_a_robot_that_is_switched_on_later(fleet, caplog):
    node, seen = fleet.node(), []
    watches = ends.watch_ends(node, lambda end, _key, alive: seen.append((end.name, alive)))
    fleet.clock.sleep(60.0)
    assert {name.partition("/")[0] for name, _ in seen} == {"robot1"}
    assert caplog.text.count("Its names are missing until it can be joined") == 1
    fleet.off.clear()
    fleet.clock.sleep(ends.AGAIN_S)
    assert ("robot2/arm/fib", True) in seen
    for watch in watches:
        watch.close()
    node.close()


@pytest.mark.parametrize("what", ["watch", "node"])
def test_watch_that_is_closed_tries_no_longer(fleet, what):
    node = fleet.node()
    watches = ends.watch_ends(node, lambda *_: None)
    node.close() if what == "node" else [watch.close() for watch in watches]
    fleet.joined.clear()
    fleet.clock.sleep(60.0)
    assert fleet.joined == []
    node.close()
