"""The routes by which the page reproduces recorded runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.concurrency import run_in_threadpool
from starlette.routing import Route

from smachpy_viz.live.answers import Json, RequestError, command_of, failing_with

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

    from smachpy_viz.live.reproductions import Reproductions
    from smachpy_viz.live.security import Access


class ReproductionRoutes:
    """Answers the requests about reproductions.

    Args:
        reproductions: Reproduces runs; None for none.
        access: Who may command.
    """

    def __init__(self, reproductions: Reproductions | None, access: Access) -> None:
        self._reproductions = reproductions
        self._access = access
        self.routes = [
            Route("/api/reproduce", self._reproduce, methods=["POST"]),
            Route("/api/reproduction", self._show),
        ]

    async def _reproduce(self, request: Request) -> Response:
        self._access.check_command(request)
        match command := await command_of(request):
            case {"command": "start"}:
                number = await run_in_threadpool(self._known().start, command)
                return Json({"ok": True, "id": number})
            case {"command": "stop", "id": number}:
                await run_in_threadpool(self._known().stop, number)
                return Json({"ok": True, "text": ""})
        raise RequestError("command: expected `start`, or `stop` with id.")

    async def _show(self, request: Request) -> Response:
        with failing_with(404):
            return Json(self._known().row(request.query_params.get("id", "")))

    def _known(self) -> Reproductions:
        if self._reproductions is None:
            raise RequestError("this viewer reproduces nothing.", 404)
        return self._reproductions
