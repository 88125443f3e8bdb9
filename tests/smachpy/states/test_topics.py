"""The states that publish, wait for a message and look up a transform."""

from __future__ import annotations

import pytest

from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.interfaces.geometry_msgs.msg import (
    PoseStamped,
    Quaternion,
    TransformStamped,
    Vector3,
)
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_msgs.msg import Bool, Header, String
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from actionlib_core.node import Node
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.time import Time
from smachpy import InvalidStateError, StateMachine
from smachpy.states import AwaitMessage, LookUpTransform, Publish, Wait, drive_to


def alone(state, **userdata):
    sm = StateMachine(state.get_registered_outcomes(), name="ALONE")
    sm.userdata.update(userdata)
    sm.add("STATE", state)
    return sm


@pytest.fixture
def other(mission):
    """Another program on the network."""
    session = mission.network.session()
    node = Node("other", transport=session, clock=mission.clock)
    yield node
    node.close()
    session.close()


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: Publish("a b", Bool), "topic: got 'a b'"),
        (lambda: Publish("a", 3), "msg_type: got 3"),
        (lambda: Publish("a", Bool, {"dat": True}), "message: got .*dat"),
        (lambda: Publish("a", Bool, Bool(), key="k"), "message, key: got both"),
        (lambda: Publish("a", Bool, subscribers=-1), "subscribers: got -1"),
        (lambda: Publish("a", Bool, timeout=-1), "timeout: got -1"),
        (lambda: Publish("a", Bool, latch=True, subscribers=2), "latch, subscribers: got both"),
        (lambda: Publish("a", Bool, latch=True, timeout=None), "latch, timeout: got both"),
        (lambda: LookUpTransform("", "cup"), "key: got ''"),
        (lambda: LookUpTransform("k", "cup", tf="a b"), "tf: got 'a b'"),
        (lambda: LookUpTransform("k", "cup", timeout="5"), "Try 5"),
        (lambda: AwaitMessage("a", Bool, key="", timeout=1.0), "key: got ''"),
    ],
)
def test_wrong_arguments_are_refused_where_they_are_given(make, problem):
    with pytest.raises(InvalidStateError, match=problem):
        make()


# -- publish -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("state", "userdata"),
    [
        (Publish("word", String, String("go")), {}),
        (Publish("word", String, {"data": "go"}), {}),
        (Publish("word", String, key="said"), {"said": String("go")}),
        (Publish("word", String, key="said"), {"said": {"data": "go"}}),
    ],
)
def test_it_publishes_to_who_is_there(mission, other, state, userdata):
    heard = []
    Subscriber("word", String, heard.append, node=other)
    mission(alone(state, **userdata)).assert_outcome("succeeded")
    mission(alone(Wait(1.0)))  # until the other program has heard it
    assert heard == [String("go")]


def test_it_waits_for_a_subscriber(mission, other):
    heard = []
    mission.clock.call_later(3.0, lambda: Subscriber("word", String, heard.append, node=other))
    run = mission(alone(Publish("word", String, String("go"))))
    run.assert_outcome("succeeded")
    assert run.duration == pytest.approx(3.0, abs=0.1)
    mission(alone(Wait(1.0)))
    assert heard == [String("go")]


@pytest.mark.parametrize("timeout", [0, 2.0])
def test_nobody_listens(mission, timeout, caplog):
    run = mission(alone(Publish("word", String, timeout=timeout)))
    run.assert_outcome("aborted")
    assert run.duration == timeout
    assert "topic /word: got 0 subscribers" in caplog.text


def test_one_listener_is_not_two(mission, other, caplog):
    heard = []
    Subscriber("word", String, heard.append, node=other)
    mission(alone(Publish("word", String, subscribers=2))).assert_outcome("aborted")
    assert "got 1 subscribers in 5 s; expected 2" in caplog.text
    assert heard == []


def test_with_no_subscriber_it_publishes_at_once(mission):
    assert mission(alone(Publish("word", String, subscribers=0))).duration == 0.0


