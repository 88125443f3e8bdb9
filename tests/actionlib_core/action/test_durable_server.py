"""Goals and results of a durable action server survive the end of its process."""

from __future__ import annotations

import contextlib
import os
import signal
import sqlite3
import subprocess
import sys

import pytest

from actionlib_core import ActionClient, ActionServer, SimpleActionServer
from actionlib_core.action.goal_keeper import CLIENTS_S
from actionlib_core.exceptions import ActionException, DurableGoalsError
from actionlib_core.goal.server import MEMORY_S
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestFeedback as Feedback
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib.msg import TestResult as Result
from actionlib_core.interfaces.actionlib.msg import TwoIntsAction
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.ros2.example_interfaces.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.transport.zenoh import ZenohTransport
from tests.two_nodes import TwoNodes


class World(TwoNodes):
    """A robot whose program is killed again and again, and a mission that stays."""

    def __init__(self, file) -> None:
        super().__init__()
        self.file = file
        self.lives = 0
        self.client = None

    def __enter__(self):
        super().__enter__()
        self.new_client()
        return self

    def new_client(self) -> None:
        """Let the mission's program end, too: a client that heard of LOST takes what comes later."""
        if self.client is not None:
            self.client.stop()
        self.client = ActionClient("work", Action, node=self.mission)

    def new_life(self):
        self.lives += 1
        return self.node(f"robot_{self.lives}")

    def serve(self, goal_cb, cancel_cb=lambda handle: None, **options):
        node = self.new_life()
        server = ActionServer(
            "work", Action, goal_cb, cancel_cb, node=node, durable=self.file, **options
        )
        assert self.client.wait_for_server(5)
        return server

    def kill(self, server) -> None:
        """What SIGKILL leaves: the network sees the session go, the file is as it is."""
        server.keeper.status.close()
        server.keeper.close_to_goals()
        server.keeper.close_file()
        server.node.transport.close()
        self.new_client()
        self.clock.sleep(1)

    def end_of(self, goal_id):
        """Ask the server what became of a goal: status, text, result."""
        handle = self.client.attach(goal_id)
        assert handle.wait(5)
        return handle.get_terminal_state(), handle.get_goal_status_text(), handle.get_result()


@pytest.fixture
def world(tmp_path):
    with World(tmp_path / "goals" / "work.db") as world:
        yield world


def send(world, number=1):
    """Send a goal, and return its id once it has arrived."""
    handle = world.client.send_goal(Goal(number))
    world.clock.sleep(0.5)
    return handle.get_goal_id()


def test_a_goal_that_ran_ends_aborted_with_the_reason(world):
    seen = []
    server = world.serve(lambda handle: (seen.append(handle.get_goal()), handle.set_accepted()))
    goal_id = send(world, 5)
    assert seen == [Goal(5)]
    world.kill(server)
    world.serve(lambda handle: seen.append("again"))
    state, text, result = world.end_of(goal_id)
    assert (state, result) == (Status.ABORTED, Result())
    assert "restarted" in text
    assert seen == [Goal(5)]


def test_a_goal_that_ran_is_resumed_when_the_server_says_so(world):
    server = world.serve(lambda handle: handle.set_accepted("first"))
    goal_id = send(world, 5)
    world.kill(server)
    seen = []

    def again(handle):
        seen.append((handle.resumed, handle.get_goal(), handle.get_goal_id().id))
        handle.set_accepted("second")
        handle.set_succeeded(Result(7), "done")

    world.serve(again, on_restart="resume")
    assert world.end_of(goal_id) == (Status.SUCCEEDED, "done", Result(7))
    assert seen == [(True, Goal(5), goal_id)]


def test_a_goal_that_was_not_accepted_is_as_new(world):
    server = world.serve(lambda handle: None)
    goal_id = send(world)
    world.kill(server)
    seen = []

    def accept(handle):
        seen.append(handle.resumed)
        handle.set_rejected(text="no")

    world.serve(accept)
    assert world.end_of(goal_id)[:2] == (Status.REJECTED, "no")
    assert seen == [False]


@pytest.mark.parametrize("on_restart", ["abort", "resume"])
def test_a_goal_that_was_asked_to_stop_is_not_begun_again(world, on_restart):
    server = world.serve(lambda handle: handle.set_accepted())
    goal_id = send(world)
    world.client.cancel_all_goals()
    world.clock.sleep(0.5)
    world.kill(server)
    world.serve(lambda handle: pytest.fail("begun again"), on_restart=on_restart)
    assert world.end_of(goal_id)[0] == Status.ABORTED


