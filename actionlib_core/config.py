"""How this program joins the network: by file, by environment, by argument.

Without any configuration a program talks to programs on the same machine, finds them by itself and
lets nobody else in. Everything beyond that is said here: a router to connect to, TLS, user and
password, who may use which names, and the name space of a robot.

The file is YAML with the fields of `Config`; `SMACHPY_CONFIG` names it, or an argument does.
`SMACHPY_DOMAIN` alone sets the domain where no file does.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from actionlib_core.exceptions import ConfigError, NameSetupError
from actionlib_core.names import clean_namespace

if TYPE_CHECKING:
    from collections.abc import Callable

ENVIRONMENT_VARIABLE = "SMACHPY_CONFIG"
DOMAIN_VARIABLE = "SMACHPY_DOMAIN"
LAST_DOMAIN = 9999
MOST_DIGITS = 9  # of a number that is read
ROUTER_ENDPOINT = "tcp/127.0.0.1:7447"

Mode = Literal["peer", "client", "router"]


@dataclass(frozen=True, slots=True)
class Tls:
    """Encryption and certificates, for endpoints that begin with `tls/`.

    Attributes:
        ca: File with the certificates (PEM) that this side trusts.
        certificate: File with this side's own certificate (PEM).
        key: File with its private key (PEM).
        require_client_certificate: Let in only who shows a certificate that `ca` signed.
        verify_name: Check that the other side's certificate is for the address connected to.
    """

    ca: str = ""
    certificate: str = ""
    key: str = ""
    require_client_certificate: bool = False
    verify_name: bool = True


@dataclass(frozen=True, slots=True)
class AccessRule:
    """Who may use which names, enforced by the router or peer that has the rule.

    Attributes:
        names: Full names without a slash in front; `*` is one word, `**` any number.
        users: Names of users it is for; empty, with `certificates` empty too, is everybody.
        certificates: Common names of client certificates it is for.
        permission: "allow" or "deny"; deny wins where both apply.
    """

    names: tuple[str, ...]
    users: tuple[str, ...] = ()
    certificates: tuple[str, ...] = ()
    permission: Literal["allow", "deny"] = "allow"


@dataclass(frozen=True, slots=True)
class Config:
    """How to join the network.

    Attributes:
        mode: "peer" talks to others directly; "client" goes through a router; "router" is one.
        connect: Endpoints to connect to, `tcp/192.168.1.2:7447` for example.
        listen: Endpoints to be reached at; empty is the loopback address (a client has none).
        discovery: Network interface on which peers find each other: "lo" stays on this machine,
            "auto" picks one, "off" finds nobody.
        domain: Programs of different domains, 0 to 9999, do not find each other.
        namespace: What relative names live under, one per robot.
        lease: A link that is silent for this long [s] is dead, and so is what was behind it.
        connect_timeout: How long opening may try to reach `connect` [s].
        settle: How long opening waits to find others [s]; 0 opens at once and finds them meanwhile.
        timestamping: Each message carries the time it was sent at, as ROS 2 nodes' messages do.
        tls: Encryption and certificates.
        user: Name to log in with.
        password: Password to log in with.
        password_file: File whose first line is the password, instead of `password`.
        users_file: File with `user:password` lines: whom this side lets in.
        access: Who may use which names; without rules everybody may everything.
    """

    mode: Mode = "peer"
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    discovery: str = "lo"
    domain: int = 0
    namespace: str = ""
    lease: float = 10.0
    connect_timeout: float = 5.0
    settle: float = 0.0
    timestamping: bool = False
    tls: Tls = field(default_factory=Tls)
    user: str = ""
    password: str = field(default="", repr=False)
    password_file: str = ""
    users_file: str = ""
    access: tuple[AccessRule, ...] = ()

    def __post_init__(self) -> None:
        """Check what fits together.

        Raises:
            ConfigError: some fields do not; the text names all of them.
        """
        problems = [line for check in _CHECKS for line in check(self).splitlines()]
        if problems:
            raise ConfigError("configuration", *problems)

    def secret(self) -> str:
        """Return the password.

        Raises:
            ConfigError: the password file cannot be read.
        """
        if not self.password_file:
            return self.password
        try:
            return Path(self.password_file).read_text(encoding="utf-8").splitlines()[0].strip()
        except (OSError, IndexError) as error:
            raise ConfigError(
                "configuration",
                f"password_file: cannot be read: got {self.password_file!r} ({error}); expected a "
                "file whose first line is the password.",
            ) from error


def _check_mode(config: Config) -> str:
    if config.mode not in get_args(Mode):
        return f"mode: unknown: got {config.mode!r}; expected one of {sorted(get_args(Mode))}."
    if config.mode == "client" and not config.connect:
        return "connect: empty: got []; expected the router's endpoint, as mode is 'client'."
    if config.mode == "client" and config.listen:
        return (
            f"listen: a client cannot listen: got {list(config.listen)}; expected none. "
            "Try mode 'peer'."
        )
    return ""


def _check_endpoints(config: Config) -> str:
    for name, endpoints in (("connect", config.connect), ("listen", config.listen)):
        for endpoint in endpoints:
            protocol, slash, address = endpoint.partition("/")
            if not (protocol and slash and address):
                return (
                    f"{name}: malformed endpoint: got {endpoint!r}; expected protocol/address, "
                    "tcp/192.168.1.2:7447 for example."
                )
    return ""


def _check_numbers(config: Config) -> str:
    if not 0 <= config.domain <= LAST_DOMAIN:
        return f"domain: out of range: got {config.domain!r}; expected 0 to {LAST_DOMAIN}."
    for name, low in (("lease", 0.1), ("connect_timeout", 0.0), ("settle", 0.0)):
        value = getattr(config, name)
        if not low <= value < math.inf:
            what = "too small" if value < low else "no length of time"
            return f"{name}: {what}: got {value!r}; expected at least {low} [s]."
    return ""


def _check_namespace(config: Config) -> str:
    try:
        clean_namespace(config.namespace)
    except NameSetupError as error:
        return f"namespace: {error}"
    return ""


def _check_tls(config: Config) -> str:
    tls = config.tls
    if bool(tls.certificate) != bool(tls.key):
        missing = "key" if tls.certificate else "certificate"
        return f"tls.{missing}: missing: got ''; expected a file, as the other half is given."
    encrypted = [e for e in (*config.connect, *config.listen) if e.startswith(("tls/", "quic/"))]
    if encrypted and not tls.ca:
        return f"tls.ca: missing: got ''; expected a file, as {encrypted[0]!r} is encrypted."
    return ""


def _check_files(config: Config) -> str:
    files = {f"tls.{name}": getattr(config.tls, name) for name in ("ca", "certificate", "key")}
    files["users_file"] = config.users_file
    files["password_file"] = config.password_file
    missing = {name: path for name, path in files.items() if path and not Path(path).is_file()}
    return "\n".join(
        f"{name}: no such file: got {path!r}; expected a file that exists."
        for name, path in missing.items()
    )


def _check_login(config: Config) -> str:
    if (config.password or config.password_file) and not config.user:
        return "user: missing: got ''; expected a name, as a password is given."
    if config.password and config.password_file:
        return "password_file: given beside password; expected one of them."
    return ""


def _check_access(config: Config) -> str:
    for index, rule in enumerate(config.access):
        where = f"access[{index}]"
        if not rule.names:
            return f"{where}.names: empty: got []; expected at least one name, '**' for all."
        if rule.permission not in {"allow", "deny"}:
            return f"{where}.permission: got {rule.permission!r}; expected 'allow' or 'deny'."
        if rule.users and rule.certificates:
            return f"{where}: for users and for certificates; expected one. Try two rules."
        bad = [n for n in rule.names if n.startswith("/") or n.endswith("/") or "//" in n]
        if bad:
            return f"{where}.names: got {bad[0]!r}; expected a full name without outer slashes."
    return ""


_CHECKS: tuple[Callable[[Config], str], ...] = (
    _check_mode,
    _check_endpoints,
    _check_numbers,
    _check_namespace,
    _check_tls,
    _check_files,
    _check_login,
    _check_access,
)


def load_config(source: Config | str | Path | None = None) -> Config:
    """Return the configuration to use.

    Args:
        source: A ready one, or a file; None takes the file that `SMACHPY_CONFIG` names, and
            without that variable the default.

    Raises:
        ConfigError: the file cannot be read or has errors; the text names all of them with line and
            field.
    """
    if isinstance(source, Config):
        return source
    if source is None:
        source = os.environ.get(ENVIRONMENT_VARIABLE) or None
    if source is None:
        return Config(domain=_domain_of_environment())
    from actionlib_core._config_file import read_config_file

    return read_config_file(Path(source))


def _domain_of_environment() -> int:
    text = os.environ.get(DOMAIN_VARIABLE) or "0"
    if not (text.isascii() and text.isdigit() and len(text) <= MOST_DIGITS):
        raise ConfigError(
            "environment",
            f"{DOMAIN_VARIABLE}: not a number: got {text!r}; expected 0 to {LAST_DOMAIN}.",
        )
    return int(text)
