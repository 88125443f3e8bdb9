#!/usr/bin/env python
import rospy, smach
import threading
import time

try:
    import queue
except ImportError:
    import Queue as queue
from std_msgs.msg import String

commands = queue.Queue()
ready = threading.Event()
lock = threading.Lock()


class Commands(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["go", "quit"], output_keys=["word"])

    def execute(self, ud):
        ready.set()
        with lock:
            word = commands.get(timeout=10)
        ud.word = word
        return "quit" if word == "quit" else "go"


def talk():
    ready.wait()
    for word in ["left", "right", "quit"]:
        time.sleep(0.5)
        pub.publish(word)


rospy.init_node("commands")
pub = rospy.Publisher("words", String, queue_size=3)
rospy.Subscriber("words", String, lambda msg, args: commands.put(msg.data), callback_args=1)
talker = threading.Thread(target=talk)
talker.daemon = True
talker.start()
sm = smach.StateMachine(outcomes=["over"])
with sm:
    smach.StateMachine.add("LISTEN", Commands(), {"go": "LISTEN", "quit": "over"})
sm.execute()
