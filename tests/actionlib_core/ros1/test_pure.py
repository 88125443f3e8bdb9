"""The bridge's decisions: bytes, answers, publishers, goals, which names."""

from __future__ import annotations

import contextlib
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core import SimpleActionClient
from actionlib_core.exceptions import Ros1Error
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.states import Status
from actionlib_core.interfaces import get_action, get_message
from actionlib_core.interfaces.actionlib.msg import (
    TestAction,
    TestActionFeedback,
    TestActionGoal,
    TestActionResult,
    TestGoal,
    TestResult,
)
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.ros1 import answers, frames
from actionlib_core.ros1.actions import GOAL_ID, ServerHere, ServerInRos, _ShownServer, action_type
from actionlib_core.ros1.answers import Names, SystemState
from actionlib_core.ros1.goals import Admission, GoalsOfClients, GoalsOfServer
from actionlib_core.ros1.node import check_master
from actionlib_core.ros1.plan import BridgePlan, Wanted, make_plan, without
from actionlib_core.ros1.publishers import Publishers
from actionlib_core.ros1.sides import Sides, Typed, type_of
from actionlib_core.time import Duration
from actionlib_core.transport.tokens import Endpoint, Kind
from tests.two_nodes import TwoNodes

TEXT = st.text(st.characters(codec="utf-8"), min_size=1).filter(lambda text: "=" not in text)


# -- bytes ---------------------------------------------------------------------------------------


@given(st.dictionaries(TEXT, st.text(st.characters(codec="utf-8"))))
def test_a_header_reads_as_it_was_written(fields):
    raw = frames.pack_header(fields)
    assert frames.read_length(raw[:4], frames.LARGEST_HEADER) == len(raw) - 4
    assert frames.unpack_header(raw[4:]) == fields


def test_a_header_with_a_comment_in_latin_1_is_read():
    raw = frames.pack_frame("message_definition=float64 t  # °C".encode("latin-1"))
    raw += frames.pack_frame(b"type=pkg/T")
    definition = "float64 t  # \ufffdC"
    assert frames.unpack_header(raw) == {"message_definition": definition, "type": "pkg/T"}


@given(st.binary(max_size=200))
def test_any_bytes_are_a_header_or_an_error(raw):
    with contextlib.suppress(ValueError):
        frames.unpack_header(raw)


@pytest.mark.parametrize("raw", [b"", b"\1\0\0", b"\xff\xff\xff\xff"])
def test_a_length_that_is_cut_or_too_great_is_refused(raw):
    with pytest.raises(ValueError, match="length"):
        frames.read_length(raw, 1000)


# -- answers -------------------------------------------------------------------------------------

HOSTILE = [None, 0, "x", [], [1], [1, "", [], 4], {}, ["a", "b", "c"], [[1, 2]], [["a", "b"]] * 3]


@pytest.mark.parametrize("value", HOSTILE)
def test_answers_that_are_none_are_errors(value):
    for read in (answers.read_types, SystemState.read, answers.read_tcpros):
        with contextlib.suppress(Ros1Error):
            read("http://robot:1", value)
    with pytest.raises(Ros1Error):
        answers.read_answer("http://robot:1", "getPid", value)


def test_a_refusal_says_why():
    with pytest.raises(Ros1Error) as error:
        answers.read_answer("http://robot:1", "lookupNode", [-1, "unknown node", 0])
    assert error.value.peer == "http://robot:1"
    assert "unknown node" in error.value.reason
    assert answers.read_answer("http://robot:1", "getPid", [1, "", 7]) == 7


@pytest.mark.parametrize(
    "uri", ["", "robot", "http://robot", "http://:1", "http://robot:x", 4, None]
)
def test_addresses_that_are_none_are_errors(uri):
    with pytest.raises(Ros1Error):
        answers.split_address("/node", uri, "http")


def test_a_master_is_named_briefly_or_in_full():
    assert check_master("robot") == "http://robot:11311"
    assert check_master("robot:4") == "http://robot:4"
    assert check_master("http://robot:11311/") == "http://robot:11311"
    for wrong in ("https://robot:1", "robot:port", "http://"):
        with pytest.raises(Ros1Error):
            check_master(wrong)


def test_what_is_registered_is_compared_with_what_is_wanted():
    state = SystemState.read("m", [[["/a", ["/me", "/x"]]], [["/b", ["/x"]]], [["/c", ["/me"]]]])
    there = answers.registered(state, "/me")
    assert there == Names(frozenset({"/a"}), frozenset(), frozenset({"/c"}))
    wanted = Names(frozenset({"/a", "/d"}), frozenset({"/b"}), frozenset())
    assert wanted - there == Names(frozenset({"/d"}), frozenset({"/b"}), frozenset())
    assert there - wanted == Names(served=frozenset({"/c"}))


