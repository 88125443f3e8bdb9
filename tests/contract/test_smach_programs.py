"""Programs as people write them for SMACH; only the import is another."""

from __future__ import annotations

import threading

import smachpy as smach
import smachpy as smach_ros


class Foo(smach.State):
    def __init__(self):
        smach.State.__init__(
            self,
            outcomes=["counted", "finished"],
            input_keys=["counter_in"],
            output_keys=["counter_out"],
        )

    def execute(self, userdata):
        if userdata.counter_in < 3:
            userdata.counter_out = userdata.counter_in + 1
            return "counted"
        return "finished"


class Bar(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["shown"], input_keys=["counter_in"])
        self.seen = []

    def execute(self, userdata):
        self.seen.append(userdata.counter_in)
        return "shown"


def test_two_states_hand_on_a_counter():
    sm = smach.StateMachine(outcomes=["done"])
    sm.userdata.sm_counter = 0
    bar = Bar()
    with sm:
        smach.StateMachine.add(
            "FOO",
            Foo(),
            transitions={"counted": "BAR", "finished": "done"},
            remapping={"counter_in": "sm_counter", "counter_out": "sm_counter"},
        )
        smach.StateMachine.add(
            "BAR", bar, transitions={"shown": "FOO"}, remapping={"counter_in": "sm_counter"}
        )
    assert sm.execute() == "done"
    assert bar.seen == [1, 2, 3]
    assert sm.userdata.sm_counter == 3


def test_a_machine_in_a_machine_with_keys_in_and_out():
    sm_top = smach.StateMachine(outcomes=["succeeded", "aborted"])
    sm_top.userdata.value = 10
    with sm_top:
        sm_sub = smach.StateMachine(
            outcomes=["done"], input_keys=["value"], output_keys=["value", "more"]
        )
        with sm_sub:

            @smach.cb_interface(
                outcomes=["done"], input_keys=["value"], output_keys=["value", "more"]
            )
            def double(ud):
                ud.more = ud.value
                ud.value = 2 * ud.value
                return "done"

            smach.StateMachine.add("DOUBLE", smach.CBState(double))
        smach.StateMachine.add("SUB", sm_sub, transitions={"done": "succeeded"})
    assert sm_top.execute() == "succeeded"
    assert (sm_top.userdata.value, sm_top.userdata.more) == (20, 10)


def test_an_iterator_that_sorts_numbers():
    sm = smach.StateMachine(outcomes=["succeeded", "preempted", "aborted"])
    sm.userdata.nums = list(range(25, 88, 3))
    sm.userdata.even_nums = []
    sm.userdata.odd_nums = []
    with sm:
        numbers = smach.Iterator(
            outcomes=["succeeded", "preempted", "aborted"],
            input_keys=["nums", "even_nums", "odd_nums"],
            it=lambda: range(len(sm.userdata.nums)),
            output_keys=["even_nums", "odd_nums"],
            it_label="index",
            exhausted_outcome="succeeded",
        )
        with numbers:
            container = smach.StateMachine(
                outcomes=["succeeded", "preempted", "aborted", "continue"],
                input_keys=["nums", "index", "even_nums", "odd_nums"],
                output_keys=["even_nums", "odd_nums"],
            )
            with container:

                @smach.cb_interface(
                    input_keys=["nums", "index"], output_keys=[], outcomes=["odd", "even"]
                )
                def classify(ud):
                    return "odd" if ud.nums[ud.index] % 2 else "even"

                smach.StateMachine.add(
                    "EVEN_OR_ODD", smach.CBState(classify), {"odd": "ODD", "even": "EVEN"}
                )

                @smach.cb_interface(
                    input_keys=["nums", "index", "odd_nums"],
                    output_keys=["odd_nums"],
                    outcomes=["succeeded"],
                )
                def odd(ud):
                    ud.odd_nums.append(ud.nums[ud.index])
                    return "succeeded"

                @smach.cb_interface(
                    input_keys=["nums", "index", "even_nums"],
                    output_keys=["even_nums"],
                    outcomes=["succeeded"],
                )
                def even(ud):
                    ud.even_nums.append(ud.nums[ud.index])
                    return "succeeded"

                smach.StateMachine.add("ODD", smach.CBState(odd), {"succeeded": "continue"})
                smach.StateMachine.add("EVEN", smach.CBState(even), {"succeeded": "continue"})
            smach.Iterator.set_contained_state("CONTAINER", container, loop_outcomes=["continue"])
        smach.StateMachine.add("NUMBERS", numbers, {"succeeded": "succeeded", "aborted": "aborted"})
    assert sm.execute() == "succeeded"
    assert sm.userdata.even_nums == [n for n in range(25, 88, 3) if n % 2 == 0]
    assert sm.userdata.odd_nums == [n for n in range(25, 88, 3) if n % 2]


