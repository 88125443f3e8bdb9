"""Goals as `with` blocks and servers as functions, on every network."""

from __future__ import annotations

import asyncio
import logging

import pytest

from actionlib_core import (
    Abort,
    ActionClient,
    GoalFailedError,
    GoalTimeoutError,
    Preempted,
    Reject,
    server,
)
from actionlib_core.action.decorated import GoalContext
from actionlib_core.interfaces.actionlib import msg

LONG_S = 60.0


@server("count", msg.TestAction)
def count(goal: msg.TestGoal, ctx: GoalContext[msg.TestFeedback]) -> msg.TestResult:
    """Count up to the goal; odd things happen at certain numbers."""
    if goal.goal < 0:
        raise Reject("only forward")
    if goal.goal == 13:
        ctx.accept()
        raise Reject("too late")
    if goal.goal == 7:
        raise Abort("seven", msg.TestResult(7))
    if goal.goal == 99:
        raise RuntimeError("broke")
    for number in range(goal.goal):
        ctx.feedback(msg.TestFeedback(number))
        if goal.goal >= 1000 and ctx.sleep(1.0):
            raise Preempted("stopped", msg.TestResult(number))
    return msg.TestResult(goal.goal)


@pytest.fixture
def client(world):
    running = count.start(node=world.node("server"))
    client = ActionClient("count", msg.TestAction, node=world.node("client"))
    assert client.wait_for_server(LONG_S)
    yield client
    running.stop()
    assert running.wait(LONG_S)


def test_feedback_then_result(client):
    with client.send(msg.TestGoal(5), timeout=LONG_S) as handle:
        assert [feedback.feedback for feedback in handle.feedback()] == [0, 1, 2, 3, 4]
        assert handle.result() == msg.TestResult(5)
    assert handle.status.name == "SUCCEEDED"


def test_result_alone(client):
    with client.send(msg.TestGoal(3)) as handle:
        assert handle.result(LONG_S).result == 3


@pytest.mark.parametrize(
    ("number", "status", "text"),
    [
        (-1, "REJECTED", "only forward"),
        (13, "ABORTED", "too late"),
        (7, "ABORTED", "seven"),
        (99, "ABORTED", "Exception in execute callback: broke"),
    ],
)
def test_ends_that_are_no_success_raise(client, number, status, text, caplog):
    with caplog.at_level(logging.CRITICAL), client.send(msg.TestGoal(number)) as handle:
        with pytest.raises(GoalFailedError, match=text) as caught:
            handle.result(LONG_S)
    assert (caught.value.status, caught.value.text) == (status, text)
    if number == 7:
        assert caught.value.result == msg.TestResult(7)


def test_leaving_the_block_cancels(client):
    with client.send(msg.TestGoal(1000)) as handle:
        assert next(iter(handle.feedback())).feedback == 0
    with pytest.raises(GoalFailedError) as caught:
        handle.result(LONG_S)
    assert (caught.value.status, caught.value.text) == ("PREEMPTED", "stopped")


def test_a_timeout_without_a_server_says_that_there_was_none(world):
    client = ActionClient("count", msg.TestAction, node=world.node("client"))
    with client.send(msg.TestGoal(1), timeout=0.3) as handle:
        with pytest.raises(GoalTimeoutError, match=r"no server accepted it within 0\.3 s"):
            handle.result()


def test_timeout_cancels_and_raises(client):
    with client.send(msg.TestGoal(1000), timeout=0.3) as handle:
        with pytest.raises(GoalTimeoutError, match=r"not over within 0\.3 s") as caught:
            handle.result()
    assert isinstance(caught.value, TimeoutError)
    assert handle.status.name == "PREEMPTED"
    with client.send(msg.TestGoal(1000), timeout=0.3) as handle:
        with pytest.raises(GoalTimeoutError):
            list(handle.feedback())


def test_follow_by_id(client):
    with client.send(msg.TestGoal(1000)) as handle:
        next(iter(handle.feedback()))
        other = ActionClient("count", msg.TestAction, node=client.node)
        with other.follow(handle.id, timeout=LONG_S) as same:
            assert same.id == handle.id
            handle.cancel()
            with pytest.raises(GoalFailedError, match="stopped"):
                same.result()


def test_async(world, client):
    async def drive():
        async with client.send(msg.TestGoal(4), timeout=LONG_S) as handle:
            seen = [feedback.feedback async for feedback in handle.feedback()]
            return seen, (await handle).result

    assert world.clock.run_async(drive()) == ([0, 1, 2, 3], 4)


