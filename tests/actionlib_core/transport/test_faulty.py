"""The faults themselves; that a fault-free session keeps every promise is in tests/conformance."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.transport import Presence, Quality
from actionlib_core.transport.faulty import (
    DELIVERED,
    DROPPED,
    FaultyTransport,
    RandomFaults,
    ScriptedFaults,
)
from actionlib_core.transport.memory import MemoryNetwork


@pytest.fixture
def pair(clock):
    """A session with a bad link, and a good one."""
    network = MemoryNetwork(clock)
    bad, good = FaultyTransport(network.session(), lease=10.0), network.session()
    yield bad, good
    bad.close()
    good.close()


def hear(session, key="goal"):
    heard = []
    session.subscribe(key, lambda sample: heard.append(sample.payload))
    return heard


def send(session, *payloads, key="goal"):
    port = session.publisher(key)
    for payload in payloads:
        port.put(payload)


def test_scripted_fates_drop_repeat_delay_and_reorder(pair, clock):
    bad, good = pair
    bad.plan = ScriptedFaults({"goal": [DROPPED, (0.0, 0.0), (2.0,), DELIVERED]})
    heard = hear(good)
    send(bad, b"0", b"1", b"2", b"3", b"4")
    clock.sleep(1)
    assert heard == [b"1", b"1", b"3", b"4"]
    clock.sleep(2)
    assert heard == [b"1", b"1", b"3", b"4", b"2"]
    assert [sent.fate for sent in bad.sent] == [(), (0.0, 0.0), (2.0,), (0.0,), (0.0,)]


def test_faults_are_for_the_keys_of_their_pattern(pair, clock):
    bad, good = pair
    bad.plan = RandomFaults(1, "robot_0/**", drop=1.0)
    robot, other = hear(good, "robot_0/goal"), hear(good, "robot_1/goal")
    send(bad, b"x", key="robot_0/goal")
    send(bad, b"x", key="robot_1/goal")
    clock.sleep(1)
    assert (robot, other) == ([], [b"x"])


@given(st.integers(), st.text("ab/", min_size=1).filter(lambda k: "//" not in k))
def test_random_faults_depend_on_seed_key_and_number_only(seed, key):
    faults = RandomFaults(seed, drop=0.3, repeat=0.3, delay=0.3, longest=2.0)
    key = key.strip("/") or "a"
    fates = [faults(key, number) for number in range(20)]
    assert fates == [faults(key, number) for number in range(20)]
    assert all(len(fate) <= 2 and all(0 <= delay <= 2.0 for delay in fate) for fate in fates)


def test_random_faults_have_about_the_shares_asked_for():
    faults = RandomFaults(5, drop=0.2, repeat=0.5, delay=0.1)
    fates = [faults("goal", number) for number in range(5000)]
    assert 0.17 < fates.count(()) / 5000 < 0.23
    assert 0.45 < sum(len(f) == 2 for f in fates) / 4000 < 0.55


def test_nothing_passes_a_cut_link_and_everything_after_it(pair, clock):
    bad, good = pair
    at_good, at_bad = hear(good), hear(bad)
    to_good, to_bad = bad.publisher("goal"), good.publisher("goal")
    bad.cut(5.0)
    to_good.put(b"lost")
    to_bad.put(b"lost too")
    clock.sleep(6)
    to_good.put(b"a")
    to_bad.put(b"b")
    clock.sleep(1)
    assert at_good == [b"lost too", b"a", b"b"]
    assert at_bad == [b"a", b"b"]


def test_message_on_its_way_is_lost_in_a_cut(pair, clock):
    bad, good = pair
    bad.plan = ScriptedFaults({"goal": [(3.0,)]})
    heard = hear(good)
    send(bad, b"late")
    clock.sleep(1)
    bad.cut(5.0)
    clock.sleep(10)
    assert heard == []


def test_tokens_vanish_after_the_lease_and_return_with_the_link(pair, clock):
    bad, good = pair
    seen_by_good, seen_by_bad = [], []
    good.watch_alive("@x/*", lambda p: seen_by_good.append((clock.now(), *p)))
    bad.watch_alive("@x/*", lambda p: seen_by_bad.append((clock.now(), *p)))
    bad.declare_alive("@x/bad")
    good.declare_alive("@x/good")
    clock.sleep(1)
    bad.cut(20.0)
    clock.sleep(12)
    assert good.list_alive("@x/*", 1.0) == ["@x/good"]
    assert bad.list_alive("@x/*", 1.0) == ["@x/bad"]
    clock.sleep(18)
    assert [s for s in seen_by_good if s[1] == "@x/bad"] == [
        (0.0, "@x/bad", True), (11.0, "@x/bad", False), (21.0, "@x/bad", True),
    ]  # fmt: skip
    assert [s for s in seen_by_bad if s[1] == "@x/good"] == [
        (0.0, "@x/good", True), (11.0, "@x/good", False), (21.0, "@x/good", True),
    ]  # fmt: skip
    assert [s for s in seen_by_bad if s[1] == "@x/bad"] == [(0.0, "@x/bad", True)]


def test_short_cut_changes_no_token(pair, clock):
    bad, good = pair
    seen = []
    good.watch_alive("@x/*", seen.append)
    bad.declare_alive("@x/bad")
    bad.cut(9.0)
    clock.sleep(30)
    assert seen == [Presence("@x/bad", alive=True)]


def test_end_that_died_during_the_cut_is_seen_when_the_link_is_back(pair, clock):
    bad, good = pair
    seen = []
    bad.watch_alive("@x/*", lambda p: seen.append((clock.now(), p.alive)))
    token = good.declare_alive("@x/good")
    clock.sleep(1)
    bad.cut(5.0)
    token.close()
    clock.sleep(10)
    assert seen == [(0.0, True), (6.0, False)]


def test_latched_message_comes_again_after_a_cut(pair, clock):
    bad, good = pair
    publisher = good.publisher("map", "", Quality(latch=True))
    publisher.put(b"old")
    heard = hear(bad, "map")
    clock.sleep(1)
    bad.cut(5.0)
    publisher.put(b"new")
    clock.sleep(10)
    assert heard == [b"old", b"new"]


def test_query_over_a_cut_link_ends_at_its_timeout(pair, clock):
    bad, good = pair
    good.queryable("add", lambda q: (q.reply(b"x"), q.finish()))
    ends = []
    bad.cut(3.0)
    bad.query(
        "add", b"", timeout=2.0, on_reply=ends.append, on_done=lambda: ends.append(clock.now())
    )
    clock.sleep(10)
    assert ends == [2.0]


def test_query_ends_with_the_lease_of_a_cut_link(pair, clock):
    bad, good = pair
    kept = []
    good.queryable("add", kept.append)
    ends = []
    bad.query(
        "add", b"", timeout=99, on_reply=ends.append, on_done=lambda: ends.append(clock.now())
    )
    clock.sleep(1)
    bad.cut(30)
    clock.sleep(50)
    assert ends == [11.0]


@pytest.mark.parametrize(("seconds", "end"), [(3.0, 4.0), (50.0, 11.0)])
def test_query_to_a_cut_session_ends_when_it_is_back_or_dead(pair, clock, seconds, end):
    bad, good = pair
    bad.queryable("add", lambda q: (q.reply(b"x"), q.finish()))
    ends = []
    clock.sleep(1)
    bad.cut(seconds)
    good.query(
        "add", b"", timeout=99, on_reply=ends.append, on_done=lambda: ends.append(clock.now())
    )
    clock.sleep(99)
    assert ends == [end]


def test_answer_given_during_a_cut_is_lost(pair, clock):
    bad, good = pair
    asked = []
    bad.queryable("add", asked.append)
    ends = []
    good.query(
        "add", b"", timeout=99, on_reply=ends.append, on_done=lambda: ends.append(clock.now())
    )
    clock.sleep(1)
    bad.cut(5.0)
    asked[0].reply(b"x")
    asked[0].finish()
    clock.sleep(50)
    assert ends == [6.0]


def test_late_query_is_answered_late(pair, clock):
    bad, good = pair
    bad.plan = ScriptedFaults({"add": [(2.0,), DROPPED]})
    good.queryable("add", lambda q: (q.reply(b"x"), q.finish()))
    ends = []
    for _ in range(2):
        bad.query("add", b"", timeout=9, on_reply=lambda r: ends.append(r.payload),
                  on_done=lambda: ends.append(clock.now()))  # fmt: skip
    clock.sleep(50)
    assert ends == [b"x", 2.0, 9.0]


def test_closing_forgets_what_is_late(pair, clock):
    bad, good = pair
    bad.plan = ScriptedFaults({"goal": [(2.0,)]})
    heard = hear(good)
    send(bad, b"late")
    bad.close()
    clock.sleep(5)
    assert heard == []


def test_restore_is_quiet_without_a_cut(pair, clock):
    bad, good = pair
    bad.restore()
    bad.cut(1.0)
    bad.cut(99.0)
    clock.sleep(2)
    assert not bad.is_cut
    heard = hear(good)
    send(bad, b"x")
    clock.sleep(1)
    assert heard == [b"x"]
