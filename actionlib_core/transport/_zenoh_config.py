"""Our configuration as Zenoh's settings: path in Zenoh's configuration -> plain JSON value.

Source:
    https://github.com/eclipse-zenoh/zenoh/blob/main/DEFAULT_CONFIG.json5 lists and explains them.
"""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING

from actionlib_core.config import ROUTER_ENDPOINT
from actionlib_core.transport._access import ACCESS_KEY
from actionlib_core.transport.tokens import ROOT

if TYPE_CHECKING:
    from actionlib_core.config import AccessRule, Config

DISCOVERY_GROUP = "224.0.0.224"  # Zenoh's default
FIRST_PORT = 7446  # of discovery in domain 0; Zenoh's default
SCOUT_S = 8.0  # Zenoh's longest interval between two searches for peers
RETRY_S = 1.0  # interval of attempts to connect to an endpoint
LOOPBACK = "tcp/127.0.0.1:0"  # a free port, not reachable from other computers
_MESSAGES = [
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
]
# Only one of two peers opens the connection; by default both do. If then only one side has given up
# a link (a process was suspended or a cable was cut, for about the lease), the new link is added to
# the rest of the old one, for ever: each side then uses numbers for keys that the other does not
# know, or uses for other keys.
# https://github.com/eclipse-zenoh/zenoh/issues/2806
_ONE_DIALS = {"peer": {"to_router": "always", "to_peer": "greater-zid"}}
_LOOKING = ["liveliness_query", "declare_liveliness_subscriber"]
QUEUED = 16  # Zenoh's maximum; memory is allocated only when it is needed
DROP_S = 0.005  # how long a message that may be dropped waits for room
_QUEUE = "transport/link/tx/queue"


def zenoh_settings(config: Config) -> dict[str, object]:
    """Return the settings for a Zenoh configuration."""
    settings: dict[str, object] = {
        "mode": config.mode,
        "connect/endpoints": list(config.connect),
        "connect/timeout_ms": round(config.connect_timeout * 1e3),
        "connect/exit_on_failure": bool(config.connect),
        "connect/retry": {
            "period_init_ms": round(RETRY_S * 1e3),
            "period_max_ms": round(RETRY_S * 1e3),
            "period_increase_factor": 1,
        },
        "listen/endpoints": _listen(config),
        "scouting/multicast/enabled": config.discovery != "off",
        "scouting/multicast/autoconnect_strategy": _ONE_DIALS,
        "scouting/gossip/autoconnect_strategy": _ONE_DIALS,
        "scouting/delay": round(config.settle * 1e3),
        "open/return_conditions/connect_scouted": config.settle > 0,
        "open/return_conditions/declares": config.settle > 0,
        "timestamping/enabled": _stamps(config),
        "transport/link/tx/lease": round(config.lease * 1e3),
        # Zenoh's default queue has room for two. Messages that may be dropped (those to ROS 2)
        # would be dropped after the first few of a burst.
        f"{_QUEUE}/size/data": QUEUED,
        f"{_QUEUE}/congestion_control/drop/wait_before_drop": round(DROP_S * 1e6),
        # Shared memory is not faster for our small messages, and killed processes leave segments.
        "transport/shared_memory/enabled": False,
    }
    if config.discovery != "off":
        settings["scouting/multicast/interface"] = config.discovery
        settings["scouting/multicast/address"] = f"{DISCOVERY_GROUP}:{FIRST_PORT + config.domain}"
    settings.update(_tls(config))
    settings.update(_login(config))
    settings.update(_access(config))
    return settings


def is_local(config: Config) -> bool:
    """Return whether a session can only be linked with others on this computer."""
    alone = config.mode == "peer" and not (config.connect or config.listen)
    return alone and config.discovery == "lo"


def new_session_id(now_ns: int) -> str:
    """Return an id for a new session: greater, in Zenoh's order, than those of earlier sessions.

    Of two peers, the one with the greater id opens the connection. That should be the newer one: it
    searches for peers at once, while the others do so only every 8 s.

    Args:
        now_ns: The time [ns]: on one computer the monotonic one, as the other can be put back; else
            that since the epoch, which is the same on all computers.
    """
    # Zenoh compares ids from the last byte of the number to the first.
    raw = now_ns.to_bytes(8, "big") + secrets.token_bytes(8)
    return f"{int.from_bytes(raw, 'little'):x}"


def _stamps(config: Config) -> bool:
    in_one_session = any(not network.router for network in config.ros2)
    return config.timestamping or config.mode == "router" or in_one_session


def _listen(config: Config) -> list[str]:
    if config.mode == "client":
        return []
    if config.listen:
        return list(config.listen)
    return [ROUTER_ENDPOINT if config.mode == "router" else LOOPBACK]


def _tls(config: Config) -> dict[str, object]:
    tls = config.tls
    if not tls.ca:
        return {}
    prefix = "transport/link/tls"
    settings: dict[str, object] = {
        f"{prefix}/root_ca_certificate": tls.ca,
        f"{prefix}/enable_mtls": tls.require_client_certificate,
        f"{prefix}/verify_name_on_connect": tls.verify_name,
    }
    if tls.certificate:
        for side in ("listen", "connect"):
            settings[f"{prefix}/{side}_certificate"] = tls.certificate
            settings[f"{prefix}/{side}_private_key"] = tls.key
    return settings


def _login(config: Config) -> dict[str, object]:
    settings: dict[str, object] = {}
    if config.user:
        settings["transport/auth/usrpwd/user"] = config.user
        settings["transport/auth/usrpwd/password"] = config.secret()
    if config.users_file:
        settings["transport/auth/usrpwd/dictionary_file"] = config.users_file
    return settings


def _access(config: Config) -> dict[str, object]:
    if not config.access:
        return {}
    # Everybody may list tokens (each token is itself subject to the rules) and query the rules.
    rules: list[dict[str, object]] = [
        _rule("look", "allow", [f"{ROOT}/**"], _LOOKING),
        _rule("ask", "allow", [ACCESS_KEY], ["query", "reply", "declare_queryable"]),
    ]
    subjects: list[dict[str, object]] = [{"id": "everybody"}]
    policies: list[dict[str, object]] = [{"rules": ["look", "ask"], "subjects": ["everybody"]}]
    for index, rule in enumerate(config.access):
        rules.append(_rule(f"rule{index}", rule.permission, _keys(rule), _MESSAGES))
        subject: dict[str, object] = {"id": f"subject{index}"}
        if rule.users:
            subject["usernames"] = list(rule.users)
        if rule.certificates:
            subject["cert_common_names"] = list(rule.certificates)
        subjects.append(subject)
        policies.append({"rules": [f"rule{index}"], "subjects": [f"subject{index}"]})
    return {
        "access_control": {
            "enabled": True,
            "default_permission": "deny",
            "rules": rules,
            "subjects": subjects,
            "policies": policies,
        }
    }


def _rule(name: str, permission: str, keys: list[str], messages: list[str]) -> dict[str, object]:
    return {
        "id": name,
        "messages": messages,
        "flows": ["ingress", "egress"],
        "permission": permission,
        "key_exprs": keys,
    }


def _keys(rule: AccessRule) -> list[str]:
    """Return the keys of a rule's names: messages, latched messages and tokens."""
    keys = []
    for name in rule.names:
        keys += [name, f"{name}/@latch/**", f"{ROOT}/*/*/*/*/*/*/{name}"]
    return keys
