"""What the network in memory does beyond the protocol: killing, and runs that repeat."""

from __future__ import annotations

import pytest

from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.exceptions import TransportError
from actionlib_core.transport import Presence
from actionlib_core.transport.memory import MemoryNetwork


def test_killed_session_vanishes_and_is_silent(clock):
    network = MemoryNetwork(clock)
    dying, other = network.session(), network.session()
    seen, heard, own = [], [], []
    other.watch_alive("@x/*", seen.append)
    other.subscribe("goal", heard.append)
    dying.subscribe("goal", own.append)
    port = dying.publisher("goal")
    dying.declare_alive("@x/dying")
    clock.sleep(1)
    dying.kill()
    port.put(b"x")
    dying.publisher("goal").put(b"y")
    dying.declare_alive("@x/ghost")
    other.publisher("goal").put(b"z")
    clock.sleep(1)
    assert seen == [Presence("@x/dying", alive=True), Presence("@x/dying", alive=False)]
    assert [sample.payload for sample in heard] == [b"z"]
    assert own == []
    assert dying.list_alive("@x/*", 1.0) == ["@x/ghost"]
    dying.close()


def test_killed_session_ends_the_queries_it_had(clock):
    network = MemoryNetwork(clock)
    dying, other = network.session(), network.session()
    asked, ends = [], []
    dying.queryable("add", asked.append)
    other.query(
        "add", b"", timeout=99, on_reply=ends.append, on_done=lambda: ends.append(clock.now())
    )
    clock.sleep(1)
    dying.kill()
    asked[0].reply(b"from the grave")
    asked[0].finish()
    clock.sleep(1)
    assert ends == [1.0]


def _run(seed):
    with VirtualClock(seed) as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        sessions = [network.session() for _ in range(4)]
        log = []
        for index, session in enumerate(sessions):
            session.subscribe("goal", lambda s, index=index: log.append((index, s.payload)))
        for session in sessions:
            session.publisher("goal").put(session.session_id.encode())
        clock.sleep(1)
        return log


def test_same_seed_gives_the_same_run():
    assert _run(3) == _run(3)
    assert len({tuple(_run(seed)) for seed in range(10)}) > 1


def test_real_clock_close_waits_for_a_running_callback():
    clock = RealClock()
    network = MemoryNetwork(clock)
    session = network.session()
    started, ended = clock.event(), []

    def callback(sample):
        started.set()
        clock.event().wait(0.05)
        ended.append(sample)

    session.subscribe("goal", callback)
    session.publisher("goal").put(b"x")
    assert started.wait(60)
    session.close()
    assert len(ended) == 1


def test_pattern_with_an_empty_word_is_refused(clock):
    session = MemoryNetwork(clock).session()
    with pytest.raises(TransportError, match="pattern: empty word: got 'a//b'"):
        session.list_alive("a//b", 1.0)