def test_a_latched_message_is_there_for_later_ones_and_each_visit_replaces_it(mission, other):
    for word in ("one", "two"):
        mission(alone(Publish("word", String, String(word), latch=True))).assert_outcome(
            "succeeded"
        )
    state = Publish("word", String, key="said", latch=True)
    for word in ("three", "four"):
        mission(alone(state, said=String(word))).assert_outcome("succeeded")
    heard = []
    Subscriber("word", String, heard.append, node=other)
    mission(alone(Wait(1.0)))
    assert heard[-1] == String("four")
    assert String("three") not in heard


@pytest.mark.parametrize("after", [0.0, 2.0])
def test_a_preempt_ends_the_wait_for_a_subscriber(mission, after):
    mission.preempt(on="STATE", after=after)
    run = mission(alone(Publish("word", String, timeout=None)))
    run.assert_outcome("preempted")
    assert run.duration == after


def test_listeners_of_another_type_are_an_error(mission, other):
    Subscriber("word", Bool, print, node=other)
    with pytest.raises(Exception, match="STATE") as caught:
        mission(alone(Publish("word", String)))
    assert isinstance(caught.value.__cause__, TypeMismatchError)


def test_a_value_that_is_no_message_is_an_error(mission, other):
    Subscriber("word", String, print, node=other)
    with pytest.raises(InvalidStateError, match="/ALONE/STATE: said: got 3"):
        mission(alone(Publish("word", String, key="said"), said=3))


def test_a_header_is_stamped_when_it_is_published(mission, other):
    heard = []
    Subscriber("pose", PoseStamped, heard.append, node=other)
    machine = alone(Publish("pose", PoseStamped, {"header": "auto"}))
    mission.clock.sleep(10.0)
    mission(machine).assert_outcome("succeeded")
    mission(alone(Wait(1.0)))
    assert heard[0].header.stamp.to_nsec() >= mission.clock.time_ns() - 2_000_000_000


def test_a_header_is_stamped_after_the_wait_for_a_subscriber(mission, other):
    """It had the time at which the wait began."""
    heard = []

    def listen():
        Subscriber("pose", PoseStamped, heard.append, node=other)

    mission.clock.call_later(30.0, listen)
    mission(alone(Publish("pose", PoseStamped, {"header": "auto"}, timeout=None)))
    mission(alone(Wait(1.0)))
    assert heard[0].header.stamp.to_nsec() >= mission.clock.time_ns() - 2_000_000_000


def test_nothing_is_published_if_a_preempt_comes_with_the_subscriber(mission, other, monkeypatch):
    heard = []
    Subscriber("word", String, heard.append, node=other)
    state = Publish("word", String)
    wait = Publisher.wait_for_connections

    def asked_meanwhile(publisher, *given):
        found = wait(publisher, *given)
        state.request_preempt()
        return found

    monkeypatch.setattr(Publisher, "wait_for_connections", asked_meanwhile)
    mission(alone(state)).assert_outcome("preempted")
    mission(alone(Wait(1.0)))
    assert heard == []


# -- wait for a message ------------------------------------------------------------------------


def test_the_message_is_written_to_a_key(mission):
    mission.topic("word", String).publish_at(2.0, String("go"))
    machine = alone(AwaitMessage("word", String, key="said", timeout=None))
    mission(machine).assert_outcome("came")
    assert machine.userdata.said == String("go")


def test_a_timeout_says_what_was_there(mission, caplog):
    topic = mission.topic("word", String)
    topic.publish_at(1.0, String("go"))
    mission(alone(AwaitMessage("word", String, lambda m: False, timeout=5.0))).assert_outcome(
        "timeout"
    )
    assert "topic /word: got 1 messages in 5 s, none that was wanted, 1 publishers" in caplog.text


def test_what_the_condition_raises_the_state_raises(mission):
    """It went to the excepthook of the subscriber's thread, and the state waited on."""
    mission.topic("word", String).publish_at(1.0, String("go"))
    with pytest.raises(Exception, match="STATE") as caught:
        mission(alone(AwaitMessage("word", String, lambda m: m.dat, timeout=100.0)))
    assert isinstance(caught.value.__cause__, AttributeError)


