"""`SimpleActionState` against real action servers on a network in memory, in virtual time."""

from __future__ import annotations

import threading

import pytest

from actionlib_core import shutdown
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.exceptions import ActionException, TypeMismatchError
from actionlib_core.interfaces.actionlib.msg import (
    TestAction as Action,
)
from actionlib_core.interfaces.actionlib.msg import (
    TestFeedback as Feedback,
)
from actionlib_core.interfaces.actionlib.msg import (
    TestGoal as Goal,
)
from actionlib_core.interfaces.actionlib.msg import (
    TestResult as Result,
)
from actionlib_core.interfaces.actionlib.msg import (
    TwoIntsAction,
)
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.std_msgs.msg import Float32
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.time import Duration
from smachpy import (
    ActionServerWrapper,
    Concurrence,
    InvalidStateError,
    InvalidUserCodeError,
    MonitorState,
    ServiceState,
    StateMachine,
    UserData,
    cb_interface,
    events,
)
from smachpy.actions.simple_action_state import SimpleActionState
from tests.smachpy.actions.left_behind import leave_behind
from tests.two_nodes import TwoNodes

OUTCOMES = ["succeeded", "aborted", "preempted"]


class World(TwoNodes):
    """A clock, a robot's node with the action server "do", and the mission's node."""

    def __init__(self, seed=None):
        super().__init__(seed)
        self.goals = []
        self.cancels = []
        self.events = []
        self.server_busy = False

    def serve(self, run):
        """Start a simple server; `run(server, goal)`."""
        server = SimpleActionServer(
            "do",
            Action,
            lambda goal: (self.goals.append(goal), run(server, goal)),
            False,
            node=self.robot,
        )
        server.start()
        return server

    def serve_raw(self, on_goal, on_cancel=lambda handle: None):
        """Start a full server."""
        server = ActionServer(
            "do",
            Action,
            lambda handle: (self.goals.append(handle), on_goal(handle)),
            lambda handle: (self.cancels.append(self.clock.now()), on_cancel(handle)),
            False,
            node=self.robot,
        )
        server.start()
        return server

    def state(self, **kwargs):
        return SimpleActionState("do", Action, **{"goal": Goal(3), "node": self.mission} | kwargs)

    def machine(self, state, **kwargs):
        machine = StateMachine([*OUTCOMES, "other"], **kwargs)
        with machine.opened(check=False):
            machine.add("A", state)
        machine.subscribe(self.events.append)
        return machine

    def done(self):
        return [event for event in self.events if isinstance(event, events.GoalDone)]


@pytest.fixture
def world():
    with World() as world:
        yield world


def count(server, goal):
    """Take `goal` seconds, give feedback each second, stop when asked."""
    for second in range(goal.goal):
        server.publish_feedback(Feedback(second))
        if server.wait_preempt(1.0):
            server.set_preempted(Result(second), "stopped")
            return
    server.set_succeeded(Result(goal.goal), "all counted")


# -- outcomes --------------------------------------------------------------------------------


def test_a_goal_succeeds(world):
    world.serve(count)
    machine = world.machine(world.state(result_key="result"), output_keys=["result"])
    assert machine.execute() == "succeeded"
    assert machine.userdata.result == Result(3)
    assert world.clock.now() == 3.0
    kinds = [type(e).__name__ for e in world.events if hasattr(e, "goal_id")]
    assert kinds == ["GoalSent", "GoalFeedback", "GoalFeedback", "GoalFeedback", "GoalDone"]
    (done,) = world.done()
    assert (done.path, done.action, done.status, done.text, done.result) == (
        "/SM_ROOT/A",
        "do",
        "SUCCEEDED",
        "all counted",
        Result(3),
    )


