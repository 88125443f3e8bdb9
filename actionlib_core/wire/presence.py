"""The liveliness tokens by which action servers, clients, services and topics announce themselves.

Every end of a name has one token while it lives. The token's key contains everything that tools and
clients need, so that they need not query or poll:

    @smachpy/<kind>/<session>/<entity>/<node>/<type>/<md5>/<name ...>

`session` is the id of the network session, `entity` a number within it, `node` the node's full
name. Slashes in `node` and `type` are written `%`, an empty word is written `-`. The name comes
last and keeps its slashes, so `@smachpy/*/*/*/*/*/*/robot_1/**` matches everything of one robot.
"""

from __future__ import annotations

from enum import StrEnum
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.exceptions import TypeMismatchError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib_core.clock import Clock
    from actionlib_core.transport import Transport

ROOT = "@smachpy"
WORDS_BEFORE_NAME = 7
LIST_TIMEOUT_S = 1.0  # longest wait for the answers to a query for tokens
SETTLE_S = 0.4  # discovery counts as finished after this time without a new token
SETTLE_MOST_S = 3.0  # or after this time in all


class Kind(StrEnum):
    """The role of an end of a name."""

    ACTION_SERVER = "action_server"
    ACTION_CLIENT = "action_client"
    SERVICE = "service"
    PUBLISHER = "publisher"
    SUBSCRIBER = "subscriber"


class Endpoint(NamedTuple):
    """One end of a name, with the contents of its token.

    Attributes:
        kind: Its role.
        name: Full name of the action, service or topic, no slash in front.
        type: "pkg/Type".
        md5: Checksum of the type.
        session: Id of its network session.
        node: Full name of its node.
        entity: Its number within the session.
    """

    kind: Kind
    name: str
    type: str
    md5: str
    session: str
    node: str
    entity: int = 0

    @property
    def age(self) -> tuple[int, str]:
        """Sorts ends by their start: the later, the greater; see `with_age`."""
        return self.entity, self.session


def with_age(endpoint: Endpoint, now_ns: int) -> Endpoint:
    """Return `endpoint` with an entity number that contains the time: milliseconds, then its own.

    For names that only one end may have: of two, the older stays.
    """
    entity = now_ns // 1_000_000 * 1_000_000 + endpoint.entity % 1_000_000
    return endpoint._replace(entity=entity)


def is_younger(endpoint: Endpoint, other: Endpoint) -> bool:
    """Return whether `endpoint` started after `other`; both sides come to the same answer."""
    return endpoint.age > other.age


@lru_cache(maxsize=1024)  # used for every goal, whose message names its server
def token_key(endpoint: Endpoint) -> str:
    """Return the key of the token of `endpoint`."""
    kind, name, type_name, md5, session, node, entity = endpoint
    words = (kind.value, session, str(entity), node, type_name, md5)
    return "/".join((ROOT, *(_pack(word) for word in words), name))


def parse_token(key: str) -> Endpoint | None:
    """Return the end that a token's key describes; None if the key is not one of our tokens."""
    words = key.split("/", WORDS_BEFORE_NAME)  # the name keeps its slashes
    # Commands print names: a line break or an escape sequence in one could pass for their output.
    if len(words) <= WORDS_BEFORE_NAME or words[0] != ROOT or not key.isprintable():
        return None
    _, kind, session, entity, node, type_name, md5, name = words
    try:
        return Endpoint(
            Kind(kind),
            name,
            _unpack(type_name),
            _unpack(md5),
            session,
            _unpack(node),
            int(entity),
        )
    except ValueError:
        return None


def token_pattern(kind: Kind | None = None, name: str = "**", *, session: str = "*") -> str:
    """Return the pattern of the tokens of a kind and a name, to watch or list them.

    Args:
        kind: None for every kind.
        name: Full name, or a pattern: "**" is every name, "robot_1/**" those of one robot.
        session: Only those of this session.
    """
    return f"{ROOT}/{kind.value if kind else '*'}/{session}/*/*/*/*/{name}"


def in_conflict(
    own: Endpoint, other: Endpoint, *, stays: bool = False
) -> tuple[tuple[str, str], tuple[str, str]]:
    """Return (node, session) of the server that stops, then of the one that keeps the name.

    `own` stops; with `stays`, the other one does.
    """
    stops, keeps = (other, own) if stays else (own, other)
    return (stops.node, stops.session), (keeps.node, keeps.session)


def list_endpoints(
    transport: Transport,
    *,
    kind: Kind | None = None,
    name: str = "**",
    timeout: float = LIST_TIMEOUT_S,
) -> list[Endpoint]:
    """Return the ends that have a token now, sorted.

    Blocks: until the network has answered, `timeout` [s] at most.
    """
    keys = transport.list_alive(token_pattern(kind, name), timeout)
    found = (parse_token(key) for key in keys)
    return sorted(endpoint for endpoint in found if endpoint is not None)


def settle_network(transport: Transport, clock: Clock, quiet: float = SETTLE_S) -> None:
    """Wait in a new session until no new token has been found for `quiet` [s].

    Blocks: `SETTLE_MOST_S` at most.
    """
    news = clock.event("the network to be known")
    watch = transport.watch_alive(token_pattern(None, "**"), lambda _presence: news.set())
    deadline = clock.now() + SETTLE_MOST_S
    try:
        while news.wait(min(quiet, max(deadline - clock.now(), 0.0))):
            news.clear()
    finally:
        watch.close()


def find_mismatch(endpoints: Iterable[Endpoint], own: Endpoint) -> TypeMismatchError | None:
    """Return the error of the first end that has another type than `own`, None when all agree."""
    for other in endpoints:
        if (other.type, other.md5) != (own.type, own.md5):
            return TypeMismatchError(
                own.name,
                (own.type, own.md5),
                (other.type, other.md5),
                by=f"{other.kind} in node {other.node!r}",
            )
    return None


# In a key, slashes separate words, and a word cannot be empty.
def _pack(word: str) -> str:
    return word.replace("/", "%") or "-"


def _unpack(word: str) -> str:
    return "" if word == "-" else word.replace("%", "/")
