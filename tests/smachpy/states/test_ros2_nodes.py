"""The states that change nodes of a ROS 2 robot: parameters, and life cycles."""

from __future__ import annotations

import math

import pytest

from smachpy import Concurrence, InvalidStateError, State, StateMachine
from smachpy.states import RestoreParameters, SetLifecycle, SetParameters, Wait
from smachpy.testing import explore, mission_kit

ENDS = ["succeeded", "aborted", "preempted"]
FAST, SLOW = {"max_vel_x": 0.5, "plugins": ["a"]}, {"max_vel_x": 0.2}


@pytest.fixture
def controller(mission):
    return mission.ros2_node("controller", FAST, state="unconfigured")


def alone(state):
    sm = StateMachine(state.get_registered_outcomes(), name="ALONE")
    sm.add("STATE", state)
    return sm


def slowly(work=None, **options):
    """Set, work, and set back at every end."""
    sm = StateMachine([*ENDS, "done"], name="SLOWLY")
    sm.add("SLOW", SetParameters("controller", SLOW, **options), {"succeeded": "WORK"})
    sm.add("WORK", work or Wait(10.0))
    sm.add_cleanup("RESTORE", RestoreParameters())
    return sm


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: SetParameters("a b", {"x": 1}), "node: got 'a b'"),
        (lambda: SetParameters("a", {}), "at least one parameter"),
        (lambda: SetParameters("a", {"x": None}), "values: x: got None"),
        (lambda: SetParameters("a", {"x": [1, "b"]}), "values: x: got"),
        (lambda: SetParameters("a", {"x": 1}, timeout=-1), "timeout: got -1"),
        (lambda: SetParameters("a", {"x": 1}, before=""), "before: got ''"),
        (lambda: RestoreParameters(timeout="5"), "Try 5"),
        (lambda: SetLifecycle("a", "activ"), "Did you mean 'active'"),
        (lambda: SetLifecycle("a", timeout=-1), "timeout: got -1"),
    ],
)
def test_wrong_arguments_are_refused_where_they_are_given(make, problem):
    with pytest.raises(InvalidStateError, match=problem):
        make()


def test_parameters_are_set_during_the_work_and_set_back(mission, controller):
    mission(slowly()).assert_outcome("done")
    assert controller.changes == [{"max_vel_x": 0.2}, {"max_vel_x": 0.5}]


@pytest.mark.parametrize("at", ["SLOW", "WORK"])
@pytest.mark.parametrize("service", ["get_parameters", "set_parameters"])
@pytest.mark.parametrize("after", [0.0, 1.0, 3.0])
def test_they_are_set_back_whenever_a_preempt_comes(mission, controller, at, service, after):
    controller.takes[service] = 2.0
    mission.preempt(on=at, after=after)
    mission(slowly()).assert_outcome("preempted")
    mission(alone(Wait(10.0)))
    assert controller.parameters == FAST


def test_a_request_that_arrives_after_its_caller_was_stopped_is_undone(mission, controller):
    """The node set it after the clean-up had found that nothing was to be restored."""
    controller.takes["set_parameters"] = 2.0
    mission.preempt(on="SLOW", after=1.0)
    mission(slowly()).assert_outcome("preempted")
    mission(alone(Wait(10.0)))
    assert controller.parameters == FAST


@pytest.mark.parametrize("timeout", [0, 3.0])
def test_a_node_that_is_not_there(mission, timeout, caplog):
    run = mission(alone(SetParameters("nobody", SLOW, timeout=timeout)))
    run.assert_outcome("aborted")
    assert run.duration == timeout
    assert "/nobody/get_parameters: no server" in caplog.text


@pytest.mark.parametrize("service", ["get_parameters", "set_parameters"])
def test_a_node_that_never_answers(mission, controller, service, caplog):
    controller.takes[service] = None
    run = mission(alone(SetParameters("controller", SLOW, timeout=4.0)))
    run.assert_outcome("aborted")
    assert run.duration == 4.0
    assert f"/controller/{service}: no answer" in caplog.text


