"""Scripted action servers, services and topics, with their faults."""

from __future__ import annotations

import itertools
import re

import pytest

from actionlib_core import Duration
from actionlib_core.interfaces.move_base_msgs.msg import (
    MoveBaseAction,
    MoveBaseFeedback,
    MoveBaseGoal,
)
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger, TriggerResponse
from smachpy import (
    CBState,
    InvalidStateError,
    InvalidUserCodeError,
    MonitorState,
    ServiceState,
    SimpleActionState,
    StateMachine,
)
from smachpy.events import GoalDone, GoalFeedback
from smachpy.testing import TimeLimitError, mission_kit


def drive(**options):
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    with sm:
        sm.add("DRIVE", SimpleActionState("move_base", MoveBaseAction, **options))
    return sm


async def waits(_):
    return False


def yields(_):
    yield


SCRIPTS = [
    (lambda server: server.custom_reply(waits), "not an async one"),
    (lambda server: server.custom_reply(yields), "without `yield`"),
    (lambda server: server.custom_reply(None), "got None"),
    (lambda server: server.custom_reply(lambda: None), "call as function"),
    (lambda server: server.reply(duration=-5), "duration: got -5"),
    (lambda server: server.reply(duration=float("nan")), "duration: got nan"),
    (lambda server: server.reply(duration="5"), "Try 5"),
    (lambda server: server.die(after=-1), "die_after: got -1"),
]
OF_ACTIONS = [
    (
        lambda server: server.reply_conditionally(waits),
        r"predicate\(goal\), not an async",
    ),
    (lambda server: server.accept_late("5"), "accept_after: got '5'"),
]


@pytest.mark.parametrize(("script", "problem"), [*SCRIPTS, *OF_ACTIONS])
def test_a_script_that_could_not_work_is_refused(mission, script, problem):
    """A function whose body nothing would run was called, and the goal left without an answer."""
    server = mission.action_server("move_base", MoveBaseAction)
    with pytest.raises(InvalidStateError, match=problem):
        script(server)


@pytest.mark.parametrize(("script", "problem"), SCRIPTS)
def test_a_script_of_a_service_that_could_not_work_is_refused(mission, script, problem):
    service = mission.service_server("dock", Trigger)
    with pytest.raises(InvalidStateError, match=problem):
        script(service)


def test_durations_of_a_script_may_be_durations_of_ros(mission):
    """They were accepted and then ended the server with a TypeError."""
    server = mission.action_server("move_base", MoveBaseAction)
    server.accept_late(Duration(2), duration=Duration(1))
    server.reply(duration=Duration(1))
    run = mission(drive_twice())
    assert run.outcome == "succeeded"
    assert mission.clock.now() == pytest.approx(4.0, abs=0.5)  # and the way of the messages


def drive_twice():
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    with sm:
        sm.add("A", SimpleActionState("move_base", MoveBaseAction), {"succeeded": "B"})
        sm.add("B", SimpleActionState("move_base", MoveBaseAction))
    return sm


def status(run):
    return [event.status for event in run.events if isinstance(event, GoalDone)]


@pytest.fixture
def server(action_server):
    return action_server("move_base", MoveBaseAction)


def test_without_a_script_every_goal_succeeds(mission, server):
    run = mission(drive_twice())
    assert run.outcome == "succeeded"
    assert server.goals == [MoveBaseGoal(), MoveBaseGoal()]


def test_replies_in_order_then_the_default(mission, server):
    server.reply(duration=5)
    server.reply(status="aborted", text="blocked")
    server.default_result(duration=1)
    assert mission(drive_twice()).outcome == "aborted"
    run = mission(drive_twice())
    assert (run.outcome, run.duration) == ("succeeded", 2)


def drive_again_and_again():
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    with sm:
        sm.add("DRIVE", SimpleActionState("move_base", MoveBaseAction), {"aborted": "DRIVE"})
    return sm


