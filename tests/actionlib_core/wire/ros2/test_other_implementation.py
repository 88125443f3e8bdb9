"""Topics and services beside another implementation of this wire, zenoh-ros2-sdk, in its own process.

It makes keys, tokens, type hashes and attachments by itself; it has no actions.
"""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from actionlib_core import Publisher, Service, ServiceProxy, Subscriber
from actionlib_core.interfaces.ros2.std_msgs.msg import String
from actionlib_core.interfaces.ros2.std_srvs.srv import SetBool
from tests.ros2_robot import DOMAIN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.ros2_robot import Ros2Robot

pytestmark = pytest.mark.zenoh

LONG_S = 60.0
OTHER = """
import os, sys
os.environ["GIT_PYTHON_REFRESH"] = "quiet"
import zenoh_ros2_sdk as sdk

where = {"router_port": int(sys.argv[1]), "domain_id": int(sys.argv[2])}
text = {"msg_definition": "string data\\n"}
flag = {
    "request_definition": "bool data\\n", "response_definition": "bool success\\nstring message\\n",
}

def say(*words):
    print(*words, flush=True)

listener = sdk.ROS2Subscriber(
    "/to_other", "std_msgs/msg/String", lambda message: say("heard", message.data), **text, **where
)
speaker = sdk.ROS2Publisher("/from_other", "std_msgs/msg/String", **text, **where)

def answer(request):
    return server.response_msg_class(success=not request.data, message="other")

server = sdk.ROS2ServiceServer("/other_flag", "std_srvs/srv/SetBool", answer, **flag, **where)
client = sdk.ROS2ServiceClient("/our_flag", "std_srvs/srv/SetBool", **flag, **where)
parameters = sdk.ROS2ServiceClient(
    "/mission/get_parameter_types", "rcl_interfaces/srv/GetParameterTypes",
    request_definition="string[] names\\n", response_definition="uint8[] types\\n", **where
)
say("ready")
for line in sys.stdin:
    if line == "speak\\n":
        speaker.publish(data="good morning")
    elif line == "parameters\\n":
        say("types", parameters.call(names=["use_sim_time"]).types.tolist())
    else:
        response = client.call(data=True)
        say("answer", response.success, response.message)
os._exit(0)  # its session keeps threads
"""


@pytest.fixture
def other(robot: Ros2Robot) -> Iterator[subprocess.Popen[str]]:
    port = robot.endpoint.rpartition(":")[2]
    with subprocess.Popen(
        [sys.executable, "-c", OTHER, port, str(DOMAIN)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def wait_for(process: subprocess.Popen[str], begin: str) -> str:
    """Return its next line that begins so."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(begin):
            return line.strip()
    raise AssertionError(f"it has ended without {begin!r}")


def tell(process: subprocess.Popen[str], line: str) -> None:
    assert process.stdin is not None
    process.stdin.write(f"{line}\n")
    process.stdin.flush()


def test_topics_and_services_both_ways(robot: Ros2Robot, other: subprocess.Popen[str]) -> None:
    node = robot.node("mission")
    heard, came = [], robot.clock.event()
    Subscriber("from_other", String, lambda message: (heard.append(message), came.set()), node=node)
    Service(
        "our_flag",
        SetBool,
        lambda request: SetBool.Response(success=request.data, message="ours"),
        node=node,
    )
    publisher = Publisher("to_other", String, node=node)
    proxy = ServiceProxy("other_flag", SetBool, node=node)
    wait_for(other, "ready")
    assert publisher.wait_for_connections(1, LONG_S)
    proxy.wait_for_service(LONG_S)

    publisher.publish(String(data="good evening"))
    assert wait_for(other, "heard") == "heard good evening"
    tell(other, "speak")
    assert came.wait(LONG_S)
    assert heard == [String(data="good morning")]
    tell(other, "call")
    assert wait_for(other, "answer") == "answer True ours"
    tell(other, "parameters")
    assert wait_for(other, "types") == "types [1]"
    assert proxy(data=True) == SetBool.Response(success=False, message="other")
