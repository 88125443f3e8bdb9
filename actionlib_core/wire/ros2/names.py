"""How ROS 2 nodes name their endpoints on Zenoh: keys, liveliness tokens, QoS, action names.

Full names have no slash in front, as everywhere in this package; types are those of ROS 2 with
their kind, `nav2_msgs/action/NavigateToPose`. Everything here is pure.

Source:
    rmw_zenoh_cpp 0.6.7 (ROS 2 Kilted), as measured; its `docs/design.md` names the parts.
"""

from __future__ import annotations

import hashlib
import re
from enum import StrEnum
from typing import NamedTuple

ROOT = "@ros2_lv"
HASH_NOT_SUPPORTED = "TypeHashNotSupported"  # what ROS 2 Humble writes in place of every hash
NO_GOAL = bytes(16)  # the id in a request to cancel several goals; no goal has it

NODE_WORDS = 9  # words of a node's token
END_WORDS = 13  # words of an endpoint's token: name, type, hash and QoS in addition
UUID_BYTES = 16

# Zenoh gives * $ ? # and / a meaning in keys; % is rmw_zenoh's escape for "/".
_FORBIDDEN = re.compile(r"[*$?#/%\s]|[^\x20-\x7e]")
_TIMES = re.compile(r"\d*,\d*:\d*,\d*:[0-3]?,\d*,\d*", re.ASCII)
_UUID = re.compile(r"[0-9a-f]{32}")
_NUMBER = re.compile(r"[0-9]{1,20}")  # 64 bits


class Kind(StrEnum):
    """The kind of entity that a token belongs to."""

    NODE = "NN"
    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"
    CLIENT = "SC"


_KINDS = frozenset(kind.value for kind in Kind)


class Qos(NamedTuple):
    """Quality of service that an endpoint offers or expects; it never prevents a match.

    Attributes:
        reliable: False: "best effort".
        latched: Late subscribers get the last messages; ROS 2 calls it "transient local".
        depth: Length of the queue for messages or requests.
        keep_all: The queue is unlimited, and `depth` has no meaning.
        rest: Deadline, lifespan and liveliness, as in the token.
    """

    reliable: bool = True
    latched: bool = False
    depth: int = 10
    keep_all: bool = False
    rest: str = ",:,:,,"


DEFAULT = Qos()  # services, feedback, and topics without further settings
LATCHED = Qos(latched=True, depth=1)  # the status of actions, maps
_UNWRITTEN_DEPTH = 42  # rmw_zenoh's default; tokens leave out values that equal the default


class Token(NamedTuple):
    """The content of a token: it describes a node or one of its endpoints.

    Attributes:
        domain: ROS_DOMAIN_ID.
        session: Id of the Zenoh session, lower-case hexadecimal.
        node_id: Number of the node in its session.
        entity_id: Number of the node or endpoint in its session.
        kind: The kind of entity.
        enclave: Security enclave, "" without one.
        namespace: Of the node, without a slash at either side; "" is the root.
        node: The node's base name.
        name: Full name of the topic or service; "" for a node.
        type: "pkg/kind/Type"; "" for a node.
        type_hash: RIHS01 hash of the type, or `HASH_NOT_SUPPORTED`; "" for a node.
        qos: None for a node, or when it cannot be parsed.
    """

    domain: int
    session: str
    node_id: int
    entity_id: int
    kind: Kind
    enclave: str
    namespace: str
    node: str
    name: str = ""
    type: str = ""
    type_hash: str = ""
    qos: Qos | None = None

    @property
    def full_node(self) -> str:
        """Full name of the node, without a slash in front."""
        return f"{self.namespace}/{self.node}" if self.namespace else self.node


class ActionNames(NamedTuple):
    """The names of the three services and two topics of an action."""

    send_goal: str
    cancel_goal: str
    get_result: str
    feedback: str
    status: str


def action_names(name: str) -> ActionNames:
    """Return the names of the services and topics of the action `name`."""
    return ActionNames(*(f"{name}/_action/{word}" for word in ActionNames._fields))


def action_of(name: str) -> str | None:
    """Return the action to which a topic or service belongs; None when it belongs to none."""
    front, found, part = name.partition("/_action/")
    return front if found and front and part in ActionNames._fields else None


def dds_type(type_name: str) -> str:
    """Return a type as in keys and tokens: `std_msgs::msg::dds_::String_`.

    Raises:
        ValueError: it is not "pkg/kind/Type".
    """
    words = type_name.split("/")
    if len(words) != 3 or not all(map(str.isidentifier, words)):  # noqa: PLR2004
        raise ValueError(
            f"type {type_name!r}: got {len(words)} words; expected three names, as in "
            "'nav2_msgs/action/NavigateToPose'."
        )
    package, kind, base = words
    return f"{package}::{kind}::dds_::{base}_"


def ros_type(dds_name: str) -> str:
    """Return "pkg/kind/Type" for a type in a key or token; other text is returned unchanged."""
    words = dds_name.split("::")
    if len(words) == 4 and words[2] == "dds_" and words[3].endswith("_"):  # noqa: PLR2004
        return "/".join((words[0], words[1], words[3][:-1]))
    return dds_name


def data_key(domain: int, name: str, type_name: str, type_hash: str) -> str:
    """Return the key that all endpoints of a topic or service use.

    Raises:
        ValueError: a part is empty, or has a character that is not allowed in keys.
    """
    words = [_check("name", word) for word in name.split("/")]
    return "/".join(
        (_number("domain", domain), *words, dds_type(type_name), _check("hash", type_hash))
    )