@pytest.mark.parametrize("service", ["get_parameters", "set_parameters"])
def test_a_preempt_ends_the_wait_for_a_node_that_never_answers(mission, controller, service):
    controller.takes[service] = None
    mission.preempt(on="STATE", after=5.0)
    run = mission(alone(SetParameters("controller", SLOW, timeout=None)))
    run.assert_outcome("preempted")
    assert run.duration == 5.0


def test_missing_and_refused_parameters_are_all_named(mission, controller, caplog):
    state = SetParameters("controller", {"max_vel_x": 0.2, "max_vel": 1.0, "acc": 1.0})
    mission(alone(state)).assert_outcome("aborted")
    assert "/controller: max_vel: got no such parameter" in caplog.text
    assert "/controller: acc: got no such parameter" in caplog.text
    assert not controller.changes
    caplog.clear()
    controller.refused["max_vel_x"] = "too slow"
    mission(alone(SetParameters("controller", SLOW))).assert_outcome("aborted")
    assert "/controller: max_vel_x: too slow" in caplog.text


def test_a_whole_number_is_sent_as_a_float_where_the_parameter_is_one(mission, controller):
    mission(alone(SetParameters("controller", {"max_vel_x": 1}))).assert_outcome("succeeded")
    assert repr(controller.parameters["max_vel_x"]) == "1.0"


def test_a_loop_and_a_second_state_restore_what_was_before_the_first(mission, controller):
    sm = StateMachine([*ENDS, "done"], name="LOOP", userdata={"rounds": 0})

    @_state(["again", "done"], ["rounds"])
    def count(userdata):
        userdata.rounds += 1
        return "done" if userdata.rounds == 3 else "again"

    sm.add("SLOW", SetParameters("controller", SLOW), {"succeeded": "SLOWER"})
    sm.add("SLOWER", SetParameters("/controller", {"max_vel_x": 0.1}), {"succeeded": "COUNT"})
    sm.add("COUNT", count, {"again": "SLOW"})
    sm.add_cleanup("RESTORE", RestoreParameters())
    mission(sm).assert_outcome("done")
    assert len(controller.changes) == 7
    assert controller.parameters == FAST
    assert sm.userdata.parameters_before == {}


def _state(outcomes, keys):
    def make(function):
        class Made(State):
            def __init__(self):
                super().__init__(outcomes, io_keys=keys)

            def execute(self, userdata):
                return function(userdata)

        return Made()

    return make


def test_nested_machines_restore_one_after_the_other(mission, controller):
    inner = StateMachine(ENDS, name="INNER")
    inner.add("SLOWER", SetParameters("controller", {"max_vel_x": 0.1}))
    inner.add_cleanup("RESTORE", RestoreParameters())
    mission(slowly(inner)).assert_outcome("succeeded")
    assert [each["max_vel_x"] for each in controller.changes] == [0.2, 0.1, 0.2, 0.5]


@pytest.mark.parametrize("takes", [0.0, 1.0])
def test_branches_that_set_the_same_parameter_share_a_key(mission, controller, takes):
    controller.takes["set_parameters"] = takes
    both = Concurrence(ENDS, "succeeded")
    both.add("A", SetParameters("controller", {"max_vel_x": 0.2}))
    both.add("B", SetParameters("controller", {"max_vel_x": 0.1}))
    both.add_cleanup("RESTORE", RestoreParameters())
    mission(both).assert_outcome("succeeded")
    assert controller.parameters == FAST


def test_what_somebody_else_has_changed_is_left_and_told(mission, controller, caplog):
    class Operator(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, userdata):
            controller.parameters["max_vel_x"] = 0.05
            return "done"

    mission(slowly(Operator())).assert_outcome("done")
    assert controller.parameters["max_vel_x"] == 0.05
    assert "max_vel_x: got 0.05; expected 0.2" in caplog.text


def test_a_node_that_restarts_has_its_own_values_again(mission, controller):
    class Restart(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, userdata):
            controller.kill()
            self.sleep(1.0)
            controller.come_back()
            return "done"

    mission(slowly(Restart())).assert_outcome("done")
    assert controller.parameters == FAST


