"""What a client makes of the servers it sees: which one is in force, and whose goals are lost."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.client import (
    GIVES_WAY_S,
    STATUS_LIST_TIMEOUT_S,
    ClientGoal,
    KnownServers,
    Receiver,
)
from actionlib_core.transport.tokens import Endpoint, Kind


def endpoint(session):
    return Endpoint(
        Kind.ACTION_SERVER, "move_base", "move_base_msgs/MoveBaseAction", "1" * 32, session, "r", 1
    )


A, B, C = (endpoint(letter * 32) for letter in "abc")
WRONG = TypeMismatchError(
    "move_base", ("move_base_msgs/MoveBaseAction", "1" * 32), (A.type, "2" * 32)
)


def offered(server="", address=None):
    """A goal that was sent to a server before."""
    goal = ClientGoal("sent")
    goal.on_offered(server, address)
    return goal


def to(server):
    return Receiver(server.session, server)


def test_goals_name_the_elder_server():
    servers, goal = KnownServers(), ClientGoal("new")
    assert servers.find_receiver(goal, 0.0) is None
    servers.appear(B, None, 0.0)
    assert servers.find_receiver(goal, 1.0) == to(B)
    servers.appear(A, None, 1.0)
    assert servers.conflict
    assert servers.current == A
    assert servers.find_receiver(goal, 1.0) == to(A)
    servers.say_farewell(A)
    assert servers.find_receiver(goal, 1.0) == to(B)


def test_goal_keeps_the_server_that_it_was_sent_to_first():
    servers = KnownServers()
    sent_to_b = offered(*to(B))
    servers.appear(B, None, 0.0)
    servers.appear(A, None, 0.0)
    assert servers.find_receiver(sent_to_b, 0.0) == to(B)
    servers.vanish(B)
    assert servers.find_receiver(sent_to_b, 0.0) == to(B)
    sent_to_b.on_untaken(0.0)
    assert servers.find_receiver(sent_to_b, 0.0) == to(A)


def test_younger_server_that_does_not_give_way_gets_the_new_goals():
    """The elder is dead then, and its token outlasts it."""
    servers = KnownServers()
    servers.appear(A, None, 0.0)
    servers.appear(B, None, 10.0)
    assert servers.find_receiver(ClientGoal("new"), 10.0 + GIVES_WAY_S - 0.1) == to(A)
    assert servers.find_receiver(ClientGoal("new"), 10.0 + GIVES_WAY_S) == to(B)
    assert servers.find_receiver(offered(*to(A)), 10.0 + GIVES_WAY_S) == to(A)


def test_goal_of_a_server_without_a_token_goes_to_no_other():
    servers = KnownServers()
    servers.on_foreign_list("bridge", 0.0)
    assert servers.find_receiver(ClientGoal("new"), 0.0) == ("bridge", None)
    servers.appear(A, None)
    assert servers.find_receiver(offered("bridge"), 0.0) == ("bridge", None)
    assert servers.take_silent(STATUS_LIST_TIMEOUT_S) == ["bridge"]
    assert servers.find_receiver(offered("bridge"), STATUS_LIST_TIMEOUT_S) is None
    assert servers.find_receiver(offered(A.session), 0.0) == to(A), "its token was late"


def test_only_servers_are_believed_while_one_shows_its_token():
    servers = KnownServers()
    assert servers.may_speak("anybody")
    servers.appear(A, None)
    assert not servers.may_speak("anybody")
    assert not servers.may_speak("")
    assert servers.may_speak(A.session)
    servers.appear(B, None)
    servers.vanish(A)
    assert servers.may_speak(A.session), "its last words"
    servers.appear(C, WRONG)
    assert not servers.may_speak(C.session)


def test_server_of_another_type_is_none_and_says_so():
    servers = KnownServers()
    servers.appear(A, WRONG)
    assert servers.current is None
    assert servers.find_wrong_type() is WRONG
    assert not servers.vanish(A)
    assert servers.find_wrong_type() is None


@pytest.mark.parametrize("right", ["there", "away", "leaving", "foreign"])
def test_server_of_another_type_is_no_error_beside_a_right_one(right):
    servers = KnownServers()
    servers.appear(A, WRONG)
    if right == "foreign":
        servers.on_foreign_list("bridge", 0.0)
    else:
        servers.appear(B, None)
    if right == "leaving":
        servers.say_farewell(B)
    if right == "away":
        servers.vanish(B)
        servers.expect_back(B, 5.0)
    assert servers.find_wrong_type() is None


def test_server_that_was_away_returns_or_is_replaced():
    servers = KnownServers()
    servers.appear(A, None)
    assert servers.vanish(A)
    servers.expect_back(A, 5.0)
    assert servers.appear(A, None) == (True, [])
    assert servers.vanish(A)
    servers.expect_back(A, 9.0)
    assert servers.appear(B, None) == (False, [A])
    assert servers.take_overdue(9.0) == []


def test_server_that_stays_away_is_overdue_once():
    servers = KnownServers()
    servers.expect_back(A, 5.0)
    assert servers.take_overdue(4.9) == []
    assert servers.take_overdue(5.0) == [A]
    assert servers.take_overdue(5.0) == []


def test_goals_sent_to_nobody_in_particular_go_with_the_last_server_only():
    servers = KnownServers()
    servers.appear(A, None)
    servers.vanish(A)
    assert servers.forget(A) == {"", A.session}
    servers.appear(B, None)
    assert servers.forget(A) == {A.session}


def test_server_that_said_farewell_takes_its_own_goals_only():
    servers = KnownServers()
    servers.appear(A, None)
    servers.say_farewell(A)
    assert servers.has_said_farewell(A)
    servers.vanish(A)
    assert servers.forget(A) == {A.session}
    assert not servers.has_said_farewell(A)


def test_status_list_without_a_token_stands_for_a_server_for_a_while():
    servers = KnownServers()
    assert not servers.is_there
    assert servers.on_foreign_list("bridge", 1.0)
    assert not servers.on_foreign_list("bridge", 2.0)
    assert servers.is_there
    assert servers.take_silent(2.0 + STATUS_LIST_TIMEOUT_S - 0.1) == []
    assert servers.take_silent(2.0 + STATUS_LIST_TIMEOUT_S) == ["bridge"]
    assert not servers.is_there
    servers.appear(A, None)
    servers.vanish(A)
    assert not servers.on_foreign_list(A.session, 20.0), "the last words of one that has left"


@given(
    st.lists(
        st.tuples(st.sampled_from(["appear", "vanish", "farewell"]), st.sampled_from([A, B, C]))
    )
)
def test_server_in_force_is_there_and_not_leaving(events):
    servers, there, leaving = KnownServers(), [], set()
    for what, server in events:
        if what == "appear" and server not in there:
            servers.appear(server, None)
            there.append(server)
        elif what == "vanish" and server in there:
            assert servers.vanish(server)
            servers.forget(server)
            there.remove(server)
            leaving.discard(server)
        elif what == "farewell" and server in there:
            servers.say_farewell(server)
            leaving.add(server)
        staying = [one for one in there if one not in leaving]
        assert servers.current == min(staying, default=None)


def test_oldest_are_forgotten():
    recent = Recent(2)
    for word in "abac":
        recent.add(word)
    assert [word in recent for word in "abc"] == [False, True, True]
