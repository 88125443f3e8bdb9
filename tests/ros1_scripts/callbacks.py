#!/usr/bin/env python
import rospy, smach

log = []


def start_cb(userdata, initial_states, *args):
    log.append(("start", list(initial_states), args))


def transition_cb(userdata, active_states, *args):
    log.append(("transition", list(active_states)))


def termination_cb(userdata, terminal_states, outcome, *args):
    log.append(("end", list(terminal_states), outcome))


rospy.init_node("callbacks")
sm = smach.StateMachine(outcomes=["done"])
with sm:
    smach.StateMachine.add("A", smach.CBState(lambda ud: "next", outcomes=["next"]), {"next": "B"})
    smach.StateMachine.add("B", smach.CBState(lambda ud: "done", outcomes=["done"]))
sm.register_start_cb(start_cb, cb_args=["x"])
sm.register_transition_cb(transition_cb)
sm.register_termination_cb(termination_cb)
sm.execute()
assert log == [("start", ["A"], ("x",)), ("transition", ["B"]), ("end", ["B"], "done")], log
