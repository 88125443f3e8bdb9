"""What rclpy does: a program for its own Python, which answers each line with a line (JSON).

It knows nothing of this project.
"""

from __future__ import annotations

import importlib
import json
import sys
import threading

import rclpy
from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from goal_conversations import CONVERSATIONS, NONE, A
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rosidl_parser.definition import AbstractNestedType, Array, BasicType, NamespacedType
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

LONG_S = 60.0


# -- messages --------------------------------------------------------------------------------------


def find(full):
    """Return the class of a type; also of those that have no name of their own in Python."""
    package, kind, name = full.split("/")
    importlib.import_module(f"{package}.{kind}")
    modules = [m for n, m in sys.modules.items() if n.startswith(f"{package}.{kind}._")]
    return next(found for m in modules if (found := getattr(m, name, None)) is not None)


def fields_of(message):
    """Name and type of each field; a message without any has one byte that no definition has."""
    names = [name.removeprefix("_") for name in message.__slots__ if name != "_check_fields"]
    fields = dict(zip(names, message.SLOT_TYPES, strict=True))
    fields.pop("structure_needs_at_least_one_member", None)
    return fields


def to_plain(value, kind):
    """Return a field's value as JSON has it."""
    if isinstance(kind, AbstractNestedType):
        return [to_plain(item, kind.value_type) for item in value]
    if isinstance(kind, NamespacedType):
        return {name: to_plain(getattr(value, name), k) for name, k in fields_of(value).items()}
    if isinstance(kind, BasicType) and kind.typename == "octet":
        return value[0]
    if isinstance(kind, BasicType):
        return value.item() if hasattr(value, "item") else value
    return value


def from_plain(value, kind):
    """Return what a field takes."""
    if isinstance(kind, AbstractNestedType):
        items = [from_plain(item, kind.value_type) for item in value]
        is_number = isinstance(kind.value_type, BasicType)
        if (
            isinstance(kind, Array)
            and is_number
            and kind.value_type.typename not in {"boolean", "octet"}
        ):
            import numpy as np

            names = {"float": "float32", "double": "float64"}
            return np.array(items, names.get(kind.value_type.typename, kind.value_type.typename))
        return items
    if isinstance(kind, NamespacedType):
        return make(find("/".join([*kind.namespaces, kind.name])), value)
    if isinstance(kind, BasicType) and kind.typename == "octet":
        return bytes([value])
    return value


def make(cls, values):
    message = cls()
    for name, kind in fields_of(message).items():
        setattr(message, name, from_plain(values[name], kind))
    return message


def read(message):
    return {name: to_plain(getattr(message, name), k) for name, k in fields_of(message).items()}


def exchange(full, values, payloads):
    """Write values and read bytes of a type."""
    cls = find(full)
    metaclass = type(cls)
    constants = getattr(metaclass, f"_{metaclass.__name__}__constants", {})
    return {
        "default": serialize_message(cls()).hex(),
        "constants": {
            name: value[0] if isinstance(value, bytes) else value
            for name, value in constants.items()
            if not name.endswith("__DEFAULT")
        },
        "written": [serialize_message(make(cls, each)).hex() for each in values],
        "read": [read(deserialize_message(bytes.fromhex(each), cls)) for each in payloads],
    }


# -- goals -----------------------------------------------------------------------------------------


