"""Every script of tests/ros1_scripts runs, draws and checks as it is."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.places import ROOT

SCRIPTS = ROOT / "tests" / "ros1_scripts"
NAMES = sorted(f"{path.stem}.py" for path in SCRIPTS.glob("*.py*") if path.is_file())
EXIT_CODES = {"serves_for_ever.py": 1}  # its end is a preempt


@pytest.fixture(scope="module")
def smachpy():
    """Return a function that runs the command and returns its exit code and output."""
    environment = {**os.environ, "PYTHONWARNINGS": "default", "COLUMNS": "200"}
    environment.pop("SMACHPY_INTERFACE_PATH", None)
    process = subprocess.Popen(
        [sys.executable, Path(__file__).with_name("forking.py")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )

    def run(*words):
        process.stdin.write(json.dumps([*map(str, words)]) + "\n")
        process.stdin.flush()
        answer = json.loads(process.stdout.readline())
        return answer["code"], answer["output"]

    yield run
    process.stdin.close()
    process.wait(60)
    process.stdout.close()


def test_there_are_enough():
    assert len(NAMES) >= 60


def test_private_parameters_stand_where_rosrun_has_them(smachpy, tmp_path):
    script = tmp_path / "rounds.py"
    script.write_text(
        "import rospy\n"
        "rospy.init_node('rounds')\n"
        "print(rospy.get_param('~rounds'), rospy.get_param('~place'), rospy.myargv()[1:])\n"
    )
    words = ("_rounds:=3", "--time", "virtual", "_place:=[1, 2]", "--", "mine", "a:=b")
    code, output = smachpy("run", "--ros1", script, *words)
    assert code == 0, output
    assert "3 [1, 2] ['mine']" in output


@pytest.mark.slow  # real time: joins a network
@pytest.mark.parametrize("time", ["real", "virtual"])
@pytest.mark.parametrize("before", ["", "rospy.Publisher('/early', String, queue_size=1)\n"])
@pytest.mark.parametrize("words", [(), ("a:=b",)])
def test_init_node_names_the_node_however_early_the_network_is_used(
    smachpy, tmp_path, time, before, words
):
    script = tmp_path / "late.py"
    script.write_text(
        f"import rospy\nfrom std_msgs.msg import String\n{before}"
        "rospy.init_node('my_node')\n"
        "private = rospy.Publisher('~out', String, queue_size=1)\n"
        "print(rospy.get_name(), private.name, rospy.get_param('~speed', 'the default'))\n"
    )
    params = tmp_path / "params.yaml"
    params.write_text("my_node: {speed: 3}\n")
    code, output = smachpy("run", "--ros1", script, "--time", time, "--params", params, *words)
    assert code == 0, output
    assert "/my_node /my_node/out 3" in output


def test_private_names_are_remapped(smachpy, tmp_path):
    script = tmp_path / "private.py"
    script.write_text(
        "import rospy\nrospy.init_node('private')\n"
        "print(rospy.resolve_name('~image'), rospy.resolve_name('~other'))\n"
    )
    words = ("--time", "virtual", "~image:=/camera/image")
    code, output = smachpy("run", "--ros1", script, *words)
    assert code == 0, output
    assert "/camera/image /private/other" in output


def test_what_is_missing_has_stand_ins_in_a_run_too(smachpy, tmp_path):
    script = tmp_path / "explored.py"
    script.write_text(
        "import rospy, smach, nobody_names\n"
        "from nobody_msgs.msg import Battery\n"
        "from nobody_msgs.srv import Ask\n"
        "def ask(ud):\n"
        "    message = Ask()\n"
        "    message.client_name = 'explorer'\n"
        "    return 'done' if message.client_name == 'explorer' else 'not'\n"
        "rospy.init_node('explored')\n"
        "rospy.Subscriber(nobody_names.BATTERY, Battery, print)\n"
        "speed = rospy.get_param('~speed')\n"
        "sm = smach.StateMachine(outcomes=['done'])\n"
        "with sm:\n"
        "    sm.add('ASK', smach.CBState(ask, outcomes=['done']))\n"
        "sm.execute()\n"
    )
    code, output = smachpy("run", "--ros1", script, "--stub-missing", "--time", "virtual")
    assert "SM_ROOT  ended: done" in output, output
    assert "parameter /explored/speed" in output
    code, output = smachpy("run", "--ros1", script, "--time", "virtual")
    assert code == 1
    assert "module 'nobody_names' is missing" in output


def test_scripts_are_drawn_and_checked_with_their_arguments(smachpy, tmp_path):
    script = tmp_path / "to_place.py"
    script.write_text(
        "import rospy, smach, sys\n"
        "if len(rospy.myargv()) < 2: sys.exit('where to?')\n"
        "rospy.init_node('to_place')\n"
        "label = f'{rospy.myargv()[1]}_{rospy.get_param(\"~n\")}'\n"
        "sm = smach.StateMachine(['ok'])\n"
        "with sm:\n"
        "    sm.add(label, smach.CBState(lambda _ud: 'ok', outcomes=['ok']), {'ok': 'ok'})\n"
        "sm.execute()\n"
    )
    picture = tmp_path / "machine.json"
    code, output = smachpy("render", "--ros1", script, "-o", picture, "_n:=3", "--", "desk")
    assert code == 0, output
    assert "desk_3" in picture.read_text()
    assert smachpy("check", "--ros1", script, "--", "desk", "_n:=3")[0] == 0
    assert smachpy("check", "patrol", "--", "desk")[0] == 2


@pytest.mark.parametrize("value", ["None", "object()"])
def test_a_state_that_returns_no_text_is_told_and_shown(smachpy, tmp_path, value):
    script = tmp_path / "forgets.py"
    script.write_text(
        "import rospy, smach, smach_ros\n"
        "class Forgets(smach.State):\n"
        "    def __init__(self):\n"
        "        smach.State.__init__(self, outcomes=['ok'])\n"
        "    def execute(self, userdata):\n"
        f"        return {value}\n"
        "rospy.init_node('forgets')\n"
        "sm = smach.StateMachine(['ok'])\n"
        "with sm:\n"
        "    smach.StateMachine.add('A', Forgets())\n"
        "server = smach_ros.IntrospectionServer('forgets', sm, '/SM')\n"
        "server.start()\n"
        "sm.execute()\n"
    )
    code, output = smachpy("run", "--ros1", script, "--time", "virtual", "--plain")
    assert code == 1, output
    assert "unknown outcome: got " in output, output
    assert "Traceback" not in output, output


def test_the_simulated_robot_has_the_name_that_the_command_line_gives(smachpy, scripts):
    words = ("--time", "virtual", "--plain", "move_base:=robot_1/move_base")
    code, output = smachpy("run", "--ros1", scripts / "move_base_client.py", *words)
    assert code == 0, output


def test_who_waits_for_what_nobody_offers(smachpy, tmp_path):
    script = tmp_path / "waits.py"
    script.write_text("import rospy\nrospy.init_node('waits')\nrospy.wait_for_service('/nobody')\n")
    code, output = smachpy("run", "--ros1", script, "--time", "virtual", "--plain")
    assert code == 2, output
    assert "MainThread: waits for service '/nobody'" in output, output


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", NAMES)
def test_runs_renders_and_checks(name, scripts, smachpy, tmp_path):
    script = scripts / name
    code, output = smachpy("run", "--ros1", script, "--time", "virtual", "--plain")
    assert code == EXIT_CODES.get(name, 0), output
    assert "ended: " in output, output
    picture = tmp_path / "machine.json"
    code, output = smachpy("render", "--ros1", script, "-o", picture)
    assert code == 0, output
    assert picture.stat().st_size > 0
    code, output = smachpy("check", "--ros1", script, "--format", "json")
    assert code in {0, 1}, output
    assert '"severity": "error"' not in output, output


def test_a_machine_that_is_filled_later_is_ignored_with_the_reason(smachpy, tmp_path):
    script = tmp_path / "later.py"
    script.write_text(
        "import rospy, smach\n"
        "sm = smach.StateMachine(outcomes=['done'])\n"
        "rospy.init_node('later')\n"
        "rospy.spin()\n"
    )
    code, output = smachpy("check", "--ros1", script)
    assert code == 0, output
    assert "ignored: /later: inconsistent: it had no states when the script began to" in output
    script.write_text(script.read_text().replace("rospy.spin()", "sm.execute()"))
    code, output = smachpy("check", "--ros1", script)
    assert code == 1, output


def test_in_virtual_time_no_robot_serves_a_move_base_of_another_type(smachpy, tmp_path):
    (tmp_path / ".catkin_workspace").touch()
    (tmp_path / "other_msgs" / "action").mkdir(parents=True)
    (tmp_path / "other_msgs" / "action" / "MoveBase.action").write_text("int8 a\n---\n---\n")
    script = tmp_path / "other.py"
    script.write_text(
        "import actionlib, rospy, smach\n"
        "from other_msgs.msg import MoveBaseAction\n"
        "rospy.init_node('other')\n"
        "client = actionlib.SimpleActionClient('flex/move_base', MoveBaseAction)\n"
        "print('server:', client.wait_for_server(rospy.Duration(5)))\n"
    )
    code, output = smachpy("run", "--ros1", script, "--time", "virtual")
    assert code == 0, output
    assert "server: False" in output