@pytest.mark.parametrize(
    ("end", "status"),
    [
        (lambda h: (h.set_accepted(), h.set_aborted(Result(1), "blocked")), "ABORTED"),
        (lambda h: h.set_rejected(Result(1), "blocked"), "REJECTED"),
        (lambda h: (h.set_accepted(), h.set_canceled(Result(1), "blocked")), "PREEMPTED"),
        (lambda h: h.set_canceled(Result(1), "blocked"), "RECALLED"),
    ],
)
def test_a_goal_that_the_server_ends_otherwise_is_aborted_with_the_reason(
    world, caplog, end, status
):
    world.serve_raw(end)
    assert world.machine(world.state()).execute() == "aborted"
    assert [(d.status, d.text) for d in world.done()] == [(status, "blocked")]
    assert "/SM_ROOT/A: goal /mission-" in caplog.text
    assert f" on 'do': {status}: blocked" in caplog.text


def test_a_server_that_dies_aborts_the_goal_at_once(world, caplog):
    world.serve_raw(lambda handle: handle.set_accepted())
    world.clock.call_later(2.5, world.robot.transport.kill)
    results = []
    state = world.state(
        result_cb=lambda ud, status, result: results.append((status, result)),
        result_key="result",
        result_slots=["result"],
    )
    assert world.machine(state).execute() == "aborted"
    assert world.clock.now() == 2.5
    assert results == [(GoalStatus.LOST, Result())]
    assert "LOST: the action server of node 'robot'" in caplog.text


def test_no_server_within_the_wait_aborts_and_says_how_to_start_one(world, caplog):
    state = world.state(server_wait_timeout=Duration(7.0))
    assert world.machine(state).execute() == "aborted"
    assert world.clock.now() == pytest.approx(7.0, abs=0.1)
    assert "no action server took this goal within 7 s" in caplog.text
    assert "Try starting an action server of type actionlib/TestAction on 'do'" in caplog.text


def test_a_server_that_comes_late_gets_the_goal(world):
    world.clock.call_later(20.0, lambda: world.clock.spawn(lambda: world.serve(count), name="late"))
    assert world.machine(world.state()).execute() == "succeeded"
    assert len(world.goals) == 1
    assert world.clock.now() == pytest.approx(23.0, abs=0.2)


def test_waiting_for_the_server_does_not_count_as_execution(world):
    world.clock.call_later(20.0, lambda: world.clock.spawn(lambda: world.serve(count), name="late"))
    assert world.machine(world.state(exec_timeout=4.0)).execute() == "succeeded"
    assert world.machine(world.state(exec_timeout=2.0)).execute() == "aborted"


def test_without_wait_a_server_that_is_there_has_time_to_answer(world):
    world.serve(count)
    assert world.machine(world.state(server_wait_timeout=0)).execute() == "succeeded"


def test_a_server_of_another_type_raises(world):
    other = SimpleActionServer("do", TwoIntsAction, lambda goal: None, False, node=world.robot)
    other.start()
    machine = world.machine(world.state(server_wait_timeout=5.0))
    assert machine.execute() == "aborted"  # the first run finds out
    assert "actionlib/TwoIntsAction" in world.done()[0].text
    with pytest.raises((InvalidUserCodeError, TypeMismatchError)) as raised:
        machine.execute()
    causes = {raised.type, type(raised.value.__cause__)}
    assert TypeMismatchError in causes


# -- the goal --------------------------------------------------------------------------------


def test_key_then_slots_then_callback_make_the_goal(world):
    seen = []

    def change(userdata, goal, step, *, factor):
        seen.append(goal.goal)
        goal.goal = (goal.goal + step) * factor

    world.serve(count)
    state = world.state(
        goal=None,
        goal_key="whole",
        goal_slots=["goal"],
        goal_cb=change,
        goal_cb_args=[1],
        goal_cb_kwargs={"factor": 2},
    )
    machine = world.machine(state)
    machine.userdata.whole = Goal(7)
    machine.userdata.goal = 1
    assert machine.execute() == "succeeded"
    assert seen == [1]
    assert world.goals == [Goal(4)]
    assert machine.userdata.whole == Goal(7)


def test_each_run_begins_with_the_goal_as_given(world):
    world.serve(count)
    given = Goal(1)

    def change(userdata, goal):
        goal.goal += 1

    machine = world.machine(world.state(goal=given, goal_cb=change))
    machine.execute()
    machine.execute()
    assert world.goals == [Goal(2), Goal(2)]
    assert given == Goal(1)


