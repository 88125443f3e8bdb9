"""Access rules sent to the programs they concern, so that a forbidden name raises an error.

Zenoh silently drops messages that a rule forbids. A session with rules therefore answers queries on
`@smachpy_access` with the rules for the program that asks, which checks its own names before it
uses them. The rules are enforced by Zenoh in the session that has them; this check only adds errors
that people can understand.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from actionlib_core.transport._keys import key_matches
from actionlib_core.transport.tokens import ROOT, WORDS_BEFORE_NAME

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib_core.config import AccessRule

ACCESS_KEY = "@smachpy_access/rules"


@dataclass(frozen=True, slots=True)
class Permissions:
    """The names that one program may use.

    Attributes:
        who: The program, as the other side identifies it: "user 'alice'".
        allow: Patterns of the names it may use.
        deny: Patterns of the names it may not use, even if `allow` has them.
    """

    who: str
    allow: tuple[str, ...]
    deny: tuple[str, ...]

    def allows(self, key: str) -> bool:
        """Return whether the program may use a key: by its name, or that in a token's key."""
        name = _name_of(key)
        if name is None or any(key_matches(pattern, name) for pattern in self.deny):
            return name is None
        return any(key_matches(pattern, name) for pattern in self.allow)

    def encode(self) -> bytes:
        """Return it as bytes."""
        fields = {"who": self.who, "allow": self.allow, "deny": self.deny}
        return json.dumps(fields).encode()


def decode_permissions(payload: bytes) -> Permissions:
    """Return the `Permissions` that `Permissions.encode` has written.

    Raises:
        ValueError: it is something else.
    """
    try:
        fields = json.loads(payload)
        who, allow, deny = (fields[word] for word in ("who", "allow", "deny"))
    except (LookupError, TypeError, RecursionError) as error:
        raise ValueError(f"got {payload[:80]!r}; expected who, allow and deny") from error
    lists = isinstance(allow, list) and isinstance(deny, list)
    if not (lists and all(isinstance(each, str) for each in (who, *allow, *deny))):
        raise ValueError(f"got {payload[:80]!r}; expected a text and two lists of texts")
    return Permissions(who, tuple(allow), tuple(deny))


def decode_question(payload: bytes) -> tuple[str, str]:
    """Return the session and the user that a program names as it asks for its permissions.

    Raises:
        ValueError: it is something else.
    """
    try:
        fields = json.loads(payload)
        session, user = fields["session"], fields["user"]
    except (LookupError, TypeError, RecursionError) as error:
        raise ValueError(f"got {payload[:80]!r}; expected session and user") from error
    if not all(isinstance(word, str) for word in (session, user)):
        raise ValueError(f"got {payload[:80]!r}; expected two texts")
    return session, user


def find_permissions(rules: Iterable[AccessRule], user: str, certificate: str) -> Permissions:
    """Return the permissions of the program that has logged in as `user` or with `certificate`.

    Args:
        rules: All rules.
        user: Its user name, or "".
        certificate: Common name of its certificate, or "".
    """
    # The same selection as Zenoh's own, to which `_zenoh_config` gives the same rules.
    mine = [rule for rule in rules if _concerns(rule, user, certificate)]
    who = f"certificate {certificate!r}" if certificate else f"user {user!r}" if user else "anybody"
    return Permissions(
        who,
        tuple(name for rule in mine if rule.permission == "allow" for name in rule.names),
        tuple(name for rule in mine if rule.permission == "deny" for name in rule.names),
    )


def _concerns(rule: AccessRule, user: str, certificate: str) -> bool:
    if rule.users:
        return user in rule.users
    return not rule.certificates or certificate in rule.certificates


def _name_of(key: str) -> str | None:
    """Return the ROS name in a key; None for keys without one, and for patterns."""
    if key.startswith(f"{ROOT}/"):
        words = key.split("/", WORDS_BEFORE_NAME)
        name = words[-1] if len(words) > WORDS_BEFORE_NAME else "*"
        return None if "*" in name else name
    name = key.partition("/@")[0]
    return None if name.startswith("@") else name
