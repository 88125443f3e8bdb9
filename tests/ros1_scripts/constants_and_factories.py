#! /usr/bin/env python
# vim: expandtab ts=4 sw=4
# Outcomes as constants, containers as classes whose states depend on arguments, module level lists.
import random

import rospy
import smach

succeeded, preempted, aborted = "succeeded", "preempted", "aborted"
ALL = [succeeded, preempted, aborted]
ENDS = dict((o, o) for o in ALL)
DEBUG = False


class Say(smach.State):
    def __init__(self, text=None, text_cb=None, **kwargs):
        keys = kwargs.pop("input_keys", [])
        smach.State.__init__(self, ALL, input_keys=keys, **kwargs)
        self.text, self.text_cb = text, text_cb

    def execute(self, ud):
        text = self.text_cb(ud) if self.text_cb else self.text
        rospy.loginfo_throttle(1, text)
        return succeeded if text else aborted


class Ask(smach.StateMachine):
    def __init__(self, kind="restaurant", tries=2):
        smach.StateMachine.__init__(self, ALL, output_keys=["order"])
        self.userdata.tries = tries
        self.userdata.order = None
        with self:
            if kind == "restaurant":
                smach.StateMachine.add(
                    "ASK", Say("What would you like?"), transitions={succeeded: "HEAR"}
                )
            else:
                smach.StateMachine.add(
                    "ASK", Say("Where do we go?"), transitions={succeeded: "HEAR"}
                )

            @smach.cb_interface(
                input_keys=["tries"],
                output_keys=["tries", "order"],
                outcomes=[succeeded, aborted, "again"],
            )
            def hear(ud):
                if ud.tries:
                    ud.tries -= 1
                    return "again"
                ud.order = random.choice(["tea"])
                return succeeded

            smach.StateMachine.add(
                "HEAR", smach.CBState(hear), transitions={"again": "ASK", aborted: aborted}
            )


class Dinner(smach.StateMachine):
    def __init__(self, guests):
        super(Dinner, self).__init__(outcomes=ALL)
        labels = ["GUEST_%s" % g.upper() for g in guests]
        with self:
            for label, following in zip(labels, labels[1:] + ["BYE"]):
                smach.StateMachine.add(
                    label, Ask(tries=len(label) % 3), {succeeded: "SERVE_" + label}
                )
                smach.StateMachine.add(
                    "SERVE_" + label,
                    Say(
                        text_cb=lambda ud, who=label: "%s: %s" % (who, ud.order),
                        input_keys=["order"],
                    ),
                    transitions=dict(ENDS, **{succeeded: following}),
                )
            smach.StateMachine.add("BYE", Say("Good bye"), transitions=ENDS)


if __name__ == "__main__":
    rospy.init_node("dinner", log_level=rospy.DEBUG if DEBUG else rospy.INFO)
    sm = Dinner(["ann", "bob"])
    outcome = sm.execute()
    if outcome not in (succeeded,):
        raise SystemExit(3)
