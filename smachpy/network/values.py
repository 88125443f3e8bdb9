"""Current userdata values in full, on request: in events long values are shortened.

<server>/smach/value     container and key -> text     smachpy_msgs/ReadValue
"""

from __future__ import annotations

import pprint
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces import Message, define_service
from actionlib_core.pubsub.service import Service
from smachpy.userdata.secret import masked

if TYPE_CHECKING:
    from actionlib_core.node import Node
    from smachpy.machines.container import Container

VALUE_SERVICE = "/smach/value"
MAX_VALUE_LENGTH = 2_000_000
"""Longest text of a value; the number of characters cut off is appended."""

WIDTH = 100

ReadValue = define_service(
    "smachpy_msgs/ReadValue",
    """
string container  # path of the container whose userdata it is
string key
---
bool success
string text       # the value; without success, why there is none
""",
)


def serve_values(server_name: str, machine: Container, path: str, node: Node) -> Service:
    """Start the service that returns the current value of a key of a container's userdata.

    Args:
        server_name: First part of the service's name.
        machine: The machine with the userdata.
        path: Its path in requests.
        node: Node of the service.

    Threads: values are formatted while the machine runs. A value that changes at that moment may
        show a mix of old and new parts, or the error that this caused.
    """

    def answer(request: Any) -> tuple[bool, str]:
        container = find_state(machine, request.container.removeprefix(path))
        userdata = getattr(container, "userdata", None)
        if userdata is None:
            return False, f"{request.container}: no such container; expected one of {path}."
        try:
            value = userdata[request.key]
        except KeyError:
            return False, f"{request.container}: {request.key!r} is not there any more."
        try:
            return True, value_text(masked(value, request.key))
        except Exception as error:  # noqa: BLE001  the user's `__repr__`
            return False, f"{type(value).__name__}: its repr raised {type(error).__name__}: {error}"

    return Service(server_name + VALUE_SERVICE, ReadValue, answer, node=node, alone=False)


def value_text(value: Any) -> str:
    """Return a value for people: text unchanged, messages as YAML, anything else as its `repr`.

    Raises:
        Exception: from the value's `repr`.
    """
    if isinstance(value, (str, Message)):
        text = str(value)
    else:
        text = pprint.pformat(value, width=WIDTH, compact=True)
    if len(text) <= MAX_VALUE_LENGTH:
        return text
    return f"{text[:MAX_VALUE_LENGTH]}\n... {len(text) - MAX_VALUE_LENGTH} characters more"


def find_state(state: Any, path: str) -> Any:
    """Return the state at `path` below `state` ("/A/B"; "" is `state` itself), or None.

    Labels may contain slashes, so the path is compared with the labels instead of being split.
    """
    if not path:
        return state
    children = state.get_children() if hasattr(state, "get_children") else {}
    for label, child in children.items():
        if path == f"/{label}" or path.startswith(f"/{label}/"):
            found = find_state(child, path.removeprefix(f"/{label}"))
            if found is not None:
                return found
    return None
