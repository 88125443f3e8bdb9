"""Which module an import of an old program finds."""

from __future__ import annotations

import queue
import sys

import pytest

from smachpy import ros1

MACHINE = """
import smach
sm = smach.StateMachine(outcomes=['done'])
with sm:
    sm.add(LABEL, smach.CBState(lambda ud: 'done', outcomes=['done']))
sm.execute()
"""


@pytest.fixture
def label(tmp_path):
    """Return a function that writes files, loads the script `robot/scripts/m.py` and returns its label."""

    def load(files, script="robot/scripts/m.py", **options):
        (tmp_path / ".catkin_workspace").touch()
        for name, text in files.items():
            path = tmp_path / "src" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        for package in {name.partition("/")[0] for name in files}:
            (tmp_path / "src" / package / "package.xml").write_text(f"<name>{package}</name>")
        machine = ros1.load(tmp_path / "src" / script, timeout=60, **options)
        return next(iter(machine.get_children()))

    yield load
    ros1.uninstall()


def test_the_source_of_another_package_comes_before_its_scripts(label):
    found = label(
        {
            "eyes/scripts/tools.py": "LABEL = 'SCRIPT'\n",
            "tools/src/tools/__init__.py": "LABEL = 'PACKAGE'\n",
            "robot/scripts/m.py": f"from tools import LABEL\n{MACHINE}",
        }
    )
    assert found == "PACKAGE"


@pytest.mark.parametrize("folder", ["eyes/scripts", "eyes/nodes", "robot/nodes", "robot"])
def test_a_script_does_not_hide_an_installed_module(label, folder):
    found = label(
        {
            f"{folder}/graphviz.py": "LABEL = 'SCRIPT'\n",
            "robot/scripts/m.py": "import graphviz\n"
            f"LABEL = getattr(graphviz, 'LABEL', 'INSTALLED')\n{MACHINE}",
        }
    )
    assert found == "INSTALLED"


def test_a_module_that_only_scripts_have_is_found(label):
    found = label(
        {
            "eyes/scripts/glances.py": "LABEL = 'SCRIPT'\n",
            "robot/scripts/m.py": f"from glances import LABEL\n{MACHINE}",
        }
    )
    assert found == "SCRIPT"


IMPORTS = {
    "from": "from utility import LABEL\n",
    "module": "import utility\nLABEL = utility.LABEL\n",
    "as": "import utility as other\nLABEL = other.LABEL\n",
    "star": "from utility import *\n",
    "below": "import deep.utility\nLABEL = deep.utility.LABEL\n",
    "below as": "import deep.utility as other\nLABEL = other.LABEL\n",
    "from below": "from deep import utility\nLABEL = utility.LABEL\n",
    "two": "import os, utility\nLABEL = utility.LABEL\n",
}


@pytest.mark.parametrize("way", IMPORTS)
@pytest.mark.parametrize("python2", [True, False])
def test_a_module_of_the_own_package_is_found_without_a_dot(label, way, python2):
    old = "print 'python 2'\n" if python2 else ""
    found = label(
        {
            "robot/src/robot/__init__.py": f"{old}from inner import first\n{IMPORTS[way]}",
            "robot/src/robot/utility.py": "LABEL = 'OWN'\n",
            "robot/src/robot/deep/__init__.py": "",
            "robot/src/robot/deep/utility.py": "LABEL = 'OWN'\n",
            "robot/src/robot/inner/__init__.py": f"{old}from utility import first\n",
            "robot/src/robot/inner/utility.py": "first = 1\n",
            "robot/scripts/m.py": f"from robot import LABEL\n{MACHINE}",
        }
    )
    assert found == "OWN"


def test_only_in_python_2_the_own_package_comes_before_other_modules(label):
    files = {
        "robot/src/robot/utility.py": "LABEL = 'OWN'\n",
        "tools/src/utility.py": "LABEL = 'OTHER'\n",
        "robot/scripts/m.py": f"from robot import LABEL\n{MACHINE}",
    }
    start = {"robot/src/robot/__init__.py": "from utility import LABEL\n"}
    assert label(files | start) == "OTHER"
    ros1.uninstall()
    old = {"robot/src/robot/__init__.py": "print 'old'\nfrom utility import LABEL\n"}
    assert label(files | old) == "OWN"


@pytest.mark.parametrize("name", ["queue", "signal", "graphviz", "transitions", "select"])
def test_a_module_beside_the_script_is_the_scripts_only(label, name):
    found = label(
        {
            f"robot/scripts/{name}.py": "LABEL = 'OWN'\n",
            "robot/scripts/helper.py": f"import {name}\nLABEL = {name}.LABEL\n",
            "robot/scripts/m.py": f"import {name} as mine\nfrom {name} import LABEL\n"
            f"from helper import LABEL as other\nassert mine.LABEL == other == 'OWN'\n"
            f"from smach_ros import ServiceState\nimport rospy\n{MACHINE}",
        }
    )
    assert found == "OWN"
    assert not hasattr(sys.modules.get(name), "LABEL")


def test_a_script_with_its_own_queue_builds_a_service_state(label):
    found = label(
        {
            "robot/scripts/queue.py": "",
            "robot/scripts/m.py": "import smach\nfrom smach_ros import ServiceState\n"
            "from std_srvs.srv import Empty\n"
            "sm = smach.StateMachine(outcomes=['succeeded', 'aborted', 'preempted'])\n"
            "with sm:\n    sm.add('CLEAR', ServiceState('clear', Empty))\nsm.execute()\n",
        }
    )
    assert found == "CLEAR"
    assert queue.SimpleQueue


SUBMODULES = {
    "actionlib": "action_client action_server exceptions goal_id_generator simple_action_client",
    "genpy": "message rostime",
    "rosgraph": "masterapi names rosenv",
    "rospkg": "common manifest rospack",
    "rospy": "client core exceptions msg names rostime service timer topics",
    "smach": "concurrence container exceptions iterator log state state_machine user_data util",
    "smach_ros": "simple_action_state service_state condition_state introspection util",
    "tf": "broadcaster listener transformations",
    "tf2_geometry_msgs": "tf2_geometry_msgs",
    "tf2_ros": "buffer buffer_client buffer_interface transform_broadcaster transform_listener",
}


@pytest.mark.parametrize("package", SUBMODULES)
def test_submodules_are_attributes_as_in_ros(label, package):
    names = SUBMODULES[package].split()
    found = label(
        {
            "robot/scripts/m.py": f"import {package}, importlib\n"
            f"for name in {names}:\n"
            f"    made = getattr({package}, name)\n"
            f"    assert made is importlib.import_module('{package}.' + name), name\n"
            f"LABEL = 'A'\n{MACHINE}"
        }
    )
    assert found == "A"


def test_a_buffer_client_knows_transforms_without_its_server(label):
    found = label(
        {
            "robot/scripts/m.py": "import rospy, tf2_ros\nrospy.init_node('x')\n"
            "buffer = tf2_ros.BufferClient('server', timeout_padding=rospy.Duration(1))\n"
            "assert buffer.wait_for_server()\n"
            "LABEL = buffer.lookup_transform('A', 'b', rospy.Time(0)).header.frame_id\n" + MACHINE
        }
    )
    assert found == "A"
