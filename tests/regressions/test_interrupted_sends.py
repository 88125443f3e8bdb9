"""Ctrl-C, or what another signal handler raises, as a program sends a goal."""

from __future__ import annotations

import sys

import pytest

from actionlib_core import (
    ActionClient,
    ClientGoalHandle,
    GoalIDGenerator,
    GoalManager,
    Preempted,
    SimpleActionClient,
    server,
)
from actionlib_core.action.sent_goal import SentGoal
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork

CLIENT = {
    sys.modules[class_.__module__].__file__
    for class_ in (
        ActionClient,
        ClientGoalHandle,
        GoalIDGenerator,
        GoalManager,
        SentGoal,
        SimpleActionClient,
    )
}


def is_of_client(frame):
    """Return whether a frame belongs to a client, in a call of this thread."""
    if frame.f_code.co_filename not in CLIENT:
        return False
    while frame is not None and "/clock/" not in frame.f_code.co_filename:
        frame = frame.f_back
    return frame is None


class InterruptAt:
    """Calls `act` in this thread the n-th time that Python looks for signals.

    Without `act` it raises KeyboardInterrupt. Python looks as a function begins and after a call of
    one written in C. Only in the client classes, but not where the virtual clock calls them: in a
    program another thread does.
    """

    def __init__(self, n, act=None):
        self.left = n
        self.act = act
        self.raised = False

    def __call__(self, frame, event, _arg):
        if event in {"call", "c_return"} and is_of_client(frame):
            self.left -= 1
            if self.left < 0:
                self.raised = True
                sys.setprofile(None)
                if self.act is None:
                    raise KeyboardInterrupt
                self.act()

    def __enter__(self):
        self.before = sys.getprofile()
        sys.setprofile(self)
        return self

    def __exit__(self, *_):
        sys.setprofile(self.before)


class Robot:
    """A server whose goals end only when they are cancelled, and a client of it."""

    def __init__(self, clock, make_client):
        network = MemoryNetwork(clock)
        self.clock = clock
        self.running = set()

        @server("drive", msg.TestAction)
        def drive(goal, ctx):
            self.running.add(goal.goal)
            ctx.wait_preempt()
            self.running.discard(goal.goal)
            raise Preempted

        self.nodes = [Node(name, transport=network.session()) for name in ("client", "server")]
        self.server = drive.start(node=self.nodes[1])
        self.client = make_client("drive", msg.TestAction, node=self.nodes[0])
        assert self.client.wait_for_server(10.0)

    def close(self):
        self.client.stop()
        self.server.stop()
        for node in self.nodes:
            node.close()
            node.transport.close()


def send_second(client, goal):
    client.send_goal(msg.TestGoal(-1))
    client.send_goal(goal)


def send_and_wait(client, goal):
    client.send_goal_and_wait(goal, 1.0)


@pytest.mark.parametrize(
    ("make_client", "send", "ends"),
    [
        (ActionClient, ActionClient.send, False),
        (ActionClient, ActionClient.send_goal, False),
        (SimpleActionClient, SimpleActionClient.send_goal, False),
        (SimpleActionClient, send_second, False),
        (SimpleActionClient, send_and_wait, True),
    ],
)
def test_goal_whose_sending_is_interrupted_is_cancelled(make_client, send, ends):
    """Its handle was lost, and the robot drove on."""
    n = 0
    with VirtualClock() as clock, use_clock(clock):
        while True:
            robot = Robot(clock, make_client)
            interrupt = InterruptAt(n)
            try:
                with interrupt:
                    send(robot.client, msg.TestGoal(n))
            except KeyboardInterrupt:
                pass
            clock.sleep(2.0)
            assert (n in robot.running) == (not interrupt.raised and not ends), n
            robot.close()
            if not interrupt.raised:
                break
            n += 1
    assert n > 15


def test_goal_that_a_signal_handler_cancels_as_it_is_sent_does_not_run():
    """It was told to be RECALLED, and then sent."""
    n = 0
    with VirtualClock() as clock, use_clock(clock):
        while True:
            robot = Robot(clock, SimpleActionClient)
            client, cancelled = robot.client, []

            def cancel(client=client, cancelled=cancelled):
                cancelled.append(client.gh is not None)  # else there is no goal yet
                client.cancel_goal()

            with InterruptAt(n, cancel) as at:
                client.send_goal(msg.TestGoal(n))
            clock.sleep(2.0)
            followed = [
                bool(client.action_client.manager._goals),
                client.action_client._owner.running,
            ]
            ran_on = cancelled != [True]
            assert ([n in robot.running, *followed]) == [ran_on, ran_on, int(ran_on)], n
            robot.close()
            if not at.raised:
                break
            n += 1
    assert n > 15


def test_goal_that_a_signal_handler_sends_as_old_deadlines_are_dropped_has_its_deadline():
    """It went into a list that was just being replaced: nobody repeated or gave up that goal."""
    with VirtualClock() as clock, use_clock(clock):
        node = Node("client", transport=MemoryNetwork(clock).session())
        client, sent = ActionClient("drive", msg.TestAction, node=node), []

        def send(frame, event, _arg):
            if event == "return" and frame.f_code.co_name == "_is_planned":
                sys.setprofile(None)
                sent.append(client.send_goal(msg.TestGoal(1), ack_timeout=2.0))

        before = sys.getprofile()
        sys.setprofile(send)
        try:
            for _ in range(1000):
                client.send_goal(msg.TestGoal(0)).cancel()
        finally:
            sys.setprofile(before)
        clock.sleep(5.0)
        assert sent[0].get_goal_status() == GoalStatus.LOST
        client.stop()
        node.close()
        node.transport.close()
