"""A `dot` program that uses the Graphviz library in the pygraphviz wheel.

It runs as a process (`python -m smachpy_viz.pictures.bundled_dot -Tsvg file.gv`) and is never
imported: a crash of the C library must not end a robot's process. It accepts the options that
`graphviz_process` and the package `graphviz` use: `-K`, `-T`, `-o`, `-G/-N/-E name=value`, `-V`,
and input files, or a stream of graphs on standard input, each ended by the line `// end of graph`.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

END = b"// end of graph"  # the same as in graphviz_process, which this process must not import


def main(arguments: list[str]) -> int:
    """Draw all inputs, one after another; return the exit code."""
    options = _parser().parse_args(arguments)
    try:
        import pygraphviz
    except ImportError as failure:  # its wheel needs glib and X11's libraries
        sys.stderr.write(
            f"the package pygraphviz cannot be used: {failure}. "
            "Try: sudo apt-get install graphviz\n"
        )
        return 1
    if options.version:
        sys.stderr.write(f"dot - graphviz version {pygraphviz.__graphviz_version__}\n")
        return 0
    out = options.output.open("wb") if options.output else sys.stdout.buffer
    try:
        for text in _texts(options.files):
            out.write(_draw(text, options))
            out.flush()
    except (ValueError, OSError, pygraphviz.DotError) as error:
        sys.stderr.write(f"Error: {str(error)!a}\n")
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="dot", allow_abbrev=False)
    parser.add_argument("-K", dest="engine", default="dot")
    parser.add_argument("-T", dest="format", default="dot")
    parser.add_argument("-o", dest="output", type=Path)
    parser.add_argument("-V", dest="version", action="store_true")
    parser.add_argument("-q", dest="quiet", action="store_true")
    for kind in "GNE":
        parser.add_argument(f"-{kind}", dest=kind, action="append", default=[])
    parser.add_argument("files", nargs="*", type=Path)
    return parser


def _texts(files: list[Path]) -> Iterator[str]:
    """Yield the text of each file; without files, each graph on standard input once complete."""
    if files:
        yield from (file.read_text(encoding="utf-8") for file in files)
        return
    lines: list[str] = []
    for line in iter(sys.stdin.buffer.readline, b""):
        lines.append(line.decode("utf-8"))
        if line.rstrip() == END:
            yield "".join(lines)
            lines = []
    if "".join(lines).strip():
        yield "".join(lines)


def _draw(text: str, options: argparse.Namespace) -> bytes:
    import pygraphviz

    picture = pygraphviz.AGraph(string=text)
    for kind, attributes in (
        ("G", picture.graph_attr),
        ("N", picture.node_attr),
        ("E", picture.edge_attr),
    ):
        for assignment in getattr(options, kind):
            name, _, value = assignment.partition("=")
            attributes[name] = value or "true"
    data: bytes = picture.draw(format=options.format, prog=options.engine)
    return data


if __name__ == "__main__":
    code = main(sys.argv[1:])
    sys.stdout.flush()
    # Not sys.exit: the library's cleanup takes time and can crash after the picture is written.
    os._exit(code)
