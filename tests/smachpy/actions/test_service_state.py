"""`ServiceState`: one call, bounded by its timeout and by a preempt."""

from __future__ import annotations

import pytest

from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.interfaces.std_srvs.srv import (
    SetBool,
    SetBoolRequest,
    SetBoolResponse,
    Trigger,
    TriggerResponse,
)
from actionlib_core.pubsub.service import Service
from actionlib_core.time import Duration
from smachpy import (
    InvalidStateError,
    InvalidUserCodeError,
    StateMachine,
    UserData,
    cb_interface,
)
from smachpy.actions.service_state import ServiceState
from tests.smachpy.actions.left_behind import leave_behind
from tests.two_nodes import TwoNodes

OUTCOMES = ["succeeded", "aborted", "preempted"]


class World(TwoNodes):
    def __init__(self, seed=None):
        super().__init__(seed)
        self.requests = []

    def serve(self, seconds=0.0):
        def answer(request):
            self.requests.append(request)
            self.clock.sleep(seconds)
            return SetBoolResponse(success=request.data, message="done")

        return Service("lamp", SetBool, answer, node=self.robot)

    def state(self, **kwargs):
        return ServiceState(
            "lamp", SetBool, **{"request": SetBoolRequest(True), "node": self.mission} | kwargs
        )

    def machine(self, state):
        machine = StateMachine([*OUTCOMES, "other"])
        with machine.opened(check=False):
            machine.add("LAMP", state)
        return machine


@pytest.fixture
def world():
    with World() as world:
        yield world


def test_the_response_arrives(world):
    world.serve(2.0)
    machine = world.machine(world.state(response_key="answer", response_slots=["message"]))
    assert machine.execute() == "succeeded"
    assert machine.userdata.answer == SetBoolResponse(True, "done")
    assert machine.userdata.message == "done"
    assert world.clock.now() == 2.0


def test_key_then_slots_then_callback_make_the_request(world):
    world.serve()

    def flip(userdata, request, times, *, really):
        assert request.data is True
        for _ in range(times):
            request.data = not request.data

    state = world.state(
        request=None,
        request_key="whole",
        request_slots=["data"],
        request_cb=flip,
        request_cb_args=[3],
        request_cb_kwargs={"really": True},
    )
    machine = world.machine(state)
    machine.userdata.whole, machine.userdata.data = SetBoolRequest(False), True
    assert machine.execute() == "succeeded"
    assert world.requests == [SetBoolRequest(False)]


def test_the_callback_may_choose_the_outcome(world):
    @cb_interface(outcomes=["other"], output_keys=["word"])
    def choose(userdata, response, word, *, end):
        userdata.word = (word, response.success)
        return end

    world.serve()
    state = world.state(
        response_cb=choose, response_cb_args=["so"], response_cb_kwargs={"end": "other"}
    )
    machine = world.machine(state)
    assert machine.execute() == "other"
    assert machine.userdata.word == ("so", True)


def test_without_a_server_it_aborts_after_the_timeout(world, caplog):
    assert world.machine(world.state(timeout=Duration(7.0))).execute() == "aborted"
    assert world.clock.now() == 7.0
    assert "/SM_ROOT/LAMP: service 'lamp'" in caplog.text
    assert "no server" in caplog.text


def test_a_server_that_comes_late_is_called(world):
    world.clock.call_later(30.0, world.serve)
    assert world.state().execute(UserData()) == "succeeded"
    assert world.clock.now() == pytest.approx(30.0)


def test_a_slow_server_runs_into_the_timeout(world, caplog):
    world.serve(100.0)
    state = world.state(timeout=5.0, timeout_outcome="slow")
    assert state.execute(UserData()) == "slow"
    assert world.clock.now() == 5.0
    world.clock.sleep(200.0)


def test_the_timeout_covers_waiting_and_answering(world):
    world.clock.call_later(4.0, lambda: world.serve(3.0))
    state = world.state(timeout=6.0, timeout_outcome="slow")
    assert state.execute(UserData()) == "slow"
    assert world.clock.now() == 6.0
    world.clock.sleep(10.0)
    assert state.execute(UserData()) == "succeeded"