class World:
    """A server of rclpy, and what a client on the wire hears from it; see `goal_conversations`."""

    def __init__(self, *, refuse_cancels=False):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("world", context=self.context)
        group = ReentrantCallbackGroup()
        self.goals, self.ends, self.codes, self.stamps, self.paths = {}, {}, {}, {}, {}
        self.news = threading.Condition()
        self.server = ActionServer(
            self.node,
            Fibonacci,
            "fib",
            self._run,
            goal_callback=lambda g: GoalResponse.REJECT if g.order < 0 else GoalResponse.ACCEPT,
            handle_accepted_callback=self._keep,
            cancel_callback=lambda _: (
                CancelResponse.REJECT if refuse_cancels else CancelResponse.ACCEPT
            ),
            callback_group=group,
        )
        name, impl, of_group = "fib/_action/", Fibonacci.Impl, {"callback_group": group}
        self.send_goal = self.node.create_client(
            impl.SendGoalService, f"{name}send_goal", **of_group
        )
        self.get_result = self.node.create_client(
            impl.GetResultService, f"{name}get_result", **of_group
        )
        self.cancel_goal = self.node.create_client(CancelGoal, f"{name}cancel_goal", **of_group)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.node.create_subscription(
            GoalStatusArray, f"{name}status", self._on_status, latched, callback_group=group
        )
        self.executor = MultiThreadedExecutor(8, context=self.context)
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self.executor.spin)
        self.thread.start()
        for client in (self.send_goal, self.get_result, self.cancel_goal):
            assert client.wait_for_service(LONG_S)

    def close(self):
        for event, _ in self.ends.values():
            event.set()
        self.executor.shutdown()
        self.thread.join()
        self.server.destroy()
        self.node.destroy_node()
        self.context.shutdown()

    # The server.

    def _keep(self, handle):
        with self.news:
            self.goals[bytes(handle.goal_id.uuid)] = handle
            self.news.notify_all()

    def _run(self, handle):
        event, end = self.ends[bytes(handle.goal_id.uuid)]
        assert event.wait(LONG_S)
        getattr(handle, *end)()
        return Fibonacci.Result(sequence=[handle.request.order])

    def _on_status(self, message):
        with self.news:
            for state in message.status_list:
                uuid = bytes(state.goal_info.goal_id.uuid)
                if state.status != self.codes.get(uuid):
                    self.paths.setdefault(uuid.hex(), []).append(state.status)
                self.codes[uuid] = state.status
                self.stamps[uuid] = state.goal_info.stamp
            self.news.notify_all()

    def _wait(self, condition):
        with self.news:
            assert self.news.wait_for(condition, LONG_S)

    def _call(self, client, request):
        done = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: done.set())

        def answer():
            assert done.wait(LONG_S)
            return future.result()

        return answer

    # What a conversation asks for.

    def send(self, uuid, order):
        request = Fibonacci.Impl.SendGoalService.Request()
        request.goal_id.uuid = list(uuid)
        request.goal.order = order
        response = self._call(self.send_goal, request)()
        if response.accepted:
            self._wait(lambda: uuid in self.goals)
        return response.accepted

    def execute(self, uuid):
        self.ends[uuid] = threading.Event(), []
        self.goals[uuid].execute()

    def finish(self, uuid, how):
        event, end = self.ends[uuid]
        end.append({"succeeded": "succeed", "aborted": "abort", "canceled": "canceled"}[how])
        event.set()

    def cancel(self, uuid=NONE, up_to=None):
        request = CancelGoal.Request()
        request.goal_info.goal_id.uuid = list(uuid)
        if up_to is not None:
            request.goal_info.stamp = self.stamps[up_to]
        response = self._call(self.cancel_goal, request)()
        return [
            response.return_code,
            sorted(hexadecimal(g.goal_id) for g in response.goals_canceling),
        ]

    def result(self, uuid):
        request = Fibonacci.Impl.GetResultService.Request()
        request.goal_id.uuid = list(uuid)
        answer = self._call(self.get_result, request)

        def end():
            response = answer()
            return [response.status, list(response.result.sequence)]

        return end

    def state(self, uuid, code):
        self._wait(lambda: self.codes.get(uuid) == code)


def hexadecimal(goal_id):
    return bytes(goal_id.uuid).hex()


def converse(name):
    """Return what rclpy's server answers in a conversation, and the states that its goals were in."""
    world = World()
    try:
        return CONVERSATIONS[name](world), world.paths
    finally:
        world.close()


def refuse_a_cancel():
    """Return what rclpy answers when its callback refuses to cancel."""
    world = World(refuse_cancels=True)
    try:
        world.send(A, 3)
        world.state(A, 1)
        world.execute(A)
        world.state(A, 2)
        heard = [world.cancel(A), world.cancel()]
        world.finish(A, "succeeded")
        return [*heard, world.result(A)()]
    finally:
        world.close()


# -- parameters and life cycles --------------------------------------------------------------------