def test_a_goal_that_was_cancelled_before_it_was_accepted_is_recalled(world):
    server = world.serve(lambda handle: None)
    goal_id = send(world)
    world.client.cancel_all_goals()
    world.clock.sleep(0.5)
    world.kill(server)
    world.serve(lambda handle: pytest.fail("begun again"), on_restart="resume")
    assert world.end_of(goal_id)[0] == Status.RECALLED


def simple(world, run, **options):
    """Make a simple server that runs its goals again after a kill."""
    kept = {"durable": world.file, "on_restart": "resume", **options}
    return SimpleActionServer("work", Action, run, False, node=world.new_life(), **kept)


@pytest.mark.parametrize("waits", [True, False], ids=["newer one waits", "newer one cancelled"])
def test_a_goal_that_a_newer_one_replaced_is_not_begun_again(world, waits):
    """Its status does not show that it was asked to stop, as in ROS."""
    ended, runs = world.clock.event(), []
    first = simple(world, lambda goal: ended.wait())
    first.start()
    older = send(world, 1)
    newer = send(world, 2)
    if not waits:
        first.action_server.keeper.on_cancel(newer, 0)
        world.clock.sleep(0.5)
    assert first.is_preempt_requested()
    assert first.current_goal.get_goal_status().status == Status.ACTIVE
    world.kill(first.action_server)

    def run(goal):
        runs.append(goal.goal)
        second.set_succeeded()

    second = simple(world, run)
    second.start()
    state, text, _ = world.end_of(older)
    assert state == Status.ABORTED
    assert "restarted" in text
    assert world.end_of(newer)[0] == (Status.SUCCEEDED if waits else Status.RECALLED)
    assert runs == ([2] if waits else [])
    ended.set()  # the thread of the first life, which a kill would have ended


def test_a_goal_whose_resource_another_one_took_is_not_begun_again(world):
    ended = world.clock.event()
    first = simple(world, lambda goal: ended.wait(), resource="base")
    first.start()
    goal_id = send(world)
    other = SimpleActionServer(
        "other",
        Action,
        lambda goal: other.set_succeeded(),
        False,
        node=world.robot,
        resource=("base", "preempt"),
    )
    other.start()
    handle = ActionClient("other", Action, node=world.mission).send_goal(Goal(1))
    world.clock.sleep(0.5)
    assert first.is_preempt_requested()
    world.kill(first.action_server)
    simple(world, lambda goal: pytest.fail("begun again")).start()
    assert world.end_of(goal_id)[0] == Status.ABORTED
    ended.set()  # the thread of the first life, which holds the resource
    assert handle.wait(60)


# Clients that die while no server runs


def other_client(world, name="other"):
    client = ActionClient("work", Action, node=world.node(name))
    assert client.wait_for_server(5)
    return client


def statuses(server):
    return {
        handle.get_goal_id().id: handle.get_goal_status().status for handle in server.status_list
    }


@pytest.mark.parametrize("when", ["before", "after"])
def test_wish_of_a_goal_to_end_with_its_client_survives(world, when):
    server = world.serve(lambda handle: handle.set_accepted())
    client = other_client(world)
    ends, stays = (
        client.send_goal(Goal(1), cancel_on_client_lost=wanted).get_goal_id()
        for wanted in (True, False)
    )
    world.clock.sleep(0.5)
    world.kill(server)
    if when == "before":
        client.node.transport.close()
    begun = []

    def begin(handle):
        begun.append(handle.get_goal_id().id)
        handle.set_accepted()

    server = world.serve(begin, lambda handle: handle.set_canceled(), on_restart="resume")
    world.clock.sleep(CLIENTS_S - 1.0)
    assert statuses(server) == {ends: Status.ACTIVE, stays: Status.ACTIVE}
    # Without its client it is not begun: the robot drove on for these 10 s.
    assert sorted(begun) == sorted([stays] if when == "before" else [ends, stays])
    if when == "after":
        world.clock.sleep(2.0)
        assert statuses(server) == {ends: Status.ACTIVE, stays: Status.ACTIVE}
        client.node.transport.close()
    world.clock.sleep(2.0)
    end = Status.ABORTED if when == "before" else Status.PREEMPTED
    assert statuses(server) == {ends: end, stays: Status.ACTIVE}
    assert len(begun) == (1 if when == "before" else 2)
    server.stop()


