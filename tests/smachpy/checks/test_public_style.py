"""Machines as people write them for SMACH: nothing is said of those that are right.

Each function under `sound` makes a machine that runs as its author means it; the first ones follow
SMACH's tutorials. Each one under `faulty` has a fault that a check must find.
"""

from __future__ import annotations

import os
import random
import time

import pytest

import smachpy as smach
import smachpy as smach_ros
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.std_msgs.msg import Empty
from actionlib_core.interfaces.std_srvs.srv import Trigger
from smachpy.checks import check

SOUND = {}
FAULTY = {}


def sound(make):
    SOUND[make.__name__] = make
    return make


def faulty(rule, path):
    def keep(make):
        FAULTY[make.__name__] = (make, rule, path)
        return make

    return keep


# -- SMACH's tutorials -----------------------------------------------------------------------------


class Foo(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["outcome1", "outcome2"])
        self.counter = 0

    def execute(self, userdata):
        if self.counter < 3:
            self.counter += 1
            return "outcome1"
        else:  # noqa: RET505  as in the tutorial
            return "outcome2"


class Bar(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["outcome1"])

    def execute(self, userdata):
        return "outcome1"


@sound
def simple_state_machine():
    sm = smach.StateMachine(outcomes=["outcome4"])
    with sm:
        smach.StateMachine.add(
            "FOO", Foo(), transitions={"outcome1": "BAR", "outcome2": "outcome4"}
        )
        smach.StateMachine.add("BAR", Bar(), transitions={"outcome1": "FOO"})
    return sm


class FooData(smach.State):
    def __init__(self):
        smach.State.__init__(
            self,
            outcomes=["outcome1", "outcome2"],
            input_keys=["foo_counter_in"],
            output_keys=["foo_counter_out"],
        )

    def execute(self, userdata):
        if userdata.foo_counter_in < 3:
            userdata.foo_counter_out = userdata.foo_counter_in + 1
            return "outcome1"
        return "outcome2"


class BarData(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["outcome1"], input_keys=["bar_counter_in"])

    def execute(self, userdata):
        print(f"Counter = {userdata.bar_counter_in}")
        return "outcome1"


@sound
def userdata_passed_between_states():
    sm = smach.StateMachine(outcomes=["outcome4"])
    sm.userdata.sm_counter = 0
    with sm:
        smach.StateMachine.add(
            "FOO",
            FooData(),
            transitions={"outcome1": "BAR", "outcome2": "outcome4"},
            remapping={"foo_counter_in": "sm_counter", "foo_counter_out": "sm_counter"},
        )
        smach.StateMachine.add(
            "BAR",
            BarData(),
            transitions={"outcome1": "FOO"},
            remapping={"bar_counter_in": "sm_counter"},
        )
    return sm


class Bas(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["outcome3"])

    def execute(self, userdata):
        return "outcome3"


@sound
def hierarchical_state_machine():
    sm_top = smach.StateMachine(outcomes=["outcome5"])
    with sm_top:
        smach.StateMachine.add("BAS", Bas(), transitions={"outcome3": "SUB"})
        sm_sub = smach.StateMachine(outcomes=["outcome4"])
        with sm_sub:
            smach.StateMachine.add(
                "FOO", Foo(), transitions={"outcome1": "BAR", "outcome2": "outcome4"}
            )
            smach.StateMachine.add("BAR", Bar(), transitions={"outcome1": "FOO"})
        smach.StateMachine.add("SUB", sm_sub, transitions={"outcome4": "outcome5"})
    return sm_top


class BasWithARest(Bas):
    def execute(self, userdata):
        time.sleep(1.0)
        return "outcome3"


@sound
def hierarchical_state_machine_that_runs_for_ever():
    """The inner pair has another way out, and the outer loop has none: its author wants that."""
    sm_top = smach.StateMachine(outcomes=["preempted"])
    with sm_top:
        smach.StateMachine.add("BAS", BasWithARest(), transitions={"outcome3": "SUB"})
        sm_sub = smach.StateMachine(outcomes=["outcome4"])
        with sm_sub:
            smach.StateMachine.add(
                "FOO", Foo(), transitions={"outcome1": "BAR", "outcome2": "outcome4"}
            )
            smach.StateMachine.add("BAR", Bar(), transitions={"outcome1": "FOO"})
        smach.StateMachine.add("SUB", sm_sub, transitions={"outcome4": "BAS"})
    return sm_top


