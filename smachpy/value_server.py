"""Values of userdata as they are now, whole: what events tell of them is shortened.

<server>/smach/value     container and key -> text     smachpy_msgs/ReadValue
"""

from __future__ import annotations

import pprint
from typing import TYPE_CHECKING

from actionlib_core.interfaces import Message, define_service
from actionlib_core.service import Service
from smachpy.container import Container

if TYPE_CHECKING:
    from typing import Any

    from actionlib_core.node import Node
    from smachpy.state import State

VALUE_SERVICE = "/smach/value"
LONGEST_VALUE = 2_000_000
"""Characters of the text of a value; the rest is cut off, which the text says."""

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


class ValueServer:
    """Answers what a key of a container's userdata holds now.

    Args:
        server_name: First part of the service's name.
        machine: Whose userdata.
        path: What the machine is called in the paths of requests.
        node: Where to answer.

    Threads: values are read while the machine runs; one that changes meanwhile may be told half
        before and half after the change, or as the error that came of it.
    """

    def __init__(self, server_name: str, machine: Container, path: str, node: Node) -> None:
        self._machine = machine
        self._path = path
        self._service = Service(
            server_name + VALUE_SERVICE, ReadValue, self._answer, node=node, alone=False
        )

    def close(self) -> None:
        """Answer no more; a second call does nothing."""
        self._service.close()

    def _answer(self, request: Any) -> tuple[bool, str]:
        container = _find(self._machine, request.container.removeprefix(self._path))
        userdata = getattr(container, "userdata", None)
        if userdata is None:
            return False, f"{request.container}: no such container; expected one of {self._path}."
        try:
            value = userdata[request.key]
        except KeyError:
            return False, f"{request.container}: {request.key!r} is not there any more."
        try:
            text = value_text(value)
        except Exception as error:  # noqa: BLE001  a repr may raise anything
            return False, f"{type(value).__name__}: its repr raised {type(error).__name__}: {error}"
        return True, text


def value_text(value: Any) -> str:
    """Return a value as people read it: text itself, messages as YAML, all else as Python.

    Raises:
        Exception: whatever the value's `repr` does.
    """
    if isinstance(value, (str, Message)):
        text = str(value)
    else:
        text = pprint.pformat(value, width=WIDTH, compact=True)
    if len(text) <= LONGEST_VALUE:
        return text
    return f"{text[:LONGEST_VALUE]}\n... {len(text) - LONGEST_VALUE} characters more"


def _find(state: State, path: str) -> State | None:
    """Return the state at a path below `state`; labels may hold anything."""
    if not path:
        return state
    if not isinstance(state, Container):
        return None
    for label, child in state.get_children().items():
        rest = path.removeprefix(f"/{label}")
        if rest != path and (not rest or rest.startswith("/")):
            found = _find(child, rest)
            if found is not None:
                return found
    return None
