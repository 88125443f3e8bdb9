"""`MonitorState`: every message is checked, nothing polls, a preempt is never lost."""

from __future__ import annotations

import threading

import pytest

from actionlib_core.interfaces.std_msgs.msg import Int32, String
from actionlib_core.pubsub.topic import Publisher
from smachpy import State, StateMachine, UserData, cb_interface, events
from smachpy.actions.monitor_state import MonitorState
from smachpy.events.introspection import describe
from smachpy.exceptions import InvalidStateError, InvalidUserCodeError
from tests.two_nodes import TwoNodes


class World(TwoNodes):
    def __init__(self, seed=None):
        super().__init__(seed)
        self.publisher = Publisher("level", Int32, node=self.robot)

    def say(self, *values, at):
        self.clock.call_later(at, lambda: [self.publisher.publish(value) for value in values])

    def state(self, cond_cb=lambda ud, message: message.data > 0, *args, **kwargs):
        return MonitorState("level", Int32, cond_cb, *args, **{"node": self.mission} | kwargs)


@pytest.fixture
def world():
    with World() as world:
        yield world


def test_the_first_bad_message_ends_it(world):
    seen, threads = [], set()

    def positive(userdata, message):
        seen.append(message.data)
        threads.add(threading.get_ident())
        return message.data > 0

    world.say(1, 2, at=1.0)
    world.say(3, -4, 5, at=2.0)
    assert world.state(positive).execute(UserData()) == "invalid"
    assert seen == [1, 2, 3, -4]
    assert threads == {threading.get_ident()}
    assert world.clock.now() == 2.0
    world.clock.sleep(0.1)
    assert world.publisher.get_num_connections() == 0


def test_enough_good_messages_end_it(world):
    world.say(1, 2, at=1.0)
    world.say(3, -4, at=2.0)
    assert world.state(max_checks=3).execute(UserData()) == "valid"
    assert world.clock.now() == 2.0


def test_a_latched_message_counts(world):
    with Publisher("level", Int32, latch=True, node=world.robot) as latched:
        latched.publish(7)
        assert world.state(max_checks=1).execute(UserData()) == "valid"


def test_only_the_newest_of_those_that_wait(world):
    seen = []

    def slow(userdata, message):
        seen.append(message.data)
        world.clock.sleep(10.0)
        return True

    world.say(1, at=1.0)
    world.say(2, 3, 4, at=2.0)
    assert world.state(slow, 2, latest=True).execute(UserData()) == "valid"
    assert seen == [1, 4]


def test_silence_can_end_it(world):
    world.say(1, at=1.0)
    state = world.state(timeout=3.0)
    assert state.execute(UserData()) == "aborted"
    assert world.clock.now() == 3.0
    state = world.state(timeout=3.0, timeout_outcome="silent")
    assert state.get_registered_outcomes() == ("valid", "invalid", "preempted", "silent")
    assert state.execute(UserData()) == "silent"


def test_a_timeout_ends_it_though_messages_keep_coming(world):
    def slow(userdata, message):
        world.clock.sleep(1.0)
        return True

    world.say(*range(1, 100), at=1.0)
    assert world.state(slow, timeout=5.5).execute(UserData()) == "aborted"
    assert world.clock.now() == 6.0


def test_a_condition_that_answers_with_a_coroutine_is_invalid(world, caplog):
    async def later():
        return True

    world.say(1, at=1.0)
    assert world.state(lambda userdata, message: later()).execute(UserData()) == "invalid"
    assert "got a coroutine; expected an answer" in caplog.text


def test_a_condition_that_raises_is_invalid_and_reported(world, caplog):
    def broken(userdata, message):
        raise LookupError("no map")

    machine = StateMachine(["valid", "invalid", "preempted"])
    with machine:
        machine.add("WATCH", world.state(broken))
    failures = []
    machine.subscribe(lambda e: failures.append(e) if isinstance(e, events.CallbackFailed) else 0)
    world.say(1, at=1.0)
    assert machine.execute() == "invalid"
    assert [(e.path, e.error) for e in failures] == [("/SM_ROOT/WATCH", "LookupError: no map")]
    assert "Traceback" in caplog.text


