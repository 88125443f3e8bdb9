"""The old names come and go with the hook, whatever else is installed."""

import importlib
import subprocess
import sys

import pytest

from smachpy import ros1
from smachpy.base import slips


@pytest.fixture
def names(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("")
    with ros1.installed(script):
        yield tmp_path


def test_the_names_are_this_packages(names):
    import smach
    import smach_ros

    import smachpy

    assert smach.StateMachine is smachpy.StateMachine
    assert smach_ros.SimpleActionState is smachpy.SimpleActionState
    assert importlib.import_module("smach.state_machine").StateMachine is smachpy.StateMachine
    assert importlib.import_module("geometry_msgs.msg").PoseStamped().header.seq == 0


def test_star_imports_leak_what_the_originals_leak(names):
    scope = {}
    exec("from actionlib import *\nfrom smach import *\nfrom smach_ros import *", scope)
    leaked = {
        "GoalStatus",
        "rospy",
        "threading",
        "SimpleActionClient",
        "State",
        "IntrospectionServer",
    }
    assert leaked <= set(scope)


def test_submodules_by_from_are_those_by_import(names):
    (names / "by_from.py").write_text(
        "from actionlib import goal_id_generator, status_tracker\n"
        "import actionlib.goal_id_generator as by_import\n"
        "assert goal_id_generator is by_import\n"
    )
    importlib.import_module("by_from")


def test_uninstall_gives_an_installed_smach_back(tmp_path):
    import smach as before

    with ros1.installed(tmp_path / "script.py"):
        assert importlib.import_module("smach") is not before
        assert slips.accepting()
    assert importlib.import_module("smach") is before
    assert not slips.accepting()
    assert "rospy" not in sys.modules
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("rospy")


def test_importing_smachpy_leaves_the_names_alone():
    code = (
        "import smachpy, sys; assert not [m for m in sys.modules if m.startswith('smachpy.ros1')]\n"
        "import smachpy.ros1\n"
        "try: import rospy\n"
        "except ImportError: print('none')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "none\n"


def test_a_missing_package_is_named_with_its_place(names):
    (names / "uses.py").write_text("import rospy\nfrom absent_msgs.msg import Thing\n")
    with pytest.raises(ModuleNotFoundError) as caught:
        importlib.import_module("uses")
    assert caught.value.name == "absent_msgs"
    assert caught.value.file == str(names / "uses.py")
    assert caught.value.line == 2
    assert "message package 'absent_msgs'" in str(caught.value)
    (names / "more.py").write_text("import dynamic_reconfigure.nobody\n")
    with pytest.raises(
        ModuleNotFoundError, match=r"module 'dynamic_reconfigure.nobody' is missing"
    ):
        importlib.import_module("more")


def test_what_packages_depend_on(tmp_path):
    manifests = {
        "arm/package.xml": "<name>arm</name><build_depend>rospy</build_depend>"
        "<exec_depend version_gte='1'> arm_msgs </exec_depend><test_depend>tests</test_depend>"
        "<!-- <depend>commented_out</depend> --><buildtool_depend>catkin</buildtool_depend>",
        "arm_msgs/package.xml": "<name>arm_msgs</name><depend>std_msgs</depend><depend>arm</depend>",
        "old/manifest.xml": '<package><depend package="arm"/>'
        '<export><cpp cflags="-I"/><cpp libs="-l"/></export></package>',
    }
    for name, text in manifests.items():
        file = tmp_path / name
        file.parent.mkdir()
        file.write_text(text)
    (tmp_path / ".git").mkdir()
    with ros1.installed(tmp_path / "arm" / "script.py"):
        rospkg = importlib.import_module("rospkg")
        pack = rospkg.RosPack()
        assert sorted(pack.get_depends("arm", implicit=False)) == ["arm_msgs", "rospy"]
        assert sorted(pack.get_depends("arm")) == ["arm_msgs", "rospy", "std_msgs"]
        assert pack.get_depends_on("arm", implicit=False) == ["arm_msgs", "old"]
        assert pack.get_depends_on("std_msgs") == ["arm", "arm_msgs", "old"]
        with pytest.raises(rospkg.ResourceNotFound):
            pack.get_depends("nobody")
        assert pack.get_manifest("old").get_export("cpp", "libs") == ["-l"]
        with pytest.raises(rospkg.InvalidManifest):  # two roots
            pack.get_manifest("arm").get_export("cpp", "libs")


@pytest.mark.parametrize("stub_missing", [False, True])
def test_a_star_import_gives_what_generated_modules_import(tmp_path, stub_missing):
    (tmp_path / "uses.py").write_text(
        "from actionlib_msgs.msg import *\n"
        "from geometry_msgs.msg import *\n"
        "made = std_msgs.msg.Bool(True), geometry_msgs.msg.Pose(), GoalID, sys.argv, genpy.Time\n"
    )
    with ros1.installed(tmp_path / "script.py", stub_missing=stub_missing):
        assert importlib.import_module("uses").made[0].data is True


def test_services_of_a_missing_package_are_services_though_its_messages_come_first(tmp_path):
    (tmp_path / "uses.py").write_text(
        "import rospy\nfrom jaw_msgs.msg import *\nfrom jaw_msgs.srv import *\n"
        "def proxies():\n"
        "    return rospy.ServiceProxy('home', HomeJaw), rospy.ServiceProxy('open', open_jaw)\n"
        "def message():\n    return JawState()\n"
    )
    with ros1.installed(tmp_path / "script.py", stub_missing=True):
        uses = importlib.import_module("uses")
        assert uses.HomeJaw._request_class is not uses.open_jaw._request_class
        assert uses.message().anything is not None


def test_messages_of_the_packages_around(tmp_path):
    scripts = tmp_path / "my_stack" / "my_robot" / "scripts"
    scripts.mkdir(parents=True)
    (tmp_path / "my_stack" / "my_robot" / "package.xml").write_text("<name>my_robot</name>")
    other = tmp_path / "my_stack" / "folder" / "msg"
    other.mkdir(parents=True)
    (tmp_path / "my_stack" / ".git").mkdir()
    (other.parent / "package.xml").write_text("<package><name>around_msgs</name></package>")
    (other / "Level.msg").write_text("float64 percent\n")
    library = tmp_path / "my_stack" / "my_robot" / "src" / "my_robot_lib"
    library.mkdir(parents=True)
    (library / "__init__.py").write_text("import parts\nprint 'made', parts.WHAT\n")
    (library / "parts.py").write_text("WHAT = 'x'\n")
    with ros1.installed(scripts / "script.py"):
        assert importlib.import_module("around_msgs.msg").Level(3.5).percent == 3.5
        assert importlib.import_module("my_robot_lib").parts.WHAT == "x"
    assert "my_robot_lib" not in sys.modules


def test_the_python2_file_stays_and_errors_show_its_lines(tmp_path):
    script = tmp_path / "old.py"
    text = "import rospy\ndef f((a, b)):\n\tprint a\n\n\nraise ValueError, 'here'\n"
    script.write_text(text)
    with pytest.raises(ros1.LoadError) as caught:
        ros1.load(script)
    ros1.uninstall()
    assert f"{script}:6: ValueError: here" in caught.value.problem
    assert script.read_text() == text
