"""What a client makes of the servers it sees: which one is in force, and whose goals are lost."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core._core.client_goal import UNLISTED_S
from actionlib_core._core.known_servers import KnownServers
from actionlib_core._core.recent import Recent
from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.presence import Endpoint, Kind, token_key


def endpoint(session):
    return Endpoint(
        Kind.ACTION_SERVER, "move_base", "move_base_msgs/MoveBaseAction", "1" * 32, session, "r", 1
    )


A, B, C = (endpoint(letter * 32) for letter in "abc")
WRONG = TypeMismatchError(
    "move_base", ("move_base_msgs/MoveBaseAction", "1" * 32), (A.type, "2" * 32)
)


def test_goals_name_the_server_that_is_alone():
    servers = KnownServers()
    assert (servers.current, servers.token) == (None, "")
    servers.appear(A, None)
    assert (servers.current, servers.token) == (A, token_key(A))
    servers.appear(B, None)
    assert (servers.current, servers.token) == (A, "")
    servers.say_farewell(A)
    assert (servers.current, servers.token) == (B, token_key(B))


def test_server_of_another_type_is_none_and_says_so():
    servers = KnownServers()
    servers.appear(A, WRONG)
    assert servers.current is None
    with pytest.raises(TypeMismatchError):
        servers.check_types()
    assert not servers.vanish(A)
    servers.check_types()


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
    assert not servers.may_listen(1.0)
    assert servers.hear_foreign("bridge", 1.0)
    assert not servers.hear_foreign("bridge", 2.0)
    assert servers.may_listen(2.0 + UNLISTED_S - 0.1)
    assert not servers.may_listen(2.0 + UNLISTED_S)
    servers.hear_foreign("bridge", 20.0)
    servers.appear(A, None)
    servers.vanish(A)
    assert not servers.may_listen(20.0)
    assert not servers.hear_foreign(A.session, 20.0), "the last words of one that has left"


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
        assert servers.current == (staying[0] if staying else None)
        assert servers.token == (token_key(staying[0]) if len(staying) == 1 else "")


def test_oldest_are_forgotten():
    recent = Recent(2)
    for word in "abac":
        recent.add(word)
    assert [word in recent for word in "abc"] == [False, True, True]
