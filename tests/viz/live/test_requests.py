"""What the page's server answers to requests that no page makes."""

from __future__ import annotations

import base64
import gzip
import io
import ipaddress
import json
import re
import socket
import threading
import urllib.error
import urllib.parse
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
import segno

from smachpy import CBState, StateMachine
from smachpy.command import main
from smachpy.events.recording import Recorder, notes_file, read_recording
from smachpy_viz.live import server as server_module
from smachpy_viz.live.app import Viewer
from smachpy_viz.live.cli import print_qr
from smachpy_viz.live.machines import Machines
from smachpy_viz.live.server import EVERYWHERE, AddressError, PageServer, outward_address
from smachpy_viz.runs import html
from smachpy_viz.runs.notes import read_notes


@pytest.mark.parametrize("last", ["x:²", "x:٣", "x:-1", "x", "x:", f"x:{'9' * 5000}", "x:1.0"])
def test_the_id_of_no_event_is_refused(served, last):
    served.add("one")
    address = served.start() + f"api/events?last={urllib.parse.quote(last)}"
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(address, timeout=60)
    with caught.value:
        assert caught.value.code == 400


@pytest.mark.parametrize("last", ["", "x:0", "an epoch: of any kind:12"])
def test_the_id_of_an_event_is_taken(served, last):
    served.add("one")
    address = served.start() + f"api/events?last={urllib.parse.quote(last)}"
    with urllib.request.urlopen(address, timeout=60) as answer:
        assert answer.status == 200


PLACES = [
    "api/control?machine=one",
    "api/action",
    "api/simulate",
    "api/mission",
    "api/notes?machine=one",
]


def commanded(served, body):
    """A command of the page with this body, to each place in turn, as (place, request)."""
    served.add("one")
    actions, simulations = SimpleNamespace(listen=lambda _: None, revision=0), SimpleNamespace()
    base = served.start(token="t", actions=actions, simulations=simulations)
    headers = {"origin": base.rstrip("/"), "x-smachpy-token": "t"}
    return [urllib.request.Request(base + place, body, headers) for place in PLACES]


@pytest.mark.parametrize("body", [b"[" * 100_000, b'{"command":' * 50_000, b"\xff", b"[1]", b""])
def test_a_body_that_is_no_command_is_refused(served, body):
    for request in commanded(served, body):
        with pytest.raises(urllib.error.HTTPError) as caught:
            urllib.request.urlopen(request, timeout=60)
        with caught.value:
            assert caught.value.code == 400


def test_a_page_that_goes_while_it_sends_a_command_leaves_no_traceback(served, capfd):
    for request in commanded(served, b"{}"):
        head = "".join(f"{name}: {value}\r\n" for name, value in request.header_items())
        first = f"POST {request.selector} HTTP/1.1\r\nhost: {request.host}\r\n{head}"
        with socket.create_connection(request.host.split(":"), 60) as link:
            link.sendall(f"{first}content-length: 50\r\n\r\n{{".encode())
            link.shutdown(socket.SHUT_WR)
            link.settimeout(60)
            while link.recv(1000):
                pass
    served.end()
    assert "Traceback" not in capfd.readouterr().err


HEAD = b"POST /api/mission HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\n"
WITH_TOKEN = HEAD + b"x-smachpy-token: t\r\nContent-Length: 50\r\n\r\n"


def ends(link, seconds=60.0):
    """Whether the server closes a connection."""
    link.settimeout(seconds)
    try:
        while link.recv(1000):
            pass
    except ConnectionResetError:
        pass
    except TimeoutError:
        return False
    return True


@pytest.mark.parametrize("sent", [b"", b"GET", HEAD, WITH_TOKEN, WITH_TOKEN + b'{"a'])
def test_request_that_does_not_end_is_given_up(served, monkeypatch, sent):
    monkeypatch.setattr(server_module, "REQUEST_S", 0.2)
    base = urllib.parse.urlsplit(served.start(token="t"))
    with socket.create_connection((base.hostname, base.port), 60) as link:
        link.sendall(sent)
        assert ends(link)


