"""Run the `dot` program: the only place that does.

It runs as a process of its own with a time limit, so that neither a fault nor an endless layout
in the C library reaches the robot's process.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from xml.sax.saxutils import escape

from graphviz import ExecutableNotFound
from graphviz.backend.execute import run_check

from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

DOT_VARIABLE = "SMACHPY_DOT"
TIME_LIMIT = 20.0
"""Longest layout [s]; past it one more try with cheaper settings gets as long."""
CHEAPER = ("-Gmclimit=0.2", "-Gnslimit=3", "-Gnslimit1=3", "-Gsplines=line")
FONTS = Path(__file__).with_name("fonts")

Layout = Literal["dot", "nop2"]
Format = Literal["svg", "png", "pdf", "json0"]


class EngineError(SmachError):
    """`dot` is missing, failed or took too long."""


def find_dot() -> tuple[str, ...]:
    """Return the command that runs `dot`.

    The first of: what the environment variable `SMACHPY_DOT` names, a `dot` on the PATH, the
    Graphviz library inside the pygraphviz package (extra `dot`).

    Raises:
        EngineError: there is none, or `SMACHPY_DOT` names no program.
    """
    wanted = os.environ.get(DOT_VARIABLE)
    if wanted:
        program = shutil.which(wanted)
        if program is None:
            raise EngineError(
                f"picture: {DOT_VARIABLE}: got {wanted!r}; expected the path of a `dot` program."
            )
        return (program,)
    system = shutil.which("dot")
    if system is not None:
        return (system,)
    if importlib.util.find_spec("pygraphviz") is not None:
        return (sys.executable, "-P", str(Path(__file__).with_name("_gvdot.py")))
    raise EngineError(
        "picture: no `dot` program found. Try: pip install 'smachpy[dot]', "
        "or: sudo apt-get install graphviz"
    )


def lay_out(texts: Sequence[str]) -> list[dict[str, Any]]:
    """Return Graphviz' JSON with positions for each DOT text.

    Raises:
        EngineError: `dot` is missing, failed or took too long.

    Blocks: for at most twice `TIME_LIMIT`.
    """
    output = _run(texts, "dot", "json0").decode("utf-8")
    decoder = json.JSONDecoder(strict=False)
    results = []
    at = 0
    for _ in texts:
        result, at = decoder.raw_decode(output, at)
        results.append(result)
        while at < len(output) and output[at].isspace():
            at += 1
    return results


def draw(text: str, form: Format) -> bytes:
    """Return the picture of a DOT text that carries its positions.

    Raises:
        EngineError: as `lay_out`.

    Blocks: as `lay_out`.
    """
    return _run([text], "nop2", form)


def draw_pages(texts: Sequence[str]) -> list[bytes]:
    """Return an SVG for each DOT text that carries its positions; one process for all.

    Raises:
        EngineError: as `lay_out`.

    Blocks: as `lay_out`.
    """
    start = b"<?xml "
    output = _run(texts, "nop2", "svg")
    return [start + page for page in output.split(start)[1:]]


def _run(texts: Sequence[str], layout: Layout, form: Format) -> bytes:
    command = [*find_dot(), f"-K{layout}", f"-T{form}"]
    with _desk(texts) as (files, environment):
        try:
            return _call([*command, *files], environment)
        except subprocess.TimeoutExpired:
            pass  # once more, cheaper
        try:
            return _call([*command, *CHEAPER, *files], environment)
        except subprocess.TimeoutExpired as error:
            raise EngineError(
                f"picture: {command[0]}: no layout within {TIME_LIMIT:g} s, twice. "
                "Try a smaller --depth, or --path to draw a part."
            ) from error


def _call(command: Sequence[str], environment: dict[str, str]) -> bytes:
    try:
        done = run_check(
            command,
            capture_output=True,
            stdin=subprocess.DEVNULL,
            env=environment,
            timeout=TIME_LIMIT,
            quiet=True,
        )
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode("utf-8", "replace").strip()[-2000:]
        raise EngineError(
            f"picture: {command[0]}: exit code {error.returncode}; it said: {said or 'nothing'}"
        ) from error
    except (ExecutableNotFound, PermissionError) as error:
        raise EngineError(f"picture: {command[0]} cannot be started: {error}") from error
    output: bytes = done.stdout
    return output


@contextlib.contextmanager
def _desk(texts: Sequence[str]) -> Iterator[tuple[list[str], dict[str, str]]]:
    """Lay the inputs and the font configuration out in a folder that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="smachpy-dot-") as name:
        folder = Path(name)
        files = []
        for i, text in enumerate(texts):
            file = folder / f"{i}.gv"
            file.write_text(text, encoding="utf-8", errors="replace")
            files.append(str(file))
        fonts = folder / "fonts.conf"
        fonts.write_text(_font_configuration(), encoding="utf-8")
        yield files, {**os.environ, "FONTCONFIG_FILE": str(fonts)}


def _font_configuration() -> str:
    """The system's fonts and the shipped ones, which come first: same sizes on every machine."""
    system = os.environ.get("FONTCONFIG_FILE", "/etc/fonts/fonts.conf")
    return f"""<?xml version="1.0"?>
<!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig>
  <dir>{escape(str(FONTS))}</dir>
  <include ignore_missing="yes">{escape(system)}</include>
  <cachedir prefix="xdg">fontconfig</cachedir>
</fontconfig>
"""