@sound
def concurrent_states():
    sm_top = smach.StateMachine(outcomes=["outcome6"])
    with sm_top:
        smach.StateMachine.add("BAS", Bas(), transitions={"outcome3": "CON"})
        sm_con = smach.Concurrence(
            outcomes=["outcome4", "outcome5"],
            default_outcome="outcome4",
            outcome_map={"outcome5": {"FOO": "outcome2", "BAR": "outcome1"}},
        )
        with sm_con:
            smach.Concurrence.add("FOO", Foo())
            smach.Concurrence.add("BAR", Bar())
        smach.StateMachine.add(
            "CON", sm_con, transitions={"outcome4": "CON", "outcome5": "outcome6"}
        )
    return sm_top


def monitor_cb(ud, msg):
    return False


@sound
def monitor_state_that_resets():
    sm = smach.StateMachine(outcomes=["DONE"])
    with sm:
        smach.StateMachine.add("FOO", Foo(), {"outcome1": "BAR", "outcome2": "DONE"})
        smach.StateMachine.add(
            "BAR",
            smach_ros.MonitorState("/sm_reset", Empty, monitor_cb),
            transitions={"invalid": "FOO", "valid": "FOO", "preempted": "FOO"},
        )
    return sm


class Setup(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["setup_done"])

    def execute(self, userdata):
        time.sleep(3.5)
        return "setup_done"


def child_term_cb(outcome_map):
    return True


@sound
def restart_by_a_monitor():
    foo_concurrence = smach.Concurrence(
        outcomes=["foo_done", "foo_reset"],
        default_outcome="foo_done",
        child_termination_cb=lambda outcomes: outcomes["RESET"] == "invalid",
        outcome_cb=lambda outcomes: "foo_reset" if outcomes["RESET"] == "invalid" else "foo_done",
    )
    with foo_concurrence:
        smach.Concurrence.add("FOO_CALC", Setup())
        smach.Concurrence.add("RESET", smach_ros.MonitorState("/sm_reset", Empty, monitor_cb))
    sm = smach.StateMachine(outcomes=["DONE"])
    with sm:
        smach.StateMachine.add("SETUP", Setup(), transitions={"setup_done": "FOO"})
        smach.StateMachine.add("FOO", foo_concurrence, {"foo_reset": "SETUP", "foo_done": "DONE"})
    return sm


@smach.cb_interface(outcomes=["even", "odd"], input_keys=["index"])
def is_even(ud):
    return "even" if ud.index % 2 == 0 else "odd"


class AddKey(smach.State):
    def __init__(self):
        smach.State.__init__(
            self, ["succeeded"], input_keys=["index", "even_nums"], output_keys=["even_nums"]
        )

    def execute(self, ud):
        ud.even_nums.append(ud.index)
        return "succeeded"


@sound
def iterator_of_the_tutorial():
    sm = smach.StateMachine(outcomes=["succeeded", "preempted", "aborted"])
    with sm:
        it = smach.Iterator(
            outcomes=["succeeded", "preempted", "aborted"],
            input_keys=["even_nums"],
            it=lambda: range(5),
            output_keys=["even_nums"],
            it_label="index",
            exhausted_outcome="succeeded",
        )
        sm.userdata.even_nums = []
        with it:
            body = smach.StateMachine(
                outcomes=["succeeded", "preempted", "aborted", "continue"],
                input_keys=["index", "even_nums"],
                output_keys=["even_nums"],
            )
            with body:
                smach.StateMachine.add(
                    "EVEN_OR_ODD", smach.CBState(is_even), {"even": "ADD", "odd": "continue"}
                )
                smach.StateMachine.add("ADD", AddKey(), {"succeeded": "continue"})
            smach.Iterator.set_contained_state("BODY", body, loop_outcomes=["continue"])
        smach.StateMachine.add("EACH", it, {"succeeded": "succeeded"})
    return sm


