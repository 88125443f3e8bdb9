"""A script's machine without a run: nothing is waited for, sent, written or started."""

import os

import pytest

import smachpy
from smachpy import ros1
from smachpy.base import slips
from smachpy.checks import check
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
assert subprocess.check_output(['ls']).split('\\n') == ['']
assert subprocess.check_output(['ls']).decode('utf-8') == ''
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_script_that_never_gets_there_is_ended(load):
    with pytest.raises(ros1.LoadError) as caught:
        load("while True: pass", timeout=0.5)
    assert caught.value.script.name == "script.py"
    assert caught.value.problem == "it built no machine in 0.5 s. Try --timeout SECONDS."


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


def test_stand_ins_have_every_field_and_every_name_of_a_star_import(load):
    machine = load(
        """
from nobody_msgs.msg import *
from nobody_msgs.srv import Find
import nobody_lib, sensor_msgs.nobody
rospy.init_node('x')
sm = smach.StateMachine(outcomes=['succeeded', 'aborted', 'preempted'])
sm.userdata.tool = nobody_lib.Tool()
smach_ros.IntrospectionServer('x', sm, '/SM').start()
sm.userdata.pose = sm.userdata.thing = 1
with sm:
    smach.StateMachine.add(
        'FIND',
        smach_ros.ServiceState('find', Find, request_slots=['thing'], response_slots=['pose']),
        {'succeeded': 'GRASP'})
    smach.StateMachine.add(
        'GRASP',
        smach_ros.SimpleActionState('grasp', GraspAction, goal_slots=['pose'], result_slots=['ok']),
        {'succeeded': 'PLACE'})
    smach.StateMachine.add(
        'PLACE', smach_ros.SimpleActionState('place', PlaceAction, goal=PlaceGoal(pose=3)))
sm.execute()
""",
        stub_missing=True,
    )
    assert list(machine.get_children()) == ["FIND", "GRASP", "PLACE"]


@pytest.fixture
def robot(tmp_path):
    """Return a script's path, in a package with an action that uses a type of nobody."""
    package = tmp_path / "robot"
    (package / "action").mkdir(parents=True)
    (package / "package.xml").write_text("<name>robot</name>")
    (package / "action" / "Grasp.action").write_text(
        "int8 n\n---\nnobody_msgs/Code code\n---\nnobody_msgs/Code code\nother_msgs/Other other\n"
    )
    (package / "lib").mkdir()
    (package / "lib" / "told.py").write_text("def tell():\n    print 'told'\n    return gone\n")
    script = package / "script.py"
    yield script
    ros1.uninstall()


ACTION = (
    HEAD
    + """
from robot.msg import GraspAction, GraspGoal
sm = smach.StateMachine(outcomes=['succeeded', 'aborted', 'preempted'])
with sm:
    sm.add('GRASP', smach_ros.SimpleActionState('grasp', GraspAction, goal=GraspGoal(n=3)))
sm.execute()
"""
)


def test_missing_parameters_name_topics_services_and_the_node(robot):
    robot.write_text(
        """
import rospy, smach
from std_msgs.msg import Bool
from std_srvs.srv import Empty
import nobody_lib
from nobody_heads import Tilt
rospy.init_node(rospy.get_param('~name'))
rospy.Publisher(nobody_lib.join('a', 'b'), Bool, queue_size=1)
assert '/' + rospy.get_param('~robot') + '/' + nobody_lib.part() == '/robot/part'
Tilt.Tilt(3).go()
rospy.Publisher(rospy.get_param('~out'), Bool, queue_size=1)
rospy.Subscriber(rospy.get_param('~in') + '/raw', Bool)
rospy.ServiceProxy(rospy.get_param('~service'), Empty)
sm = smach.StateMachine(outcomes=['done'])
with sm:
    smach.StateMachine.add('A', smach.CBState(lambda _: 'done', outcomes=['done']))
sm.execute()
"""
    )
    assert list(ros1.load(robot, stub_missing=True).get_children()) == ["A"]


