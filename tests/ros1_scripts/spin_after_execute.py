#!/usr/bin/env python
import rospy
import smach
import smach_ros


class Foo(smach.State):
    def __init__(self):
        super(Foo, self).__init__(outcomes=["succeeded"])

    def execute(self, userdata):
        return "succeeded"


def main():
    rospy.init_node("spinner")
    sm = smach.StateMachine(outcomes=["succeeded"])
    with sm:
        smach.StateMachine.add("FOO", Foo())
    sis = smach_ros.IntrospectionServer("spinner", sm, "/SM_ROOT")
    sis.start()
    sm.execute()
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
    sis.stop()


if __name__ == "__main__":
    main()
