"""Python programs that import PNP's `pnp_cmd_ros` run as they are."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SMACHPY = Path(sys.executable).parent / "smachpy"
PROGRAM = """
import os, sys
try:
    sys.path.insert(0, os.environ["PNP_HOME"] + '/scripts')
except:
    print("Please set PNP_HOME.")
    sys.exit(1)

import pnp_cmd_ros
from pnp_cmd_ros import *

p = PNPCmd()
p.begin()
print "goto", p.exec_action('goto', "7.5_-7.5_0.0")
p.start_action('guard', 'door')
print "guard", p.action_status('guard')
print "say", p.exec_action('say', 'hello', interrupt='loud', recovery='skip_action')
p.interrupt_action('guard')
print "guard", p.wait_for_termination('guard')
print p.get_condition('loud'), p.get_condition('quiet'), rospy.get_name()
p.end()
"""
ACTIONS = """
actions:
  goto: {run: "does:goto"}
  say: {run: "does:say"}
  guard: {run: "does:guard"}
conditions:
  loud: true
"""
DOES = """
import smachpy

def goto(userdata, x, y, angle):
    return float(x) == 7.5

def say(userdata, text):
    smachpy.current_state().sleep(60.0)

guard = say
"""


def test_a_program_with_actions_of_its_own(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    (tmp_path / "actions.yaml").write_text(ACTIONS)
    (tmp_path / "does.py").write_text(DOES)
    done = subprocess.run(
        [SMACHPY, "run", "--ros1", "program.py"],
        cwd=tmp_path,
        env={**os.environ, "PNP_HOME": "."},
        capture_output=True,
        text=True,
        timeout=100,
    )
    lines = [
        line
        for line in done.stdout.splitlines()
        if line.startswith(("goto ", "guard ", "say ", "True"))
    ]
    assert lines == [
        "goto success",
        "guard run",
        "say interrupt",
        "guard interrupt",
        "True False /pnp_cmd",
    ], done
