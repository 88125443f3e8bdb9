"""Goals of a mission whose process ended: followed by id, on both wires, in virtual time."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

import smachpy
from actionlib_core.action.server import ActionServer
from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces._ros2 import ros2_registry
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestFeedback as Feedback
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib.msg import TestResult as Result
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import Node
from smachpy import CBState, Concurrence, SimpleActionState, StateMachine, events
from smachpy.durable.journal import read_position
from smachpy.durable.recorder import Recorder
from smachpy.durable.store import FencedError, StoreError
from tests.smachpy.durable.killing_store import Kill, KillingStore
from tests.two_nodes import TwoNodes

if TYPE_CHECKING:
    from collections.abc import Iterator

ENDS = ["succeeded", "aborted", "preempted"]
CONFIGS = {"own": Config(), "ROS 2": Config(ros2=(Ros2(names=("*",)),))}


class World(TwoNodes):
    """A robot with the action "do", and processes of a mission, one after the other."""

    def __init__(self, config: Config) -> None:
        self.config = config
        self.store = KillingStore()
        self.handles: list[Any] = []
        self.ids: list[str] = []
        self.number = 0
        super().__init__()

    def node(self, name: str) -> Node:
        node = Node(name, transport=self.session(), clock=self.clock, config=self.config)
        self._left.callback(node.transport.close)
        self._left.callback(node.close)
        return node

    def serve(self, *, accepts: bool = True) -> ActionServer:
        """Start a server that accepts goals and leaves it at that."""

        def on_goal(handle: Any) -> None:
            self.handles.append(handle)
            self.ids.append(handle.get_goal_id().id)
            if accepts:
                handle.set_accepted()
                handle.publish_feedback(Feedback(1))

        def on_cancel(handle: Any) -> None:
            handle.set_canceled(Result(0))

        server = ActionServer("do", Action, on_goal, on_cancel, auto_start=False, node=self.robot)
        server.start()
        return server

    def restart(self, server: ActionServer) -> ActionServer:
        """Let the robot's process end and begin anew: it knows nothing of earlier goals."""
        server.stop()
        self.robot.close()
        self.robot.transport.close()
        self.number += 1
        self.robot = self.node(f"robot_{self.number}")
        return self.serve()

    def machine(self, *, dies: bool = False, **options: Any) -> StateMachine:
        """The mission in a new process; one that `dies` does so at the first feedback."""
        self.mission.close()
        self.mission.transport.close()
        self.number += 1
        self.mission = self.node(f"mission_{self.number}")

        def on_feedback(_: Any, __: Any) -> None:
            if dies:
                raise Kill

        state = SimpleActionState(
            "do",
            Action,
            goal=Goal(3),
            result_key="result",
            feedback_cb=on_feedback,
            node=self.mission,
            server_wait_timeout=5.0,
            **options,
        )
        machine = StateMachine([*ENDS, "skipped"], name="M")
        with machine:
            machine.add("GO", state)
        return machine

    def kill(self, **options: Any) -> None:
        with pytest.raises(Kill):
            self.run(self.machine(dies=True, **options))

    def run(self, machine: StateMachine) -> str:
        return smachpy.run_durable(machine, self.store, mission="m")

    def end_soon(self, seconds: float = 1.0) -> None:
        self.clock.call_later(seconds, lambda: self.handles[-1].set_succeeded(Result(7)))


@pytest.fixture(params=CONFIGS)
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    if request.param == "ROS 2":
        definition = "int32 goal\n---\nint32 result\n---\nint32 feedback\n"
        ros2_registry("jazzy").define("action", "actionlib/Test", definition)
    with World(CONFIGS[request.param]) as world:
        yield world


def test_one_that_still_runs_is_followed(world: World) -> None:
    world.serve()
    world.kill()
    machine = world.machine()
    world.end_soon()
    assert world.run(machine) == "succeeded"
    assert machine.userdata.result == Result(7)
    assert len(world.ids) == 1


