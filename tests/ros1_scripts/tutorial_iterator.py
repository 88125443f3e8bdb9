#!/usr/bin/env python
# The iterator tutorial, with its lists that a state changes though it only reads them.
import rospy
import smach
from smach import Iterator, StateMachine, CBState
from smach_ros import ConditionState, IntrospectionServer


def construct_sm():
    sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"])
    sm.userdata.nums = range(25, 88, 3)
    sm.userdata.even_nums = []
    sm.userdata.odd_nums = []
    with sm:
        tutorial_it = Iterator(
            outcomes=["succeeded", "preempted", "aborted"],
            input_keys=["nums", "even_nums", "odd_nums"],
            it=lambda: range(0, len(sm.userdata.nums)),
            output_keys=["even_nums", "odd_nums"],
            it_label="index",
            exhausted_outcome="succeeded",
        )
        with tutorial_it:
            container_sm = StateMachine(
                outcomes=["succeeded", "preempted", "aborted", "continue"],
                input_keys=["nums", "index", "even_nums", "odd_nums"],
                output_keys=["even_nums", "odd_nums"],
            )
            with container_sm:
                StateMachine.add(
                    "EVEN_OR_ODD",
                    ConditionState(
                        cond_cb=lambda userdata: userdata.nums[userdata.index] % 2,
                        input_keys=["nums", "index"],
                    ),
                    {"true": "ODD", "false": "EVEN"},
                )

                @smach.cb_interface(
                    input_keys=["nums", "index", "even_nums"],
                    output_keys=["odd_nums"],
                    outcomes=["succeeded"],
                )
                def even_cb(ud):
                    ud.even_nums.append(ud.nums[ud.index])
                    return "succeeded"

                StateMachine.add("EVEN", CBState(even_cb), {"succeeded": "continue"})

                @smach.cb_interface(
                    input_keys=["nums", "index", "odd_nums"],
                    output_keys=["odd_nums"],
                    outcomes=["succeeded"],
                )
                def odd_cb(ud):
                    ud.odd_nums.append(ud.nums[ud.index])
                    return "succeeded"

                StateMachine.add("ODD", CBState(odd_cb), {"succeeded": "continue"})
            Iterator.set_contained_state(
                "CONTAINER_STATE", container_sm, loop_outcomes=["continue"]
            )
        StateMachine.add(
            "TUTORIAL_IT", tutorial_it, {"succeeded": "succeeded", "aborted": "aborted"}
        )
    return sm


def main():
    rospy.init_node("iterator_tutorial")
    sm_iterator = construct_sm()
    intro_server = IntrospectionServer("iterator_tutorial", sm_iterator, "/ITERATOR_TUTORIAL")
    intro_server.start()
    outcome = sm_iterator.execute()
    rospy.loginfo("even: %s", sm_iterator.userdata.even_nums)
    assert len(sm_iterator.userdata.even_nums) + len(sm_iterator.userdata.odd_nums) == 21
    rospy.spin()
    intro_server.stop()


if __name__ == "__main__":
    main()
