"""The program is asked to end while a state of it waits in rospy: the machine is preempted."""

import pytest

from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.std_msgs.msg import Empty
from actionlib_core.node import Node, use_node
from actionlib_core.shutdown import Shutdown, use_shutdown
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import ros1
from smachpy.exceptions import InvalidUserCodeError
from smachpy.ros1 import session
from smachpy.ros1.session import Session

ASKED_AT_S = 5.0


@pytest.fixture
def clock():
    ending = Shutdown()
    with VirtualClock() as clock, use_clock(clock), use_shutdown(ending), ros1.installed():
        node = Node("script", transport=MemoryNetwork(clock).session(), clock=clock)
        made = Session(["script.py"], make_node=lambda _name: node)
        made.shows_transitions = True
        with node, use_node(node):
            session.begin(made)
            clock.call_later(ASKED_AT_S, lambda: ending.request("SIGINT"))
            yield clock
            session.end(made)


def machine_of(wait):
    import rospy
    import smach

    rospy.init_node("script")
    outer, inner = (smach.StateMachine(outcomes=["done"]) for _ in range(2))
    with inner:
        state = smach.CBState(lambda _ud: wait(rospy), outcomes=["done"])
        smach.StateMachine.add("WAITS", state, {"done": "done"})
    with outer:
        smach.StateMachine.add("INNER", inner, {"done": "done"})
    return outer


WAITS = {
    "sleep": lambda rospy: rospy.sleep(60),
    "rate": lambda rospy: rospy.Rate(0.01).sleep(),
    "service": lambda rospy: rospy.wait_for_service("nobody"),
    "service for some time": lambda rospy: rospy.wait_for_service("nobody", 60),
    "message": lambda rospy: rospy.wait_for_message("nowhere", Empty, timeout=60),
    "any message": lambda rospy: rospy.wait_for_message("nowhere", rospy.AnyMsg, timeout=60),
}


@pytest.mark.parametrize("name", WAITS)
def test_a_wait_that_the_end_interrupts_is_a_preempt(clock, name):
    assert machine_of(WAITS[name]).execute() == "preempted"
    assert clock.now() == ASKED_AT_S


def test_a_machine_whose_states_never_say_so_ends_without_smach_ros_too(clock):
    rounds = []

    def hurries(_ud):
        rounds.append(clock.now())
        assert len(rounds) < 100
        if clock.now() < ASKED_AT_S:
            clock.sleep(1.0)
        return "again"

    import smach

    sm = smach.StateMachine(outcomes=["done"])
    with sm:
        sm.add("HURRIES", smach.CBState(hurries, outcomes=["again"]), {"again": "HURRIES"})
    assert sm.execute() == "preempted"
    assert clock.now() == ASKED_AT_S


@pytest.fixture
def client(clock):
    """A client of a server whose goals end only when they are cancelled."""
    import rospy

    rospy.init_node("script")
    from actionlib import SimpleActionClient, SimpleActionServer

    def execute(_goal):
        while not server.is_preempt_requested():
            clock.sleep(0.1)
        server.set_preempted()

    server = SimpleActionServer("endless", MoveBaseAction, execute, auto_start=False)
    server.start()
    return SimpleActionClient("endless", MoveBaseAction)


@pytest.mark.parametrize("limit", [0, 60])
def test_the_end_ends_waits_for_actions(clock, client, limit):
    import actionlib
    import rospy

    assert client.wait_for_server(rospy.Duration(limit))
    client.send_goal(MoveBaseGoal())
    assert not client.wait_for_result(rospy.Duration(limit))
    assert clock.now() == ASKED_AT_S
    for other in (actionlib.SimpleActionClient, actionlib.ActionClient):
        assert not other("nobody", MoveBaseAction).wait_for_server(rospy.Duration(limit))
    assert clock.now() == ASKED_AT_S
    client.cancel_goal()


def test_the_end_cancels_a_goal_that_is_waited_for(clock, client):
    client.send_goal_and_wait(MoveBaseGoal())
    assert clock.now() == ASKED_AT_S
    clock.sleep(1.0)
    assert client.get_state() == GoalStatus.PREEMPTED


def test_children_of_a_concurrence_are_preempted_too(clock):
    import rospy
    import smach

    both = smach.Concurrence(outcomes=["done", "preempted"], default_outcome="done")
    with both:
        for label in ("LEFT", "RIGHT"):
            state = smach.CBState(lambda _ud: rospy.sleep(60), outcomes=["ok"])
            smach.Concurrence.add(label, state)
    rospy.init_node("script")
    assert both.execute() == "preempted"


def test_a_state_may_catch_it_and_keeps_its_outcome(clock):
    def wait(rospy):
        try:
            rospy.sleep(60)
        except rospy.ROSInterruptException:
            return "done"

    assert machine_of(wait).execute() == "done"


def test_what_it_logs_is_on_rosout(clock):
    import rospy
    from rosgraph_msgs.msg import Log

    rospy.init_node("script")
    heard = []
    subscriber = rospy.Subscriber("/rosout", Log, heard.append)
    rospy.sleep(0.1)
    rospy.logwarn("low: %d", 20)
    rospy.logdebug("nobody asks for that")
    rospy.sleep(0.1)
    subscriber.unregister()
    (message,) = heard
    assert (message.level, message.name, message.msg) == (Log.WARN, "/script", "low: 20")
    assert message.file == __file__
    assert message.line > 0


def test_raised_by_the_program_itself_it_is_an_error(clock):
    def wait(rospy):
        raise rospy.ROSInterruptException("nobody has asked")

    with pytest.raises(InvalidUserCodeError) as caught:
        machine_of(wait).execute()
    assert caught.value.path.endswith("/INNER/WAITS")
    assert clock.now() == 0.0