@sound
def goal_built_by_a_callback():
    def goal_cb(userdata, goal):
        if userdata.fast:
            goal.target_pose.header.frame_id = userdata.frame
        return goal

    def result_cb(userdata, status, result):
        userdata.reached = status
        return "succeeded"

    sm = smach.StateMachine(outcomes=["succeeded", "aborted", "preempted"])
    sm.userdata.fast = True
    sm.userdata.frame = "map"
    with sm:
        smach.StateMachine.add(
            "MOVE",
            smach_ros.SimpleActionState(
                "move_base",
                MoveBaseAction,
                goal_cb=goal_cb,
                result_cb=result_cb,
                input_keys=["fast", "frame"],
                output_keys=["reached"],
            ),
        )
    return sm


@sound
def service_call():
    sm = smach.StateMachine(["succeeded", "aborted", "preempted"])
    with sm:
        smach.StateMachine.add("CALL", smach_ros.ServiceState("reset", Trigger))
    return sm


# -- loops -----------------------------------------------------------------------------------------


def move(**transitions):
    return smach_ros.SimpleActionState("move_base", MoveBaseAction, goal=MoveBaseGoal())


@sound
def retry_until_it_succeeds():
    sm = smach.StateMachine(["succeeded", "preempted"])
    with sm:
        smach.StateMachine.add("MOVE", move(), {"aborted": "CLEAR"})
        smach.StateMachine.add("CLEAR", Setup(), {"setup_done": "MOVE"})
    return sm


class Counts(smach.State):
    """Tries again until its count is over."""

    def __init__(self, most):
        smach.State.__init__(self, outcomes=["again", "give_up"])
        self._most = most
        self._count = 0

    def execute(self, userdata):
        self._count += 1
        return "again" if self._count < self._most else "give_up"


@sound
def retry_with_a_count():
    sm = smach.StateMachine(["succeeded", "aborted", "preempted"])
    with sm:
        smach.StateMachine.add("MOVE", move(), {"aborted": "COUNT"})
        smach.StateMachine.add("COUNT", Counts(3), {"again": "MOVE", "give_up": "aborted"})
    return sm


class Choose(smach.State):
    """Ends with any of its outcomes."""

    def __init__(self, *outcomes, **keys):
        smach.State.__init__(self, outcomes=outcomes, **keys)

    def execute(self, userdata):
        return random.choice(self.get_registered_outcomes())


def pair(outcomes=("done",), **options):
    """A machine with an inner pair that has another way out."""
    sm = smach.StateMachine(outcomes, **options)
    with sm:
        smach.StateMachine.add("A", Choose("next", *outcomes), {"next": "B"})
        smach.StateMachine.add("B", Choose("back"), {"back": "A"})
    return sm


@sound
def inner_pair_two_levels_down_in_a_root_that_serves():
    middle = smach.StateMachine(["done"])
    with middle:
        smach.StateMachine.add("PAIR", pair())
    sm = smach.StateMachine(["preempted"])
    with sm:
        smach.StateMachine.add("WAIT", Choose("asked"), {"asked": "DO"})
        smach.StateMachine.add("DO", middle, {"done": "WAIT"})
    return sm


@sound
def inner_pairs_side_by_side_in_a_concurrence():
    both = smach.Concurrence(
        ["succeeded", "failed"],
        "failed",
        outcome_map={"succeeded": {"LEFT": "done", "RIGHT": "done"}},
    )
    with both:
        smach.Concurrence.add("LEFT", pair(["done", "failed"]))
        smach.Concurrence.add("RIGHT", pair(["done", "failed"]))
    sm = smach.StateMachine(["succeeded", "failed"])
    with sm:
        smach.StateMachine.add("BOTH", both)
    return sm


@sound
def inner_pair_whose_way_out_is_never_wanted():
    """The concurrence never ends with what the pair's only way out would make of it."""
    both = smach.Concurrence(["succeeded"], "succeeded", child_termination_cb=lambda outcomes: True)
    with both:
        smach.Concurrence.add("WORK", Choose("ok", "bad"))
        smach.Concurrence.add("PAIR", pair(["failed"]))
    return both