def test_a_monitor_ends_a_long_action(clock):
    class Long(smach.State):
        def __init__(self):
            smach.State.__init__(self, outcomes=["succeeded", "preempted"])

        def execute(self, userdata):
            for _ in range(1000):
                if self.preempt_requested():
                    self.service_preempt()
                    return "preempted"
                clock.sleep(0.1)
            return "succeeded"

    def monitor(userdata):
        clock.sleep(2.05)
        return "triggered"

    def child_term_cb(outcome_map):
        return outcome_map["MONITOR"] == "triggered"

    def out_cb(outcome_map):
        if outcome_map["MONITOR"] == "triggered" and outcome_map["LONG"] == "preempted":
            return "stopped"
        return None

    cc = smach.Concurrence(
        outcomes=["finished", "stopped"],
        default_outcome="finished",
        child_termination_cb=child_term_cb,
        outcome_cb=out_cb,
    )
    with cc:
        smach.Concurrence.add("LONG", Long())
        smach.Concurrence.add("MONITOR", smach.CBState(monitor, outcomes=["triggered"]))
    sm = smach_ros.StateMachine(outcomes=["end"])
    with sm:
        smach_ros.StateMachine.add("CON", cc, {"finished": "end", "stopped": "end"})
    assert sm.execute() == "end"
    assert clock.now() < 2.2


def test_a_mission_in_a_thread_is_preempted_and_runs_again(clock):
    class Wait(smach.State):
        def __init__(self):
            smach.State.__init__(self, outcomes=["done", "preempted"])

        def execute(self, userdata):
            return "preempted" if self.sleep(60.0) else "done"

    sq = smach.Sequence(outcomes=["done", "preempted"], connector_outcome="done")
    with sq:
        smach.Sequence.add("ONE", Wait())
        smach.Sequence.add("TWO", Wait())
    outcomes = []
    mission = clock.spawn(lambda: outcomes.append(sq.execute()), name="mission")
    clock.sleep(61.0)
    assert sq.get_active_states() == ["TWO"]
    sq.request_preempt()
    mission.join()
    assert outcomes == ["preempted"]
    assert sq.get_active_states() == ["None"]
    assert sq.execute() == "done"


def test_a_sequential_machine_in_the_main_thread_has_no_threads_of_its_own():
    seen = []
    sm = smach.StateMachine(outcomes=["done"])
    with sm:
        smach.StateMachine.add(
            "A",
            smach.CBState(
                lambda ud: seen.append(threading.current_thread()) or "done", outcomes=["done"]
            ),
        )
    before = set(threading.enumerate())
    sm.execute()
    assert seen == [threading.main_thread()]
    assert set(threading.enumerate()) <= before


def test_callbacks_hear_of_a_run_with_smachs_arguments():
    heard = []
    sm = smach.StateMachine(outcomes=["done"])
    with sm:
        smach.StateMachine.add("A", smach.CBState(lambda ud: "on", outcomes=["on"]), {"on": "B"})
        smach.StateMachine.add("B", smach.CBState(lambda ud: "done", outcomes=["done"]))
    sm.register_start_cb(lambda ud, initial, *args: heard.append(("start", initial, args)), [1])
    sm.register_transition_cb(lambda ud, active, *args: heard.append(("step", active, args)), [2])
    sm.register_termination_cb(
        lambda ud, last, outcome, *args: heard.append(("end", last, outcome, args)), [3]
    )
    sm.execute()
    assert heard == [
        ("start", ["A"], (1,)),
        ("step", ["B"], (2,)),
        ("end", ["B"], "done", (3,)),
    ]