def test_what_was_set_first_is_set_back_if_the_node_refuses_the_second_value(mission, controller):
    sm = StateMachine(ENDS, name="TWICE")
    sm.add("SLOW", SetParameters("controller", SLOW), {"succeeded": "SLOWER"})
    sm.add("SLOWER", SetParameters("controller", {"max_vel_x": "0.1"}))
    sm.add_cleanup("RESTORE", RestoreParameters())
    mission(sm).assert_outcome("aborted")
    assert controller.parameters == FAST


@pytest.mark.parametrize(
    ("was", "value", "sent"),
    [
        ([0.5, 1.0], (0.1, 0.2), [0.1, 0.2]),
        ([0.5, 1.0], [1, 2], [1.0, 2.0]),
        (0.5, math.nan, math.nan),
        (math.nan, 0.5, 0.5),
        ([], ["scan"], ["scan"]),
    ],
)
def test_values_of_every_form_are_set_back(mission, was, value, sent):
    node = mission.ros2_node("costmap", {"x": was, "speed": 1.0})
    sm = StateMachine(ENDS, name="M")
    sm.add("SET", SetParameters("costmap", {"x": value, "speed": 2.0}))
    sm.add_cleanup("RESTORE", RestoreParameters())
    mission(sm).assert_outcome("succeeded")
    told = [repr(each["x"]) for each in node.changes]
    assert told == [repr(sent), repr(was)]
    assert node.parameters["speed"] == 1.0


def test_a_branch_that_is_limited_keeps_what_another_one_has_noted_meanwhile(mission, controller):
    planner = mission.ros1_node("move_base/Planner", {"max_vel_x": 0.5})
    planner.highest, planner.takes = {"max_vel_x": 0.8}, {"set_parameters": 2.0}
    both = Concurrence(ENDS, "succeeded")
    both.add("A", SetParameters("move_base/Planner", {"max_vel_x": 3.0}, ros1=True))
    both.add("B", SetParameters("controller", SLOW))
    both.add_cleanup("RESTORE", RestoreParameters())
    controller.takes["get_parameters"] = 3.0  # between the planner's answers, at 2 and at 4 s
    mission(both).assert_outcome("succeeded")
    assert controller.parameters == FAST
    assert planner.parameters == {"max_vel_x": 0.5}


def test_what_could_not_be_restored_stays_in_the_key(mission, controller, caplog):
    class Kill(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, userdata):
            controller.kill()
            return "done"

    sm = slowly(Kill())
    mission(sm).assert_outcome("done")
    assert "/controller/get_parameters: no server" in caplog.text
    assert sm.userdata.parameters_before == {
        "controller": {"max_vel_x": {"was": 0.5, "set": [0.2]}}
    }


def test_the_others_are_restored_where_a_node_does_not_have_one_any_more(
    mission, controller, caplog
):
    class Restart(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, userdata):
            del controller.parameters["plugins"]
            return "done"

    sm = StateMachine([*ENDS, "done"], name="M")
    both = {"max_vel_x": 0.2, "plugins": ["b"]}
    sm.add("SET", SetParameters("controller", both), {"succeeded": "RESTART"})
    sm.add("RESTART", Restart())
    sm.add_cleanup("RESTORE", RestoreParameters())
    mission(sm).assert_outcome("done")
    assert controller.parameters == {"max_vel_x": 0.5}
    assert "/controller: plugins: got no such parameter" in caplog.text
    assert set(sm.userdata.parameters_before["controller"]) == set(both)


def test_a_secret_is_shown_neither_in_pictures_nor_in_the_log(mission, caplog):
    node = mission.ros2_node("wifi", {"password": "first"})

    class Operator(State):
        def __init__(self):
            super().__init__(["done"])

        def execute(self, userdata):
            node.parameters["password"] = "third"
            return "done"

    sm = StateMachine([*ENDS, "done"], name="M")
    state = SetParameters("wifi", {"password": "second"})
    sm.add("SET", state, {"succeeded": "OPERATOR"})
    sm.add("OPERATOR", Operator())
    sm.add_cleanup("RESTORE", RestoreParameters())
    mission(sm).assert_outcome("done")
    told = caplog.text + repr(state.describe_details())
    assert "Somebody has changed it" in told
    assert not {"first", "second", "third"} & set(told.replace("'", " ").split())


def test_there_may_be_nothing_to_restore(mission):
    mission(alone(RestoreParameters())).assert_outcome("succeeded")