def test_goal_that_waits_for_its_client_after_a_restart_can_be_cancelled(world):
    server = world.serve(lambda handle: handle.set_accepted())
    client = other_client(world)
    goal_id = client.send_goal(Goal(1), cancel_on_client_lost=True).get_goal_id()
    world.clock.sleep(0.5)
    world.kill(server)
    client.node.transport.close()
    server = world.serve(lambda handle: pytest.fail("begun"), on_restart="resume")
    world.clock.sleep(1.0)
    world.client.cancel_all_goals()
    world.clock.sleep(1.0)
    assert statuses(server) == {goal_id: Status.ABORTED}
    server.stop()


def test_server_that_cancels_goals_of_lost_clients_looks_for_those_of_its_former_life(world):
    options = {"on_restart": "resume", "on_client_lost": "cancel"}
    server = world.serve(lambda handle: handle.set_accepted(), **options)
    gone, there = other_client(world, "gone"), other_client(world, "there")
    ends, stays = (client.send_goal(Goal(1)).get_goal_id() for client in (gone, there))
    world.clock.sleep(0.5)
    world.kill(server)
    gone.node.transport.close()
    world.clock.sleep(0.5)
    server = world.serve(lambda handle: handle.set_accepted(), **options)
    world.clock.sleep(CLIENTS_S + 1.0)
    assert statuses(server) == {ends: Status.ABORTED, stays: Status.ACTIVE}
    server.stop()


def test_goal_of_which_nobody_knows_the_client_waits_for_none_after_a_restart(world):
    options = {"on_restart": "resume", "on_client_lost": "cancel"}
    server = world.serve(lambda handle: handle.set_accepted(), **options)
    server.keeper.on_goal("by_hand", 1, Goal(1), "")
    world.clock.sleep(0.5)
    world.kill(server)
    begun = []
    server = world.serve(begun.append, **options)
    world.clock.sleep(CLIENTS_S + 1.0)
    assert [handle.get_goal_id().id for handle in begun] == ["by_hand"]
    server.stop()


def test_goal_of_a_lost_client_that_another_life_was_to_stop_is_not_begun_again(world):
    """The server dies again between the request and the end."""
    server = world.serve(lambda handle: handle.set_accepted())
    client = other_client(world)
    goal_id = client.send_goal(Goal(1), cancel_on_client_lost=True).get_goal_id()
    world.clock.sleep(0.5)
    world.kill(server)
    client.node.transport.close()
    server = world.serve(lambda handle: handle.set_accepted(), on_restart="resume")
    world.clock.sleep(CLIENTS_S + 1.0)
    world.kill(server)
    world.serve(lambda handle: pytest.fail("begun again"), on_restart="resume")
    assert world.end_of(goal_id)[0] == Status.ABORTED


def test_server_that_stops_looks_for_no_clients(world):
    server = world.serve(lambda handle: handle.set_accepted())
    client = other_client(world)
    client.send_goal(Goal(1), cancel_on_client_lost=True)
    world.clock.sleep(0.5)
    world.kill(server)
    client.node.transport.close()
    lost = []
    server = world.serve(lambda handle: handle.set_accepted(), on_restart="resume")
    server.keeper.on_client_lost = lost.append
    server.stop()
    world.clock.sleep(CLIENTS_S + 1.0)
    assert lost == []


def test_goal_that_comes_as_the_server_starts_is_newer_than_those_of_before(world):
    """The resumed goal, which was delivered later, preempted it."""
    server = world.serve(lambda handle: handle.set_accepted())
    former = send(world)
    world.kill(server)
    ran = []

    def run(goal):
        ran.append((goal.goal, simple.wait_preempt(5.0)))
        simple.set_succeeded()

    kept = {"durable": world.file, "on_restart": "resume"}
    simple = SimpleActionServer("work", Action, run, False, node=world.new_life(), **kept)
    port = simple.action_server.keeper.port
    opened = port.open

    def open_and_wait(listener):
        opened(listener)
        world.clock.sleep(0.5)

    port.open = open_and_wait
    world.client.send_goal(Goal(2))
    simple.start()
    world.clock.sleep(10.0)
    assert ran == [(2, False)]
    assert world.end_of(former)[0] == Status.RECALLED


