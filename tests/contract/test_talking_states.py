"""The states that talk, on every network: memory on virtual and on real time, and zenoh."""

from __future__ import annotations

from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import RealClock
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestFeedback as Feedback
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib.msg import TestResult as Result
from actionlib_core.interfaces.std_msgs.msg import Int32
from actionlib_core.interfaces.std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import Publisher
from smachpy import (
    ActionServerWrapper,
    CBState,
    ConditionState,
    IntrospectionClient,
    IntrospectionServer,
    MonitorState,
    ServiceState,
    SimpleActionState,
    StateMachine,
    UserData,
    describe,
    events,
)

OUTCOMES = ["succeeded", "aborted", "preempted"]
LONG_S = 60.0


def serve(world, run):
    server = SimpleActionServer(
        "do", Action, lambda goal: run(server, goal), False, node=world.node("robot")
    )
    server.start()
    return server


def machine_of(state, outcomes=OUTCOMES):
    machine = StateMachine(outcomes)
    with machine:
        machine.add("A", state)
    return machine


def test_an_action_state_succeeds_with_feedback_and_result(world):
    def run(server, goal):
        for number in range(goal.goal):
            server.publish_feedback(Feedback(number))
        server.set_succeeded(Result(goal.goal))

    serve(world, run)
    seen = []
    state = SimpleActionState(
        "do",
        Action,
        goal=Goal(20),
        result_key="result",
        feedback_cb=lambda ud, feedback: seen.append(feedback.feedback),
        node=world.node("mission"),
    )
    userdata = UserData()
    for _ in range(3):
        assert state.execute(userdata) == "succeeded"
        assert userdata.result == Result(20)
        assert seen == list(range(20))
        seen.clear()


def test_an_action_state_is_preempted_at_once(world):
    def run(server, goal):
        server.publish_feedback(Feedback(1))
        assert server.wait_preempt(LONG_S)
        server.set_preempted()

    serve(world, run)
    preempt = []
    machine = machine_of(
        SimpleActionState(
            "do",
            Action,
            goal=Goal(1),
            feedback_cb=lambda ud, f: preempt[0](),
            node=world.node("mission"),
        )
    )
    preempt.append(lambda: world.clock.spawn(machine.request_preempt, name="operator"))
    start = world.clock.now()
    assert machine.execute() == "preempted"
    assert isinstance(world.clock, RealClock) or world.clock.now() - start < 5.0


def test_a_server_that_leaves_ends_the_goal(world):
    robot = world.node("robot")

    def begin(handle):
        handle.set_accepted()
        handle.publish_feedback(Feedback(1))

    ActionServer("do", Action, begin, node=robot)
    left = []
    state = SimpleActionState("do", Action, goal=Goal(1), node=world.node("mission"))
    machine = machine_of(state)

    def leave(event):
        if isinstance(event, events.GoalFeedback):
            left.append(world.clock.spawn(robot.close, name="leaving"))

    machine.subscribe(leave)
    start = world.clock.now()
    assert machine.execute() == "aborted"
    assert isinstance(world.clock, RealClock) or world.clock.now() - start < 5.0
    assert left[0].join(LONG_S)


def test_a_service_state_calls(world):
    Service(
        "lamp",
        SetBool,
        lambda request: SetBoolResponse(request.data, "on"),
        node=world.node("robot"),
    )
    state = ServiceState(
        "lamp",
        SetBool,
        request=SetBoolRequest(True),
        response_slots=["message"],
        node=world.node("mission"),
    )
    userdata = UserData()
    for _ in range(2):
        assert state.execute(userdata) == "succeeded"
        assert userdata.message == "on"


def test_a_service_state_can_be_preempted(world):
    go = world.event()
    Service(
        "lamp", SetBool, lambda request: (go.wait(LONG_S), "x")[::2] or {}, node=world.node("robot")
    )
    state = ServiceState("lamp", SetBool, node=world.node("mission"))
    task = world.clock.spawn(
        lambda: (world.clock.sleep(0.3), state.request_preempt()), name="operator"
    )
    assert state.execute(UserData()) == "preempted"
    go.set()
    assert task.join(LONG_S)


def test_monitor_and_condition_hear_a_topic(world):
    with Publisher("level", Int32, latch=True, node=world.node("robot")) as levels:
        levels.publish(5)
        node = world.node("mission")
        monitor = MonitorState("level", Int32, lambda ud, message: message.data > 5, node=node)
        assert monitor.execute(UserData()) == "invalid"
        checks = []

        def second_time(userdata):
            checks.append(userdata)
            if len(checks) == 1:
                levels.publish(6)
            return len(checks) == 2

        condition = ConditionState(
            second_time,
            poll_rate=None,
            max_checks=-1,
            wake_on=[("level", Int32)],
            node=node,
        )
        assert condition.execute(UserData()) == "true"


def test_a_machine_is_an_action_of_another(world):
    inner = StateMachine(["done"], input_keys=["action_goal"], output_keys=["action_result"])

    def double(userdata):
        userdata.action_result = Result(2 * userdata.action_goal.goal)
        return "done"

    with inner:
        inner.add("DOUBLE", CBState(double, [], {}, ["done"], ["action_goal"], ["action_result"]))
    wrapper = ActionServerWrapper("do", Action, inner, ["done"], node=world.node("robot"))
    wrapper.run_server()
    state = SimpleActionState(
        "do", Action, goal=Goal(21), result_slots=["result"], node=world.node("mission")
    )
    userdata = UserData()
    assert state.execute(userdata) == "succeeded"
    assert userdata.result == 42
    wrapper.stop()


def test_a_machine_is_watched_and_prepared_from_elsewhere(world):
    machine = StateMachine(["done"])
    with machine:
        machine.add("A", CBState(lambda ud: "done", outcomes=["done"]), {"done": "B"})
        machine.add("B", CBState(lambda ud: "done", outcomes=["done"]))
    server = IntrospectionServer("patrol", machine, "/SM_ROOT", node=world.node("robot"))
    server.start()
    client = IntrospectionClient(node=world.node("desk"))
    assert client.get_description("patrol", timeout=LONG_S) == describe(machine)
    assert client.get_servers(timeout=LONG_S) == ["/patrol"]
    assert client.set_initial_state("patrol", "/SM_ROOT", ["B"], timeout=LONG_S) is True
    assert client.set_initial_state("patrol", "/SM_ROOT", ["C"], timeout=LONG_S) is False
    found = []
    over = world.event()

    def note(event, seq):
        found.append(event)
        if isinstance(event, events.Finished):
            over.set()

    client.subscribe("patrol", note)
    for _ in range(round(LONG_S / 0.1)):  # until the server knows of the follower
        if server._feed._events.get_num_connections():
            break
        world.clock.sleep(0.1)
    machine.execute()
    assert over.wait(LONG_S)
    assert [e.path for e in found if isinstance(e, events.Entered)] == ["/SM_ROOT/B"]
    server.stop()
