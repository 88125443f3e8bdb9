"""The files and data of the page, for the server or for a page in one file."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from dataclasses import asdict
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from smachpy_viz.model.extract import extract
from smachpy_viz.model.labels import html_text
from smachpy_viz.pictures.theme import THEMES, Theme

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.events.introspection import StateRecord
    from smachpy_viz.model.machine import Node

# The files that are served are listed once, when this module is imported: a name in a request is
# only compared with that list, so it cannot lead to any other file.
WEB = Path(__file__).resolve().parent.parent / "web"
ALL_LEVELS = 1_000_000  # the page opens and closes containers itself

FILES = frozenset(
    path.relative_to(WEB).as_posix()
    for path in WEB.rglob("*")
    if path.suffix in {".js", ".css", ".woff2", ".txt"}
)
"""The files that are served; `make web` builds them from `viz/web`."""

WORKERS = ("elk", "film")
"""Workers of the page: files of the server, or parts of a page in one file."""

TYPES = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".woff2": "font/woff2",
    ".txt": "text/plain; charset=utf-8",
    ".html": "text/html; charset=utf-8",
}


def read(name: str) -> bytes | None:
    """Return a file of the page; None when there is no such file."""
    return (WEB / name).read_bytes() if name in FILES else None


@cache
def version() -> str:
    """Return a hash over all files of the page."""
    digest = hashlib.sha256()
    for name in sorted({"index.html", *FILES}):
        digest.update((WEB / name).read_bytes())
    return digest.hexdigest()[:12]


def index() -> str:
    """Return the served page."""
    text = (WEB / "index.html").read_text(encoding="utf-8")
    head = (
        '<link rel="stylesheet" href="/theme.css"><link rel="stylesheet" href="/page.css">'
        '<script type="module" src="/page.js"></script>'
    )
    return text.replace("<!-- head -->", head)


_ON_THE_MAP = ["floor", "unknown", "wall", "halo", "hair-map", *(f"s{i}" for i in range(1, 9))]
ON_THE_MAP = {
    "light": "#ffffff #dfe5eb #3b4754 #ffb000 #e4eaf0"
    " #4a57c9 #b0337f #0b7a85 #8a5a12 #5b7300 #7a49b8 #b3462f #47586b",
    "dark": "#1a2531 #0b1118 #93a1b0 #ffc94d #27333f"
    " #8f9bff #f07fc0 #3fc7d3 #d9a24a #a9c33a #c39bff #ff9076 #a9bacb",
}
"""Colours of the map and the tracks on it (s1 to s8), which pictures and their themes lack."""


def theme_css() -> str:
    """Return the themes' colours as CSS variables, chosen by the system's setting or the user."""
    light, dark = (_variables(THEMES[name]) for name in ("light", "dark"))
    return (
        f":root{{color-scheme:light;{light}}}\n"
        f"@media (prefers-color-scheme:dark){{:root{{color-scheme:dark;{dark}}}}}\n"
        f':root[data-theme="light"]{{color-scheme:light;{light}}}\n'
        f':root[data-theme="dark"]{{color-scheme:dark;{dark}}}\n'
    )


def _variables(theme: Theme) -> str:
    pairs = {
        "background": theme.background,
        "ink": theme.ink,
        "muted": theme.muted,
        "faint": theme.faint,
        "edge": theme.edge,
        "border": theme.border,
        **{f"depth{depth}": theme.container(depth) for depth in range(12)},
        **dict(zip(_ON_THE_MAP, ON_THE_MAP[theme.name].split(), strict=True)),
    }
    for name in ("inactive", "active", "success", "failure", "preempted", "other", "waiting"):
        swatch = getattr(theme, name)
        pairs |= {name: swatch.stroke, f"{name}-fill": swatch.fill, f"{name}-text": swatch.text}
    return "".join(f"--{name}:{value};" for name, value in pairs.items())


def model(record: StateRecord, draw: Callable[..., Node] | None = None) -> dict[str, Any]:
    """Return the data from which the page draws a machine, with and without implicit transitions.

    Args:
        record: The machine.
        draw: Makes the diagram, with the arguments `depth` and `show_implicit` of `extract`; by
            default that of the machine.
    """
    draw = draw or partial(extract, record)
    return {
        "explicit": asdict(draw(depth=ALL_LEVELS)),
        "implicit": asdict(draw(depth=ALL_LEVELS, show_implicit=True)),
        "keys": {
            state.path: {
                "inputs": state.input_keys,
                "outputs": state.output_keys,
                "remapping": state.remapping,
            }
            for state in record.walk()
            if state.input_keys or state.output_keys or state.remapping
        },
    }


def standalone(run: dict[str, Any], title: str) -> str:
    """Return one HTML file that shows a run without a server or network.

    Args:
        run: The data of the run, as the server would send it.
        title: Title of the page.
    """
    style = theme_css() + (WEB / "page.css").read_text(encoding="utf-8")
    for font in ("inter", "jetbrains-mono"):
        data = base64.b64encode((WEB / f"{font}.woff2").read_bytes()).decode()
        style = style.replace(f"/{font}.woff2", f"data:font/woff2;base64,{data}")
    # In a script, only these two would be read by the parser of HTML.
    code = (WEB / "page.js").read_text(encoding="utf-8")
    code = code.replace("</script", "<\\/script").replace("<!--", "<\\!--")
    digest = base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()
    parts = [
        f'<meta http-equiv="Content-Security-Policy" content="{_FILE_POLICY.format(digest)}">',
        f"<style>{style}</style>",
        *(_packed_worker(name, (WEB / f"{name}-worker.js").read_bytes()) for name in WORKERS),
        _packed("run", json.dumps(run).encode()),
        f'<script type="module">{code}</script>',
    ]
    text = (WEB / "index.html").read_text(encoding="utf-8")
    text = text.replace("<title>smachpy</title>", f"<title>{html_text(title)}</title>")
    return text.replace("<!-- head -->", "\n".join(parts))


_FILE_POLICY = (
    "default-src 'none'; script-src 'sha256-{}' blob:; worker-src blob:; "
    "style-src 'unsafe-inline'; font-src data:; img-src data: blob:; "
    "connect-src data: blob:; base-uri 'none'; form-action 'none'"
)
"""Content security policy of a page in one file; its workers have `blob:` addresses."""


def _packed(name: str, content: bytes) -> str:
    """A block of data in a page: gzip as base64, which cannot contain `</script>`."""
    data = base64.b64encode(gzip.compress(content, mtime=0)).decode()  # the same bytes each time
    return f'<script type="application/octet-stream" id="{name}-data">{data}</script>'


_packed_worker = lru_cache(maxsize=len(WORKERS))(_packed)  # the same in each file
