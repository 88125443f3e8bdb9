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
from typing import NamedTuple

ROOT = "@smachpy"
WORDS_BEFORE_NAME = 7


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


# In a key, slashes separate words, and a word cannot be empty.
def _pack(word: str) -> str:
    return word.replace("/", "%") or "-"


def _unpack(word: str) -> str:
    return "" if word == "-" else word.replace("%", "/")