@sound
def patrol_beside_a_monitor():
    patrol = smach.StateMachine(["preempted"])
    with patrol:
        smach.StateMachine.add("LEFT", Setup(), {"setup_done": "RIGHT"})
        smach.StateMachine.add("RIGHT", Setup(), {"setup_done": "LEFT"})
    both = smach.Concurrence(
        ["recharge", "aborted"],
        "aborted",
        outcome_map={"recharge": {"BATTERY": "invalid"}},
        child_termination_cb=child_term_cb,
    )
    with both:
        smach.Concurrence.add("PATROL", patrol)
        smach.Concurrence.add("BATTERY", smach_ros.MonitorState("battery", Empty, monitor_cb))
    sm = smach.StateMachine(["succeeded", "aborted"])
    with sm:
        smach.StateMachine.add("WORK", both, {"recharge": "DOCK"})
        smach.StateMachine.add("DOCK", Setup(), {"setup_done": "succeeded"})
    return sm


@sound
def patrol_that_a_timeout_ends():
    patrol = smach.StateMachine(["preempted"], timeout=600, timeout_outcome="time_over")
    with patrol:
        smach.StateMachine.add("LEFT", Setup(), {"setup_done": "RIGHT"})
        smach.StateMachine.add("RIGHT", Setup(), {"setup_done": "LEFT"})
    sm = smach.StateMachine(["succeeded", "preempted"])
    with sm:
        smach.StateMachine.add("PATROL", patrol, {"time_over": "succeeded"})
    return sm


@sound
def root_that_serves_for_ever():
    sm = smach.StateMachine(["preempted"])
    with sm:
        smach.StateMachine.add(
            "LISTEN", Choose("command", "nothing"), {"nothing": "LISTEN", "command": "ACT"}
        )
        smach.StateMachine.add("ACT", Choose("done"), {"done": "LISTEN"})
    return sm


@sound
def root_that_serves_for_ever_once_it_is_set_up():
    sm = smach.StateMachine(["aborted"])
    with sm:
        smach.StateMachine.add(
            "INIT", Choose("ready", "failed"), {"ready": "SERVE", "failed": "aborted"}
        )
        smach.StateMachine.add("SERVE", Choose("served"), {"served": "SERVE"})
    return sm


@sound
def root_of_watchers_that_run_until_they_are_stopped():
    class Watch(smach.State):
        def __init__(self):
            smach.State.__init__(self, outcomes=["preempted"])

        def execute(self, userdata):
            while not self.preempt_requested():
                time.sleep(0.1)
            self.service_preempt()
            return "preempted"

    both = smach.Concurrence(["preempted"], "preempted")
    with both:
        smach.Concurrence.add("LASER", Watch())
        smach.Concurrence.add("BUMPER", Watch())
    return both


# -- userdata --------------------------------------------------------------------------------------


class Reads(smach.State):
    def __init__(self, key):
        smach.State.__init__(self, outcomes=["done"], input_keys=[key])
        self._key = key

    def execute(self, userdata):
        print(userdata[self._key])
        return "done"