def test_goals_without_end_at_one_moment_are_told_with_what_the_server_missed(mission, server):
    server.reply(status="aborted")
    with pytest.raises(
        TimeLimitError, match=r"its threads took 400 turns \(5 steps each\) at 0 s"
    ) as caught:
        mission(drive_again_and_again(), steps=2000)
    notes = caught.value.__notes__[1:]
    assert notes[0].startswith("move_base: goal number 2 came; expected 1")
    assert notes[5].startswith("move_base: and ")
    server.default_result(duration=1)
    assert mission(drive()).outcome == "succeeded"


def test_a_goal_that_comes_as_the_test_ends_is_nobody_s_error():
    sm = StateMachine(["aborted", "preempted"], name="M")
    with sm:
        sm.add("DRIVE", SimpleActionState("move_base", MoveBaseAction), {"succeeded": "DRIVE"})
    for steps in range(500, 525):  # the run breaks off anywhere; a thread that raises is a warning
        with mission_kit() as mission:
            mission.action_server("move_base", MoveBaseAction)
            with pytest.raises(TimeLimitError):
                mission(sm, steps=steps)


def test_the_errors_of_all_servers_are_told_and_of_their_own_run(mission, server, action_server):
    other = action_server("dock", MoveBaseAction)
    server.reply(status="aborted")
    other.reply(status="aborted")

    def twice(end):
        sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
        with sm:
            for label, action in (("A", "move_base"), ("B", "move_base"), ("C", "dock")):
                following = {"aborted": chr(ord(label) + 1)}
                sm.add(label, SimpleActionState(action, MoveBaseAction), following)
            sm.add("D", SimpleActionState("dock", MoveBaseAction), {"aborted": "END"})
            sm.add("END", CBState(end, outcomes=["aborted"]))
        return sm

    with pytest.raises(InvalidUserCodeError) as raised:
        mission(twice(lambda ud: 1 / 0))
    assert [note.partition(" came")[0] for note in raised.value.__notes__[1:3]] == [
        "move_base: goal number 2",
        "dock: goal number 2",
    ]
    with pytest.raises(AssertionError, match=r"goal number 3(.|\n)*dock: goal number 3"):
        mission(twice(lambda ud: "aborted"))


def test_what_the_functions_of_a_test_raise_fails_the_run(mission, server):
    def wrong(_):
        raise AssertionError("the goal is no good")

    server.custom_reply(wrong)
    begun = mission.clock.now()
    with pytest.raises(AssertionError, match=r"wrong of the test raised .*: the goal is no") as got:
        mission(drive())
    assert mission.clock.now() - begun < 1
    assert str(got.value.__cause__).startswith("the goal is no good")
    server.reply_conditionally(wrong)
    with pytest.raises(AssertionError, match="the goal is no good"):
        mission(drive())
    assert len(server.goals) == 2


def test_a_goal_that_its_function_has_ended_stays_so(mission, server):
    def late(handle):
        handle.set_accepted()
        handle.set_succeeded()
        raise ValueError("too late")

    server.custom_reply(late)
    with pytest.raises(AssertionError, match="ValueError: too late"):
        mission(drive())


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_what_runs_beside_the_mission_fails_it_too(mission, server):
    server.reply(duration=10)
    mission.clock.spawn(lambda: [server.await_goal(5) for _ in range(2)], name="beside")
    with pytest.raises(AssertionError, match="beside: AssertionError: move_base: no goal came wit"):
        mission(drive())


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_what_went_wrong_after_the_last_run_is_told_at_the_end():
    with pytest.raises(AssertionError, match="beside: ZeroDivisionError"), mission_kit() as mission:
        mission.clock.spawn(lambda: 1 / 0, name="beside").join()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_what_went_wrong_beside_a_failing_test_is_noted():
    def test():
        with mission_kit() as mission:
            mission.clock.spawn(lambda: 1 / 0, name="beside").join()
            raise KeyError

    with pytest.raises(KeyError) as caught:
        test()
    assert caught.value.__notes__ == ["beside: ZeroDivisionError: division by zero"]