@pytest.mark.slow
def test_they_are_restored_after_a_kill_at_any_moment(mission, controller):
    found = mission.explore(slowly, faults=["kill"], keep=["SLOW", "WORK", "RESTORE"])
    found.assert_ok()
    assert found.runs > 3


# -- ROS 1 -------------------------------------------------------------------------------------

PLANNER = {"max_vel_x": 0.5, "samples": 3, "holonomic": False, "frame": "odom"}


@pytest.fixture
def planner(mission):
    return mission.ros1_node("move_base/Planner", PLANNER)


def slowly_in_ros1(values=None, **options):
    sm = StateMachine([*ENDS, "done"], name="SLOWLY")
    slow = SetParameters("move_base/Planner", values or SLOW, ros1=True, **options)
    sm.add("SLOW", slow, {"succeeded": "WORK"})
    sm.add("WORK", Wait(10.0))
    sm.add_cleanup("RESTORE", RestoreParameters())
    return sm


def test_parameters_of_a_ros1_node_are_set_during_the_work_and_set_back(mission, planner):
    values = {"max_vel_x": 1, "samples": 5, "holonomic": True, "frame": "map"}
    sm = slowly_in_ros1(values)
    mission(sm).assert_outcome("done")
    assert planner.changes == [values, PLANNER]
    assert type(planner.changes[0]["max_vel_x"]) is float
    assert sm.userdata.parameters_before == {}


@pytest.mark.parametrize("after", [0.0, 1.0, 3.0, 4.5])
def test_those_of_a_ros1_node_are_set_back_whenever_a_preempt_comes(mission, planner, after):
    planner.takes["set_parameters"] = 2.0
    mission.preempt(on="SLOW", after=after) if after < 4 else mission.preempt(on="WORK")
    mission(slowly_in_ros1()).assert_outcome("preempted")
    mission(alone(Wait(10.0)))
    assert planner.parameters == PLANNER


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"max_vel": 1.0}, "max_vel: got no such parameter; expected one of its own. Did you mean"),
        ({"holonomic": "yes"}, "holonomic: the node did not take the value. Try"),
        ({"samples": 2.5}, "samples: the node did not take the value: 3, not 2.5. Try"),
        ({"max_vel_x": 9.0}, "max_vel_x: the node did not take the value: 0.5, not 9.0. Try"),
    ],
)
def test_what_a_ros1_node_does_not_take_is_told(mission, planner, caplog, values, problem):
    planner.refused["max_vel_x"] = "beyond its limits"
    mission(slowly_in_ros1(values)).assert_outcome("aborted")
    assert f"/move_base/Planner: {problem}" in caplog.text
    assert planner.parameters == PLANNER


def test_what_a_ros1_node_limits_is_set_back_too(mission, planner, caplog):
    """It stayed at the limit, as if somebody else had changed it."""
    planner.highest["max_vel_x"] = 0.8
    values = {"max_vel_x": 9.0, "samples": 5}
    mission(slowly_in_ros1(values)).assert_outcome("aborted")
    assert planner.changes[0] == {"max_vel_x": 0.8, "samples": 5}
    assert planner.parameters == PLANNER


def test_a_ros1_node_that_is_not_there_or_never_answers(mission, caplog):
    run = mission(slowly_in_ros1(timeout=3.0))
    assert run.outcome == "aborted"
    assert "/move_base/Planner/set_parameters: no server" in caplog.text
    planner = mission.ros1_node("move_base/Planner", PLANNER)
    planner.takes["set_parameters"] = None
    mission(slowly_in_ros1(timeout=3.0)).assert_outcome("aborted")
    assert "/move_base/Planner/set_parameters: no answer" in caplog.text


def test_a_node_of_the_other_ros_is_told(mission, planner, caplog):
    mission.ros2_node("controller", FAST)
    for name, ros1 in (("controller", True), ("move_base/Planner", False)):
        state = SetParameters(name, SLOW, ros1=ros1, timeout=3.0)
        mission(alone(state)).assert_outcome("aborted")
    assert "expected one of type dynamic_reconfigure/Reconfigure" in caplog.text
    assert "expected one of type rcl_interfaces/srv/GetParameters" in caplog.text
    assert planner.parameters == PLANNER


