"""The routes about runs: the lists for the home page, missions and simulated batches."""

from __future__ import annotations

import re
from collections import deque
from typing import TYPE_CHECKING, Final

from starlette.concurrency import run_in_threadpool
from starlette.responses import Response
from starlette.routing import Route

from smachpy_viz.live import assets
from smachpy_viz.live.answers import Json, RequestError, command_of, failing_with, machine_of

if TYPE_CHECKING:
    from starlette.requests import Request

    from smachpy_viz.live.runs import Runs
    from smachpy_viz.live.security import Access
    from smachpy_viz.live.simulations import Simulations

REPORT_POLICY: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'none'; sandbox"
)
"""Content security policy of a report, a page without scripts."""

_NUMBER: Final = re.compile(r"[0-9]{1,9}")


class RunRoutes:
    """Answers the requests about runs.

    Args:
        runs: The live and recorded runs.
        simulations: The batches of simulated runs; None for none.
        access: Who may command.
    """

    def __init__(self, runs: Runs, simulations: Simulations | None, access: Access) -> None:
        self._runs = runs
        self._simulations = simulations
        self._access = access
        self.routes = [
            Route("/api/runs", self._list),
            Route("/api/fleet", self._fleet),
            Route("/api/good", self._good),
            Route("/api/open", self._open),
            Route("/api/mission", self._command_mission, methods=["POST"]),
            Route("/api/simulations", self._batches),
            Route("/api/report", self._report),
            Route("/api/simulate", self._simulate, methods=["POST"]),
        ]

    async def _list(self, _request: Request) -> Response:
        return Json(await run_in_threadpool(self._runs.rows))

    async def _fleet(self, request: Request) -> Response:
        skip = request.query_params.get("skip", "0")
        if not _NUMBER.fullmatch(skip):
            raise RequestError(f"skip: got {skip!r}; expected a number of runs.")
        return Json(await run_in_threadpool(self._runs.fleet, int(skip)))

    async def _good(self, request: Request) -> Response:
        machine = machine_of(request, self._runs.machines)
        assert machine.record is not None
        from smachpy_viz.runs.good_runs import compare_with_good
        from smachpy_viz.runs.html import MOST_EVENTS

        good = self._runs.good(machine.name)
        record, events = machine.record, machine.events()
        found = await run_in_threadpool(
            lambda: compare_with_good(record, list(deque(events, MOST_EVENTS)), good)
        )
        return Json(found.to_json())

    async def _open(self, request: Request) -> Response:
        asked = request.query_params.get("run", "")
        with failing_with(404):
            name = await run_in_threadpool(self._runs.open, asked)
        return Json({"ok": True, "name": name})

    async def _command_mission(self, request: Request) -> Response:
        self._access.check_command(request)
        text = await run_in_threadpool(self._runs.command, await command_of(request))
        return Json({"ok": True, "text": text})

    async def _batches(self, _request: Request) -> Response:
        if self._simulations is None:
            return Json({"missions": {}, "batches": []})
        batches = await run_in_threadpool(self._simulations.rows)
        missions = await run_in_threadpool(self._simulations.missions)
        return Json({"missions": missions, "batches": batches})

    async def _report(self, request: Request) -> Response:
        with failing_with(404):
            name = request.query_params.get("batch", "")
            report = await run_in_threadpool(self._started().report, name)
        headers = {"content-security-policy": REPORT_POLICY}
        return Response(report, media_type=assets.TYPES[".html"], headers=headers)

    async def _simulate(self, request: Request) -> Response:
        self._access.check_command(request)
        match command := await command_of(request):
            case {"command": "start"}:
                name = await run_in_threadpool(self._started().start, command)
                return Json({"ok": True, "batch": name})
            case {"command": "stop", "batch": name}:
                await run_in_threadpool(self._started().stop, name)
                return Json({"ok": True, "text": ""})
        raise RequestError("command: expected `start`, or `stop` with batch.")

    def _started(self) -> Simulations:
        if self._simulations is None:
            raise RequestError("this viewer simulates nothing.", 404)
        return self._simulations
