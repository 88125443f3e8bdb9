"""Access rules told to those they are for, so that a forbidden name is an error and no silence.

Zenoh drops what a rule forbids without a word. A session with rules therefore answers a question on
`@smachpy_access` with the rules that concern the one who asks, who checks his own names before
they go out. This is a courtesy: what enforces the rules is zenoh, on the side that has them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from actionlib_core.transport._keys import key_matches
from actionlib_core.wire.presence import ROOT, WORDS_BEFORE_NAME

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib_core.config import AccessRule

ACCESS_KEY = "@smachpy_access/rules"


@dataclass(frozen=True, slots=True)
class Permissions:
    """What one program may use.

    Attributes:
        who: Whom the other side takes it for: "user 'alice'".
        allow: Names it may use.
        deny: Names it may not, whatever `allow` says.
    """

    who: str
    allow: tuple[str, ...]
    deny: tuple[str, ...]

    def allows(self, key: str) -> bool:
        """Tell whether a key, or what a token or latched message is about, may be used."""
        name = _name_of(key)
        if name is None or any(key_matches(pattern, name) for pattern in self.deny):
            return name is None
        return any(key_matches(pattern, name) for pattern in self.allow)

    def encode(self) -> bytes:
        """Return it as it travels."""
        fields = {"who": self.who, "allow": self.allow, "deny": self.deny}
        return json.dumps(fields).encode()


def decode_permissions(payload: bytes) -> Permissions:
    """Return what `Permissions.encode` wrote."""
    fields = json.loads(payload)
    return Permissions(fields["who"], tuple(fields["allow"]), tuple(fields["deny"]))


def find_permissions(rules: Iterable[AccessRule], user: str, certificate: str) -> Permissions:
    """Return what a program may use that logged in as `user` or showed `certificate`.

    Args:
        rules: All rules.
        user: Name it logged in with; "" is none.
        certificate: Common name of the certificate it showed; "" is none.
    """
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
    """Return the ROS name that a key is about; None for keys and patterns that are about none."""
    if key.startswith(f"{ROOT}/"):
        words = key.split("/", WORDS_BEFORE_NAME)
        name = words[-1] if len(words) > WORDS_BEFORE_NAME else "*"
        return None if "*" in name else name
    name = key.partition("/@")[0]
    return None if name.startswith("@") else name
