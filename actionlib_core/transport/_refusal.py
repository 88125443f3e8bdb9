"""Why a network cannot be joined, in words: zenoh itself says little, or nothing."""

from __future__ import annotations

import ipaddress
import socket
import ssl
from typing import TYPE_CHECKING

from actionlib_core.exceptions import ConfigError

if TYPE_CHECKING:
    from actionlib_core.config import Config, Tls

PROBE_S = 1.0  # longest wait for an answer of the other side


def check_interface(config: Config) -> None:
    """Check that the interface of `discovery` is there; zenoh would find nobody, in silence.

    Raises:
        ConfigError: it is not.
    """
    names = [name for _, name in socket.if_nameindex()]
    if config.discovery in {*names, "auto", "off"}:
        return
    try:
        ipaddress.ip_address(config.discovery)
    except ValueError:
        raise ConfigError(
            "configuration",
            f"discovery: no such network interface: got {config.discovery!r}; expected one of "
            f"{sorted(names)}, its address, 'auto' or 'off'.",
        ) from None


def explain_refusal(config: Config) -> str:
    """Return what is known about each endpoint of `connect` that could not be joined.

    Blocks: about `PROBE_S` per endpoint; it is tried once more, without zenoh.
    """
    return "; ".join(f"{point}: {_explain(point, config)}" for point in config.connect)


def _explain(endpoint: str, config: Config) -> str:
    protocol, _, address = endpoint.partition("/")
    if protocol not in {"tcp", "tls"}:
        return "it cannot be reached. Try checking the address and that the router runs."
    host, _, port = address.partition("#")[0].partition("?")[0].rpartition(":")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), PROBE_S) as plain:
            problem = _explain_tls(plain, host, config.tls) if protocol == "tls" else ""
    except ValueError:
        return f"got port {port!r}; expected a number."
    except OSError as error:
        return (
            f"nothing answers there ({error}). Try starting the router with 'actionlib router', "
            "or checking the address."
        )
    return problem or _explain_login(config)


def _explain_tls(plain: socket.socket, host: str, tls: Tls) -> str:
    """Return what is wrong with the certificates, "" when nothing is."""
    context = ssl.create_default_context(cafile=tls.ca)
    context.check_hostname = tls.verify_name
    if tls.certificate:
        context.load_cert_chain(tls.certificate, tls.key)
    try:
        with context.wrap_socket(plain, server_hostname=host) as secure:
            # A refusal of our certificate comes after the handshake, with the first bytes.
            secure.settimeout(PROBE_S / 2)
            secure.recv(1)
    except TimeoutError:
        return ""
    except ssl.SSLCertVerificationError as error:
        return (
            f"its certificate is not trusted: {error.verify_message}; expected one that "
            f"tls.ca {tls.ca!r} signed."
        )
    except ssl.SSLError as error:
        shown = repr(tls.certificate) if tls.certificate else "no certificate"
        return (
            f"it refuses us: {error.reason or error}: got {shown}; expected a client certificate "
            "that it knows. Try tls.certificate and tls.key signed by its certificate authority."
        )
    except OSError:
        return ""
    return ""


def _explain_login(config: Config) -> str:
    shown = f"user {config.user!r} with this password" if config.user else "no user"
    return (
        f"it answers but does not let us in: got {shown}; expected a user and password that it "
        "knows. Try user and password_file in the configuration."
    )
