"""The viewer's HTTP interface: the page, the machines, their events and commands.

    GET  /                    the page
    GET  /api/events          everything about one machine as server-sent events: settings, snap,
                              gap, facts, machines, actions, observed (records of robot topics),
                              beat (the server's time [ms]), and unnamed batches of events
    GET  /api/machines        the machines
    GET  /api/model           structure of a machine
    GET  /api/picture         svg, png, pdf or dot, with `theme` and the `active` paths
    GET  /api/export          the run as .html or .jsonl
    GET  /api/statistics      statistics of recorded runs
    GET  /api/runs            live and past runs, for the home page
    GET  /api/fleet           the live runs, with the data for a common map
    GET  /api/open            the name of the machine that shows a run
    GET  /api/why             the causes of the end of a machine's newest run
    GET  /api/compare         a machine and another one in one drawing
    GET  /api/value           the present value of a userdata key, unabridged
    GET  /api/question        the picture of a question
    GET  /api/action          the data for a goal's form
    GET  /api/simulations     the missions that may be simulated, and the batches
    GET  /api/report          the report of a batch, a page
    POST /api/control         a command, or the answer to a question
    POST /api/action          check, send or cancel a goal
    POST /api/simulate        start or stop a batch
    POST /api/mission         resume or cancel a durable mission

A slow page never delays a machine: each page gets the events that it has not seen when it can take
them, and a page that is too far behind gets a snapshot instead.
"""

from __future__ import annotations

# Handlers run in the event loop. What can block (files, the network, drawing, long runs) goes to a
# thread by `run_in_threadpool`, so that other pages are served meanwhile.
import asyncio
import contextlib
import json
import math
import re
import time
from typing import TYPE_CHECKING, Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from smachpy.exceptions import SmachError
from viz.live import assets
from viz.live.actions import GoalRefusedError
from viz.live.machines import KEPT_EVENTS
from viz.live.runs import Runs
from viz.live.security import WRONG_TOKEN, Guard, refuse_command

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from starlette.requests import Request

    from smachpy.introspection import StateRecord
    from viz.live.actions import Actions
    from viz.live.machines import Machine, Machines
    from viz.live.simulations import Simulations

COALESCE_S = 0.004
"""Time to wait for further events before a message, besides that of the link [s]."""

LIST_S = 0.5
"""Shortest time between two lists of machines [s]."""

ACTIONS_S = 0.15
"""Shortest time between two messages about goals sent from here [s]."""

OBSERVED_S = 0.1
"""Shortest time between two messages about the robot [s]."""

BEAT_S = 2.0
"""Longest time between two beats; without them the page considers the server lost [s]."""

FARTHEST = 3_000
"""A page that is more events behind than this gets a snapshot."""

MOST_PAGES = 64
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'none'; sandbox"
)
"""Content security policy of a report, a page without scripts."""

LONGEST_COMMAND = 1_000_000
"""Longest command [bytes]."""

_LAST_EVENT = re.compile(r"(.*:[0-9]{1,18})?", re.DOTALL)

PICTURES = {
    "svg": "image/svg+xml",
    "png": "image/png",
    "pdf": "application/pdf",
    "dot": "text/vnd.graphviz",
    "mmd": "text/plain",
    "txt": "text/plain",
}


class Json(JSONResponse):
    """JSON in ASCII: names may contain lone UTF-16 surrogates, which UTF-8 cannot encode."""

    def render(self, content: Any) -> bytes:
        """Return the content as JSON."""
        return json.dumps(content, separators=(",", ":")).encode("ascii")


