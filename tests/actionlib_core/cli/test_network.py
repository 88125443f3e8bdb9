"""What the commands wait for before they say what is there."""

from __future__ import annotations

import pytest

from actionlib_core.cli import UsageError, _network
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.pubsub.topic import Publisher
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import FIRST_S, SETTLE_MOST_S, settle_network

NODES = ("cli", "robot")


def test_a_program_that_says_nothing_is_waited_for_a_little(nodes, clock):
    start = clock.now()
    settle_network(nodes[0].transport, clock, 0.4)
    assert clock.now() - start == pytest.approx(FIRST_S)


def test_who_shows_up_late_makes_it_wait_again(nodes, clock):
    start = clock.now()
    for number, delay in enumerate((0.3, 0.6)):
        clock.call_later(delay, lambda n=number: Publisher(f"a_{n}", String, node=nodes[1]))
    settle_network(nodes[0].transport, clock, 0.4)
    assert clock.now() - start == pytest.approx(1.0)


def test_a_network_that_never_rests_is_taken_as_it_is(nodes, clock):
    start = clock.now()
    for number in range(300):
        clock.call_later(number * 0.1, lambda n=number: Publisher(f"a_{n}", String, node=nodes[1]))
    settle_network(nodes[0].transport, clock, 0.4)
    assert clock.now() - start == pytest.approx(SETTLE_MOST_S)


def test_a_name_is_waited_for_and_ends_of_other_kinds_are_not_it(nodes, clock):
    cli, robot = nodes
    start = clock.now()
    there = []  # a publisher that the program drops leaves its topic
    clock.call_later(0.5, lambda: there.append(Publisher("chatter", String, node=robot)))
    assert _network.find_by_name(cli, "chatter", (Kind.SERVICE,)) == []
    assert clock.now() - start == pytest.approx(_network.FIND_S)
    (end,) = _network.find_by_name(cli, "chatter", (Kind.PUBLISHER,))
    assert end.node == "robot"


@pytest.mark.parametrize(
    ("names", "text"),
    [
        ([], "expected one, but there is none at all."),
        (["charge"], "expected one of ['/charge']."),
        (["charge", "move_base"], "Did you mean '/move_base'?"),
    ],
)
def test_what_there_is_instead(names, text):
    assert _network.which_there_are("move_bse", names).endswith(text)


def test_error_that_a_server_answers_with_is_told(nodes):
    cli, robot = nodes

    def answer(query):
        query.reply_error("action 'dock': out of order")
        query.finish()

    robot.transport.queryable("dock/result", answer)
    with pytest.raises(UsageError, match=r"^action 'dock': out of order"):
        _network.ask(cli, "dock", "/nobody-1", lambda reply: reply)