@pytest.mark.parametrize("error", [FencedError, StoreError, MemoryError])
def test_one_that_another_process_follows_is_not_cancelled(
    world: World, monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    def renew(lease: Any, **_: Any) -> bool:
        if error is MemoryError:  # nobody renewed the lease any more, and the mission went on
            raise MemoryError
        if error is StoreError:
            raise StoreError("here", "no space is left.", reason="full")
        raise FencedError("here", lease, "other:7")

    world.serve()
    monkeypatch.setattr(world.store, "renew", renew)
    with pytest.raises(error):
        world.run(world.machine())
    world.clock.sleep(5.0)
    is_cancelled = world.handles[0].get_goal_status().status == GoalStatus.PREEMPTED
    assert is_cancelled is (error is not FencedError)


def test_its_feedback_comes_again(world: World) -> None:
    world.serve()
    world.kill()
    machine = world.machine()
    seen: list[Any] = []
    machine.subscribe(seen.append)
    world.clock.call_later(0.5, lambda: world.handles[0].publish_feedback(Feedback(5)))
    world.end_soon()
    assert world.run(machine) == "succeeded"
    feedback = [event.feedback for event in seen if isinstance(event, events.GoalFeedback)]
    assert feedback == [Feedback(5)]


def test_the_result_of_one_that_has_ended_is_taken(world: World) -> None:
    world.serve()
    world.kill()
    world.handles[0].set_succeeded(Result(7))
    world.clock.sleep(5.0)
    machine = world.machine()
    assert world.run(machine) == "succeeded"
    assert machine.userdata.result == Result(7)
    assert len(world.ids) == 1


def test_the_server_keeps_a_result_that_comes_twice_until_it_is_in_the_journal(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that dies while it writes must get it from the server again."""
    keeper, kept = world.serve().keeper, []
    goal_done = Recorder.goal_done

    def result_comes_again(*args: Any, **options: Any) -> None:
        entry, body = keeper.find_end(world.ids[0])
        assert body is not None
        keeper.port.send_result(entry, body)
        world.clock.sleep(1.0)
        kept.append(keeper.find_end(world.ids[0])[1] is not None)
        goal_done(*args, **options)

    monkeypatch.setattr(Recorder, "goal_done", result_comes_again)
    world.end_soon()
    assert world.run(world.machine()) == "succeeded"
    assert kept == [True]


def test_one_that_was_cancelled_as_its_mission_died_is_sent_again(
    world: World, caplog: pytest.LogCaptureFixture
) -> None:
    """On ROS 2's wire nobody cancels it, and it is followed."""
    world.serve()
    world.kill(cancel_on_client_lost=True)
    machine = world.machine(cancel_on_client_lost=True)  # the former process is gone now
    world.clock.sleep(2.0)
    world.end_soon()
    assert world.run(machine) == "succeeded"
    own = not world.config.ros2
    assert len(world.ids) == (2 if own else 1)
    assert ("has no effect on ROS 2's wire" in caplog.text) is not own


def test_one_whose_mission_was_cancelled_meanwhile_is_not_sent_again(world: World) -> None:
    world.serve()
    world.kill(cancel_on_client_lost=True)
    world.store.request_cancel("m")
    machine = world.machine(cancel_on_client_lost=True)
    world.clock.sleep(2.0)
    assert world.run(machine) == "preempted"
    assert len(world.ids) == 1


def test_a_preempt_cancels_it(world: World) -> None:
    world.serve()
    world.kill()
    machine = world.machine()
    world.clock.call_later(1.0, machine.request_preempt)
    assert world.run(machine) == "preempted"
    assert len(world.ids) == 1


def test_one_of_a_mission_that_was_cancelled_meanwhile_is_cancelled(world: World) -> None:
    """The request was there before the run, which ended at once: the robot drove on."""
    world.serve()
    world.kill()
    world.store.request_cancel("m")
    assert world.run(world.machine()) == "preempted"
    assert world.handles[0].get_goal_status().status == 2  # preempted
    assert len(world.ids) == 1


def test_a_request_before_the_run_is_one_of_the_run(world: World) -> None:
    world.serve()
    world.kill()
    machine = world.machine()
    machine.request_preempt()
    assert world.run(machine) == "preempted"
    assert world.handles[0].get_goal_status().status == 2


def test_a_branch_that_ends_at_once_lets_the_others_stop_their_goals(world: World) -> None:
    """It ended its concurrence before they had been entered again."""
    world.serve()

    def mission(*, dies: bool) -> StateMachine:
        go = world.machine(dies=dies).get_children()["GO"]
        branches = Concurrence([*ENDS, "skipped"], "preempted", child_termination_cb=lambda _: True)
        branches.add("QUICK", CBState(waits, outcomes=["ok"], resume="skip:ok"))
        branches.add("GO", go)
        root = StateMachine([*ENDS, "skipped"], name="M")
        root.add("BOTH", branches)
        return root

    def waits(_: Any) -> str:
        world.clock.sleep(100.0)
        return "ok"

    with pytest.raises(Kill):
        world.run(mission(dies=True))
    assert world.run(mission(dies=False)) == "preempted"
    assert world.handles[0].get_goal_status().status == 2
    assert len(world.ids) == 1


def test_exec_timeout_counts_from_where_the_server_took_it(world: World) -> None:
    world.serve()
    world.kill(exec_timeout=10.0)
    world.clock.sleep(4.0)
    machine = world.machine(exec_timeout=10.0)
    begun = world.clock.now()
    assert world.run(machine) == "aborted"
    assert world.clock.now() - begun == pytest.approx(6.0, abs=0.5)


@pytest.mark.parametrize("world", ["own"], indirect=True)  # on ROS 2 feedback shows that it runs
def test_exec_timeout_of_one_that_waits_at_the_server_begins_with_its_acceptance(
    world: World,
) -> None:
    world.serve(accepts=False)
    world.clock.call_later(1.0, lambda: world.handles[0].publish_feedback(Feedback(1)))
    world.kill(exec_timeout=10.0)
    visit = read_position(world.store, "m").visits["/M/GO"]
    assert (visit["goal"]["taken_ns"] is not None, visit["goal"]["begun_ns"]) == (True, None)
    world.clock.sleep(20.0)
    machine = world.machine(exec_timeout=10.0)
    world.clock.call_later(4.0, lambda: world.handles[0].set_accepted())
    begun = world.clock.now()
    assert world.run(machine) == "aborted"
    assert world.clock.now() - begun == pytest.approx(14.0, abs=0.5)


@pytest.mark.parametrize(
    ("options", "outcome", "sent"),
    [
        ({}, "aborted", 1),
        ({"idempotent": True}, "succeeded", 2),
        ({"resume": "skip:skipped"}, "skipped", 1),
        ({"resume": lambda _: "aborted"}, "aborted", 1),
        ({"resume": lambda _: None}, "succeeded", 2),
    ],
    ids=["lost", "idempotent", "skip", "method", "method-none"],
)
def test_one_that_a_restarted_server_does_not_know(
    world: World, options: dict[str, Any], outcome: str, sent: int
) -> None:
    server = world.serve()
    world.kill(**options)
    assert read_position(world.store, "m").visits["/M/GO"]["goal"]["taken_ns"]
    world.restart(server)
    machine = world.machine(**options)
    if sent > 1:
        world.clock.call_later(9.0, lambda: world.handles[-1].set_succeeded(Result(7)))
    assert world.run(machine) == outcome
    assert len(world.ids) == len(set(world.ids)) == sent


def test_the_loss_of_one_names_the_ways_out(world: World, caplog: pytest.LogCaptureFixture) -> None:
    """It told to start the server, which runs."""
    server = world.serve()
    world.kill()
    world.restart(server)
    assert world.run(world.machine()) == "aborted"
    assert "Try idempotent=True" in caplog.text


def test_one_that_was_written_and_never_sent_is_sent(world: World) -> None:
    world.serve()
    world.store.arm(3, written=True)  # the write before it is sent
    with pytest.raises(Kill):
        world.run(world.machine())
    world.store.arm(0, written=False)
    assert world.ids == []
    machine = world.machine()
    world.clock.call_later(9.0, lambda: world.handles[-1].set_succeeded(Result(7)))
    assert world.run(machine) == "succeeded"
    assert len(world.ids) == 1


@pytest.mark.parametrize("written", [False, True])
@pytest.mark.parametrize("kill_at", [1, 2, 3])
def test_one_that_was_never_sent_is_sent_also_after_a_second_kill(
    world: World, kill_at: int, *, written: bool
) -> None:
    """Its loss was written before the new one was: the next process took it for lost."""
    world.serve()
    world.store.arm(3, written=True)  # the write before it is sent
    with pytest.raises(Kill):
        world.run(world.machine())
    world.store.arm(kill_at, written=written)
    with pytest.raises(Kill):
        world.run(world.machine())
    world.store.arm(0, written=False)
    for after in (9.0, 19.0):
        world.clock.call_later(
            after, lambda: [each.set_succeeded(Result(7)) for each in world.handles[-1:]]
        )
    assert world.run(world.machine()) == "succeeded"
    assert len(world.ids) == len(set(world.ids)) == 1


def test_a_kill_at_each_write_executes_each_goal_once(world: World) -> None:
    def run(kill_at: int, *, written: bool) -> str:
        world.store.arm(kill_at, written=written)
        machine = world.machine()
        for after in (2.0, 12.0):
            world.clock.call_later(after, end)
        return world.run(machine)

    def end() -> None:
        for handle in world.handles:
            if not handle.get_goal_status().status > 1:
                handle.set_succeeded(Result(7))

    world.serve()
    assert run(0, written=False) == "succeeded"
    writes = world.store.writes
    for kill_at in range(1, writes):
        for written in (False, True):
            world.store = KillingStore()
            world.ids.clear()
            world.handles.clear()
            with pytest.raises(Kill):
                run(kill_at, written=written)
            assert run(0, written=False) == "succeeded"
            assert len(world.ids) == 1, (kill_at, written)


def test_a_mission_that_is_stopped_cancels_its_goal_when_it_is_back_and_sends_no_other(world):
    """The emergency stop was lost with the process: the robot drove again."""
    world.serve()
    world.kill()
    stamp_ns = json.loads(world.store.entries["m"][-1])["stamp_ns"]
    stopped = {"kind": "Stopped", "path": "/M", "stamp_ns": stamp_ns}
    world.store.entries["m"].append(json.dumps(stopped).encode())
    machine, seen = world.machine(), []

    def look() -> None:
        seen.append((machine.control.is_paused(), len(world.handles)))
        seen.append(world.handles[0].get_goal_status().status)

    world.clock.call_later(20.0, look)
    world.clock.call_later(30.0, machine.control.resume)
    world.end_soon(40.0)
    assert world.run(machine) == "succeeded"
    assert seen == [(True, 1), GoalStatus.PREEMPTED]
    assert len(world.handles) == 2
    assert "emergency" not in read_position(world.store, "m").data
