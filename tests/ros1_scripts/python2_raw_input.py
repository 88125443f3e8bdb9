#!/usr/bin/env python
import rospy
import smach
import ConfigParser, StringIO, string

def menu(options):
    for i, option in enumerate(options):
        print i, ':', option
    return string.join(map(str, options), ', ')

class Ask(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=['yes', 'no'])
    def execute(self, userdata):
        try:
            answer = raw_input('go? [y/n] ')
        except EOFError, e:
            answer = 'y'
        text = menu(filter(lambda o: o != 'x', ['y', 'n', 'x']))
        if type(text) is unicode or isinstance(text, basestring):
            print u'options: ' + text
        if string.find(answer, 'y') >= 0:
            return 'yes'
        return 'no'

if __name__ == '__main__':
    rospy.init_node('ask')
    sm = smach.StateMachine(outcomes=['yes', 'no'])
    with sm:
        smach.StateMachine.add('ASK', Ask(), transitions={'yes':'yes', 'no':'no'})
    print 'outcome: %s' % sm.execute()