def test_a_callback_may_return_another_goal_even_one_that_it_may_only_read(world):
    world.serve(count)
    state = world.state(goal_cb=lambda ud, goal: ud.other, input_keys=["other"])
    machine = world.machine(state)
    machine.userdata.other = Goal(2)
    assert machine.execute() == "succeeded"
    assert world.goals == [Goal(2)]
    assert type(world.goals[0]) is Goal


def test_read_only_parts_of_userdata_can_be_sent(world):
    poses = []
    server = SimpleActionServer(
        "move_base",
        MoveBaseAction,
        lambda goal: (poses.append(goal.target_pose), server.set_succeeded()),
        False,
        node=world.robot,
    )
    server.start()
    pose = PoseStamped()
    pose.pose.position.x = 2.5

    def fill(ud, goal):
        goal.target_pose = ud.pose

    for more in ({"goal_slots": ["target_pose"]}, {"goal_cb": fill, "input_keys": ["pose"]}):
        state = SimpleActionState("move_base", MoveBaseAction, node=world.mission, **more)
        machine = world.machine(state)
        machine.userdata.target_pose = machine.userdata.pose = pose
        assert machine.execute() == "succeeded"
    assert poses == [pose, pose]


def test_interfaces_of_callbacks_are_added(world):
    @cb_interface(input_keys=["a"], output_keys=["b"])
    def goal_cb(ud, goal):
        ud.b = ud.a + 1

    @cb_interface(outcomes=["other"], output_keys=["c"])
    def result_cb(ud, status, result, word, *, end):
        ud.c = (status, result.result, word)
        return end

    world.serve(count)
    state = world.state(
        goal_cb=goal_cb,
        result_cb=result_cb,
        result_cb_args=["word"],
        result_cb_kwargs={"end": "other"},
    )
    assert state.get_registered_outcomes() == ("succeeded", "aborted", "preempted", "other")
    machine = world.machine(state)
    machine.userdata.a = 1
    assert machine.execute() == "other"
    assert machine.userdata.b == 2
    assert machine.userdata.c == (GoalStatus.SUCCEEDED, 3, "word")


def test_wrong_arguments_are_all_named_at_once(world):
    with pytest.raises(InvalidStateError) as raised:
        world.state(goal=MoveBaseGoal(), goal_slots=["gaol"], result_slots=["x"], exec_timeout=-1)
    text = str(raised.value)
    assert "SimpleActionState 'do': goal: got MoveBaseGoal(" in text
    assert (
        "goal_slots: got 'gaol'; expected fields of actionlib/TestGoal: ['goal']. Did you mean 'goal'?"
        in text
    )
    assert "result_slots: got 'x'" in text
    assert "exec_timeout: got -1.0; expected seconds >= 0, or None." in text
    with pytest.raises(InvalidStateError, match="result_cb: got 3; expected something to call"):
        world.state(result_cb=3)
    with pytest.raises(ActionException, match="expected an action class"):
        SimpleActionState("do", Goal)


# -- feedback --------------------------------------------------------------------------------


def test_feedback_goes_to_the_callback_and_into_userdata(world):
    world.serve(count)
    threads, seen = set(), []

    def on_feedback(userdata, feedback):
        threads.add(threading.get_ident())
        seen.append((feedback.feedback, world.clock.now()))

    state = world.state(feedback_cb=on_feedback, feedback_key="progress")
    machine = world.machine(state)
    assert machine.execute() == "succeeded"
    assert seen == [(0, 0.0), (1, 1.0), (2, 2.0)]
    assert threads == {threading.get_ident()}
    assert machine.userdata.progress == Feedback(2)
    written = [e.value for e in world.events if isinstance(e, events.UserdataWritten)]
    assert written == [Feedback(0), Feedback(1), Feedback(2)]


