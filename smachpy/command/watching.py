"""Shows a run to others: over the network, in a browser, in a file."""

from __future__ import annotations

import contextlib
import re
import shlex
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import RealClock, use_clock
from actionlib_core.node import Node
from actionlib_core.process.output import printable
from smachpy.command import runs_folder
from smachpy.command.extras import load_view
from smachpy.durable.store import for_child
from smachpy.events.recording import Recorder
from smachpy.network.robot_topics import RobotTopics
from smachpy.network.server import IntrospectionServer

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from actionlib_core.shutdown import Shutdown
    from smachpy.events.inputs import Which
    from smachpy.machines.container import Container


@dataclass(frozen=True, slots=True)
class Watching:
    """How a run is shown.

    Attributes:
        record: File to record the run to; None records only viewed runs, in the folder of runs.
        inputs: Which inputs of the mission the recording has (`smachpy.events.inputs`).
        origin: How to begin the mission again, for the recording.
        view: Serve the page of the live viewer during the run and after its end.
        view_for: How long after its end [s]; None: until the program is to end.
        port: Port of that page; 0 takes any.
        control: Obey commands of viewers: pause, step, jump and so on.
        journal: Journal of a durable mission, for the page's list of runs.
        allow: Places of missions that the page may resume, see `smachpy.command.queued`.
        alone: The mission is not on a shared network: only `view` shows it.
    """

    record: Path | None = None
    inputs: Which = "seen"
    origin: Mapping[str, Any] = field(default_factory=dict)
    view: bool = False
    view_for: float | None = None
    port: int = 8080
    control: bool = False
    journal: str | None = None
    allow: tuple[str, ...] = ()
    alone: bool = False

    @property
    def records(self) -> bool:
        """Whether there is a recording."""
        return self.record is not None or self.view


class Watch:
    """The page and the recording of one run.

    Args:
        file: The recording.
        viewer: The process that serves the page.
        stay: How long the page stays after the end [s]; None: until the program is to end.
    """

    def __init__(self, file: Recorder | None, viewer: Any, stay: float | None) -> None:
        self._file = file
        self._viewer = viewer
        self._stay = stay
        self._clock = RealClock()  # the page is read in real time
        self._over = self._clock.event("page of the run")

    def viewer_ended(self) -> None:
        """Note that the viewer may have ended; from any thread."""
        if self._viewer is not None and self._viewer.exit_code is not None:
            self._over.set()

    def close(self) -> None:
        """Complete the recording; a second call does nothing.

        Blocks: 2 s at most.
        """
        if self._file is not None:
            self._file.close()

    def linger(self, outcome: str | None, ending: Shutdown) -> None:
        """Complete the recording, say where the run can be viewed, and keep the page for a while.

        Args:
            outcome: The outcome; None: the mission's code raised.
            ending: The shutdown of the program.

        Blocks: until the time is over, `ending` is requested, or the viewer has ended.
        """
        self.close()
        if self._viewer is None:
            return
        if self._file is not None:
            path = shlex.quote(str(self._file.path))
            print(printable(f"recorded: smachpy view {path}"), flush=True)
        if ending.requested() or self._stay == 0 or self._viewer.exit_code is not None:
            return
        how = "raised an exception" if outcome is None else f"ended: {outcome}"
        left = "" if self._stay is None else f" for {self._stay:g} s"
        print(
            printable(f"{how}; still at {self._viewer.address}{left} (Ctrl-C ends it)"), flush=True
        )
        with use_clock(self._clock):  # the mission's virtual clock has stopped by now
            cancel = ending.on_shutdown(self._over.set)
        self.viewer_ended()
        self._over.wait(self._stay)
        cancel()


@contextlib.contextmanager
def watched(name: str, machine: Container, path: str, watching: Watching) -> Iterator[Watch]:
    """Show a machine within the block; no viewer can delay it.

    Args:
        name: The name for viewers.
        machine: The machine.
        path: Its path in its record.
        watching: How to show it.

    Yields:
            The page, which can stay after the end.

    Raises:
        SmachError: the file exists, or the page cannot be served.
    """
    word = re.sub(r"[^A-Za-z0-9_]", "_", name)
    with contextlib.ExitStack() as stack:
        robot = stack.enter_context(RobotTopics())
        node = None
        # The mission's network is in memory: viewers need a node on the real one, in real time.
        if watching.alone and watching.view:
            node = stack.enter_context(Node("mission", clock=RealClock()))
        file = _file(name, machine, watching)
        begun: list[bool] = []
        if file is not None:
            if watching.record is None and not file.earlier:
                stack.callback(_forget_unless, begun, file.path)
            stack.enter_context(file)
            stack.callback(robot.listen(file.observe))
        server = IntrospectionServer(
            word if word[:1].isalpha() else f"m_{word}",
            machine,
            path,
            control=watching.control and not watching.alone,
            node=node,
            robot=robot,
            earlier=() if file is None else file.earlier,
        )
        if watching.view or not watching.alone:
            server.start()
            stack.callback(server.stop)
        viewer = None
        if watching.view:
            control = ("--control",) if watching.control and not watching.alone else ()
            address, secrets = for_child(watching.journal or "")
            journal = () if watching.journal is None else (f"--durable={address}",)
            allow = [f"--allow={place}" for place in watching.allow]
            port = ("--port", str(watching.port))
            words = ("--auto-focus", *port, *control, *journal, *allow)
            viewer = load_view("viewer")(words, environment=secrets)
        watch = Watch(file, viewer, watching.view_for)
        if viewer is not None:
            viewer.on_change = watch.viewer_ended
            stack.enter_context(viewer)
            print(printable(f"watch it at {viewer.address}"), flush=True)
        begun.append(True)
        yield watch


def _forget_unless(begun: list[bool], recording: Path) -> None:
    """Remove the recording of a run that did not begin, as its page could not be served."""
    if not begun:
        recording.unlink(missing_ok=True)


def _file(name: str, machine: Container, watching: Watching) -> Recorder | None:
    """Return the recorder; a durable run that continues goes to the file that it began with."""
    run = machine._smachpy.live.journal.run
    path = watching.record
    if path is None and watching.view:
        path = runs_folder.new_file(name, RealClock().time_ns(), run)
    if path is None:
        return None
    return Recorder(path, machine, run=run, inputs=watching.inputs, origin=watching.origin)
