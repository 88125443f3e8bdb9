"""Actions between our network and a real ROS 1, both ways."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections import Counter

import pytest

from actionlib_core import SimpleActionClient, SimpleActionServer
from actionlib_core.goal import client as client_goal
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus, GoalStatusArray
from actionlib_core.node import Node
from actionlib_core.pubsub.topic import Subscriber
from tests.actionlib_core.ros1.conftest import impatient

pytestmark = [pytest.mark.ros1, pytest.mark.zenoh]

WAIT_S = 60.0
GOALS = 200


def client_of(name):
    client = SimpleActionClient(name, msg.TestAction)
    assert client.wait_for_server(WAIT_S)
    return client


def send(client, number):
    client.send_goal(msg.TestGoal(number))
    assert client.wait_for_result(WAIT_S)
    result = client.get_result()
    return client.get_state(), result and result.result


def test_goals_to_a_server_in_ros(ros, bridge):
    ros.start("action_server", "to_ros", "worker")
    bridge(actions={"to_ros": "actionlib/Test"})
    client = client_of("to_ros")
    ended = [send(client, number) for number in range(GOALS)]
    assert ended == [(GoalStatus.SUCCEEDED, 2 * number) for number in range(GOALS)]
    assert client.get_goal_status_text() == "done by ROS 1"


def test_goals_over_a_bridge_in_another_process(ros, command, node):
    server = ros.start("action_server", "beyond", "beyond_worker")
    with command("--action", "beyond"):
        client = client_of("beyond")
        ended = [send(client, number) for number in range(GOALS)]
        assert ended == [(GoalStatus.SUCCEEDED, 2 * number) for number in range(GOALS)]
        begun = node.clock.event()
        client.send_goal(msg.TestGoal(-5), feedback_cb=lambda feedback: begun.set())
        assert begun.wait(WAIT_S)
        server.send_signal(signal.SIGKILL)
        assert client.wait_for_result(WAIT_S)
        assert client.get_state() == GoalStatus.LOST
        assert "beyond_worker" in client.get_goal_status_text()


def test_over_a_bridge_in_this_process_nothing_comes_twice_and_others_hear_all(
    ros, bridge, node, monkeypatch
):
    # A goal that a slow server has not listed after this time is sent again, and passed on again.
    monkeypatch.setattr(client_goal, "RESEND_FIRST_S", 10 * WAIT_S)
    recorder = ros.start("topics", "counter")
    recorder.ask("record /direct/goal")
    ros.start("action_server", "direct", "direct_worker")
    bridge(actions=["direct"])
    client = client_of("direct")
    feedback, seen = [], []
    words = {"goal", "feedback", "result"}
    heard = node.clock.event()

    def see(sample):
        seen.append(sample.key.rpartition("/")[2])
        heard.set()

    with Node("onlooker", clock=node.clock) as onlooker:
        for word in words:
            onlooker.transport.subscribe(f"direct/{word}", see)
        sent = 0
        # Until onlooker and recorder are known everywhere: rospy counts a subscriber's connection
        # before it has made it.
        while not (words <= set(seen) and recorder.ask("heard /direct/goal 0")):
            assert send(client, sent) == (GoalStatus.SUCCEEDED, 2 * sent)
            sent += 1
        before = Counter(seen)
        for number in range(20):
            client.send_goal(
                msg.TestGoal(number), feedback_cb=lambda told: feedback.append(told.feedback)
            )
            assert client.wait_for_result(WAIT_S)
        while any((Counter(seen) - before)[word] < 20 for word in words):
            assert heard.wait(WAIT_S)
            heard.clear()
    # When this one has ended, the copies of those before it have come.
    assert send(client, 99) == (GoalStatus.SUCCEEDED, 198)
    # Nothing comes twice. A goal's result may overtake its feedback, which then is too late: in ROS 1
    # each topic has a connection of its own.
    assert feedback
    assert feedback == sorted(set(feedback))
    told = [int(number) for number in recorder.ask("until /direct/goal 99").split()]
    assert told[-21:] == [*range(20), 99]
    assert told[:-21] == sorted(set(told[:-21]))


def test_a_server_in_ros_that_comes_later_gives_feedback_and_is_cancelled(ros, bridge, node):
    bridge(actions=["late"])
    ros.start("action_server", "late", "late_worker")
    client = client_of("late")
    begun = node.clock.event()
    client.send_goal(msg.TestGoal(-5), feedback_cb=lambda feedback: begun.set())
    assert begun.wait(WAIT_S)
    client.cancel_goal()
    assert client.wait_for_result(WAIT_S)
    assert client.get_state() == GoalStatus.PREEMPTED
    assert client.get_result() == msg.TestResult(-1)


@pytest.mark.parametrize("wanted", [True, False])
def test_a_goal_in_ros_is_cancelled_with_its_client_if_that_wants_it(ros, bridge, node, wanted):
    ros.start("action_server", "left", "left_worker")
    bridge(actions=["left"])
    watcher = client_of("left")
    news = node.clock.event()
    seen = []

    def see(message):
        seen.extend(each.status for each in message.status_list)
        news.set()

    def wait_for(status):
        while status not in seen:
            assert news.wait(WAIT_S)
            news.clear()

    with Subscriber("left/status", GoalStatusArray, see):
        with Node("mortal", clock=node.clock) as mortal:
            client = SimpleActionClient("left", msg.TestAction, node=mortal)
            assert client.wait_for_server(WAIT_S)
            client.send_goal(msg.TestGoal(-5), cancel_on_client_lost=wanted)
            wait_for(GoalStatus.ACTIVE)
        if not wanted:  # it goes on until somebody cancels it
            seen.clear()
            wait_for(GoalStatus.ACTIVE)
            watcher.cancel_all_goals()
        wait_for(GoalStatus.PREEMPTED)


def test_a_killed_server_in_ros_is_lost_with_its_nodes_name(ros, bridge, node):
    server = ros.start("action_server", "mortal", "mortal_worker")
    bridge(actions={"mortal": "actionlib/TestAction"}, namespace="robot_1")
    client = client_of("robot_1/mortal")
    begun = node.clock.event()
    client.send_goal(msg.TestGoal(-5), feedback_cb=lambda feedback: begun.set())
    assert begun.wait(WAIT_S)
    server.send_signal(signal.SIGKILL)
    assert client.wait_for_result(WAIT_S)
    assert client.get_state() == GoalStatus.LOST
    assert "robot_1/mortal_worker" in client.get_goal_status_text()
    ros.start("action_server", "mortal", "mortal_worker")
    assert client.wait_for_server(WAIT_S)
    assert send(client, 4) == (GoalStatus.SUCCEEDED, 8)


def test_a_server_in_ros_that_hangs_is_lost_and_comes_back(ros, bridge, node):
    server = ros.start("action_server", "hanging", "hanging_worker")
    made = bridge(actions=["hanging"])
    client = client_of("hanging")
    begun = node.clock.event()
    client.send_goal(msg.TestGoal(-5), feedback_cb=lambda feedback: begun.set())
    assert begun.wait(WAIT_S)
    server.send_signal(signal.SIGSTOP)
    try:
        with impatient(made, "/hanging"):
            assert client.wait_for_result(WAIT_S)
        assert client.get_state() == GoalStatus.LOST
    finally:
        server.send_signal(signal.SIGCONT)
    assert client.wait_for_server(WAIT_S)
    client.cancel_all_goals()
    assert send(client, 4) == (GoalStatus.SUCCEEDED, 8)


def test_a_server_in_ros_takes_the_place_of_one_of_its_name_that_hangs(ros, bridge, node):
    old = ros.start("action_server", "taken", "same_name")
    made = bridge(actions=["taken"], status_timeout=100.0)
    client = client_of("taken")
    begun = node.clock.event()
    client.send_goal(msg.TestGoal(-5), feedback_cb=lambda feedback: begun.set())
    assert begun.wait(WAIT_S)
    old.send_signal(signal.SIGSTOP)
    ros.start("action_server", "taken", "same_name")
    assert client.wait_for_result(WAIT_S)
    assert client.get_state() == GoalStatus.LOST
    assert client.wait_for_server(WAIT_S)
    assert send(client, 4) == (GoalStatus.SUCCEEDED, 8)
    old.send_signal(signal.SIGKILL)
    links = made._actions["/taken"]._side._links["/same_name"]
    while any(len(of_word) > 1 for of_word in list(links.values())):
        assert send(client, 4) == (GoalStatus.SUCCEEDED, 8)
    assert client.wait_for_server(WAIT_S)
    assert send(client, 5) == (GoalStatus.SUCCEEDED, 10)


def test_a_recorder_in_ros_hears_goals_and_is_no_server(ros, bridge):
    recorder = ros.start("topics", "recorder")
    recorder.ask("record /recorded/goal")
    bridge(actions={"recorded": "actionlib/Test"})
    ros.start("action_server", "recorded", "recorded_worker")
    client = client_of("recorded")
    # Several times: rospy counts a subscriber's connection before it has made it.
    while not recorder.ask("heard /recorded/goal 0"):
        assert send(client, 4) == (GoalStatus.SUCCEEDED, 8)
    assert set(recorder.ask("heard /recorded/goal 1").split()) == {"4"}


def test_a_result_message_that_is_lost_is_told(ros, bridge):
    ros.start("action_server", "muted", "muted_worker", "mute")
    bridge(actions=["muted"])
    client = client_of("muted")
    assert send(client, 4) == (GoalStatus.SUCCEEDED, None)
    assert "the result message itself was lost" in client.get_goal_status_text()


@pytest.fixture
def serve(node):
    servers = []

    def serve(name):
        def execute(goal):
            while goal.goal < 0:
                if server.is_preempt_requested():
                    server.set_preempted(msg.TestResult(-1), "preempted here")
                    return
                node.clock.sleep(0.01)
            server.set_succeeded(msg.TestResult(2 * goal.goal), "done here")

        server = SimpleActionServer(name, msg.TestAction, execute)
        servers.append(server)
        return server

    yield serve
    for server in servers:
        server.stop()


def test_goals_from_a_client_in_ros(ros, bridge, serve):
    serve("from_ros")
    bridge(actions=["from_ros"])
    client = ros.start("action_client", "from_ros")
    ended = [client.ask(str(number)) for number in range(GOALS)]
    assert ended == [f"{GoalStatus.SUCCEEDED} {2 * number} done here" for number in range(GOALS)]
    assert client.ask("-5") == "sent"
    assert client.ask("begun?") == "begun"
    assert client.ask("cancel") == f"{GoalStatus.PREEMPTED} -1 preempted here"


def test_our_server_comes_goes_and_its_goals_are_lost_for_a_client_in_ros(ros, bridge, serve):
    bridge(actions=["coming"])
    client = ros.start("action_client", "coming", ready=False)
    server = serve("coming")
    assert client.read() == "ready"
    assert client.ask("3") == f"{GoalStatus.SUCCEEDED} 6 done here"
    server.stop()
    serve("coming")
    while client.ask("server?") != "True":
        pass
    assert client.ask("4") == f"{GoalStatus.SUCCEEDED} 8 done here"


SERVER = """
import sys
from actionlib_core import SimpleActionServer
from actionlib_core.interfaces.actionlib.msg import TestAction, TestFeedback

