"""Missions and viewers in processes of their own, and a browser to look at them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
import urllib.request
from dataclasses import asdict
from pathlib import Path
from unittest.mock import patch

import pytest

from actionlib_core.config import DOMAIN_VARIABLE
from actionlib_core.wire.private_network import _free_domain
from smachpy import CBState, StateMachine
from smachpy.events.introspection import describe
from tests.browser import opened_browser

HERE = Path(__file__).parent
# A busy computer is no failure: a command waits for its answer, a notice stays until the next one.
PATIENT = """
AbortController.prototype.abort = () => {};
Object.defineProperty(window, "smachpy", { configurable: true, set(smachpy) {
    Object.defineProperty(window, "smachpy", { value: smachpy });
    smachpy.store.view.notify = function (text, kind = "info") { this.notice.value = { text, kind }; };
} });
"""
BEAT_S = 60.0  # what the pages of `served` expect
SLOW_ROBOT = """
robot: {max_speed: 0.05}
battery: {capacity: 100}
start: {x: 9.8, y: 7.1, yaw: 1.5708}
dock: {x: 9.8, y: 7.1, yaw: 1.5708}
"""


class Child:
    """A process that ends when its standard input ends."""

    def __init__(self, *command):
        self.process = subprocess.Popen(
            [sys.executable, *command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.said = self.process.stdout.readline().strip()

    @property
    def pid(self):
        return self.process.pid

    def end(self):
        if self.process.stdin.closed:
            return
        self.process.stdin.close()
        try:
            self.process.wait(60.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()

    def tell(self, line):
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.end()


def start_robot(*arguments):
    child = Child(str(HERE / "robot.py"), *map(str, arguments))
    assert child.said == "ready"
    return child


def start_simulation(folder):
    """A robot so slow that no drive ends before the test does."""
    config = folder / "robot.yaml"
    config.write_text(SLOW_ROBOT, encoding="utf-8")
    child = Child("-m", "smachpy", "robot", "--child", "--config", str(config))
    assert "ready" in child.said
    return child


# A busy computer is no failure here either: its robots and missions may answer late.
VIEW = """
import sys
from smachpy.command import main
from smachpy.network import remote_control
from smachpy.states import questions
from smachpy_viz.live import actions, network, server_goals

for module, name in (
    (actions, "SERVER_S"), (network, "ASK_S"), (network, "VALUE_S"), (questions, "CALL_S"),
    (remote_control, "ANSWER_S"), (server_goals, "ASK_S"), (server_goals, "CANCEL_S"),
):
    assert getattr(module, name) < 60.0
    setattr(module, name, 60.0)
sys.exit(main())
"""


class View(Child):
    """`smachpy view`."""

    def __init__(self, *arguments, port=0):
        super().__init__("-c", VIEW, "view", "--child", "--port", str(port), *map(str, arguments))
        self.address = self.said
        self.base, _, self.token = self.address.partition("#token=")
        found = re.search(r":(\d+)/", self.base)
        assert found, self.said
        self.port = int(found[1])

    def get(self, path, **headers):
        request = urllib.request.Request(self.base + path.lstrip("/"), headers=headers)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, dict(answer.headers), answer.read()


class Served:
    """The page of machines that this process makes up: no mission, no network."""

    def __init__(self):
        from smachpy_viz.live.machines import Machines

        self.machines = Machines()
        self.commands = []
        self.beat = BEAT_S
        self._server = self._thread = None
        self.began = time.time_ns()

    def add(self, name, label="JOB", labels="AB", events=(), sm=None, **history):
        """A chain of states, or `sm`; `events` are (kind, path[, facts]) a millisecond apart."""
        if sm is None:
            sm = StateMachine(outcomes=["done"], name=label)
            with sm:
                for one, after in zip(labels, [*labels[1:], "done"], strict=True):
                    StateMachine.add(one, CBState(lambda _: "ok", outcomes=["ok"]), {"ok": after})
        machine = self.machines.obtain(name)
        told = {"epoch": f"{name} {label}", "problems": [], "base": None, "control": None}
        record = asdict(describe(sm))
        machine.reset({**told, **history, "description": record, "events": self.events(events)})
        return machine

    def events(self, events, after=0):
        """Events as a machine sends them; `at` [s] moves one away from its place."""
        made = []
        for seq, (kind, path, *more) in enumerate(events, after + 1):
            facts = dict(*more)
            stamp = self.began + int(facts.pop("at", seq / 1000) * 1e9)
            made.append({"kind": kind, "path": path, "stamp_ns": stamp, "t": 0.0, **facts})
            made[-1]["seq"] = seq
        return made

    def start(self, **viewer):
        from smachpy_viz.live import app
        from smachpy_viz.live.server import PageServer

        with patch.object(app, "BEAT_S", self.beat):
            viewer = app.Viewer(self.machines, send=self._send, **viewer)
        self._server = PageServer(viewer, "127.0.0.1", 0)
        self._thread = threading.Thread(target=self._server.serve_here)
        self._thread.start()
        self.address = self._server.address
        return self.address

    def _send(self, _name, command):
        self.commands.append(command)
        return {"ok": True, "text": "", "paused": False, "breakpoints": []}

    def end(self):
        if self._server is not None:
            self._server.stop()
            self._thread.join()


@pytest.fixture
def served():
    served = Served()
    yield served
    served.end()


@pytest.fixture(scope="session")
def domain():
    """A network of this test session's own, which the child processes inherit."""
    with _free_domain() as own, patch.dict(os.environ, {DOMAIN_VARIABLE: str(own)}):
        yield


