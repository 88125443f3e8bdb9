"""Writes the files of `smachpy run --out DIR`: events, pictures and a summary."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import json
from typing import TYPE_CHECKING, Any

from actionlib_core.process.private_files import make_private_folder, open_private
from smachpy.base.log import logwarn
from smachpy.command.extras import advice, load_view
from smachpy.command.track_recorder import TrackRecorder
from smachpy.events.recording import Recorder, RecordingError
from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from smachpy.command.surroundings import RobotOptions
    from smachpy.machines.container import Container


class OutFolder:
    """The files of one run; they replace those of the mission's previous run.

    Args:
        folder: The folder; it is created if necessary.
        name: The mission's name, the prefix of the files.
        machine: The mission.
        robot: Provides map and dock for the picture of the track.

    Raises:
        MissionError: a file cannot be written.
        SmachError: the machine cannot be drawn.
    """

    def __init__(self, folder: Path, name: str, machine: Container, robot: RobotOptions) -> None:
        self._folder = folder
        self._name = name
        self._machine = machine
        self._robot = robot
        self._track = TrackRecorder()
        self._history: Any = load_view("history")()
        self._draw: Callable[..., Path] = load_view("run")
        self._events = self._path(".jsonl")
        with self._writing():
            make_private_folder(folder)
            # Errors in drawing or writing show up here, before the robot moves.
            self._draw(machine, self._path(".svg"))
            for old in (self._events, self._path("_summary.json"), self._path("_track.png")):
                old.unlink(missing_ok=True)
        self._no_track = _why_no_track()

    @contextlib.contextmanager
    def collecting(self) -> Iterator[None]:
        """Collect events within the `with` block.

        Raises:
            MissionError: the file cannot be written.
        """
        try:
            recorder = Recorder(self._events, self._machine)
        except RecordingError as error:
            raise MissionError(f"--out {self._folder}: {error}") from error
        with recorder, contextlib.ExitStack() as stack:
            for listener in (self._track, self._history):
                stack.callback(self._machine.subscribe(listener.on_event))
            yield

    def write(self, facts: dict[str, Any]) -> list[Path]:
        """Write the pictures and the summary.

        Args:
            facts: How the run was started and ended; the first part of the summary.

        Returns:
            All files, including the events.

        Raises:
            MissionError: a file cannot be written.
        """
        with self._writing():
            files = [self._draw(self._machine, self._path(".svg"), run=self._history)]
            if self._track.has_goals and self._no_track is not None:
                logwarn(f"{self._path('_track.png')}: not drawn: {self._no_track}")
            elif self._track.has_goals:
                files.append(self._draw_track(f"{self._name}: {facts['outcome']}"))
            path = self._path("_summary.json")
            with open_private(path, "w") as file:
                file.write(json.dumps({**facts, **self._summary()}, indent=2) + "\n")
        return [*files, self._events, path]

    def _summary(self) -> dict[str, Any]:
        """Return the states' visits as plain data."""
        return {
            "seconds": self._history.seconds,
            "states": {
                path: {
                    "visits": visits.count,
                    "seconds": round(visits.seconds, 6),
                    "outcomes": visits.outcomes,
                }
                for path, visits in self._history.visits().items()
            },
        }

    def _draw_track(self, title: str) -> Path:
        path = self._path("_track.png")
        grid, dock = self._robot.floor()
        self._track.draw(path, grid, dock=dock, title=title)
        return path

    def _path(self, ending: str) -> Path:
        return self._folder / f"{self._name}{ending}"

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise MissionError(
                f"--out {self._folder}: got {error.strerror or str(error)!r}; expected a folder to "
                "write to."
            ) from error


def _why_no_track() -> str | None:
    """Import the track drawing now, since that takes a moment; return what is missing for it."""
    if importlib.util.find_spec("smachpy.sim") is None:
        return "the simulated robot, which draws it, is not installed"
    try:
        importlib.import_module("smachpy.sim.track")
    except ModuleNotFoundError as error:
        text = advice(error)
        if text is None:
            raise
        return text
    return None
