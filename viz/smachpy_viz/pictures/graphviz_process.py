"""Runs the `dot` program; no other module does.

`dot` runs as a separate process with a time limit, so that neither a crash nor an endless layout
in the C library affects the robot's process.
"""

from __future__ import annotations

import contextlib
import html
import importlib.util
import json
import os
import selectors
import shutil
import subprocess
import tempfile
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar

from graphviz import ExecutableNotFound
from graphviz.backend.execute import run_check

from actionlib_core.clock import RealClock
from actionlib_core.shutdown.child_process import python_command
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from actionlib_core.clock import Event

    Run = Callable[[Sequence[str]], list[dict[str, Any] | None]]

DOT_VARIABLE = "SMACHPY_DOT"
TIME_LIMIT = 20.0
"""Time limit for a layout [s]; after it, one more attempt with cheaper settings gets as long."""
CHEAPER = ("-Gmclimit=0.2", "-Gnslimit=3", "-Gnslimit1=3", "-Gsplines=line")
FONTS = Path(__file__).with_name("fonts")

END = "// end of graph"
"""The comment line after each DOT text, which separates the texts in a stream."""

_JSON_END = b"\n}\n"
_LOOK_S = 0.1  # time between two looks at whether nobody waits for a layout any more
_REAL = RealClock()  # `dot` runs in real time, even if the machine's clock is virtual

T = TypeVar("T")
Format = Literal["svg", "png", "pdf"]


class EngineError(SmachError):
    """`dot` is missing, failed or took too long.

    Try: apt-get install graphviz, or pip install 'smachpy[dot]'.
    """