def execute(goal):
    server.publish_feedback(TestFeedback(goal.goal))
    server.wait_preempt(60.0)

server = SimpleActionServer("killed", TestAction, execute)
print("ready", flush=True)
sys.stdin.read()
"""


def test_our_killed_server_loses_the_goals_of_clients_in_ros(ros, bridge):
    with subprocess.Popen(
        [sys.executable, "-c", SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as server:
        try:
            assert server.stdout.readline() == "ready\n"
            bridge(used=True)
            client = ros.start("action_client", "killed")
            assert client.ask("-5") == "sent"
            assert client.ask("begun?") == "begun"
        finally:
            server.kill()
    assert client.ask("wait").startswith(f"{GoalStatus.LOST} None")


def test_a_killed_client_in_ros_has_its_goals_cancelled_where_that_is_asked_for(ros, bridge, node):
    begun, ended = node.clock.event(), node.clock.event()

    def execute(goal):
        begun.set()
        if server.wait_preempt(WAIT_S):
            ended.set()
        server.set_preempted()

    server = SimpleActionServer("caring", msg.TestAction, execute, on_client_lost="cancel")
    bridge(actions=["caring"])
    client = ros.start("action_client", "caring")
    assert client.ask("-5") == "sent"
    assert begun.wait(WAIT_S)
    client.send_signal(signal.SIGKILL)
    assert ended.wait(WAIT_S)
    server.stop()
