"""The tables: every cell of the server's, the client's paths against ROS 1's."""

from __future__ import annotations

import itertools

import pytest

from actionlib_core.exceptions import IllegalTransitionError
from actionlib_core.goal.life_cycle import Row, _compile, client_life_cycle, server_life_cycle
from actionlib_core.goal.states import TERMINAL, CommState, Status

SERVER = {
    ("PENDING", "accept"): "ACTIVE",
    ("RECALLING", "accept"): "PREEMPTING",
    ("PENDING", "request_cancel"): "RECALLING",
    ("ACTIVE", "request_cancel"): "PREEMPTING",
    ("PENDING", "cancel"): "RECALLED",
    ("RECALLING", "cancel"): "RECALLED",
    ("ACTIVE", "cancel"): "PREEMPTED",
    ("PREEMPTING", "cancel"): "PREEMPTED",
    ("PENDING", "reject"): "REJECTED",
    ("RECALLING", "reject"): "REJECTED",
    ("ACTIVE", "abort"): "ABORTED",
    ("PREEMPTING", "abort"): "ABORTED",
    ("ACTIVE", "succeed"): "SUCCEEDED",
    ("PREEMPTING", "succeed"): "SUCCEEDED",
}

# ROS 1's client: what a status does in a state. "-": nothing; missing: an overtaken status.
CLIENT = """
WAITING_FOR_GOAL_ACK PENDING     PENDING
WAITING_FOR_GOAL_ACK ACTIVE      ACTIVE
WAITING_FOR_GOAL_ACK REJECTED    PENDING WAITING_FOR_RESULT
WAITING_FOR_GOAL_ACK RECALLING   PENDING RECALLING
WAITING_FOR_GOAL_ACK RECALLED    PENDING WAITING_FOR_RESULT
WAITING_FOR_GOAL_ACK PREEMPTED   ACTIVE PREEMPTING WAITING_FOR_RESULT
WAITING_FOR_GOAL_ACK SUCCEEDED   ACTIVE WAITING_FOR_RESULT
WAITING_FOR_GOAL_ACK ABORTED     ACTIVE WAITING_FOR_RESULT
WAITING_FOR_GOAL_ACK PREEMPTING  ACTIVE PREEMPTING
PENDING PENDING     -
PENDING ACTIVE      ACTIVE
PENDING REJECTED    WAITING_FOR_RESULT
PENDING RECALLING   RECALLING
PENDING RECALLED    RECALLING WAITING_FOR_RESULT
PENDING PREEMPTED   ACTIVE PREEMPTING WAITING_FOR_RESULT
PENDING SUCCEEDED   ACTIVE WAITING_FOR_RESULT
PENDING ABORTED     ACTIVE WAITING_FOR_RESULT
PENDING PREEMPTING  ACTIVE PREEMPTING
ACTIVE ACTIVE      -
ACTIVE PREEMPTED   PREEMPTING WAITING_FOR_RESULT
ACTIVE SUCCEEDED   WAITING_FOR_RESULT
ACTIVE ABORTED     WAITING_FOR_RESULT
ACTIVE PREEMPTING  PREEMPTING
WAITING_FOR_RESULT ACTIVE     -
WAITING_FOR_RESULT REJECTED   -
WAITING_FOR_RESULT RECALLED   -
WAITING_FOR_RESULT PREEMPTED  -
WAITING_FOR_RESULT SUCCEEDED  -
WAITING_FOR_RESULT ABORTED    -
WAITING_FOR_CANCEL_ACK PENDING     -
WAITING_FOR_CANCEL_ACK ACTIVE      -
WAITING_FOR_CANCEL_ACK REJECTED    WAITING_FOR_RESULT
WAITING_FOR_CANCEL_ACK RECALLING   RECALLING
WAITING_FOR_CANCEL_ACK RECALLED    RECALLING WAITING_FOR_RESULT
WAITING_FOR_CANCEL_ACK PREEMPTED   PREEMPTING WAITING_FOR_RESULT
WAITING_FOR_CANCEL_ACK SUCCEEDED   PREEMPTING WAITING_FOR_RESULT
WAITING_FOR_CANCEL_ACK ABORTED     PREEMPTING WAITING_FOR_RESULT
WAITING_FOR_CANCEL_ACK PREEMPTING  PREEMPTING
RECALLING PENDING     -
RECALLING ACTIVE      -
RECALLING REJECTED    WAITING_FOR_RESULT
RECALLING RECALLING   -
RECALLING RECALLED    WAITING_FOR_RESULT
RECALLING PREEMPTED   PREEMPTING WAITING_FOR_RESULT
RECALLING SUCCEEDED   PREEMPTING WAITING_FOR_RESULT
RECALLING ABORTED     PREEMPTING WAITING_FOR_RESULT
RECALLING PREEMPTING  PREEMPTING
PREEMPTING ACTIVE      -
PREEMPTING PREEMPTED   WAITING_FOR_RESULT
PREEMPTING SUCCEEDED   WAITING_FOR_RESULT
PREEMPTING ABORTED     WAITING_FOR_RESULT
PREEMPTING PREEMPTING  -
DONE ACTIVE     -
DONE REJECTED   -
DONE RECALLED   -
DONE PREEMPTED  -
DONE SUCCEEDED  -
DONE ABORTED    -
"""


