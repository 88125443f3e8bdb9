"""The action commands, typed into one process on a network in memory."""

from __future__ import annotations

import io
import json
import os
import signal
import threading

import pytest

from actionlib_core import Abort, Preempted, Reject, server
from actionlib_core.action.client import GoalManager
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.cli import main
from actionlib_core.clock import RealClock
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus, GoalStatusArray
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.actions import GOAL
from actionlib_core.wire.encoding import encoding_of


@server("robot/count", msg.TestAction)
def count(goal, ctx):
    if goal.goal < 0:
        raise Reject("only forward")
    if goal.goal == 7:
        raise Abort("seven")
    for number in range(goal.goal):
        ctx.feedback(msg.TestFeedback(number))
        if goal.goal > 100 and ctx.sleep(10.0):
            raise Preempted("stopped")
    return msg.TestResult(2 * goal.goal)


class Shell:
    """Runs commands and tells what they printed."""

    def __init__(self, network, clock, capsys):
        self.clock = clock
        self.node = Node("shell", transport=network.session(), clock=clock)
        self._capsys = capsys

    def __call__(self, *argv, code=0):
        self._capsys.readouterr()
        assert main(argv, node=self.node) == code
        out, err = self._capsys.readouterr()
        return out if not code else out + err

    def output(self):
        return self._capsys.readouterr()

    def json(self, *argv, code=0):
        return json.loads(self(*argv, "--json", code=code))


@pytest.fixture
def shell(network, clock, capsys):
    return Shell(network, clock, capsys)


@pytest.fixture
def counting(network, clock):
    node = Node("counter", transport=network.session(), clock=clock)
    with count.start(node=node):
        yield node
    node.close()


def test_list(shell, counting):
    assert shell("list") == "/robot/count\n"
    assert shell("list", "-t") == "/robot/count [actionlib/action/Test]\n"
    assert shell("list", "-c") == "1\n"
    assert shell.json("list") == [{"name": "/robot/count", "types": ["actionlib/action/Test"]}]


def test_list_of_nothing(shell):
    assert shell("list") == ""


def test_info(shell, counting):
    assert shell("info", "/robot/count", "-t") == (
        "Action: /robot/count\nAction clients: 0\nAction servers: 1\n"
        "    /counter [actionlib/action/Test]\n"
    )
    assert shell("info", "robot/count", "-c").endswith("Action servers: 1\n")
    assert shell.json("info", "robot/count")["servers"][0]["node"] == "/counter"


def test_type_and_find(shell, counting):
    assert shell("type", "robot/count") == "actionlib/action/Test\n"
    for name in ("actionlib/Test", "actionlib/action/Test", "actionlib/TestAction"):
        assert shell("find", name) == "/robot/count\n"
    assert shell("find", "actionlib/TestRequest", "-c") == "0\n"


def test_send_goal_with_feedback(shell, counting):
    out = shell("send_goal", "robot/count", "{goal: 2}", "-f")
    goal_id = out.partition("ID: ")[2].partition("\n")[0]
    assert goal_id.startswith("/shell-")
    assert out == (
        "Waiting for an action server to become available...\n"
        "Sending goal:\n    goal: 2\n\n"
        f"Goal accepted with ID: {goal_id}\n\n"
        "Feedback:\n    feedback: 0\n\n"
        "Feedback:\n    feedback: 1\n\n"
        "Result:\n    result: 4\n\n"
        "Goal finished with status: SUCCEEDED\n"
    )


def test_send_goal_ends_that_are_no_success(shell, counting):
    out = shell("send_goal", "robot/count", "actionlib/Test", "{goal: -1}", code=1)
    assert out.endswith("Goal was rejected. only forward\n")
    out = shell("send_goal", "robot/count", "{goal: 7}", code=1)
    assert out.endswith("Goal finished with status: ABORTED (seven)\n")


def test_send_goal_json_and_stdin(shell, counting, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("goal: 1\n"))
    lines = shell("send_goal", "robot/count", "--stdin", "-f", "--json").splitlines()
    events = [json.loads(line) for line in lines]
    assert [event["event"] for event in events] == ["accepted", "feedback", "result"]
    assert events[-1]["status"] == "SUCCEEDED"
    assert events[-1]["result"] == {"result": 2}


