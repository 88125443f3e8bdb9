"""Waiting for a network to be known: as long as names keep coming, and with a word at the end."""

from __future__ import annotations

import argparse

import pytest

from actionlib_core.cli import _listing
from actionlib_core.transport.memory import MemoryTransport
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire import presence
from actionlib_core.wire.presence import FIRST_S, SETTLE_MOST_S, SETTLE_S, settle_network
from tests.two_nodes import TwoNodes


@pytest.fixture
def world():
    with TwoNodes() as world:
        yield world


def announce(world, every, count, after=0.0):
    def run():
        world.clock.sleep(after)
        for number in range(count):
            world.robot.announce(Kind.SERVICE, f"s{number}", "pkg/Type", "0")
            world.clock.sleep(every)

    world.clock.spawn(run, name="announces")


def settle(world):
    started = world.clock.now()
    settled = settle_network(world.mission.transport, world.clock)
    return settled, world.clock.now() - started


def test_it_waits_while_names_keep_coming(world):
    announce(world, 0.3, 30)
    settled, seconds = settle(world)
    assert settled
    assert 29 * 0.3 < seconds < 30 * 0.3 + 2 * SETTLE_S


def test_names_that_never_end_are_told(world):
    announce(world, 0.3, 100)
    settled, seconds = settle(world)
    assert not settled
    assert seconds == pytest.approx(SETTLE_MOST_S, abs=SETTLE_S)


def test_a_program_that_was_found_may_take_its_time_for_the_first_name(world):
    announce(world, 0.3, 3, after=FIRST_S - 0.5)
    settled, seconds = settle(world)
    assert settled
    assert seconds > FIRST_S


@pytest.mark.parametrize(("answers_s", "settled"), [(5.0, True), (SETTLE_MOST_S, False)])
def test_a_busy_program_is_asked_for_what_it_does_not_show(world, monkeypatch, answers_s, settled):
    """`actionlib list` printed nothing, with exit code 0, beside 1,000 servers on a busy computer."""
    transport = world.mission.transport

    def answer(_pattern, timeout):
        world.clock.sleep(min(answers_s, timeout))
        return ["@smachpy/late"] if answers_s < timeout else []

    monkeypatch.setattr(transport, "list_alive", answer)
    found, seconds = settle(world)
    assert found is settled
    assert seconds >= FIRST_S + min(answers_s, SETTLE_MOST_S - FIRST_S - SETTLE_S)


@pytest.mark.parametrize(("busy", "seconds"), [(False, SETTLE_S), (True, FIRST_S)])
def test_nobody_there_is_known_soon_unless_the_computer_is_busy(world, monkeypatch, busy, seconds):
    monkeypatch.setattr(MemoryTransport, "is_linked", False)
    monkeypatch.setattr(presence, "is_busy", lambda: busy)
    assert settle(world) == (True, pytest.approx(seconds))


def test_a_busy_computer_may_take_its_time_to_find_another_program(world, monkeypatch):
    """`actionlib list` printed nothing, with exit code 0, as it was not linked after 0.4 s."""
    started = world.clock.now()
    monkeypatch.setattr(presence, "is_busy", lambda: True)
    monkeypatch.setattr(
        MemoryTransport, "is_linked", property(lambda _: world.clock.now() > started + 1.0)
    )
    announce(world, 0.3, 3, after=1.5)
    settled, seconds = settle(world)
    assert settled
    assert seconds > 1.5 + 2 * 0.3


@pytest.mark.parametrize(("settled", "code"), [(True, 0), (False, 2)])
def test_a_list_says_when_it_may_be_incomplete(world, monkeypatch, capsys, settled, code):
    world.robot.announce(Kind.SERVICE, "there", "pkg/Type", "0")
    args = argparse.Namespace(
        node=world.mission, json=False, count=False, show_types=False, settled=settled
    )
    assert _listing._list((Kind.SERVICE,), lambda *_: {}, args) == code
    out, err = capsys.readouterr()
    assert out == "/there\n"
    assert ("may be incomplete" in err) is not settled