def test_userdata_is_there_for_the_condition(world):
    @cb_interface(input_keys=["limit"], output_keys=["last"])
    def below(userdata, message):
        userdata.last = message.data
        return message.data < userdata.limit

    machine = StateMachine(["valid", "invalid", "preempted"])
    with machine:
        machine.add("WATCH", world.state(below))
    machine.userdata.limit = 5
    world.say(3, 9, at=1.0)
    assert machine.execute() == "invalid"
    assert machine.userdata.last == 9


def test_it_can_run_again(world):
    state = world.state(max_checks=1)
    for moment in (1.0, 2.0):
        world.say(1, at=moment - world.clock.now())
        assert state.execute(UserData()) == "valid"
        assert world.clock.now() == moment


@pytest.mark.parametrize("seed", range(50))
def test_a_preempt_at_any_moment_is_never_lost(seed):
    with World(seed) as world:
        state = world.state()
        world.say(1, 2, 3, at=0.0)
        world.say(1, 2, 3, at=1.0)
        for moment in (0.0, 0.0, 1.0, 3.0):
            task = world.clock.spawn(
                lambda moment=moment: (world.clock.sleep(moment), state.request_preempt()),
                name="preempter",
            )
            start = world.clock.now()
            assert state.execute(UserData()) == "preempted"
            assert world.clock.now() - start == moment
            assert not state.preempt_requested()
            task.join()


def test_a_condition_may_wait_whatever_it_is_made_of(world):
    class Slow:
        @property
        def limit(self):
            world.clock.sleep(1.0)
            return 2

    slow = Slow()
    world.say(3, 4, 1, at=1.0)
    state = world.state(lambda ud, message: message.data > slow.limit)
    assert state.execute(UserData()) == "invalid"
    assert world.clock.now() == 4.0  # each message was checked once to the end


def test_it_describes_itself(world):
    def charged(userdata, message):
        return True

    kind, details = world.state(charged, 3, timeout=4).describe_details()
    assert kind == "monitor"
    assert dict(details) == {
        "topic": "level",
        "type": "std_msgs/Int32",
        "condition": "charged",
        "checks": "3",
        "timeout": "4 s -> aborted",
    }


class Uninitialised(MonitorState):
    def __init__(self):
        State.__init__(self, outcomes=["valid", "invalid", "preempted"])


def test_a_class_that_skips_its_init_is_named_where_it_is_described_and_where_it_runs():
    sm = StateMachine(outcomes=["valid", "invalid", "preempted"])
    sm.add("WATCH", Uninitialised())
    with pytest.raises(InvalidStateError, match=r"/WATCH.*MonitorState\.__init__"):
        describe(sm)
    with pytest.raises(InvalidUserCodeError, match=r"/WATCH.*MonitorState\.__init__"):
        sm.execute()


def test_other_missing_attributes_are_the_states_own():
    class Broken(MonitorState):
        def describe_details(self):
            return self.nothing

    sm = StateMachine(outcomes=["valid", "invalid", "preempted"])
    sm.add("WATCH", Broken("level", Int32, lambda _userdata, _message: True))
    with pytest.raises(AttributeError):
        describe(sm)


def test_messages_that_wait_for_a_slow_condition_are_bounded(world, caplog):
    """They were all kept: images filled the memory."""
    sizes = []

    def slow(userdata, message):
        sizes.append(len(message.data))
        if len(sizes) == 1:
            world.clock.sleep(10.0)
        return True

    camera = Publisher("camera", String, node=world.robot)
    image = "x" * 2**20
    world.clock.call_later(1.0, lambda: [camera.publish(image) for _ in range(40)])
    state = MonitorState("camera", String, slow, timeout=20.0, node=world.mission)
    assert state.execute(UserData()) == "aborted"
    assert 30 < len(sizes) < 35
    assert caplog.text.count("messages come faster than the condition") == 1