def test_async_cancellation_cancels_the_goal(world, client):
    handles = []

    async def drive():
        async with client.send(msg.TestGoal(1000)) as handle:
            handles.append(handle)
            await handle

    async def main():
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.3):
                await drive()

    world.clock.run_async(main())
    with pytest.raises(GoalFailedError) as caught:
        handles[0].result(LONG_S)
    assert caught.value.status == "PREEMPTED"


def test_async_timeout_and_many_at_once(world, client):
    async def late():
        async with client.send(msg.TestGoal(1000), timeout=0.3) as handle:
            await handle

    async def one(number):
        async with client.send(msg.TestGoal(number)) as handle:
            return (await handle).result

    async def main():
        with pytest.raises(GoalTimeoutError):
            await late()
        return [await one(n) for n in range(3)]

    assert world.clock.run_async(main()) == [0, 1, 2]


# -- async servers -----------------------------------------------------------------------------


@server("wait", msg.TestAction)
async def wait(goal: msg.TestGoal, ctx: GoalContext[msg.TestFeedback]) -> msg.TestResult:
    """Wait for as many seconds as the goal says; odd things happen at certain numbers."""
    if goal.goal < 0:
        raise Reject("only forward")
    ctx.feedback(msg.TestFeedback(1))
    if goal.goal == 99:
        raise RuntimeError("broke")
    if goal.goal == 98:
        raise asyncio.CancelledError
    try:
        await asyncio.sleep(goal.goal)
    except asyncio.CancelledError:
        if goal.goal < 1000:
            raise
        await asyncio.sleep(0.01)  # its clean-up, which no second request cuts short
        if goal.goal == 2000:
            return msg.TestResult(-2)
        raise Preempted("tidied up", msg.TestResult(-1)) from None
    return msg.TestResult(goal.goal)


@pytest.fixture
def waiter(world):
    with wait.start(node=world.node("server")) as running:
        client = ActionClient("wait", msg.TestAction, node=world.node("client"))
        assert client.wait_for_server(LONG_S)
        yield client
    assert running.wait(LONG_S)


@pytest.mark.parametrize(
    ("number", "status", "text"),
    [
        (0, "SUCCEEDED", ""),
        (-1, "REJECTED", "only forward"),
        (99, "ABORTED", "Exception in execute callback: broke"),
        (98, "ABORTED", "Exception in execute callback: its task was cancelled, but not by"),
    ],
)
@pytest.mark.usefixtures("caplog")
def test_async_function_ends_its_goal(waiter, number, status, text):
    with waiter.send(msg.TestGoal(number), timeout=LONG_S) as handle:
        assert handle.wait(LONG_S)
    assert handle.status.name == status
    assert handle.text.startswith(text)


@pytest.mark.parametrize(
    ("number", "status", "text", "result"),
    [
        (500, "PREEMPTED", "its task was cancelled", 0),
        (1000, "PREEMPTED", "tidied up", -1),
        (2000, "SUCCEEDED", "", -2),
    ],
)
def test_cancel_cancels_the_task_of_an_async_function(waiter, number, status, text, result):
    handle = waiter.send(msg.TestGoal(number))
    assert handle.next_feedback() == msg.TestFeedback(1)
    for _ in range(3):
        handle.cancel()
    assert handle.wait(LONG_S)
    found = handle.status.name, handle.text, handle.get_result()
    assert found == (status, text, msg.TestResult(result))


def test_newer_goal_cancels_the_task_of_the_older_one_and_runs(waiter):
    older = waiter.send(msg.TestGoal(500))
    assert older.next_feedback() == msg.TestFeedback(1)
    newer = waiter.send(msg.TestGoal(0))
    assert newer.result(LONG_S) == msg.TestResult(0)
    assert older.wait(LONG_S)
    assert older.status.name == "PREEMPTED"


def test_stop_cancels_the_task_of_an_async_function(world):
    running = wait.start(node=world.node("server"))
    client = ActionClient("wait", msg.TestAction, node=world.node("client"))
    handle = client.send(msg.TestGoal(500))
    assert handle.next_feedback() == msg.TestFeedback(1)
    running.stop()
    assert handle.wait(LONG_S)
    assert handle.status in world.stopped


def test_function_can_be_called_by_itself():
    with pytest.raises(Reject):
        count(msg.TestGoal(-1), None)
    assert count.__doc__.startswith("Count up")
