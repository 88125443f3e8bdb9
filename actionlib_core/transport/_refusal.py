"""Explanations why a network cannot be joined; Zenoh's own errors contain little or nothing."""

from __future__ import annotations

import ipaddress
import socket
import ssl
from typing import TYPE_CHECKING

from actionlib_core.exceptions import ConfigError

if TYPE_CHECKING:
    from actionlib_core.config import Config, Tls

PROBE_S = 3.0  # longest wait for an answer of the other side, which may be busy


def check_interface(config: Config) -> None:
    """Check that the interface in `discovery` exists; otherwise Zenoh silently finds no peers.

    Raises:
        ConfigError: it does not exist.
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
    """Return an explanation for each endpoint of `connect`, which could not be joined.

    Blocks: about `PROBE_S` per endpoint, for a connection of its own, without Zenoh.
    """
    return "; ".join(f"{point}: {_explain(point, config)}" for point in config.connect)


def _explain(endpoint: str, config: Config) -> str:
    protocol, _, address = endpoint.partition("/")
    if protocol not in {"tcp", "tls"}:
        return "it cannot be reached. Try checking the address and that the router runs."
    context = _tls_context(config.tls) if protocol == "tls" else None
    if isinstance(context, str):
        return context
    host, _, port = address.partition("#")[0].partition("?")[0].rpartition(":")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), PROBE_S) as plain:
            problem = "" if context is None else _explain_tls(plain, host, context, config.tls)
    except ValueError:
        return f"got port {port!r}; expected a number."
    except OSError as error:
        return (
            f"nothing answers there ({error}). Try starting the router with 'actionlib router', "
            "or checking the address."
        )
    return problem or _explain_login(config)


def _tls_context(tls: Tls) -> ssl.SSLContext | str:
    """Return a context with the settings of `tls`, or the error of its files."""
    try:
        context = ssl.create_default_context(cafile=tls.ca)
    except OSError as error:  # the base class of ssl's errors too
        return (
            f"tls.ca {tls.ca!r}: it cannot be used: {_reason(error)}; expected a file of "
            "certificates in PEM form."
        )
    context.check_hostname = tls.verify_name
    # Python 3.13 also refuses certificates that Zenoh accepts, which cannot be the reason here.
    context.verify_flags &= ~ssl.VERIFY_X509_STRICT
    if not tls.certificate:
        return context
    try:
        # Zenoh supports no key with a password. Without this empty one, ssl would ask for the
        # password on the terminal.
        context.load_cert_chain(tls.certificate, tls.key, password="")
    except OSError as error:
        return (
            f"tls.certificate {tls.certificate!r} and tls.key {tls.key!r}: they cannot be used: "
            f"{_reason(error)}; expected a certificate and the key it was made with, both in PEM "
            "form, without a password."
        )
    return context


def _reason(error: OSError) -> str:
    return (isinstance(error, ssl.SSLError) and error.reason) or str(error)


def _explain_tls(plain: socket.socket, host: str, context: ssl.SSLContext, tls: Tls) -> str:
    """Return the error of the certificates, "" without one."""
    is_shaken = False
    try:
        with context.wrap_socket(plain, server_hostname=host) as secure:
            is_shaken = True
            # With TLS 1.3 our handshake succeeds before the other side has checked our certificate;
            # its refusal arrives with the first bytes.
            secure.settimeout(PROBE_S / 2)
            secure.recv(1)
    except TimeoutError:
        if not is_shaken:  # nothing is known of certificates and logins
            return (
                f"it answers, but makes no TLS connection within {PROBE_S:g} s. Try again later, "
                "or checking that this port is one for tls/."
            )
        return ""
    except ssl.SSLCertVerificationError as error:
        return (
            f"its certificate is not trusted: {error.verify_message}; expected one that "
            f"tls.ca {tls.ca!r} signed."
        )
    except ssl.SSLError as error:
        shown = repr(tls.certificate) if tls.certificate else "no certificate"
        return (
            f"it refuses us ({_reason(error)}): got {shown}; expected a client certificate "
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