def test_feedback_sent_just_before_the_end_is_seen(world):
    def run(server, goal):
        for number in range(100):
            server.publish_feedback(Feedback(number))
        server.set_succeeded()

    world.serve(run)
    seen = []
    world.machine(world.state(feedback_cb=lambda ud, f: seen.append(f.feedback))).execute()
    assert seen == list(range(100))


# -- timeouts --------------------------------------------------------------------------------


def test_exec_timeout_cancels_and_aborts(world, caplog):
    world.serve_raw(lambda h: h.set_accepted(), lambda h: h.set_canceled(Result(1), "stopped"))
    state = world.state(exec_timeout=Duration(2.0), result_key="r")
    machine = world.machine(state)
    assert machine.execute() == "aborted"
    assert world.clock.now() == 2.0
    assert machine.userdata.r == Result(1)
    assert "PREEMPTED: cancelled after exec_timeout=2 s: stopped" in caplog.text


@pytest.mark.parametrize("kind", ["preempt", "exec_timeout"])
def test_a_goal_is_cancelled_beside_a_callback_though_no_thread_can_be_started(
    world, monkeypatch, kind
):
    """The thread of the state was the only one left to do it, and that was in the callback."""
    cancelled, spawn = [], world.clock.spawn

    def spawn_others(target, *, name):
        if name.startswith("goal of"):
            raise RuntimeError("can't start new thread")
        return spawn(target, name=name)

    def run(handle):
        handle.set_accepted()
        handle.publish_feedback(Feedback(1))

    def end(handle):
        cancelled.append(world.clock.now())
        handle.set_canceled()

    world.serve_raw(run, end)
    monkeypatch.setattr(world.clock, "spawn", spawn_others)
    limit = {"exec_timeout": 2.0} if kind == "exec_timeout" else {}
    state = world.state(feedback_cb=lambda *_: world.clock.sleep(8.0), **limit)
    machine = world.machine(state)
    if kind == "preempt":
        world.clock.call_later(2.0, machine.request_preempt)
    machine.execute()
    assert cancelled == [2.0]


@pytest.mark.parametrize(("wait", "runs", "outcome"), [(29, 2, "succeeded"), (29, 4, "aborted")])
def test_exec_timeout_does_not_count_while_the_goal_waits_at_the_server(world, wait, runs, outcome):
    """It was recalled from the queue, before it was started."""

    def on_goal(handle):
        world.clock.call_later(wait, handle.set_accepted)
        world.clock.call_later(wait + runs, lambda: ended(handle))

    def ended(handle):
        if not world.cancels:
            handle.set_succeeded()

    world.serve_raw(on_goal, lambda handle: handle.set_canceled())
    machine = world.machine(world.state(exec_timeout=3.0, server_wait_timeout=30.0))
    assert machine.execute() == outcome
    assert world.clock.now() == wait + min(runs, 3)


@pytest.mark.parametrize("exec_timeout", [None, 5.0])
def test_goal_that_is_not_accepted_within_server_wait_timeout_is_cancelled(
    world, caplog, exec_timeout
):
    """A server whose code hangs acknowledges goals, but never accepts one."""
    world.serve_raw(lambda handle: None, lambda handle: handle.set_canceled())
    machine = world.machine(world.state(exec_timeout=exec_timeout, server_wait_timeout=10.0))
    assert machine.execute() == "aborted"
    assert world.clock.now() == 10.0
    assert "RECALLED: not accepted within server_wait_timeout=10 s" in caplog.text


def test_a_server_that_ignores_cancels_is_abandoned_after_preempt_timeout(world, caplog):
    world.serve_raw(lambda h: h.set_accepted())
    state = world.state(exec_timeout=2.0, preempt_timeout=3.0)
    assert world.machine(state).execute() == "aborted"
    assert world.clock.now() == 5.0
    assert world.cancels == [2.0]
    assert (
        "has not ended it 3 s after the cancel. It was abandoned and may still run." in caplog.text
    )
    assert world.done()[0].status == "LOST"


