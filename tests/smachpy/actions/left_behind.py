"""A callback of a state that goes on long after its mission has ended."""

from __future__ import annotations

import contextlib

from smachpy import Concurrence


def leave_behind(world, callback):
    """Preempt a branch whose callback swallows each interruption for 30 s; return after 90 s more."""

    def swallows(*_):
        until = world.clock.now() + 30.0
        while world.clock.now() < until:
            with contextlib.suppress(BaseException):
                world.clock.sleep(1.0)

    branches = Concurrence(["done", "preempted"], "done")
    branches.add("A", world.state(**{callback: swallows}, preempt_timeout=0.2))
    world.clock.call_later(1.0, branches.request_preempt)
    assert branches.execute() == "preempted"
    world.clock.sleep(90.0)
