"""A script's machine without a run: nothing is waited for, sent, written or started."""

import os

import pytest

import smachpy
from smachpy import ros1
from smachpy.testing import MissionKit

HEAD = """
import warnings; warnings.simplefilter('ignore')
import rospy, smach, smach_ros, actionlib, os, subprocess, threading, time
from std_srvs.srv import Trigger
from std_msgs.msg import String
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

def machine():
    sm = smach.StateMachine(outcomes=['done'])
    with sm:
        smach.StateMachine.add('A', smach.CBState(lambda ud: 'done', outcomes=['done']))
    return sm
"""


@pytest.fixture
def load(tmp_path):
    def load(text, **options):
        script = tmp_path / "script.py"
        script.write_text(HEAD + text)
        options.setdefault("timeout", 60)
        return ros1.load(script, **options)

    yield load
    ros1.uninstall()


def test_it_waits_for_nothing_and_does_nothing(load, tmp_path):
    target = tmp_path / "written"
    machine = load(f"""
rospy.init_node('x')
rospy.wait_for_service('nobody')
rospy.ServiceProxy('nobody', Trigger)()
assert rospy.wait_for_message('/nothing', String).data == ''
client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
client.wait_for_server()
assert client.send_goal_and_wait(MoveBaseGoal()) == 3
with open({str(target)!r}, 'w') as file:
    file.write('x')
subprocess.Popen(['touch', {str(target)!r}]).wait()
os.system('touch {target}')
time.sleep(1000)
rospy.sleep(1000)
sm = machine()
sm.execute()
os.mkdir({str(target)!r})
""")
    assert list(machine.get_children()) == ["A"]
    assert not os.path.exists(target)


@pytest.mark.parametrize(
    "end",
    [
        "sm.execute()",
        "rospy.spin()",
        "threading.Thread(target=sm.execute).start(); rospy.spin()",
        "smach_ros.ActionServerWrapper('x', MoveBaseAction, sm).run_server(); rospy.spin()",
        "while not rospy.is_shutdown(): rospy.sleep(0.1)",
        "sm.userdata.x = 1",
    ],
)
def test_the_outermost_machine_is_found(load, end):
    machine = load(f"""
rospy.init_node('x')
inner = machine()
sm = smach.StateMachine(outcomes=['done'])
with sm:
    smach.StateMachine.add('INNER', inner)
other = machine()
{end}
""")
    assert list(machine.get_children()) == ["INNER"]


def test_a_machine_in_the_place_of_one_that_was_freed_is_found(load):
    kept = [smachpy.StateMachine(["done"]) for _ in range(500)]
    for machine in kept:
        machine.itself = machine
    del kept, machine
    machine = load("""
import gc; gc.collect()
made = [smach.StateMachine(['done']) for _ in range(100)]
sm = smach.StateMachine(outcomes=['done'])
with sm:
    for number, each in enumerate(made):
        smach.StateMachine.add('S%d' % number, each)
rospy.spin()
""")
    assert len(machine.get_children()) == 100


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("x = 1", "ended without a machine"),
        ("import sys; sys.exit(3)", "sys.exit(3)"),
        ("rospy.get_param('/nope')", "KeyError"),
        ("import nobody_has_this", "nobody_has_this"),
    ],
)
def test_what_has_no_machine_says_why(load, text, what):
    with pytest.raises(ros1.LoadError) as caught:
        load(text, timeout=60)
    assert what in caught.value.problem


def test_a_script_that_never_gets_there_is_ended(load):
    with pytest.raises(ros1.LoadError) as caught:
        load("while True: pass", timeout=0.5)
    assert caught.value.script.name == "script.py"


def test_stand_ins_and_parameters(load):
    stubbed = []
    machine = load(
        """
from nobody_msgs.msg import DockAction, DockGoal, Place
from nobody_msgs.srv import Open
import nobody_lib
rospy.init_node('x')
place = Place(name='x')
place.pose.x = rospy.get_param('/unset')
goal = DockGoal(place=place)
assert rospy.get_param('/a/b') == 4
sm = smach.StateMachine(outcomes=['done', 'aborted', 'preempted'])
with sm:
    smach.StateMachine.add('DOCK', smach_ros.SimpleActionState('dock', DockAction, goal=goal), {'succeeded': 'OPEN'})
    smach.StateMachine.add('OPEN', smach_ros.ServiceState('open', Open), {'succeeded': 'done'})
    smach.StateMachine.add('LIB', nobody_lib.Grasp(3), {'ok': 'DOCK'})
sm.execute()
""",
        params={"a": {"b": 4}},
        stub_missing=True,
        stubbed=stubbed,
    )
    assert list(machine.get_children()) == ["DOCK", "OPEN", "LIB"]
    assert {"parameter /unset", "module nobody_lib", "module nobody_msgs"} <= set(stubbed)


def test_a_loaded_machine_runs_in_a_test(load):
    with MissionKit() as mission:
        machine = load("""
rospy.init_node('x')
class Wait(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=['done'])
        self.pub = rospy.Publisher('/said', String, queue_size=1)
    def execute(self, ud):
        rospy.sleep(5)
        self.pub.publish('hello')
        return 'done'
sm = smach.StateMachine(outcomes=['done'])
with sm:
    smach.StateMachine.add('WAIT', Wait())
sm.execute()
""")
        run = mission(machine)
    assert run.outcome == "done"
    assert run.duration == pytest.approx(5)


def test_it_joins_no_network(load):
    from actionlib_core.node import has_node

    before = has_node()
    machine = load("""
rospy.init_node('named')
assert rospy.get_name() == '/named' and rospy.resolve_name('~x') == '/named/x'
machine().execute()
""")
    assert machine is not None
    assert has_node() == before