# -- publishers ----------------------------------------------------------------------------------


def test_an_answer_that_an_update_has_overtaken_is_dropped():
    publishers = Publishers("http://me/")
    asked = publishers.ask()
    assert publishers.update(["http://new/", "http://me/"]).connect == {"http://new/"}
    assert publishers.answer(asked, ["http://old/"]).connect == frozenset()
    assert publishers.there == {"http://new/"}
    change = publishers.answer(publishers.ask(), ["http://old/"])
    assert (change.connect, change.give_up) == ({"http://old/"}, {"http://new/"})


# -- goals ---------------------------------------------------------------------------------------


def entry(goal_id, status, text=""):
    return StatusEntry(goal_id, 0, status, text)


def test_a_goal_is_passed_until_the_server_speaks_of_it():
    goals = GoalsOfServer()
    assert goals.on_goal("g") is Admission.PASS
    goals.on_statuses([entry("g", Status.RECALLING)], now=0.0)
    assert goals.on_goal("g") is Admission.PASS
    goals.on_statuses([entry("g", Status.ACTIVE)], now=0.0)
    assert goals.on_goal("g") is Admission.DROP
    goals.on_statuses([], now=0.0)
    assert goals.on_goal("g") is Admission.DROP  # ended long ago: the server would run it again
    assert goals.on_goal("") is Admission.PASS


def test_of_a_goal_that_comes_both_ways_the_second_is_dropped():
    goals = GoalsOfServer()
    assert goals.on_direct_goal("g") is Admission.PASS
    goals.on_result(entry("g", Status.SUCCEEDED), b"result", now=0.0)
    assert goals.on_goal("g") is Admission.DROP
    assert goals.on_goal("g") is Admission.REPEAT_RESULT
    assert goals.on_goal("h") is Admission.PASS
    assert goals.on_direct_goal("h") is Admission.DROP
    assert goals.on_goal("h") is Admission.PASS  # sent again: the server has not spoken of it


def test_a_result_is_sent_again_until_it_is_acknowledged_or_old():
    goals = GoalsOfServer()
    goals.on_result(entry("g", Status.SUCCEEDED), b"result", now=0.0)
    assert goals.on_goal("g") is Admission.REPEAT_RESULT
    assert goals.result("g") == b"result"
    goals.on_acknowledged(["g", "unknown"])
    assert goals.result("g") is None
    assert goals.on_goal("g") is Admission.DROP
    goals.on_result(entry("h", Status.ABORTED), b"", now=0.0)
    goals.on_result(entry("i", Status.ABORTED), b"", now=61.0)
    assert goals.result("h") is None


def test_a_final_status_without_a_result_says_that_the_message_was_lost():
    goals = GoalsOfServer()
    assert goals.status("g", now=0.0).status == Status.LOST
    goals.on_statuses([entry("g", Status.ACTIVE, "on my way")], now=0.0)
    assert goals.status("g", now=0.0).text == "on my way"
    for now in (0.0, 4.0):
        goals.on_statuses([entry("g", Status.SUCCEEDED, "there")], now=now)
    assert goals.status("g", now=5.0).status == Status.SUCCEEDED
    assert "result message itself was lost" in goals.status("g", now=5.0).text
    goals.on_statuses([], now=5.1)  # no longer listed
    assert goals.status("g", now=6.0).status == Status.SUCCEEDED
    goals.on_statuses([entry("h", Status.ABORTED)], now=66.0)
    assert goals.status("g", now=66.0).status == Status.LOST


def test_a_result_that_comes_later_than_its_status_is_not_lost():
    """On a busy computer the client was told that it was lost, and ended without it."""
    goals = GoalsOfServer()
    goals.on_statuses([entry("g", Status.SUCCEEDED, "there")], now=0.0)
    assert goals.status("g", now=4.9).status == Status.PENDING
    goals.on_result(entry("g", Status.SUCCEEDED), b"result", now=4.9)
    assert goals.result("g") == b"result"
    goals.on_acknowledged(["g"])
    goals.on_statuses([entry("g", Status.SUCCEEDED, "there")], now=5.0)
    assert goals.status("g", now=5.0).status == Status.SUCCEEDED


