#!/usr/bin/env python
# Callback states with arguments, partials and methods; callbacks of the machine with cb_args.
import functools

import rospy
import smach
from smach import CBState, cb_interface


class Robot(object):
    def __init__(self):
        self.log = []

    @cb_interface(input_keys=["speed"], output_keys=["speed"], outcomes=["ok", "too_fast"])
    def faster(self, ud, step, limit=3):
        ud.speed = ud.speed + step
        self.log.append(ud.speed)
        return "too_fast" if ud.speed > limit else "ok"


robot = Robot()


@cb_interface(outcomes=["ok"])
def say(ud, text, times=1):
    for _ in range(times):
        rospy.loginfo(text)
    return "ok"


def on_transition(userdata, active, *args, **kwargs):
    rospy.loginfo("at %s %s %s", active, args, sorted(kwargs))


def on_start(userdata, initial, *args):
    rospy.loginfo("starts at %s", initial)


def on_end(userdata, terminal, outcome, name):
    rospy.loginfo("%s ended at %s by %s", name, terminal, outcome)


rospy.init_node("callbacks_with_arguments")
smach.set_loggers(rospy.logdebug, rospy.logwarn, rospy.logdebug, rospy.logerr)
sm = smach.StateMachine(outcomes=["done"])
sm.userdata.speed = 0
sm.register_start_cb(on_start, ["x"])
sm.register_transition_cb(on_transition, cb_args=["a"])
sm.register_termination_cb(on_end, cb_args=["sm"])
with sm:
    smach.StateMachine.add("SAY", CBState(say, cb_args=["go"], cb_kwargs={"times": 2}), {"ok": "FAST"})
    smach.StateMachine.add(
        "FAST",
        CBState(functools.partial(Robot.faster, robot), cb_kwargs={"step": 1},
                outcomes=["ok", "too_fast"], input_keys=["speed"], output_keys=["speed"]),
        {"ok": "FAST", "too_fast": "done"},
    )
sm.check_consistency()
assert sorted(sm.get_children()) == ["FAST", "SAY"]
assert sm.get_initial_states() == ["SAY"]
result = sm.execute()
rospy.loginfo("%s %s %s", result, robot.log, sm.get_active_states())
