from __future__ import annotations

import subprocess
import sys

import pytest

from smachpy_viz.pictures import graphviz_process

TEXT = 'digraph { a -> b [id=e]; a [label="x y"] }'
SLOW = "import time; time.sleep(60)"


@pytest.fixture
def script(tmp_path, monkeypatch):
    """`script(code)` makes a program of Python code the `dot` program."""

    def make(code):
        program = tmp_path / "dot"
        program.write_text(f"#!{sys.executable}\n{code}\n")
        program.chmod(0o755)
        monkeypatch.setenv(graphviz_process.DOT_VARIABLE, str(program))

    return make


@pytest.mark.usefixtures("any_dot")
def test_one_process_lays_out_batch_after_batch():
    def work(run):
        first = run([TEXT, TEXT])
        return [*first, *run([TEXT])]

    results = graphviz_process.lay_out(work)
    assert len(results) == 3
    assert all("pos" in result["edges"][0] for result in results)


@pytest.mark.usefixtures("any_dot")
@pytest.mark.parametrize(
    ("form", "start"), [("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")]
)
def test_every_format_can_be_drawn(form, start):
    text = 'digraph { a [pos="10,50"]; b [pos="10,0"]; a -> b [pos="e,10,20 10,40 10,35 10,30 10,25"] }'
    assert graphviz_process.draw(text, form, dots_per_inch=100).startswith(start)


@pytest.mark.usefixtures("any_dot")
def test_many_pages_come_from_one_call():
    text = 'digraph { a [pos="10,50"] }'
    pages = graphviz_process.draw_pages([text] * 3)
    assert len(pages) == 3
    assert all(page.rstrip().endswith(b"</svg>") for page in pages)


@pytest.mark.usefixtures("any_dot")
def test_a_large_batch_fills_no_pipe():
    texts = [f'digraph {{ a [tooltip="{"x" * 5000}"] }}'] * 300
    assert len(graphviz_process.lay_out(lambda run: run(texts))) == 300


@pytest.mark.usefixtures("any_dot")
def test_a_mistake_in_the_text_is_told():
    with pytest.raises(graphviz_process.EngineError, match="exit code"):
        graphviz_process.draw("digraph { a -> }", "svg")
    with pytest.raises(graphviz_process.EngineError, match="exit code"):
        graphviz_process.lay_out(lambda run: run(["digraph { a -> }"]))


def test_the_environment_names_the_program(script):
    script("import sys; sys.stdout.write('<?xml drawn')")
    assert graphviz_process.draw(TEXT, "svg") == b"<?xml drawn"


def test_a_wrong_name_in_the_environment_is_told(monkeypatch):
    monkeypatch.setenv(graphviz_process.DOT_VARIABLE, "/no/such/dot")
    with pytest.raises(graphviz_process.EngineError, match=r"SMACHPY_DOT: got '/no/such/dot'"):
        graphviz_process.find_dot()


def test_without_any_program_both_remedies_are_named(monkeypatch, tmp_path):
    monkeypatch.delenv(graphviz_process.DOT_VARIABLE, raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(graphviz_process.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(
        graphviz_process.EngineError, match=r"pip install.*apt-get install graphviz"
    ):
        graphviz_process.find_dot()


@pytest.mark.slow
def test_a_layout_that_never_ends_is_tried_cheaper_and_given_up(monkeypatch, tmp_path):
    program = tmp_path / "dot"
    program.write_text("#!/bin/sh\nexec sleep 600\n")
    program.chmod(0o755)
    commands, start = [], subprocess.Popen

    def started(command, **options):
        commands.append(command)
        return start(command, **options)

    monkeypatch.setattr(subprocess, "Popen", started)
    monkeypatch.setenv(graphviz_process.DOT_VARIABLE, str(program))
    monkeypatch.setattr(graphviz_process, "TIME_LIMIT", 0.2)
    with pytest.raises(graphviz_process.EngineError, match="twice"):
        graphviz_process.lay_out(lambda run: run([TEXT]))
    assert ["nslimit" in " ".join(command) for command in commands] == [False, True]


def test_a_picture_that_never_ends_is_given_up(script, monkeypatch):
    script(SLOW)
    monkeypatch.setattr(graphviz_process, "TIME_LIMIT", 0.2)
    with pytest.raises(graphviz_process.EngineError, match="--depth"):
        graphviz_process.draw(TEXT, "svg")


def test_a_crash_is_told_with_what_the_program_said(script):
    script("import sys; sys.stderr.write('out of luck'); sys.exit(7)")
    with pytest.raises(graphviz_process.EngineError, match=r"exit code 7; it said: out of luck"):
        graphviz_process.lay_out(lambda run: run([TEXT]))
    with pytest.raises(graphviz_process.EngineError, match=r"exit code 7; it said: out of luck"):
        graphviz_process.draw(TEXT, "svg")


def test_only_the_text_that_makes_dot_crash_is_lost(script):
    script(
        "import os, sys\n"
        "for line in sys.stdin:\n"
        "    if 'bad' in line: os.kill(os.getpid(), 11)\n"
        "    if line.startswith('//'): print('{\\n}', flush=True)\n"
    )
    texts = ["good", "bad", "good", "good", "bad"]
    assert graphviz_process.lay_out(lambda run: run(texts)) == [{}, None, {}, {}, None]


def test_a_program_that_cannot_be_started_is_told(tmp_path, monkeypatch):
    program = tmp_path / "dot"
    program.write_bytes(b"\x7fELF nonsense")
    program.chmod(0o755)
    monkeypatch.setenv(graphviz_process.DOT_VARIABLE, str(program))
    with pytest.raises(graphviz_process.EngineError, match="cannot be started"):
        graphviz_process.lay_out(lambda run: run([TEXT]))
    with pytest.raises(graphviz_process.EngineError, match="cannot be started"):
        graphviz_process.draw(TEXT, "svg")


@pytest.mark.usefixtures("any_dot")
def test_without_any_font_on_the_system_text_has_its_size(tmp_path, monkeypatch):
    def width():
        font = 'fontname="Liberation Sans"'
        text = f'digraph {{ graph [{font}]; a [{font},label="MISSION", margin=0] }}'
        (result,) = graphviz_process.lay_out(lambda run: run([text]))
        return float(result["objects"][0]["width"])

    usual = width()
    empty = tmp_path / "fonts.conf"
    empty.write_text('<?xml version="1.0"?><fontconfig><dir>/nowhere</dir></fontconfig>')
    monkeypatch.setenv("FONTCONFIG_FILE", str(empty))
    assert width() == pytest.approx(usual, rel=0.01)


def test_the_bundled_program_answers_like_dot(tmp_path):
    pytest.importorskip("pygraphviz", exc_type=ImportError)  # without its libraries, too
    command = [sys.executable, "-m", "smachpy_viz.pictures.bundled_dot"]
    version = subprocess.run([*command, "-V"], capture_output=True, check=True)
    assert b"graphviz version" in version.stderr
    source, target = tmp_path / "in.gv", tmp_path / "out.svg"
    source.write_text(TEXT)
    subprocess.run([*command, "-Tsvg", f"-o{target}", "-Gbgcolor=red", source], check=True)
    assert "<svg" in target.read_text()
    assert 'fill="red"' in target.read_text()
    whole = subprocess.run([*command, "-Tplain"], input=TEXT.encode(), capture_output=True)
    assert whole.stdout.startswith(b"graph ")