def test_a_goal_on_its_way_to_the_server_is_not_lost():
    """A client that attached before the next status list was told LOST; the goal then ran."""
    goals = GoalsOfServer()
    assert goals.on_goal("g") is Admission.PASS
    goals.on_passed("g", now=0.0)
    goals.on_statuses([], now=0.0)  # made before the goal arrived
    assert goals.status("g", now=0.9).status == Status.PENDING
    assert goals.status("g", now=1.0).status == Status.LOST  # it has not arrived at all
    goals.on_passed("g", now=1.0)
    goals.on_statuses([entry("g", Status.ACTIVE)], now=0.0)
    assert goals.status("g", now=1.1).status == Status.ACTIVE
    goals.on_statuses([], now=0.0)  # ended, and no longer listed
    assert goals.status("g", now=1.2).status == Status.LOST


def test_an_idle_servers_status_is_news_once():
    goals = GoalsOfServer()
    assert not goals.on_statuses([], now=0.0)
    assert goals.on_statuses([entry("g", Status.ACTIVE)], now=0.0)
    assert goals.on_statuses([], now=0.0)
    assert not goals.on_statuses([], now=0.0)


def test_goals_of_clients_are_sent_again_until_the_server_speaks_of_them():
    goals = GoalsOfClients()
    goals.on_goal("g", b"goal", 0, now=0.0)
    goals.on_goal("", b"without id", 0, now=0.0)
    assert goals.take_due(0.4).again == []
    assert goals.take_due(0.5).again == [b"goal"]
    assert goals.take_due(1.4).again == []
    assert goals.take_due(1.5).again == [b"goal"]
    goals.on_status(entry("g", Status.ACTIVE), now=2.0)
    goals.on_status(entry("stranger", Status.SUCCEEDED), now=2.0)
    assert goals.next_due() is None
    goals.on_status(entry("g", Status.SUCCEEDED), now=3.0)
    assert goals.take_due(3.2) == ([], [], ["g"])
    assert goals.on_result("g")
    assert not goals.on_result("g")  # the answer came beside the message
    assert goals.next_due() is None
    assert goals.on_result("stranger")


@pytest.mark.parametrize(
    ("goal_id", "stamp_ns", "cancelled"),
    [
        ("b", 0, ["b"]),
        ("", 0, ["a", "b", "c"]),
        ("", 2, ["a", "b"]),
        ("c", 1, ["a", "c"]),
        ("stranger", 0, []),
    ],
)
def test_cancels_are_sent_again_with_the_goals_that_they_are_about(goal_id, stamp_ns, cancelled):
    goals = GoalsOfClients()
    for stamp, name in ((1, "a"), (2, "b"), (0, "c")):
        goals.on_goal(name, name.encode(), stamp, now=0.0)
    goals.on_cancel(goal_id, stamp_ns)
    assert goals.take_due(0.5) == (cancelled, [b"a", b"b", b"c"], [])
    goals.on_status(entry("b", Status.RECALLED), now=0.6)
    assert "b" not in goals.take_due(1.5).cancel


def test_a_cancelled_goal_that_no_server_has_is_sent_again_behind_its_cancel():
    ros = Mock()
    with TwoNodes() as world:
        sides, log = Sides(world.mission, ros, ""), []
        typed = TestAction._type, TestAction._md5sum
        server = world.robot.endpoint(Kind.ACTION_SERVER, "a", *typed)
        for word in ("goal", "cancel"):
            world.robot.transport.subscribe(f"a/{word}", lambda it: log.append(it.key))
        here = ServerHere(sides, "/a", server, Mock())
        goal = TestActionGoal(goal_id=GoalID(id="g"))
        here.on_goal(Typed(TestActionGoal._type, TestActionGoal._md5sum), goal.to_bytes())
        here.on_cancel(GOAL_ID, goal.goal_id.to_bytes())
        world.clock.sleep(0.6)
        here.close()
    assert log == ["a/goal", "a/cancel", "a/cancel", "a/goal"]


def test_goals_that_a_dead_server_may_have_taken_are_not_sent_to_the_next():
    goals = GoalsOfClients()
    goals.on_goal("g", b"goal", 0, now=0.0)
    goals.drop_unacknowledged()
    goals.on_goal("g", b"goal", 0, now=0.0)  # a repetition
    assert goals.next_due() is None


# -- types ---------------------------------------------------------------------------------------


def test_the_type_of_an_action_follows_from_those_of_its_topics():
    def typed(name):
        found = get_message(name)
        return Typed(found._type, found._md5sum)

    name = "move_base_msgs/MoveBaseAction"
    parts = {word: typed(f"{name}{word.title()}") for word in ("goal", "result", "feedback")}
    assert action_type(parts) == Typed(name, get_action(name)._md5sum)
    with pytest.raises(Ros1Error):
        action_type({**parts, "goal": Typed("std_msgs/String", "x")})


