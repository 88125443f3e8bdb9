"""Runs unchanged programs for ROS 1: `rospy`, `smach`, `tf` and others under their old names.

    import smachpy.ros1

    smachpy.ros1.install()
    import rospy, smach, smach_ros

or, without a change to the program, `smachpy run --ros1 old_mission.py`. `load` builds the machine
of a script without running it, for pictures, checks and tests.
"""

from __future__ import annotations

from smachpy.ros1.install import install as install
from smachpy.ros1.install import installed as installed
from smachpy.ros1.install import uninstall as uninstall
from smachpy.ros1.program import LoadError as LoadError
from smachpy.ros1.program import load as load
from smachpy.ros1.program import run_script as run_script

__all__ = ["LoadError", "install", "installed", "load", "run_script", "uninstall"]