def test_send_goal_timeouts(shell, counting):
    out = shell("send_goal", "robot/count", "{goal: 1000}", "--timeout", "3", code=1)
    assert "Canceling goal...\nGoal canceled.\n" in out
    assert "Goal finished with status: PREEMPTED (stopped)" in out
    assert "not over within 3 s" in out
    out = shell("send_goal", "nobody", "{}", "--timeout", "3", code=2)
    assert "action '/nobody': got no server within 3 s" in out


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_cancels_the_goal_first(shell, counting, monkeypatch, number, code):
    from actionlib_core.cli import send_goal

    def follow(handle, _args):
        handle.next_feedback()
        signal.raise_signal(number)

    monkeypatch.setattr(send_goal, "_follow", follow)
    before = signal.getsignal(signal.SIGTERM)
    out = shell("send_goal", "robot/count", "{goal: 1000}", code=code)
    assert signal.getsignal(signal.SIGTERM) is before
    assert "Canceling goal...\nGoal canceled.\n" in out
    assert out.endswith("Goal finished with status: PREEMPTED (stopped)\n")


def test_a_signal_as_the_goal_is_sent_cancels_it(shell, counting, monkeypatch):
    """The server had the goal, and the command no handle of it: the robot drove on."""
    begin = GoalManager.begin

    def begin_and_raise(manager, handle):
        begin(manager, handle)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(GoalManager, "begin", begin_and_raise)
    out = shell("send_goal", "robot/count", "{goal: 1000}", code=130)
    assert "Canceling goal...\nGoal canceled.\n" in out


def test_goal_that_ends_in_spite_of_the_cancel_is_not_called_canceled(shell, network, clock):
    node = Node("deaf", transport=network.session(), clock=clock)
    server = SimpleActionServer(
        "deaf",
        msg.TestAction,
        lambda goal: (clock.sleep(goal.goal), server.set_succeeded()),
        auto_start=False,
        node=node,
    )
    server.start()
    out = shell("send_goal", "deaf", "{goal: 5}", "--timeout", "3", code=1)
    assert "Canceling goal..." in out
    assert "Goal canceled." not in out
    assert "Goal finished with status: SUCCEEDED" in out
    out = shell("send_goal", "deaf", "{goal: 50}", "--timeout", "3", code=1)
    assert "Goal not finished; last status: PREEMPTING" in out
    node.close()


class Head(io.TextIOWrapper):
    """An output whose reader leaves before so many writes."""

    def __init__(self, writes):
        self._writes = writes
        self._reader, writer = os.pipe()
        super().__init__(os.fdopen(writer, "wb"))

    def write(self, text):
        if self._writes == 0:
            os.close(self._reader)
        self._writes -= 1
        return super().write(text)


@pytest.mark.parametrize("writes", [0, 2, 4, 8])
def test_goal_is_cancelled_when_nobody_reads_any_more(shell, counting, monkeypatch, writes):
    """`actionlib send_goal ... -f | head` ended with code 0, and the robot drove on."""
    with Head(writes) as output, monkeypatch.context() as patch:
        patch.setattr("sys.stdout", output)
        assert main(["send_goal", "robot/count", "{goal: 1000}", "-f"], node=shell.node) == 1
        assert output._writes < 0
    assert shell.json("goal", "list", "robot/count") == []


@pytest.mark.parametrize("writes", [6, 8])
def test_goal_that_succeeded_unread_has_succeeded(shell, counting, monkeypatch, writes):
    with Head(writes) as output, monkeypatch.context() as patch:
        patch.setattr("sys.stdout", output)
        assert main(["send_goal", "robot/count", "{goal: 1}"], node=shell.node) == 0
        assert output._writes < 0


def test_reader_of_a_list_may_leave(shell, counting, monkeypatch):
    with Head(0) as output, monkeypatch.context() as patch:
        patch.setattr("sys.stdout", output)
        assert main(["list"], node=shell.node) == 0


@pytest.mark.parametrize(
    ("argv", "text"),
    [
        (["send_goal", "robot/count", "{gaol: 1}"], "Did you mean 'goal'"),
        (["send_goal", "robot/count", "{goal: 1", "}"], "got 2 goals"),
        (["send_goal", "robot/count", "actionlib/Tset", "{}"], "actionlib/Tset"),
        (["send_goal", "robot//count", "{}"], "'//' is not allowed"),
        (["cancel", "robot/count"], "got no ID, --all or --before"),
        (["cancel", "robot/count", "x", "--all"], "--all beside ID"),
        (["cancel", "robot/count", "--before", "noon"], "expected seconds since the epoch"),
        (["info", "nobody"], "Try 'actionlib list'"),
        (["info", "robot/cuont"], "Did you mean '/robot/count'?"),
        (["type", "count"], "expected one of ['/robot/count']"),
        (["cancel", "robot/coun", "--all"], "Did you mean '/robot/count'?"),
        (["goal", "list", "nobody"], "got no server"),
        (["goal", "info", "robot/count", "\udcff"], "ID: got '\\udcff'; expected a goal's id"),
        (["cancel", "robot/count", "\udcff"], "ID: got '\\udcff'; expected a goal's id"),
    ],
)
def test_mistakes_fit_on_a_screen(shell, counting, argv, text):
    out = shell(*argv, code=2)
    assert text in out
    assert "Traceback" not in out
    assert "Traceback" in shell("--debug", *argv, code=2)


