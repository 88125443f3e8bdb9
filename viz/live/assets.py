"""The files and data of the page, for the server or for a page in one file."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
from dataclasses import asdict
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viz.model.extract import extract
from viz.pictures.theme import THEMES, Theme

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.introspection import StateRecord
    from viz.model.machine import Node

# The files that are served are listed once, when this module is imported: a name in a request is
# only compared with that list, so it cannot lead to any other file.
WEB = Path(__file__).resolve().parent.parent / "web"
ALL_LEVELS = 1_000_000  # the page opens and closes containers itself

ROOMS = ("core", "drawing", "panels")
"""Folders of the page's modules; each imports only from itself and those before it."""


def _files(folder: str) -> list[str]:
    return [f"{folder}/{path.name}" for path in sorted((WEB / folder).iterdir())]


SCRIPTS = [*(name for room in ROOMS for name in _files(f"js/{room}")), "js/app.js"]
VENDOR = _files("vendor")
FILES = frozenset(["app.css", *SCRIPTS, *VENDOR])
"""The files that are served; the others in the folder are for development."""

MODULES = {
    "preact": "vendor/preact.js",
    "preact/hooks": "vendor/preact-hooks.js",
    "htm": "vendor/htm.js",
    "@preact/signals-core": "vendor/signals-core.js",
    "@preact/signals": "vendor/signals.js",
    "uplot": "vendor/uplot.js",
    "gifenc": "vendor/gifenc.js",
    **{f"#{name.removeprefix('js/')}": name for name in SCRIPTS},
}
"""Import map: the same module names in the served page, in a page in one file and in Node."""

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


def import_map() -> str:
    """Return the import map of the served page."""
    return json.dumps({"imports": {name: f"/{path}" for name, path in MODULES.items()}})


def index() -> str:
    """Return the served page."""
    text = (WEB / "index.html").read_text(encoding="utf-8")
    head = (
        '<link rel="stylesheet" href="/theme.css"><link rel="stylesheet" href="/vendor/uplot.css">'
        '<link rel="stylesheet" href="/app.css">'
        f'<script type="importmap">{import_map()}</script>'
        '<script type="module" src="/js/app.js"></script>'
    )
    return text.replace("<!-- head -->", head)


def script_hash() -> str:
    """Return the hash by which the content security policy allows the import map, inline."""
    digest = hashlib.sha256(import_map().encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


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
    style = theme_css() + "".join(
        (WEB / name).read_text(encoding="utf-8") for name in ("vendor/uplot.css", "app.css")
    )
    for font in ("inter", "jetbrains-mono"):
        data = base64.b64encode((WEB / "vendor" / f"{font}.woff2").read_bytes()).decode()
        style = style.replace(f"/vendor/{font}.woff2", f"data:font/woff2;base64,{data}")
    # Modules cannot be imported from file: URLs, but from data: URLs in an import map.
    modules = {name: _data_url((WEB / path).read_bytes()) for name, path in MODULES.items()}
    layouter = (WEB / "vendor" / "elk-worker.min.js").read_bytes()
    parts = [
        f"<style>{style}</style>",
        f'<script type="importmap">{json.dumps({"imports": modules})}</script>',
        _packed("elk", layouter),
        _packed("run", json.dumps(run).encode()),
        '<script type="module">import "#app.js";</script>',
    ]
    text = (WEB / "index.html").read_text(encoding="utf-8")
    text = text.replace("<title>smachpy</title>", f"<title>{html.escape(title)}</title>")
    return text.replace("<!-- head -->", "\n".join(parts))


def _data_url(content: bytes) -> str:
    return f"data:text/javascript;base64,{base64.b64encode(content).decode()}"


def _packed(name: str, content: bytes) -> str:
    """A block of data in a page: gzip as base64, which cannot contain `</script>`."""
    data = base64.b64encode(gzip.compress(content, mtime=0)).decode()  # the same bytes each time
    return f'<script type="application/octet-stream" id="{name}-data">{data}</script>'