@pytest.mark.parametrize("value", [None, [1], b"x", 2**31])
def test_what_no_ros1_parameter_can_be_is_refused_where_it_is_given(value):
    with pytest.raises(InvalidStateError, match=r"values: x: got .* an int of 32 bits"):
        SetParameters("a", {"x": value}, ros1=True)


# -- life cycles -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("first", "target", "steps"),
    [
        ("unconfigured", "active", ["configure", "activate"]),
        ("unconfigured", "inactive", ["configure"]),
        ("active", "unconfigured", ["deactivate", "cleanup"]),
        ("inactive", "finalized", ["shutdown"]),
        ("active", "active", []),
    ],
)
def test_a_node_is_brought_to_a_state(mission, first, target, steps):
    node = mission.ros2_node("map_server", state=first)
    mission(alone(SetLifecycle("map_server", target))).assert_outcome("succeeded")
    assert (node.state, node.transitions) == (target, steps)


def test_a_node_that_refuses_a_transition(mission, caplog):
    node = mission.ros2_node("map_server", state="unconfigured")
    node.refused["activate"] = "no map"
    mission(alone(SetLifecycle("map_server"))).assert_outcome("aborted")
    assert node.state == "inactive"
    assert "/map_server: activate: got a refusal in state 'inactive'" in caplog.text


def test_a_state_from_which_no_transition_leads_there(mission, caplog):
    mission.ros2_node("map_server", state="finalized")
    mission(alone(SetLifecycle("map_server"))).assert_outcome("aborted")
    assert "got state 'finalized'; expected one from which it can become 'active'" in caplog.text


def test_a_node_that_says_it_did_but_did_not(mission, monkeypatch, caplog):
    node = mission.ros2_node("map_server", state="unconfigured")
    monkeypatch.setitem(_moves(), ("unconfigured", "configure"), "unconfigured")
    mission(alone(SetLifecycle("map_server"))).assert_outcome("aborted")
    assert node.transitions == ["configure"]
    assert "had answered that it did 'configure'" in caplog.text


def _moves():
    from smachpy.testing.ros2_node import MOVES

    return MOVES


def test_it_waits_while_somebody_else_moves_the_node(mission):
    node = mission.ros2_node("map_server", state="activating")
    mission.clock.call_later(3.0, lambda: setattr(node, "state", "active"))
    run = mission(alone(SetLifecycle("map_server")))
    run.assert_outcome("succeeded")
    assert 3.0 <= run.duration <= 3.5


def test_a_node_that_never_arrives(mission, caplog):
    mission.ros2_node("map_server", state="activating")
    run = mission(alone(SetLifecycle("map_server", timeout=5.0)))
    run.assert_outcome("aborted")
    assert run.duration <= 5.5


@pytest.mark.parametrize("after", [0.0, 0.2, 1.5, 3.0])
def test_a_preempt_ends_a_life_cycle_at_any_moment(mission, after):
    node = mission.ros2_node("map_server", state="unconfigured")
    node.takes |= {"get_state": 0.5, "change_state": 1.0}
    mission.preempt(on="STATE", after=after)
    run = mission(alone(SetLifecycle("map_server")))
    run.assert_outcome("preempted")
    assert run.duration == after


def test_a_preempt_ends_the_wait_between_two_states(mission):
    mission.ros2_node("map_server", state="activating")
    mission.preempt(on="STATE", after=1.2)
    run = mission(alone(SetLifecycle("map_server")))
    run.assert_outcome("preempted")
    assert run.duration == 1.2


def test_an_exploration_has_the_node_as_the_test_has_made_it(mission):
    """Its runs began with the first parameters and the first state."""
    node = mission.ros2_node("controller", FAST, state="unconfigured")
    node.parameters["max_vel_x"] = 0.4
    node.state = "inactive"
    with mission_kit() as other:
        copy = node.copy_to(other)
        assert (copy.parameters, copy.state) == ({**FAST, "max_vel_x": 0.4}, "inactive")
        copy.kill()
        copy.come_back()
        assert (copy.parameters, copy.state) == (FAST, "unconfigured")


def test_a_machine_explored_with_them_is_sound():
    found = explore(slowly)
    assert found.ok
