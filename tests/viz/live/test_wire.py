"""What crosses the border between the page's server and its pages has the types of `wire`."""

from __future__ import annotations

import asyncio
import json
import logging
import subprocess
import sys
import urllib.error
import urllib.parse
import urllib.request
from types import SimpleNamespace

import pytest

from actionlib_core.inputs.checked_data import checked
from smachpy.events.reading import read_event, read_observed
from smachpy_viz.live import streams as streams_module
from smachpy_viz.live import wire
from smachpy_viz.live.machines import Machines
from smachpy_viz.live.security import Access
from smachpy_viz.live.streams import Followed, Stream, Streams
from tests.places import ROOT

WEB = ROOT / "viz" / "web"


def test_types_of_the_page_are_those_of_the_server():
    """Try: python viz/web/wire_types.py > viz/web/src/core/wire.ts."""
    made = subprocess.run(
        [sys.executable, str(WEB / "wire_types.py")], capture_output=True, text=True, check=True
    )
    assert made.stdout == (WEB / "src" / "core" / "wire.ts").read_text(encoding="utf-8")


RUN = [
    ("Started", "/JOB"),
    ("Entered", "/JOB/A"),
    ("UserdataWritten", "/JOB/A", {"key": "count", "value": 1}),
    ("GoalSent", "/JOB/A", {"action": "robot/move", "goal_id": "1", "goal": {}}),
    ("Left", "/JOB/A", {"outcome": "ok"}),
    ("Entered", "/JOB/B"),
    ("Failed", "/JOB/B", {"error": "ValueError: no", "trace": ""}),
    ("Finished", "/JOB", {"outcome": "aborted"}),
]
POSE = {"kind": "Observed", "path": "", "stamp_ns": 5, "n": 1, "robot": "", "what": "pose"}


@pytest.fixture
def one_run(served):
    served.add("one", events=RUN, observed=[{**POSE, "at": [1.0, 2.0, 0.0]}])
    served.add("two", events=RUN[:2])
    return served


READ = {
    "GET /api/machines": "",
    "GET /api/model": "?machine=one",
    "GET /api/statistics": "?machine=one",
    "GET /api/why": "?machine=one",
    "GET /api/compare": "?machine=one&with=two",
    "GET /api/runs": "",
    "GET /api/fleet": "",
    "GET /api/open": "?run=machine+one",
    "GET /api/simulations": "",
}


@pytest.mark.parametrize("route", READ)
def test_answer_of_a_route_has_its_type(one_run, route):
    base = one_run.start()
    with urllib.request.urlopen(base + route.split("/", 1)[1] + READ[route], timeout=60) as answer:
        checked(wire.ANSWERS[route], json.load(answer))


# One request of each kind that fails: address, status.
FAILING = [
    ("api/model?machine=none", 404),
    ("api/model", 404),
    ("api/statistics?machine=none", 404),
    ("api/why?machine=none", 404),
    ("api/compare?machine=one&with=none", 404),
    ("api/picture?machine=one&format=exe", 404),
    ("api/export?machine=one&format=exe", 404),
    ("api/value?machine=one&container=/JOB&key=k", 409),
    ("api/question?machine=one&path=/JOB/A", 404),
    ("api/open?run=file+/etc/passwd", 404),
    ("api/report?batch=none", 404),
    ("api/action?name=none", 404),
    ("api/goals?name=none", 404),
    ("api/events?last=x", 400),
    ("api/events?machine=one&last=x", 400),
    ("api/nothing", 404),
    ("js/../app.py", 404),
]


@pytest.mark.parametrize(("address", "status"), FAILING)
def test_error_of_any_route_has_one_form(one_run, address, status):
    base = one_run.start()
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(base + address, timeout=60)
    with caught.value as error:
        assert error.code == status
        assert checked(wire.Failure, json.load(error))["text"]


@pytest.mark.parametrize("place", ["control?machine=one", "action", "simulate", "mission"])
@pytest.mark.parametrize("token", [None, "t"])
def test_refused_command_has_the_form_of_an_error(one_run, place, token):
    base = one_run.start(token=token)
    request = urllib.request.Request(f"{base}api/{place}", b"{}", {"origin": base.rstrip("/")})
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(request, timeout=60)
    with caught.value as error:
        assert error.code == 403
        assert checked(wire.Failure, json.load(error))["wants_token"] == (token is not None)


def test_command_that_a_machine_refuses_is_an_error(one_run):
    def refuse(_name, _command):
        return {"ok": False, "text": "no such state", "paused": False, "breakpoints": []}

    one_run._send = refuse
    base = one_run.start(token="t")
    headers = {"origin": base.rstrip("/"), "x-smachpy-token": "t"}
    request = urllib.request.Request(f"{base}api/control?machine=one", b"{}", headers)
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(request, timeout=60)
    with caught.value as error:
        assert error.code == 409
        assert checked(wire.Failure, json.load(error))["text"] == "no such state"


