"""`smachpy port`: what comes out is Python, does the same, and what is left is said with its line."""

from __future__ import annotations

import ast
import subprocess
import sys

import pytest

from smachpy.command.targets import load_target
from smachpy.ros1.port import port
from smachpy.ros1.python2 import to_code
from tests.places import ROOT

SCRIPTS = ROOT / "tests" / "ros1_scripts"
OLD = b"""#!/usr/bin/env python
# a comment that stays
import roslib; roslib.load_manifest('x')
import rospy
import smach  # and this one
import smach_ros
from std_srvs.srv import Trigger


class Foo(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=['ok'])

    def execute(self, userdata):
        rospy.loginfo("in %s",   'foo')   # layout stays
        rospy.sleep(0.1)
        return 'ok'


def main():
    rospy.init_node('x')
    sm = smach.StateMachine(outcomes=['ok'])
    with sm:
        smach.StateMachine.add('FOO', Foo())
        inner = smach.Concurrence(outcomes=['ok'], default_outcome='ok')
        with inner:
            smach.Concurrence.add('BAR', Foo())
    print(sm.execute())


if __name__ == '__main__':
    main()
"""


def test_the_new_script_runs_by_itself(tmp_path):
    ported = port(OLD, "old.py")
    script = tmp_path / "new.py"
    script.write_text(ported.text)
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=100, check=True
    )
    assert done.stdout == "ok\n"


def test_what_is_rewritten():
    text = port(OLD, "old.py").text
    assert "# a comment that stays\n" in text
    assert "import roslib" not in text
    assert "import rospy" not in text
    assert "from actionlib_core.interfaces.std_srvs.srv import Trigger\n" in text
    assert "super().__init__(outcomes=['ok'])\n" in text
    assert "logger.info(\"in %s\",   'foo')   # layout stays\n" in text
    assert "self.sleep(0.1)\n" in text
    assert "sm.add('FOO', Foo())\n" in text
    assert "inner.add('BAR', Foo())\n" in text


PROGRAM = """import threading
import rospy
import smach, smach_ros

def main():
    rospy.init_node('x')
    sm = smach.StateMachine(outcomes=['ok'])
    with sm:
        smach.StateMachine.add('A', smach.CBState(lambda ud: 'ok', outcomes=['ok']))
    sis = smach_ros.IntrospectionServer('x', sm, '/SM')
    sis.start()
    {run}

if __name__ == '__main__':
    {call}
"""
IN_A_THREAD = """thread = threading.Thread(target=sm.execute)
    thread.start()
    rospy.spin()
    sm.request_preempt()
    thread.join()
    sis.stop()"""
GUARDED = """try:
        main()
    except rospy.ROSInterruptException:
        pass"""


def test_a_script_that_imports_nothing_else_before_its_function():
    source = "import rospy\nimport smach\n\ndef main():\n    rospy.init_node('x')\n"
    source += "    sm = smach.StateMachine([])\n    sm.execute()\n\nmain()\n"
    text = port(source.encode(), "old.py").text
    ast.parse(text)
    assert text.index("import smachpy") < text.index("@smachpy.mission")


@pytest.mark.parametrize("call", ["main()", GUARDED], ids=["plain", "guarded"])
@pytest.mark.parametrize(
    "run",
    [
        "sm.execute()",
        "outcome = sm.execute()\n    print(outcome)",
        "return sm.execute()",
        IN_A_THREAD,
    ],
    ids=["execute", "printed", "returned", "thread"],
)
def test_a_function_that_executes_its_machine_becomes_a_mission(tmp_path, run, call):
    ported = port(PROGRAM.format(run=run, call=call).encode(), "old.py")
    assert "rospy" not in ported.text
    assert not any("wants a function" in text for _, text in ported.notes)
    script = tmp_path / "new.py"
    script.write_text(ported.text)
    target = load_target(str(script))
    assert list(target.build().get_children()) == ["A"]
    assert target.build().execute() == "ok"