def find_dot() -> tuple[str, ...]:
    """Return the command that runs `dot`.

    The first of these that exists: the program named by the environment variable `SMACHPY_DOT`, a
    `dot` on the PATH, the Graphviz library in the pygraphviz package (extra `dot`).

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
        return tuple(python_command(str(Path(__file__).with_name("bundled_dot.py"))))
    raise EngineError(
        "picture: no `dot` program found. Try: pip install 'smachpy[dot]', "
        "or: sudo apt-get install graphviz"
    )


_unwanted: ContextVar[Event | None] = ContextVar("unwanted", default=None)


@contextlib.contextmanager
def until(unwanted: Event) -> Iterator[None]:
    """Let layouts of this thread end with an `EngineError` once `unwanted` is set."""
    token = _unwanted.set(unwanted)
    try:
        yield
    finally:
        _unwanted.reset(token)


def lay_out(work: Callable[[Run], T]) -> T:
    """Call `work` with a function that lays out DOT texts; return the result of `work`.

    The function takes any number of texts and returns Graphviz' JSON for each; None for a text
    that makes `dot` crash. It may be called repeatedly; one process serves all calls.

    Args:
        work: Called a second time, with cheaper settings, if the first attempt takes too long.

    Raises:
        EngineError: `dot` is missing, failed or took too long.

    Blocks: for at most twice `TIME_LIMIT`.
    """
    command = [*find_dot(), "-Kdot", "-Tjson0"]
    with _environment() as environment:
        try:
            with _Layouts(command, environment) as layouts:
                return work(layouts.run)
        except _TooSlowError:
            pass  # a second attempt follows, with cheaper settings
        try:
            with _Layouts([*command, *CHEAPER], environment) as layouts:
                return work(layouts.run)
        except _TooSlowError as error:
            raise EngineError(
                f"picture: {command[0]}: no layout within {TIME_LIMIT:g} s, twice. "
                "Try a smaller --depth, or --path to draw a part."
            ) from error


def draw(text: str, form: Format, *, dots_per_inch: int = 72) -> bytes:
    """Return the picture of a DOT text with positions.

    Args:
        text: The DOT text.
        form: The format.
        dots_per_inch: Resolution of a PNG.

    Raises:
        EngineError: as `lay_out`.

    Blocks: for at most `TIME_LIMIT`.
    """
    options = [f"-Gdpi={dots_per_inch}"] if form == "png" else []
    return _call([*find_dot(), "-Knop2", f"-T{form}", *options], [text])


def draw_pages(texts: Sequence[str]) -> list[bytes]:
    """Return an SVG for each DOT text with positions, using one process.

    Raises:
        EngineError: as `lay_out`.

    Blocks: for at most `TIME_LIMIT`.
    """
    # `dot` writes the documents one after another; each begins with this.
    start = b"<?xml "
    output = _call([*find_dot(), "-Knop2", "-Tsvg"], texts)
    return [start + page for page in output.split(start)[1:]]


def describe_pages(texts: Sequence[str]) -> list[dict[str, Any]]:
    """Return Graphviz' JSON for each DOT text with positions, with every drawing step.

    Raises:
        EngineError: as `lay_out`.

    Blocks: for at most `TIME_LIMIT`.
    """
    return _decoded(_call([*find_dot(), "-Knop2", "-Tjson"], texts))


def _decoded(output: bytes) -> list[dict[str, Any]]:
    decoder = json.JSONDecoder(strict=False)
    return [decoder.decode(f"{page.decode()}}}") for page in output.split(_JSON_END)[:-1]]


class _TooSlowError(Exception):
    """The time limit is over."""


class _CrashError(Exception):
    """`dot` was ended by a signal."""


class _Layouts:
    """A `dot` process that lays out batches of texts, one after another."""

    def __init__(self, command: Sequence[str], environment: dict[str, str]) -> None:
        self._command = command
        self._environment = environment
        self._deadline = _REAL.now() + TIME_LIMIT

    def __enter__(self) -> Self:
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def run(self, texts: Sequence[str]) -> list[dict[str, Any] | None]:
        """Return the JSON of each text; None for a text that makes `dot` crash."""
        if not texts:
            return []
        try:
            output = self._exchange(_joined(texts), len(texts))
        except _CrashError:
            self._stop()
            self._start()
            # `dot` does not say which text it crashed on: halve the batch until it is alone.
            half = len(texts) // 2
            return [*self.run(texts[:half]), *self.run(texts[half:])] if half else [None]
        return list(_decoded(output))

    def _start(self) -> None:
        # A file and not a pipe: nobody reads it meanwhile, and a full pipe would block `dot`.
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115  closed by `_stop`
        try:
            self._process = subprocess.Popen(  # noqa: S603  the command is the user's own `dot`
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=self._environment,
                bufsize=0,
            )
        except OSError as error:
            self._errors.close()
            raise _cannot_start(self._command, error) from error
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._in, self._out = self._process.stdin, self._process.stdout
        os.set_blocking(self._in.fileno(), False)

    def _stop(self) -> None:
        self._process.kill()
        self._process.wait()
        self._out.close()
        with contextlib.suppress(BrokenPipeError):
            self._in.close()
        self._errors.close()

    def _exchange(self, data: bytes, expected: int) -> bytes:
        """Write and read at the same time, so that a full pipe cannot block both sides."""
        output = bytearray()
        found = 0
        unwanted = _unwanted.get()
        with selectors.DefaultSelector() as selector:
            selector.register(self._in, selectors.EVENT_WRITE)
            selector.register(self._out, selectors.EVENT_READ)
            while found < expected:
                left = max(self._deadline - _REAL.now(), 0)
                ready = selector.select(min(left, _LOOK_S) if unwanted else left)
                if unwanted and unwanted.is_set():
                    raise EngineError(f"picture: {self._command[0]}: nobody waits for it any more.")
                if not ready and _REAL.now() >= self._deadline:
                    raise _TooSlowError
                for key, _ in ready:
                    if key.fileobj is self._out:
                        # Search again in the last few bytes: a separator may arrive in two pieces.
                        seen = max(len(output) - len(_JSON_END) + 1, 0)
                        output += self._read()
                        found += output.count(_JSON_END, seen)
                    else:
                        data = self._write(data)
                        if not data:
                            selector.unregister(self._in)
        return bytes(output)

    def _write(self, data: bytes) -> bytes:
        try:
            return data[self._in.write(data[:65536]) or 0 :]
        except BrokenPipeError:
            return b""  # the process has ended; `_read` reports why

    def _read(self) -> bytes:
        piece = os.read(self._out.fileno(), 1 << 20)
        if piece:
            return piece
        code = self._process.wait()
        if code < 0:
            raise _CrashError
        self._errors.seek(0)
        raise _failed(self._command, code, self._errors.read())


def _call(command: Sequence[str], texts: Sequence[str]) -> bytes:
    try:
        with _environment() as environment:
            done = run_check(
                command,
                input=_joined(texts),
                capture_output=True,
                env=environment,
                timeout=TIME_LIMIT,
                quiet=True,
            )
    except subprocess.CalledProcessError as error:
        raise _failed(command, error.returncode, error.stderr) from error
    except subprocess.TimeoutExpired as error:
        raise EngineError(
            f"picture: {command[0]}: no picture within {TIME_LIMIT:g} s. "
            "Try a smaller --depth, or --path to draw a part."
        ) from error
    except (ExecutableNotFound, OSError) as error:
        raise _cannot_start(command, error) from error
    output: bytes = done.stdout
    return output


def _joined(texts: Sequence[str]) -> bytes:
    return "".join(f"{text}\n{END}\n" for text in texts).encode("utf-8", "replace")


def _failed(command: Sequence[str], code: int, said: bytes) -> EngineError:
    words = said.decode("utf-8", "replace").strip()[-2000:]
    return EngineError(f"picture: {command[0]}: exit code {code}; it said: {words or 'nothing'}")


def _cannot_start(command: Sequence[str], error: Exception) -> EngineError:
    return EngineError(f"picture: {command[0]} cannot be started: {error}")


@contextlib.contextmanager
def _environment() -> Iterator[dict[str, str]]:
    """Yield the environment for `dot`, with a temporary font configuration."""
    with tempfile.TemporaryDirectory(prefix="smachpy-dot-") as folder:
        fonts = Path(folder) / "fonts.conf"
        fonts.write_text(_font_configuration(), encoding="utf-8")
        yield {**os.environ, "FONTCONFIG_FILE": str(fonts)}


def _font_configuration() -> str:
    """Return a configuration with the shipped fonts first: labels have the same size everywhere."""
    system = os.environ.get("FONTCONFIG_FILE", "/etc/fonts/fonts.conf")
    return f"""<?xml version="1.0"?>
<!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig>
  <dir>{html.escape(str(FONTS))}</dir>
  <include ignore_missing="yes">{html.escape(system)}</include>
  <cachedir prefix="xdg">fontconfig</cachedir>
</fontconfig>
"""
