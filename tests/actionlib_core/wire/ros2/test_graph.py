"""Our node in the graph of ROS 2, and what it sees of others there."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.exceptions import TransportError
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.ros2.attachment import unpack_attachment
from actionlib_core.wire.ros2.graph import ActionServers, RosNode, RosType
from actionlib_core.wire.ros2.names import (
    LATCHED,
    Kind,
    Token,
    action_names,
    parse_token,
)

NAMES = action_names("robot1/fib")
TYPES = tuple(RosType(f"a/srv/{word}", f"RIHS01_{word}") for word in NAMES._fields)
KINDS = (Kind.SERVICE, Kind.SERVICE, Kind.SERVICE, Kind.PUBLISHER, Kind.PUBLISHER)


def tokens(session: str = "aa", node_id: int = 0, **changed: RosType) -> list[Token]:
    """Return the tokens of a server of the action."""
    return [
        Token(
            1,
            session,
            node_id,
            10 + number,
            kind,
            "",
            "robot1",
            "nav",
            name,
            *changed.get(word, own),
            None,
        )
        for number, (kind, name, word, own) in enumerate(
            zip(KINDS, NAMES, NAMES._fields, TYPES, strict=True)
        )
    ]


@given(st.permutations(range(5)), st.integers(0, 4))
def test_a_server_is_there_with_five_tokens_in_any_order_and_gone_with_the_first(
    order: list[int], lost: int
) -> None:
    servers, shown = ActionServers("robot1/fib", TYPES), tokens()
    changes = [servers.on_token(shown[number], alive=True) for number in order]
    assert changes[:4] == [None] * 4
    assert changes[4].alive
    assert changes[4].mismatches == ()
    assert changes[4].server[:3] == ("aa", "robot1/nav", 0)
    assert servers.on_token(shown[0], alive=True) is None
    gone = servers.on_token(shown[lost], alive=False)
    assert (gone.server, gone.alive) == (changes[4].server, False)
    assert len(servers) == 0
    again = servers.on_token(shown[lost], alive=True)
    assert again.server == gone.server  # its link was lost for a while


def test_two_servers_are_two_also_in_one_session() -> None:
    servers = ActionServers("robot1/fib", TYPES)
    for token in (*tokens(), *tokens(node_id=7), *tokens("bb")):
        servers.on_token(token, alive=True)
    assert len(servers) == 3


@pytest.mark.parametrize(
    "other", [RosType("a/srv/feedback", "RIHS01_other"), RosType("b/srv/X", "RIHS01_feedback")]
)
def test_another_hash_or_type_is_reported_with_both(other: RosType) -> None:
    servers = ActionServers("robot1/fib", TYPES)
    *_, change = [servers.on_token(token, alive=True) for token in tokens(feedback=other)]
    (mismatch,) = change.mismatches
    assert mismatch == (NAMES.feedback, TYPES[3], other)


def test_clients_and_others_are_no_servers() -> None:
    servers = ActionServers("robot1/fib", TYPES)
    for token in tokens():
        client = Kind.CLIENT if token.kind is Kind.SERVICE else Kind.SUBSCRIPTION
        assert servers.on_token(token._replace(kind=client), alive=True) is None
        assert servers.on_token(token._replace(name="robot1/other"), alive=True) is None
    assert len(servers) == 0


def test_a_node_and_its_ends_are_seen_and_listed() -> None:
    with VirtualClock() as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        ours, theirs = network.session(), network.session()
        node = RosNode(ours, clock, domain=7, full_name="robot1/mission")
        other = RosNode(theirs, clock, domain=7, full_name="looker")
        stranger = RosNode(theirs, clock, domain=8, full_name="stranger")
        heard: list[tuple[Token, str, bool]] = []
        watch = other.watch(lambda *what: heard.append(what), name="robot1/map")
        all_of_it = other.watch_action("robot1/fib", lambda *what: heard.append(what))
        end = node.end(Kind.PUBLISHER, "robot1/map", RosType("a/msg/Map", "RIHS01_1"), LATCHED)
        part = node.end(Kind.SERVICE, NAMES.get_result, TYPES[2])
        stranger.end(Kind.PUBLISHER, "robot1/map", RosType("a/msg/Map", "RIHS01_1")).show()
        assert other.list() == []
        for shown in (node, end, end, part):
            shown.show()
        clock.sleep(0.1)
        assert [(token.name, alive) for token, _, alive in heard] == [
            ("robot1/map", True),
            (NAMES.get_result, True),
        ]
        assert heard[0][0] == end.token == parse_token(heard[0][1])
        assert heard[0][0].full_node == "robot1/mission"
        assert {token.kind for token in other.list()} == {Kind.NODE, Kind.PUBLISHER, Kind.SERVICE}
        assert other.list(kind=Kind.NODE) == [node.token]
        assert other.list(name="robot1/map") == [end.token]
        assert len({token.entity_id for token in other.list()}) == 3
        for shown in (end, end, part, node):
            shown.close()
        clock.sleep(0.1)
        assert [alive for _, _, alive in heard] == [True, True, False, False]
        watch.close()
        all_of_it.close()
        ours.close()
        with pytest.raises(TransportError):
            end.show()


def test_what_an_end_sends_is_numbered_and_named() -> None:
    with VirtualClock() as clock, use_clock(clock):
        node = RosNode(MemoryNetwork(clock).session(), clock, domain=0, full_name="m")
        first, second = (node.end(Kind.CLIENT, "a", TYPES[0]) for _ in range(2))
        sent = [unpack_attachment(end.attachment()) for end in (first, first, second)]
        assert [attachment.sequence for attachment in sent] == [1, 2, 1]
        assert [attachment.gid for attachment in sent] == [first.gid, first.gid, second.gid]
        assert first.gid != second.gid
        assert sent[0].time_ns == clock.time_ns()


def test_nodes_of_one_session_share_its_numbers() -> None:
    with VirtualClock() as clock, use_clock(clock):
        session, ids = MemoryNetwork(clock).session(), itertools.count()
        nodes = [RosNode(session, clock, domain=0, full_name=n, ids=ids) for n in ("a", "b")]
        ends = [node.end(Kind.CLIENT, "x", TYPES[0]) for node in nodes]
        assert [end.token.node_id for end in ends] == [0, 1]
        assert [end.token.entity_id for end in ends] == [2, 3]


@pytest.mark.parametrize(("domain", "name"), [(-1, "a"), (0, ""), (0, "a/"), (0, "a b")])
def test_a_node_that_nobody_could_see_is_not_made(domain: int, name: str) -> None:
    with VirtualClock() as clock, use_clock(clock):
        session = MemoryNetwork(clock).session()
        with pytest.raises(ValueError, match="expected"):
            RosNode(session, clock, domain=domain, full_name=name)
