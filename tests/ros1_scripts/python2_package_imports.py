#!/usr/bin/env python
import rospy, smach
from helpers.places import names
from helpers import places as p
import helpers.rooms

print "known:", names()

class Go(smach.State):
    def __init__(self, where):
        smach.State.__init__(self, outcomes=['there'])
        self.where = where
    def execute(self, ud):
        print >> open('/dev/null', 'w'), self.where
        return 'there'

rospy.init_node('rooms')
sm = smach.StateMachine(outcomes=['there'])
with sm:
    last = None
    for i, room in enumerate(sorted(helpers.rooms.ROOMS.iterkeys())):
        smach.StateMachine.add(room.upper(), Go(room), {'there': 'LAB' if i == 0 else 'there'})
sm.execute()