class Viewer:
    """The server side of the page.

    Args:
        machines: The machines to show.
        token: The token that commands must carry; None refuses all commands.
        send: Sends a command to a machine and returns the answer; blocks.
        follow: Whether pages follow the active states from the start.
        statistics: Returns the statistics of a machine's recorded runs; blocks.
        hosts: Host names of the server, besides addresses.
        actions: The actions on the network; None for none.
        runs: The runs for the home page; by default those of `machines`.
        home: Whether pages begin with the list of runs, unless they name a machine.
        simulations: The batches of simulated runs; None for none.
        value: Reads the value of a userdata key, by machine, container and key; blocks.
        picture: Reads the picture of a question, by machine and path; returns media type and bytes,
            or None; blocks.
    """

    def __init__(
        self,
        machines: Machines,
        *,
        token: str | None = None,
        send: Callable[[str, dict[str, Any]], dict[str, Any]] | None = None,
        follow: bool = False,
        statistics: Callable[[StateRecord], dict[str, Any] | None] = lambda _record: None,
        hosts: tuple[str, ...] = (),
        actions: Actions | None = None,
        value: Callable[[str, str, str], str] | None = None,
        picture: Callable[[str, str], tuple[str, bytes] | None] | None = None,
        runs: Runs | None = None,
        home: bool = False,
        simulations: Simulations | None = None,
    ) -> None:
        self._picture_of = picture
        self._machines = machines
        self._value = value
        self._listed = Runs(machines) if runs is None else runs
        self._home = home
        self._simulations = simulations
        self._actions = actions
        self._token = token
        self._send = send
        self._follow = follow
        self._statistics = statistics
        self._pages: set[_Page] = set()
        self._drawing = asyncio.Semaphore(1)  # one `dot` at a time, whatever pages ask for
        self._loop: asyncio.AbstractEventLoop | None = None  # while the server runs
        self._woken = False  # whether a wake-up of the pages is pending
        machines.listen(lambda _machine: self._on_change())
        if actions is not None:
            actions.listen(self._on_change)
        self.app = Starlette(
            routes=[
                Route("/", self._index),
                Route("/theme.css", self._theme),
                Route("/api/events", self._events),
                Route("/api/machines", self._list),
                Route("/api/model", self._model),
                Route("/api/picture", self._picture),
                Route("/api/export", self._export),
                Route("/api/statistics", self._runs),
                Route("/api/runs", self._run_list),
                Route("/api/open", self._open),
                Route("/api/why", self._why),
                Route("/api/compare", self._compare),
                Route("/api/value", self._whole_value),
                Route("/api/question", self._question_picture),
                Route("/api/control", self._control, methods=["POST"]),
                Route("/api/mission", self._command_mission, methods=["POST"]),
                Route("/api/fleet", self._fleet),
                Route("/api/simulations", self._list_simulations),
                Route("/api/report", self._report),
                Route("/api/simulate", self._simulate, methods=["POST"]),
                Route("/api/action", self._action, methods=["GET"]),
                Route("/api/action", self._command_action, methods=["POST"]),
                Route("/{name:path}", self._file),  # last: it matches every path
            ],
            middleware=[Middleware(Guard, hosts=hosts)],
            lifespan=self._life,
        )

    @contextlib.asynccontextmanager
    async def _life(self, _app: Starlette) -> AsyncIterator[None]:
        self._loop = asyncio.get_running_loop()
        yield
        self._loop = None

    def close(self) -> None:
        """End the event streams of all pages, which are endless; may be called from any thread."""
        loop = self._loop
        if loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop was closed meanwhile
                loop.call_soon_threadsafe(self._end_pages)

    def _end_pages(self) -> None:
        for one in self._pages:
            one.closed = True
            one.news.set()

    def _on_change(self) -> None:
        """Wake the pages, from any thread; no-op while a wake-up is pending."""
        loop = self._loop
        if loop is None or self._woken:
            return
        self._woken = True
        with contextlib.suppress(RuntimeError):  # the loop was closed meanwhile
            loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        # Cleared before the pages look: a change during their look wakes them again.
        self._woken = False
        for one in self._pages:
            one.news.set()

    # -- answers -------------------------------------------------------------------------------

    async def _index(self, _request: Request) -> Response:
        return Response(assets.index(), media_type=assets.TYPES[".html"])

    async def _theme(self, _request: Request) -> Response:
        return Response(assets.theme_css(), media_type=assets.TYPES[".css"])

    async def _file(self, request: Request) -> Response:
        name = request.path_params["name"]
        content = assets.read(name)
        if content is None:
            return PlainTextResponse(f"no such file: {name}", status_code=404)
        # "no-cache" lets a browser keep the file but ask each time whether it has changed.
        etag = f'"{assets.version()}"'
        headers = {"etag": etag, "cache-control": "no-cache"}
        if request.headers.get("if-none-match") == etag:
            return Response(status_code=304, headers=headers)
        media = assets.TYPES["." + name.rpartition(".")[2]]
        return Response(content, media_type=media, headers=headers)

    async def _list(self, _request: Request) -> Response:
        return Json(self._machines.summaries())

    async def _model(self, request: Request) -> Response:
        machine = self._asked(request)
        if machine is None or machine.record is None:
            return _unknown(request)
        return Json({"revision": machine.revision, **assets.model(machine.record)})

    async def _runs(self, request: Request) -> Response:
        machine = self._asked(request)
        if machine is None or machine.record is None:
            return _unknown(request)
        try:
            return Json(await run_in_threadpool(self._statistics, machine.record))
        except SmachError as error:
            return PlainTextResponse(str(error), status_code=503)

    async def _run_list(self, _request: Request) -> Response:
        return Json(await run_in_threadpool(self._listed.rows))

    async def _fleet(self, _request: Request) -> Response:
        return Json(await run_in_threadpool(self._listed.fleet))

    async def _open(self, request: Request) -> Response:
        asked = request.query_params.get("run", "")
        try:
            name = await run_in_threadpool(self._listed.open, asked)
        except SmachError as error:
            return _failed(error, status=404)
        return Json({"ok": True, "name": name})

    async def _why(self, request: Request) -> Response:
        machine = self._asked(request)
        if machine is None or machine.record is None:
            return _unknown(request)
        from viz.model.why import why

        found = await run_in_threadpool(why, machine.record, machine.events())
        return Json(found.to_json())

    async def _compare(self, request: Request) -> Response:
        machine = self._asked(request)
        other = self._machines.get(request.query_params.get("with", ""))
        if machine is None or machine.record is None or other is None or other.record is None:
            return _unknown(request)
        sides = (other.name, other.record, other.events()), (
            machine.name, machine.record, machine.events(),
        )  # fmt: skip
        return Json(await run_in_threadpool(_compared, *sides))

    async def _whole_value(self, request: Request) -> Response:
        machine = self._asked(request)
        if machine is None or self._value is None:
            return _unknown(request)
        if machine.recorded or machine.stale is not None:
            return _failed("The mission is gone; only its last message about this value is left.")
        query = request.query_params
        try:
            text = await run_in_threadpool(
                self._value, machine.name, query.get("container", ""), query.get("key", "")
            )
        except SmachError as error:
            return _failed(error)
        return Json({"ok": True, "text": text})

    async def _question_picture(self, request: Request) -> Response:
        machine = self._asked(request)
        if machine is None or self._picture_of is None:
            return _unknown(request)
        path = request.query_params.get("path", "")
        try:
            found = await run_in_threadpool(self._picture_of, machine.name, path)
        except SmachError as error:
            return PlainTextResponse(str(error), status_code=409)
        return _unknown(request) if found is None else Response(found[1], media_type=found[0])

    async def _picture(self, request: Request) -> Response:
        machine = self._asked(request)
        form = request.query_params.get("format", "svg")
        if machine is None or machine.record is None or form not in PICTURES:
            return _unknown(request)
        from viz.pictures.drawing import picture

        # Paths of an outdated page are left out; drawing would refuse an unknown path.
        asked = set(request.query_params.getlist("active"))
        paths = {state.path for state in machine.record.walk()}
        looks: dict[str, Any] = {
            "theme": "dark" if request.query_params.get("theme") == "dark" else "light",
            "active": sorted(paths & asked),
        }
        async with self._drawing:
            try:
                data = await run_in_threadpool(picture, machine.record, form, **looks)
            except SmachError as error:
                return PlainTextResponse(str(error), status_code=503)
        return _download(data, PICTURES[form], f"{_file_name(machine)}.{form}")

    async def _export(self, request: Request) -> Response:
        machine = self._asked(request)
        form = request.query_params.get("format", "html")
        if machine is None or machine.record is None or form not in _EXPORTS:
            return _unknown(request)
        make, media = _EXPORTS[form]
        data = await run_in_threadpool(make, machine, machine.record)
        name = "run" if form == "jsonl" else _file_name(machine)
        return _download(data, media, f"{name}.{form}")

    async def _control(self, request: Request) -> Response:
        reason = refuse_command(request, self._token)
        # Refused before the body is read: it may be large, and its sender is not trusted.
        if reason is not None or self._send is None:
            return _refused(reason)
        name = request.query_params.get("machine", "")
        command = await _read_command(request)
        if command is None:
            return _no_command()
        client = request.client.host if request.client else "?"
        command = {"by": f"page at {client}", **command}  # the page may name its user
        try:
            return Json(await run_in_threadpool(self._send, name, command))
        except SmachError as error:
            return _failed(error)

    async def _list_simulations(self, _request: Request) -> Response:
        if self._simulations is None:
            return Json({"missions": {}, "batches": []})
        batches = await run_in_threadpool(self._simulations.rows)
        missions = await run_in_threadpool(self._simulations.missions)
        return Json({"missions": missions, "batches": batches})

    async def _report(self, request: Request) -> Response:
        if self._simulations is None:
            return _unknown(request)
        try:
            name = request.query_params.get("batch", "")
            report = await run_in_threadpool(self._simulations.report, name)
        except SmachError as error:
            return PlainTextResponse(str(error), status_code=404)
        headers = {"content-security-policy": REPORT_POLICY}
        return Response(report, media_type=assets.TYPES[".html"], headers=headers)

    async def _simulate(self, request: Request) -> Response:
        reason = refuse_command(request, self._token)
        if reason is not None or self._simulations is None:
            return _refused(reason)
        command = await _read_command(request) or {}
        try:
            match command:
                case {"command": "start"}:
                    name = await run_in_threadpool(self._simulations.start, command)
                    return Json({"ok": True, "batch": name})
                case {"command": "stop", "batch": name}:
                    await run_in_threadpool(self._simulations.stop, name)
                    return Json({"ok": True})
        except SmachError as error:
            return _failed(error)
        return _no_command()

    async def _command_mission(self, request: Request) -> Response:
        reason = refuse_command(request, self._token)
        if reason is not None:
            return _refused(reason)
        command = await _read_command(request)
        if command is None:
            return _no_command()
        try:
            text = await run_in_threadpool(self._listed.command, command)
        except SmachError as error:
            return _failed(error)
        return Json({"ok": True, "text": text})

    async def _action(self, request: Request) -> Response:
        if self._actions is None:
            return _unknown(request)
        name = request.query_params.get("name", "")
        try:
            return Json(await run_in_threadpool(self._actions.definition, name))
        except GoalRefusedError as error:
            return _failed(error)

    async def _command_action(self, request: Request) -> Response:
        reason = refuse_command(request, self._token)
        if reason is not None or self._actions is None:
            return _refused(reason)
        command = await _read_command(request)
        if command is None:
            return _no_command()
        try:
            answer = await run_in_threadpool(_do, self._actions, command)
        except GoalRefusedError as error:
            return _failed(error, problems=error.problems)
        return Json({"ok": True, **answer})

    async def _events(self, request: Request) -> Response:
        if len(self._pages) >= MOST_PAGES:
            text = f"pages: got {MOST_PAGES} open ones; expected fewer. Close one."
            return PlainTextResponse(text, status_code=503)
        # A browser that reconnects sends the id of the last event: the stream goes on after it.
        last = request.headers.get("last-event-id") or request.query_params.get("last", "")
        if not _LAST_EVENT.fullmatch(last):
            text = f"last: got {last!r}; expected EPOCH:NUMBER, the id of an event, or nothing."
            return PlainTextResponse(text, status_code=400)
        one = _Page(
            self._machines,
            request.query_params.get("machine", ""),
            last,
            {
                "follow": self._follow,
                "control": self._token is not None,
                "beat": BEAT_S,
                "kept": KEPT_EVENTS,
                "home": self._home,
            },
            self._actions,
        )
        return StreamingResponse(self._stream(one), media_type="text/event-stream")

    async def _stream(self, one: _Page) -> AsyncIterator[str]:
        self._pages.add(one)
        try:
            async for text in one.messages():
                yield text
        finally:
            self._pages.discard(one)

    def _asked(self, request: Request) -> Machine | None:
        return self._machines.get(request.query_params.get("machine", ""))