def test_mistake_in_the_viewer_is_an_error_of_the_same_form(one_run, monkeypatch, caplog):
    base = one_run.start()
    logger = logging.getLogger("uvicorn.error")  # its records do not reach the root logger
    monkeypatch.setattr(logger, "handlers", [caplog.handler])
    monkeypatch.setattr(one_run.machines, "summaries", lambda: 1 / 0)
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(f"{base}api/machines", timeout=60)
    with caught.value as error:
        assert error.code == 500
        assert "ZeroDivisionError" in checked(wire.Failure, json.load(error))["text"]
    one_run.end()  # it is logged after the answer
    assert "ZeroDivisionError: division by zero" in caplog.text  # with its traceback


# -- the stream of events -------------------------------------------------------------------------


def read_messages(machines, names, lasts=(), *, parts=2, actions=None, between=None):
    """The messages (name, data) in the first texts of a stream."""
    followed = [
        Followed(name, epoch, int(seq))
        for name, (epoch, _, seq) in zip(
            names, [one.rpartition(":") for one in (*lasts, *[":0"] * 9)], strict=False
        )
    ]
    settings = {"follow": False, "control": False, "beat": 2.0, "kept": 9, "home": False}
    settings["reproduces"] = False

    async def read():
        stream = Stream(machines, followed, settings, actions)
        texts = []
        async for text in stream.messages():
            texts.append(text)
            if between is not None:
                between(len(texts))
                stream.news.set()
            if len(texts) == parts:
                break
        return texts

    texts = asyncio.run(read())
    found = []
    for block in "".join(texts).split("\n\n"):
        lines = dict(line.split(": ", 1) for line in block.splitlines())
        if "event" in lines:
            found.append((lines["event"], json.loads(lines["data"]), lines.get("id", "")))
    return found


def test_messages_of_a_stream_have_their_types(one_run):
    one_run.machines.get("one").set_stale(5)
    found = read_messages(one_run.machines, ["one", "two"])
    for name, data, _ in found:
        checked(wire.STREAM[name], data)
    assert {name for name, _, _ in found} == {
        *("settings", "machines", "snap", "facts", "observed", "beat")
    }
    snaps = [data for name, data, _ in found if name == "snap"]
    assert [one["name"] for one in snaps] == ["one", "two"]
    for snap in snaps:
        assert [read_event(one) for one in snap["events"]]
    records = next(data["records"] for name, data, _ in found if name == "observed")
    assert [read_observed(one)["at"] for one in records] == [[1.0, 2.0, 0.0]]


def test_stream_goes_on_after_the_events_that_the_browser_has(one_run):
    first = read_messages(one_run.machines, ["one", "two"])
    [ids] = {one for _, _, one in first if one}
    lasts = [urllib.parse.unquote(word) for word in ids.split()]
    assert len(lasts) == 2

    def more(part):
        if part == 1:
            events = one_run.events([("Left", "/JOB/A", {"outcome": "ok"})], after=2)
            one_run.machines.get("two").add(events)

    again = read_messages(one_run.machines, ["one", "two"], lasts, between=more)
    assert "snap" not in {name for name, _, _ in again}
    [news] = [data for name, data, _ in again if name == "events"]
    assert (news["name"], news["seq"]) == ("two", 3)
    assert checked(wire.NewEvents, news)["events"][0]["kind"] == "Left"


def test_stream_without_a_name_follows_the_first_machine(one_run):
    found = read_messages(one_run.machines, [""])
    assert [data["name"] for name, data, _ in found if name == "snap"] == ["one"]


def test_stream_sends_only_the_summaries_that_have_changed(one_run, monkeypatch):
    monkeypatch.setattr(streams_module, "LIST_S", 0.0)

    def change(part):
        if part == 2:
            one_run.machines.get("two").set_stale(7)
            one_run.machines.forget("one")

    found = read_messages(one_run.machines, [], parts=3, between=change)
    lists = [data for name, data, _ in found if name == "machines"]
    assert [[one["name"] for one in data["machines"]] for data in lists] == [
        ["one", "two"],
        ["two"],
    ]
    assert [data["gone"] for data in lists] == [[], ["one"]]


def test_stream_that_is_too_far_behind_gets_a_snapshot_and_the_gap(one_run, monkeypatch):
    monkeypatch.setattr(streams_module, "MAX_LAG_EVENTS", 3)
    machine = one_run.machines.get("one")
    found = read_messages(one_run.machines, ["one"], [f"{machine.epoch}:2"])
    names = [name for name, _, _ in found]
    assert names.index("gap") == names.index("snap") + 1
    gap = next(data for name, data, _ in found if name == "gap")
    assert gap == {"name": "one", "missed": 6}