def test_file_of_the_version_before_gets_the_new_columns(world):
    server = world.serve(lambda handle: handle.set_accepted())
    goal_id = send(world)
    world.kill(server)
    with contextlib.closing(sqlite3.connect(world.file)) as raw:
        raw.execute("ALTER TABLE goals DROP COLUMN cancel_if_lost")
        raw.execute("ALTER TABLE goals DROP COLUMN superseded")
        raw.execute("PRAGMA user_version = 1")
    world.kill(world.serve(lambda handle: handle.set_accepted(), on_restart="resume"))
    world.serve(lambda handle: handle.set_accepted())
    assert world.end_of(goal_id)[0] == Status.ABORTED


def test_a_result_that_nobody_has_heard_is_told_later(world, tmp_path):
    """The client is gone as the goal ends, and the server before the client is back."""
    handles = []
    server = world.serve(lambda handle: (handle.set_accepted(), handles.append(handle)))
    other = world.node("other")
    goal_id = ActionClient("work", Action, node=other).send_goal(Goal(1)).get_goal_id()
    world.clock.sleep(0.5)
    other.transport.close()
    world.clock.sleep(0.5)
    handles[0].set_succeeded(Result(9), "alone")
    world.kill(server)
    world.serve(lambda handle: pytest.fail("begun again"))
    assert world.end_of(goal_id) == (Status.SUCCEEDED, "alone", Result(9))


def test_a_late_copy_of_a_goal_is_none_to_the_next_server(world):
    seen = []

    def run(handle):
        seen.append(handle.get_goal_id().id)
        handle.set_accepted()
        handle.set_succeeded()

    server = world.serve(run)
    goal_id = send(world)
    world.clock.sleep(3)  # the client has acknowledged
    world.kill(server)
    server = world.serve(run)
    assert server.keeper.on_goal(goal_id, 5, Goal(1), "somebody") is False
    world.clock.sleep(1)
    assert seen == [goal_id]
    assert server.keeper.find_end(goal_id)[0].status == Status.SUCCEEDED


def test_each_life_adds_to_the_file_and_a_result_is_told_through_several(world):
    server = world.serve(lambda handle: handle.set_accepted())
    ids = []
    for number in range(4):
        ids.append(send(world, number))
        world.kill(server)
        server = world.serve(lambda handle: handle.set_accepted(), on_restart="resume")
        world.clock.sleep(0.2)
    listed = {
        handle.get_goal_id().id: handle.get_goal_status().status for handle in server.status_list
    }
    assert listed == dict.fromkeys(ids, Status.ACTIVE)
    assert all(handle.resumed for handle in server.status_list)


def test_an_orderly_end_is_no_death(world):
    server = world.serve(lambda handle: handle.set_accepted())
    handle = world.client.send_goal(Goal(1))
    world.clock.sleep(0.5)
    server.stop()
    world.clock.sleep(1)
    assert handle.get_terminal_state() == Status.ABORTED
    assert world.serve(lambda handle: pytest.fail("begun again")).status_list == []


def test_a_simple_server_runs_its_goal_again(world):
    began = []
    first = simple(world, lambda goal: (began.append(first.is_resumed()), first.wait_preempt(1000)))
    first.start()
    goal_id = send(world)
    world.kill(first.action_server)

    def run(goal):
        began.append(second.is_resumed())
        second.publish_feedback(Feedback(1))
        second.set_succeeded(Result(goal.goal))

    second = simple(world, run)
    second.start()
    assert world.end_of(goal_id)[0] == Status.SUCCEEDED
    assert began == [False, True]
    first._preempted.set()  # the thread of the first life, which a kill would have ended


def test_a_goal_that_cannot_be_kept_is_not_run(world, monkeypatch):
    server = world.serve(lambda handle: pytest.fail("run"))
    server.keeper._file._connection.execute("PRAGMA query_only = 1")
    handle = world.client.send_goal(Goal(1))
    world.clock.sleep(1)
    assert handle.get_terminal_state() == Status.REJECTED
    server.keeper._file._connection.execute("PRAGMA query_only = 0")


# What time removes


def rows(world):
    """Return the goals in the file: status, whether it has the goal, whether it has a result."""
    with contextlib.closing(sqlite3.connect(world.file)) as raw:
        return raw.execute(
            "SELECT status, goal IS NOT NULL, result IS NOT NULL FROM goals ORDER BY rowid"
        ).fetchall()


def run_at_once(handle):
    handle.set_accepted()
    handle.set_succeeded(Result(1))


