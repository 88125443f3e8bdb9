"""What ROS 2 nodes call their ends on Zenoh: keys, liveliness tokens, quality of service, actions.

Names in full have no slash in front here, as everywhere in this package; types are those of ROS 2
with their kind, `nav2_msgs/action/NavigateToPose`. Everything here is pure.

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
NO_GOAL = bytes(16)  # the id that a cancel of several goals carries; no goal has it

NODE_WORDS = 9
END_WORDS = 13
UUID_BYTES = 16

_FORBIDDEN = re.compile(r"[*$?#/%\s]|[^\x20-\x7e]")  # Zenoh's own characters, and the escape of "/"
_TIMES = re.compile(r"\d*,\d*:\d*,\d*:[0-3]?,\d*,\d*", re.ASCII)
_UUID = re.compile(r"[0-9a-f]{32}")
_NUMBER = re.compile(r"[0-9]{1,20}")  # 64 bits


class Kind(StrEnum):
    """What shows a token."""

    NODE = "NN"
    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"
    CLIENT = "SC"


_KINDS = frozenset(kind.value for kind in Kind)


class Qos(NamedTuple):
    """Quality of service of an end: what it promises or expects; it never prevents a match.

    Attributes:
        reliable: False is "best effort".
        latched: Late subscriptions get the last messages; ROS 2 calls it "transient local".
        depth: How many messages or requests wait for the end.
        keep_all: All of them wait; `depth` says nothing then.
        rest: Deadline, lifespan and liveliness, as they are written.
    """

    reliable: bool = True
    latched: bool = False
    depth: int = 10
    keep_all: bool = False
    rest: str = ",:,:,,"


DEFAULT = Qos()  # services, feedback, and a topic of which nothing was said
LATCHED = Qos(latched=True, depth=1)  # the status of actions, maps
_UNWRITTEN_DEPTH = 42  # rmw_zenoh leaves out what equals its own default


class Token(NamedTuple):
    """What a token says of a node or of one of its ends.

    Attributes:
        domain: ROS_DOMAIN_ID.
        session: Id of the Zenoh session, lower-case hexadecimal.
        node_id: Number of the node in its session.
        entity_id: Number of the end in its session.
        kind: What shows the token.
        enclave: Security enclave, "" without one.
        namespace: Of the node, without slashes around it; "" is the root.
        node: The node's base name.
        name: Full name of the topic or service; "" for a node.
        type: "pkg/kind/Type"; "" for a node.
        type_hash: RIHS01 hash of the type, or `HASH_NOT_SUPPORTED`; "" for a node.
        qos: None for a node, and when it cannot be read.
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
        """Full name of the node, no slash in front."""
        return f"{self.namespace}/{self.node}" if self.namespace else self.node


class ActionNames(NamedTuple):
    """The names of the three services and two topics of an action."""

    send_goal: str
    cancel_goal: str
    get_result: str
    feedback: str
    status: str


def action_names(name: str) -> ActionNames:
    """Return the names of what the action `name` consists of."""
    return ActionNames(*(f"{name}/_action/{word}" for word in ActionNames._fields))


def action_of(name: str) -> str | None:
    """Return the action that a topic or service belongs to; None when it is no part of one."""
    front, found, part = name.partition("/_action/")
    return front if found and front and part in ActionNames._fields else None


def dds_type(type_name: str) -> str:
    """Return a type as keys and tokens write it: `std_msgs::msg::dds_::String_`.

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
    """Return "pkg/kind/Type" of what a key or token names; other text comes back as it is."""
    words = dds_name.split("::")
    if len(words) == 4 and words[2] == "dds_" and words[3].endswith("_"):  # noqa: PLR2004
        return "/".join((words[0], words[1], words[3][:-1]))
    return dds_name


def data_key(domain: int, name: str, type_name: str, type_hash: str) -> str:
    """Return the key on which all ends of a topic or service meet.

    Raises:
        ValueError: a part is empty, or holds what a key must not.
    """
    words = [_check("name", word) for word in name.split("/")]
    return "/".join(
        (_number("domain", domain), *words, dds_type(type_name), _check("hash", type_hash))
    )


def token_key(token: Token) -> str:
    """Return the key of a token.

    Raises:
        ValueError: a part is empty where it must not be, or holds what a key must not.
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
    """Return what a token's key says; None when it is none of ROS 2's.

    Words after the last known one are ignored: newer releases add some.
    """
    words = key.split("/")
    if len(words) < NODE_WORDS or words[0] != ROOT:
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


def token_pattern(
    domain: int, kind: Kind | None = None, *, name: str | None = None, session: str = "*"
) -> str:
    """Return the pattern of the tokens of a domain, to watch or list them.

    Args:
        domain: ROS_DOMAIN_ID.
        kind: None for every kind, nodes included.
        name: Full name of a topic or service; None for every one. The ends of an action are those
            of the five names in `action_names`.
        session: Only those of this session.
    """
    front = f"{ROOT}/{domain}/{session}/*/*/{kind.value if kind else '*'}"
    return f"{front}/**" if name is None else f"{front}/*/*/*/{_escape('name', name)}/**"


def gid_of(key: str) -> bytes:
    """Return the 16 bytes by which messages name the end that shows the token `key`.

    They are those of rmw_zenoh: XXH3 of the token, 128 bits, the low half first.
    """
    import xxhash  # here: the names alone are of use without it

    return xxhash.xxh3_128_digest(key.encode())[::-1]


def qos_text(qos: Qos) -> str:
    """Return quality of service as tokens write it: what equals rmw_zenoh's default is left out.

    Raises:
        ValueError: the depth is negative, or `rest` is none that rmw_zenoh writes.
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
    """Return what `qos_text` wrote, or None when nobody could have written it."""
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
    """Return the 16 bytes that stand for a goal id on this wire: always the same for the same id.

    An id of 32 hexadecimal digits is those bytes; any other text is digested. Never `NO_GOAL`,
    which would make a cancel of one goal a cancel of all.
    """
    if _UUID.fullmatch(goal_id):
        uuid = bytes.fromhex(goal_id)
        if uuid != NO_GOAL:
            return uuid
    return hashlib.blake2b(goal_id.encode("utf-8", "surrogatepass"), digest_size=16).digest()


def goal_id_text(uuid: bytes) -> str:
    """Return the goal id of 16 bytes that came from another program: 32 hexadecimal digits."""
    return bytes(uuid).hex()


def _check(what: str, word: str) -> str:
    """Return one word of a key if it is one."""
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
    """Return a name as one word, as if it had a slash in front."""
    if not name:
        return "%"
    return "".join("%" + _check(what, word) for word in name.split("/"))


def _unescape(word: str) -> str:
    return word.replace("%", "/").strip("/")