async def open_streams(streams, number, host="1.2.3.4", cookie=""):
    """Begin streams of one address; returns the statuses."""
    from starlette.requests import Request

    from smachpy_viz.live.answers import RequestError

    scope = {"type": "http", "method": "GET", "query_string": b"", "server": ("x", 80)}
    scope |= {"client": (host, 5), "headers": [(b"cookie", cookie.encode())]}
    statuses = []
    for _ in range(number):
        try:
            response = await streams._begin(Request(scope))
        except RequestError as error:
            statuses.append(error.status)
        else:
            await anext(response._texts)
            statuses.append(200)
    return statuses


def test_streams_of_strangers_leave_room_for_pages_that_have_logged_in():
    access = Access("secret")
    request = SimpleNamespace(
        url=SimpleNamespace(scheme="http"),
        headers={"origin": "http://x", "host": "x"},
        scope={"server": ("x", 80)},
    )
    cookie = access.log_in(request, "secret").partition(";")[0]

    async def attack():
        streams = Streams(Machines(), {}, None, access)
        statuses = await open_streams(streams, 100)
        assert statuses == [200] * streams_module.MAX_STREAMS_PER_ADDRESS + [503] * 52
        others = await open_streams(streams, 100, "5.6.7.8")
        assert (
            others.count(200)
            == streams_module.MAX_STRANGERS - streams_module.MAX_STREAMS_PER_ADDRESS
        )
        assert await open_streams(streams, 1, cookie="smachpy-80=secret") == [503]
        assert await open_streams(streams, 5, cookie=cookie) == [200] * 5

    asyncio.run(attack())


# -- who may read ---------------------------------------------------------------------------------


def log_in(base, token, origin=None):
    body = json.dumps({"token": token}).encode()
    headers = {"origin": base.rstrip("/") if origin is None else origin}
    request = urllib.request.Request(f"{base}api/login", body, headers)
    with urllib.request.urlopen(request, timeout=60) as answer:
        return answer.headers["set-cookie"]


def status(base, address, **headers):
    try:
        with urllib.request.urlopen(
            urllib.request.Request(base + address, headers=headers), timeout=60
        ) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        with error:
            return error.code


@pytest.mark.parametrize("token", ["reader", "commander"])
def test_with_a_read_token_only_pages_that_have_logged_in_read(one_run, token):
    base = one_run.start(token="commander", read_token="reader")
    places = ["api/machines", "api/events", "api/export?machine=one", "api/runs", "api/nothing"]
    assert [status(base, place) for place in places] == [401] * 5
    assert status(base, "") == 200  # the page, which asks for the token
    cookie = log_in(base, token)
    assert {"HttpOnly", "SameSite=Strict"} <= {word.strip() for word in cookie.split(";")}
    assert token not in cookie
    pair = cookie.partition(";")[0]
    assert [status(base, place, cookie=pair) for place in places] == [200] * 4 + [404]
    assert status(base, "api/machines", **{"x-smachpy-token": token}) == 200
    assert status(base, "api/machines", **{"x-smachpy-token": "other"}) == 401
    assert status(base, "api/machines", cookie=f"{pair}0") == 401


@pytest.mark.parametrize("token", ["", "other", "reader ", None, 5, ["reader"]])
def test_wrong_token_does_not_log_in(one_run, token):
    base = one_run.start(read_token="reader")
    with pytest.raises(urllib.error.HTTPError) as caught:
        log_in(base, token)
    with caught.value as error:
        assert error.code == 403
        assert checked(wire.Failure, json.load(error))["wants_token"]


def test_a_long_message_is_sent_in_parts_and_its_id_is_with_the_last(monkeypatch):
    monkeypatch.setattr(streams_module, "SENT_AT_ONCE", 5)
    made = []

    def part(text):
        made.append(text)
        return text

    long = map(part, ["data: ", "1234", ",5678", "\n\n"])
    parts = streams_module._texts(["data: 0\n\n", "id: e:1\n", long])
    assert next(parts) == "data: 0\n\n"
    assert made == []  # what nobody has taken is not made
    assert [*parts] == ["id: e:1\n", "data: ", "1234,5678", "\n\n"]


def test_page_of_another_site_does_not_log_in(one_run):
    base = one_run.start(read_token="reader")
    for origin in ("http://evil.example", "null", ""):
        with pytest.raises(urllib.error.HTTPError) as caught:
            log_in(base, "reader", origin)
        with caught.value as error:
            assert error.code == 403


def test_token_for_reading_does_not_command(one_run):
    base = one_run.start(token="commander", read_token="reader")
    headers = {"origin": base.rstrip("/"), "cookie": log_in(base, "commander").partition(";")[0]}
    for token in ("reader", "", None):
        more = {} if token is None else {"x-smachpy-token": token}
        request = urllib.request.Request(f"{base}api/mission", b"{}", {**headers, **more})
        with pytest.raises(urllib.error.HTTPError) as caught:
            urllib.request.urlopen(request, timeout=60)
        with caught.value as error:
            assert error.code == 403