@pytest.mark.parametrize("acknowledged", [True, False], ids=["acknowledged", "client died"])
def test_results_leave_the_file_as_they_leave_the_memory(world, acknowledged):
    """Of clients that died, as of all ROS 2 clients, each result stayed for good."""
    server = world.serve(run_at_once, result_timeout=10.0)
    goal_ids = [world.client.send_goal(Goal(1)).get_goal_id() for _ in range(3)]
    if not acknowledged:
        world.mission.transport.close()
    world.clock.sleep(0.5)
    assert rows(world) == [(Status.SUCCEEDED, not acknowledged, not acknowledged)] * 3
    world.clock.sleep(20)
    assert rows(world) == [(Status.SUCCEEDED, False, False)] * 3
    goals = server.keeper.goals
    assert [goals.past_status(goal_id) for goal_id in goal_ids] == [Status.SUCCEEDED] * 3
    world.clock.sleep(MEMORY_S)
    handle = ActionClient("work", Action, node=world.node("later")).send_goal(Goal(2))
    assert handle.wait(5)
    world.clock.sleep(10)
    assert len(rows(world)) == 1
    server.stop()


def test_result_that_was_not_fetched_before_a_kill_is_kept_once_more_but_not_listed(world):
    server = world.serve(run_at_once, result_timeout=10.0)
    world.mission.transport.close()  # it hears no result
    handle = server.keeper.on_goal("lost", 1, Goal(1), "somebody")
    assert handle
    world.clock.sleep(1)
    world.mission = world.node("mission_2")
    for _ in range(3):  # lives
        world.kill(server)
        server = world.serve(run_at_once, result_timeout=10.0)
        assert server.keeper.list_goals() == []
        assert rows(world) == [(Status.SUCCEEDED, True, True)]
    world.clock.sleep(11)
    assert rows(world) == [(Status.SUCCEEDED, False, False)]
    server.stop()


def test_goal_that_nobody_ends_is_lost_in_the_next_life_too(world):
    server = world.serve(lambda handle: handle.set_accepted())
    goal_id = send(world)
    server.keeper.release(server.keeper.goals.find(goal_id))
    world.clock.sleep(10)
    assert rows(world) == [(Status.LOST, False, False)]
    world.kill(server)
    world.serve(lambda handle: pytest.fail("run again"), on_restart="resume")
    assert world.end_of(goal_id)[0] == Status.LOST


@pytest.mark.parametrize("step", [-7200.0, 7200.0])
def test_ids_are_remembered_whatever_the_clock_says(world, monkeypatch, step):
    """A clock that was set forward by an hour let a late copy of a goal run again."""
    server = world.serve(run_at_once)
    goal_id = send(world)
    world.kill(server)
    monkeypatch.setattr(world.clock, "time_ns", lambda: round((1e9 + step) * 1e9))
    server = world.serve(lambda handle: pytest.fail("run again"))
    assert not server.keeper.on_goal(goal_id, 1, Goal(1), "somebody")


def test_number_of_remembered_ids_in_the_file_is_limited(world, monkeypatch):
    monkeypatch.setattr("actionlib_core.action._durable.MEMORY_GOALS", 3)
    server = world.serve(run_at_once)
    goal_ids = [send(world) for _ in range(5)]
    world.kill(server)
    server = world.serve(run_at_once)
    remembered = [server.keeper.goals.past_status(goal_id) is not None for goal_id in goal_ids]
    assert remembered == [False, False, True, True, True]


def test_file_that_cannot_be_tidied_is_reported_and_nothing_else(world, caplog):
    server = world.serve(run_at_once)
    server.keeper._file._connection.execute("PRAGMA query_only = 0")
    monkey = server.keeper._file._connection
    send(world)
    monkey.execute("PRAGMA query_only = 1")
    server.keeper.goals.forgotten.append(("x", Status.SUCCEEDED))
    server.keeper._tidy_file()
    assert "cannot be removed" in caplog.text
    monkey.execute("PRAGMA query_only = 0")
    send(world)
    assert len(rows(world)) == 2


def test_servers_share_a_file(world):
    handles = []
    for name in ("left", "right"):
        ActionServer(name, Action, handles.append, node=world.robot, durable=world.file)
        client = ActionClient(name, Action, node=world.mission)
        assert client.wait_for_server(5)
        client.send_goal(Goal(1))
    world.clock.sleep(0.5)
    assert len(handles) == 2
    with contextlib.closing(sqlite3.connect(world.file)) as raw:
        assert sorted(raw.execute("SELECT action FROM goals")) == [("left",), ("right",)]


def test_nothing_is_written_without_durable(world):
    ActionServer("work", Action, node=world.robot)
    assert not world.file.parent.exists()


