"""A stand-in fits wherever a script passes it: to every parameter of every class and function."""

from __future__ import annotations

import pytest

from smachpy import ros1

HEAD = """
import warnings; warnings.simplefilter('ignore')
import inspect, itertools, types
import actionlib, rospy, smach, smach_ros, tf, tf2_ros, message_filters
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nobody import Kind, thing
from std_msgs.msg import String
from std_srvs.srv import Trigger
rospy.init_node('x')

class A(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=['ok'], input_keys=['a'], output_keys=['b'])

    def execute(self, ud):
        return 'ok'

def machine():
    sm = smach.StateMachine(outcomes=['ok'])
    with sm:
        smach.StateMachine.add('A', A())
    return sm
"""

EVERY_PARAMETER = (
    HEAD
    + """
def f(*args):
    return 'ok'

VALUES = dict(
    outcomes=['ok'], cb=f, callback=f, cond_cb=f, default_outcome='ok', it=[1, 2], it_label='i',
    input_keys=['a'], output_keys=['b'], action_spec=MoveBaseAction, ActionSpec=MoveBaseAction,
    service_spec=Trigger, service_class=Trigger, msg_type=String, data_class=String, handler=f,
    topic_type=String, period=1.0, hz=10, label='B', connector_outcome='ok', loop_outcomes=['ok'],
    connector_outcomes=['ok'], initial_states=['A'], path='/SM', new_outcomes=['o'], keys=['k'],
    items=[1], param_name='p', param_value=1, h=f, duration=1.0, state=A(),
    wrapped_container=machine(), buffer=tf2_ros.Buffer(),
)
NAMES = ('name', 'ns', 'server_name', 'service_name', 'action_name', 'topic', 'service')
number = itertools.count()
found = []

def attempt(what, make, function):
    parameters = [
        p for p in inspect.signature(function).parameters.values()
        if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and p.name != 'self'
    ]
    for chosen in parameters:
        for stand_in in (thing, Kind, thing.all['x']):
            given = {p.name: VALUES.get(p.name) for p in parameters if p.default is p.empty}
            given.update((n, 'n%d' % next(number)) for n in NAMES if n in given)
            if what == 'IntrospectionServer':
                given['state'] = machine()
            given[chosen.name] = stand_in
            try:
                made = make(**given)
                for end in ('stop', 'unregister', 'shutdown'):
                    if hasattr(made, end) and not isinstance(made, type(thing)):
                        getattr(made, end)()
            except SystemExit:
                pass
            except Exception as error:
                found.append('%s(%s=%r): %s: %s' % (what, chosen.name, stand_in, type(error), error))

def concurrence():
    made = smach.Concurrence(['ok'], 'ok')
    with made:
        smach.Concurrence.add('A', A())
    return made

CONTAINERS = {
    smach.StateMachine: machine,
    smach.Concurrence: concurrence,
    smach.Iterator: lambda: smach.Iterator(['ok'], ['a'], ['b'], [1], 'i', 'ok'),
    smach.Sequence: lambda: smach.Sequence(['ok'], 'ok'),
    smach.State: A,
}
METHODS = (
    'add', 'add_auto', 'set_contained_state', 'set_initial_state', 'set_iteritems',
    'register_outcomes', 'register_input_keys', 'register_output_keys', 'register_io_keys',
)
for module in (smach, smach_ros, actionlib, rospy, tf, tf2_ros, message_filters):
    for name in module.__all__ if hasattr(module, '__all__') else dir(module):
        value = getattr(module, name)
        if name.startswith(('_', 'log')) or not getattr(value, '__module__', '').startswith(
            ('smachpy', 'actionlib_core')
        ):
            continue
        if isinstance(value, type) and name in CLASSES:
            attempt(name, value, value.__init__)
        elif isinstance(value, types.FunctionType) and module is rospy and name not in NO_CALL:
            attempt('rospy.' + name, value, value)
for kind, make in CONTAINERS.items():
    for name in METHODS:
        if name in vars(kind):
            method = getattr(make(), name)
            attempt(kind.__name__ + '.' + name, lambda **g: getattr(make(), name)(**g), method)
assert next(number) > 300, 'too few attempts'
if found:
    raise RuntimeError('\\n'.join(found))
machine().execute()
"""
)

CLASSES = (
    *("State", "CBState", "StateMachine", "Concurrence", "Iterator", "Sequence", "ActionServer"),
    *("SimpleActionState", "ServiceState", "MonitorState", "ConditionState", "ActionClient"),
    *("ActionServerWrapper", "IntrospectionServer", "SimpleActionClient", "SimpleActionServer"),
    *("Publisher", "Subscriber", "Service", "ServiceProxy", "Timer", "Rate", "Duration", "Time"),
    *("TransformListener", "Buffer"),
)
# They end the program, or need what a stand-in cannot be: a parameter that exists.
NO_CALL = ("get_master", "init_node", "spin", "signal_shutdown", "delete_param")


