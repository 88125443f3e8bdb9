"""Configuration of a program's network: by a file, the environment or an argument.

Without a configuration, programs on the same computer find each other, and no other computer has
access. A configuration can add a router to connect to, TLS, user and password, access rules, and
the namespace of a robot.

The file is YAML with the fields of `Config`; `SMACHPY_CONFIG` or an argument has its path. Without
a file, `SMACHPY_DOMAIN` sets the domain. With or without a file, `SMACHPY_ROS2` is the router of a
ROS 2 robot, with `SMACHPY_ROS2_DOMAIN` and `SMACHPY_ROS2_DISTRO`.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from actionlib_core.exceptions import ConfigError, NameSetupError
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.names import clean_namespace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ENVIRONMENT_VARIABLE = "SMACHPY_CONFIG"
DOMAIN_VARIABLE = "SMACHPY_DOMAIN"
ROS2_VARIABLE = "SMACHPY_ROS2"
ROS2_DOMAIN_VARIABLE = "SMACHPY_ROS2_DOMAIN"
ROS2_DISTRO_VARIABLE = "SMACHPY_ROS2_DISTRO"
ALL_NAMES = "**"
LAST_DOMAIN = 9999
LARGEST_SECRET = 10_000
"""Largest file with a password [bytes]."""

MAX_DIGITS = 9  # of a number in the environment or command line
ROUTER_ENDPOINT = "tcp/127.0.0.1:7447"

PROBE_S = 5.0  # interval of the probes of a ROS 2 server with running goals

Mode = Literal["peer", "client", "router"]
Distro = Literal["humble", "jazzy", "kilted", "lyrical", "rolling"]


@dataclass(frozen=True, slots=True)
class Tls:
    """Encryption and certificates, for endpoints that begin with `tls/`.

    Attributes:
        ca: File with the certificates (PEM) that this side trusts.
        certificate: File with this side's own certificate (PEM).
        key: File with its private key (PEM).
        require_client_certificate: Accept only clients with a certificate that `ca` has signed.
        verify_name: Check that the other side's certificate is for the address of the connection.
    """

    ca: str = ""
    certificate: str = ""
    key: str = ""
    require_client_certificate: bool = False
    verify_name: bool = True


@dataclass(frozen=True, slots=True)
class AccessRule:
    """Permission to use names, enforced by the router or peer that has the rule.

    Attributes:
        names: Full names without a leading slash; `*` matches one word, `**` any number.
        users: The users that it applies to; with `certificates` empty too: everybody.
        certificates: Common names of the client certificates that it applies to.
        permission: "allow" or "deny"; if both apply, "deny" wins.
    """

    names: tuple[str, ...]
    users: tuple[str, ...] = ()
    certificates: tuple[str, ...] = ()
    permission: Literal["allow", "deny"] = "allow"


@dataclass(frozen=True, slots=True)
class Mapped:
    """A name here that has another name or type on a ROS 2 network.

    Attributes:
        name: Full name here, without a leading slash.
        action: Its name there, if it is an action; "": the same name, as for the next two.
        topic: The same for a topic.
        service: The same for a service.
        type: Its type there, "nav2_msgs/NavigateToPose"; "": the corresponding type.
        fields: Pairs of corresponding fields, here and there ("": none), where this does not follow
            from names and types; for an action or service with its part in front,
            "goal.target_pose" or "request.data".
    """

    name: str
    action: str = ""
    topic: str = ""
    service: str = ""
    type: str = ""
    fields: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        """Check the fields.

        Raises:
            ConfigError: some are wrong; the text lists all of them.
        """
        given = {word: getattr(self, word) for word in ("action", "topic", "service")}
        named = [word for word, name in given.items() if name]
        problems = [
            f"{word}: got {given[word]!r} beside {named[0]!r}; expected one of the two."
            for word in named[1:]
        ]
        # A name with a slash in front would never be found: full names have none.
        problems += _check_names("name", (self.name,))
        problems += _check_namespaces(self, "name", *named)
        if not (named or self.type or self.fields):
            problems.append("action: missing: got nothing; expected a name or a type.")
        if problems:
            raise ConfigError("map", *problems)

    @property
    def name_there(self) -> str:
        """Its full name there, before the network's namespace."""
        return (self.action or self.topic or self.service or self.name).strip("/")


