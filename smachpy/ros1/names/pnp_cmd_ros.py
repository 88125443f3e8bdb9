"""pnp_cmd_ros: `PNPCmd` as PNP's own Python programs use it.

Actions and conditions come from a file `actions.yaml` beside the program. Those that it does not
name, or all without such a file, are left to the robot's `PNPActionServer`.

Source:
    pnp_cmd_ros and pnp_cmd_base of PetriNetPlans 1.4.
"""

from __future__ import annotations

import os  # programs take these modules from here, by `from pnp_cmd_ros import *`
import sys
import threading
import time
from pathlib import Path
from typing import Any

from smachpy import pnp
from smachpy.pnp.mapping import Registered, mapping_beside, read_mapping
from smachpy.ros1.names import rospy
from smachpy.ros1.names.rospy.client import get_param
from smachpy.ros1.names.rospy.core import init_node, is_initialized

NODE = "pnp_cmd"


class PNPCmd(pnp.PNPCmd):
    """A `smachpy.pnp.PNPCmd` with the arguments of these programs."""

    def __init__(self) -> None:
        program = Path(sys.argv[0] or "program")
        beside = mapping_beside(program)
        given = Registered() if beside is None else read_mapping(beside)
        server = given.options.get("server")
        if server is None and beside is None:
            server = pnp.PNPServer(robot=str(get_param("robotname", "")))
        super().__init__(given.actions, given.conditions, plan_folder=program.parent, server=server)

    def begin(self) -> None:
        """Begin; make the program's node first, if it has none."""
        if not is_initialized():
            init_node(NODE)
        super().begin()

    def stop_plan(self, name: str = "") -> None:
        """Ask the running plan to stop."""
        del name
        super().stop_plan()

    def wait_for_termination(self, action: Any = None) -> Any:
        """Wait until an action has ended; return "success", "failure" or "interrupt".

        Without the name of an action, as `smachpy.pnp.PNPCmd.wait_for_termination`.

        Blocks: until then.
        """
        if not isinstance(action, str):
            return super().wait_for_termination(action)
        for task in self._tasks_of(action):
            if task is not None:
                task.join(None)
        return self.action_status(action)
