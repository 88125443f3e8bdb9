"""Slips that SMACH accepted: warned of once, with the line; refused, and better told, elsewhere."""

from __future__ import annotations

import warnings

import pytest

import smachpy
from smachpy import InvalidStateError, ReadOnlyError, UserDataKeyError, ros1
from smachpy.base import slips


def done(userdata):
    return "done"


class Plain(smachpy.State):
    def __init__(self, **more):
        super().__init__(outcomes=["done"], **more)

    def execute(self, userdata):
        return "done"


class NoInit(smachpy.State):
    def __init__(self):
        self.count = 1

    def execute(self, userdata):
        return "done"


class Duck:
    outcome = "done"

    def execute(self, userdata):
        return self.outcome

    def get_registered_outcomes(self):
        return ["done"]


class Changes(Plain):
    def __init__(self):
        super().__init__(input_keys=["seen"])

    def execute(self, userdata):
        userdata.seen.append(1)
        userdata.seen.append(2)
        return "done"


class Writes(Plain):
    def execute(self, userdata):
        userdata.undeclared = 1
        return "done"


def machine(*states, **values):
    sm = smachpy.StateMachine(outcomes=["done"])
    for key, value in values.items():
        sm.userdata[key] = value
    with sm:
        for index, state in enumerate(states):
            last = index == len(states) - 1
            sm.add(str(index), state, {"done": "done" if last else str(index + 1)})
    return sm


def early_initial():
    sm = smachpy.StateMachine(outcomes=["done"])
    with sm:
        sm.set_initial_state(["LATER"])
        sm.add("FIRST", Plain(), {"done": "LATER"})
        sm.add("LATER", Plain())
    assert sm.get_initial_states() == ["LATER"]
    return sm


def empty_label():
    sm = smachpy.StateMachine(outcomes=["done"])
    with sm:
        sm.add("", Plain())
    return sm


def unknown_rules():
    cc = smachpy.Concurrence(["done"], "done", outcome_map={"never": {"A": "preempted"}})
    with cc:
        cc.add("A", Plain())
        cc.add("A", Plain())
    return cc


def empty_outcome():
    sm = smachpy.StateMachine(outcomes=["done", ""])
    with sm:
        sm.add("A", smachpy.CBState(done, outcomes=["done", ""]))
    return sm


def led_to_nothing():
    sm = smachpy.StateMachine(outcomes=["done"])
    sm.userdata[""] = 1
    with sm:
        sm.add("A", Plain(input_keys=["seen"]), remapping={"seen": ""})
    return sm


SLIPS = {
    "empty_outcome": (empty_outcome, InvalidStateError),
    "empty_key": (lambda: machine(Plain(input_keys=[""])), InvalidStateError),
    "empty_target": (led_to_nothing, InvalidStateError),
    "early_initial": (early_initial, InvalidStateError),
    "empty_label": (empty_label, InvalidStateError),
    "no_init": (lambda: machine(NoInit()), InvalidStateError),
    "duck": (lambda: machine(Duck()), InvalidStateError),
    "changes": (lambda: machine(Changes(), seen=[]), ReadOnlyError),
    "writes": (lambda: machine(Writes()), UserDataKeyError),
    "rules": (unknown_rules, InvalidStateError),
    "string": (lambda: machine(smachpy.CBState(done, outcomes="done")), InvalidStateError),
}


@pytest.fixture
def accepted(tmp_path):
    with ros1.installed(tmp_path / "script.py"):
        yield


@pytest.mark.parametrize("name", SLIPS)
def test_a_slip_runs_with_a_warning_at_its_line(name, accepted):
    make, _ = SLIPS[name]
    with pytest.warns(slips.SlipWarning) as caught:
        outcome = make().execute()
    assert outcome == "done"
    assert all(warning.filename == __file__ for warning in caught)
    assert all(warning.lineno > 0 for warning in caught)


@pytest.mark.parametrize("name", SLIPS)
def test_a_slip_is_an_error_elsewhere(name):
    make, error = SLIPS[name]
    with pytest.raises((error, smachpy.SmachError)):
        make().execute()


def test_each_slip_is_told_once(accepted):
    sm = machine(Changes(), seen=[])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(3):
            sm.execute()
    lines = [(w.filename, w.lineno) for w in caught]
    assert len(lines) == len(set(lines)) == 2
    assert sm.userdata.seen == [1, 2] * 3


def test_the_initial_state_is_said_to_be_missing_yet():
    with pytest.raises(InvalidStateError) as caught:
        early_initial()
    assert "not added yet" in str(caught.value)


def test_a_read_only_error_names_key_and_state():
    with pytest.raises(ReadOnlyError) as caught:
        machine(Changes(), seen=[]).execute()
    assert (caught.value.key, caught.value.path) == ("seen", "/SM_ROOT/0")


def test_a_monitor_state_without_init_is_named():
    class Watch(smachpy.MonitorState):
        def __init__(self):
            self.count = 0

    with pytest.raises(InvalidStateError) as caught:
        machine(Watch())
    assert "Watch" in str(caught.value)


def test_wrapper_outcomes_that_the_container_lacks(accepted):
    from actionlib_core.interfaces.actionlib.msg import TestAction
    from smachpy.testing import MissionKit

    with MissionKit(), pytest.warns(slips.SlipWarning):
        smachpy.ActionServerWrapper("x", TestAction, machine(Plain()), ["done", "not_there"])


def makers_of_names():
    """Return functions that use a name of the network as programs for ROS 1 do."""
    import actionlib
    import rospy
    import smach_ros
    from actionlib.msg import TestAction
    from std_msgs.msg import Empty
    from std_srvs.srv import Trigger

    def introspect(name):
        smach_ros.IntrospectionServer(name, machine(Plain()), "/SM").start()

    return [
        lambda name: rospy.Publisher(name, Empty, queue_size=1),
        lambda name: rospy.Subscriber(name, Empty),
        lambda name: rospy.Service(name, Trigger, print),
        lambda name: rospy.ServiceProxy(name, Trigger),
        lambda name: actionlib.SimpleActionClient(name, TestAction),
        lambda name: actionlib.SimpleActionServer(name, TestAction, print, False).start(),
        lambda name: smach_ros.SimpleActionState(name, TestAction),
        lambda name: smach_ros.MonitorState(name, Empty, print),
        introspect,
    ]


@pytest.mark.parametrize(
    ("name", "used"), [("//grip/", "grip"), ("my-grip", "my_grip"), ("2 gr~ips", "_2_gr_ips")]
)
def test_names_that_rospy_accepted(accepted, name, used):
    from actionlib_core.node import get_node
    from actionlib_core.wire.presence import list_endpoints
    from smachpy.testing import MissionKit

    with MissionKit(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for make in makers_of_names():
            before = len(caught)
            made = make(name)  # noqa: F841  keeps it alive
            told = caught[before:]
            # rospy removed slashes silently.
            assert len(told) == (used not in name), [str(each.message) for each in told]
        names = {end.name for end in list_endpoints(get_node().transport)}
        assert {used, f"{used}/smach/container_status"} <= names
        assert {name.partition("/")[0] for name in names} <= {used, "rosout"}


def test_parameters_may_have_any_name(accepted):
    import rospy

    from smachpy.testing import MissionKit

    with MissionKit():
        assert rospy.get_param("~my-speed", 2) == 2
        rospy.set_param("/robot-1/max speed", 3)
        assert rospy.get_param("robot-1//max speed/") == 3
        assert rospy.has_param("/robot-1")
        assert rospy.resolve_name("a-b", "/lab/node") == "/lab/a-b"
