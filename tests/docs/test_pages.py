"""What the README and the docs say is executed: a page is one program.

Blocks marked `python` run in order in one namespace; `console` blocks run their `$ ` lines and
their output must hold the lines shown (`...` stands for anything). An HTML comment before a block:

- `<!-- file: NAME -->`  the block is written to that file in the page's working directory
- `<!-- exit: N -->`     the last command of the block ends with this code
- `<!-- shown: WHY -->`  the block is only shown (it needs something a test cannot have)

The ports 174xx of a page are others in each run: what listens there may not meet another run's.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import pytest

from actionlib_core import node
from tests.free_port import free_port

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
# Pages that start many processes or drive the robot for long. `.ci/installed` tries README.md and the tutorial with the wheel.
SLOW = {
    "README.md",
    "tutorial.md",
    "lessons.md",
    "demo_action.md",
    "demo_service.md",
    "rp_action.md",
    "running_missions.md",
    "there_and_back.md",
    "countdown.md",
    "patrol.md",
    "delivery.md",
    "explore.md",
    "guided_recovery.md",
}
MARKED = [
    pytest.param(page, marks=[pytest.mark.slow, pytest.mark.timeout(900)])
    if page.name in SLOW
    else page
    for page in PAGES
]
FENCE = re.compile(
    r"(?:<!-- (?P<directive>file|exit|shown): (?P<value>.*?) -->\n+)?"
    r"^```(?P<language>\w+)[^\n]*\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
COMMAND_S = 250


@dataclass(frozen=True)
class Block:
    language: str
    text: str
    line: int
    directive: str
    value: str


def blocks_of(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    for port in set(re.findall(r"127\.0\.0\.1:(174\d\d)\b", text)):
        text = text.replace(f"127.0.0.1:{port}", f"127.0.0.1:{free_port()}")
    return [
        Block(
            match["language"],
            match["text"],
            text.count("\n", 0, match.start("text")) + 1,
            match["directive"] or "",
            match["value"] or "",
        )
        for match in FENCE.finditer(text)
    ]


def run_python(page: Path, block: Block, namespace: dict) -> None:
    code = compile("\n" * (block.line - 1) + block.text, str(page), "exec", dont_inherit=True)
    exec(code, namespace)


def run_console(page: Path, block: Block, directory: Path, groups: list[int]) -> None:
    parts = re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "COLUMNS": "100",
    }
    for number, part in enumerate(parts, 1):
        command, _, shown = part.partition("\n")
        shell = subprocess.Popen(
            command,
            shell=True,
            cwd=directory,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
        groups.append(shell.pid)
        output = "".join(shell.communicate(timeout=COMMAND_S))
        wanted = int(block.value) if block.directive == "exit" and number == len(parts) else 0
        where = f"{page.name}:{block.line}: $ {command}"
        assert shell.returncode == wanted, f"{where}\nexit code {shell.returncode}\n{output}"
        check_output(where, shown, output)


def check_output(where: str, shown: str, output: str) -> None:
    """Every line shown must be in the output, in this order; blanks are folded."""
    lines = iter([" ".join(line.split()) for line in output.splitlines()])
    for line in shown.splitlines():
        folded = " ".join(line.split())
        if not folded or folded == "...":
            continue
        pattern = ".*".join(re.escape(piece) for piece in folded.split("..."))
        assert any(re.fullmatch(pattern, real) for real in lines), (
            f"{where}\nnot printed (in this order): {line}\n--- printed:\n{output}"
        )


@pytest.fixture
def fresh_program(monkeypatch):
    """No default node from before, none left after."""
    default = node._Default()
    monkeypatch.setattr(node, "_default", default)
    yield
    if default._node is not None:
        default._node.close()


@pytest.fixture
def own_modules(tmp_path, monkeypatch):
    """A page imports the files that it writes, also where another test had some of these names."""
    monkeypatch.syspath_prepend(str(tmp_path))
    forget_modules(tmp_path.parent)
    yield
    forget_modules(tmp_path)


def forget_modules(folder):
    inside = os.path.join(folder, "")
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None)).startswith(inside):
            del sys.modules[name]


@pytest.fixture
def groups():
    """The process groups of a page's commands; what still runs in them when it failed is ended."""
    started = []
    yield started
    for group in started:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(group, signal.SIGKILL)


@pytest.mark.zenoh
@pytest.mark.parametrize("page", MARKED, ids=lambda page: str(page.relative_to(ROOT)))
@pytest.mark.usefixtures("fresh_program", "own_modules")
def test_page(page, tmp_path, monkeypatch, groups):
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "page"}
    for block in blocks_of(page):
        if block.directive == "shown":
            continue
        if block.directive == "file":
            target = tmp_path / block.value
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.text, encoding="utf-8")
        elif block.language == "python":
            run_python(page, block, namespace)
        elif block.language == "console":
            run_console(page, block, tmp_path, groups)


def links_of(page: Path) -> set[str]:
    """Return the page's links to other files and to headings."""
    return set(
        re.findall(r"\]\((?!https?:|mailto:)([^)\s]+)\)", FENCE.sub("", page.read_text("utf-8")))
    )


def anchors_of(page: Path) -> set[str]:
    """Return the anchors of the page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", FENCE.sub("", page.read_text("utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize(
    "page",
    [*PAGES, ROOT / "missions" / "README.md", ROOT / "CHANGELOG.md"],
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_every_link_leads_to_a_file_and_a_heading(page):
    broken = []
    for link in links_of(page):
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.exists() or (anchor and anchor not in anchors_of(target)):
            broken.append(link)
    assert not broken


def test_the_index_leads_to_every_page():
    index = ROOT / "docs" / "README.md"
    lists = [index, ROOT / "docs" / "decisions.md"]
    linked = {(page.parent / link).resolve() for page in lists for link in links_of(page)}
    assert set((ROOT / "docs").rglob("*.md")) - {index} <= linked


def test_the_files_that_the_architecture_names_are_there():
    text = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    named = set(re.findall(r"`(\w+/[\w/]+\.py)`", text))
    roots = (ROOT, ROOT / "actionlib_core")
    assert len(named) > 10
    assert not [name for name in named if not any((root / name).exists() for root in roots)]


def test_the_configuration_page_lists_every_environment_variable():
    packages = ("actionlib_core", "smachpy", "viz", "missions")
    files = [file for name in packages for file in (ROOT / name).rglob("*.py")]
    used = {word for file in files for word in re.findall(r"SMACHPY_[A-Z0-9_]+", file.read_text())}
    page = (ROOT / "docs" / "configuration.md").read_text("utf-8")
    listed = page[page.index("## Environment variables") :]
    assert used == set(re.findall(r"`(SMACHPY_[A-Z0-9_]+)`", listed))


def test_the_changelog_lists_each_change_once_and_each_subject_once_in_its_section():
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    for release in re.split(r"(?m)^## ", text)[1:]:
        entries = re.findall(r"(?ms)^- .*?(?=\n- |\n\n|\n#|\n[A-Z]|\Z)", release)
        assert [one for one, times in Counter(entries).items() if times > 1] == []
        for section in re.split(r"(?m)^### ", release)[1:]:
            subjects = re.findall(r"(?m)^[A-Z][\w, ]+$", section.partition("\n")[2])
            assert [one for one, times in Counter(subjects).items() if times > 1] == []