def test_an_assertion_in_a_service_s_function_fails_the_run(mission, service_server):
    service = service_server("ask", Trigger)

    def wrong(_):
        raise AssertionError("what a request")

    service.custom_reply(wrong)
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    with sm:
        sm.add("ASK", ServiceState("ask", Trigger))
    with pytest.raises(AssertionError, match="wrong of the test raised AssertionError: what a req"):
        mission(sm)


def test_feedback_is_spread_over_the_duration(mission, server):
    server.reply(duration=10, feedback=[MoveBaseFeedback(), {}])
    run = mission(drive())
    times = [event.t for event in run.events if isinstance(event, GoalFeedback)]
    assert times == [5, 10]


def test_a_reply_for_some_goals(mission, server):
    server.reply_conditionally(
        lambda goal: goal.target_pose.header.frame_id == "map", status="aborted"
    )
    goal = MoveBaseGoal()
    assert mission(drive(goal=goal)).outcome == "succeeded"
    goal.target_pose.header.frame_id = "map"
    assert mission(drive(goal=goal)).outcome == "aborted"


def test_a_reply_of_one_s_own(mission, server):
    def reply(handle):
        handle.set_accepted()
        mission.clock.sleep(7)
        handle.set_succeeded()

    server.custom_reply(reply)
    assert mission(drive()).duration == 7


def test_a_goal_too_many_fails_the_run(mission, server):
    server.reply()
    with pytest.raises(AssertionError, match="goal number 2 came; expected 1"):
        mission(drive_twice())


def test_a_goal_can_be_awaited_beside_the_mission(mission, server):
    server.default_result(duration=5)
    seen = []

    def watch():
        server.await_goal(timeout=10)
        seen.append(mission.clock.now())
        with pytest.raises(AssertionError, match="no goal came within 10 s"):
            server.await_goal(timeout=10)
        seen.append(mission.clock.now())

    task = mission.clock.spawn(watch, name="watch")
    mission(drive())
    task.join()
    assert seen == [0, 10]


def test_a_cancelled_goal_ends_early(mission, server):
    server.reply(duration=100)
    mission.preempt(at=30)
    run = mission(drive())
    assert (run.outcome, run.duration, status(run)) == ("preempted", 30, ["PREEMPTED"])
    assert len(server.cancelled) == 1


@pytest.mark.parametrize("word", ["statos", ""])
def test_an_unknown_status(server, word):
    with pytest.raises(ValueError, match="succeeded"):
        server.reply(status=word)


def test_a_result_of_another_type(server):
    with pytest.raises(TypeError, match="MoveBaseResult"):
        server.reply(result=3)


# -- faults of action servers ----------------------------------------------------------------------


def test_never_answers(mission, server):
    server.never_answer()
    limits = {"server_wait_timeout": 20.0, "exec_timeout": 30.0, "preempt_timeout": 5.0}
    run = mission(drive(**limits))
    assert run.outcome == "aborted"
    assert run.duration <= 30


def test_never_finishes(mission, server):
    server.never_finish()
    assert mission(drive(exec_timeout=30.0)).duration == 30
    server.never_finish(ignore_cancel=True)
    run = mission(drive(exec_timeout=30.0, preempt_timeout=5.0))
    assert run.outcome == "aborted"
    assert run.duration == pytest.approx(35, abs=0.1)


@pytest.mark.parametrize("obeys", [False, True])
def test_a_goal_that_is_cancelled_in_vain_is_left(mission, server, obeys):
    if obeys:
        server.never_finish()
    else:
        server.ignore_cancel(600)

    run = mission(drive(exec_timeout=30.0, preempt_timeout=5.0))

    assert run.outcome == "aborted"
    assert len(run.goals_left) == (not obeys)
    assert run.ignored == run.goals_left == server.ignored
    assert server.left == ()


def test_a_goal_that_has_ended_in_spite_of_a_cancel_is_not_left(mission, server):
    server.ignore_cancel(40)

    run = mission(drive(exec_timeout=30.0, preempt_timeout=20.0))

    assert run.duration == pytest.approx(40, abs=0.1)
    assert run.goals_left == run.ignored == ()


