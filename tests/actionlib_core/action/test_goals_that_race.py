"""Goals, cancels and stops of a simple server that come at the same moment, forced."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from actionlib_core import (
    Abort,
    ActionClient,
    ActionServer,
    SimpleActionClient,
    SimpleActionServer,
    server,
)
from actionlib_core.exceptions import ServerConflictError, TransportError
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib.msg import (
    TestAction,
    TestFeedback,
    TestGoal,
    TestResult,
)
from smachpy import ActionServerWrapper, State, StateMachine
from smachpy.events import PreemptRequested
from tests.two_nodes import TwoNodes


@pytest.fixture
def world():
    with TwoNodes() as world:
        yield world


def client(world):
    made = SimpleActionClient("a", TestAction, node=world.mission)
    made.wait_for_server()
    return made


def first(function, before):
    """Return `function`, which calls `before` with its arguments once, first."""
    left = [before]

    def wrapped(*arguments, **options):
        if left:
            left.pop()(*arguments)
        return function(*arguments, **options)

    return wrapped


@pytest.mark.parametrize("runs_goals", [True, False])
def test_a_cancel_of_all_that_comes_as_a_goal_is_delivered_is_not_lost(world, runs_goals):
    """The goal ran to its end, and every later cancel was ignored."""
    asked, ran = [], []

    def execute(_goal):
        ran.append(True)

    def take():
        simple.accept_new_goal()
        asked.append(simple.is_preempt_requested())
        simple.set_preempted(TestResult(1))

    simple = SimpleActionServer(
        "a", TestAction, execute if runs_goals else None, False, node=world.robot
    )
    if not runs_goals:
        simple.register_goal_callback(take)
    keeper = simple.action_server.keeper
    keeper._deliver_goal = first(keeper._deliver_goal, lambda _: keeper.on_cancel("", 0))
    simple.start()

    sender = client(world)
    sender.send_goal(TestGoal(1))
    assert sender.wait_for_result(60.0)

    assert sender.get_state() == (Status.RECALLED if runs_goals else Status.PREEMPTED)
    assert (ran, asked) == ([], [] if runs_goals else [True])


@pytest.mark.parametrize("how", ["stop", "close", "conflict"])
def test_a_server_that_stops_calls_its_preempt_callback(world, how):
    """Its code drove on: it was told of cancels and of newer goals only."""
    heard = []
    simple = SimpleActionServer("a", TestAction, None, False, node=world.robot)
    simple.register_goal_callback(simple.accept_new_goal)
    simple.register_preempt_callback(lambda: heard.append(simple.is_preempt_requested()))
    simple.start()
    sender = client(world)
    sender.send_goal(TestGoal(1))
    world.clock.sleep(1.0)
    assert simple.is_active()

    end(world, simple.action_server, simple.stop, how)
    world.clock.sleep(1.0)

    assert heard == [True]


def test_a_server_that_gives_way_and_is_stopped_then_asks_its_code_once(world):
    """The second request would end what the first has led to, such as the way home."""
    heard = []
    simple = SimpleActionServer(
        "a", TestAction, lambda _goal: world.clock.sleep(30.0), False, node=world.robot
    )
    simple.register_preempt_callback(lambda: heard.append(True))
    simple.start()
    client(world).send_goal(TestGoal(1))
    world.clock.sleep(1.0)

    end(world, simple.action_server, simple.stop, "conflict")
    world.clock.sleep(1.0)
    simple.stop()
    world.clock.sleep(1.0)

    assert heard == [True]


def end(world, action_server, stop, how):
    if how == "stop":
        stop()
    elif how == "close":
        world.robot.close()
    else:
        action_server.keeper.on_conflict(ServerConflictError("a", ("robot", "2"), ("robot", "1")))


@pytest.mark.parametrize("how", ["stop", "close", "conflict"])
def test_the_goals_of_a_server_that_stops_are_asked_to_stop_once(world, how):
    """Their code heard nothing, and no cancel could reach it any more."""
    running, asked = [], []

    def take(goal):
        goal.set_accepted()
        running.append(goal)

    def stop(goal):
        asked.append(goal.get_goal_id().id)
        goal.set_canceled()

    action_server = ActionServer("a", TestAction, take, stop, node=world.robot)
    client(world).send_goal(TestGoal(1))
    world.clock.sleep(1.0)
    (goal,) = running
    assert goal.record.status is Status.ACTIVE

    end(world, action_server, action_server.stop, how)
    world.clock.sleep(1.0)
    action_server.stop()
    world.clock.sleep(1.0)

    assert asked == [goal.get_goal_id().id]
    assert goal.record.status is Status.PREEMPTED


@pytest.mark.parametrize("how", ["stop", "close", "conflict"])
def test_the_machine_of_a_server_that_stops_is_preempted(world, how):
    class Drives(State):
        def __init__(self):
            super().__init__(["done", "preempted"])

        def execute(self, userdata):
            return "preempted" if self.sleep(30.0) else "done"

    ended, asked = [], []
    machine = StateMachine(["done", "preempted"])
    machine.add("DRIVE", Drives())
    machine.register_termination_cb(lambda _userdata, _labels, outcome: ended.append(outcome))
    machine.subscribe(lambda e: asked.append(e.why) if isinstance(e, PreemptRequested) else None)
    wrapper = ActionServerWrapper(
        "a", TestAction, machine, ["done"], [], ["preempted"], node=world.robot
    )
    wrapper.run_server()
    client(world).send_goal(TestGoal(1))
    world.clock.sleep(1.0)

    end(world, wrapper._ActionServerWrapper__action_server.action_server, wrapper.stop, how)
    world.clock.sleep(1.0)

    assert ended == ["preempted"]
    assert set(asked) == {"the server stops"}
    assert len(asked) == 2  # once for the machine, and once for its state


def test_a_goal_that_comes_as_the_server_begins_to_stop_is_rejected(world):
    """It ran on after stop() had returned, and nobody had asked it to stop."""
    ran = []
    simple = SimpleActionServer("a", TestAction, ran.append, False, node=world.robot)
    simple.start()
    sender = client(world)
    lock = simple.lock

    class Late:
        """The lock, which another thread has first, to stop the server."""

        def __enter__(self):
            simple.lock = lock
            simple._begin_to_stop()
            return lock.__enter__()

        def __exit__(self, *error):
            return lock.__exit__(*error)

    simple.lock = Late()
    sender.send_goal(TestGoal(1))
    assert sender.wait_for_result(60.0)
    simple.stop()

    assert sender.get_state() == Status.REJECTED
    assert not ran


def test_a_new_goal_is_accepted_although_the_old_one_ends_at_that_moment(world):
    """It stayed pending for ever."""
    simple = SimpleActionServer("a", TestAction, None, False, node=world.robot)
    simple.register_goal_callback(simple.accept_new_goal)
    simple.start()
    one, two = client(world), client(world)
    one.send_goal(TestGoal(1))
    world.clock.sleep(1.0)
    keeper, real = simple.action_server.keeper, simple.action_server.keeper.step

    def step(handle, event, *arguments, **options):
        if event == "cancel":  # another thread ends it just before
            keeper.step = real
            real(handle, "succeed", "set_succeeded()", TestResult(1), "")
        return real(handle, event, *arguments, **options)

    keeper.step = step
    two.send_goal(TestGoal(2))
    world.clock.sleep(1.0)

    assert one.get_state() == Status.SUCCEEDED
    assert two.get_state() == Status.ACTIVE
    simple.set_succeeded(TestResult(2))
    assert two.wait_for_result(60.0)


def test_a_thread_that_outlives_its_goal_is_not_told_of_the_next_one(world):
    """It was told that nobody had asked it, and drove on; its feedback went to the next goal."""
    asked, heard, goals = [], [], []

    @server("a", TestAction)
    def drive(goal, context):
        goals.append(context)
        context.wait_preempt()
        return TestResult(goal.goal)

    with drive.start(node=world.robot):
        sender = client(world)
        sender.send_goal(TestGoal(1))
        world.clock.sleep(1.0)
        assert not goals[0].preempted
        sender.send_goal(TestGoal(2), feedback_cb=lambda each: heard.append(each.feedback))
        world.clock.sleep(1.0)
        asked += [goals[0].preempted, goals[0].sleep(5.0), goals[1].preempted]
        goals[0].feedback(TestFeedback(1))
        goals[1].feedback(TestFeedback(2))
        world.clock.sleep(1.0)
    assert asked == [True, True, False]
    assert heard == [2]


@pytest.mark.parametrize("end", [None, Abort("no way"), ValueError("a slip")])
def test_a_thread_that_waits_for_a_preempt_hears_of_the_end_of_its_goal(world, end, caplog):
    """It slept on through all later goals, until one of them was asked to stop."""
    heard = []

    @server("a", TestAction)
    def drive(goal, context):
        def watch():
            heard.append((goal.goal, context.wait_preempt(), world.clock.now() - begun))

        begun = world.clock.now()
        world.clock.spawn(watch, name="watch")
        world.clock.sleep(1.0)
        if end is not None:
            raise end
        return TestResult(goal.goal)

    with drive.start(node=world.robot):
        sender = client(world)
        for number in (1, 2):
            sender.send_goal(TestGoal(number))
            assert sender.wait_for_result(60.0)
            world.clock.sleep(1.0)
            assert heard == [(n, True, 1.0) for n in range(1, number + 1)]


def test_a_server_whose_preempt_cannot_be_told_leaves_the_network_all_the_same(world):
    """It stayed on the network, and took goals that nobody answered."""

    @server("a", TestAction)
    def drive(goal, context):
        context.sleep(30.0)
        return TestResult(1)

    running = drive.start(node=world.robot)
    client(world).send_goal(TestGoal(1))
    world.clock.sleep(1.0)

    def closed():
        raise RuntimeError("Event loop is closed")

    running._runner._cancel_task = closed
    with pytest.raises(RuntimeError):
        running.stop()

    assert running.wait(0.0)


def test_a_goal_for_which_no_thread_can_be_started_is_rejected(world, monkeypatch):
    """It stayed pending until another goal came."""
    ran = []

    def execute(goal):
        ran.append(goal.goal)
        simple.set_succeeded()

    simple = SimpleActionServer("a", TestAction, execute, False, node=world.robot)
    simple.start()
    sender = client(world)
    start, left = simple._start, ["one"]

    def start_late():
        if left:
            left.pop()
            raise RuntimeError("can't start new thread")
        return start()

    monkeypatch.setattr(simple, "_start", start_late)
    for goal in (1, 2):
        sender.send_goal(TestGoal(goal))
        assert sender.wait_for_result(5.0)
        assert ran == [2][: goal - 1]
        assert sender.get_state() == (Status.REJECTED, Status.SUCCEEDED)[goal - 1]


def refuse(*_arguments, **_options):
    raise RuntimeError("can't start new thread")


def test_a_goal_whose_callback_gets_a_thread_late_runs_then_and_is_cancelled(world, monkeypatch):
    """It stayed pending, whatever its client did, and ran when the next goal came."""
    ran = []

    def take(handle):
        ran.append(handle.get_goal().goal)
        handle.set_accepted()

    robot = ActionServer("a", TestAction, take, lambda goal: goal.set_canceled(), node=world.robot)
    sender = client(world)
    with monkeypatch.context() as without:
        without.setattr(robot.callback_queue._executor, "_spawn", refuse)
        sender.send_goal(TestGoal(1))
        world.clock.sleep(1.0)
        sender.cancel_goal()
        world.clock.sleep(1.0)
    assert ran == []
    assert sender.wait_for_result(5.0)
    assert (ran, sender.get_state()) == ([1], Status.PREEMPTED)


@pytest.mark.parametrize("simple", [True, False])
def test_a_goal_is_rejected_when_no_thread_can_be_started_at_all(world, monkeypatch, simple):
    """Not even one for the timers, which the status list needs, too."""
    ran = []
    if simple:
        simple = SimpleActionServer("a", TestAction, ran.append, False, node=world.robot)
        simple.start()
        robot = simple.action_server
    else:
        robot = ActionServer("a", TestAction, ran.append, node=world.robot)
    sender = client(world)
    full = SimpleNamespace(now=world.clock.now, call_later=refuse)
    with monkeypatch.context() as without:
        without.setattr(robot.keeper.status, "_clock", full)
        without.setattr(robot.callback_queue._executor, "_clock", full)
        without.setattr(robot.callback_queue._executor, "_spawn", refuse)
        if simple:
            without.setattr(simple, "_start", refuse)
        sender.send_goal(TestGoal(1))
        assert sender.wait_for_result(5.0)
    assert (ran, sender.get_state()) == ([], Status.REJECTED)
    sender.send_goal(TestGoal(2))
    assert sender.wait_for_result(5.0) == bool(simple)
    assert len(ran) == 1  # the rejected one does not come after all


def test_a_goal_that_has_ended_before_its_callback_had_its_turn_is_not_begun(world):
    """Behind a callback that blocked, it came after the server had stopped and rejected it."""
    ran, held = [], world.clock.event()

    def take(handle):
        ran.append(handle.get_goal().goal)
        held.wait(60.0)

    robot = ActionServer("a", TestAction, take, node=world.robot)
    for goal in (1, 2):
        client(world).send_goal(TestGoal(goal))
        world.clock.sleep(1.0)
    robot.stop()
    held.set()
    world.clock.sleep(1.0)
    assert ran == [1]


def test_every_goal_of_a_dead_server_is_lost_though_one_can_start_no_thread(world, monkeypatch):
    """Those after it were followed for ever."""
    ActionServer("a", TestAction, lambda goal: goal.set_accepted(), node=world.robot)
    clients = [ActionClient("a", TestAction, node=world.mission) for _ in range(3)]
    clients[0].wait_for_server()
    goals = [one.send_goal(TestGoal(1), transition_cb=bool) for one in clients]
    world.clock.sleep(1.0)
    with monkeypatch.context() as without:
        for one in clients:
            without.setattr(one._owner.callbacks._executor, "_spawn", refuse)
        world.robot.transport.kill()
        world.clock.sleep(1.0)
    assert [goal.get_goal_status() for goal in goals] == [Status.LOST] * 3
    assert all(goal.wait(5.0) for goal in goals)


def test_a_client_repeats_later_goals_after_its_timer_could_not_be_started(world, monkeypatch):
    """It took the timer that it had not got for one that runs, and set no other."""
    sender = ActionClient("a", TestAction, node=world.mission)
    manager, call_later = sender.manager, world.clock.call_later

    def call_others(delay, callback):
        return refuse() if callback == manager._on_timer else call_later(delay, callback)

    with monkeypatch.context() as without:
        without.setattr(world.clock, "call_later", call_others)
        with pytest.raises(RuntimeError, match="new thread"):
            sender.send_goal(TestGoal(1))
    goal = sender.send_goal(TestGoal(2), ack_timeout=1.0)
    world.clock.sleep(5.0)
    assert goal.get_goal_status() == Status.LOST


def test_a_stopped_client_follows_no_goal_of_another_one(world):
    simple = SimpleActionServer("a", TestAction, lambda goal: None, False, node=world.robot)
    simple.start()
    stopped = ActionClient("a", TestAction, node=world.mission)
    sender = ActionClient("a", TestAction, node=world.mission)
    goal_id = sender.send_goal(TestGoal(1)).get_goal_id()
    stopped.stop()
    with pytest.raises(TransportError, match="the client is stopped"):
        stopped.follow(goal_id)
