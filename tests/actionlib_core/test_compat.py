"""ROS 1's module names."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from actionlib_core.compat import MODULES


@pytest.mark.parametrize("name", MODULES)
def test_a_module_is_found_under_its_ros_name(name):
    assert importlib.import_module(name) is importlib.import_module(MODULES[name])


def test_an_alias_in_a_new_program_leaves_the_module_as_it_is():
    code = (
        "from actionlib_core.simple_action_client import SimpleActionClient\n"
        "import actionlib_core.action.simple_client as home\n"
        "assert home.SimpleActionClient is SimpleActionClient\n"
        "assert home.__name__ == home.__spec__.name == 'actionlib_core.action.simple_client'\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_other_names_are_not_found():
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("actionlib_core.no_such_module")