class Managed(LifecycleNode):
    """A managed node.

    Args:
        context: Its context.
        parameters: Its parameters.
        refused: Transitions and parameters that fail.
        broken: Transitions that raise.
    """

    def __init__(self, context, parameters, refused=(), broken=()):
        super().__init__("robot", context=context)
        self.refused, self.broken = refused, broken
        for name, value in parameters.items():
            self.declare_parameter(name, value)
        self.add_on_set_parameters_callback(self._judge)

    def _judge(self, parameters):
        wrong = [one.name for one in parameters if one.name in self.refused]
        return SetParametersResult(successful=not wrong, reason=" ".join(wrong) and "too fast")

    def _move(self, label):
        if label in self.broken:
            raise RuntimeError(label)
        is_refused = label in self.refused
        return TransitionCallbackReturn.FAILURE if is_refused else TransitionCallbackReturn.SUCCESS

    def on_configure(self, _state):
        return self._move("configure")

    def on_activate(self, _state):
        return self._move("activate")

    def on_deactivate(self, _state):
        return self._move("deactivate")

    def on_cleanup(self, _state):
        return self._move("cleanup")


class Robot:
    """A managed node, and a lifecycle manager as Nav2's: it is active from the third question on.

    The arguments are those of `Managed`.
    """

    def __init__(self, *arguments):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = Managed(self.context, *arguments)
        self.manager = rclpy.create_node("manager", context=self.context)
        self.manager.create_service(Trigger, "/manager/is_active", self._is_active)
        self.asker = rclpy.create_node("asker", context=self.context)
        self.executor = MultiThreadedExecutor(4, context=self.context)
        for each in (self.node, self.manager, self.asker):
            self.executor.add_node(each)
        self.questions = 0
        self.thread = threading.Thread(target=self.executor.spin)
        self.thread.start()

    def _is_active(self, _request, response):
        self.questions += 1
        response.success = self.questions >= 3
        return response

    def call(self, kind, name, request):
        client = self.asker.create_client(kind, name)
        assert client.wait_for_service(LONG_S)
        done = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: done.set())
        assert done.wait(LONG_S)
        self.asker.destroy_client(client)
        return future.result()

    def close(self):
        self.executor.shutdown()
        self.thread.join()
        for each in (self.node, self.manager, self.asker):
            each.destroy_node()
        self.context.shutdown()


def ask_a_node(parameters, asked):
    """Return what a managed node of rclpy answers, in order; see `test_nodes`."""
    robot = Robot(parameters)

    def call(kind, name, request):
        return robot.call(kind, f"/robot/{name}", request)

    def set_parameters(values):
        made = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        found = call(SetParameters, "set_parameters", SetParameters.Request(parameters=made))
        return [n for n, one in zip(values, found.results, strict=True) if not one.successful]

    def get_parameters(names):
        found = call(GetParameters, "get_parameters", GetParameters.Request(names=names)).values
        return [parameter_value_to_python(one) for one in found]

    def change_state(label):
        request = ChangeState.Request()
        request.transition.label = label
        is_done = call(ChangeState, "change_state", request).success
        return [is_done, call(GetState, "get_state", GetState.Request()).current_state.label]

    known = {f.__name__: f for f in (set_parameters, get_parameters, change_state)}
    try:
        return [known[name](argument) for name, argument in asked]
    finally:
        robot.close()


ROBOTS = []


def open_robot(*arguments):
    """Begin a robot that `ask_robot` asks; see `Robot`."""
    ROBOTS.append(Robot(*arguments))


def ask_robot(service, full, payload):
    """Return the bytes with which a service of the robot answers these."""
    kind = find(full)
    request = deserialize_message(bytes.fromhex(payload), kind.Request)
    return serialize_message(ROBOTS[-1].call(kind, service, request)).hex()


def look_at_robot(names):
    """Return the values of parameters, the state, and how often the manager was asked."""
    node = ROBOTS[-1].node
    state = node._state_machine.current_state[1]
    return [[node.get_parameter(name).value for name in names], state, ROBOTS[-1].questions]


def close_robot():
    """End it."""
    ROBOTS.pop().close()


COMMANDS = {
    f.__name__: f
    for f in (
        *(exchange, converse, refuse_a_cancel, ask_a_node),
        *(open_robot, ask_robot, look_at_robot, close_robot),
    )
}

for line in sys.stdin:
    command, *arguments = json.loads(line)
    print(json.dumps(COMMANDS[command](*arguments)), flush=True)
