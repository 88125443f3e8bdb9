#!/usr/bin/env python
# One machine, executed again and again from a loop, with what a topic says in between.
import threading

import rospy
import smach
from std_msgs.msg import Int32, String


class Dialog(object):
    def __init__(self):
        rospy.init_node("dialog", disable_signals=True)
        self.lock = threading.Lock()
        self.heard = threading.Event()
        self.words = []
        self.pub_state = rospy.Publisher("~state", String, queue_size=10)
        self.sub = rospy.Subscriber(
            "speech", String, self.on_speech, callback_args="ear", queue_size=1
        )
        self.say = rospy.Publisher("speech", String, queue_size=5)
        rospy.on_shutdown(self.clean_up)
        self.machine = self.make()

    def on_speech(self, msg, args):
        with self.lock:
            self.words.append((args, msg.data))
        self.heard.set()

    def clean_up(self):
        self.sub.unregister()

    def make(self):
        machine = smach.StateMachine(outcomes=["understood", "bored"], input_keys=["patience"])
        dialog = self

        class Listen(smach.State):
            def __init__(self):
                smach.State.__init__(self, outcomes=["word", "silence"], output_keys=["word"])

            def execute(self, userdata):
                dialog.pub_state.publish(String(data="LISTEN"))
                dialog.heard.wait(1.0)
                with dialog.lock:
                    if not dialog.words:
                        return "silence"
                    userdata.word = dialog.words.pop(0)[1]
                dialog.heard.clear()
                return "word"

        @smach.cb_interface(
            input_keys=["patience"], output_keys=["patience"], outcomes=["ok", "over"]
        )
        def wait(userdata, step=1, limit=0):
            userdata.patience = userdata.patience - step
            return "over" if userdata.patience <= limit else "ok"

        with machine:
            smach.StateMachine.add("LISTEN", Listen(), {"word": "understood", "silence": "WAIT"})
            smach.StateMachine.add(
                "WAIT",
                smach.CBState(wait, cb_kwargs={"step": 2, "limit": 0}),
                {"ok": "LISTEN", "over": "bored"},
            )
        return machine

    def run(self):
        results = []
        while not rospy.is_shutdown() and len(results) < 3:
            self.machine.userdata.patience = 3
            if len(results) == 1:
                self.say.publish("hello")
            results.append(self.machine.execute())
        rospy.loginfo("results: %s", results)
        rospy.signal_shutdown("done")


if __name__ == "__main__":
    Dialog().run()
