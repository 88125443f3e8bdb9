"""The routes about one machine: its structure, pictures, files, values, and why it ended."""

from __future__ import annotations

import asyncio
import io
from typing import TYPE_CHECKING, Any, Final

from starlette.concurrency import run_in_threadpool
from starlette.responses import Response
from starlette.routing import Route

from smachpy_viz.live import assets
from smachpy_viz.live.answers import (
    Json,
    RequestError,
    download,
    failing_with,
    file_name,
    machine_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from starlette.requests import Request

    from smachpy.events.introspection import StateRecord
    from smachpy_viz.live.machines import Machine, Machines
    from smachpy_viz.runs.notes import RunNote

PICTURES: Final = {
    "svg": "image/svg+xml",
    "png": "image/png",
    "pdf": "application/pdf",
    "dot": "text/vnd.graphviz",
    "mmd": "text/plain",
    "txt": "text/plain",
}
_UNAVAILABLE: Final = 503
LONGEST_VIEW: Final = 20_000
"""Longest view that an exported page begins with [characters]."""


class MachineRoutes:
    """Answers the requests about one machine.

    Args:
        machines: The machines.
        statistics: Returns the statistics of a machine's recorded runs; blocks.
        value: Reads the value of a userdata key, by machine, container and key; blocks.
        picture: Reads the picture of a question, by machine and path; returns media type and bytes,
            or None; blocks.
        notes: Reads the notes on a machine's newest run; blocks.
    """

    def __init__(
        self,
        machines: Machines,
        statistics: Callable[[StateRecord], dict[str, Any] | None],
        value: Callable[[str, str, str], str] | None,
        picture: Callable[[str, str], tuple[str, bytes] | None] | None,
        notes: Callable[[Machine], list[RunNote]],
    ) -> None:
        self._machines = machines
        self._statistics_of = statistics
        self._value_of = value
        self._picture_of = picture
        self._notes_of = notes
        self._drawing = asyncio.Semaphore(1)  # one `dot` at a time, whatever pages ask for
        self.routes = [
            Route("/api/machines", self._list),
            Route("/api/model", self._model),
            Route("/api/picture", self._picture),
            Route("/api/export", self._export),
            Route("/api/statistics", self._statistics),
            Route("/api/why", self._why),
            Route("/api/compare", self._compare),
            Route("/api/value", self._value),
            Route("/api/question", self._question),
        ]

    async def _list(self, _request: Request) -> Response:
        return Json(self._machines.summaries())

    async def _model(self, request: Request) -> Response:
        machine, record = self._asked(request)
        return Json({"revision": machine.revision, **assets.model(record)})

    async def _statistics(self, request: Request) -> Response:
        _, record = self._asked(request)
        with failing_with(_UNAVAILABLE):
            return Json(await run_in_threadpool(self._statistics_of, record))

    async def _why(self, request: Request) -> Response:
        machine, record = self._asked(request)
        from smachpy_viz.model.why import why

        found = await run_in_threadpool(why, record, machine.events())
        return Json(found.to_json())

    async def _compare(self, request: Request) -> Response:
        machine, record = self._asked(request)
        other, old = self._asked(request, "with")
        sides = (other.name, old, other.events()), (machine.name, record, machine.events())
        return Json(await run_in_threadpool(compared, *sides))

    async def _value(self, request: Request) -> Response:
        machine, _ = self._asked(request)
        if self._value_of is None or machine.recorded or machine.stale is not None:
            text = "The mission is gone; only its last message about this value is left."
            raise RequestError(text, 409)
        asked = (request.query_params.get(name, "") for name in ("container", "key"))
        text = await run_in_threadpool(self._value_of, machine.name, *asked)
        return Json({"ok": True, "text": text})

    async def _question(self, request: Request) -> Response:
        machine, _ = self._asked(request)
        path = request.query_params.get("path", "")
        found = None
        if self._picture_of is not None:
            found = await run_in_threadpool(self._picture_of, machine.name, path)
        if found is None:
            raise RequestError(f"path: got {path!r}, which asks nothing with a picture.", 404)
        return Response(found[1], media_type=found[0])

    async def _picture(self, request: Request) -> Response:
        machine, record = self._asked(request)
        form = _one_of(request, "svg", PICTURES)
        from smachpy_viz.pictures.drawing import picture

        # Paths of an outdated page are left out; drawing would refuse an unknown path.
        asked = set(request.query_params.getlist("active"))
        paths = {state.path for state in record.walk()}
        looks: dict[str, Any] = {
            "theme": "dark" if request.query_params.get("theme") == "dark" else "light",
            "active": sorted(paths & asked),
        }
        async with self._drawing:
            with failing_with(_UNAVAILABLE):
                data = await run_in_threadpool(picture, record, form, **looks)
        return download(data, PICTURES[form], f"{file_name(machine)}.{form}")

    async def _export(self, request: Request) -> Response:
        machine, record = self._asked(request)
        form = _one_of(request, "html", EXPORTS)
        make, media = EXPORTS[form]
        view = request.query_params.get("view", "")
        if len(view) > LONGEST_VIEW:
            raise RequestError(
                f"view: got {len(view)} characters; expected at most {LONGEST_VIEW}."
            )
        notes = await run_in_threadpool(self._notes_of, machine)
        data = await run_in_threadpool(make, machine, record, view, notes)
        name = "run" if form == "jsonl" else file_name(machine)
        return download(data, media, f"{name}.{form}")

    def _asked(self, request: Request, parameter: str = "machine") -> tuple[Machine, StateRecord]:
        machine = machine_of(request, self._machines, parameter)
        assert machine.record is not None
        return machine, machine.record


def _one_of(request: Request, usual: str, known: dict[str, Any]) -> str:
    form = request.query_params.get("format", usual)
    if form not in known:
        raise RequestError(f"format: got {form!r}; expected one of {sorted(known)}.", 404)
    return form


def _export_page(machine: Machine, record: StateRecord, view: str, notes: list[RunNote]) -> bytes:
    """The run as one file that opens without a server."""
    from smachpy_viz.runs.html import page_of

    return page_of(machine, record, view=view, notes=notes).encode("utf-8", "replace")


def _export_recording(
    machine: Machine, record: StateRecord, _view: str, _notes: list[RunNote]
) -> bytes:
    """The run as a recording, in the format of `Recorder`."""
    from smachpy.events.recording import recording_lines

    base, events = machine.history()
    file = io.BytesIO()  # a list of all lines would take several times as much memory
    file.writelines(map(str.encode, recording_lines(record, events, base, machine.observed())))
    return file.getvalue()


EXPORTS: Final = {
    "html": (_export_page, assets.TYPES[".html"]),
    "jsonl": (_export_recording, "application/jsonl"),
}


def compared(old: tuple[str, Any, Any], new: tuple[str, Any, Any]) -> dict[str, Any]:
    """Return a `Comparison` of two machines, each given as name, record and events."""
    from smachpy_viz.runs.compare import ComparedRun, unite
    from smachpy_viz.runs.statistics import Statistics

    sides = []
    for name, record, events in (old, new):
        statistics = Statistics()
        statistics.add(events, record)
        sides.append(ComparedRun(name, record, statistics))
    union = unite(*sides)
    return {
        "with": old[0],
        "model": assets.model(union.record, union.node),
        "listed": union.listed(),
        "runs": [side.statistics.runs for side in sides if side.statistics is not None],
    }
