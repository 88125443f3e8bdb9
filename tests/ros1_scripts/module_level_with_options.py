#!/usr/bin/env python
# Everything at module level, options by optparse and argparse, a signal handler, a log of its own.
import argparse
import logging
import optparse
import os
import signal
import sys

import rospkg
import rospy
import smach
import yaml

parser = argparse.ArgumentParser(description="patrol")
parser.add_argument("--rounds", type=int, default=2)
parser.add_argument("-v", dest="verbose", action="store_true")
args, unknown = parser.parse_known_args(rospy.myargv(argv=sys.argv)[1:])

old = optparse.OptionParser()
old.add_option("-n", type="int", default=1)
options, rest = old.parse_args(rospy.myargv()[1:])

rospy.init_node("patrol_%s" % os.path.splitext(os.path.basename(__file__))[0], argv=sys.argv)
logging.getLogger("rosout").setLevel(logging.ERROR)
logger = logging.getLogger("patrol")
places = yaml.safe_load("{dock: [0, 0], desk: [1.5, 2]}")
rounds = rospy.get_param("~rounds", args.rounds)
rospy.set_param("~places", places)


def handler(signum, frame):
    rospy.loginfo("signal")
    sm.request_preempt()


class Visit(smach.State):
    outcomes = ["arrived", "over"]

    def __init__(self, name):
        smach.State.__init__(self, outcomes=self.outcomes, io_keys=["left"])
        self.place = rospy.get_param("~places/" + name)

    def execute(self, ud):
        ud.left -= 1
        logger.info("at %s", self.place)
        return Visit.outcomes[ud.left < 0]


sm = smach.StateMachine(outcomes=["finished"])
sm.userdata.left = rounds * len(places)
with sm:
    names = sorted(places)
    for here, there in zip(names, names[1:] + names[:1]):
        sm.add(here.upper(), Visit(here), {"arrived": there.upper(), "over": "finished"})
sm.set_initial_state([names[0].upper()])
signal.signal(signal.SIGINT, handler)
print(sm.execute())