class _Page:
    """One open page, and how far it has been sent the events of its machine."""

    def __init__(
        self,
        machines: Machines,
        name: str,
        last_id: str,
        settings: dict[str, Any],
        actions: Actions | None,
    ) -> None:
        self.news = asyncio.Event()
        self.closed = False
        self._machines = machines
        self._name = name
        self._settings = settings
        # The last event that the page has: epoch of its machine, and number.
        epoch, _, seq = last_id.rpartition(":")
        self._epoch = epoch
        self._seq = int(seq or 0)
        self._facts: dict[str, Any] = {}
        self._list = ""
        self._listed = 0.0
        self._beaten = 0.0
        self._observed = -1  # number of the newest sent record of robot topics
        self._observed_sent = 0.0
        self._actions = actions
        self._actions_revision = -1  # the revision that was sent
        self._actions_sent = 0.0

    async def messages(self) -> AsyncIterator[str]:
        """Yield the messages for the page, until it is closed."""
        loop = asyncio.get_running_loop()
        yield f"retry: 500\nevent: settings\ndata: {json.dumps(self._settings)}\n\n"
        while not self.closed:
            # Cleared before looking: a change from now on ends the wait below at once.
            self.news.clear()
            machine = self._choose()
            if machine is not None:
                for text in (*self._update(machine), *self._robot_texts(machine, loop.time())):
                    yield text
            # `due` becomes the longest time until something must be sent without a change.
            # The list is sent when it has changed; it is compared as text, which is needed anyway.
            due = self._listed + LIST_S - loop.time()
            if due <= 0:
                self._listed = loop.time()
                text = json.dumps(self._machines.summaries())
                if text != self._list:
                    self._list = text
                    yield f"event: machines\ndata: {text}\n\n"
                due = BEAT_S
            if self._beaten + BEAT_S <= loop.time():
                self._beaten = loop.time()
                yield f"event: beat\ndata: {time.time_ns() // 1_000_000}\n\n"
            due = min(due, self._beaten + BEAT_S - loop.time(), self._robot_due(machine))
            if self._actions is not None and self._actions_revision != self._actions.revision:
                wait = self._actions_sent + ACTIONS_S - loop.time()
                if wait <= 0:
                    yield self._actions_text(self._actions, loop.time())
                else:
                    due = min(due, wait)
            # Wait for a change or until something is due; after a change, a little for others.
            try:
                async with asyncio.timeout(max(due, COALESCE_S)):
                    await self.news.wait()
            except TimeoutError:
                continue
            await asyncio.sleep(COALESCE_S)

    def _robot_texts(self, machine: Machine, now: float) -> list[str]:
        """A message with the new records of robot topics, unless one was sent just now."""
        if self._observed == machine.observed_seq or now < self._observed_sent + OBSERVED_S:
            return []
        texts = machine.observed_since(self._observed)
        self._observed, self._observed_sent = machine.observed_seq, now
        return [f"event: observed\ndata: [{','.join(texts)}]\n\n"]

    def _robot_due(self, machine: Machine | None) -> float:
        """Time until the next message about the robot [s]."""
        waits = machine is not None and self._observed != machine.observed_seq
        return OBSERVED_S if waits else math.inf

    def _actions_text(self, actions: Actions, now: float) -> str:
        self._actions_revision, self._actions_sent = actions.revision, now
        return f"event: actions\ndata: {json.dumps(actions.summary())}\n\n"

    def _choose(self) -> Machine | None:
        """The machine that the page names, otherwise the first one, to which it then stays."""
        machine = self._machines.get(self._name) if self._name else self._machines.first()
        if machine is not None:
            self._name = machine.name
        return None if machine is None or machine.record is None else machine

    def _update(self, machine: Machine) -> list[str]:
        texts: list[str] = []
        # A snapshot for a new page, another program or a page too far behind; else the new events.
        behind = machine.since(self._seq) if machine.epoch == self._epoch else None
        if behind is None or len(behind) > FARTHEST:
            missed, before = behind is not None, self._seq
            self._epoch = machine.epoch
            self._observed = -1
            self._seq, snap = machine.snapshot(short=missed)
            texts.append(f"event: snap\nid: {self._epoch}:{self._seq}\ndata: {snap}\n\n")
            if missed:
                texts.append(f"event: gap\ndata: {self._seq - before}\n\n")
            behind = []
        facts = machine.facts()
        if facts != self._facts:
            self._facts = facts
            texts.append(f"event: facts\ndata: {json.dumps(facts)}\n\n")
        if behind:
            # Not `+= len(behind)`: numbers of dropped events are missing.
            self._seq = json.loads(behind[-1])["seq"]
            data = f"[{','.join(behind)}]"
            texts.append(f"id: {self._epoch}:{self._seq}\ndata: {data}\n\n")
        return texts