@pytest.fixture
def load(tmp_path):
    def load(text, **options):
        script = tmp_path / "script.py"
        script.write_text(text)
        return ros1.load(script, stub_missing=True, timeout=100, **options)

    yield load
    ros1.uninstall()


@pytest.mark.slow
def test_every_parameter_of_every_class_and_function_takes_a_stand_in(load):
    names = f"CLASSES, NO_CALL = {CLASSES}, {NO_CALL}\n"
    text = EVERY_PARAMETER.replace("number = ", f"{names}number = ")
    assert list(load(text).get_children()) == ["A"]


USES = {
    "goal": "smach_ros.SimpleActionState('go', MoveBaseAction, goal=thing('kitchen'))",
    "action": "smach_ros.SimpleActionState('go', Kind, goal=MoveBaseGoal(), goal_slots=['x'])",
    "request": "smach_ros.ServiceState('fill', Fill, request=100)",
    "outcomes": "smach.CBState(lambda ud: 'ok', outcomes=[thing.OK, 'ok'])",
    "slots": "smach_ros.ServiceState(thing.NAME, Kind, request_slots=[thing.A])",
    "keys": "smach.CBState(lambda ud: 'ok', outcomes=['ok'], input_keys=thing.KEYS)",
    "timeout": "smach_ros.MonitorState(thing.TOPIC, Kind, thing.check, thing.COUNT)",
}


@pytest.mark.parametrize("use", USES)
def test_a_state_takes_stand_ins(load, use):
    machine = load(f"""{HEAD}
from nobody_msgs.srv import Fill
sm = smach.StateMachine(outcomes=['done'])
with sm:
    sm.add('GO', {USES[use]}, {{'ok': 'done', thing.OUT: thing.LABEL}}, remapping=thing.KEYS)
sm.execute()
""")
    assert list(machine.get_children()) == ["GO"]


def test_a_wrapper_takes_fields_of_an_action_of_nobody(load):
    machine = load(f"""{HEAD}
from nobody_msgs.msg import TidyAction
smach_ros.ActionServerWrapper(
    'tidy', TidyAction, machine(), ['ok'], goal_slots_map={{'room': 'room'}},
    result_slots_map={{'seen': 'b'}}).run_server()
""")
    assert list(machine.get_children()) == ["A"]


@pytest.mark.parametrize(
    "end",
    [
        "smach_ros.ActionServerWrapper('tidy', MoveBaseAction, thing, ['ok'], ['no']).run_server()",
        "smach_ros.ActionServerWrapper('tidy', MoveBaseAction, Kind()).run_server()",
    ],
)
def test_a_machine_that_is_a_stand_in_is_named(load, end):
    with pytest.raises(ros1.LoadError, match=r"stand-in.*expected a machine.*module nobody"):
        load(HEAD + end)


def test_a_script_whose_only_machine_is_missing_says_what_may_hold_it(load):
    with pytest.raises(ros1.LoadError, match=r"got a call of spin\(\).*may be in.*module nobody"):
        load(HEAD + "thing.run()\nrospy.spin()\n")


def test_a_second_star_import_leaves_a_usable_action(load):
    machine = load("""
import smach, smach_ros
from nobody_tools import *
from nobody_msgs.msg import *
sm = smach.StateMachine(outcomes=['succeeded', 'aborted', 'preempted'])
with sm:
    sm.add('GO', smach_ros.SimpleActionState('go', GoAction, goal=GoGoal(x=3)))
sm.execute()
""")
    assert list(machine.get_children()) == ["GO"]


def test_stand_ins_are_exceptions_and_enumerations(load):
    machine = load(f"""{HEAD}
from nobody import GraspError, NobodyException
for exception in (GraspError('x'), NobodyException):
    try:
        raise exception
    except (GraspError, NobodyException) as error:
        caught = error
assert not list(Kind) and Kind['RED'] and Kind.RED and len(Kind) == 0
assert str(thing.all[3].items) == 'items'
machine().execute()
""")
    assert list(machine.get_children()) == ["A"]


def test_a_file_with_many_star_imports_is_read_once(load, monkeypatch):
    from smachpy.ros1 import stubs

    reads = []
    real = stubs.to_tree
    monkeypatch.setattr(stubs, "to_tree", lambda *args: reads.append(args[1]) or real(*args))
    imports = "".join(f"from nobody{i}_msgs.msg import *\n" for i in range(20))
    load(HEAD.replace("rospy.init_node", f"{imports}rospy.init_node") + "machine().execute()\n")
    assert len(reads) == 1


def test_uninstall_gives_the_classes_back(tmp_path):
    import smachpy

    before = {
        kind: dict(vars(kind))
        for kind in (smachpy.State, smachpy.StateMachine, smachpy.SimpleActionState)
    }
    with ros1.installed(tmp_path / "script.py", stub_missing=True):
        import smach

        assert smach.StateMachine is smachpy.StateMachine
        ros1.install(tmp_path / "other.py", stub_missing=True)
        ros1.install(tmp_path / "other.py")
    for kind, members in before.items():
        assert dict(vars(kind)) == members