class UsesGoal(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"], input_keys=["goal"])

    def execute(self, userdata):
        print(userdata.goal)
        return "done"


@sound
def key_written_by_a_start_callback():
    sm = smach.StateMachine(["done"])
    sm.register_start_cb(lambda ud, initial: ud.update({"goal": 1}))
    with sm:
        smach.StateMachine.add("USE", UsesGoal())
    return sm


@sound
def key_written_by_the_start_callback_of_an_outer_machine():
    inner = smach.StateMachine(["done"], input_keys=["goal"])
    with inner:
        smach.StateMachine.add("USE", UsesGoal())
    middle = smach.StateMachine(["done"], input_keys=["goal"])
    with middle:
        smach.StateMachine.add("INNER", inner)
    sm = smach.StateMachine(["done"])
    sm.register_start_cb(lambda ud, initial: ud.update({"goal": 1}))
    with sm:
        smach.StateMachine.add("MIDDLE", middle)
    return sm


@sound
def key_written_by_the_start_callback_of_an_inner_machine():
    inner = smach.StateMachine(["done"], output_keys=["goal"])
    inner.register_start_cb(lambda ud, initial: ud.update({"goal": 1}))
    with inner:
        smach.StateMachine.add("LOOK", Bas(), {"outcome3": "done"})
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("INNER", inner, {"done": "USE"})
        smach.StateMachine.add("USE", UsesGoal())
    return sm


@sound
def keys_given_by_the_caller():
    sm = smach.StateMachine(["done"], input_keys=["goal"])
    with sm:
        smach.StateMachine.add("USE", UsesGoal())
    return sm


class Follows(smach.State):
    def __init__(self, **options):
        smach.State.__init__(self, outcomes=["done"], io_keys=["goal"], **options)

    def execute(self, userdata):
        userdata.goal = userdata.goal + 1
        return "done"


def first_goal(userdata):
    userdata.goal = 1


@sound
def key_written_by_on_enter():
    inner = smach.StateMachine(["done"], ["goal"], ["goal"], on_enter=first_goal)
    with inner:
        smach.StateMachine.add("USE", Follows())
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add(
            "USE", Follows(on_enter=first_goal), {"done": "INNER"}, {"goal": "a"}
        )
        smach.StateMachine.add("INNER", inner, remapping={"goal": "b"})
    return sm


class Mission(smach.StateMachine):
    """Its constructor takes the values."""

    def __init__(self, goal):
        smach.StateMachine.__init__(self, outcomes=["done"])
        self.userdata.goal = goal
        with self:
            smach.StateMachine.add("USE", UsesGoal())


@sound
def machine_class_with_constructor_arguments():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("FIRST", Mission(1), {"done": "SECOND"})
        smach.StateMachine.add("SECOND", Mission(2))
    return sm


@sound
def userdata_shared_by_two_machines():
    sm = smach.StateMachine(["done"])
    inner = smach.StateMachine(["done"])
    inner.userdata = sm.userdata
    with inner:
        smach.StateMachine.add("USE", UsesGoal())
    with sm:
        smach.StateMachine.add("FIND", Choose("found", output_keys=["goal"]), {"found": "INNER"})
        smach.StateMachine.add("INNER", inner)
    return sm


@sound
def key_set_on_the_machine_by_a_state():
    sm = smach.StateMachine(["done"])

    class Sets(smach.State):
        def execute(self, userdata):
            sm.userdata.goal = 1
            return "done"

    with sm:
        smach.StateMachine.add("SET", Sets(["done"]), {"done": "USE"})
        smach.StateMachine.add("USE", UsesGoal())
    return sm


class Guards(smach.State):
    """Reads what need not be there, in all the ways there are."""

    def __init__(self):
        smach.State.__init__(self, outcomes=["done"], input_keys=["a", "b", "c", "d", "e", "f"])

    def execute(self, userdata):
        if "a" in userdata:
            print(userdata.a)
        try:
            print(userdata.b)
        except KeyError:
            print("no b")
        try:
            print(userdata["c"])
        except Exception:
            print("no c")
        if "d" not in userdata or userdata.d is None:
            print("no d")
        print("e" in userdata and userdata["e"])
        print(userdata.f if "f" in userdata else "no f")
        return "done"


@sound
def guarded_reads():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("LOOK", Guards())
    return sm


class AsksForAttributes(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"], input_keys=["a", "b", "c"])

    def execute(self, userdata):
        if hasattr(userdata, "a"):
            print(userdata.a)
        if "b" in userdata.keys():  # noqa: SIM118
            print(userdata.b)
        print(getattr(userdata, "c", None))
        return "done"


@sound
def guarded_reads_of_attributes():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("LOOK", AsksForAttributes())
    return sm


class UsesWhatWasFound(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done", "none"], input_keys=["found", "pose"])

    def execute(self, userdata):
        if not userdata.found:
            return "none"
        print(userdata.pose)
        return "done"


class Tells(smach.State):
    def __init__(self, outcome, output_keys):
        smach.State.__init__(self, outcomes=[outcome], output_keys=output_keys)
        self._outcome = outcome

    def execute(self, userdata):
        for key in self.get_registered_output_keys():
            userdata[key] = True
        return self._outcome


@sound
def key_read_only_where_another_one_says_that_it_is_there():
    sm = smach.StateMachine(["done", "none"])
    with sm:
        smach.StateMachine.add(
            "LOOK", Choose("seen", "unseen"), {"seen": "SEEN", "unseen": "UNSEEN"}
        )
        smach.StateMachine.add("SEEN", Tells("told", ["found", "pose"]), {"told": "USE"})
        smach.StateMachine.add("UNSEEN", Tells("told", ["found"]), {"told": "USE"})
        smach.StateMachine.add("USE", UsesWhatWasFound())
    return sm


@sound
def key_written_on_the_way_that_leads_to_the_reader():
    sm = smach.StateMachine(["done", "aborted"])
    with sm:
        smach.StateMachine.add(
            "LOOK",
            Choose("found", "lost", output_keys=["goal"]),
            {"found": "USE", "lost": "aborted"},
        )
        smach.StateMachine.add("USE", UsesGoal())
    return sm


@sound
def key_written_by_a_monitor_in_a_concurrence():
    def saw(userdata, message):
        userdata.goal = message
        return False

    both = smach.Concurrence(
        ["seen", "not_seen"],
        "not_seen",
        output_keys=["goal"],
        outcome_map={"seen": {"WATCH": "invalid"}},
        child_termination_cb=child_term_cb,
    )
    with both:
        smach.Concurrence.add(
            "WATCH", smach_ros.MonitorState("seen", Empty, saw, output_keys=["goal"])
        )
        smach.Concurrence.add("TURN", Setup())
    sm = smach.StateMachine(["done", "aborted"])
    with sm:
        smach.StateMachine.add("SEARCH", both, {"seen": "USE", "not_seen": "aborted"})
        smach.StateMachine.add("USE", UsesGoal())
    return sm


@sound
def key_in_a_loop_written_by_the_pass_before():
    class Follows(smach.State):
        def __init__(self):
            smach.State.__init__(self, outcomes=["more", "done"], io_keys=["last"])
            self.passes = 0

        def execute(self, userdata):
            if self.passes:
                print(userdata.last)
            userdata.last = self.passes
            self.passes += 1
            return "more" if self.passes < 3 else "done"

    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("FOLLOW", Follows(), {"more": "FOLLOW"})
    return sm


# -- containers and outcomes -----------------------------------------------------------------------


class RunsItsStatesItself(smach.StateMachine):
    """Runs its states in an order of its own."""

    def __init__(self):
        smach.StateMachine.__init__(self, outcomes=["done"], input_keys=["goal"])
        with self:
            smach.StateMachine.add("A", Bas(), {"outcome3": "B"})
            smach.StateMachine.add("B", Bas(), {"outcome3": "A"})
            smach.StateMachine.add("NEVER", UsesGoal())

    def execute(self, parent_ud=None):
        for state in self.get_children().values():
            state.execute(self.userdata)
        return "done"


@sound
def container_that_runs_its_states_itself():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("OWN", RunsItsStatesItself())
    return sm


class Navigate(smach.State):
    """Declares what its arguments ask for."""

    def __init__(self, *, may_fail=False):
        outcomes = ["done"]
        if may_fail:
            outcomes.append("failed")
        smach.State.__init__(self, outcomes=outcomes)
        self._may_fail = may_fail

    def execute(self, userdata):
        if self._may_fail and not os.path.exists("/map"):
            return "failed"
        return "done"


@sound
def outcomes_that_depend_on_constructor_arguments():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("FIRST", Navigate(), {"done": "SECOND"})
        smach.StateMachine.add("SECOND", Navigate(may_fail=True), {"failed": "FIRST"})
    return sm


class Base(smach.State):
    """Does what its subclasses say."""

    def __init__(self):
        smach.State.__init__(self, outcomes=["succeeded", "aborted", "preempted"])

    def execute(self, userdata):
        if self.preempt_requested():
            self.service_preempt()
            return "preempted"
        return self.work(userdata)

    def work(self, userdata):
        raise NotImplementedError


class Grasp(Base):
    def work(self, userdata):
        return "succeeded"


@sound
def states_of_a_common_base_class():
    sm = smach.StateMachine(["succeeded", "preempted"])
    with sm:
        smach.StateMachine.add("GRASP", Grasp(), {"aborted": "GRASP"})
    return sm


@sound
def sequence_of_actions():
    sequence = smach.Sequence(["succeeded", "aborted", "preempted"], "succeeded")
    with sequence:
        smach.Sequence.add("THERE", move())
        smach.Sequence.add("BACK", move())
    return sequence


@sound
def nested_concurrences_with_monitors():
    inner = smach.Concurrence(
        ["done", "stopped"],
        "done",
        outcome_map={"stopped": {"BUTTON": "invalid"}},
        child_termination_cb=child_term_cb,
    )
    with inner:
        smach.Concurrence.add("WORK", pair())
        smach.Concurrence.add("BUTTON", smach_ros.MonitorState("button", Empty, monitor_cb))
    outer = smach.Concurrence(
        ["done", "low", "stopped"],
        "done",
        outcome_map={"low": {"BATTERY": "invalid"}, "stopped": {"INNER": "stopped"}},
        child_termination_cb=child_term_cb,
        outcome_cb=lambda outcomes: None,
    )
    with outer:
        smach.Concurrence.add("INNER", inner)
        smach.Concurrence.add("BATTERY", smach_ros.MonitorState("battery", Empty, monitor_cb))
    sm = smach.StateMachine(["done", "stopped"])
    with sm:
        smach.StateMachine.add("DAY", outer, {"low": "CHARGE"})
        smach.StateMachine.add("CHARGE", Setup(), {"setup_done": "DAY"})
    return sm


@sound
def cleanup_after_a_preempt():
    sm = smach.StateMachine(["succeeded", "aborted", "preempted"])
    with sm:
        smach.StateMachine.add("MOVE", move(), {"preempted": "PARK"})
        smach.StateMachine.add("PARK", Tells("preempted", []))
    return sm


@sound
def menu_that_leads_everywhere_and_back():
    sm = smach.StateMachine(["quit"])
    tasks = ["clean", "fetch", "guard"]
    with sm:
        smach.StateMachine.add(
            "MENU", Choose(*tasks, "quit"), {task: task.upper() for task in tasks}
        )
        for task in tasks:
            smach.StateMachine.add(task.upper(), pair(), {"done": "MENU"})
    return sm


# Machines with outcomes that they really do not need, as warnings say.
SPARE = frozenset({"iterator_of_the_tutorial"})


@pytest.mark.parametrize("name", SOUND)
def test_nothing_is_said_of_a_machine_that_is_right(name):
    report = check(SOUND[name]())
    if name in SPARE:
        assert {(p.rule, p.severity) for p in report} == {("impossible-outcome", "warning")}
    else:
        report.assert_ok()


def test_there_are_enough_machines_to_say_so():
    assert len(SOUND) >= 30
    assert len(FAULTY) >= 10


# -- faults ----------------------------------------------------------------------------------------


@faulty("endless-loop", "/SM_ROOT/IN")
def inner_pair_without_a_way_out():
    inner = smach.StateMachine(["done", "failed"])
    with inner:
        smach.StateMachine.add("FIND", Choose("found", "lost"), {"found": "done", "lost": "A"})
        smach.StateMachine.add("A", Choose("next"), {"next": "B"})
        smach.StateMachine.add("B", Choose("back"), {"back": "A"})
        smach.StateMachine.add("C", Choose("failed"))
    sm = smach.StateMachine(["done", "failed"])
    with sm:
        smach.StateMachine.add("IN", inner)
    return sm


@faulty("endless-loop", "/SM_ROOT")
def outer_trap_around_an_inner_pair_that_has_a_way_out():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("TRY", Choose("done", "failed"), {"failed": "MEND"})
        smach.StateMachine.add("MEND", pair(), {"done": "MEND"})
    return sm


@faulty("endless-loop", "/SM_ROOT/BOTH/LEFT")
def trap_in_a_concurrence_that_nobody_calls_off():
    left = smach.StateMachine(["done"])
    with left:
        smach.StateMachine.add("TRY", Choose("done", "failed"), {"failed": "AGAIN"})
        smach.StateMachine.add("AGAIN", Choose("again"), {"again": "AGAIN"})
    both = smach.Concurrence(["done"], "done")
    with both:
        smach.Concurrence.add("LEFT", left)
        smach.Concurrence.add("RIGHT", Bas())
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("BOTH", both)
    return sm


@faulty("impossible-outcome", "/SM_ROOT")
def root_that_never_gets_to_its_outcome():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("A", Choose("next"), {"next": "B"})
        smach.StateMachine.add("B", Choose("back"), {"back": "A"})
    return sm


@faulty("stuck-concurrence", "/SM_ROOT/BOTH")
def guard_that_nobody_calls_off():
    class Guard(smach.State):
        def __init__(self):
            smach.State.__init__(self, outcomes=["preempted"])

        def execute(self, userdata):
            while not self.preempt_requested():
                time.sleep(0.1)
            return "preempted"

    both = smach.Concurrence(["done"], "done")
    with both:
        smach.Concurrence.add("GUARD", Guard())
        smach.Concurrence.add("WORK", Bas())
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("BOTH", both)
    return sm


@faulty("unset-key", "/SM_ROOT/USE")
def key_that_is_written_on_one_way_only():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("LOOK", Choose("seen", "unseen"), {"seen": "TELL", "unseen": "USE"})
        smach.StateMachine.add("TELL", Tells("told", ["goal"]), {"told": "USE"})
        smach.StateMachine.add("USE", UsesGoal())
    return sm


@faulty("unset-key", "/SM_ROOT/USE")
def key_that_nobody_writes_in_a_branch():
    class UsesInABranch(smach.State):
        def __init__(self):
            smach.State.__init__(self, outcomes=["done"], input_keys=["goal"])

        def execute(self, userdata):
            if os.path.exists("/map"):
                print(userdata.goal)
            return "done"

    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("USE", UsesInABranch())
    return sm


@faulty("unset-key", "/SM_ROOT/USE")
def key_with_a_misspelt_remapping():
    sm = smach.StateMachine(["done"])
    sm.userdata.goal = 1
    with sm:
        smach.StateMachine.add("USE", UsesGoal(), remapping={"goal": "gaol"})
    return sm


@faulty("unset-key", "/SM_ROOT/IN/USE")
def input_key_that_the_inner_machine_does_not_declare():
    inner = smach.StateMachine(["done"])
    with inner:
        smach.StateMachine.add("USE", UsesGoal())
    sm = smach.StateMachine(["done"])
    sm.userdata.goal = 1
    with sm:
        smach.StateMachine.add("IN", inner)
    return sm


@faulty("undeclared-outcome", "/SM_ROOT/GO")
def misspelt_outcome():
    class Misspelt(smach.State):
        def __init__(self):
            smach.State.__init__(self, outcomes=["done", "failed"])

        def execute(self, userdata):
            if os.path.exists("/map"):
                return "dnoe"
            return "failed"

    sm = smach.StateMachine(["done", "failed"])
    with sm:
        smach.StateMachine.add("GO", Misspelt())
    return sm


@faulty("unreachable-state", "/SM_ROOT/PARK")
def state_that_nothing_leads_to():
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("GO", Bas(), {"outcome3": "done"})
        smach.StateMachine.add("PARK", Bas(), {"outcome3": "done"})
    return sm


@faulty("preempt-outcome", "/SM_ROOT/PATROL")
def preempt_that_goes_on():
    patrol = smach.StateMachine(["succeeded", "aborted"])
    with patrol:
        smach.StateMachine.add("MOVE", move(), {"preempted": "aborted"})
    sm = smach.StateMachine(["succeeded"])
    with sm:
        smach.StateMachine.add("PATROL", patrol, {"aborted": "PATROL"})
    return sm


@faulty("unmapped-outcome", "/SM_ROOT/MOVE")
def outcome_without_a_transition():
    sm = smach.StateMachine(["succeeded"])
    with sm.opened(check=False):
        sm.add("MOVE", move(), {"aborted": "MOVE"})
    return sm


@pytest.mark.parametrize("name", FAULTY)
def test_a_fault_is_found(name):
    make, rule, path = FAULTY[name]
    report = check(make())
    assert not report.ok
    assert (rule, path) in [(p.rule, p.path) for p in report if p.severity != "note"]
