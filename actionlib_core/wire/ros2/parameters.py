"""The parameter services that every ROS 2 node has, for the nodes of this program.

`ros2 param list` asks each node that it sees and waits for those that do not answer, so a node
without these services delays it. Our nodes have the parameter that all nodes have, `use_sim_time`,
and it is read-only.

Source:
    rclpy's parameter_service.py: the names, and the answers about unknown parameters.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces import ros2
from actionlib_core.wire.ros2.attachment import answer_to, unpack_attachment
from actionlib_core.wire.ros2.graph import RosType
from actionlib_core.wire.ros2.names import HASH_NOT_SUPPORTED, Kind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.transport import Closable, Query
    from actionlib_core.wire.ros2.graph import RosNode

OWN = "use_sim_time"
VALUE = False
BOOL = 1  # rcl_interfaces/msg/ParameterType
READ_ONLY = (
    "use_sim_time: got another value for a parameter that is read-only; expected false: programs "
    "of smachpy take time from the computer's clock."
)
UNKNOWN = (
    "{!r}: got a parameter that is not declared; expected use_sim_time: a program of smachpy has "
    "no other one."
)
SERVICES = {
    "describe_parameters": "rcl_interfaces/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/GetParameterTypes",
    "get_parameters": "rcl_interfaces/GetParameters",
    "list_parameters": "rcl_interfaces/ListParameters",
    "set_parameters": "rcl_interfaces/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/SetParametersAtomically",
}


def serve_parameters(node: RosNode, distro: str) -> list[Closable]:
    """Offer the parameter services of a node; return what is to be closed, in reverse order.

    Args:
        node: The node.
        distro: The distribution whose definitions are used.

    Raises:
        TransportError: the session is closed.

    Threads: requests are answered on the network's threads.
    """
    declared: list[Closable] = []
    ends = []
    for service, type_name in SERVICES.items():
        service_class: Any = ros2.get_service(type_name, distro)
        type_hash = HASH_NOT_SUPPORTED if distro == "humble" else service_class._rihs01
        ros_type = RosType(service_class._type, type_hash)
        end = node.end(Kind.SERVICE, f"{node.full_name}/{service}", ros_type)
        ends.append(end)
        take = partial(_take, node, service_class, partial(answer, service, distro))
        declared.append(node.transport.queryable(end.key, take, complete=True))
    for end in ends:  # last, because a program that sees them may send a request at once
        end.show()
    return [*declared, *ends]


def _take(node: RosNode, service_class: Any, decide: Callable[[Any], Any], query: Query) -> None:
    """Answer a request; if it cannot be read, with an error."""
    try:
        asked = unpack_attachment(query.attachment)
        request = service_class.Request.from_cdr(query.payload)
    except ValueError as error:
        query.reply_error(f"{service_class._type}: the request cannot be read: {error}")
    else:
        payload = decide(request).to_cdr()
        query.reply(payload, attachment=answer_to(asked, node.clock.time_ns()))
    query.finish()


def answer(service: str, distro: str, request: Any) -> Any:
    """Return the response to a request of one of `SERVICES`.

    As in rclpy, a request that names an unknown parameter is answered with an empty list.
    """
    service_class: Any = ros2.get_service(SERVICES[service], distro)
    response = service_class.Response()
    match service:
        case "list_parameters":
            wanted = request.prefixes
            response.result.names = [OWN] if not wanted or OWN in wanted else []
        case "set_parameters":
            response.results = [_set([each], distro) for each in request.parameters]
        case "set_parameters_atomically":
            response.result = _set(request.parameters, distro)
        case _ if set(request.names) - {OWN}:  # an unknown one: all lists stay empty
            pass
        case "get_parameters":
            value: Any = ros2.get_message("rcl_interfaces/ParameterValue", distro)
            response.values = [value(type=BOOL, bool_value=VALUE) for _ in request.names]
        case "get_parameter_types":
            response.types = [BOOL for _ in request.names]
        case "describe_parameters":
            descriptor: Any = ros2.get_message("rcl_interfaces/ParameterDescriptor", distro)
            response.descriptors = [
                descriptor(name=OWN, type=BOOL, read_only=True) for _ in request.names
            ]
    return response


def _set(parameters: list[Any], distro: str) -> Any:
    """Return the result of setting parameters: refused, unless nothing would change."""
    reasons = [
        READ_ONLY if each.name == OWN else UNKNOWN.format(each.name)
        for each in parameters
        if each.name != OWN or each.value.type != BOOL or each.value.bool_value != VALUE
    ]
    result: Any = ros2.get_message("rcl_interfaces/SetParametersResult", distro)
    return result(successful=not reasons, reason=" ".join(reasons))


__all__ = ["SERVICES", "answer", "serve_parameters"]