async def _read_command(request: Request) -> dict[str, Any] | None:
    """The JSON object in a request; None if it is too long, cut off or something else."""
    # Read in parts, so that a long body is refused before it fills the memory.
    body = b""
    try:
        async for chunk in request.stream():
            body += chunk
            if len(body) > LONGEST_COMMAND:
                return None
        command = json.loads(body)
    except (ClientDisconnect, ValueError, RecursionError):  # RecursionError: thousands of "["
        return None
    return command if isinstance(command, dict) else None


def _no_command() -> Response:
    text = f"command: got no JSON object of at most {LONGEST_COMMAND} bytes; expected one."
    return _failed(text, status=400)


def _failed(reason: object, *, status: int = 409, **more: object) -> Response:
    return Json({"ok": False, "text": str(reason), **more}, status_code=status)


def _export_page(machine: Machine, record: StateRecord) -> bytes:
    """The run as one file that opens without a server."""
    from viz.runs.html import page_of

    return page_of(machine, record).encode("utf-8", "replace")


def _export_recording(machine: Machine, record: StateRecord) -> bytes:
    """The run as a recording, in the format of `Recorder`."""
    from smachpy.events.recording import recording_lines

    base, events = machine.history()
    return "".join(recording_lines(record, events, base, machine.observed())).encode()