@pytest.mark.slow
def test_what_nobody_has_gives_constants_folders_and_keys(robot):
    robot.write_text("""
import warnings; warnings.simplefilter('ignore')
import rospkg, rospy, smach, nobody_lib
from nobody_msgs.msg import LookGoal, Place
from nobody_msgs.srv import Ask
assert str(LookGoal.FAR) == 'FAR' and Place.HIGH and Ask.ANY
assert rospkg.RosPack().get_path('nobody_models').endswith('/nobody_models')

class Show(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=['done'], input_keys=['seen'])

    def execute(self, userdata):
        rospy.loginfo(userdata.seen)
        return 'done'

sm = smach.StateMachine(outcomes=['done'])
with sm:
    smach.StateMachine.add('LOOK', nobody_lib.look(), {'seen': 'SHOW'})
    smach.StateMachine.add('SHOW', Show())
sm.execute()
""")
    stubbed = []
    machine = ros1.load(robot, stub_missing=True, stubbed=stubbed)
    assert "package nobody_models" in stubbed
    assert not [problem for problem in check(machine).problems if problem.severity == "error"]


def test_an_action_with_a_type_of_nobody(robot):
    robot.write_text(ACTION)
    with pytest.raises(ros1.LoadError, match=r"(?s)nobody_msgs/Code.*--stub-missing"):
        ros1.load(robot)
    ros1.uninstall()
    assert list(ros1.load(robot, stub_missing=True).get_children()) == ["GRASP"]


def test_modules_of_added_folders_may_be_python_2_and_errors_name_their_line(robot):
    robot.write_text(
        "import os, sys\n"
        "sys.path.append(os.path.join(os.path.dirname(__file__), 'lib'))\n"
        "import told\n"
        "told.tell()\n"
    )
    with pytest.raises(ros1.LoadError, match=r"lib.told\.py:3: NameError: name 'gone'"):
        ros1.load(robot)


def test_what_python_2_or_an_old_numpy_took(load):
    machine = load("""
import numpy as np
np.set_printoptions(threshold=np.nan)
COUNT = 0

def count(ud):
    if COUNT < 3:
        global COUNT
        COUNT += 1
        return 'again'
    def inner():
        return COUNT
    return 'done' if inner() == 3 else 'wrong'

sm = smach.StateMachine(outcomes=['done'])
with sm:
    sm.add('COUNT', smach.CBState(count, outcomes=['again', 'done']), {'again': 'COUNT'})
sm.execute()
""")
    assert machine.execute() == "done"


def test_a_name_that_a_bundled_package_lacks(load):
    with pytest.raises(ros1.LoadError, match=r"(?s)QueryNothing.*FOLDER/std_srvs/srv"):
        load("from std_srvs.srv import QueryNothing\n")


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


@pytest.mark.parametrize(
    "text", ["actionlib.SimpleActionServer('a', MoveBaseAction, len, False)", ""]
)
def test_a_script_that_only_serves_is_said_to_spin(load, text):
    with pytest.raises(ros1.LoadError) as caught:
        load(f"rospy.init_node('x')\n{text}\nrospy.spin()\n")
    assert caught.value.problem == (
        "it ended without a machine: got a call of spin(); expected a machine. It only serves others."
    )


def test_a_state_whose_base_was_not_initialised_is_drawn_with_a_warning(load):
    machine = load("""
class Watch(smach_ros.MonitorState):
    def __init__(self):
        smach.State.__init__(self, outcomes=['valid', 'invalid', 'preempted'])
sm = smach.StateMachine(outcomes=['done'])
with sm:
    sm.add('W', Watch(), {'valid': 'done', 'invalid': 'done', 'preempted': 'done'})
sm.execute()
""")
    with pytest.warns(slips.SlipWarning, match=r"did not call MonitorState\.__init__"):
        assert smachpy.describe(machine).children[0].outcomes == ("valid", "invalid", "preempted")
