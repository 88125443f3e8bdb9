"""The viewer's HTTP interface: the page, the machines, their events and commands.

    GET  /                    the page
    POST /api/login           a cookie for a page that knows the token
    GET  /api/events          server-sent events about machines (`streams`)
    GET  /api/machines        the machines
    GET  /api/model           structure of a machine
    GET  /api/picture         svg, png, pdf or dot, with `theme` and the `active` paths
    GET  /api/export          the run as .html or .jsonl
    GET  /api/statistics      statistics of recorded runs
    GET  /api/why             the causes of the end of a machine's newest run
    GET  /api/compare         a machine and another one in one drawing
    GET  /api/value           the present value of a userdata key, unabridged
    GET  /api/question        the picture of a question
    POST /api/control         a command, or the answer to a question
    GET  /api/runs            live and past runs, for the home page
    GET  /api/fleet           32 live runs, with the data for a common map
    GET  /api/good            how a machine's run that failed differs from good runs in files
    GET  /api/open            the name of the machine that shows a run
    POST /api/mission         resume or cancel a durable mission
    GET  /api/simulations     the missions that may be simulated, and the batches
    GET  /api/report          the report of a batch, a page
    POST /api/simulate        start or stop a batch
    POST /api/reproduce       reproduce a recorded run, write a test of it, or stop that
    GET  /api/reproduction    what a reproduction has found
    GET  /api/action          the data for a goal's form
    POST /api/action          check, send or cancel a goal
    GET  /api/goals           the running goals of an action's server, whoever sent them
    GET  /api/notes           the notes on a machine's newest run
    POST /api/notes           add or remove one

Answers are JSON with the types of `wire.ANSWERS`, or files. Every error is a `wire.Failure`.
"""

from __future__ import annotations

# Handlers run in the event loop. What can block (files, the network, drawing, long runs) goes to a
# thread by `run_in_threadpool`, so that other pages are served meanwhile.
import contextlib
from typing import TYPE_CHECKING, Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.responses import Response
from starlette.routing import Route

from smachpy.exceptions import SmachError
from smachpy_viz.live import assets
from smachpy_viz.live.answers import (
    Json,
    RequestError,
    command_of,
    on_any_error,
    on_http_error,
    on_smach_error,
)
from smachpy_viz.live.command_routes import CommandRoutes
from smachpy_viz.live.machine_routes import MachineRoutes
from smachpy_viz.live.machines import MAX_KEPT_EVENTS
from smachpy_viz.live.notes import Notes
from smachpy_viz.live.reproduction_routes import ReproductionRoutes
from smachpy_viz.live.run_routes import RunRoutes
from smachpy_viz.live.runs import Runs
from smachpy_viz.live.security import Access, Guard
from smachpy_viz.live.streams import BEAT_S, Streams

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from starlette.requests import Request

    from smachpy.events.introspection import StateRecord
    from smachpy_viz.live.actions import Actions
    from smachpy_viz.live.machines import Machines
    from smachpy_viz.live.reproductions import Reproductions
    from smachpy_viz.live.simulations import Simulations
    from smachpy_viz.live.wire import Settings


class Viewer:
    """The server side of the page.

    Args:
        machines: The machines to show.
        token: The token that commands must carry; None refuses all commands.
        read_token: The token for reading only; None lets everybody read.
        send: Sends a command to a machine and returns the answer; blocks.
        follow: Whether pages follow the active states from the start.
        statistics: Returns the statistics of a machine's recorded runs; blocks.
        hosts: Host names of the server, besides addresses.
        actions: The actions on the network; None for none.
        runs: The runs for the home page; by default those of `machines`.
        home: Whether pages begin with the list of runs, unless they name a machine.
        simulations: The batches of simulated runs; None for none.
        reproductions: Reproduces runs; None for none.
        value: Reads the value of a userdata key, by machine, container and key; blocks.
        picture: Reads the picture of a question, by machine and path; returns media type and bytes,
            or None; blocks.
    """

    def __init__(
        self,
        machines: Machines,
        *,
        token: str | None = None,
        read_token: str | None = None,
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
        reproductions: Reproductions | None = None,
    ) -> None:
        self._access = access = Access(token, read_token)
        settings: Settings = {
            "follow": follow,
            "control": token is not None,
            "beat": BEAT_S,
            "kept": MAX_KEPT_EVENTS,
            "home": home,
            "reproduces": token is not None and reproductions is not None,
        }
        self._streams = Streams(machines, dict(settings), actions, access)
        runs = Runs(machines) if runs is None else runs
        notes = Notes(runs, access)
        self.app = Starlette(
            routes=[
                Route("/", self._index),
                Route("/theme.css", self._theme),
                Route("/api/login", self._log_in, methods=["POST"]),
                *self._streams.routes,
                *MachineRoutes(machines, statistics, value, picture, notes.of).routes,
                *notes.routes,
                *RunRoutes(runs, simulations, access).routes,
                *ReproductionRoutes(reproductions, access).routes,
                *CommandRoutes(send, actions, access, machines.sender_of).routes,
                Route("/{name:path}", self._file),  # last: it matches every path
            ],
            middleware=[Middleware(Guard, access=access, hosts=hosts)],
            exception_handlers={
                SmachError: on_smach_error,
                HTTPException: on_http_error,
                Exception: on_any_error,
            },
            lifespan=self._life,
        )

    def close(self) -> None:
        """End the event streams of all pages, which are endless; may be called from any thread."""
        self._streams.close()

    @contextlib.asynccontextmanager
    async def _life(self, _app: Starlette) -> AsyncIterator[None]:
        async with self._streams.running():
            yield

    async def _index(self, _request: Request) -> Response:
        return Response(assets.index(), media_type=assets.TYPES[".html"])

    async def _theme(self, _request: Request) -> Response:
        return Response(assets.theme_css(), media_type=assets.TYPES[".css"])

    async def _file(self, request: Request) -> Response:
        name = request.path_params["name"]
        content = assets.read(name)
        if content is None:
            raise RequestError(f"no such file: {name}", 404)
        # "no-cache" lets a browser keep the file but ask each time whether it has changed.
        etag = f'"{assets.version()}"'
        headers = {"etag": etag, "cache-control": "no-cache"}
        if request.headers.get("if-none-match") == etag:
            return Response(status_code=304, headers=headers)
        media = assets.TYPES["." + name.rpartition(".")[2]]
        return Response(content, media_type=media, headers=headers)

    async def _log_in(self, request: Request) -> Response:
        command = await command_of(request)
        cookie = self._access.log_in(request, command.get("token"))
        return Json({"ok": True, "text": ""}, headers={"set-cookie": cookie})