@pytest.mark.parametrize(
    ("state", "event"),
    list(
        itertools.product(
            Status, ["accept", "request_cancel", "cancel", "reject", "abort", "succeed"]
        )
    ),
    ids=lambda value: getattr(value, "name", value),
)
def test_server_cell(state, event):
    target = SERVER.get((state.name, event))
    table = server_life_cycle()
    if target is not None:
        assert table.step(state, event, goal="g", call="c") == (Status[target],)
        return
    with pytest.raises(IllegalTransitionError) as caught:
        table.step(state, event, goal="g", call="c")
    assert set(caught.value.allowed) == {source for source, name in SERVER if name == event}


def test_server_illegal_step_names_the_goal_and_the_way_out():
    with pytest.raises(IllegalTransitionError) as caught:
        server_life_cycle().step(
            Status.PREEMPTED, "succeed", goal="goal 7f3a on 'arm/move'", call="set_succeeded()"
        )
    assert str(caught.value) == (
        "goal 7f3a on 'arm/move': cannot go PREEMPTED -> SUCCEEDED on set_succeeded(); "
        "allowed from: ACTIVE, PREEMPTING."
    )


def test_client_statuses_pass_the_states_of_ros_1():
    expected = {}
    for line in CLIENT.strip().splitlines():
        state, status, *path = line.split()
        expected[CommState[state], status] = tuple(CommState[s] for s in path if s != "-")
    names = {status.name for status in Status}
    found = {k: path for k, path in client_life_cycle().steps.items() if k[1] in names}
    assert found == expected


def test_client_every_live_state_can_be_lost_and_cancelled():
    steps = client_life_cycle().steps
    for state in CommState:
        assert (state, "cancel") in steps
        assert ((state, "lose") in steps) is (state not in {CommState.DONE, CommState.LOST})


def test_client_ends_by_a_result_only_when_it_waits_for_one():
    sources = [state for state, event in client_life_cycle().steps if event == "result"]
    assert sources == [CommState.WAITING_FOR_RESULT]


def test_terminal_statuses_have_no_way_out():
    for state, _ in server_life_cycle().steps:
        assert state not in TERMINAL


def test_numbers_are_those_of_ros():
    assert [s.name for s in Status] == [
        "PENDING", "ACTIVE", "PREEMPTED", "SUCCEEDED", "ABORTED", "REJECTED", "PREEMPTING",
        "RECALLING", "RECALLED", "LOST",
    ]  # fmt: skip
    assert [s.value for s in CommState] == list(range(9))


def test_compile_rejects_two_answers_to_one_event():
    rows = [
        Row("go", (Status.PENDING,), (Status.ACTIVE,)),
        Row("go", (Status.PENDING,), (Status.ABORTED,)),
    ]
    with pytest.raises(ValueError, match="got 2 rows"):
        _compile("x", Status.PENDING, rows)


def test_compile_rejects_a_state_that_is_never_reached():
    rows = [Row("go", (Status.ACTIVE,), (Status.ABORTED,))]
    with pytest.raises(ValueError, match=r"never be reached: \['ACTIVE'\]"):
        _compile("x", Status.PENDING, rows)
