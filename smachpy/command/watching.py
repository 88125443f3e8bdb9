"""A run that others can see: over the network, in a browser, in a file."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from smachpy import IntrospectionServer
from smachpy.command.extras import load_view
from smachpy.events.recording import Recorder

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from smachpy.machines.container import Container


@dataclass(frozen=True, slots=True)
class Watching:
    """Who may see a run, and how.

    Attributes:
        record: File to write the run to; None writes none.
        view: Serve the page of the live viewer while it runs.
        port: Of that page; 0 takes any.
        control: Obey pause, step, jump and the like from viewers.
        alone: Nobody can look in, as the mission is on no network that others are on.
    """

    record: Path | None = None
    view: bool = False
    port: int = 8080
    control: bool = False
    alone: bool = False


@contextlib.contextmanager
def watched(name: str, machine: Container, path: str, watching: Watching) -> Iterator[None]:
    """Let a machine be seen while the context lasts; nothing that watches can hold it up.

    Args:
        name: What viewers find it under.
        machine: The machine.
        path: Its path in its record.
        watching: Who may see it.

    Raises:
        SmachError: the file exists, or the page cannot be served.
    """
    word = re.sub(r"[^A-Za-z0-9_]", "_", name)
    server = IntrospectionServer(
        word if word[:1].isalpha() else f"m_{word}", machine, path, control=watching.control
    )
    with contextlib.ExitStack() as stack:
        if watching.record is not None:
            stack.enter_context(Recorder(watching.record, machine))
        if not watching.alone:
            server.start()
            stack.callback(server.stop)
        if watching.view:
            control = ("--control",) if watching.control else ()
            viewer = load_view("viewer")(("--auto-focus", "--port", str(watching.port), *control))
            stack.enter_context(viewer)
            print(f"watch it at {viewer.address}", flush=True)
        yield