def test_accepts_late(mission, server):
    server.accept_late(20, duration=5)
    assert mission(drive()).duration == 25


def test_rejects(mission, server):
    server.reject("no map")
    run = mission(drive())
    assert (run.outcome, status(run)) == ("aborted", ["REJECTED"])


def test_dies_while_active(mission, server):
    server.die(after=3)
    run = mission(drive())
    assert (run.outcome, status(run), run.duration) == ("aborted", ["LOST"], 3)


def test_dies_and_comes_back(mission, server):
    server.die(after=3, back_after=10)
    server.default_result()
    sm = StateMachine(["succeeded", "preempted"], name="M")
    with sm:
        sm.add("DRIVE", SimpleActionState("move_base", MoveBaseAction), {"aborted": "DRIVE"})
    run = mission(sm)
    assert run.outcome == "succeeded"
    assert run.visits("DRIVE") == 2
    assert run.duration >= 13


def test_loses_the_result(mission, server):
    server.lose_result(duration=4)
    run = mission(drive())
    assert (run.outcome, status(run)) == ("succeeded", ["SUCCEEDED"])


def test_delivers_twice(mission, server):
    server.deliver_twice(duration=4, feedback=[{}])
    run = mission(drive_twice_after(server))
    assert run.outcome == "succeeded"
    assert status(run) == ["SUCCEEDED", "SUCCEEDED"]


def drive_twice_after(server):
    server.default_result()
    return drive_twice()


def test_ignores_a_cancel(mission, server):
    server.ignore_cancel(duration=50)
    mission.preempt(at=10)
    run = mission(drive())
    assert run.duration == 50
    assert status(run) == ["SUCCEEDED"]


def test_a_server_preempts_by_itself(mission, server):
    server.reply(status="preempted")
    run = mission(drive())
    assert (run.outcome, status(run)) == ("aborted", ["PREEMPTED"])


# -- services --------------------------------------------------------------------------------------


def call(**options):
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    with sm:
        sm.add("CALL", ServiceState("dock", Trigger, **options))
    return sm


def test_a_service_answers_in_order(mission, service_server):
    server = service_server("dock", Trigger)
    server.reply(TriggerResponse(success=True), duration=3)
    server.reply({"message": "again"})
    run = mission(call(response_slots=["success"]))
    assert (run.outcome, run.duration, run.userdata["success"]) == ("succeeded", 3, True)
    assert mission(call(response_slots=["message"])).userdata["message"] == "again"
    with pytest.raises(AssertionError, match="request number 3 came"):
        mission(call())
    assert len(server.requests) == 3


def test_a_service_without_a_script(mission, service_server):
    service_server("dock", Trigger)
    assert mission(call()).outcome == "succeeded"


def test_a_service_made_by_hand(mission, service_server):
    service_server("dock", Trigger).custom_reply(lambda request: TriggerResponse(message="mine"))
    assert mission(call(response_slots=["message"])).userdata["message"] == "mine"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("fault", ["fail", "die"])
def test_a_service_that_fails(mission, service_server, fault):
    server = service_server("dock", Trigger)
    getattr(server, fault)()
    server.default_response()
    assert mission(call()).outcome == "aborted"
    if fault == "die":
        server.come_back()
    assert mission(call()).outcome == "succeeded"


def test_a_service_that_never_answers(mission, service_server):
    service_server("dock", Trigger).never_answer()
    run = mission(call(timeout=12.0))
    assert (run.outcome, run.duration) == ("aborted", 12)


def test_a_service_that_never_answers_ends_with_the_test_in_silence(caplog):
    with mission_kit() as mission:
        mission.service_server("dock", Trigger).never_answer()
        mission(call(timeout=12.0)).assert_outcome("aborted")
        caplog.clear()
    assert caplog.records == []


# -- topics ----------------------------------------------------------------------------------------


def watch():
    sm = StateMachine(["heard", "valid", "invalid", "preempted"], name="M")
    state = MonitorState("chatter", String, lambda ud, msg: msg.data != "stop")
    with sm:
        sm.add("WATCH", state, {"invalid": "heard"})
    return sm