def test_a_server_that_dies_aborts_at_once(world, caplog):
    world.serve(100.0)
    world.clock.call_later(2.0, world.robot.transport.kill)
    assert world.state(timeout_outcome="slow").execute(UserData()) == "aborted"
    assert world.clock.now() == 2.0
    assert "died or left" in caplog.text
    world.clock.sleep(200.0)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_handler_that_raises_aborts_with_its_words(world, caplog, monkeypatch):
    monkeypatch.setattr("threading.excepthook", lambda args: None)

    def broken(request):
        raise LookupError("bulb is missing")

    Service("lamp", SetBool, broken, node=world.robot)
    assert world.state().execute(UserData()) == "aborted"
    assert "LookupError: bulb is missing" in caplog.text


def test_another_type_raises(world):
    Service("lamp", Trigger, lambda request: TriggerResponse(), node=world.robot)
    with pytest.raises(TypeMismatchError):
        world.state().execute(UserData())
    with pytest.raises(InvalidUserCodeError) as raised:
        world.machine(world.state()).execute()
    assert isinstance(raised.value.__cause__, TypeMismatchError)


def boom(*_):
    raise ValueError("boom")


def test_what_callbacks_raise_goes_through_and_the_state_stays_usable(world):
    world.serve()
    with pytest.raises(ValueError, match="boom"):
        world.state(request_cb=boom).execute(UserData())
    assert world.requests == []
    state = world.state(response_cb=boom)
    for _ in range(2):
        with pytest.raises(ValueError, match="boom"):
            state.execute(UserData())
    assert len(world.requests) == 2


def test_wrong_arguments_are_all_named_at_once(world):
    with pytest.raises(InvalidStateError) as raised:
        world.state(request=3, request_slots=["dta"], response_slots=["x"])
    text = str(raised.value)
    assert (
        "ServiceState 'lamp': request: got 3; expected a message of type std_srvs/SetBoolRequest"
        in text
    )
    assert "Did you mean 'data'?" in text
    assert "response_slots: got 'x'" in text


def test_a_preempt_before_it_calls_nothing(world):
    world.serve()
    state = world.state(request_cb=lambda ud, request: state.request_preempt())
    assert state.execute(UserData()) == "preempted"
    assert world.requests == []
    assert not state.preempt_requested()


def test_a_preempt_while_the_server_is_missing(world):
    state = world.state(timeout=None)
    world.clock.call_later(3.0, state.request_preempt)
    assert state.execute(UserData()) == "preempted"
    assert world.clock.now() == 3.0


@pytest.mark.parametrize("seed", range(50))
def test_a_preempt_at_any_moment_ends_it_then(seed):
    with World(seed) as world:
        world.serve(5.0)
        state = world.state(timeout=60.0)
        for moment in (0.0, 0.0, 2.0, 5.0):
            start = world.clock.now()
            task = world.clock.spawn(
                lambda moment=moment: (world.clock.sleep(moment), state.request_preempt()),
                name="preempter",
            )
            outcome = state.execute(UserData())
            assert outcome == "preempted" or moment == 5.0
            assert world.clock.now() - start == moment
            task.join()
            state.recall_preempt()
        world.clock.sleep(10.0)
        assert state.execute(UserData()) == "succeeded"


def test_it_describes_itself(world):
    kind, details = world.state(timeout=4).describe_details()
    assert kind == "service"
    assert dict(details) == {
        "service": "lamp",
        "type": "std_srvs/SetBool",
        "timeout": "4 s -> aborted",
    }


def test_a_program_that_ends_during_a_call_without_limit_preempts(world):
    from actionlib_core.shutdown import Shutdown, use_shutdown

    world.serve(100.0)
    with use_shutdown(Shutdown()) as shutdown:
        machine = world.machine(world.state(timeout=None))
        world.clock.call_later(3.0, shutdown.request)
        assert machine.execute() == "preempted"
        assert world.clock.now() == 3.0
    world.clock.sleep(200.0)


def test_a_request_callback_that_was_left_behind_calls_nothing(world):
    world.serve()
    leave_behind(world, "request_cb")
    assert world.requests == []


def test_without_time_nothing_is_called(world):
    world.serve()
    machine = world.machine(world.state(timeout=0, timeout_outcome="other"))
    assert [machine.execute() for _ in range(2)] == ["other"] * 2
    world.clock.sleep(1.0)
    assert world.requests == []