def test_unknown_command_exits_with_2(shell, capsys):
    with pytest.raises(SystemExit) as caught:
        main(["lsit"], node=shell.node)
    assert caught.value.code == 2
    assert "--help" in capsys.readouterr().err


def test_goals_are_listed_shown_and_cancelled(shell, network, clock):
    from actionlib_core.action.client import ActionClient

    node = Node("keeper", transport=network.session(), clock=clock)
    ActionServer(
        "keep",
        msg.TestAction,
        lambda handle: handle.set_accepted("yours"),
        lambda handle: handle.set_canceled(msg.TestResult(5), "as you wish"),
        node=node,
    )
    client = ActionClient("keep", msg.TestAction, node=node)
    assert client.wait_for_server(1.0)
    first = client.send_goal(msg.TestGoal(1))
    clock.sleep(1.0)
    second = client.send_goal(msg.TestGoal(2))
    clock.sleep(1.0)
    ids = [goal["id"] for goal in shell.json("goal", "list", "keep")]
    assert ids == [first.get_goal_id(), second.get_goal_id()]
    assert shell("goal", "list", "keep", "-c") == "2\n"
    assert f"{ids[0]} ACTIVE 1000000000.000 yours\n" in shell("goal", "list", "keep")
    assert "Status: ACTIVE" in shell("goal", "info", "keep", ids[0])
    assert shell("goal", "info", "keep", ids[0]).endswith("Content:\n    goal: 1\n\n")
    assert shell("goal", "info", "keep", ids[0], "--goal-only") == "Goal:\n    goal: 1\n\n"
    assert "goal: 1" not in shell("goal", "info", "keep", ids[0], "--status-only")
    assert shell.json("goal", "info", "keep", ids[1], "--goal-only") == {"goal": 2}
    shown = shell.json("goal", "info", "keep", ids[1])
    assert (shown["status"], shown["goal"], shown["result"]) == ("ACTIVE", {"goal": 2}, None)
    shown = shell("goal", "info", "keep", ids[0], "--result-only", code=1)
    assert "its result is not there; its status is ACTIVE." in shown
    shown = shell("goal", "info", "keep", "unknown", "--goal-only", code=1)
    assert "its goal is not there; its status is LOST." in shown
    for zero in ("0", "0.0", "0.0000000009"):  # the stamp 0 means all goals on the wire
        refused = shell("cancel", "keep", "--before", zero, code=2)
        assert f"got '{zero}'; expected seconds since the epoch above 0. Try --all" in refused
    assert not first.wait(1.0)
    assert not second.wait(1.0)
    assert shell("cancel", "keep", "--before", "1000000000.5") == (
        f"Cancel requested for goal {ids[0]}\n"
    )
    assert first.wait(1.0)
    assert shell.json("cancel", "keep", "--all") == {"cancelled": [ids[1]]}
    assert second.wait(1.0)
    wrong = shell("cancel", "keep", "unknown-1", code=1)
    assert "got goal 'unknown-1'; expected one of []. The server remembers the cancel" in wrong
    assert shell.json("cancel", "keep", "unknown-1", code=1) == {"cancelled": []}
    assert "unknown-1" not in shell("goal", "list", "keep")
    assert shell.json("cancel", "keep", "--all") == {"cancelled": []}
    assert shell("cancel", "keep", "--all") == "No running goal is meant.\n"
    clock.sleep(1.0)
    shown = shell("goal", "info", "keep", ids[0], code=0)
    assert "Status: PREEMPTED" in shown
    assert "expected a goal's id" in shell("goal", "info", "keep", "", code=2)
    assert "Status: LOST" in shell("goal", "info", "keep", "never-1-1.1", code=1)
    node.close()


@pytest.mark.parametrize("encoding", ["", encoding_of(GoalStatus), encoding_of(GoalStatusArray)])
def test_answers_of_others_that_cannot_be_read_are_passed_over(shell, network, clock, encoding):
    """They ended the commands with a traceback; a cancel was then not sent."""

    def answer(query):
        query.reply(b"garbage", encoding)
        query.finish()

    session = network.session()
    for word in ("result", "goal"):
        session.queryable(f"robot/count/{word}", answer)
    with Node("counter", transport=network.session(), clock=clock) as node, count.start(node=node):
        assert shell("goal", "list", "robot/count") == ""
        assert "Status: LOST" in shell("goal", "info", "robot/count", "x", code=1)
        assert shell("cancel", "robot/count", "--all") == "No running goal is meant.\n"
    session.close()