def test_request_that_arrives_byte_by_byte_has_no_more_time(served, monkeypatch):
    monkeypatch.setattr(server_module, "REQUEST_S", 0.2)
    base = urllib.parse.urlsplit(served.start(token="t"))
    with socket.create_connection((base.hostname, base.port), 60) as link:
        for byte in b"GET / HTTP/1.1\r\nx: " + b"y" * 10_000:
            try:
                link.sendall(bytes([byte]))
            except OSError:
                return
            if ends(link, 0.01):
                return
    pytest.fail("it had all the time")


def test_stream_of_events_outlasts_the_time_for_a_request(served):
    served.add("one")
    with urllib.request.urlopen(f"{served.start()}api/events", timeout=60) as stream:
        assert stream.readline()
        [connection] = served._server.server_state.connections
        assert connection._deadline is None


def test_connections_above_the_limit_are_closed(served, monkeypatch):
    monkeypatch.setattr(server_module, "MAX_CONNECTIONS", 3)
    base = urllib.parse.urlsplit(served.start())
    links = [socket.create_connection((base.hostname, base.port), 60) for _ in range(3)]
    try:
        with socket.create_connection((base.hostname, base.port), 60) as link:
            assert ends(link)
    finally:
        for link in links:
            link.close()


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_server_that_listens_everywhere_names_an_address_of_this_computer(host):
    family = EVERYWHERE[host][0]
    address = outward_address(host)
    assert ipaddress.ip_address(address)
    assert not ipaddress.ip_address(address).is_unspecified
    try:
        socket.socket(family).close()
    except OSError:
        pytest.skip("this computer has no such addresses")
    with socket.create_server((address, 0), family=family):
        pass  # it is one of this computer's


def test_an_address_of_version_six_stands_in_brackets():
    try:
        server = PageServer(Viewer(Machines()), "::1", 0)
    except AddressError:
        pytest.skip("this computer has no such addresses")
    assert server.address == f"http://[::1]:{server.port}/"
    server._socket.close()


@pytest.mark.parametrize("host", ["0.0.0.0", "0", "::", "0::0"])
def test_a_server_that_listens_everywhere_prints_an_address_that_others_can_open(host):
    try:
        server = PageServer(Viewer(Machines()), host, 0)
    except AddressError:
        pytest.skip("this computer has no such addresses")
    shown = urllib.parse.urlsplit(server.address).hostname
    assert shown is not None
    assert not ipaddress.ip_address(shown).is_unspecified
    server._socket.close()


@pytest.mark.parametrize("host", ["", "192.0.2.1", "half\ud800", "a" * 100])
def test_a_host_that_is_no_address_of_this_computer_is_named(host):
    """The empty one means all addresses to the system, as an unset variable must not."""
    with pytest.raises(AddressError, match="expected an address of this computer"):
        PageServer(Viewer(Machines()), host, 0)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_a_qr_code_of_an_address_that_a_phone_cannot_open_is_refused(host, capsys):
    assert main(["view", "--qr", "--host", host, "--port", "0"]) == 2
    assert "Try --host 0.0.0.0" in capsys.readouterr().err


def test_the_qr_code_has_the_address(capsys):
    address = "http://192.0.2.7:8080/#token=abc"
    print_qr(address)
    printed = capsys.readouterr().out
    again = io.StringIO()
    segno.make(address, error="l", micro=False).terminal(again, compact=True)
    assert printed == again.getvalue()
    assert len(printed.splitlines()) > 10
    assert "\u2580" in printed


@pytest.mark.parametrize("form", ["html", "jsonl"])
def test_the_server_answers_while_a_run_is_exported(served, monkeypatch, form):
    began, go_on = threading.Event(), threading.Event()
    machine = served.add("one", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])

    def held(real):
        def made(*arguments):
            began.set()
            assert go_on.wait(60), "nothing else was answered meanwhile"
            return real(*arguments)

        return made

    monkeypatch.setattr(html, "why", held(html.why))
    monkeypatch.setattr(machine, "history", held(machine.history))
    address = served.start()

    def get(path):
        with urllib.request.urlopen(address + path, timeout=60) as answer:
            return answer.read()

    with ThreadPoolExecutor(1) as pool:
        export = pool.submit(get, f"api/export?machine=one&format={form}")
        try:
            assert began.wait(60)
            assert b'"one"' in get("api/machines")
            assert not export.done()
        finally:
            go_on.set()
        assert export.result()