# Bad input


@pytest.mark.parametrize("on_restart", ["continue", "", None])
def test_another_policy_is_refused(world, on_restart):
    with pytest.raises(ActionException, match="on_restart"):
        ActionServer("work", Action, node=world.robot, on_restart=on_restart)


def test_goals_of_another_definition_are_refused_and_left(world):
    server = world.serve(lambda handle: handle.set_accepted())
    send(world)
    world.kill(server)
    for other in (TwoIntsAction, MoveBaseAction):
        with pytest.raises(DurableGoalsError, match="type"):
            ActionServer("work", other, node=world.new_life(), durable=world.file)
    with contextlib.closing(sqlite3.connect(world.file)) as raw:
        assert raw.execute("SELECT COUNT(*) FROM goals").fetchone() == (1,)


@pytest.mark.parametrize("content", [b"pick up milk\n" * 100, None, "table", "future"])
def test_a_file_that_is_none_of_ours_is_left_as_it_is(world, tmp_path, content):
    file = tmp_path / "other.db"
    if content is None:
        file.mkdir()
    elif isinstance(content, bytes):
        file.write_bytes(content)
    else:
        with contextlib.closing(sqlite3.connect(file)) as raw:
            raw.execute("CREATE TABLE songs (title TEXT)")
            if content == "future":
                raw.execute(f"PRAGMA application_id = {0x736D6767}")
                raw.execute("PRAGMA user_version = 3")
    before = file.is_file() and file.read_bytes()
    with pytest.raises(DurableGoalsError) as caught:
        ActionServer("work", Action, node=world.robot, durable=file)
    assert caught.value.file == str(file)
    assert "\n" not in str(caught.value)
    assert (file.is_file() and file.read_bytes()) == before
    ActionServer("work", Action, node=world.robot)  # the name is free


# Real processes

SERVER = """
import sys
from actionlib_core import SimpleActionServer
from actionlib_core.interfaces.actionlib.msg import TestAction, TestFeedback, TestResult

def run(goal):
    if server.is_resumed():
        server.set_succeeded(TestResult(goal.goal + 1))
    else:
        print("begun", flush=True)
        server.wait_preempt(60.0)

server = SimpleActionServer("durable_server", TestAction, run, auto_start=False, durable=sys.argv[1], on_restart=sys.argv[2])
server.start()
server.wait()
"""


@pytest.mark.zenoh
@pytest.mark.parametrize(
    ("on_restart", "status", "result"),
    [("abort", Status.ABORTED, Result()), ("resume", Status.SUCCEEDED, Result(42))],
)
def test_kill_9_and_a_new_process(tmp_path, on_restart, status, result):

    @contextlib.contextmanager
    def server():
        with subprocess.Popen(
            [sys.executable, "-c", SERVER, str(tmp_path / "goals.db"), on_restart],
            stdout=subprocess.PIPE,
        ) as process:
            try:
                yield process
            finally:
                os.kill(process.pid, signal.SIGKILL)

    @contextlib.contextmanager
    def client():
        with contextlib.ExitStack() as stack:
            transport = ZenohTransport()
            stack.callback(transport.close)
            node = Node("mission", transport=transport)
            stack.callback(node.close)
            yield ActionClient("durable_server", Action, node=node)

    with client() as sender, server() as first:
        assert sender.wait_for_server(60)
        goal_id = sender.send_goal(Goal(41)).get_goal_id()
        assert first.stdout.readline() == b"begun\n"
        sender.stop()
    with server(), client() as follower:
        assert follower.wait_for_server(60)
        with follower.follow(goal_id, timeout=60) as sent:
            sent.wait()
            assert (sent.status, sent.get_result()) == (status, result)


@pytest.mark.parametrize("spec", [Fibonacci])
def test_goals_of_ros2_types_are_kept(tmp_path, spec):
    from actionlib_core.action._durable import GoalFile
    from actionlib_core.goal.server import ServerGoal
    from actionlib_core.wire.action_types import ActionTypes

    types = ActionTypes.of(spec)
    file = GoalFile(tmp_path / "goals.db", "/fibonacci", types)
    goal = types.goal(order=5)
    assert file.add(ServerGoal("id", 5), goal) is None
    file.close()
    again = GoalFile(tmp_path / "goals.db", "/fibonacci", types)
    ((kept,), past) = again.load()
    assert (kept.content, kept.begun, past) == (goal, False, {})
    again.close()
