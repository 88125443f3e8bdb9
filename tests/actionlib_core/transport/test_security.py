"""Logins and access rules, enforced by a router; certificates at work are in docs/howto/certificates.md."""

from __future__ import annotations

import datetime as dt
import socket
import ssl
import threading

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from actionlib_core.clock import RealClock
from actionlib_core.config import AccessRule, Config, Tls
from actionlib_core.exceptions import AccessDeniedError, TransportError
from actionlib_core.transport import Quality, _refusal
from actionlib_core.transport._access import ACCESS_KEY, Permissions
from actionlib_core.transport._refusal import explain_refusal
from actionlib_core.transport.zenoh import ZenohTransport
from tests.free_port import free_port

pytestmark = pytest.mark.zenoh

CLOCK = RealClock()
WAIT_S = 60.0
RULES = (
    AccessRule(("robot_1/**",), users=("alice",)),
    AccessRule(("robot_1/secret",), users=("alice",), permission="deny"),
    AccessRule(("robot_2/**",), users=("bob",)),
    AccessRule(("public/**",)),
)


@pytest.fixture(scope="module")
def endpoint(tmp_path_factory):
    users = tmp_path_factory.mktemp("users") / "users.txt"
    users.write_text("alice:secret\nbob:hunter2\n")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = ZenohTransport(
        Config(
            mode="router", listen=(endpoint,), discovery="off", users_file=str(users), access=RULES
        )
    )
    yield endpoint
    router.close()


@pytest.fixture
def join(endpoint):
    joined = []

    def join(user="", password="", **fields):
        login = {"user": user, "password": password, "connect_timeout": WAIT_S}
        config = Config(mode="client", connect=(endpoint,), discovery="off", **{**login, **fields})
        transport = ZenohTransport(config)
        joined.append(transport)
        return transport

    yield join
    for transport in joined:
        transport.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("user", "password", "shown"),
    [
        ("alice", "wrong", "user 'alice' with this password"),
        ("mallory", "secret", "user 'mallory' with this password"),
        ("", "", "no user"),
    ],
)
def test_wrong_login_is_refused_and_told(join, user, password, shown):
    with pytest.raises(TransportError) as caught:
        join(user, password, connect_timeout=1.0)
    text = str(caught.value)
    assert f"it answers but does not let us in: got {shown}; expected a user" in text
    assert not password or password not in text


def test_allowed_names_work(join):
    first, second = join("alice", "secret"), join("alice", "secret")
    heard, changed = [], CLOCK.event()

    def on_sample(sample):
        heard.append(sample.payload)
        changed.set()

    first.publisher("robot_1/map", "", Quality(latch=True)).put(b"x")
    first.declare_alive("@smachpy/service/s/1/n/t/m/robot_1/grip")
    second.subscribe("robot_1/map", on_sample)
    assert changed.wait(WAIT_S)
    assert heard == [b"x"]
    assert second.list_alive("@smachpy/*/*/*/*/*/*/**", WAIT_S) == [
        "@smachpy/service/s/1/n/t/m/robot_1/grip"
    ]


def test_what_a_stranger_says_of_rules_does_not_count():
    """Where the router has none, anybody could refuse all names to all programs."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    client = Config(mode="client", connect=(endpoint,), discovery="off", connect_timeout=WAIT_S)

    def answer(query):
        query.reply(Permissions("anybody", (), ("**",)).encode())
        query.finish()

    router = ZenohTransport(Config(mode="router", listen=(endpoint,), discovery="off"))
    mallory = ZenohTransport(client)
    mallory.queryable(ACCESS_KEY, answer)
    alice = ZenohTransport(client)
    try:
        alice.publisher("robot_1/map")
    finally:
        for transport in (alice, mallory, router):
            transport.close()


@pytest.mark.parametrize(
    "question", [b"", b"junk", b"[]", b'{"session": "s"}', b'{"session": [], "user": {}}']
)
def test_a_question_about_the_rules_that_is_none_is_answered_with_an_error(
    join, question, monkeypatch
):
    raised, answers, done = [], [], CLOCK.event()
    monkeypatch.setattr(threading, "excepthook", raised.append)
    asker = join("bob", "hunter2")
    asker._permissions = None
    asker.query(ACCESS_KEY, question, timeout=WAIT_S, on_reply=answers.append, on_done=done.set)
    assert done.wait(WAIT_S)
    assert [reply.error for reply in answers] == [True]
    assert answers[0].payload.startswith(b"access rules: ")
    assert raised == []


@pytest.mark.parametrize("key", ["robot_2/goal", "robot_1/secret", "other"])
def test_forbidden_names_are_refused_and_told(join, key):
    alice = join("alice", "secret")
    calls = (
        lambda: alice.publisher(key),
        lambda: alice.subscribe(key, print),
        lambda: alice.queryable(key, print),
        lambda: alice.query(key, b"", timeout=1.0, on_reply=print, on_done=print),
        lambda: alice.declare_alive(f"@smachpy/service/s/1/n/t/m/{key}"),
    )
    for call in calls:
        with pytest.raises(AccessDeniedError, match="access denied: got user 'alice'") as caught:
            call()
        assert caught.value.allowed == ("robot_1/**", "public/**")


def test_who_does_not_ask_is_stopped_all_the_same(join):
    alice, bob = join("alice", "secret"), join("bob", "hunter2")
    bob._permissions = None
    heard, seen, end, saw = [], [], CLOCK.event(), CLOCK.event()

    def on_sample(sample):
        heard.append(sample.payload)
        if sample.payload == b"end":
            end.set()

    def on_token(presence):
        seen.append(presence)
        saw.set()

    alice.subscribe("robot_1/cmd", on_sample)
    alice.subscribe("public/end", on_sample)
    alice.declare_alive("@smachpy/service/s/1/n/t/m/robot_1/grip")
    bob.watch_alive("@smachpy/*/*/*/*/*/*/**", on_token)
    commands, ends = bob.publisher("robot_1/cmd"), bob.publisher("public/end")
    # What is sent before bob's session has heard of the subscriber goes nowhere.
    for _ in range(int(WAIT_S / 0.02)):
        commands.put(b"drive!")
        ends.put(b"end")
        if end.wait(0.02):
            break
    assert set(heard) == {b"end"}
    bob.declare_alive("@smachpy/service/s/1/n/t/m/public/bob")
    assert saw.wait(WAIT_S)
    assert bob.list_alive("@smachpy/*/*/*/*/*/*/robot_1/**", WAIT_S) == []
    assert [p.key.rpartition("/m/")[2] for p in seen] == ["public/bob"]


# -- certificates that cannot be used ------------------------------------------------------------


def write_certificate(folder, name, password=b"", issuer=None):
    """Write `name`.pem and its key `name`.key, which needs `password`; return name and key.

    The certificate has no extension that tells whose key signed it, which zenoh does not mind.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    issuer_name, issuer_key = issuer or (subject, key)
    now = dt.datetime.now(dt.UTC)
    certificate = (
        x509.CertificateBuilder(issuer_name, subject, key.public_key(), x509.random_serial_number())
        .not_valid_before(now - dt.timedelta(minutes=5))
        .not_valid_after(now + dt.timedelta(days=1))
        .add_extension(x509.BasicConstraints(ca=issuer is None, path_length=None), critical=True)
        .sign(issuer_key, hashes.SHA256())
    )
    (folder / f"{name}.pem").write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    locked = serialization.BestAvailableEncryption(password) if password else None
    (folder / f"{name}.key").write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            locked or serialization.NoEncryption(),
        )
    )
    return subject, key


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    folder = tmp_path_factory.mktemp("certificates")
    ca = write_certificate(folder, "ca")
    write_certificate(folder, "robot", issuer=ca)
    write_certificate(folder, "locked", b"secret")
    (folder / "text.pem").write_text("no certificate\n")
    (folder / "empty.pem").write_text("")
    return folder