@pytest.mark.parametrize(
    "header",
    [
        {},
        {"type": "std_msgs/String"},
        {"type": "*", "md5sum": "*"},
        {"type": "a/B;md5=1", "md5sum": "2"},
        {"type": "a/B", "md5sum": "2", "callerid": "/smachpy_bridge_1_2"},
    ],
)
def test_headers_without_a_usable_type_are_refused(header):
    with pytest.raises(Ros1Error):
        type_of(header, "/topic")


@pytest.mark.parametrize(
    ("namespace", "key", "name"),
    [
        ("", "move_base", "/move_base"),
        ("robot_1", "robot_1/move_base", "/move_base"),
        ("robot_1", "robot_10/move_base", None),
        ("robot_1", "robot_1", None),
        ("fleet/robot_1", "fleet/robot_1/a/b", "/a/b"),
        ("robot_1", "move_base", None),
    ],
)
def test_names_correspond(namespace, key, name):
    sides = Sides(None, None, namespace)
    assert sides.ros_name(key) == name
    assert name is None or sides.key(name) == key


# -- which names ---------------------------------------------------------------------------------

ACTION_TOPICS = {
    "/nav/goal": "m/NavActionGoal",
    "/nav/cancel": "actionlib_msgs/GoalID",
    "/nav/status": "actionlib_msgs/GoalStatusArray",
    "/nav/feedback": "m/NavActionFeedback",
    "/nav/result": "m/NavActionResult",
}
STATE = SystemState(
    {"/scan": ["/lidar"], "/rosout": ["/lidar"], **{t: ["/nav"] for t in ACTION_TOPICS}},
    {"/cmd_vel": ["/base"]},
    {"/clear": ["/nav"], "/nav/get_loggers": ["/nav"]},
)


def end(kind, name):
    return Endpoint(kind, name.strip("/"), "a/B", "md5", "session", "node")


def plan(wanted, ends=(), state=STATE, looked_for=()):
    by_name = {}
    for each in ends:
        by_name.setdefault(f"/{each.name}", []).append(each)
    return make_plan(wanted, by_name, state, ACTION_TOPICS, looked_for)


def test_names_alone_are_bridged_when_they_are_given():
    made = plan(
        Wanted({"/nav": "", "/x": "a/XAction"}, frozenset({"/scan"}), frozenset({"/clear", "/y"})),
        [end(Kind.SUBSCRIBER, "/other"), end(Kind.ACTION_CLIENT, "/more")],
    )
    assert made.actions == {"/nav": "m/NavAction", "/x": "a/XAction"}
    assert made.topics == {"/scan": True}
    assert made.services == {"/clear": True, "/y": False}


def test_what_is_used_here_is_bridged():
    ends = [
        end(Kind.SUBSCRIBER, "/scan"),
        end(Kind.PUBLISHER, "/cmd_vel"),
        end(Kind.ACTION_CLIENT, "/nav"),
        end(Kind.SERVICE, "/ours"),
    ]
    made = plan(Wanted(used=True), ends)
    assert made.actions == {"/nav": "m/NavAction"}
    assert made.topics == {"/scan": True, "/cmd_vel": False}
    assert made.services == {"/clear": True, "/ours": False}
    assert plan(Wanted(used=True)).topics == {}
    assert plan(Wanted(used=True)).actions == {"/nav": "m/NavAction"}


def test_on_demand_nothing_is_bridged_that_nobody_uses():
    wanted = Wanted(on_demand=True)
    assert plan(wanted) == BridgePlan({}, {}, {})
    ends = [end(Kind.SUBSCRIBER, "/scan"), end(Kind.ACTION_CLIENT, "/nav")]
    made = plan(wanted, ends, looked_for=["/clear", "/nowhere"])
    assert made == BridgePlan({"/nav": "m/NavAction"}, {"/scan": True}, {"/clear": True})
    left = plan(Wanted(on_demand=True, leave_out=("/sc*", "*av")), ends, looked_for=["/clear"])
    assert left == BridgePlan({}, {}, {"/clear": True})


def test_all_is_all_but_the_log_and_the_topics_of_actions():
    made = plan(Wanted(all=True))
    assert made.actions == {"/nav": "m/NavAction"}
    assert made.topics == {"/scan": True}
    assert made.services == {"/clear": True}