@dataclass(frozen=True, slots=True)
class Ros2:
    """A network of ROS 2 nodes whose middleware is rmw_zenoh: a robot's, for example.

    Attributes:
        router: Endpoint of its Zenoh router, `tcp/robot.local:7447`; "": its nodes are in the
            network that this program has joined anyway.
        domain: ROS_DOMAIN_ID of its nodes.
        distro: Their release of ROS 2, which determines the definitions of messages.
        namespace: Prefix of names there: `navigate_to_pose` here is `<namespace>/navigate_to_pose`
            there. Names that already begin with it are not changed.
        robot: Prefix of names here, for several robots with the same names: `<robot>/odom` here is
            `odom` there, under `namespace`.
        names: Full names here that are on this network; `*` matches one word, `**` any number.
            Needed with several networks without `robot`, and for types of ROS 1, for which the
            corresponding types of ROS 2 are then used. `**` alone means every name whose type ROS 2
            has, except std_msgs and std_srvs, which programs also use among themselves.
        map: Names here that have another name or type there; they need not be in `names`.
        mode: "client" reaches nodes only through the router, as is necessary from another computer;
            "peer" communicates with them directly and faster, on the robot's own computer.
        probe: Interval in which a server with running goals is probed [s], since ROS 2 may need a
            minute to notice a dead link; 0: never.
    """

    router: str = ""
    domain: int = 0
    distro: Distro = "jazzy"
    namespace: str = ""
    robot: str = ""
    names: tuple[str, ...] = ()
    map: tuple[Mapped, ...] = ()
    mode: Literal["peer", "client"] = "client"
    probe: float = PROBE_S

    def __post_init__(self) -> None:
        """Check the fields.

        Raises:
            ConfigError: some are wrong; the text lists all of them.
        """
        problems = [
            *_check_endpoint("router", self.router),
            *_check_domain(self.domain),
            *_check_choice("distro", self.distro, get_args(Distro)),
            *_check_choice("mode", self.mode, ("client", "peer")),
            *_check_names("names", self.names),
            *_check_namespaces(self, "namespace", "robot"),
        ]
        if not 0 <= self.probe < math.inf:
            problems.append(f"probe: got {self.probe!r}; expected 0 or more [s].")
        if problems:
            raise ConfigError("ros2", *problems)


