"""The program is asked to end while a state of it waits in rospy: the machine is preempted."""

import pytest

from actionlib_core.clock import VirtualClock, use_clock
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
}


@pytest.mark.parametrize("name", WAITS)
def test_a_wait_that_the_end_interrupts_is_a_preempt(clock, name):
    assert machine_of(WAITS[name]).execute() == "preempted"
    assert clock.now() == ASKED_AT_S


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
