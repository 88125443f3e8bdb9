#!/usr/bin/env python
# -*- coding: latin-1 -*-
import roslib
roslib.load_manifest("old_robot")
import rospy, smach
import types

class Old(smach.State):
  def __init__(self, values = {}):
    smach.State.__init__(self, outcomes = ["ok","ko"])
    self.values = values
  def next(self):
    return 1
  def execute(self, ud):
    keys = self.values.keys(); keys.sort()
    for k in keys: print k, self.values[k],
    print
    total = 0L
    for (a, b) in zip([1, 2], [3, 4]):
      total += a * b
    try:
      raise RuntimeError, 'old'
    except RuntimeError, why:
      rospy.logwarn("caught %s" % why)
    exec "x = 1"
    if type(self.values) == types.DictType and not self.values.has_key("c"):
      return "ok"
    return "ko"

rospy.init_node("old")
sm = smach.StateMachine(outcomes = ["ok", "ko"])
with sm: smach.StateMachine.add("OLD", Old({"b": 2, "a": 1}))
print "done:", sm.execute()
