"""Every promise of the Transport protocol, on every network."""

from __future__ import annotations

import threading
from functools import partial

import pytest

from actionlib_core.exceptions import TransportError
from actionlib_core.transport import Presence, Quality, Reply, Sample

GOAL = "robot_0/move_base/goal"
LATCH = Quality(latch=True)
HOUR_S = 3600.0  # what ends only then has not ended at once, on a busy computer either


def payloads(items):
    return [item.payload for item in items]


# -- publishing ------------------------------------------------------------------------------------


def test_put_reaches_subscriber_with_key_encoding_and_source(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox)
    publisher = a.publisher(GOAL, "ros1/pkg/Type;md5=12", Quality(express=True))
    network.meet(a, b)
    publisher.put(b"one")
    assert inbox.wait_for(1) == [Sample(GOAL, b"one", "ros1/pkg/Type;md5=12", a.session_id)]


def test_put_without_encoding_arrives_with_empty_encoding(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    publisher.put(b"")
    assert inbox.wait_for(1) == [Sample(GOAL, b"", "", a.session_id)]


def test_messages_of_one_sender_keep_their_order(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    sent = [str(number).encode() for number in range(500)]
    for payload in sent:
        publisher.put(payload)
    assert payloads(inbox.wait_for(500)) == sent


def test_large_payload_arrives_whole(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    publisher.put(bytes(range(256)) * 20_000)
    assert payloads(inbox.wait_for(1)) == [bytes(range(256)) * 20_000]


def test_every_subscriber_of_the_key_gets_it_and_no_other(network):
    a, b, c = (network.session() for _ in range(3))
    first, second, other = network.inbox(), network.inbox(), network.inbox()
    b.subscribe(GOAL, first)
    c.subscribe(GOAL, second)
    c.subscribe("robot_0/move_base/goals", other)
    publisher = a.publisher(GOAL)
    last = a.publisher("robot_0/move_base/goals")
    network.meet(a, b, c)
    publisher.put(b"x")
    last.put(b"y")
    assert payloads(first.wait_for(1)) == [b"x"]
    assert payloads(second.wait_for(1)) == [b"x"]
    assert payloads(other.wait_for(1)) == [b"y"]


def test_own_puts_arrive_off_the_callers_stack(network):
    a = network.session()
    inside = []
    inbox = network.inbox()
    putting = threading.local()

    def callback(sample):
        inside.append(getattr(putting, "now", False))
        inbox(sample)

    a.subscribe(GOAL, callback)
    publisher = a.publisher(GOAL)
    putting.now = True
    publisher.put(b"x")
    putting.now = False
    assert payloads(inbox.wait_for(1)) == [b"x"]
    assert inside == [False]


def test_callback_may_put_on_its_own_key(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()

    def count_down(sample):
        inbox(sample)
        left = int(sample.payload) - 1
        if left >= 0:
            answer.put(str(left).encode())

    answer = b.publisher(GOAL)
    b.subscribe(GOAL, count_down)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    publisher.put(b"3")
    assert payloads(inbox.wait_for(4)) == [b"3", b"2", b"1", b"0"]


def test_callback_may_declare_and_close(network):
    a, b = network.session(), network.session()
    inbox, later = network.inbox(), network.inbox()
    handles = []

    def callback(sample):
        handles.pop().close()
        b.subscribe("later", later)
        b.declare_alive("@later/b")
        inbox(sample)

    handles.append(b.subscribe(GOAL, callback))
    alive = network.inbox()
    a.watch_alive("@later/*", alive)
    publisher = a.publisher(GOAL)
    second = a.publisher("later")
    network.meet(a, b)
    publisher.put(b"x")
    alive.wait_for(1)
    publisher.put(b"y")
    second.put(b"z")
    assert payloads(later.wait_for(1)) == [b"z"]
    assert payloads(inbox.items) == [b"x"]


def test_matching_follows_the_subscribers(network):
    a, b = network.session(), network.session()
    publisher = a.publisher(GOAL)
    assert not publisher.matching()
    subscriber = b.subscribe(GOAL, print)
    network.meet(a, b)
    assert publisher.matching()
    subscriber.close()
    network.meet(a, b)
    assert not publisher.matching()


def test_raising_callback_is_reported_and_the_next_message_comes(network, monkeypatch):
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(args.exc_value))
    a, b = network.session(), network.session()
    inbox = network.inbox()

    def callback(sample):
        inbox(sample)
        if sample.payload == b"bad":
            raise ValueError("bad sample")

    b.subscribe(GOAL, callback)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    publisher.put(b"bad")
    publisher.put(b"good")
    assert payloads(inbox.wait_for(2)) == [b"bad", b"good"]
    assert [str(error) for error in reported] == ["bad sample"]


# -- latching --------------------------------------------------------------------------------------


def test_late_subscriber_gets_exactly_the_last_message(network):
    a, b = network.session(), network.session()
    publisher = a.publisher(GOAL, "enc", LATCH)
    for payload in (b"1", b"2", b"3"):
        publisher.put(payload)
    network.meet(a, b)
    inbox = network.inbox()
    b.subscribe(GOAL, inbox)
    assert inbox.wait_for(1) == [Sample(GOAL, b"3", "enc", a.session_id)]
    publisher.put(b"4")
    assert payloads(inbox.wait_for(2)) == [b"3", b"4"]


def test_early_subscriber_gets_every_latched_message_once(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox)
    network.meet(a, b)
    publisher = a.publisher(GOAL, "", LATCH)
    network.meet(a, b)
    for payload in (b"1", b"2", b"3"):
        publisher.put(payload)
    assert payloads(inbox.wait_for(3)) == [b"1", b"2", b"3"]
    late = network.inbox()
    b.subscribe(GOAL, late)
    late.wait_for(1)
    publisher.put(b"end")
    assert payloads(late.wait_for(2)) == [b"3", b"end"]
    assert payloads(inbox.wait_for(4)) == [b"1", b"2", b"3", b"end"]


def test_subscriber_of_the_same_session_gets_the_latched_message(network):
    a = network.session()
    publisher = a.publisher(GOAL, "", LATCH)
    publisher.put(b"1")
    inbox = network.inbox()
    a.subscribe(GOAL, inbox)
    assert payloads(inbox.wait_for(1)) == [b"1"]


def test_latched_message_of_two_threads_is_the_one_that_came_last(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox, history=False)
    network.meet(a, b)
    publisher = a.publisher(GOAL, "", LATCH)
    network.meet(a, b)
    sent = 100

    def send(letter):
        for number in range(sent):
            publisher.put(b"%s%d" % (letter, number))

    threads = [network.clock.spawn(partial(send, letter), name="sender") for letter in (b"a", b"b")]
    for thread in threads:
        thread.join(60.0)
    last = payloads(inbox.wait_for(2 * sent))[-1]
    late = network.inbox()
    b.subscribe(GOAL, late)
    assert payloads(late.wait_for(1)) == [last]


def test_every_latched_publisher_is_heard(network):
    a, b, c = (network.session() for _ in range(3))
    for session, payload in ((a, b"a"), (b, b"b")):
        session.publisher(GOAL, "", LATCH).put(payload)
    network.meet(a, b, c)
    inbox = network.inbox()
    c.subscribe(GOAL, inbox)
    assert sorted(payloads(inbox.wait_for(2))) == [b"a", b"b"]


def test_closed_latched_publisher_is_forgotten(network):
    a, b = network.session(), network.session()
    old = a.publisher(GOAL, "", LATCH)
    old.put(b"old")
    old.close()
    new = a.publisher(GOAL, "", LATCH)
    new.put(b"new")
    network.meet(a, b)
    inbox = network.inbox()
    b.subscribe(GOAL, inbox)
    inbox.wait_for(1)
    new.put(b"end")
    assert payloads(inbox.wait_for(2)) == [b"new", b"end"]


def test_without_history_the_latched_message_does_not_come(network):
    a, b = network.session(), network.session()
    publisher = a.publisher(GOAL, "", LATCH)
    publisher.put(b"1")
    network.meet(a, b)
    without, asked = network.inbox(), network.inbox()
    b.subscribe(GOAL, without, history=False)
    b.subscribe(GOAL, asked)
    asked.wait_for(1)
    publisher.put(b"2")
    assert payloads(asked.wait_for(2)) == [b"1", b"2"]
    assert payloads(without.wait_for(1)) == [b"2"]


def test_what_a_publisher_has_kept_already_comes_only_to_those_who_ask_for_it(network):
    a, b = network.session(), network.session()
    without, early, late = (network.inbox() for _ in range(3))
    b.subscribe(GOAL, without, history=False)
    b.subscribe(GOAL, early)
    network.meet(a, b)
    publisher = a.publisher(GOAL, "enc", LATCH, kept=b"1")
    assert early.wait_for(1) == [Sample(GOAL, b"1", "enc", a.session_id)]
    b.subscribe(GOAL, late)
    assert payloads(late.wait_for(1)) == [b"1"]
    publisher.put(b"2")
    for inbox, expected in ((early, [b"1", b"2"]), (late, [b"1", b"2"]), (without, [b"2"])):
        assert payloads(inbox.wait_for(len(expected))) == expected


# -- caches, in the way of zenoh's advanced publishers ---------------------------------------------


def test_late_subscriber_gets_what_it_asks_for_of_a_cache(network):
    a, b = network.session(), network.session()
    publisher = a.publisher(GOAL, "", Quality(cache=3))
    for number in range(5):
        publisher.put(b"%d" % number, b"seq %d" % number)
    network.meet(a, b)
    two, ten, live = network.inbox(), network.inbox(), network.inbox()
    b.subscribe(GOAL, two, cached=2)
    b.subscribe(GOAL, ten, cached=10)
    b.subscribe(GOAL, live)
    assert payloads(two.wait_for(2)) == [b"3", b"4"]
    assert payloads(ten.wait_for(3)) == [b"2", b"3", b"4"]
    assert [sample.attachment for sample in ten.items] == [b"seq 2", b"seq 3", b"seq 4"]
    network.meet(a, b)
    publisher.put(b"end", b"seq 5")
    assert payloads(two.wait_for(3)) == [b"3", b"4", b"end"]
    assert payloads(ten.wait_for(4))[-1] == b"end"
    assert payloads(live.wait_for(1)) == [b"end"]


def test_early_subscriber_gets_every_cached_message_once(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox, cached=1)
    network.meet(a, b)
    publisher = a.publisher(GOAL, "", Quality(cache=1))
    network.meet(a, b)
    for payload in (b"1", b"2", b"3"):
        publisher.put(payload, b"att")
    assert payloads(inbox.wait_for(3)) == [b"1", b"2", b"3"]
    late = network.inbox()
    b.subscribe(GOAL, late, cached=1)
    late.wait_for(1)
    publisher.put(b"end", b"att")
    assert payloads(late.wait_for(2)) == [b"3", b"end"]
    assert payloads(inbox.wait_for(4)) == [b"1", b"2", b"3", b"end"]
    assert publisher.matching()


def test_subscriber_of_a_cache_hears_a_publisher_without_one(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox, cached=1)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    publisher.put(b"x", b"att")
    publisher.put(b"y", b"att")
    assert payloads(inbox.wait_for(2)) == [b"x", b"y"]


def test_closed_publisher_with_a_cache_is_forgotten(network):
    a, b = network.session(), network.session()
    publisher = a.publisher(GOAL, "", Quality(cache=1))
    publisher.put(b"old", b"att")
    publisher.close()
    with pytest.raises(TransportError, match="closed"):
        publisher.put(b"x", b"att")
    new = a.publisher(GOAL)
    network.meet(a, b)
    inbox = network.inbox()
    b.subscribe(GOAL, inbox, cached=1)
    network.meet(a, b)
    new.put(b"end")
    assert payloads(inbox.wait_for(1)) == [b"end"]


# -- attachments -----------------------------------------------------------------------------------


@pytest.mark.parametrize("attachment", [b"", b"123456789012", bytes(range(33))])
def test_attachment_arrives_with_the_message(network, attachment):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    b.subscribe(GOAL, inbox, history=False)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    publisher.put(b"x", attachment)
    publisher.put(b"y")
    assert [sample.attachment for sample in inbox.wait_for(2)] == [attachment, None]


def test_attachments_go_with_question_and_answer(network):
    a, b = network.session(), network.session()
    seen = []

    def answer(query):
        seen.append(query.attachment)
        query.reply(b"yes", attachment=b"number 1, again")
        query.finish()

    b.queryable("add", answer)
    network.meet(a, b)
    _, replies, done = ask(network, a, attachment=b"number 1")
    done.wait_for(1)
    assert [reply.attachment for reply in replies.items] == [b"number 1, again"]
    assert seen == [b"number 1"]
    ask(network, a)[2].wait_for(1)
    assert seen == [b"number 1", None]


# -- queries ---------------------------------------------------------------------------------------


def ask(network, session, key="add", payload=b"?", timeout=60.0, **how):
    replies, done = network.inbox(), network.inbox()
    handle = session.query(
        key,
        payload,
        encoding="q",
        timeout=timeout,
        on_reply=replies,
        on_done=lambda: done("done"),
        **how,
    )
    return handle, replies, done


def test_query_gets_the_answer_and_one_done(network):
    a, b = network.session(), network.session()
    seen = []

    def answer(query):
        seen.append((query.key, query.payload, query.encoding))
        query.reply(b"yes", "r")
        query.finish()
        query.finish()
        query.reply(b"too late")

    b.queryable("add", answer)
    network.meet(a, b)
    _, replies, done = ask(network, a)
    done.wait_for(1)
    assert replies.items == [Reply("add", b"yes", "r", error=False, source=b.session_id)]
    assert seen == [("add", b"?", "q")]
    ask(network, a)[2].wait_for(1)
    assert done.items == ["done"]


def test_query_may_be_answered_later_from_another_thread(network):
    a, b = network.session(), network.session()

    def answer(query):
        def later():
            query.reply(b"later")
            query.finish()

        network.clock.spawn(later, name="later")

    b.queryable("add", answer)
    network.meet(a, b)
    _, replies, done = ask(network, a)
    done.wait_for(1)
    assert payloads(replies.items) == [b"later"]


def test_query_to_the_own_session_runs_off_the_callers_stack(network):
    a = network.session()
    held = threading.Lock()

    def answer(query):
        with held:
            query.reply(b"self")
            query.finish()

    a.queryable("add", answer)
    with held:
        _, replies, done = ask(network, a)
    done.wait_for(1)
    assert payloads(replies.items) == [b"self"]


def test_every_queryable_is_asked(network):
    a, b, c = (network.session() for _ in range(3))
    for session, payload in ((a, b"a"), (b, b"b"), (c, b"c")):

        def answer(query, payload=payload):
            query.reply(payload)
            query.finish()

        session.queryable("add", answer)
    network.meet(a, b, c)
    _, replies, done = ask(network, a)
    done.wait_for(1)
    assert sorted(payloads(replies.items)) == [b"a", b"b", b"c"]


@pytest.mark.parametrize("complete", [0, 1, 2, 3])
def test_query_for_the_best_reaches_one_complete_queryable(network, complete):
    a, *others = (network.session() for _ in range(4))
    for number, session in enumerate(others):

        def answer(query, number=number):
            query.reply(b"%d" % number)
            query.finish()

        session.queryable("add", answer, complete=number < complete)
    network.meet(a, *others)
    for _ in range(3):
        _, replies, done = ask(network, a, best=True)
        done.wait_for(1)
        answers = {int(payload) for payload in payloads(replies.items)}
        assert len(replies.items) == (1 if complete else 3)
        assert answers <= set(range(complete or 3))


def test_query_that_nobody_answers_is_done_at_once(network):
    a = network.session()
    _, replies, done = ask(network, a, timeout=HOUR_S)
    done.wait_for(1)
    assert replies.items == []


def test_error_reply_is_marked(network):
    a, b = network.session(), network.session()

    def answer(query):
        query.reply_error("no: überlast")
        query.finish()

    b.queryable("add", answer)
    network.meet(a, b)
    _, replies, done = ask(network, a)
    done.wait_for(1)
    assert replies.items == [
        Reply("", "no: überlast".encode(), "", error=True, source=b.session_id)
    ]


def test_query_ends_at_its_timeout_without_a_reply(network):
    a, b = network.session(), network.session()
    kept = []
    b.queryable("add", kept.append)
    network.meet(a, b)
    start = network.clock.now()
    _, replies, done = ask(network, a, timeout=0.2)
    done.wait_for(1)
    assert network.clock.now() - start >= 0.15
    assert replies.items == []
    kept[0].reply(b"late")
    kept[0].finish()
    ask(network, a, key="nobody")[2].wait_for(1)
    assert replies.items == []
    assert done.items == ["done"]


def test_raising_queryable_answers_with_its_error(network, monkeypatch):
    reported = []
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.append(args.exc_value))
    a, b = network.session(), network.session()

    def answer(query):
        raise ValueError("cannot add")

    b.queryable("add", answer)
    network.meet(a, b)
    _, replies, done = ask(network, a)
    done.wait_for(1)
    assert [(r.payload, r.error) for r in replies.items] == [(b"ValueError: cannot add", True)]
    assert [str(error) for error in reported] == ["cannot add"]


def test_query_ends_when_the_answering_session_closes(network):
    a, b = network.session(), network.session()
    asked = network.inbox()
    b.queryable("add", asked)
    network.meet(a, b)
    _, replies, done = ask(network, a, timeout=HOUR_S)
    asked.wait_for(1)
    b.close()
    done.wait_for(1)
    assert replies.items == []


def test_closed_query_calls_nothing(network):
    a, b = network.session(), network.session()
    asked = network.inbox()
    b.queryable("add", asked)
    network.meet(a, b)
    handle, replies, done = ask(network, a)
    asked.wait_for(1)
    handle.close()
    handle.close()
    asked.items[0].reply(b"x")
    asked.items[0].finish()
    ask(network, a, key="nobody")[2].wait_for(1)
    assert (replies.items, done.items) == ([], [])


def test_query_may_be_closed_by_its_own_answer(network):
    a, b = network.session(), network.session()

    def answer(query):
        query.reply(b"1")
        query.reply(b"2")
        query.finish()

    b.queryable("add", answer)
    network.meet(a, b)
    replies, done, handles = network.inbox(), network.inbox(), []
    handed_over = network.clock.event()

    def on_reply(reply):
        handed_over.wait(60.0)
        handles[0].close()
        replies(reply)

    on_done = lambda: done("done")  # noqa: E731
    handles.append(a.query("add", b"", timeout=60.0, on_reply=on_reply, on_done=on_done))
    handed_over.set()
    assert payloads(replies.wait_for(1)) == [b"1"]
    ask(network, a)[2].wait_for(1)
    assert (payloads(replies.items), done.items) == ([b"1"], [])


def test_closed_queryable_is_not_asked(network):
    a, b = network.session(), network.session()
    asked = network.inbox()
    b.queryable("add", asked).close()
    network.meet(a, b)
    ask(network, a)[2].wait_for(1)
    assert asked.items == []


# -- presence --------------------------------------------------------------------------------------


def test_watch_hears_existing_tokens_first_then_changes(network):
    a, b = network.session(), network.session()
    first = b.declare_alive("@x/server/one")
    network.meet(a, b)
    inbox = network.inbox()
    a.watch_alive("@x/*/**", inbox)
    inbox.wait_for(1)
    second = b.declare_alive("@x/server/two")
    inbox.wait_for(2)
    first.close()
    inbox.wait_for(3)
    second.close()
    assert inbox.wait_for(4) == [
        Presence("@x/server/one", alive=True),
        Presence("@x/server/two", alive=True),
        Presence("@x/server/one", alive=False),
        Presence("@x/server/two", alive=False),
    ]


def test_watch_hears_the_own_sessions_tokens_too(network):
    a = network.session()
    before = a.declare_alive("@x/one")
    inbox = network.inbox()
    a.watch_alive("@x/*", inbox)
    inbox.wait_for(1)
    after = a.declare_alive("@x/two")
    inbox.wait_for(2)
    after.close()
    before.close()
    assert [(p.key[-3:], p.alive) for p in inbox.wait_for(4)] == [
        ("one", True), ("two", True), ("two", False), ("one", False),
    ]  # fmt: skip


def test_token_declared_twice_vanishes_with_the_last(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    a.watch_alive("@x/*", inbox)
    first, second = b.declare_alive("@x/one"), b.declare_alive("@x/one")
    network.meet(a, b)
    first.close()
    network.meet(a, b)
    assert inbox.items == [Presence("@x/one", alive=True)]
    second.close()
    assert inbox.wait_for(2)[1] == Presence("@x/one", alive=False)


def test_tokens_vanish_with_their_session(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()
    a.watch_alive("@x/**", inbox)
    b.declare_alive("@x/one")
    b.declare_alive("@x/two/three")
    inbox.wait_for(2)
    b.close()
    gone = {p.key for p in inbox.wait_for(4) if not p.alive}
    assert gone == {"@x/one", "@x/two/three"}


def test_closed_watch_hears_nothing(network):
    a, b = network.session(), network.session()
    closed, open_ = network.inbox(), network.inbox()
    a.watch_alive("@x/*", closed).close()
    a.watch_alive("@x/*", open_)
    b.declare_alive("@x/one")
    open_.wait_for(1)
    assert closed.items == []


def test_list_returns_what_matches_now(network):
    a, b = network.session(), network.session()
    a.declare_alive("@x/action/0/robot_0/move_base")
    b.declare_alive("@x/action/1/robot_1/move_base")
    gone = b.declare_alive("@x/action/2/robot_1/dock")
    network.meet(a, b)
    gone.close()
    network.meet(a, b)
    assert a.list_alive("@x/action/*/**", 5.0) == [
        "@x/action/0/robot_0/move_base",
        "@x/action/1/robot_1/move_base",
    ]
    assert a.list_alive("@x/*/*/robot_1/**", 5.0) == ["@x/action/1/robot_1/move_base"]
    assert a.list_alive("@x/service/**", 5.0) == []
    assert a.list_alive("*/**", 5.0) == []  # no wildcard stands for a word with '@'


MANY = 30  # watches and lists of single names, which a session may serve together
NAME = "@x/*/name/{}"


def test_many_watches_of_single_names_hear_theirs_only(network):
    a, b = network.session(), network.session()
    before = b.declare_alive("@x/a/name/7")
    network.meet(a, b)
    inboxes = [network.inbox() for _ in range(MANY)]
    watches = [a.watch_alive(NAME.format(n), inbox) for n, inbox in enumerate(inboxes)]
    inboxes[7].wait_for(1)
    late = network.inbox()
    a.watch_alive(NAME.format(7), late)
    assert late.wait_for(1) == [Presence("@x/a/name/7", alive=True)]
    tokens = [(a if n % 2 else b).declare_alive(f"@x/b/name/{n}") for n in range(MANY)]
    for n, inbox in enumerate(inboxes):
        inbox.wait_for(2 if n == 7 else 1)
    before.close()
    inboxes[7].wait_for(3)
    for token in tokens:
        token.close()
    assert [(p.key, p.alive) for p in inboxes[7].wait_for(4)] == [
        ("@x/a/name/7", True), ("@x/b/name/7", True),
        ("@x/a/name/7", False), ("@x/b/name/7", False),
    ]  # fmt: skip
    for n in (0, 20, MANY - 1):
        heard = [Presence(f"@x/b/name/{n}", alive) for alive in (True, False)]
        assert inboxes[n].wait_for(2) == heard
    watches[20].close()
    late.wait_for(4)
    again = [a.declare_alive(f"@x/b/name/{n}") for n in (20, 7)]
    late.wait_for(5)
    assert len(inboxes[20].items) == 2
    again[1].close()


def test_lists_of_single_names_are_right_beside_many_watches(network):
    a, b = network.session(), network.session()
    for n in range(MANY):
        a.watch_alive(NAME.format(n), network.inbox())
    theirs = b.declare_alive("@x/a/name/3")
    network.meet(a, b)
    for who in "bcd":  # the first answer may come from the network, later ones not
        assert a.list_alive(NAME.format(3), 5.0) == ["@x/a/name/3"]
        assert a.list_alive(NAME.format(4), 5.0) == []
        own = a.declare_alive(f"@x/{who}/name/3")
        assert a.list_alive(NAME.format(3), 5.0) == ["@x/a/name/3", f"@x/{who}/name/3"]
        own.close()
        assert a.list_alive(NAME.format(3), 5.0) == ["@x/a/name/3"]
    inbox = network.inbox()
    a.watch_alive(NAME.format(3), inbox)
    inbox.wait_for(1)
    theirs.close()
    assert inbox.wait_for(2) == [Presence("@x/a/name/3", alive) for alive in (True, False)]
    assert a.list_alive(NAME.format(3), 5.0) == []
    assert a.list_alive("@x/e/name/3", 5.0) == []


# -- closing ---------------------------------------------------------------------------------------


def test_closed_subscriber_gets_nothing_more(network):
    a, b = network.session(), network.session()
    closed, open_ = network.inbox(), network.inbox()
    subscriber = b.subscribe(GOAL, closed)
    b.subscribe(GOAL, open_)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    publisher.put(b"1")
    open_.wait_for(1)
    closed.wait_for(1)
    subscriber.close()
    subscriber.close()
    publisher.put(b"2")
    open_.wait_for(2)
    assert payloads(closed.items) == [b"1"]


def test_closed_publisher_raises(network):
    a = network.session()
    publisher = a.publisher(GOAL)
    publisher.close()
    publisher.close()
    with pytest.raises(TransportError, match="publisher is closed"):
        publisher.put(b"x")


def test_closed_session_raises_on_everything_but_close(network):
    a = network.session()
    publisher = a.publisher(GOAL)
    handles = [
        a.subscribe(GOAL, print),
        a.queryable("q", print),
        a.declare_alive("@x/a"),
        a.watch_alive("@x/*", print),
    ]
    a.close()
    a.close()
    for handle in handles:
        handle.close()
    calls = [
        lambda: publisher.put(b""),
        lambda: a.publisher(GOAL),
        lambda: a.subscribe(GOAL, print),
        lambda: a.queryable("q", print),
        lambda: a.query("q", b"", timeout=1.0, on_reply=print, on_done=print),
        lambda: a.declare_alive("@x/a"),
        lambda: a.watch_alive("@x/*", print),
        lambda: a.list_alive("@x/*", 1.0),
    ]
    for call in calls:
        with pytest.raises(TransportError, match="closed"):
            call()


def test_session_may_be_closed_from_its_own_callback(network):
    a, b = network.session(), network.session()
    inbox = network.inbox()

    def callback(sample):
        b.close()
        inbox(sample)

    b.subscribe(GOAL, callback)
    publisher = a.publisher(GOAL)
    network.meet(a, b)
    publisher.put(b"1")
    publisher.put(b"2")
    alive = network.inbox()
    inbox.wait_for(1)
    a.watch_alive("@x/*", alive)
    a.declare_alive("@x/end")
    alive.wait_for(1)
    assert payloads(inbox.items) == [b"1"]


def test_close_does_not_wait_for_queries_that_are_open(network):
    a, b = network.session(), network.session()
    asked = network.inbox()
    b.queryable("add", asked)
    network.meet(a, b)
    _, replies, done = ask(network, a, timeout=HOUR_S)
    asked.wait_for(1)
    a.close()
    assert (replies.items, done.items) == ([], [])


@pytest.mark.parametrize("key", ["", "/goal", "goal/", "a//b", "a/*", "a/**", "a$b", "a?b", "a#b"])
def test_malformed_key_is_refused_with_the_key(network, key):
    a = network.session()
    for call in (
        lambda: a.publisher(key),
        lambda: a.subscribe(key, print),
        lambda: a.queryable(key, print),
        lambda: a.declare_alive(key),
        lambda: a.query(key, b"", timeout=1.0, on_reply=print, on_done=print),
    ):
        with pytest.raises(TransportError, match="key: not usable"):
            call()


def test_session_ids_are_lower_case_hexadecimal_and_unique(network):
    ids = {network.session().session_id for _ in range(5)}
    assert len(ids) == 5
    for session_id in ids:
        assert session_id == f"{int(session_id, 16):x}".rjust(len(session_id), "0")
