"""An interruption of a state that ignores its preempt leaves the interpreter as it was."""

from __future__ import annotations

import subprocess
import sys

import pytest

CODE = """
import logging, sys, threading
import smachpy

logging.disable(logging.CRITICAL)
entered, free = threading.Event(), threading.Event()


class Deaf(smachpy.State):
    def execute(self, userdata):
        entered.set()
        if sys.argv[1] == "in C":
            free.wait()
        while True:
            pass


def stop():
    entered.wait()
    machine.request_preempt()


machine = smachpy.Concurrence(["done", "preempted"], "done", preempt_timeout=0.02)
machine.add("DEAF", Deaf(["done", "preempted"]))
asker = threading.Thread(target=stop)
asker.start()
print(machine.execute())
asker.join()
sys.settrace(lambda *_: None)
print((lambda: "traced")())
sys.settrace(None)
free.set()
"""


@pytest.mark.parametrize("where", ["in C", "in Python"])
def test_a_traced_function_begins_after_a_thread_was_interrupted(where):
    """CPython 3.11 turned for ever at the first step of the traced function."""
    done = subprocess.run(
        [sys.executable, "-c", CODE, where],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.stdout.split() == ["preempted", "traced"]
    assert done.returncode == 0, done.stderr
