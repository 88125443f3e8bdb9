#!/usr/bin/env python
import rospy, smach

ticks = []


def tick(event):
    ticks.append(event.current_real.to_sec())
    assert isinstance(event.last_real, (rospy.Time, type(None)))


class Loop(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"])

    def execute(self, ud):
        rate = rospy.Rate(5)
        begin = rospy.Time.now()
        n = 0
        while not rospy.is_shutdown() and rospy.Time.now() - begin < rospy.Duration.from_sec(2.0):
            n += 1
            rate.sleep()
        rospy.loginfo("%d rounds, %d ticks, %s left", n, len(ticks), rate.remaining().to_sec() >= 0)
        assert 9 <= n <= 11
        return "done"


rospy.init_node("loop")
once = rospy.Timer(rospy.Duration(0.5), tick, oneshot=True)
often = rospy.Timer(rospy.Duration(0.5), tick)
sm = smach.StateMachine(outcomes=["done"])
with sm:
    smach.StateMachine.add("LOOP", Loop())
sm.execute()
often.shutdown()
assert len(ticks) >= 4