def asked(address, body=None, **headers):
    """(status, JSON) of a request."""
    data = None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    request = urllib.request.Request(address, data, headers)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        with error:
            return error.code, json.load(error)


def recorded_job(path):
    """A recording of a short run."""
    machine = StateMachine(["done"], name="JOB")
    machine.add("A", CBState(lambda _: "done", outcomes=["done"]))
    with Recorder(path, machine):
        machine.execute()
    return path


NOTE = {"stamp_ns": 5_000_000_000, "text": "here"}


def test_notes_are_written_beside_the_recording_with_the_token_only(served, tmp_path):
    file = recorded_job(tmp_path / "run.jsonl")
    served.machines.obtain("one").load(read_recording(file))
    base = served.start(token="t")
    place, own = f"{base}api/notes?machine=one", {"origin": base.rstrip("/")}
    known = {**own, "x-smachpy-token": "t"}
    add = {"command": "add", "note": NOTE}
    for headers in (own, {"x-smachpy-token": "t"}, {**own, "x-smachpy-token": "u"}):
        assert asked(place, add, **headers)[0] == 403
    assert asked(place) == (200, [])
    assert asked(place, add, **known) == (200, {"ok": True, "text": ""})
    assert asked(place, {"command": "add", "note": {**NOTE, "by": "Ada"}}, **known)[0] == 200
    assert asked(place)[1] == [{**NOTE, "by": "Ada"}]
    assert [one["text"] for one in read_notes(file)] == ["here"]
    assert served.machines.get("one").facts()["noted"] == 2
    with urllib.request.urlopen(f"{base}api/export?machine=one", timeout=60) as answer:
        [data] = re.findall(r'id="run-data">([^<]*)<', answer.read().decode())
        assert json.loads(gzip.decompress(base64.b64decode(data)))["notes"] == asked(place)[1]
    assert asked(place, {"command": "remove", "note": NOTE}, **known)[0] == 200
    assert not notes_file(file).exists()
    assert asked(f"{base}api/notes?machine=two", add, **known)[0] == 404


@pytest.mark.parametrize(
    ("command", "status"),
    [
        ({"command": "add"}, 400),
        ({"command": "clear", "note": NOTE}, 400),
        ({"command": "add", "note": "here"}, 400),
        ({"command": "add", "note": {**NOTE, "text": " "}}, 400),
        ({"command": "add", "note": {**NOTE, "stamp_ns": -1}}, 400),
        ({"command": "add", "note": {**NOTE, "file": "/etc/passwd"}}, 400),
    ],
)
def test_what_is_no_note_is_refused(served, command, status):
    served.add("one")
    base = served.start(token="t")
    headers = {"origin": base.rstrip("/"), "x-smachpy-token": "t"}
    found = asked(f"{base}api/notes?machine=one", command, **headers)
    assert found[0] == status
    assert "expected" in found[1]["text"]
    assert asked(f"{base}api/notes?machine=one") == (200, [])


def test_notes_on_a_run_without_a_recording_end_with_it(served):
    machine = served.add("one", events=[("Started", "/JOB")])
    base = served.start(token="t")
    place, headers = f"{base}api/notes?machine=one", {"origin": base.rstrip("/")}
    for number in range(101):
        note = {"stamp_ns": number * 1_000_000, "text": "x"}
        add = {"command": "add", "note": note}
        status, answer = asked(place, add, **headers, **{"x-smachpy-token": "t"})
        assert status == (200 if number < 100 else 409), answer
    assert len(asked(place)[1]) == 100
    served.add("one", label="NEXT", events=[("Started", "/NEXT")])
    assert asked(place)[1] == []
    earlier = urllib.parse.quote(machine.before)
    assert len(asked(f"{base}api/notes?machine={earlier}")[1]) == 100


def test_notes_that_cannot_be_read_or_written_are_told(served, tmp_path):
    file = recorded_job(tmp_path / "run.jsonl")
    notes_file(file).write_text("damaged")
    served.machines.obtain("one").load(read_recording(file))
    base = served.start(token="t")
    headers = {"origin": base.rstrip("/"), "x-smachpy-token": "t"}
    for body in (None, {"command": "add", "note": NOTE}):
        status, answer = asked(f"{base}api/notes?machine=one", body, **headers)
        assert status == 409
        assert "run.notes.json" in answer["text"]
    assert notes_file(file).read_text() == "damaged"
