"""Errors point to their section of the page of errors, which says what to do."""

from __future__ import annotations

import copy
import json
import pickle
import re
import subprocess
import sys
import traceback

import pytest

from actionlib_core.cli import main as actionlib
from actionlib_core.exceptions import ERRORS_PAGE, WaitTimeoutError
from smachpy.command import main as smachpy
from smachpy.exceptions import MissionError
from tests.places import ROOT


class OwnError(MissionError):
    """An error of a user."""


@pytest.mark.parametrize(
    ("error", "anchor"),
    [
        (MissionError("no map"), "missionerror"),
        (WaitTimeoutError("no server"), "waittimeouterror"),
        (OwnError("no map"), "missionerror"),
    ],
)
def test_a_traceback_ends_with_the_address_of_the_nearest_error_of_ours(error, anchor):
    lines = "".join(traceback.format_exception(error)).splitlines()
    assert lines[-1] == f"More: {ERRORS_PAGE}#{anchor}"


def test_the_text_of_an_error_is_without_the_address():
    assert str(MissionError("no map")) == "no map"


@pytest.mark.parametrize("copied", [copy.copy, lambda error: pickle.loads(pickle.dumps(error))])
def test_a_copied_error_keeps_its_notes_and_has_one_address(copied):
    error = MissionError("no map")
    error.add_note("at the door")
    assert copied(error).__notes__ == [f"More: {ERRORS_PAGE}#missionerror", "at the door"]


@pytest.mark.parametrize(
    ("main", "words", "anchor"),
    [
        (smachpy, ["run", "no_such_mission"], "targeterror"),
        (actionlib, ["interface", "show", "no_pkg/Type"], "unknowntypeerror"),
    ],
)
def test_an_error_of_a_command_ends_with_the_address(main, words, anchor, capsys):
    assert main(words) == 2
    assert capsys.readouterr().err.splitlines()[-1] == f"More: {ERRORS_PAGE}#{anchor}"


def test_a_wrong_use_of_a_command_has_no_address(capsys):
    assert smachpy(["new", "no/name"]) == 2
    assert ERRORS_PAGE not in capsys.readouterr().err


LIST = """
import inspect, json, sys
from importlib.machinery import SourceFileLoader
site = SourceFileLoader("site_of_docs", ".ci/site").load_module()
print(json.dumps([(kind.__name__, inspect.getdoc(kind)) for kind in site.documented_errors()]))
"""


@pytest.mark.slow
def test_every_error_has_a_section_of_its_own_with_a_way_out():
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", LIST],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    errors = json.loads(done.stdout)
    assert len(errors) > 80
    assert len({name.lower() for name, _ in errors}) == len(errors)
    assert [name for name, doc in errors if not re.search(r"^Try: .*\.$", doc, re.M | re.S)] == []
