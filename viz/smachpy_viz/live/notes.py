"""Notes on runs that all pages share: kept beside the recording, and without one by the viewer."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from starlette.concurrency import run_in_threadpool
from starlette.routing import Route

from actionlib_core.inputs.checked_data import DataError
from smachpy_viz.live.answers import Json, RequestError, command_of, machine_of
from smachpy_viz.runs.notes import checked_note, read_notes, with_note, without_note, write_notes

if TYPE_CHECKING:
    from collections.abc import Callable

    from starlette.requests import Request
    from starlette.responses import Response

    from smachpy_viz.live.machines import Machine
    from smachpy_viz.live.runs import Runs
    from smachpy_viz.live.security import Access
    from smachpy_viz.runs.notes import RunNote


class Notes:
    """The notes on runs, and the routes by which pages read and change them.

    Args:
        runs: The runs, which know their files.
        access: Who may command, and so write.
    """

    def __init__(self, runs: Runs, access: Access) -> None:
        self._runs = runs
        self._access = access
        self._lock = threading.Lock()  # a change reads the file and writes it
        self.routes = [
            Route("/api/notes", self._list, methods=["GET"]),
            Route("/api/notes", self._change, methods=["POST"]),
        ]

    def of(self, machine: Machine) -> list[RunNote]:
        """Return the notes on a machine's newest run, by their instants; blocks.

        Raises:
            RecordingError: their file cannot be read, or is none.
        """
        file = self._runs.file_of(machine.name)
        notes = [] if file is None else read_notes(file)
        for one in machine.notes:  # written before there was a recording
            notes = with_note(notes, one)
        return notes

    def _set(
        self,
        machine: Machine,
        change: Callable[[list[RunNote], RunNote], list[RunNote]],
        note: RunNote,
    ) -> None:
        with self._lock:
            try:
                notes = change(self.of(machine), note)
            except ValueError as error:
                raise RequestError(f"notes: {error}", 409) from error
            file = self._runs.file_of(machine.name)
            if file is not None:
                write_notes(file, notes)
                notes = []
            machine.set_notes(notes)

    async def _list(self, request: Request) -> Response:
        machine = machine_of(request, self._runs.machines)
        return Json(await run_in_threadpool(self.of, machine))

    async def _change(self, request: Request) -> Response:
        self._access.check_command(request)
        machine = machine_of(request, self._runs.machines)
        command = await command_of(request)
        by = f"page at {request.client.host if request.client else '?'}"
        match command:
            case {"command": "add", "note": data}:
                change = with_note
            case {"command": "remove", "note": data}:
                change = without_note
            case _:
                raise RequestError("command: expected `add` or `remove` with note.")
        try:
            note = checked_note(data, by)
        except DataError as error:
            raise RequestError(f"note{str(error).removeprefix('$')}") from error
        await run_in_threadpool(self._set, machine, change, note)
        return Json({"ok": True, "text": ""})