CA = "tls.ca {ca!r}: "
PAIR = "tls.certificate {certificate!r} and tls.key {key!r}: "


@pytest.mark.parametrize(
    ("ca", "certificate", "key", "told"),
    [
        ("ca", "robot.pem", "ca.key", PAIR),
        ("ca", "robot.pem", "locked.key", PAIR),
        ("ca", "locked.pem", "locked.key", PAIR),
        ("ca", "text.pem", "robot.key", PAIR),
        ("text", "", "", CA),
        ("empty", "robot.pem", "robot.key", CA),
    ],
    ids=["another key", "another locked key", "locked key", "no certificate", "no ca", "empty ca"],
)
def test_certificates_that_cannot_be_used_are_told(
    endpoint, certificates, ca, certificate, key, told
):
    ca = str(certificates / f"{ca}.pem")
    certificate, key = (str(certificates / name) if name else "" for name in (certificate, key))
    address = endpoint.replace("tcp/", "tls/")
    config = Config(
        mode="client",
        connect=(address,),
        discovery="off",
        tls=Tls(ca=ca, certificate=certificate, key=key),
        connect_timeout=0.2,
    )
    with pytest.raises(TransportError) as caught:
        ZenohTransport(config)
    text = str(caught.value)
    assert f"{address}: {told.format(ca=ca, certificate=certificate, key=key)}" in text
    assert "expected a" in text
    assert "nothing answers" not in text
    assert explain_refusal(config) in text


def test_a_certificate_that_zenoh_takes_is_not_told_to_be_wrong(certificates, monkeypatch):
    """Python 3.13 asks more of a certificate than zenoh: here it is asked on every Python."""

    def strict(*args, make=ssl.create_default_context, **kwargs):
        context = make(*args, **kwargs)
        context.verify_flags |= ssl.VERIFY_X509_STRICT
        return context

    monkeypatch.setattr(ssl, "create_default_context", strict)
    monkeypatch.setattr(_refusal, "PROBE_S", WAIT_S)
    files = [certificates / "robot.pem", certificates / "robot.key"]
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*files)

    def serve():
        plain, _ = listener.accept()
        with plain, context.wrap_socket(plain, server_side=True):
            pass  # it ends the connection without a word

    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(WAIT_S)
        server = CLOCK.spawn(serve, name="server")
        config = Config(
            mode="client",
            connect=(f"tls/127.0.0.1:{listener.getsockname()[1]}",),
            discovery="off",
            tls=Tls(ca=str(certificates / "ca.pem"), verify_name=False),
        )
        text = explain_refusal(config)
        assert server.join(WAIT_S)
    assert "does not let us in: got no user" in text
    assert "not trusted" not in text


def test_a_handshake_that_takes_too_long_is_told_as_that(certificates, monkeypatch):
    """On a busy computer it was told that the other side lets no user in."""
    monkeypatch.setattr(_refusal, "PROBE_S", 0.01)
    with socket.create_server(("127.0.0.1", 0)) as listener:  # it accepts, and says nothing
        config = Config(
            mode="client",
            connect=(f"tls/127.0.0.1:{listener.getsockname()[1]}",),
            discovery="off",
            tls=Tls(ca=str(certificates / "ca.pem"), verify_name=False),
        )
        text = explain_refusal(config)
    assert "it answers, but makes no TLS connection within 0.01 s. Try again" in text
    assert "let us in" not in text