def test_a_condition_that_answers_a_coroutine_is_an_error(mission):
    """A coroutine counts as true: any message ended the wait."""

    async def is_wanted(message):
        return False

    mission.topic("word", String).publish_at(1.0, String("go"))
    with pytest.raises(Exception, match="STATE") as caught:
        mission(alone(AwaitMessage("word", String, lambda m: is_wanted(m), timeout=100.0)))
    assert "not async" in str(caught.value.__cause__)


@pytest.mark.parametrize("timeout", [50.0, None])
def test_it_waits_on_if_a_request_to_stop_is_withdrawn(mission, timeout):
    """It ended with 'timeout', or with an error about its text if it had no limit."""
    state = AwaitMessage("word", String, timeout=timeout)
    mission.trigger(lambda _: (state.request_preempt(), state.recall_preempt()), at=3.0)
    mission.topic("word", String).publish_at(10.0, String("go"))
    run = mission(alone(state))
    run.assert_outcome("came")
    assert run.duration == 10.0


def test_publishers_of_another_type_are_an_error(mission):
    mission.topic("word", Bool).publish(Bool(True), latch=True)
    with pytest.raises(Exception, match="STATE") as caught:
        mission(alone(AwaitMessage("word", String, timeout=5.0)))
    assert isinstance(caught.value.__cause__, TypeMismatchError)


# -- transforms --------------------------------------------------------------------------------


def transform(parent, child, x=0.0, stamp=1.0):
    made = TransformStamped(Header(frame_id=parent, stamp=Time.from_sec(stamp)), child)
    made.transform.translation = Vector3(x, 0.0, 0.0)
    made.transform.rotation = Quaternion(w=1.0)
    return TFMessage([made])


def test_a_transform_through_several_frames_is_written_to_a_key(mission):
    mission.topic("/tf_static", TFMessage).publish(transform("base", "camera", 0.5), latch=True)
    mission.topic("/tf", TFMessage).publish_at(2.0, transform("map", "base", 1.0, stamp=7.0))
    machine = alone(LookUpTransform("cup", "camera"))
    run = mission(machine)
    run.assert_outcome("succeeded")
    assert run.duration == 2.0
    cup = machine.userdata.cup
    assert (cup.header.frame_id, cup.header.stamp.to_sec()) == ("map", 7.0)
    assert (cup.pose.position.x, cup.pose.orientation.w) == (1.5, 1.0)


def test_one_can_drive_to_what_was_looked_up(mission):
    base = mission.action_server("move_base", MoveBaseAction)
    mission.topic("/tf_static", TFMessage).publish(transform("map", "dock", 3.0), latch=True)
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="GO")
    sm.add("LOOK", LookUpTransform("place", "dock"), {"succeeded": "DRIVE"})
    sm.add("DRIVE", drive_to("place"))
    mission(sm).assert_outcome("succeeded")
    assert base.goals[0].target_pose.pose.position.x == 3.0


def test_a_robot_may_have_its_own_topic(mission):
    mission.topic("/r1/tf_static", TFMessage).publish(transform("map", "base", 2.0), latch=True)
    machine = alone(LookUpTransform("at", "base", tf="r1/tf"))
    mission(machine).assert_outcome("succeeded")
    assert machine.userdata.at.pose.position.x == 2.0


@pytest.mark.parametrize(
    ("there", "problem"),
    [
        ([], "does not exist. Frames that are known: none."),
        ([("map", "base")], "does not exist. Frames that are known: base, map."),
        ([("map", "base"), ("world", "cup")], "same tree"),
    ],
)
def test_a_transform_that_is_not_there(mission, there, problem, caplog):
    topic = mission.topic("/tf", TFMessage)
    for parent, child in there:
        topic.publish_at(1.0, transform(parent, child))
    machine = alone(LookUpTransform("at", "cup"))
    run = mission(machine)
    run.assert_outcome("aborted")
    assert run.duration == 5.0
    assert problem in caplog.text
    assert "at" not in machine.userdata


@pytest.mark.parametrize("after", [0.0, 2.0])
def test_a_preempt_ends_the_wait_for_a_transform(mission, after):
    mission.preempt(on="STATE", after=after)
    run = mission(alone(LookUpTransform("at", "cup", timeout=None)))
    run.assert_outcome("preempted")
    assert run.duration == after