@pytest.fixture
def alone(domain):
    """A network of this test's own."""
    with _free_domain() as own, patch.dict(os.environ, {DOMAIN_VARIABLE: str(own)}):
        yield


@pytest.fixture
def start(domain, tmp_path):
    """`start.robot(...)` and `start.view(...)`; what is left is ended after the test."""

    class Start:
        def __init__(self):
            self.children = []

        def robot(self, *arguments):
            self.children.append(start_robot(*arguments))
            return self.children[-1]

        def simulation(self):
            self.children.append(start_simulation(tmp_path))
            return self.children[-1]

        def program(self, code):
            self.children.append(Child("-c", code))
            return self.children[-1]

        def view(self, *arguments, port=0):
            self.children.append(View(*arguments, port=port))
            return self.children[-1]

    start = Start()
    yield start
    for child in reversed(start.children):
        child.end()


@pytest.fixture(scope="module")
def delivery(domain):
    """A delivery that loops for ever and obeys, and a viewer that may command it."""
    robot = start_robot("--name", "delivery", "--rate", 4, "--control")
    view = View("--control")
    yield view
    view.end()
    robot.end()


@pytest.fixture(scope="module")
def errand(domain):
    """A mission that asks its operator again and again and takes no commands, and a viewer."""
    robot = start_robot("--name", "errand", "--rate", 4, "--ask", 300)
    view = View("--control")
    yield view
    view.end()
    robot.end()


@pytest.fixture(scope="module")
def simulation(domain, tmp_path_factory):
    """The simulated robot with its actions."""
    child = start_simulation(tmp_path_factory.mktemp("robot"))
    yield child
    child.end()


@pytest.fixture(scope="module")
def commanding(simulation):
    """A viewer that may command, for tests that send no goals."""
    view = View("--control")
    yield view
    view.end()


@pytest.fixture(scope="module")  # its event loop would be in the way of other modules' tests
def chromium():
    with opened_browser() as browser:
        yield browser


@pytest.fixture
def look(chromium):
    """`look(address)` opens a page and waits until it has drawn; errors in it fail the test."""
    contexts, errors = [], []

    def look(address, *, drawn=True, patient=True, **options):
        options = {"viewport": {"width": 1400, "height": 900}, **options}
        context = chromium.new_context(**options)
        context.set_default_timeout(120_000)
        if patient:
            context.add_init_script(PATIENT)
        contexts.append(context)
        page = context.new_page()
        page.foreign = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on(
            "request",
            lambda r: (
                page.foreign.append(r.url)
                if not r.url.startswith(
                    ("http://127.0.0.1", "http://localhost", "data:", "blob:", "file:")
                )
                else None
            ),
        )
        page.on(
            "console", lambda m: errors.append(m.text) if "Content Security" in m.text else None
        )
        page.goto(address)
        if drawn:
            page.wait_for_selector("html[data-drawn]")
        return page

    yield look
    for context in contexts:
        context.close()
    assert not errors


@pytest.fixture(scope="module")
def first_page(chromium, delivery):
    context = chromium.new_context(viewport={"width": 1400, "height": 900})
    context.set_default_timeout(120_000)
    context.add_init_script(PATIENT)
    page = context.new_page()
    page.foreign = []
    page.errors = []
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.on(
        "request",
        lambda r: (
            None if r.url.startswith(("http://127.0.0.1", "data:")) else page.foreign.append(r.url)
        ),
    )
    page.goto(delivery.base + "?machine=delivery")
    page.wait_for_selector("html[data-drawn]")
    yield page
    context.close()


@pytest.fixture
def shared(first_page):
    """`shared()` is one page of the delivery for all tests, as it was when it was opened."""

    def reset():
        first_page.keyboard.press("Escape")
        first_page.evaluate(
            """async () => { const { page, store } = smachpy; page.layouts.setFollow(false); page.timeline.live();
            page.select(null); store.view.query.value = ""; page.layouts.setDepth(9); await page.layouts.running; }"""
        )
        return first_page

    yield reset
    assert not first_page.errors