def test_a_topic_at_moments_that_the_test_says(mission, topic):
    chatter = topic("chatter", String)
    chatter.publish_every(2, [{"data": "go"}, {"data": "go"}, {"data": "stop"}], start=1)
    assert mission(watch()).duration == 5
    assert [message.data for message in chatter.received] == ["go", "go", "stop"]


@pytest.mark.parametrize("message", [String("go"), {"data": "go"}], ids=["message", "fields"])
def test_one_message_is_published_again_and_again(mission, topic, message):
    chatter = topic("chatter", String)
    chatter.publish_every(5.0, message, start=2.0)
    chatter.publish_at(1000.0, data="stop")
    assert mission(watch()).duration == 1000
    assert [each.data for each in chatter.received] == ["go"] * 200 + ["stop"]


def test_messages_without_an_end_are_taken_when_their_time_has_come(mission, topic):
    """All were taken at once: the call never returned."""
    taken = []

    def messages():
        for number in itertools.count():
            taken.append(mission.clock.now())
            yield String("go" if number < 9 else "stop")

    begun = mission.clock.now()
    topic("chatter", String).publish_every(3.0, messages())
    assert mission(watch()).duration == 27
    assert len(taken) <= 11
    assert taken[0] == begun


@pytest.mark.parametrize(
    ("last", "text"),
    [(lambda: 1 / 0, "ZeroDivisionError: division by zero"), (lambda: 7, "got 7; expected std_")],
    ids=["raises", "wrong message"],
)
def test_messages_that_cannot_be_made_fail_the_run(mission, topic, last, text):
    """The topic fell silent, and the test passed."""

    def words():
        yield String("go")
        yield last()

    chatter = topic("chatter", String)
    chatter.publish_every(3.0, words())
    chatter.publish_at(10.0, data="stop")
    with pytest.raises(AssertionError, match=f"chatter: .*words.* of the test raised .*{text}"):
        mission(watch())


def test_copies_of_a_topic_take_the_same_messages(topic):
    """An iterator was used up by the first of the runs."""
    chatter = topic("chatter", String)
    chatter.publish_every(1.0, (String(word) for word in ("go", "go", "stop")))
    machine = watch()
    for _ in range(2):
        with mission_kit() as other:
            chatter.copy_to(other)
            assert other(machine).duration == 2


@pytest.mark.parametrize(
    ("period", "messages", "error", "text"),
    [
        (0.0, String("go"), InvalidStateError, "period: got 0.0; expected more than 0 s."),
        (-1.0, [], InvalidStateError, "period: got -1.0"),
        (float("nan"), [], InvalidStateError, "period: got nan"),
        (None, [], InvalidStateError, "period: got None"),
        (1.0, 7, TypeError, "message: got 7; expected std_msgs/String"),
        (1.0, "go", TypeError, "message: got 'go'"),
        (1.0, [String("go"), 7], TypeError, "message: got 7"),
    ],
)
def test_wrong_arguments_of_publish_every(topic, period, messages, error, text):
    """A message alone ended with "'String' object is not iterable", from inside of the library."""
    with pytest.raises(error, match=re.escape(text)):
        topic("chatter", String).publish_every(period, messages)


def test_a_latched_topic(mission, topic):
    topic("chatter", String).publish(data="stop", latch=True)
    assert mission(watch()).duration == 0


def test_faults_of_a_topic(mission, topic):
    chatter = topic("chatter", String)
    chatter.lose()
    chatter.delay(4)
    chatter.publish_at(1, data="stop")
    chatter.publish_at(2, data="stop")
    assert mission(watch()).duration == 6
    chatter.deliver_twice()
    chatter.publish_at(1, data="stop")
    mission(watch())
    mission.clock.sleep(10)
    assert len(chatter.received) == 3


def test_a_cut_link(mission, server):
    server.default_result(duration=60)
    server.cut()
    mission.clock.call_later(5, server.restore)
    run = mission(drive())
    assert run.outcome == "succeeded"
    assert run.duration >= 65
