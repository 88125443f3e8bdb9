"""What smach_ros got wrong, each fault shown once and gone here."""

from __future__ import annotations

import pytest

from actionlib_core.action.server import ActionServer
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib.msg import TestResult as Result
from smachpy import SimpleActionState, StateMachine, UserData
from tests.two_nodes import TwoNodes

OUTCOMES = ["succeeded", "aborted", "preempted"]


class World(TwoNodes):
    def state(self, **kwargs):
        return SimpleActionState("do", Action, goal=Goal(1), node=self.mission, **kwargs)


@pytest.fixture
def world():
    with World() as world:
        yield world


@pytest.mark.parametrize("escape", ["nothing", "exec_timeout", "preempt"])
def test_smach_ros_never_noticed_a_dead_server(world, escape):
    """It waited for ever; neither exec_timeout nor preempt_timeout nor a preempt helped."""
    server = ActionServer(
        "do", Action, lambda h: h.set_accepted(), auto_start=False, node=world.robot
    )
    server.start()
    state = world.state(exec_timeout=5.0 if escape == "exec_timeout" else None, preempt_timeout=5.0)
    if escape == "nothing":
        world.clock.call_later(3.0, world.robot.transport.kill)
        assert state.execute(UserData()) == "aborted"
        assert world.clock.now() == 3.0
        return
    # The server hangs, its token stays: it neither works nor ends the goal.
    if escape == "preempt":
        world.clock.call_later(5.0, state.request_preempt)
    assert state.execute(UserData()) == ("preempted" if escape == "preempt" else "aborted")
    assert world.clock.now() == 10.0


@pytest.mark.parametrize("seed", range(100))
@pytest.mark.parametrize("delay", [0.0, 0.001, 0.004])
def test_smach_ros_lost_or_misread_a_preempt_at_the_start(seed, delay):
    """Of 400 preempts within 4 ms it lost 11 and called 50 'aborted', because RECALLED was."""
    with World(seed) as world:
        waiting = []

        def take_later(handle):
            waiting.append(handle)
            world.clock.call_later(0.002, lambda: accept(handle))

        def accept(handle):
            if handle in waiting:
                waiting.remove(handle)
                handle.set_accepted()

        def cancel(handle):
            if handle in waiting:
                waiting.remove(handle)
            handle.set_canceled(Result(7))

        server = ActionServer("do", Action, take_later, cancel, False, node=world.robot)
        server.start()
        machine = StateMachine(OUTCOMES)
        with machine:
            machine.add("DRIVE", world.state())
        world.clock.sleep(0.1)
        start = world.clock.now()
        task = world.clock.spawn(
            lambda: (world.clock.sleep(delay), machine.request_preempt()), name="preempter"
        )
        assert machine.execute() == "preempted"
        assert world.clock.now() - start == pytest.approx(delay)
        task.join()
        assert not machine.preempt_requested()


def test_smach_ros_kept_a_lock_after_a_raising_result_callback(world):
    """The next `execute` from another thread hung."""
    server = ActionServer(
        "do",
        Action,
        lambda h: (h.set_accepted(), h.set_succeeded(Result(7))),
        auto_start=False,
        node=world.robot,
    )
    server.start()
    broken = [True]

    def result_cb(userdata, status, result):
        if broken.pop():
            raise ValueError("no")

    state = world.state(result_cb=result_cb)
    with pytest.raises(ValueError, match="no"):
        state.execute(UserData())
    broken[:] = [False]
    outcomes = []
    task = world.clock.spawn(lambda: outcomes.append(state.execute(UserData())), name="another")
    assert task.join(5.0)
    assert outcomes == ["succeeded"]


def test_smach_ros_did_not_pass_the_arguments_of_result_cb(world):
    server = ActionServer(
        "do",
        Action,
        lambda h: (h.set_accepted(), h.set_succeeded(Result(7))),
        auto_start=False,
        node=world.robot,
    )
    server.start()
    seen = []
    state = world.state(
        result_cb=lambda ud, status, result, *args, **kwargs: seen.append((args, kwargs)),
        result_cb_args=["a"],
        result_cb_kwargs={"b": 2},
    )
    assert state.execute(UserData()) == "succeeded"
    assert seen == [(("a",), {"b": 2})]


def test_smach_ros_changed_the_goal_it_was_given_for_later_runs(world):
    goals = []
    server = ActionServer(
        "do",
        Action,
        lambda h: (goals.append(h.get_goal().goal), h.set_accepted(), h.set_succeeded()),
        auto_start=False,
        node=world.robot,
    )
    server.start()

    def count(userdata, goal):
        goal.goal += 1

    state = world.state(goal_cb=count)
    state.execute(UserData())
    state.execute(UserData())
    assert goals == [2, 2]


def test_smach_ros_started_a_thread_in_the_constructor():
    import threading

    before = set(threading.enumerate())  # idle ones of other tests may end meanwhile
    SimpleActionState("do", Action)
    assert set(threading.enumerate()) <= before


@pytest.mark.parametrize("error", ["recalled", "lost"])
def test_smach_ros_called_a_preempt_aborted_when_the_goal_was_recalled_or_lost(world, error):
    def cancel(handle):
        if error == "recalled":
            handle.set_canceled(Result(7))
        else:
            world.robot.transport.kill()

    server = ActionServer("do", Action, lambda h: None, cancel, False, node=world.robot)
    server.start()
    state = world.state()
    world.clock.call_later(1.0, state.request_preempt)
    assert state.execute(UserData()) == "preempted"
    assert world.clock.now() == 1.0


def test_smach_ros_waited_for_ever_after_exec_timeout(world):
    ActionServer("do", Action, lambda h: h.set_accepted(), node=world.robot)
    state = world.state(exec_timeout=2.0, preempt_timeout=3.0)
    assert state.execute(UserData()) == "aborted"
    assert world.clock.now() == 5.0


def test_smach_ros_gave_none_as_the_result_of_a_lost_goal(world):
    ActionServer("do", Action, lambda h: h.set_accepted(), node=world.robot)
    world.clock.call_later(1.0, world.robot.transport.kill)
    seen = []
    state = world.state(result_cb=lambda ud, status, result: seen.append(result.result))
    assert state.execute(UserData()) == "aborted"
    assert seen == [0]


def test_smach_ros_service_states_waited_for_ever(world):
    from actionlib_core.interfaces.std_srvs.srv import Trigger
    from smachpy import ServiceState

    assert ServiceState("absent", Trigger, node=world.mission).execute(UserData()) == "aborted"
    assert world.clock.now() == 60.0


def test_smach_ros_wrapped_what_a_condition_raised_in_text_only(world):
    from smachpy import ConditionState, InvalidUserCodeError

    def broken(userdata):
        raise LookupError("no map")

    with pytest.raises(LookupError, match="no map"):
        ConditionState(broken).execute(UserData())
    machine = StateMachine(["true", "false", "preempted"])
    with machine:
        machine.add("LOOK", ConditionState(broken))
    with pytest.raises(InvalidUserCodeError, match=r"/SM_ROOT/LOOK") as raised:
        machine.execute()
    assert isinstance(raised.value.__cause__, LookupError)