@pytest.mark.parametrize(
    "run",
    [
        "for _ in range(2):\n        sm.execute()",
        "sm.execute()\n    print('again')\n    again(sm)",
        "if not rospy.has_param('x'):\n        return\n    sm.execute()",
        "other = sm\n    sm.execute()\n    other.execute()",
    ],
    ids=["loop", "work after it", "early end", "two runs"],
)
def test_a_function_that_does_more_is_left_to_a_person(run):
    ported = port(PROGRAM.format(run=run, call="main()").encode(), "old.py")
    assert "@smachpy.mission" not in ported.text
    assert "sm.execute()" in ported.text
    assert any("wants a function" in text for _, text in ported.notes)


def test_what_a_person_must_look_at():
    ported = port(b"import rospy\nx = rospy.get_param('~x')\n\nrospy.spin()\n", "old.py")
    assert [line for line, _ in ported.notes] == [1, 2, 4]
    assert "rospy.get_param" in ported.notes[1][1]


def test_names_of_ros_1_that_stay_are_told():
    source = b"import message_filters, rospy, smach\nmessage_filters.Cache()\nsmach.State()\n"
    ((line, text),) = port(source, "old.py").notes
    assert (line, text.partition(" is still")[0]) == (1, "message_filters")


def test_names_that_went_away_since(tmp_path):
    source = """import sys, threading, types, yaml
from types import FunctionType, ListType, StringType as Text
from collections import Mapping
assert isinstance([], ListType) and isinstance('', (Text, types.StringTypes))  # stays
words = ['b', 'a']
words.sort(lambda a, b: cmp(a, b))
assert words == ['a', 'b'] and isinstance({}, Mapping) and isinstance(sys.maxint, int)
assert {'k': yaml.load('1')}.keys()[0] == 'k' and not threading.Thread().isAlive()
assert file(__file__).read().startswith('import')
try:
    raise ValueError('bad')
except ValueError as error:
    assert error.message == 'bad'
print >>sys.stdout, 'done', isinstance(lambda: 0, FunctionType)
"""
    ported = port(source.encode(), "old.py")
    assert "  # stays\n" in ported.text
    script = tmp_path / "new.py"
    script.write_text(ported.text)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert done.stdout == "done True\n"


def test_an_error_with_a_message_of_its_own_keeps_it():
    """`error.message` was an AttributeError in the handler, where a robot is to stop."""
    source = b"""
class Own(Exception):
    def __init__(self):
        self.message = "own"
found = []
for error in (Own(), ValueError("one"), ValueError(), IOError(2, "two")):
    try:
        raise error
    except Exception, e:
        found.append(e.message)
class Message:
    message = "else"
found.append(Message.message)
"""
    made = {}
    exec(to_code(source, "old.py"), made)
    assert made["found"] == ["own", "one", "", "", "else"]


def test_a_script_that_still_uses_rospy_keeps_its_node():
    rest = "import rospy\nrospy.init_node('x')\n"
    for use in ("rospy.spin()\n", "rate = rospy.Rate(10)\n"):
        assert "rospy.init_node('x')" in port((rest + use).encode(), "old.py").text
    ported = port((rest + "rospy.loginfo('hello')\n").encode(), "old.py")
    assert "actionlib_core.init('x')" in ported.text


def test_what_is_python_3_is_not_touched():
    source = "import yaml\nx = yaml.load(f,  Loader=L)\nnames.sort( key = f )\nprint( 'a' , 1 )\n"
    assert port(source.encode(), "new.py").text == source


@pytest.mark.parametrize("source", [b"def f(:\n", b"print 'a' +\n"])
def test_what_is_no_python(source):
    with pytest.raises(SyntaxError):
        port(source, "bad.py")


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(SCRIPTS.glob("*.py*")), ids=lambda path: path.name)
def test_all_scripts_give_python(path):
    ported = port(path.read_bytes(), str(path))
    ast.parse(ported.text)
    again = port(ported.text.encode(), str(path))
    assert again.text.count("import smachpy") <= 2


def test_the_command_writes_no_file_twice(tmp_path):
    from smachpy.command import main

    script, new = tmp_path / "old.py", tmp_path / "new.py"
    script.write_bytes(OLD)
    assert main(["port", str(script), "-o", str(new)]) == 0
    first = new.read_text()
    assert main(["port", str(script), "-o", str(new)]) == 2
    assert new.read_text() == first
    assert main(["port", str(tmp_path / "none.py")]) == 2
    script.write_text("def f(:\n")
    assert main(["port", str(script)]) == 2