def test_definitions_of_installed_packages_are_known(shell, capsys):
    assert shell("find", "mission_msgs/Charge") == ""
    assert "mission_msgs/action/Charge" in shell("interface", "list", "-a")
    assert "until" in shell("interface", "show", "mission_msgs/Charge")
    assert "Try mission_msgs/action/Charge." in shell("interface", "show", "Charge", code=2)


def test_echo_prints_what_passes(shell, counting, clock, capsys):
    def later():
        clock.sleep(1.0)
        main(["send_goal", "robot/count", "{goal: 1}", "--json"], node=shell.node)

    clock.spawn(later, name="later")
    out = shell("echo", "robot/count", "--timeout", "5", "--json")
    topics = [json.loads(line).get("topic") for line in out.splitlines()]
    assert [topic for topic in topics if topic] == ["goal", "feedback", "result"]


def test_echo_ends_after_enough(shell, counting, clock):
    def later():
        clock.sleep(1.0)
        main(["send_goal", "robot/count", "{goal: 9}", "--json"], node=shell.node)

    task = clock.spawn(later, name="later")
    out = shell("echo", "robot/count", "-n", "3", "--json")
    lines = [json.loads(line) for line in out.splitlines()]
    assert [line["topic"] for line in lines if "topic" in line] == ["goal", "feedback", "feedback"]
    task.join()
    out = shell("echo", "robot/count", "--once", "--timeout", "2", code=1)
    assert "/robot/count: not enough in 2 s" in out


def test_echo_drops_what_it_cannot_read(shell, counting, clock, caplog):
    """One message of a wrong form or type ended it."""

    def later():
        clock.sleep(1.0)
        for encoding in ("", encoding_of(msg.TestGoal)):
            wrong = shell.node.transport.publisher("robot/count/goal", encoding, GOAL)
            wrong.put(b"")
            wrong.put(b"no goal")
            wrong.close()
        main(["send_goal", "robot/count", "{goal: 0}", "--json"], node=shell.node)

    task = clock.spawn(later, name="later")
    code = main(["echo", "robot/count", "-n", "2"], node=shell.node)
    task.join()
    out, err = shell.output()
    assert code == 0
    assert "goal:\n    header:" in out
    assert "result:\n    header:" in out
    assert err.count("actionlib: goal: a message cannot be read: ") == 1
    assert "types differ: got 'actionlib/TestGoal'" in caplog.text


def test_server_by_hand(capsys, monkeypatch):
    from actionlib_core.action.simple_client import SimpleActionClient
    from actionlib_core.cli import server as module

    clock = RealClock()
    network = MemoryNetwork(clock)
    node = Node("hand", transport=network.session(), clock=clock)
    came = threading.Event()

    class Operator:
        """Standard input: answers goals as they come."""

        def __iter__(self):
            assert came.wait(60)
            yield "1 feedback {feedback: 3}\n"
            yield "accept fine\n"
            yield "nonsense\n"
            yield "² accept\n"
            yield "1" * 5000 + " accept\n"
            yield "1 feedback {feedback: 3}\n"
            yield "list\n"
            yield "succeed {result: 8}\n"
            yield "succeed\n"
            done.wait(60)
            yield "quit\n"

    class Watched(module.Operator):
        def on_goal(self, handle):
            super().on_goal(handle)
            came.set()

    seen, done = [], threading.Event()
    monkeypatch.setattr("sys.stdin", Operator())
    monkeypatch.setattr(module, "Operator", Watched)
    client = SimpleActionClient(
        "byhand", msg.TestAction, node=Node("c", transport=network.session(), clock=clock)
    )

    def drive():
        assert client.wait_for_server(60)
        client.send_goal(msg.TestGoal(1), feedback_cb=lambda f: seen.append(f.feedback))
        client.wait_for_result(60)
        done.set()

    thread = threading.Thread(target=drive)
    thread.start()
    assert main(["server", "byhand", "actionlib/Test"], node=node) == 0
    thread.join(60)
    out, err = capsys.readouterr()
    assert client.get_state() == 3
    assert client.get_result().result == 8
    assert client.get_goal_status_text() == ""
    assert seen[-1] == 3
    assert "Goal 1 (" in out
    assert "1 ACTIVE" in out
    assert "got 'nonsense'; expected one of" in err
    assert "got '²'; expected one of" in err
    assert "got '1111" in err