_EXPORTS = {
    "html": (_export_page, assets.TYPES[".html"]),
    "jsonl": (_export_recording, "application/jsonl"),
}


def _compared(old: tuple[str, Any, Any], new: tuple[str, Any, Any]) -> dict[str, Any]:
    """The union of two machines, each given as name, record and events."""
    from viz.runs.compare import Side, unite
    from viz.runs.statistics import Statistics

    sides = []
    for name, record, events in (old, new):
        statistics = Statistics()
        statistics.add(events, record)
        sides.append(Side(name, record, statistics))
    union = unite(*sides)
    return {
        "with": old[0],
        "model": assets.model(union.record, union.node),
        "listed": union.listed(),
        "runs": [side.statistics.runs for side in sides if side.statistics is not None],
    }


def _do(actions: Actions, command: dict[str, Any]) -> dict[str, Any]:
    """Carry out a command about an action."""
    match command:
        case {"command": "check", "name": str(name), "yaml": str(text)}:
            return actions.check(name, text)
        case {"command": "send", "name": str(name), "yaml": str(text)}:
            return {"goal": actions.send(name, text)}
        case {"command": "cancel", "goal": str(goal)}:
            actions.cancel(goal)
            return {}
    raise GoalRefusedError(
        f"command: got {sorted(command)}; expected `check` or `send` with name and yaml, "
        "or `cancel` with goal."
    )


def _refused(reason: str | None) -> Response:
    """Refuse a command; after a wrong token, such as an earlier viewer's, the page asks for one."""
    return _failed(reason, status=403, wants_token=reason == WRONG_TOKEN)


def _unknown(request: Request) -> Response:
    return PlainTextResponse(f"nothing there: {request.url.query}", status_code=404)


def _file_name(machine: Machine) -> str:
    label = machine.record.label if machine.record else machine.name
    # ASCII letters and digits only: the name goes into a header, and labels are not trusted.
    return "".join(c if c.isalnum() and c.isascii() else "_" for c in label)[:60] or "machine"


def _download(data: bytes, media: str, name: str) -> Response:
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(data, media_type=media, headers=headers)
