"""Tokens: what they say, and that every endpoint survives the way through its key."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.node import Node
from actionlib_core.transport._keys import check_key, key_matches
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.transport.tokens import Endpoint, Kind, parse_token, token_key, token_pattern
from actionlib_core.wire.presence import find_mismatch, list_endpoints

ROBOT = Endpoint(
    Kind.ACTION_SERVER,
    "robot_1/move_base",
    "move_base_msgs/MoveBaseAction",
    "70b6aca7c7f7746d8d1609ad94c80bb8",
    "0af1",
    "robot_1/nav",
    3,
)

NAME = st.from_regex(r"[a-z_][a-z0-9_]{0,5}(/[a-z0-9_]{1,5}){0,2}", fullmatch=True)


def test_key_is_the_documented_one():
    assert token_key(ROBOT) == (
        "@smachpy/action_server/0af1/3/robot_1%nav/move_base_msgs%MoveBaseAction/"
        "70b6aca7c7f7746d8d1609ad94c80bb8/robot_1/move_base"
    )


@pytest.mark.slow
@given(
    st.builds(
        Endpoint, st.sampled_from(Kind), NAME, st.just("") | NAME, st.just("") | NAME, NAME.map(lambda n: n.replace("/", "")),
        st.just("") | NAME, st.integers(0, 10**9),
    )
)  # fmt: skip
def test_every_endpoint_survives_its_key(endpoint):
    key = token_key(endpoint)
    assert check_key(key) == key
    assert parse_token(key) == endpoint
    assert key_matches(token_pattern(), key)
    assert key_matches(token_pattern(endpoint.kind, endpoint.name), key)
    assert key_matches(token_pattern(session=endpoint.session), key)


@pytest.mark.parametrize(
    "key", ["", "a/b", "@smachpy/x", "@other/service/s/1/n/t/m/x", "@smachpy/cook/s/1/n/t/m/x",
            "@smachpy/service/s/one/n/t/m/x", "@smachpy/service/s/1/n/t/m/x\nproblem",
            "@smachpy/service/s/1/n\x1b[31m/t/m/x"]
)  # fmt: skip
def test_foreign_keys_are_no_tokens(key):
    assert parse_token(key) is None


def test_patterns_select_kind_name_and_robot():
    key = token_key(ROBOT)
    assert key_matches(token_pattern(Kind.ACTION_SERVER, "robot_1/**"), key)
    assert not key_matches(token_pattern(Kind.SERVICE), key)
    assert not key_matches(token_pattern(None, "robot_2/**"), key)
    assert not key_matches("**", key)


def test_list_endpoints_is_sorted_and_selects(clock):
    network = MemoryNetwork(clock)
    node = Node("nav", transport=network.session(), clock=clock, namespace="robot_1")
    node.announce(Kind.SERVICE, "robot_1/b", "p/T", "12")
    node.announce(Kind.SERVICE, "robot_1/a", "p/T", "12")
    node.announce(Kind.PUBLISHER, "robot_1/c", "p/M", "34")
    other = network.session()
    assert [e.name for e in list_endpoints(other, kind=Kind.SERVICE)] == ["robot_1/a", "robot_1/b"]
    assert len(list_endpoints(other)) == 3
    (found,) = list_endpoints(other, name="robot_1/c")
    assert (found.kind, found.type, found.md5, found.node) == (
        Kind.PUBLISHER, "p/M", "34", "robot_1/nav",
    )  # fmt: skip
    assert list_endpoints(other, name="robot_2/**") == []


def test_mismatch_names_both_types_and_checksums():
    other = ROBOT._replace(type="my_msgs/Turn", md5="ff", node="turner")
    error = find_mismatch([ROBOT._replace(entity=9), other], ROBOT)
    assert error is not None
    for text in (ROBOT.type, ROBOT.md5, "my_msgs/Turn", "ff", "node 'turner'", "robot_1/move_base"):
        assert text in str(error)
    assert find_mismatch([ROBOT], ROBOT) is None