def token_key(token: Token) -> str:
    """Return the key of a token.

    Raises:
        ValueError: a part is empty that must not be, or has a character that is not allowed.
    """
    words = [
        ROOT,
        _number("domain", token.domain),
        _check("session", token.session),
        _number("node id", token.node_id),
        _number("entity id", token.entity_id),
        token.kind.value,
        _escape("enclave", token.enclave),
        _escape("namespace", token.namespace),
        _check("node", token.node),
    ]
    if token.kind is not Kind.NODE:
        words += [
            _escape("name", _filled("name", token.name)),
            dds_type(token.type),
            _check("hash", token.type_hash),
            qos_text(token.qos or DEFAULT),
        ]
    return "/".join(words)


def parse_token(key: str) -> Token | None:
    """Return the content of a token; None when the key is not a token of ROS 2.

    Words after the last known one are ignored: newer releases append some.
    """
    words = key.split("/")
    # Commands print names: a line break or an escape sequence in one could pass for their output.
    if len(words) < NODE_WORDS or words[0] != ROOT or not key.isprintable():
        return None
    _, domain, session, node_id, entity_id, kind, enclave, namespace, node = words[:NODE_WORDS]
    numbers = (domain, node_id, entity_id)
    if not all(words[:NODE_WORDS]) or not all(map(_NUMBER.fullmatch, numbers)):
        return None
    if kind not in _KINDS:
        return None
    front = Token(
        int(domain),
        session,
        int(node_id),
        int(entity_id),
        Kind(kind),
        _unescape(enclave),
        _unescape(namespace),
        node,
    )
    if front.kind is Kind.NODE:
        return front
    if len(words) < END_WORDS or not all(words[NODE_WORDS:END_WORDS]):
        return None
    name, type_name, type_hash, qos = words[NODE_WORDS:END_WORDS]
    return front._replace(
        name=_unescape(name), type=ros_type(type_name), type_hash=type_hash, qos=parse_qos(qos)
    )


def token_pattern(domain: int, kind: Kind | None = None, *, name: str | None = None) -> str:
    """Return a key expression for tokens of a domain, to watch or list them.

    Args:
        domain: ROS_DOMAIN_ID.
        kind: None: every kind, nodes included.
        name: Full name of a topic or service; None: every name.
    """
    front = f"{ROOT}/{domain}/*/*/*/{kind.value if kind else '*'}"
    # The three stars are enclave, namespace and node.
    return f"{front}/**" if name is None else f"{front}/*/*/*/{_escape('name', name)}/**"


def gid_of(key: str) -> bytes:
    """Return the 16 bytes that identify the endpoint with the token `key` in messages.

    They are computed as in rmw_zenoh: XXH3 of the token, 128 bits, the low half first.
    """
    import xxhash  # here, so that the rest of this module works without it

    return xxhash.xxh3_128_digest(key.encode())[::-1]


def qos_text(qos: Qos) -> str:
    """Return quality of service as in tokens, without the values that equal rmw_zenoh's defaults.

    Raises:
        ValueError: the depth is negative, or rmw_zenoh would not write such a `rest`.
    """
    if not _TIMES.fullmatch(qos.rest):
        raise ValueError(f"qos: rest: got {qos.rest!r}; expected text like {DEFAULT.rest!r}.")
    depth = "" if qos.depth == _UNWRITTEN_DEPTH else _number("depth", qos.depth)
    return ":".join(
        (
            "" if qos.reliable else "2",
            "1" if qos.latched else "",
            f"{'2' if qos.keep_all else ''},{depth}",
            qos.rest,
        )
    )


def parse_qos(text: str) -> Qos | None:
    """Return quality of service from a token; None when the text is malformed."""
    words = text.split(":", 3)
    if len(words) != 4:  # noqa: PLR2004
        return None
    reliability, durability, past, rest = words
    history, comma, depth = past.partition(",")
    known = (
        comma and reliability in {"", "1", "2"} and durability in {"", "1", "2"}
    ) and history in {"", "1", "2"}
    if not known or not _TIMES.fullmatch(rest):
        return None
    if depth and not _NUMBER.fullmatch(depth):
        return None
    return Qos(
        reliable=reliability != "2",
        latched=durability == "1",
        depth=int(depth) if depth else _UNWRITTEN_DEPTH,
        keep_all=history == "2",
        rest=rest,
    )


def goal_uuid(goal_id: str) -> bytes:
    """Return the 16 bytes for a goal id on this wire: always the same for the same id.

    32 hexadecimal digits are these bytes; any other text is hashed. The result is never `NO_GOAL`,
    which would turn the cancel of one goal into a cancel of all.
    """
    if _UUID.fullmatch(goal_id):
        uuid = bytes.fromhex(goal_id)
        if uuid != NO_GOAL:
            return uuid
    return hashlib.blake2b(goal_id.encode("utf-8", "surrogatepass"), digest_size=16).digest()


def goal_id_text(uuid: bytes) -> str:
    """Return the goal id for 16 bytes of another program: 32 hexadecimal digits."""
    return bytes(uuid).hex()


def _check(what: str, word: str) -> str:
    """Return a word if it may be part of a key, else raise."""
    found = _FORBIDDEN.search(_filled(what, word))
    if found is not None or word.startswith("@"):
        bad = found.group() if found else "@"
        raise ValueError(f"{what}: got {word!r}; expected a word without {bad!r}.")
    return word


def _filled(what: str, word: str) -> str:
    if not word:
        raise ValueError(f"{what}: got ''; expected a word.")
    return word


def _number(what: str, number: int) -> str:
    if number < 0:
        raise ValueError(f"{what}: got {number}; expected 0 or more.")
    return str(number)


def _escape(what: str, name: str) -> str:
    """Return a name as one word of a key, with % for each slash and for the one in front."""
    if not name:
        return "%"
    return "".join("%" + _check(what, word) for word in name.split("/"))


def _unescape(word: str) -> str:
    return word.replace("%", "/").strip("/")