@dataclass(frozen=True, slots=True)
class Config:
    """How to join the network.

    Attributes:
        mode: "peer" connects to others directly; "client" uses a router; "router" is one.
        connect: Endpoints to connect to, `tcp/192.168.1.2:7447` for example.
        listen: Endpoints to listen at; empty: the loopback address (a client has none).
        discovery: Network interface on which peers find each other: "lo" is this machine only,
            "auto" chooses one, "off" disables discovery.
        domain: 0 to 9999; programs in different domains do not find each other.
        namespace: Prefix of relative names, usually one per robot.
        lease: A link that is silent for this time [s] counts as dead, with all programs behind it.
        connect_timeout: Longest time for reaching `connect` while opening the session [s].
        settle: How long opening waits for discovery [s]; 0: it does not wait.
        timestamping: Messages have the time at which they were sent, as those of ROS 2 nodes do.
        tls: Encryption and certificates.
        user: Name to log in with.
        password: Password to log in with.
        password_file: File whose first line is the password, instead of `password`.
        users_file: File with `user:password` lines: the users that may log in here.
        access: Access rules; without rules, everybody may use all names.
        ros2: Networks of ROS 2 nodes that this program uses as well. `tls`, `user` and the password
            also apply to their routers.
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
    ros2: tuple[Ros2, ...] = ()

    def __post_init__(self) -> None:
        """Check the fields, also against each other.

        Raises:
            ConfigError: some are wrong; the text lists all of them.
        """
        problems = [problem for check in _CHECKS for problem in check(self)]
        problems += _check_namespaces(self, "namespace")
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
            text = read_limited(self.password_file, LARGEST_SECRET).decode("utf-8")
            return text.splitlines()[0].strip()
        except (OSError, IndexError, UnicodeDecodeError) as error:
            raise ConfigError(
                "configuration",
                f"password_file: cannot be read: got {self.password_file!r} ({error}); expected a "
                "file whose first line is the password.",
            ) from error

    def for_ros2(self, network: Ros2) -> Config:
        """Return how to join the network of `network.router`."""
        return replace(
            self,
            mode=network.mode,
            # This session gets no endpoints, discovery or names of our own network.
            connect=(network.router,),
            listen=(),
            discovery="off",
            domain=0,
            namespace="",
            timestamping=True,
            users_file="",
            access=(),
            ros2=(),
        )


def _check_choice(name: str, value: object, choices: tuple[str, ...]) -> list[str]:
    if value in choices:
        return []
    return [f"{name}: unknown: got {value!r}; expected one of {sorted(choices)}."]


def _check_endpoint(name: str, endpoint: str) -> list[str]:
    protocol, slash, address = endpoint.partition("/")
    if not endpoint or (protocol and slash and address):
        return []
    expected = "protocol/address, tcp/192.168.1.2:7447 for example"
    return [f"{name}: malformed endpoint: got {endpoint!r}; expected {expected}."]


def _check_domain(domain: int) -> list[str]:
    if isinstance(domain, int) and 0 <= domain <= LAST_DOMAIN:
        return []
    return [f"domain: out of range: got {domain!r}; expected 0 to {LAST_DOMAIN}."]


def _check_names(where: str, names: tuple[str, ...]) -> list[str]:
    bad = [n for n in names if not n or n.startswith("/") or n.endswith("/") or "//" in n]
    return [f"{where}: got {name!r}; expected a full name without outer slashes." for name in bad]


def _check_namespaces(record: object, *fields: str) -> Iterator[str]:
    for name in fields:
        try:
            clean_namespace(getattr(record, name))
        except NameSetupError as error:
            yield f"{name}: {error}"


def _check_mode(config: Config) -> Iterator[str]:
    yield from _check_choice("mode", config.mode, get_args(Mode))
    if config.mode == "client" and not config.connect:
        yield "connect: empty: got []; expected the router's endpoint, as mode is 'client'."
    if config.mode == "client" and config.listen:
        yield (
            f"listen: a client cannot listen: got {list(config.listen)}; expected none. "
            "Try mode 'peer'."
        )


def _check_endpoints(config: Config) -> Iterator[str]:
    for name, ends in (("connect", config.connect), ("listen", config.listen)):
        for end in ends:
            if end:
                yield from _check_endpoint(name, end)
            else:
                yield f"{name}: got ''; expected an endpoint."


def _check_numbers(config: Config) -> Iterator[str]:
    yield from _check_domain(config.domain)
    for name, low in (("lease", 0.1), ("connect_timeout", 0.0), ("settle", 0.0)):
        value = getattr(config, name)
        if not low <= value < math.inf:
            what = "too small" if value < low else "no length of time"
            yield f"{name}: {what}: got {value!r}; expected at least {low} [s]."


def _check_tls(config: Config) -> Iterator[str]:
    tls = config.tls
    if bool(tls.certificate) != bool(tls.key):
        missing = "key" if tls.certificate else "certificate"
        yield f"tls.{missing}: missing: got ''; expected a file, as the other half is given."
    routers = (network.router for network in config.ros2)
    ends = (*config.connect, *config.listen, *routers)
    encrypted = [end for end in ends if end.startswith(("tls/", "quic/"))]
    if encrypted and not tls.ca:
        yield f"tls.ca: missing: got ''; expected a file, as {encrypted[0]!r} is encrypted."


def _check_files(config: Config) -> Iterator[str]:
    files = {f"tls.{name}": getattr(config.tls, name) for name in ("ca", "certificate", "key")}
    files["users_file"] = config.users_file
    files["password_file"] = config.password_file
    for name, path in files.items():
        if path and not Path(path).is_file():
            yield f"{name}: no such file: got {path!r}; expected a file that exists."


def _check_login(config: Config) -> Iterator[str]:
    if (config.password or config.password_file) and not config.user:
        yield "user: missing: got ''; expected a name, as a password is given."
    if config.password and config.password_file:
        yield "password_file: given beside password; expected one of them."


def _check_access(config: Config) -> Iterator[str]:
    for index, rule in enumerate(config.access):
        where = f"access[{index}]"
        if not rule.names:
            yield f"{where}.names: empty: got []; expected at least one name, '**' for all."
        if rule.permission not in {"allow", "deny"}:
            yield f"{where}.permission: got {rule.permission!r}; expected 'allow' or 'deny'."
        if rule.users and rule.certificates:
            yield f"{where}: for users and for certificates; expected one. Try two rules."
        yield from _check_names(f"{where}.names", rule.names)


def _check_ros2(config: Config) -> Iterator[str]:
    # With several networks, a name must be on one of them at most.
    alike = [network for network in config.ros2 if not (network.robot or network.names)]
    if len(config.ros2) > 1 and len(alike) > 1:
        yield (
            f"ros2: got {len(alike)} networks that do not say which names are theirs; expected one "
            "at most. Try 'robot: robot1' or 'names: [robot1/**]'."
        )
    robots = [robot for network in config.ros2 if (robot := clean_namespace(network.robot))]
    for robot in dict.fromkeys(robots):
        if robots.count(robot) > 1:
            yield f"ros2: robot: got {robot!r} {robots.count(robot)} times; expected it once."


_CHECKS: tuple[Callable[[Config], Iterator[str]], ...] = (
    _check_mode,
    _check_endpoints,
    _check_numbers,
    _check_tls,
    _check_files,
    _check_login,
    _check_access,
    _check_ros2,
)


def load_config(source: Config | str | Path | None = None) -> Config:
    """Return the configuration to use.

    Args:
        source: A configuration, or a file; None: the file in `SMACHPY_CONFIG`, or without that
            variable the default.

    Raises:
        ConfigError: the file cannot be read or has errors; the text lists all of them with line and
            field.
    """
    if isinstance(source, Config):
        return source
    if source is None:
        source = os.environ.get(ENVIRONMENT_VARIABLE) or None
    if source is None:
        config = Config(domain=_number_of_environment(DOMAIN_VARIABLE, LAST_DOMAIN))
    else:
        from actionlib_core.config._file import read_config_file

        config = read_config_file(Path(source))
    return _with_ros2_of_environment(config)


def _with_ros2_of_environment(config: Config) -> Config:
    """Add the ROS 2 network in the environment, or apply it to the only one in the file."""
    router = os.environ.get(ROS2_VARIABLE) or ""
    if not router:
        return config
    if len(config.ros2) > 1:
        raise ConfigError(
            "environment",
            f"{ROS2_VARIABLE}: got {router!r} beside {len(config.ros2)} networks in the file; "
            "expected one at most, of which it replaces the router.",
        )
    values: dict[str, Any] = {"router": router}
    if os.environ.get(ROS2_DOMAIN_VARIABLE):
        values["domain"] = _number_of_environment(ROS2_DOMAIN_VARIABLE, LAST_DOMAIN)
    if distro := os.environ.get(ROS2_DISTRO_VARIABLE):
        values["distro"] = distro.lower()
    try:
        if config.ros2:
            return replace(config, ros2=(replace(config.ros2[0], **values),))
        return replace(config, ros2=(Ros2(names=(ALL_NAMES,), **values),))
    except ConfigError as error:
        raise ConfigError("environment (SMACHPY_ROS2...)", *error.problems) from error


def _number_of_environment(variable: str, last: int) -> int:
    text = os.environ.get(variable) or "0"
    if not (text.isascii() and text.isdigit() and len(text) <= MAX_DIGITS):
        raise ConfigError(
            "environment",
            f"{variable}: not a number: got {text!r}; expected 0 to {last}.",
        )
    return int(text)
