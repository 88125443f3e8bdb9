"""Importing interface packages under the long and the plain names."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from actionlib_core import interfaces
from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces import _modules


def run(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_import_forms() -> None:
    from actionlib_core.interfaces import geometry_msgs
    from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
    from actionlib_core.interfaces.std_srvs.srv import Trigger, TriggerRequest

    assert geometry_msgs.msg.PoseStamped is PoseStamped
    assert interfaces.get_message("geometry_msgs/PoseStamped") is PoseStamped
    assert interfaces.get_action("move_base_msgs/MoveBase") is MoveBaseAction
    assert interfaces.get_message("move_base_msgs/MoveBaseGoal") is MoveBaseGoal
    assert Trigger._request_class is TriggerRequest
    assert PoseStamped.__module__ == "actionlib_core.interfaces.geometry_msgs.msg"
    assert "PoseStamped" in dir(geometry_msgs.msg)
    namespace: dict[str, object] = {}
    exec("from actionlib_core.interfaces.geometry_msgs.msg import *", namespace)
    assert namespace["PoseStamped"] is PoseStamped


def test_wrong_names() -> None:
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("actionlib_core.interfaces.geometri_msgs")
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("actionlib_core.interfaces.geometry_msgs.action")
    msg = importlib.import_module("actionlib_core.interfaces.geometry_msgs.msg")
    with pytest.raises(AttributeError, match="Did you mean 'PoseStamped'"):
        msg.Posestamped
    with pytest.raises(AttributeError):
        msg._nothing
    with pytest.raises(AttributeError):
        importlib.import_module("actionlib_core.interfaces.geometry_msgs").nothing
    srv = importlib.import_module("actionlib_core.interfaces.geometry_msgs.srv")
    with pytest.raises(AttributeError, match="It has none"):
        srv.Anything


def test_inline_definitions_can_be_imported() -> None:
    action = interfaces.define_action("test_modules_pkg/Turn", "float32 angle\n---\n---\n")
    message = interfaces.define_message("test_modules_pkg/Note", "string text\n")
    service = interfaces.define_service("test_modules_pkg/Ask", "---\nbool yes\n")
    msg = importlib.import_module("actionlib_core.interfaces.test_modules_pkg.msg")
    srv = importlib.import_module("actionlib_core.interfaces.test_modules_pkg.srv")
    assert msg.TurnAction is action
    assert msg.Note is message
    assert srv.Ask is service
    assert srv.AskResponse is service._response_class


def test_plain_ros_names_run_old_programs() -> None:
    printed = run(
        "from actionlib_core import interfaces\n"
        "interfaces.install_ros_names(); interfaces.install_ros_names()\n"
        "import actionlib, std_msgs\n"
        "from geometry_msgs.msg import *\n"
        "from actionlib.msg import TestAction\n"
        "from std_srvs.srv import Trigger, TriggerResponse\n"
        "from actionlib_core.interfaces.geometry_msgs.msg import Pose as Same\n"
        "assert Pose is Same\n"
        "print(std_msgs.msg.String('hi').data, TestAction._type, actionlib.__name__)"
    )
    assert printed == "hi actionlib/TestAction actionlib"


def test_folders_of_definitions_do_not_hide_their_classes(tmp_path: Path) -> None:
    (tmp_path / "my_pkg" / "msg").mkdir(parents=True)
    (tmp_path / "my_pkg" / "msg" / "Age.msg").write_text("float32 years\n")
    (tmp_path / "real_pkg" / "msg").mkdir(parents=True)
    (tmp_path / "real_pkg" / "msg" / "Age.msg").write_text("float32 years\n")
    (tmp_path / "real_pkg" / "__init__.py").write_text("REAL = True\n")
    printed = run(
        "import os, sys\n"
        f"os.chdir({str(tmp_path)!r}); sys.path.insert(0, '')\n"
        "from actionlib_core import interfaces\n"
        "interfaces.add_path('.'); interfaces.install_ros_names()\n"
        "from my_pkg.msg import Age\n"
        "import real_pkg\n"
        "from real_pkg.msg import Age as Other\n"
        "print(Age._type, Other._type, real_pkg.REAL)"
    )
    assert printed == "my_pkg/Age real_pkg/Age True"


def test_plain_names_of_another_installation_are_not_mixed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "geometry_msgs", type(sys)("geometry_msgs"))
    with pytest.raises(InterfaceError, match="imported already"):
        _modules.install_ros_names()


def test_messages_load_nothing_heavy() -> None:
    printed = run(
        "import sys\n"
        "from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction\n"
        "MoveBaseAction().to_bytes()\n"
        "print([m for m in ('rosbags', 'numpy', 'zenoh', 'ruamel.yaml') if m in sys.modules])"
    )
    assert printed == "[]"
