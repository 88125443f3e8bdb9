"""What the page on deployment and the workflows show is held against the programs that read it."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from smachpy.command import full_parser
from tests.places import DOCS, ROOT

PAGE = (DOCS / "howto" / "deploy.md").read_text("utf-8")
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
CLAIMED = re.findall(r'Python :: (3\.\d+)"', (ROOT / "pyproject.toml").read_text("utf-8"))


def block(language):
    (found,) = re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return found


def accepted(words):
    """Return what `smachpy` makes of a command; it exits if it does not know a word."""
    assert Path(words[0]).name == "smachpy"
    return full_parser().parse_args(words[1:])


def test_the_commands_of_the_unit_and_of_the_container_are_understood():
    (command,) = re.findall(r"^ExecStart=(.*)$", block("ini"), re.MULTILINE)
    (words,) = re.findall(r"^CMD (.*)$", block("dockerfile"), re.MULTILINE)
    for given in (shlex.split(command), json.loads(words)):
        args = accepted(given)
        assert (args.target, args.plain) == ("patrol.py", True)
        assert args.durable is not None


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd is not here")
def test_systemd_accepts_the_unit(tmp_path):
    unit = tmp_path / "mission.service"
    program = Path(sys.executable).with_name("smachpy")
    here = block("ini").replace("/opt/robot/venv/bin/smachpy", str(program))
    unit.write_text(here.replace("User=robot\n", ""))  # who is not a user of this computer
    done = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True)
    ours = [line for line in done.stderr.splitlines() if "mission" in line]
    assert (done.returncode, ours) == (0, [])
    unit.write_text(unit.read_text().replace("KillMode=mixed", "KillMode=gently"))
    done = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True)
    assert "kill mode" in done.stderr  # so it does read the unit


def test_the_container_file_uses_a_supported_python_and_known_instructions():
    lines = block("dockerfile").splitlines()
    known = {"FROM", "RUN", "WORKDIR", "COPY", "USER", "STOPSIGNAL", "CMD"}
    assert {line.split()[0] for line in lines} <= known
    assert lines[0].startswith("FROM ")
    assert re.search(r"python:(3\.\d+)", lines[0])[1] in CLAIMED


def steps(workflow):
    for job in YAML(typ="safe").load(workflow)["jobs"].values():
        yield from job["steps"]


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_runs_scripts_and_targets_that_are_there(workflow):
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    commands = [step["run"] for step in steps(workflow) if "run" in step]
    uses = [step["uses"] for step in steps(workflow) if "uses" in step]
    assert commands
    for command in commands:
        for made in re.findall(r"\bmake ([\w -]+)", command):
            assert set(made.split()) <= targets
        for script in re.findall(r"(?<![\w/])\.ci/[\w-]+", command):
            assert (ROOT / script).stat().st_mode & 0o111, f"{script} cannot be executed"
    assert [
        one for one in uses if not re.fullmatch(r"[\w-]+/[\w-]+@(v\d+|release/v\d+)", one)
    ] == []


@pytest.mark.parametrize(("tag", "code"), [("v0.1.0", 0), ("v0.1", 1), ("v99.0.0", 1)])
def test_a_tag_is_published_only_if_the_changelog_has_a_dated_section_for_it(tag, code):
    release = steps(ROOT / ".github" / "workflows" / "release.yml")
    (dated,) = [one["run"] for one in release if "CHANGELOG.md" in one.get("run", "")]
    done = subprocess.run(
        dated, shell=True, cwd=ROOT, env={"GITHUB_REF_NAME": tag, "PATH": os.environ["PATH"]}
    )
    assert done.returncode == code


def test_the_workflows_try_the_versions_of_python_that_are_claimed():
    matrix = YAML(typ="safe").load(ROOT / ".github" / "workflows" / "release.yml")
    assert matrix["jobs"]["installed"]["strategy"]["matrix"]["python"] == CLAIMED
    (setup,) = [
        step["with"]["python-version"].split()
        for step in steps(ROOT / ".github" / "workflows" / "ci.yml")
        if "setup-python" in step.get("uses", "")
    ]
    assert sorted(setup) == CLAIMED


def test_the_claimed_versions_include_the_lowest_one():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["requires-python"] == f">={CLAIMED[0]}"
