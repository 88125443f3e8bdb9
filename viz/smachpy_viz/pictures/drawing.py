"""Pictures of machines, from the record to the file."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from smachpy.events.introspection import StateRecord, describe
from smachpy.events.run_state import paths_above
from smachpy.exceptions import SmachError
from smachpy_viz.model import extract
from smachpy_viz.model.history import History
from smachpy_viz.model.machine import Diagram, Marks, Node
from smachpy_viz.pictures import graphviz_process, layout
from smachpy_viz.pictures.container_layout import INCH
from smachpy_viz.pictures.dot import dot_text
from smachpy_viz.pictures.mermaid import mermaid_text
from smachpy_viz.pictures.outline import outline_text
from smachpy_viz.pictures.shapes import shapes_of
from smachpy_viz.pictures.text_widths import with_widths
from smachpy_viz.pictures.theme import THEMES, Theme

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.events import Event
    from smachpy.machines.state import State


SHARP = 144
"""Dots per inch of a PNG."""
MAX_PIXELS = 16000
"""Longest side of a PNG."""
LARGEST = 14_400
"""Longest side of a picture [points]: a PDF page may not be larger, and readers refuse it."""
MAX_STATES = 4000
"""Most states in one container, side by side; nobody can follow the arrows between more."""


FORMATS = ("dot", "gv", "json", "mmd", "pdf", "png", "svg", "txt")


class PictureError(SmachError):
    """The picture cannot be made as asked for.

    Try: choose another format or another part of the machine, as the text says.
    """


class TooLargeError(PictureError):
    """The picture would be too large to be opened.

    Try: draw a part of the machine (`--path`), or fewer levels (`--depth`).

    Attributes:
        path: The container that is too large.
        states: Number of states in it.
        size: Its width and height [points]; None if it has not been laid out.
    """

    def __init__(
        self, path: str, states: int, size: tuple[float, float] | None, expected: str
    ) -> None:
        self.path, self.states, self.size = path, states, size
        got = f"{states} states" + (f", {size[0]:.0f} x {size[1]:.0f} points" if size else "")
        way_out = "a smaller --depth, one container (--path), a page for each (--atlas DIR)"
        super().__init__(
            f"picture: {path}: got {got}; expected at most {expected}. "
            f"Try {way_out if size else 'containers inside it'}, or text (-o FILE.txt)."
        )


def render(
    machine: State | StateRecord,
    file: str | os.PathLike[str],
    *,
    theme: str = "light",
    depth: int | None = None,
    path: str | None = None,
    active: Iterable[str] = (),
    run: History | Iterable[Event] | Marks | None = None,
    show_implicit: bool = False,
    legend: tuple[tuple[str, str], ...] = (),
) -> Path:
    """Draw a machine into a file.

    Args:
        machine: A state machine, any container, or its record.
        file: The file; its suffix is the format: svg, png, pdf, dot, json, mmd or txt.
        theme: `light` or `dark`.
        depth: Container levels to open; None opens as many as stay readable (60 states).
        path: Draw only the container at this path.
        active: Paths of states to mark as running.
        run: The history or the events of a run, to mark its states and transitions; or the marks
            of many runs (`smachpy_viz.runs.statistics.marks_of`).
        show_implicit: Also draw transitions that nobody wrote down.
        legend: The meaning of signs, beside the title (`smachpy_viz.model.machine.Diagram`).

    Returns:
        The file.

    Raises:
        PictureError: unknown format or theme, or the file cannot be written.
        TooLargeError: an SVG, PNG or PDF would be longer than 14,400 points, or a container has
            more than 4,000 states side by side.
        UnknownPathError: `path` or one of `active` names no state.
        EngineError: there is no `dot` program, or it failed.

    Blocks: while `dot` runs, usually well under a second, at most until its time limit.
    """
    target = Path(file)
    content = picture(
        machine,
        target.suffix.lstrip(".").lower(),
        theme=theme,
        depth=depth,
        path=path,
        active=active,
        run=run,
        show_implicit=show_implicit,
        legend=legend,
    )
    return write(content, target)


def picture(
    machine: State | StateRecord,
    form: str,
    *,
    theme: str = "light",
    depth: int | None = None,
    path: str | None = None,
    active: Iterable[str] = (),
    run: History | Iterable[Event] | Marks | None = None,
    show_implicit: bool = False,
    legend: tuple[tuple[str, str], ...] = (),
) -> bytes:
    """Return what `render` would write into a file of the format `form`.

    Raises, Blocks: as `render`.
    """
    whole = machine if isinstance(machine, StateRecord) else describe(machine)
    record = whole if path is None else extract.find(whole, path)
    marks = _marks(whole, active, run)
    if form == "json":  # the whole structure: depth, theme and marks do not apply
        return (record.to_json(indent=2) + "\n").encode("utf-8", "replace")
    node = extract.extract(record, depth=depth, show_implicit=show_implicit)
    return draw(Diagram(node, marks, legend=legend), form, theme=theme)


def draw(diagram: Diagram, form: str, *, theme: str = "light") -> bytes:
    """Return a picture of a given diagram, in any format except JSON.

    Text and Mermaid cannot show the differences of two versions.

    Raises, Blocks: as `render`.
    """
    match form:
        case "svg" | "png" | "pdf":
            return _draw(diagram, form, _theme(theme))
        case "dot" | "gv":
            colours = _theme(theme)
            text = dot_text(shapes_of(diagram, colours), colours)
        case "mmd" if not diagram.compared:
            text = mermaid_text(diagram, _theme(theme))
        case "txt" if not diagram.compared:
            text = outline_text(diagram)
        case _:
            forms = ("svg", "png", "pdf", "dot") if diagram.compared else FORMATS
            raise PictureError(
                f"picture: format: got {form!r}; expected one of {', '.join(forms)}."
            )
    return text.encode("utf-8", "replace")


def write(content: bytes, file: str | os.PathLike[str]) -> Path:
    """Write a picture to a file atomically: a viewer never sees a part of it.

    Raises:
        PictureError: it cannot be written.
    """
    target = Path(file)
    draft = target.with_name(f".{target.name}.{os.urandom(4).hex()}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            draft.write_bytes(content)
            draft.replace(target)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise PictureError(
            f"picture: {str(target)!r} cannot be written: {error.strerror}"
        ) from error
    return target


def svg(machine: State | StateRecord) -> str:
    """Return a machine as SVG text, for a notebook.

    Raises, Blocks: as `render`.
    """
    return picture(machine, "svg").decode("utf-8")


def atlas(
    machine: State | StateRecord,
    folder: str | os.PathLike[str],
    *,
    theme: str = "light",
    run: History | Iterable[Event] | Marks | None = None,
    show_implicit: bool = False,
    legend: tuple[tuple[str, str], ...] = (),
) -> Path:
    """Draw one SVG page per container into `folder`, with links between the pages.

    Returns:
        The page of the outermost container, `index.svg`.

    Raises, Blocks: as `render`.
    """
    record = machine if isinstance(machine, StateRecord) else describe(machine)
    colours = _theme(theme)
    marks = _marks(record, (), run)
    parents = [state for state in record.walk() if state.children] or [record]
    names = {state.path: f"page{i}.svg" for i, state in enumerate(parents)}
    names[record.path] = "index.svg"
    above = {child.path: state.path for state in parents for child in state.children}
    pages = []
    for state in parents:
        node = extract.extract(state, depth=1, show_implicit=show_implicit)
        links = {path: names[path] for path in (c.path for c in state.children) if path in names}
        if state.path in above:
            links[state.path] = names[above[state.path]]
        shown = legend if state is record else ()
        _check_states([node])
        pages.append(shapes_of(Diagram(node, marks, links, shown), colours))
    geometries = graphviz_process.lay_out(partial(layout.compose_all, pages, colours))
    texts = [dot_text(p, colours, g) for p, g in zip(pages, geometries, strict=True)]
    place = Path(folder)
    contents = graphviz_process.draw_pages(texts)
    for state, content, drawn in zip(
        parents, contents, graphviz_process.describe_pages(texts), strict=True
    ):
        write(with_widths(content, drawn), place / names[state.path])
    return place / "index.svg"


def _marks(
    record: StateRecord, active: Iterable[str], run: History | Iterable[Event] | Marks | None
) -> Marks:
    marks = run if isinstance(run, Marks) else _history(run).marks()
    named = {extract.find(record, path).path for path in active}
    inside = named | paths_above(named)
    paths = {state.path for state in record.walk() if state.path in inside}
    return replace(marks, active=marks.active | paths)


def _history(run: History | Iterable[Event] | None) -> History:
    if isinstance(run, History):
        return run
    history = History()
    for event in run or ():
        history.on_event(event)
    return history


def _theme(name: str) -> Theme:
    if name not in THEMES:
        raise PictureError(f"picture: theme: got {name!r}; expected one of {sorted(THEMES)}.")
    return THEMES[name]


def _draw(diagram: Diagram, form: graphviz_process.Format, theme: Theme) -> bytes:
    shapes = shapes_of(diagram, theme)
    _check_states([diagram.root])
    places = graphviz_process.lay_out(partial(layout.compose, shapes, theme))
    size = layout.canvas_size(places)
    if max(size) > LARGEST:
        states = sum(1 for _ in diagram.root.walk())
        raise TooLargeError(diagram.root.path, states, size, f"{LARGEST} points either way")
    text = dot_text(shapes, theme, places)
    content = graphviz_process.draw(text, form, dots_per_inch=_resolution(places))
    if form == "svg":
        content = with_widths(content, *graphviz_process.describe_pages([text]))
    return content


def _check_states(roots: Iterable[Node]) -> None:
    """Refuse containers that are too large to look at."""
    for node in (node for root in roots for node in root.walk()):
        if len(node.children) > MAX_STATES:
            raise TooLargeError(
                node.path, len(node.children), None, f"{MAX_STATES} side by side in a container"
            )


def _resolution(places: layout.Geometry) -> int:
    """Return a PNG's resolution: sharp on any screen, but small enough for image viewers."""
    width, height = layout.canvas_size(places)
    return int(min(SHARP, MAX_PIXELS * INCH / max(width, height)))
