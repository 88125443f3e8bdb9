"""Reads and checks the answers of the XML-RPC interfaces of master and nodes. No network.

Source:
    https://wiki.ros.org/ROS/Master_API and https://wiki.ros.org/ROS/Slave_API.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from actionlib_core.exceptions import Ros1Error

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

SUCCESS = 1
_PARTS = 3  # of every answer: code, text, value
_PORTS = 65536


def read_answer(peer: str, method: str, answer: object) -> Any:
    """Return the value of an answer `[code, text, value]`.

    Raises:
        Ros1Error: it is malformed, or its code is not `SUCCESS`.
    """
    if not isinstance(answer, (list, tuple)) or len(answer) != _PARTS:
        raise Ros1Error(peer, f"{method}: got {answer!r:.200}; expected [code, text, value].")
    code, text, value = answer
    if code != SUCCESS:
        raise refusal(peer, method, text)
    return value


def refusal(peer: str, method: str, text: object) -> Ros1Error:
    """Return the error of a call that a master or node refuses with a text."""
    error = Ros1Error(peer, f"{method}: refused: {text!s:.200}")
    error.refused = True
    return error


def read_texts(peer: str, method: str, value: object) -> list[str]:
    """Return `value` if it is a list of texts; raises as `read_answer`."""
    if not isinstance(value, (list, tuple)) or not all(isinstance(item, str) for item in value):
        raise Ros1Error(peer, f"{method}: got {value!r:.200}; expected a list of texts.")
    return list(value)


def split_address(peer: str, uri: object, scheme: str) -> tuple[str, int]:
    """Return host and port of `http://host:port/` or `rosrpc://host:port`.

    Raises:
        Ros1Error: it is not such an address.
    """
    try:
        parts = urlsplit(uri if isinstance(uri, str) else "")
        if parts.scheme == scheme and parts.hostname and parts.port:
            return parts.hostname, parts.port
    except ValueError:  # raised by `parts.port` when it is not a number
        pass
    raise Ros1Error(peer, f"address: got {uri!r:.200}; expected {scheme}://HOST:PORT.")


def read_tcpros(peer: str, value: object) -> tuple[str, int]:
    """Return host and port from the answer to `requestTopic`, `["TCPROS", host, port]`.

    Raises:
        Ros1Error: it is something else.
    """
    if isinstance(value, (list, tuple)) and len(value) == _PARTS and value[0] == "TCPROS":
        host, port = value[1:]
        if isinstance(host, str) and host and isinstance(port, int) and 0 < port < _PORTS:
            return host, port
    raise Ros1Error(peer, f"requestTopic: got {value!r:.200}; expected ['TCPROS', host, port].")


@dataclass(frozen=True)
class SystemState:
    """The master's registrations: names of topics and services -> names of nodes."""

    publishers: dict[str, list[str]] = field(default_factory=dict)
    subscribers: dict[str, list[str]] = field(default_factory=dict)
    services: dict[str, list[str]] = field(default_factory=dict)

    @classmethod
    def read(cls, peer: str, value: object) -> SystemState:
        """Read the answer to `getSystemState`.

        Raises:
            Ros1Error: it is something else.
        """
        try:
            parts = [
                {str(name): [str(node) for node in nodes] for name, nodes in part}
                for part in value  # type: ignore[attr-defined]  # checked by trying
            ]
            return cls(*parts)
        except (TypeError, ValueError) as error:
            raise Ros1Error(
                peer, f"getSystemState: got {value!r:.200}; expected three lists."
            ) from error


def read_types(peer: str, value: object) -> dict[str, str]:
    """Read the answer to `getTopicTypes`: topic -> type; raises as `SystemState.read`."""
    try:
        return {str(name): str(type_name) for name, type_name in value}  # type: ignore[attr-defined]
    except (TypeError, ValueError) as error:
        raise Ros1Error(
            peer, f"getTopicTypes: got {value!r:.200}; expected pairs of texts."
        ) from error


@dataclass(frozen=True)
class Names:
    """The topics and services with which a node is registered, or wants to be.

    The difference of two, `wanted - there`, is what is still to be registered.
    """

    published: frozenset[str] = frozenset()
    subscribed: frozenset[str] = frozenset()
    served: frozenset[str] = frozenset()

    def __sub__(self, other: Names) -> Names:
        return Names(
            self.published - other.published,
            self.subscribed - other.subscribed,
            self.served - other.served,
        )


def registered(state: SystemState, node: str) -> Names:
    """Return what the master has registered for a node."""

    def of(part: dict[str, list[str]]) -> frozenset[str]:
        return frozenset(name for name, nodes in part.items() if node in nodes)

    return Names(of(state.publishers), of(state.subscribers), of(state.services))


ACTION_WORDS = ("goal", "cancel", "status", "feedback", "result")


def find_actions(types: dict[str, str], names: Iterable[str]) -> dict[str, str]:
    """Return the actions among topics: name -> type "pkg/XAction".

    The master knows no actions, only their five topics.

    Args:
        types: Topic -> its type.
        names: The topics that have publishers or subscribers.
    """
    there: Collection[str] = set(names)
    found = {}
    for topic in there:
        name, slash, word = topic.rpartition("/")
        type_name = types.get(topic, "")
        if not (slash and name and word == "goal" and type_name.endswith("ActionGoal")):
            continue
        if all(f"{name}/{other}" in there for other in ACTION_WORDS):
            found[name] = type_name.removesuffix("Goal")
    return found