def test_a_goal_that_ends_in_time_is_not_cancelled(world):
    world.serve(count)
    state = world.state(exec_timeout=3.5)
    assert world.machine(state).execute() == "succeeded"
    assert world.cancels == []
    world.clock.sleep(10.0)
    assert world.cancels == []


# -- preempts --------------------------------------------------------------------------------


def stoppable(world):
    return world.serve_raw(
        lambda h: h.set_accepted(), lambda h: h.set_canceled(Result(9), "stopped")
    )


def test_a_preempt_cancels_at_once(world):
    stoppable(world)
    machine = world.machine(world.state(result_key="r"))
    world.clock.call_later(4.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert world.clock.now() == 4.0
    assert world.cancels == [4.0]
    assert machine.userdata.r == Result(9)
    assert not machine["A"].preempt_requested()


def test_a_preempt_before_the_run_sends_nothing(world):
    stoppable(world)
    state = world.state()
    state.request_preempt()
    assert state.execute(UserData()) == "preempted"
    assert world.goals == []
    assert not state.preempt_requested()


def test_a_preempt_while_the_goal_is_made_sends_nothing(world):
    stoppable(world)
    machine = world.machine(world.state(goal_cb=lambda ud, goal: machine.request_preempt()))
    assert machine.execute() == "preempted"
    assert world.goals == []


def test_a_preempt_while_no_server_is_there_ends_at_once_and_the_goal_is_never_sent(world):
    machine = world.machine(world.state())
    world.clock.call_later(4.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert world.clock.now() == 4.0
    world.serve(count)
    world.clock.sleep(100.0)
    assert world.goals == []


def test_a_preempt_of_a_goal_whose_server_dies_is_preempted(world):
    world.serve_raw(lambda h: h.set_accepted())
    machine = world.machine(world.state())
    world.clock.call_later(1.0, machine.request_preempt)
    world.clock.call_later(2.0, world.robot.transport.kill)
    assert machine.execute() == "preempted"
    assert world.clock.now() == 2.0


def test_a_preempt_of_a_server_that_ignores_it_is_bounded(world, caplog):
    world.serve_raw(lambda h: h.set_accepted())
    machine = world.machine(world.state(preempt_timeout=5.0))
    for moment in (1.0, 1.5, 3.0):
        world.clock.call_later(moment, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert world.clock.now() == 6.0
    assert world.cancels == [1.0]
    assert "It was abandoned" in caplog.text


@pytest.mark.parametrize(
    ("own", "container", "took"),
    [
        ({}, {}, 60.0),  # the default, as in SMACH
        ({}, {"preempt_timeout": 3.0}, 3.0),
        ({}, {"preempt_timeout": 90.0}, 60.0),
        ({}, {"preempt_timeout": None}, 60.0),
        ({"preempt_timeout": 8.0}, {"preempt_timeout": 3.0}, 8.0),
        ({"preempt_timeout": Duration(8.0)}, {"preempt_timeout": 3.0}, 8.0),
        ({"preempt_timeout": float("60.0")}, {"preempt_timeout": 3.0}, 60.0),
    ],
)
def test_a_containers_shorter_grace_holds_unless_the_state_has_its_own(
    world, caplog, own, container, took
):
    world.serve_raw(lambda h: h.set_accepted())
    inner = world.machine(world.state(**own))
    outer = world.machine(inner, **container)
    world.clock.call_later(1.0, outer.request_preempt)
    assert outer.execute() == "preempted"
    assert world.clock.now() == 1.0 + took
    assert f"{took:g} s after the cancel. It was abandoned" in caplog.text
    assert not [event for event in world.events if isinstance(event, events.Abandoned)]


def test_a_callback_that_hangs_is_left_behind_soon_after_the_containers_grace(world):
    world.serve(count)
    hangs = world.state(feedback_cb=lambda ud, feedback: world.clock.sleep(1000.0))
    machine = world.machine(hangs, preempt_timeout=3.0)
    world.clock.call_later(2.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert world.clock.now() == 2.0 + 3.0 + 1.0
    assert [event.grace for event in world.events if isinstance(event, events.Abandoned)] == [4.0]


def test_a_goal_that_succeeds_although_preempted_keeps_its_outcome(world):
    world.serve_raw(
        lambda h: h.set_accepted(), lambda h: h.set_succeeded(Result(7), "was just done")
    )
    state = world.state(result_key="r")
    world.clock.call_later(1.0, state.request_preempt)
    userdata = UserData()
    assert state.execute(userdata) == "succeeded"
    assert userdata.r == Result(7)


def test_after_a_preempt_the_next_run_is_free(world):
    stoppable(world)
    machine = world.machine(world.state(exec_timeout=2.0))
    world.clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert machine.execute() == "aborted"
    assert len(world.goals) == 2


def test_two_states_of_one_action_are_preempted_together(world):
    world.serve_raw(lambda h: h.set_accepted(), lambda h: h.set_canceled(Result(9), "stopped"))
    both = Concurrence(
        OUTCOMES, "aborted", outcome_map={"preempted": {"A": "preempted", "B": "preempted"}}
    )
    with both:
        Concurrence.add("A", world.state())
        Concurrence.add("B", world.state())
    world.clock.call_later(1.0, both.request_preempt)
    assert both.execute() == "preempted"
    assert len(world.goals) == 2
    assert world.clock.now() == 1.0


@pytest.mark.parametrize("seed", range(60))
def test_a_preempt_at_any_moment_is_never_lost(seed):
    """Preempts race with sending, accepting, running and the result; twice each."""
    with World(seed) as world:
        world.serve(lambda server, goal: hold(world, server))
        machine = world.machine(world.state(preempt_timeout=3.0))
        for moment in (0.0, 0.0, 2.0, 2.0, 5.0):
            world.events.clear()
            start = world.clock.now()
            preempter = world.clock.spawn(
                lambda moment=moment: (world.clock.sleep(moment), machine.request_preempt()),
                name="preempter",
            )
            outcome = machine.execute()
            took = world.clock.now() - start
            preempter.join()
            assert outcome in {"preempted", "succeeded"}
            if outcome == "succeeded":
                assert moment == 5.0
                assert took == 5.0
            elif moment < 5.0:
                assert took == moment
            assert len(world.done()) <= 1
            machine.recall_preempt()
            world.clock.sleep(20.0)
            assert not world.server_busy


def hold(world, server):
    """Run for 5 s, or until asked to stop."""
    world.server_busy = True
    stop = world.clock.event()
    server.register_preempt_callback(stop.set)
    if server.is_preempt_requested() or stop.wait(5.0):
        server.set_preempted()
    else:
        server.set_succeeded()
    world.server_busy = False


# -- what callbacks raise --------------------------------------------------------------------


def boom(*_):
    raise ValueError("boom")


def test_a_goal_callback_that_raises_sends_nothing(world):
    stoppable(world)
    with pytest.raises(ValueError, match="boom"):
        world.state(goal_cb=boom).execute(UserData())
    world.clock.sleep(1.0)
    assert world.goals == []


def test_a_feedback_callback_that_raises_cancels_the_goal_and_waits_for_its_end(world):
    world.serve(count)
    with pytest.raises(ValueError, match="boom"):
        world.state(feedback_cb=boom).execute(UserData())
    assert len(world.goals) == 1
    assert world.clock.now() == 0.0


def test_a_feedback_callback_that_raises_can_be_an_outcome(world):
    world.serve(count)
    state = world.state(feedback_cb=boom, on_exception={ValueError: "other"})
    assert world.machine(state).execute() == "other"


def test_a_result_callback_that_raises_leaves_the_state_usable_from_other_threads(world):
    world.serve(count)
    results = []

    def once(ud, status, result):
        results.append(status)
        if len(results) == 1:
            boom()

    state = world.state(result_cb=once)
    with pytest.raises(ValueError, match="boom"):
        state.execute(UserData())
    outcomes = []
    task = world.clock.spawn(lambda: outcomes.append(state.execute(UserData())), name="second")
    assert task.join(10.0)
    assert outcomes == ["succeeded"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit])
def test_an_interrupt_cancels_the_goal_and_goes_on_at_once(world, error):
    stoppable(world)

    def interrupt(ud, feedback):
        raise error

    def give_feedback(handle):
        handle.set_accepted()
        handle.publish_feedback(Feedback(1))

    world.robot.close()
    world.robot = world.node("robot")
    world.serve_raw(give_feedback, lambda h: h.set_canceled(Result(9), "stopped"))
    with pytest.raises(error):
        world.state(feedback_cb=interrupt).execute(UserData())
    world.clock.sleep(1.0)
    assert len(world.cancels) == 1


# -- life ------------------------------------------------------------------------------------


def test_the_constructor_touches_no_network_and_starts_no_thread():
    before = set(threading.enumerate())
    state = SimpleActionState("do", Action)
    assert set(threading.enumerate()) <= before  # idle ones of other tests may have ended
    assert state._status == SimpleActionState.INACTIVE
    kind, details = state.describe_details()
    assert kind == "action"
    assert dict(details) == {
        "action": "do",
        "type": "actionlib/TestAction",
        "preempt_timeout": "60 s",
        "server_wait_timeout": "60 s",
    }


def test_the_status_follows_the_goal(world):
    stoppable(world)
    state = world.state(feedback_cb=lambda ud, f: None)
    seen = []
    for moment in (0.5, 1.5, 2.5):
        world.clock.call_later(moment, lambda: seen.append(state._status))
    world.clock.call_later(2.0, state.request_preempt)
    state.execute(UserData())
    seen.append(state._status)
    assert seen == [SimpleActionState.ACTIVE, SimpleActionState.ACTIVE, SimpleActionState.COMPLETED]
    world.clock.sleep(1.0)


def test_a_new_node_gets_a_new_client(world):
    from actionlib_core.node import use_node

    world.serve(count)
    state = SimpleActionState("do", Action, goal=Goal(1))
    for name in ("first", "second"):
        node = world.node(name)
        with use_node(node):
            assert state.execute(UserData()) == "succeeded"
            assert state.execute(UserData()) == "succeeded"
        node.close()


def test_states_of_one_action_share_a_client(world):
    from actionlib_core.transport.tokens import Kind
    from actionlib_core.wire.presence import list_endpoints

    world.serve(count)
    for _ in range(5):
        assert world.state(goal=Goal(1)).execute(UserData()) == "succeeded"
    assert len(list_endpoints(world.robot.transport, kind=Kind.ACTION_CLIENT)) == 1


@pytest.mark.parametrize(
    "make",
    [
        lambda name: SimpleActionState(name, Action),
        lambda name: ServiceState(name, SetBool),
        lambda name: MonitorState(name, Float32, lambda _userdata, _message: True),
        lambda name: ActionServerWrapper(name, Action, StateMachine(["done"])),
    ],
    ids=["action", "service", "topic", "server"],
)
def test_a_name_that_breaks_the_rules_of_ros_is_refused_when_the_state_is_made(make):
    with pytest.raises(InvalidStateError, match="' ' is not allowed"):
        make("move base")


def test_a_goal_callback_that_was_left_behind_sends_no_goal(world):
    """It was told that nobody asked, once it had returned: the robot drove after the mission."""
    world.serve(count)
    leave_behind(world, "goal_cb")
    assert world.goals == []


def test_no_goal_is_sent_once_the_last_ones_are_cancelled(world, monkeypatch):
    """A second signal cancelled the goal; the next state's drove on without its process."""
    monkeypatch.setattr(shutdown, "LAST_S", 0.0)
    world.serve(count)
    machine = StateMachine(OUTCOMES)
    machine.add("HOME", world.state(), {"aborted": "OTHER"})
    machine.add("OTHER", world.state())
    with shutdown.use_shutdown(shutdown.Shutdown()) as end:
        world.clock.call_later(1.0, end.cancel_all)
        assert machine.execute() == "aborted"
    assert len(world.goals) == 1
