#!/usr/bin/env python
# -*- coding: utf-8 -*-
import rospy, smach
import sys, Queue
from helpers import places   # a neighbour, imported the old way

class Ask(smach.State):
	def __init__(self):
		smach.State.__init__(self, outcomes=['yes','no'])
	def execute(self, ud):
		try:
			answers = {'a': 1, 'b': 2}
			for k, v in answers.iteritems():
				print "%s is" % k, v
			if answers.has_key('a') and 1 <> 2:
			        print >>sys.stderr, "mixed tabs and spaces"
			raise ValueError, "on purpose"
		except ValueError, e:
			print `e`, 0777, 10L, u"text"
		q = Queue.Queue()
		q.put(reduce(lambda a, b: a + b, map(int, xrange(4))))
		return 'yes' if q.get() == 6 else 'no'

def both((x, y)):
	return x + y

def main():
	rospy.init_node('python2')
	sm = smach.StateMachine(['yes','no'])
	with sm:
		smach.StateMachine.add('ASK', Ask())
	assert both((1, 2)) == 3
	assert places.names() == ['kitchen', 'lab']
	print sm.execute()

if __name__ == '__main__':
	main()