def test_other_bridges_do_not_count():
    state = SystemState({"/scan": ["/smachpy_bridge_1_2"], "/odom": ["/base", "/smachpy_bridge_1"]})
    assert without(state, "/smachpy_bridge_") == SystemState({"/odom": ["/base"]})


def types_of_test():
    """The types of the five topics of actionlib/TestAction."""
    kinds = {"status": GoalStatusArray, "cancel": GoalID}
    for word in ("goal", "feedback", "result"):
        kinds[word] = get_message(f"actionlib/TestAction{word.title()}")
    return {word: Typed(kind._type, kind._md5sum) for word, kind in kinds.items()}


@pytest.mark.parametrize("text", ["Größe".encode("latin-1"), "Größe".encode()[:3]])
def test_a_goal_whose_texts_are_not_utf_8_is_taken_once_and_ends_as_its_server_says(text):
    def status(goal_id, number):
        goal = GoalID(id=goal_id)
        return GoalStatus(goal_id=goal, status=number, text=text.decode("utf-8", "surrogateescape"))

    typed = Typed(TestAction._type, TestAction._md5sum)
    sent = []
    with TwoNodes() as world:
        goals = Mock(put=lambda payload: sent.append(TestActionGoal.from_bytes(payload)))
        server = _ShownServer(
            Sides(world.robot, Mock(), ""),
            "/do",
            typed,
            types_of_test(),
            "/old",
            frozenset(),
            (goals, Mock()),
        )
        client = SimpleActionClient("do", TestAction, node=world.mission)
        assert client.wait_for_server()
        client.send_goal(TestGoal(1))
        world.clock.sleep(0.1)
        goal_id = sent[0].goal_id.id
        listed = GoalStatusArray(status_list=[status(goal_id, Status.ACTIVE), status("x", 1)])
        for _ in range(30):
            server.on_status(listed.to_bytes())
            world.clock.sleep(0.2)
        assert client.get_state() == Status.ACTIVE
        result = TestActionResult(status=status(goal_id, Status.SUCCEEDED), result=TestResult(7))
        server.on_result(result.to_bytes())
        assert client.wait_for_result()
        assert (client.get_state(), client.get_result()) == (Status.SUCCEEDED, TestResult(7))
        assert client.get_goal_status_text().encode("utf-8", "surrogateescape") == text
    assert len(sent) == 1


def shown_and_found(world):
    """Return a server of ROS 1 that the bridge shows, and a client that has found it."""
    shown = ServerInRos(Sides(world.robot, Mock(), ""), "/do", Mock(), 5.0, "actionlib/TestAction")
    for word, typed in types_of_test().items():
        shown.connect("/old", word, f"link for {word}", typed)
    client = SimpleActionClient("do", TestAction, node=world.mission)
    assert client.wait_for_server()
    return shown, client


@pytest.mark.parametrize("heard", [True, False])
def test_bridge_that_stood_still_hides_a_server_only_if_it_is_not_heard_afterwards(heard):
    with TwoNodes() as world:
        shown, client = shown_and_found(world)

        def run(seconds, *, status):
            for _ in range(seconds):
                world.clock.sleep(1.0)
                if status:
                    shown.take("/old", "status", "link for status", GoalStatusArray().to_bytes())
                shown.check_silence()

        run(10, status=True)
        assert client.wait_for_server(Duration(0.1))
        world.clock.sleep(60.0)  # SIGSTOP, a debugger
        shown.check_silence()
        run(10, status=heard)
        assert client.wait_for_server(Duration(0.1)) is heard
        run(10, status=False)
        assert not client.wait_for_server(Duration(0.1))


def test_server_is_hidden_though_each_look_is_late():
    with TwoNodes() as world:
        shown, client = shown_and_found(world)
        for _ in range(3):  # the master hangs
            world.clock.sleep(20.0)
            shown.check_silence()
        assert not client.wait_for_server(Duration(0.1))


@pytest.mark.parametrize("word", ["status", "feedback", "result"])
def test_message_that_comes_while_its_server_is_being_hidden_does_not_end_its_link(word):
    with TwoNodes() as world:
        bridged, _ = shown_and_found(world)
        bridged._shown.close()  # as another thread does
        listed = GoalStatus(goal_id=GoalID(id="g"), status=Status.ACTIVE)
        messages = {
            "status": GoalStatusArray(status_list=[listed]),
            "feedback": TestActionFeedback(status=listed),
            "result": TestActionResult(status=listed),
        }
        bridged.take("/old", word, f"link for {word}", messages[word].to_bytes())
